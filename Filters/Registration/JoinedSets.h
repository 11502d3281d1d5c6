// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Index.h"
#include <algorithm>
#include <numeric>
#include <vector>

namespace echorama {

/// Sets of numbers that are joined; the smallest member names a set.
class JoinedSets {
public:
  explicit JoinedSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0); }
  int Of(int v)
  {
    while (parents_[Index(v)] != v)
      v = parents_[Index(v)] = parents_[Index(parents_[Index(v)])];
    return v;
  }
  bool Join(int a, int b) ///< \returns whether they were apart
  {
    a = Of(a);
    b = Of(b);
    parents_[Index(std::max(a, b))] = std::min(a, b);
    return a != b;
  }

private:
  std::vector<int> parents_;
};

} // namespace echorama
