// SPDX-License-Identifier: GPL-3.0-or-later
// echorama-alpha-wrap: a torn surface in, a closed one out.
#include "AlphaWrap.h"
#include "Core/Base/Error.h"
#include <CLI/CLI.hpp>
#include <iostream>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLWriter.h>
#include <vtkUltrasoundMeshFile.h>

using namespace echorama;

namespace {

void WriteStl(const TriangleSurface& surface, const std::string& path)
{
  vtkNew<vtkPoints> points;
  for (const Eigen::Vector3f& point : surface.points)
    points->InsertNextPoint(point.data());
  vtkNew<vtkCellArray> triangles;
  for (const auto& [a, b, c] : surface.triangles) {
    const vtkIdType corners[3] = {a, b, c};
    triangles->InsertNextCell(3, corners);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(triangles);
  vtkNew<vtkSTLWriter> writer;
  writer->SetInputData(data);
  writer->SetFileName(path.c_str());
  writer->SetFileTypeToBinary();
  if (!writer->Write() || writer->GetErrorCode() != 0)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written");
}

} // namespace

int main(int argc, char* argv[])
{
  CLI::App program(
      "Close a torn surface by CGAL's alpha wrapping. This program is under the GPL, version 3 or later; the rest of "
      "Echorama is not.");
  std::string input, output;
  AlphaWrapParameters parameters;
  program.add_option("surface", input, "A surface in mm (.stl, .ply, .obj, .vtp, .glb), with holes or self-intersections")
      ->required();
  program.add_option("-o,--output", output, "The closed surface (.stl)")->required();
  program.add_option("--alpha-mm", parameters.alphaMm, "Holes narrower than a ball of this radius are closed")
      ->capture_default_str();
  program.add_option("--offset-mm", parameters.offsetMm, "How far outside the surface the closed one lies")
      ->capture_default_str();
  CLI11_PARSE(program, argc, argv);
  try {
    const TriangleSurface closed = AlphaWrap(ReadMesh(input), parameters);
    const SurfaceReport report = CheckSurface(closed);
    if (!report.IsSound())
      throw Error(Error::Kind::NotPossible, "the wrap did not come out sound: " + report.Faults() + "; try another --alpha-mm");
    WriteStl(closed, output);
    std::cout << report.triangles << " triangles, " << report.components << (report.components == 1 ? " piece, " : " pieces, ")
              << report.volumeMm3 / 1000.0 << " cm^3: " << output << "\n";
  } catch (const std::exception& error) {
    std::cerr << "echorama-alpha-wrap: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
