// SPDX-License-Identifier: BSD-3-Clause
// Nearly incompressible tissue is what makes this hard: Chebyshev polynomials of low degree over the blocks of nodes stand it,
// and all their work is products with the matrix, which run along x. A V-cycle is symmetric, since the smoother is the same
// before and after. Sums are taken slice by slice, in order.
//
// Links are exact in the products of conjugate gradients. Each level of the preconditioner has its own image of them (a Galerkin
// product also), so that bodies that touch move as one on coarse levels at little energy; only what lies between nodes that
// are no neighbours there is replaced by something diagonal that is stiffer.
#include "LatticeMultigrid.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "IndependentLoop.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace echorama {
namespace {

constexpr int ChebyshevDegree = 3;
constexpr int NodesOfATask = 512;       // much more than it costs to start one
constexpr double ChebyshevRange = 12.0; // errors with eigenvalues down to 1/12 of the largest are smoothed

// One step of the Chebyshev recurrence in one row: step = keep * step + take * inverse * (right - product), next = value + step.
void ChebyshevRow(int count, float keep, float take, const float* product, int padded, const float* const* right,
                  const float* const* inverse, const float* const* value, float* const* step, float* const* next)
{
  const float *p0 = product, *p1 = product + padded, *p2 = product + 2 * padded;
  ECHORAMA_INDEPENDENT
  for (int i = 0; i < count; ++i) {
    const float r0 = right[0][i] - p0[i], r1 = right[1][i] - p1[i], r2 = right[2][i] - p2[i];
    const float s0 = keep * step[0][i] + take * (inverse[0][i] * r0 + inverse[1][i] * r1 + inverse[2][i] * r2);
    const float s1 = keep * step[1][i] + take * (inverse[1][i] * r0 + inverse[3][i] * r1 + inverse[4][i] * r2);
    const float s2 = keep * step[2][i] + take * (inverse[2][i] * r0 + inverse[4][i] * r1 + inverse[5][i] * r2);
    step[0][i] = s0;
    step[1][i] = s1;
    step[2][i] = s2;
    next[0][i] = value[0][i] + s0;
    next[1][i] = value[1][i] + s1;
    next[2][i] = value[2][i] + s2;
  }
}

// a = a * scale + b * factor, slice by slice.
void Combine(LatticeField<float>& a, float scale, const LatticeField<float>& b, float factor)
{
  const LatticeShape& shape = a.Shape();
  ParallelFor(shape.nodes[2], [&](std::ptrdiff_t k) {
    for (int c = 0; c < 3; ++c) {
      float* x = a.Component(c) + (k + 1) * shape.slice;
      const float* y = b.Component(c) + (k + 1) * shape.slice;
      for (std::ptrdiff_t i = 0; i < shape.slice; ++i)
        x[i] = x[i] * scale + y[i] * factor;
    }
  });
}

// out = in with every node times its scale.
void Scaled(const LatticeField<float>& in, const std::vector<float>& scale, LatticeField<float>& out)
{
  const LatticeShape& shape = in.Shape();
  ParallelFor(shape.nodes[2], [&](std::ptrdiff_t k) {
    for (int c = 0; c < 3; ++c)
      for (std::ptrdiff_t at = (k + 1) * shape.slice; at < (k + 2) * shape.slice; ++at)
        out.Component(c)[at] = in.Component(c)[at] * scale[static_cast<std::size_t>(at)];
  });
}

} // namespace

double SumOfProducts(const LatticeField<float>& a, const LatticeField<float>& b)
{
  const LatticeShape& shape = a.Shape();
  return ParallelSum<double>(shape.nodes[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c)
      for (int j = 0; j < shape.nodes[1]; ++j) {
        const std::ptrdiff_t at = shape.At(0, j, static_cast<int>(k));
        const float *x = a.Component(c) + at, *y = b.Component(c) + at;
        double lanes[LatticeShape::Lanes] = {};
        for (int i = 0; i < shape.Padded(); i += LatticeShape::Lanes)
          for (int l = 0; l < LatticeShape::Lanes; ++l)
            lanes[l] += static_cast<double>(x[i + l]) * static_cast<double>(y[i + l]);
        for (const double lane : lanes)
          sum += lane;
      }
    return sum;
  });
}

