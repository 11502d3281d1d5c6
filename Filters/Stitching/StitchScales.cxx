// SPDX-License-Identifier: BSD-3-Clause
// One volume after the other, so that the maps or levels of one live at a time; what is kept are the scales of the overlap.
#include "StitchScales.h"
#include "BlendWeights.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

namespace echorama {

namespace {

// Spans of the overlap voxels of a volume; with a rim, also of their six neighbours.
std::shared_ptr<const RowSpans> OverlapSpans(const RegionMap& regions, int volume, bool rim)
{
  const GridBox& own = regions.Box(volume);
  const std::size_t rows = static_cast<std::size_t>(own.size[1]) * static_cast<std::size_t>(own.size[2]);
  std::vector<int> first(rows, 0), end(rows, 0);
  ForRows(own, Progress(), [&](int j, int k) {
    const unsigned char* inside = regions.MaskRow(volume, j, k) - own.first[0];
    const unsigned char* covered = regions.Coverage().At(own.first[0], j, k) - own.first[0];
    const auto shared = [&](int i) { return (inside[i] & 1) && covered[i] > 1; };
    int a = own.first[0], b = own.first[0] + own.size[0];
    while (a < b && !shared(a))
      ++a;
    while (b > a && !shared(b - 1))
      --b;
    const std::size_t row = static_cast<std::size_t>(k - own.first[2]) * static_cast<std::size_t>(own.size[1]) +
                            static_cast<std::size_t>(j - own.first[1]);
    first[row] = a < b ? a : 0;
    end[row] = a < b ? b : 0;
  });
  if (!rim)
    return std::make_shared<const RowSpans>(own, std::move(first), std::move(end));
  const RowSpans inner(own, std::move(first), std::move(end));
  GridBox grown;
  const auto& n = regions.Coverage().Dimensions();
  for (int axis = 0; axis < 3; ++axis) {
    grown.first[axis] = std::max(0, own.first[axis] - 1);
    grown.size[axis] = std::min(n[axis], own.first[axis] + own.size[axis] + 1) - grown.first[axis];
  }
  if (own.Empty())
    grown = GridBox{};
  std::vector<int> grownFirst, grownEnd;
  for (int k = grown.first[2]; k < grown.first[2] + grown.size[2]; ++k)
    for (int j = grown.first[1]; j < grown.first[1] + grown.size[1]; ++j) {
      int a = std::numeric_limits<int>::max(), b = -1;
      const int neighbours[5][3] = {{j, k, 1}, {j - 1, k, 0}, {j + 1, k, 0}, {j, k - 1, 0}, {j, k + 1, 0}};
      for (const auto& [y, z, beside] : neighbours)
        if (inner.First(y, z) < inner.End(y, z)) {
          a = std::min(a, inner.First(y, z) - beside);
          b = std::max(b, inner.End(y, z) + beside);
        }
      const bool any = b >= 0;
      grownFirst.push_back(any ? std::max(a, 0) : 0);
      grownEnd.push_back(any ? std::min(b, n[0]) : 0);
    }
  return std::make_shared<const RowSpans>(grown, std::move(grownFirst), std::move(grownEnd));
}

// A row of a squared distance map: infinite where the map has no row.
class Distance {
public:
  Distance(const Boxed<float>& map, int j, int k) : squared_(map.box.HasRow(j, k) ? map.Row(j, k) - map.box.first[0] : nullptr) {}
  float operator()(int i) const { return squared_ ? std::sqrt(squared_[i]) : std::numeric_limits<float>::infinity(); }

private:
  const float* squared_;
};

RowField<float> DistanceScale(const RegionMap& regions, int volume, const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, volume, false));
  if (scale.values.empty())
    return scale;
  const Boxed<float> pure = regions.SquaredDistanceTo(Region::Pure, volume, progress.Part(0.0, 0.45));
  const Boxed<float> empty = regions.SquaredDistanceTo(Region::Empty, volume, progress.Part(0.45, 0.9));
  ForRows(scale.spans->Box(), progress.Part(0.9, 1.0), [&](int j, int k) {
    float* out = scale.Row(j, k);
    const int start = regions.Box(volume).first[0];
    const unsigned char *covered = regions.Coverage().At(start, j, k) - start, *inside = regions.MaskRow(volume, j, k) - start;
    const Distance p(pure, j, k), e(empty, j, k);
    const int first = scale.spans->First(j, k);
    for (int i = first; i < scale.spans->End(j, k); ++i)
      if ((inside[i] & 1) && covered[i] > 1)
        out[i - first] = BlendScale(p(i), e(i));
  });
  return scale;
}

RowField<float> DepthScale(const RegionMap& regions, int volume, const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, volume, false));
  if (scale.values.empty())
    return scale;
  const Boxed<float> depth = regions.SquaredDepth(volume, progress);
  ForRows(scale.spans->Box(), Progress(), [&](int j, int k) {
    const int first = scale.spans->First(j, k), end = scale.spans->End(j, k);
    const Distance depthAt(depth, j, k);
    for (int i = first; i < end; ++i)
      scale.Row(j, k)[i - first] = depthAt(i);
  });
  return scale;
}

