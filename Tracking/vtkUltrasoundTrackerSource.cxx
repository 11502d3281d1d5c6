// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTrackerSource.h"

#include "Core/Base/Angles.h"
#include "Core/Base/JoinedText.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/TransformFile.h"
#include "Tracking/Devices/ReplayTracker.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/StreamReport.h"

#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUltrasoundSkinNormals.h"
#include "vtkUltrasoundTrackerOutputs.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

using echorama::Error;
using echorama::LiveTransform;
using echorama::LiveTransforms;
using echorama::TransformStatus;

vtkStandardNewMacro(vtkUltrasoundTrackerSource);

vtkUltrasoundParametersMacro(vtkUltrasoundTrackerSource);

namespace {
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

std::string TextOf(const char* text)
{
  return text ? text : "";
}
} // namespace

// A device that was opened, and all that came from it.
struct vtkUltrasoundTrackerSource::Session {
  echorama::PoseStream Poses;
  echorama::ImageStream Images;
  std::unique_ptr<LiveTransforms> Transforms; // empty: to be made anew
  std::unique_ptr<echorama::StreamRecorder> Recorder;
  std::unique_ptr<echorama::TrackerDevice> Device; // which writes to what is above, so it goes first
  std::vector<double> Times;                       // of a recording that is shown as a whole
  double TimeShown = NaN;                          // of that recording
  std::optional<echorama::ShownImage> Image;       // that output 1 shows
  std::uint64_t PosesShown = 0, ImagesShown = 0;   // versions
  double FreshSeconds = 0.0;                       // of the transforms
  double FreshUntil = 0.0;                         // our clock: when a tool that is shown becomes too old

  explicit Session(const echorama::StreamLimits& limits) : Poses(limits) {}
  bool IsWhole() const { return !Times.empty(); }
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTrackerSource::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {{Parameter(
            "WorldFrame", this->WorldFrame,
            "The frame of coordinates that is the world. Tools that no transforms lead from to it are missing. Empty takes the "
            "frame that most tools are seen in, usually Tracker."),
        Parameter("ImageFrame", this->ImageFrame, "The frame of coordinates that counts pixels of the image.").Advanced()},
       echorama::Without(Describe(this->Limits), {"PosesPerTool", "Tools", "JumpSeconds"}),
       {Parameter("FreshSeconds", this->FreshSeconds, {0, 3600, true}, "s",
                  "A tool whose newest pose, of a live device, came longer ago is missing.")
            .Advanced(),
        Parameter("AxisLengthMm", this->AxisLengthMm, {0, echorama::Unlimited}, "mm", "Length of the axes in output 2.")}});
}

//----------------------------------------------------------------------------
vtkUltrasoundTrackerSource::vtkUltrasoundTrackerSource() : Time(NaN)
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(3);
}

