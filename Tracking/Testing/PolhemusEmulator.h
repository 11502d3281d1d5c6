// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Core/Base/Worker.h"
#include "PseudoTerminal.h"
#include "Tracking/Devices/PolhemusDecoder.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// Where an emulated sensor is, mm; smooth, and its x says which millisecond it is.
inline Pose EmulatedPose(int station, std::uint32_t milliseconds)
{
  const double t = 0.001 * (milliseconds % 100000);
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(200.0 + t, 150.0 * std::sin(1.3 * t) + 20.0 * station, -80.0 + 60.0 * std::cos(0.7 * t));
  pose.linear() = ExpRotation(Eigen::Vector3d(0.9 * std::sin(0.8 * t), 0.3 * station, 1.5 * std::cos(0.5 * t)));
  return pose;
}

/// The numbers of a record beside its pose.
struct EmulatedMoment {
  std::uint32_t milliseconds = 0, frame = 0;
  int distortion = 3;
  char error = ' ';
};

/// A record as a device writes it.
inline std::string EncodePolhemus(const PolhemusSpeech& speech, int station, const Pose& pose, const EmulatedMoment& moment)
{
  const bool binary = speech.format == PolhemusFormat::Binary;
  std::string body;
  const auto word = [&body](std::uint32_t w) {
    for (int i = 0; i < 4; ++i)
      body += static_cast<char>(w >> (8 * i) & 0xff);
  };
  const auto text = [&body](const char* format, double number) {
    char digits[64];
    std::snprintf(digits, sizeof digits, format, number);
    body += digits;
  };
  const auto whole = [&](double number) {
    if (binary)
      word(static_cast<std::uint32_t>(static_cast<std::int64_t>(number)));
    else
      text("%.0f ", number);
  };
  const auto numbers = [&](const Eigen::VectorXd& values, const char* format) {
    for (const double value : values) {
      if (binary) {
        const float number = static_cast<float>(value);
        std::uint32_t bits;
        std::memcpy(&bits, &number, 4);
        word(bits);
      } else {
        text(format, value);
      }
    }
  };
  const Eigen::Vector3d position = pose.translation() / speech.unitMm;
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Matrix3d& R = pose.linear();
  const double elevation = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  const Eigen::Vector3d euler =
      Eigen::Vector3d(std::atan2(R(1, 0), R(0, 0)), elevation, std::atan2(R(2, 1), R(2, 2))) * DegreesPerRadian;
  for (const PolhemusItem item : speech.layout) {
    switch (item) {
    case PolhemusItem::LineEnd:
      body += "\r\n";
      break;
    case PolhemusItem::Position:
      numbers(position, "%7.2f ");
      break;
    case PolhemusItem::PositionExtended:
      numbers(position, "%14.6E ");
      break;
    case PolhemusItem::EulerExtended:
      numbers(euler, "%14.6E ");
      break;
    case PolhemusItem::Quaternion:
      numbers(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()), "%8.5f ");
      break;
    case PolhemusItem::Time:
      whole(moment.milliseconds);
      break;
    case PolhemusItem::Frame:
      whole(moment.frame);
      break;
    case PolhemusItem::Distortion:
      whole(moment.distortion);
      break;
    }
  }
  std::string head;
  if (binary) {
    head = speech.model == PolhemusModel::Patriot ? "PA" : "LY";
    head += static_cast<char>(station);
    head += 'C';
    head += moment.error == ' ' ? '\0' : moment.error;
    head += '\0';
    head += static_cast<char>(body.size() & 0xff);
    head += static_cast<char>(body.size() >> 8);
  } else {
    char digits[8];
    std::snprintf(digits, sizeof digits, "%2d", station);
    head = digits;
    head += moment.error;
  }
  return head + body;
}

/// What a bad line does to bytes: each, with these probabilities, is replaced by another one, lost, or followed by one too many.
struct LineNoise {
  double damaged = 0.0, lost = 0.0, added = 0.0;

  std::string Over(const std::string& bytes, Random& random) const
  {
    std::string out;
    for (const char byte : bytes) {
      if (random.Uniform() < lost)
        continue;
      const bool hit = random.Uniform() < damaged;
      out += hit ? static_cast<char>(byte + 1 + static_cast<int>(random.Below(255))) : byte;
      if (random.Uniform() < added)
        out += static_cast<char>(random.Below(256));
    }
    return out;
  }
};

/// A device that is none, at the far end of a pseudo-terminal: it answers the commands, and streams EmulatedPose.
class EmulatedPolhemus {
public:
  struct Character {
    PolhemusModel model = PolhemusModel::Patriot;
    std::uint32_t sensors = 3;
    double framesPerSecond = 60.0;
    bool talksAlready = false;          ///< it was left in continuous mode, in text and inches
    std::set<int> unknownItems;         ///< an O command with one of these is refused
    std::uint32_t milliseconds = 50000; ///< of its clock at the start
    LineNoise noise;                    ///< of its records
    bool deaf = false;                  ///< it answers nothing
    bool knowsCentimetres = true;
  };

  explicit EmulatedPolhemus(Character character) : character_(std::move(character)) { PlugIn(); }
  ~EmulatedPolhemus() { worker_.Stop(); }

  std::string Path() const { return line_.Path(); }
  void Unplug()
  {
    worker_.Stop();
    line_.Unplug();
  }
  /// As after power-up.
  void PlugIn()
  {
    worker_.Stop();
    line_.Plug();
    Resume();
  }
  void SwitchOff() { worker_.Stop(); } ///< the line is there, the device is dumb
  void SwitchOn() { Resume(); }
  void SetClockAhead(double seconds) { ahead_ = static_cast<std::int32_t>(1000.0 * seconds); }

