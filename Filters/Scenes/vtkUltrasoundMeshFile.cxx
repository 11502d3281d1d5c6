// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundMeshFile.h"

#include "Core/Base/Error.h"
#include "Core/Base/VtkMessage.h"
#include "Filters/Tissue/StlFile.h"
#include "MeshFile.h"
#include "Readers/ImageHeader.h"
#include "Readers/VtkXmlFile.h"
#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkDataArraySelection.h"
#include "vtkExecutive.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundTriangles.h"
#include "vtkXMLPolyDataReader.h"

#include <algorithm>
#include <filesystem>
#include <vector>

using echorama::Error;

namespace {

// What the reader complains of becomes the reason of an error.
vtkSmartPointer<vtkPolyData> ReadVtp(const std::string& path)
{
  std::vector<std::string> complaints;
  vtkNew<vtkCallbackCommand> listener;
  listener->SetClientData(&complaints);
  listener->SetCallback([](vtkObject*, unsigned long, void* list, void* text) {
    static_cast<std::vector<std::string>*>(list)->push_back(
        echorama::SentenceOfVtkMessage(text ? static_cast<const char*>(text) : ""));
  });
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->AddObserver(vtkCommand::ErrorEvent, listener);
  reader->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, listener);
  reader->SetParserErrorObserver(listener); // an object of its own
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  reader->GetPointDataArraySelection()->DisableAllArrays(); // nobody needs them, and they may be damaged
  reader->GetCellDataArraySelection()->DisableAllArrays();
  reader->Update();
  const std::string problem = echorama::ReasonAmong(complaints);
  if (!problem.empty()) {
    throw Error(Error::Kind::BadFile, path + ": " + problem);
  }
  return reader->GetOutput();
}

// What VTK's filters believe of cells.
void CheckCells(vtkCellArray* cells, vtkIdType points, const std::string& path)
{
  bool good = cells->IsValid();
  for (vtkIdType i = 0; good && i < cells->GetNumberOfCells(); ++i) {
    good = cells->GetCellSize(i) > 2;
  }
  if (good && cells->GetNumberOfConnectivityIds() > 0) {
    double range[2];
    cells->GetConnectivityArray()->GetRange(range);
    good = range[0] >= 0.0 && range[1] < static_cast<double>(points);
  }
  if (!good) {
    throw Error(Error::Kind::BadFile,
                path + ": its polygons are damaged: they have fewer than three corners, or name points that are not there");
  }
}

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
    CheckVtkXmlFile(path, "PolyData");
    data = ReadVtp(path);
    CheckCells(data->GetPolys(), data->GetNumberOfPoints(), path);
    CheckCells(data->GetStrips(), data->GetNumberOfPoints(), path);
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
