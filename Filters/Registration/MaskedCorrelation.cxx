// SPDX-License-Identifier: BSD-3-Clause
// Weight and weighted value of a volume are the real and imaginary part of one complex transform. With z the spectrum of
// the moving volume's pair, z' the same at the opposite frequency, W and V the spectra of the fixed volume's weights and
// values, the spectrum of (sum of weights) + i (sum of products) is
//   W conj(w) + i V conj(v) = (W - V) / 2 conj(z) + (W + V) / 2 z',
// so that a translation's two sums cost one transform there and one back. The six sums of the full normalised correlation
// go in the same way, two by two.
//
// The fixed volume lies where the first shift puts the moving volume on the first voxels of the transform: the shifts asked
// for come out first and in order, and the way back leaves out other rows and slices, as the way there leaves out those
// that hold nothing.
#include "MaskedCorrelation.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>
// It asks aligned_alloc for sizes that are no multiples of the alignment, which C11 does not allow.
#define aligned_alloc(alignment, size) std::aligned_alloc(alignment, ((size) + (alignment)-1) / (alignment) * (alignment))
#include <pocketfft.hpp>
#undef aligned_alloc

namespace echorama {
namespace {

using Complex = MaskedCorrelator::Complex;

// Below this share of the squared mean or of 1 a variance is rounding.
constexpr double LeastVariance = 1e-5;

// The next number without prime factors above 7.
int GoodSize(int n)
{
  for (;; ++n) {
    int rest = n;
    for (const int prime : {2, 3, 5, 7})
      while (rest % prime == 0)
        rest /= prime;
    if (rest == 1)
      return n;
  }
}

// Where the frequency opposite to number i of n lies.
std::ptrdiff_t Opposite(std::ptrdiff_t i, std::ptrdiff_t n)
{
  return i == 0 ? 0 : n - i;
}

// One axis of the first voxels of a volume, in place.
void TransformAxis(std::vector<Complex>& volume, const std::array<int, 3>& size, const std::array<int, 3>& part, int axis,
                   bool forward)
{
  const std::ptrdiff_t bytes = sizeof(Complex);
  const pocketfft::stride_t strides{bytes * size[0] * size[1], bytes * size[0], bytes};
  const pocketfft::shape_t shape{static_cast<std::size_t>(part[2]), static_cast<std::size_t>(part[1]),
                                 static_cast<std::size_t>(part[0])};
  pocketfft::c2c(shape, strides, strides, {static_cast<std::size_t>(2 - axis)}, forward, volume.data(), volume.data(), 1.0f);
}

// Products without the library's care for infinities.
inline Complex Times(Complex a, Complex b)
{
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
inline Complex TimesI(Complex a)
{
  return {-a.imag(), a.real()};
}

// A row of frequencies of the fixed and the moving volume; the opposite row runs backwards.
struct Rows {
  const Complex *halfDifference, *halfSum, *moving, *opposite;
  int count;
};

// The spectrum of (weights, products).
void MultiplyRow(const Rows& rows, Complex* out)
{
  const Complex *halfDifference = rows.halfDifference, *halfSum = rows.halfSum, *z = rows.moving, *opposite = rows.opposite;
  const int count = rows.count;
  out[0] = Times(halfDifference[0], std::conj(z[0])) + Times(halfSum[0], opposite[0]);
  for (int i = 1; i < count; ++i)
    out[i] = Times(halfDifference[i], std::conj(z[i])) + Times(halfSum[i], opposite[count - i]);
}

// The spectra of (sum of f, sum of m) and of (sum of f f, sum of m m), over the overlap.
void MultiplyMoments(const Rows& rows, const Complex* fixedSquares, const Complex* movingSquares, Complex* means,
                     Complex* squares)
{
  for (int i = 0; i < rows.count; ++i) {
    const Complex z = rows.moving[i], zOpposite = rows.opposite[i == 0 ? 0 : rows.count - i];
    const Complex w = 0.5f * (std::conj(z) + zOpposite), v = 0.5f * TimesI(std::conj(z) - zOpposite); // both conjugate
    const Complex W = rows.halfSum[i] + rows.halfDifference[i], V = rows.halfSum[i] - rows.halfDifference[i];
    means[i] = Times(V, w) + TimesI(Times(W, v));
    squares[i] = Times(fixedSquares[i], w) + TimesI(Times(W, std::conj(movingSquares[i])));
  }
}

// Weight times the square of the value.
Volume<Complex> Squares(VolumeView<const Complex> voxels)
{
  Volume<Complex> squares(voxels.Dimensions());
  std::transform(voxels.begin(), voxels.end(), squares.View().begin(),
                 [](Complex c) { return Complex(c.real() > 0.0f ? c.imag() * c.imag() / c.real() : 0.0f); });
  return squares;
}

// From sums, all scaled alike, to the correlation.
double Correlation(double weight, double products, double f, double m, double ff, double mm)
{
  f /= weight;
  m /= weight;
  const double varianceF = ff / weight - f * f, varianceM = mm / weight - m * m;
  if (!(varianceF > LeastVariance * (1.0 + f * f) && varianceM > LeastVariance * (1.0 + m * m)))
    return 0.0;
  return std::clamp((products / weight - f * m) / std::sqrt(varianceF * varianceM), -1.0, 1.0);
}

} // namespace

template <class RowBody>
void MaskedCorrelator::ForEachRow(const RowBody& body) const
{
  for (std::ptrdiff_t k = 0; k < size_[2]; ++k)
    for (std::ptrdiff_t j = 0; j < size_[1]; ++j)
      body((k * size_[1] + j) * size_[0], (Opposite(k, size_[2]) * size_[1] + Opposite(j, size_[1])) * size_[0]);
}

MaskedCorrelator::MaskedCorrelator(VolumeView<const Complex> fixed, const std::array<int, 3>& movingDimensions,
                                   const ShiftRange& shifts)
  : shifts_(shifts)
{
  std::array<int, 3> at{};
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = -shifts.first[axis];
    size_[axis] = GoodSize(std::max({fixed.Dimensions()[axis], movingDimensions[axis], shifts.Counts()[axis],
                                     fixed.Dimensions()[axis] - shifts.first[axis], shifts.last[axis] + movingDimensions[axis]}));
  }
  Spectrum pair;
  Forward(fixed, at, pair);
  halfDifference_.resize(pair.size());
  halfSum_.resize(pair.size());
  Forward(Squares(fixed).View(), at, squares_);
  const float scale = 1.0f / static_cast<float>(pair.size());
  ForEachRow([&](std::ptrdiff_t row, std::ptrdiff_t opposite) {
    for (std::ptrdiff_t i = 0; i < size_[0]; ++i) {
      const std::size_t here = static_cast<std::size_t>(row + i);
      const Complex z = pair[here], mirrored = std::conj(pair[static_cast<std::size_t>(opposite + Opposite(i, size_[0]))]);
      const Complex weights = 0.5f * scale * (z + mirrored), values = 0.5f * scale * TimesI(mirrored - z);
      halfDifference_[here] = 0.5f * (weights - values);
      halfSum_[here] = 0.5f * (weights + values);
      squares_[here] *= scale;
    }
  });
}

void MaskedCorrelator::Forward(VolumeView<const Complex> voxels, const std::array<int, 3>& at, Spectrum& spectrum) const
{
  const auto& n = voxels.Dimensions();
  spectrum.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]),
                  Complex());
  const auto wrapped = [this](int position, int axis) {
    const int rest = position % size_[axis];
    return static_cast<std::size_t>(rest < 0 ? rest + size_[axis] : rest);
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const std::size_t row = (wrapped(k + at[2], 2) * static_cast<std::size_t>(size_[1]) + wrapped(j + at[1], 1)) *
                              static_cast<std::size_t>(size_[0]);
      for (int i = 0; i < n[0]; ++i)
        spectrum[row + wrapped(i + at[0], 0)] = voxels(i, j, k);
    }
  const bool first = at == std::array<int, 3>{0, 0, 0};
  TransformAxis(spectrum, size_, first ? std::array<int, 3>{size_[0], n[1], n[2]} : size_, 0, true);
  TransformAxis(spectrum, size_, first ? std::array<int, 3>{size_[0], size_[1], n[2]} : size_, 1, true);
  TransformAxis(spectrum, size_, size_, 2, true);
}

