// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPoseEditor.h"

#include "AlignmentScore.h"
#include "ValidPoints.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMath.h"
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

namespace {
using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
constexpr double NotANumber = std::numeric_limits<double>::quiet_NaN();

// Whole quarter turns are exact: a turn by 90 degrees leaves no dust of rounding.
Eigen::Matrix3d Turn(double degrees, int axis)
{
  const double whole = std::remainder(degrees, 360.0);
  double cosine = std::cos(vtkMath::RadiansFromDegrees(whole)), sine = std::sin(vtkMath::RadiansFromDegrees(whole));
  if (std::remainder(whole, 90.0) == 0.0) {
    cosine = std::round(cosine);
    sine = std::round(sine);
  }
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  matrix(a, a) = matrix(b, b) = cosine;
  matrix(b, a) = sine;
  matrix(a, b) = -sine;
  return matrix;
}

// The motion that an earlier filter has told, as far as it is one.
Pose VolumeToWorldOf(vtkImageData* image)
{
  auto* array = vtkDoubleArray::SafeDownCast(image->GetFieldData()->GetArray(vtkUltrasoundAligner::VolumeToWorldName()));
  Pose pose = Pose::Identity();
  if (array && array->GetNumberOfValues() == 16) {
    const RowMajor matrix = Eigen::Map<const RowMajor>(array->GetPointer(0));
    if (matrix.allFinite() && echorama::IsRotation(matrix.topLeftCorner<3, 3>())) {
      pose.matrix() = matrix;
    }
  }
  return pose;
}

vtkSmartPointer<vtkDoubleArray> NewNumbers(const char* name, int components = 1)
{
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  return array;
}
} // namespace

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
  const RowMajor rows = this->Motion.matrix();
  motion->DeepCopy(rows.data());
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::FillInputPortInformation(int port, vtkInformation* info)
{
  // The tree comes first: the pipeline looks there to see that composite data is wanted whole, not leaf by leaf.
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  info->Set(INPUT_IS_REPEATABLE(), 1);
  info->Set(INPUT_IS_OPTIONAL(), port == 1 ? 1 : 0);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  // Without this, ranks other than the first would be handed empty data.
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  vtkUltrasoundVolume::RequestWhole(inputs[1]);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundPoseEditor::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Score = NotANumber;
  this->Motion = Pose::Identity();
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    // 1. what came in, and which of it is moved
    progress(0.0);
    const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
    const auto truth = vtkUltrasoundVolume::CollectInputs(this, inputs[1]);
    const int count = static_cast<int>(volumes.size());
    std::vector<bool> moves(volumes.size(), false);
    for (const int volume : this->Volumes) {
      if (volume < 0 || volume >= count) {
        throw Error(Error::Kind::InvalidParameter,
                    "there is no volume " + std::to_string(volume) + "; there are " + std::to_string(count) + ", counted from 0");
      }
      moves[static_cast<std::size_t>(volume)] = true;
    }
    for (int volume = 0; this->Volumes.empty() && volume < count; ++volume) {
      moves[static_cast<std::size_t>(volume)] = count == 1 || volume != this->FixedVolume;
    }

    // 2. the motion
    Vector3d centre = Vector3d::Zero();
    if (this->RotateAbout == CENTRE) {
      centre = Vector3d(this->Centre);
    } else if (this->RotateAbout == MIDDLE) {
      int chosen = 0;
      for (std::size_t i = 0; i < volumes.size(); ++i) {
        if (moves[i]) {
          centre += vtkUltrasoundVolume::GeometryOf(volumes[i].Image).Centre();
          ++chosen;
        }
      }
      centre /= std::max(1, chosen);
    }
    const Eigen::Matrix3d rotation = Turn(this->Rotation[2], 2) * Turn(this->Rotation[0], 0) * Turn(this->Rotation[1], 1);
    Pose motion = Pose::Identity();
    motion.linear() = rotation;
    motion.translation() = centre - rotation * centre + Vector3d(this->Translation);
    if (!motion.matrix().allFinite()) {
      throw Error(Error::Kind::InvalidParameter, "Translation, Rotation and Centre must be numbers");
    }

    // 3. the same voxels there
    auto* output = vtkMultiBlockDataSet::GetData(outputs);
    output->SetNumberOfBlocks(static_cast<unsigned int>(volumes.size()));
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      vtkNew<vtkImageData> placed;
      placed->ShallowCopy(volumes[i].Image);
      Pose pose = VolumeToWorldOf(placed);
      if (moves[i]) {
        vtkUltrasoundVolume::Move(placed, motion);
        pose = motion * pose;
      }
      const RowMajor rows = pose.matrix();
      const auto field = NewNumbers(vtkUltrasoundAligner::VolumeToWorldName(), 16);
      field->InsertNextTuple(rows.data());
      placed->GetFieldData()->AddArray(field);
      const auto block = static_cast<unsigned int>(i);
      output->SetBlock(block, placed);
      output->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volumes[i].Name.c_str());
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
    std::map<DrawnFrom, std::vector<Vector3d>> drawn;
    std::vector<echorama::ScoredVolume> scored(volumes.size());
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      const auto& volume = volumes[i];
      const DrawnFrom from{volume.Intensity->GetMTime(), volume.ValidRegion ? volume.ValidRegion->GetMTime() : 0,
                           static_cast<unsigned long long>(this->Points), static_cast<unsigned long long>(this->Seed)};
      const auto known = this->Drawn.find(from);
      auto& points = drawn[from];
      if (known != this->Drawn.end()) {
        points = known->second;
      } else {
        vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto type) {
          const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volume);
          points = echorama::ValidPoints<decltype(type)>(posed.intensity, posed.valid, this->Points,
                                                         static_cast<std::uint64_t>(this->Seed));
        });
      }
      scored[i].aligned =
          vtkUltrasoundVolume::GeometryOf(vtkImageData::SafeDownCast(output->GetBlock(static_cast<unsigned int>(i))));
      scored[i].truth = vtkUltrasoundVolume::GeometryOf(truth[i].Image);
      scored[i].indexPoints = points;
      scored[i].name = volume.Name;
    }
    this->Drawn = std::move(drawn);
    const echorama::AlignmentScore score = echorama::ScoreAlignment(scored, this->FixedVolume);
    const auto total = NewNumbers("Score"), each = NewNumbers("VolumeScore");
    total->InsertNextValue(score.mean);
    for (const echorama::VolumeScore& volume : score.volumes) {
      each->InsertNextValue(volume.mean);
    }
    output->GetFieldData()->AddArray(total);
    output->GetFieldData()->AddArray(each);
    this->Score = score.mean;
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPoseEditor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Volumes:";
  for (const int volume : this->Volumes) {
    os << " " << volume;
  }
  const auto print = [&](const char* name, const double numbers[3]) {
    os << indent << name << ": " << numbers[0] << " " << numbers[1] << " " << numbers[2] << "\n";
  };
  os << "\n";
  print("Translation", this->Translation);
  print("Rotation", this->Rotation);
  os << indent << "RotateAbout: " << this->RotateAbout << "\n";
  print("Centre", this->Centre);
  os << indent << "FixedVolume: " << this->FixedVolume << "\n";
  os << indent << "Points: " << this->Points << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "Score: " << this->Score << "\n";
}
