// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundEmbedQuality.h"

#include "Core/Base/Error.h"
#include "Core/Base/Json.h"
#include "vtkUltrasoundAcquisition.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <optional>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundEmbedQuality);

vtkUltrasoundParametersMacro(vtkUltrasoundEmbedQuality);

namespace {
echorama::VolumeView<const unsigned char> LabelsOf(vtkImageData* image)
{
  vtkDataArray* array = image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
  if (!array) {
    throw Error(Error::Kind::BadInput, "the embedded volume has no array Embedding, which says what its voxels are");
  }
  if (array->GetDataType() != VTK_UNSIGNED_CHAR || array->GetNumberOfComponents() != 1 ||
      array->GetNumberOfTuples() != image->GetNumberOfPoints()) {
    throw Error(Error::Kind::BadInput, "the embedded volume: its Embedding is not one unsigned char per voxel");
  }
  return vtkUltrasoundVolume::ViewOf<const unsigned char>(array, image);
}

nlohmann::ordered_json JsonOf(const echorama::SurfaceJumps& jumps)
{
  return {{"patches", jumps.patches},
          {"mean", jumps.mean},
          {"median", jumps.median},
          {"percentile95", jumps.percentile95},
          {"bias", jumps.bias},
          {"deviation_ratio", jumps.deviationRatio},
          {"deviation_ratio_5", jumps.deviationRatio5},
          {"deviation_ratio_95", jumps.deviationRatio95}};
}

nlohmann::ordered_json JsonOf(const echorama::Crop& crop)
{
  return {{"share", crop.share},
          {"depth_mm", {crop.first.depth, crop.last.depth}},
          {"fan", {crop.first.fan, crop.last.fan}},
          {"sweep", {crop.first.sweep, crop.last.sweep}}};
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundEmbedQuality::Parameters()
{
  return echorama::Without(Describe(this->Values), {"LeastJump", "MostDeviation"});
}

//----------------------------------------------------------------------------
vtkUltrasoundEmbedQuality::vtkUltrasoundEmbedQuality()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
int vtkUltrasoundEmbedQuality::FillInputPortInformation(int port, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  if (port == 1) {
    information->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedQuality::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Quality = {};
  this->Report.clear();

  // 1. what came in
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto embedded = vtkUltrasoundVolume::CheckInput(this, image, "the embedded volume");
  const auto labels = LabelsOf(image);
  std::optional<vtkUltrasoundVolume::Input> original;
  if (inputs[1]->GetNumberOfInformationObjects() > 0) {
    original = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[1]), "the original");
    if (original->Intensity->GetDataType() != embedded.Intensity->GetDataType()) {
      throw Error(Error::Kind::BadInput, std::string("the original has voxels of type ") +
                                             original->Intensity->GetDataTypeAsString() + ", the embedded volume of type " +
                                             embedded.Intensity->GetDataTypeAsString());
    }
  }
  std::optional<echorama::PlacedProbe> fan;
  const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image);
  if (geometry && pose) {
    fan = echorama::PlacedProbe{*geometry, *pose};
  }

  // 2. the kernel
  vtkUltrasoundVolume::Dispatch(embedded.Intensity, [&](auto voxel) {
    using T = decltype(voxel);
    const auto posed = vtkUltrasoundVolume::PosedVolumeOf<T>(embedded);
    std::optional<echorama::PosedVolume<T>> source;
    if (original) {
      source = vtkUltrasoundVolume::PosedVolumeOf<T>(*original);
    }
    this->Quality = echorama::MeasureEmbedding<T>(posed.intensity, labels, posed.geometry, source ? &*source : nullptr,
                                                  fan ? &*fan : nullptr, this->Values, progress);
  });

  // 3. what goes out
  output->ShallowCopy(image);
  const echorama::EmbedQualityReport& q = this->Quality;
  this->Report = nlohmann::ordered_json{{"border", JsonOf(q.border)},
                                        {"reference", JsonOf(q.reference)},
                                        {"border_measured", q.borderMeasured},
                                        {"jump_limit", q.jumpLimit},
                                        {"jump_passes", q.jumpPasses},
                                        {"deviation_passes", q.deviationPasses},
                                        {"voxels",
                                         {{"data", q.data},
                                          {"blend", q.blend},
                                          {"invented", q.invented},
                                          {"altered", q.altered},
                                          {"pretended", q.pretended},
                                          {"lost", q.lost}}},
                                        {"crop", JsonOf(q.crop)}}
                     .dump();
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedQuality::GetSeamJump() const
{
  return this->Quality.border.percentile95;
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedQuality::GetReferenceJump() const
{
  return this->Quality.reference.percentile95;
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedQuality::GetJumpLimit() const
{
  return this->Quality.jumpLimit;
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedQuality::GetDeviationRatio() const
{
  return this->Quality.border.deviationRatio;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundEmbedQuality::GetSeamPasses() const
{
  return this->Quality.jumpPasses && this->Quality.deviationPasses;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetDataVoxels() const
{
  return this->Quality.data;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetBlendVoxels() const
{
  return this->Quality.blend;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetInventedVoxels() const
{
  return this->Quality.invented;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetAlteredVoxels() const
{
  return this->Quality.altered;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetPretendedVoxels() const
{
  return this->Quality.pretended;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundEmbedQuality::GetLostVoxels() const
{
  return this->Quality.lost;
}

//----------------------------------------------------------------------------
double vtkUltrasoundEmbedQuality::GetCropShare() const
{
  return this->Quality.crop.share;
}

//----------------------------------------------------------------------------
void vtkUltrasoundEmbedQuality::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Report: " << this->Report << "\n";
}
