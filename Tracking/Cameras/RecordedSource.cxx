// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Cameras/RecordedSource.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Tracking/Cameras/RestUntil.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

const char* const RateField = "CameraRate";
const char* const ExposureField = "CameraExposureMs";
const char* const RowField = "CameraRowUs";
const char* const NumberField = "FrameNumber";
const char* const ArrivalOfFrame = "Arrival";
constexpr double LatestArrival = 10.0; // s after its exposure

template <class T>
bool ReadField(const std::vector<HeaderField>& fields, const char* name, T& value)
{
  for (const auto& [key, text] : fields)
    if (key == name)
      return ParseNumber(text, value);
  return false;
}

SequenceContent ContentOf(const CameraFormat& format)
{
  SequenceContent content;
  content.dimensions = {format.width, format.height, 1};
  content.fields = {{RateField, NumberText(format.frameRate)},
                    {ExposureField, NumberText(format.exposureMs)},
                    {RowField, NumberText(format.rowUs)}};
  return content;
}

SequenceRecorderOptions Unsynchronised()
{
  SequenceRecorderOptions options;
  options.syncToDisk = false; // which would hold frames up; a crash of the program, not of the machine, loses nothing by it
  return options;
}

} // namespace

CameraRecorder::CameraRecorder(const std::string& path, const CameraFormat& format)
  : format_(format), recorder_(std::make_unique<SequenceRecorder>(path, ContentOf(format), Unsynchronised())),
    pixels_(static_cast<std::size_t>(format.width) * static_cast<std::size_t>(format.height))
{
}

CameraRecorder::~CameraRecorder() = default;

void CameraRecorder::Add(const CameraFrame& frame)
{
  if (frame.grey.width != format_.width || frame.grey.height != format_.height)
    throw Error(Error::Kind::BadInput, "a frame of " + std::to_string(frame.grey.width) + " x " +
                                           std::to_string(frame.grey.height) + " pixels cannot go into a recording of " +
                                           std::to_string(format_.width) + " x " + std::to_string(format_.height));
  std::uint8_t* out = pixels_.data();
  for (int y = 0; y < format_.height; ++y)
    for (int x = 0; x < format_.width; ++x)
      *out++ = frame.grey(x, y);
  SequenceFrame written;
  written.time = frame.begin;
  written.fields = {{NumberField, std::to_string(frame.number)}, {ArrivalOfFrame, NumberText(frame.arrival)}};
  recorder_->Append(written, pixels_.data());
}

void CameraRecorder::Finish()
{
  recorder_->Finish();
}

ParameterList Describe(RecordedSourceParameters& p)
{
  return {
      Parameter("Speed", p.speed, {0, 1000}, "", "Of the replay; 0: whenever frames are asked for."),
      Parameter("FrameRate", p.frameRate, {0, 1000}, "Hz",
                "Of a recording that does not say it; of one without time stamps, frames lie so far apart. 0: as it says."),
      Parameter("ExposureMs", p.exposureMs, {0, 1000}, "ms", "Of a recording that does not say it; 0: as it says."),
      Parameter("RowUs", p.rowUs, {0, 1000}, "us", "How much later each row begins, where the recording does not say it."),
  };
}

RecordedSourceParameters RecordedSourceParameters::Of(const TrackerAddress& address)
{
  RecordedSourceParameters p;
  p.path = address.place;
  if (p.path.empty())
    throw Error(Error::Kind::InvalidParameter, address.text + ": which recording? Say " + address.scheme + ":FILE");
  address.Set(Describe(p));
  return p;
}

RecordedSource::RecordedSource(const RecordedSourceParameters& parameters) : parameters_(parameters)
{
  CheckRanges(parameters_);
}

double RecordedSource::TimeOf(int index) const
{
  const double time = file_->Time(index);
  return std::isfinite(time) || !(parameters_.frameRate > 0.0) ? time : index / parameters_.frameRate;
}

