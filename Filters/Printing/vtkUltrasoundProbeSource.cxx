// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundProbeSource.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/ProbePresets.h"
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

#include <cmath>

vtkStandardNewMacro(vtkUltrasoundProbeSource);

namespace {

using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

// The kernel's preset behind a number of the enumeration, or nullptr.
const echorama::ProbePreset* PresetOf(int preset)
{
  static const char* const names[] = {"", "curvilinear", "linear", "phased", "endocavity-3d", "mechanical-3d"};
  return preset == vtkUltrasoundProbeSource::Custom ? nullptr : &echorama::ProbePresetOf(names[preset]);
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
    const RowMajor rows = (probeToWorld * poses[static_cast<std::size_t>(i)]).matrix();
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
vtkUltrasoundProbeSource::vtkUltrasoundProbeSource() : Preset(Mechanical3D)
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
  const echorama::ProbePreset& preset = *PresetOf(Mechanical3D);
  this->FanAngle = std::round(preset.probe.fanAngle * echorama::DegreesPerRadian);
  this->FanRadius = std::round(preset.probe.fanWidth / preset.probe.fanAngle);
  this->FanWidth = 40.0;
  this->SweepAngle = std::round(preset.probe.sweepAngle * echorama::DegreesPerRadian);
  this->SweepRadius = std::round(preset.probe.sweepWidth / preset.probe.sweepAngle);
  this->SweepWidth = 0.0;
  this->DepthMin = preset.probe.depthMin;
  this->DepthMax = preset.probe.depthMax;
  this->Elements = preset.elements;
  this->SweepSteps = preset.sweepSteps;
  const echorama::ProbeHousing housing;
  this->RimMm = housing.rimMm;
  this->SkirtMm = housing.skirtMm;
  this->NeckMm = housing.neckMm;
  this->HandleMm = housing.handleMm;
  this->HandleWidthMm = housing.handleWidthMm;
  this->HandleThicknessMm = housing.handleThicknessMm;
  this->FaceWidthMm = housing.faceWidthMm;
  this->FaceThicknessMm = housing.faceThicknessMm;
  this->ResolutionMm = housing.resolutionMm;
  for (int axis = 0; axis < 3; ++axis) {
    this->Position[axis] = this->Orientation[axis] = 0.0;
  }
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundProbeSource::GetPresetSource()
{
  const echorama::ProbePreset* preset = PresetOf(this->Preset);
  return preset ? preset->source.c_str() : "";
}

//----------------------------------------------------------------------------
echorama::ProbeGeometry vtkUltrasoundProbeSource::Geometry() const
{
  if (const echorama::ProbePreset* preset = PresetOf(this->Preset)) {
    return preset->probe;
  }
  echorama::ProbeGeometry geometry;
  geometry.fanAngle = this->FanAngle / echorama::DegreesPerRadian;
  geometry.fanWidth = geometry.fanAngle > 0.0 ? geometry.fanAngle * this->FanRadius : this->FanWidth;
  geometry.sweepAngle = this->SweepAngle / echorama::DegreesPerRadian;
  geometry.sweepWidth = geometry.sweepAngle > 0.0 ? geometry.sweepAngle * this->SweepRadius : this->SweepWidth;
  geometry.depthMin = this->DepthMin;
  geometry.depthMax = this->DepthMax;
  return geometry;
}

//----------------------------------------------------------------------------
echorama::ProbeHousing vtkUltrasoundProbeSource::Housing() const
{
  echorama::ProbeHousing housing;
  housing.rimMm = this->RimMm;
  housing.skirtMm = this->SkirtMm;
  housing.neckMm = this->NeckMm;
  housing.handleMm = this->HandleMm;
  housing.handleWidthMm = this->HandleWidthMm;
  housing.handleThicknessMm = this->HandleThicknessMm;
  housing.faceWidthMm = this->FaceWidthMm;
  housing.faceThicknessMm = this->FaceThicknessMm;
  housing.resolutionMm = this->ResolutionMm;
  return housing;
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundProbeSource::ProbeToWorld() const
{
  echorama::Pose pose = echorama::Pose::Identity();
  pose.linear() = echorama::ExpRotation(Eigen::Map<const Eigen::Vector3d>(this->Orientation) / echorama::DegreesPerRadian);
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(this->Position);
  return pose;
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeSource::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  echorama::Pose pose;
  pose.matrix() = Eigen::Map<const RowMajor>(probeToWorld->GetData());
  if (!echorama::IsRotation(pose.linear()) || !pose.translation().allFinite() ||
      pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  const Eigen::Vector3d turn = echorama::LogRotation(pose.linear()) * echorama::DegreesPerRadian;
  this->SetOrientation(turn.x(), turn.y(), turn.z());
  this->SetPosition(pose.translation().x(), pose.translation().y(), pose.translation().z());
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeSource::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const RowMajor rows = this->ProbeToWorld().matrix();
  probeToWorld->DeepCopy(rows.data());
}

//----------------------------------------------------------------------------
int vtkUltrasoundProbeSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    progress(0.0);
    const echorama::ProbePreset* preset = PresetOf(this->Preset);
    const echorama::ProbeGeometry geometry = this->Geometry();
    const echorama::Pose probeToWorld = this->ProbeToWorld();
    if (!probeToWorld.matrix().allFinite()) {
      throw echorama::Error(echorama::Error::Kind::InvalidParameter, "Position and Orientation must be finite");
    }
    const int elements = preset ? preset->elements : this->Elements;
    const int steps = geometry.IsPlane() ? 1 : preset ? preset->sweepSteps : this->SweepSteps;
    WriteMesh(echorama::MakeProbeMesh(geometry, this->Housing()), probeToWorld, vtkPolyData::GetData(outputs, 0));
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
  os << indent << "Preset: " << this->Preset << "\n";
  os << indent << "FanAngle: " << this->FanAngle << "\n";
  os << indent << "FanRadius: " << this->FanRadius << "\n";
  os << indent << "FanWidth: " << this->FanWidth << "\n";
  os << indent << "SweepAngle: " << this->SweepAngle << "\n";
  os << indent << "SweepRadius: " << this->SweepRadius << "\n";
  os << indent << "SweepWidth: " << this->SweepWidth << "\n";
  os << indent << "DepthMin: " << this->DepthMin << "\n";
  os << indent << "DepthMax: " << this->DepthMax << "\n";
  os << indent << "Elements: " << this->Elements << "\n";
  os << indent << "SweepSteps: " << this->SweepSteps << "\n";
  os << indent << "RimMm: " << this->RimMm << "\n";
  os << indent << "SkirtMm: " << this->SkirtMm << "\n";
  os << indent << "NeckMm: " << this->NeckMm << "\n";
  os << indent << "HandleMm: " << this->HandleMm << "\n";
  os << indent << "HandleWidthMm: " << this->HandleWidthMm << "\n";
  os << indent << "HandleThicknessMm: " << this->HandleThicknessMm << "\n";
  os << indent << "FaceWidthMm: " << this->FaceWidthMm << "\n";
  os << indent << "FaceThicknessMm: " << this->FaceThicknessMm << "\n";
  os << indent << "ResolutionMm: " << this->ResolutionMm << "\n";
  os << indent << "Position: " << this->Position[0] << " " << this->Position[1] << " " << this->Position[2] << "\n";
  os << indent << "Orientation: " << this->Orientation[0] << " " << this->Orientation[1] << " " << this->Orientation[2] << "\n";
}
