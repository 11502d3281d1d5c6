// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/LatticeField.h"
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// A symmetric matrix that ties every node of a lattice to the 27 nodes around it by blocks of 3 x 3.
///
/// Of each pair of nodes only the block of the one that comes first (z, then y, then x) is kept: a node has its own block and
/// those of the 13 nodes that come after it. For each row of nodes there are 14 x 9 runs of numbers along x:
/// [offset - 13][row][column][node], offset = (dz + 1) * 9 + (dy + 1) * 3 + dx + 1.
class LatticeMatrix {
public:
  static constexpr int Own = 13;      ///< the offset of a node from itself: the first that is kept
  static constexpr int Entries = 126; ///< of a node

  LatticeMatrix() = default;
  explicit LatticeMatrix(const LatticeShape& shape);

  const LatticeShape& Shape() const { return shape_; }
  void Clear();
  /// The runs of the nodes (0 ..., j, k); entries are Padded() apart.
  float* Row(int j, int k) { return data_.data() + RowAt(j, k); }
  const float* Row(int j, int k) const { return data_.data() + RowAt(j, k); }
  static int Offset(int dx, int dy, int dz) { return (dz + 1) * 9 + (dy + 1) * 3 + dx + 1; }
  /// \a offset is Own or more.
  float& At(int i, int j, int k, int offset, int row, int column)
  {
    return Row(j, k)[static_cast<std::ptrdiff_t>((offset - Own) * 9 + row * 3 + column) * shape_.Padded() + i];
  }
  float At(int i, int j, int k, int offset, int row, int column) const
  {
    return const_cast<LatticeMatrix&>(*this).At(i, j, k, offset, row, column);
  }

  /// Clears the rows and columns of nodes where \a live (as a component of a field) is 0.
  void KeepOnly(const std::vector<float>& live);

  /// product (3 runs of Padded() numbers) = the rows (j, k) of A x.
  void MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const;

  /// coarse (of a lattice with CoarseCount() nodes along \a axis) = the Galerkin product P^T A P, where P interpolates linearly
  /// from every second node along the axis.
  void Coarsen(int axis, LatticeMatrix& coarse) const;
  /// How many nodes remain of \a nodes along an axis.
  static int CoarseCount(int nodes) { return nodes / 2 + 1; }

private:
  std::ptrdiff_t RowAt(int j, int k) const { return (static_cast<std::ptrdiff_t>(k) * shape_.nodes[1] + j) * rowSize_; }

  LatticeShape shape_;
  std::ptrdiff_t rowSize_ = 0;
  std::vector<float> data_;
};

/// D^-1 A D^-1 of such a matrix A for fast products: D is diagonal, one positive number per node, and makes all entries lie
/// within
/// [-1, 1], so that 16 bits hold them to 2e-5 of the diagonal. What rounding takes away is given back to the diagonal blocks,
/// which are not rounded: a translation of the whole takes the same energy as with A.
class PackedLatticeMatrix {
public:
  PackedLatticeMatrix() = default;
  explicit PackedLatticeMatrix(const LatticeShape& shape);

  const LatticeShape& Shape() const { return shape_; }
  /// Nodes whose own block is not positive are left out: they have no rows and columns, and scale and inverse 0.
  void Pack(const LatticeMatrix& matrix);

  /// Adds D^-1 change D^-1 to the own block of a node.
  void ChangeOwn(int i, int j, int k, const Eigen::Matrix3f& change);

  /// product (3 runs of Padded() numbers) = the rows (j, k) of this x.
  void MultiplyRow(int j, int k, const LatticeField<float>& x, float* product) const;

  /// D and D^-1 per node, like a component of a field; 0 for nodes that are left out.
  const std::vector<float>& Scale() const { return scale_; }
  const std::vector<float>& Unscale() const { return unscale_; }
  /// Of the own blocks: xx, xy, xz, yy, yz, zz.
  const std::vector<float>& Inverse(int n) const { return inverse_[n]; }

private:
  static constexpr int Entries = 117;
  std::ptrdiff_t RowAt(int j, int k) const
  {
    return LatticeShape::Lanes + (static_cast<std::ptrdiff_t>(k) * shape_.nodes[1] + j) * Entries * shape_.Padded();
  }

  void SetOwn(std::ptrdiff_t at, const Eigen::Matrix3f& block);

  LatticeShape shape_;
  std::vector<std::int16_t> data_;
  std::vector<float> scale_, unscale_, own_[6], inverse_[6];
};

} // namespace echorama
