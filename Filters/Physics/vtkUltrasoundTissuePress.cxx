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

//----------------------------------------------------------------------------
vtkUltrasoundTissuePress::vtkUltrasoundTissuePress()
{
  this->SetNumberOfInputPorts(2);
}

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
  const std::vector<echorama::PlacedProbe> probes = vtkUltrasoundAcquisition::ProbesOf(inputs[1]);
  echorama::TissueBody body =
      echorama::TissueBodyOf(vtkUltrasoundTissue::Of(vtkPolyData::GetData(inputs[0])), this->Lattice, progress.Part(0.0, 0.05));

  // 2. the kernel
  const double start = probes.empty() ? 1.0 : 0.1;
  echorama::TissuePress press(std::move(body), this->Values, progress.Part(0.05, start));
  std::shared_ptr<const echorama::ProbeShape> shape;
  for (std::size_t n = 0; n < probes.size(); ++n) {
    if (n == 0 || !(probes[n].geometry == probes[n - 1].geometry)) {
      shape = std::make_shared<const echorama::ProbeShape>(probes[n].geometry, this->Head);
    }
    const auto at = [&](std::size_t number) {
      return start + (1.0 - start) * static_cast<double>(number) / static_cast<double>(probes.size());
    };
    try {
      press.Move(shape, probes[n].probeToWorld, progress.Part(at(n), at(n + 1)));
    } catch (const Error& error) {
      throw Error(error.GetKind(), "probe " + std::to_string(n + 1) + ": " + error.what());
    }
  }

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
