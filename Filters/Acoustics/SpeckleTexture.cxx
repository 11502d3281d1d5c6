// SPDX-License-Identifier: BSD-3-Clause
// White complex noise of a cube, each axis then blurred by a Gaussian that goes round (the cube is a torus). Between voxels it is
// trilinear. Both change the power by known factors, for which it is scaled at once: of white noise the sum of the squared
// weights remains, and between correlated neighbours a third of what they do not share is lost on average, in each direction.
//
// Cost: once two million normal deviates and 33 products each (some 0.3 s on one core); then eight voxels a number.
#include "SpeckleTexture.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include <array>
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {
namespace {

constexpr int textureEdge = 128; // voxels, a power of two
constexpr double voxelsPerGrain = 1.5;
constexpr int textureReach = 5; // of the blur, voxels: more than three standard deviations

} // namespace

SpeckleTexture::SpeckleTexture(std::uint64_t seed, double grainMm) : grain_(grainMm)
{
  if (!(grainMm >= 0.001 && grainMm <= 100.0))
    throw Error(Error::Kind::InvalidParameter, "grainMm is " + NumberText(grainMm) + "; it must be in [0.001, 100] mm");
  constexpr int n = textureEdge;
  std::array<float, 2 * textureReach + 1> weights{};
  double squares = 0.0, shared = 0.0;
  for (int i = -textureReach; i <= textureReach; ++i) {
    const double weight = std::exp(-0.5 * std::pow(i / voxelsPerGrain, 2));
    weights[static_cast<std::size_t>(i + textureReach)] = static_cast<float>(weight);
    squares += weight * weight;
    if (i > -textureReach)
      shared += weight * std::exp(-0.5 * std::pow((i - 1) / voxelsPerGrain, 2));
  }
  const double kept = squares * (2.0 + shared / squares) / 3.0; // of the power, by each axis
  const double size = std::pow(kept, -1.5);

  numbers_.resize(static_cast<std::size_t>(n) * n * n);
  ParallelFor(n * n, [&](std::ptrdiff_t row) {
    Random random(seed, static_cast<std::uint64_t>(row));
    for (int i = 0; i < n; ++i) { // of a complex Gaussian number, the square of the size is exponentially distributed
      const double length = size * std::sqrt(-std::log1p(-random.Uniform())), angle = 6.283185307179586 * random.Uniform();
      numbers_[static_cast<std::size_t>(row * n + i)] = {static_cast<float>(length * std::cos(angle)),
                                                         static_cast<float>(length * std::sin(angle))};
    }
  });
  // Rows lie along an axis in turn: each pass blurs the first axis and makes it the last.
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::complex<float>> turned(numbers_.size());
    ParallelFor(n, [&](std::ptrdiff_t k) {
      std::array<std::complex<float>, textureEdge + 2 * textureReach> row;
      for (int j = 0; j < n; ++j) {
        const std::complex<float>* from = numbers_.data() + (k * n + j) * n;
        for (int i = 0; i < n + 2 * textureReach; ++i)
          row[static_cast<std::size_t>(i)] = from[(i - textureReach) & (n - 1)];
        for (int i = 0; i < n; ++i) {
          std::complex<float> sum = 0.0f;
          for (std::size_t w = 0; w < weights.size(); ++w)
            sum += weights[w] * row[static_cast<std::size_t>(i) + w];
          turned[static_cast<std::size_t>((i * static_cast<std::ptrdiff_t>(n) + k) * n + j)] = sum;
        }
      }
    });
    numbers_.swap(turned);
  }
}

double SpeckleTexture::PeriodMm() const
{
  return textureEdge * grain_ / voxelsPerGrain;
}

Eigen::Matrix3d SpeckleTexture::Axes()
{
  return Eigen::AngleAxisd(0.9, Eigen::Vector3d(0.48, 0.62, 0.3).normalized()).toRotationMatrix();
}

inline __attribute__((always_inline)) std::complex<float> SpeckleTexture::NumberAt(const Eigen::Vector3d& voxel) const
{
  constexpr std::int64_t n = textureEdge, mask = n - 1;
  const std::complex<float>* const cube = numbers_.data();
  std::int64_t low[3], high[3];
  float part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double place = voxel[axis], whole = std::floor(place);
    const auto cell = static_cast<std::int64_t>(whole);
    low[axis] = cell & mask;
    high[axis] = (cell + 1) & mask;
    part[axis] = static_cast<float>(place - whole);
  }
  const auto line = [&](std::int64_t j, std::int64_t k) {
    const std::complex<float>* row = cube + (k * n + j) * n;
    return row[low[0]] + part[0] * (row[high[0]] - row[low[0]]);
  };
  const auto plane = [&](std::int64_t k) {
    const std::complex<float> a = line(low[1], k), b = line(high[1], k);
    return a + part[1] * (b - a);
  };
  const std::complex<float> a = plane(low[2]), b = plane(high[2]);
  return a + part[2] * (b - a);
}

void SpeckleTexture::Along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const std::vector<double>& along,
                           std::complex<float>* numbers) const
{
  const Eigen::Matrix3d toVoxels = (voxelsPerGrain / grain_) * Axes().transpose();
  const Eigen::Vector3d start = toVoxels * origin, step = toVoxels * direction;
  for (std::size_t s = 0; s < along.size(); ++s)
    numbers[s] = NumberAt(start + along[s] * step);
}

void SpeckleTexture::At(const std::vector<Eigen::Vector3d>& points, std::complex<float>* numbers) const
{
  const Eigen::Matrix3d toVoxels = (voxelsPerGrain / grain_) * Axes().transpose();
  for (std::size_t s = 0; s < points.size(); ++s)
    numbers[s] = NumberAt(toVoxels * points[s]);
}

} // namespace echorama