LatticeMultigrid::LatticeMultigrid(const std::array<int, 3>& nodes, const Eigen::Vector3d& spacing, std::vector<float> live)
{
  std::array<int, 3> size = nodes;
  Eigen::Vector3d width = spacing;
  while (true) {
    const LatticeShape shape(size);
    Level level;
    level.right = level.value = level.other = level.step = level.mode = LatticeField<float>(shape);
    level.packed = PackedLatticeMatrix(shape);
    level.matrix = LatticeMatrix(shape);
    if (levels_.empty())
      live_ = std::move(live);
    Random random(17, levels_.size());
    ForNodes(size, [&](int i, int j, int k) {
      for (int c = 0; c < 3; ++c)
        level.mode.Component(c)[shape.At(i, j, k)] = static_cast<float>(random.Uniform(-1.0, 1.0));
    });
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (size[axis] > 3)
        least = std::min(least, width[static_cast<int>(axis)]);
    const bool isCoarsest = shape.Count() <= 150 || least == std::numeric_limits<double>::infinity();
    for (const std::size_t axis : {2, 1, 0})
      if (!isCoarsest && size[axis] > 3 && width[static_cast<int>(axis)] < 1.5 * least) {
        level.halved[axis] = true;
        size[axis] = LatticeMatrix::CoarseCount(size[axis]);
        width[static_cast<int>(axis)] *= 2.0;
        level.between.emplace_back(LatticeShape(size));
      }
    if (!isCoarsest)
      level.between.pop_back(); // that is the next level
    levels_.push_back(std::move(level));
    if (isCoarsest)
      break;
  }
  residual_ = direction_ = product_ = correction_ = LatticeField<float>(LatticeShape(nodes));
}

void LatticeMultigrid::Prepare()
{
  levels_.front().matrix.KeepOnly(live_);
  for (std::size_t n = 0; n + 1 < levels_.size(); ++n) {
    Level& level = levels_[n];
    const LatticeMatrix* from = &level.matrix;
    auto next = level.between.begin();
    for (const int axis : {2, 1, 0})
      if (level.halved[static_cast<std::size_t>(axis)]) {
        LatticeMatrix& to = next == level.between.end() ? levels_[n + 1].matrix : *next++;
        from->Coarsen(axis, to);
        from = &to;
      }
  }
  AddLinks();
  for (std::size_t n = 0; n < levels_.size(); ++n) {
    levels_[n].packed.Pack(levels_[n].matrix);
    if (n + 1 < levels_.size())
      EstimateLargest(levels_[n]);
  }
  const Level& last = levels_.back();
  const LatticeShape& shape = last.matrix.Shape();
  unknowns_.clear();
  std::vector<int> number(static_cast<std::size_t>(shape.size), -1);
  ForNodes(shape.nodes, [&](int i, int j, int k) {
    const std::ptrdiff_t at = shape.At(i, j, k);
    if (last.packed.Scale()[static_cast<std::size_t>(at)] > 0.0f) {
      number[static_cast<std::size_t>(at)] = static_cast<int>(unknowns_.size());
      unknowns_.push_back(at);
    }
  });
  const auto size = static_cast<Eigen::Index>(3 * unknowns_.size());
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  ForNodes(shape.nodes, [&](int i, int j, int k) {
    const int own = number[static_cast<std::size_t>(shape.At(i, j, k))];
    if (own < 0)
      return;
    for (int offset = LatticeMatrix::Own; offset < 27; ++offset) {
      const int other =
          number[static_cast<std::size_t>(shape.At(i + offset % 3 - 1, j + offset / 3 % 3 - 1, k + offset / 9 - 1))];
      for (int entry = 0; other >= 0 && entry < 9; ++entry)
        dense(3 * other + entry % 3, 3 * own + entry / 3) = // the lower triangle, which is all that counts
            static_cast<double>(last.matrix.At(i, j, k, offset, entry / 3, entry % 3));
    }
  });
  // Rounding, and directions of negative curvature, must not stop the factorisation: then it is that of a stiffer matrix.
  for (double shift = 1e-7;; shift *= 100.0) {
    Eigen::MatrixXd shifted = dense;
    shifted.diagonal() *= 1.0 + shift;
    coarsest_.compute(shifted);
    if (coarsest_.info() == Eigen::Success || shift > 1e3)
      break;
  }
}

