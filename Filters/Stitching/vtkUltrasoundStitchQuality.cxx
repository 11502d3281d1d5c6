// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundStitchQuality.h"

#include "Core/Base/Error.h"
#include "Core/Base/Json.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <optional>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundStitchQuality);

namespace {
echorama::AnyPosedVolume AnyVolumeOf(const vtkUltrasoundVolume::Input& input)
{
  echorama::AnyPosedVolume any;
  vtkUltrasoundVolume::Dispatch(input.Intensity,
                                [&](auto voxel) { any = vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(input); });
  return any;
}

echorama::VolumeView<const float> ReliabilityOf(const vtkUltrasoundVolume::Input& input)
{
  vtkDataArray* array = input.Image->GetPointData()->GetArray(vtkUltrasoundVolume::ReliabilityName());
  if (array && (array->GetDataType() != VTK_FLOAT || array->GetNumberOfComponents() != 1 ||
                array->GetNumberOfTuples() != input.Image->GetNumberOfPoints())) {
    throw Error(Error::Kind::BadInput, input.Name + ": its Reliability is not one float per voxel");
  }
  return vtkUltrasoundVolume::ViewOf<const float>(array, input.Image);
}

nlohmann::ordered_json JsonOf(const echorama::SeamVisibility& seam)
{
  return {{"mean", seam.mean}, {"gradient", seam.gradient}, {"faces", seam.faces}};
}
} // namespace

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
    volumes.push_back({AnyVolumeOf(source), source.Name, ReliabilityOf(source)});
  }
  std::optional<echorama::AnyPosedVolume> reference;
  if (inputs[2]->GetNumberOfInformationObjects() > 0) {
    reference = AnyVolumeOf(vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[2]), "the reference"));
  }

  // 2. the kernel
  echorama::StitchQualityParameters parameters;
  parameters.stride = this->Stride;
  vtkUltrasoundVolume::Dispatch(stitched.Intensity, [&](auto voxel) {
    const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(stitched);
    this->Quality = echorama::MeasureStitch<decltype(voxel)>(volumes, posed.geometry, posed.intensity, posed.valid,
                                                             reference ? &*reference : nullptr, parameters, progress);
  });

  // 3. what goes out
  output->ShallowCopy(image);
  const echorama::StitchQualityReport& q = this->Quality;
  this->Report = nlohmann::ordered_json{{"seam_mean", q.seamMean},           {"seam_gradient", q.seamGradient},
                                        {"borders", JsonOf(q.borders)},      {"cuts", JsonOf(q.cuts)},
                                        {"texture_kept", q.textureKept},     {"snr", q.snr},
                                        {"snr_sources", q.snrSources},       {"overlap_windows", q.overlapWindows},
                                        {"overlap_voxels", q.overlapVoxels}, {"error_overlap", q.errorOverlap},
                                        {"error_outside", q.errorOutside}}
                     .dump();
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
  os << indent << "Stride: " << this->Stride << "\n";
  os << indent << "Report: " << this->Report << "\n";
}
