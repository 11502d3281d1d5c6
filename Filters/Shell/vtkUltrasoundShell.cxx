// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundShell.h"

#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Filters/Shell/PrintFile.h"
#include "Filters/Shell/Shell.h"
#include "Filters/Shell/ShellMarks.h"
#include "Filters/Shell/ShellRig.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkClipPolyData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPlane.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkQuadricDecimation.h"
#include "vtkTriangleFilter.h"
#include "vtkUltrasoundTriangles.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <vector>

using echorama::Error;
using echorama::Shell;
using echorama::TriangleSurface;
using Eigen::Vector3d;

vtkStandardNewMacro(vtkUltrasoundShell);

vtkUltrasoundParametersMacro(vtkUltrasoundShell);

struct vtkUltrasoundShell::Settings {
  echorama::ShellParameters shell;
  enum class Places { Proxy, Dome };

  Places places = Places::Proxy;
  int points = 350;
  bool fitPrinter = true, isRig = false;
  echorama::RigParameters rig;
  std::vector<echorama::PrintedBody> prints; // in the body's frame
  echorama::Pose bodyToShell = echorama::Pose::Identity();

  void Keep(const std::vector<echorama::PrintedPart>& parts, const echorama::Pose& pose, vtkPolyData* all);
};

namespace {

// All of them, told apart by the cells' array.
void PutPrints(const std::vector<echorama::PrintedBody>& prints, vtkPolyData* data)
{
  TriangleSurface all;
  vtkNew<vtkIntArray> numbers;
  numbers->SetName("Print");
  for (std::size_t n = 0; n < prints.size(); ++n) {
    const auto first = static_cast<std::uint32_t>(all.points.size());
    const TriangleSurface& surface = prints[n].surface;
    all.points.insert(all.points.end(), surface.points.begin(), surface.points.end());
    for (const auto& [a, b, c] : surface.triangles) {
      all.triangles.push_back({a + first, b + first, c + first});
      numbers->InsertNextValue(static_cast<int>(n));
    }
  }
  echorama::SetTriangles(data, all);
  data->GetCellData()->AddArray(numbers);
}

void PutField(vtkPolyData* data, const char* name, const Vector3d& values)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(3);
  array->InsertNextTuple(values.data());
  data->GetFieldData()->AddArray(array);
}

// Both domes and their marks; returns the page that shows where these are.
std::string PutRig(const echorama::CalibrationRig& rig, vtkInformationVector* outputs)
{
  vtkNew<vtkPoints> places;
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkIntArray> numbers, domes;
  numbers->SetName("Mark");
  domes->SetName("Dome");
  vtkNew<vtkDoubleArray> seen;
  seen->SetName("InCamera");
  seen->SetNumberOfComponents(3);
  vtkNew<vtkFloatArray> normals;
  normals->SetName("Normals");
  normals->SetNumberOfComponents(3);
  std::vector<Vector3d> ofLarge;
  for (std::size_t which = 0; which < rig.domes.size(); ++which) {
    const auto& dome = rig.domes[which];
    vtkPolyData* data = vtkPolyData::GetData(outputs, static_cast<int>(which));
    echorama::SetTriangles(data, dome.part.surface);
    PutField(data, "CameraPosition", rig.bodyToCamera.inverse().translation());
    PutField(data, "CameraDirection", rig.bodyToCamera.linear().transpose() * Vector3d::UnitZ());
    for (std::size_t i = 0; i < dome.marks.size(); ++i) {
      const vtkIdType at = places->InsertNextPoint(dome.marks[i].place.data());
      vertices->InsertNextCell(1, &at);
      numbers->InsertNextValue(static_cast<int>(i) + 1);
      domes->InsertNextValue(static_cast<int>(which));
      seen->InsertNextTuple((rig.bodyToCamera * dome.marks[i].place).eval().data());
      normals->InsertNextTuple(dome.marks[i].normal.data());
      if (which == 0) {
        ofLarge.push_back(rig.bodyToCamera * dome.marks[i].place);
      }
    }
  }
  vtkPolyData* points = vtkPolyData::GetData(outputs, 2);
  points->SetPoints(places);
  points->SetVerts(vertices);
  for (vtkDataArray* array :
       {static_cast<vtkDataArray*>(numbers), static_cast<vtkDataArray*>(domes), static_cast<vtkDataArray*>(seen)}) {
    points->GetPointData()->AddArray(array);
  }
  points->GetPointData()->SetNormals(normals);
  return echorama::MarksGuide(ofLarge, Vector3d::UnitZ());
}

