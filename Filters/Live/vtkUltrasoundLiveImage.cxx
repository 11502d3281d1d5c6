// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundLiveImage.h"

#include "Core/Base/Angles.h"
#include "Filters/Live/PressStates.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundDeformGeometry.h"
#include "vtkUltrasoundTissue.h"

#include "vtkDataArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <cmath>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundLiveImage);

vtkUltrasoundParametersMacro(vtkUltrasoundLiveImage);

struct vtkUltrasoundLiveImage::KeptVolumes {
  std::vector<std::pair<vtkImageData*, vtkMTimeType>> Sources;
  std::string ArrayName; // of the intensities that were chosen
  echorama::BeamVolumes Volumes;
  bool HasLabels = false, IsPrepared = false;
};

struct vtkUltrasoundLiveImage::KeptScene {
  KeptScene(vtkPolyData* tissue) : Tissue(tissue), Time(tissue->GetMTime()), Scene(vtkUltrasoundTissue::Of(tissue)) {}
  vtkPolyData* Tissue;
  vtkMTimeType Time;
  echorama::LiveScene Scene;
};

struct vtkUltrasoundLiveImage::KeptPress {
  std::vector<std::pair<vtkImageData*, vtkMTimeType>> Sources;
  echorama::PressStates States;
};

//----------------------------------------------------------------------------
vtkUltrasoundLiveImage::vtkUltrasoundLiveImage()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundLiveImage::~vtkUltrasoundLiveImage() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundLiveImage::Parameters()
{
  using echorama::Parameter;
  echorama::ParameterList look = Describe(this->Look);
  for (Parameter& parameter : look) {
    if (parameter.whenName.empty()) {
      parameter.When("Needle", "on");
    }
  }
  return echorama::Join(
      {{Parameter("Position", this->Place, {}, "mm", "Where the middle of the probe's face lies in the world."),
        Parameter("Orientation", this->Turn, {}, "degrees",
                  "How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x.")},
       Describe(this->SceneValues),
       Describe(this->Values),
       {Parameter("Needle", this->HasNeedle, "Whether there is a needle. It is drawn only where it crosses the plane."),
        Parameter("NeedleTip", this->NeedlePlace, {}, "mm", "Where its tip lies in the world.").When("Needle", "on"),
        Parameter("NeedleDirection", this->NeedleWay, {}, "",
                  "The way it goes in, in the world; of any length but 0. The shaft lies behind the tip.")
            .When("Needle", "on"),
        Parameter("NeedleStops", this->NeedleIsStopped, "Whether bone stops it when it is advanced (AdvanceNeedle).")
            .When("Needle", "on"),
        Parameter("NeedleStopLevel", this->NeedleLevel, {0, 1}, "",
                  "Of volumes: what is brighter than this, averaged over 1.5 mm, is bone. 0 is black, 1 white.")
            .When("NeedleStops", "on")},
       look,
       {Parameter("Frame", this->FrameNumber, {0, 9223372036854775807.0}, "", "The number of the frame, which chooses its noise.")
            .When("NoiseMoves", "on")
            .Advanced(),
        Parameter("BeamsOutput", this->PutsOutBeams, "Whether the beams are put out, too.").Advanced()}});
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundLiveImage::OwnPose() const
{
  echorama::Pose pose = echorama::Pose::Identity();
  pose.linear() = echorama::ExpRotation(this->Turn * echorama::RadiansPerDegree);
  pose.translation() = this->Place;
  return pose;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundLiveImage::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const auto pose = probeToWorld ? vtkUltrasoundVolume::RigidPoseOf(probeToWorld) : std::nullopt;
  if (!pose || !pose->matrix().allFinite()) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform of finite numbers; the pose was not changed");
    return false;
  }
  this->Turn = echorama::LogRotation(pose->linear()) * echorama::DegreesPerRadian;
  this->Place = pose->translation();
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundLiveImage::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  vtkUltrasoundVolume::SetMatrix(probeToWorld, this->OwnPose());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundLiveImage::SetNeedleToWorld(vtkMatrix4x4* needleToWorld)
{
  const auto pose = needleToWorld ? vtkUltrasoundVolume::RigidPoseOf(needleToWorld) : std::nullopt;
  if (!pose || !pose->matrix().allFinite()) {
    vtkErrorMacro("NeedleToWorld is not a rigid transform of finite numbers; the needle was not moved");
    return false;
  }
  const echorama::Needle needle = echorama::Needle::Of(*pose);
  this->NeedlePlace = needle.tip;
  this->NeedleWay = needle.direction;
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
echorama::Needle vtkUltrasoundLiveImage::NeedleNow() const
{
  const double length = this->NeedleWay.norm();
  if (!(length > 0.0) || !std::isfinite(length) || !this->NeedlePlace.allFinite()) {
    throw Error(Error::Kind::InvalidParameter, "NeedleTip must be finite, and NeedleDirection finite and not (0, 0, 0)");
  }
  return {this->NeedlePlace, this->NeedleWay / length};
}

//----------------------------------------------------------------------------
double vtkUltrasoundLiveImage::AdvanceNeedle(double mm, double stepMm)
{
  double moved = 0.0;
  vtkUltrasoundVolume::Run(this, nullptr, [this, mm, stepMm, &moved](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    const echorama::Needle needle = this->NeedleNow();
    echorama::NeedleObstacle bone;
    if (this->NeedleIsStopped && mm > 0.0) {
      const bool isVolumes = this->SceneValues.source == echorama::LiveSource::Volumes;
      const int port = isVolumes ? 0 : 1;
      for (int input = 0; input < this->GetNumberOfInputConnections(port); ++input) {
        this->GetInputAlgorithm(port, input)->Update();
      }
      vtkInformationVector* inputs = this->GetExecutive()->GetInputInformation(port);
      bool hasLabels = false;
      if (isVolumes) {
        const echorama::MachineControls& greys = this->Values.controls;
        bone = echorama::BrighterThan(this->VolumesOf(inputs, hasLabels),
                                      greys.black + this->NeedleLevel * (greys.white - greys.black), this->Values.mix);
      } else if (const echorama::LiveScene* scene = this->SceneOf(inputs)) {
        bone = scene->Hard();
      }
    }
    moved = echorama::AdvanceTip(needle.tip, needle.tip + mm * needle.direction, bone, stepMm).freeMm * (mm < 0.0 ? -1.0 : 1.0);
    this->NeedlePlace = needle.tip + moved * needle.direction;
    this->Modified();
  });
  return moved;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundLiveImage::SetProbeFrom(vtkDataObject* data)
{
  const auto probe = vtkUltrasoundAcquisition::ProbeGeometryOf(data);
  if (!probe || probe->fanOffset != 0.0) {
    vtkErrorMacro("the data has no field data " << vtkUltrasoundAcquisition::ProbeGeometryName()
                                                << " of 6 finite numbers (a fan that is not centred cannot be taken)");
    return false;
  }
  this->Values.probe = {echorama::LiveProbe::Custom, probe->fanAngle * echorama::DegreesPerRadian, probe->fanWidth,
                        probe->depthMin, probe->depthMax};
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundLiveImage::GetStateText() const
{
  switch (this->State) {
  case SEES_VOLUME:
    return "";
  case NO_VOLUME:
    return this->SceneValues.source == echorama::LiveSource::Volumes ? "there is no volume" : "there is no tissue";
  case OUTSIDE:
    if (this->SceneValues.source == echorama::LiveSource::Volumes && !this->Values.mix.showInvented) {
      return "nothing that was measured lies under the probe";
    }
    return this->SceneValues.source == echorama::LiveSource::Volumes ? "no volume lies under the probe"
                                                                     : "no body lies under the probe";
  default:
    return "the image could not be made";
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundLiveImage::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 1) {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  } else if (port == 2) {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  } else {
    vtkUltrasoundVolume::AcceptVolumes(info);
  }
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundLiveImage::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  const int done = vtkUltrasoundVolume::Run(this, nullptr, [this, outputs](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    this->Image.Set(this->Values);
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0), this->Image.Grid(this->OwnPose()));
    echorama::ImageGeometry beams;
    if (this->PutsOutBeams) {
      beams.dimensions = this->Image.BeamValue().Dimensions();
    }
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(1), beams);
    vtkDataObject::SetPointDataActiveScalarInfo(outputs->GetInformationObject(0), VTK_UNSIGNED_CHAR, 1);
    vtkDataObject::SetPointDataActiveScalarInfo(outputs->GetInformationObject(1), VTK_FLOAT, 1);
  });
  if (!done) {
    this->State = FAILED;
  }
  return done;
}

//----------------------------------------------------------------------------
int vtkUltrasoundLiveImage::RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->State = FAILED;
  this->SeenShare = 0.0;
  this->ContactShare = 1.0;
  this->HardMaterial.clear();
  this->Sight = {};
  return this->Superclass::RequestData(request, inputs, outputs);
}

