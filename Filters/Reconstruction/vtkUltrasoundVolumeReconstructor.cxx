// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundVolumeReconstructor.h"

#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"

#include "vtkAlgorithmOutput.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <sstream>

using echorama::Error;
using Pipeline = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkUltrasoundVolumeReconstructor);

vtkUltrasoundParametersMacro(vtkUltrasoundVolumeReconstructor);

namespace {
const char* const NoPose = "it has no valid pose (ImageToWorld)";
const char* const OtherType = "its pixels are of another type than those of the first frame";

// What a frame may show: the sector, and of that what its own valid region allows. The store keeps what is combined.
echorama::VolumeView<const unsigned char> MaskOf(const vtkUltrasoundVolume::Input& frame,
                                                 const std::optional<echorama::Volume<unsigned char>>& sector,
                                                 echorama::Volume<unsigned char>& store)
{
  return echorama::BothMasks(vtkUltrasoundVolume::ViewOf<const unsigned char>(frame.ValidRegion, frame.Image),
                             sector ? sector->View() : echorama::VolumeView<const unsigned char>(), store);
}

vtkDataArray* MakeArray(vtkImageData* image, const char* name, int type)
{
  const auto array = vtkUltrasoundVolume::NewArray(type, image->GetNumberOfPoints(), name);
  image->GetPointData()->AddArray(array);
  return array;
}

// The arrays of a volume that is reconstructed.
struct Arrays {
  explicit Arrays(vtkImageData* image, int type)
    : Intensity(MakeArray(image, vtkUltrasoundVolume::IntensityName(), type)),
      Valid(MakeArray(image, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR)),
      Coverage(MakeArray(image, vtkUltrasoundVolumeReconstructor::CoverageName(), VTK_UNSIGNED_SHORT))
  {
    image->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  }

  template <class T>
  echorama::ReconstructionOutput<T> Views(vtkImageData* image) const
  {
    return {vtkUltrasoundVolume::ViewOf<T>(this->Intensity, image),
            vtkUltrasoundVolume::ViewOf<unsigned char>(this->Valid, image),
            vtkUltrasoundVolume::ViewOf<unsigned short>(this->Coverage, image)};
  }

  vtkDataArray* Intensity;
  vtkDataArray* Valid;
  vtkDataArray* Coverage;
};
} // namespace

//----------------------------------------------------------------------------
// The frames of the input, made one at a time.
class vtkUltrasoundVolumeReconstructor::Frames {
public:
  Frames(vtkUltrasoundVolumeReconstructor* self, vtkInformationVector** inputs) : Self(self)
  {
    this->Producer = self->GetInputAlgorithm(0, 0, this->Port);
    this->Executive = Pipeline::SafeDownCast(this->Producer->GetExecutive());
    vtkInformation* in = inputs[0]->GetInformationObject(0);
    std::vector<double> times;
    if (in->Has(Pipeline::TIME_STEPS())) {
      times.assign(in->Get(Pipeline::TIME_STEPS()), in->Get(Pipeline::TIME_STEPS()) + in->Length(Pipeline::TIME_STEPS()));
      std::sort(times.begin(), times.end());
    }
    this->Timed = !times.empty();
    this->Total = this->Timed ? static_cast<int>(times.size()) : 1;
    const int last = self->To < 0 ? this->Total - 1 : std::min(self->To, this->Total - 1);
    for (long frame = self->From; frame <= last; frame += self->EveryNth) {
      this->Numbers.push_back(static_cast<int>(frame));
      this->Times.push_back(this->Timed ? times[static_cast<std::size_t>(frame)] : 0.0);
    }
    if (this->Numbers.empty()) {
      throw Error(Error::Kind::InvalidParameter, "there is no frame from FirstFrame " + std::to_string(self->From) +
                                                     " to LastFrame " + std::to_string(self->To) + " in a sequence of " +
                                                     std::to_string(this->Total) + " frames");
    }
  }

  int Count() const { return static_cast<int>(this->Numbers.size()); }

