// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundProbeSource.h"

#include "Core/Base/Angles.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/ProbePresets.h"
#include "Core/Geometry/ProbeSettings.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include <utility>

vtkStandardNewMacro(vtkUltrasoundProbeSource);

vtkUltrasoundParametersMacro(vtkUltrasoundProbeSource);

namespace {

// The kernel's preset behind a number of the enumeration, or nullptr.
const echorama::ProbePreset* PresetOf(int preset)
{
  return preset == vtkUltrasoundProbeSource::CUSTOM ? nullptr
                                                    : &echorama::ProbePresets().at(static_cast<std::size_t>(preset) - 1);
}

vtkNew<vtkDoubleArray> NewArray(const char* name, int components, std::size_t count)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(count));
  return array;
}

void WriteMesh(const echorama::ProbeMesh& mesh, const echorama::Pose& probeToWorld, vtkPolyData* output)
{
  // In single precision the points of the face would leave it by some micrometres.
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.points.size()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Eigen::Vector3d point = probeToWorld * mesh.points[i];
    points->SetPoint(static_cast<vtkIdType>(i), point.data());
  }
  vtkNew<vtkCellArray> triangles;
  triangles->AllocateExact(static_cast<vtkIdType>(mesh.triangles.size()), 3 * static_cast<vtkIdType>(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    triangles->InsertNextCell({static_cast<vtkIdType>(a), static_cast<vtkIdType>(b), static_cast<vtkIdType>(c)});
  }
  vtkNew<vtkUnsignedCharArray> part;
  part->SetName(vtkUltrasoundProbeSource::PartName());
  part->SetNumberOfTuples(static_cast<vtkIdType>(mesh.part.size()));
  std::copy(mesh.part.begin(), mesh.part.end(), part->GetPointer(0));
  output->SetPoints(points);
  output->SetPolys(triangles);
  output->GetCellData()->AddArray(part);
}

void WriteElements(const std::vector<echorama::Pose>& poses, int elements, const echorama::Pose& probeToWorld,
                   vtkPolyData* output)
{
  using Source = vtkUltrasoundProbeSource;
  const std::size_t count = poses.size();
  const int steps = static_cast<int>(count) / elements;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(count));
  const auto direction = NewArray(Source::DirectionName(), 3, count), fan = NewArray(Source::FanName(), 1, count),
             sweep = NewArray(Source::SweepName(), 1, count), matrix = NewArray(Source::ElementToWorldName(), 16, count);
  vtkNew<vtkCellArray> vertices;
  vertices->AllocateExact(static_cast<vtkIdType>(count), static_cast<vtkIdType>(count));
  for (vtkIdType i = 0; i < static_cast<vtkIdType>(count); ++i) {
    const echorama::MatrixRows rows = (probeToWorld * poses[static_cast<std::size_t>(i)]).matrix();
    points->SetPoint(i, rows(0, 3), rows(1, 3), rows(2, 3));
    direction->SetTuple3(i, rows(0, 2), rows(1, 2), rows(2, 2));
    fan->SetValue(i, echorama::PositionOf(static_cast<int>(i) % elements, elements));
    sweep->SetValue(i, echorama::PositionOf(static_cast<int>(i) / elements, steps));
    matrix->SetTuple(i, rows.data());
    vertices->InsertNextCell({i});
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  output->GetPointData()->SetNormals(direction);
  for (vtkDoubleArray* array : {fan.Get(), sweep.Get(), matrix.Get()}) {
    output->GetPointData()->AddArray(array);
  }
}
} // namespace

