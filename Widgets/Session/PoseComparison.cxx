// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/PoseComparison.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/RigidTransform.h"

namespace echorama {

std::vector<PoseDifference> ComparePoses(const SessionState& state, const std::map<int, Pose>& other, bool besideFirst)
{
  Pose together = Pose::Identity();
  if (besideFirst)
    for (const SessionVolume& volume : state.volumes)
      if (const auto found = other.find(volume.id); found != other.end()) {
        together = volume.volumeToWorld * found->second.inverse();
        break;
      }
  std::vector<PoseDifference> differences;
  for (const SessionVolume& volume : state.volumes) {
    PoseDifference difference;
    difference.id = volume.id;
    if (const auto found = other.find(volume.id); found != other.end()) {
      difference.isKnown = true;
      const Pose &here = volume.volumeToWorld, there = together * found->second;
      const ImageGeometry& geometry = volume.geometry;
      difference.middleMm = (here * geometry.Centre() - there * geometry.Centre()).norm();
      difference.degrees = RotationAngle(here * there.inverse()) * DegreesPerRadian;
      difference.mostMm = FarthestCornerMm(geometry, here, there);
    }
    differences.push_back(difference);
  }
  return differences;
}

} // namespace echorama
