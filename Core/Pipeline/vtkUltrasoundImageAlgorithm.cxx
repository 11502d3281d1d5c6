// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundImageAlgorithm.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

//----------------------------------------------------------------------------
int vtkUltrasoundImageAlgorithm::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* in = this->GetNumberOfInputPorts() > 0 ? inputs[0]->GetInformationObject(0) : nullptr;
  if (in) {
    vtkInformation* out = outputs->GetInformationObject(0);
    out->CopyEntry(in, vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT());
    out->CopyEntry(in, vtkDataObject::ORIGIN());
    out->CopyEntry(in, vtkDataObject::SPACING());
    out->CopyEntry(in, vtkDataObject::DIRECTION());
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundImageAlgorithm::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port) {
    vtkUltrasoundVolume::RequestWhole(inputs[port]);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundImageAlgorithm::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    vtkImageData* output = vtkImageData::GetData(outputs);
    this->Execute(inputs, output, progress);
    vtkInformation* out = outputs->GetInformationObject(0);
    if (out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT())) {
      int wanted[6];
      out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
      output->Crop(wanted); // does nothing when all was wanted
    }
  });
}

//----------------------------------------------------------------------------
vtkDataArray* vtkUltrasoundImageAlgorithm::CopyWithNewIntensity(vtkImageData* input, vtkDataArray* intensity,
                                                                vtkImageData* output, int vtkType)
{
  const std::string name = intensity->GetName() ? intensity->GetName() : vtkUltrasoundVolume::IntensityName();
  output->ShallowCopy(input);
  vtkDataArray* fresh = AddArray(output, name.c_str(), vtkType);
  output->GetPointData()->SetActiveScalars(name.c_str());
  return fresh;
}

//----------------------------------------------------------------------------
vtkDataArray* vtkUltrasoundImageAlgorithm::AddArray(vtkImageData* output, const char* name, int vtkType)
{
  const auto fresh = vtkUltrasoundVolume::NewArray(vtkType, output->GetNumberOfPoints(), name);
  output->GetPointData()->AddArray(fresh); // replaces one of the same name
  return fresh;                            // the output holds it
}
