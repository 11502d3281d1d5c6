// SPDX-License-Identifier: BSD-3-Clause
#include "Membrane.h"
#include "Core/Base/Multiversion.h"
#include "MembraneLevels.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

namespace echorama {
namespace {

constexpr int Lanes = 16;
constexpr std::ptrdiff_t VoxelsOfOneTask = 65536;

double SecondsSince(std::chrono::steady_clock::time_point start)
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

float OfBits(std::int32_t bits)
{
  float number;
  std::memcpy(&number, &bits, sizeof(number));
  return number;
}

struct SolutionRows {
  const double *own, *below, *above, *before, *behind;
};

// b - A u; returns the largest magnitude, as bits.
ECHORAMA_HOT std::int32_t ResidualOf(SolutionRows u, const unsigned char* codes, double wx, double wy, double wz, int begin,
                                     int end, float* residual)
{
  std::int32_t largest = 0;
  for (int i = begin; i < end; ++i) {
    const int code = codes[i];
    const double sum = wx * (u.own[i - 1] + u.own[i + 1]) + wy * (u.below[i] + u.above[i]) + wz * (u.before[i] + u.behind[i]);
    const double diagonal = wx * (code & 3) + wy * ((code >> 2) & 3) + wz * ((code >> 4) & 3);
    const float r = (code & MembraneCounts) != 0 ? static_cast<float>(sum - diagonal * u.own[i]) : 0.0f;
    residual[i] = r;
    std::int32_t bits;
    std::memcpy(&bits, &r, sizeof(bits));
    bits &= 0x7fffffff;
    largest = bits > largest ? bits : largest;
  }
  return largest;
}

// The least A v over unknowns, as bits of a float rounded down (0 where it is not positive), and the largest v.
struct Majorant {
  std::int32_t least = 0x7f7fffff, largest = 0;
};
ECHORAMA_HOT Majorant MajorantOf(const float* v, const float* below, const float* above, const float* before, const float* behind,
                                 const unsigned char* codes, double wx, double wy, double wz, int begin, int end)
{
  std::int32_t least = 0x7f7fffff, largest = 0;
  for (int i = begin; i < end; ++i) {
    const int code = codes[i];
    const double sum = wx * (static_cast<double>(v[i - 1]) + v[i + 1]) + wy * (static_cast<double>(below[i]) + above[i]) +
                       wz * (static_cast<double>(before[i]) + behind[i]);
    const double diagonal = wx * (code & 3) + wy * ((code >> 2) & 3) + wz * ((code >> 4) & 3);
    const float load = static_cast<float>((diagonal * v[i] - sum) * (1.0 - 1e-6));
    const float positive = v[i] >= 0.0f && load > 0.0f ? load : 0.0f;
    const float top = v[i] > 0.0f ? v[i] : 0.0f;
    std::int32_t loadBits, topBits;
    std::memcpy(&loadBits, &positive, sizeof(loadBits));
    std::memcpy(&topBits, &top, sizeof(topBits));
    const bool unknown = (code & MembraneCounts) != 0;
    loadBits = unknown ? loadBits : 0x7f7fffff;
    topBits = unknown ? topBits : 0;
    least = loadBits < least ? loadBits : least;
    largest = topBits > largest ? topBits : largest;
  }
  return {least, largest};
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
ECHORAMA_HOT void AddProducts(const float* e, const float* eBelow, const float* eAbove, const float* eBefore,
                              const float* eBehind, const float* p, const float* pBelow, const float* pAbove,
                              const float* pBefore, const float* pBehind, const float* r, const unsigned char* codes, float wx,
                              float wy, float wz, int begin, int end, double* sums)
{
  float lanes[5][Lanes] = {};
  const auto step = [&](int i, int l) __attribute__((always_inline))
  {
    const int code = codes[i];
    const float diagonal =
        wx * static_cast<float>(code & 3) + wy * static_cast<float>((code >> 2) & 3) + wz * static_cast<float>((code >> 4) & 3);
    const float ae =
        diagonal * e[i] - (wx * (e[i - 1] + e[i + 1]) + wy * (eBelow[i] + eAbove[i]) + wz * (eBefore[i] + eBehind[i]));
    const float ap =
        diagonal * p[i] - (wx * (p[i - 1] + p[i + 1]) + wy * (pBelow[i] + pAbove[i]) + wz * (pBefore[i] + pBehind[i]));
    lanes[0][l] += e[i] * ae;
    lanes[1][l] += e[i] * ap;
    lanes[2][l] += p[i] * ap;
    lanes[3][l] += e[i] * r[i];
    lanes[4][l] += p[i] * r[i];
  };
  int i = begin;
  for (; i + Lanes <= end; i += Lanes)
    for (int l = 0; l < Lanes; ++l)
      step(i + l, l);
  for (; i < end; ++i)
    step(i, 0);
  for (int n = 0; n < 5; ++n)
    for (int l = 0; l < Lanes; ++l)
      sums[n] += static_cast<double>(lanes[n][l]);
}

ECHORAMA_HOT void Advance(double* u, float* p, const float* e, float alongE, float alongP, std::ptrdiff_t begin,
                          std::ptrdiff_t end)
{
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    p[i] = alongE * e[i] + alongP * p[i];
    u[i] += static_cast<double>(p[i]);
  }
}

// Codes of unknowns (kind 1): how many neighbours along each axis are not void.
ECHORAMA_HOT void CountNeighbours(const unsigned char* kind, const unsigned char* below, const unsigned char* above,
                                  const unsigned char* before, const unsigned char* behind, int begin, int end,
                                  unsigned char* code)
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
  double Residual();
  void Move();

