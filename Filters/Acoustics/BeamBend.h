// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include <vector>

namespace echorama {

/// Where tissue under a probe that presses lay at rest, less where it is now: mm in the probe's frame, known at nodes and linear
/// between them. Nodes lie evenly over the depths and the fan of the probe's middle plane, and at -acrossMm, 0 and acrossMm
/// beside it (along y); what lies beyond has what the nearest node has.
class BeamBend {
public:
  /// All rests. \throws Error(InvalidParameter) for a geometry that is none, or sweeps; fewer than 2 depths or beams; acrossMm <=
  /// 0
  BeamBend(const ProbeGeometry& probe, int depths, int beams, double acrossMm);

  std::size_t Count() const { return moves_.size(); }
  /// Where a node lies, in the probe's frame.
  Eigen::Vector3d NodePoint(std::size_t node) const;
  void SetMove(std::size_t node, const Eigen::Vector3d& move) { moves_[node] = move.cast<float>(); }

  /// (1 - part) of this one and a part of another with the same nodes.
  BeamBend Mixed(const BeamBend& other, float part) const;

  /// Of one beam: \a fan from -0.5 to 0.5.
  class Line {
  public:
    /// \param depthMm from the face \param acrossMm beside the plane
    Eigen::Vector3f At(float depthMm, float acrossMm) const;

  private:
    friend class BeamBend;
    std::vector<Eigen::Vector3f> moves_; // of each depth the three across
    float depthMin_ = 0.0f, perMm_ = 0.0f, perAcross_ = 0.0f;
  };
  Line Along(double fan) const;
  /// At any place: as a line says.
  Eigen::Vector3d At(double depthMm, double fan, double acrossMm) const;
  int Depths() const { return depths_; }

private:
  ProbeGeometry probe_;
  int depths_, beams_;
  double acrossMm_;
  std::vector<Eigen::Vector3f> moves_; // across fastest, then depth, then fan
};

} // namespace echorama
