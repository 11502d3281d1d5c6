// SPDX-License-Identifier: BSD-3-Clause
// The conversation. A device may be in any state: half a command typed, text or binary, already talking. So: a line end and P
// (one record, and an end to continuous output) until it is silent; then binary, and control-V, whose answer begins with the two
// letters of the model; control-U for the sensors; U1 for centimetres, and a look whether it obeys. Then the richest record
// that fits the line is asked for with O and started with C; if within half a second no record can be believed, because the
// firmware does not know an item or writes it otherwise than we think, the next simpler one is tried.
#include "Tracking/Devices/PolhemusTracker.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/ToolPose.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace echorama {
namespace {

constexpr double ListenSeconds = 0.05; // s: how often the worker asks whether it should stop
constexpr double Silence = 0.1;        // s without a byte: it has stopped talking
constexpr double AnswerSeconds = 0.5;  // s for an answer
constexpr double LongSilence = 2.0;    // s without a record: it is gone
constexpr char ControlU = 0x15, ControlV = 0x16;

double FramesPerSecond(PolhemusModel model)
{
  return model == PolhemusModel::Patriot ? 60.0 : 240.0;
}

std::uint32_t Bits(const std::string& data, std::size_t at)
{
  return static_cast<unsigned char>(data[at]) + 256u * static_cast<unsigned char>(data[at + 1]);
}

} // namespace

PolhemusOptions PolhemusOptions::From(const TrackerAddress& address)
{
  const auto refuse = [&address](const std::string& what) {
    throw Error(Error::Kind::InvalidParameter, address.text + ": " + what);
  };
  PolhemusOptions options;
  options.path = address.place;
  if (options.path.empty())
    refuse("the line is missing, such as polhemus:/dev/ttyUSB0");
  enum class Model { Auto, Patriot, Liberty } model = Model::Auto;
  std::string list;
  address.Set(
      Join({{Parameter("Baud", options.baud, {1200, 1000000}, "bits/s", "Speed of the line, as the switches on the device say."),
             Parameter("Model", Choice(model, {"auto", "patriot", "liberty"}), "Which device is expected; another is refused."),
             Parameter("Names", list, "Names of the stations, separated by commas; the rest are Station1, Station2 ..."),
             Parameter("Hemisphere", Choice(options.hemisphere, {"as-set", "+x", "-x", "+y", "-y", "+z", "-z"}),
                       "On which side of the source the sensors are."),
             Parameter("Record", Choice(options.record, {"auto", "twofold", "single", "bare"}),
                       "How much is sent: twofold when the line is fast enough for it, else single.")},
            Without(Describe(options.speech), {"UnitMm"})}));
  if (model != Model::Auto)
    options.model = model == Model::Patriot ? PolhemusModel::Patriot : PolhemusModel::Liberty;
  std::istringstream names(list);
  std::set<std::string> seen;
  for (std::string name; std::getline(names, name, ',');) {
    if (!name.empty() && !seen.insert(ToolTransformName(name)).second)
      refuse("the name " + name + " is given twice");
    options.names.push_back(name);
  }
  const int most = PolhemusStations(options.model.value_or(PolhemusModel::Liberty));
  if (options.names.size() > static_cast<std::size_t>(most))
    refuse("there are " + std::to_string(options.names.size()) + " names for at most " + std::to_string(most) + " stations");
  return options;
}

PolhemusTracker::PolhemusTracker(const TrackerAddress& address)
  : options_(PolhemusOptions::From(address)), port_(options_.path, options_.baud)
{
}

void PolhemusTracker::Start(PoseStream& poses, ImageStream*)
{
  Stop();
  port_.Open();
  poses_ = &poses;
  poses_->SetLive(true);
  poses_->SetState(DeviceState::Connecting, options_.path);
  RunDevice(worker_, poses, [this](const Worker::Signal& signal) { Run(signal); });
}

void PolhemusTracker::Stop()
{
  worker_.Stop();
  port_.Close();
  poses_ = nullptr;
}

void PolhemusTracker::Run(const Worker::Signal& signal)
{
  bool wasThere = false;
  while (!signal.Stopped()) {
    std::string problem;
    try {
      port_.Open();
      if (Converse(signal)) {
        wasThere = true;
        poses_->SetState(DeviceState::Running, running_);
        Listen(signal, 0.0);
      }
      break; // it was stopped
    } catch (const Error& error) {
      problem = error.what();
      if (error.GetKind() == Error::Kind::NotPossible) {
        poses_->SetState(DeviceState::Failed, problem);
        break;
      }
    }
    poses_->SetState(wasThere ? DeviceState::Lost : DeviceState::Connecting, problem);
    if (!signal.Sleep(0.5))
      break;
  }
  if (port_.IsOpen())
    port_.Write("P", ListenSeconds); // ends continuous output
}

