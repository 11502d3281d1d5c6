// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A scene that is known everywhere, and volumes that see it, for the tests of this room.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/Pyramid.h"
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace echorama {

// A smooth random field of the world: waves of 15 mm and longer, about 100 grey levels +- 30. Known everywhere, so that
// volumes of any geometry see exactly the same thing.
class Scene {
public:
  explicit Scene(std::uint64_t seed)
  {
    for (std::uint64_t w = 0; w < 24; ++w) {
      Random random(seed, w);
      const double length = random.Uniform(15.0, 50.0);
      waves_.push_back({random.Direction() * (6.283185307179586 / length), random.Uniform(0.0, 6.283185307179586)});
    }
  }
  double operator()(const Eigen::Vector3d& p) const
  {
    double sum = 0.0;
    for (const auto& [k, phase] : waves_)
      sum += std::cos(k.dot(p) + phase);
    return 100.0 + 8.0 * sum;
  }

private:
  std::vector<std::pair<Eigen::Vector3d, double>> waves_;
};

// What a volume of this geometry sees of the scene.
inline Volume<float> See(const std::function<double(const Eigen::Vector3d&)>& scene, const ImageGeometry& geometry)
{
  Volume<float> volume(geometry.dimensions);
  const auto view = volume.View();
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  ParallelFor(geometry.dimensions[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < geometry.dimensions[1]; ++j)
      for (int i = 0; i < geometry.dimensions[0]; ++i)
        view(i, j, static_cast<int>(k)) = static_cast<float>(scene(toWorld * Eigen::Vector3d(i, j, static_cast<double>(k))));
  });
  return volume;
}

inline ImageGeometry Box(const std::array<int, 3>& dimensions, double spacing, const Eigen::Vector3d& origin)
{
  ImageGeometry geometry;
  geometry.dimensions = dimensions;
  geometry.spacing.setConstant(spacing);
  geometry.origin = origin;
  return geometry;
}

inline std::vector<PyramidLevel> PyramidOf(const Volume<float>& volume, const ImageGeometry& geometry)
{
  return BuildPyramid<float>({volume.View(), {}, geometry});
}

// Mean distance between where two poses put the corners of a grid.
inline double Distance(const Pose& a, const Pose& b, const ImageGeometry& geometry)
{
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto& n = geometry.dimensions;
    const Eigen::Vector3d p = geometry.IndexToWorld() *
                              Eigen::Vector3d(corner & 1 ? n[0] - 1 : 0, corner & 2 ? n[1] - 1 : 0, corner & 4 ? n[2] - 1 : 0);
    sum += (a * p - b * p).norm() / 8.0;
  }
  return sum;
}

} // namespace echorama
