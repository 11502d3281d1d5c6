// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSynthesizer.h"

#include "Core/Base/Angles.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "SeenTissue.h"
#include "vtkAlgorithmOutput.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundDisplacement.h"
#include "vtkUltrasoundTissue.h"

#include <algorithm>
#include <limits>

using echorama::Error;
using echorama::SynthesisParameters;

vtkStandardNewMacro(vtkUltrasoundSynthesizer);

vtkUltrasoundParametersMacro(vtkUltrasoundSynthesizer);

namespace {
constexpr std::size_t MaximumVoxels = 536870912; // 2^29

enum Port { Tissue, Probe, Displacement };

vtkDataObject* DataOn(vtkInformationVector* port)
{
  vtkInformation* info = port->GetInformationObject(0);
  return info ? info->Get(vtkDataObject::DATA_OBJECT()) : nullptr;
}

// What the scene and the run have to say, a line each.
std::string NotesOn(const echorama::AcousticScene& scene, const echorama::SynthesisCost& cost)
{
  std::string text;
  const auto say = [&text](double count, const char* what) {
    if (count > 0.0) {
      text += echorama::NumberText(count) + what;
    }
  };
  const auto& notes = scene.GetNotes();
  say(static_cast<double>(notes.degenerateTriangles), " triangles without area were left out\n");
  say(notes.turnedShells, " surfaces were inside out and are taken the right way round\n");
  say(notes.leakyShells, " surfaces have small holes; their inside is what they nearly close\n");
  say(notes.sheets, " surfaces are open: they reflect, but nothing lies inside them\n");
  say(static_cast<double>(cost.rays), " rays\n");
  say(static_cast<double>(cost.segments), " straight pieces of the ways of sound\n");
  say(static_cast<double>(cost.surfaceEchoes), " echoes of surfaces\n");
  say(static_cast<double>(cost.scatterers), " scatterers\n");
  const auto seconds = [&text](const char* stage, double value) {
    char line[80];
    std::snprintf(line, sizeof(line), "%s: %.3f s\n", stage, value);
    text += line;
  };
  seconds("rays", cost.raysSeconds);
  seconds("scatterers", cost.scatterersSeconds);
  seconds("echoes", cost.echoesSeconds);
  seconds("detection", cost.detectionSeconds);
  say(1e-6 * static_cast<double>(cost.bytes), " MB\n");
  return text;
}
} // namespace

// The structure that rays ask, and the tissue it was made from.
struct vtkUltrasoundSynthesizer::SceneOfInput {
  vtkPolyData* Tissue;
  vtkMTimeType Time;
  echorama::AcousticScene Scene;
};

// What the inputs and our parameters come to.
struct vtkUltrasoundSynthesizer::Job {
  SynthesisParameters Parameters;
  echorama::ImageGeometry Grid;
};

