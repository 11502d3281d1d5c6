// SPDX-License-Identifier: BSD-3-Clause
// The fixed volume lies where shift number 0 puts the moving volume on the first voxels of the transform; so the shifts asked for
// come out first, in order, and the inverse transform of other rows and slices is left out.
#include "MaskedCorrelation.h"
#include <algorithm>
#include <cmath>
#include <pocketfft.hpp>

namespace echorama {
namespace {

using Complex = std::complex<float>;

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

// One axis of a part of a volume, in place.
void TransformAxis(Complex* data, const std::array<int, 3>& size, const std::array<int, 3>& part, int axis, bool forward)
{
  const std::ptrdiff_t bytes = sizeof(Complex);
  const pocketfft::stride_t strides{bytes * size[0] * size[1], bytes * size[0], bytes};
  const pocketfft::shape_t shape{static_cast<std::size_t>(part[2]), static_cast<std::size_t>(part[1]),
                                 static_cast<std::size_t>(part[0])};
  pocketfft::c2c(shape, strides, strides, {static_cast<std::size_t>(2 - axis)}, forward, data, data, 1.0f);
}

// Where the frequency opposite to number i of n lies.
std::ptrdiff_t Opposite(std::ptrdiff_t i, int n)
{
  return i == 0 ? 0 : n - i;
}

// Products of complex numbers without the library's care for infinities.
inline Complex Times(Complex a, Complex b)
{
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
inline Complex TimesI(Complex a)
{
  return {-a.imag(), a.real()};
}

// The spectra of two real volumes, from that of one + i * other, at a frequency and from its opposite.
struct Pair {
  Pair(Complex here, Complex there)
    : first(0.5f * (here + std::conj(there))), second(0.5f * Complex(here.imag() + there.imag(), there.real() - here.real()))
  {
  }
  Complex first, second;
};

} // namespace

MaskedCorrelator::MaskedCorrelator(VolumeView<const Complex> fixed, const std::array<int, 3>& movingDimensions,
                                   const ShiftRange& shifts)
  : shifts_(shifts), movingDimensions_(movingDimensions)
{
  std::array<int, 3> at{};
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = -shifts.first[axis];
    const int n = std::max(fixed.Dimensions()[axis] - shifts.first[axis], shifts.last[axis] + movingDimensions[axis]);
    size_[axis] = GoodSize(std::max(n, movingDimensions[axis]));
  }
  Spectrum pair;
  Forward(fixed, at, pair);
  weights_.resize(pair.size());
  values_.resize(pair.size());
  for (std::ptrdiff_t k = 0; k < size_[2]; ++k)
    for (std::ptrdiff_t j = 0; j < size_[1]; ++j)
      for (std::ptrdiff_t i = 0; i < size_[0]; ++i) {
        const std::size_t here = static_cast<std::size_t>((k * size_[1] + j) * size_[0] + i);
        const std::size_t there = static_cast<std::size_t>((Opposite(k, size_[2]) * size_[1] + Opposite(j, size_[1])) * size_[0] +
                                                           Opposite(i, size_[0]));
        const Pair spectra(pair[here], pair[there]);
        weights_[here] = spectra.first;
        values_[here] = spectra.second;
      }
  Volume<Complex> squares(fixed.Dimensions());
  for (std::ptrdiff_t i = 0; i < fixed.Size(); ++i)
    if (fixed[i].real() > 0.0f)
      squares.View()[i] = fixed[i].imag() * fixed[i].imag() / fixed[i].real();
  Forward(squares.View(), at, squares_);
}

// Only rows, then slices, that hold voxels are transformed before all are.
void MaskedCorrelator::Forward(VolumeView<const Complex> voxels, const std::array<int, 3>& at, Spectrum& spectrum) const
{
  const auto& n = voxels.Dimensions();
  spectrum.assign(static_cast<std::size_t>(Count()), Complex());
  const auto wrapped = [this](int position, int axis) { return position % size_[axis]; };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      Complex* row = &spectrum[static_cast<std::size_t>(
          (static_cast<std::ptrdiff_t>(wrapped(k + at[2], 2)) * size_[1] + wrapped(j + at[1], 1)) * size_[0])];
      for (int i = 0; i < n[0]; ++i)
        row[wrapped(i + at[0], 0)] = voxels(i, j, k);
    }
  if (at == std::array<int, 3>{0, 0, 0}) {
    TransformAxis(spectrum.data(), size_, {size_[0], n[1], n[2]}, 0, true);
    TransformAxis(spectrum.data(), size_, {size_[0], size_[1], n[2]}, 1, true);
  } else {
    TransformAxis(spectrum.data(), size_, size_, 0, true);
    TransformAxis(spectrum.data(), size_, size_, 1, true);
  }
  TransformAxis(spectrum.data(), size_, size_, 2, true);
}