  std::unique_ptr<MembraneLevels> levels_;
  std::vector<double> solution_;
  std::vector<float> direction_;
  double lowest_ = 0.0, span_ = 1.0;
  double amplification_ = std::numeric_limits<double>::infinity(); // no error is larger than this times the largest residual
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

  // 2. what is stored: unknown, known, void; and the known values
  solution_.assign(static_cast<std::size_t>(rows.count), 0.0);
  std::vector<unsigned char> kind(static_cast<std::size_t>(rows.count), 0);
  ParallelRanges(rows.size[1] + 2, rows.Grain(), Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int z = rows.low[1] - 1 + static_cast<int>(begin); z < rows.low[1] - 1 + static_cast<int>(end); ++z)
      for (int y = rows.low[0] - 1; y <= rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        const int first = std::max(row.first, frame.First(y, z)), last = std::min(row.last, frame.End(y, z));
        if (first >= last)
          continue;
        const unsigned char* from = frame.Row(kinds, y, z) - frame.First(y, z);
        const float* value = frame.Row(values, y, z) - frame.First(y, z);
        unsigned char* to = kind.data() + row.at;
        double* u = solution_.data() + row.at;
        for (int i = first; i < last; ++i)
          if (from[i] == static_cast<unsigned char>(MembraneVoxel::Known)) {
            to[i] = 2;
            u[i] = (static_cast<double>(value[i]) - lowest_) / span_;
          }
        const int line = (z - components.z0) * ny + (y - components.y0);
        for (auto n = static_cast<std::size_t>(components.rowStart[static_cast<std::size_t>(line)]);
             n < static_cast<std::size_t>(components.rowStart[static_cast<std::size_t>(line) + 1]); ++n)
          if (IsSolved(components.Root(n)))
            std::fill(to + components.runs[n].begin, to + components.runs[n].end, static_cast<unsigned char>(1));
      }
  });
  std::vector<unsigned char> codes(static_cast<std::size_t>(rows.count), 0);
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
  direction_.assign(static_cast<std::size_t>(rows.count), 0.0f);
  levels_ = std::make_unique<MembraneLevels>(std::move(rows), std::move(codes), spacing, progress);
  BoundErrors(progress);
}

