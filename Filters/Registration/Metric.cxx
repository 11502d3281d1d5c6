// SPDX-License-Identifier: BSD-3-Clause
#include "Metric.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {
namespace {

constexpr std::ptrdiff_t FewestOfLevel = 200;

const std::vector<const Metric*>& Metrics()
{
  static const std::vector<const Metric*> metrics{&LocalNccMetric, &NccMetric, &MadMetric, &MindSscMetric, &Lc2Metric};
  return metrics;
}

// Voxels beside real ones get their mean value (and keep the weight 0), so that reading between the two sees no step.
void ExtendByOne(MetricLevel& level)
{
  const auto& n = level.geometry.dimensions;
  SeenVoxel* seen = level.seen.data();
  const std::ptrdiff_t row = n[0], slice = row * n[1];
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t at = k * slice + j * row + i;
        if (seen[at].IsReal())
          continue;
        int sum = 0, neighbours = 0;
        const auto add = [&](bool inside, std::ptrdiff_t other) {
          if (inside && seen[other].IsReal()) {
            sum += seen[other].value;
            ++neighbours;
          }
        };
        add(i > 0, at - 1);
        add(i + 1 < n[0], at + 1);
        add(j > 0, at - row);
        add(j + 1 < n[1], at + row);
        add(k > 0, at - slice);
        add(k + 1 < n[2], at + slice);
        if (neighbours > 0)
          seen[at].value = static_cast<std::int16_t>(sum / neighbours);
      }
  });
}

void Check(const PlacedVolume& volume)
{
  CheckPlacedVolume(volume);
  if (volume.pyramid->front().geometry.VoxelCount() > (std::size_t{1} << 29))
    throw Error(Error::Kind::TooLarge, volume.name + ": volumes of at most 2^29 voxels can be aligned");
  if (!volume.reliability)
    return;
  for (std::size_t l = 0; l < std::min(volume.reliability->size(), volume.pyramid->size()); ++l)
    if ((*volume.reliability)[l].geometry.dimensions != (*volume.pyramid)[l].geometry.dimensions)
      throw Error(Error::Kind::BadInput, volume.name + ": its reliability has other dimensions than itself");
}

} // namespace

void MetricLevel::CountReal()
{
  const std::ptrdiff_t voxels = static_cast<std::ptrdiff_t>(geometry.VoxelCount()), runs = (voxels + RunLength - 1) / RunLength;
  realBefore.assign(static_cast<std::size_t>(runs + 1), 0);
  ParallelRanges(runs, 1 << 12, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t run = begin; run < end; ++run) {
      std::int32_t real = 0;
      for (std::ptrdiff_t i = run * RunLength; i < std::min(voxels, (run + 1) * RunLength); ++i)
        real += IsReal(i);
      realBefore[static_cast<std::size_t>(run + 1)] = real;
    }
  });
  std::partial_sum(realBefore.begin(), realBefore.end(), realBefore.begin());
}

std::vector<std::string> MetricNames()
{
  std::vector<std::string> names;
  for (const Metric* metric : Metrics())
    names.emplace_back(metric->name);
  return names;
}

const Metric& MetricNamed(const std::string& name)
{
  std::string known;
  for (const Metric* metric : Metrics()) {
    if (name == metric->name)
      return *metric;
    known += (known.empty() ? "" : ", ") + std::string(metric->name);
  }
  throw Error(Error::Kind::InvalidParameter, "there is no metric \"" + name + "\"; there are " + known);
}

RowSpans::RowSpans(VolumeView<const float> intensity)
  : rows_(static_cast<std::size_t>(intensity.Dimensions()[1])),
    spans_(rows_ * static_cast<std::size_t>(intensity.Dimensions()[2]))
{
  const auto isReal = [](float v) { return v == v; };
  ParallelFor(intensity.Slices(), [&](std::ptrdiff_t k) {
    for (std::size_t j = 0; j < rows_; ++j) {
      const float *row = intensity.Row(static_cast<int>(j), static_cast<int>(k)), *end = row + intensity.RowStride();
      const float* first = std::find_if(row, end, isReal);
      while (end > first && !isReal(end[-1]))
        --end;
      spans_[static_cast<std::size_t>(k) * rows_ + j] = {static_cast<int>(first - row), static_cast<int>(end - row)};
    }
  });
}

