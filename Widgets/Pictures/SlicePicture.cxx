// SPDX-License-Identifier: BSD-3-Clause
// From pixel to pixel of a row the position in a volume's index space changes by the same vector. So each row is first cut to
// the pixels that hit the volume, in closed form; what is left is sampled in short pieces, in three passes that each do one
// thing: positions (arithmetic, vectorised), the eight voxels around each (memory, as four pairs), and the interpolation
// (arithmetic, vectorised). Positions are start + i step, not sums of steps: nothing builds up along a row.
//
// The valid region is read beside the voxels, in the same pairs. Where all eight voxels are real the interpolation holds, where
// none is there is nothing to see, and only the pixels on the rim of the valid region go through Sampler, one by one. A voxel
// that is not finite makes the interpolated value not finite, whatever its weight, so that needs no look-up of its own.
//
// Cost: mostly the memory's. Rows are shared out among threads.
#include "SlicePicture.h"

#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>

namespace echorama {
namespace {

constexpr int Piece = 64;        // pixels
constexpr int RowsPerTask = 8;   // large enough to be worth a task, small enough to share out evenly
constexpr float Outside = -1.0f; // a grey level where the volume is not real; else they are in [0, 1]

// One volume, ready to be read along rows of pixels.
template <class T>
struct Source {
  using Real = std::conditional_t<std::is_same_v<T, double>, double, float>;

  Source(const SliceLayer& layer, const PosedVolume<T>& volume, const SlicePlane& plane)
    : intensity(volume.intensity), valid(volume.valid), sampler(volume.intensity, volume.valid),
      black(static_cast<Real>(layer.black)), scale(static_cast<Real>(1.0 / (layer.white - layer.black)))
  {
    const Eigen::Affine3d toIndex = volume.geometry.WorldToIndex();
    origin = toIndex * plane.origin;
    right = toIndex.linear() * plane.right;
    up = toIndex.linear() * plane.up;
  }