//----------------------------------------------------------------------------
vtkUltrasoundTrackerSource::~vtkUltrasoundTrackerSource() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Device: " << this->Device << "\n";
  os << indent << "Active: " << this->Active << "\n";
  os << indent << "TransformFile: " << this->TransformFile << "\n";
  os << indent << "Time: " << this->Time << "\n";
  os << indent << "FollowTime: " << this->FollowTime << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "State: " << this->GetState() << "\n";
  os << indent << "Message: " << this->GetMessage() << "\n";
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetDevice(const char* device)
{
  if (this->Device != TextOf(device)) {
    this->Device = TextOf(device);
    this->Close();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetDeviceKinds()
{
  return echorama::Joined(echorama::TrackerSchemes());
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetActive(bool active)
{
  if (!active && this->Opened && this->Opened->Device) {
    this->Opened->Device->Stop();
    this->Opened->Device.reset();
    this->Opened->Poses.SetState(echorama::DeviceState::Idle, "stopped");
  }
  if (this->Active != active) {
    this->Active = active;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::Start()
{
  this->SetActive(true);
  return vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress&) { this->Open(); }) != 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetTransformFile(const char* fileName)
{
  if (this->TransformFile != TextOf(fileName)) {
    this->TransformFile = TextOf(fileName);
    if (this->Opened) {
      this->Opened->Transforms.reset();
    }
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetTime(double time)
{
  if (!(this->Time == time || (std::isnan(this->Time) && std::isnan(time)))) {
    this->Time = time;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetFollowTime(bool follow)
{
  if (this->FollowTime != follow) {
    this->FollowTime = follow;
    this->Close(); // it is opened in another way
    this->Modified();
  }
}

//----------------------------------------------------------------------------
// Opens the device when there is one that is not open, and is to be. Whoever subscribes before it starts misses no pose.
void vtkUltrasoundTrackerSource::Open(std::shared_ptr<echorama::PoseSubscription>* subscription)
{
  if (!this->Active || (this->Opened && this->Opened->Device)) {
    return;
  }
  this->Close();
  try {
    echorama::CheckRanges(this->Parameters());
    if (this->Device.empty()) {
      throw Error(Error::Kind::InvalidParameter, "there is no Device; its kinds are " + GetDeviceKinds());
    }
    echorama::StreamLimits limits = this->Limits;
    auto device = echorama::MakeTracker(this->Device);
    auto* recording = this->FollowTime ? dynamic_cast<echorama::ReplayTracker*>(device.get()) : nullptr;
    if (recording) {
      limits.posesPerTool = 1000000; // whatever it holds; memory is taken as it is needed
    }
    auto session = std::make_unique<Session>(limits);
    session->Device = std::move(device); // from here on: should anything throw, it goes before what it writes to
    if (recording) {
      recording->ShowAll(session->Poses, &session->Images);
      session->Times = recording->Times();
      session->TimeShown = session->Times.front();
    } else {
      if (subscription) {
        *subscription = session->Poses.Subscribe();
      }
      if (auto* fused = dynamic_cast<echorama::FusedTracker*>(session->Device.get())) {
        fused->SetNormals(this->Normals);
      }
      session->Device->Start(session->Poses, &session->Images);
    }
    this->Opened = std::move(session);
    this->Updated();
  } catch (const Error& error) {
    this->Close();
    this->Failure = error.what();
    throw;
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::Close()
{
  if (echorama::StreamRecorder* recorder = this->Opened ? this->Opened->Recorder.get() : nullptr) {
    this->Opened->Device.reset(); // what it has sent is recorded
    std::string problem = "the recording ended with its device";
    try {
      recorder->StopIfAnything();
    } catch (const Error& error) {
      problem += std::string(": ") + error.what();
      vtkErrorMacro(<< problem);
    }
    this->Ended = recorder->State();
    this->Ended.problem = problem;
  }
  this->Opened.reset();
  this->Failure.clear();
}

//----------------------------------------------------------------------------
// What is open, with its transforms; nullptr when nothing is.
vtkUltrasoundTrackerSource::Session* vtkUltrasoundTrackerSource::Updated()
{
  if (this->Opened && (!this->Opened->Transforms || this->Opened->FreshSeconds != this->FreshSeconds)) {
    const std::string& file = this->TransformFile;
    this->Opened->Transforms = std::make_unique<LiveTransforms>(
        this->Opened->Poses, file.empty() ? std::vector<echorama::NamedTransform>() : echorama::ReadTransforms(file),
        this->FreshSeconds);
    this->Opened->FreshSeconds = this->FreshSeconds;
  }
  return this->Opened.get();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::GetNeedsUpdate()
{
  const Session* session = this->Opened.get();
  if (!session || !(session->Poses.Version() != session->PosesShown || session->Images.Version() != session->ImagesShown ||
                    echorama::ClockNow() > session->FreshUntil)) {
    return false;
  }
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::WaitForPoses(int count, double seconds)
{
  return this->Start() && this->Opened->Poses.WaitForPoses(static_cast<std::uint64_t>(std::max(count, 0)), seconds);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::Step()
{
  if (!this->Start()) {
    return false;
  }
  auto* recording = dynamic_cast<echorama::ReplayTracker*>(this->Opened->Device.get());
  if (!recording || !recording->Step()) {
    return false;
  }
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetState() const
{
  using echorama::DeviceState;
  return DeviceStateText(!this->Failure.empty() ? DeviceState::Failed
                         : this->Opened         ? this->Opened->Poses.State().first
                                                : DeviceState::Idle);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetMessage() const
{
  return this->Opened ? this->Opened->Poses.State().second : this->Failure;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetReport() const
{
  return this->Opened ? echorama::StreamReport(this->Opened->Poses.Statistics()) : "";
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerSource::GetNumberOfTools() const
{
  return this->Opened ? static_cast<int>(this->Opened->Poses.Tools().size()) : 0;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetToolName(int index) const
{
  const std::vector<std::string> tools = this->Opened ? this->Opened->Poses.Tools() : std::vector<std::string>();
  return index >= 0 && static_cast<std::size_t>(index) < tools.size() ? tools[static_cast<std::size_t>(index)] : "";
}

//----------------------------------------------------------------------------
// By the name of the tool, or that of its frame.
double vtkUltrasoundTrackerSource::StatisticOf(const char* name, const Statistic& value, double otherwise) const
{
  const echorama::StreamStatistics all = this->Opened ? this->Opened->Poses.Statistics() : echorama::StreamStatistics();
  const echorama::ToolStatistics* tool = all.Find(TextOf(name));
  return tool ? value(*tool) : otherwise;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::StartRecording(const char* fileName)
{
  const std::string path = TextOf(fileName);
  if (path.empty()) {
    return this->StopRecording();
  }
  this->SetActive(true);
  // The new one first: when it cannot be started, the earlier one goes on.
  std::unique_ptr<echorama::StreamRecorder> earlier;
  const auto start = [&](const echorama::Progress&) {
    std::shared_ptr<echorama::PoseSubscription> poses;
    this->Open(&poses);
    auto next = std::make_unique<echorama::StreamRecorder>(path, poses ? poses : this->Opened->Poses.Subscribe());
    earlier = std::exchange(this->Opened->Recorder, std::move(next));
    this->Ended = {};
  };
  if (!vtkUltrasoundVolume::Run(this, nullptr, start)) {
    return false;
  }
  vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
    if (earlier) {
      earlier->StopIfAnything();
    }
  });
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::StopRecording()
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress&) {
           if (auto recorder = this->Opened ? std::move(this->Opened->Recorder) : nullptr) {
             recorder->Stop();
           }
         }) != 0;
}

//----------------------------------------------------------------------------
echorama::RecordingState vtkUltrasoundTrackerSource::Recording() const
{
  return this->Opened && this->Opened->Recorder ? this->Opened->Recorder->State() : this->Ended;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundTrackerSource::GetNumberOfRejected() const
{
  return this->Opened ? static_cast<vtkIdType>(this->Opened->Poses.Statistics().Rejected()) : 0;
}

//----------------------------------------------------------------------------
// A transform at the time that is shown.
LiveTransform vtkUltrasoundTrackerSource::Found(const char* name)
{
  LiveTransform found;
  found.transform.status = TransformStatus::Missing;
  found.message = "the device is not open";
  vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
    if (const Session* session = this->Updated()) {
      found = session->Transforms->Find(TextOf(name), session->IsWhole() ? session->TimeShown : this->Time);
    }
  });
  return found;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerSource::GetTransform(const char* name, vtkMatrix4x4* matrix)
{
  const LiveTransform found = this->Found(name);
  if (matrix) {
    const bool known = found.Status() != TransformStatus::Missing;
    const echorama::MatrixRows rows = known ? found.transform.matrix.matrix() : Eigen::Matrix4d(Eigen::Matrix4d::Identity());
    matrix->DeepCopy(rows.data());
  }
  return static_cast<int>(found.Status());
}

//----------------------------------------------------------------------------
echorama::FusedTracker* vtkUltrasoundTrackerSource::Fused() const
{
  return this->Opened ? dynamic_cast<echorama::FusedTracker*>(this->Opened->Device.get()) : nullptr;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::Tell(const std::function<void(echorama::FusedTracker&)>& what)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [&](const echorama::Progress&) {
           this->Open();
           echorama::FusedTracker* fused = this->Fused();
           if (!fused) {
             throw Error(Error::Kind::NotPossible,
                         this->Device + (this->Active
                                             ? ": only fused trackers, fused:POSITION-LINE|ORIENTATION-LINE, are told this"
                                             : ": it is not open"));
           }
           what(*fused);
         }) != 0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::Align(double x, double y, double z, double sigmaDegrees)
{
  return this->Tell([&](echorama::FusedTracker& fused) { fused.Align({x, y, z}, sigmaDegrees); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::AlignBySlide(double seconds, double sigmaDegrees)
{
  return this->Tell([&](echorama::FusedTracker& fused) { fused.AlignBySlide(seconds, sigmaDegrees); });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetHeadingSigma() const
{
  const echorama::FusedTracker* fused = this->Fused();
  return fused ? fused->HeadingSigma() * echorama::DegreesPerRadian : NaN;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundTrackerSource::SetPlace(double x, double y, double z, double normalX, double normalY, double normalZ)
{
  const Eigen::Vector3d normal(normalX, normalY, normalZ);
  return this->Tell([&](echorama::FusedTracker& fused) {
    fused.SetPlace({x, y, z}, normal.isZero(0.0) ? std::nullopt : std::optional<Eigen::Vector3d>(normal));
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetNormals(echorama::FusedTracker::NormalOf normals)
{
  this->Normals = std::move(normals);
  if (echorama::FusedTracker* fused = this->Fused()) {
    fused->SetNormals(this->Normals);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetSkin(vtkPolyData* skin)
{
  if (skin == this->Skin) {
    return;
  }
  this->Skin = skin;
  this->SetNormals(skin && skin->GetNumberOfCells() > 0 ? echorama::NormalsOf(skin) : nullptr);
  this->Modified();
}

//----------------------------------------------------------------------------
vtkPolyData* vtkUltrasoundTrackerSource::GetSkin() const
{
  return this->Skin;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerSource::FillOutputPortInformation(int port, vtkInformation* information)
{
  information->Set(vtkDataObject::DATA_TYPE_NAME(), port == 1 ? "vtkImageData" : "vtkPolyData");
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerSource::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* image = outputs->GetInformationObject(1);
  const int nothing[6] = {0, -1, 0, -1, 0, -1};
  image->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), nothing, 6);
  for (int port = 0; port < 3; ++port) {
    outputs->GetInformationObject(port)->Remove(vtkStreamingDemandDrivenPipeline::TIME_STEPS());
    outputs->GetInformationObject(port)->Remove(vtkStreamingDemandDrivenPipeline::TIME_RANGE());
  }
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs, image](const echorama::Progress&) {
    echorama::CheckRanges(this->Parameters());
    this->Open();
    const Session* session = this->Updated();
    if (!session) {
      return;
    }
    if (session->IsWhole()) {
      const double range[2] = {session->Times.front(), session->Times.back()};
      for (int port = 0; port < 3; ++port) {
        vtkInformation* out = outputs->GetInformationObject(port);
        out->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), session->Times.data(), static_cast<int>(session->Times.size()));
        out->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
      }
    }
    // Data have to agree with what is said here, so the image that will be shown is chosen here. Those of a recording are all
    // alike: one is read when there is none, and no other, because what is read makes this source need an update.
    if (session->IsWhole() && session->Images.Version() == 0) {
      this->ReadImage(session->Times.front());
    }
    this->ChooseImage(session->IsWhole() ? session->Times.front() : this->Time);
    if (session->Image) {
      vtkUltrasoundVolume::SetGeometry(image, session->Image->geometry);
      vtkDataObject::SetPointDataActiveScalarInfo(image, echorama::VtkTypeOf(session->Image->image.type), 1);
    }
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundTrackerSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    progress(0.0);
    for (int port = 0; port < 3; ++port) {
      vtkDataObject::GetData(outputs, port)->Initialize();
    }
    Session* session = this->Updated();
    if (!session) {
      return;
    }
    session->PosesShown = session->Poses.Version();
    double time = this->Time;
    if (session->IsWhole()) {
      time = session->Times.front();
      for (int port = 2; port >= 0; --port) {
        vtkInformation* out = outputs->GetInformationObject(port);
        if (out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())) {
          time = out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
        }
      }
      time = std::min(std::max(time, session->Times.front()), session->Times.back());
      session->TimeShown = time;
      this->ReadImage(time);
      this->ChooseImage(time);
      for (int port = 0; port < 3; ++port) {
        vtkDataObject::GetData(outputs, port)->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
      }
    }
    this->ShowTools(vtkPolyData::GetData(outputs, 0), vtkPolyData::GetData(outputs, 2), time);
    if (session->Image) {
      echorama::PutImage(*session->Image, vtkImageData::GetData(outputs, 1));
    }
  });
}

//----------------------------------------------------------------------------
// Of a recording that is shown as a whole, the image of a moment.
void vtkUltrasoundTrackerSource::ReadImage(double time)
{
  if (auto* recording = dynamic_cast<echorama::ReplayTracker*>(this->Opened->Device.get())) {
    recording->ShowImage(time);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::ChooseImage(double time)
{
  Session& session = *this->Opened;
  session.ImagesShown = session.Images.Version();
  session.Image = echorama::ChooseImage(session.Images.Images(), *session.Transforms, this->ImageFrame, this->World(), time);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::World() const
{
  return this->WorldFrame.empty() ? echorama::UsualWorld(this->Opened->Poses.Tools()) : this->WorldFrame;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::ShowTools(vtkPolyData* tools, vtkPolyData* axes, double time)
{
  Session& session = *this->Opened;
  const std::string world = this->World();
  const auto shown = echorama::ShowTools(session.Poses.Tools(), *session.Transforms, world, time);
  session.FreshUntil = std::numeric_limits<double>::infinity();
  if (std::isnan(time) && session.Poses.Live()) {
    for (const echorama::ShownTool& tool : shown) {
      if (tool.status == TransformStatus::Valid) {
        session.FreshUntil = std::min(session.FreshUntil, session.Poses.Latest(tool.name).arrival + this->FreshSeconds);
      }
    }
  }
  echorama::PutTools(shown, world, this->AxisLengthMm, tools, axes);
}
