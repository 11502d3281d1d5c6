// SPDX-License-Identifier: BSD-3-Clause
// Components first: those that touch one value, or none, have their answer, and the equations of all others have exactly one.
//
// Set-up lays out the unknowns (MembraneLevels). The solution of A v = 1 is the time that heat spends in the overlap before it
// finds a known voxel, 100 to 10000: a residual that is the same everywhere is an error so many times larger. Floats cannot
// carry a solution with such small residuals; it is kept in doubles. Corrections, which only need to be right to some per cent,
// residuals, and what bounds the error (MembraneBound.cxx) are floats.
//
// The first guess comes from all coarser levels. Each round then is one V-cycle on the residual, and the best step along its
// result and the step before (conjugate gradients: a cycle alone is slow where the border of the overlap is rough). Passes
// over the unknowns are fused (MembraneLevels::Sweep): a round reads and writes the finest level about four times.
#include "Membrane.h"
#include "Core/Base/ElapsedTime.h"
#include "MembraneLanes.h"
#include "MembraneLevels.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

namespace echorama {
namespace {

float OfBits(std::int32_t bits)
{
  float number;
  std::memcpy(&number, &bits, sizeof(number));
  return number;
}

[[gnu::always_inline]] inline std::int32_t BitsOf(float number)
{
  std::int32_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

// load - A u, where known values are part of u; returns the largest magnitude. (Floats that are not negative have the order of
// their bits.)
std::int32_t ResidualOf(const double* u, const double* below, const double* above, const double* before, const double* behind,
                        const unsigned char* codes, double load, double wx, double wy, double wz, int begin, int end,
                        float* __restrict residual)
{
  std::int32_t largest[MembraneByteLanes] = {};
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int l, float) __attribute__((always_inline)) {
        const int code = codes[i];
        const double sum = wx * (u[i - 1] + u[i + 1]) + wy * (below[i] + above[i]) + wz * (before[i] + behind[i]);
        const double diagonal = wx * (code & 3) + wy * ((code >> 2) & 3) + wz * ((code >> 4) & 3);
        const float unknown = static_cast<float>((code & MembraneCounts) != 0 ? 1 : 0);
        const float r = unknown * static_cast<float>(load + (sum - diagonal * u[i]));
        residual[i] = r;
        const std::int32_t bits = BitsOf(r) & 0x7fffffff;
        largest[l] = bits > largest[l] ? bits : largest[l];
      });
  return *std::max_element(largest, largest + MembraneByteLanes);
}

struct Products { // of the correction e, the last direction p, and the residual r
  double eAe = 0.0, eAp = 0.0, pAp = 0.0, er = 0.0, pr = 0.0;
  Products& operator+=(const Products& other)
  {
    eAe += other.eAe;
    eAp += other.eAp;
    pAp += other.pAp;
    er += other.er;
    pr += other.pr;
    return *this;
  }
};

// A is a sum over faces: (a, A b) = sum of diagonal a b - sum over both sides of faces of w a b.
void AddProducts(const float* e, const float* eBelow, const float* eAbove, const float* eBefore, const float* eBehind,
                 const float* p, const float* pBelow, const float* pAbove, const float* pBefore, const float* pBehind,
                 const float* r, const unsigned char* codes, float wx, float wy, float wz, int begin, int end, double* sums)
{
  float lanes[5][MembraneByteLanes] = {};
  ForLanes<MembraneByteLanes>(
      begin, end, [&](int i, int l, float fresh) __attribute__((always_inline)) {
        const int code = codes[i];
        const float diagonal = wx * static_cast<float>(code & 3) + wy * static_cast<float>((code >> 2) & 3) +
                               wz * static_cast<float>((code >> 4) & 3);
        const float ae =
            diagonal * e[i] - (wx * (e[i - 1] + e[i + 1]) + wy * (eBelow[i] + eAbove[i]) + wz * (eBefore[i] + eBehind[i]));
        const float ap =
            diagonal * p[i] - (wx * (p[i - 1] + p[i + 1]) + wy * (pBelow[i] + pAbove[i]) + wz * (pBefore[i] + pBehind[i]));
        const float ownE = fresh * e[i], ownP = fresh * p[i];
        lanes[0][l] += ownE * ae;
        lanes[1][l] += ownE * ap;
        lanes[2][l] += ownP * ap;
        lanes[3][l] += ownE * r[i];
        lanes[4][l] += ownP * r[i];
      });
  for (int n = 0; n < 5; ++n)
    for (int l = 0; l < MembraneByteLanes; ++l)
      sums[n] += static_cast<double>(lanes[n][l]);
}

void Advance(double* u, float* p, const float* e, float alongE, float alongP, std::ptrdiff_t begin, std::ptrdiff_t end)
{
  for (int i = begin; i < end; ++i) {
    p[i] = alongE * e[i] + alongP * p[i];
    u[i] += static_cast<double>(p[i]);
  }
}

// Codes of unknowns (kind 1): how many neighbours along each axis are not void.
void CountNeighbours(const unsigned char* kind, const unsigned char* below, const unsigned char* above,
                     const unsigned char* before, const unsigned char* behind, int begin, int end, unsigned char* code)
{
  for (int i = begin; i < end; ++i) {
    const int count = (kind[i - 1] != 0) + (kind[i + 1] != 0) + 4 * ((below[i] != 0) + (above[i] != 0)) +
                      16 * ((before[i] != 0) + (behind[i] != 0));
    code[i] = static_cast<unsigned char>(kind[i] == 1 ? count : code[i]);
  }
}

// The spans as they are worked on: rows stay rows; where y is longer than z they change places, for z is what is shared out
// among threads.
struct Frame {
  const RowSpans* spans;
  bool swapped;
  int First(int y, int z) const { return swapped ? spans->First(z, y) : spans->First(y, z); }
  int End(int y, int z) const { return swapped ? spans->End(z, y) : spans->End(y, z); }
  template <class Field>
  auto Row(Field& field, int y, int z) const
  {
    return swapped ? field.Row(z, y) : field.Row(y, z);
  }
};

// Connected unknowns of one row.
struct Run {
  int begin, end;
  std::int32_t parent;
  float least, most; // of the known values that the component touches
};

class Components {
public:
  Components(const Frame& frame, const GridBox& box, const RowField<unsigned char>& kinds, const RowField<float>& values);