void LatticeMultigrid::AddLinks()
{
  apart_.clear();
  for (LatticeLink link : links_) {
    const LatticeShape& finest = levels_.front().matrix.Shape();
    const auto isHeld = [&](const auto& node) {
      return live_[static_cast<std::size_t>(finest.At(node.first[0], node.first[1], node.first[2]))] == 0.0f;
    };
    link.nodes.erase(std::remove_if(link.nodes.begin(), link.nodes.end(), isHeld), link.nodes.end());
    for (std::size_t n = 0; n < levels_.size(); ++n) {
      LatticeMatrix& matrix = levels_[n].matrix;
      const auto add = [&](const std::array<int, 3>& node, int offset, double factor) {
        for (int entry = 0; entry < 9; ++entry)
          matrix.At(node[0], node[1], node[2], offset, entry / 3, entry % 3) +=
              static_cast<float>(factor * link.stiffness(entry / 3, entry % 3));
      };
      for (std::size_t a = 0; a < link.nodes.size(); ++a)
        for (std::size_t b = a; b < link.nodes.size(); ++b) {
          const auto& [first, weight] = link.nodes[a];
          const auto& [second, other] = link.nodes[b];
          const int d[3] = {second[0] - first[0], second[1] - first[1], second[2] - first[2]};
          const double factor = weight * other;
          if (std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])}) <= 1) {
            const int offset = LatticeMatrix::Offset(d[0], d[1], d[2]);
            add(offset < LatticeMatrix::Own ? second : first, std::max(offset, 26 - offset), factor);
            continue;
          }
          add(first, LatticeMatrix::Own, std::abs(factor));
          add(second, LatticeMatrix::Own, std::abs(factor));
          if (n == 0)
            apart_.push_back({{finest.At(first[0], first[1], first[2]), finest.At(second[0], second[1], second[2])},
                              factor < 0.0 ? -1.0f : 1.0f,
                              (std::abs(factor) * link.stiffness).cast<float>()});
        }
      // To the nodes of the next level.
      std::map<std::array<int, 3>, double> nodes;
      for (const auto& [node, weight] : link.nodes)
        for (int corner = 0; corner < 8; ++corner) {
          std::array<int, 3> to = node;
          double part = weight;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const bool isHigh = (corner >> axis & 1) != 0, isBetween = levels_[n].halved[axis] && node[axis] % 2 == 1;
            to[axis] = (levels_[n].halved[axis] ? node[axis] / 2 : node[axis]) + (isHigh ? 1 : 0);
            part *= isBetween ? 0.5 : isHigh ? 0.0 : 1.0;
          }
          if (part != 0.0)
            nodes[to] += part;
        }
      link.nodes.assign(nodes.begin(), nodes.end());
    }
  }
}

void LatticeMultigrid::ChangeOwn(const std::array<int, 3>& node, const Eigen::Matrix3f& change)
{
  Level& finest = levels_.front();
  for (int entry = 0; entry < 9; ++entry)
    finest.matrix.At(node[0], node[1], node[2], LatticeMatrix::Own, entry / 3, entry % 3) += change(entry / 3, entry % 3);
  finest.packed.ChangeOwn(node[0], node[1], node[2], change);
}

// The runs of a row of a field.
#define ECHORAMA_ROWS(field)                                                                                                     \
  {                                                                                                                              \
    field.Component(0) + at, field.Component(1) + at, field.Component(2) + at                                                    \
  }
#define ECHORAMA_INVERSES(matrix)                                                                                                \
  {                                                                                                                              \
    matrix.Inverse(0).data() + at, matrix.Inverse(1).data() + at, matrix.Inverse(2).data() + at, matrix.Inverse(3).data() + at,  \
        matrix.Inverse(4).data() + at, matrix.Inverse(5).data() + at                                                             \
  }

