// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Imaging/DisplacementField.h"
#include <optional>
#include <vector>

namespace echorama {

/// What was found in one volume, and where an alignment put it.
struct LandmarkList {
  Pose volumeToWorld = Pose::Identity(); ///< the motion that the alignment gives the volume as its file stands
  std::vector<Landmark> landmarks;
  std::string name; ///< for messages
  /// What the pose leaves over: what belongs at x is at x + u(x) when the pose alone has moved it.
  std::optional<DisplacementField> displacement{};

  /// Where a point of the volume belongs. \throws Error(NotPossible) where the displacement folds
  Eigen::Vector3d Place(const Eigen::Vector3d& point) const;
};

/// One place that was found in two volumes.
struct LandmarkDistance {
  std::string label;
  int first = 0, second = 0; ///< lists, first < second
  Eigen::Vector3d place;     ///< in the world: where the alignment puts that of the first volume
  Eigen::Vector3d error;     ///< from there to where it puts that of the second
};

/// A label that no other list has.
struct LoneLandmark {
  std::string label;
  int list = 0;
};

struct LandmarkError {
  std::vector<LandmarkDistance> distances; ///< by pair of lists, then in the order of the first list
  std::vector<LoneLandmark> unmatched;     ///< in the order of the lists
  double mean = 0.0, rms = 0.0, median = 0.0, percentile95 = 0.0, max = 0.0; ///< of their lengths, mm
};

/// The target registration error (TRE): how far landmarks of one label lie apart once the volumes are aligned. Landmarks with a
/// label that no other list has do not count; they are named. What is measured includes how exactly the landmarks were found.
/// \throws Error(BadInput) for fewer than two lists, an empty label, a label that one list holds twice (the message names
/// both), numbers that are not finite, and when no label is in two lists; as LandmarkList::Place.
LandmarkError MeasureLandmarkError(const std::vector<LandmarkList>& lists);

} // namespace echorama
