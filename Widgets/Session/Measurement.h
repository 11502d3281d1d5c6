// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// What somebody measured in the world: two points are a distance, three an angle at the second.
struct Measurement {
  int number = 0;                      ///< from 1, for people; each once
  std::vector<Eigen::Vector3d> points; ///< world, mm: it stays where it is when volumes move

  bool IsAngle() const { return points.size() == 3; }
  /// The distance, mm, or the angle in [0, 180] degrees. NaN for an angle with an arm of no length.
  double Value() const;
};

inline bool operator==(const Measurement& a, const Measurement& b)
{
  return a.number == b.number && a.points == b.points;
}

} // namespace echorama