//----------------------------------------------------------------------------
const echorama::BeamVolumes& vtkUltrasoundLiveImage::VolumesOf(vtkInformationVector* port, bool& hasLabels)
{
  const auto inputs = vtkUltrasoundVolume::CollectInputs(this, port);
  auto now = std::make_unique<KeptVolumes>();
  for (const auto& input : inputs) {
    now->Sources.emplace_back(input.Image, input.Image->GetMTime());
    now->ArrayName += std::string(input.Intensity->GetName() ? input.Intensity->GetName() : "") + "\n";
  }
  if (!this->Kept || this->Kept->Sources != now->Sources || this->Kept->ArrayName != now->ArrayName) {
    this->Kept.reset();
    for (const auto& input : inputs) {
      vtkDataArray* labels = input.Image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
      if (labels && (labels->GetDataType() != VTK_UNSIGNED_CHAR || labels->GetNumberOfComponents() != 1 ||
                     labels->GetNumberOfTuples() != input.Image->GetNumberOfPoints())) {
        throw Error(Error::Kind::BadInput, input.Name + ": its Embedding is not one unsigned char per voxel");
      }
      now->HasLabels = now->HasLabels || labels;
      vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
        using T = decltype(type);
        now->Volumes.Add<T>(vtkUltrasoundVolume::PosedVolumeOf<T>(input),
                            vtkUltrasoundVolume::ViewOf<const unsigned char>(labels, input.Image));
      });
    }
    this->Kept = std::move(now);
  }
  if (this->Values.mix.overlap == echorama::VolumeMix::Overlap::Mean && !this->Kept->IsPrepared) {
    this->Kept->Volumes.PrepareMean();
    this->Kept->IsPrepared = true;
  }
  hasLabels = this->Kept->HasLabels;
  return this->Kept->Volumes;
}

