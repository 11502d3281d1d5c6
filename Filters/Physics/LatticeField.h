// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstddef>
#include <cstring>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// How values at the nodes of a regular lattice lie in memory: rows along x with room to read and write beyond their ends (one
/// vector of lanes), and one row and slice of ghosts on each side, so that loops over stencils need no cases.
struct LatticeShape {
  static constexpr int Lanes = 8;
  std::array<int, 3> nodes{0, 0, 0};
  std::ptrdiff_t row = 0, slice = 0, size = 0;

  LatticeShape() = default;
  explicit LatticeShape(const std::array<int, 3>& theNodes) : nodes(theNodes)
  {
    row = Padded() + 2 * Lanes;
    slice = row * (nodes[1] + 2);
    size = slice * (nodes[2] + 2);
  }
  /// Nodes of a row, rounded up to whole lanes.
  int Padded() const { return (nodes[0] + Lanes - 1) / Lanes * Lanes; }
  /// Where a node lies; -1 and nodes[axis] are ghosts.
  std::ptrdiff_t At(int i, int j, int k) const { return (k + 1) * slice + (j + 1) * row + Lanes + i; }
  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(nodes[0]) * nodes[1] * nodes[2]; }
};

/// A vector at every node, component by component; ghosts are zero.
template <class T>
class LatticeField {
public:
  LatticeField() = default;
  explicit LatticeField(const LatticeShape& shape) : shape_(shape), data_(static_cast<std::size_t>(3 * shape.size), T(0)) {}

  const LatticeShape& Shape() const { return shape_; }
  T* Component(int c) { return data_.data() + c * shape_.size; }
  const T* Component(int c) const { return data_.data() + c * shape_.size; }
  Eigen::Matrix<T, 3, 1> Get(std::ptrdiff_t at) const { return {Component(0)[at], Component(1)[at], Component(2)[at]}; }
  void Set(std::ptrdiff_t at, const Eigen::Matrix<T, 3, 1>& value)
  {
    for (int c = 0; c < 3; ++c)
      Component(c)[at] = value[c];
  }
  void Fill(T value) { std::fill(data_.begin(), data_.end(), value); }
  std::vector<T>& Data() { return data_; }
  const std::vector<T>& Data() const { return data_; }

private:
  LatticeShape shape_;
  std::vector<T> data_;
};

/// Calls body(i, j, k) for every node of a lattice, x fastest.
template <class Body>
void ForNodes(const std::array<int, 3>& nodes, const Body& body)
{
  for (int k = 0; k < nodes[2]; ++k)
    for (int j = 0; j < nodes[1]; ++j)
      for (int i = 0; i < nodes[0]; ++i)
        body(i, j, k);
}

} // namespace echorama
