// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

namespace echorama::testing {

/// The front of a column of water, twice as high as wide, that runs out on a dry bed: Martin and Moyce, Phil. Trans. R. Soc. A
/// 244 (1952), figure 3 (a width of 2.25 inches). Lengths are in widths, times in sqrt(width / (2 g)). Their water is released by
/// a gate, a computed one at once, which is a constant lead; so the front is timed between places that it passes after that.
class DamBreak {
public:
  static constexpr std::array<double, 3> places{2.292, 2.995, 4.134}, measured{1.997, 2.547, 3.345};
  static constexpr double end = 3.4;

  static double TimeUnit(double widthMm) { return std::sqrt(widthMm / (2.0 * 9810.0)); }

  /// Where the front is, as time goes on.
  void Pass(double time, double front)
  {
    for (std::size_t p = 0; p < places.size(); ++p)
      if (front_ < places[p] && front >= places[p])
        passed_[p] = time_ + (time - time_) * (places[p] - front_) / (front - front_);
    time_ = time;
    front_ = front;
  }

  /// How long the way from the first place takes, as a part of what was measured too much or too little, at worst; 1 when the
  /// front never came there.
  double Error() const
  {
    double worst = 0.0;
    for (std::size_t p = 1; p < places.size(); ++p)
      worst = std::max(worst, passed_[p] > 0.0 ? std::abs((passed_[p] - passed_[0]) / (measured[p] - measured[0]) - 1.0) : 1.0);
    return worst;
  }

  double Lead() const { return measured[0] - passed_[0]; }

private:
  double time_ = 0.0, front_ = 1.0;
  std::array<double, 3> passed_{};
};

} // namespace echorama::testing
