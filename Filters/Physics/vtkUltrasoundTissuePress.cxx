// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTissuePress.h"

#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundDisplacement.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundTissuePress);

vtkUltrasoundParametersMacro(vtkUltrasoundTissuePress);

namespace {

void AddMarks(vtkImageData* image, const char* name, const std::vector<unsigned char>& values)
{
  vtkNew<vtkUnsignedCharArray> array;
  array->SetName(name);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  std::copy(values.begin(), values.end(), array->GetPointer(0));
  image->GetPointData()->AddArray(array);
}

} // namespace

// Where the tissue came to rest, and all that it depends on.
struct vtkUltrasoundTissuePress::State {
  const vtkPolyData* Tissue = nullptr;
  vtkMTimeType TissueTime = 0;
  std::string Parameters;
  std::vector<echorama::PlacedProbe> Probes; ///< where it has been
  std::shared_ptr<const echorama::ProbeShape> Shape;
  std::unique_ptr<echorama::TissuePress> Press;

  bool LeadsTo(const State& other) const
  {
    return this->Tissue == other.Tissue && this->TissueTime == other.TissueTime && this->Parameters == other.Parameters &&
           this->Probes.size() <= other.Probes.size() &&
           std::equal(this->Probes.begin(), this->Probes.end(), other.Probes.begin(),
                      [](const echorama::PlacedProbe& a, const echorama::PlacedProbe& b) {
                        return a.geometry == b.geometry && a.probeToWorld.matrix() == b.probeToWorld.matrix();
                      });
  }
};

//----------------------------------------------------------------------------
vtkUltrasoundTissuePress::vtkUltrasoundTissuePress()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundTissuePress::~vtkUltrasoundTissuePress() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTissuePress::Parameters()
{
  return echorama::Join({Describe(this->Lattice), Describe(this->Values), Describe(this->Head)});
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissuePress::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkPolyData" : "vtkDataObject");
  if (port == 1) {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
    info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissuePress::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // The lattice covers the tissue, which must be there for that.
  if (!vtkUltrasoundVolume::MakeInput(this, 0)) {
    return 0;
  }
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress&) {
    vtkUltrasoundVolume::SetGeometry(
        outputs->GetInformationObject(0),
        echorama::TissueLatticeOf(vtkUltrasoundTissue::Of(vtkPolyData::GetData(inputs[0])), this->Lattice));
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissuePress::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  // 1. what came in
  echorama::CheckRanges(this->Parameters());
  auto state = std::make_unique<State>();
  state->Tissue = vtkPolyData::GetData(inputs[0]);
  state->TissueTime = vtkPolyData::GetData(inputs[0])->GetMTime();
  state->Parameters = echorama::DescriptionText(this->Parameters());
  state->Probes = vtkUltrasoundAcquisition::ProbesOf(inputs[1]);

  // 2. the kernel, from where it was if it can go on from there; after a failure it cannot
  const std::vector<echorama::PlacedProbe>& probes = state->Probes;
  const std::unique_ptr<State> kept = std::move(this->Kept);
  const double start = probes.empty() ? 1.0 : 0.1;
  std::size_t first = 0;
  if (kept && kept->LeadsTo(*state)) {
    state->Shape = kept->Shape;
    state->Press = std::move(kept->Press);
    first = kept->Probes.size();
  } else {
    echorama::TissueBody body =
        echorama::TissueBodyOf(vtkUltrasoundTissue::Of(vtkPolyData::GetData(inputs[0])), this->Lattice, progress.Part(0.0, 0.05));
    state->Press = std::make_unique<echorama::TissuePress>(std::move(body), this->Values, progress.Part(0.05, start));
  }
  echorama::TissuePress& press = *state->Press;
  for (std::size_t n = first; n < probes.size(); ++n) {
    if (n == 0 || !(probes[n].geometry == probes[n - 1].geometry)) {
      state->Shape = std::make_shared<const echorama::ProbeShape>(probes[n].geometry, this->Head);
    }
    const auto at = [&](std::size_t number) {
      return start + (1.0 - start) * static_cast<double>(number - first) / static_cast<double>(probes.size() - first);
    };
    try {
      press.Move(state->Shape, probes[n].probeToWorld, progress.Part(at(n), at(n + 1)));
    } catch (const Error& error) {
      throw Error(error.GetKind(), "probe " + std::to_string(n + 1) + ": " + error.what());
    }
  }
  this->Kept = std::move(state);

  // 3. what goes out
  SetOutput(press.Now(), output);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissuePress::SetOutput(const echorama::PressedTissue& pressed, vtkImageData* output)
{
  output->Initialize(); // the pipeline has passed on what the tissue says of itself
  vtkUltrasoundVolume::SetGeometry(output, pressed.nodes);
  vtkNew<vtkDoubleArray> displacement;
  displacement->SetName(vtkUltrasoundDisplacement::DisplacementName());
  displacement->SetNumberOfComponents(3);
  displacement->SetNumberOfTuples(static_cast<vtkIdType>(pressed.displacements.size()));
  for (std::size_t n = 0; n < pressed.displacements.size(); ++n) {
    displacement->SetTuple(static_cast<vtkIdType>(n), pressed.displacements[n].data());
  }
  output->GetPointData()->SetVectors(displacement);
  AddMarks(output, TissueName(), pressed.tissueNodes);
  AddMarks(output, ContactName(), pressed.contactNodes);
  const double volumes[2] = {pressed.relativeVolume, pressed.leastVolume};
  vtkUltrasoundVolume::AddField(output, ProbeForceName(), pressed.forceN.data(), 3);
  vtkUltrasoundVolume::AddField(output, RelativeVolumeName(), volumes, 2);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissuePress::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
