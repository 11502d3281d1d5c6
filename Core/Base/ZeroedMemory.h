// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace echorama {

/// Memory of arrays of numbers that begin with zeros: large ones lie on huge pages where the system has them (a fault of a page
/// costs as much as a pass over it, and a huge page is 512 of them), and nobody writes the zeros, so that each thread brings in
/// the pages that it is the first to write to.
template <class T>
class ZeroedMemory {
public:
  using value_type = T;
  ZeroedMemory() = default;
  template <class U>
  explicit ZeroedMemory(const ZeroedMemory<U>&)
  {
  }
  T* allocate(std::size_t count)
  {
    void* memory = nullptr;
#ifdef __linux__
    if (const std::size_t bytes = Bytes(count); bytes >= Large) {
      // As much as is needed, from the beginning of a huge page on.
      void* all = mmap(nullptr, bytes + HugePage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (all == MAP_FAILED)
        throw std::bad_alloc();
      const std::size_t before = (HugePage - reinterpret_cast<std::size_t>(all) % HugePage) % HugePage;
      memory = static_cast<char*>(all) + before;
      if (before > 0)
        munmap(all, before);
      munmap(static_cast<char*>(memory) + bytes, HugePage - before);
      madvise(memory, bytes, MADV_HUGEPAGE);
      return static_cast<T*>(memory);
    }
#endif
    memory = std::calloc(count, sizeof(T));
    if (!memory)
      throw std::bad_alloc();
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count)
  {
#ifdef __linux__
    if (const std::size_t bytes = Bytes(count); bytes >= Large) {
      munmap(memory, bytes);
      return;
    }
#endif
    static_cast<void>(count);
    std::free(memory);
  }
  template <class U>
  void construct(U*)
  {
  }
  template <class U, class... From>
  void construct(U* where, From&&... from)
  {
    ::new (static_cast<void*>(where)) U(std::forward<From>(from)...);
  }
  bool operator==(const ZeroedMemory&) const
  {
    return true;
  }
  bool operator!=(const ZeroedMemory&) const
  {
    return false;
  }

private:
  static constexpr std::size_t HugePage = std::size_t(1) << 21, Large = 2 * HugePage;
  static constexpr std::size_t Page = std::size_t(1) << 16; // the largest of any system: what is given back begins with a page
  static std::size_t Bytes(std::size_t count)
  {
    return (count * sizeof(T) + Page - 1) / Page * Page;
  }
};

/// An array of numbers, made with so many zeros: Zeroed<float> array(count). It is made at its size: what one that shrank grows
/// by again is not zero.
template <class T>
using Zeroed = std::vector<T, ZeroedMemory<T>>;

} // namespace echorama
