// SPDX-License-Identifier: BSD-3-Clause
// A bound of the error that a residual r leaves. A is an M-matrix: where A w >= part (|r| + floor), no error is larger than
// w / part. Any such w will do, and it costs less than a cycle to find one: |r| is summed up on the next coarser level and
// solved for there; the result is interpolated and swept a few times, and then A w is looked at everywhere. What it lacks it
// lacks at few voxels, where multigrid is rough: these are raised one by one, which lowers A w beside them, until nothing is
// lacking there either. The floor is what a smooth w may be wrong by.
//
// That is some hundred times sharper than the largest residual times the longest time that heat spends in the overlap: large
// residuals are rare.
#include "MembraneLanes.h"
#include "MembraneLevels.h"
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr int SpreadSweeps = 3;
constexpr float Upwards = 1.0f + 1e-6f; // more than a float is rounded by

void RaiseRow(float* r, const unsigned char* codes, float floor, int begin, int end)
{
  for (int i = begin; i < end; ++i)
    r[i] = (codes[i] & MembraneCounts) != 0 ? std::abs(r[i]) * Upwards + floor : 0.0f;
}

// How many unknowns of a row have A w < part s (some may count twice), and their largest w.
int CountLacking(const float* w, const float* below, const float* above, const float* before, const float* behind, const float* s,
                 const unsigned char* codes, double wx, double wy, double wz, double part, int begin, int end,
                 float* __restrict largest)
{
  int lacking[MembraneByteLanes] = {};
  float most[MembraneByteLanes] = {};
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int l, float) __attribute__((always_inline)) {
        const int code = codes[i];
        const double sum = wx * (static_cast<double>(w[i - 1]) + static_cast<double>(w[i + 1])) +
                           wy * (static_cast<double>(below[i]) + static_cast<double>(above[i])) +
                           wz * (static_cast<double>(before[i]) + static_cast<double>(behind[i]));
        const double diagonal = wx * (code & 3) + wy * ((code >> 2) & 3) + wz * ((code >> 4) & 3);
        lacking[l] += diagonal * static_cast<double>(w[i]) - sum < part * static_cast<double>(s[i]) ? 1 : 0;
        most[l] = w[i] > most[l] ? w[i] : most[l];
      });
  int count = 0;
  for (int l = 0; l < MembraneByteLanes; ++l) {
    count += lacking[l];
    *largest = std::max(*largest, most[l]);
  }
  return count;
}

} // namespace

double MembraneLevels::SpreadCoarsely(float floor, int finest)
{
  Level& level = levels_.front();
  const auto largest = [](const Zeroed<float>& value) {
    return static_cast<double>(*std::max_element(value.begin(), value.end()));
  };
  if (Count() == 1) {
    const Zeroed<float> residuals = level.right;
    RaiseRow(level.right.data(), codes_.data(), floor, 0, static_cast<int>(level.right.size()));
    SolveCoarsest();
    level.right = residuals;
    return largest(level.value);
  }
  SumUp(0, [&](const MembraneRows::Row& row, float* to) {
    thread_local std::vector<float> raised;
    raised.assign(level.right.begin() + row.at + row.begin, level.right.begin() + row.at + row.end);
    float* from = raised.data() - row.begin;
    RaiseRow(from, codes_.data() + row.at, floor, row.begin, row.end);
    AddToCells(from, 1.0f, row.begin, row.end, level.halved[0], to);
  });
  for (int number = 1; number + 1 < Count(); ++number)
    Aggregate(number, 1.0f);
  SolveCoarsest();
  for (int number = Count() - 2; number >= finest; --number) {
    Prolong(number, false);
    Cycle(number, true, {});
  }
  return largest(levels_[static_cast<std::size_t>(std::min(finest, Count() - 1))].value);
}

