// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// A smooth field of displacements over a picture, in pixels: a thin plate of r^2 log r about some centres, and an affine part
/// (Duchon 1977; few centres: Wood, J. R. Stat. Soc. B 2003). Plain data; without centres it is 0 everywhere.
struct ThinPlate {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero(); ///< pixels; with \a scale what makes of them numbers near 1
  double scale = 1.0;
  std::vector<Eigen::Vector2d> centres; ///< pixels
  std::vector<Eigen::Vector2d> weights; ///< of each centre, then of 1, x and y

  bool IsNone() const { return centres.empty(); }
  /// What the weights are multiplied by at a pixel.
  Eigen::VectorXd Basis(const Eigen::Vector2d& pixel) const;
  Eigen::Vector2d At(const Eigen::Vector2d& pixel) const;
  /// How the field changes with the pixel.
  Eigen::Matrix2d Gradient(const Eigen::Vector2d& pixel) const;

  /// A plate without weights: at most \a count centres, out of \a pixels, far from each other.
  static ThinPlate Over(const std::vector<Eigen::Vector2d>& pixels, int count);
  /// Columns are independent changes of one component's weights which are alike in size: the sum of the squares of their factors
  /// is the bending energy plus that of the affine part. Weights are sums of such columns and nothing else. The last ones,
  /// LowOrders() of them, are what is nearest to squares and products of x and y, and the affine part itself.
  Eigen::MatrixXd Freedoms() const;
  Eigen::Index LowOrders() const; ///< 6; fewer of a plate of few centres
};

/// The part of a picture that observations say something about.
struct PixelCoverage {
  std::vector<Eigen::Vector2d> pixels; ///< of the observations, each mark once
  std::vector<double> reach;           ///< of each: how far other pixels may be from it
  std::vector<Eigen::Vector2d> hull;   ///< convex, counter-clockwise with x to the right and y upwards

  /// A pixel's reach is the distance to its sixth nearest neighbour, at most twice the median of those.
  static PixelCoverage Of(const std::vector<Eigen::Vector2d>& pixels);
  /// Within the reach of the nearest observation, and at most half of that outside of their hull.
  bool Holds(const Eigen::Vector2d& pixel) const;
  double HullArea() const; ///< pixels squared
};

} // namespace echorama
