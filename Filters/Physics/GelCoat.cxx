// SPDX-License-Identifier: BSD-3-Clause
// All happens in the frame of the probe's last pose, where the space between probe and skin fits a box. Skin is a grid of
// distances, at rest and pressed. Afterwards a particle counts for the points around it with the spline that it had in the
// solver; a point lies in gel where they fill three tenths of what solids leave free there, so that a thin film counts as
// much as a thick one, cracks between particles are no air, and gel reaches a little way into the solids that it touches.
#include "GelCoat.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Filters/Tissue/TissueDistance.h"
#include <algorithm>
#include <cmath>
#include <memory>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double aroundMm = 12.0; // how far gel may flow beside the head
constexpr double highestCapMm = 60.0;
constexpr double longestWayMm = 300.0;
constexpr double bandCells = 4.0; // of distances; the solver asks within 2.7
constexpr int gelBeams = 48;

// The cap on the face: its height falls to 0 at its edge, as a paraboloid's does.
class Cap {
public:
  Cap(const ProbeShape& shape, const GelCoatParameters& p)
    : shape_(shape), middle_(0.5 * (shape.Low() + shape.High())), radii_(0.5 * p.coverage * (shape.High() - shape.Low()))
  {
    height_ = 2.0 * 1000.0 * p.amountMl / (Pi * radii_.prod());
    if (height_ > highestCapMm)
      throw Error(Error::Kind::InvalidParameter, "AmountMl: " + NumberText(p.amountMl) + " ml would stand " +
                                                     NumberText(std::round(height_)) + " mm high on the face; no more than " +
                                                     NumberText(highestCapMm) + " mm hold");
  }
  double Height() const { return height_; }
  bool Holds(const Vector3d& point) const
  {
    const double rim = 1.0 - (point.head<2>() - middle_).cwiseQuotient(radii_).squaredNorm();
    if (rim <= 0.0 || height_ <= 0.0)
      return false;
    const double distance = shape_.Distance(point);
    return distance > 0.0 && distance < height_ * rim && shape_.Slope(point).z() > 0.0; // not behind the head
  }

private:
  const ProbeShape& shape_;
  Eigen::Vector2d middle_, radii_;
  double height_ = 0.0;
};

// The space in which gel may be around a head, in the head's frame.
Eigen::AlignedBox3d BoxOf(const ProbeGeometry& geometry, const ProbeHead& head, const ProbeShape& shape, double before)
{
  double back = 0.0; // of the face at its edges
  for (const double fan : {-0.5, 0.5})
    for (const double sweep : {-0.5, 0.5})
      back = std::min(back, PointOf(geometry, {0.0, fan, sweep}).z());
  return {Vector3d(shape.Low().x() - aroundMm, shape.Low().y() - aroundMm, back - head.marginMm - aroundMm),
          Vector3d(shape.High().x() + aroundMm, shape.High().y() + aroundMm, before)};
}

// How far back along its axis a probe must start for all that is before it to be clear of tissue.
double WayFrom(const TissueSurface& tissue, const PlacedProbe& probe, const ProbeShape& shape, double before)
{
  const Pose toProbe = probe.probeToWorld.inverse();
  double nearest = before;
  for (const auto& corners : tissue.triangles) {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t corner : corners)
      box.extend(toProbe * tissue.points[corner].cast<double>());
    if (box.min().x() < shape.High().x() && box.max().x() > shape.Low().x() && box.min().y() < shape.High().y() &&
        box.max().y() > shape.Low().y())
      nearest = std::min(nearest, box.min().z());
  }
  if (before - nearest > longestWayMm)
    throw Error(Error::Kind::NotPossible, "the probe has no clear way to its first pose: tissue lies " +
                                              NumberText(std::round(-nearest)) + " mm behind the middle of its face");
  return before - nearest;
}

ImageGeometry GridOf(const GelDomain& domain, double spacing)
{
  ImageGeometry grid;
  grid.origin = domain.origin;
  grid.spacing.setConstant(spacing);
  for (std::size_t axis = 0; axis < 3; ++axis)
    grid.dimensions[axis] = static_cast<int>(std::lround(domain.cells[axis] * domain.cellMm / spacing)) + 1;
  return grid;
}

// The part of a quadratic B-spline, in cells, below x.
double SplineBelow(double x)
{
  const double a = std::abs(x);
  const double above = a >= 1.5 ? 0.0 : a >= 0.5 ? std::pow(1.5 - a, 3) / 6.0 : 0.5 - 0.75 * a + a * a * a / 3.0;
  return x > 0.0 ? 1.0 - above : above;
}

