// SPDX-License-Identifier: BSD-3-Clause
// All happens in the frame of the probe as it starts. The domain grows with the way of the head, so what is far from there costs
// nothing; all gel is computed at all times, wherever it lies.
#include "GelMotion.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/NumberText.h"
#include "GelSkin.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double aroundMm = 12.0; // how far gel may flow beside the head
constexpr double highestCapMm = 60.0;
constexpr double longestWayMm = 300.0;
constexpr int wayParts = 256;    // in which a face meets skin, and leaves it
constexpr int turnParts = 8;     // of a way, for what the head sweeps
constexpr double gelCells = 4.0; // around gel where skin is known

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
  void Stretch(double factor) { height_ *= factor; }
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

// All that a box comes by.
Eigen::AlignedBox3d SweptBy(const Eigen::AlignedBox3d& box, const Pose& from, const Pose& to)
{
  Eigen::AlignedBox3d swept;
  for (int part = 0; part <= turnParts; ++part) {
    const Pose pose = Interpolate(from, to, static_cast<double>(part) / turnParts);
    for (int corner = 0; corner < 8; ++corner)
      swept.extend(pose * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return swept;
}

// How near the face comes to skin.
double Clearance(const ProbeGeometry& geometry, const GelShape& skin, const Pose& pose)
{
  constexpr int places = 17;
  double least = std::numeric_limits<double>::max();
  for (int n = 0; n < places * places; ++n) {
    const BeamPoint at{0.0, n % places / (places - 1.0) - 0.5, n / places / (places - 1.0) - 0.5};
    least = std::min(least, skin.Distance(pose * PointOf(geometry, at), 0.0));
  }
  return least;
}

// Where on its straight way, 0 ... 1, a face first meets skin; 1 where it does not.
double Meeting(const ProbeGeometry& geometry, const GelShape& skin, const Pose& from, const Pose& to)
{
  int part = 0;
  while (part < wayParts && Clearance(geometry, skin, Interpolate(from, to, static_cast<double>(part) / wayParts)) >= 0.0)
    ++part;
  return static_cast<double>(part) / wayParts;
}

} // namespace

struct GelMotion::State {
  State(const TissueSurface& tissue, const PlacedProbe& first, const ProbeHead& head, const GelMaterial& material,
        const GelCoatParameters& p);

  Eigen::AlignedBox3d SkinBox(const Eigen::AlignedBox3d& swept) const;
  void Advance(double seconds, const std::shared_ptr<const GelShape>& skin, const Pose& from, const Pose& to,
               const Progress& progress);
  void Move(const Pose& probeToWorld, double seconds, const TissueSurface* tissue, const Progress& progress);

  GelCoatParameters parameters;
  ProbeGeometry geometry;
  std::shared_ptr<const GelProbe> head;
  ProbeShape shape;
  Eigen::AlignedBox3d headBox;   // in the probe's frame
  Pose frame = Pose::Identity(); // to world
  Pose probe = Pose::Identity(); // to world
  std::optional<GelSolver> solver;
  std::optional<GelSkin> skin;
  double putOn = 0.0, seconds = 0.0;
  GelReport report;
};

GelMotion::State::State(const TissueSurface& tissue, const PlacedProbe& first, const ProbeHead& probeHead,
                        const GelMaterial& material, const GelCoatParameters& p)
  : parameters(p), geometry(first.geometry), shape(first.geometry, probeHead)
{
  CheckRanges(parameters);
  tissue.Check();
  head = std::make_shared<const GelProbe>(shape);
  Cap cap(shape, parameters);
  const double before = cap.Height() + 2.0 * parameters.cellMm;
  headBox = BoxOf(geometry, probeHead, shape, before + aroundMm);
  probe = first.probeToWorld;
  probe.translation() -= WayFrom(tissue, first, shape, before) * probe.linear().col(2);
  frame = probe;

  GelDomain domain;
  domain.cellMm = parameters.cellMm;
  domain.cells.fill(GelGrid::BlockSize);
  domain = domain.With(headBox);
  for (int round = 0; round < 5; ++round) { // on a bent face, and as cells see it, the cap is not quite a paraboloid
    solver.emplace(domain, material);
    solver->Fill([&cap](const Vector3d& point) { return cap.Holds(point); });
    putOn = solver->Totals().restVolume;
    if (putOn <= 0.0 || std::abs(putOn - 1000.0 * parameters.amountMl) < 0.005 * putOn)
      break;
    cap.Stretch(1000.0 * parameters.amountMl / putOn);
  }
  skin.emplace(tissue, frame, parameters.cellMm);
}

Eigen::AlignedBox3d GelMotion::State::SkinBox(const Eigen::AlignedBox3d& swept) const
{
  Eigen::AlignedBox3d box = swept;
  const Vector3d margin = Vector3d::Constant(gelCells * parameters.cellMm);
  for (const GelParticle& particle : solver->Particles()) {
    const Vector3d at = Eigen::Map<const Vector3d>(particle.position);
    box.extend(Eigen::AlignedBox3d(at - margin, at + margin));
  }
  return box;
}

void GelMotion::State::Advance(double time, const std::shared_ptr<const GelShape>& skinShape, const Pose& from, const Pose& to,
                               const Progress& progress)
{
  if (!(time > 0.0))
    return;
  GelCollider skinSolid, face;
  skinSolid.shape = skinShape;
  face.shape = head;
  face.begin = from;
  face.end = to;
  report += solver->Advance(time, {skinSolid, face}, progress);
  seconds += time;
}

// Skin waits until a face that is clear of it meets it, and does not move after a face has left it.
void GelMotion::State::Move(const Pose& probeToWorld, double time, const TissueSurface* tissue, const Progress& progress)
{
  if (!probeToWorld.matrix().allFinite() || !IsRotation(probeToWorld.linear()))
    throw Error(Error::Kind::InvalidParameter, "the pose to which the probe goes is not a rigid one");
  if (!std::isnan(time))
    CheckRange("the seconds in which the probe goes on", time, 0.0, 1e6);
  const Pose toFrame = frame.inverse(), from = toFrame * probe, to = toFrame * probeToWorld;
  if (!(time > 0.0)) {
    double longest = 0.0; // of the ways of the head's corners
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d point = headBox.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      longest = std::max(longest, (to * point - from * point).norm());
    }
    time = longest / parameters.speedMmPerS;
  }
  const Eigen::AlignedBox3d swept = SweptBy(headBox, from, to);
  solver->Include(swept);
  skin->Move(tissue, SkinBox(swept), progress.Part(0.0, 0.1));
  probe = probeToWorld;
  if (time <= 0.0)
    return;

  double meets = 0.0, leaves = 1.0;
  if (skin->Yields()) {
    if (Clearance(geometry, *skin->Before(), from) > parameters.cellMm)
      meets = Meeting(geometry, *skin->Before(), from, to);
    if (Clearance(geometry, *skin->Now(), to) > parameters.cellMm)
      leaves = 1.0 - Meeting(geometry, *skin->Now(), to, from);
    meets = meets < 1.0 ? meets : 0.0; // skin that is not met has its own reasons to move
    leaves = leaves > meets ? leaves : 1.0;
  }
  const Pose atMeeting = Interpolate(from, to, meets), atLeaving = Interpolate(from, to, leaves);
  const Progress moving = progress.Part(0.1, 1.0);
  Advance(meets * time, skin->Before(), from, atMeeting, moving.Part(0.0, meets));
  Advance((leaves - meets) * time, skin->Yields() ? skin->Moving() : skin->Now(), atMeeting, atLeaving,
          moving.Part(meets, leaves));
  Advance((1.0 - leaves) * time, skin->Now(), atLeaving, to, moving.Part(leaves, 1.0));
}

