// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>

namespace echorama {

/// How far a voxel is on its way from the empty region of a volume (0) to its pure region (1): e / (p + e), dissertation
/// eq. 5.3. A distance is infinite where its region does not exist: without an empty region the scale is 1, without a pure
/// region 0, without either 1 (nothing speaks against the volume; equal volumes then share equally).
/// \param pure, empty distances, mm, >= 0; not both 0
float BlendScale(float pure, float empty);

/// ratio^b for ratios in [0, 1], with 0^0 = 1; the common sharpnesses without a power function.
struct BlendPower {
  explicit BlendPower(double b);
  enum class Kind { Zero, One, OneAndAHalf, Two, ThirtyTwo, Other } kind;
  float exponent;
};

/// The weights of some volumes at each voxel of a row: s_i^b / sum s_j^b, dissertation eq. 5.10 (5.4 with b = 1).
/// Scales are divided by the largest of the voxel first, so that a large b never gives 0/0. All scales 0: each weight is
/// one over the number of volumes.
/// \param scales a row of \a count per volume
/// \param factors how far each volume can be trusted, > 0: multiplies s^b; nullptr, for one volume or for all: 1
/// \param weights receives a row per volume \param scratch 2 * count numbers
void BlendWeights(const float* const* scales, const float* const* factors, std::size_t volumes, std::size_t count,
                  const BlendPower& power, float* const* weights, float* scratch);

/// How a row of voxels is made of volumes: what they have there, a row of \a count each.
template <class A>
struct BlendRow {
  std::size_t volumes = 0, count = 0;
  const A* const* value = nullptr;
  const float* const* weight = nullptr; ///< BlendWeights
  // Only where details are blended apart:
  const A* const* low = nullptr;           ///< the smooth part
  const float* const* share = nullptr;     ///< BlendWeights of the details, value - low
  const float* const* deviation = nullptr; ///< of the details around here
  const float* correlation = nullptr;      ///< of the details of volumes a and b, at a * volumes + b
  float mostAmplified = 1.0f;              ///< details are made stronger or weaker by no more than this
  float* scratch = nullptr;                ///< 2 * count numbers
};

///@{
/// result := the weighted mean, v0 + sum w (v - v0), so that what is the same in all is kept to the last bit.
void BlendMean(const BlendRow<float>& row, float* result);
void BlendMean(const BlendRow<double>& row, double* result);
///@}

///@{
/// result := the mean of the smooth parts, and the details that change over by their own shares: sum h H / sqrt(sum h_i h_j
/// rho_ij). How strong these are goes with the smooth weights: a texture that ends abruptly at a stronger one is a seam as well.
/// \param sum count numbers
void BlendSplit(const BlendRow<float>& row, float* sum, float* result);
void BlendSplit(const BlendRow<double>& row, double* sum, double* result);
///@}

///@{
/// to := gain * value + offset; with \a inside and \a coverage only where the volume is (bit 0) and no other.
void ApplyGain(const float* value, float gain, float offset, std::size_t count, float* to);
void ApplyGain(const double* value, double gain, double offset, std::size_t count, double* to);
void ShowAlone(const float* value, const unsigned char* inside, const unsigned char* coverage, float gain, float offset,
               std::size_t count, float* to);
void ShowAlone(const double* value, const unsigned char* inside, const unsigned char* coverage, double gain, double offset,
               std::size_t count, double* to);
///@}

} // namespace echorama
