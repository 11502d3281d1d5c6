// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundReliabilityMap.h"

#include "vtkUltrasoundAcquisition.h"

#include "vtkImageData.h"
#include "vtkObjectFactory.h"

#include <algorithm>

vtkStandardNewMacro(vtkUltrasoundReliabilityMap);

vtkUltrasoundParametersMacro(vtkUltrasoundReliabilityMap);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundReliabilityMap::Parameters()
{
  return echorama::Join({{echorama::Parameter("FitProbe", this->Fitted,
                                              "Whether a probe is fitted to the valid region of a volume that brings none. Where "
                                              "none fits, beams are lines of voxels along the depth axis.")},
                         Describe(this->Values)});
}

//----------------------------------------------------------------------------
void vtkUltrasoundReliabilityMap::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  echorama::CheckRanges(this->Parameters());
  this->ShadowFraction = this->SaturatedFraction = 0.0;
  this->Note.clear();
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");

  // 1. the probe
  std::optional<echorama::PlacedProbe> probe;
  std::string note = "Beams are lines of voxels along the depth axis: the volume brings no probe.";
  const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image);
  if (geometry && pose) {
    probe = {*geometry, *pose};
    note = "Beams are those of the volume's probe.";
  } else if (this->Fitted) {
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
      std::string reason;
      probe =
          echorama::FindProbe(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input), {}, &reason, progress.Part(0.0, 0.7));
      note = probe ? "Beams are those of a probe that was fitted to the valid region."
                   : "Beams are lines of voxels along the depth axis: no probe fits the valid region (" + reason + ").";
    });
  }

  // 2. the map
  echorama::Reliability reliability;
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    reliability = echorama::MeasureReliability(vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input), probe, this->Values,
                                               progress.Part(0.7, 1.0));
  });
  for (const std::string& further : reliability.notes) {
    note += "\n" + further;
  }

  // 3. what goes out
  output->ShallowCopy(image);
  const auto out =
      vtkUltrasoundVolume::ViewOf<float>(AddArray(output, vtkUltrasoundVolume::ReliabilityName(), VTK_FLOAT), output);
  std::copy(reliability.map.View().begin(), reliability.map.View().end(), out.begin());
  this->ShadowFraction = reliability.shadowShare;
  this->SaturatedFraction = reliability.saturatedShare;
  this->Note = note;
}

//----------------------------------------------------------------------------
void vtkUltrasoundReliabilityMap::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "ShadowFraction: " << this->ShadowFraction << "\n";
  os << indent << "SaturatedFraction: " << this->SaturatedFraction << "\n";
  os << indent << "Note: " << this->Note << "\n";
}
