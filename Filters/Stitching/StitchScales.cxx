// SPDX-License-Identifier: BSD-3-Clause
// One volume after the other, so that the maps or levels of one live at a time; what is kept are the scales of the overlap.
#include "StitchScales.h"
#include "BlendWeights.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

// Spans of the overlap voxels of a volume; with a rim, also of their six neighbours.
std::shared_ptr<const RowSpans> OverlapSpans(const RegionMap& regions, VolumeView<const unsigned char> coverage, int volume,
                                             bool rim)
{
  const GridBox& own = regions.Box(volume);
  const std::size_t rows = static_cast<std::size_t>(own.size[1]) * static_cast<std::size_t>(own.size[2]);
  std::vector<int> first(rows, 0), end(rows, 0);
  ForRows(own, Progress(), [&](int j, int k) {
    const unsigned char* inside = regions.MaskRow(volume, j, k) - own.first[0];
    const unsigned char* covered = coverage.Row(j, k);
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
  const auto& n = coverage.Dimensions();
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

RowField<float> DistanceScale(const RegionMap& regions, VolumeView<const unsigned char> coverage, int volume,
                              const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, coverage, volume, false));
  if (scale.values.empty())
    return scale;
  const Boxed<float> pure = regions.SquaredDistanceTo(Region::Pure, volume, progress.Part(0.0, 0.45));
  const Boxed<float> empty = regions.SquaredDistanceTo(Region::Empty, volume, progress.Part(0.45, 0.9));
  ForRows(scale.spans->Box(), progress.Part(0.9, 1.0), [&](int j, int k) {
    float* out = scale.Row(j, k);
    const unsigned char *covered = coverage.Row(j, k), *inside = regions.MaskRow(volume, j, k) - regions.Box(volume).first[0];
    const Distance p(pure, j, k), e(empty, j, k);
    const int first = scale.spans->First(j, k);
    for (int i = first; i < scale.spans->End(j, k); ++i)
      if ((inside[i] & 1) && covered[i] > 1)
        out[i - first] = BlendScale(p(i), e(i));
  });
  return scale;
}

RowField<float> DepthScale(const RegionMap& regions, VolumeView<const unsigned char> coverage, int volume,
                           const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, coverage, volume, false));
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

RowField<float> MembraneScale(const StitchParameters& parameters, const RegionMap& regions, const OverlapComponents& components,
                              VolumeView<const unsigned char> coverage, const Eigen::Vector3d& spacing, int volume,
                              const std::vector<RowField<float>>& before, double& worst, const Progress& progress)
{
  RowField<float> scale(OverlapSpans(regions, coverage, volume, true));
  if (scale.values.empty())
    return scale;
  RowField<unsigned char> kinds(scale.spans, static_cast<unsigned char>(MembraneVoxel::Void));
  const GridBox& own = regions.Box(volume);
  std::vector<int> cored; // other volumes with a core
  for (int other = 0; other < regions.Count(); ++other)
    if (other != volume && regions.HasCore(other))
      cored.push_back(other);
  ForRows(scale.spans->Box(), Progress(), [&](int j, int k) {
    const int first = scale.spans->First(j, k), end = scale.spans->End(j, k);
    const unsigned char* covered = coverage.Row(j, k);
    const unsigned char* inside = own.HasRow(j, k) ? regions.MaskRow(volume, j, k) - own.first[0] : nullptr;
    unsigned char* kind = kinds.Row(j, k);
    float* value = scale.Row(j, k);
    OverlapComponents::Row pieces = components.RowAt(j, k);
    const auto known = [&](int i, float v) {
      kind[i - first] = static_cast<unsigned char>(MembraneVoxel::Known);
      value[i - first] = v;
    };
    const auto otherCore = [&](int i) {
      return std::any_of(cored.begin(), cored.end(), [&](int other) {
        const GridBox& box = regions.Box(other);
        return box.HasRow(j, k) && i >= box.first[0] && i < box.first[0] + box.size[0] &&
               (regions.MaskRow(other, j, k)[i - box.first[0]] & 2) != 0;
      });
    };
    for (int i = first; i < end; ++i) {
      if (covered[i] == 0)
        continue;
      const bool here = inside && i >= own.first[0] && i < own.first[0] + own.size[0] && (inside[i] & 1);
      if (!here)
        known(i, 0.0f);
      else if (covered[i] == 1 || (inside[i] & 2))
        known(i, 1.0f);
      else if (!cored.empty() && otherCore(i))
        known(i, 0.0f);
      else if (const int partner = pieces.PartnerOf(volume, i); partner >= 0 && partner < volume) {
        // The rest of the other; kept out of this volume's own membrane.
        const RowField<float>& rest = before[partner];
        value[i - first] = 1.0f - rest.Row(j, k)[i - rest.spans->First(j, k)];
      } else
        kind[i - first] = static_cast<unsigned char>(MembraneVoxel::Unknown);
    }
  });
  if (std::none_of(kinds.values.begin(), kinds.values.end(),
                   [](unsigned char kind) { return kind == static_cast<unsigned char>(MembraneVoxel::Unknown); }))
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
                                          VolumeView<const unsigned char> coverage, const Eigen::Vector3d& spacing, double& worst,
                                          const Progress& progress)
{
  std::vector<RowField<float>> scales;
  worst = 0.0;
  if (parameters.method == StitchMethod::Average || parameters.method == StitchMethod::Maximum) {
    scales.resize(static_cast<std::size_t>(regions.Count()));
    return scales;
  }
  const bool membrane = parameters.method == StitchMethod::Membrane;
  const OverlapComponents components = membrane ? OverlapComponents(regions, coverage) : OverlapComponents();
  for (int v = 0; v < regions.Count(); ++v) {
    const Progress part = progress.Part(static_cast<double>(v) / regions.Count(), (v + 1.0) / regions.Count());
    scales.push_back(membrane ? MembraneScale(parameters, regions, components, coverage, spacing, v, scales, worst, part)
                     : parameters.method == StitchMethod::Feather ? DepthScale(regions, coverage, v, part)
                                                                  : DistanceScale(regions, coverage, v, part));
  }
  return scales;
}

} // namespace echorama
