// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAligner.h"

#include "AlignmentJson.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/FormatText.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Sharing/ControllerWork.h"
#include "PreparedVolume.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundLandmarkField.h"

#include <algorithm>

vtkStandardNewMacro(vtkUltrasoundAligner);

vtkUltrasoundParametersMacro(vtkUltrasoundAligner);

namespace {

echorama::PreparedVolume Prepare(const vtkUltrasoundVolume::Input& volume, bool withReliability,
                                 const echorama::Progress& progress)
{
  const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(volume.Image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(volume.Image);
  const auto probe = geometry && pose ? std::optional(echorama::PlacedProbe{*geometry, *pose}) : std::nullopt;
  echorama::PreparedVolume prepared;
  vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto type) {
    prepared =
        echorama::PrepareVolume(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volume), withReliability, probe, progress);
  });
  return prepared;
}

// Of all that Prepare depends on.
std::string ContentOf(const vtkUltrasoundVolume::Input& volume, bool withReliability)
{
  std::string content = withReliability ? "reliable " : "";
  const auto add = [&content](const auto& numbers) {
    content += echorama::Checksum(numbers.data(), numbers.size() * sizeof(double));
  };
  for (vtkDataArray* array : {volume.Intensity, volume.ValidRegion})
    content += array ? array->GetDataTypeAsString() +
                           echorama::Checksum(array->GetVoidPointer(0),
                                              static_cast<std::size_t>(array->GetDataSize() * array->GetDataTypeSize()))
                     : "-";
  const echorama::ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(volume.Image);
  content += echorama::SizeText(geometry.dimensions);
  add(geometry.origin);
  add(geometry.spacing);
  add(geometry.direction);
  for (const char* name : {vtkUltrasoundAcquisition::ProbeGeometryName(), vtkUltrasoundAcquisition::ProbeToWorldName()})
    if (vtkDataArray* array = volume.Image->GetFieldData()->GetArray(name)) {
      std::vector<double> values;
      for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
        values.insert(values.end(), array->GetTuple(i), array->GetTuple(i) + array->GetNumberOfComponents());
      add(values);
    }
  return content;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundAligner::Parameters()
{
  using echorama::Parameter;
  Settings& v = this->Values;
  return echorama::Join(
      {{Parameter("FixedVolume", v.fixedVolume, {0, echorama::Unlimited}, "",
                  "The volume that stays where it is, counted from 0."),
        Parameter("UseReliability", v.useReliability, "Whether shadowed and saturated voxels count less.")},
       Describe(v.align.pair),
       Describe(v.align.resources),
       {Parameter("DryRun", v.dryRun, "Whether it is only told what would be done: pairs, memory and time. No volume is moved.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
vtkUltrasoundAligner::vtkUltrasoundAligner()
{
  this->SetController(vtkMultiProcessController::GetGlobalController());
}

//----------------------------------------------------------------------------
vtkUltrasoundAligner::~vtkUltrasoundAligner()
{
  this->SetController(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::SetController(vtkMultiProcessController* controller)
{
  vtkSetObjectBodyMacro(Controller, vtkMultiProcessController, controller);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::AddHeldVolume(int volume)
{
  this->Values.align.held.push_back(volume);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::ClearHeldVolumes()
{
  if (!this->Values.align.held.empty()) {
    this->Values.align.held.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::GetNumberOfHeldVolumes() const
{
  return static_cast<int>(this->Values.align.held.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::AddLandmarkFile(const char* file)
{
  this->Landmarks.files.emplace_back(file ? file : "");
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::ClearLandmarkFiles()
{
  this->Landmarks.files.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::AddLandmark(int volume, const char* label, double x, double y, double z)
{
  this->Landmarks.points[volume].push_back({label ? label : "", {x, y, z}});
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::ClearLandmarks()
{
  this->Landmarks.points.clear();
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                   const echorama::Progress& progress)
{
  this->Found = {};
  this->Planned = {};
  echorama::ControllerWork<vtkMultiProcessController> shared(this->Controller);
  try {
    shared.Run([&] { this->Align(inputs, outputs, shared, progress); });
  } catch (...) {
    this->Found = {}; // another rank may have failed after this one was done
    throw;
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::Align(vtkInformationVector** inputs, vtkInformationVector* outputs, echorama::SharedWork& shared,
                                 const echorama::Progress& progress)
{
  echorama::CheckRanges(this->Parameters());
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  auto landmarks = this->Landmarks.Lists(static_cast<int>(volumes.size()));
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const auto carried = vtkUltrasoundLandmarkField::Of(volumes[i].Image);
    landmarks[i].insert(landmarks[i].end(), carried.begin(), carried.end());
  }

  // 1. what they are; their resolutions are made when a pair asks for them
  std::vector<echorama::VolumeOnDemand> demanded;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    echorama::VolumeOnDemand volume;
    volume.placed.name = volumes[i].Name;
    volume.placed.landmarks = landmarks[i];
    volume.prepare = [this, &input = volumes[i]](bool withReliability, const echorama::Progress& part) {
      return Prepare(input, withReliability && this->Values.useReliability, part);
    };
    if (!this->Values.align.resources.finishedPairs.empty())
      volume.content = ContentOf(volumes[i], this->Values.useReliability);
    demanded.push_back(std::move(volume));
  }

  // 2. where they belong
  if (this->Values.dryRun) {
    if (shared.Rank() == 0) {
      this->Planned = echorama::PlanAlignment(demanded, this->Values.fixedVolume, this->Values.align, progress);
    }
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      vtkNew<vtkImageData> same;
      same->ShallowCopy(volumes[i].Image);
      PutBlock(outputs, 0, i, same, volumes[i].Name);
    }
    return;
  }
  echorama::AlignVolumesParameters parameters = this->Values.align;
  parameters.shared = &shared;
  echorama::AlignVolumesResult found = echorama::AlignVolumesOnDemand(demanded, this->Values.fixedVolume, parameters, progress);

  // 3. the same voxels there
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const echorama::VolumeAlignment& result = found.volumes[i];
    vtkNew<vtkImageData> moved;
    moved->ShallowCopy(volumes[i].Image);
    if (static_cast<int>(i) != this->Values.fixedVolume) {
      vtkUltrasoundVolume::Move(moved, result.volumeToWorld);
      vtkUltrasoundVolume::AddField(moved, AlignmentOverlapName(), &result.overlap, 1);
    }
    vtkUltrasoundVolume::AddField(moved, VolumeToWorldName(), echorama::MatrixRows(result.volumeToWorld.matrix()).data(), 16);
    vtkUltrasoundVolume::AddField(moved, AlignmentVerdictName(), echorama::NameOf(result.verdict));
    vtkUltrasoundVolume::AddField(moved, AlignmentReasonName(), result.reason);
    vtkUltrasoundVolume::AddField(moved, AlignmentSimilarityName(), &result.similarity, 1);
    vtkUltrasoundVolume::AddField(moved, AlignmentCovarianceName(), result.covariance.data(), 36); // symmetric: rows are columns
    vtkUltrasoundVolume::AddField(moved, AlignmentCentreName(), result.centre.data(), 3);
    PutBlock(outputs, 0, i, moved, volumes[i].Name);
  }
  this->Found = std::move(found);
}

//----------------------------------------------------------------------------
const echorama::VolumeAlignment* vtkUltrasoundAligner::ResultOf(int volume) const
{
  return volume >= 0 && volume < this->GetNumberOfVolumes() ? &this->Found.volumes[static_cast<std::size_t>(volume)] : nullptr;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::GetNumberOfVolumes() const
{
  return static_cast<int>(this->Found.volumes.size());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::GetPose(int volume, vtkMatrix4x4* pose) const
{
  if (const auto* result = this->ResultOf(volume)) {
    vtkUltrasoundVolume::SetMatrix(pose, result->volumeToWorld);
  }
  return this->ResultOf(volume) != nullptr;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetOverlap(int volume) const
{
  return this->ResultOf(volume) ? this->ResultOf(volume)->overlap : 0.0;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetSimilarity(int volume) const
{
  return this->ResultOf(volume) ? this->ResultOf(volume)->similarity : 0.0;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetVerdict(int volume) const
{
  return this->ResultOf(volume) ? echorama::NameOf(this->ResultOf(volume)->verdict) : std::string();
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetReason(int volume) const
{
  return this->ResultOf(volume) ? this->ResultOf(volume)->reason : std::string();
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetReport() const
{
  return this->Found.volumes.empty() ? std::string() : echorama::Report(this->Found);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetPlan() const
{
  return this->Planned.budgetBytes > 0.0 ? echorama::Report(this->Planned) : std::string();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::GetAllAligned() const
{
  const auto& volumes = this->Found.volumes;
  return !volumes.empty() && std::all_of(volumes.begin(), volumes.end(), [](const echorama::VolumeAlignment& volume) {
    return volume.verdict == echorama::Verdict::Aligned;
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "HeldVolumes: " << this->Values.align.held.size() << "\n";
  os << indent << "LandmarksOfVolumes: " << this->Landmarks.Count() << "\n";
  os << indent << "Volumes: " << this->Found.volumes.size() << "\n";
}
