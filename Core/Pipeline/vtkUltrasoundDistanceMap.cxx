// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDistanceMap.h"

#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include "Core/Imaging/Sampling.h"

#include "vtkDataObject.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"

#include <cmath>

vtkStandardNewMacro(vtkUltrasoundDistanceMap);

vtkUltrasoundParametersMacro(vtkUltrasoundDistanceMap);

namespace {
// 1 in the region, else 0.
echorama::Volume<unsigned char> RegionOf(const vtkUltrasoundVolume::Input& input, bool chosen)
{
  echorama::Volume<unsigned char> region;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&input, chosen, &region](auto type) {
    using T = decltype(type);
    const auto volume = vtkUltrasoundVolume::PosedVolumeOf<T>(input);
    // An array that was chosen is the region itself; the valid region has no say.
    const echorama::Sampler<T> sampler(volume.intensity, chosen ? echorama::VolumeView<const unsigned char>() : volume.valid);
    region = echorama::Volume<unsigned char>(volume.intensity.Dimensions());
    const auto inside = region.View();
    echorama::ParallelRanges(inside.Size(), 65536, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t i = begin; i < end; ++i) {
        inside[i] = sampler.IsReal(i) && (!chosen || volume.intensity[i] != T(0)) ? 1 : 0;
      }
    });
  });
  return region;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundDistanceMap::Parameters()
{
  using echorama::Parameter;
  return {Parameter("Measure", echorama::Choice(this->Measured, {"outside", "inside", "signed"}),
                    "Outside: the distance to the nearest voxel of the region, 0 inside it. Inside: the distance to the nearest "
                    "voxel outside the region or beyond the grid, 0 outside it. Signed: the first less the second."),
          Parameter("Squared", this->Squares, "Whether distances are put out squared (mm^2), with their sign.")};
}

//----------------------------------------------------------------------------
void vtkUltrasoundDistanceMap::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  vtkInformation* choice = this->GetInputArrayInformation(0);
  const auto region = RegionOf(input, choice && choice->Has(vtkDataObject::FIELD_NAME()));
  const Eigen::Vector3d spacing = vtkUltrasoundVolume::GeometryOf(image).spacing;

  output->ShallowCopy(image);
  const auto distance = vtkUltrasoundVolume::ViewOf<float>(AddArray(output, DistanceName(), VTK_FLOAT), output);
  echorama::Volume<float> inside;
  if (this->Measured == INSIDE) {
    echorama::SquaredDepthMap(region.View(), spacing, distance, progress);
  } else {
    echorama::SquaredDistanceMap(region.View(), spacing, distance, progress.Part(0.0, this->Measured == SIGNED ? 0.5 : 1.0));
  }
  if (this->Measured == SIGNED) {
    inside = echorama::Volume<float>(region.Dimensions());
    echorama::SquaredDepthMap(region.View(), spacing, inside.View(), progress.Part(0.5, 1.0));
  }
  echorama::ParallelRanges(distance.Size(), 65536, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const bool deep = this->Measured == SIGNED && region.View()[i];
      const float square = deep ? inside.View()[i] : distance[i];
      const float size = this->Squares ? square : std::sqrt(square);
      distance[i] = deep ? -size : size;
    }
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundDistanceMap::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
