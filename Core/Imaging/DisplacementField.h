// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <vector>

namespace echorama {

/// A smooth displacement u of the world: a cubic B-spline over a coarse lattice of control points.
///
/// As all displacements here it leads from rest to now: what lies, or belongs, at x is at x + u(x) now, which is where a volume
/// of it, placed by its geometry (its pose), shows it. So a volume is resampled to rest without an inverse, by reading it at x +
/// u(x); where something that is seen belongs is told by Inverse().
///
/// u is the sum over control points of coefficient * B(x - control point), B being the product of a cubic B-spline per axis
/// of the lattice, one spacing a unit. Beyond the lattice all coefficients are zero: u is twice continuously differentiable
/// everywhere, and exactly zero from two spacings outside of the outermost control points on. Where all 64 control points
/// around x exist (from the second one to the last but one) linear fields are exact.
/// A default one has no lattice and is zero.
class DisplacementField {
public:
  DisplacementField() = default;

  /// Zero on a lattice. \throws Error(BadInput) for a lattice that is no geometry, Error(TooLarge) beyond 2^24 points.
  explicit DisplacementField(const ImageGeometry& lattice);

  /// \param coefficients one per control point, x fastest; vectors of the world, mm
  /// \throws Error(BadInput) as above, for another number of coefficients, and for one that is not finite or beyond 1e6 mm.
  DisplacementField(const ImageGeometry& lattice, const std::vector<Eigen::Vector3d>& coefficients);

  /// The field that takes the given values at its control points (a tridiagonal system along each axis). So an image of
  /// displacements is a field, and SampledOn(Lattice()) gives the image back. \throws as the constructor does.
  static DisplacementField Interpolating(const ImageGeometry& lattice, const std::vector<Eigen::Vector3d>& values);

  const ImageGeometry& Lattice() const { return lattice_; }
  bool IsZero() const { return largest_ == 0.0; }

  /// The coefficients, x fastest.
  std::vector<Eigen::Vector3d> Coefficients() const;

  /// u(x), mm; \a world in mm, anywhere.
  Eigen::Vector3d At(const Eigen::Vector3d& world) const;

  /// u at start, start + step ... (\a count points), as At() gives it to rounding. Along an axis of the lattice a point costs
  /// a 16th.
  void Row(const Eigen::Vector3d& start, const Eigen::Vector3d& step, int count, Eigen::Vector3d* displacements) const;

  /// u at every voxel of a grid.
  Volume<Eigen::Vector3d> SampledOn(const ImageGeometry& grid, const Progress& progress = {}) const;

  /// The derivative of x + u(x): row by component, column by axis of the world.
  Eigen::Matrix3d Jacobian(const Eigen::Vector3d& world) const;

  /// Where what is at \a read now belongs: the x with x + u(x) = read, by iterating x = read - u(x).
  ///
  /// Each step shrinks the error by the norm of the derivative of u at worst, so it converges to the only answer where that
  /// norm stays below one; a field that folds has no such answer.
  /// \param tolerance of x + u(x), mm, > 0 \throws Error(NotPossible) when 200 steps do not reach it.
  Eigen::Vector3d Inverse(const Eigen::Vector3d& read, double tolerance = 1e-6) const;

  /// No displacement is longer than this, mm: the longest coefficient (B-splines are averages of them).
  double Bound() const { return largest_; }

  /// The smallest determinant of the Jacobian at \a perCell^3 points of every cell: at most 0 where space folds, 1 without
  /// displacement. Between the points the determinant can be a little smaller.
  double SmallestDeterminant(int perCell = 4) const;

  /// The integral over all space of the sum of the squared second derivatives of all components, mm.
  double BendingEnergy() const;

  /// The same field seen on another lattice: exact where its lattice refines this one and covers its support.
  DisplacementField SeenOn(const ImageGeometry& lattice) const { return Interpolating(lattice, ValuesOn(lattice)); }

private:
  std::vector<Eigen::Vector3d> ValuesOn(const ImageGeometry& lattice) const;
  std::ptrdiff_t Place(int i, int j, int k) const { return 4 * ((static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0] + i); }
  const double* Padded(int i, int j, int k) const { return padded_.data() + Place(i, j, k); }
  bool Support(const Eigen::Vector3d& index, int* first, Eigen::Vector3d& fraction) const;

  ImageGeometry lattice_;
  Eigen::Affine3d worldToIndex_ = Eigen::Affine3d::Identity();
  std::array<int, 3> size_{0, 0, 0}; // with three zeros before and after
  std::vector<double> padded_;       // x, y, z, 0 of each
  double largest_ = 0.0;
};

/// The four cubic B-splines that are not zero in a cell, at \a t in [0, 1] of the way from the second control point to the
/// third; derivative 0, 1 or 2, per spacing.
std::array<double, 4> CubicWeights(double t, int derivative = 0);

/// What two control points \a offset apart (each in -3 ... 3) contribute to the bending energy, as the matrix entry K of
/// energy = sum c_a . c_b K(b - a): the integral of the products of the second derivatives of their basis functions, mm^-1.
double BendingEntry(const std::array<int, 3>& offset, const Eigen::Vector3d& spacing);

/// The same for the integral of u^2: the product of the two basis functions themselves, mm^3.
double MassEntry(const std::array<int, 3>& offset, const Eigen::Vector3d& spacing);

} // namespace echorama
