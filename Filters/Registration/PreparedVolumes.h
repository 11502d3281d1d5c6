// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "LocalAlign.h"
#include "PlacedVolume.h"
#include "PreparedVolume.h"
#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// What an alignment of many volumes may use. What it finds does not depend on it.
struct AlignResources {
  double memoryGb = 0.0;
  std::string finishedPairs; ///< a file
};

ParameterList Describe(AlignResources& p);

double BudgetBytes(const AlignResources& resources); ///< of memory, now

/// A volume whose resolutions are made when they are needed, and again when the memory for them did not last.
struct VolumeOnDemand {
  PlacedVolume placed; ///< what is known of it; its resolutions are used where there is no `prepare`
  std::function<PreparedVolume(bool withReliability, const Progress& progress)> prepare; ///< the same each time
  std::string content; ///< a checksum of all that `prepare` depends on; empty: not known
};

/// All that a pair asks of a volume.
struct AlignableVolume {
  PlacedVolume placed; ///< its resolutions lie in `prepared` or are the caller's
  PreparedVolume prepared;
  std::shared_ptr<const MetricPyramid> features;

  /// Makes it. \throws as BuildMetricPyramid and `prepare`
  static std::shared_ptr<const AlignableVolume> Of(const VolumeOnDemand& volume, const std::string& metric,
                                                   const Progress& progress = {});
  PlacedVolume At(const Pose& volumeToWorld) const;
  double Bytes() const; ///< of what was made for it
};

/// Keeps what was made of volumes while a budget of memory lasts; what was not asked for the longest goes first.
///
/// The two that were asked for last are always kept, whatever the budget. What is asked for does not depend on it.
class PreparedVolumes {
public:
  using Made = std::shared_ptr<const AlignableVolume>;
  using Maker = std::function<Made(int volume, const Progress& progress)>;

  PreparedVolumes(double budgetBytes, Maker maker) : budgetBytes_(budgetBytes), maker_(std::move(maker)) {}

  Made Get(int volume, const Progress& progress = {});
  /// Makes those of \a volumes that are not kept side by side, if all have room. One that cannot be made is left to whoever asks
  /// for it.
  void MakeAhead(const std::set<int>& volumes, const Progress& progress = {});
  /// Whether these fit, as large as the largest so far, beside all that is kept, unless they are among that.
  bool HasRoomFor(const std::set<int>& volumes) { return bytes_ + Missing(volumes).size() * largestBytes_ <= budgetBytes_; }
  double Seconds() const { return seconds_; } ///< by the clock, while volumes were made

  int TimesMade() const { return timesMade_; }
  double LargestBytes() const { return largestBytes_; } ///< of one volume
  double PeakBytes() const { return peakBytes_; }       ///< the most that was kept at once

private:
  struct Kept {
    int volume;
    Made made;
    double bytes;
  };
  std::list<Kept>::iterator Find(int volume);
  std::vector<int> Missing(const std::set<int>& volumes);
  void Make(const std::vector<int>& volumes, bool isAsked, const Progress& progress);
  void MakeRoom(double bytes);

  const double budgetBytes_;
  const Maker maker_;
  std::list<Kept> kept_; // the last asked for first
  double bytes_ = 0.0, largestBytes_ = 0.0, peakBytes_ = 0.0, seconds_ = 0.0;
  int timesMade_ = 0;
};

/// \a pairs in an order in which each volume's follow soon after each other, so that few volumes are made twice. It depends on
/// nothing but the pairs.
std::vector<std::pair<int, int>> OrderedForReuse(std::vector<std::pair<int, int>> pairs);

/// How often volumes are made when pairs are aligned in this order and \a kept volumes (at least two) are kept.
int TimesMade(const std::vector<std::pair<int, int>>& pairs, int kept);

} // namespace echorama
