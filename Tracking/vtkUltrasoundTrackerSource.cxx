// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTrackerSource.h"

#include "Core/Base/Error.h"
#include "Core/Geometry/MatrixRows.h"
#include "Readers/TransformFile.h"
#include "Tracking/Devices/ReplayTracker.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/ShownImage.h"
#include "Tracking/Stream/StreamRecorder.h"
#include "Tracking/Stream/StreamReport.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

using echorama::Error;
using echorama::LiveTransform;
using echorama::LiveTransforms;
using echorama::ToolStatistics;
using echorama::TransformStatus;

vtkStandardNewMacro(vtkUltrasoundTrackerSource);

namespace {
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

std::string TextOf(const char* text)
{
  return text ? text : "";
}

// Whether it was another one.
bool Replace(char*& text, const char* by)
{
  if ((!text && !by) || (text && by && std::strcmp(text, by) == 0)) {
    return false;
  }
  delete[] text;
  text = by ? new char[std::strlen(by) + 1] : nullptr;
  if (by) {
    std::strcpy(text, by);
  }
  return true;
}

template <class Array>
vtkSmartPointer<Array> NewArray(const char* name, int components = 1)
{
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  return array;
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
  double FreshUntil = 0.0;                         // our clock: when a tool that is shown becomes too old

  explicit Session(const echorama::StreamLimits& limits) : Poses(limits) {}
  bool IsWhole() const { return !Times.empty(); }
};

//----------------------------------------------------------------------------
vtkUltrasoundTrackerSource::vtkUltrasoundTrackerSource()
  : Time(NaN), LongestGapSeconds(echorama::StreamLimits().longestGapSeconds)
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(3);
  this->SetImageFrame("Image");
}