  VolumeView<const T> intensity;
  VolumeView<const unsigned char> valid;
  Sampler<T> sampler;
  Real black, scale;
  Eigen::Vector3d origin, right, up; // of the plane, voxels
};

// The pixels of one row: where the first sample is, and how far the next, in voxels.
struct Row {
  double start[3], step[3];
  int begin, end; // of those that hit the volume
};

// Cuts [begin, end) to the samples with -1/2 <= start + i step < n - 1/2 along every axis. The condition is monotonic in i, in
// floating point too, so a guess that is corrected by the condition itself is exact.
void Clip(const std::array<int, 3>& dimensions, Row& row)
{
  for (int axis = 0; axis < 3; ++axis) {
    const double start = row.start[axis], step = row.step[axis], low = -0.5, high = dimensions[axis] - 0.5;
    if (step == 0.0) {
      if (!(start >= low && start < high))
        row.end = row.begin;
      continue;
    }
    const auto before = [&](int i) { return step > 0.0 ? start + i * step < low : start + i * step >= high; };
    const auto behind = [&](int i) { return step > 0.0 ? start + i * step >= high : start + i * step < low; };
    const auto guess = [&](double plane) {
      return static_cast<int>(std::clamp((plane - start) / step, static_cast<double>(row.begin), static_cast<double>(row.end)));
    };
    int first = guess(step > 0.0 ? low : high), last = guess(step > 0.0 ? high : low);
    while (first > row.begin && !before(first - 1))
      --first;
    while (first < row.end && before(first))
      ++first;
    while (last > row.begin && behind(last - 1))
      --last;
    while (last < row.end && !behind(last))
      ++last;
    row.begin = first;
    row.end = std::max(first, last);
  }
}

template <class Real>
inline __attribute__((always_inline)) float Window(Real value, Real black, Real scale)
{
  const Real grey = (value - black) * scale;
  return static_cast<float>(grey < Real(0) ? Real(0) : grey > Real(1) ? Real(1) : grey);
}

// The grey levels of the pixels [row.begin, row.end), trilinear; the volume has at least two voxels along x.
template <class T>
inline __attribute__((always_inline)) void LinearPixels(const Source<T>& source, const Row& row, float* grey)
{
  using Real = typename Source<T>::Real;
  const auto& n = source.intensity.Dimensions();
  const std::ptrdiff_t strides[3] = {1, source.intensity.RowStride(), source.intensity.SliceStride()};
  const std::ptrdiff_t toY = n[1] > 1 ? strides[1] : 0, toZ = n[2] > 1 ? strides[2] : 0;
  const std::ptrdiff_t pairs[4] = {0, toY, toZ, toZ + toY};
  const T* intensity = source.intensity.Data();
  const unsigned char* valid = source.valid.Data();
  const Real black = source.black, scale = source.scale;

  std::ptrdiff_t offset[Piece];
  Real fraction[3][Piece];
  T voxels[4][Piece][2];
  unsigned char all[Piece], some[Piece]; // whether all eight voxels are valid, and any
  std::memset(all, 1, sizeof all);
  std::memset(some, 1, sizeof some);
  for (int begin = row.begin; begin < row.end; begin += Piece) {
    const int count = std::min(Piece, row.end - begin);
    for (int axis = 0; axis < 3; ++axis) {
      const double start = row.start[axis], step = row.step[axis], top = n[axis] - 1.0;
      const int lastPair = std::max(0, n[axis] - 2);
      const std::ptrdiff_t stride = strides[axis];
      for (int i = 0; i < count; ++i) {
        double at = start + (begin + i) * step;
        at = at > 0.0 ? at : 0.0;
        at = at < top ? at : top;
        int below = static_cast<int>(at);
        below = below < lastPair ? below : lastPair;
        fraction[axis][i] = static_cast<Real>(at - below);
        offset[i] = (axis == 0 ? 0 : offset[i]) + below * stride;
      }
    }
    for (int i = 0; i < count; ++i)
      for (int pair = 0; pair < 4; ++pair)
        std::memcpy(voxels[pair][i], intensity + offset[i] + pairs[pair], 2 * sizeof(T));
    if (valid)
      for (int i = 0; i < count; ++i) {
        std::uint16_t both = 0xffff, either = 0;
        for (int pair = 0; pair < 4; ++pair) {
          std::uint16_t two;
          std::memcpy(&two, valid + offset[i] + pairs[pair], 2);
          both &= two;
          either |= two;
        }
        all[i] = (both & 0xff) != 0 && (both >> 8) != 0;
        some[i] = either != 0;
      }
    float* out = grey + begin;
    for (int i = 0; i < count; ++i) {
      const auto along = [](Real a, Real b, Real t) __attribute__((always_inline))
      {
        return a + t * (b - a);
      };
      Real x[4];
      for (int pair = 0; pair < 4; ++pair)
        x[pair] = along(static_cast<Real>(voxels[pair][i][0]), static_cast<Real>(voxels[pair][i][1]), fraction[0][i]);
      const Real value = along(along(x[0], x[1], fraction[1][i]), along(x[2], x[3], fraction[1][i]), fraction[2][i]);
      if constexpr (std::is_floating_point_v<T>)
        all[i] = static_cast<unsigned char>(valid ? all[i] : 1) & static_cast<unsigned char>(value - value == Real(0) ? 1 : 0);
      const float level = Window(value, black, scale);
      out[i] = some[i] ? level : Outside;
    }
    for (int i = 0; i < count; ++i)
      if (some[i] && !all[i]) {
        double at[3], value;
        for (int axis = 0; axis < 3; ++axis)
          at[axis] = row.start[axis] + (begin + i) * row.step[axis];
        out[i] = source.sampler.Linear(at[0], at[1], at[2], value)
                     ? Window(value, static_cast<double>(black), static_cast<double>(scale))
                     : Outside;
      }
  }
}

// The same, of the nearest voxels, or of volumes that are one voxel wide.
template <class T>
inline __attribute__((always_inline)) void SingleSamples(const Source<T>& source, const Row& row, bool linear, float* grey)
{
  for (int i = row.begin; i < row.end; ++i) {
    const double x = row.start[0] + i * row.step[0], y = row.start[1] + i * row.step[1], z = row.start[2] + i * row.step[2];
    double value = 0.0;
    const bool inside = linear ? source.sampler.Linear(x, y, z, value) : source.sampler.Nearest(x, y, z, value);
    grey[i] = inside ? Window(value, static_cast<double>(source.black), static_cast<double>(source.scale)) : Outside;
  }
}

#define EchoramaSliceRows(T)                                                                                                     \
  void LinearRow(const Source<T>& source, const Row& row, float* grey)                                                           \
  {                                                                                                                              \
    LinearPixels(source, row, grey);                                                                                             \
  }                                                                                                                              \
  void SingleRow(const Source<T>& source, const Row& row, bool linear, float* grey)                                              \
  {                                                                                                                              \
    SingleSamples(source, row, linear, grey);                                                                                    \
  }
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaSliceRows)
#undef EchoramaSliceRows

// What the volumes of one side (all, the selected, the others) sum up to along a row.
struct Sums {
  explicit Sums(std::size_t width) : red(width), green(width), blue(width), weight(width), top(width) {}
  void Clear()
  {
    for (auto* sum : {&red, &green, &blue, &weight, &top})
      std::fill(sum->begin(), sum->end(), 0.0f);
  }
  std::vector<float> red, green, blue; // tinted grey levels by opacity
  std::vector<float> weight;           // opacities
  std::vector<float> top;              // the largest opacity
};

void AddRow(const float* grey, int begin, int end, float opacity, const float* colour, float* __restrict red,
            float* __restrict green, float* __restrict blue, float* __restrict weight, float* __restrict top)
{
  const float r = opacity * colour[0], g = opacity * colour[1], b = opacity * colour[2];
  for (int i = begin; i < end; ++i) {
    const float real = grey[i] >= 0.0f ? 1.0f : 0.0f;
    const float level = real * grey[i];
    red[i] += r * level;
    green[i] += g * level;
    blue[i] += b * level;
    weight[i] += real * opacity;
    const float opaque = real * opacity;
    top[i] = top[i] > opaque ? top[i] : opaque;
  }
}

// Means of one side, as bytes.
void MeanRow(const float* red, const float* green, const float* blue, const float* weight, const float* top, int count,
             std::uint8_t* __restrict rgba)
{
  for (int i = 0; i < count; ++i) {
    const float scale = weight[i] > 0.0f ? 255.0f / weight[i] : 0.0f;
    rgba[4 * i] = static_cast<std::uint8_t>(static_cast<int>(red[i] * scale + 0.5f));
    rgba[4 * i + 1] = static_cast<std::uint8_t>(static_cast<int>(green[i] * scale + 0.5f));
    rgba[4 * i + 2] = static_cast<std::uint8_t>(static_cast<int>(blue[i] * scale + 0.5f));
    rgba[4 * i + 3] = static_cast<std::uint8_t>(static_cast<int>(top[i] * 255.0f + 0.5f));
  }
}

void MeanRow(const Sums& sums, std::uint8_t* rgba)
{
  MeanRow(sums.red.data(), sums.green.data(), sums.blue.data(), sums.weight.data(), sums.top.data(),
          static_cast<int>(sums.red.size()), rgba);
}

// Of two sides whose tints are white.
void DifferenceRow(const Sums& a, const Sums& b, std::uint8_t* rgba)
{
  constexpr float alone = 0.25f;
  for (std::size_t i = 0; i < a.red.size(); ++i) {
    const float ofA = a.weight[i] > 0.0f ? a.red[i] / a.weight[i] : 0.0f;
    const float ofB = b.weight[i] > 0.0f ? b.red[i] / b.weight[i] : 0.0f;
    const bool both = a.weight[i] > 0.0f && b.weight[i] > 0.0f;
    const float level = (both ? 1.0f : alone) * std::fabs(ofA - ofB);
    rgba[4 * i] = rgba[4 * i + 1] = rgba[4 * i + 2] = static_cast<std::uint8_t>(255.0f * level + 0.5f);
    rgba[4 * i + 3] = static_cast<std::uint8_t>(255.0f * std::max(a.top[i], b.top[i]) + 0.5f);
  }
}

// Takes pixels of \a other into \a own, where it is the other's square or own has none.
void CheckerboardRow(const Sums& own, const Sums& other, const std::uint8_t* otherRgba, int row, int step, int square,
                     std::uint8_t* rgba)
{
  for (std::size_t i = 0; i < own.red.size(); ++i) {
    const bool otherSquare = ((static_cast<int>(i) * step / square + row / square) & 1) != 0;
    if (other.weight[i] > 0.0f && (otherSquare || !(own.weight[i] > 0.0f)))
      std::memcpy(rgba + 4 * i, otherRgba + 4 * i, 4);
  }
}

void CheckInRange(const char* name, double value, double low, double high)
{
  if (!(value >= low && value <= high))
    throw Error(Error::Kind::InvalidParameter, std::string(name) + " of a slice is " + std::to_string(value) +
                                                   "; it must be in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
}

void Check(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters)
{
  CheckInRange("width", plane.width, 0, 1 << 15);
  CheckInRange("height", plane.height, 0, 1 << 15);
  CheckInRange("squarePixels", parameters.squarePixels, 2, 10000);
  CheckInRange("step", parameters.step, 1, 16);
  const double area = plane.right.cross(plane.up).norm();
  if (!(plane.origin.allFinite() && area > 1e-9 * plane.right.norm() * plane.up.norm()))
    throw Error(Error::Kind::InvalidParameter, "the plane of a slice is none: origin, right and up must be finite, and right and "
                                               "up must span a plane");
  int number = 0;
  for (const SliceLayer& layer : layers) {
    ++number;
    CheckInRange("opacity", layer.opacity, 0.0, 1.0);
    for (const double c : layer.colour)
      CheckInRange("colour", c, 0.0, 1.0);
    if (!(layer.white > layer.black && std::isfinite(layer.white - layer.black)))
      throw Error(Error::Kind::InvalidParameter, "the grey window of volume " + std::to_string(number) +
                                                     " of a slice is empty: white must be above black, and both finite");
    std::visit([&](const auto& volume) { volume.geometry.Check("volume " + std::to_string(number) + " of a slice"); },
               layer.volume);
  }
}

using AnySource = std::variant<Source<unsigned char>, Source<short>, Source<unsigned short>, Source<float>, Source<double>>;

struct Drawn {
  AnySource source;
  float opacity;
  float colour[3];
  int side; // 0: the first sums (all, or the selected), 1: the others
};

// The grey levels of row j of pixels, of every step-th; returns the cut row.
template <class T>
Row SampleRow(const Source<T>& source, int j, int step, int width, bool linear, float* grey)
{
  Row row{};
  const Eigen::Vector3d start = source.origin + static_cast<double>(j) * source.up;
  for (int axis = 0; axis < 3; ++axis) {
    row.start[axis] = start[axis];
    row.step[axis] = step * source.right[axis];
  }
  row.end = width;
  Clip(source.intensity.Dimensions(), row);
  if (linear && source.intensity.Dimensions()[0] > 1)
    LinearRow(source, row, grey);
  else
    SingleRow(source, row, linear, grey);
  return row;
}

// Rows [begin, end) of the sampled pixels: width x rows, every step-th of the plane's both ways.
void DrawRows(const std::vector<Drawn>& drawn, const SliceParameters& parameters, int width, int begin, int end,
              std::uint8_t* rgba)
{
  const std::size_t count = static_cast<std::size_t>(width);
  std::vector<float> grey(count);
  std::array<Sums, 2> sides{Sums(count), Sums(parameters.mode == SliceMode::Blend ? 0 : count)};
  std::vector<std::uint8_t> others(parameters.mode == SliceMode::Checkerboard ? 4 * count : 0);
  for (int j = begin; j < end; ++j) {
    const int pixelRow = j * parameters.step;
    std::uint8_t* out = rgba + 4 * count * static_cast<std::size_t>(j);
    for (Sums& side : sides)
      side.Clear();
    for (const Drawn& layer : drawn) {
      const Row row = std::visit(
          [&](const auto& source) { return SampleRow(source, pixelRow, parameters.step, width, parameters.linear, grey.data()); },
          layer.source);
      Sums& sums = sides[static_cast<std::size_t>(layer.side)];
      AddRow(grey.data(), row.begin, row.end, layer.opacity, layer.colour, sums.red.data(), sums.green.data(), sums.blue.data(),
             sums.weight.data(), sums.top.data());
    }
    if (parameters.mode == SliceMode::Difference) {
      DifferenceRow(sides[0], sides[1], out);
      continue;
    }
    MeanRow(sides[0], out);
    if (parameters.mode == SliceMode::Checkerboard) {
      MeanRow(sides[1], others.data());
      CheckerboardRow(sides[0], sides[1], others.data(), pixelRow, parameters.step, parameters.squarePixels, out);
    }
  }
}

// The samples of two rows, mixed: (step - part) lower + part upper, per byte.
void MixRows(const std::uint8_t* lower, const std::uint8_t* upper, int bytes, int step, int part, std::uint16_t* __restrict mixed)
{
  for (int i = 0; i < bytes; ++i)
    mixed[i] = static_cast<std::uint16_t>((step - part) * lower[i] + part * upper[i]);
}

// Fills the pixels of a row between samples: bilinear where the four samples around are equally opaque, else the nearest, so that
// what is not real keeps its shape and no black bleeds in. \a part: rows above the lower samples.
void FillRow(const std::uint8_t* lower, const std::uint8_t* upper, int samples, int step, int part, int width,
             std::uint16_t* mixed, std::uint8_t* rgba)
{
  MixRows(lower, upper, 4 * samples, step, part, mixed);
  const std::uint8_t* nearer = 2 * part < step ? lower : upper;
  const unsigned square = static_cast<unsigned>(step * step), inverse = (65536u + square / 2u) / square;
  for (int left = 0; left < samples; ++left) {
    const int right = std::min(left + 1, samples - 1), count = std::min(step, width - left * step);
    const std::uint8_t opaque = lower[4 * left + 3];
    const bool even = lower[4 * right + 3] == opaque && upper[4 * left + 3] == opaque && upper[4 * right + 3] == opaque;
    for (int along = 0; along < count; ++along, rgba += 4) {
      if (!even) {
        std::memcpy(rgba, nearer + 4 * (2 * along < step ? left : right), 4);
        continue;
      }
      const unsigned toLeft = static_cast<unsigned>(step - along), toRight = static_cast<unsigned>(along);
      for (int channel = 0; channel < 3; ++channel)
        rgba[channel] = static_cast<std::uint8_t>(
            ((toLeft * mixed[4 * left + channel] + toRight * mixed[4 * right + channel]) * inverse + 32768u) >> 16);
      rgba[3] = opaque;
    }
  }
}

} // namespace

void DrawSlice(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters,
               std::uint8_t* rgba)
{
  Check(layers, plane, parameters);
  std::vector<Drawn> drawn;
  for (const SliceLayer& layer : layers) {
    if (layer.opacity == 0.0)
      continue;
    const bool white = parameters.mode == SliceMode::Difference;
    const auto tint = [&](int c) { return white ? 1.0f : static_cast<float>(layer.colour[static_cast<std::size_t>(c)]); };
    std::visit(
        [&](const auto& volume) {
          drawn.push_back({Source(layer, volume, plane),
                           static_cast<float>(layer.opacity),
                           {tint(0), tint(1), tint(2)},
                           parameters.mode != SliceMode::Blend && !layer.selected ? 1 : 0});
        },
        layer.volume);
  }

  const int step = parameters.step;
  const int width = (plane.width + step - 1) / step, height = (plane.height + step - 1) / step;
  std::vector<std::uint8_t> samples(step > 1 ? 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height) : 0);
  std::uint8_t* sampled = step > 1 ? samples.data() : rgba;
  ParallelRanges(height, RowsPerTask, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    DrawRows(drawn, parameters, width, static_cast<int>(begin), static_cast<int>(end), sampled);
  });
  if (step == 1)
    return;
  ParallelRanges(plane.height, 4 * RowsPerTask, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<std::uint16_t> mixed(4 * static_cast<std::size_t>(width));
    for (int j = static_cast<int>(begin); j < end; ++j) {
      const int below = j / step, above = std::min(below + 1, height - 1);
      FillRow(sampled + 4 * static_cast<std::ptrdiff_t>(width) * below, sampled + 4 * static_cast<std::ptrdiff_t>(width) * above,
              width, step, j - below * step, plane.width, mixed.data(), rgba + 4 * static_cast<std::ptrdiff_t>(plane.width) * j);
    }
  });
}

} // namespace echorama