  std::vector<std::int32_t> rowStart; // the runs of a row, z * ny + y, lie in [rowStart[row], rowStart[row + 1])
  std::vector<Run> runs;
  const Run& Root(std::size_t run) const { return runs[static_cast<std::size_t>(runs[run].parent)]; }
  int y0, z0, ny, nz;

private:
  std::int32_t Find(std::int32_t run)
  {
    while (runs[static_cast<std::size_t>(run)].parent != run) {
      auto& parent = runs[static_cast<std::size_t>(run)].parent;
      parent = runs[static_cast<std::size_t>(parent)].parent;
      run = parent;
    }
    return run;
  }
};

Components::Components(const Frame& frame, const GridBox& box, const RowField<unsigned char>& kinds,
                       const RowField<float>& values)
  : y0(box.first[frame.swapped ? 2 : 1]), z0(box.first[frame.swapped ? 1 : 2]), ny(box.size[frame.swapped ? 2 : 1]),
    nz(box.size[frame.swapped ? 1 : 2])
{
  constexpr float Infinity = std::numeric_limits<float>::infinity();
  const auto unknown = static_cast<unsigned char>(MembraneVoxel::Unknown),
             known = static_cast<unsigned char>(MembraneVoxel::Known);
  std::vector<std::vector<Run>> slices(static_cast<std::size_t>(nz));
  rowStart.assign(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz) + 1, 0);
  ParallelFor(nz, [&](std::ptrdiff_t slice) {
    auto& own = slices[static_cast<std::size_t>(slice)];
    const int z = z0 + static_cast<int>(slice);
    for (int y = y0; y < y0 + ny; ++y) {
      const unsigned char* row = frame.Row(kinds, y, z);
      const int first = frame.First(y, z), end = frame.End(y, z);
      std::int32_t count = 0;
      for (int i = first; row && i < end; ++i) {
        const void* found = std::memchr(row + (i - first), unknown, static_cast<std::size_t>(end - i));
        if (!found)
          break;
        const int begin = first + static_cast<int>(static_cast<const unsigned char*>(found) - row);
        for (i = begin; i < end && row[i - first] == unknown; ++i) {
        }
        Run run{begin, i, 0, Infinity, -Infinity};
        const auto touch = [&run](float value) {
          if (!std::isfinite(value))
            throw Error(Error::Kind::BadInput, "the known values of a membrane must be finite numbers");
          run.least = std::min(run.least, value);
          run.most = std::max(run.most, value);
        };
        const float* value = frame.Row(values, y, z);
        if (begin > first && row[begin - 1 - first] == known)
          touch(value[begin - 1 - first]);
        if (i < end && row[i - first] == known)
          touch(value[i - first]);
        const int near[4][2] = {{y - 1, z}, {y + 1, z}, {y, z - 1}, {y, z + 1}};
        for (const auto& other : near) {
          const unsigned char* kind = frame.Row(kinds, other[0], other[1]);
          if (!kind)
            continue;
          const float* at = frame.Row(values, other[0], other[1]);
          const int otherFirst = frame.First(other[0], other[1]);
          const int from = std::max(begin, otherFirst), to = std::min(i, frame.End(other[0], other[1]));
          for (int x = from; x < to; ++x) {
            const void* hit = std::memchr(kind + (x - otherFirst), known, static_cast<std::size_t>(to - x));
            if (!hit)
              break;
            x = otherFirst + static_cast<int>(static_cast<const unsigned char*>(hit) - kind);
            touch(at[x - otherFirst]);
          }
        }
        own.push_back(run);
        ++count;
      }
      rowStart[static_cast<std::size_t>(slice) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y - y0) + 1] = count;
    }
  });
  for (std::size_t row = 1; row < rowStart.size(); ++row)
    rowStart[row] += rowStart[row - 1];
  runs.reserve(static_cast<std::size_t>(rowStart.back()));
  for (const auto& slice : slices)
    runs.insert(runs.end(), slice.begin(), slice.end());
  for (std::size_t run = 0; run < runs.size(); ++run)
    runs[run].parent = static_cast<std::int32_t>(run);
  const auto join = [&](std::size_t row, std::size_t other) {
    std::int32_t a = rowStart[row], b = rowStart[other];
    while (a < rowStart[row + 1] && b < rowStart[other + 1]) {
      const Run &mine = runs[static_cast<std::size_t>(a)], &theirs = runs[static_cast<std::size_t>(b)];
      if (mine.begin < theirs.end && theirs.begin < mine.end) {
        const std::int32_t p = Find(a), q = Find(b);
        runs[static_cast<std::size_t>(std::max(p, q))].parent = std::min(p, q);
      }
      mine.end < theirs.end ? ++a : ++b;
    }
  };
  for (std::size_t row = 0; row + 1 < rowStart.size(); ++row) {
    if (row % static_cast<std::size_t>(ny) > 0)
      join(row, row - 1);
    if (row >= static_cast<std::size_t>(ny))
      join(row, row - static_cast<std::size_t>(ny));
  }
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const std::int32_t root = Find(static_cast<std::int32_t>(run));
    runs[run].parent = root;
    Run& of = runs[static_cast<std::size_t>(root)];
    of.least = std::min(of.least, runs[run].least);
    of.most = std::max(of.most, runs[run].most);
  }
}

