// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDisagreement.h"

#include "Core/Base/Percentile.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <array>
#include <cmath>
#include <limits>

using echorama::Error;
using echorama::LocalShift;

vtkStandardNewMacro(vtkUltrasoundDisagreement);

vtkUltrasoundParametersMacro(vtkUltrasoundDisagreement);

namespace {
constexpr double NotANumber = std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundDisagreement::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundDisagreement::vtkUltrasoundDisagreement()
{
  this->Forget();
}

//----------------------------------------------------------------------------
void vtkUltrasoundDisagreement::Forget()
{
  this->Blocks = this->KnownBlocks = 0;
  this->Median = this->Percentile95 = NotANumber;
}

//----------------------------------------------------------------------------
int vtkUltrasoundDisagreement::FillInputPortInformation(int /*port*/, vtkInformation* info)
{
  vtkUltrasoundVolume::AcceptVolumes(info);
  return 1;
}

//----------------------------------------------------------------------------
echorama::ImageGeometry vtkUltrasoundDisagreement::GridOf(const std::vector<vtkUltrasoundVolume::Input>& volumes) const
{
  std::vector<echorama::ImageGeometry> geometries;
  for (const vtkUltrasoundVolume::Input& volume : volumes) {
    geometries.push_back(vtkUltrasoundVolume::GeometryOf(volume.Image));
  }
  return echorama::DisagreementGrid(geometries, this->Values);
}

//----------------------------------------------------------------------------
int vtkUltrasoundDisagreement::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    if (!vtkUltrasoundVolume::MakeInput(this, 0)) {
      throw Error(Error::Kind::BadInput, "a volume could not be made");
    }
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0),
                                     this->GridOf(vtkUltrasoundVolume::CollectInputs(this, inputs[0])));
  });
}

//----------------------------------------------------------------------------
echorama::DisagreementMap vtkUltrasoundDisagreement::Compare(const std::vector<vtkUltrasoundVolume::Input>& volumes,
                                                             const echorama::DisagreementParameters& parameters,
                                                             const echorama::Progress& progress)
{
  std::vector<std::vector<echorama::PyramidLevel>> pyramids(volumes.size());
  std::vector<echorama::PlacedVolume> placed;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const double share = 0.3 / static_cast<double>(volumes.size());
    vtkUltrasoundVolume::Dispatch(volumes[i].Intensity, [&](auto type) {
      pyramids[i] = echorama::BuildPyramid(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volumes[i]), {},
                                           progress.Part(share * static_cast<double>(i), share * static_cast<double>(i + 1)));
    });
    placed.push_back({&pyramids[i], echorama::Pose::Identity(), volumes[i].Name}); // their poses are in their geometry
  }
  return echorama::Disagreement(placed, parameters, progress.Part(0.3, 1.0));
}

//----------------------------------------------------------------------------
void vtkUltrasoundDisagreement::PutOut(const echorama::DisagreementMap& map, const echorama::ImageGeometry& grid,
                                       vtkImageData* output)
{
  vtkUltrasoundVolume::SetGeometry(output, grid);
  const auto add = [output](const char* name, int type, int components, double nothing) {
    auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
    array->SetName(name);
    array->SetNumberOfComponents(components);
    array->SetNumberOfTuples(output->GetNumberOfPoints());
    array->Fill(nothing);
    output->GetPointData()->AddArray(array);
    return array.Get(); // the output holds it
  };
  vtkDataArray* lengths = add("Disagreement", VTK_FLOAT, 1, NotANumber);
  vtkDataArray* shifts = add("Shift", VTK_FLOAT, 3, 0.0);
  vtkDataArray* deviations = add("Deviation", VTK_FLOAT, 1, 0.0);
  vtkDataArray* correlations = add("Correlation", VTK_FLOAT, 1, 0.0);
  vtkDataArray* directions = add("KnownDirections", VTK_UNSIGNED_CHAR, 1, 0.0);
  vtkDataArray* first = add("FirstVolume", VTK_SHORT, 1, -1.0);
  vtkDataArray* second = add("SecondVolume", VTK_SHORT, 1, -1.0);
  output->GetPointData()->SetActiveScalars("Disagreement");
  output->GetPointData()->SetActiveVectors("Shift");

  const Eigen::Array3d offset = ((map.geometry.origin - grid.origin).array() / grid.spacing.array()).round();
  const auto& n = map.geometry.dimensions;
  for (std::size_t at = 0; at < map.shifts.size(); ++at) {
    const LocalShift& shift = map.shifts[at];
    if (shift.knownDirections == 0) {
      continue;
    }
    const auto number = static_cast<int>(at);
    int block[3] = {number % n[0], number / n[0] % n[1], number / (n[0] * n[1])};
    for (int axis = 0; axis < 3; ++axis) {
      block[axis] += static_cast<int>(offset[axis]);
    }
    const vtkIdType id = output->ComputePointId(block);
    lengths->SetComponent(id, 0, shift.mm);
    shifts->SetTuple(id, shift.shift.data());
    deviations->SetComponent(id, 0, shift.errorMm);
    correlations->SetComponent(id, 0, shift.correlation);
    directions->SetComponent(id, 0, shift.knownDirections);
    first->SetComponent(id, 0, map.fixed[at]);
    second->SetComponent(id, 0, map.moving[at]);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundDisagreement::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Forget();
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  const echorama::DisagreementMap map = Compare(volumes, this->Values, progress);
  PutOut(map, this->GridOf(volumes), output);

  this->Blocks = map.compared;
  this->KnownBlocks = map.known;
  std::vector<double> lengths;
  for (const LocalShift& shift : map.shifts) {
    if (shift.knownDirections > 0) {
      lengths.push_back(shift.mm);
    }
  }
  if (!lengths.empty()) {
    this->Median = echorama::Percentile(lengths, 0.5);
    this->Percentile95 = echorama::Percentile(lengths, 0.95);
  }
  const double counts[2] = {static_cast<double>(map.compared), static_cast<double>(map.known)};
  vtkUltrasoundVolume::AddField(output, "Median", &this->Median, 1);
  vtkUltrasoundVolume::AddField(output, "Percentile95", &this->Percentile95, 1);
  vtkUltrasoundVolume::AddField(output, "Blocks", counts, 2);
}

//----------------------------------------------------------------------------
void vtkUltrasoundDisagreement::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Blocks: " << this->Blocks << "\n";
  os << indent << "KnownBlocks: " << this->KnownBlocks << "\n";
  os << indent << "Median: " << this->Median << "\n";
  os << indent << "Percentile95: " << this->Percentile95 << "\n";
}
