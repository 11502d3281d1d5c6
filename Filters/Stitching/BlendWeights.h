// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cmath>
#include <cstddef>

namespace echorama {

/// How far a voxel is on its way from the empty region of a volume (0) to its pure region (1): e / (p + e), dissertation
/// eq. 5.3. A distance is infinite where its region does not exist: without an empty region the scale is 1, without a pure
/// region 0, without either 1 (nothing speaks against the volume; equal volumes then share equally).
/// \param pure, empty distances, mm, >= 0; not both 0
float BlendScale(float pure, float empty);

/// ratio^b for ratios in [0, 1], with 0^0 = 1; the common sharpnesses without a power function.
class BlendPower {
public:
  explicit BlendPower(double b)
    : kind_(b == 0.0    ? Kind::Zero
            : b == 1.0  ? Kind::One
            : b == 1.5  ? Kind::OneAndAHalf
            : b == 2.0  ? Kind::Two
            : b == 32.0 ? Kind::ThirtyTwo
                        : Kind::Other),
      b_(static_cast<float>(b))
  {
  }

  float operator()(float ratio) const
  {
    switch (kind_) {
    case Kind::Zero:
      return 1.0f;
    case Kind::One:
      return ratio;
    case Kind::OneAndAHalf:
      return ratio * std::sqrt(ratio);
    case Kind::Two:
      return ratio * ratio;
    case Kind::ThirtyTwo:
      for (int doubling = 0; doubling < 5; ++doubling)
        ratio *= ratio;
      return ratio;
    case Kind::Other:
      break;
    }
    return std::pow(ratio, b_);
  }

private:
  enum class Kind { Zero, One, OneAndAHalf, Two, ThirtyTwo, Other } kind_;
  float b_;
};

/// The weights of \a count volumes at one voxel: s_i^b / sum s_j^b, dissertation eq. 5.10 (5.4 with b = 1).
/// Scales are divided by the largest first, so that a large b never gives 0/0. All scales 0: each weight is 1 / count.
/// \param factors how far each volume can be trusted, > 0: multiplies s^b; nullptr: 1
void BlendWeights(const float* scales, const float* factors, std::size_t count, const BlendPower& power, float* weights);

} // namespace echorama
