// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPhantomSource.h"

#include "Core/Base/Angles.h"
#include "Core/Geometry/ProbeSettings.h"
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

vtkUltrasoundParametersMacro(vtkUltrasoundPhantomSource);

struct vtkUltrasoundPhantomSource::Settings {
  echorama::PhantomParameters phantom; // but for scene and probe, which come from the others
  echorama::ConvexProbeSettings probe;
  std::string scene;
};

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
echorama::ParameterList vtkUltrasoundPhantomSource::Parameters()
{
  Settings& v = *this->Values;
  return echorama::Join(
      {Without(Describe(v.phantom),
               {"PulseSigmaMm", "LateralSigmaMm", "LateralGrowth", "ElevationSigmaMm", "ElevationGrowth", "ScatterersPerMm3"}),
       Describe(v.probe),
       {echorama::Parameter("Scene", v.scene,
                            "The scene as JSON text, as it stands in the field data Scene of a phantom; empty: the "
                            "default scene.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
vtkUltrasoundPhantomSource::vtkUltrasoundPhantomSource() : Values(new Settings)
{
  this->SetNumberOfInputPorts(0);
  this->Values->probe.depthMin = this->Values->phantom.probe.depthMin;
}

//----------------------------------------------------------------------------
vtkUltrasoundPhantomSource::~vtkUltrasoundPhantomSource() = default;

//----------------------------------------------------------------------------
echorama::PhantomParameters vtkUltrasoundPhantomSource::Phantom() const
{
  echorama::PhantomParameters phantom = this->Values->phantom;
  if (!this->Values->scene.empty()) {
    phantom.scene = echorama::PhantomFromJson(this->Values->scene);
  }
  const echorama::PlacedProbe placed = this->Values->probe.Place();
  phantom.probe = placed.geometry;
  phantom.probeToWorld = placed.probeToWorld;
  return phantom;
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SetView(const echorama::Pose& probeToWorld, double gainDb)
{
  this->Values->probe.orientation = echorama::LogRotation(probeToWorld.linear()) * echorama::DegreesPerRadian;
  this->Values->probe.position = probeToWorld.translation();
  this->Values->phantom.gainDb = gainDb;
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const auto pose = vtkUltrasoundVolume::RigidPoseOf(probeToWorld);
  if (!pose) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  this->SetView(*pose, this->Values->phantom.gainDb);
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  vtkUltrasoundVolume::SetMatrix(probeToWorld, this->Values->probe.Place().probeToWorld);
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::TissueToSeen(vtkPoints* from, vtkPoints* to)
{
  const echorama::ProbePress& press = this->Values->phantom.press;
  MapPoints(this->Values->probe.Place().probeToWorld, from, to,
            [&press](const Eigen::Vector3d& point) { return press.Seen(point); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::SeenToTissue(vtkPoints* from, vtkPoints* to)
{
  const echorama::ProbePress& press = this->Values->phantom.press;
  MapPoints(this->Values->probe.Place().probeToWorld, from, to,
            [&press](const Eigen::Vector3d& point) { return press.Unpressed(point); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::Add(echorama::Inclusion inclusion)
{
  try {
    echorama::PhantomScene scene = this->Phantom().scene;
    scene.inclusions.push_back(std::move(inclusion));
    scene.Check();
    this->SetParameterAsText("Scene", echorama::PhantomToJson(scene).c_str());
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
  this->SetParameterAsText("Scene", echorama::PhantomToJson(echorama::UniformScene()).c_str());
}

//----------------------------------------------------------------------------
int vtkUltrasoundPhantomSource::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, echorama::PhantomGeometry(this->Phantom()));
    vtkDataObject::SetPointDataActiveScalarInfo(out, VTK_UNSIGNED_CHAR, 1);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPhantomSource::Execute(vtkInformationVector**, vtkImageData* output, const echorama::Progress& progress)
{
  const echorama::PhantomParameters parameters = this->Phantom();
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
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
