// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "SharedWork.h"
#include <algorithm>
#include <limits>

namespace echorama {

/// The ranks of a vtkMultiProcessController, or of what has its functions; one rank where there is none. Kernels name nothing of
/// VTK, so the class comes from whoever has one.
template <class Controller>
class ControllerWork : public SharedWork {
public:
  /// \param mostBytes of all ranks that go in one call: MPI counts in int
  explicit ControllerWork(Controller* controller, std::int64_t mostBytes = std::numeric_limits<int>::max() / 2)
    : controller_(controller && controller->GetNumberOfProcesses() > 1 ? controller : nullptr), mostBytes_(mostBytes)
  {
  }
  int Rank() const override { return controller_ ? controller_->GetLocalProcessId() : 0; }
  int Ranks() const override { return controller_ ? controller_->GetNumberOfProcesses() : 1; }

protected:
  std::vector<std::string> AllGather(const std::string& mine) override
  {
    using Id = long long; // vtkIdType
    const auto ranks = static_cast<std::size_t>(Ranks());
    const auto size = static_cast<Id>(mine.size());
    std::vector<Id> sizes(ranks), counts(ranks), places(ranks);
    Check(controller_->AllGather(&size, sizes.data(), 1));
    std::vector<std::string> all(ranks);
    const Id piece = std::max<Id>(1, mostBytes_ / static_cast<Id>(ranks));
    for (Id done = 0; done < *std::max_element(sizes.begin(), sizes.end()); done += piece) {
      Id sum = 0;
      for (std::size_t rank = 0; rank < ranks; ++rank) {
        places[rank] = sum;
        counts[rank] = std::clamp<Id>(sizes[rank] - done, 0, piece);
        sum += counts[rank];
      }
      std::vector<char> received(static_cast<std::size_t>(sum));
      const std::size_t own = std::min(static_cast<std::size_t>(done), mine.size());
      Check(controller_->AllGatherV(mine.data() + own, received.data(), counts[static_cast<std::size_t>(Rank())], counts.data(),
                                    places.data()));
      for (std::size_t rank = 0; rank < ranks; ++rank)
        all[rank].append(received.data() + places[rank], static_cast<std::size_t>(counts[rank]));
    }
    return all;
  }

private:
  static void Check(int isDone)
  {
    if (!isDone)
      throw Error(Error::Kind::NotPossible, "the other ranks cannot be reached");
  }

  Controller* controller_;
  std::int64_t mostBytes_;
};

} // namespace echorama
