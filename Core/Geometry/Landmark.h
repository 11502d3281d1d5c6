// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <string>

namespace echorama {

/// A point that somebody found in a volume.
struct Landmark {
  std::string label;        ///< the same for the same place in several volumes
  Eigen::Vector3d position; ///< mm, LPS, in the frame of the volume's own file
};

inline bool operator==(const Landmark& a, const Landmark& b)
{
  return a.label == b.label && a.position == b.position;
}

} // namespace echorama
