// SPDX-License-Identifier: BSD-3-Clause
#include "OverlappingPairs.h"
#include "Core/Base/Parallel.h"
#include "Index.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int Points = 1000; // of a volume

// A point lies in a volume when the voxel nearest to it is real: half a voxel beyond the centres, and a little for rounding.
TurnedBox BoxOf(const PyramidLevel& level)
{
  const VolumeView<const float> view = level.intensity.View();
  const auto& n = view.Dimensions();
  Eigen::AlignedBox3d box;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (std::isfinite(view(i, j, k)))
          box.extend(Eigen::Vector3d(i, j, k));
  TurnedBox result;
  if (box.isEmpty())
    return result;
  result.axes = level.geometry.direction;
  result.centre = level.geometry.IndexToWorld() * box.center();
  result.half = (0.5 * box.sizes().array() + 0.51).matrix().cwiseProduct(level.geometry.spacing);
  return result;
}

} // namespace

VolumeOutline::VolumeOutline(const PlacedVolume& volume)
  : coarsest(volume.pyramid->back()), shape(volume), points(volume, Points), box(BoxOf(coarsest))
{
}

TurnedBox VolumeOutline::BoxAt(const Pose& volumeToWorld) const
{
  return {volumeToWorld.linear() * box.axes, volumeToWorld * box.centre, box.half};
}

double OverlapOf(const VolumeOutline& a, const Pose& aToWorld, const VolumeOutline& b, const Pose& bToWorld)
{
  return std::max(OverlapOf(b.points, bToWorld, {{&a.coarsest, aToWorld}}),
                  OverlapOf(a.points, aToWorld, {{&b.coarsest, bToWorld}}));
}

std::vector<OverlappingPair> OverlappingPairs(const std::vector<VolumeOutline>& volumes, const std::vector<Pose>& poses,
                                              double reachMm, double minimumOverlap, const std::function<bool(int, int)>& isAsked)
{
  std::vector<TurnedBox> turned;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    turned.push_back(volumes[v].BoxAt(poses[v]));
    const Eigen::AlignedBox3d box = turned.back().Bounds();
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(0.5 * reachMm + 1e-6);
    boxes.emplace_back(box.min() - reach, box.max() + reach);
  }
  std::vector<OverlappingPair> pairs;
  for (const auto& [a, b] : PairsThatMeet(boxes))
    if (isAsked(a, b))
      pairs.push_back({a, b});
  ParallelFor(static_cast<std::ptrdiff_t>(pairs.size()), [&](std::ptrdiff_t i) {
    OverlappingPair& pair = pairs[Index(i)];
    const auto a = Index(pair.a), b = Index(pair.b);
    const VolumeShape &first = volumes[a].shape, &second = volumes[b].shape;
    const Eigen::Vector3d way = poses[a] * first.centroid - poses[b] * second.centroid;
    const double distance = way.norm();
    if (distance - reachMm > first.reach + second.reach)
      return; // their spheres do not meet
    const auto overlapAt = [&](const Eigen::Vector3d& shift) {
      TurnedBox moved = turned[b];
      moved.centre += shift;
      return Meet(turned[a], moved) ? OverlapOf(volumes[a], poses[a], volumes[b], Eigen::Translation3d(shift) * poses[b]) : 0.0;
    };
    pair.overlap = overlapAt(Eigen::Vector3d::Zero());
    if (pair.overlap < minimumOverlap && reachMm > 0.0 && distance > 0.0) {
      pair.overlap = overlapAt(way * std::min(1.0, reachMm / distance));
      pair.isFar = true;
    }
  });
  pairs.erase(
      std::remove_if(pairs.begin(), pairs.end(), [&](const OverlappingPair& pair) { return pair.overlap < minimumOverlap; }),
      pairs.end());
  return pairs;
}

std::vector<std::pair<int, int>> MostOverlapping(const std::vector<OverlappingPair>& all, int volumes, int most, int enough)
{
  using Ranked = std::pair<double, std::pair<int, int>>; // minus the overlap
  std::vector<std::vector<Ranked>> near(Index(volumes)), far(Index(volumes));
  for (const OverlappingPair& pair : all)
    for (const int v : {pair.a, pair.b})
      (pair.isFar ? far : near)[Index(v)].push_back({-pair.overlap, {pair.a, pair.b}});
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t v = 0; v < near.size(); ++v) {
    std::sort(near[v].begin(), near[v].end());
    std::sort(far[v].begin(), far[v].end());
    near[v].resize(std::min(near[v].size(), Index(most)));
    for (const Ranked& ranked : far[v])
      if (near[v].size() < Index(std::min(enough, most)))
        near[v].push_back(ranked);
    for (const Ranked& ranked : near[v])
      pairs.push_back(ranked.second);
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

} // namespace echorama
