// SPDX-License-Identifier: BSD-3-Clause
// Each part is sampled in blocks of 8^3 cells that its surface may cross: those of OpenVDB's level set of the body, in which the
// wall lies, and what flange and base need beyond. OpenVDB tells which these are, and
// on which side a node is. Its distances are off by up to a third of a cell (it widens its band from triangle to neighbouring
// triangle), so those of nodes beside a surface come from the tree. Points of the mesh then move onto the surfaces themselves.
// Last, the parts are checked as any surface, and the wall is measured.
#include "Shell.h"
#include "BodyLevelSet.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "LevelSetMesh.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace echorama {
namespace {

using Eigen::Vector3d;
using ShellPartKind = ShellDesign::Part;

// What the printer's plate sees of a part: z is up.
void Measure(ShellPart& part, const Vector3d& printerMm)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& point : part.surface.points)
    box.extend(point.cast<double>());
  part.sizeMm = box.sizes();
  const Vector3d &size = part.sizeMm, turned(size.y(), size.x(), size.z());
  part.fits = (size.array() <= printerMm.array()).all() || (turned.array() <= printerMm.array()).all();
}

class ShellMaker {
public:
  ShellMaker(const ShellParameters& parameters, const BodySurface& body, const ShellDesign& design)
    : p_(parameters), body_(body), design_(design)
  {
    // A plane that lies in one of the lattice would give many values of 0; this shift is no round number.
    const Eigen::AlignedBox3d all = design.Bounds(ShellPartKind::Skin).merged(design.Bounds(ShellPartKind::Base));
    origin_ = all.min() - Vector3d::Constant(2.3719 * p_.resolutionMm);
    const double bump = p_.marks == ShellParameters::MarkKind::Bumps ? 0.5 * p_.markMm : 0.0;
    // The wall, and the base's lip beside it.
    inside_ = p_.thicknessMm + std::max(p_.thicknessMm + p_.clearanceMm + 2.0 * p_.resolutionMm, 3.0 * p_.resolutionMm);
    outside_ = bump + 3.0 * p_.resolutionMm;
    level_ = std::make_unique<BodyLevelSet>(body, origin_, p_.resolutionMm, inside_, outside_);
  }

  // All of a part, or what lies of it in a cell.
  TriangleSurface Make(ShellPartKind part, const CutCell* cell, const Progress& progress) const
  {
    LevelSet levelSet;
    const Eigen::AlignedBox3d bounds = design_.Bounds(part);
    levelSet.origin = origin_;
    levelSet.cellMm = p_.resolutionMm;
    const Eigen::Array3d count = ((bounds.max() - origin_) / p_.resolutionMm).array().ceil() + 3.0;
    if (count.maxCoeff() > 1e5)
      throw Error(Error::Kind::TooLarge,
                  Format("the shell would be %.0f cells long; ask for a coarser ResolutionMm", count.maxCoeff()));
    levelSet.cells = count.cast<int>();
    const bool isSkin = part == ShellPartKind::Skin;
    levelSet.mayCross = [this, isSkin, cell](const Eigen::Array3i& first) {
      if (cell && !cell->Reach().intersects({NodeAt(first, -1, -1, -1), NodeAt(first, edge + 1, edge + 1, edge + 1)}))
        return false;
      return MayCross(isSkin, first);
    };
    levelSet.sample = [this, isSkin, cell](const Eigen::Array3i& first, LevelSet::Values& values) {
      if (isSkin)
        SampleSkin(first, cell, values);
      else
        SampleBase(first, cell, values);
    };
    TriangleSurface surface = MeshLevelSet(levelSet, progress.Part(0.0, isSkin ? 0.7 : 1.0));
    DropCrumbs(surface, 2.0 * p_.resolutionMm);
    if (isSkin)
      MovePoints(
          surface, [this, cell](const Vector3d& point) { return design_.Refined(point, cell); }, progress.Part(0.7, 1.0));
    return surface;
  }

private:
  static constexpr int edge = LevelSet::blockCells;

  bool MayCross(bool isSkin, const Eigen::Array3i& first) const
  {
    const double width = edge * p_.resolutionMm, low = NodeAt(first, 0, 0, 0).z(), high = low + width;
    const auto reaches = [low, high, this](double from, double to) {
      return high > from - p_.resolutionMm && low < to + p_.resolutionMm;
    };
    if (!isSkin)
      return reaches(-p_.baseMm, 0.0) || level_->Touches(first);
    if (level_->Touches(first))
      return high > -p_.resolutionMm;
    if (p_.flangeMm <= 0.0 || !reaches(0.0, p_.flangeThicknessMm))
      return false;
    const Vector3d middle = NodeAt(first, 0, 0, 0) + Vector3d::Constant(0.5 * width);
    return level_->IsOutside(first) && body_.Distance(middle) - p_.flangeMm <= 0.8661 * width + 0.05 * p_.resolutionMm;
  }

