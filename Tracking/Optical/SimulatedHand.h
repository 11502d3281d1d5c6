// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Tracking/Optical/SimulatedCamera.h"
#include <cstdint>
#include <functional>
#include <vector>

namespace echorama {

/// A hand that is told marks to put a light on.
struct SimulatedHandParameters {
  double moveSeconds = 0.4, liftMm = 12.0;
  double placementMm = 0.1, tremorMm = 0.03;
  double wrongMarks = 0.0;
  double peak = 150.0; ///< of its light, grey levels
  std::uint64_t seed = 1;
};
ParameterList Describe(SimulatedHandParameters& p); ///< but for the light

/// Puts a light on numbered marks as it is told, with a hand's errors; now and then on another mark than it was told. What it did
/// stays what it was, so that a frame may be rendered again.
class SimulatedHand {
public:
  /// \param toSkin the place of the skin that is nearest to a point \throws Error(InvalidParameter) also without marks
  SimulatedHand(const SimulatedHandParameters& parameters, std::vector<Eigen::Vector3d> marks,
                std::function<Eigen::Vector3d(const Eigen::Vector3d&)> toSkin);

  /// From \a time on, which does not go back, it goes to \a mark (from 0) and stays there; where it is already, it lifts off and
  /// tries again. \throws Error(InvalidParameter)
  void GoTo(std::size_t mark, double time);
  /// Which mark it is at or on its way to, in truth.
  std::size_t Mark() const { return stays_.back().mark; }
  LightOnSkin At(double time) const;

private:
  struct Stay {
    double leave, arrive; // of the way to it, s
    std::size_t mark;
    Eigen::Vector3d from, place;
  };
  SimulatedHandParameters parameters_;
  std::vector<Eigen::Vector3d> marks_;
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> toSkin_;
  std::vector<Stay> stays_;
};

} // namespace echorama
