// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <string>
#include <vector>

namespace echorama {

/// The triangles of one body. Those that share an edge share its two points: see MendSurface for meshes that do not.
struct TriangleSurface {
  std::vector<Eigen::Vector3f> points;                 ///< mm
  std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise as seen from outside
};

/// One kind of fault of a surface.
struct SurfaceFault {
  std::int64_t count = 0;
  std::vector<Eigen::Vector3f> places; ///< of the first ones
};

/// What a surface is like, as the boundary of a body.
struct SurfaceReport {
  std::int64_t triangles = 0;
  std::int64_t components = 0;      ///< pieces of surface whose triangles hang together
  std::int64_t cavities = 0;        ///< components that lie inside an odd number of others: they bound holes
  SurfaceFault openEdges;           ///< of one triangle alone
  SurfaceFault crowdedEdges;        ///< of three triangles and more
  SurfaceFault inconsistentEdges;   ///< whose two triangles face different sides
  SurfaceFault insideOut;           ///< components that face the wrong side as a whole; a cavity faces inwards
  SurfaceFault selfIntersections;   ///< pairs of triangles that cross, or overlap in one plane; touching is none
  SurfaceFault degenerateTriangles; ///< without area, or with a corner that is not finite
  double volumeMm3 = 0.0;           ///< within, as oriented; negative when inside out. It means little unless IsClosed()

  bool IsClosed() const { return openEdges.count == 0 && crowdedEdges.count == 0 && triangles > 0; }
  /// Nothing that could mislead a ray.
  bool IsSound() const
  {
    return IsClosed() && inconsistentEdges.count + insideOut.count + selfIntersections.count + degenerateTriangles.count == 0;
  }

  /// The faults as a sentence, with the place of the first of each kind; empty when IsSound().
  std::string Faults() const;
};

struct SurfaceCheckParameters {
  bool selfIntersections = true;
  int mostPlaces = 100;
};

ParameterList Describe(SurfaceCheckParameters& p);

/// Looks for faults; changes nothing. Cost: a sort of the edges; for self-intersections, a box tree and about 2 us per triangle.
/// Two triangles cross when an edge of one goes through the other by more than the rounding of doubles.
/// \throws Error(BadInput) when a triangle names a point that is not there, Error(InvalidParameter), Error(Cancelled).
SurfaceReport CheckSurface(const TriangleSurface& surface, const SurfaceCheckParameters& parameters = {},
                           const Progress& progress = {});

struct SurfaceMendParameters {
  double weldMm = 1e-3;
  bool orient = true;
  bool closeHoles = false;
};

ParameterList Describe(SurfaceMendParameters& p);

/// What was mended.
struct SurfaceMending {
  std::int64_t weldedPoints = 0;     ///< that went into another, or were used by no triangle
  std::int64_t droppedTriangles = 0; ///< two corners alike, or one that is not finite
  std::int64_t turnedTriangles = 0;
  std::int64_t closedHoles = 0;
};

/// Mends what files do to surfaces: they repeat points at seams, turn triangles, and leave holes where organs were cut.
/// Self-intersections stay. \throws as CheckSurface.
SurfaceMending MendSurface(TriangleSurface& surface, const SurfaceMendParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
