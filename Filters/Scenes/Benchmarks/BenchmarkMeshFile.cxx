// SPDX-License-Identifier: BSD-3-Clause
// Reading a mesh that VTK wrote, with ours and VTK's reader in turn. Error: the largest distance between a corner of a triangle
// that was read and that which was written.
#include "Filters/Scenes/MeshFile.h"
#include "Filters/Tissue/StlFile.h"
#include "Testing/Benchmark.h"
#ifdef ECHORAMA_WITH_VTK
#include "vtkCellArray.h"
#include "vtkCompositeDataIterator.h"
#include "vtkGLTFReader.h"
#include "vtkGLTFWriter.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkOBJReader.h"
#include "vtkOBJWriter.h"
#include "vtkPLYReader.h"
#include "vtkPLYWriter.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkSphereSource.h"
#include "vtkSTLReader.h"
#include "vtkSTLWriter.h"
#include <algorithm>
#include <filesystem>
#include <limits>
#include <unistd.h>

using namespace echorama;
using namespace echorama::benchmark;

namespace {

using Corners = std::vector<Eigen::Vector3d>;

Corners CornersOf(vtkPolyData* data)
{
  Corners corners;
  vtkIdType count;
  const vtkIdType* ids;
  for (vtkIdType i = 0; data && i < data->GetNumberOfPolys(); ++i) {
    data->GetPolys()->GetCellAtId(i, count, ids);
    for (vtkIdType n = 0; n < count; ++n)
      corners.emplace_back(data->GetPoint(ids[n]));
  }
  return corners;
}

Corners CornersOf(const PolygonMesh& mesh)
{
  Corners corners;
  for (const std::uint32_t corner : mesh.corners)
    corners.emplace_back(mesh.points[corner].cast<double>());
  return corners;
}

Corners CornersOf(const TriangleSurface& surface)
{
  Corners corners;
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle)
      corners.emplace_back(surface.points[corner].cast<double>());
  return corners;
}

double Off(const Corners& read, const Corners& written)
{
  double off = read.size() == written.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(read.size(), written.size()); ++i)
    off = std::max(off, (read[i] - written[i]).norm());
  return off;
}

vtkPolyData* FirstOf(vtkDataObject* data)
{
  auto* parts = vtkMultiBlockDataSet::SafeDownCast(data);
  if (!parts)
    return vtkPolyData::SafeDownCast(data);
  const auto leaf = vtk::TakeSmartPointer(parts->NewIterator());
  leaf->InitTraversal();
  return leaf->IsDoneWithTraversal() ? nullptr : vtkPolyData::SafeDownCast(leaf->GetCurrentDataObject());
}

// A file of one format, written by VTK.
template <class Reader, class Writer, class Decode>
void Case(const std::string& name, const std::string& path, Writer* writer, const Corners& written, const Decode& decode)
{
  writer->SetFileName(path.c_str());
  writer->Write();
  vtkSmartPointer<Reader> reader;
  decltype(decode(path)) mesh;
  const auto [seconds, vtkSeconds] = Duel([&] { mesh = decode(path); },
                                          [&] {
                                            reader =
                                                vtkSmartPointer<Reader>::New(); // a new one each time: some keep what they read
                                            reader->SetFileName(path.c_str());
                                            reader->Update();
                                          });
  const double megabytes = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  Report("mesh_file", name, "ours", seconds, Off(CornersOf(mesh), written), "mm", {{"file_mb", megabytes}});
  Report("mesh_file", name, "VTK", vtkSeconds, Off(CornersOf(FirstOf(reader->GetOutputDataObject(0))), written), "mm");
}

} // namespace

int main()
{
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("echorama-meshes-" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const vtkNew<vtkSphereSource> sphere;
  sphere->SetRadius(100.0);
  sphere->SetThetaResolution(Smoke() ? 20 : 500);
  sphere->SetPhiResolution(Smoke() ? 20 : 500);
  sphere->Update();
  vtkPolyData* data = sphere->GetOutput();
  const Corners written = CornersOf(data);
  const std::string size = std::to_string(written.size() / 3) + " triangles, ";
  const vtkNew<vtkPLYWriter> binary, text;
  const vtkNew<vtkSTLWriter> stl, stlText;
  const vtkNew<vtkOBJWriter> obj;
  const vtkNew<vtkGLTFWriter> gltf;
  binary->SetInputData(data);
  text->SetInputData(data);
  text->SetFileTypeToASCII();
  obj->SetInputData(data);
  stl->SetInputData(data);
  stl->SetFileTypeToBinary();
  stlText->SetInputData(data);
  const vtkNew<vtkMultiBlockDataSet> scene, actor;
  actor->SetBlock(0, data);
  scene->SetBlock(0, actor);
  gltf->SetInputData(scene);
  gltf->InlineDataOn();
  Case<vtkPLYReader>(size + "PLY, binary", (folder / "b.ply").string(), binary.Get(), written, ReadPly);
  Case<vtkPLYReader>(size + "PLY, text", (folder / "t.ply").string(), text.Get(), written, ReadPly);
  const auto readStl = [](const std::string& path) { return SurfaceOfStl(path, ReadMeshContent(path)); };
  Case<vtkSTLReader>(size + "STL, binary", (folder / "b.stl").string(), stl.Get(), written, readStl);
  Case<vtkSTLReader>(size + "STL, text", (folder / "t.stl").string(), stlText.Get(), written, readStl);
  Case<vtkOBJReader>(size + "OBJ", (folder / "o.obj").string(), obj.Get(), written, ReadObj);
  Case<vtkGLTFReader>(size + "glTF, data as text", (folder / "g.gltf").string(), gltf.Get(), written, ReadGltf);
  std::filesystem::remove_all(folder);
  return 0;
}
#else
int main()
{
  std::cerr << "mesh_file needs VTK, whose files it reads\n";
  return 77;
}
#endif
