// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// Landmarks of several volumes as users give them: a file for each, points one by one, or both.
struct LandmarkInput {
  std::vector<std::string> files;              ///< of the volumes in their order; an empty name: none
  std::map<int, std::vector<Landmark>> points; ///< by volume, from 0

  /// How many volumes they are of: one more than the last.
  int Count() const;
  /// Those of each of \a volumes volumes, read (ReadLandmarks) and joined.
  /// \throws Error as ReadLandmarks; Error(BadInput) when there are landmarks of a volume that there is not
  std::vector<std::vector<Landmark>> Lists(int volumes) const;
};

} // namespace echorama
