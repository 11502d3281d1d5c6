// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the tests of the local alignment look at: a texture that is known everywhere, and volumes of any geometry that see it.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/LocalAlign.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <memory>

namespace echorama::testing_scene {

/// Waves of 8 mm and longer in all directions: no symmetry, mean 100, some 30 up and down.
class Texture {
public:
  explicit Texture(std::uint64_t seed)
  {
    for (std::uint64_t w = 0; w < 40; ++w) {
      Random random(seed, w);
      const double length = random.Uniform(8.0, 40.0);
      waves_.push_back({random.Direction() * (6.283185307179586 / length), random.Uniform(0.0, 6.283185307179586)});
    }
  }
  double operator()(const Eigen::Vector3d& p) const
  {
    double sum = 0.0;
    for (const auto& [k, phase] : waves_)
      sum += std::cos(k.dot(p) + phase);
    return 100.0 + 7.0 * sum;
  }

private:
  std::vector<std::pair<Eigen::Vector3d, double>> waves_;
};

inline ImageGeometry Box(const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing, const Eigen::Vector3d& origin)
{
  ImageGeometry geometry;
  geometry.dimensions = dimensions;
  geometry.spacing = spacing;
  geometry.origin = origin;
  return geometry;
}

using Field = std::function<float(const Eigen::Vector3d&)>;

/// A volume of its own, with its pyramid.
struct Seen {
  Seen(const ImageGeometry& g, const Field& field) : geometry(g), voxels(g.dimensions)
  {
    const auto view = voxels.View();
    const Eigen::Affine3d toWorld = geometry.IndexToWorld();
    ParallelFor(g.dimensions[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < g.dimensions[1]; ++j)
        for (int i = 0; i < g.dimensions[0]; ++i)
          view(i, j, static_cast<int>(k)) = field(toWorld * Eigen::Vector3d(i, j, static_cast<double>(k)));
    });
    pyramid = BuildPyramid<float>({voxels.View(), {}, geometry});
  }
  std::shared_ptr<const MetricPyramid> As(const std::string& metric, const std::string& name = "volume") const
  {
    return BuildMetricPyramid({&pyramid, Pose::Identity(), name}, metric);
  }

  ImageGeometry geometry;
  Volume<float> voxels;
  std::vector<PyramidLevel> pyramid;
};

/// Mean distance between where two poses put the corners of a grid.
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

/// The name of a test of a metric.
inline std::string TestName(const testing::TestParamInfo<std::string>& metric)
{
  std::string name = metric.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

inline std::string MessageOf(const std::function<void()>& call, Error::Kind kind)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

} // namespace echorama::testing_scene