  Vector3d NodeAt(const Eigen::Array3i& first, int i, int j, int k) const
  {
    return origin_ + p_.resolutionMm * Vector3d(first.x() + i, first.y() + j, first.z() + k);
  }

  // Calls function(place, distance, column) for all nodes of a block.
  template <class Function>
  void ForNodes(const Eigen::Array3i& first, LevelSet::Values& values, const Function& function) const
  {
    level_->Fill(first, values);
    std::size_t at = 0;
    for (int k = 0; k < LevelSet::blockNodes; ++k)
      for (int j = 0; j < LevelSet::blockNodes; ++j)
        for (int i = 0; i < LevelSet::blockNodes; ++i, ++at)
          values[at] = static_cast<float>(function(NodeAt(first, i, j, k), static_cast<double>(values[at]),
                                                   static_cast<std::size_t>(i + LevelSet::blockNodes * j)));
  }

  void SampleSkin(const Eigen::Array3i& first, const CutCell* cell, LevelSet::Values& values) const
  {
    const double half = 0.5 * LevelSet::blockCells * p_.resolutionMm, near = 2.0 * p_.resolutionMm,
                 above = p_.flangeThicknessMm + near;
    const auto marks = design_.MarksNear(NodeAt(first, 0, 0, 0) + Vector3d::Constant(half), 1.7321 * half);
    ForNodes(first, values, [&](const Vector3d& place, double distance, std::size_t) {
      // Beyond the wall the flange alone wants to know how far.
      const bool isNearWall = distance > -design_.DeepestAt(place, cell) - near && distance < near && place.z() > -near;
      if (isNearWall || (distance >= near && p_.flangeMm > 0.0 && std::abs(place.z()) < above))
        distance = body_.Distance(place);
      return design_.Skin(place, distance, marks, cell);
    });
  }

  void SampleBase(const Eigen::Array3i& first, const CutCell* cell, LevelSet::Values& values) const
  {
    // Distances in the plane of the opening, of each column. Where the level set says that it is far inside nobody asks how far.
    constexpr int nodes = LevelSet::blockNodes;
    std::array<double, nodes * nodes> feet;
    feet.fill(-inside_);
    const auto plane = static_cast<int>(std::floor(-origin_.z() / p_.resolutionMm));
    const Eigen::Array3i under(first.x(), first.y(), plane);
    level_->Fill(under, values);
    for (int j = 0; j < nodes; ++j)
      for (int i = 0; i < nodes; ++i) {
        const auto column = static_cast<std::size_t>(i + nodes * j);
        const float least = static_cast<float>(-0.999 * inside_);
        if (values[column] > least || values[column + nodes * nodes] > least) {
          const Vector3d node = NodeAt(first, i, j, 0);
          feet[column] = body_.Distance({node.x(), node.y(), 0.0});
        }
      }
    const double near = 2.0 * p_.resolutionMm, lip = p_.thicknessMm + p_.clearanceMm;
    ForNodes(first, values, [&](const Vector3d& place, double distance, std::size_t column) {
      if (p_.baffleMm > 0.0 && place.z() > -near && distance < near - lip && distance > -near - lip - p_.thicknessMm)
        distance = body_.Distance(place);
      return design_.Base(place, distance, feet[column], cell);
    });
  }

  const ShellParameters& p_;
  const BodySurface& body_;
  const ShellDesign& design_;
  Vector3d origin_;
  double inside_ = 0.0, outside_ = 0.0;
  std::unique_ptr<BodyLevelSet> level_;
};

