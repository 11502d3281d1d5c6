// SPDX-License-Identifier: BSD-3-Clause
// Squared distance maps of fixed masks beside vtkImageEuclideanDistance, set to SaitoCached, all else as it comes: at 256^3
// voxels from masks as a user meets them to those that are hardest for either, at 512^3 what users meet. The error is the
// largest difference from brute force at voxels drawn at random; "largest_difference" is that between the two maps over all
// voxels. "growth" is our time per voxel at 512^3 over that of the same mask at 256^3, measured in turn.
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

constexpr int Small = 256, Large = 512;

template <class Function>
Volume<unsigned char> Mask(int size, const Function& isSite)
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
Volume<unsigned char> Fan(int size)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40.0, 1.1, 25.0, 5.0, 120.0);
  const double spacing = 0.6 * Small / size, middle = (size - 1) / 2.0;
  return Mask(size, [&](int i, int j, int k) {
    return BeamPointAt(probe, Eigen::Vector3d(i - middle, j - middle, k) * spacing).has_value();
  });
}

// Balls of all sizes, as lesions or vessels in a segmentation.
Volume<unsigned char> Balls(int size)
{
  Volume<unsigned char> mask({size, size, size});
  Random random(3);
  for (int ball = 0; ball < 200; ++ball) {
    const double scale = static_cast<double>(size) / Small;
    const double x = random.Uniform(0, size), y = random.Uniform(0, size), z = random.Uniform(0, size),
                 radius = random.Uniform(2, 12) * scale;
    const auto first = [radius](double at) { return std::max(0, static_cast<int>(at - radius)); };
    const auto last = [radius, size](double at) { return std::min(size - 1, static_cast<int>(at + radius)); };
    for (int k = first(z); k <= last(z); ++k)
      for (int j = first(y); j <= last(y); ++j)
        for (int i = first(x); i <= last(x); ++i)
          if ((Eigen::Vector3d(i, j, k) - Eigen::Vector3d(x, y, z)).squaredNorm() < radius * radius)
            mask.View()(i, j, k) = 1;
  }
  return mask;
}

Volume<unsigned char> Noise(int size, double density)
{
  return Mask(size, [density, size](int i, int j, int k) {
    const std::ptrdiff_t at = (static_cast<std::ptrdiff_t>(k) * size + j) * size + i;
    return Random(9, static_cast<std::uint64_t>(at)).Uniform() < density;
  });
}

// The largest difference from brute force at 200 voxels. A nearest site is at the surface of the mask.
template <class T>
double ErrorOf(const T* map, VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing)
{
  const int size = mask.Dimensions()[0];
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

// \a more: further keys of our line.
void Run(const std::string& name, const Volume<unsigned char>& mask, const Eigen::Vector3d& spacing = Eigen::Vector3d::Ones(),
         const nlohmann::ordered_json& more = {})
{
  const int size = mask.Dimensions()[0];
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
  const auto theirs = [&peer] {
    peer->Modified();
    peer->Update();
  };
  double peerSeconds = 0.0;
  if (size <= Small)
    std::tie(seconds, peerSeconds) = benchmark::Duel(ours, theirs, 3);
  else { // the peer takes a minute or two
    peerSeconds = benchmark::Seconds(theirs);
    seconds = benchmark::MedianSeconds(ours, 3);
  }
  const auto* peerMap = static_cast<const double*>(peer->GetOutput()->GetScalarPointer());
  double difference = 0.0;
  for (std::ptrdiff_t i = 0; i < map.View().Size(); ++i)
    difference = std::max(difference, std::abs(peerMap[i] - static_cast<double>(map.View()[i])));
  const double ratio = peerSeconds / seconds;
#else
  seconds = benchmark::MedianSeconds(ours, 3);
  const double difference = 0.0, ratio = 0.0;
#endif
  nlohmann::ordered_json line{{"mvoxels_per_second", static_cast<double>(map.View().Size()) * 1e-6 / seconds},
                              {"threads", tbb::info::default_concurrency()},
                              {"largest_difference", difference},
                              {"times_faster", ratio}};
  if (more.is_object())
    line.update(more);
  benchmark::Report("distance_map", name, "echorama", seconds, ErrorOf(map.View().Data(), mask.View(), spacing), "mm^2", line);
#ifdef ECHORAMA_WITH_VTK
  benchmark::Report("distance_map", name, "vtkImageEuclideanDistance SaitoCached", peerSeconds,
                    ErrorOf(peerMap, mask.View(), spacing), "mm^2",
                    {{"mvoxels_per_second", static_cast<double>(map.View().Size()) * 1e-6 / peerSeconds},
                     {"threads", 1}}); // it knows no threads
#endif
}

// At 512^3, and how the time per voxel grows.
void RunLarge(const std::string& name, Volume<unsigned char> (*make)(int size))
{
  const Volume<unsigned char> small = make(Small), large = make(Large);
  double growth = 0.0;
  {
    Volume<float> smallMap(small.Dimensions()), largeMap(large.Dimensions());
    const auto [smallSeconds, largeSeconds] =
        benchmark::Duel([&] { SquaredDistanceMap(small.View(), Eigen::Vector3d::Ones(), smallMap.View()); },
                        [&] { SquaredDistanceMap(large.View(), Eigen::Vector3d::Ones(), largeMap.View()); });
    growth =
        largeSeconds / smallSeconds * static_cast<double>(smallMap.View().Size()) / static_cast<double>(largeMap.View().Size());
  }
  Run(name + " 512^3", large, Eigen::Vector3d::Ones(), {{"growth", growth}});
}

} // namespace

int main()
{
  const auto fan = Fan(Small);
  Run("fan 256^3", fan);
  Run("fan 256^3, spacing 0.5 0.6 0.9", fan, {0.5, 0.6, 0.9});
  Run("balls 256^3", Balls(Small));
  Run("noise of 50% 256^3", Noise(Small, 0.5));
  Run("noise of 1% 256^3", Noise(Small, 0.01));
  Run("noise of 0.001% 256^3", Noise(Small, 1e-5));
  Run("single voxel 256^3", Mask(Small, [](int i, int j, int k) { return i == 100 && j == 120 && k == 140; }));
  Run("diagonal sheet 256^3", Mask(Small, [](int i, int j, int k) { return i + j + k == 3 * Small / 2; }));
  RunLarge("fan", Fan);
  RunLarge("balls", Balls);
}
