// SPDX-License-Identifier: BSD-3-Clause
// The order of pairs is that of Cuthill and McKee (1969): volumes are numbered outwards from one at the rim of what overlaps, so
// that those which overlap have numbers close to each other. Of a sweep in rows about two rows need to be kept.
#include "PreparedVolumes.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Core/Base/Memory.h"
#include "Core/Sharing/SideBySide.h"
#include "Index.h"
#include "Metric.h"
#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace echorama {
namespace {

double BytesOf(const std::vector<PyramidLevel>& levels)
{
  double bytes = 0.0;
  for (const PyramidLevel& level : levels)
    bytes += static_cast<double>(level.geometry.VoxelCount()) * sizeof(float);
  return bytes;
}

template <class T, class Memory>
double BytesOf(const std::vector<T, Memory>& values)
{
  return static_cast<double>(values.capacity()) * sizeof(T);
}

using Neighbours = std::map<int, std::vector<int>>; // of each volume, in ascending order

// From `start` outwards, those with few neighbours first.
std::vector<int> Outwards(const Neighbours& neighbours, int start)
{
  std::vector<int> order{start};
  std::map<int, bool> isSeen{{start, true}};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto begin = static_cast<std::ptrdiff_t>(order.size());
    for (const int other : neighbours.at(order[i]))
      if (!std::exchange(isSeen[other], true))
        order.push_back(other);
    std::stable_sort(order.begin() + begin, order.end(),
                     [&](int a, int b) { return neighbours.at(a).size() < neighbours.at(b).size(); });
  }
  return order;
}

} // namespace

ParameterList Describe(AlignResources& p)
{
  return {Parameter("MemoryGb", p.memoryGb, {0, 1e6}, "GB",
                    "How much memory may hold what is made of volumes for their pairs. Where it does not last, volumes are "
                    "prepared again: that takes longer and finds the same. 0: half of what is free.")
              .Advanced(),
          Parameter("FinishedPairs", p.finishedPairs,
                    "A file in which aligned pairs are kept. A run that was stopped goes on from there, and pairs of which "
                    "nothing has changed are not aligned again.")
              .Advanced()};
}

double BudgetBytes(const AlignResources& resources)
{
  return resources.memoryGb > 0.0 ? resources.memoryGb * 1e9 : 0.5 * FreeMemory();
}

std::shared_ptr<const AlignableVolume> AlignableVolume::Of(const VolumeOnDemand& volume, const std::string& metric,
                                                           const Progress& progress)
{
  auto made = std::make_shared<AlignableVolume>();
  made->placed = volume.placed;
  if (volume.prepare) {
    made->prepared = volume.prepare(true, progress.Part(0.0, 0.8));
    made->placed.pyramid = &made->prepared.pyramid;
    made->placed.reliability = made->prepared.reliability.empty() ? nullptr : &made->prepared.reliability;
  }
  made->features = BuildMetricPyramid(made->placed, metric, progress.Part(volume.prepare ? 0.8 : 0.0, 1.0));
  return made;
}

PlacedVolume AlignableVolume::At(const Pose& volumeToWorld) const
{
  PlacedVolume moved = placed;
  moved.volumeToWorld = volumeToWorld;
  return moved;
}

double AlignableVolume::Bytes() const
{
  double bytes = BytesOf(prepared.pyramid) + BytesOf(prepared.reliability);
  for (const MetricLevel& level : features->levels)
    bytes += BytesOf(level.seen) + BytesOf(level.edges) + BytesOf(level.descriptors) + BytesOf(level.realBefore);
  return bytes;
}

PreparedVolumes::Made PreparedVolumes::Get(int volume, const Progress& progress)
{
  if (Find(volume) == kept_.end()) {
    MakeRoom(largestBytes_); // before it is made, so that the budget holds meanwhile
    Make({volume}, true, progress);
  }
  kept_.splice(kept_.begin(), kept_, Find(volume));
  return kept_.front().made;
}

void PreparedVolumes::MakeAhead(const std::set<int>& volumes, const Progress& progress)
{
  if (HasRoomFor(volumes))
    Make(Missing(volumes), false, progress);
}

std::list<PreparedVolumes::Kept>::iterator PreparedVolumes::Find(int volume)
{
  return std::find_if(kept_.begin(), kept_.end(), [volume](const Kept& kept) { return kept.volume == volume; });
}

std::vector<int> PreparedVolumes::Missing(const std::set<int>& volumes)
{
  std::vector<int> missing;
  std::copy_if(volumes.begin(), volumes.end(), std::back_inserter(missing), [this](int v) { return Find(v) == kept_.end(); });
  return missing;
}

void PreparedVolumes::Make(const std::vector<int>& volumes, bool isAsked, const Progress& progress)
{
  const Clock::time_point start = Clock::now();
  std::vector<Made> made(volumes.size());
  SideBySide(static_cast<std::ptrdiff_t>(volumes.size()), progress, [&](std::ptrdiff_t i, const Progress& part) {
    try {
      made[Index(i)] = maker_(volumes[Index(i)], part);
    } catch (const Error& error) {
      if (isAsked || error.GetKind() == Error::Kind::Cancelled)
        throw;
    }
  });
  seconds_ += SecondsSince(start);
  for (std::size_t i = 0; i < made.size(); ++i)
    if (made[i]) {
      ++timesMade_;
      const double bytes = made[i]->Bytes();
      MakeRoom(bytes);
      kept_.push_front({volumes[i], made[i], bytes});
      bytes_ += bytes;
      largestBytes_ = std::max(largestBytes_, bytes);
      peakBytes_ = std::max(peakBytes_, bytes_);
    }
}

void PreparedVolumes::MakeRoom(double bytes)
{
  while (kept_.size() > 1 && bytes_ + bytes > budgetBytes_) {
    bytes_ -= kept_.back().bytes;
    kept_.pop_back();
  }
}

std::vector<std::pair<int, int>> OrderedForReuse(std::vector<std::pair<int, int>> pairs)
{
  Neighbours neighbours;
  for (const auto& [a, b] : pairs) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  for (auto& [volume, others] : neighbours)
    std::sort(others.begin(), others.end());
  std::map<int, std::size_t> place;
  for (const auto& [volume, others] : neighbours)
    if (place.count(volume) == 0) { // a part of its own; the last that is reached from anywhere lies at its rim
      const int end = Outwards(neighbours, volume).back(), rim = std::min(end, Outwards(neighbours, end).back());
      for (const int v : Outwards(neighbours, rim))
        place.emplace(v, place.size());
    }
  const auto key = [&place](const std::pair<int, int>& pair) {
    const auto [low, high] = std::minmax(place.at(pair.first), place.at(pair.second));
    return std::make_pair(high, low);
  };
  std::sort(pairs.begin(), pairs.end(),
            [&key](const std::pair<int, int>& a, const std::pair<int, int>& b) { return key(a) < key(b); });
  return pairs;
}

int TimesMade(const std::vector<std::pair<int, int>>& pairs, int kept)
{
  std::list<int> volumes; // the last asked for first
  std::map<int, std::list<int>::iterator> where;
  int made = 0;
  for (const auto& pair : pairs)
    for (const int v : {pair.first, pair.second}) {
      const auto found = where.find(v);
      if (found != where.end()) {
        volumes.splice(volumes.begin(), volumes, found->second);
        continue;
      }
      ++made;
      volumes.push_front(v);
      where[v] = volumes.begin();
      if (static_cast<int>(volumes.size()) > std::max(2, kept)) {
        where.erase(volumes.back());
        volumes.pop_back();
      }
    }
  return made;
}

} // namespace echorama
