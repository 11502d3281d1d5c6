// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundFeather.h"

#include "Core/Imaging/Sampling.h"

#include "vtkImageData.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundFeather);

vtkUltrasoundParametersMacro(vtkUltrasoundFeather);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundFeather::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundFeather::vtkUltrasoundFeather()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
void vtkUltrasoundFeather::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const auto input = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[0]), "the input");
  const auto other = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[1]), "the background");
  RefuseEmbedded(input.Image);
  const auto geometry = vtkUltrasoundVolume::GeometryOf(input.Image);
  if (!vtkUltrasoundVolume::GeometryOf(other.Image).AgreesWith(geometry)) {
    throw Error(Error::Kind::BadInput, "the background does not lie on the grid of the volume");
  }

  echorama::Volume<unsigned char> region, otherRegion;
  echorama::Volume<float> background(geometry.dimensions);
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    region = echorama::RealRegionOf(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input));
  });
  if (std::none_of(region.View().begin(), region.View().end(), [](unsigned char real) { return real != 0; })) {
    throw Error(Error::Kind::BadInput, "the input has no valid voxel");
  }
  vtkUltrasoundVolume::Dispatch(other.Intensity, [&](auto type) {
    const auto volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(other);
    otherRegion = echorama::RealRegionOf(volume);
    std::transform(volume.intensity.begin(), volume.intensity.end(), background.View().begin(),
                   [](auto value) { return static_cast<float>(value); });
  });
  echorama::Volume<float> weights(geometry.dimensions);
  echorama::FeatherWeights(this->Values, region.View(), otherRegion.View(), geometry.spacing, weights.View(),
                           progress.Part(0.1, 0.4));

  vtkDataArray* result = CopyWithNewIntensity(input.Image, input.Intensity, output, input.Intensity->GetDataType());
  vtkDataArray* labels = AddArray(output, vtkUltrasoundVolume::EmbeddingName(), VTK_UNSIGNED_CHAR);
  // What was seen stays known; voxels that are not numbers were not.
  vtkDataArray* seen = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  std::copy(region.View().begin(), region.View().end(), vtkUltrasoundVolume::ViewOf<unsigned char>(seen, output).begin());
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    using T = decltype(type);
    const auto values = vtkUltrasoundVolume::ViewOf<const T>(input.Intensity, input.Image);
    const auto out = vtkUltrasoundVolume::ViewOf<T>(result, output);
    std::copy(values.begin(), values.end(), out.begin());
    echorama::Feather<T>(this->Values, weights.View(), region.View(), background.View(), otherRegion.View(), geometry.spacing,
                         out, vtkUltrasoundVolume::ViewOf<unsigned char>(labels, output), progress.Part(0.4, 1.0));
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundFeather::RefuseEmbedded(vtkImageData* volume)
{
  vtkDataArray* labels = volume->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
  double range[2] = {0.0, 0.0};
  if (labels) {
    labels->GetRange(range);
  }
  if (range[1] > static_cast<double>(echorama::EmbeddedVoxel::Data)) {
    throw Error(Error::Kind::BadInput,
                "the input was embedded before: its array Embedding has mixed or invented voxels, which would "
                "pass as data; embed the volume that it was made from");
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundFeather::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
