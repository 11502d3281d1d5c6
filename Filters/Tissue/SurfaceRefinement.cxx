// SPDX-License-Identifier: BSD-3-Clause
// Passes over the triangles, each of which halves what is too long. A triangle with one, two or three such edges becomes two,
// three or four; the pass after it sees to what is still too long, so there are about as many as the logarithm of the longest
// edge.
#include "SurfaceRefinement.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include <unordered_map>

namespace echorama {
namespace {

class Refinement {
public:
  Refinement(TissueSurface& surface, double longestMm, const Eigen::AlignedBox3d& region)
    : surface_(surface), longestSquared_(longestMm * longestMm), region_(region)
  {
  }

  // Whether anything was too long.
  bool Pass()
  {
    middles_.clear();
    triangles_.clear();
    bodies_.clear();
    for (std::size_t n = 0; n < surface_.triangles.size(); ++n)
      Divide(surface_.triangles[n], surface_.bodyOfTriangle[n]);
    const bool changed = triangles_.size() != surface_.triangles.size();
    surface_.triangles.swap(triangles_);
    surface_.bodyOfTriangle.swap(bodies_);
    constexpr std::size_t most = 2147483647;
    if (surface_.points.size() > most || surface_.triangles.size() > most)
      throw Error(Error::Kind::TooLarge, "a surface would have more than 2^31 triangles with edges this short");
    return changed;
  }

private:
  using Triangle = std::array<std::uint32_t, 3>;
  static constexpr std::uint32_t whole = 0xffffffffu;

  // The point in the middle of an edge that is too long.
  std::uint32_t MiddleOf(std::uint32_t a, std::uint32_t b)
  {
    const Eigen::Vector3d from = surface_.points[a].cast<double>(), to = surface_.points[b].cast<double>();
    if ((to - from).squaredNorm() <= longestSquared_)
      return whole;
    if (!region_.isEmpty() && !Eigen::AlignedBox3d(from.cwiseMin(to), from.cwiseMax(to)).intersects(region_))
      return whole;
    const std::uint64_t key = static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
    const auto [place, isNew] = middles_.try_emplace(key, static_cast<std::uint32_t>(surface_.points.size()));
    if (isNew)
      surface_.points.push_back((0.5 * (from + to)).cast<float>());
    return place->second;
  }

  void Divide(const Triangle& corner, std::int32_t body)
  {
    const auto add = [this, body](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      triangles_.push_back({a, b, c});
      bodies_.push_back(body);
    };
    // Of the edges opposite the corners.
    const Triangle middle{MiddleOf(corner[1], corner[2]), MiddleOf(corner[2], corner[0]), MiddleOf(corner[0], corner[1])};
    const int count = (middle[0] != whole) + (middle[1] != whole) + (middle[2] != whole);
    if (count == 0) {
      add(corner[0], corner[1], corner[2]);
      return;
    }
    if (count == 3) {
      add(corner[0], middle[2], middle[1]);
      add(corner[1], middle[0], middle[2]);
      add(corner[2], middle[1], middle[0]);
      add(middle[0], middle[1], middle[2]);
      return;
    }
    // Turned so that the odd edge out, divided alone or not divided, lies opposite the first corner.
    std::size_t odd = 0;
    while ((middle[odd] != whole) != (count == 1))
      ++odd;
    const std::uint32_t a = corner[odd], b = corner[(odd + 1) % 3], c = corner[(odd + 2) % 3];
    if (count == 1) {
      add(a, b, middle[odd]);
      add(a, middle[odd], c);
    } else {
      const std::uint32_t ca = middle[(odd + 1) % 3], ab = middle[(odd + 2) % 3];
      add(a, ab, ca);
      add(ab, b, c);
      add(ab, c, ca);
    }
  }

  TissueSurface& surface_;
  double longestSquared_;
  Eigen::AlignedBox3d region_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
  std::vector<Triangle> triangles_;
  std::vector<std::int32_t> bodies_;
};

} // namespace

void RefineSurface(TissueSurface& surface, double longestMm, const Eigen::AlignedBox3d& region)
{
  CheckRange("the longest edge (mm)", longestMm, 1e-3, 1e9);
  Refinement refinement(surface, longestMm, region);
  while (refinement.Pass())
    ;
}

} // namespace echorama