  // The data of a frame lives until the next one is made.
  vtkUltrasoundVolume::Input Make(int index)
  {
    const std::string name = "frame " + std::to_string(this->Numbers[static_cast<std::size_t>(index)]);
    vtkInformation* information = this->Executive->GetOutputInformation(this->Port);
    const bool made = this->Request(information, this->Times[static_cast<std::size_t>(index)]);
    vtkImageData* image = vtkImageData::SafeDownCast(this->Executive->GetOutputData(this->Port));
    if (!made || !image) {
      throw Error(Error::Kind::BadInput,
                  name + " could not be made by " + this->Producer->GetClassName() + "; its own message says why");
    }
    vtkUltrasoundVolume::Input frame = vtkUltrasoundVolume::CheckInput(this->Self, image, name);
    if (image->GetDimensions()[2] != 1) {
      throw Error(Error::Kind::BadInput,
                  name + ": it has " + std::to_string(image->GetDimensions()[2]) + " slices; a frame is an image of one slice");
    }
    return frame;
  }

  // Others that show a frame of the same input find the one that they had asked for.
  void Restore(vtkInformation* in)
  {
    if (this->Timed && in->Has(Pipeline::UPDATE_TIME_STEP())) {
      this->Request(this->Executive->GetOutputInformation(this->Port), this->Shown);
    }
  }

  void Remember(vtkInformation* in)
  {
    if (in->Has(Pipeline::UPDATE_TIME_STEP())) {
      this->Shown = in->Get(Pipeline::UPDATE_TIME_STEP());
    }
  }

private:
  // Whether it succeeded; what is in the output otherwise is of an earlier time.
  bool Request(vtkInformation* information, double time)
  {
    if (!this->Executive->UpdateInformation()) {
      return false;
    }
    if (this->Timed) {
      information->Set(Pipeline::UPDATE_TIME_STEP(), time);
    }
    information->Set(Pipeline::UPDATE_PIECE_NUMBER(), 0);
    information->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), 1);
    information->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
    if (information->Has(Pipeline::WHOLE_EXTENT())) {
      int whole[6];
      information->Get(Pipeline::WHOLE_EXTENT(), whole);
      information->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
    }
    return this->Executive->Update(this->Port) != 0;
  }

  vtkUltrasoundVolumeReconstructor* Self;
  vtkAlgorithm* Producer = nullptr;
  Pipeline* Executive = nullptr;
  int Port = 0, Total = 0;
  bool Timed = false;
  double Shown = 0.0;
  std::vector<int> Numbers;
  std::vector<double> Times;
};

//----------------------------------------------------------------------------
// What is known before the volume is made, and of which state of the inputs.
struct vtkUltrasoundVolumeReconstructor::Plan : echorama::ReconstructionPlan {
  std::array<vtkMTimeType, 3> Times{}; // of the frames, the reference, and of this filter
  int Type = VTK_UNSIGNED_CHAR;
};

//----------------------------------------------------------------------------
struct vtkUltrasoundVolumeReconstructor::Live {
  vtkSmartPointer<vtkImageData> Image;
  int Type = VTK_UNSIGNED_CHAR;
  std::optional<echorama::Volume<unsigned char>> Sector; // made for the first frame
  std::unique_ptr<Arrays> Data;
  // Adds a frame to the reconstruction, whatever its voxel type.
  std::function<echorama::FrameUse(const vtkUltrasoundVolume::Input&, echorama::VolumeView<const unsigned char>,
                                   const Eigen::Affine3d&)>
      Add;
  std::function<int()> Between;
};

//----------------------------------------------------------------------------
vtkUltrasoundVolumeReconstructor::vtkUltrasoundVolumeReconstructor()
{
  this->SetNumberOfInputPorts(2);
}

