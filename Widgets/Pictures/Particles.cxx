// SPDX-License-Identifier: BSD-3-Clause
// Layers of blocks are independent: each sums its voxels row by row into the sums of its blocks and writes its particles into
// lists of its own, which are then put one after the other. So the voxels are read once, in their order, and the result does not
// depend on threads. When the budget is exceeded the blocks are made larger by what the count tells, and all is done once more.
//
// The sort: depths are cut into 65536 steps, steps are counted, and places follow from the counts. Its cost is two passes.
#include "Particles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

[[noreturn]] void Refuse(const std::string& sentence)
{
  throw Error(Error::Kind::InvalidParameter, sentence);
}

struct Layer {
  std::vector<float> positions;
  std::vector<std::uint8_t> values, alphas;
};

// What grey levels become: value and opacity of a particle.
struct Look {
  double black, scale, minimum, maximum, opacity, layers;
  bool valueOpacity;
  std::uint8_t alphaOfValue[256]; // of blocks that are real as a whole: most

  Look(const ParticleParameters& p, int block)
    : black(p.black), scale(255.0 / (p.white - p.black)), minimum(p.minimum), maximum(p.maximum), opacity(p.opacity),
      layers(static_cast<double>(block) / p.downsampling), valueOpacity(p.valueOpacity)
  {
    for (int value = 0; value < 256; ++value)
      alphaOfValue[value] = Alpha(value, 1.0);
  }

  std::uint8_t Alpha(int value, double share) const
  {
    const double one = valueOpacity ? opacity * value / 255.0 : opacity;
    return static_cast<std::uint8_t>(std::lround(255.0 * (1.0 - std::pow(1.0 - one, share * layers))));
  }
  bool Shows(double grey) const { return grey >= minimum && grey <= maximum; }
  std::uint8_t ValueOf(double grey) const
  {
    return static_cast<std::uint8_t>(std::lround(std::clamp((grey - black) * scale, 0.0, 255.0)));
  }
};

// Calls sink(column, row, mean, real voxels) for the blocks with real voxels whose first slice is \a block * number.
template <class T, class Sink>
void VisitBlocks(const PosedVolume<T>& volume, int block, std::ptrdiff_t number, const Sink& sink)
{
  const auto& n = volume.intensity.Dimensions();
  const Sampler<T> sampler(volume.intensity, volume.valid);
  const int columns = (n[0] + block - 1) / block, rows = (n[1] + block - 1) / block;
  const int first = static_cast<int>(number) * block, last = std::min(first + block, n[2]);
  std::vector<double> sums(static_cast<std::size_t>(columns));
  std::vector<int> counts(sums.size());
  for (int row = 0; row < rows; ++row) {
    std::fill(sums.begin(), sums.end(), 0.0);
    std::fill(counts.begin(), counts.end(), 0);
    for (int k = first; k < last; ++k)
      for (int j = row * block; j < std::min((row + 1) * block, n[1]); ++j) {
        const std::ptrdiff_t begin = volume.intensity.SliceStride() * k + volume.intensity.RowStride() * j;
        std::size_t column = 0;
        for (int i = 0; i < n[0]; ++column)
          for (const int end = std::min(i + block, n[0]); i < end; ++i)
            if (sampler.IsReal(begin + i)) {
              sums[column] += static_cast<double>(volume.intensity[begin + i]);
              ++counts[column];
            }
      }
    for (int column = 0; column < columns; ++column) {
      const auto at = static_cast<std::size_t>(column);
      if (counts[at] > 0)
        sink(column, row, sums[at] / counts[at], counts[at]);
    }
  }
}

