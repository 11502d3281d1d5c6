// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace echorama {

/// What VTK classes report as errors and warnings. VTK has one place for it in a process, and reports from any thread.
class Messages {
public:
  /// Takes over VTK's output. What no OfThread gathers goes, as one sentence, to \a show, on the thread that reported it.
  static void Install(std::function<void(const std::string& message, bool isError)> show);

  /// While it lives, gathers what its thread reports; inside another, what was reported since it began, which the other then
  /// does not hear of.
  class OfThread {
  public:
    OfThread();
    ~OfThread();
    OfThread(const OfThread&) = delete;
    OfThread& operator=(const OfThread&) = delete;
    std::vector<std::string> Warnings() const;
    /// The first error that gives a reason; empty: none.
    std::string Error() const;
    /// Throws it as Error(BadInput), if there is one.
    void ThrowErrors() const;

  private:
    std::size_t begin_, beginOfWarnings_; ///< of its errors and warnings, among those of the thread
  };
};

} // namespace echorama
