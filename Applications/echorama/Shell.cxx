// SPDX-License-Identifier: BSD-3-Clause
// echorama shell: a body's surface as a printed skin for the optical surface tracker, with its base and its calibration points.
#include "Commands.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <algorithm>
#include <memory>
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLWriter.h>
#include <vtkUltrasoundMeshFile.h>
#include <vtkUltrasoundShell.h>

namespace echorama {
namespace {

struct ShellOptions {
  std::string body, folder;
};

vtkSmartPointer<vtkPolyData> DataOf(const TriangleSurface& surface)
{
  vtkNew<vtkPoints> points;
  for (const Eigen::Vector3f& point : surface.points)
    points->InsertNextPoint(point.data());
  vtkNew<vtkCellArray> triangles;
  for (const auto& triangle : surface.triangles) {
    const vtkIdType corners[3] = {triangle[0], triangle[1], triangle[2]};
    triangles->InsertNextCell(3, corners);
  }
  const auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(triangles);
  return data;
}

void MakeShellFiles(Session& session, const ShellOptions& options, vtkUltrasoundShell* filter)
{
  TriangleSurface surface;
  session.Time("read", [&] { surface = ReadMesh(options.body); });
  filter->SetInputData(DataOf(surface));
  try {
    session.Update(filter, "make", options.body);
  } catch (const Error& error) { // the filter knows no files
    if (error.GetKind() == Error::Kind::Cancelled)
      throw;
    throw Error(error.GetKind(), options.body + ": " + error.what());
  }
  OutputFolder folder(options.folder, {options.body});
  session.ShowAs(folder.StageFolder(), options.folder);
  for (int print = 0; print < filter->GetNumberOfPrints(); ++print) {
    std::string name = filter->GetPrintName(print); // "skin", or "skin 2"
    const std::string part = name.substr(0, name.find(' '));
    std::replace(name.begin(), name.end(), ' ', '-');
    name += ".stl";
    vtkNew<vtkPolyData> mesh;
    filter->GetPrint(print, mesh);
    vtkNew<vtkSTLWriter> writer;
    writer->SetInputData(mesh);
    writer->SetFileName(folder.Stage(name).c_str());
    writer->SetFileTypeToBinary();
    session.Watch(writer, "write", name, [&] { writer->Write(); });
    if (part + ".stl" == name)
      session.result[part] = name;
    else
      session.result[part].push_back(name);
  }
  const std::string all = filter->GetRig() ? "rig.3mf" : "shell.3mf", stagedAll = folder.Stage(all);
  session.Watch(filter, "write", all, [&] { filter->Write3mf(stagedAll.c_str()); });
  session.result["all"] = all;
  vtkPolyData* marks = filter->GetOutput(2);
  const auto writePoints = [&](const std::string& name, const auto& placeOf, vtkIdType first, vtkIdType end) {
    std::string table = "label,x,y,z\n";
    for (vtkIdType i = first; i < end; ++i) {
      const double* p = placeOf(i);
      table += std::to_string(i - first + 1) + "," + NumberText(p[0]) + "," + NumberText(p[1]) + "," + NumberText(p[2]) + "\n";
    }
    WriteTextFile(folder.Stage(name), table);
  };
  const vtkIdType count = marks->GetNumberOfPoints();
  if (filter->GetRig()) { // the large dome's, then as many of the small one's, as the camera has them
    vtkDataArray* seen = marks->GetPointData()->GetArray("InCamera");
    writePoints(
        "points-large.csv", [seen](vtkIdType i) { return seen->GetTuple(i); }, 0, count / 2);
    writePoints(
        "points-small.csv", [seen](vtkIdType i) { return seen->GetTuple(i); }, count / 2, count);
    session.result["points"] = {"points-large.csv", "points-small.csv"};
  } else if (count > 0) {
    writePoints(
        "points.csv", [marks](vtkIdType i) { return marks->GetPoint(i); }, 0, count);
    session.result["points"] = "points.csv";
  }
  if (count > 0) {
    WriteTextFile(folder.Stage("points.html"), filter->GetGuide());
    session.result["guide"] = "points.html";
  }
  if (!filter->GetRig())
    session.result["wall_mm"] = {filter->GetLeastThickness(), filter->GetMostThickness()};
  double camera[3];
  filter->GetOutput(0)->GetFieldData()->GetArray("CameraPosition")->GetTuple(0, camera);
  session.result["camera"] = {camera[0], camera[1], camera[2]};
  if (vtkDataArray* marker = filter->GetOutput(0)->GetFieldData()->GetArray("MarkerId"))
    session.result["marker"] = Format("%06X", static_cast<unsigned>(marker->GetTuple1(0)));
  folder.Commit();
  for (const std::string& line : LinesOf(filter->GetReport()))
    session.Say(line);
  session.Say("wrote them to " + options.folder);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ShellOptions>();
  const auto filter = vtkSmartPointer<vtkUltrasoundShell>::New();
  options->add_option("body", values->body, "A closed surface in mm (.stl, .ply, .obj, .vtp, .glb)")
      ->type_name("FILE")
      ->required();
  options->add_option("-o,--output", values->folder, "Folder for the files")->type_name("FOLDER")->required();
  AddParametersBut(options, filter, {});
  action = [values, filter](Session& session) { MakeShellFiles(session, *values, filter); };
}

} // namespace echorama
