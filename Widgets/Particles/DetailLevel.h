// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <cmath>

namespace echorama {

/// Chooses how coarse a picture is while something is dragged, so that a frame stays below a budget of time. Level 0 is the full
/// picture; each next one costs about a third.
///
/// Two slow frames in turn, or a very slow one, make the next ones coarser: one alone may be another program's doing. Finer ones
/// are tried after some that were much faster than need be; a level that was too slow is not tried again in the same drag, so
/// that the picture does not flicker between two.
class DetailLevel {
public:
  static constexpr int Coarsest = 5;  ///< a 243rd: less would tell nothing any more
  static constexpr double Step = 3.0; ///< of cost from level to level, about

  explicit DetailLevel(double budgetSeconds = 0.1) : budget_(budgetSeconds) {}
  double Budget() const { return budget_; }
  int Level() const { return level_; }

  /// A drag begins. \a fullSeconds: what the full picture took last; 0: not known.
  void Begin(double fullSeconds)
  {
    level_ = LevelFor(fullSeconds);
    tooFine_ = -1;
    fast_ = slow_ = 0;
  }

  /// The level that Begin would choose.
  int LevelFor(double fullSeconds) const { return std::clamp(static_cast<int>(std::ceil(Steps(fullSeconds))), 0, Coarsest); }

  /// A frame of the level took \a seconds. \returns whether the next one has another level.
  bool Measure(double seconds)
  {
    const int before = level_;
    const bool slow = seconds > 0.8 * budget_;
    const bool fast = !slow && level_ > tooFine_ + 1 && seconds * Step < 0.6 * budget_;
    slow_ = slow ? slow_ + 1 : 0;
    fast_ = fast ? fast_ + 1 : 0;
    if (slow_ >= 2 || seconds > 3.0 * budget_) {
      tooFine_ = std::max(tooFine_, level_);
      level_ = std::min(level_ + std::max(1, static_cast<int>(std::round(Steps(seconds)))), Coarsest);
      slow_ = 0;
    } else if (fast_ >= 5) {
      --level_;
      fast_ = 0;
    }
    return level_ != before;
  }

private:
  // Levels from what takes so long to what takes 60 % of the budget.
  double Steps(double seconds) const { return seconds > 0.0 ? std::log(seconds / (0.6 * budget_)) / std::log(Step) : 0.0; }

  double budget_;
  int level_ = 0, tooFine_ = -1, fast_ = 0, slow_ = 0;
};

} // namespace echorama
