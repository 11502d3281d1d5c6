// SPDX-License-Identifier: BSD-3-Clause
// Squared distance maps of fixed masks of 256^3 voxels beside vtkImageEuclideanDistance, set to SaitoCached, all else as it
// comes: from masks as a user meets them to those that are hardest for either. The error is the largest difference from brute
// force at voxels drawn at random; "largest_difference" is that between the two maps over all voxels.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/DistanceMap.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <tbb/info.h>

#ifdef ECHORAMA_WITH_VTK
#include <vtkImageData.h>
#include <vtkImageEuclideanDistance.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#endif

namespace {

using namespace echorama;

constexpr int size = 256;

template <class Function>
Volume<unsigned char> Mask(const Function& isSite)
{
  Volume<unsigned char> mask({size, size, size});
  ParallelFor(size, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        mask.View()(i, j, k) = isSite(i, j, k) ? 1 : 0;
  });
  return mask;
}

// What a convex probe sees: the valid region of a volume.
bool InFan(int i, int j, int k)
{
  static const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40.0, 1.1, 25.0, 5.0, 120.0);
  return BeamPointAt(probe, Eigen::Vector3d(i - 127.5, j - 127.5, k) * 0.6).has_value();
}

// Balls of all sizes, as lesions or vessels in a segmentation.
Volume<unsigned char> Balls()
{
  std::vector<Eigen::Vector4d> balls;
  Random random(3);
  for (int ball = 0; ball < 200; ++ball)
    balls.emplace_back(random.Uniform(0, size), random.Uniform(0, size), random.Uniform(0, size), random.Uniform(2, 12));
  return Mask([&balls](int i, int j, int k) {
    for (const Eigen::Vector4d& ball : balls)
      if ((Eigen::Vector3d(i, j, k) - ball.head<3>()).squaredNorm() < ball[3] * ball[3])
        return true;
    return false;
  });
}

Volume<unsigned char> Noise(double density)
{
  return Mask([density](int i, int j, int k) {
    return Random(9,
                  (static_cast<std::uint64_t>(k) * size + static_cast<std::uint64_t>(j)) * size + static_cast<std::uint64_t>(i))
               .Uniform() < density;
  });
}

// The largest difference from brute force at 200 voxels. A nearest site is at the surface of the mask.
template <class T>
double ErrorOf(const T* map, VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing)
{
  std::vector<Eigen::Vector3d> surface;
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const auto outside = [&](int x, int y, int z) {
          return x < 0 || y < 0 || z < 0 || x >= size || y >= size || z >= size || mask(x, y, z) == 0;
        };
        if (mask(i, j, k) && (outside(i - 1, j, k) || outside(i + 1, j, k) || outside(i, j - 1, k) || outside(i, j + 1, k) ||
                              outside(i, j, k - 1) || outside(i, j, k + 1)))
          surface.emplace_back(i, j, k);
      }
  Random random(17);
  double largest = 0.0;
  for (int sample = 0; sample < 200; ++sample) {
    const int i = static_cast<int>(random.Below(size)), j = static_cast<int>(random.Below(size)),
              k = static_cast<int>(random.Below(size));
    double nearest = mask(i, j, k) ? 0.0 : HUGE_VAL;
    for (const Eigen::Vector3d& site : surface)
      nearest = std::min(nearest, (site - Eigen::Vector3d(i, j, k)).cwiseProduct(spacing).squaredNorm());
    largest =
        std::max(largest, std::abs(nearest - static_cast<double>(map[(static_cast<std::ptrdiff_t>(k) * size + j) * size + i])));
  }
  return largest;
}

void Run(const std::string& name, const Volume<unsigned char>& mask, const Eigen::Vector3d& spacing = Eigen::Vector3d::Ones())
{
  Volume<float> map({size, size, size});
  const auto ours = [&] { SquaredDistanceMap(mask.View(), spacing, map.View()); };
  double seconds = 0.0;
#ifdef ECHORAMA_WITH_VTK
  // The peer measures the distance from what is not 0 to what is 0.
  vtkNew<vtkUnsignedCharArray> complement;
  complement->SetNumberOfTuples(map.View().Size());
  for (std::ptrdiff_t i = 0; i < map.View().Size(); ++i)
    complement->SetValue(i, mask.View()[i] ? 0 : 1);
  vtkNew<vtkImageData> image;
  image->SetDimensions(size, size, size);
  image->SetSpacing(spacing.data());
  image->GetPointData()->SetScalars(complement);
  vtkNew<vtkImageEuclideanDistance> peer;
  peer->SetAlgorithmToSaitoCached();
  peer->SetInputData(image);
  double peerSeconds = 0.0;
  std::tie(seconds, peerSeconds) = benchmark::Duel(
      ours,
      [&peer] {
        peer->Modified();
        peer->Update();
      },
      3);
  const auto* peerMap = static_cast<const double*>(peer->GetOutput()->GetScalarPointer());
  double difference = 0.0;
  for (std::ptrdiff_t i = 0; i < map.View().Size(); ++i)
    difference = std::max(difference, std::abs(peerMap[i] - static_cast<double>(map.View()[i])));
  const double ratio = peerSeconds / seconds;
#else
  seconds = benchmark::MedianSeconds(ours, 3);
  const double difference = 0.0, ratio = 0.0;
#endif
  benchmark::Report("distance_map", name, "echorama", seconds, ErrorOf(map.View().Data(), mask.View(), spacing), "mm^2",
                    {{"mvoxels_per_second", static_cast<double>(map.View().Size()) * 1e-6 / seconds},
                     {"threads", tbb::info::default_concurrency()},
                     {"largest_difference", difference},
                     {"times_faster", ratio}});
#ifdef ECHORAMA_WITH_VTK
  benchmark::Report("distance_map", name, "vtkImageEuclideanDistance SaitoCached", peerSeconds,
                    ErrorOf(peerMap, mask.View(), spacing), "mm^2",
                    {{"mvoxels_per_second", static_cast<double>(map.View().Size()) * 1e-6 / peerSeconds},
                     {"threads", 1}}); // it knows no threads
#endif
}

} // namespace

int main()
{
  const auto fan = Mask(InFan);
  Run("fan 256^3", fan);
  Run("fan 256^3, spacing 0.5 0.6 0.9", fan, {0.5, 0.6, 0.9});
  Run("balls 256^3", Balls());
  Run("noise of 50% 256^3", Noise(0.5));
  Run("noise of 1% 256^3", Noise(0.01));
  Run("noise of 0.001% 256^3", Noise(1e-5));
  Run("single voxel 256^3", Mask([](int i, int j, int k) { return i == 100 && j == 120 && k == 140; }));
  Run("diagonal sheet 256^3", Mask([](int i, int j, int k) { return i + j + k == 3 * size / 2; }));
}
