// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/Worker.h"
#include "Tracking/Devices/DeviceClock.h"
#include "Tracking/Devices/PolhemusDecoder.h"
#include "Tracking/Devices/SerialPort.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// What an address polhemus:/dev/ttyUSB0 may say.
struct PolhemusOptions {
  std::string path;
  int baud = 115200;                  ///< as the switches on the device say
  std::optional<PolhemusModel> model; ///< else the device says; another one is refused
  PolhemusSpeech speech;              ///< its format, range and distortion
  std::vector<std::string> names;     ///< of the stations; the rest are Station1, Station2 ...
  enum class Hemisphere { AsSet, PlusX, MinusX, PlusY, MinusY, PlusZ, MinusZ };
  Hemisphere hemisphere = Hemisphere::AsSet; ///< on which side of the source the sensors are
  enum class Record { Auto, Twofold, Single, Bare };
  Record record = Record::Auto; ///< Auto: twofold when the line is fast enough for it, else single

  /// \throws Error(InvalidParameter) that names what does not fit.
  static PolhemusOptions From(const TrackerAddress& address);
};

/// A Polhemus Patriot or Liberty on a serial line. It does the whole conversation: stops a device that talks already, asks what
/// it is and which sensors it has, sets units and records, and starts and stops continuous output. When the line is lost or
/// falls silent it begins again, every half a second, until it is stopped.
class PolhemusTracker : public TrackerDevice {
public:
  static constexpr const char* Scheme = "polhemus";

  /// \throws Error(InvalidParameter), see PolhemusOptions::From.
  explicit PolhemusTracker(const TrackerAddress& address);
  ~PolhemusTracker() override { Stop(); }

  /// \throws Error(FileSystem) when the line cannot be opened.
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override;

private:
  // All throw Error(FileSystem) when the conversation has failed, and may go better another time; NotPossible when it cannot.
  void Run(const Worker::Signal& signal);
  bool Converse(const Worker::Signal& signal); ///< false when it was stopped, as the next two
  bool TryLayouts(const Worker::Signal& signal, PolhemusSpeech speech);
  /// With \a trial > 0 until the first record, or false after so many seconds without one; else until something ends it.
  bool Listen(const Worker::Signal& signal, double trial);
  void Quiet(const Worker::Signal& signal);
  void Tell(const std::string& command);
  std::vector<unsigned char> Hear(double seconds); ///< nothing when nothing comes
  [[noreturn]] void Fail(const std::string& why, Error::Kind kind = Error::Kind::FileSystem) const;
  std::optional<PolhemusReply> Ask(const Worker::Signal& signal, const std::string& command, unsigned char answers);
  void Pass(const std::vector<PolhemusRecord>& records, double arrival);
  std::vector<PolhemusLayout> Layouts(PolhemusModel model, int stations) const;

  PolhemusOptions options_;
  SerialPort port_;
  Worker worker_;
  PoseStream* poses_ = nullptr;

  // of the worker alone
  std::string running_; ///< the message while all is well
  std::optional<PolhemusDecoder> decoder_;
  PolhemusSpeech speech_;
  DeviceClock clock_;
  std::uint64_t jumpsTold_ = 0;
  std::array<double, 32> lastTimes_{}; ///< of the stations
};

} // namespace echorama
