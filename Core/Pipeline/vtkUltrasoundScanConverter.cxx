// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundScanConverter.h"

#include "Core/Imaging/ScanConversion.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkUltrasoundAcquisition.h"

#include <algorithm>
#include <limits>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundScanConverter);

vtkUltrasoundParametersMacro(vtkUltrasoundScanConverter);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundScanConverter::Parameters()
{
  using echorama::Parameter;
  return {Parameter("SpacingMm", this->Spacing, {0, 1000}, "mm",
                    "Edge of a voxel. 0: the geometric mean of the distances between samples, beams and steps halfway down the "
                    "middle beam, so that about as many voxels lie inside the fan as there are samples."),
          Parameter("MaximumVoxels", this->MostVoxels, {1, echorama::Unlimited}, "",
                    "The output is refused when it would have more voxels. A voxel takes the bytes of its type and one for its "
                    "valid region.")
              .Advanced()};
}

// What the input says and the grid that follows from it.
struct vtkUltrasoundScanConverter::Job {
  vtkUltrasoundVolume::Input Input;
  echorama::ProbeGeometry Probe;
  echorama::Pose ProbeToWorld;
  echorama::ImageGeometry Grid;
};

//----------------------------------------------------------------------------
vtkUltrasoundScanConverter::Job vtkUltrasoundScanConverter::Prepare(vtkInformationVector** inputs)
{
  echorama::CheckRanges(this->Parameters());
  Job job;
  job.Input = vtkUltrasoundVolume::CheckInput(this, vtkImageData::GetData(inputs[0]), "the beam volume");
  const auto probe = vtkUltrasoundAcquisition::ProbeGeometryOf(job.Input.Image);
  if (!probe) {
    throw Error(Error::Kind::BadInput, std::string("the beam volume: it has no field data ") +
                                           vtkUltrasoundAcquisition::ProbeGeometryName() +
                                           " of 6 or 7 finite numbers, so where its samples lie is not known");
  }
  job.Probe = *probe;
  const char* poseName = vtkUltrasoundAcquisition::ProbeToWorldName();
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(job.Input.Image);
  if (!pose && job.Input.Image->GetFieldData()->GetAbstractArray(poseName)) {
    throw Error(Error::Kind::BadInput, std::string("the beam volume: its field data ") + poseName + " is not 16 finite numbers");
  }
  job.ProbeToWorld = pose.value_or(echorama::Pose::Identity());
  const auto dimensions = vtkUltrasoundVolume::GeometryOf(job.Input.Image).dimensions;
  echorama::CheckBeamVolume(dimensions, job.Probe);
  const double spacing = this->Spacing == 0.0 ? echorama::SampleSpacing(dimensions, job.Probe) : this->Spacing;
  job.Grid = echorama::ScanConversionGrid(job.Probe, job.ProbeToWorld, spacing, static_cast<std::size_t>(this->MostVoxels));
  return job;
}

//----------------------------------------------------------------------------
int vtkUltrasoundScanConverter::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkUltrasoundVolume::MakeInput(this, 0); // field data does not travel with the information of the pipeline
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0), this->Prepare(inputs).Grid);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundScanConverter::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  const Job job = this->Prepare(inputs);
  vtkUltrasoundVolume::SetGeometry(output, job.Grid);
  output->GetFieldData()->ShallowCopy(job.Input.Image->GetFieldData());
  vtkUltrasoundAcquisition::SetProbeToWorld(output, job.ProbeToWorld);
  const char* name = job.Input.Intensity->GetName();
  vtkDataArray* intensity =
      AddArray(output, name ? name : vtkUltrasoundVolume::IntensityName(), job.Input.Intensity->GetDataType());
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(intensity->GetName());

  const auto validView = vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output);
  vtkUltrasoundVolume::Dispatch(job.Input.Intensity, [&](auto type) {
    using T = decltype(type);
    const auto view = vtkUltrasoundVolume::ViewOf<T>(intensity, output);
    echorama::ScanConvert<T>(vtkUltrasoundVolume::ViewOf<const T>(job.Input.Intensity, job.Input.Image), job.Probe,
                             job.ProbeToWorld, job.Grid, view, validView, progress.Part(0.0, job.Input.ValidRegion ? 0.5 : 1.0));
    if (!job.Input.ValidRegion) {
      return;
    }
    // The mask goes the same way, with NaN where it hides a sample: the kernel then finds the voxels next to one.
    const auto mask = vtkUltrasoundVolume::ViewOf<const unsigned char>(job.Input.ValidRegion, job.Input.Image);
    echorama::Volume<float> hidden(mask.Dimensions()), ignored(job.Grid.dimensions);
    echorama::Volume<unsigned char> real(job.Grid.dimensions);
    std::transform(mask.begin(), mask.end(), hidden.View().begin(),
                   [](unsigned char sample) { return sample ? 0.0f : std::numeric_limits<float>::quiet_NaN(); });
    echorama::ScanConvert<float>(hidden.View(), job.Probe, job.ProbeToWorld, job.Grid, ignored.View(), real.View(),
                                 progress.Part(0.5, 1.0));
    for (std::ptrdiff_t i = 0; i < view.Size(); ++i) {
      if (!real.View()[i]) {
        view[i] = T(0);
        validView[i] = 0;
      }
    }
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundScanConverter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
