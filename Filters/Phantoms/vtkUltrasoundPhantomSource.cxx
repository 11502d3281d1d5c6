// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPhantomSource.h"

#include "Core/Base/Angles.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkUltrasoundAcquisition.h"

#include <cmath>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundPhantomSource);

namespace {

// Applies a map of the probe frame to points of the world.
template <class Map>
void MapPoints(const echorama::Pose& probeToWorld, vtkPoints* from, vtkPoints* to, Map&& map)
{
  if (!from || !to) {
    return;
  }
  const echorama::Pose worldToProbe = probeToWorld.inverse();
  vtkNew<vtkPoints> mapped;
  mapped->SetDataTypeToDouble();
  mapped->SetNumberOfPoints(from->GetNumberOfPoints());
  for (vtkIdType i = 0; i < from->GetNumberOfPoints(); ++i) {
    const Eigen::Vector3d point = probeToWorld * map(worldToProbe * Eigen::Map<const Eigen::Vector3d>(from->GetPoint(i)));
    mapped->SetPoint(i, point.data());
  }
  to->ShallowCopy(mapped);
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundPhantomSource::vtkUltrasoundPhantomSource()
{
  this->SetNumberOfInputPorts(0);
  const echorama::PhantomParameters defaults;
  this->Seed = static_cast<vtkTypeInt64>(defaults.seed);
  this->SpacingMm = defaults.spacingMm;
  this->GainDb = defaults.gainDb;
  this->DynamicRangeDb = defaults.dynamicRangeDb;
  this->BackgroundGrey = defaults.backgroundGrey;
  this->Shadows = defaults.shadows;
  this->Decorrelation = defaults.decorrelation;
  this->ChangeSeed = static_cast<vtkTypeInt64>(defaults.changeSeed);
  this->DeformationMm = defaults.press.mm;
  this->NoiseDb = defaults.noiseDb;
  this->RibShare = defaults.ribShare;
  this->Jets = defaults.jets;
  this->WavelengthMm = defaults.wavelengthMm;
  this->FanAngle = defaults.probe.fanAngle * echorama::DegreesPerRadian;
  this->FanRadius = defaults.probe.fanWidth / defaults.probe.fanAngle;
  this->SweepAngle = defaults.probe.sweepAngle * echorama::DegreesPerRadian;
  this->SweepRadius = defaults.probe.sweepWidth / defaults.probe.sweepAngle;
  this->DepthMin = defaults.probe.depthMin;
  this->DepthMax = defaults.probe.depthMax;
  for (int axis = 0; axis < 3; ++axis) {
    this->Position[axis] = this->Orientation[axis] = 0.0;
  }
  this->Scene = nullptr;
}

//----------------------------------------------------------------------------
vtkUltrasoundPhantomSource::~vtkUltrasoundPhantomSource()
{
  this->SetScene(nullptr);
}

//----------------------------------------------------------------------------
echorama::PhantomParameters vtkUltrasoundPhantomSource::Parameters() const
{
  echorama::PhantomParameters parameters;
  if (this->Scene && *this->Scene) {
    parameters.scene = echorama::SceneFromJson(this->Scene);
  }
  parameters.probe = echorama::ProbeGeometry::Convex(this->FanAngle / echorama::DegreesPerRadian, this->FanRadius,
                                                     this->SweepAngle / echorama::DegreesPerRadian, this->SweepRadius,
                                                     this->DepthMin, this->DepthMax);
  parameters.probeToWorld = this->ProbeToWorld();
  parameters.seed = static_cast<std::uint64_t>(this->Seed);
  parameters.spacingMm = this->SpacingMm;
  parameters.gainDb = this->GainDb;
  parameters.dynamicRangeDb = this->DynamicRangeDb;
  parameters.backgroundGrey = this->BackgroundGrey;
  parameters.shadows = this->Shadows;
  parameters.decorrelation = this->Decorrelation;
  parameters.changeSeed = static_cast<std::uint64_t>(this->ChangeSeed);
  parameters.press.mm = this->DeformationMm;
  parameters.noiseDb = this->NoiseDb;
  parameters.ribShare = this->RibShare;
  parameters.jets = this->Jets;
  parameters.wavelengthMm = this->WavelengthMm;
  return parameters;
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SetView(const echorama::Pose& probeToWorld, double gainDb)
{
  const Eigen::Vector3d turn = echorama::LogRotation(probeToWorld.linear()) * echorama::DegreesPerRadian;
  const Eigen::Vector3d place = probeToWorld.translation();
  this->SetOrientation(turn.x(), turn.y(), turn.z());
  this->SetPosition(place.x(), place.y(), place.z());
  this->SetGainDb(gainDb);
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  echorama::Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(probeToWorld->GetData());
  if (!echorama::IsRotation(pose.linear()) || !pose.translation().allFinite() ||
      pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  this->SetView(pose, this->GainDb);
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundPhantomSource::ProbeToWorld() const
{
  echorama::Pose pose = echorama::Pose::Identity();
  pose.linear() = echorama::ExpRotation(Eigen::Map<const Eigen::Vector3d>(this->Orientation) / echorama::DegreesPerRadian);
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(this->Position);
  return pose;
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = this->ProbeToWorld().matrix();
  probeToWorld->DeepCopy(rows.data());
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::TissueToSeen(vtkPoints* from, vtkPoints* to)
{
  const echorama::ProbePress press{this->DeformationMm};
  MapPoints(this->ProbeToWorld(), from, to, [&press](const Eigen::Vector3d& point) { return press.Seen(point); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SeenToTissue(vtkPoints* from, vtkPoints* to)
{
  const echorama::ProbePress press{this->DeformationMm};
  MapPoints(this->ProbeToWorld(), from, to, [&press](const Eigen::Vector3d& point) { return press.Unpressed(point); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::Add(echorama::Inclusion inclusion)
{
  try {
    echorama::PhantomScene scene = this->Parameters().scene;
    scene.inclusions.push_back(std::move(inclusion));
    scene.Check();
    this->SetScene(echorama::SceneToJson(scene).c_str());
  } catch (const Error& error) {
    vtkErrorMacro(<< error.what());
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::AddEllipsoid(const double centre[3], const double radii[3], double echogenicityDb)
{
  echorama::Ellipsoid ellipsoid;
  ellipsoid.centre = Eigen::Map<const Eigen::Vector3d>(centre);
  ellipsoid.radii = Eigen::Map<const Eigen::Vector3d>(radii);
  this->Add({"", ellipsoid, echogenicityDb, 0.0, 0.0, 0.0});
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::AddTube(const double from[3], const double to[3], double radius, double echogenicityDb)
{
  echorama::Tube tube;
  tube.path = {Eigen::Map<const Eigen::Vector3d>(from), Eigen::Map<const Eigen::Vector3d>(to)};
  tube.radius = radius;
  this->Add({"", tube, echogenicityDb, 0.0, 0.0, 0.0});
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::ClearScene()
{
  this->SetScene(echorama::SceneToJson(echorama::UniformScene()).c_str());
}

//----------------------------------------------------------------------------
int vtkUltrasoundPhantomSource::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress&) {
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, echorama::PhantomGeometry(this->Parameters()));
    vtkDataObject::SetPointDataActiveScalarInfo(out, VTK_UNSIGNED_CHAR, 1);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::Execute(vtkInformationVector**, vtkImageData* output, const echorama::Progress& progress)
{
  const echorama::PhantomParameters parameters = this->Parameters();
  vtkUltrasoundVolume::SetGeometry(output, echorama::PhantomGeometry(parameters));
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());

  echorama::MakePhantom(parameters, vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output),
                        vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output), progress);

  vtkUltrasoundAcquisition::SetProbeGeometry(output, parameters.probe);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, parameters.probeToWorld);
  vtkUltrasoundAcquisition::SetSeed(output, parameters.seed);
  vtkUltrasoundAcquisition::SetScene(output, echorama::DescribePhantom(parameters));
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "SpacingMm: " << this->SpacingMm << "\n";
  os << indent << "GainDb: " << this->GainDb << "\n";
  os << indent << "DynamicRangeDb: " << this->DynamicRangeDb << "\n";
  os << indent << "BackgroundGrey: " << this->BackgroundGrey << "\n";
  os << indent << "Shadows: " << this->Shadows << "\n";
  os << indent << "Decorrelation: " << this->Decorrelation << "\n";
  os << indent << "ChangeSeed: " << this->ChangeSeed << "\n";
  os << indent << "DeformationMm: " << this->DeformationMm << "\n";
  os << indent << "NoiseDb: " << this->NoiseDb << "\n";
  os << indent << "RibShare: " << this->RibShare << "\n";
  os << indent << "Jets: " << this->Jets << "\n";
  os << indent << "WavelengthMm: " << this->WavelengthMm << "\n";
  os << indent << "Fan: " << this->FanAngle << " degrees, radius " << this->FanRadius << "\n";
  os << indent << "Sweep: " << this->SweepAngle << " degrees, radius " << this->SweepRadius << "\n";
  os << indent << "Depth: " << this->DepthMin << " to " << this->DepthMax << "\n";
  os << indent << "Position: " << this->Position[0] << " " << this->Position[1] << " " << this->Position[2] << "\n";
  os << indent << "Orientation: " << this->Orientation[0] << " " << this->Orientation[1] << " " << this->Orientation[2] << "\n";
  os << indent << "Scene: " << (this->Scene && *this->Scene ? this->Scene : "(default)") << "\n";
}
