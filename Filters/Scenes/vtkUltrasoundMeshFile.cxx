// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundMeshFile.h"

#include "Core/Base/Error.h"
#include "Filters/Tissue/StlFile.h"
#include "MeshFile.h"
#include "Readers/ImageHeader.h"
#include "vtkCellArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundTriangles.h"
#include "vtkUltrasoundVtpFile.h"

#include <filesystem>

using echorama::Error;

namespace {

vtkSmartPointer<vtkPolyData> PolyDataOf(const echorama::PolygonMesh& mesh)
{
  vtkNew<vtkPoints> points;
  for (const Eigen::Vector3f& point : mesh.points) {
    points->InsertNextPoint(point.data());
  }
  vtkNew<vtkCellArray> polygons;
  std::size_t corner = 0;
  for (const std::size_t end : mesh.ends) {
    polygons->InsertNextCell(static_cast<int>(end - corner));
    for (; corner < end; ++corner) {
      polygons->InsertCellPoint(static_cast<vtkIdType>(mesh.corners[corner]));
    }
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polygons);
  return data;
}

} // namespace

//----------------------------------------------------------------------------
echorama::TriangleSurface echorama::ReadMesh(const std::string& path)
{
  std::error_code unknown; // of a name that no file can have
  if (!std::filesystem::is_regular_file(path, unknown)) {
    throw Error(Error::Kind::FileSystem, path + ": there is no such file");
  }
  const std::string extension = LowerExtension(path);
  vtkSmartPointer<vtkPolyData> data;
  TriangleSurface surface;
  if (extension == ".glb" || extension == ".gltf") {
    data = PolyDataOf(ReadGltf(path));
  } else if (extension == ".ply") {
    data = PolyDataOf(ReadPly(path));
  } else if (extension == ".stl") {
    surface = SurfaceOfStl(path, ReadMeshContent(path));
  } else if (extension == ".obj") {
    data = PolyDataOf(ReadObj(path));
  } else if (extension == ".vtp") {
    data = ReadVtp(path);
  } else {
    throw Error(Error::Kind::BadFile, path + ": its extension is none of a mesh (.glb, .gltf, .ply, .stl, .obj, .vtp)");
  }

  if (data) {
    echorama::AddTriangles(surface, data);
  }
  if (surface.triangles.empty()) {
    throw Error(Error::Kind::BadFile, path + ": there are no triangles in it");
  }
  return surface;
}
