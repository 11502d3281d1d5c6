// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/FanRefinement.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace echorama {
namespace {

using FanMatrix = Eigen::Matrix<double, FanModel::unknowns, FanModel::unknowns>;

// Solves a symmetric positive definite system: Cholesky, in this order on every machine.
FanVector Solved(FanMatrix a, FanVector b)
{
  for (int j = 0; j < FanModel::unknowns; ++j)
    for (int i = j; i < FanModel::unknowns; ++i) {
      double sum = a(i, j);
      for (int k = 0; k < j; ++k)
        sum -= a(i, k) * a(j, k);
      a(i, j) = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / a(j, j);
    }
  for (int i = 0; i < FanModel::unknowns; ++i) {
    for (int k = 0; k < i; ++k)
      b[i] -= a(i, k) * b[k];
    b[i] /= a(i, i);
  }
  for (int i = FanModel::unknowns; i-- > 0;) {
    for (int k = i + 1; k < FanModel::unknowns; ++k)
      b[i] -= a(k, i) * b[k];
    b[i] /= a(i, i);
  }
  return b;
}

// The robust least squares of a model to points, at one reach of Tukey's weight.
class Problem {
public:
  Problem(const OutlinePoints& points, double reach, FanFreedom freedom) : points_(points), reach_(reach), freedom_(freedom) {}

  // The sum that is minimised. With a matrix, also the normal equations.
  double Evaluate(const FanModel& model, FanMatrix* hessian = nullptr, FanVector* slope = nullptr) const
  {
    const Pose worldToProbe = model.probeToWorld.inverse();
    double cost = 0.0;
    if (hessian) {
      hessian->setZero();
      slope->setZero();
    }
    for (const RegionOutline::Point& point : points_) {
      const Eigen::Vector3d inProbe = worldToProbe * point.position;
      const FanPlace at = LocateInFan(model.shape, inProbe);
      const double kind = point.atGrid && at.distance < 0.0 ? leastFanWeight : 1.0;
      const double ratio = at.distance / reach_, remains = std::max(0.0, 1.0 - ratio * ratio);
      cost += kind * (1.0 - remains * remains * remains);
      if (!hessian || remains == 0.0)
        continue;
      const double weight = kind * remains * remains;
      const FanVector gradient = FanGradient(model.shape, inProbe, at);
      hessian->selfadjointView<Eigen::Lower>().rankUpdate(gradient, weight);
      *slope += (weight * at.distance) * gradient;
    }
    return cost;
  }

  // At most \a steps steps downhill.
  void Improve(FanModel& model, int steps) const
  {
    double damping = 1e-3;
    FanMatrix hessian;
    FanVector slope;
    double cost = Evaluate(model, &hessian, &slope);
    for (int step = 0; step < steps; ++step) {
      bool better = false;
      double gain = 0.0;
      for (int trial = 0; trial < 6 && !better; ++trial) {
        const FanModel moved = Moved(model, hessian, slope, damping);
        const double movedCost = Evaluate(moved);
        better = movedCost < cost;
        if (better) {
          gain = cost - movedCost;
          model = moved;
          damping = std::max(1e-9, damping * 0.2);
        } else {
          damping *= 8.0;
        }
      }
      if (!better || gain < 1e-5 * cost)
        return;
      cost = Evaluate(model, &hessian, &slope);
    }
  }

private:
  bool IsFree(int unknown) const
  {
    if (unknown == FanModel::FanOffset)
      return freedom_ == FanFreedom::Offset;
    return freedom_ != FanFreedom::Plane || unknown == 0 || unknown == 2 || unknown == 4 || unknown == FanModel::FanAngle ||
           unknown == FanModel::FanWidth || unknown == FanModel::Length;
  }

  // One damped step. Shape numbers do not fall below 0: one that would is held there and the others are solved for again.
  FanModel Moved(const FanModel& model, const FanMatrix& hessian, const FanVector& slope, double damping) const
  {
    std::array<bool, FanModel::unknowns> held;
    FanVector change = FanVector::Zero();
    for (int unknown = 0; unknown < FanModel::unknowns; ++unknown)
      held[unknown] = !IsFree(unknown);
    for (bool again = true; again;) {
      again = false;
      FanMatrix system = hessian.selfadjointView<Eigen::Lower>();
      FanVector right = -slope;
      const double least = 1e-12 * (hessian.diagonal().maxCoeff() + 1e-30);
      for (int unknown = 0; unknown < FanModel::unknowns; ++unknown) {
        system(unknown, unknown) += damping * hessian(unknown, unknown) + least;
        if (held[unknown]) {
          // What the others see of a number that is clamped: it goes to 0, or stays.
          right -= system.col(unknown) * change[unknown];
        }
      }
      for (int unknown = 0; unknown < FanModel::unknowns; ++unknown)
        if (held[unknown]) {
          system.row(unknown).setZero();
          system.col(unknown).setZero();
          system(unknown, unknown) = 1.0;
          right[unknown] = change[unknown];
        }
      change = Solved(system, right);
      for (int unknown = FanModel::FanAngle; unknown < FanModel::unknowns; ++unknown)
        if (unknown != FanModel::FanOffset && !held[unknown] && model[unknown] + change[unknown] < 0.0) {
          held[unknown] = true;
          change[unknown] = -model[unknown];
          again = true;
        }
      if (again)
        for (int unknown = 0; unknown < FanModel::unknowns; ++unknown)
          if (!held[unknown])
            change[unknown] = 0.0;
    }
    FanModel moved = model;
    moved.probeToWorld = model.probeToWorld * Exp(change.head<6>());
    for (int unknown = FanModel::FanAngle; unknown < FanModel::unknowns; ++unknown)
      if (IsFree(unknown))
        moved[unknown] =
            unknown == FanModel::FanOffset ? model[unknown] + change[unknown] : std::max(0.0, model[unknown] + change[unknown]);
    moved.shape.fanAngle = std::min(moved.shape.fanAngle, 1.999 * Pi);
    moved.shape.sweepAngle = std::min(moved.shape.sweepAngle, 1.999 * Pi);
    moved.shape.depthMax = std::max(moved.shape.depthMax, 0.5 * model.shape.depthMax);
    return moved;
  }

  const OutlinePoints& points_;
  double reach_;
  FanFreedom freedom_;
};

} // namespace

void RefineFan(FanModel& model, const OutlinePoints& points, FanFreedom freedom, double from, double to, int steps)
{
  for (double reach = from; reach > 1.5 * to; reach *= 0.5)
    Problem(points, reach, freedom).Improve(model, 4);
  Problem(points, to, freedom).Improve(model, steps);
}

} // namespace echorama
