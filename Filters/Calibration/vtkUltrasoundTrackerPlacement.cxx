// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTrackerPlacement.h"

#include "Core/Geometry/MatrixRows.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundTrackPoses.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <limits>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundTrackerPlacement);

vtkUltrasoundParametersMacro(vtkUltrasoundTrackerPlacement);

namespace {
std::string TextOf(const char* text)
{
  return text ? text : "";
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundTrackerPlacement::vtkUltrasoundTrackerPlacement()
{
  this->SetNumberOfInputPorts(2);
  Eigen::Map<echorama::MatrixRows>(this->VolumeToSensor).setIdentity();
  this->Forget();
}

//----------------------------------------------------------------------------
vtkUltrasoundTrackerPlacement::~vtkUltrasoundTrackerPlacement()
{
  this->SetRecording(nullptr);
  this->SetCalibrationFile(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::Forget()
{
  this->Poses.clear();
  this->Notes.clear();
  this->ErrorMm = std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::SetVolumeToSensor(vtkMatrix4x4* matrix)
{
  if (matrix) {
    this->SetVolumeToSensor(matrix->GetData());
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::AddTime(double seconds)
{
  this->Values.times.push_back(seconds);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::RemoveAllTimes()
{
  if (!this->Values.times.empty()) {
    this->Values.times.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTrackerPlacement::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {{Parameter("Tool", this->Tool,
                  "The tool that is fixed to the probe: ProbeToTracker, or by its name in ToolNames. "
                  "Of a recording also one that is composed, such as ProbeToReference. Empty takes the only one.")},
       Describe(this->Values),
       {Parameter(
            "VolumeFrame", echorama::Choice(this->VolumeFrame, {"automatic", "probe", "file-frame"}),
            "What the calibration calls the volume: the frame of its probe (ProbeToWorld), or that of the file, for volumes "
            "that lie as they were acquired. Automatic: as the file of the calibration says, else the probe's where all "
            "volumes know it.")
            .Advanced(),
        Parameter("PoseArray", this->PoseArray,
                  "The point array of 16 numbers that holds the poses of the track, from the tool to the world.")
            .Advanced()},
       echorama::Renamed(echorama::Without(Describe(this->RecordingOptions), {"RowsPerSecond"}), "UnitMm", "RecordingUnitMm")});
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerPlacement::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 1) {
    info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
    info->Set(INPUT_IS_OPTIONAL(), 1);
    return 1;
  }
  return this->Superclass::FillInputPortInformation(port, info);
}

//----------------------------------------------------------------------------
echorama::TrackedVolume vtkUltrasoundTrackerPlacement::TrackedVolumeOf(vtkImageData* image, const std::string& name)
{
  return {name, vtkUltrasoundVolume::GeometryOf(image).direction, vtkUltrasoundAcquisition::TimeStampOf(image),
          vtkUltrasoundAcquisition::ProbeToWorldOf(image)};
}

//----------------------------------------------------------------------------
echorama::ToolTrack vtkUltrasoundTrackerPlacement::Track(vtkInformationVector* input) const
{
  if (input->GetNumberOfInformationObjects() == 0) {
    if (TextOf(this->Recording).empty()) {
      throw Error(Error::Kind::BadInput, "there is neither a track (input 1) nor a recording");
    }
    return echorama::ToolTrackOf(echorama::ReadPoseLog(this->Recording, this->RecordingOptions), this->Tool);
  }
  echorama::ToolTrack track;
  track.source = "the track";
  auto poses = echorama::TrackPosesOf(vtkPolyData::GetData(input), this->PoseArray, this->Tool, track.source);
  track.poses = std::move(poses.poses);
  track.name = poses.tool.empty() ? "the tool" : poses.tool;
  const auto frames = echorama::FramesOf(poses.tool);
  track.from = frames ? frames->first : poses.tool.empty() ? "Sensor" : poses.tool;
  return track;
}

//----------------------------------------------------------------------------
echorama::VolumeCalibration vtkUltrasoundTrackerPlacement::Calibration(const std::string& sensor) const
{
  echorama::VolumeCalibration calibration;
  if (!TextOf(this->CalibrationFile).empty()) {
    calibration = echorama::ReadVolumeCalibration(this->CalibrationFile, sensor);
  } else if (!echorama::NearestPose(Eigen::Map<const echorama::MatrixRows>(this->VolumeToSensor), calibration.volumeToSensor)) {
    throw Error(Error::Kind::InvalidParameter, "VolumeToSensor is not a rigid pose");
  }
  if (this->VolumeFrame != Frame::Automatic) {
    calibration.frame = this->VolumeFrame == Frame::Probe ? "probe" : "file";
  }
  return calibration;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                            const echorama::Progress& progress)
{
  this->Forget();
  echorama::CheckRanges(this->Parameters());
  progress(0.0); // it may be stopped
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  std::vector<echorama::TrackedVolume> tracked;
  for (const vtkUltrasoundVolume::Input& volume : volumes) {
    tracked.push_back(TrackedVolumeOf(volume.Image, volume.Name));
  }
  const echorama::ToolTrack track = this->Track(inputs[1]);
  const echorama::VolumeCalibration calibration = this->Calibration(track.from);
  const echorama::TrackerPlacement placement = echorama::PlaceByTracker(track, tracked, calibration, this->Values);
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    vtkNew<vtkImageData> moved;
    moved->ShallowCopy(volumes[i].Image);
    if (i != static_cast<std::size_t>(this->Values.fixed)) {
      vtkUltrasoundVolume::Move(moved, placement.volumeToWorld[i]);
    }
    vtkUltrasoundVolume::AddField(moved, VolumeToWorldName(), echorama::MatrixRows(placement.volumeToWorld[i].matrix()).data(),
                                  16);
    PutBlock(outputs, 0, i, moved, volumes[i].Name);
  }
  this->Poses = placement.volumeToWorld;
  this->ErrorMm = calibration.errorMm.value_or(this->ErrorMm);
  this->Notes = placement.how;
  for (const auto& notes : {track.notes, placement.notes}) {
    for (const std::string& note : notes) {
      this->Notes += "\n" + note;
    }
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerPlacement::GetPose(int volume, vtkMatrix4x4* pose) const
{
  if (!pose || volume < 0 || volume >= this->GetNumberOfVolumes()) {
    return false;
  }
  pose->DeepCopy(echorama::MatrixRows(this->Poses[static_cast<std::size_t>(volume)].matrix()).data());
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Recording: " << TextOf(this->Recording) << "\n";
  os << indent << "CalibrationFile: " << TextOf(this->CalibrationFile) << "\n";
  os << indent << "VolumeToSensor:";
  for (const double number : this->VolumeToSensor) {
    os << " " << number;
  }
  os << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Times: " << this->GetNumberOfTimes() << "\n";
  os << indent << "ErrorMm: " << this->ErrorMm << "\n";
}
