// SPDX-License-Identifier: BSD-3-Clause
// The acceleration is a Gauss-Markov process: with rate b, exp(-b t) of it are left after t. What white noise of power
// q = 2 b sigma^2 did t ago has grown to g(t) = ((b t - 1 + exp(-b t)) / b^2, (1 - exp(-b t)) / b, exp(-b t)) of position,
// velocity and acceleration. The integral of q g g' is a polynomial of degree 4 where t is short, so three points of Gauss are
// exact there; and a sum of squares is never negative, as differences of the closed form are.
#include "HandMotion.h"
#include <cmath>

namespace echorama {

namespace {

constexpr double Forgets = 10.0; // 1/s: of a hand's acceleration

Eigen::Vector3d Grown(double seconds)
{
  const double x = Forgets * seconds, gone = -std::expm1(-x);
  return {(x - gone) / (Forgets * Forgets), gone / Forgets, 1.0 - gone};
}

// One axis of the state for another, both coordinates alike.
void Set(HandCovariance& matrix, int row, int column, double value)
{
  matrix(2 * row, 2 * column) = matrix(2 * row + 1, 2 * column + 1) = value;
}

} // namespace

HandMotion::HandMotion(double seconds, double acceleration) : step(HandCovariance::Identity()), noise(HandCovariance::Zero())
{
  const Eigen::Vector3d grown = Grown(seconds);
  Set(step, 0, 1, seconds);
  for (int row = 0; row < 3; ++row)
    Set(step, row, 2, grown[row]);

  const double length = std::abs(seconds), root = std::sqrt(0.6);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& [at, weight] : {std::pair(0.5 - 0.5 * root, 5.0), std::pair(0.5, 8.0), std::pair(0.5 + 0.5 * root, 5.0)}) {
    const Eigen::Vector3d g = Grown(at * length);
    sum += weight / 18.0 * g * g.transpose();
  }
  sum *= 2.0 * Forgets * acceleration * acceleration * length;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      Set(noise, row, column, sum(row, column));
}

} // namespace echorama