MeanAndDeviation MeanAndDeviationOf(const MetricSource& source)
{
  struct Sum {
    double weight = 0.0, value = 0.0;
    void operator+=(const Sum& s)
    {
      weight += s.weight;
      value += s.value;
    }
  };
  const auto sum = [&source](const auto& of) {
    return ParallelSum<Sum>(source.intensity.Slices(), 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
      Sum s;
      for (int j = 0; j < source.intensity.Dimensions()[1]; ++j) {
        const RowSpan span = source.spans.At(j, static_cast<int>(k));
        const std::ptrdiff_t row = k * source.intensity.SliceStride() + j * source.intensity.RowStride();
        for (std::ptrdiff_t i = row + span.first; i < row + span.end; ++i) {
          const double v = static_cast<double>(source.intensity[i]), trust = v == v ? source.Trust(i) : 0.0;
          if (trust > 0.0)
            s += {trust, trust * of(v)};
        }
      }
      return s;
    });
  };
  const Sum first = sum([](double v) { return v; });
  if (!(first.weight > 0.0))
    return {};
  const double mean = first.value / first.weight;
  const Sum second = sum([mean](double v) { return (v - mean) * (v - mean); });
  return {mean, std::sqrt(second.value / second.weight)};
}

std::shared_ptr<const MetricPyramid> BuildMetricPyramid(const PlacedVolume& volume, const std::string& name,
                                                        const Progress& progress)
{
  const Metric& metric = MetricNamed(name);
  Check(volume);
  auto result = std::make_shared<MetricPyramid>();
  result->metric = name;
  result->name = volume.name;
  std::size_t coarsest = 0;
  for (std::size_t l = 0; l < volume.pyramid->size(); ++l) {
    const PyramidLevel& in = (*volume.pyramid)[l];
    const auto& n = in.geometry.dimensions;
    if (l > 0 && (in.realVoxels < FewestOfLevel || *std::min_element(n.begin(), n.end()) < 2))
      break;
    const bool isCoarserGood = l + 1 < volume.pyramid->size() && (*volume.pyramid)[l + 1].realVoxels >= FewestOfLevel;
    if (static_cast<std::ptrdiff_t>(in.geometry.VoxelCount()) > metric.mostVoxels && isCoarserGood)
      continue;
    coarsest = l;
    progress(l == 0 ? 0.0 : 0.9);
    MetricLevel level;
    level.geometry = in.geometry;
    level.voxelMm = std::cbrt(in.geometry.spacing.prod());
    level.octave = static_cast<int>(std::lround(std::log2(level.voxelMm)));
    MetricSource source{in.intensity.View(), {}, RowSpans(in.intensity.View()), result->levels.empty()};
    if (volume.reliability && l < volume.reliability->size())
      source.reliability = (*volume.reliability)[l].intensity.View();
    metric.see(source, level);
    if (!level.seen.empty())
      ExtendByOne(level);
    level.CountReal();
    result->levels.push_back(std::move(level));
  }

  // The centroid, from the coarsest level: it is where numbers are counted from, so that they stay small.
  const PyramidLevel& last = (*volume.pyramid)[coarsest];
  const Eigen::Affine3d toWorld = last.geometry.IndexToWorld();
  const auto view = last.intensity.View();
  const auto& n = view.Dimensions();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (view(i, j, k) == view(i, j, k)) {
          sum += Eigen::Vector3d(i, j, k);
          count += 1.0;
        }
  result->centre = toWorld * (sum / std::fmax(count, 1.0));
  progress(1.0);
  return result;
}

} // namespace echorama