void LatticeMultigrid::EstimateLargest(Level& level)
{
  // Power iteration, from the mode that it found for the last matrix.
  const LatticeShape& shape = level.matrix.Shape();
  const int steps = level.largest == 0.0 ? 12 : 3;
  double largest = 1.0;
  level.right.Fill(0.0f);
  for (int n = 0; n < steps; ++n) {
    level.value.Fill(0.0f);
    ParallelFor(shape.nodes[2], [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      for (int j = 0; j < shape.nodes[1]; ++j) {
        const std::ptrdiff_t at = shape.At(0, j, k);
        const float* scale = level.packed.Scale().data() + at;
        for (int c = 0; c < 3; ++c) // what lies at nodes that are left out does not count
          for (int i = 0; i < shape.nodes[0]; ++i)
            level.other.Component(c)[at + i] = scale[i] > 0.0f ? level.mode.Component(c)[at + i] : 0.0f;
      }
    });
    ParallelFor(shape.nodes[2], [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      std::vector<float> product(static_cast<std::size_t>(3 * shape.Padded()));
      for (int j = 0; j < shape.nodes[1]; ++j) {
        const std::ptrdiff_t at = shape.At(0, j, k);
        level.packed.MultiplyRow(j, k, level.other, product.data());
        const float* const right[3] = ECHORAMA_ROWS(level.right);
        const float* const value[3] = ECHORAMA_ROWS(level.value);
        float* const step[3] = ECHORAMA_ROWS(level.step);
        float* const next[3] = ECHORAMA_ROWS(level.mode);
        const float* const inverse[6] = ECHORAMA_INVERSES(level.packed);
        ChebyshevRow(shape.nodes[0], 0.0f, -1.0f, product.data(), shape.Padded(), right, inverse, value, step, next);
      }
    });
    const double before = std::sqrt(SumOfProducts(level.other, level.other)),
                 after = std::sqrt(SumOfProducts(level.mode, level.mode));
    if (!(before > 0.0 && after > 0.0 && std::isfinite(after)))
      break;
    largest = after / before;
    const auto scale = static_cast<float>(1.0 / after);
    Combine(level.mode, scale, level.mode, 0.0f);
  }
  level.largest = largest;
}

// Passes over a lattice of which each takes what the one before made of a slice and of its neighbours: body(pass, j, k). They
// follow each other one slice apart, so that the matrix comes from memory once for all of them.
template <class Body>
void Sweep(const LatticeShape& shape, int passes, const Body& body)
{
  const std::ptrdiff_t grain = std::max(1, NodesOfATask / shape.nodes[0]);
  for (int front = 0; front < shape.nodes[2] + passes - 1; ++front)
    for (int pass = std::max(0, front - shape.nodes[2] + 1); pass < std::min(passes, front + 1); ++pass)
      ParallelRanges(shape.nodes[1], grain, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t j = begin; j < end; ++j)
          body(pass, static_cast<int>(j), front - pass);
      });
}

void LatticeMultigrid::Smooth(Level& level, bool fromZero)
{
  const LatticeShape& shape = level.matrix.Shape();
  const double high = 1.1 * level.largest, low = high / ChebyshevRange, middle = 0.5 * (high + low), half = 0.5 * (high - low);
  const double sigma = middle / half;
  float keep[ChebyshevDegree] = {0.0f}, take[ChebyshevDegree] = {static_cast<float>(1.0 / middle)};
  double rho = 1.0 / sigma;
  for (int n = 1; n < ChebyshevDegree; ++n) {
    const double next = 1.0 / (2.0 * sigma - rho);
    keep[n] = static_cast<float>(next * rho);
    take[n] = static_cast<float>(2.0 * next / half);
    rho = next;
  }
  // The passes write by turns to other and to value; the one after them, before the next level is asked, makes the residual.
  const std::vector<float> zeros(static_cast<std::size_t>(3 * shape.Padded()), 0.0f);
  LatticeField<float>* const fields[2] = {&level.value, &level.other};
  Sweep(shape, ChebyshevDegree + (fromZero ? 1 : 0), [&](int n, int j, int k) {
    const std::ptrdiff_t at = shape.At(0, j, k);
    LatticeField<float>&from = *fields[n % 2], &to = *fields[1 - n % 2];
    const bool isZero = n == 0 && fromZero;
    std::vector<float> product;
    if (!isZero) {
      product.resize(static_cast<std::size_t>(3 * shape.Padded()));
      level.packed.MultiplyRow(j, k, from, product.data());
    }
    const float* const right[3] = ECHORAMA_ROWS(level.right);
    float* const next[3] = ECHORAMA_ROWS(to);
    if (n == ChebyshevDegree) {
      const float* scale = level.packed.Scale().data() + at;
      for (int c = 0; c < 3; ++c)
        for (int i = 0; i < shape.nodes[0]; ++i)
          next[c][i] = scale[i] * (right[c][i] - product[static_cast<std::size_t>(c * shape.Padded() + i)]);
      return;
    }
    const float* const some[3] = ECHORAMA_ROWS(from);
    const float* const none[3] = {zeros.data(), zeros.data(), zeros.data()};
    float* const step[3] = ECHORAMA_ROWS(level.step);
    const float* const inverse[6] = ECHORAMA_INVERSES(level.packed);
    ChebyshevRow(shape.nodes[0], keep[n], take[n], isZero ? zeros.data() : product.data(), shape.Padded(), right, inverse,
                 isZero ? none : some, step, next);
  });
  static_assert(ChebyshevDegree % 2 == 1);
  std::swap(level.value, level.other);
}

