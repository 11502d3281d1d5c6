// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Packing.h"
#include "SharedWork.h"
#include <algorithm>

namespace echorama {

/// What `find(first, count, begin, end)` finds for each of \a count items, on every rank: each does a piece of them, and they
/// tell each other after every \a atOnce. It finds the first of these items, and as many more as it likes, in their order; from
/// begin to end is their part of what this rank does, in [0, 1]. T is packed and unpacked by the functions Pack(Packed&, const
/// T&) and Unpack(Unpacked&, T&). \param hear hear(i, found) is called for each item, as soon as it is known \param about see
/// SharedWork::Exchange
template <class T, class Find, class Hear>
std::vector<T> ShareOut(SharedWork& shared, std::size_t count, std::size_t atOnce, const std::string& about, const Find& find,
                        const Hear& hear)
{
  std::vector<T> all(count);
  const auto items = static_cast<std::ptrdiff_t>(count), step = static_cast<std::ptrdiff_t>(atOnce);
  const std::ptrdiff_t most = (items + shared.Ranks() - 1) / shared.Ranks(); // of any rank
  for (std::ptrdiff_t done = 0; done < most; done += step) {
    const auto pieceOf = [&](int rank) {
      const auto [first, last] = shared.ShareOf(rank, items);
      return std::pair(first + done, std::min(last, first + done + step));
    };
    Packed mine;
    const auto [first, last] = shared.Share(items);
    const auto part = [first = first, last = last](std::ptrdiff_t i) {
      return static_cast<double>(i - first) / static_cast<double>(last - first);
    };
    for (auto [i, end] = pieceOf(shared.Rank()); i < end;)
      for (T& found : find(static_cast<std::size_t>(i), static_cast<std::size_t>(end - i), part(i), part(end))) {
        T& item = all[static_cast<std::size_t>(i)] = std::move(found);
        hear(static_cast<std::size_t>(i++), item);
        if (shared.Ranks() > 1)
          Pack(mine, item);
      }
    const std::vector<std::string> told = shared.Exchange(mine.Bytes(), about);
    for (int rank = 0; rank < shared.Ranks(); ++rank) {
      if (rank == shared.Rank())
        continue;
      Unpacked from(told[static_cast<std::size_t>(rank)]);
      for (auto [i, end] = pieceOf(rank); i < end; ++i) {
        T& item = all[static_cast<std::size_t>(i)];
        Unpack(from, item);
        hear(static_cast<std::size_t>(i), item);
      }
    }
  }
  return all;
}

} // namespace echorama
