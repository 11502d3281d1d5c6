// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include <string>

namespace echorama {

/// The triangles of a mesh file (.glb, .gltf, .ply, .stl, .obj, .vtp), all its parts together, as they stand there. Throws Error
/// that names the file.
TriangleSurface LoadMesh(const std::string& path);

} // namespace echorama