//----------------------------------------------------------------------------
echorama::LiveScene* vtkUltrasoundLiveImage::SceneOf(vtkInformationVector* port)
{
  vtkPolyData* tissue = vtkPolyData::GetData(port);
  if (!tissue) {
    return nullptr;
  }
  if (!this->Scene || this->Scene->Tissue != tissue || this->Scene->Time != tissue->GetMTime()) {
    this->Scene.reset();
    this->Scene = std::make_unique<KeptScene>(tissue);
  }
  return &this->Scene->Scene;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundLiveImage::SetPressState(vtkDataObject* displacement, double pressMm, vtkMatrix4x4* probeToWorld)
{
  const auto pose = probeToWorld ? vtkUltrasoundVolume::RigidPoseOf(probeToWorld) : std::nullopt;
  if (!displacement || !pose || !pose->matrix().allFinite()) {
    vtkGenericWarningMacro("the state of pressed tissue needs data, and a rigid transform of finite numbers");
    return false;
  }
  vtkUltrasoundVolume::AddField(displacement, PressMmName(), &pressMm, 1);
  vtkUltrasoundAcquisition::SetProbeToWorld(displacement, *pose);
  return true;
}

//----------------------------------------------------------------------------
const echorama::BeamBend* vtkUltrasoundLiveImage::BendOf(vtkInformationVector* port)
{
  auto now = std::make_unique<KeptPress>();
  for (int i = 0; i < port->GetNumberOfInformationObjects(); ++i) {
    vtkImageData* image = vtkImageData::GetData(port, i);
    now->Sources.emplace_back(image, image ? image->GetMTime() : 0);
  }
  if (!this->Press || this->Press->Sources != now->Sources) {
    this->Press.reset();
    for (std::size_t i = 0; i < now->Sources.size(); ++i) {
      vtkImageData* image = now->Sources[i].first;
      const std::string name = "pressed state " + std::to_string(i + 1);
      vtkDataArray* press = image ? image->GetFieldData()->GetArray(PressMmName()) : nullptr;
      const auto pose = image ? vtkUltrasoundAcquisition::ProbeToWorldOf(image) : std::nullopt;
      if (!press || press->GetNumberOfValues() != 1 || !pose) {
        throw Error(Error::Kind::BadInput,
                    name + ": its field data have no PressMm of one number or no ProbeToWorld (SetPressState)");
      }
      now->States.Add(press->GetTuple1(0), *pose, vtkUltrasoundDeformGeometry::MapOf(image, name));
    }
    this->Press = std::move(now);
  }
  const echorama::ProbeGeometry& probe = this->Image.Probe();
  const double reach = echorama::ThicknessOf(this->Values).ReachMm(probe.depthMin, probe.depthMax);
  return this->Press->States.At(probe, reach, this->SceneValues.look.pressMm);
}

//----------------------------------------------------------------------------
void vtkUltrasoundLiveImage::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Image.Set(this->Values);
  const echorama::Pose pose = this->OwnPose();
  bool hasLabels = false, isEmpty = true;
  progress(0.0); // one frame of volumes is no work to be stopped within, but before
  if (this->SceneValues.source == echorama::LiveSource::Volumes) {
    const echorama::BeamVolumes& volumes = this->VolumesOf(inputs[0], hasLabels);
    this->Image.MakeBeams(volumes, pose, this->FrameNumber, this->BendOf(inputs[2]));
    this->SeenShare = this->Image.RealShare();
    isEmpty = volumes.Empty();
  } else if (echorama::LiveScene* scene = this->SceneOf(inputs[1])) {
    const bool isDrawn = this->SceneValues.source == echorama::LiveSource::Scene;
    this->Image.SetBeams(scene->MakeBeams(echorama::SceneSettings(this->Values, pose, this->FrameNumber), this->SceneValues,
                                          progress.Part(0.0, 0.5), echorama::SceneThickness(this->Values),
                                          isDrawn ? this->BendOf(inputs[2]) : nullptr));
    this->SeenShare = scene->SeenShare();
    this->ContactShare = scene->ContactShare();
    // Behind the face: a probe that lies on the bone is not within it.
    const echorama::Material* hard = scene->HardMaterialAt(pose * Eigen::Vector3d(0.0, 0.0, -1.0));
    this->HardMaterial = hard ? hard->name : "";
    isEmpty = false;
  } else {
    this->Image.MakeBeams(echorama::BeamVolumes(), pose); // of nothing
  }
  if (this->HasNeedle) {
    this->Sight = this->Image.DrawNeedle(this->Look, this->NeedleNow(), pose);
  }
  progress(0.5);

  output->Initialize(); // the pipeline has passed on what the first volume says of itself
  vtkUltrasoundVolume::SetGeometry(output, this->Image.Grid(pose));
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* labels = hasLabels ? AddArray(output, vtkUltrasoundVolume::EmbeddingName(), VTK_UNSIGNED_CHAR) : nullptr;
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  this->Image.MakePixels(vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output),
                         vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output),
                         vtkUltrasoundVolume::ViewOf<unsigned char>(labels, output));

  vtkImageData* beams = vtkImageData::SafeDownCast(this->GetOutputDataObject(1));
  beams->Initialize();
  if (this->PutsOutBeams) {
    echorama::ImageGeometry grid;
    grid.dimensions = this->Image.BeamValue().Dimensions();
    vtkUltrasoundVolume::SetGeometry(beams, grid);
    vtkDataArray* values = AddArray(beams, vtkUltrasoundVolume::IntensityName(), VTK_FLOAT);
    vtkDataArray* real = AddArray(beams, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
    const auto value = this->Image.BeamValue();
    const auto content = this->Image.BeamContents();
    std::copy(value.begin(), value.end(), vtkUltrasoundVolume::ViewOf<float>(values, beams).begin());
    std::transform(content.begin(), content.end(), vtkUltrasoundVolume::ViewOf<unsigned char>(real, beams).begin(),
                   [](unsigned char each) { return static_cast<unsigned char>(each != 0); });
    if (hasLabels) {
      vtkDataArray* marks = AddArray(beams, vtkUltrasoundVolume::EmbeddingName(), VTK_UNSIGNED_CHAR);
      std::transform(content.begin(), content.end(), vtkUltrasoundVolume::ViewOf<unsigned char>(marks, beams).begin(),
                     echorama::LabelOfContent);
    }
    beams->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  }
  for (vtkImageData* each : {output, beams}) {
    vtkUltrasoundAcquisition::SetProbeGeometry(each, this->Image.Probe());
    vtkUltrasoundAcquisition::SetProbeToWorld(each, pose);
  }
  this->State = isEmpty ? NO_VOLUME : this->SeenShare > 0.0 ? SEES_VOLUME : OUTSIDE;
}

//----------------------------------------------------------------------------
void vtkUltrasoundLiveImage::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "State: " << this->State << "\n" << indent << "SeenShare: " << this->SeenShare << "\n";
  os << indent << "ContactShare: " << this->ContactShare << "\n" << indent << "NeedleSeenMm: " << this->Sight.seenMm << "\n";
}
