// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include <functional>
#include <utility>

namespace echorama {

/// How a long kernel tells how far it is, and learns that it should stop.
///
/// A kernel calls it from the thread it was called on, with a fraction in [0, 1]. When the callback returns false the
/// call throws Error(Cancelled), which unwinds the kernel. A default Progress does nothing.
class Progress {
public:
  using Callback = std::function<bool(double fraction)>;

  Progress() = default;
  explicit Progress(Callback callback) : callback_(std::move(callback)) {}

  void operator()(double fraction) const
  {
    if (callback_ && !callback_(begin_ + (end_ - begin_) * fraction))
      throw Error(Error::Kind::Cancelled, "stopped on request");
  }

  /// The progress of one step that takes the piece [begin, end] of this one.
  Progress Part(double begin, double end) const
  {
    Progress part(callback_);
    part.begin_ = begin_ + (end_ - begin_) * begin;
    part.end_ = begin_ + (end_ - begin_) * end;
    return part;
  }

private:
  Callback callback_;
  double begin_ = 0.0, end_ = 1.0;
};

} // namespace echorama
