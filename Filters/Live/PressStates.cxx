// SPDX-License-Identifier: BSD-3-Clause
// Interpolated in the world, a place just before the face would be tissue in one state and within the probe in the next. Seen
// from the probe the face is always at depth 0, and what lies before it is tissue in all states.
//
// Cost: for a state, once for a probe, some 9000 points that go back through its displacement; for another press one pass over as
// many nodes; for another pose nothing.
#include "Filters/Live/PressStates.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Filters/Physics/DeformGeometry.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int depthNodes = 97, fanNodes = 33;

} // namespace

void PressStates::Add(double pressMm, const Pose& probeToWorld, LatticeMap displacement)
{
  if (!(pressMm > 0.0 && std::isfinite(pressMm)))
    throw Error(Error::Kind::BadInput, "PressMm of a state is " + NumberText(pressMm) + "; it must be above 0 and finite");
  if (!IsRotation(probeToWorld.linear()) || !probeToWorld.translation().allFinite())
    throw Error(Error::Kind::BadInput,
                "ProbeToWorld of the state with PressMm " + NumberText(pressMm) + " is not rigid and finite");
  if (!states_.emplace(pressMm, State{probeToWorld, std::move(displacement), std::nullopt}).second)
    throw Error(Error::Kind::BadInput, "two states have the same PressMm, " + NumberText(pressMm));
}

const BeamBend& PressStates::BendOf(State& state)
{
  if (!state.bend) {
    BeamBend bend(*probe_, depthNodes, fanNodes, reachMm_);
    std::vector<Eigen::Vector3d> points(bend.Count());
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = state.probeToWorld * bend.NodePoint(i);
    DeformGeometryParameters back;
    back.direction = DeformGeometryParameters::Direction::Backward;
    back.outside = DeformGeometryParameters::Outside::Nearest;
    back.maskFolds = true; // behind the face, where there is no tissue, anything may be
    std::vector<unsigned char> valid;
    DeformPoints(back, state.displacement, points, valid);
    const Pose worldToProbe = state.probeToWorld.inverse();
    for (std::size_t i = 0; i < points.size(); ++i)
      bend.SetMove(i, worldToProbe * points[i] - bend.NodePoint(i));
    state.bend = std::move(bend);
  }
  return *state.bend;
}

const BeamBend* PressStates::At(const ProbeGeometry& probe, double reachMm, double pressMm)
{
  if (states_.empty() || pressMm == 0.0)
    return nullptr;
  const auto after = states_.lower_bound(pressMm);
  if (after == states_.end())
    throw Error(Error::Kind::InvalidParameter, "PressMm is " + NumberText(pressMm) + "; the deepest of the pressed states has " +
                                                   NumberText(DeepestMm()) + " mm");
  reachMm = std::max(reachMm, 0.01);
  if (!(probe_ == probe) || reachMm_ != reachMm) {
    for (auto& [press, state] : states_)
      state.bend.reset();
    mixed_.reset();
    probe_ = probe;
    reachMm_ = reachMm;
  }
  if (!mixed_ || pressMm_ != pressMm) {
    const BeamBend& deeper = BendOf(after->second);
    if (after == states_.begin()) {
      mixed_ = BeamBend(probe, depthNodes, fanNodes, reachMm).Mixed(deeper, static_cast<float>(pressMm / after->first));
    } else {
      const auto before = std::prev(after);
      const double part = (pressMm - before->first) / (after->first - before->first);
      mixed_ = BendOf(before->second).Mixed(deeper, static_cast<float>(part));
    }
    pressMm_ = pressMm;
  }
  return &*mixed_;
}

} // namespace echorama
