// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSurfaceDiffuser.h"

#include "Core/Imaging/Sampling.h"
#include "LocalStatistics.h"
#include "RegionSurface.h"
#include "vtkUltrasoundToneMapper.h"

#include "vtkImageData.h"
#include "vtkObjectFactory.h"

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundSurfaceDiffuser);

vtkUltrasoundParametersMacro(vtkUltrasoundSurfaceDiffuser);

namespace {

// Mean and deviation at the surface of the region, as two channels.
template <class T>
echorama::DiffusionSources SurfaceLevels(echorama::VolumeView<const T> intensity, const echorama::Volume<unsigned char>& region,
                                         const Eigen::Vector3d& spacing, double smoothMm, const echorama::Progress& progress)
{
  echorama::DiffusionSources sources;
  sources.voxels = echorama::SurfaceOf(region.View(), progress.Part(0.0, 0.3));
  if (sources.voxels.empty()) {
    throw Error(Error::Kind::BadInput, "the input has no valid voxel, so there is no surface to start from");
  }
  sources.channels = 2;
  const std::size_t count = sources.voxels.size();
  sources.values.assign(2 * count, 0.0f);
  if (smoothMm == 0.0) {
    for (std::size_t s = 0; s < count; ++s) {
      const auto& v = sources.voxels[s];
      sources.values[s] = static_cast<float>(intensity(v[0], v[1], v[2]));
    }
    return sources;
  }
  const auto statistics = echorama::GrainStatistics(intensity, region.View(), spacing, smoothMm, progress.Part(0.3, 1.0));
  for (std::size_t s = 0; s < count; ++s) {
    const auto& v = sources.voxels[s];
    statistics.Row(v[1], v[2], v[0], v[0] + 1, &sources.values[s], &sources.values[count + s]);
  }
  return sources;
}

} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSurfaceDiffuser::Parameters()
{
  return echorama::Join(
      {Describe(this->Values),
       {echorama::Parameter("SmoothMm", this->SmoothMm, {0, echorama::Unlimited}, "mm",
                            "Standard deviation of the windows in which mean and deviation of the grain are taken "
                            "at the surface. 0: the voxels' own values, which deviate by 0.")}});
}

//----------------------------------------------------------------------------
vtkUltrasoundSurfaceDiffuser::vtkUltrasoundSurfaceDiffuser() {}

//----------------------------------------------------------------------------
void vtkUltrasoundSurfaceDiffuser::Execute(vtkInformationVector** inputs, vtkImageData* output,
                                           const echorama::Progress& progress)
{
  const auto input = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[0]), "the input");
  const auto geometry = vtkUltrasoundVolume::GeometryOf(input.Image);
  if (!input.ValidRegion) {
    throw Error(Error::Kind::BadInput, "the input has no ValidRegion, so it has no surface");
  }
  echorama::CheckRanges(this->Parameters());
  echorama::Volume<unsigned char> region;
  echorama::DiffusionSources sources;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    const auto volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
    region = echorama::RealRegionOf(volume);
    sources = SurfaceLevels(volume.intensity, region, geometry.spacing, this->SmoothMm, progress.Part(0.0, 0.2));
  });
  vtkDataArray* mean = CopyWithNewIntensity(input.Image, input.Intensity, output, VTK_FLOAT);
  vtkDataArray* deviation = AddArray(output, vtkUltrasoundToneMapper::DeviationName(), VTK_FLOAT);
  echorama::Diffuse(this->Values, sources, geometry.spacing, region.View(), {},
                    {vtkUltrasoundVolume::ViewOf<float>(mean, output), vtkUltrasoundVolume::ViewOf<float>(deviation, output)},
                    progress.Part(0.2, 1.0));
}

//----------------------------------------------------------------------------
void vtkUltrasoundSurfaceDiffuser::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
