// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/LatticeField.h"
#include <array>
#include <vector>

namespace echorama {

/// A symmetric matrix that ties every node of a lattice to the 27 nodes around it by blocks of 3 x 3.
///
/// For each row of nodes there are 27 x 9 runs of numbers along x: [offset][row][column][node], offset =
/// (dz + 1) * 9 + (dy + 1) * 3 + dx + 1. Products are then plain loops along x.
class LatticeMatrix {
public:
  static constexpr int Entries = 243;

  LatticeMatrix() = default;
  explicit LatticeMatrix(const LatticeShape& shape);

  const LatticeShape& Shape() const { return shape_; }
  void Clear();
  /// The runs of the nodes (0 ..., j, k); entries are Padded() apart.
  float* Row(int j, int k) { return data_.data() + RowAt(j, k); }
  const float* Row(int j, int k) const { return data_.data() + RowAt(j, k); }
  static int Offset(int dx, int dy, int dz) { return (dz + 1) * 9 + (dy + 1) * 3 + dx + 1; }
  float& At(int i, int j, int k, int offset, int row, int column)
  {
    return Row(j, k)[static_cast<std::ptrdiff_t>(offset * 9 + row * 3 + column) * shape_.Padded() + i];
  }

  /// product (3 runs of Padded() numbers) = the rows (j, k) of A x.
  void MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const;

  /// The Galerkin product P^T A P where P interpolates linearly from every second node along \a axis. Both sides of A are first
  /// multiplied by \a live (1 or 0 per node) if it is given.
  LatticeMatrix Coarsened(int axis, const std::vector<float>* live) const;
  /// How many nodes remain of \a nodes along an axis.
  static int CoarseCount(int nodes) { return nodes / 2 + 1; }

private:
  std::ptrdiff_t RowAt(int j, int k) const { return (static_cast<std::ptrdiff_t>(k) * shape_.nodes[1] + j) * rowSize_; }

  LatticeShape shape_;
  std::ptrdiff_t rowSize_ = 0;
  std::vector<float> data_;
};

} // namespace echorama
