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

/// The level of each frame of a view: full at rest; while something is dragged as DetailLevel has it; after that one finer with
/// each Refine, as far as the time of a frame at rest allows.
class FrameDetail {
public:
  static constexpr double AtOnceSeconds = 0.1; ///< nobody feels that the mouse waits so long

  double restSeconds = 1.0; ///< what a frame of Refine may take to draw

  double Budget() const { return drag_.Budget(); }
  void SetBudget(double seconds) { drag_ = DetailLevel(seconds); }

  bool Interactive() const { return interactive_; }
  bool Dragging() const { return interactive_ && refined_ < 0; }
  bool Full() const { return !interactive_ || refined_ == 0; }
  int Level() const { return !interactive_ ? 0 : refined_ >= 0 ? refined_ : drag_.Level(); }
  /// The level that a drag would begin with.
  int LevelFor(double fullSeconds) const { return drag_.LevelFor(fullSeconds); }

  /// \param fullSeconds: what the full picture takes; 0: not known. \returns false when all is as it was.
  bool SetInteractive(bool on, double fullSeconds)
  {
    if (interactive_ == on && refined_ < 0)
      return false;
    interactive_ = on;
    refined_ = -1;
    if (on)
      Begin(fullSeconds);
    return true;
  }

  /// A drag begins, or goes on with another picture.
  void Begin(double fullSeconds)
  {
    refined_ = -1;
    coarser_ = 0.0;
    drag_.Begin(fullSeconds);
  }

  /// A frame took \a seconds, \a drawSeconds of these to draw. \a typical: the next one will cost as much. \returns whether the
  /// next one has another level.
  bool Measure(double seconds, double drawSeconds, bool typical)
  {
    drawn_ = drawSeconds;
    return Dragging() && typical && drag_.Measure(seconds);
  }

  /// The drag is over, and its level stays.
  void Stay() { refined_ = Level(); }

  /// As Stay, one level finer; at once the full picture where that is known to take no longer than AtOnceSeconds.
  /// \param fullSeconds: what the full picture took last; 0: not known.
  /// \returns false, and does nothing, at level 0 or when the frame would take too long: as much more as the last step took; of
  /// the first step what is known of levels.
  bool Refine(double fullSeconds)
  {
    const int level = Level();
    const double growth = coarser_ > 0.0 ? std::clamp(drawn_ / coarser_, 1.2, DetailLevel::Step) : DetailLevel::Step;
    if (level == 0 || (level == 1 && fullSeconds > 0.0 ? fullSeconds : growth * drawn_) > restSeconds)
      return false;
    coarser_ = drawn_;
    refined_ = fullSeconds > 0.0 && fullSeconds <= AtOnceSeconds ? 0 : level - 1;
    return true;
  }

private:
  DetailLevel drag_;
  bool interactive_ = false;
  int refined_ = -1;                   ///< the level of Refine; -1: that of the drag
  double drawn_ = 0.0, coarser_ = 0.0; ///< what the last frame took to draw, and that of the level before
};

} // namespace echorama
