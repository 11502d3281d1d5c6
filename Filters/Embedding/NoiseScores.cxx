// SPDX-License-Identifier: BSD-3-Clause
//
// Speckle is told from the rest by two local numbers, the mean and the deviation, which every sample has anyway. The level below
// which it is too dark to be speckle comes from a histogram of local means in which each sample counts by its power: there a
// little tissue outweighs much water.
#include "NoiseScores.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace echorama {

namespace {

constexpr double flat = 0.05; // of the whole deviation: below this there is no texture
// Developed speckle has a deviation of 0.52 of its mean, less after compression. Walls and wires among
// darkness, and darkness that is cut off at black, have more; what is smooth has less.
constexpr double mostSpeckleContrast = 0.75, leastSpeckleContrast = 0.05;
constexpr double darkestSpeckle = 1.0 / 6.0; // of the level of the speckle: water and shadows are darker

constexpr std::size_t levels = 320; // eight to the octave
constexpr std::size_t bins = 8192;  // of standardised values
constexpr double binsReach = 8.0, binsPerUnit = bins / (2.0 * binsReach);

std::size_t Bin(float value)
{
  const double bin = (static_cast<double>(value) + binsReach) * binsPerUnit;
  return static_cast<std::size_t>(std::min(std::max(bin, 0.0), static_cast<double>(bins - 1)));
}

} // namespace

NoiseScores::NoiseScores(VolumeView<const float> beams, VolumeView<const unsigned char> valid)
  : beams_(beams), valid_(valid), scores_(beams.Dimensions())
{
  CountReal();
}

bool NoiseScores::IsReal(std::ptrdiff_t i) const
{
  return (valid_.Empty() || valid_[i] != 0) && std::isfinite(beams_[i]);
}

void NoiseScores::KeepSpeckle(const LocalStatistics& local, double step)
{
  const auto& n = beams_.Dimensions();
  speckle_ = Volume<unsigned char>(n);
  const VolumeView<unsigned char> stays = speckle_.View();
  const bool echoes = least_ >= 0.0f;
  // The power of what may be speckle by the level of its local mean, eight levels to the octave.
  struct Levels {
    std::vector<double> power = std::vector<double>(levels);
    Levels& operator+=(const Levels& other)
    {
      for (std::size_t level = 0; level < levels; ++level)
        power[level] += other.power[level];
      return *this;
    }
  };
  const auto levelOf = [this](float mean) {
    const double octaves = std::log2(std::max(static_cast<double>(mean / greatest_), 1e-12));
    return static_cast<std::size_t>(std::clamp(static_cast<double>(levels) + 8.0 * octaves, 0.0, levels - 1.0));
  };
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const Levels found = ParallelSum<Levels>(rows, 1024, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    Levels part;
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      local.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), 0, n[0], mean.data(), deviation.data());
      for (int i = 0; i < n[0]; ++i) {
        const float m = mean[static_cast<std::size_t>(i)], s = deviation[static_cast<std::size_t>(i)];
        const bool isSpeckle =
            IsReal(row * n[0] + i) && s > static_cast<float>(step) && m + s <= greatest_ && m - s >= least_ - 0.5f * s &&
            (!echoes ||
             (s <= static_cast<float>(mostSpeckleContrast) * m && s >= static_cast<float>(leastSpeckleContrast) * (m - least_)));
        stays[row * n[0] + i] = isSpeckle;
        if (isSpeckle && echoes)
          part.power[levelOf(m)] += static_cast<double>(m) * static_cast<double>(m);
      }
    }
    return part;
  });
  if (const double all = std::accumulate(found.power.begin(), found.power.end(), 0.0); all > 0.0) {
    std::size_t middle = 0;
    for (double below = 0.0; middle + 1 < levels && (below += found.power[middle]) < 0.5 * all;)
      ++middle;
    const auto level = static_cast<double>(greatest_) * std::exp2((static_cast<double>(middle) - levels) / 8.0);
    const auto least = static_cast<float>(darkestSpeckle * level);
    ParallelRanges(rows, 64, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      std::vector<float> mean(static_cast<std::size_t>(n[0]));
      for (std::ptrdiff_t row = begin; row < end; ++row) {
        local.Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), 0, n[0], mean.data(), nullptr);
        for (int i = 0; i < n[0]; ++i)
          if (mean[static_cast<std::size_t>(i)] < least)
            stays[row * n[0] + i] = 0;
      }
    });
  }
  valid_ = stays;
  CountReal();
  const VolumeView<float> scores = scores_.View();
  ParallelRanges(scores.Size(), 1 << 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i)
      scores[i] = stays[i] ? scores[i] : std::numeric_limits<float>::quiet_NaN();
  });
  Count();
}