double Spline(double x)
{
  const double a = std::abs(x);
  return a >= 1.5 ? 0.0 : a >= 0.5 ? 0.5 * (1.5 - a) * (1.5 - a) : 0.75 - a * a;
}

// How much of every cell around a point particles fill.
std::vector<float> FilledOn(const ImageGeometry& grid, const GelSolver& solver)
{
  const double cell = solver.Domain().cellMm, perCell = 1.0 / (cell * cell * cell);
  std::vector<float> filled(grid.VoxelCount(), 0.0f);
  const auto rows = static_cast<std::size_t>(grid.dimensions[1]), row = static_cast<std::size_t>(grid.dimensions[0]);
  for (const GelParticle& particle : solver.Particles()) {
    std::array<int, 3> low{}, high{};
    std::array<std::array<double, 8>, 3> weights{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int n = static_cast<int>(axis);
      const double at = (particle.position[axis] - grid.origin[n]) / grid.spacing[n], reach = 1.5 * cell / grid.spacing[n];
      low[axis] = std::max(static_cast<int>(std::ceil(at - reach)), 0);
      high[axis] = std::min({static_cast<int>(std::floor(at + reach)), grid.dimensions[axis] - 1, low[axis] + 7});
      for (int i = low[axis]; i <= high[axis]; ++i)
        weights[axis][static_cast<std::size_t>(i - low[axis])] = Spline((i - at) * grid.spacing[n] / cell);
    }
    const double volume = particle.volume * particle.strain.J * perCell;
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j) {
        const double weight =
            volume * weights[2][static_cast<std::size_t>(k - low[2])] * weights[1][static_cast<std::size_t>(j - low[1])];
        float* at = filled.data() + (static_cast<std::size_t>(k) * rows + static_cast<std::size_t>(j)) * row;
        for (int i = low[0]; i <= high[0]; ++i)
          at[i] += static_cast<float>(weight * weights[0][static_cast<std::size_t>(i - low[0])]);
      }
  }
  return filled;
}

// Skin under the probe, in the frame of its last pose.
struct Skin {
  ImageGeometry grid;
  std::vector<float> rest, pressed; ///< distances; pressed is empty where it does not yield
  std::shared_ptr<const GelShape> atRest, yielding, atEnd;
};

// How far tissue moves at most; distances must be known that far for those between to be right.
double LongestWay(const TissueSurface& rest, const TissueSurface& pressed)
{
  double longest = 0.0;
  for (std::size_t n = 0; n < rest.points.size(); ++n)
    longest = std::max(longest, (pressed.points[n] - rest.points[n]).cast<double>().norm());
  return longest;
}

Skin SkinOf(const TissueSurface& rest, const TissueSurface* pressed, const GelDomain& domain, const Pose& frame,
            const Progress& progress)
{
  Skin skin;
  skin.grid = GridOf(domain, domain.cellMm);
  const ImageGeometry inWorld = skin.grid.Moved(frame);
  const double band = bandCells * domain.cellMm + (pressed ? LongestWay(rest, *pressed) : 0.0);
  skin.rest = DistancesOn(rest, inWorld, band, progress.Part(0.0, 0.5));
  skin.atRest = std::make_shared<const GelDistanceGrid>(skin.grid, skin.rest);
  skin.yielding = skin.atEnd = skin.atRest;
  if (pressed) {
    skin.pressed = DistancesOn(*pressed, inWorld, band, progress.Part(0.5, 1.0));
    skin.atEnd = std::make_shared<const GelDistanceGrid>(skin.grid, skin.pressed);
    skin.yielding = std::make_shared<const GelDistanceGrid>(skin.grid, skin.rest, skin.pressed);
  }
  return skin;
}

// A part of the probe's way.
struct Leg {
  Pose from, to;
  std::shared_ptr<const GelShape> skin;
  double seconds;
};

// Where on its straight way, 0 ... 1, a face first meets skin.
double Meeting(const ProbeGeometry& geometry, const GelShape& skin, const Pose& from, const Pose& to)
{
  constexpr int parts = 256, places = 17;
  const auto meets = [&](const Pose& pose) {
    for (int n = 0; n < places * places; ++n) {
      const BeamPoint at{0.0, n % places / (places - 1.0) - 0.5, n / places / (places - 1.0) - 0.5};
      if (skin.Distance(pose * PointOf(geometry, at), 0.0) < 0.0)
        return true;
    }
    return false;
  };
  int part = 0;
  while (part < parts && !meets(Interpolate(from, to, static_cast<double>(part) / parts)))
    ++part;
  return static_cast<double>(part) / parts;
}