// Only what lies in the range of shifts is right afterwards.
void MaskedCorrelator::Backward(Spectrum& spectrum) const
{
  const auto counts = shifts_.Counts();
  TransformAxis(spectrum, size_, size_, 2, false);
  TransformAxis(spectrum, size_, {size_[0], size_[1], counts[2]}, 1, false);
  TransformAxis(spectrum, size_, {size_[0], counts[1], counts[2]}, 0, false);
}

void MaskedCorrelator::Products(VolumeView<const Complex> moving, VolumeView<Complex> out, Work& work) const
{
  Forward(moving, {0, 0, 0}, work.moving);
  Spectrum& sums = work.sums[0];
  sums.resize(work.moving.size());
  ForEachRow([&](std::ptrdiff_t row, std::ptrdiff_t opposite) {
    MultiplyRow(
        {halfDifference_.data() + row, halfSum_.data() + row, work.moving.data() + row, work.moving.data() + opposite, size_[0]},
        sums.data() + row);
  });
  Backward(sums);
  const auto counts = shifts_.Counts();
  for (int k = 0; k < counts[2]; ++k)
    for (int j = 0; j < counts[1]; ++j)
      std::copy_n(sums.data() + (static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0], counts[0], out.Row(j, k));
}

void MaskedCorrelator::Normalised(VolumeView<const Complex> moving, double leastWeight, VolumeView<Complex> out, Work& work) const
{
  Forward(moving, {0, 0, 0}, work.moving);
  Forward(Squares(moving).View(), {0, 0, 0}, work.squares);
  for (Spectrum& sums : work.sums)
    sums.resize(work.moving.size());
  ForEachRow([&](std::ptrdiff_t row, std::ptrdiff_t opposite) {
    const Rows rows{halfDifference_.data() + row, halfSum_.data() + row, work.moving.data() + row, work.moving.data() + opposite,
                    size_[0]};
    MultiplyRow(rows, work.sums[0].data() + row);
    MultiplyMoments(rows, squares_.data() + row, work.squares.data() + row, work.sums[1].data() + row, work.sums[2].data() + row);
  });
  for (Spectrum& sums : work.sums)
    Backward(sums);
  const auto counts = shifts_.Counts();
  for (int k = 0; k < counts[2]; ++k)
    for (int j = 0; j < counts[1]; ++j) {
      const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0];
      Complex* to = out.Row(j, k);
      for (int i = 0; i < counts[0]; ++i) {
        const std::complex<double> sums = work.sums[0][static_cast<std::size_t>(row + i)],
                                   means = work.sums[1][static_cast<std::size_t>(row + i)],
                                   squares = work.sums[2][static_cast<std::size_t>(row + i)];
        const bool enough = sums.real() >= leastWeight && sums.real() > 0.0;
        const double ncc =
            enough ? Correlation(sums.real(), sums.imag(), means.real(), means.imag(), squares.real(), squares.imag()) : 0.0;
        to[i] = {static_cast<float>(sums.real()), static_cast<float>(ncc)};
      }
    }
}

} // namespace echorama