template <class T>
Layer LayerOf(const PosedVolume<T>& volume, int block, std::ptrdiff_t number, const Look& look)
{
  const Eigen::Affine3d toWorld = volume.geometry.IndexToWorld();
  const auto middle = [block, &volume](std::ptrdiff_t index, std::size_t axis) {
    return 0.5 * static_cast<double>(index * block +
                                     std::min<std::ptrdiff_t>((index + 1) * block, volume.intensity.Dimensions()[axis]) - 1);
  };
  const double z = middle(number, 2);
  const std::ptrdiff_t all = static_cast<std::ptrdiff_t>(block) * block * block;
  Layer layer;
  VisitBlocks(volume, block, number, [&](int column, int row, double grey, int real) {
    if (!look.Shows(grey))
      return;
    const std::uint8_t value = look.ValueOf(grey);
    const std::uint8_t alpha = real == all ? look.alphaOfValue[value] : look.Alpha(value, static_cast<double>(real) / all);
    if (alpha == 0)
      return;
    const Eigen::Vector3f position = (toWorld * Eigen::Vector3d(middle(column, 0), middle(row, 1), z)).cast<float>();
    layer.positions.insert(layer.positions.end(), position.data(), position.data() + 3);
    layer.values.push_back(value);
    layer.alphas.push_back(alpha);
  });
  return layer;
}

template <class T>
void Check(const PosedVolume<T>& volume, const ParticleParameters& parameters)
{
  parameters.Check();
  volume.geometry.Check("the volume");
  const auto& n = volume.intensity.Dimensions();
  if (n != volume.geometry.dimensions || (!volume.valid.Empty() && volume.valid.Dimensions() != n))
    throw Error(Error::Kind::BadInput, "the volume: its voxels, valid region and geometry differ in their dimensions");
}

} // namespace

void ParticleParameters::Check() const
{
  if (downsampling < 1 || downsampling > 64)
    Refuse("the downsampling must be in [1, 64]; it is " + std::to_string(downsampling));
  if (block != 0 && (block < downsampling || block > 1 << 20))
    Refuse("the block of a coarser level must be at least the downsampling; it is " + std::to_string(block));
  if (!(opacity >= 0.0 && opacity <= 1.0))
    Refuse("the opacity must be in [0, 1]; it is " + std::to_string(opacity));
  if (std::isnan(minimum) || std::isnan(maximum))
    Refuse("the minimum and the maximum must be numbers");
  if (!std::isfinite(black) || !std::isfinite(white) || !(black < white))
    Refuse("black must be below white; they are " + std::to_string(black) + " and " + std::to_string(white));
  if (budget < 1)
    Refuse("the budget must be at least 1; it is " + std::to_string(budget));
}

template <class T>
Particles MakeParticles(const PosedVolume<T>& volume, const ParticleParameters& parameters, const Progress& progress)
{
  Check(volume, parameters);
  int block = std::max(parameters.downsampling, parameters.block);
  for (;;) {
    const Look look(parameters, block);
    std::vector<Layer> layers(static_cast<std::size_t>((volume.intensity.Slices() + block - 1) / block));
    ParallelFor(static_cast<std::ptrdiff_t>(layers.size()), progress,
                [&](std::ptrdiff_t number) { layers[static_cast<std::size_t>(number)] = LayerOf(volume, block, number, look); });
    std::size_t count = 0;
    for (const Layer& layer : layers)
      count += layer.values.size();
    if (count > static_cast<std::size_t>(parameters.budget)) {
      const double growth = std::cbrt(static_cast<double>(count) / parameters.budget);
      block = std::max(block + 1, static_cast<int>(block * growth));
      continue;
    }
    Particles particles;
    particles.block = block;
    particles.sizeMm = static_cast<float>(block * std::cbrt(volume.geometry.spacing.prod()));
    particles.positions.reserve(3 * count);
    particles.values.reserve(count);
    particles.alphas.reserve(count);
    for (Layer& layer : layers) {
      particles.positions.insert(particles.positions.end(), layer.positions.begin(), layer.positions.end());
      particles.values.insert(particles.values.end(), layer.values.begin(), layer.values.end());
      particles.alphas.insert(particles.alphas.end(), layer.alphas.begin(), layer.alphas.end());
      layer = Layer();
    }
    return particles;
  }
}

