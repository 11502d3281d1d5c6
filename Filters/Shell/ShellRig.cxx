// SPDX-License-Identifier: BSD-3-Clause
// What a lens does to light is found from marks whose places are known: two on each ray, one near and one far (dissertation 7.3).
// The domes are made as the skin is: functions that are negative inside, on a lattice. Below the plate they are the skin itself,
// so whatever holds a skin holds them; above it they are spheres, whose distance needs no tree.
#include "ShellRig.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "LevelSetMesh.h"
#include "ShellMarks.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double wholeTurn = 6.283185307179586;

class DomeMaker {
public:
  DomeMaker(const ShellDesign& design, const BodySurface& body, double radiusMm, const std::vector<ShellMark>& marks)
    : design_(design), body_(body), marks_(marks), p_(design.Parameters()), radius_(radiusMm), plate_(design.PlateMm()),
      bump_(p_.marks == ShellParameters::MarkKind::Bumps ? 0.5 * p_.markMm : 0.0), box_(design.Bounds(ShellDesign::Part::Skin))
  {
    box_.max().z() = std::max(design.Camera().z() + radius_, plate_) + bump_;
    box_.min() -= Vector3d::Constant(2.3719 * p_.resolutionMm);
  }

  TriangleSurface Make(const CutCell* cell, const Progress& progress) const
  {
    LevelSet levelSet;
    levelSet.origin = box_.min();
    levelSet.cellMm = p_.resolutionMm;
    const Eigen::Array3d count = (box_.sizes() / p_.resolutionMm).array().ceil() + 3.0;
    if (count.maxCoeff() > 1e5)
      throw Error(Error::Kind::TooLarge, "the rig would be too many cells long; ask for a coarser ResolutionMm");
    levelSet.cells = count.cast<int>();
    levelSet.mayCross = [this, cell](const Eigen::Array3i& first) { return MayCross(first, cell); };
    levelSet.sample = [this, cell](const Eigen::Array3i& first, LevelSet::Values& values) { Sample(first, cell, values); };
    TriangleSurface surface = MeshLevelSet(levelSet, progress);
    DropCrumbs(surface, 2.0 * p_.resolutionMm);
    return surface;
  }

private:
  Vector3d NodeAt(const Eigen::Array3i& first, int i, int j, int k) const
  {
    return box_.min() + p_.resolutionMm * Vector3d(first.x() + i, first.y() + j, first.z() + k);
  }
  Vector3d MiddleOf(const Eigen::Array3i& first) const
  {
    return NodeAt(first, 0, 0, 0) + Vector3d::Constant(0.5 * LevelSet::blockCells * p_.resolutionMm);
  }
  // From the middle of a block to its corners, and a little.
  double Half() const { return (0.8661 * LevelSet::blockCells + 0.1) * p_.resolutionMm; }

  bool MayCross(const Eigen::Array3i& first, const CutCell* cell) const
  {
    const Vector3d middle = MiddleOf(first);
    const Vector3d half = Vector3d::Constant(0.5 * LevelSet::blockCells * p_.resolutionMm + p_.resolutionMm);
    if (cell && !cell->Reach().intersects({middle - half, middle + half}))
      return false;
    const double ball = (middle - design_.Camera()).norm() - radius_;
    if (ball < bump_ + Half() && ball > -p_.thicknessMm - Half())
      return true;
    return middle.z() - half.z() < plate_ && middle.z() + half.z() > 0.0 && body_.Distance(middle) < p_.flangeMm + Half();
  }

  void Sample(const Eigen::Array3i& first, const CutCell* cell, LevelSet::Values& values) const
  {
    const Vector3d middle = MiddleOf(first);
    const double ofBlock = body_.Distance(middle), half = Half();
    // The foot's own distances where it may have a surface; beyond it is enough to be on the right side of all of them.
    const bool isFoot = NodeAt(first, 0, 0, 0).z() < plate_ + 2.0 * p_.resolutionMm && ofBlock > -p_.thicknessMm - half &&
                        ofBlock < p_.flangeMm + half;
    std::vector<const ShellMark*> near;
    for (const ShellMark& mark : marks_)
      if ((mark.place - middle).norm() < half + p_.markMm + p_.thicknessMm + 4.0)
        near.push_back(&mark);
    std::size_t at = 0;
    for (int k = 0; k < LevelSet::blockNodes; ++k)
      for (int j = 0; j < LevelSet::blockNodes; ++j)
        for (int i = 0; i < LevelSet::blockNodes; ++i) {
          const Vector3d place = NodeAt(first, i, j, k);
          values[at++] = static_cast<float>(Value(place, isFoot ? body_.Distance(place) : ofBlock, near, cell));
        }
  }