// Only what lies within the range of shifts is right afterwards.
void MaskedCorrelator::Backward(Spectrum& spectrum) const
{
  const auto counts = shifts_.Counts();
  TransformAxis(spectrum.data(), size_, size_, 2, false);
  TransformAxis(spectrum.data(), size_, {size_[0], size_[1], counts[2]}, 1, false);
  TransformAxis(spectrum.data(), size_, {size_[0], counts[1], counts[2]}, 0, false);
}

void MaskedCorrelator::Products(VolumeView<const Complex> moving, VolumeView<Complex> out, Work& work) const
{
  Forward(moving, {0, 0, 0}, work.moving);
  Spectrum& sum = work.sums[0];
  sum.resize(work.moving.size());
  for (std::ptrdiff_t k = 0; k < size_[2]; ++k)
    for (std::ptrdiff_t j = 0; j < size_[1]; ++j) {
      const std::ptrdiff_t row = (k * size_[1] + j) * size_[0];
      const Complex* opposite = work.moving.data() + (Opposite(k, size_[2]) * size_[1] + Opposite(j, size_[1])) * size_[0];
      for (std::ptrdiff_t i = 0; i < size_[0]; ++i) {
        const std::size_t here = static_cast<std::size_t>(row + i);
        const Pair m(work.moving[here], opposite[Opposite(i, size_[0])]);
        sum[here] = Times(weights_[here], std::conj(m.first)) + TimesI(Times(values_[here], std::conj(m.second)));
      }
    }
  Backward(sum);
  const float scale = 1.0f / static_cast<float>(Count());
  const auto counts = shifts_.Counts();
  for (int k = 0; k < counts[2]; ++k)
    for (int j = 0; j < counts[1]; ++j) {
      const Complex* row = &sum[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0])];
      std::transform(row, row + counts[0], out.Row(j, k), [scale](Complex c) { return c * scale; });
    }
}

void MaskedCorrelator::Normalised(VolumeView<const Complex> moving, double leastWeight, VolumeView<Complex> out, Work& work) const
{
  Volume<Complex> squared(moving.Dimensions());
  for (std::ptrdiff_t i = 0; i < moving.Size(); ++i)
    if (moving[i].real() > 0.0f)
      squared.View()[i] = moving[i].imag() * moving[i].imag() / moving[i].real();
  Forward(moving, {0, 0, 0}, work.moving);
  Forward(squared.View(), {0, 0, 0}, work.squares);
  for (Spectrum& sum : work.sums)
    sum.resize(work.moving.size());
  for (std::ptrdiff_t k = 0; k < size_[2]; ++k)
    for (std::ptrdiff_t j = 0; j < size_[1]; ++j) {
      const std::ptrdiff_t row = (k * size_[1] + j) * size_[0];
      const Complex* opposite = work.moving.data() + (Opposite(k, size_[2]) * size_[1] + Opposite(j, size_[1])) * size_[0];
      for (std::ptrdiff_t i = 0; i < size_[0]; ++i) {
        const std::size_t here = static_cast<std::size_t>(row + i);
        const Pair m(work.moving[here], opposite[Opposite(i, size_[0])]);
        const Complex w = std::conj(m.first), v = std::conj(m.second), s = std::conj(work.squares[here]);
        work.sums[0][here] = Times(weights_[here], w) + TimesI(Times(values_[here], v));
        work.sums[1][here] = Times(values_[here], w) + TimesI(Times(weights_[here], v));
        work.sums[2][here] = Times(squares_[here], w) + TimesI(Times(weights_[here], s));
      }
    }
  for (Spectrum& sum : work.sums)
    Backward(sum);
  const double scale = 1.0 / static_cast<double>(Count());
  const auto counts = shifts_.Counts();
  for (int k = 0; k < counts[2]; ++k)
    for (int j = 0; j < counts[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0]);
      Complex* to = out.Row(j, k);
      for (std::size_t i = 0; i < static_cast<std::size_t>(counts[0]); ++i) {
        const double n = scale * static_cast<double>(work.sums[0][row + i].real());
        double ncc = 0.0;
        if (n >= leastWeight && n > 0.0) {
          const double fm = scale * static_cast<double>(work.sums[0][row + i].imag()) / n;
          const double f = scale * static_cast<double>(work.sums[1][row + i].real()) / n;
          const double m = scale * static_cast<double>(work.sums[1][row + i].imag()) / n;
          const double ff = scale * static_cast<double>(work.sums[2][row + i].real()) / n - f * f;
          const double mm = scale * static_cast<double>(work.sums[2][row + i].imag()) / n - m * m;
          // Single precision leaves this much of the squares undecided.
          const double least = 1e-5;
          if (ff > least * (1.0 + f * f) && mm > least * (1.0 + m * m))
            ncc = std::clamp((fm - f * m) / std::sqrt(ff * mm), -1.0, 1.0);
        }
        to[i] = {static_cast<float>(n), static_cast<float>(ncc)};
      }
    }
}

} // namespace echorama
