// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

struct Sphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< mm
  double radius = 0.0;                              ///< mm
};

/// Spheres of many sizes in a region, none of which overlap. Source: dissertation 3.1.2 and figure 3.5.
struct SpherePackingParameters {
  enum class Method {
    Random,     ///< sizes are drawn first; each sphere is tried at random places until it fits, large ones first
    EmptySpace, ///< random places in empty space, each with the largest sphere that fits there (Manna, Physica A 187, 1992)
  };
  enum class Radii {
    Uniform,    ///< all radii alike
    LogUniform, ///< all factors alike: density 1/r
    PowerLaw,   ///< density r^-exponent, as in fractal media
  };
  enum class Region {
    Box,
    Ball, ///< the largest about the middle of the box
  };

  Method method = Method::Random;
  Region region = Region::Box;
  Eigen::Vector3d boxMin{-50.0, -50.0, 0.0};
  Eigen::Vector3d boxMax{50.0, 50.0, 100.0};
  Radii radii = Radii::LogUniform;
  double exponent = 3.0;
  double radiusMin = 1.0;
  double radiusMax = 8.0;
  double gapMm = 0.0;
  double fillFraction = 0.3;
  std::int64_t count = mostSpheres;
  int misses = 20000;
  std::uint64_t seed = 1;

  static constexpr std::int64_t mostSpheres = 5000000;

  /// Throws Error(InvalidParameter) that names the number which is out of its range; also for a box without volume, and for
  /// spheres that do not fit into the region.
  void Check() const;

  /// Of the region, mm^3.
  double Volume() const;
};

ParameterList Describe(SpherePackingParameters& p);

struct SpherePacking {
  std::vector<Sphere> spheres;
  double fillFraction = 0.0; ///< volume of the spheres over that of the region; exact, since all lie wholly inside
  std::int64_t tries = 0;    ///< places that were tried
  bool saturated = false;    ///< it ended for want of room, with less than what was asked for
};

/// Packs spheres until the fill fraction or the count is reached, whichever comes first, or no more fit. The last sphere is cut
/// to the size that is missing, so that the fill fraction comes out to less than a smallest sphere.
///
/// With Method::Random, sizes are drawn from the distribution until they sum up to the fill fraction or the count. A size that
/// misses too often is given up together with all larger ones, and smaller ones are drawn in their stead; so a dense packing has
/// fewer large spheres than its distribution says. Fractions up to 0.3 usually come out as drawn.
///
/// The result depends on the parameters alone, and not on the number of threads.
/// \throws Error(InvalidParameter) as Check(), Error(TooLarge) when it takes mostSpheres or more, Error(Cancelled).
SpherePacking PackSpheres(const SpherePackingParameters& parameters, const Progress& progress = {});

} // namespace echorama
