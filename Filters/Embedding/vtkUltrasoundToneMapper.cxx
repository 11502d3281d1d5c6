// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundToneMapper.h"

#include "Core/Imaging/Sampling.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundToneMapper);

vtkUltrasoundParametersMacro(vtkUltrasoundToneMapper);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundToneMapper::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundToneMapper::vtkUltrasoundToneMapper()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
int vtkUltrasoundToneMapper::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 1) {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return this->Superclass::FillInputPortInformation(port, info);
}

//----------------------------------------------------------------------------
void vtkUltrasoundToneMapper::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const auto input = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[0]), "the input");
  const auto geometry = vtkUltrasoundVolume::GeometryOf(input.Image);
  vtkUltrasoundVolume::Input levels;
  vtkDataArray* deviation = nullptr;
  if (inputs[1]->GetNumberOfInformationObjects() > 0) {
    levels = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[1]), "the levels");
    if (!vtkUltrasoundVolume::GeometryOf(levels.Image).AgreesWith(geometry)) {
      throw Error(Error::Kind::BadInput, "the levels do not lie on the grid of the volume");
    }
    deviation = levels.Image->GetPointData()->GetArray(DeviationName());
    if (this->Values.matchDeviation && (!deviation || deviation->GetNumberOfComponents() != 1)) {
      throw Error(Error::Kind::BadInput, "the levels have no point array Deviation, which MatchDeviation needs");
    }
  }
  vtkDataArray* result = CopyWithNewIntensity(input.Image, input.Intensity, output, VTK_FLOAT);
  const auto out = vtkUltrasoundVolume::ViewOf<float>(result, output);
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    const auto volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
    const echorama::Volume<unsigned char> region = echorama::RealRegionOf(volume);
    std::transform(volume.intensity.begin(), volume.intensity.end(), out.begin(),
                   [](auto value) { return static_cast<float>(value); });
    echorama::ExtractGrain(this->Values, out, region.View(), geometry.spacing, out, progress);
    // Voxels that are not numbers become some, and stay unreal.
    if (input.ValidRegion || std::any_of(region.View().begin(), region.View().end(), [](unsigned char real) { return !real; })) {
      vtkDataArray* real = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
      std::copy(region.View().begin(), region.View().end(), vtkUltrasoundVolume::ViewOf<unsigned char>(real, output).begin());
    }
  });
  if (levels.Intensity) {
    for (vtkIdType i = 0; i < result->GetNumberOfTuples(); ++i) {
      out[i] = echorama::ApplyGrain(this->Values.matchDeviation, out[i], static_cast<float>(levels.Intensity->GetComponent(i, 0)),
                                    this->Values.matchDeviation ? static_cast<float>(deviation->GetComponent(i, 0)) : 0.0f);
    }
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundToneMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
