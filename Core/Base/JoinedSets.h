// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace echorama {

/// Sets of numbers that are joined (union-find); the smallest member names a set.
template <class Number = std::size_t>
class JoinedSets {
public:
  explicit JoinedSets(std::size_t count = 0) : parents_(count) { std::iota(parents_.begin(), parents_.end(), Number(0)); }
  Number Add() ///< the next number, in a set of its own
  {
    parents_.push_back(static_cast<Number>(parents_.size()));
    return parents_.back();
  }
  Number Of(Number v)
  {
    while (Parent(v) != v)
      v = Parent(v) = Parent(Parent(v));
    return v;
  }
  bool Join(Number a, Number b) ///< \returns whether they were apart
  {
    a = Of(a);
    b = Of(b);
    Parent(std::max(a, b)) = std::min(a, b);
    return a != b;
  }

private:
  Number& Parent(Number v) { return parents_[static_cast<std::size_t>(v)]; }

  std::vector<Number> parents_;
};

} // namespace echorama