GelMotion::GelMotion(const TissueSurface& tissue, const PlacedProbe& first, const ProbeHead& head, const GelMaterial& material,
                     const GelCoatParameters& parameters)
  : state_(std::make_unique<State>(tissue, first, head, material, parameters))
{
}

GelMotion::GelMotion(const GelMotion& other) : state_(std::make_unique<State>(*other.state_)) {}

GelMotion& GelMotion::operator=(const GelMotion& other)
{
  state_ = std::make_unique<State>(*other.state_);
  return *this;
}

GelMotion::GelMotion(GelMotion&&) noexcept = default;
GelMotion& GelMotion::operator=(GelMotion&&) noexcept = default;
GelMotion::~GelMotion() = default;

void GelMotion::Move(const Pose& probeToWorld, double seconds, const TissueSurface* tissue, const Progress& progress)
{
  state_->Move(probeToWorld, seconds, tissue, progress);
}

GelCoat GelMotion::Look(bool settle, const Progress& progress)
{
  State& state = *state_;
  if (settle && state.parameters.settleS > 0.0)
    state.Move(state.probe, state.parameters.settleS, nullptr, progress.Part(0.0, 0.9));
  if (!state.skin->Now()) // it has not moved yet
    state.skin->Move(nullptr, state.SkinBox(state.headBox), progress.Part(0.0, 0.9));
  const Pose headToFrame = state.frame.inverse() * state.probe;
  GelCoat coat = CoatOf({*state.solver, *state.skin->Now(), state.shape, state.geometry, headToFrame, state.headBox});
  coat.grid = coat.grid.Moved(state.frame);
  for (GelBeam& beam : coat.face)
    beam.start = state.frame * beam.start;
  const GelTotals totals = state.solver->Totals();
  coat.volumeMm3 = totals.volume;
  coat.putOnMm3 = state.putOn;
  coat.leftMm3 = totals.restVolume;
  coat.goneMm3 = state.report.goneMm3;
  coat.seconds = state.seconds;
  coat.report = state.report;
  progress(1.0);
  return coat;
}

double GelMotion::Seconds() const
{
  return state_->seconds;
}

const Pose& GelMotion::ProbeToWorld() const
{
  return state_->probe;
}

const TissueSurface& GelMotion::Tissue() const
{
  return state_->skin->Tissue();
}

GelCoat SpreadGel(const TissueSurface& rest, const TissueSurface* pressed, const std::vector<PlacedProbe>& probes,
                  const ProbeHead& head, const GelMaterial& material, const GelCoatParameters& parameters,
                  const Progress& progress)
{
  if (probes.empty())
    throw Error(Error::Kind::BadInput, "there is no probe that gel could be put on");
  for (const PlacedProbe& probe : probes)
    if (!(probe.geometry == probes.front().geometry))
      throw Error(Error::Kind::BadInput, "all poses must be of one probe, since the gel on its face goes with it");
  GelMotion motion(rest, probes.front(), head, material, parameters);
  const double count = static_cast<double>(probes.size());
  for (std::size_t n = 0; n < probes.size(); ++n) {
    const Progress part = progress.Part(0.8 * static_cast<double>(n) / count, 0.8 * static_cast<double>(n + 1) / count);
    motion.Move(probes[n].probeToWorld, 0.0, n + 1 == probes.size() ? pressed : nullptr, part);
  }
  return motion.Look(true, progress.Part(0.8, 1.0));
}

} // namespace echorama