  std::string Commands() const ///< all that it was told, control keys as ^X, line ends as /
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return commands_;
  }
  bool Talks() const { return talks_; }
  int Frames() const { return frames_; } ///< that were sent

private:
  void Resume()
  {
    speech_ = PolhemusSpeech();
    speech_.model = character_.model;
    speech_.format = PolhemusFormat::Ascii;
    speech_.layout = {PolhemusItem::Position, PolhemusItem::EulerExtended, PolhemusItem::LineEnd};
    speech_.unitMm = 25.4;
    talks_ = character_.talksAlready;
    typed_.clear();
    worker_.Start([this](const Worker::Signal& signal) { Live(signal); });
  }

  void Live(const Worker::Signal& signal)
  {
    signal_ = &signal;
    Random random(77, ++lives_);
    const double begin = ClockNow();
    std::uint32_t frame = 0;
    while (!signal.Stopped()) {
      Hear();
      const double due = begin + (frame + 1) / character_.framesPerSecond;
      const double now = ClockNow();
      if (now < due) {
        signal.Sleep(std::min(0.002, due - now));
        continue;
      }
      ++frame;
      now_.frame = frame;
      now_.milliseconds = character_.milliseconds + static_cast<std::uint32_t>(ahead_.load()) +
                          static_cast<std::uint32_t>(std::lround(1000.0 * frame / character_.framesPerSecond));
      if (talks_) {
        Say(character_.noise.Over(Records(), random));
        ++frames_;
      }
    }
  }

  std::string Records() const
  {
    std::string all;
    for (int station = 1; station <= 16; ++station)
      if (character_.sensors >> (station - 1) & 1)
        all += EncodePolhemus(speech_, station, EmulatedPose(station, now_.milliseconds), now_);
    return all;
  }

  void Say(const std::string& bytes)
  {
    // Waits a while for a reader that a busy machine holds up: what is lost is for LineNoise to say.
    int waits = 0;
    for (std::size_t at = 0; at < bytes.size() && waits < 500 && !signal_->Stopped();) {
      const ssize_t count = write(line_.Master(), bytes.data() + at, bytes.size() - at);
      if (count > 0) {
        at += static_cast<std::size_t>(count);
      } else {
        signal_->Sleep(0.002);
        ++waits;
      }
    }
  }

  void Answer(unsigned char command, const std::string& data, unsigned char error = 0)
  {
    if (speech_.format == PolhemusFormat::Ascii) {
      Say(std::string("01") + static_cast<char>(command) + " text that nobody reads\r\n");
      return;
    }
    std::string head = character_.model == PolhemusModel::Patriot ? "PA" : "LY";
    head += '\x01';
    head += static_cast<char>(command);
    head += static_cast<char>(error);
    head += '\0';
    head += static_cast<char>(data.size());
    head += '\0';
    Say(head + data);
  }

  void Hear()
  {
    char bytes[256];
    const ssize_t count = line_.Master() < 0 ? -1 : read(line_.Master(), bytes, sizeof bytes);
    for (ssize_t i = 0; i < count; ++i) {
      const char byte = bytes[i];
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (byte == '\r')
          commands_ += '/';
        else if (byte < 32)
          commands_ += {'^', static_cast<char>(byte + 64)};
        else
          commands_ += byte;
      }
      if (character_.deaf)
        continue;
      if (typed_.empty() && byte == 'P') { // acts at once, without a line end
        talks_ = false;
        Say(Records());
      } else if (byte == '\r') {
        Obey(typed_);
        typed_.clear();
      } else {
        typed_ += byte;
      }
    }
  }

  void Obey(const std::string& command)
  {
    if (command == "C")
      talks_ = true;
    else if (command == "F0" || command == "F1")
      speech_.format = command == "F1" ? PolhemusFormat::Binary : PolhemusFormat::Ascii;
    else if (command == "U0" || (command == "U1" && character_.knowsCentimetres))
      speech_.unitMm = command == "U1" ? 10.0 : 25.4;
    else if (command == "U")
      Answer('U', std::string(1, speech_.unitMm == 10.0 ? '\1' : '\0') + std::string(3, '\0'));
    else if (command == "\x16")
      Answer(0x16, std::string(60, 'w'));
    else if (command == "\x15" + std::string("0")) {
      std::string data;
      for (int i = 0; i < 2; ++i)
        data += {static_cast<char>(character_.sensors & 0xff), static_cast<char>(character_.sensors >> 8 & 0xff)};
      Answer(0x15, data);
    } else if (command.rfind("O*", 0) == 0) {
      PolhemusLayout layout;
      for (std::size_t at = 2; at < command.size();) {
        const std::size_t end = std::min(command.find(',', at + 1), command.size());
        layout.push_back(static_cast<PolhemusItem>(std::stoi(command.substr(at + 1, end - at - 1))));
        at = end;
      }
      bool known = true;
      for (const PolhemusItem item : layout)
        known = known && character_.unknownItems.count(static_cast<int>(item)) == 0;
      if (known)
        speech_.layout = layout;
      else
        Answer('O', "", 3);
    }
  }

  Character character_;
  PseudoTerminal line_;
  PolhemusSpeech speech_;
  std::string typed_;
  const Worker::Signal* signal_ = nullptr;
  EmulatedMoment now_;
  std::uint64_t lives_ = 0;
  std::atomic<bool> talks_{false};
  std::atomic<std::int32_t> ahead_{0};
  std::atomic<int> frames_{0};
  mutable std::mutex mutex_;
  std::string commands_;
  Worker worker_; // the last, so that it stops first
};

} // namespace echorama
