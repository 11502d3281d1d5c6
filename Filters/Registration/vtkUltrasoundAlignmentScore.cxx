// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAlignmentScore.h"

#include "Core/Imaging/ValidPoints.h"
#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundVolume.h"

#include <limits>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundAlignmentScore);

vtkUltrasoundParametersMacro(vtkUltrasoundAlignmentScore);

namespace {
constexpr double NotANumber = std::numeric_limits<double>::quiet_NaN();
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundAlignmentScore::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentScore::vtkUltrasoundAlignmentScore() : Score(NotANumber)
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentScore::~vtkUltrasoundAlignmentScore() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentScore::FillInputPortInformation(int, vtkInformation* info)
{
  vtkUltrasoundVolume::AcceptVolumes(info);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentScore::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  vtkUltrasoundVolume::RequestWhole(inputs[1]);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentScore::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Score = NotANumber;
  this->VolumeScores.clear();
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    // 1. what came in
    echorama::CheckRanges(this->Parameters());
    const auto aligned = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
    const auto truth = vtkUltrasoundVolume::CollectInputs(this, inputs[1]);
    if (aligned.size() != truth.size()) {
      throw Error(Error::Kind::BadInput, "there are " + std::to_string(aligned.size()) + " aligned volumes and " +
                                             std::to_string(truth.size()) + " true ones; one truth per volume is needed");
    }

    // 2. the kernel
    std::vector<echorama::ScoredVolume> volumes;
    for (std::size_t i = 0; i < aligned.size(); ++i) {
      progress(static_cast<double>(i) / static_cast<double>(aligned.size()));
      echorama::ScoredVolume volume;
      volume.aligned = vtkUltrasoundVolume::GeometryOf(aligned[i].Image);
      volume.truth = vtkUltrasoundVolume::GeometryOf(truth[i].Image);
      volume.name = aligned[i].Name;
      vtkUltrasoundVolume::Dispatch(aligned[i].Intensity, [&](auto type) {
        const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(aligned[i]);
        volume.indexPoints =
            echorama::ValidPoints<decltype(type)>(posed.intensity, posed.valid, this->Values.points, this->Values.seed);
      });
      volumes.push_back(std::move(volume));
    }
    const echorama::AlignmentScore score = echorama::ScoreAlignment(volumes, this->Values.fixedVolume);

    // 3. what goes out
    vtkNew<vtkDoubleArray> errors;
    errors->SetName("Error");
    errors->SetNumberOfComponents(3);
    vtkNew<vtkIntArray> ids;
    ids->SetName("Volume");
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> vertices;
    for (std::size_t i = 0; i < score.volumes.size(); ++i) {
      const echorama::VolumeScore& volume = score.volumes[i];
      for (std::size_t p = 0; p < volume.points.size(); ++p) {
        const vtkIdType id = points->InsertNextPoint(volume.points[p].data());
        vertices->InsertNextCell(1, &id);
        errors->InsertNextTuple(volume.errors[p].data());
        ids->InsertNextValue(static_cast<int>(i));
      }
      this->VolumeScores.push_back(volume.mean);
    }
    this->Score = score.mean;

    vtkInformation* out = outputs->GetInformationObject(0);
    vtkPolyData* output = vtkPolyData::GetData(out);
    if (out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_PIECE_NUMBER()) <= 0) {
      output->SetPoints(points);
      output->SetVerts(vertices);
      output->GetPointData()->AddArray(ids);
      output->GetPointData()->SetVectors(errors);
    }
    vtkUltrasoundVolume::AddField(output, "Score", &score.mean, 1);
    using Of = echorama::VolumeScore;
    for (const auto& [name, number] :
         {std::pair("VolumeScore", &Of::mean), std::pair("VolumeRms", &Of::rms), std::pair("VolumeMedian", &Of::median),
          std::pair("VolumePercentile95", &Of::percentile95), std::pair("VolumeMax", &Of::max)}) {
      vtkNew<vtkDoubleArray> values;
      values->SetName(name);
      for (const echorama::VolumeScore& volume : score.volumes) {
        values->InsertNextValue(volume.*number);
      }
      output->GetFieldData()->AddArray(values);
    }
    vtkNew<vtkStringArray> names;
    names->SetName("VolumeName");
    for (const echorama::ScoredVolume& volume : volumes) {
      names->InsertNextValue(volume.name);
    }
    output->GetFieldData()->AddArray(names);
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentScore::GetNumberOfVolumes() const
{
  return static_cast<int>(this->VolumeScores.size());
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentScore::GetVolumeScore(int volume) const
{
  return volume >= 0 && volume < this->GetNumberOfVolumes() ? this->VolumeScores[static_cast<std::size_t>(volume)] : NotANumber;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentScore::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Score: " << this->Score << "\n";
}