void LatticeMultigrid::Restrict(const Level& fine, Level& coarse)
{
  const LatticeShape &from = fine.matrix.Shape(), &to = coarse.matrix.Shape();
  const LatticeField<float>& residual = fine.other;
  const std::array<int, 3> reach = {fine.halved[0] ? 1 : 0, fine.halved[1] ? 1 : 0, fine.halved[2] ? 1 : 0};
  ParallelFor(to.nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < to.nodes[1]; ++j)
      for (int c = 0; c < 3; ++c) {
        float* out = coarse.right.Component(c) + to.At(0, j, k);
        std::fill(out, out + to.nodes[0], 0.0f);
        for (int dz = -reach[2]; dz <= reach[2]; ++dz)
          for (int dy = -reach[1]; dy <= reach[1]; ++dy) {
            const int fj = (reach[1] ? 2 * j : j) + dy, fk = (reach[2] ? 2 * k : k) + dz;
            if (fj < 0 || fk < 0 || fj >= from.nodes[1] || fk >= from.nodes[2])
              continue;
            const float weight = (dz ? 0.5f : 1.0f) * (dy ? 0.5f : 1.0f);
            const float* in = residual.Component(c) + from.At(0, fj, fk);
            if (reach[0] == 0) {
              for (int i = 0; i < to.nodes[0]; ++i)
                out[i] += weight * in[i];
            } else { // ghosts are zero; the last coarse node may lie one beyond the fine ones
              for (int i = 0; i < to.nodes[0]; ++i)
                out[i] += weight * (in[2 * i] + 0.5f * (in[2 * i - 1] + in[2 * i + 1]));
            }
          }
        const float* unscale = coarse.packed.Unscale().data() + to.At(0, j, k);
        for (int i = 0; i < to.nodes[0]; ++i)
          out[i] *= unscale[i];
      }
  });
}

void LatticeMultigrid::Prolong(const Level& coarse, Level& fine)
{
  const LatticeShape &from = coarse.matrix.Shape(), &to = fine.matrix.Shape();
  ParallelFor(to.nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    const int k0 = fine.halved[2] ? k / 2 : k, k1 = fine.halved[2] ? (k + 1) / 2 : k;
    std::vector<float> row(static_cast<std::size_t>(from.nodes[0]) + 1);
    for (int j = 0; j < to.nodes[1]; ++j) {
      const int j0 = fine.halved[1] ? j / 2 : j, j1 = fine.halved[1] ? (j + 1) / 2 : j;
      const std::ptrdiff_t at = to.At(0, j, k);
      const float *scale = fine.packed.Scale().data() + at, *unscale = coarse.packed.Unscale().data();
      const std::ptrdiff_t rows[4] = {from.At(0, j0, k0), from.At(0, j1, k0), from.At(0, j0, k1), from.At(0, j1, k1)};
      for (int c = 0; c < 3; ++c) {
        const float* in = coarse.value.Component(c);
        for (int i = 0; i <= from.nodes[0]; ++i)
          row[static_cast<std::size_t>(i)] =
              0.25f * (in[rows[0] + i] * unscale[rows[0] + i] + in[rows[1] + i] * unscale[rows[1] + i] +
                       in[rows[2] + i] * unscale[rows[2] + i] + in[rows[3] + i] * unscale[rows[3] + i]);
        float* out = fine.value.Component(c) + at;
        for (int i = 0; i < to.nodes[0]; ++i) {
          const float value = fine.halved[0]
                                  ? 0.5f * (row[static_cast<std::size_t>(i / 2)] + row[static_cast<std::size_t>((i + 1) / 2)])
                                  : row[static_cast<std::size_t>(i)];
          out[i] += scale[i] * value;
        }
      }
    }
  });
}

