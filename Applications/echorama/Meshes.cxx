// SPDX-License-Identifier: BSD-3-Clause
#include "Meshes.h"
#include "Core/Base/Error.h"
#include "Session.h"
#include <algorithm>
#include <filesystem>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkGLTFReader.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkSTLReader.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

namespace echorama {
namespace {

void Append(TriangleSurface& surface, vtkPolyData* part)
{
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputData(part);
  triangles->PassLinesOff();
  triangles->PassVertsOff();
  triangles->Update();
  vtkPolyData* mesh = triangles->GetOutput();
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i)
    surface.points.push_back(Eigen::Vector3d(mesh->GetPoint(i)).cast<float>());
  vtkIdType count = 0;
  const vtkIdType* ids = nullptr;
  for (auto cells = vtk::TakeSmartPointer(mesh->GetPolys()->NewIterator()); !cells->IsDoneWithTraversal();
       cells->GoToNextCell()) {
    cells->GetCurrentCell(count, ids);
    if (count == 3)
      surface.triangles.push_back({first + static_cast<std::uint32_t>(ids[0]), first + static_cast<std::uint32_t>(ids[1]),
                                   first + static_cast<std::uint32_t>(ids[2])});
  }
}

template <class Reader>
vtkSmartPointer<vtkDataObject> Read(const std::string& path)
{
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

} // namespace

TriangleSurface LoadMesh(const std::string& path)
{
  if (!std::filesystem::is_regular_file(path))
    throw Error(Error::Kind::FileSystem, path + ": there is no such file");
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  Session::TakeReportedError();
  vtkSmartPointer<vtkDataObject> data;
  if (extension == ".glb" || extension == ".gltf")
    data = Read<vtkGLTFReader>(path);
  else if (extension == ".ply")
    data = Read<vtkPLYReader>(path);
  else if (extension == ".stl")
    data = Read<vtkSTLReader>(path);
  else if (extension == ".obj")
    data = Read<vtkOBJReader>(path);
  else if (extension == ".vtp")
    data = Read<vtkXMLPolyDataReader>(path);
  else
    throw Error(Error::Kind::BadFile, path + ": its extension is none of a mesh (.glb, .gltf, .ply, .stl, .obj, .vtp)");
  const std::string problem = Session::TakeReportedError();
  if (!problem.empty())
    throw Error(Error::Kind::BadFile, path + ": " + problem);

  TriangleSurface surface;
  if (auto* parts = vtkCompositeDataSet::SafeDownCast(data)) {
    const auto leaf = vtk::TakeSmartPointer(parts->NewIterator());
    for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem())
      if (auto* part = vtkPolyData::SafeDownCast(leaf->GetCurrentDataObject()))
        Append(surface, part);
  } else if (auto* part = vtkPolyData::SafeDownCast(data)) {
    Append(surface, part);
  }
  if (surface.triangles.empty())
    throw Error(Error::Kind::BadFile, path + ": there are no triangles in it");
  return surface;
}

} // namespace echorama