  double Value(const Vector3d& place, double distance, const std::vector<const ShellMark*>& near, const CutCell* cell) const
  {
    const double ball = (place - design_.Camera()).norm() - radius_, under = plate_ - p_.flangeThicknessMm;
    const double outer = std::min(std::max(distance, place.z() - plate_), ball);
    const double inner = std::min(std::max(distance + p_.thicknessMm, place.z() - under), ball + p_.thicknessMm);
    double dome = std::max({outer, -inner, -place.z()});
    // The skin cut off at the plate, with its flange and its screws.
    dome = std::min(dome, std::max(design_.Skin(place, distance, {}), place.z() - plate_));
    dome = std::max(dome, -design_.ScrewHoles(place));
    for (const ShellMark* mark : near)
      if (bump_ > 0.0)
        dome = std::min(dome, std::max((place - mark->place).norm() - bump_, -ball - p_.thicknessMm));
    if (cell)
      dome = std::max(dome, cell->Within(place));
    for (const ShellMark* mark : near)
      if (bump_ == 0.0)
        dome = std::max(dome, -MarkRod(place, *mark, 0.5 * p_.markMm, -p_.thicknessMm - 2.0, 2.0));
    return dome;
  }

  const ShellDesign& design_;
  const BodySurface& body_;
  const std::vector<ShellMark>& marks_;
  const ShellParameters& p_;
  double radius_, plate_, bump_;
  Eigen::AlignedBox3d box_;
};

// The radius of the largest dome that stands on the plate within the body's outline.
double LargestDome(const ShellDesign& design, const BodySurface& body)
{
  const double plate = design.PlateMm(), above = plate - design.Camera().z();
  double least = 1e9;
  for (int i = 0; i < 360; ++i) {
    const double angle = wholeTurn * i / 360.0;
    const Vector3d away(std::cos(angle), std::sin(angle), 0.0);
    double radius = 0.0;
    for (int step = 0; step < 200; ++step)
      radius += std::max(0.0, -body.Distance(Vector3d(0.0, 0.0, plate) + radius * away) - 1.0);
    least = std::min(least, radius);
  }
  return std::sqrt(least * least + above * above);
}

double LeastGap(const std::vector<Vector3d>& places)
{
  double least = 1e9;
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      least = std::min(least, (places[i] - places[j]).norm());
  return least;
}

// Directions of as many marks as have room on a dome.
std::vector<Vector3d> Directions(int points, double radiusMm, double lowestDegrees, double gapMm)
{
  for (int count = points; count >= 20; count -= std::max(1, count / 50)) {
    const std::vector<Vector3d> directions = DomeMarks(count, 1.0, 3.0, lowestDegrees);
    if (radiusMm * LeastGap(directions) >= gapMm) {
      std::vector<Vector3d> ordered;
      for (const std::size_t which : OrderMarks(directions, Vector3d::UnitZ()))
        ordered.push_back(directions[which]);
      return ordered;
    }
  }
  throw Error(Error::Kind::InvalidParameter,
              Format("a dome of %.1f mm has no room for 20 marks that are %.1f mm apart; ask for a smaller MarkMm or a larger "
                     "dome, and for Points of at least 20",
                     radiusMm, gapMm));
}

} // namespace

ParameterList Describe(RigParameters& p)
{
  return {
      Parameter("LargeDomeMm", p.largeDomeMm, {0, 1000}, "mm",
                "Radius of the rig's large dome. 0: the largest that the base has room for.")
          .Advanced(),
      Parameter("SmallDomeMm", p.smallDomeMm, {0, 1000}, "mm", "Radius of the rig's small dome. 0: 0.6 of the large one.")
          .Advanced(),
  };
}

void RigParameters::Check() const
{
  CheckRanges(*this);
}

std::vector<PrintedPart> CalibrationRig::Prints() const
{
  std::vector<PrintedPart> prints;
  for (const Dome& dome : domes)
    if (dome.cut.empty())
      prints.push_back({dome.name, dome.part});
    else
      prints.insert(prints.end(), dome.cut.begin(), dome.cut.end());
  return prints;
}

