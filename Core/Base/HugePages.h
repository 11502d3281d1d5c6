// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace echorama {

/// Asks for huge pages under a large array that was just allocated and that nobody has written to yet, such as one of VTK's.
/// Memory of our own is that of ZeroedMemory.h.
inline void PreferHugePages(void* memory, std::size_t bytes)
{
#ifdef __linux__
  constexpr std::uintptr_t hugePage = std::uintptr_t(1) << 21;
  const auto start = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (start + hugePage - 1) / hugePage * hugePage, end = (start + bytes) / hugePage * hugePage;
  if (first < end)
    madvise(static_cast<char*>(memory) + (first - start), end - first, MADV_HUGEPAGE);
#else
  static_cast<void>(memory);
  static_cast<void>(bytes);
#endif
}

} // namespace echorama
