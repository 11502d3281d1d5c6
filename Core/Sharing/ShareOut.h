// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Packing.h"
#include "SharedWork.h"
#include <algorithm>

namespace echorama {

/// What `find(i, begin, end)` finds for each of \a count items, on every rank: each does a piece of them, and they tell each
/// other after every \a atOnce. From begin to end is item i 's part of what this rank does, in [0, 1]. T is packed and unpacked
/// by the functions Pack(Packed&, const T&) and Unpack(Unpacked&, T&). \param hear hear(i, found) is called for each item, as
/// soon as it is known \param about see SharedWork::Exchange
template <class T, class Find, class Hear>
std::vector<T> ShareOut(SharedWork& shared, std::size_t count, std::size_t atOnce, const std::string& about, const Find& find,
                        const Hear& hear)
{
  std::vector<T> all(count);
  const auto items = static_cast<std::ptrdiff_t>(count), step = static_cast<std::ptrdiff_t>(atOnce);
  const std::ptrdiff_t most = (items + shared.Ranks() - 1) / shared.Ranks(); // of any rank
  for (std::ptrdiff_t done = 0; done < most; done += step) {
    const auto forEachOf = [&](int rank, const auto& visit) {
      const auto [first, last] = shared.ShareOf(rank, items);
      for (std::ptrdiff_t i = first + done; i < std::min(last, first + done + step); ++i)
        visit(static_cast<std::size_t>(i), static_cast<double>(i - first) / static_cast<double>(last - first),
              static_cast<double>(i - first + 1) / static_cast<double>(last - first));
    };
    Packed mine;
    forEachOf(shared.Rank(), [&](std::size_t i, double begin, double end) {
      all[i] = find(i, begin, end);
      hear(i, all[i]);
      if (shared.Ranks() > 1)
        Pack(mine, all[i]);
    });
    const std::vector<std::string> told = shared.Exchange(mine.Bytes(), about);
    for (int rank = 0; rank < shared.Ranks(); ++rank) {
      if (rank == shared.Rank())
        continue;
      Unpacked from(told[static_cast<std::size_t>(rank)]);
      forEachOf(rank, [&](std::size_t i, double, double) {
        Unpack(from, all[i]);
        hear(i, all[i]);
      });
    }
  }
  return all;
}

} // namespace echorama
