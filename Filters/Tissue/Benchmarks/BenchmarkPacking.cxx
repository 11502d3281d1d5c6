// SPDX-License-Identifier: BSD-3-Clause
// How long 200,000 spheres at a fill fraction of 0.30 take. The error is the deepest overlap of any two, which must be 0, found
// by another way than the packing's. The peer is the plain check of each place against all spheres; it is quadratic, so it
// is measured with 10,000, and what it would take for 200,000 is said to be scaled.
#include "Core/Base/Random.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>

using namespace echorama;
using Eigen::Vector3d;

namespace {

using Parameters = SpherePackingParameters;

// Neighbours along x alone, widest reach first.
double DeepestOverlap(std::vector<Sphere> spheres)
{
  std::sort(spheres.begin(), spheres.end(), [](const Sphere& a, const Sphere& b) { return a.centre.x() < b.centre.x(); });
  double largest = 0.0, deepest = 0.0;
  for (const Sphere& sphere : spheres)
    largest = std::max(largest, sphere.radius);
  for (std::size_t i = 0; i < spheres.size(); ++i)
    for (std::size_t j = i + 1; j < spheres.size(); ++j) {
      if (spheres[j].centre.x() - spheres[i].centre.x() > spheres[i].radius + largest)
        break;
      const double reach = spheres[i].radius + spheres[j].radius;
      const double squared = (spheres[i].centre - spheres[j].centre).squaredNorm();
      if (squared < reach * reach)
        deepest = std::max(deepest, reach - std::sqrt(squared));
    }
  return deepest;
}

// The same sizes, each tried at random places against all that are there.
std::vector<Sphere> PackWithAllPairs(const Parameters& p, const std::vector<Sphere>& sizes)
{
  Random places(p.seed, 1);
  std::vector<Sphere> spheres;
  for (const Sphere& size : sizes) {
    const double radius = size.radius;
    for (;;) {
      Vector3d place;
      for (int axis = 0; axis < 3; ++axis)
        place[axis] = places.Uniform(p.boxMin[axis] + radius, p.boxMax[axis] - radius);
      const bool free = std::none_of(spheres.begin(), spheres.end(), [&](const Sphere& other) {
        const double reach = radius + other.radius;
        return (other.centre - place).squaredNorm() < reach * reach;
      });
      if (free) {
        spheres.push_back({place, radius});
        break;
      }
    }
  }
  return spheres;
}

void Measure(const std::string& name, const std::string& method, const Parameters& p, int runs)
{
  SpherePacking packing;
  const std::clock_t before = std::clock();
  const double seconds = benchmark::MedianSeconds([&] { packing = PackSpheres(p); }, runs);
  const double cpuSeconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / (runs + 1); // and the warm-up
  benchmark::Report("packing", name, method, seconds, DeepestOverlap(packing.spheres), "deepest overlap, mm",
                    {{"cpu_seconds", cpuSeconds},
                     {"spheres", packing.spheres.size()},
                     {"fill_fraction", packing.fillFraction},
                     {"tries", packing.tries},
                     {"saturated", packing.saturated}});
}

} // namespace

int main()
{
  Parameters mixed; // radii of one to ten
  mixed.radii = Parameters::Radii::PowerLaw;
  mixed.exponent = 3.0;
  mixed.radiusMin = 0.27;
  mixed.radiusMax = 2.7;
  Measure("sizes 1 to 10", "random", mixed, 3);

  Parameters narrow;
  narrow.radii = Parameters::Radii::Uniform;
  narrow.radiusMin = 0.35;
  narrow.radiusMax = 0.97;
  Measure("sizes 1 to 3", "random", narrow, 3);

  Parameters manna = narrow;
  manna.method = Parameters::Method::EmptySpace;
  manna.radiusMin = 0.315;
  manna.radiusMax = 0.945;
  Measure("sizes 1 to 3", "empty space", manna, 3);

  Parameters equal;
  equal.radiusMin = equal.radiusMax = 0.7101;
  Measure("equal sizes, near their saturation", "random", equal, 1);

  // The plain check, in a twentieth of the box.
  Parameters small = narrow;
  small.boxMax.z() = small.boxMin.z() + 5.0;
  const SpherePacking sizes = PackSpheres(small);
  std::vector<Sphere> plain;
  const auto [ours, theirs] =
      benchmark::Duel([&] { PackSpheres(small); }, [&] { plain = PackWithAllPairs(small, sizes.spheres); }, 3);
  benchmark::Report("packing", "sizes 1 to 3, a twentieth", "random", ours, DeepestOverlap(sizes.spheres), "deepest overlap, mm",
                    {{"spheres", sizes.spheres.size()}, {"fill_fraction", sizes.fillFraction}});
  benchmark::Report("packing", "sizes 1 to 3, a twentieth", "random, all pairs", theirs, DeepestOverlap(plain),
                    "deepest overlap, mm", {{"spheres", plain.size()}, {"seconds_scaled_to_all", 400.0 * theirs}});

  PackedTissueParameters tissue;
  tissue.packing = mixed;
  TissueSurface surface;
  const std::vector<Sphere> spheres = PackSpheres(mixed).spheres;
  const double seconds = benchmark::MedianSeconds([&] { surface = MeshSpheres(tissue, spheres); }, 3);
  benchmark::ReportTime("packing", "sizes 1 to 10", "meshes for a cell of 1 mm", seconds,
                        {{"spheres", spheres.size()}, {"triangles", surface.triangles.size()}});
}
