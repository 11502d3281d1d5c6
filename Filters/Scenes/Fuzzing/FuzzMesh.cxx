// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a PLY, STL, glTF or VTK file, or, where they begin as none of these, as an OBJ file. No corner of what is accepted
// lies beyond the points. VTK's polygons are read with VTK, which is not ours.
#include "Filters/Scenes/MeshFile.h"
#include "Filters/Scenes/vtkUltrasoundVtpFile.h"
#include "Filters/Tissue/StlFile.h"
#include "Filters/Tissue/vtkUltrasoundTriangles.h"
#include "Testing/Fuzzing.h"
#include <sanitizer/lsan_interface.h>
#include <string_view>
#include <vtkLogger.h>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); // its texts are made all the same: they can end it, too
  const MemoryFile file(data, size);
  return Survives([&] {
    const std::string_view content(reinterpret_cast<const char*>(data), size);
    if (content.substr(0, 5) == "solid" || content.substr(0, 6) == "binary") {
      const TriangleSurface surface = SurfaceOfStl(file.Path(), content);
      for (const auto& triangle : surface.triangles)
        for (const std::uint32_t corner : triangle)
          if (corner >= surface.points.size())
            std::abort(); // a finding
      return;
    }
    if (content.substr(0, 8) == "<VTKFile") {
      const __lsan::ScopedDisabler leaks; // of the array that VTK is reading when its data turn out to be damaged
      TriangleSurface surface;
      AddTriangles(surface, ReadVtp(file.Path()));
      return;
    }
    const bool isPly = content.substr(0, 3) == "ply", isGltf = content.substr(0, 4) == "glTF" || content.substr(0, 1) == "{";
    const PolygonMesh mesh = isPly ? ReadPly(file.Path()) : isGltf ? ReadGltf(file.Path()) : ReadObj(file.Path());
    std::size_t begin = 0;
    for (const std::size_t end : mesh.ends) {
      if (end < begin + 3 || end > mesh.corners.size())
        std::abort();
      begin = end;
    }
    for (const std::uint32_t corner : mesh.corners)
      if (corner >= mesh.points.size())
        std::abort();
  });
}
