// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "DiffusionSums.h"
#include <array>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// How much error a tile's list may have.
struct DiffusionTolerance {
  double expansion; ///< bound of what a cluster's expansion leaves away, in shares of the cluster
  double left;      ///< clusters are left out whose share of all weights is below it
};

/// The sources in a tree of clusters, each with its moments.
class DiffusionTree {
public:
  /// \param voxels of the sources; their place is their index times \a spacing
  /// \param rows values of every row (row 0: ones), in the order of the voxels
  DiffusionTree(const std::vector<std::array<int, 3>>& voxels, const Eigen::Vector3d& spacing,
                const std::vector<std::vector<float>>& rows, double exponent);

  /// What a box of points must sum, as seen from \a origin.
  /// \param nearest the largest distance of one of its points to the points' nearest source, mm
  void List(const DiffusionExponent& exponent, const DiffusionTolerance& tolerance, const Eigen::Vector3d& low,
            const Eigen::Vector3d& high, double nearest, const Eigen::Vector3d& origin, DiffusionNear& near,
            DiffusionFar& far) const;

  /// Squared distance from a point to the nearest source, mm^2.
  double SquaredDistance(const Eigen::Vector3d& point) const;

private:
  struct Cluster {
    int first = 0, count = 0;
    int child = -1;                                   // two, one after the other; -1: none
    double radius = 0.0;                              // no source is farther from the centre
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(); // mean of the sources
    Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
  };
  void Divide(std::vector<int>& order);
  void Expand(int number);

  double exponent_;
  int rows_;
  std::vector<Cluster> clusters_;
  std::vector<double> moments_; // per cluster and row: sum, first, second moments
  std::vector<float> terms_;    // the same with the factors of the exponent, as DiffusionFar has them
  std::vector<Eigen::Vector3d> places_;
  std::vector<std::vector<float>> values_;
};

} // namespace echorama
