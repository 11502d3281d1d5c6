// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPoseEditor.h"

#include "Core/Geometry/MatrixRows.h"
#include "Core/Imaging/ValidPoints.h"
#include "vtkBoundingBox.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundAligner.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <limits>

using echorama::Error;
using echorama::Pose;
using Eigen::Vector3d;

vtkStandardNewMacro(vtkUltrasoundPoseEditor);

vtkUltrasoundParametersMacro(vtkUltrasoundPoseEditor);

namespace {
constexpr double NotANumber = std::numeric_limits<double>::quiet_NaN();

// The motion that an earlier filter has told, as far as it is one.
Pose VolumeToWorldOf(vtkImageData* image)
{
  auto* array = vtkDoubleArray::SafeDownCast(image->GetFieldData()->GetArray(vtkUltrasoundAligner::VolumeToWorldName()));
  Pose pose = Pose::Identity();
  if (array && array->GetNumberOfValues() == 16) {
    const auto told = echorama::FromRows<Pose>(array->GetPointer(0));
    if (told.matrix().allFinite() && echorama::IsRotation(told.linear())) {
      pose = told;
    }
  }
  return pose;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundPoseEditor::Parameters()
{
  using echorama::Parameter;
  Settings& v = this->Values;
  echorama::ParameterList edit = Describe(v.edit), score = Describe(v.score);
  echorama::Named(edit, "Centre").When("RotateAbout", "centre");
  echorama::Named(score, "FixedVolume").help =
      "The volume that stays unless it is named, and on which alignment and truth are taken to agree; counted from 0.";
  echorama::Named(score, "Points").Advanced();
  return echorama::Join(
      {{Parameter(
           "RotateAbout", echorama::Choice(v.rotateAbout, {"world-origin", "middle", "centre"}),
           "What the rotation turns about. The box in ParaView's view shows the motion with the world's origin; the middle "
           "of the chosen volumes is handier to turn by numbers.")},
       edit,
       score});
}

//----------------------------------------------------------------------------
vtkUltrasoundPoseEditor::vtkUltrasoundPoseEditor() : Score(NotANumber)
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundPoseEditor::~vtkUltrasoundPoseEditor() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::AddVolume(int volume)
{
  this->Volumes.push_back(volume);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::ClearVolumes()
{
  if (!this->Volumes.empty()) {
    this->Volumes.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::GetMotion(vtkMatrix4x4* motion) const
{
  vtkUltrasoundVolume::SetMatrix(motion, this->Motion);
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_IS_OPTIONAL(), port == 1 ? 1 : 0);
  return this->Superclass::FillInputPortInformation(port, info);
}

//----------------------------------------------------------------------------
std::vector<bool> vtkUltrasoundPoseEditor::Moves(int count) const
{
  std::vector<bool> moves(static_cast<std::size_t>(count), false);
  for (const int volume : this->Volumes) {
    if (volume < 0 || volume >= count) {
      throw Error(Error::Kind::InvalidParameter,
                  "there is no volume " + std::to_string(volume) + "; there are " + std::to_string(count) + ", counted from 0");
    }
    moves[static_cast<std::size_t>(volume)] = true;
  }
  for (int volume = 0; this->Volumes.empty() && volume < count; ++volume) {
    moves[static_cast<std::size_t>(volume)] = count == 1 || volume != this->Values.score.fixedVolume;
  }
  return moves;
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::PlaceBox(const std::vector<vtkUltrasoundVolume::Input>& volumes, const std::vector<bool>& moves)
{
  vtkBoundingBox box;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    if (moves[i]) {
      box.AddBounds(volumes[i].Image->GetBounds());
    }
  }
  if (box.IsValid()) {
    box.GetBounds(this->BoxBounds);
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::RequestInformation(vtkInformation* request, vtkInformationVector** inputs,
                                                vtkInformationVector* outputs)
{
  // The handle is there before anything is moved. What is wrong with the input, or with the choice, Execute tells.
  try {
    const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
    this->PlaceBox(volumes, this->Moves(static_cast<int>(volumes.size())));
  } catch (const Error&) {
  }
  return this->Superclass::RequestInformation(request, inputs, outputs);
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                      const echorama::Progress& progress)
{
  this->Score = NotANumber;
  this->Motion = Pose::Identity();
  // 1. what came in, and which of it is moved
  progress(0.0);
  echorama::CheckRanges(this->Parameters());
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  const auto truth = vtkUltrasoundVolume::CollectInputs(this, inputs[1]);
  const int count = static_cast<int>(volumes.size());
  const std::vector<bool> moves = this->Moves(count);
  this->PlaceBox(volumes, moves);

  // 2. the motion
  echorama::PoseEdit edit = this->Values.edit;
  if (this->Values.rotateAbout != Settings::Centre::Given) {
    edit.centreMm.setZero();
  }
  if (this->Values.rotateAbout == Settings::Centre::Middle) {
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      edit.centreMm += moves[i] ? vtkUltrasoundVolume::GeometryOf(volumes[i].Image).Centre() : Vector3d::Zero();
    }
    edit.centreMm /= std::max<std::ptrdiff_t>(1, std::count(moves.begin(), moves.end(), true));
  }
  const Pose motion = edit.Motion();

  // 3. the same voxels there
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    vtkNew<vtkImageData> placed;
    placed->ShallowCopy(volumes[i].Image);
    Pose pose = VolumeToWorldOf(placed);
    if (moves[i]) {
      vtkUltrasoundVolume::Move(placed, motion);
      pose = motion * pose;
    }
    vtkUltrasoundVolume::AddField(placed, vtkUltrasoundAligner::VolumeToWorldName(), echorama::MatrixRows(pose.matrix()).data(),
                                  16);
    PutBlock(outputs, 0, i, placed, volumes[i].Name);
  }
  this->Motion = motion;
  if (truth.empty()) {
    return;
  }

  // 4. how far that is from where they belong
  if (truth.size() != volumes.size()) {
    throw Error(Error::Kind::BadInput, "there are " + std::to_string(count) + " volumes and " + std::to_string(truth.size()) +
                                           " true ones; one truth per volume is needed");
  }
  auto* output = vtkMultiBlockDataSet::GetData(outputs);
  std::map<DrawnFrom, std::vector<Vector3d>> drawn;
  std::vector<echorama::ScoredVolume> scored(volumes.size());
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const auto& volume = volumes[i];
    const DrawnFrom from{volume.Intensity->GetMTime(), volume.ValidRegion ? volume.ValidRegion->GetMTime() : 0,
                         static_cast<unsigned long long>(this->Values.score.points), this->Values.score.seed};
    const auto known = this->Drawn.find(from);
    auto& points = drawn[from];
    if (known != this->Drawn.end()) {
      points = known->second;
    } else {
      vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto type) {
        const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volume);
        points = echorama::ValidPoints<decltype(type)>(posed.intensity, posed.valid, this->Values.score.points,
                                                       this->Values.score.seed);
      });
    }
    scored[i].aligned =
        vtkUltrasoundVolume::GeometryOf(vtkImageData::SafeDownCast(output->GetBlock(static_cast<unsigned int>(i))));
    scored[i].truth = vtkUltrasoundVolume::GeometryOf(truth[i].Image);
    scored[i].indexPoints = points;
    scored[i].name = volume.Name;
  }
  this->Drawn = std::move(drawn);
  const echorama::AlignmentScore score = echorama::ScoreAlignment(scored, this->Values.score.fixedVolume);
  vtkNew<vtkDoubleArray> each;
  each->SetName("VolumeScore");
  for (const echorama::VolumeScore& volume : score.volumes) {
    each->InsertNextValue(volume.mean);
  }
  vtkUltrasoundVolume::AddField(output, "Score", &score.mean, 1);
  output->GetFieldData()->AddArray(each);
  this->Score = score.mean;
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Volumes:";
  for (const int volume : this->Volumes) {
    os << " " << volume;
  }
  os << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Score: " << this->Score << "\n";
}