// Where heat spends longer in the overlap, the floats of MembraneLevels::SpreadFinely carry no bound: A w is rounded by too much.
constexpr double SlowestOfFloats = 3e5;

// The equations A u = 0 of the unknowns that two or more different values touch, solved for values scaled to [0, 1].
class Multigrid {
public:
  Multigrid(const Frame& frame, const RowField<unsigned char>& kinds, const RowField<float>& values, const Components& components,
            const Eigen::Vector3d& spacing, const Progress& progress);
  void Solve(const MembraneParameters& parameters, const Progress& progress, MembraneReport& report);
  void Write(const Frame& frame, const Components& components, RowField<float>& values) const;

private:
  const MembraneRows& Rows() const { return levels_->Rows(); }
  template <class Body>
  void ForRows(const Body& body) const;
  void BoundErrors(const Progress& progress);
  double Improve(bool first);
  double Step(float alongE, float alongP);
  double Bound(double residual, double goal, bool last);

  std::unique_ptr<MembraneLevels> levels_;
  Zeroed<double> solution_;
  Zeroed<float> direction_;
  double load_ = 0.0; // the right side at every unknown
  double lowest_ = 0.0, span_ = 1.0;
  double slowest_ = 0.0;       // about the largest v where A v = 1: the longest time that heat spends in the overlap
  double amplification_ = 0.0; // if not 0, no error is larger than this times the largest residual
};

