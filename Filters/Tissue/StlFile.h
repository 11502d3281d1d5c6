// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include <string_view>

namespace echorama {

/// The triangles of an STL file, which repeats the points of each: those with the same coordinates are one again, in the order
/// in which they first come. Binary is what has as many bytes as it needs for the triangles that it counts, or does not begin
/// with "solid"; else it is text.
/// \param bytes of the file \param path names it in errors
/// \throws Error(BadFile) when it is truncated or damaged
TriangleSurface SurfaceOfStl(const std::string& path, std::string_view bytes);

} // namespace echorama