// At 10^4 places, spread over the inner surface by area.
WallThickness MeasureWall(const TriangleSurface& skin, const ShellDesign& design, const BodySurface& body,
                          const Progress& progress)
{
  std::vector<double> areas(skin.triangles.size() + 1, 0.0);
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    const Vector3d p = skin.points[a].cast<double>();
    areas[t + 1] = areas[t] + (skin.points[b].cast<double>() - p).cross(skin.points[c].cast<double>() - p).norm();
  }
  constexpr int tries = 24000; // about half lie on the outside
  struct Sample {
    double depth = -1.0, wall = 0.0;
  };
  const ShellParameters& p = design.Parameters();
  std::vector<Sample> samples(tries);
  ParallelRanges(tries, 256, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      Random random(1, static_cast<std::uint64_t>(i));
      const double wanted = random.Uniform() * areas.back();
      const auto t = static_cast<std::size_t>(std::upper_bound(areas.begin() + 1, areas.end() - 1, wanted) - areas.begin()) - 1;
      double u = random.Uniform(), v = random.Uniform();
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const auto& [a, b, c] = skin.triangles[t];
      const Vector3d place =
          (1.0 - u - v) * skin.points[a].cast<double>() + u * skin.points[b].cast<double>() + v * skin.points[c].cast<double>();
      if (!design.IsPlainWall(place, p.resolutionMm))
        continue;
      const double distance = body.Distance(place);
      // Thin along a ray that grazes is thin to the surface: there the wall's own depth tells the inside from the outside.
      const double depth = design.Depth(place, distance);
      if (depth > 0.5 * p.thicknessMm)
        samples[static_cast<std::size_t>(i)] = {depth, -distance};
    }
  });
  WallThickness wall;
  wall.leastMm = wall.leastWallMm = std::numeric_limits<double>::max();
  for (const Sample& sample : samples)
    if (sample.depth >= 0.0) {
      ++wall.places;
      wall.leastMm = std::min(wall.leastMm, sample.depth);
      wall.mostMm = std::max(wall.mostMm, sample.depth);
      wall.meanMm += sample.depth;
      wall.leastWallMm = std::min(wall.leastWallMm, sample.wall);
    }
  if (wall.places > 0)
    wall.meanMm /= static_cast<double>(wall.places);
  return wall;
}

// What lies in each cell that is not empty.
void AddCut(Shell& shell, const ShellMaker& maker, const ShellDesign& design, ShellPartKind kind, const Progress& progress)
{
  const auto& cells = design.Cells(kind);
  int number = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto count = static_cast<double>(cells.size());
    PrintedPart printed;
    printed.part.surface =
        maker.Make(kind, &cells[i], progress.Part(static_cast<double>(i) / count, (static_cast<double>(i) + 1.0) / count));
    if (printed.part.surface.triangles.empty())
      continue;
    printed.name = (kind == ShellPartKind::Skin ? "skin " : "base ") + std::to_string(++number);
    shell.cut.push_back(std::move(printed));
  }
}

} // namespace

std::string ShellPart::Text() const
{
  return Format("%.1f x %.1f x %.1f mm, %lld triangles, %.1f cm^3%s", sizeMm.x(), sizeMm.y(), sizeMm.z(),
                static_cast<long long>(check.triangles), check.volumeMm3 / 1000.0, fits ? "" : "; the printer is smaller");
}

std::string Shell::Text() const
{
  std::string text = "skin: " + skin.Text() + ", closed, nothing inside out\n";
  text +=
      Format("  wall %.3f to %.3f mm, %.3f in the mean, at %zu places; %.3f mm to the nearest place of the surface at least\n",
             thickness.leastMm, thickness.mostMm, thickness.meanMm, thickness.places, thickness.leastWallMm);
  if (skin.check.cavities > 0)
    text += Format("  %lld closed rooms in it that the opening does not reach\n", static_cast<long long>(skin.check.cavities));
  text += "base: " + base.Text() + ", closed, nothing inside out\n";
  for (const PrintedPart& printed : cut)
    text += "  to print: " + printed.name + ", " + printed.part.Text() + "\n";
  if (markerId)
    text += Format("marker: %06X\n", *markerId);
  return text + Format("camera: at (%.3f, %.3f, %.3f) mm in the body's frame", camera.x(), camera.y(), camera.z());
}

BodySurface MovedBody(const BodySurface& body, const Pose& pose, const Progress& progress)
{
  TriangleSurface moved = body.Surface();
  for (Eigen::Vector3f& point : moved.points)
    point = (pose * point.cast<double>()).cast<float>();
  return BodySurface(std::move(moved), progress);
}

