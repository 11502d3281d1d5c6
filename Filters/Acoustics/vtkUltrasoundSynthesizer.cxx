// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSynthesizer.h"

#include "Core/Base/Angles.h"
#include "Core/Base/NumberText.h"
#include "Core/Imaging/ScanConversion.h"
#include "vtkAlgorithmOutput.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundDisplacement.h"
#include "vtkUltrasoundTissue.h"

#include <algorithm>
#include <utility>

using echorama::Error;
using echorama::SynthesisParameters;

vtkStandardNewMacro(vtkUltrasoundSynthesizer);

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
  const echorama::ProbeGeometry& probe = this->Values.probe;
  this->FanAngle = probe.fanAngle * echorama::DegreesPerRadian;
  this->FanRadius = probe.fanWidth / probe.fanAngle;
  this->SweepAngle = probe.sweepAngle * echorama::DegreesPerRadian;
  this->SweepRadius = probe.sweepWidth / probe.sweepAngle;
  this->DepthMin = probe.depthMin;
  this->DepthMax = probe.depthMax;
  std::fill_n(this->Position, 3, 0.0);
  std::fill_n(this->Orientation, 3, 0.0);
}

//----------------------------------------------------------------------------
vtkUltrasoundSynthesizer::~vtkUltrasoundSynthesizer() = default;

//----------------------------------------------------------------------------
// Each number has its home in the kernel's parameters, which also know its range.
#define EchoramaParameter(Name, Type, place)                                                                                     \
  void vtkUltrasoundSynthesizer::Set##Name(Type value)                                                                           \
  {                                                                                                                              \
    using Value = decltype(this->Values.place);                                                                                  \
    if (this->Values.place != static_cast<Value>(value)) {                                                                       \
      this->Values.place = static_cast<Value>(value);                                                                            \
      this->Modified();                                                                                                          \
    }                                                                                                                            \
  }                                                                                                                              \
  Type vtkUltrasoundSynthesizer::Get##Name() const                                                                               \
  {                                                                                                                              \
    return static_cast<Type>(this->Values.place);                                                                                \
  }

EchoramaParameter(Mode, int, mode) EchoramaParameter(Seed, vtkTypeInt64, seed) EchoramaParameter(Elements, int, elements)
    EchoramaParameter(Steps, int, steps) EchoramaParameter(Samples, int, samples)
        EchoramaParameter(FrequencyMHz, double, transducer.frequencyMHz)
            EchoramaParameter(Bandwidth, double, transducer.bandwidth) EchoramaParameter(LateralApertureMm, double,
                                                                                         transducer.lateralApertureMm)
                EchoramaParameter(LateralFocusMm, double, transducer.lateralFocusMm)
                    EchoramaParameter(ElevationApertureMm, double, transducer.elevationApertureMm)
                        EchoramaParameter(ElevationFocusMm, double, transducer.elevationFocusMm)
                            EchoramaParameter(MaxBounces, int, transport.maxBounces) EchoramaParameter(FaceReflection, double,
                                                                                                       transport.faceReflection)
                                EchoramaParameter(MirrorDb, double, mirrorDb) EchoramaParameter(SubRays, int, subRays)
                                    EchoramaParameter(ScatterersPerMm3, double, scatterersPerMm3)
                                        EchoramaParameter(RaysPerElement, int, counting.raysPerElement)
                                            EchoramaParameter(Clarity, double, counting.clarity)
                                                EchoramaParameter(GainDb, double, receiver.gainDb)
                                                    EchoramaParameter(TgcDbPerCm, double, receiver.tgcDbPerCm)
                                                        EchoramaParameter(DynamicRangeDb, double, receiver.dynamicRangeDb)
                                                            EchoramaParameter(ReferenceGrey, double, receiver.referenceGrey)
                                                                EchoramaParameter(NoiseDb, double, receiver.noiseDb)
                                                                    EchoramaParameter(NoiseSeed, vtkTypeInt64, receiver.noiseSeed)

#undef EchoramaParameter

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
  echorama::Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(probeToWorld->GetData());
  if (!echorama::IsRotation(pose.linear()) || !pose.translation().allFinite() ||
      pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    vtkErrorMacro("ProbeToWorld is not a rigid transform; the pose was not changed");
    return;
  }
  const Eigen::Vector3d turn = echorama::LogRotation(pose.linear()) * echorama::DegreesPerRadian;
  this->SetOrientation(turn.x(), turn.y(), turn.z());
  this->SetPosition(pose.translation().x(), pose.translation().y(), pose.translation().z());
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::GetProbeToWorld(vtkMatrix4x4* probeToWorld)
{
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = this->OwnPose().matrix();
  probeToWorld->DeepCopy(rows.data());
}

