// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Geometry>
#include <utility>
#include <vector>

namespace echorama {

/// A box with axes of its own.
struct TurnedBox {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity(); ///< columns
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero(); ///< along its axes

  Eigen::AlignedBox3d Bounds() const;
};

/// Whether two boxes have a point in common; touching counts. Boxes that miss each other by less than rounding may.
bool Meet(const TurnedBox& a, const TurnedBox& b);

/// All pairs (a, b) of boxes that meet, a < b, in ascending order; empty boxes meet none. Cost: a tree of the boxes, then what
/// there is to find: n log n where each meets few.
std::vector<std::pair<int, int>> PairsThatMeet(const std::vector<Eigen::AlignedBox3d>& boxes);

} // namespace echorama