void PolhemusTracker::Fail(const std::string& why, Error::Kind kind) const
{
  throw Error(kind, options_.path + ": " + why);
}

void PolhemusTracker::Tell(const std::string& command)
{
  if (port_.Write(command, Silence) != SerialPort::Outcome::Done)
    Fail("the line is gone");
}

std::vector<unsigned char> PolhemusTracker::Hear(double seconds)
{
  std::vector<unsigned char> bytes;
  if (port_.Read(bytes, seconds) == SerialPort::Outcome::Lost)
    Fail("the line is gone");
  return bytes;
}

void PolhemusTracker::Quiet(const Worker::Signal& signal)
{
  for (int attempt = 0; attempt < 3 && !signal.Stopped(); ++attempt) {
    Tell("\rP");
    for (const double begin = ClockNow(); ClockNow() - begin < 2.0 * AnswerSeconds && !signal.Stopped();)
      if (Hear(Silence).empty())
        return;
  }
  if (!signal.Stopped())
    Fail("the device does not stop sending; is it a Polhemus tracker, set to " + std::to_string(options_.baud) +
         " bits per second?");
}

std::optional<PolhemusReply> PolhemusTracker::Ask(const Worker::Signal& signal, const std::string& command, unsigned char answers)
{
  Tell(command);
  std::string bytes;
  for (const double begin = ClockNow(); ClockNow() - begin < AnswerSeconds && !signal.Stopped();) {
    const std::vector<unsigned char> piece = Hear(ListenSeconds);
    bytes.append(piece.begin(), piece.end());
    if (auto reply = TakePolhemusReply(bytes, answers))
      return reply;
  }
  return std::nullopt;
}

std::vector<PolhemusLayout> PolhemusTracker::Layouts(PolhemusModel model, int stations) const
{
  using Record = PolhemusOptions::Record;
  // A byte takes 10 bits; a line that is full to the brim has no room to catch up.
  const double room = 0.97 * options_.baud / 10.0 / FramesPerSecond(model) / stations;
  const bool fits = static_cast<double>(PolhemusRecordBytes(PolhemusTwofold(true), options_.speech.format)) <= room;
  std::vector<PolhemusLayout> layouts;
  if (options_.record == Record::Twofold || (options_.record == Record::Auto && fits))
    layouts = {PolhemusTwofold(true), PolhemusTwofold(false)};
  if (options_.record == Record::Single || options_.record == Record::Auto)
    layouts.insert(layouts.end(), {PolhemusSingle(true), PolhemusSingle(false)});
  if (options_.record == Record::Bare || options_.record == Record::Auto)
    layouts.push_back(PolhemusBare());
  return layouts;
}

bool PolhemusTracker::Converse(const Worker::Signal& signal)
{
  Quiet(signal);
  std::optional<PolhemusReply> who;
  for (int attempt = 0; attempt < 3 && !who && !signal.Stopped(); ++attempt) {
    Tell("F1\r");
    who = Ask(signal, std::string(1, ControlV) + "\r", ControlV);
  }
  if (signal.Stopped())
    return false;
  if (!who)
    Fail("nothing there answers like a Polhemus; is it on, and set to " + std::to_string(options_.baud) + " bits per second?");
  if (options_.model && *options_.model != who->model)
    Fail(std::string("it is a ") + PolhemusModelText(who->model) + ", not a " + PolhemusModelText(*options_.model),
         Error::Kind::NotPossible);

  PolhemusSpeech speech = options_.speech;
  speech.model = who->model;
  speech.stations = (1u << PolhemusStations(speech.model)) - 1;
  const auto sensors = Ask(signal, std::string(1, ControlU) + "0\r", ControlU);
  if (sensors && sensors->data.size() >= 4)
    speech.stations &= Bits(sensors->data, 0) & Bits(sensors->data, 2); // those that are plugged in, those that are on
  if (speech.stations == 0)
    Fail("no sensor is plugged in");
  for (int attempt = 0;; ++attempt) {
    Tell("U1\r");
    const auto unit = Ask(signal, "U\r", 'U');
    if (!unit || unit->data.size() < 2 || Bits(unit->data, 0) == 1)
      break;
    if (attempt == 2)
      Fail("it does not go over to centimetres");
  }
  static const char* const directions[] = {"1,0,0", "-1,0,0", "0,1,0", "0,-1,0", "0,0,1", "0,0,-1"};
  if (const auto side = static_cast<std::size_t>(options_.hemisphere); side > 0)
    Tell("H*," + std::string(directions[side - 1]) + "\r");
  return TryLayouts(signal, speech);
}

