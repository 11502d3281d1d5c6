// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeShape.h"
#include <algorithm>
#include <cmath>

namespace echorama {

constexpr int MostPointsOfShape = 1000;

VolumeShape::VolumeShape(const PlacedVolume& volume)
{
  const PyramidLevel& level = volume.pyramid->back();
  const VolumeView<const float> view = level.intensity.View();
  const std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, level.realVoxels / MostPointsOfShape);
  const auto& n = view.Dimensions();
  const Eigen::Affine3d toWorld = level.geometry.IndexToWorld();
  Eigen::AlignedBox3d box;
  std::ptrdiff_t real = 0, index = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (std::isfinite(view[index++])) {
          const Eigen::Vector3d p = toWorld * Eigen::Vector3d(i, j, k);
          box.extend(p);
          if (real++ % step == 0)
            points.push_back(p);
        }
  for (const Eigen::Vector3d& p : points)
    centroid += p / static_cast<double>(points.size());
  for (const Eigen::Vector3d& p : points) {
    radius += (p - centroid).squaredNorm() / static_cast<double>(points.size());
    reach = std::max(reach, (p - centroid).norm());
  }
  radius = std::sqrt(radius);
  extent = points.empty() ? 0.0 : box.sizes().maxCoeff();
}

double VolumeShape::Distance(const Pose& a, const Pose& b) const
{
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points)
    sum += (a * p - b * p).norm();
  return sum / static_cast<double>(points.size());
}

double VolumeShape::Error(const Information& covariance, const Eigen::Vector3d& centre, const Pose& pose) const
{
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d r = pose * p - centre;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << 1.0, 0.0, 0.0, 0.0, r.z(), -r.y(), 0.0, 1.0, 0.0, -r.z(), 0.0, r.x(), 0.0, 0.0, 1.0, r.y(), -r.x(), 0.0;
    sum += (jacobian * covariance * jacobian.transpose()).trace();
  }
  return std::sqrt(std::max(0.0, sum / static_cast<double>(points.size())));
}

} // namespace echorama