// The body above a plane with about that many points.
TriangleSurface Simplified(const TriangleSurface& body, const Vector3d& origin, const Vector3d& up, int wanted)
{
  vtkNew<vtkPolyData> data;
  echorama::SetTriangles(data, body);
  vtkNew<vtkPlane> plane;
  plane->SetOrigin(origin.data());
  plane->SetNormal(up.data());
  vtkNew<vtkClipPolyData> clip;
  clip->SetInputData(data);
  clip->SetClipFunction(plane);
  vtkNew<vtkTriangleFilter> cut; // the clip leaves polygons of four corners
  cut->SetInputConnection(clip->GetOutputPort());
  cut->Update();
  vtkNew<vtkQuadricDecimation> decimation;
  decimation->SetInputConnection(cut->GetOutputPort());
  // Triangles are asked for, and points are wanted: a little more than half as many.
  const auto triangles = static_cast<double>(std::max<vtkIdType>(cut->GetOutput()->GetNumberOfCells(), 1));
  double target = 2.0 * wanted;
  for (int round = 0; round < 4; ++round) {
    decimation->SetTargetReduction(std::clamp(1.0 - target / triangles, 0.0, 0.9999));
    decimation->Update();
    const auto points = static_cast<double>(std::max<vtkIdType>(decimation->GetOutput()->GetNumberOfPoints(), 1));
    if (std::abs(points - wanted) <= 0.02 * wanted || target >= triangles) {
      break;
    }
    target *= wanted / points;
  }
  TriangleSurface proxy;
  echorama::AddTriangles(proxy, decimation->GetOutput());
  return proxy;
}

} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundShell::Parameters()
{
  using echorama::Parameter;
  Settings& v = *this->Values;
  return echorama::Join(
      {Describe(v.shell),
       {Parameter("FitPrinter", v.fitPrinter, "Whether parts that do not fit the printer are refused."),
        Parameter("Places", echorama::Choice(v.places, {"proxy", "dome"}),
                  "Where calibration points lie when none are given: at the points of the simplified body, or in directions from "
                  "the middle of the opening that are three times denser at the horizon than at the top."),
        Parameter("Points", v.points, {0, 10000}, "",
                  "About how many calibration points there are when none are given. 0: none."),
        Parameter("Rig", v.isRig,
                  "Whether two domes with marks are made instead, which stand on the same base: with them a lens is calibrated "
                  "once, for all shells of that base.")},
       Describe(v.rig)});
}

//----------------------------------------------------------------------------
void vtkUltrasoundShell::Settings::Keep(const std::vector<echorama::PrintedPart>& parts, const echorama::Pose& pose,
                                        vtkPolyData* all)
{
  for (const echorama::PrintedPart& printed : parts) {
    this->prints.push_back({printed.name, printed.part.surface});
  }
  this->bodyToShell = pose;
  PutPrints(this->prints, all);
}

//----------------------------------------------------------------------------
vtkUltrasoundShell::vtkUltrasoundShell() : Values(new Settings), LeastThickness(vtkMath::Nan()), MostThickness(vtkMath::Nan())
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(5);
}