// On the last leg tissue yields from when the face meets it.
std::vector<Leg> LegsOf(const std::vector<Pose>& way, const ProbeGeometry& geometry, const Eigen::AlignedBox3d& head,
                        const Skin& skin, const GelCoatParameters& parameters)
{
  std::vector<Leg> legs;
  const auto add = [&](const Pose& from, const Pose& to, const std::shared_ptr<const GelShape>& shape) {
    double longest = 0.0; // of the ways of the head's corners
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d point = head.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      longest = std::max(longest, (to * point - from * point).norm());
    }
    if (longest > 1e-6)
      legs.push_back({from, to, shape, longest / parameters.speedMmPerS});
  };
  for (std::size_t n = 1; n + 1 < way.size(); ++n)
    add(way[n - 1], way[n], skin.atRest);
  const Pose& last = way[way.size() - 2];
  const Pose meeting = Interpolate(last, way.back(), Meeting(geometry, *skin.atRest, last, way.back()));
  add(last, meeting, skin.atRest);
  add(meeting, way.back(), skin.yielding);
  if (parameters.settleS > 0.0)
    legs.push_back({way.back(), way.back(), skin.atEnd, parameters.settleS});
  return legs;
}

GelReport Run(GelSolver& solver, const std::vector<Leg>& legs, const std::shared_ptr<const GelShape>& head,
              const Progress& progress)
{
  GelReport sum;
  double all = 0.0, passed = 0.0;
  for (const Leg& leg : legs)
    all += leg.seconds;
  GelCollider skin, face;
  face.shape = head;
  for (const Leg& leg : legs) {
    if (solver.Particles().empty())
      break;
    skin.shape = leg.skin;
    face.begin = leg.from;
    face.end = leg.to;
    const GelReport report = solver.Advance(leg.seconds, {skin, face}, progress.Part(passed / all, (passed + leg.seconds) / all));
    passed += leg.seconds;
    sum.shortestStep = sum.steps == 0 ? report.shortestStep : std::min(sum.shortestStep, report.shortestStep);
    sum.largestSpeed = report.largestSpeed;
    sum.steps += report.steps;
    sum.particleSteps += report.particleSteps;
    sum.gone += report.gone;
    sum.torn += report.torn;
  }
  return sum;
}

// From what particles fill to what is positive in gel.
void MakeLevels(const ImageGeometry& grid, double cell, const GelShape& skin, const ProbeShape& head, std::vector<float>& levels)
{
  constexpr double share = 0.3, least = 0.02; // of what solids leave free, of a cell
  const Eigen::Affine3d toPoint = grid.IndexToWorld();
  const std::ptrdiff_t row = grid.dimensions[0], rows = grid.dimensions[1];
  ParallelFor(grid.dimensions[2], [&](std::ptrdiff_t k) {
    for (std::ptrdiff_t j = 0; j < rows; ++j)
      for (std::ptrdiff_t i = 0; i < row; ++i) {
        const Vector3d point = toPoint * Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        const double open = SplineBelow(skin.Distance(point, 0.0) / cell) + SplineBelow(head.Distance(point) / cell) - 1.0;
        float& level = levels[static_cast<std::size_t>((k * rows + j) * row + i)];
        const bool isBorder = i == 0 || j == 0 || k == 0 || i == row - 1 || j == rows - 1 || k == grid.dimensions[2] - 1;
        level = isBorder ? -1.0f : static_cast<float>(level - share * std::max(open, 0.0) - least); // surfaces are closed
      }
  });
}

// From the face along a beam to the skin, or to the end of space.
GelBeam Follow(const ProbeGeometry& geometry, BeamPoint at, double cell, const Eigen::AlignedBox3d& space, const GelShape& skin,
               const GelShape& levels)
{
  GelBeam beam;
  beam.start = PointOf(geometry, at);
  const double step = 0.125 * cell;
  for (at.depth = 0.5 * step; !beam.meetsSkin; at.depth += step) {
    const Vector3d point = PointOf(geometry, at);
    if (!space.contains(point))
      break;
    beam.meetsSkin = skin.Distance(point, 0.0) <= 0.0;
    if (!beam.meetsSkin)
      (levels.Distance(point, 0.0) > 0.0 ? beam.gelMm : beam.airMm) += step;
  }
  beam.couples = beam.meetsSkin && beam.airMm < 0.5 * cell;
  return beam;
}

} // namespace