// A majorant v >= 0 with A v >= load > 0 bounds every error: |A e| <= r means |e| <= v r / load, for A is an M-matrix. v is
// about A^-1 1; what it is worth is then measured.
void Multigrid::BoundErrors(const Progress& progress)
{
  const MembraneRows& rows = Rows();
  const Eigen::Vector3d& w = levels_->Weights();
  auto& finest = levels_->Finest();
  const unsigned char* codes = levels_->Codes().data();
  const auto load = [&](int y, int z, const MembraneRows::Row& row) {
    float* right = finest.right.data() + row.at;
    const unsigned char* code = codes + row.at;
    for (int i = row.begin; i < row.end; ++i)
      right[i] = (code[i] & MembraneCounts) != 0 ? 1.0f : 0.0f;
    static_cast<void>(y);
    static_cast<void>(z);
  };
  ForRows(load);
  levels_->Spread();
  levels_->Smooth(2);
  std::vector<float>& v = direction_;
  v = finest.value;
  for (int round = 0; round < 12; ++round) {
    progress(0.0);
    const std::ptrdiff_t grain = rows.Grain();
    std::vector<Majorant> parts(static_cast<std::size_t>((rows.size[1] + grain - 1) / grain));
    ParallelRanges(rows.size[1], grain, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      Majorant& part = parts[static_cast<std::size_t>(begin / grain)];
      for (int z = rows.low[1] + static_cast<int>(begin); z < rows.low[1] + static_cast<int>(end); ++z)
        for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
          const auto& row = rows.At(y, z);
          const Majorant m = MajorantOf(v.data() + row.at, v.data() + rows.At(y - 1, z).at, v.data() + rows.At(y + 1, z).at,
                                        v.data() + rows.At(y, z - 1).at, v.data() + rows.At(y, z + 1).at, codes + row.at, w[0],
                                        w[1], w[2], row.begin, row.end);
          part.least = std::min(part.least, m.least);
          part.largest = std::max(part.largest, m.largest);
        }
    });
    Majorant whole;
    for (const Majorant& part : parts) {
      whole.least = std::min(whole.least, part.least);
      whole.largest = std::max(whole.largest, part.largest);
    }
    const double least = static_cast<double>(OfBits(whole.least)), largest = static_cast<double>(OfBits(whole.largest));
    if (least > 0.0)
      amplification_ = std::min(amplification_, largest / least * (1.0 + 1e-6));
    if (least > 0.5)
      break;
    // One more cycle for what is missing.
    ForRows([&](int y, int z, const MembraneRows::Row& row) {
      float* right = finest.right.data() + row.at;
      const float* own = v.data() + row.at;
      const float *below = v.data() + rows.At(y - 1, z).at, *above = v.data() + rows.At(y + 1, z).at,
                  *before = v.data() + rows.At(y, z - 1).at, *behind = v.data() + rows.At(y, z + 1).at;
      const unsigned char* code = codes + row.at;
      for (int i = row.begin; i < row.end; ++i) {
        const int c = code[i];
        const double sum = w[0] * (static_cast<double>(own[i - 1]) + own[i + 1]) +
                           w[1] * (static_cast<double>(below[i]) + above[i]) +
                           w[2] * (static_cast<double>(before[i]) + behind[i]);
        const double diagonal = w[0] * (c & 3) + w[1] * ((c >> 2) & 3) + w[2] * ((c >> 4) & 3);
        right[i] = (c & MembraneCounts) != 0 ? static_cast<float>(1.0 + sum - diagonal * own[i]) : 0.0f;
      }
    });
    levels_->Cycle();
    ForRows([&](int, int, const MembraneRows::Row& row) {
      for (std::ptrdiff_t i = row.at + row.begin; i < row.at + row.end; ++i)
        v[static_cast<std::size_t>(i)] += finest.value[static_cast<std::size_t>(i)];
    });
  }
  std::fill(direction_.begin(), direction_.end(), 0.0f);
}

