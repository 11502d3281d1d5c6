// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Synthesize.h"

namespace echorama {

/// Where a scanner sees tissue: the truth that goes with a synthesised volume.
///
/// Sound bends, and its speed is not the one that the scanner assumes, so tissue is shown elsewhere than it is. The axis of every
/// beam, or the middle of a wide one, is followed along the direct way: at each of its bends it tells how far from where the
/// scanner shows it something really lies. Along a beam, and between the four nearest beams at one scan depth, this displacement
/// is taken as linear. Where a point is seen is found by a damped fixed-point iteration, to 1e-6 mm.
///
/// With stepPoses each plane shows what lies where the probe was.
class SeenTissue {
public:
  /// \throws as SynthesisParameters::Check(); Error(InvalidParameter) for the mode Counting, whose echoes come back another way;
  /// Error(Cancelled). The result does not depend on the number of threads.
  SeenTissue(const AcousticScene& scene, const SynthesisParameters& parameters, const Progress& progress = {});

  /// Where tissue at a point of the world is seen, in the world by probeToWorld, mm. Nothing where it is not seen:
  /// - outside of the fan or its depths; for a probe that does not sweep, off the surface that its plane images,
  /// - where none of the four nearest beams gets to directly: behind total reflection, or below transport.dynamicRangeDb,
  /// - where the displacements of those beams differ by more than the beams are apart, and by more than they are wide (the
  ///   standard deviation of WidthAt): beside the rim of a body that bends sound, where tissue is seen twice or not at all.
  /// Thread safe.
  std::optional<Eigen::Vector3d> Seen(const Eigen::Vector3d& point) const;

private:
  // Displacements from where something is shown to where it is, in the probe frame, at the ends of a beam's straight pieces.
  struct Node {
    double scanDepth;
    Eigen::Vector3d displacement;
  };
  struct Beam {
    double fan, sweep;
    std::vector<Node> nodes;
  };

  struct Displacement {
    Eigen::Vector3d vector; // where no beam gets to, that of the nearest depth that one does
    bool isSeen;
  };
  Displacement At(const BeamPoint& beam) const;

  ProbeGeometry probe_;
  Pose probeToWorld_;
  Transducer transducer_;
  int elements_, steps_;
  std::vector<Beam> beams_;
};

} // namespace echorama
