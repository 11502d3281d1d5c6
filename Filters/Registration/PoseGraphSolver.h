// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The numbers of a pose graph, apart from the judgement (PoseGraph.cxx): least squares, robust or plain, and covariances.
#include "PoseGraph.h"

namespace echorama {

/// An edge ready to be weighed.
struct WeighedEdge {
  /// Adds the floor to the edge's own covariance; directions without information get a standard deviation of 1 m.
  WeighedEdge(const PoseEdge& edge, const PoseGraphParameters& parameters);

  int from, to;
  Pose toInFrom, fromInTo;
  Eigen::Vector3d centre; ///< in `from`
  Information root;       ///< root^T root is the information
  double variance;        ///< of the distance it moves points at the radius, mm^2
  bool verified;
};

/// How far two poses are from what an edge measured: (translation mm, rotation vector) about its centre, seen from `from`.
Twist Disagreement(const WeighedEdge& edge, const Pose& from, const Pose& to);

/// Per volume, in its own frame: the mean of the centres of its edges of \a isUsed; volumes turn about it.
std::vector<Eigen::Vector3d> MeanCentres(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed,
                                         std::size_t volumes);

/// Moves the volumes that \a isFixed does not name to the least sum of squares over the edges of \a isUsed.
/// \param lossSigmas scale of a Cauchy loss; 0: none
void MinimiseDisagreement(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed,
                          const std::vector<bool>& isFixed, double lossSigmas, std::vector<Pose>& poses);

/// Covariances at a solution.
class MarginalCovariances {
public:
  /// \param isUsed edges that hold the volumes; \param isAsked edges that Of(edge) may be asked about
  /// Every volume that is not fixed must be joined to a fixed one by used edges.
  MarginalCovariances(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed, const std::vector<bool>& isAsked,
                      const std::vector<bool>& isFixed, const std::vector<Pose>& poses);

  /// Of MotionAbout(centre of the volume, rotation, translation) * pose; zero for a fixed volume.
  Information OfVolume(int volume) const;
  /// Of the disagreement of an edge, as far as the volumes' poses cause it.
  Information OfEdge(std::size_t edge) const;
  /// In the world: about which a volume's covariance speaks.
  const Eigen::Vector3d& Centre(int volume) const { return centres_[static_cast<std::size_t>(volume)]; }

private:
  struct Jacobians {
    Information from, to;
  };
  Jacobians Of(const WeighedEdge& edge) const;
  Information Block(int a, int b) const;
  double Entry(int row, int column) const;

  const std::vector<WeighedEdge>& edges_;
  const std::vector<Pose>& poses_;
  std::vector<Eigen::Vector3d> centres_;
  std::vector<int> first_;               // per volume: its first unknown, or -1
  std::vector<int> place_;               // per unknown: where the factor's order has it
  std::vector<int> starts_, rows_;       // the factor's pattern below the diagonal, by columns
  std::vector<double> lower_, diagonal_; // the inverse on that pattern
};

} // namespace echorama
