// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAligner.h"

#include "AlignInTurn.h"
#include "vtkDataObjectTree.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <cstring>

vtkStandardNewMacro(vtkUltrasoundAligner);

namespace {
using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

void AddField(vtkDataObject* data, const char* name, const double* values, int components)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->InsertNextTuple(values);
  data->GetFieldData()->AddArray(array);
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundAligner::vtkUltrasoundAligner()
{
  const echorama::AlignSearchParameters defaults;
  this->MinimumOverlap = defaults.minimumOverlap;
  this->Samples = defaults.samples;
  this->Levels = defaults.levels;
  this->FirstStepMm = defaults.firstStepMm;
  this->FirstStepDegrees = defaults.firstStepDegrees;
  this->Repeats = defaults.repeats;
  this->Points = defaults.points;
  this->Seed = static_cast<int>(defaults.seed);
  this->Pyramid = defaults.pyramid;
}

//----------------------------------------------------------------------------
vtkUltrasoundAligner::~vtkUltrasoundAligner() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::SetMethod(const char* name)
{
  if (!name || std::strcmp(name, this->GetMethod()) != 0) {
    vtkErrorMacro("there is no alignment method named \"" << (name ? name : "") << "\"; the methods are: search");
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::SetParameter(const char* name, double value)
{
  struct Parameter {
    const char* Name;
    double From, To;
    bool Whole;
    void (vtkUltrasoundAligner::*SetReal)(double);
    void (vtkUltrasoundAligner::*SetWhole)(int);
  };
  using Self = vtkUltrasoundAligner;
  static const Parameter parameters[] = {
      {"MinimumOverlap", 0.01, 1.0, false, &Self::SetMinimumOverlap, nullptr},
      {"Samples", 3, 7, true, nullptr, &Self::SetSamples},
      {"Levels", 1, 20, true, nullptr, &Self::SetLevels},
      {"FirstStepMm", 1e-6, 1000.0, false, &Self::SetFirstStepMm, nullptr},
      {"FirstStepDegrees", 1e-6, 60.0, false, &Self::SetFirstStepDegrees, nullptr},
      {"Repeats", 0, 100, true, nullptr, &Self::SetRepeats},
      {"Points", 100, 1e7, true, nullptr, &Self::SetPoints},
      {"Seed", 0, VTK_INT_MAX, true, nullptr, &Self::SetSeed},
      {"Pyramid", 0, 1, true, nullptr, nullptr},
  };
  std::string names;
  for (const Parameter& p : parameters) {
    names += (names.empty() ? "" : ", ") + std::string(p.Name);
    if (!name || std::strcmp(name, p.Name) != 0) {
      continue;
    }
    if (!(value >= p.From && value <= p.To) || (p.Whole && value != std::floor(value))) {
      vtkErrorMacro(<< p.Name << " must be " << (p.Whole ? "a whole number" : "a number") << " in [" << p.From << ", " << p.To
                    << "]; it is not " << value);
      return false;
    }
    if (p.SetReal) {
      (this->*p.SetReal)(value);
    } else if (p.SetWhole) {
      (this->*p.SetWhole)(static_cast<int>(value));
    } else {
      this->SetPyramid(value != 0.0);
    }
    return true;
  }
  vtkErrorMacro("the method search has no parameter named \"" << (name ? name : "") << "\"; it has: " << names);
  return false;
}

//----------------------------------------------------------------------------
echorama::AlignSearchParameters vtkUltrasoundAligner::Parameters() const
{
  echorama::AlignSearchParameters p;
  p.minimumOverlap = this->MinimumOverlap;
  p.samples = this->Samples;
  p.levels = this->Levels;
  p.firstStepMm = this->FirstStepMm;
  p.firstStepDegrees = this->FirstStepDegrees;
  p.repeats = this->Repeats;
  p.points = this->Points;
  p.seed = static_cast<std::uint64_t>(this->Seed);
  p.pyramid = this->Pyramid;
  return p;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::FillInputPortInformation(int, vtkInformation* info)
{
  // The tree comes first: the pipeline looks there to see that composite data is wanted whole, not leaf by leaf.
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  info->Set(INPUT_IS_REPEATABLE(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  // Without this, ranks other than the first would be handed empty data.
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Results.clear();
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
    const echorama::AlignSearchParameters parameters = this->Parameters();
    parameters.Check();

    // 1. the resolutions of each volume
    std::vector<std::vector<echorama::PyramidLevel>> pyramids(volumes.size());
    std::vector<echorama::PlacedVolume> placed(volumes.size());
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      const double count = static_cast<double>(volumes.size());
      const auto part = progress.Part(0.1 * static_cast<double>(i) / count, 0.1 * static_cast<double>(i + 1) / count);
      vtkUltrasoundVolume::Dispatch(volumes[i].Intensity, [&](auto type) {
        pyramids[i] = echorama::BuildPyramid(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volumes[i]), {}, part);
      });
      placed[i].pyramid = &pyramids[i];
      placed[i].name = volumes[i].Name;
    }

    // 2. where they belong
    const auto results = echorama::AlignInTurn(placed, this->FixedVolume, parameters, progress.Part(0.1, 1.0));

    // 3. the same voxels there
    auto* output = vtkMultiBlockDataSet::GetData(outputs);
    output->SetNumberOfBlocks(static_cast<unsigned int>(volumes.size()));
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      vtkNew<vtkImageData> moved;
      moved->ShallowCopy(volumes[i].Image);
      if (static_cast<int>(i) != this->FixedVolume) {
        vtkUltrasoundVolume::Move(moved, results[i].volumeToWorld);
        AddField(moved, AlignmentErrorName(), &results[i].error, 1);
        AddField(moved, AlignmentOverlapName(), &results[i].overlap, 1);
      }
      const RowMajor rows = results[i].volumeToWorld.matrix();
      AddField(moved, VolumeToWorldName(), rows.data(), 16);
      const auto block = static_cast<unsigned int>(i);
      output->SetBlock(block, moved);
      output->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volumes[i].Name.c_str());
    }
    this->Results = results;
  });
}

//----------------------------------------------------------------------------
const echorama::AlignSearchResult* vtkUltrasoundAligner::ResultOf(int volume) const
{
  return volume >= 0 && volume < this->GetNumberOfVolumes() ? &this->Results[static_cast<std::size_t>(volume)] : nullptr;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::GetNumberOfVolumes() const
{
  return static_cast<int>(this->Results.size());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::GetPose(int volume, vtkMatrix4x4* pose) const
{
  const auto* result = this->ResultOf(volume);
  if (result) {
    const RowMajor rows = result->volumeToWorld.matrix();
    pose->DeepCopy(rows.data());
  }
  return result != nullptr;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetError(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->error : 0.0;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetOverlap(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->overlap : 0.0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FixedVolume: " << this->FixedVolume << "\n";
  os << indent << "Method: " << this->GetMethod() << "\n";
  os << indent << "MinimumOverlap: " << this->MinimumOverlap << "\n";
  os << indent << "Samples: " << this->Samples << "\n";
  os << indent << "Levels: " << this->Levels << "\n";
  os << indent << "FirstStepMm: " << this->FirstStepMm << "\n";
  os << indent << "FirstStepDegrees: " << this->FirstStepDegrees << "\n";
  os << indent << "Repeats: " << this->Repeats << "\n";
  os << indent << "Points: " << this->Points << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "Pyramid: " << (this->Pyramid ? "on" : "off") << "\n";
  os << indent << "Volumes: " << this->Results.size() << "\n";
}