void FinishPart(ShellPart& part, const std::string& name, const Pose& back, const Vector3d& printerMm, const Progress& progress)
{
  Measure(part, printerMm);
  for (Eigen::Vector3f& point : part.surface.points)
    point = (back * point.cast<double>()).cast<float>();
  part.check = CheckSurface(part.surface, {}, progress);
  const std::string what = "the " + name;
  if (part.surface.triangles.empty())
    throw Error(Error::Kind::NotPossible, what + " is empty");
  if (!part.check.IsSound())
    throw Error(Error::Kind::NotPossible,
                what + " did not come out sound: " + part.check.Faults() + "; try another ResolutionMm");
  const std::int64_t pieces = part.check.components - part.check.cavities;
  if (pieces > 1)
    throw Error(Error::Kind::NotPossible, what + " falls into " + std::to_string(pieces) +
                                              " pieces: the body is in several, or the opening or the printer's size cuts it "
                                              "into them");
}

std::vector<PrintedPart> Shell::Prints() const
{
  std::vector<PrintedPart> prints;
  const auto add = [&](const ShellPart& whole, const std::string& name) {
    const std::size_t before = prints.size();
    for (const PrintedPart& printed : cut)
      if (printed.name.compare(0, name.size(), name) == 0)
        prints.push_back(printed);
    if (prints.size() == before)
      prints.push_back({name, whole});
  };
  add(skin, "skin");
  add(base, "base");
  return prints;
}

Shell MakeShell(const BodySurface& given, const ShellParameters& parameters, const std::vector<Vector3d>& marks,
                const Progress& progress)
{
  parameters.Check();
  Shell shell;
  shell.bodyToShell = BodyToShell(parameters, given.Surface());
  const BodySurface body = MovedBody(given, shell.bodyToShell, progress.Part(0.0, 0.15));

  std::vector<ShellMark> above;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (!marks[i].allFinite())
      throw Error(Error::Kind::BadInput, "calibration point " + std::to_string(i) + " is not finite");
    const BodySurface::Place place = body.PlaceOf(shell.bodyToShell * marks[i]);
    if (place.nearest.z() < LowestMark(parameters))
      continue;
    above.push_back({place.nearest, body.PlaceOf(place.nearest).away});
    shell.left.push_back(i);
  }
  if (parameters.marker)
    shell.markerId = MarkerIdOf(parameters, given.Surface());
  const ShellDesign design(parameters, body, above, shell.markerId.value_or(0));
  const ShellMaker maker(parameters, body, design);
  progress(0.35);
  shell.skin.surface = maker.Make(ShellPartKind::Skin, nullptr, progress.Part(0.35, 0.55));
  shell.thickness = MeasureWall(shell.skin.surface, design, body, progress.Part(0.55, 0.57));
  if (shell.thickness.places == 0)
    throw Error(Error::Kind::NotPossible,
                Format("the body is too thin: a wall of ThicknessMm, %g mm, leaves no room inside", parameters.thicknessMm));
  shell.base.surface = maker.Make(ShellPartKind::Base, nullptr, progress.Part(0.57, 0.62));
  AddCut(shell, maker, design, ShellPartKind::Skin, progress.Part(0.62, 0.75));
  AddCut(shell, maker, design, ShellPartKind::Base, progress.Part(0.75, 0.8));
  const Pose back = shell.bodyToShell.inverse();
  shell.camera = back * design.Camera();
  for (const ShellMark& mark : above)
    shell.marks.push_back({back * mark.place, back.linear() * mark.normal});
  FinishPart(shell.skin, "skin", back, parameters.printerMm, progress.Part(0.8, 0.88));
  FinishPart(shell.base, "base", back, parameters.printerMm, progress.Part(0.88, 0.9));
  for (std::size_t i = 0; i < shell.cut.size(); ++i) {
    const auto count = static_cast<double>(shell.cut.size());
    FinishPart(shell.cut[i].part, shell.cut[i].name, back, parameters.printerMm,
               progress.Part(0.9 + 0.1 * static_cast<double>(i) / count, 0.9 + 0.1 * (static_cast<double>(i) + 1.0) / count));
  }
  return shell;
}

void CheckPrinter(const std::vector<PrintedPart>& prints, const ShellParameters& parameters)
{
  const Vector3d& printer = parameters.printerMm;
  for (const auto& [name, part] : prints)
    if (!part.fits)
      throw Error(Error::Kind::NotPossible,
                  Format("the %s is %.1f x %.1f x %.1f mm and does not fit the printer (PrinterMm), which makes %g x %g x %g mm",
                         name.c_str(), part.sizeMm.x(), part.sizeMm.y(), part.sizeMm.z(), printer.x(), printer.y(), printer.z()) +
                      (parameters.cutToFit ? "" : "; CutToFit would cut it into parts"));
}

} // namespace echorama