bool IsSolved(const Run& root)
{
  return root.least < root.most;
}

template <class Body>
void Multigrid::ForRows(const Body& body) const
{
  const MembraneRows& rows = Rows();
  ParallelRanges(rows.size[1], rows.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = rows.low[1] + static_cast<int>(begin); z < rows.low[1] + static_cast<int>(end); ++z)
      for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y)
        if (rows.At(y, z).begin < rows.At(y, z).end)
          body(y, z, rows.At(y, z));
  });
}

Multigrid::Multigrid(const Frame& frame, const RowField<unsigned char>& kinds, const RowField<float>& values,
                     const Components& components, const Eigen::Vector3d& spacing, const Progress& progress)
{
  // 1. the rows that hold unknowns, and the range of the values that they touch
  const int ny = components.ny, nz = components.nz;
  std::vector<std::array<int, 2>> spans(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), {0, 0});
  int low[2] = {ny, nz}, high[2] = {0, 0};
  float least = std::numeric_limits<float>::infinity(), most = -least;
  for (std::size_t row = 0; row < spans.size(); ++row)
    for (auto n = static_cast<std::size_t>(components.rowStart[row]); n < static_cast<std::size_t>(components.rowStart[row + 1]);
         ++n) {
      const Run& root = components.Root(n);
      if (!IsSolved(root))
        continue;
      const Run& run = components.runs[n];
      spans[row] =
          spans[row][0] < spans[row][1] ? std::array<int, 2>{spans[row][0], run.end} : std::array<int, 2>{run.begin, run.end};
      const int y = static_cast<int>(row % static_cast<std::size_t>(ny)),
                z = static_cast<int>(row / static_cast<std::size_t>(ny));
      low[0] = std::min(low[0], y);
      low[1] = std::min(low[1], z);
      high[0] = std::max(high[0], y + 1);
      high[1] = std::max(high[1], z + 1);
      least = std::min(least, root.least);
      most = std::max(most, root.most);
    }
  lowest_ = static_cast<double>(least);
  span_ = static_cast<double>(most) - static_cast<double>(least);
  std::vector<std::array<int, 2>> inside;
  for (int z = low[1]; z < high[1]; ++z)
    for (int y = low[0]; y < high[0]; ++y)
      inside.push_back(spans[static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y)]);
  MembraneRows rows({components.y0 + low[0], components.z0 + low[1]}, {high[0] - low[0], high[1] - low[1]}, inside);

  // 2. what is stored: unknown, known, void
  solution_ = Zeroed<double>(static_cast<std::size_t>(rows.count));
  Zeroed<unsigned char> kind(static_cast<std::size_t>(rows.count));
  ParallelRanges(rows.size[1] + 2, rows.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = rows.low[1] - 1 + static_cast<int>(begin); z < rows.low[1] - 1 + static_cast<int>(end); ++z)
      for (int y = rows.low[0] - 1; y <= rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        const int first = std::max(row.first, frame.First(y, z)), last = std::min(row.last, frame.End(y, z));
        if (first >= last)
          continue;
        const unsigned char* from = frame.Row(kinds, y, z) - frame.First(y, z);
        unsigned char* to = kind.data() + row.at;
        for (int i = first; i < last; ++i)
          if (from[i] == static_cast<unsigned char>(MembraneVoxel::Known))
            to[i] = 2;
        const int line = (z - components.z0) * ny + (y - components.y0);
        for (auto n = static_cast<std::size_t>(components.rowStart[static_cast<std::size_t>(line)]);
             n < static_cast<std::size_t>(components.rowStart[static_cast<std::size_t>(line) + 1]); ++n)
          if (IsSolved(components.Root(n)))
            std::fill(to + components.runs[n].begin, to + components.runs[n].end, static_cast<unsigned char>(1));
      }
  });
  Zeroed<unsigned char> codes(static_cast<std::size_t>(rows.count));
  ParallelRanges(rows.size[1] + 2, rows.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = rows.low[1] - 1 + static_cast<int>(begin); z < rows.low[1] - 1 + static_cast<int>(end); ++z)
      for (int y = rows.low[0] - 1; y <= rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        const unsigned char* own = kind.data() + row.at;
        unsigned char* code = codes.data() + row.at;
        for (int i = row.first; i < row.last; ++i)
          code[i] = own[i] == 2 ? static_cast<unsigned char>(MembraneKnown) : static_cast<unsigned char>(0);
        if (row.begin < row.end)
          CountNeighbours(own, kind.data() + rows.At(y - 1, z).at, kind.data() + rows.At(y + 1, z).at,
                          kind.data() + rows.At(y, z - 1).at, kind.data() + rows.At(y, z + 1).at, row.begin, row.end, code);
      }
  });
  kind = {};
  direction_ = Zeroed<float>(static_cast<std::size_t>(rows.count));
  levels_ = std::make_unique<MembraneLevels>(std::move(rows), std::move(codes),
                                             frame.swapped ? Eigen::Vector3d(spacing[0], spacing[2], spacing[1]) : spacing,
                                             progress.Part(0.0, 0.5));
  slowest_ = std::max(1.0, levels_->SpreadCoarsely(1.0f, 2));
  if (slowest_ > SlowestOfFloats)
    BoundErrors(progress);

  // 3. the known values
  const MembraneRows& stored = Rows();
  ParallelRanges(stored.size[1] + 2, stored.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = stored.low[1] - 1 + static_cast<int>(begin); z < stored.low[1] - 1 + static_cast<int>(end); ++z)
      for (int y = stored.low[0] - 1; y <= stored.low[0] + stored.size[0]; ++y) {
        const auto& row = stored.At(y, z);
        const int first = std::max(row.first, frame.First(y, z)), last = std::min(row.last, frame.End(y, z));
        if (first >= last)
          continue;
        const unsigned char* code = levels_->Codes().data() + row.at;
        const float* value = frame.Row(values, y, z) - frame.First(y, z);
        double* u = solution_.data() + row.at;
        for (int i = first; i < last; ++i)
          if (code[i] == MembraneKnown) {
            // Those that no unknown touches may be anything, NaN too; they must not disturb the sums that leave them out.
            const double scaled = (static_cast<double>(value[i]) - lowest_) / span_;
            u[i] = scaled > 0.0 ? std::min(scaled, 1.0) : 0.0;
          }
      }
  });
}

