// SPDX-License-Identifier: BSD-3-Clause
// The plate's kernel is positive definite only among weights that neither sum up to anything nor have a first moment. Those are a
// plane Q through 0; there Q' K Q = L L', and Q L^-T are weights of which the bending energy is a plain sum of squares.
#include "ThinPlate.h"
#include "Core/Base/Percentile.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <limits>

namespace echorama {

using Eigen::Vector2d;

namespace {

constexpr double SamePx = 1.0; // nearer observations are of one mark

double PlateKernel(double squared) // r^2 log r
{
  return squared > 0.0 ? 0.5 * squared * std::log(squared) : 0.0;
}

double Turn(const Vector2d& a, const Vector2d& b, const Vector2d& c)
{
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

std::vector<Vector2d> ConvexHull(std::vector<Vector2d> points)
{
  std::sort(points.begin(), points.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3)
    return points;
  std::vector<Vector2d> hull;
  for (int side = 0; side < 2; ++side) { // the lower one, then the upper one
    const std::size_t first = hull.size();
    for (const Vector2d& point : points) {
      while (hull.size() >= first + 2 && Turn(hull[hull.size() - 2], hull.back(), point) <= 0.0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back(); // it begins the other side
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

} // namespace

Eigen::VectorXd ThinPlate::Basis(const Vector2d& pixel) const
{
  const auto count = static_cast<Eigen::Index>(centres.size());
  Eigen::VectorXd basis(count + 3);
  for (Eigen::Index i = 0; i < count; ++i)
    basis[i] = PlateKernel((pixel - centres[static_cast<std::size_t>(i)]).squaredNorm() / (scale * scale));
  basis.tail<3>() << 1.0, (pixel - middle) / scale;
  return basis;
}

Vector2d ThinPlate::At(const Vector2d& pixel) const
{
  Vector2d sum = Vector2d::Zero();
  if (IsNone())
    return sum;
  const Eigen::VectorXd basis = Basis(pixel);
  for (std::size_t i = 0; i < weights.size(); ++i)
    sum += basis[static_cast<Eigen::Index>(i)] * weights[i];
  return sum;
}

Eigen::Matrix2d ThinPlate::Gradient(const Vector2d& pixel) const
{
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const Vector2d from = (pixel - centres[i]) / scale;
    const double squared = from.squaredNorm();
    if (squared > 0.0)
      sum += weights[i] * ((std::log(squared) + 1.0) / scale * from).transpose();
  }
  if (!IsNone()) {
    sum.col(0) += weights[weights.size() - 2] / scale;
    sum.col(1) += weights[weights.size() - 1] / scale;
  }
  return sum;
}

ThinPlate ThinPlate::Over(const std::vector<Vector2d>& pixels, int count)
{
  ThinPlate plate;
  Vector2d low = pixels.at(0), high = low;
  for (const Vector2d& pixel : pixels) {
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  plate.middle = 0.5 * (low + high);
  plate.scale = std::max(0.5 * (high - low).maxCoeff(), 1.0);

  // Each next one is the pixel farthest from all before: the first is that nearest to the middle.
  std::vector<double> distance(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    distance[i] = -(pixels[i] - plate.middle).squaredNorm();
  while (static_cast<int>(plate.centres.size()) < count) {
    const auto next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
    if (!plate.centres.empty() && distance[next] < 1e-4 * plate.scale * plate.scale / count)
      break; // the rest repeats what there is
    const Vector2d centre = pixels[next];
    const bool isFirst = plate.centres.empty();
    plate.centres.push_back(centre);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double squared = (pixels[i] - centre).squaredNorm();
      distance[i] = isFirst ? squared : std::min(distance[i], squared);
    }
  }
  plate.weights.assign(plate.centres.size() + 3, Vector2d::Zero());
  return plate;
}

Eigen::MatrixXd ThinPlate::Freedoms() const
{
  const auto count = static_cast<Eigen::Index>(centres.size());
  if (count < 4) { // no bend; without centres there is nothing at all
    Eigen::MatrixXd affine = Eigen::MatrixXd::Zero(count + 3, IsNone() ? 0 : 3);
    affine.bottomRows<3>().setIdentity();
    return affine;
  }
  Eigen::MatrixXd kernel(count, count + 3);
  for (Eigen::Index i = 0; i < count; ++i)
    kernel.row(i) = Basis(centres[static_cast<std::size_t>(i)]).transpose();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(Eigen::MatrixXd(kernel.rightCols<3>()));
  const Eigen::MatrixXd q = (qr.householderQ() * Eigen::MatrixXd::Identity(count, count)).rightCols(count - 3);
  const Eigen::MatrixXd energy = q.transpose() * kernel.leftCols(count) * q;
  const Eigen::LLT<Eigen::MatrixXd> factor(energy);
  Eigen::MatrixXd freedoms = Eigen::MatrixXd::Zero(count + 3, count);
  const Eigen::MatrixXd bends = factor.matrixL().solve(q.transpose()).transpose();
  // Turned such that the last three take what squares of the coordinates have at the centres.
  Eigen::MatrixXd squares(count, 3);
  const auto x = kernel.col(count + 1).array(), y = kernel.col(count + 2).array();
  squares << x * x, x * y, y * y;
  const Eigen::HouseholderQR<Eigen::MatrixXd> turn(Eigen::MatrixXd(bends.transpose() * squares));
  freedoms.topLeftCorner(count, count - 3) =
      (bends * (turn.householderQ() * Eigen::MatrixXd::Identity(count - 3, count - 3))).rowwise().reverse();
  freedoms.bottomRightCorner<3, 3>().setIdentity();
  return freedoms;
}

Eigen::Index ThinPlate::LowOrders() const
{
  return IsNone() ? 0 : std::clamp<Eigen::Index>(static_cast<Eigen::Index>(centres.size()), 3, 6);
}

PixelCoverage PixelCoverage::Of(const std::vector<Vector2d>& pixels)
{
  PixelCoverage covered;
  for (const Vector2d& pixel : pixels) // a mark that was seen again is no neighbour
    if (std::none_of(covered.pixels.begin(), covered.pixels.end(),
                     [&pixel](const Vector2d& other) { return (other - pixel).squaredNorm() < SamePx * SamePx; }))
      covered.pixels.push_back(pixel);
  const std::size_t count = covered.pixels.size(), neighbours = std::min<std::size_t>(6, count > 0 ? count - 1 : 0);
  std::vector<double> squares(count);
  for (const Vector2d& pixel : covered.pixels) {
    for (std::size_t i = 0; i < count; ++i)
      squares[i] = (covered.pixels[i] - pixel).squaredNorm();
    std::nth_element(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(neighbours), squares.end());
    covered.reach.push_back(std::sqrt(squares[neighbours])); // the pixel itself is the first
  }
  if (count > 0) {
    const double most = 2.0 * Median(covered.reach);
    for (double& reach : covered.reach)
      reach = std::min(reach, most);
  }
  covered.hull = ConvexHull(pixels);
  return covered;
}

bool PixelCoverage::Holds(const Vector2d& pixel) const
{
  double nearest = std::numeric_limits<double>::infinity();
  std::size_t which = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double squared = (pixels[i] - pixel).squaredNorm();
    if (squared < nearest) {
      nearest = squared;
      which = i;
    }
  }
  if (!(std::sqrt(nearest) <= (pixels.empty() ? 0.0 : reach[which])))
    return false;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d &a = hull[i], &b = hull[(i + 1) % hull.size()];
    if (Turn(a, b, pixel) < -0.5 * reach[which] * (b - a).norm())
      return false;
  }
  return hull.size() > 2;
}

double PixelCoverage::HullArea() const
{
  double twice = 0.0;
  for (std::size_t i = 2; i < hull.size(); ++i)
    twice += Turn(hull[0], hull[i - 1], hull[i]);
  return 0.5 * twice;
}

} // namespace echorama
