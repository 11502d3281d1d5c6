// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/Landmark.h"
#include "Widgets/Painting/Stroke.h"
#include "Widgets/Session/MadeOf.h"
#include "Widgets/Session/Measurement.h"
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

inline constexpr int LargestNumber = 99999999; ///< of groups, of measurements, and of the backup that a project goes on from

/// For something new beside those that are \a taken: one beyond the largest or, where there is none, the smallest that is free.
inline int NextNumber(const std::set<int>& taken)
{
  int number = taken.empty() ? 1 : *taken.rbegin() + 1;
  for (number = number > LargestNumber ? 1 : number; taken.count(number) > 0;)
    ++number;
  return number;
}

/// A volume as an alignment session knows it, without its voxels.
struct SessionVolume {
  int id = 0;                                  ///< from 1; never given twice in a session
  std::string name;                            ///< for people; unique in the session
  std::string file;                            ///< where it was read from, absolute; empty: it came from a pipeline
  ImageGeometry geometry;                      ///< of the file as it stands
  Pose volumeToWorld = Pose::Identity();       ///< from the physical space of the file as it stands
  std::array<double, 3> colour{1.0, 1.0, 1.0}; ///< RGB in [0, 1]
  double opacity = 1.0;                        ///< [0, 1]
  bool visible = true;
  int group = 0;                   ///< volumes of one group are selected together; 0: none
  StrokeChain strokes;             ///< painted and carved
  std::vector<Landmark> landmarks; ///< in the physical space of the file as it stands; each label once
  /// A result: a volume that was made of others. Aligners leave it alone, and it is no source unless asked. nullptr: no result.
  std::shared_ptr<const MadeOf> madeOf;
  int edition = 0; ///< which of its voxels, when it was made again; never given twice to a volume
};

/// All that undo brings back. Cheap to copy. The selection is not part of it: choosing is not an edit.
struct SessionState {
  std::vector<SessionVolume> volumes;      ///< in the user's order; the first is the gauge of pose files
  std::vector<Measurement> measurements{}; ///< in the order in which they were made
  std::optional<Eigen::Vector3d> centre{}; ///< about which rotations turn, world; none: the middle of what is selected
  const SessionVolume* Find(int id) const;
  SessionVolume* Find(int id);
  /// -1: there are not so many.
  int IdAt(int index) const
  {
    return index >= 0 && index < static_cast<int>(volumes.size()) ? volumes[static_cast<std::size_t>(index)].id : -1;
  }
};

bool SameGeometry(const ImageGeometry&, const ImageGeometry&); ///< exact: to the last bit
bool operator==(const SessionVolume&, const SessionVolume&);   ///< exact as well
bool operator==(const SessionState&, const SessionState&);
inline bool operator!=(const SessionState& a, const SessionState& b)
{
  return !(a == b);
}

} // namespace echorama
