// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include <string_view>

namespace echorama {

/// The triangles of an STL file, which repeats the points of each: those with the same coordinates are one again, in the order
/// in which they first come, and triangles with two corners alike are left out. Text begins with "solid"; binary files that do
/// so, too, are known by their length or a byte 0.
/// \param bytes of the file \param path names it in errors
/// \throws Error(BadFile) when it is truncated or damaged
TriangleSurface SurfaceOfStl(const std::string& path, std::string_view bytes);

/// A surface as binary STL.
std::string StlOf(const TriangleSurface& surface);

} // namespace echorama
