// SPDX-License-Identifier: BSD-3-Clause
#include "LatticeEquations.h"
#include "Core/Base/Parallel.h"
#include "Filters/Registration/Index.h"
#include <Eigen/LU>

namespace echorama {

void LatticeEquations::AddPenalty(const Penalty& entries, const Vectors& coefficients)
{
  ParallelRanges(count_, 32, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t node = begin; node < end; ++node)
      Neighbours(node, [&](std::ptrdiff_t other, int di, int dj, int dk) {
        const double entry = entries[Index(Entry(di, dj, dk))];
        double* block = Block(node, di, dj, dk);
        block[0] += entry;
        block[3] += entry;
        block[5] += entry;
        right_[Index(node)] -= entry * coefficients[Index(other)];
      });
  });
}

double LatticeEquations::PenaltyOf(const Penalty& entries, const Vectors& c) const
{
  return ParallelSum<double>(static_cast<std::ptrdiff_t>(c.size()), 32, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    double sum = 0.0;
    for (std::ptrdiff_t node = begin; node < end; ++node)
      Neighbours(node, [&](std::ptrdiff_t other, int di, int dj, int dk) {
        sum += entries[Index(Entry(di, dj, dk))] * c[Index(node)].dot(c[Index(other)]);
      });
    return 0.5 * sum;
  });
}

LatticeEquations::Vectors LatticeEquations::Solve(double damping) const
{
  std::vector<Eigen::Matrix3d> inverse(right_.size());
  for (std::ptrdiff_t node = 0; node < count_; ++node)
    inverse[Index(node)] = Diagonal(node).inverse() / (1.0 + damping);
  const auto dot = [](const Vectors& a, const Vectors& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
      sum += a[i].dot(b[i]);
    return sum;
  };
  Vectors x(right_.size(), Eigen::Vector3d::Zero()), r = right_, z(x), p(x), q(x);
  const auto precondition = [&] {
    for (std::size_t i = 0; i < r.size(); ++i)
      z[i] = inverse[i] * r[i];
  };
  precondition();
  p = z;
  double rz = dot(r, z);
  const double enough = 1e-8 * rz;
  for (int step = 0; step < 400 && rz > enough; ++step) {
    ParallelRanges(count_, 32, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t node = begin; node < end; ++node) {
        Eigen::Vector3d sum = damping * (Diagonal(node) * p[Index(node)]);
        Neighbours(node, [&](std::ptrdiff_t other, int di, int dj, int dk) {
          const double* b = blocks_.data() + 6 * (node * Stencil + Entry(di, dj, dk));
          const Eigen::Vector3d& v = p[Index(other)];
          sum[0] += b[0] * v[0] + b[1] * v[1] + b[2] * v[2];
          sum[1] += b[1] * v[0] + b[3] * v[1] + b[4] * v[2];
          sum[2] += b[2] * v[0] + b[4] * v[1] + b[5] * v[2];
        });
        q[Index(node)] = sum;
      }
    });
    const double alpha = rz / dot(p, q);
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] += alpha * p[i];
      r[i] -= alpha * q[i];
    }
    precondition();
    const double next = dot(r, z), beta = next / rz;
    rz = next;
    for (std::size_t i = 0; i < p.size(); ++i)
      p[i] = z[i] + beta * p[i];
  }
  return x;
}

Eigen::Matrix3d LatticeEquations::Diagonal(std::ptrdiff_t node) const
{
  const double* b = blocks_.data() + 6 * (node * Stencil + Entry(0, 0, 0));
  Eigen::Matrix3d full;
  full << b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5];
  return full;
}

} // namespace echorama
