// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundDeformableAligner.h"

#include "Core/Base/Error.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkUltrasoundDisplacement.h"

#include <algorithm>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundDeformableAligner);

vtkUltrasoundParametersMacro(vtkUltrasoundDeformableAligner);

namespace {
// What the metric sees of a volume, by its Reliability where it has one.
std::shared_ptr<const echorama::MetricPyramid> FeaturesOf(const vtkUltrasoundVolume::Input& volume,
                                                          const echorama::Progress& progress)
{
  vtkDataArray* trust = volume.Image->GetPointData()->GetArray(vtkUltrasoundVolume::ReliabilityName());
  if (trust && (trust->GetDataType() != VTK_FLOAT || trust->GetNumberOfComponents() != 1 ||
                trust->GetNumberOfTuples() != volume.Image->GetNumberOfPoints())) {
    throw Error(Error::Kind::BadInput, volume.Name + ": its Reliability is not one float per voxel");
  }
  std::vector<echorama::PyramidLevel> pyramid, reliability;
  vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto voxel) {
    const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(voxel)>(volume);
    pyramid = echorama::BuildPyramid(posed, {}, progress.Part(0.0, 0.3));
    if (trust) {
      reliability =
          echorama::BuildPyramid(echorama::PosedVolume<float>{vtkUltrasoundVolume::ViewOf<const float>(trust, volume.Image),
                                                              posed.valid, posed.geometry},
                                 {}, progress.Part(0.3, 0.5));
    }
  });
  echorama::PlacedVolume placed{&pyramid, echorama::Pose::Identity(), volume.Name};
  placed.reliability = trust ? &reliability : nullptr;
  return echorama::BuildMetricPyramid(placed, "local-ncc", progress.Part(0.5, 1.0));
}

// A volume that is not bent has a zero displacement at the corners of its box.
echorama::DisplacementField ZeroField(const echorama::ImageGeometry& volume)
{
  echorama::ImageGeometry corners = volume;
  for (int axis = 0; axis < 3; ++axis) {
    corners.spacing[axis] *= std::max(1, volume.dimensions[axis] - 1);
    corners.dimensions[axis] = 2;
  }
  return echorama::DisplacementField(corners);
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundDeformableAligner::Parameters()
{
  return echorama::Join({{echorama::Parameter("FixedVolume", this->Values.fixedVolume, {0, echorama::Unlimited}, "",
                                              "The volume that is not bent, counted from 0.")},
                         Describe(this->Values.align)});
}

//----------------------------------------------------------------------------
vtkUltrasoundDeformableAligner::vtkUltrasoundDeformableAligner()
{
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
void vtkUltrasoundDeformableAligner::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                             const echorama::Progress& progress)
{
  // 1. what came in
  echorama::CheckRanges(this->Parameters());
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  std::vector<std::shared_ptr<const echorama::MetricPyramid>> features;
  std::vector<echorama::DeformableVolume> seen;
  const double count = static_cast<double>(volumes.size());
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const double done = static_cast<double>(i);
    features.push_back(FeaturesOf(volumes[i], progress.Part(0.2 * done / count, 0.2 * (done + 1.0) / count)));
    seen.push_back({features.back().get(), echorama::Pose::Identity(), nullptr});
  }

  // 2. the kernel
  this->Found = echorama::DeformInTurn(seen, this->Values.fixedVolume, this->Values.align, progress.Part(0.2, 1.0));

  // 3. the same volumes, and their displacements
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const echorama::DeformableAlignResult& result = this->Found[i];
    vtkNew<vtkImageData> volume;
    volume->ShallowCopy(volumes[i].Image);
    const auto add = [&volume](const char* name, std::initializer_list<double> values) {
      vtkUltrasoundVolume::AddField(volume, name, values.begin(), static_cast<int>(values.size()));
    };
    add(DeformationAppliedName(), {result.isApplied ? 1.0 : 0.0});
    add(DeformationSimilarityName(), {result.similarityBefore, result.similarityAfter});
    add(DeformationBendingName(), {result.bendingEnergy});
    add(DeformationLargestName(), {result.largestMm});
    add(DeformationJacobianName(), {result.smallestDeterminant});
    vtkUltrasoundVolume::AddField(volume, DeformationReasonName(),
                                  static_cast<int>(i) == this->Values.fixedVolume ? "it is the fixed volume" : result.reason);
    vtkNew<vtkImageData> displacement;
    vtkUltrasoundDisplacement::ImageOf(
        result.isApplied ? result.field : ZeroField(vtkUltrasoundVolume::GeometryOf(volumes[i].Image)), displacement);
    PutBlock(outputs, 0, i, volume, volumes[i].Name);
    PutBlock(outputs, 1, i, displacement, volumes[i].Name);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundDeformableAligner::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
