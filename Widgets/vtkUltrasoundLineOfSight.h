// SPDX-License-Identifier: BSD-3-Clause
// Which volumes a person points at in 3D.
#ifndef vtkUltrasoundLineOfSight_h
#define vtkUltrasoundLineOfSight_h

#include "vtkCamera.h"
#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkRenderer.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <vector>

namespace echorama {

/** From the camera, or with parallel rays its near plane, to a point beyond; world. It goes on: clipping ranges are not always
 * those of the volumes. */
inline std::array<Eigen::Vector3d, 2> LineOfSight(vtkRenderer* renderer, double pixelX, double pixelY)
{
  std::array<Eigen::Vector3d, 2> line;
  for (const int end : {0, 1}) {
    double place[4];
    renderer->SetDisplayPoint(pixelX, pixelY, end);
    renderer->DisplayToWorld();
    renderer->GetWorldPoint(place);
    line[static_cast<std::size_t>(end)] = Eigen::Vector3d(place) / place[3];
  }
  if (!renderer->GetActiveCamera()->GetParallelProjection()) {
    renderer->GetActiveCamera()->GetPosition(line[0].data());
  }
  return line;
}

/** Those of the volumes that have a voxel with a grey level in [least, most] on the line, by where their first one lies. */
inline std::vector<int> VolumesOnLine(vtkUltrasoundAlignmentSession* session, const std::vector<int>& ids,
                                      const std::array<Eigen::Vector3d, 2>& line, double least, double most)
{
  std::vector<std::pair<double, int>> hits; // how far, and which
  if (!session || !line[0].allFinite() || !line[1].allFinite()) {
    return {};
  }
  for (const int id : ids) {
    vtkImageData* image = session->GetImage(id);
    vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
    const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image);
    const Eigen::Affine3d toIndex = geometry.WorldToIndex();
    const Eigen::Vector3d from = toIndex * line[0], way = toIndex * line[1] - from;
    // The part of the line in the box of the voxels.
    double begin = 0.0, end = std::numeric_limits<double>::max();
    for (int axis = 0; axis < 3; ++axis) {
      const double low = (-0.5 - from[axis]) / way[axis], high = (geometry.dimensions[axis] - 0.5 - from[axis]) / way[axis];
      if (std::isfinite(low) && std::isfinite(high)) {
        begin = std::max(begin, std::min(low, high));
        end = std::min(end, std::max(low, high));
      }
    }
    const double step = 0.5 / way.cwiseAbs().maxCoeff(); // half a voxel
    for (double at = begin; at <= end && step > 0.0; at += step) {
      const Eigen::Vector3d place = line[0] + at * (line[1] - line[0]);
      const vtkIdType voxel = session->GetVoxelAt(id, place.data());
      const double grey = voxel < 0 ? 0.0 : intensity->GetComponent(voxel, 0);
      if (voxel >= 0 && grey >= least && grey <= most) {
        hits.emplace_back(at, id);
        break;
      }
    }
  }
  std::sort(hits.begin(), hits.end());
  std::vector<int> found;
  for (const auto& [at, id] : hits) {
    found.push_back(id);
  }
  return found;
}

} // namespace echorama

#endif
