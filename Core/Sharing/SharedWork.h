// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace echorama {

/// What a rank has told the others and been told, every message sent from rank to rank.
struct Traffic {
  std::int64_t exchanges = 0, messages = 0, bytesSent = 0, bytesReceived = 0;
};

/// Ranks: processes that run the same program on the same input and share its work. By itself it is one rank alone.
///
/// Every rank asks for the same exchanges in the same order, all of them within Run(). What a rank cannot do ends all: its error
/// takes the place of its next message, and each rank throws it.
class SharedWork {
public:
  virtual ~SharedWork() = default;
  virtual int Rank() const { return 0; }
  virtual int Ranks() const { return 1; }

  /// Which of \a count items are those of \a rank: from first up to, and without, second. Neighbours stay together.
  std::pair<std::ptrdiff_t, std::ptrdiff_t> ShareOf(int rank, std::ptrdiff_t count) const
  {
    return {rank * count / Ranks(), (rank + 1) * count / Ranks()};
  }
  std::pair<std::ptrdiff_t, std::ptrdiff_t> Share(std::ptrdiff_t count) const { return ShareOf(Rank(), count); }

  /// What each rank has to say, by rank. \param about what all have to agree on, such as a checksum of the question
  /// \throws Error what another rank threw; Error(BadInput) when the ranks are not about the same
  std::vector<std::string> Exchange(const std::string& mine, const std::string& about = {});

  /// Does \a work on every rank, and comes back when all have done it. \throws Error what it threw on any rank, with the number
  /// of that rank, unless all threw the same; alone, whatever it throws
  void Run(const std::function<void()>& work);

  const Traffic& Told() const { return traffic_; }

protected:
  /// The messages of all ranks, by rank. \throws Error(NotPossible) when they cannot be reached
  virtual std::vector<std::string> AllGather(const std::string& mine) { return {mine}; }

private:
  std::vector<std::string> Pass(const std::string& status, const std::string& mine);

  Traffic traffic_;
  bool isOver_ = false; // all know that a rank has failed
};

} // namespace echorama
