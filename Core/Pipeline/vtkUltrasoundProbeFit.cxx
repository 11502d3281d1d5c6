// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundProbeFit.h"

#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "vtkUltrasoundAcquisition.h"

#include "vtkImageData.h"
#include "vtkObjectFactory.h"

vtkStandardNewMacro(vtkUltrasoundProbeFit);

namespace {
// 1 where a voxel is real, else 0.
echorama::Volume<unsigned char> RegionOf(const vtkUltrasoundVolume::Input& input)
{
  echorama::Volume<unsigned char> region;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&input, &region](auto type) {
    using T = decltype(type);
    const auto volume = vtkUltrasoundVolume::PosedVolumeOf<T>(input);
    const echorama::Sampler<T> sampler(volume.intensity, volume.valid);
    region = echorama::Volume<unsigned char>(volume.intensity.Dimensions());
    const auto inside = region.View();
    echorama::ParallelRanges(inside.Size(), 65536, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t i = begin; i < end; ++i) {
        inside[i] = sampler.IsReal(i) ? 1 : 0;
      }
    });
  });
  return region;
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundProbeFit::vtkUltrasoundProbeFit()
{
  const echorama::ProbeFitParameters defaults;
  this->MinimumOverlap = defaults.minimumOverlap;
  this->MaximumDistance = defaults.maximumDistance;
  this->OutlinePoints = defaults.outlinePoints;
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeFit::Remember(const echorama::ProbeFit& fit)
{
  this->ResidualMm = fit.residualMm;
  this->MeanDistance = fit.meanDistance;
  this->Overlap = fit.overlap;
  this->Notes.clear();
  for (const std::string& note : fit.notes) {
    this->Notes += (this->Notes.empty() ? "" : "\n") + note;
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeFit::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Remember({});
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  const auto region = RegionOf(input);

  echorama::ProbeFitParameters parameters;
  parameters.minimumOverlap = this->MinimumOverlap;
  parameters.maximumDistance = this->MaximumDistance;
  parameters.outlinePoints = this->OutlinePoints;
  echorama::ProbeFit fit = echorama::FitProbe(region.View(), vtkUltrasoundVolume::GeometryOf(image), parameters, progress);

  if (!input.ValidRegion) {
    fit.notes.insert(fit.notes.begin(), "The volume has no valid region: every voxel counts as valid.");
  }
  if (vtkUltrasoundAcquisition::ProbeGeometryOf(image)) {
    fit.notes.insert(fit.notes.begin(), "The volume had a probe geometry; it was replaced.");
  }
  output->ShallowCopy(image);
  vtkUltrasoundAcquisition::SetProbeGeometry(output, fit.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, fit.probeToWorld);
  this->Remember(fit);
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeFit::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "MinimumOverlap: " << this->MinimumOverlap << "\n";
  os << indent << "MaximumDistance: " << this->MaximumDistance << "\n";
  os << indent << "OutlinePoints: " << this->OutlinePoints << "\n";
  os << indent << "ResidualMm: " << this->ResidualMm << "\n";
  os << indent << "MeanDistance: " << this->MeanDistance << "\n";
  os << indent << "Overlap: " << this->Overlap << "\n";
  os << indent << "Notes: " << this->Notes << "\n";
}