template <class T>
DisplayVolume MakeDisplayVolume(const PosedVolume<T>& volume, const ParticleParameters& parameters, const Progress& progress)
{
  Check(volume, parameters);
  const int block = std::max(1, parameters.block);
  const auto& n = volume.intensity.Dimensions();
  const auto blocks = [block](int count) { return (count + block - 1) / block; };
  const Look look(parameters, block);
  DisplayVolume display{Volume<unsigned char>({blocks(n[0]), blocks(n[1]), blocks(n[2])}, 0),
                        Eigen::Vector3d::Constant(0.5 * (block - 1))};
  const VolumeView<unsigned char> values = display.values.View();
  ParallelFor(values.Slices(), progress, [&](std::ptrdiff_t number) {
    VisitBlocks(volume, block, number, [&](int column, int row, double grey, int) {
      if (look.Shows(grey))
        values(column, row, static_cast<int>(number)) = std::max<std::uint8_t>(1, look.ValueOf(grey));
    });
  });
  return display;
}

template <class T>
Eigen::AlignedBox3i RealBox(const PosedVolume<T>& volume)
{
  struct Box : Eigen::AlignedBox3i {
    void operator+=(const Box& other) { extend(other); }
  };
  const auto& n = volume.intensity.Dimensions();
  const Sampler<T> sampler(volume.intensity, volume.valid);
  return ParallelSum<Box>(n[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    Box box;
    for (int j = 0; j < n[1]; ++j) {
      const std::ptrdiff_t row = volume.intensity.SliceStride() * k + volume.intensity.RowStride() * j;
      int first = 0, last = n[0] - 1;
      while (first <= last && !sampler.IsReal(row + first))
        ++first;
      while (last > first && !sampler.IsReal(row + last))
        --last;
      if (first <= last) {
        box.extend(Eigen::Vector3i(first, j, static_cast<int>(k)));
        box.extend(Eigen::Vector3i(last, j, static_cast<int>(k)));
      }
    }
    return box;
  });
}

std::vector<std::uint32_t> BackToFront(const std::vector<ParticleDepths>& sets)
{
  constexpr std::size_t Steps = 1 << 16;
  std::vector<std::size_t> begins{0};
  for (const ParticleDepths& set : sets)
    begins.push_back(begins.back() + set.positions->size() / 3);
  const std::size_t count = begins.back();
  if (count > std::numeric_limits<std::uint32_t>::max())
    throw Error(Error::Kind::TooLarge, "there are more particles than can be sorted");

  std::vector<float> depths(count);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const Eigen::Vector3f d = sets[s].direction.cast<float>();
    const float offset = static_cast<float>(sets[s].offset);
    const float* positions = sets[s].positions->data();
    float* out = depths.data() + begins[s];
    ParallelRanges(static_cast<std::ptrdiff_t>(begins[s + 1] - begins[s]), 1 << 15, Progress(),
                   [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                     for (std::ptrdiff_t p = begin; p < end; ++p)
                       out[p] = positions[3 * p] * d[0] + positions[3 * p + 1] * d[1] + positions[3 * p + 2] * d[2] + offset;
                   });
  }
  std::vector<std::uint32_t> order(count);
  if (count == 0)
    return order;
  const auto [least, most] = std::minmax_element(depths.begin(), depths.end());
  const float low = *least, range = *most - low;
  const float scale = range > 0.0f ? static_cast<float>(Steps - 1) / range : 0.0f;
  const auto step = [&](float depth) { return std::min(static_cast<std::size_t>((depth - low) * scale), Steps - 1); };
  std::vector<std::uint32_t> places(Steps + 1, 0);
  for (const float depth : depths)
    ++places[step(depth) + 1];
  for (std::size_t s = 1; s <= Steps; ++s)
    places[s] += places[s - 1];
  for (std::size_t p = 0; p < count; ++p)
    order[places[step(depths[p])]++] = static_cast<std::uint32_t>(p);
  return order;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template Particles MakeParticles<T>(const PosedVolume<T>&, const ParticleParameters&, const Progress&);                        \
  template DisplayVolume MakeDisplayVolume<T>(const PosedVolume<T>&, const ParticleParameters&, const Progress&);                \
  template Eigen::AlignedBox3i RealBox<T>(const PosedVolume<T>&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