void LatticeMultigrid::SolveCoarsest()
{
  Level& level = levels_.back();
  Eigen::VectorXd right(static_cast<Eigen::Index>(3 * unknowns_.size()));
  const auto scale = [&level](std::ptrdiff_t at) { return level.packed.Scale()[static_cast<std::size_t>(at)]; };
  for (std::size_t n = 0; n < unknowns_.size(); ++n)
    right.segment<3>(static_cast<Eigen::Index>(3 * n)) = (scale(unknowns_[n]) * level.right.Get(unknowns_[n])).cast<double>();
  const Eigen::VectorXd solution = coarsest_.solve(right);
  level.value.Fill(0.0f);
  for (std::size_t n = 0; n < unknowns_.size(); ++n)
    level.value.Set(unknowns_[n], scale(unknowns_[n]) * solution.segment<3>(static_cast<Eigen::Index>(3 * n)).cast<float>());
}

void LatticeMultigrid::Cycle(std::size_t n)
{
  if (n + 1 == levels_.size()) {
    SolveCoarsest();
    return;
  }
  Smooth(levels_[n], true);
  Restrict(levels_[n], levels_[n + 1]);
  Cycle(n + 1);
  Prolong(levels_[n + 1], levels_[n]);
  Smooth(levels_[n], false);
}

void LatticeMultigrid::Cycle()
{
  Level& finest = levels_.front();
  Scaled(residual_, finest.packed.Unscale(), finest.right);
  Cycle(0);
  Scaled(finest.value, finest.packed.Unscale(), correction_);
}

LatticeMultigrid::Result LatticeMultigrid::Solve(const LatticeField<float>& b, LatticeField<float>& x, double tolerance,
                                                 int maximumSteps, const Progress& progress)
{
  Result result;
  const LatticeMatrix& matrix = levels_.front().matrix;
  const LatticeShape& shape = matrix.Shape();
  x = LatticeField<float>(shape);
  residual_ = b;
  double before = 0.0, first = 0.0;
  for (; result.steps < maximumSteps; ++result.steps) {
    progress(0.0);
    Cycle();
    const double now = SumOfProducts(residual_, correction_);
    if (result.steps == 0)
      first = now;
    if (!(first > 0.0) || !std::isfinite(now))
      break;
    result.reduction = std::sqrt(std::max(now, 0.0) / first);
    if (result.reduction <= tolerance)
      break;
    Combine(direction_, result.steps == 0 ? 0.0f : static_cast<float>(now / before), correction_, 1.0f);
    before = now;
    ParallelFor(shape.nodes[2], [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      std::vector<float> product(static_cast<std::size_t>(3 * shape.Padded()));
      for (int j = 0; j < shape.nodes[1]; ++j) {
        matrix.MultiplyRow(j, k, direction_, product.data());
        for (int c = 0; c < 3; ++c)
          std::copy_n(product.data() + c * shape.Padded(), shape.nodes[0], product_.Component(c) + shape.At(0, j, k));
      }
    });
    for (const Apart& apart : apart_) {
      const Eigen::Vector3f push = apart.stiffness * (direction_.Get(apart.at[0]) - apart.sign * direction_.Get(apart.at[1]));
      product_.Set(apart.at[0], product_.Get(apart.at[0]) - push);
      product_.Set(apart.at[1], product_.Get(apart.at[1]) + apart.sign * push);
    }
    const double curvature = SumOfProducts(direction_, product_);
    if (!(curvature > 0.0)) {
      result.isConvex = false;
      if (result.steps == 0)
        x = correction_; // still a way down, since the preconditioner is positive
      break;
    }
    const auto length = static_cast<float>(now / curvature);
    Combine(x, 1.0f, direction_, length);
    Combine(residual_, 1.0f, product_, -length);
  }
  return result;
}

} // namespace echorama
