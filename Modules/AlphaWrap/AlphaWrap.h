// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include "Core/Base/Parameters.h"
#include "Filters/Tissue/SurfaceCheck.h"

namespace echorama {

struct AlphaWrapParameters {
  double alphaMm = 10.0;
  double offsetMm = 0.5;
};
ParameterList Describe(AlphaWrapParameters& p);

/// A closed surface about whatever the triangles are: torn, doubled, in pieces that cross (Portaneri et al., "Alpha wrapping with
/// an offset", ACM TOG 2022, by CGAL). No ball of radius AlphaMm that comes from outside goes through it; it encloses all
/// triangles, and its points lie OffsetMm from the nearest of them. So the body grows by OffsetMm.
///
/// \throws Error(InvalidParameter); Error(BadInput) when there is no triangle, a point is not finite, or a triangle names a point
/// that is not there
TriangleSurface AlphaWrap(const TriangleSurface& surface, const AlphaWrapParameters& parameters = {});

} // namespace echorama
