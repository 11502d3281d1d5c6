// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Acoustics/BeamBend.h"
#include "Filters/Physics/LatticeMap.h"
#include <map>
#include <optional>

namespace echorama {

/// Tissue at rest under a probe that pressed it more and more, at one place: states that were worked out before (TissuePress),
/// and what lies between them.
///
/// Beside the probe everything moves with it: where a sample of a beam lay before, seen from the probe, is known for each state
/// (exactly, as DeformPoints inverts the displacement) and linear in PressMm between two of them; at 0 it is where it is. A probe
/// that has left the place of the states takes their dent along.
class PressStates {
public:
  /// \param pressMm how deep the probe is pressed in, above 0; no two states have the same \param probeToWorld where it then is
  /// \param displacement of the tissue \throws Error(BadInput)
  void Add(double pressMm, const Pose& probeToWorld, LatticeMap displacement);
  bool Empty() const { return states_.empty(); }
  double DeepestMm() const { return states_.empty() ? 0.0 : states_.rbegin()->first; }

  /// Where tissue lay before; nullptr where none has moved: without states, and with no pressure. What a probe and a press share
  /// with those of the call before is kept.
  /// \param reachMm how far beside its plane the probe looks
  /// \throws Error(InvalidParameter) for a press beyond the deepest state, as BeamBend
  const BeamBend* At(const ProbeGeometry& probe, double reachMm, double pressMm);

private:
  struct State {
    Pose probeToWorld;
    LatticeMap displacement;
    std::optional<BeamBend> bend;
  };
  const BeamBend& BendOf(State& state);

  std::map<double, State> states_; // by PressMm
  std::optional<ProbeGeometry> probe_;
  double reachMm_ = 0.0, pressMm_ = 0.0;
  std::optional<BeamBend> mixed_;
};

} // namespace echorama
