// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundNoiseTiler.h"

#include "Core/Base/Error.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundProbeFit.h"

#include <algorithm>
#include <tuple>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundNoiseTiler);

vtkUltrasoundParametersMacro(vtkUltrasoundNoiseTiler);

//----------------------------------------------------------------------------
struct vtkUltrasoundNoiseTiler::Volumes {
  using Key = std::tuple<vtkImageData*, vtkMTimeType, vtkDataArray*, vtkDataArray*, std::string>;
  std::vector<Key> Made; // of each: the fits hold as long as these stay
  std::vector<echorama::NoiseInput> Inputs;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundNoiseTiler::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundNoiseTiler::vtkUltrasoundNoiseTiler() = default;

//----------------------------------------------------------------------------
vtkUltrasoundNoiseTiler::~vtkUltrasoundNoiseTiler() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundNoiseTiler::FillInputPortInformation(int, vtkInformation* information)
{
  vtkUltrasoundVolume::AcceptVolumes(information);
  return 1;
}

//----------------------------------------------------------------------------
const std::vector<echorama::NoiseInput>& vtkUltrasoundNoiseTiler::Prepare(vtkInformationVector* port,
                                                                          const echorama::Progress& progress)
{
  const auto inputs = vtkUltrasoundVolume::CollectInputs(this, port);
  std::vector<Volumes::Key> made;
  std::transform(inputs.begin(), inputs.end(), std::back_inserter(made), [](const auto& input) {
    return Volumes::Key{input.Image, input.Image->GetMTime(), input.Intensity, input.ValidRegion, input.Name};
  });
  if (this->Kept && this->Kept->Made == made) {
    return this->Kept->Inputs;
  }
  this->Kept.reset();
  this->Notes.clear();
  auto volumes = std::make_unique<Volumes>();
  for (const auto& input : inputs) {
    const double done = static_cast<double>(volumes->Inputs.size()), count = static_cast<double>(inputs.size());
    const auto part = progress.Part(done / count, (done + 1.0) / count);
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
      const auto volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
      volumes->Inputs.push_back({volume, vtkUltrasoundProbeFit::ProbeOf(input, &this->Notes, part), input.Name});
    });
  }
  volumes->Made = std::move(made);
  this->Kept = std::move(volumes);
  return this->Kept->Inputs;
}

//----------------------------------------------------------------------------
int vtkUltrasoundNoiseTiler::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // How large the whole is depends on the fans, and field data does not travel with the information of the pipeline.
  vtkUltrasoundVolume::MakeInput(this, 0);
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    const auto tiling = echorama::PlanNoiseTiling(this->Values, this->Prepare(inputs[0], progress));
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkUltrasoundVolume::SetGeometry(out, tiling.geometry);
    vtkDataObject::SetPointDataActiveScalarInfo(out, VTK_FLOAT, 1);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseTiler::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const auto& volumes = this->Prepare(inputs[0], progress.Part(0.0, 0.2));
  const auto tiled = echorama::TileNoise(this->Values, volumes, progress.Part(0.2, 1.0));
  vtkUltrasoundVolume::SetGeometry(output, tiled.geometry);
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), VTK_FLOAT);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  std::copy(tiled.intensity.View().begin(), tiled.intensity.View().end(),
            vtkUltrasoundVolume::ViewOf<float>(intensity, output).begin());
  std::copy(tiled.valid.View().begin(), tiled.valid.View().end(),
            vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output).begin());
  vtkUltrasoundAcquisition::SetProbeGeometry(output, tiled.fan.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(output, tiled.fan.probeToWorld);
}

//----------------------------------------------------------------------------
void vtkUltrasoundNoiseTiler::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->Notes << "\n";
}