bool PolhemusTracker::TryLayouts(const Worker::Signal& signal, PolhemusSpeech speech)
{
  std::vector<std::string> stations;
  for (int station = 1; station <= PolhemusStations(speech.model); ++station)
    if (speech.Has(station))
      stations.push_back(std::to_string(station));
  std::string complaint;
  for (const PolhemusLayout& layout : Layouts(speech.model, static_cast<int>(stations.size()))) {
    speech.layout = layout;
    std::string items;
    for (const PolhemusItem item : layout)
      items += "," + std::to_string(static_cast<int>(item));
    // What went wrong with the layout before may still lie in the line.
    Quiet(signal);
    Tell("O*" + items + "\r");
    if (speech.format == PolhemusFormat::Ascii)
      Tell("F0\r");
    Tell("C\r");
    speech_ = speech;
    decoder_.emplace(speech);
    clock_.Reset();
    jumpsTold_ = 0;
    const bool twofold = std::count(layout.begin(), layout.end(), PolhemusItem::Position) > 0;
    const bool timed = std::count(layout.begin(), layout.end(), PolhemusItem::Time) > 0;
    const char* const kind = twofold ? "twofold" : timed ? "single" : "bare";
    running_ =
        options_.path + ": " + PolhemusModelText(speech.model) + ", stations " + Joined(stations) + ", " + kind + " records";
    const bool heard = Listen(signal, AnswerSeconds);
    if (heard || signal.Stopped())
      return heard;
    complaint = decoder_->LastComplaint();
    if (speech.format == PolhemusFormat::Ascii)
      Tell("F1\r");
  }
  Fail("its records cannot be read" + (complaint.empty() ? "; none came" : ": " + complaint));
}

bool PolhemusTracker::Listen(const Worker::Signal& signal, double trial)
{
  double lastRecord = ClockNow();
  std::uint64_t malformed = decoder_->Malformed();
  while (!signal.Stopped()) {
    const std::vector<unsigned char> bytes = Hear(ListenSeconds);
    const double arrival = ClockNow();
    const auto records = decoder_->Take(bytes.data(), bytes.size());
    Pass(records, arrival);
    if (trial <= 0.0)
      for (; malformed < decoder_->Malformed(); ++malformed)
        poses_->Reject(Rejection::Malformed, options_.path + ": " + decoder_->LastComplaint());
    if (!records.empty())
      lastRecord = arrival;
    if (trial > 0.0 && (!records.empty() || arrival - lastRecord > trial))
      return !records.empty();
    if (arrival - lastRecord > LongSilence)
      Fail("no record has come for " + NumberText(LongSilence) + " s");
  }
  return false;
}

void PolhemusTracker::Pass(const std::vector<PolhemusRecord>& records, double arrival)
{
  std::array<int, 32> left{}; // records of a station that came in one piece
  for (const PolhemusRecord& record : records)
    ++left[static_cast<std::size_t>(record.station - 1)];
  for (const PolhemusRecord& record : records) {
    const auto index = static_cast<std::size_t>(record.station - 1);
    ToolPose pose;
    const bool named = index < options_.names.size() && !options_.names[index].empty();
    pose.name = ToolTransformName(named ? options_.names[index] : "Station" + std::to_string(record.station));
    pose.arrival = arrival;
    pose.pose = record.pose;
    pose.status = record.status;
    --left[index];
    if (record.milliseconds)
      pose.time = clock_.Map(*record.milliseconds, arrival);
    else // the last has just come, those before it one frame earlier each
      pose.time = std::max(arrival - left[index] / FramesPerSecond(speech_.model), lastTimes_[index] + 1e-6);
    lastTimes_[index] = pose.time;
    poses_->Add(pose);
  }
  if (clock_.Jumps() != jumpsTold_) {
    jumpsTold_ = clock_.Jumps();
    std::ostringstream text;
    text.precision(3);
    text << running_ << "; its clock has jumped by " << std::fixed << clock_.LastJump() << " s, and is mapped anew";
    poses_->SetState(DeviceState::Running, text.str());
  }
}

} // namespace echorama
