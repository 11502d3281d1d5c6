// SPDX-License-Identifier: BSD-3-Clause
#ifndef vtkUltrasoundMeshFile_h
#define vtkUltrasoundMeshFile_h

#include "EchoramaFiltersScenesModule.h"
#include "Filters/Tissue/SurfaceCheck.h"
#include <string>

namespace echorama {

/** The triangles of a mesh file, as they stand there. Throws Error that names the file. */
ECHORAMAFILTERSSCENES_EXPORT TriangleSurface ReadMesh(const std::string& path);

} // namespace echorama

#endif
