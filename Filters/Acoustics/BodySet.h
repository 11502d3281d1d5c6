// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// The shells (connected closed surfaces) that hold a point: a sorted set of small numbers. A few are kept in place, more on
/// the heap.
class BodySet {
public:
  const std::int32_t* begin() const { return count_ <= few ? few_.data() : many_.data(); }
  const std::int32_t* end() const { return begin() + count_; }
  int Count() const { return count_; }
  bool Contains(std::int32_t shell) const;
  /// Both may be asked for what is so already.
  void Insert(std::int32_t shell);
  void Erase(std::int32_t shell);
  bool operator==(const BodySet& other) const;

private:
  static constexpr int few = 10;
  int count_ = 0;
  std::array<std::int32_t, few> few_{};
  std::vector<std::int32_t> many_; ///< all of them, when they are more than a few
};

} // namespace echorama