// right := what the solution leaves; returns its largest magnitude.
double Multigrid::Residual()
{
  const MembraneRows& rows = Rows();
  const Eigen::Vector3d& w = levels_->Weights();
  auto& right = levels_->Finest().right;
  const std::ptrdiff_t grain = rows.Grain();
  std::vector<std::int32_t> parts(static_cast<std::size_t>((rows.size[1] + grain - 1) / grain), 0);
  ParallelRanges(rows.size[1], grain, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::int32_t& part = parts[static_cast<std::size_t>(begin / grain)];
    for (int z = rows.low[1] + static_cast<int>(begin); z < rows.low[1] + static_cast<int>(end); ++z)
      for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        if (row.begin >= row.end)
          continue;
        const double* u = solution_.data();
        const SolutionRows around{u + row.at, u + rows.At(y - 1, z).at, u + rows.At(y + 1, z).at, u + rows.At(y, z - 1).at,
                                  u + rows.At(y, z + 1).at};
        part = std::max(part, ResidualOf(around, levels_->Codes().data() + row.at, w[0], w[1], w[2], row.begin, row.end,
                                         right.data() + row.at));
      }
  });
  return static_cast<double>(OfBits(*std::max_element(parts.begin(), parts.end())));
}

// solution += the best combination of the correction of the last cycle and the direction before: conjugate gradients,
// which do not mind that a cycle is not quite the same operator each time.
void Multigrid::Move()
{
  const MembraneRows& rows = Rows();
  auto& finest = levels_->Finest();
  const float wx = static_cast<float>(levels_->Weights()[0]), wy = static_cast<float>(levels_->Weights()[1]),
              wz = static_cast<float>(levels_->Weights()[2]);
  const Products s = ParallelSum<Products>(rows.size[1], rows.Grain(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    double sums[5] = {};
    for (int z = rows.low[1] + static_cast<int>(begin); z < rows.low[1] + static_cast<int>(end); ++z)
      for (int y = rows.low[0]; y < rows.low[0] + rows.size[0]; ++y) {
        const auto& row = rows.At(y, z);
        const std::ptrdiff_t below = rows.At(y - 1, z).at, above = rows.At(y + 1, z).at, before = rows.At(y, z - 1).at,
                             behind = rows.At(y, z + 1).at;
        const float *e = finest.value.data(), *p = direction_.data();
        AddProducts(e + row.at, e + below, e + above, e + before, e + behind, p + row.at, p + below, p + above, p + before,
                    p + behind, finest.right.data() + row.at, levels_->Codes().data() + row.at, wx, wy, wz, row.begin, row.end,
                    sums);
      }
    return Products{sums[0], sums[1], sums[2], sums[3], sums[4]};
  });
  double alongE = s.eAe > 0.0 ? s.er / s.eAe : 0.0, alongP = 0.0;
  const double determinant = s.eAe * s.pAp - s.eAp * s.eAp;
  if (determinant > 1e-6 * s.eAe * s.pAp) {
    alongE = (s.er * s.pAp - s.pr * s.eAp) / determinant;
    alongP = (s.pr * s.eAe - s.er * s.eAp) / determinant;
  }
  ParallelRanges(rows.count, VoxelsOfOneTask, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Advance(solution_.data(), direction_.data(), finest.value.data(), static_cast<float>(alongE), static_cast<float>(alongP),
            begin, end);
  });
}

void Multigrid::Solve(const MembraneParameters& parameters, const Progress& progress, MembraneReport& report)
{
  auto& finest = levels_->Finest();
  // What is added to the bound: the sums of six rounded terms above, and the rounding of the result.
  const double rounding = std::max(std::abs(lowest_), std::abs(lowest_ + span_)) / 16777216.0;
  Residual();
  levels_->Guess();
  ParallelRanges(Rows().count, VoxelsOfOneTask, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t at = begin; at < end; ++at)
      solution_[static_cast<std::size_t>(at)] += static_cast<double>(finest.value[static_cast<std::size_t>(at)]);
  });
  for (report.cycles = 0;; ++report.cycles) {
    progress(std::min(1.0, report.cycles / 10.0));
    const double residual = Residual() * (1.0 + 1e-6) + 1e-14;
    report.bound = amplification_ * residual * span_ + rounding;
    report.certified = report.bound <= parameters.tolerance * span_;
    if (report.certified || report.cycles >= parameters.maximumCycles)
      return;
    levels_->Cycle();
    Move();
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