CameraFormat RecordedSource::Open()
{
  const std::string& path = parameters_.path;
  file_ = std::make_unique<SequenceFile>(path);
  const SequenceContent& content = file_->Content();
  if (!content.HasImages() || content.frames < 1 || content.dimensions[2] != 1)
    FailFile(path, "there are no pictures in it: it is no recording of a camera");
  if (content.type != VoxelType::UInt8 || (content.components != 1 && content.components != 3))
    FailFile(path, "its pixels are neither bytes nor three bytes of colour");
  for (int i = 0; i < content.frames; ++i) {
    if (!std::isfinite(TimeOf(i)))
      FailFile(path, "frame " + std::to_string(i) +
                         " has no time stamp; if frames are equally far apart and none is missing, say "
                         "how many are a second: frameRate=90");
    if (i > 0 && !(TimeOf(i) > TimeOf(i - 1)))
      FailFile(path, "the time stamps do not go on: frame " + std::to_string(i) + " is of " + NumberText(TimeOf(i)) +
                         " s, the one before of " + NumberText(TimeOf(i - 1)) + " s");
  }
  CameraFormat format;
  format.width = content.dimensions[0];
  format.height = content.dimensions[1];
  format.pixels = content.components == 1 ? "GREY" : "RGB3";
  format.name = path;
  const auto known = [&content](const char* field, double given, double& value) {
    if (!ReadField(content.fields, field, value) || !std::isfinite(value) || value < 0.0)
      value = given;
  };
  known(RateField, parameters_.frameRate, format.frameRate);
  known(ExposureField, parameters_.exposureMs, format.exposureMs);
  known(RowField, parameters_.rowUs, format.rowUs);
  if (!(format.frameRate > 0.0) && content.frames > 2) { // the median interval: frames may be missing
    std::vector<double> intervals;
    for (int i = 1; i < content.frames; ++i)
      intervals.push_back(TimeOf(i) - TimeOf(i - 1));
    const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
    std::nth_element(intervals.begin(), middle, intervals.end());
    format.frameRate = 1.0 / *middle;
  }
  if (!(format.frameRate > 0.0))
    FailFile(path, "it does not say how many frames there are a second: frameRate=90");
  pixels_.resize(content.FrameBytes());
  index_ = 0;
  number_ = -1;
  lost_ = 0;
  start_ = ClockNow();
  return format;
}

CameraSource::Outcome RecordedSource::Next(CameraFrame& frame, double seconds)
{
  std::int64_t number = number_ + 1;
  for (; file_ && index_ < file_->Content().frames && !file_->Frame(index_).imageValid; ++index_)
    ++number; // no image: as good as lost
  if (!file_ || index_ >= file_->Content().frames)
    return Outcome::Ended;
  const double time = TimeOf(index_);
  if (parameters_.speed > 0.0 && !RestUntil(start_ + (time - TimeOf(0)) / parameters_.speed, seconds))
    return Outcome::Nothing;
  const SequenceContent& content = file_->Content();
  file_->ReadFrame(index_, pixels_.data());
  const SequenceFrame said = file_->Frame(index_);
  frame.grey = content.components == 1 ? GreyFrame::Mono(pixels_.data(), content.dimensions[0], content.dimensions[1])
                                       : GreyFrame::Green(pixels_.data(), content.dimensions[0], content.dimensions[1]);
  frame.begin = frame.arrival = time;
  // One of another clock says nothing.
  if (double arrival = time; ReadField(said.fields, ArrivalOfFrame, arrival) && arrival >= time && arrival < time + LatestArrival)
    frame.arrival = arrival;
  if (std::int64_t told = 0; ReadField(said.fields, NumberField, told) && told > number_)
    number = told;
  lost_ += number_ < 0 ? 0 : number - number_ - 1;
  frame.number = number_ = number;
  ++index_;
  return Outcome::Frame;
}

} // namespace echorama