void NoiseScores::Standardise(const Eigen::Vector3d& window, std::optional<LocalStatistics>& local, const Progress& progress)
{
  local = LocalStatistics(beams_, valid_, window.cwiseInverse(), 1.0, progress.Part(0.0, 0.4), 0.0, false,
                          local ? &*local : nullptr, &mean_);
  const auto& n = beams_.Dimensions();
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  const VolumeView<float> scores = scores_.View();
  // The deviation about the local means decides what is flat.
  struct Squares {
    double sum = 0.0;
    Squares& operator+=(const Squares& other)
    {
      sum += other.sum;
      return *this;
    }
  };
  const auto forRow = [&](std::ptrdiff_t row, std::vector<float>& mean, std::vector<float>& deviation) {
    local->Row(static_cast<int>(row % n[1]), static_cast<int>(row / n[1]), 0, n[0], mean.data(), deviation.data());
    return row * n[0];
  };
  const Squares squares = ParallelSum<Squares>(rows, 64, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    Squares part;
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const std::ptrdiff_t first = forRow(row, mean, deviation);
      for (int i = 0; i < n[0]; ++i)
        if (IsReal(first + i)) {
          const double rest = static_cast<double>(beams_[first + i] - mean[static_cast<std::size_t>(i)]);
          part.sum += rest * rest;
        }
    }
    return part;
  });
  deviation_ = real_ > 0.0 ? std::sqrt(squares.sum / real_) : 0.0;
  const auto floor = static_cast<float>(std::max(flat * deviation_, 1e-5 * std::abs(mean_)));
  ParallelRanges(rows, 64, progress.Part(0.4, 0.8), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> mean(static_cast<std::size_t>(n[0])), deviation(mean.size());
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const std::ptrdiff_t first = forRow(row, mean, deviation);
      for (int i = 0; i < n[0]; ++i) {
        const auto at = static_cast<std::size_t>(i);
        scores[first + i] = IsReal(first + i) && deviation[at] > floor ? (beams_[first + i] - mean[at]) / deviation[at]
                                                                       : std::numeric_limits<float>::quiet_NaN();
      }
    }
  });
  Count();
}

double NoiseScores::Quantile(double probability) const
{
  const double wanted = probability * static_cast<double>(used_);
  double below = 0.0;
  for (std::size_t b = 0; b < histogram_.size(); ++b) {
    const double count = static_cast<double>(histogram_[b]);
    if (count > 0.0 && below + count >= wanted)
      return (static_cast<double>(b) + std::max(0.0, (wanted - below) / count)) / binsPerUnit - binsReach;
    below += count;
  }
  return binsReach;
}

void NoiseScores::Rank()
{
  std::vector<float> table(bins);
  double below = 0.0;
  for (std::size_t b = 0; b < bins; ++b) {
    const double rank = (below + 0.5 * static_cast<double>(histogram_[b])) / static_cast<double>(used_);
    table[b] = static_cast<float>(std::sqrt(-2.0 * std::log1p(-std::min(rank, 1.0 - 1e-12))) - 1.2533141373155003);
    below += static_cast<double>(histogram_[b]);
  }
  const VolumeView<float> scores = scores_.View();
  ParallelRanges(scores.Size(), 1 << 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i)
      if (!std::isnan(scores[i]))
        scores[i] = table[Bin(scores[i])];
  });
}

void NoiseScores::CountReal()
{
  struct Sums {
    double count = 0.0, first = 0.0;
    float least = std::numeric_limits<float>::infinity(), greatest = -std::numeric_limits<float>::infinity();
    Sums& operator+=(const Sums& other)
    {
      count += other.count;
      first += other.first;
      least = std::min(least, other.least);
      greatest = std::max(greatest, other.greatest);
      return *this;
    }
  };
  const Sums sums = ParallelSum<Sums>(beams_.Size(), 1 << 16, [this](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Sums part;
    for (std::ptrdiff_t i = begin; i < end; ++i)
      if (IsReal(i)) {
        part.count += 1.0;
        part.first += static_cast<double>(beams_[i]);
        part.least = std::min(part.least, beams_[i]);
        part.greatest = std::max(part.greatest, beams_[i]);
      }
    return part;
  });
  least_ = sums.least;
  greatest_ = sums.greatest;
  real_ = sums.count;
  mean_ = sums.count > 0.0 ? sums.first / sums.count : 0.0;
}

void NoiseScores::Count()
{
  struct Histogram {
    std::vector<std::ptrdiff_t> counts = std::vector<std::ptrdiff_t>(bins);
    Histogram& operator+=(const Histogram& other)
    {
      for (std::size_t b = 0; b < bins; ++b)
        counts[b] += other.counts[b];
      return *this;
    }
  };
  const VolumeView<const float> scores = View();
  histogram_ = ParallelSum<Histogram>(scores.Size(), 1 << 20, [&scores](std::ptrdiff_t begin, std::ptrdiff_t end) {
                 Histogram part;
                 for (std::ptrdiff_t i = begin; i < end; ++i)
                   if (!std::isnan(scores[i]))
                     ++part.counts[Bin(scores[i])];
                 return part;
               }).counts;
  used_ = 0;
  for (const std::ptrdiff_t count : histogram_)
    used_ += count;
}

} // namespace echorama
