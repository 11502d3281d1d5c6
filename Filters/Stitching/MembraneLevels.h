// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parallel.h"
#include "Core/Base/ZeroedMemory.h"
#include <algorithm>
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace echorama {

/// Where the voxels of one level of a membrane are kept. Rows run along x; each stores the voxels between its first and last
/// unknown, and what the unknowns of rows nearby look at (one voxel further on all sides), so that loops over a row need no
/// cases. Rows of the border hold no unknowns. Voxels are found by Row::at + i, with i the index along x.
struct MembraneRows {
  struct Row {
    int begin = 0, end = 0;  ///< the unknowns lie here
    int first = 0, last = 0; ///< what is stored, [first, last)
    std::ptrdiff_t at = 0;   ///< position of x = 0 in arrays of the level
  };
  std::array<int, 2> low{0, 0};  ///< the lowest y and z that hold unknowns
  std::array<int, 2> size{0, 0}; ///< how many rows and slices do
  std::ptrdiff_t count = 0;      ///< voxels stored
  std::vector<Row> rows;         ///< with one more row on each side

  MembraneRows() = default;
  /// From begin and end of the rows that hold unknowns (y fastest); lays out what is stored.
  MembraneRows(std::array<int, 2> lowest, std::array<int, 2> extent, const std::vector<std::array<int, 2>>& unknowns);

  /// y from low[0] - 1 to low[0] + size[0]; z alike.
  const Row& At(int y, int z) const
  {
    return rows[static_cast<std::size_t>(z - low[1] + 1) * static_cast<std::size_t>(size[0] + 2) +
                static_cast<std::size_t>(y - low[0] + 1)];
  }
  Row& At(int y, int z) { return const_cast<Row&>(static_cast<const MembraneRows&>(*this).At(y, z)); }
  /// Slices that one task works on, whatever the number of threads.
  std::ptrdiff_t Grain() const;
};

/// What a stored voxel of the finest level is: for unknowns, how many neighbours along x, y and z are not void, two bits each
/// from the lowest on; bit 6 marks known voxels; 0 is void.
enum : unsigned char { MembraneCounts = 0x3f, MembraneKnown = 0x40 };

/// The levels of a membrane: the equations A e = r of its unknowns, and ever coarser images of them.
///
/// Finest level: (A e)(p) = sum over neighbours q that are not void of w_axis (e_p - e_q), e = 0 at known voxels. A coarse
/// cell joins two voxels per axis (only the axes whose spacing is nearly the least), holds an unknown if any of them does, and
/// is tied to its neighbours and to the known voxels by the sums of their ties, scaled to its size.
class MembraneLevels {
public:
  struct Level {
    MembraneRows rows;
    std::array<bool, 3> halved{false, false, false}; ///< the axes along which the next level is coarser
    std::ptrdiff_t unknowns = 0;
    Zeroed<float> value, right; ///< e and r
    // Coarse levels: ties to the lower neighbour along x, y and z, and one over their sum (0: not an unknown).
    Zeroed<float> tie[3], inverse;
    // Coarse cells without unknowns that interpolation looks at: they take a weighted sum of unknowns nearby.
    struct Fill {
      std::vector<std::uint32_t> cell, from; ///< the voxels from[start[n]] ... take part in cell[n]
      std::vector<std::uint32_t> start;
      std::vector<float> weight; ///< like from
    };
    Fill voids;  ///< cells that are not there: the mean of their neighbours
    Fill knowns; ///< known cells: the boundary value, from the right sides of their neighbours

    /// The ties of a row of a coarse level, each by x.
    struct Ties {
      const float *x, *y, *yNext, *z, *zNext, *inverse;
    };
    Ties TiesOf(int y, int z) const
    {
      const std::ptrdiff_t own = rows.At(y, z).at, above = rows.At(y + 1, z).at, behind = rows.At(y, z + 1).at;
      return {tie[0].data() + own, tie[1].data() + own,    tie[1].data() + above,
              tie[2].data() + own, tie[2].data() + behind, inverse.data() + own};
    }
  };
  static int CellOf(int fine, bool halved) { return halved ? fine >> 1 : fine; }
  static constexpr float KnownTie = 0.75f; ///< see BuildCoarse

  /// \param rows, codes of the finest level; there is at least one unknown, each is connected to a known voxel
  MembraneLevels(MembraneRows rows, Zeroed<unsigned char> codes, const Eigen::Vector3d& spacing, const Progress& progress);

  const MembraneRows& Rows() const { return levels_.front().rows; }
  const Zeroed<unsigned char>& Codes() const { return codes_; }
  const Eigen::Vector3d& Weights() const { return weights_; } ///< (least spacing / spacing)^2
  Level& Finest() { return levels_.front(); }
  int Count() const { return static_cast<int>(levels_.size()); }
  const std::vector<Level>& All() const { return levels_; }

  /// Runs body(stage, z) for all stages and slices with unknowns, one stage as if after the other, but slice by slice: a stage
  /// reads and writes its own slice and reads the two beside it. Data then pass through the caches once for all stages.
  template <class Body>
  static void Sweep(const MembraneRows& rows, int stages, const Body& body);

  /// value := about A^-1 right on the finest level: one V-cycle. \a then, if given, is called for each slice when it and
  /// those beside it are final.
  void Cycle(const std::function<void(int z)>& then = {}) { Cycle(0, false, then); }
  /// value := a first guess of the solution on the finest level, from all coarser ones. right holds what known values give.
  void Guess();
  /// The same where right is a source in space, and known values are 0; followed by a cycle on the finest level too.
  void Spread();
  /// Solves A w = |right| + floor about, on the level \a finest (or the coarsest, if that is finer) and all coarser ones.
  /// \returns the largest w
  double SpreadCoarsely(float floor, int finest = 1);
  /// After it: on the finest level, with A w >= part (|right| + floor), so that no error that leaves the residual right is
  /// larger than w / part. right becomes |right| + floor, value w. \returns the largest w / part, infinity if that is not found
  double SpreadFinely(float floor, double part);

private:
  void BuildCoarse(int fine);
  void BuildFills(int level, const Zeroed<unsigned char>& kinds);
  void BuildCoarsest();
  template <class AddRow>
  void SumUp(int fine, const AddRow& add);
  void Aggregate(int fine, float factor);
  void RelaxSlice(int level, int z, int colour, bool fromZero);
  void RestrictSlice(int level, int z);
  void FoldFills(int level);
  void FillVoids(int level);
  void ProlongSlice(int level, int z, bool add);
  void Prolong(int fine, bool solution);
  void SolveCoarsest();
  struct Place {
    int x, y, z;
  };
  double Lack(const Place& place, double part) const;
  bool Mend(std::vector<Place> places, double part, double& largest);
  void Cycle(int level, bool improve, const std::function<void(int z)>& then);

  std::vector<Level> levels_;
  Zeroed<unsigned char> codes_;
  Eigen::Vector3d weights_;
  std::vector<Zeroed<float>> known_;     // per level while it is built: ties to known voxels
  Zeroed<unsigned char> kinds_;          // of the level built last
  std::vector<std::ptrdiff_t> coarsest_; // the unknowns of the coarsest level
  std::vector<double> factor_;           // its Cholesky factor, by rows
};

/// Adds factor from[i] to the cells of the voxels [begin, end) of a row, voxel after voxel.
void AddToCells(const float* from, float factor, int begin, int end, bool halved, float* __restrict to);

/// right of the next coarser level := what add(row, to) adds for the rows of a level, to by cells.
template <class AddRow>
void MembraneLevels::SumUp(int number, const AddRow& add)
{
  const Level& fine = levels_[static_cast<std::size_t>(number)];
  Level& coarse = levels_[static_cast<std::size_t>(number) + 1];
  const auto& halved = fine.halved;
  ParallelRanges(coarse.rows.size[1], coarse.rows.Grain(), Progress(), [&](std::ptrdiff_t first, std::ptrdiff_t last) {
    for (int Z = coarse.rows.low[1] + static_cast<int>(first); Z < coarse.rows.low[1] + static_cast<int>(last); ++Z)
      for (int Y = coarse.rows.low[0]; Y < coarse.rows.low[0] + coarse.rows.size[0]; ++Y) {
        const auto& cell = coarse.rows.At(Y, Z);
        float* to = coarse.right.data() + cell.at;
        std::fill(to + cell.begin, to + cell.end, 0.0f);
        for (int z = halved[2] ? 2 * Z : Z; z <= (halved[2] ? 2 * Z + 1 : Z); ++z)
          for (int y = halved[1] ? 2 * Y : Y; y <= (halved[1] ? 2 * Y + 1 : Y); ++y)
            if (z >= fine.rows.low[1] && z < fine.rows.low[1] + fine.rows.size[1] && y >= fine.rows.low[0] &&
                y < fine.rows.low[0] + fine.rows.size[0])
              add(fine.rows.At(y, z), to);
      }
  });
}

template <class Body>
void MembraneLevels::Sweep(const MembraneRows& rows, int stages, const Body& body)
{
  // Each task moves through its slices like a wave, the stages one slice behind each other, and leaves out what needs slices
  // of other tasks: a wedge at each border, filled afterwards.
  const int slices = rows.size[1], low = rows.low[1];
  const int tasks = std::max(1, slices / std::max(4 * stages, static_cast<int>(rows.Grain())));
  const auto border = [slices, tasks](std::ptrdiff_t task) { return static_cast<int>(slices * task / tasks); };
  ParallelFor(tasks, [&](std::ptrdiff_t task) {
    const int begin = border(task), end = border(task + 1);
    for (int front = begin; front < end + stages - 1; ++front)
      for (int stage = 0; stage < stages; ++stage) {
        const int z = front - stage;
        if (z >= (task == 0 ? begin : begin + stage) && z < (task + 1 == tasks ? end : end - stage))
          body(stage, low + z);
      }
  });
  if (stages > 1)
    ParallelFor(tasks - 1, [&](std::ptrdiff_t task) {
      const int middle = border(task + 1);
      for (int stage = 1; stage < stages; ++stage)
        for (int z = middle - stage; z < middle + stage; ++z)
          body(stage, low + z);
    });
}

} // namespace echorama
