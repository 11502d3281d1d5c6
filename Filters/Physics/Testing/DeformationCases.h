// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the tests of deformation share: lattices, fields, images.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Physics/DeformedCells.h"
#include "Filters/Physics/DeformedSources.h"
#include "Filters/Physics/DeformGeometry.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>

namespace echorama::deformation {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Deform = DeformGeometryParameters;

inline ImageGeometry Oblique(std::array<int, 3> dimensions = {6, 7, 5}, const Vector3d& spacing = {4.0, 3.0, 5.0})
{
  ImageGeometry lattice;
  lattice.dimensions = dimensions;
  lattice.spacing = spacing;
  lattice.origin = {-7.0, 11.0, 3.0};
  lattice.direction =
      (Eigen::AngleAxisd(0.4, Vector3d::UnitX()) * Eigen::AngleAxisd(-0.7, Vector3d(1, 2, 3).normalized())).toRotationMatrix();
  return lattice;
}

template <class Field>
std::vector<Vector3d> Sampled(const ImageGeometry& lattice, const Field& field)
{
  std::vector<Vector3d> values;
  for (int k = 0; k < lattice.dimensions[2]; ++k)
    for (int j = 0; j < lattice.dimensions[1]; ++j)
      for (int i = 0; i < lattice.dimensions[0]; ++i)
        values.push_back(field(lattice.IndexToWorld() * Vector3d(i, j, k)));
  return values;
}

// Points all over a lattice, \a margin inside of it in index units.
inline std::vector<Vector3d> PointsIn(const ImageGeometry& lattice, int count, double margin = 0.0, std::uint64_t seed = 3)
{
  Random random(seed);
  std::vector<Vector3d> points;
  for (int n = 0; n < count; ++n) {
    Vector3d index;
    for (int axis = 0; axis < 3; ++axis)
      index[axis] = random.Uniform(margin, lattice.dimensions[static_cast<std::size_t>(axis)] - 1 - margin);
    points.push_back(lattice.IndexToWorld() * index);
  }
  return points;
}

// A bump that presses and bulges; its derivative stays below 1.
struct Bump {
  Vector3d centre;
  double mm = 3.0, sigma = 9.0;
  Vector3d operator()(const Vector3d& x) const
  {
    const Vector3d d = x - centre;
    const double g = std::exp(-d.squaredNorm() / (2.0 * sigma * sigma));
    return mm * g * Vector3d(0.3 * std::sin(0.2 * d[1]), -0.5 * std::cos(0.15 * d[0]), 1.0);
  }
};

inline LatticeMap Pressed(const ImageGeometry& lattice, double mm = 3.0)
{
  return {lattice, Sampled(lattice, Bump{lattice.Centre(), mm})};
}

inline Deform With(Deform::Direction direction, Deform::Outside outside = Deform::Outside::Refuse, bool maskFolds = false)
{
  Deform p;
  p.direction = direction;
  p.outside = outside;
  p.maskFolds = maskFolds;
  return p;
}

constexpr auto Forward = Deform::Direction::Forward;
constexpr auto Backward = Deform::Direction::Backward;

// The kind and message of what a function throws.
template <class Function>
std::pair<int, std::string> Thrown(const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    return {static_cast<int>(error.GetKind()), error.what()};
  }
  return {-1, "nothing was thrown"};
}

template <class Function>
void ExpectThrow(const Function& function, Error::Kind kind, const std::vector<std::string>& words)
{
  const auto [thrown, message] = Thrown(function);
  EXPECT_EQ(thrown, static_cast<int>(kind)) << message;
  for (const auto& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << message << " does not say " << word;
}

inline const Matrix3d stretch = (Matrix3d() << 0.9, 0.2, -0.1, 0.05, 1.15, 0.1, -0.2, 0.1, 0.8).finished();
inline const Vector3d shift(2.0, -3.0, 1.5);
inline Vector3d Affine(const Vector3d& x)
{
  return stretch * x + shift;
}

struct TestImage {
  ImageGeometry geometry;
  std::vector<double> in;
  std::vector<unsigned char> real;
};

// An image of a function of the place.
template <class Function>
TestImage ImageOf(const ImageGeometry& geometry, const Function& function)
{
  TestImage image{geometry, {}, {}};
  for (int k = 0; k < geometry.dimensions[2]; ++k)
    for (int j = 0; j < geometry.dimensions[1]; ++j)
      for (int i = 0; i < geometry.dimensions[0]; ++i)
        image.in.push_back(function(geometry.IndexToWorld() * Vector3d(i, j, k)));
  return image;
}

struct Out {
  std::vector<double> values;
  std::vector<unsigned char> valid;
  DeformReport report;
};

inline Out Deformed(const Deform& p, const LatticeMap& map, const TestImage& image, const ImageGeometry& grid,
                    const Progress& progress = {})
{
  Out out{std::vector<double>(grid.VoxelCount(), -9.0), std::vector<unsigned char>(grid.VoxelCount(), 9), {}};
  DeformedImage d;
  d.geometry = image.geometry;
  if (!image.real.empty())
    d.real = {image.real.data(), image.geometry.dimensions};
  d.grid = grid;
  d.writers = {MixedArray<double>(image.in.data(), out.values.data(), 1)};
  d.valid = {out.valid.data(), grid.dimensions};
  out.report = DeformImage(p, map, d, progress);
  return out;
}

} // namespace echorama::deformation
