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
  this->SetPoseArray("ToolToWorld");
  Eigen::Map<echorama::MatrixRows>(this->VolumeToSensor).setIdentity();
  this->Forget();
}

//----------------------------------------------------------------------------
vtkUltrasoundTrackerPlacement::~vtkUltrasoundTrackerPlacement()
{
  this->SetRecording(nullptr);
  this->SetTool(nullptr);
  this->SetPoseArray(nullptr);
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
void vtkUltrasoundTrackerPlacement::SetTrackConnection(vtkAlgorithmOutput* track)
{
  this->SetInputConnection(1, track);
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
  this->Parameters.times.push_back(seconds);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::RemoveAllTimes()
{
  if (!this->Parameters.times.empty()) {
    this->Parameters.times.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerPlacement::GetNumberOfTimes() const
{
  return static_cast<int>(this->Parameters.times.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::SetWindowSeconds(double seconds)
{
  if (seconds != this->Parameters.smoothing.sigmaSeconds) {
    this->Parameters.smoothing.sigmaSeconds = seconds;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerPlacement::GetWindowSeconds() const
{
  return this->Parameters.smoothing.sigmaSeconds;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::SetLongestGapSeconds(double seconds)
{
  if (seconds != this->Parameters.smoothing.longestGapSeconds) {
    this->Parameters.smoothing.longestGapSeconds = seconds;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerPlacement::GetLongestGapSeconds() const
{
  return this->Parameters.smoothing.longestGapSeconds;
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
    echorama::PoseLogOptions options;
    options.unitMm = this->RecordingUnitMm;
    return echorama::ToolTrackOf(echorama::ReadPoseLog(this->Recording, options), TextOf(this->Tool));
  }
  echorama::ToolTrack track;
  track.source = "the track";
  auto poses = echorama::TrackPosesOf(vtkPolyData::GetData(input), TextOf(this->PoseArray), TextOf(this->Tool), track.source);
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
  if (this->VolumeFrame != AUTOMATIC) {
    calibration.frame = this->VolumeFrame == PROBE ? "probe" : "file";
  }
  return calibration;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerPlacement::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                            const echorama::Progress& progress)
{
  this->Forget();
  progress(0.0); // it may be stopped
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  std::vector<echorama::TrackedVolume> tracked;
  for (const vtkUltrasoundVolume::Input& volume : volumes) {
    tracked.push_back(TrackedVolumeOf(volume.Image, volume.Name));
  }
  const echorama::ToolTrack track = this->Track(inputs[1]);
  const echorama::VolumeCalibration calibration = this->Calibration(track.from);
  echorama::TrackerPlacementParameters parameters = this->Parameters;
  parameters.fixed = static_cast<std::size_t>(this->FixedVolume);
  const echorama::TrackerPlacement placement = echorama::PlaceByTracker(track, tracked, calibration, parameters);
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    vtkNew<vtkImageData> moved;
    moved->ShallowCopy(volumes[i].Image);
    if (i != parameters.fixed) {
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
int vtkUltrasoundTrackerPlacement::GetNumberOfVolumes() const
{
  return static_cast<int>(this->Poses.size());
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
  os << indent << "RecordingUnitMm: " << this->RecordingUnitMm << "\n";
  os << indent << "Tool: " << TextOf(this->Tool) << "\n";
  os << indent << "PoseArray: " << TextOf(this->PoseArray) << "\n";
  os << indent << "CalibrationFile: " << TextOf(this->CalibrationFile) << "\n";
  os << indent << "VolumeToSensor:";
  for (const double number : this->VolumeToSensor) {
    os << " " << number;
  }
  os << "\n" << indent << "VolumeFrame: " << this->VolumeFrame << "\n";
  os << indent << "Times: " << this->GetNumberOfTimes() << "\n";
  os << indent << "WindowSeconds: " << this->GetWindowSeconds() << "\n";
  os << indent << "LongestGapSeconds: " << this->GetLongestGapSeconds() << "\n";
  os << indent << "FixedVolume: " << this->FixedVolume << "\n";
  os << indent << "ErrorMm: " << this->ErrorMm << "\n";
}