// v solves A v = 1 about, and what is missing is known: A v >= 1 - r. A is an M-matrix, so v >= 0, and |A e| <= residual
// means |e| <= residual v / (1 - r).
void Multigrid::BoundErrors(const Progress& progress)
{
  constexpr int MostCycles = 30;
  load_ = 1.0;
  amplification_ = std::numeric_limits<double>::infinity();
  Improve(true);
  levels_->Spread();
  for (int cycle = 0; cycle <= MostCycles; ++cycle) {
    progress(0.5 + 0.5 * cycle / MostCycles);
    const double missing = Improve(cycle == 0) * (1.0 + 1e-6) + 1e-9;
    if (missing < 1.0) {
      const double largest = *std::max_element(solution_.begin(), solution_.end());
      amplification_ = std::min(amplification_, largest / (1.0 - missing));
    }
    if (missing <= 0.65) // another cycle would cost more than it saves
      break;
  }
  load_ = 0.0;
  std::fill(solution_.begin(), solution_.end(), 0.0);
  std::fill(direction_.begin(), direction_.end(), 0.0f);
  auto& value = levels_->Finest().value;
  std::fill(value.begin(), value.end(), 0.0f);
}

// solution += the best combination of the cycle's correction and the direction before: conjugate gradients, which do not
// mind that a cycle is not quite the same operator each time. Returns what Step does.
double Multigrid::Improve(bool first)
{
  const MembraneRows& rows = Rows();
  const Eigen::Vector3d& w = levels_->Weights();
  auto& finest = levels_->Finest();
  const unsigned char* codes = levels_->Codes().data();
  const auto slices = static_cast<std::size_t>(rows.size[1]);
  float alongE = 1.0f, alongP = 0.0f;
  if (!first) {
    const float wx = static_cast<float>(w[0]), wy = static_cast<float>(w[1]), wz = static_cast<float>(w[2]);
    std::vector<Products> parts(slices);
    levels_->Cycle([&](int z) {
      double sums[5] = {};
      for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        if (row.begin >= row.end)
          continue;
        const std::ptrdiff_t below = rows.At(y - 1, z).at, above = rows.At(y + 1, z).at, before = rows.At(y, z - 1).at,
                             behind = rows.At(y, z + 1).at;
        const float *e = finest.value.data(), *p = direction_.data();
        AddProducts(e + row.at, e + below, e + above, e + before, e + behind, p + row.at, p + below, p + above, p + before,
                    p + behind, finest.right.data() + row.at, codes + row.at, wx, wy, wz, row.begin, row.end, sums);
      }
      parts[static_cast<std::size_t>(z - rows.low[1])] = {sums[0], sums[1], sums[2], sums[3], sums[4]};
    });
    Products s;
    for (const Products& part : parts)
      s += part;
    alongE = static_cast<float>(s.eAe > 0.0 ? s.er / s.eAe : 0.0);
    const double determinant = s.eAe * s.pAp - s.eAp * s.eAp;
    if (determinant > 1e-6 * s.eAe * s.pAp) {
      alongE = static_cast<float>((s.er * s.pAp - s.pr * s.eAp) / determinant);
      alongP = static_cast<float>((s.pr * s.eAe - s.er * s.eAp) / determinant);
    }
  }
  return Step(alongE, alongP);
}