std::string CalibrationRig::Text() const
{
  std::string text;
  for (const Dome& dome : domes) {
    text += dome.name + Format(", radius %.1f mm, %zu marks: ", dome.radiusMm, dome.marks.size()) + dome.part.Text() +
            ", closed, nothing inside out\n";
    for (const PrintedPart& printed : dome.cut)
      text += "  to print: " + printed.name + ", " + printed.part.Text() + "\n";
  }
  const Vector3d camera = bodyToCamera.inverse().translation();
  return text + Format("camera: at (%.3f, %.3f, %.3f) mm in the body's frame", camera.x(), camera.y(), camera.z());
}

CalibrationRig MakeRig(const BodySurface& given, const ShellParameters& parameters, const RigParameters& rig, int points,
                       const Progress& progress)
{
  parameters.Check();
  ShellParameters shell = parameters;
  shell.marker = false; // domes fit under every skin of the base; whether one has room for its marker is no matter of theirs
  rig.Check();
  CalibrationRig made;
  made.bodyToShell = BodyToShell(shell, given.Surface());
  const BodySurface body = MovedBody(given, made.bodyToShell, progress.Part(0.0, 0.1));
  const ShellDesign design(shell, body, {});
  const Vector3d camera = design.Camera();
  made.bodyToCamera = Pose(Eigen::Translation3d(-camera)) * made.bodyToShell;

  const double most = LargestDome(design, body);
  const double large = rig.largeDomeMm > 0.0 ? rig.largeDomeMm : most,
               small = rig.smallDomeMm > 0.0 ? rig.smallDomeMm : 0.6 * large;
  if (large > most)
    throw Error(Error::Kind::InvalidParameter,
                Format("LargeDomeMm is %g mm; the base has room for a dome of %.1f mm at most", large, most));
  if (small > 0.9 * large)
    throw Error(Error::Kind::InvalidParameter,
                Format("SmallDomeMm is %g mm; it must be at most 0.9 of the large dome, which is %.1f mm", small, large));
  const double lowest = design.PlateMm() - camera.z() + 0.5 * shell.markMm + 1.0;
  if (lowest > 0.7 * small)
    throw Error(Error::Kind::InvalidParameter,
                Format("a small dome (SmallDomeMm) of %.1f mm hardly reaches above the plate, which is %.1f mm above the camera",
                       small, design.PlateMm() - camera.z()));
  const std::vector<Vector3d> directions = Directions(points, small, std::asin(std::max(lowest, 0.0) / small) * 360.0 / wholeTurn,
                                                      shell.markMm + 2.0 * shell.resolutionMm + 0.5);

  const Pose back = made.bodyToShell.inverse();
  for (std::size_t which = 0; which < 2; ++which) {
    CalibrationRig::Dome& dome = made.domes[which];
    const auto part = [&progress, which](double from, double to) {
      return progress.Part(0.1 + 0.45 * (static_cast<double>(which) + from), 0.1 + 0.45 * (static_cast<double>(which) + to));
    };
    dome.name = which == 0 ? "large-dome" : "small-dome";
    dome.radiusMm = which == 0 ? large : small;
    std::vector<ShellMark> marks;
    for (const Vector3d& direction : directions)
      marks.push_back({camera + dome.radiusMm * direction, direction});
    const DomeMaker maker(design, body, dome.radiusMm, marks);
    dome.part.surface = maker.Make(nullptr, part(0.0, 0.4));
    for (const CutCell& cell : design.DomeCells()) {
      PrintedPart printed;
      printed.part.surface = maker.Make(&cell, part(0.4, 0.5));
      if (printed.part.surface.triangles.empty())
        continue;
      printed.name = dome.name + " " + std::to_string(dome.cut.size() + 1);
      dome.cut.push_back(std::move(printed));
    }
    FinishPart(dome.part, dome.name, back, shell.printerMm, part(0.5, 0.8));
    for (PrintedPart& printed : dome.cut)
      FinishPart(printed.part, printed.name, back, shell.printerMm, part(0.8, 1.0));
    for (const ShellMark& mark : marks)
      dome.marks.push_back({back * mark.place, back.linear() * mark.normal});
  }
  return made;
}

} // namespace echorama