//----------------------------------------------------------------------------
echorama::Pose vtkUltrasoundSynthesizer::OwnPose() const
{
  echorama::Pose pose = echorama::Pose::Identity();
  pose.linear() = echorama::ExpRotation(Eigen::Map<const Eigen::Vector3d>(this->Orientation) / echorama::DegreesPerRadian);
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(this->Position);
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
  Job job;
  SynthesisParameters& p = job.Parameters;
  p = this->Values;
  for (const auto& [name, seed] : {std::pair("Seed", this->GetSeed()), std::pair("NoiseSeed", this->GetNoiseSeed())}) {
    if (seed < 0) {
      throw Error(Error::Kind::InvalidParameter, std::string(name) + " is " + std::to_string(seed) + "; it must be at least 0");
    }
  }
  if (vtkDataObject* probe = DataOn(inputs[Probe])) {
    const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(probe);
    if (!geometry) {
      throw Error(Error::Kind::BadInput, std::string("the probe: it has no field data ") +
                                             vtkUltrasoundAcquisition::ProbeGeometryName() + " of 6 or 7 finite numbers");
    }
    p.probe = *geometry;
    p.probeToWorld = vtkUltrasoundAcquisition::ProbeToWorldOf(probe).value_or(echorama::Pose::Identity());
  } else {
    p.probe = echorama::ProbeGeometry::Convex(this->FanAngle / echorama::DegreesPerRadian, this->FanRadius,
                                              this->SweepAngle / echorama::DegreesPerRadian, this->SweepRadius, this->DepthMin,
                                              this->DepthMax);
    p.probeToWorld = this->OwnPose();
  }
  p.probe.Check();
  if (this->SliceOnly && !p.probe.IsPlane()) {
    p = echorama::SliceOf(p, this->SlicePosition);
  }
  p.Check();
  const double spacing = this->SpacingMm == 0.0 ? echorama::SampleSpacing(p.BeamDimensions(), p.probe) : this->SpacingMm;
  job.Grid = echorama::ScanConversionGrid(p.probe, p.probeToWorld, spacing, MaximumVoxels);
  return job;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSynthesizer::RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // Field data does not travel with the information of the pipeline.
  if (this->GetNumberOfInputConnections(Probe) > 0) {
    int port = 0;
    this->GetInputAlgorithm(Probe, 0, port)->Update(port);
  }
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
  if (!this->Kept || this->Kept->Tissue != tissue || this->Kept->Time != tissue->GetMTime()) {
    this->Kept.reset();
    this->Kept.reset(new SceneOfInput{tissue, tissue->GetMTime(),
                                      echorama::AcousticScene(vtkUltrasoundTissue::Of(tissue), progress.Part(0.0, 0.1))});
  }
  const auto made = echorama::SynthesizeBeams(this->Kept->Scene, p, progress.Part(0.1, 0.95), &this->LastCost);
  this->Notes = NotesOn(this->Kept->Scene, this->LastCost);

  vtkImageData* beams = vtkImageData::SafeDownCast(this->GetOutputDataObject(1));
  beams->Initialize();
  echorama::ImageGeometry beamGrid;
  beamGrid.dimensions = p.BeamDimensions();
  vtkUltrasoundVolume::SetGeometry(beams, beamGrid);
  vtkDataArray* samples = AddArray(beams, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
  beams->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  std::copy(made.View().begin(), made.View().end(), vtkUltrasoundVolume::ViewOf<unsigned char>(samples, beams).begin());

  output->Initialize(); // the pipeline has passed on what the tissue says of itself
  vtkUltrasoundVolume::SetGeometry(output, job.Grid);
  vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), VTK_UNSIGNED_CHAR);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  echorama::ScanConvert<unsigned char>(made.View(), p.probe, p.probeToWorld, job.Grid,
                                       vtkUltrasoundVolume::ViewOf<unsigned char>(intensity, output),
                                       vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output), progress.Part(0.95, 1.0));
  for (vtkImageData* each : {output, beams}) {
    vtkUltrasoundAcquisition::SetProbeGeometry(each, p.probe);
    vtkUltrasoundAcquisition::SetProbeToWorld(each, p.probeToWorld);
    vtkUltrasoundAcquisition::SetSeed(each, p.seed);
    vtkUltrasoundAcquisition::SetScene(each, echorama::DescribeSynthesis(p));
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundSynthesizer::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Parameters: " << echorama::DescribeSynthesis(this->Values) << "\n";
  os << indent << "Fan: " << this->FanAngle << " degrees, radius " << this->FanRadius << "\n";
  os << indent << "Sweep: " << this->SweepAngle << " degrees, radius " << this->SweepRadius << "\n";
  os << indent << "Depth: " << this->DepthMin << " to " << this->DepthMax << "\n";
  os << indent << "Position: " << this->Position[0] << " " << this->Position[1] << " " << this->Position[2] << "\n";
  os << indent << "Orientation: " << this->Orientation[0] << " " << this->Orientation[1] << " " << this->Orientation[2] << "\n";
  os << indent << "SliceOnly: " << this->SliceOnly << " at " << this->SlicePosition << "\n";
  os << indent << "SpacingMm: " << this->SpacingMm << "\n";
  os << indent << "Notes: " << this->Notes << "\n";
}
