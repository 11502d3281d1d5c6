// SPDX-License-Identifier: BSD-3-Clause
// The error is s L v with L L^T the covariance, v uniform on the sphere of directions and s independent of it. In a direction
// of size q = |L v| the sphere of radius r holds s <= r / q. The chance of that, averaged over directions (one octant is enough),
// grows with r, and where it is the level is found by false position.
#include "Filters/Calibration/ConfidenceRadius.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Eigenvalues>

namespace echorama {
namespace {

// The chance that |t| <= x for Student's t (Abramowitz and Stegun 26.7.3 and 26.7.4), and its density at x.
struct Student {
  double within, density;
};
Student StudentAt(double x, int degrees)
{
  const double root = std::sqrt(static_cast<double>(degrees));
  const double angle = std::atan(x / root), cosine = std::cos(angle), sine = std::sin(angle);
  const bool odd = degrees % 2 == 1;
  double term = odd ? cosine : 1.0, sum = 0.0;
  for (int power = odd ? 1 : 0; power <= degrees - 2; power += 2) {
    sum += term;
    term *= cosine * cosine * (power + 1) / (power + 2);
  }
  const double logarithm = std::lgamma(0.5 * (degrees + 1)) - std::lgamma(0.5 * degrees) - 0.5 * std::log(degrees * Pi) -
                           0.5 * (degrees + 1) * std::log1p(x * x / degrees);
  return {odd ? 2.0 / Pi * (angle + sine * sum) : sine * sum, std::exp(logarithm)};
}

// The chance that the length of a vector of three such numbers, of one common scale, is at most x.
double Within(double x, int degrees)
{
  if (degrees > 0 && degrees < 1000) {
    const Student student = StudentAt(x, degrees);
    return student.within - 2.0 * x * student.density;
  }
  return std::erf(x / std::sqrt(2.0)) - x * std::sqrt(2.0 / Pi) * std::exp(-0.5 * x * x);
}

} // namespace

double ConfidenceRadius(const Eigen::Matrix3d& covariance, int degrees, double level)
{
  const Eigen::Vector3d variance =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().cwiseMax(0.0);
  if (!(variance[2] > 0.0))
    return 0.0;
  constexpr int Steps = 8; // midpoints: heights on the sphere times quarters of a turn
  std::array<double, Steps * Steps> sizes{};
  for (int i = 0; i < Steps; ++i)
    for (int j = 0; j < Steps; ++j) {
      const double height = (i + 0.5) / Steps, angle = 0.5 * Pi * (j + 0.5) / Steps, flat = 1.0 - height * height;
      sizes[static_cast<std::size_t>(i * Steps + j)] =
          std::sqrt(variance[0] * flat * std::pow(std::cos(angle), 2) + variance[1] * flat * std::pow(std::sin(angle), 2) +
                    variance[2] * height * height);
    }
  const auto chance = [&](double r) {
    double sum = 0.0;
    for (const double size : sizes)
      sum += Within(r / std::max(size, 1e-150), degrees);
    return sum / static_cast<double>(sizes.size());
  };
  double low = 0.0, lowGap = -level, high = std::sqrt(variance.sum()), highGap = chance(high) - level;
  for (int doubling = 0; highGap < 0.0 && doubling < 200; ++doubling) {
    low = high;
    lowGap = highGap;
    high *= 2.0;
    highGap = chance(high) - level;
  }
  // False position, with the gap of an end that stays halved (Illinois).
  int stayed = 0;
  for (int step = 0; step < 60 && high - low > 1e-9 * high; ++step) {
    const double middle = (low * highGap - high * lowGap) / (highGap - lowGap);
    const double gap = chance(middle) - level;
    if (std::abs(gap) < 1e-9)
      return middle;
    if (gap < 0.0) {
      low = middle;
      lowGap = gap;
      highGap *= stayed == -1 ? 0.5 : 1.0;
      stayed = -1;
    } else {
      high = middle;
      highGap = gap;
      lowGap *= stayed == 1 ? 0.5 : 1.0;
      stayed = 1;
    }
  }
  return 0.5 * (low + high);
}

} // namespace echorama