//----------------------------------------------------------------------------
vtkUltrasoundTrackerSource::~vtkUltrasoundTrackerSource()
{
  this->Close();
  Replace(this->Device, nullptr);
  Replace(this->TransformFile, nullptr);
  this->SetWorldFrame(nullptr);
  this->SetImageFrame(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Device: " << (this->Device ? this->Device : "(none)") << "\n";
  os << indent << "Active: " << this->Active << "\n";
  os << indent << "TransformFile: " << (this->TransformFile ? this->TransformFile : "(none)") << "\n";
  os << indent << "WorldFrame: " << TextOf(this->WorldFrame) << "\n";
  os << indent << "ImageFrame: " << TextOf(this->ImageFrame) << "\n";
  os << indent << "Time: " << this->Time << "\n";
  os << indent << "FollowTime: " << this->FollowTime << "\n";
  os << indent << "LongestGapSeconds: " << this->LongestGapSeconds << "\n";
  os << indent << "FreshSeconds: " << this->FreshSeconds << "\n";
  os << indent << "AxisLengthMm: " << this->AxisLengthMm << "\n";
  os << indent << "State: " << this->GetState() << "\n";
  os << indent << "Message: " << this->GetMessage() << "\n";
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetDevice(const char* device)
{
  if (Replace(this->Device, device)) {
    this->Close();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetDeviceKinds()
{
  std::string text;
  for (const std::string& scheme : echorama::TrackerSchemes()) {
    text += (text.empty() ? "" : ", ") + scheme;
  }
  return text;
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
  if (Replace(this->TransformFile, fileName)) {
    if (this->Opened) {
      this->Opened->Transforms.reset();
    }
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::SetFreshSeconds(double seconds)
{
  if (this->FreshSeconds != seconds) {
    this->FreshSeconds = seconds;
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
    const std::string address = TextOf(this->Device);
    if (address.empty()) {
      throw Error(Error::Kind::InvalidParameter, "there is no Device; its kinds are " + GetDeviceKinds());
    }
    echorama::StreamLimits limits;
    limits.longestGapSeconds = this->LongestGapSeconds;
    auto device = echorama::MakeTracker(address);
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
  this->Opened.reset();
  this->Failure.clear();
}

//----------------------------------------------------------------------------
// What is open, with its transforms; nullptr when nothing is.
vtkUltrasoundTrackerSource::Session* vtkUltrasoundTrackerSource::Updated()
{
  if (this->Opened && !this->Opened->Transforms) {
    const std::string file = TextOf(this->TransformFile);
    this->Opened->Transforms = std::make_unique<LiveTransforms>(
        this->Opened->Poses, file.empty() ? std::vector<echorama::NamedTransform>() : echorama::ReadTransforms(file),
        this->FreshSeconds);
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
  if (!this->Start()) {
    return false;
  }
  const double until = echorama::ClockNow() + seconds;
  for (std::uint64_t version = this->Opened->Poses.Version();;) {
    const echorama::StreamStatistics statistics = this->Opened->Poses.Statistics();
    std::uint64_t taken = 0;
    for (const ToolStatistics& tool : statistics.tools) {
      taken += tool.valid + tool.missing + tool.outOfRange;
    }
    if (count <= 0 || taken >= static_cast<std::uint64_t>(count)) {
      return true;
    }
    const double left = until - echorama::ClockNow();
    if (!(left > 0.0) || statistics.state == echorama::DeviceState::Ended || statistics.state == echorama::DeviceState::Failed) {
      return false;
    }
    version = this->Opened->Poses.WaitBeyond(version, left);
  }
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
  return !this->Failure.empty() ? DeviceStateText(echorama::DeviceState::Failed)
                                : DeviceStateText(this->Opened ? this->Opened->Poses.State().first : echorama::DeviceState::Idle);
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

// By the name of the tool, or that of its frame.
template <class T, class Value>
T vtkUltrasoundTrackerSource::StatisticOf(const char* name, T otherwise, const Value& value) const
{
  const std::string wanted = TextOf(name);
  const auto tools = this->Opened ? this->Opened->Poses.Statistics().tools : std::vector<ToolStatistics>();
  for (const ToolStatistics& tool : tools) {
    const auto frames = echorama::FramesOf(tool.name);
    if (tool.name == wanted || (frames && frames->first == wanted)) {
      return static_cast<T>(value(tool));
    }
  }
  return otherwise;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundTrackerSource::GetNumberOfPoses(const char* tool) const
{
  return this->StatisticOf<vtkIdType>(tool, 0, [](const auto& s) { return s.valid + s.missing + s.outOfRange; });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetRate(const char* tool) const
{
  return this->StatisticOf(tool, NaN, [](const auto& s) { return s.rateHz; });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetJitter(const char* tool) const
{
  return this->StatisticOf(tool, NaN, [](const auto& s) { return s.jitterSeconds; });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetLatency(const char* tool) const
{
  return this->StatisticOf(tool, NaN, [](const auto& s) { return s.medianLatencySeconds; });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetDropoutShare(const char* tool) const
{
  return this->StatisticOf(tool, NaN, [](const auto& s) { return s.DropoutShare(); });
}

//----------------------------------------------------------------------------
double vtkUltrasoundTrackerSource::GetSecondsSinceLast(const char* tool) const
{
  return this->StatisticOf(tool, NaN, [](const auto& s) { return s.secondsSinceLast; });
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
  return this->Opened && this->Opened->Recorder ? this->Opened->Recorder->State() : echorama::RecordingState();
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundTrackerSource::GetNumberOfRecordedPoses() const
{
  return static_cast<vtkIdType>(this->Recording().poses);
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundTrackerSource::GetNumberOfUnrecordedPoses() const
{
  return static_cast<vtkIdType>(this->Recording().lost);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetRecordingProblem() const
{
  return this->Recording().problem;
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
double vtkUltrasoundTrackerSource::GetTransformError(const char* name)
{
  return this->Found(name).transform.errorMm.value_or(-1.0);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::GetTransformMessage(const char* name)
{
  return this->Found(name).message;
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
    vtkPolyData* tools = vtkPolyData::GetData(outputs, 0);
    vtkImageData* image = vtkImageData::GetData(outputs, 1);
    vtkPolyData* axes = vtkPolyData::GetData(outputs, 2);
    for (vtkDataObject* output :
         {static_cast<vtkDataObject*>(tools), static_cast<vtkDataObject*>(image), static_cast<vtkDataObject*>(axes)}) {
      output->Initialize();
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
    this->ShowTools(tools, axes, time);
    this->ShowImage(image);
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
  session.Image =
      echorama::ChooseImage(session.Images.Images(), *session.Transforms, TextOf(this->ImageFrame), this->World(), time);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundTrackerSource::World() const
{
  const std::string world = TextOf(this->WorldFrame);
  return world.empty() ? echorama::UsualWorld(this->Opened->Poses.Tools()) : world;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::ShowTools(vtkPolyData* output, vtkPolyData* axesOutput, double time)
{
  Session& session = *this->Opened;
  const std::vector<std::string> names = session.Poses.Tools();
  const std::string world = this->World();

  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const vtkNew<vtkCellArray> vertices;
  const auto tool = NewArray<vtkIntArray>("Tool");
  const auto times = NewArray<vtkDoubleArray>("TimeStamp");
  const auto toWorld = NewArray<vtkDoubleArray>("ToolToWorld", 16);
  const auto statuses = NewArray<vtkUnsignedCharArray>("Status");
  const vtkSmartPointer<vtkDoubleArray> axes[3] = {NewArray<vtkDoubleArray>("XAxis", 3), NewArray<vtkDoubleArray>("YAxis", 3),
                                                   NewArray<vtkDoubleArray>("ZAxis", 3)};
  const vtkNew<vtkPoints> ends;
  ends->SetDataTypeToDouble();
  const vtkNew<vtkCellArray> lines;
  const auto toolOfLine = NewArray<vtkIntArray>("Tool"), axisOfLine = NewArray<vtkIntArray>("Axis");
  const auto toolNames = NewArray<vtkStringArray>("ToolNames"), worldFrame = NewArray<vtkStringArray>("WorldFrame");
  worldFrame->InsertNextValue(world);
  session.FreshUntil = std::numeric_limits<double>::infinity();
  for (const std::string& name : names) {
    const auto frames = echorama::FramesOf(name);
    if (!frames || toolNames->LookupValue(frames->first) >= 0) {
      continue; // no transform, or a second one of the same frame
    }
    LiveTransform found = session.Transforms->Find(frames->first, world, time);
    if (frames->first == world) { // its place is known, but not whether it is seen
      found = session.Transforms->Find(frames->first, frames->second, time);
      found.transform.matrix.setIdentity();
    }
    const bool known = found.Status() != TransformStatus::Missing;
    const Eigen::Affine3d matrix = known ? found.transform.matrix : Eigen::Affine3d::Identity();
    const vtkIdType point = points->InsertNextPoint(matrix.translation().data());
    if (found.Status() == TransformStatus::Valid) {
      vertices->InsertNextCell(1, &point);
      if (std::isnan(time) && session.Poses.Live()) {
        session.FreshUntil = std::min(session.FreshUntil, session.Poses.Latest(name).arrival + this->FreshSeconds);
      }
    }
    const int number = static_cast<int>(toolNames->InsertNextValue(frames->first));
    tool->InsertNextValue(number);
    times->InsertNextValue(known ? found.time : NaN);
    statuses->InsertNextValue(static_cast<unsigned char>(found.Status()));
    toWorld->InsertNextTuple(echorama::MatrixRows(matrix.matrix()).data());
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d direction = matrix.linear().col(axis).normalized();
      axes[axis]->InsertNextTuple(direction.data());
      if (found.Status() == TransformStatus::Valid) {
        const Eigen::Vector3d end = matrix.translation() + this->AxisLengthMm * direction;
        const vtkIdType line[2] = {ends->InsertNextPoint(matrix.translation().data()), ends->InsertNextPoint(end.data())};
        lines->InsertNextCell(2, line);
        toolOfLine->InsertNextValue(number);
        axisOfLine->InsertNextValue(axis);
      }
    }
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  for (vtkDataArray* array :
       {static_cast<vtkDataArray*>(tool), static_cast<vtkDataArray*>(times), static_cast<vtkDataArray*>(toWorld),
        static_cast<vtkDataArray*>(statuses), static_cast<vtkDataArray*>(axes[0]), static_cast<vtkDataArray*>(axes[1]),
        static_cast<vtkDataArray*>(axes[2])}) {
    output->GetPointData()->AddArray(array);
  }
  axesOutput->SetPoints(ends);
  axesOutput->SetLines(lines);
  axesOutput->GetCellData()->AddArray(toolOfLine);
  axesOutput->GetCellData()->AddArray(axisOfLine);
  for (vtkPolyData* data : {output, axesOutput}) {
    data->GetFieldData()->AddArray(toolNames);
    data->GetFieldData()->AddArray(worldFrame);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundTrackerSource::ShowImage(vtkImageData* output)
{
  if (!this->Opened->Image) {
    return;
  }
  const echorama::ShownImage& shown = *this->Opened->Image;
  const echorama::StreamedImage& image = shown.image;
  vtkUltrasoundVolume::SetGeometry(output, shown.geometry);
  const auto intensity = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(echorama::VtkTypeOf(image.type)));
  intensity->SetName(vtkUltrasoundVolume::IntensityName());
  intensity->SetNumberOfTuples(output->GetNumberOfPoints());
  if (image.components == 1) {
    std::memcpy(intensity->GetVoidPointer(0), image.voxels->data(), image.voxels->size());
  } else {
    echorama::DispatchVoxelType(image.type, [&](auto zero) {
      using T = decltype(zero);
      echorama::MakeGrey(reinterpret_cast<const T*>(image.voxels->data()), static_cast<std::uint64_t>(image.components),
                         static_cast<T*>(intensity->GetVoidPointer(0)), intensity->GetNumberOfTuples());
    });
  }
  output->GetPointData()->SetScalars(intensity);
  const auto valid = NewArray<vtkUnsignedCharArray>(vtkUltrasoundVolume::ValidRegionName());
  valid->SetNumberOfTuples(output->GetNumberOfPoints());
  valid->Fill(1.0);
  output->GetPointData()->AddArray(valid);
  if (shown.imageToWorld) {
    vtkUltrasoundAcquisition::SetImageToWorld(output, *shown.imageToWorld);
  }
  if (std::isfinite(image.time)) {
    vtkUltrasoundAcquisition::SetTimeStamp(output, image.time);
  }
}