// solution += the steps along the correction and the direction; right := what that leaves. \returns its largest magnitude
double Multigrid::Step(float alongE, float alongP)
{
  const MembraneRows& rows = Rows();
  const Eigen::Vector3d& w = levels_->Weights();
  auto& finest = levels_->Finest();
  const unsigned char* codes = levels_->Codes().data();
  const bool moves = alongE != 0.0f || alongP != 0.0f;
  std::vector<std::int32_t> parts(static_cast<std::size_t>(rows.size[1]), 0);
  MembraneLevels::Sweep(rows, moves ? 2 : 1, [&](int stage, int z) {
    std::int32_t& part = parts[static_cast<std::size_t>(z - rows.low[1])];
    for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
      const auto& row = rows.At(y, z);
      if (row.begin >= row.end)
        continue;
      double* u = solution_.data();
      if (moves && stage == 0) {
        Advance(u + row.at, direction_.data() + row.at, finest.value.data() + row.at, alongE, alongP, row.begin, row.end);
      } else {
        part = std::max(part, ResidualOf(u + row.at, u + rows.At(y - 1, z).at, u + rows.At(y + 1, z).at, u + rows.At(y, z - 1).at,
                                         u + rows.At(y, z + 1).at, codes + row.at, load_, w[0], w[1], w[2], row.begin, row.end,
                                         finest.right.data() + row.at));
      }
    }
  });
  return static_cast<double>(OfBits(*std::max_element(parts.begin(), parts.end())));
}

// How far the solution can be from the exact one, or infinity where that is surely, or probably, too far: finding out costs
// nearly as much as a cycle. The last time it is found out in any case.
double Multigrid::Bound(double residual, double goal, bool last)
{
  if (amplification_ > 0.0)
    return amplification_ * residual;
  if (!last && 2.0 * residual > goal)
    return std::numeric_limits<double>::infinity();
  const auto floor = static_cast<float>(std::max({0.25 * goal / slowest_, (last ? 1e-2 : 3e-4) * residual, 1e-30}));
  const double about = levels_->SpreadCoarsely(floor);
  if (!last && about > 0.8 * goal)
    return std::numeric_limits<double>::infinity();
  const double bound = levels_->SpreadFinely(floor, std::clamp(1.1 * about / goal, 0.3, 0.8));
  if (!(bound <= goal) && !last)
    Step(0.0f, 0.0f);
  return bound;
}

