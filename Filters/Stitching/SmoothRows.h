// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "LowPass.h"

namespace echorama {

/// Reads a field of blocks (SmoothPart) at the voxels of the grid, row by row. It gives what a RowSampler does where all eight
/// blocks around a voxel are numbers, to the last bit for blocks of 1, 2, 4 ... voxels. The lattice lies along the grid, so that
/// a row of blocks is interpolated along x once for all rows of voxels that it takes part in: the reader keeps the latest, and is
/// for one thread.
template <class A>
class SmoothRows {
public:
  /// \param field must outlive the reader
  SmoothRows(const BlockLattice& blocks, const Boxed<float>& field);

  /// Writes values[i - first] for the voxels i of [first, end) of the row (j, k) of the grid, which must lie in blocks of the
  /// field. \returns whether those are finite where wanted[i - first] has bit 0
  bool Row(int j, int k, int first, int end, const unsigned char* wanted, A* values);

private:
  // Of a voxel along an axis: the lower of the two blocks around it, counted from its own, and how far it is from there.
  struct Step {
    int below;
    A fraction;
  };
  struct Neighbours {
    int below, above; // in indices of the lattice
    A fraction;
  };
  Step StepOf(int within, int axis) const;
  Neighbours NeighboursOf(int voxel, int axis) const;
  const A* Stretched(int bj, int bk);

  std::array<int, 3> size_;
  const Boxed<float>* field_;
  std::vector<int> offsets_;
  std::vector<A> fractions_;
  std::vector<float> padded_;
  struct Kept {
    int bj = -1, bk = -1;
    std::vector<A> row; // from the first voxel of the field's first block on
  };
  std::array<Kept, 4> kept_; // by the parities of bj and bk
};

} // namespace echorama