vtkUltrasoundVolumeReconstructor::~vtkUltrasoundVolumeReconstructor() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::SetReferenceConnection(vtkAlgorithmOutput* output)
{
  this->SetInputConnection(1, output);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::SetReferenceData(vtkImageData* volume)
{
  this->SetInputData(1, volume);
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeReconstructor::FillInputPortInformation(int port, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  if (port == 1) {
    information->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundVolumeReconstructor::Parameters()
{
  using echorama::Choice;
  using echorama::Parameter;
  using echorama::Unlimited;
  return echorama::Join(
      {Describe(this->Making),
       Describe(this->Filling),
       {Parameter(
            "Sector", Choice(this->Part, {"all", "detected", "rectangle", "fan"}),
            "Which part of the images goes into the volume, of what their valid regions allow. Detected: the sector is found "
            "by what changes from frame to frame, so that what a scanner prints stays out; all pixels, with a warning, where "
            "hardly anything changes or frames come live."),
        Parameter("Grid", Choice(this->Directions, {"fitted", "world"}),
                  "How the grid lies when none is given: fitted to the data's own directions, or along the axes of the world."),
        Parameter("SpacingMm", this->Spacing, {0, Unlimited}, "mm",
                  "Edge of a voxel when no grid is given. 0: the longer edge of a pixel."),
        Parameter("FirstFrame", this->From, {0, Unlimited}, "", "The first frame to use, counted from 0 in the order of time."),
        Parameter("LastFrame", this->To, {-1, Unlimited}, "", "The last frame to use. -1: the last of the sequence."),
        Parameter("FrameStep", this->EveryNth, {1, Unlimited}, "", "Every n-th frame is used."),
        Parameter("MemoryLimitMb", this->MostMemoryMb, {0, Unlimited}, "MB",
                  "What takes more memory (in 10^6 bytes) is refused. 0: what is free on this machine.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
echorama::SectorParameters vtkUltrasoundVolumeReconstructor::GivenSector() const
{
  echorama::SectorParameters sector;
  sector.choice = this->Part;
  std::copy_n(this->Rectangle, 4, sector.rectangle.begin());
  sector.fan = {this->FanApex[0],   this->FanApex[1],   this->FanAngles[0],
                this->FanAngles[1], this->FanDepths[0], this->FanDepths[1]};
  return sector;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::Begin(const echorama::ImageGeometry& grid, int type)
{
  const double bytes =
      echorama::ReconstructionMemory(this->Making, grid, static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(type)));
  echorama::CheckMemory(grid, bytes / static_cast<double>(grid.VoxelCount()), this->MostMemoryMb);
  this->Statistics = Counts();
  this->Statistics.MemoryMb = bytes / 1e6;
  this->Statistics.Grid = echorama::SizeText(grid.dimensions);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::Refuse(const std::string& reason)
{
  ++this->Statistics.Refused;
  for (auto& [text, count] : this->Statistics.Reasons) {
    if (text == reason) {
      ++count;
      return;
    }
  }
  this->Statistics.Reasons.emplace_back(reason, 1);
}

//----------------------------------------------------------------------------
const vtkUltrasoundVolumeReconstructor::Plan& vtkUltrasoundVolumeReconstructor::Prepare(vtkInformationVector** inputs,
                                                                                        const echorama::Progress& progress)
{
  // Going through all frames is not to be repeated as long as nothing has changed.
  const auto timeOf = [this](int inputPort) -> vtkMTimeType {
    int port = 0;
    vtkAlgorithm* producer = this->GetNumberOfInputConnections(inputPort) ? this->GetInputAlgorithm(inputPort, 0, port) : nullptr;
    auto* executive = producer ? Pipeline::SafeDownCast(producer->GetExecutive()) : nullptr;
    return executive ? std::max(executive->GetPipelineMTime(), producer->GetMTime()) : 0;
  };
  const std::array<vtkMTimeType, 3> times{timeOf(0), timeOf(1), this->GetMTime()};
  if (this->Prepared && this->Prepared->Times == times) {
    return *this->Prepared;
  }
  this->Prepared.reset();
  echorama::CheckRanges(this->Parameters());
  auto plan = std::make_unique<Plan>();
  plan->Times = times;

  vtkInformation* in = inputs[0]->GetInformationObject(0);
  Frames frames(this, inputs);
  frames.Remember(in);
  const bool given = this->GetNumberOfInputConnections(1) > 0;
  echorama::ReconstructionSurvey survey(this->GivenSector());
  for (int index = 0; index < frames.Count(); ++index) {
    progress(0.9 * index / frames.Count());
    const vtkUltrasoundVolume::Input frame = frames.Make(index);
    vtkUltrasoundVolume::Dispatch(frame.Intensity, [&](auto type) {
      if (survey.Add(vtkUltrasoundVolume::ViewOf<const decltype(type)>(frame.Intensity, frame.Image),
                     vtkUltrasoundVolume::ViewOf<const unsigned char>(frame.ValidRegion, frame.Image),
                     vtkUltrasoundAcquisition::ImageToWorldOf(frame.Image))) {
        plan->Type = frame.Intensity->GetDataType();
      }
    });
    if (given && this->Part != echorama::SectorChoice::Detected && !survey.Empty()) {
      break; // the type is all that was to be learned
    }
  }
  frames.Restore(in);
  std::optional<echorama::ImageGeometry> grid;
  if (given) {
    int port = 0;
    vtkAlgorithm* producer = this->GetInputAlgorithm(1, 0, port);
    const bool made = producer->GetExecutive()->Update(port) != 0;
    vtkImageData* reference = vtkImageData::SafeDownCast(producer->GetOutputDataObject(port));
    if (!made || !reference || reference->GetNumberOfPoints() < 1) {
      throw Error(Error::Kind::BadInput, "the reference volume is empty");
    }
    grid = vtkUltrasoundVolume::GeometryOf(reference);
    grid->Check("the reference volume");
  }
  static_cast<echorama::ReconstructionPlan&>(*plan) =
      survey.Finish(grid, this->Directions, this->Spacing, progress.Part(0.9, 1.0));
  if (!plan->sectorFound) {
    vtkWarningMacro(<< plan->sectorText);
  }
  this->Prepared = std::move(plan);
  return *this->Prepared;
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeReconstructor::RequestInformation(vtkInformation*, vtkInformationVector** inputs,
                                                         vtkInformationVector* outputs)
{
  // A failure here ends the update: an earlier output would stay.
  const int done = vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    vtkInformation* out = outputs->GetInformationObject(0);
    const Plan& plan = this->Prepare(inputs, progress);
    vtkUltrasoundVolume::SetGeometry(out, plan.grid);
    vtkDataObject::SetPointDataActiveScalarInfo(out, plan.Type, 1);
    // One volume of all times.
    out->Remove(Pipeline::TIME_STEPS());
    out->Remove(Pipeline::TIME_RANGE());
  });
  this->Stopped = !done && this->GetAbortExecute();
  return done;
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeReconstructor::ComputePipelineMTime(vtkInformation* request, vtkInformationVector** inputs,
                                                           vtkInformationVector* outputs, int port, vtkMTimeType* time)
{
  if (this->Stopped) { // the pipeline takes information as made even where that was stopped
    this->Stopped = false;
    this->Modified();
  }
  return this->Superclass::ComputePipelineMTime(request, inputs, outputs, port, time);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::Execute(vtkInformationVector** inputs, vtkImageData* output,
                                               const echorama::Progress& progress)
{
  this->Statistics = Counts();
  const Plan& plan = this->Prepare(inputs, progress);
  this->Begin(plan.grid, plan.Type);
  this->Statistics.SectorText = plan.sectorText;
  output->Initialize();
  vtkUltrasoundVolume::SetGeometry(output, plan.grid);
  const Arrays arrays(output, plan.Type);
  vtkInformation* in = inputs[0]->GetInformationObject(0);
  Frames frames(this, inputs);
  frames.Remember(in);
  vtkUltrasoundVolume::Dispatch(arrays.Intensity, [&](auto type) {
    using T = decltype(type);
    const echorama::ReconstructionOutput<T> views = arrays.Views<T>(output);
    echorama::VolumeReconstruction<T> reconstruction(this->Making, plan.grid, views);
    echorama::Volume<unsigned char> store;
    for (int index = 0; index < frames.Count(); ++index) {
      progress(0.9 * index / frames.Count());
      const vtkUltrasoundVolume::Input frame = frames.Make(index);
      const auto pose = vtkUltrasoundAcquisition::ImageToWorldOf(frame.Image);
      if (!pose) {
        this->Refuse(NoPose);
        continue;
      }
      if (frame.Intensity->GetDataType() != plan.Type) {
        this->Refuse(OtherType);
        continue;
      }
      const auto pixels = vtkUltrasoundVolume::ViewOf<const T>(frame.Intensity, frame.Image);
      if (plan.sector && plan.sector->Dimensions() != pixels.Dimensions()) {
        this->Refuse("it is not of the size of the first frame, " + echorama::SizeText(plan.sector->Dimensions()));
        continue;
      }
      const echorama::FrameUse use = reconstruction.Add({pixels, MaskOf(frame, plan.sector, store), *pose});
      if (use != echorama::FrameUse::Used) {
        this->Refuse(echorama::FrameUseText(use));
      }
    }
    this->Statistics.Used = reconstruction.FramesUsed();
    this->Statistics.Between = reconstruction.FramesBetween();
    if (this->Statistics.Used == 0) {
      throw Error(Error::Kind::BadInput, "none of the frames could be used; " + this->GetReport());
    }
    this->Statistics.Seen = static_cast<vtkIdType>(views.valid.Size() - std::count(views.valid.begin(), views.valid.end(), 0));
    if (this->Filling.method != echorama::HoleFilling::Nothing) {
      this->Statistics.Filled = static_cast<vtkIdType>(
          echorama::FillHoles<T>(this->Filling, views.intensity, views.valid, views.coverage, progress.Part(0.9, 1.0)));
    }
  });
  frames.Restore(in);
  vtkNew<vtkStringArray> report;
  report->SetName(ReportName());
  std::istringstream lines(this->GetReport());
  for (std::string line; std::getline(lines, line);) {
    report->InsertNextValue(line);
  }
  output->GetFieldData()->AddArray(report);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundVolumeReconstructor::GetReport()
{
  const Counts& counts = this->Statistics;
  std::ostringstream text;
  text << counts.Used << " frames used, " << counts.Between << " put in between, " << counts.Refused << " refused\n";
  for (const auto& [reason, count] : counts.Reasons) {
    text << count << " refused: " << reason << "\n";
  }
  if (!counts.Grid.empty()) {
    text << counts.Grid << " voxels, " << counts.Seen << " seen, " << counts.Filled << " filled; " << counts.MemoryMb
         << " MB to make\n";
  }
  if (!counts.SectorText.empty()) {
    text << counts.SectorText << "\n";
  }
  return text.str();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeReconstructor::BeginLive(vtkImageData* grid, int vtkType)
{
  this->EndLive();
  return vtkUltrasoundVolume::Run(this, nullptr, [this, grid, vtkType](const echorama::Progress&) {
           if (!grid) {
             throw Error(Error::Kind::BadInput, "a live volume needs a grid");
           }
           echorama::CheckRanges(this->Parameters());
           const echorama::ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(grid);
           geometry.Check("the grid");
           this->Begin(geometry, vtkType);
           auto live = std::make_unique<Live>();
           live->Type = vtkType;
           live->Image = vtkSmartPointer<vtkImageData>::New();
           vtkUltrasoundVolume::SetGeometry(live->Image, geometry);
           live->Data = std::make_unique<Arrays>(live->Image, vtkType);
           vtkUltrasoundVolume::Dispatch(live->Data->Intensity, [&](auto type) {
             using T = decltype(type);
             auto reconstruction = std::make_shared<echorama::VolumeReconstruction<T>>(
                 this->Making, geometry, live->Data->template Views<T>(live->Image));
             live->Between = [reconstruction] { return reconstruction->FramesBetween(); };
             live->Add = [reconstruction](const vtkUltrasoundVolume::Input& frame, echorama::VolumeView<const unsigned char> mask,
                                          const Eigen::Affine3d& pose) {
               return reconstruction->Add({vtkUltrasoundVolume::ViewOf<const T>(frame.Intensity, frame.Image), mask, pose});
             };
           });
           this->LiveVolume = std::move(live);
         }) == 1;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeReconstructor::AddFrame(vtkImageData* image)
{
  bool used = false;
  vtkUltrasoundVolume::Run(this, nullptr, [this, image, &used](const echorama::Progress&) {
    if (!this->LiveVolume) {
      throw Error(Error::Kind::BadInput, "BeginLive comes before AddFrame");
    }
    if (!image) {
      throw Error(Error::Kind::BadInput, "a frame is missing");
    }
    Live& live = *this->LiveVolume;
    const vtkUltrasoundVolume::Input frame = vtkUltrasoundVolume::CheckInput(this, image, "the frame");
    const auto pose = vtkUltrasoundAcquisition::ImageToWorldOf(image);
    if (!pose) {
      this->Refuse(NoPose);
      return;
    }
    if (frame.Intensity->GetDataType() != live.Type) {
      this->Refuse("its pixels are not of the type of the live volume");
      return;
    }
    if (const echorama::FrameUse placed = echorama::CheckPose(*pose); placed != echorama::FrameUse::Used) {
      this->Refuse(echorama::FrameUseText(placed));
      return;
    }
    const std::array<int, 3> size = vtkUltrasoundVolume::GeometryOf(image).dimensions;
    if (!live.Sector || live.Sector->Dimensions() != size) {
      live.Sector = echorama::GivenSector(this->GivenSector(), size, *pose);
    }
    echorama::Volume<unsigned char> store;
    const echorama::FrameUse use = live.Add(frame, MaskOf(frame, live.Sector, store), *pose);
    used = use == echorama::FrameUse::Used;
    if (!used) {
      this->Refuse(echorama::FrameUseText(use));
      return;
    }
    ++this->Statistics.Used;
    this->Statistics.Between = live.Between();
    live.Data->Intensity->Modified();
    live.Data->Valid->Modified();
    live.Data->Coverage->Modified();
    live.Image->Modified();
  });
  return used;
}

//----------------------------------------------------------------------------
vtkImageData* vtkUltrasoundVolumeReconstructor::GetLiveOutput()
{
  return this->LiveVolume ? this->LiveVolume->Image.Get() : nullptr;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundVolumeReconstructor::FillLiveHoles()
{
  if (!this->LiveVolume) {
    vtkErrorMacro("BeginLive comes before FillLiveHoles");
    return 0;
  }
  vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress& progress) {
    Live& live = *this->LiveVolume;
    vtkUltrasoundVolume::Dispatch(live.Data->Intensity, [&](auto type) {
      const auto views = live.Data->template Views<decltype(type)>(live.Image);
      this->Statistics.Filled = static_cast<vtkIdType>(
          echorama::FillHoles<decltype(type)>(this->Filling, views.intensity, views.valid, views.coverage, progress));
      this->Statistics.Seen =
          static_cast<vtkIdType>(views.coverage.Size() - std::count(views.coverage.begin(), views.coverage.end(), 0));
    });
    live.Data->Intensity->Modified();
    live.Data->Valid->Modified();
    live.Image->Modified();
  });
  return this->Statistics.Filled;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::EndLive()
{
  this->LiveVolume.reset();
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeReconstructor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Rectangle: " << this->Rectangle[0] << " " << this->Rectangle[1] << " " << this->Rectangle[2] << " "
     << this->Rectangle[3] << "\n";
  os << indent << "FanApex: " << this->FanApex[0] << " " << this->FanApex[1] << "\n";
  os << indent << "FanAngles: " << this->FanAngles[0] << " " << this->FanAngles[1] << "\n";
  os << indent << "FanDepths: " << this->FanDepths[0] << " " << this->FanDepths[1] << "\n";
  os << indent << "Report: " << this->GetReport();
}