//----------------------------------------------------------------------------
// The head is that of the mechanical 3D probe, in round numbers.
struct vtkUltrasoundProbeSource::Settings {
  int preset = MECHANICAL_3D;
  echorama::ProbeSettings head{70.0, 40.0, 65.0, 0.0, 0.0, 150.0};
  double fanRadius = 40.0, sweepRadius = 30.0;
  int elements = 128, sweepSteps = 128;
  echorama::ProbeHousing housing;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundProbeSource::Parameters()
{
  using echorama::Parameter;
  Settings& v = *this->Values;
  echorama::ParameterList custom = echorama::Without(Describe(v.head), {"Position", "Orientation"});
  echorama::Named(custom, "FanWidth").help = "Length of a flat array: where FanAngle is 0.";
  echorama::Named(custom, "SweepWidth").help = "How far the array moves along a line where SweepAngle is 0. 0: a single plane.";
  custom.insert(custom.begin() + 1, Parameter("FanRadius", v.fanRadius, {0, 10000}, "mm",
                                              "Radius of the array's arc; of no meaning where FanAngle is 0."));
  custom.insert(custom.begin() + 4, Parameter("SweepRadius", v.sweepRadius, {0, 10000}, "mm",
                                              "From the axis of the sweep to the face; of no meaning where SweepAngle is 0."));
  custom.push_back(Parameter("Elements", v.elements, {1, 65536}, "", "Beams across the fan."));
  custom.push_back(Parameter("SweepSteps", v.sweepSteps, {1, 65536}, "", "Planes of the sweep; a single plane has one."));
  for (Parameter& parameter : custom) {
    parameter.When("Preset", "custom");
  }
  std::vector<std::string> presets{"custom"};
  for (const echorama::ProbePreset& preset : echorama::ProbePresets()) {
    presets.push_back(preset.name);
  }
  const std::vector<std::string> head{"FanAngle", "FanWidth", "SweepAngle", "SweepWidth", "DepthMin", "DepthMax"};
  return echorama::Join({{Parameter("Preset", echorama::Choice(v.preset, std::move(presets)),
                                    "The kind of probe. Custom: the head that the following parameters describe.")},
                         std::move(custom),
                         Describe(v.housing),
                         echorama::Without(Describe(v.head), head)});
}

//----------------------------------------------------------------------------
vtkUltrasoundProbeSource::vtkUltrasoundProbeSource() : Values(new Settings)
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundProbeSource::~vtkUltrasoundProbeSource() = default;

//----------------------------------------------------------------------------
const char* vtkUltrasoundProbeSource::GetPresetSource()
{
  const echorama::ProbePreset* preset = PresetOf(this->Values->preset);
  return preset ? preset->source.c_str() : "";
}

//----------------------------------------------------------------------------
echorama::ProbeGeometry vtkUltrasoundProbeSource::Geometry() const
{
  if (const echorama::ProbePreset* preset = PresetOf(this->Values->preset)) {
    return preset->probe;
  }
  const Settings& v = *this->Values;
  echorama::ProbeGeometry geometry = v.head.Place().geometry;
  geometry.fanWidth = geometry.fanAngle > 0.0 ? geometry.fanAngle * v.fanRadius : geometry.fanWidth;
  geometry.sweepWidth = geometry.sweepAngle > 0.0 ? geometry.sweepAngle * v.sweepRadius : geometry.sweepWidth;
  return geometry;
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundProbeSource::ProbeToWorld() const
{
  return this->Values->head.Place().probeToWorld;
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeSource::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const auto pose = vtkUltrasoundVolume::RigidPoseOf(probeToWorld);
  if (!pose) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  const Eigen::Vector3d turn = echorama::LogRotation(pose->linear()) * echorama::DegreesPerRadian;
  this->SetParameterAsVector("Orientation", turn.data());
  this->SetParameterAsVector("Position", pose->translation().data());
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeSource::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  vtkUltrasoundVolume::SetMatrix(probeToWorld, this->ProbeToWorld());
}

//----------------------------------------------------------------------------
int vtkUltrasoundProbeSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    progress(0.0);
    const echorama::ProbePreset* preset = PresetOf(this->Values->preset);
    const echorama::ProbeGeometry geometry = this->Geometry();
    const echorama::Pose probeToWorld = this->ProbeToWorld();
    const int elements = preset ? preset->elements : this->Values->elements;
    const int steps = geometry.IsPlane() ? 1 : preset ? preset->sweepSteps : this->Values->sweepSteps;
    WriteMesh(echorama::MakeProbeMesh(geometry, this->Values->housing), probeToWorld, vtkPolyData::GetData(outputs, 0));
    progress(0.5);
    WriteElements(echorama::ElementPoses(geometry, elements, steps), elements, probeToWorld, vtkPolyData::GetData(outputs, 1));
    for (const int port : {0, 1}) {
      vtkPolyData* output = vtkPolyData::GetData(outputs, port);
      vtkUltrasoundAcquisition::SetProbeGeometry(output, geometry);
      vtkUltrasoundAcquisition::SetProbeToWorld(output, probeToWorld);
    }
    progress(1.0);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