//----------------------------------------------------------------------------
vtkUltrasoundSynthesizer::vtkUltrasoundSynthesizer()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundSynthesizer::~vtkUltrasoundSynthesizer() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSynthesizer::Parameters()
{
  using echorama::Parameter;
  auto& v = this->Own;
  const std::string otherwise = " Not used with a probe input.";
  echorama::ParameterList values = Describe(this->Values);
  // Counting has rays of its own, which know neither pulse nor beam. WideBeams says so itself.
  SynthesisParameters other;
  const echorama::ParameterList model = Without(Describe(static_cast<echorama::EchoModel&>(other)),
                                                {"Mode", "DynamicRangeDb", "WideBeams"}),
                                sound = Without(Describe(other.transducer), {"AssumedSoundSpeed"}),
                                scatterers = {echorama::Named(values, "ScatterersPerMm3"),
                                              echorama::Named(values, "InvisibleDb")};
  for (const Parameter& unused : echorama::Join({model, sound, scatterers})) {
    if (Parameter& mine = echorama::Named(values, unused.name); mine.whenName.empty()) {
      mine.When("Mode", "coherent");
    }
  }
  return echorama::Join(
      {{Parameter("Position", v.position, {}, "mm", "Where the middle of the probe's face lies in the world." + otherwise),
        Parameter("Orientation", v.orientation, {}, "degrees",
                  "How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x." + otherwise),
        Parameter("FanAngle", v.fanAngle, {0, 359.999}, "degrees",
                  "Angle between the first and the last beam of a fan." + otherwise),
        Parameter("FanRadius", v.fanRadius, {0, 10000}, "mm", "Radius of the array." + otherwise),
        Parameter("SweepAngle", v.sweepAngle, {0, 359.999}, "degrees",
                  "Angle that the array sweeps. 0: a single plane." + otherwise),
        Parameter("SweepRadius", v.sweepRadius, {0, 10000}, "mm", "How far the face is from the axis of the sweep." + otherwise),
        Parameter("DepthMin", v.depthMin, {-10000, 10000}, "mm", "First depth along the beams, from the face." + otherwise),
        Parameter("DepthMax", v.depthMax, {-10000, 10000}, "mm", "Last depth along the beams, from the face." + otherwise),
        Parameter("SliceOnly", v.sliceOnly, "Whether only one plane of the sweep is made, a 2D image: for interaction."),
        Parameter("SlicePosition", v.slicePosition, {-0.5, 0.5}, "whole sweeps",
                  "Which plane of the sweep: -0.5 is the first, 0.5 the last.")
            .When("SliceOnly", "on"),
        Parameter("SpacingMm", v.spacingMm, {0, 1000}, "mm", "Edge of the cubic voxels. 0: about as many voxels as samples.")},
       std::move(values)});
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::SetParameters(const SynthesisParameters& parameters)
{
  this->Values = parameters;
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::SetProbeConnection(vtkAlgorithmOutput* probe)
{
  this->SetInputConnection(Probe, probe);
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::SetDisplacementConnection(vtkAlgorithmOutput* displacement)
{
  this->SetInputConnection(Displacement, displacement);
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::SetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const auto pose = vtkUltrasoundVolume::RigidPoseOf(probeToWorld);
  if (!pose) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  this->Own.orientation = echorama::LogRotation(pose->linear()) * echorama::DegreesPerRadian;
  this->Own.position = pose->translation();
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  vtkUltrasoundVolume::SetMatrix(probeToWorld, this->OwnPose());
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundSynthesizer::OwnPose() const
{
  echorama::Pose pose = echorama::Pose::Identity();
  pose.linear() = echorama::ExpRotation(this->Own.orientation / echorama::DegreesPerRadian);
  pose.translation() = this->Own.position;
  return pose;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSynthesizer::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), port == Tissue  ? "vtkPolyData"
                                                      : port == Probe ? "vtkDataObject"
                                                                      : "vtkImageData");
  if (port != Tissue) {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
vtkUltrasoundSynthesizer::Job vtkUltrasoundSynthesizer::Prepare(vtkInformationVector** inputs)
{
  echorama::CheckRanges(this->Parameters());
  Job job;
  SynthesisParameters& p = job.Parameters;
  p = this->Values;
  if (vtkDataObject* probe = DataOn(inputs[Probe])) {
    const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(probe);
    if (!geometry) {
      throw Error(Error::Kind::BadInput, std::string("the probe: it has no field data ") +
                                             vtkUltrasoundAcquisition::ProbeGeometryName() + " of 6 or 7 finite numbers");
    }
    p.probe = *geometry;
    p.probeToWorld = vtkUltrasoundAcquisition::ProbeToWorldOf(probe).value_or(echorama::Pose::Identity());
  } else {
    const auto& v = this->Own;
    p.probe = echorama::ProbeGeometry::Convex(v.fanAngle / echorama::DegreesPerRadian, v.fanRadius,
                                              v.sweepAngle / echorama::DegreesPerRadian, v.sweepRadius, v.depthMin, v.depthMax);
    p.probeToWorld = this->OwnPose();
  }
  p.probe.Check();
  if (this->Own.sliceOnly && !p.probe.IsPlane()) {
    p = echorama::SliceOf(p, this->Own.slicePosition);
  }
  p.Check();
  const double spacing = this->Own.spacingMm == 0.0 ? echorama::SampleSpacing(p.BeamDimensions(), p.probe) : this->Own.spacingMm;
  job.Grid = echorama::ScanConversionGrid(p.probe, p.probeToWorld, spacing, MaximumVoxels);
  return job;
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::UpdateInput(int port)
{
  if (this->GetNumberOfInputConnections(port) > 0) {
    int output = 0;
    this->GetInputAlgorithm(port, 0, output)->Update(output);
  }
}

//----------------------------------------------------------------------------
const echorama::AcousticScene& vtkUltrasoundSynthesizer::SceneOf(vtkPolyData* tissue, const echorama::Progress& progress)
{
  if (!this->Kept || this->Kept->Tissue != tissue || this->Kept->Time != tissue->GetMTime()) {
    this->Kept.reset();
    this->Kept.reset(
        new SceneOfInput{tissue, tissue->GetMTime(), echorama::AcousticScene(vtkUltrasoundTissue::Of(tissue), progress)});
  }
  return this->Kept->Scene;
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::TissueToSeen(vtkPoints* from, vtkPoints* to)
{
  if (!from || !to) {
    return;
  }
  vtkNew<vtkPoints> seen;
  seen->SetDataTypeToDouble();
  seen->SetNumberOfPoints(from->GetNumberOfPoints());
  auto* places = static_cast<double*>(seen->GetVoidPointer(0));
  std::fill_n(places, 3 * from->GetNumberOfPoints(), std::numeric_limits<double>::quiet_NaN());
  this->UpdateInput(Tissue);
  this->UpdateInput(Probe);
  vtkUltrasoundVolume::Run(this, nullptr, [this, from, places](const echorama::Progress& progress) {
    vtkInformationVector** inputs = this->GetExecutive()->GetInputInformation();
    vtkPolyData* tissue = vtkPolyData::SafeDownCast(DataOn(inputs[Tissue]));
    if (!tissue) {
      throw Error(Error::Kind::BadInput, "there is no tissue on input 0");
    }
    const SynthesisParameters parameters = this->Prepare(inputs).Parameters;
    const echorama::SeenTissue map(this->SceneOf(tissue, progress.Part(0.0, 0.2)), parameters, progress.Part(0.2, 0.9));
    constexpr std::ptrdiff_t pointsPerRange = 64;
    echorama::ParallelRanges(from->GetNumberOfPoints(), pointsPerRange, progress.Part(0.9, 1.0),
                             [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                               for (std::ptrdiff_t i = begin; i < end; ++i) {
                                 Eigen::Vector3d point;
                                 from->GetPoint(i, point.data());
                                 if (const auto place = map.Seen(point)) {
                                   std::copy_n(place->data(), 3, places + 3 * i);
                                 }
                               }
                             });
  });
  to->ShallowCopy(seen);
}

//----------------------------------------------------------------------------
int vtkUltrasoundSynthesizer::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Field data does not travel with the information of the pipeline.
  this->UpdateInput(Probe);
  return vtkUltrasoundVolume::Run(this, nullptr, [this, inputs, outputs](const echorama::Progress&) {
    const Job job = this->Prepare(inputs);
    echorama::ImageGeometry beams;
    beams.dimensions = job.Parameters.BeamDimensions();
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(0), job.Grid);
    vtkUltrasoundVolume::SetGeometry(outputs->GetInformationObject(1), beams);
    for (int port = 0; port < 2; ++port) {
      vtkDataObject::SetPointDataActiveScalarInfo(outputs->GetInformationObject(port), VTK_UNSIGNED_CHAR, 1);
    }
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundSynthesizer::RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* out = outputs->GetInformationObject(1);
  vtkImageData* beams = vtkImageData::GetData(out);
  if (!this->Superclass::RequestData(request, inputs, outputs)) {
    return 0;
  }
  if (beams->GetNumberOfPoints() > 0 && out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT())) {
    int wanted[6];
    out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
    beams->Crop(wanted);
  }
  return 1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  this->Notes.clear();
  Job job = this->Prepare(inputs);
  SynthesisParameters& p = job.Parameters;
  vtkPolyData* tissue = vtkPolyData::GetData(inputs[Tissue]);
  if (auto* displacement = vtkImageData::SafeDownCast(DataOn(inputs[Displacement]))) {
    p.displacement = vtkUltrasoundDisplacement::FieldOf(displacement, "the displacement of the tissue");
  }
  const echorama::AcousticScene& scene = this->SceneOf(tissue, progress.Part(0.0, 0.1));
  const auto made = echorama::SynthesizeBeams(scene, p, progress.Part(0.1, 0.95), &this->LastCost);
  this->Notes = NotesOn(scene, this->LastCost);

  SetOutputs(p, made.View(), job.Grid, output, vtkImageData::SafeDownCast(this->GetOutputDataObject(1)),
             progress.Part(0.95, 1.0));
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::SetOutputs(const SynthesisParameters& p, echorama::VolumeView<const unsigned char> made,
                                          const echorama::ImageGeometry& grid, vtkImageData* output, vtkImageData* beams,
                                          const echorama::Progress& progress)
{
  if (beams) {
    beams->Initialize();
    echorama::ImageGeometry beamGrid;
    beamGrid.dimensions = p.BeamDimensions();
    vtkUltrasoundVolume::SetGeometry(beams, beamGrid);
    vtkDataArray* samples = AddArray(beams, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
    beams->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
    std::copy(made.begin(), made.end(), vtkUltrasoundVolume::ViewOf<unsigned char>(samples, beams).begin());
  }
  output->Initialize(); // the pipeline has passed on what the tissue says of itself
  vtkUltrasoundVolume::SetGeometry(output, grid);
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  echorama::ScanConvert<unsigned char>(made, p.probe, p.probeToWorld, grid,
                                       vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output),
                                       vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output), progress);
  for (vtkImageData* each : {output, beams}) {
    if (each) {
      vtkUltrasoundAcquisition::SetProbeGeometry(each, p.probe);
      vtkUltrasoundAcquisition::SetProbeToWorld(each, p.probeToWorld);
      vtkUltrasoundAcquisition::SetSeed(each, p.seed);
      vtkUltrasoundAcquisition::SetScene(each, echorama::DescribeSynthesis(p));
    }
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->Notes << "\n";
}
