// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundStitchQuality.h"

#include "StitchJson.h"
#include "vtkUltrasoundStitcher.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"

#include <optional>

vtkStandardNewMacro(vtkUltrasoundStitchQuality);

vtkUltrasoundParametersMacro(vtkUltrasoundStitchQuality);

namespace {
echorama::AnyPosedVolume AnyVolumeOf(const vtkUltrasoundVolume::Input& input)
{
  echorama::AnyPosedVolume any;
  vtkUltrasoundVolume::Dispatch(input.Intensity,
                                [&](auto voxel) { any = vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(input); });
  return any;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundStitchQuality::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundStitchQuality::vtkUltrasoundStitchQuality()
{
  this->SetNumberOfInputPorts(3);
}

//----------------------------------------------------------------------------
int vtkUltrasoundStitchQuality::FillInputPortInformation(int port, vtkInformation* information)
{
  if (port == 1) {
    vtkUltrasoundVolume::AcceptVolumes(information);
    return 1;
  }
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  if (port == 2) {
    information->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitchQuality::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Quality = {};
  this->Report.clear();

  // 1. what came in
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto stitched = vtkUltrasoundVolume::CheckInput(this, image, "the stitched volume");
  const auto sources = vtkUltrasoundVolume::CollectInputs(this, inputs[1]);
  std::vector<echorama::StitchInput> volumes;
  for (const vtkUltrasoundVolume::Input& source : sources) {
    volumes.push_back({AnyVolumeOf(source), source.Name, vtkUltrasoundStitcher::ReliabilityOf(source)});
  }
  std::optional<echorama::AnyPosedVolume> reference;
  if (inputs[2]->GetNumberOfInformationObjects() > 0) {
    reference = AnyVolumeOf(vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[2]), "the reference"));
  }

  // 2. the kernel
  vtkUltrasoundVolume::Dispatch(stitched.Intensity, [&](auto voxel) {
    const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(stitched);
    this->Quality = echorama::MeasureStitch<decltype(voxel)>(volumes, posed.geometry, posed.intensity, posed.valid,
                                                             reference ? &*reference : nullptr, this->Values, progress);
  });

  // 3. what goes out
  output->ShallowCopy(image);
  this->Report = echorama::Report(this->Quality);
}

//----------------------------------------------------------------------------
const echorama::StitchQualityReport& vtkUltrasoundStitchQuality::Measured() const
{
  return this->Quality;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetSeamMean() const
{
  return this->Quality.seamMean;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetSeamGradient() const
{
  return this->Quality.seamGradient;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetTextureKept() const
{
  return this->Quality.textureKept;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetSpeckleSnr() const
{
  return this->Quality.snr;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetSourceSpeckleSnr() const
{
  return this->Quality.snrSources;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetErrorOverlap() const
{
  return this->Quality.errorOverlap;
}

//----------------------------------------------------------------------------
double vtkUltrasoundStitchQuality::GetErrorOutside() const
{
  return this->Quality.errorOutside;
}

//----------------------------------------------------------------------------
void vtkUltrasoundStitchQuality::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Report: " << this->Report << "\n";
}