ParameterList Describe(GelCoatParameters& p)
{
  return {
      Parameter("AmountMl", p.amountMl, {0.0, 1000.0}, "ml", "How much gel is put on the face of the probe."),
      Parameter("Coverage", p.coverage, {0.05, 1.0}, "",
                "Which part of the head's width and of its length the cap of gel covers at first."),
      Parameter("CellMm", p.cellMm, {0.1, 20.0}, "mm",
                "Edge of the cells that gel is computed with: thinner layers of air are not seen. Half of it takes sixteen times "
                "as long."),
      Parameter("SpeedMmPerS", p.speedMmPerS, {1.0, 1000.0}, "mm/s", "How fast the probe moves."),
      Parameter("SettleS", p.settleS, {0.0, 100.0}, "s", "How long gel goes on flowing when the probe has stopped."),
  };
}

GelCoat SpreadGel(const TissueSurface& rest, const TissueSurface* pressed, const std::vector<PlacedProbe>& probes,
                  const ProbeHead& head, const GelMaterial& material, const GelCoatParameters& parameters,
                  const Progress& progress)
{
  CheckRanges(parameters);
  rest.Check();
  if (pressed) {
    pressed->Check();
    if (pressed->points.size() != rest.points.size())
      throw Error(Error::Kind::BadInput, "the tissue that is pressed has " + NumberText(pressed->points.size()) +
                                             " points, at rest it has " + NumberText(rest.points.size()));
  }
  if (probes.empty())
    throw Error(Error::Kind::BadInput, "there is no probe that gel could be put on");
  for (const PlacedProbe& probe : probes)
    if (!(probe.geometry == probes.front().geometry))
      throw Error(Error::Kind::BadInput, "all poses must be of one probe, since the gel on its face goes with it");

  // The probe's way, and the box around it.
  const ProbeGeometry& geometry = probes.front().geometry;
  const ProbeShape shape(geometry, head);
  const Cap cap(shape, parameters);
  const double before = cap.Height() + 2.0 * parameters.cellMm;
  const Pose toFrame = probes.back().probeToWorld.inverse();
  std::vector<Pose> way;
  Pose start = probes.front().probeToWorld;
  start.translation() -= WayFrom(rest, probes.front(), shape, before) * start.linear().col(2);
  way.push_back(toFrame * start);
  for (const PlacedProbe& probe : probes)
    way.push_back(toFrame * probe.probeToWorld);

  const Eigen::AlignedBox3d headBox = BoxOf(geometry, head, shape, before + aroundMm);
  Eigen::AlignedBox3d box;
  for (const Pose& pose : way)
    for (int corner = 0; corner < 8; ++corner)
      box.extend(pose * headBox.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  GelDomain domain;
  domain.cellMm = parameters.cellMm;
  domain.origin = box.min();
  for (std::size_t axis = 0; axis < 3; ++axis)
    domain.cells[axis] = static_cast<int>(std::ceil(box.sizes()[static_cast<int>(axis)] / domain.cellMm));
  GelSolver solver(domain, material);
  const Pose& frame = probes.back().probeToWorld;
  const Skin skin = SkinOf(rest, pressed, domain, frame, progress.Part(0.0, 0.06));

  // The motion.
  const Pose fromStart = way.front().inverse();
  solver.Fill([&](const Vector3d& point) { return cap.Holds(fromStart * point); });
  GelCoat coat;
  coat.report = Run(solver, LegsOf(way, geometry, headBox, skin, parameters), std::make_shared<const GelProbe>(shape),
                    progress.Part(0.06, 0.97));
  coat.volumeMm3 = solver.Totals().volume;

  // What came of it.
  coat.grid = GridOf(domain, 0.5 * domain.cellMm);
  coat.level = FilledOn(coat.grid, solver);
  MakeLevels(coat.grid, domain.cellMm, *skin.atEnd, shape, coat.level);
  const GelDistanceGrid levels(coat.grid, coat.level);
  coat.beams = gelBeams;
  coat.planes = geometry.IsPlane() ? 1 : gelBeams;
  coat.face.resize(static_cast<std::size_t>(coat.beams * coat.planes));
  ParallelFor(coat.planes, [&](std::ptrdiff_t plane) {
    for (int n = 0; n < coat.beams; ++n) {
      const BeamPoint at{0.0, (n + 0.5) / coat.beams - 0.5, (static_cast<double>(plane) + 0.5) / coat.planes - 0.5};
      GelBeam& beam = coat.face[static_cast<std::size_t>(plane * coat.beams + n)];
      beam = Follow(geometry, at, domain.cellMm, box, *skin.atEnd, levels);
      beam.start = frame * beam.start;
    }
  });
  const auto coupled = std::count_if(coat.face.begin(), coat.face.end(), [](const GelBeam& beam) { return beam.couples; });
  coat.coupled = static_cast<double>(coupled) / static_cast<double>(coat.face.size());
  coat.grid = coat.grid.Moved(frame);
  return coat;
}

} // namespace echorama