void Multigrid::Solve(const MembraneParameters& parameters, const Progress& progress, MembraneReport& report)
{
  // What is added to the bound: the sums of six rounded terms above, and the rounding of the result.
  const double rounding = std::max(std::abs(lowest_), std::abs(lowest_ + span_)) / 16777216.0;
  Improve(true);
  levels_->Guess();
  for (report.cycles = 0;; ++report.cycles) {
    progress(std::min(1.0, report.cycles / 10.0));
    const double residual = Improve(report.cycles == 0) * (1.0 + 1e-6) + 1e-14;
    const bool last = report.cycles >= parameters.maximumCycles;
    const double goal = std::max(parameters.tolerance - rounding / span_, 0.1 * parameters.tolerance);
    report.bound = Bound(residual, goal, last) * span_ + rounding;
    report.certified = report.bound <= parameters.tolerance * span_;
    if (report.certified || last)
      return;
  }
}

void Multigrid::Write(const Frame& frame, const Components& components, RowField<float>& values) const
{
  ForRows([&](int y, int z, const MembraneRows::Row& row) {
    const auto line = static_cast<std::size_t>((z - components.z0) * components.ny + (y - components.y0));
    float* to = frame.Row(values, y, z) - frame.First(y, z);
    for (auto n = static_cast<std::size_t>(components.rowStart[line]);
         n < static_cast<std::size_t>(components.rowStart[line + 1]); ++n) {
      const Run &run = components.runs[n], &root = components.Root(n);
      if (!IsSolved(root))
        continue;
      for (int i = run.begin; i < run.end; ++i)
        to[i] = std::clamp(static_cast<float>(lowest_ + span_ * solution_[static_cast<std::size_t>(row.at + i)]), root.least,
                           root.most);
    }
  });
}

void Check(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, const RowField<float>& values,
           const MembraneParameters& parameters)
{
  const auto refuse = [](const char* why) { throw Error(Error::Kind::InvalidParameter, why); };
  if (kinds.spans != values.spans)
    refuse("the kinds and values of a membrane must share their spans");
  if (kinds.spans && (kinds.values.size() != static_cast<std::size_t>(kinds.spans->Count()) ||
                      values.values.size() != static_cast<std::size_t>(kinds.spans->Count())))
    refuse("a membrane needs one kind and one value per voxel of its spans");
  if (!(spacing.minCoeff() > 0.0) || !spacing.allFinite())
    refuse("the spacing of a membrane must be positive");
  if (!(parameters.tolerance > 0.0))
    refuse("the tolerance of a membrane must be positive");
  if (parameters.maximumCycles < 0)
    refuse("the number of cycles of a membrane must not be negative");
}

} // namespace

MembraneReport SolveMembrane(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, RowField<float>& values,
                             float isolated, const MembraneParameters& parameters, const Progress& progress)
{
  const auto start = std::chrono::steady_clock::now();
  Check(kinds, spacing, values, parameters);
  MembraneReport report;
  report.certified = true;
  if (!kinds.spans || kinds.spans->Box().Empty())
    return report;
  const GridBox& box = kinds.spans->Box();
  const Frame frame{kinds.spans.get(), box.size[1] > box.size[2]};
  const Components components(frame, box, kinds, values);
  bool any = false;
  for (std::size_t line = 0; line + 1 < components.rowStart.size(); ++line)
    for (auto n = static_cast<std::size_t>(components.rowStart[line]);
         n < static_cast<std::size_t>(components.rowStart[line + 1]); ++n) {
      const Run &run = components.runs[n], &root = components.Root(n);
      report.unknowns += run.end - run.begin;
      any = any || IsSolved(root);
      if (IsSolved(root))
        continue;
      const int y = components.y0 + static_cast<int>(line) % components.ny,
                z = components.z0 + static_cast<int>(line) / components.ny;
      float* to = frame.Row(values, y, z) - frame.First(y, z);
      std::fill(to + run.begin, to + run.end, root.least == root.most ? root.least : isolated);
    }
  if (!any)
    return report;
  Multigrid multigrid(frame, kinds, values, components, spacing, progress.Part(0.0, 0.5));
  report.setupSeconds = SecondsSince(start);
  multigrid.Solve(parameters, progress.Part(0.5, 1.0), report);
  multigrid.Write(frame, components, values);
  report.solveSeconds = SecondsSince(start) - report.setupSeconds;
  return report;
}

} // namespace echorama
