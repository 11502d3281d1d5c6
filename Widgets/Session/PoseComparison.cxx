// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/PoseComparison.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/RigidTransform.h"
#include <algorithm>

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
      const auto apart = [&](const Eigen::Vector3d& point) { return (here * point - there * point).norm(); };
      difference.middleMm = apart(geometry.Centre());
      difference.degrees = RotationAngle(here * there.inverse()) * DegreesPerRadian;
      for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d index;
        for (int axis = 0; axis < 3; ++axis)
          index[axis] = (corner >> axis & 1) * (geometry.dimensions[static_cast<std::size_t>(axis)] - 1);
        difference.mostMm = std::max(difference.mostMm, apart(geometry.IndexToWorld() * index));
      }
    }
    differences.push_back(difference);
  }
  return differences;
}

} // namespace echorama