// What the voxels of a row are to the membrane of a volume, before other volumes' cores and membranes are looked at: beside the
// volume's box, where \a kind comes in as the coverage, and within it, where \a mask says where it is (bit 0) and has its core
// (bit 1).
void BeginBeside(int count, unsigned char* kind)
{
  for (int i = 0; i < count; ++i)
    kind[i] = static_cast<unsigned char>(kind[i] != 0 ? MembraneVoxel::Known : MembraneVoxel::Void);
}

void BeginWithin(const unsigned char* coverage, const unsigned char* mask, int count, unsigned char* __restrict kind,
                 float* __restrict value)
{
  for (int i = 0; i < count; ++i) {
    const int here = mask[i] & 1, alone = here & (coverage[i] == 1 ? 1 : mask[i] >> 1);
    const int there = coverage[i] != 0 ? 1 : 0;
    kind[i] = static_cast<unsigned char>(there * (2 - (here & ~alone & 1))); // void, unknown, known
    value[i] = static_cast<float>(alone & 1);
  }
}

RowField<float> MembraneScale(const StitchParameters& parameters, const RegionMap& regions, const OverlapComponents& components,
                              const Eigen::Vector3d& spacing, int volume, const std::vector<RowField<float>>& before,
                              double& worst, const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, volume, true));
  if (scale.values.empty())
    return scale;
  RowField<unsigned char> kinds(scale.spans);
  const GridBox& own = regions.Box(volume);
  std::vector<int> cored; // other volumes with a core
  for (int other = 0; other < regions.Count(); ++other)
    if (other != volume && regions.HasCore(other))
      cored.push_back(other);
  std::atomic<bool> any = false;
  ForRows(scale.spans->Box(), Progress(), [&](int j, int k) {
    const int first = scale.spans->First(j, k), end = scale.spans->End(j, k);
    if (first >= end)
      return;
    unsigned char* const kind = kinds.Row(j, k) - first;
    float* const value = scale.Row(j, k) - first;
    // The part of the span that lies in the box of the volume; beside it only others can be.
    const bool has = own.HasRow(j, k);
    const int from = has ? std::clamp(own.first[0], first, end) : end;
    const int to = has ? std::clamp(own.first[0] + own.size[0], from, end) : end;
    regions.Coverage().Copy(first, j, k, from - first, kind + first);
    BeginBeside(from - first, kind + first);
    regions.Coverage().Copy(to, j, k, end - to, kind + to);
    BeginBeside(end - to, kind + to);
    if (from == to)
      return;
    BeginWithin(regions.Coverage().At(from, j, k), regions.MaskRow(volume, j, k) + (from - own.first[0]), to - from, kind + from,
                value + from);
    constexpr auto unknown = static_cast<unsigned char>(MembraneVoxel::Unknown);
    for (const int other : cored) {
      const GridBox row = GridBox{{from, j, k}, {to - from, 1, 1}}.Intersected(regions.Box(other));
      const unsigned char* const mask = row.Empty() ? nullptr : regions.MaskRow(other, j, k) - regions.Box(other).first[0];
      for (int i = row.first[0]; mask && i < row.first[0] + row.size[0]; ++i)
        if (kind[i] == unknown && (mask[i] & 2) != 0)
          kind[i] = static_cast<unsigned char>(MembraneVoxel::Known);
    }
    components.ForRuns(volume, j, k, [&](int begin, int behind, int partner) {
      if (partner < 0 || partner >= volume)
        return;
      // The rest of the other; kept out of this volume's own membrane.
      const RowField<float>& rest = before[partner];
      const float* const other = rest.Row(j, k) - rest.spans->First(j, k);
      for (int i = std::max(begin, from); i < std::min(behind, to); ++i)
        if (kind[i] == unknown) {
          kind[i] = static_cast<unsigned char>(MembraneVoxel::Void);
          value[i] = 1.0f - other[i];
        }
    });
    if (!any && std::memchr(kind + from, unknown, static_cast<std::size_t>(to - from)))
      any = true;
  });
  if (!any)
    return scale;
  MembraneParameters membrane;
  // An exponent multiplies the error of a scale: the weights are certified for exponents up to 32.
  membrane.tolerance = parameters.membraneTolerance / std::clamp(parameters.sharpness, 1.0, 32.0);
  const MembraneReport report = SolveMembrane(kinds, spacing, scale, 0.5f, membrane, progress);
  worst = std::max(worst, report.bound);
  return scale;
}

} // namespace

std::vector<RowField<float>> StitchScales(const StitchParameters& parameters, const RegionMap& regions,
                                          const Eigen::Vector3d& spacing, double& worst, const Progress& progress)
{
  std::vector<RowField<float>> scales;
  worst = 0.0;
  if (parameters.method == StitchMethod::Average || parameters.method == StitchMethod::Maximum) {
    scales.resize(static_cast<std::size_t>(regions.Count()));
    return scales;
  }
  const bool membrane = parameters.method == StitchMethod::Membrane;
  const OverlapComponents components = membrane ? OverlapComponents(regions) : OverlapComponents();
  for (int v = 0; v < regions.Count(); ++v) {
    const Progress part = progress.Part(static_cast<double>(v) / regions.Count(), (v + 1.0) / regions.Count());
    scales.push_back(membrane ? MembraneScale(parameters, regions, components, spacing, v, scales, worst, part)
                     : parameters.method == StitchMethod::Feather ? DepthScale(regions, v, part)
                                                                  : DistanceScale(regions, v, part));
  }
  return scales;
}

} // namespace echorama
