// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundProbeFit.h"

#include "Core/Imaging/Sampling.h"
#include "vtkUltrasoundAcquisition.h"

#include "vtkImageData.h"
#include "vtkObjectFactory.h"

#include <algorithm>
#include <utility>

vtkStandardNewMacro(vtkUltrasoundProbeFit);

vtkUltrasoundParametersMacro(vtkUltrasoundProbeFit);

namespace {
// 1 where a voxel is real, else 0.
echorama::Volume<unsigned char> RegionOf(const vtkUltrasoundVolume::Input& input)
{
  echorama::Volume<unsigned char> region;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    region = echorama::RealRegionOf(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input));
  });
  return region;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundProbeFit::Parameters()
{
  echorama::ParameterList fit = Describe(this->Fitting), enclose = Describe(this->Enclosing);
  for (echorama::Parameter& parameter : fit) {
    parameter.When("EncloseRegion", "off");
  }
  for (echorama::Parameter& parameter : enclose) {
    parameter.When("EncloseRegion", "on");
  }
  return echorama::Join({std::move(fit),
                         {echorama::Parameter("EncloseRegion", this->Encloses,
                                              "Whether the fan must hold every real voxel: the least that does, found from the "
                                              "region or enlarged from the probe that the volume has, for regions of any shape "
                                              "such as stitched volumes.")},
                         std::move(enclose)});
}

//----------------------------------------------------------------------------
echorama::PlacedProbe vtkUltrasoundProbeFit::ProbeOf(const vtkUltrasoundVolume::Input& input, std::string* notes,
                                                     const echorama::Progress& progress)
{
  const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(input.Image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(input.Image);
  if (geometry && pose) {
    return {*geometry, *pose};
  }
  try {
    const echorama::ProbeFit fit =
        echorama::FitProbe(RegionOf(input).View(), vtkUltrasoundVolume::GeometryOf(input.Image), {}, progress);
    if (notes) {
      *notes += (notes->empty() ? "" : "\n") + input.Name + ": its fan was fitted to its valid region.";
      for (const std::string& note : fit.notes) {
        *notes += "\n" + input.Name + ": " + note;
      }
    }
    return {fit.geometry, fit.probeToWorld};
  } catch (const echorama::Error& error) {
    if (error.GetKind() == echorama::Error::Kind::Cancelled) {
      throw;
    }
    throw echorama::Error(error.GetKind(), input.Name + ": it brings no probe, and none fits its valid region: " + error.what());
  }
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
echorama::ProbeFit vtkUltrasoundProbeFit::Enclose(vtkImageData* image, const echorama::Volume<unsigned char>& region,
                                                  const echorama::Progress& progress) const
{
  const auto geometry = vtkUltrasoundVolume::GeometryOf(image);
  const auto recorded = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image);
  echorama::EnclosingFanParameters parameters = this->Enclosing;
  if (recorded && pose) {
    parameters.shape = echorama::PlacedProbe{*recorded, *pose};
  }
  const echorama::PlacedProbe fan = echorama::EncloseRegion(region.View(), geometry, parameters, progress);

  echorama::ProbeFit fit;
  fit.geometry = fan.geometry;
  fit.probeToWorld = fan.probeToWorld;
  const auto voxels = region.View();
  const auto count = std::count(voxels.begin(), voxels.end(), static_cast<unsigned char>(1));
  const double voxel = geometry.spacing.head(geometry.dimensions[2] == 1 ? 2 : 3).prod();
  fit.overlap = std::min(1.0, static_cast<double>(count) * voxel / echorama::FanVolume(fan.geometry));
  fit.notes.push_back("The fan encloses the whole region; the region itself need not be fan-shaped.");
  return fit;
}

//----------------------------------------------------------------------------
void vtkUltrasoundProbeFit::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  echorama::CheckRanges(this->Parameters());
  this->Remember({});
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  const auto region = RegionOf(input);

  echorama::ProbeFit fit =
      this->Encloses ? this->Enclose(image, region, progress)
                     : echorama::FitProbe(region.View(), vtkUltrasoundVolume::GeometryOf(image), this->Fitting, progress);

  if (!input.ValidRegion) {
    fit.notes.insert(fit.notes.begin(), "The volume has no valid region: every voxel counts as valid.");
  }
  if (const auto known = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
      known && this->Encloses && vtkUltrasoundAcquisition::ProbeToWorldOf(image)) {
    fit.notes.insert(fit.notes.begin(), "The volume had a probe geometry; the fan is that, or larger.");
  } else if (known) {
    fit.notes.insert(fit.notes.begin(), "The volume had a probe geometry, which the fit does not use.");
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
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "ResidualMm: " << this->ResidualMm << "\n";
  os << indent << "MeanDistance: " << this->MeanDistance << "\n";
  os << indent << "Overlap: " << this->Overlap << "\n";
  os << indent << "Notes: " << this->Notes << "\n";
}