double MembraneLevels::SpreadFinely(float floor, double part)
{
  const MembraneRows& rows = Rows();
  std::vector<float> largest(static_cast<std::size_t>(rows.size[1]), 0.0f);
  std::vector<std::vector<Place>> lacking(largest.size());
  const auto look = [&](int z) {
    const auto slice = static_cast<std::size_t>(z - rows.low[1]);
    lacking[slice].clear();
    for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
      const auto& row = rows.At(y, z);
      if (row.begin >= row.end)
        continue;
      const float* w = levels_.front().value.data();
      if (CountLacking(w + row.at, w + rows.At(y - 1, z).at, w + rows.At(y + 1, z).at, w + rows.At(y, z - 1).at,
                       w + rows.At(y, z + 1).at, levels_.front().right.data() + row.at, codes_.data() + row.at, weights_[0],
                       weights_[1], weights_[2], part, row.begin, row.end, &largest[slice]) > 0)
        for (int i = row.begin; i < row.end; ++i)
          if (Lack({i, y, z}, part) > 0.0)
            lacking[slice].push_back({i, y, z});
    }
  };
  const auto raise = [&](int z) {
    for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y)
      if (const auto& row = rows.At(y, z); row.begin < row.end)
        RaiseRow(levels_.front().right.data() + row.at, codes_.data() + row.at, floor, row.begin, row.end);
  };
  if (Count() == 1) {
    Sweep(rows, 1, [&](int, int z) { raise(z); });
    SolveCoarsest();
    Sweep(rows, 1, [&](int, int z) { look(z); });
  } else {
    FillVoids(1);
    // The last colour is the one that cycles relax last: its residuals are small, so that w is rough where s is large.
    const int halves = 2 * SpreadSweeps;
    Sweep(rows, halves + 2, [&](int stage, int z) {
      if (stage == 0) {
        raise(z);
        ProlongSlice(0, z, false);
      } else if (stage <= halves)
        RelaxSlice(0, z, stage & 1, false);
      else
        look(z);
    });
  }
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (attempt > 0)
      Cycle(0, true, look);
    std::vector<Place> places;
    for (const auto& slice : lacking)
      places.insert(places.end(), slice.begin(), slice.end());
    double most = static_cast<double>(*std::max_element(largest.begin(), largest.end()));
    if (Mend(std::move(places), part, most))
      return most / part;
  }
  return std::numeric_limits<double>::infinity();
}

// How much A w is short of part s.
double MembraneLevels::Lack(const Place& place, double part) const
{
  const auto& [x, y, z] = place;
  const Level& level = levels_.front();
  const auto own = static_cast<std::size_t>(level.rows.At(y, z).at + x);
  const int code = codes_[own];
  if ((code & MembraneCounts) == 0)
    return 0.0;
  const auto w = [&level](std::ptrdiff_t at) { return static_cast<double>(level.value[static_cast<std::size_t>(at)]); };
  const std::ptrdiff_t at = level.rows.At(y, z).at + x;
  double lack = part * static_cast<double>(level.right[own]);
  lack += weights_[0] * (w(at - 1) + w(at + 1) - (code & 3) * w(at));
  lack += weights_[1] * (w(level.rows.At(y - 1, z).at + x) + w(level.rows.At(y + 1, z).at + x) - ((code >> 2) & 3) * w(at));
  lack += weights_[2] * (w(level.rows.At(y, z - 1).at + x) + w(level.rows.At(y, z + 1).at + x) - ((code >> 4) & 3) * w(at));
  return lack;
}

bool MembraneLevels::Mend(std::vector<Place> places, double part, double& largest)
{
  const double more = 0.5 * (1.0 - part); // raised so far beyond what is needed that it can bear its neighbours' rise
  std::size_t most = 16 * places.size() + 1000;
  if (places.size() > static_cast<std::size_t>(levels_.front().unknowns / 50 + 1000))
    return false;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Place place = places[n];
    const double lack = Lack(place, part);
    if (lack <= 0.0)
      continue;
    if (n > most)
      return false;
    const auto& [x, y, z] = place;
    const auto at = static_cast<std::size_t>(Rows().At(y, z).at + x);
    const int code = codes_[at];
    const double diagonal = weights_[0] * (code & 3) + weights_[1] * ((code >> 2) & 3) + weights_[2] * ((code >> 4) & 3);
    float& w = levels_.front().value[at];
    w += static_cast<float>((lack + more * static_cast<double>(levels_.front().right[at])) / diagonal);
    largest = std::max(largest, static_cast<double>(w));
    if (Lack(place, part) > 0.0) // the step was rounded away
      return false;
    for (const Place& near :
         {Place{x - 1, y, z}, Place{x + 1, y, z}, Place{x, y - 1, z}, Place{x, y + 1, z}, Place{x, y, z - 1}, Place{x, y, z + 1}})
      if (Lack(near, part) > 0.0)
        places.push_back(near);
  }
  return true;
}

} // namespace echorama