//----------------------------------------------------------------------------
vtkUltrasoundShell::~vtkUltrasoundShell() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundShell::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkPolyData" : "vtkPointSet");
  info->Set(INPUT_IS_OPTIONAL(), port);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundShell::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Report.clear();
  this->Guide.clear();
  this->LeastThickness = this->MostThickness = vtkMath::Nan();
  Settings& v = *this->Values;
  v.prints.clear();
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs, &v](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    v.shell.Check();
    TriangleSurface triangles;
    echorama::AddTriangles(triangles, vtkPolyData::GetData(inputs[0]));
    const echorama::BodySurface body(std::move(triangles), progress.Part(0.0, 0.1));
    const Vector3d up = v.shell.up.normalized();
    echorama::ShellParameters parameters = v.shell;
    parameters.cutToFit = parameters.cutToFit && v.fitPrinter;
    if (v.isRig) {
      const auto rig = echorama::MakeRig(body, parameters, v.rig, v.points, progress.Part(0.1, 1.0));
      if (v.fitPrinter) {
        CheckPrinter(rig.Prints(), parameters);
      }
      this->Report = rig.Text();
      this->Guide = PutRig(rig, outputs);
      v.Keep(rig.Prints(), rig.bodyToShell, vtkPolyData::GetData(outputs, 4));
      return;
    }
    const echorama::Pose shellToBody = BodyToShell(v.shell, body.Surface()).inverse();
    const Vector3d lowest = shellToBody * Vector3d(0.0, 0.0, LowestMark(v.shell));

    std::vector<Vector3d> marks;
    TriangleSurface proxy;
    std::vector<std::size_t> order; // of the proxy's points
    vtkPointSet* given = vtkPointSet::GetData(inputs[1]);
    if (given) {
      for (vtkIdType i = 0; i < given->GetNumberOfPoints(); ++i) {
        marks.emplace_back(given->GetPoint(i));
      }
    } else if (v.points > 0 && v.places == Settings::Places::Dome) {
      const Vector3d middle = shellToBody.translation();
      std::vector<Vector3d> places;
      for (const Vector3d& direction : echorama::DomeMarks(v.points, 1.0)) {
        const Vector3d ray = shellToBody.linear() * direction;
        if (const auto distance = body.Along(middle, ray)) {
          places.push_back(middle + *distance * ray);
        }
      }
      for (const std::size_t which : echorama::OrderMarks(places, up)) {
        marks.push_back(places[which]);
      }
    } else if (v.points > 0) {
      proxy = Simplified(body.Surface(), lowest + 1e-3 * up, up, v.points);
      std::vector<Vector3d> places;
      for (const Eigen::Vector3f& point : proxy.points) {
        places.push_back(body.PlaceOf(point.cast<double>()).nearest);
      }
      order = echorama::OrderMarks(places, up);
      for (const std::size_t which : order) {
        marks.push_back(places[which]);
      }
    }
    progress(0.2);
    const Shell shell = echorama::MakeShell(body, parameters, marks, progress.Part(0.2, 0.97));
    if (v.fitPrinter) {
      CheckPrinter(shell.Prints(), parameters);
    }
    this->Report = shell.Text();

    echorama::SetTriangles(vtkPolyData::GetData(outputs, 0), shell.skin.surface);
    echorama::SetTriangles(vtkPolyData::GetData(outputs, 1), shell.base.surface);
    PutField(vtkPolyData::GetData(outputs, 0), "CameraPosition", shell.camera);
    PutField(vtkPolyData::GetData(outputs, 0), "CameraDirection", up);
    if (shell.markerId) {
      vtkNew<vtkIntArray> marker;
      marker->SetName("MarkerId");
      marker->InsertNextValue(static_cast<int>(*shell.markerId));
      vtkPolyData::GetData(outputs, 0)->GetFieldData()->AddArray(marker);
    }
    vtkPolyData* points = vtkPolyData::GetData(outputs, 2);
    vtkNew<vtkPoints> places;
    vtkNew<vtkCellArray> vertices;
    vtkNew<vtkIntArray> numbers;
    numbers->SetName("Mark");
    vtkNew<vtkFloatArray> normals;
    normals->SetName("Normals");
    normals->SetNumberOfComponents(3);
    std::vector<Vector3d> onSkin;
    for (const echorama::ShellMark& mark : shell.marks) {
      const vtkIdType at = places->InsertNextPoint(mark.place.data());
      vertices->InsertNextCell(1, &at);
      numbers->InsertNextValue(static_cast<int>(at) + 1);
      normals->InsertNextTuple(mark.normal.data());
      onSkin.push_back(mark.place);
    }
    points->SetPoints(places);
    points->SetVerts(vertices);
    points->GetPointData()->AddArray(numbers);
    points->GetPointData()->SetNormals(normals);
    if (!onSkin.empty()) {
      this->Guide = echorama::MarksGuide(onSkin, up);
      this->Report += echorama::Format("\ncalibration points: %zu", onSkin.size());
    }
    if (!order.empty() && !onSkin.empty()) {
      vtkPolyData* simplified = vtkPolyData::GetData(outputs, 3);
      vtkNew<vtkIntArray> marksOfPoints; // 0: too near to the opening
      marksOfPoints->SetName("Mark");
      marksOfPoints->SetNumberOfValues(static_cast<vtkIdType>(order.size()));
      marksOfPoints->FillValue(0);
      for (std::size_t i = 0; i < shell.left.size(); ++i) {
        const std::size_t which = order[shell.left[i]];
        marksOfPoints->SetValue(static_cast<vtkIdType>(which), static_cast<int>(i) + 1);
        proxy.points[which] = onSkin[i].cast<float>();
      }
      echorama::SetTriangles(simplified, proxy);
      simplified->GetPointData()->AddArray(marksOfPoints);
      const auto fit = echorama::MeasureProxy(body.Surface(), proxy, onSkin, up, up.dot(lowest), progress.Part(0.97, 1.0));
      this->Report +=
          echorama::Format("; proxy %.2f mm from the body in the mean, %.2f mm at most; no place further than %.1f mm from a "
                           "point, which is at (%.1f, %.1f, %.1f)",
                           fit.meanMm, fit.mostMm, fit.farthestMarkMm, fit.farthest.x(), fit.farthest.y(), fit.farthest.z());
    }
    this->LeastThickness = shell.thickness.leastMm;
    this->MostThickness = shell.thickness.mostMm;
    v.Keep(shell.Prints(), shell.bodyToShell, vtkPolyData::GetData(outputs, 4));
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundShell::GetNumberOfPrints() const
{
  return static_cast<int>(this->Values->prints.size());
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundShell::GetPrintName(int print) const
{
  return print >= 0 && print < this->GetNumberOfPrints() ? this->Values->prints[static_cast<std::size_t>(print)].name.c_str()
                                                         : "";
}

//----------------------------------------------------------------------------
bool vtkUltrasoundShell::GetPrint(int print, vtkPolyData* data)
{
  if (!data || print < 0 || print >= this->GetNumberOfPrints()) {
    vtkErrorMacro("there is no print " << print << "; there are " << this->GetNumberOfPrints());
    return false;
  }
  data->Initialize();
  echorama::SetTriangles(data, this->Values->prints[static_cast<std::size_t>(print)].surface);
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundShell::Write3mf(const char* path)
{
  try {
    if (!path || !*path) {
      throw Error(Error::Kind::FileSystem, "Write3mf needs the name of a file");
    }
    std::vector<echorama::PrintedBody> bodies = this->Values->prints;
    for (echorama::PrintedBody& body : bodies) { // they stand on the plate
      for (Eigen::Vector3f& point : body.surface.points) {
        point = (this->Values->bodyToShell * point.cast<double>()).cast<float>();
      }
    }
    echorama::WritePrintFile(path, bodies);
    return true;
  } catch (const Error& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundShell::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "LeastThickness: " << this->LeastThickness << "\n";
  os << indent << "MostThickness: " << this->MostThickness << "\n";
  os << indent << "Report: " << this->Report << "\n";
}
