// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundMultiBlockAlgorithm.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiBlockDataSet.h"

//----------------------------------------------------------------------------
int vtkUltrasoundMultiBlockAlgorithm::FillInputPortInformation(int, vtkInformation* info)
{
  vtkUltrasoundVolume::AcceptVolumes(info);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundMultiBlockAlgorithm::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  // Without this, ranks other than the first would be handed empty data.
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port) {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundMultiBlockAlgorithm::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port) {
    vtkUltrasoundVolume::RequestWhole(inputs[port]);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundMultiBlockAlgorithm::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(
      this, outputs, [this, inputs, outputs](const echorama::Progress& progress) { this->Execute(inputs, outputs, progress); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundMultiBlockAlgorithm::PutBlock(vtkInformationVector* outputs, int port, std::size_t block, vtkImageData* volume,
                                                const std::string& name)
{
  auto* output = vtkMultiBlockDataSet::GetData(outputs, port);
  const auto number = static_cast<unsigned int>(block);
  output->SetBlock(number, volume);
  output->GetMetaData(number)->Set(vtkCompositeDataSet::NAME(), name.c_str());
}
