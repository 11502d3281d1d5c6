// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Geometry/TransformGraph.h"
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace echorama {

enum class PolhemusModel { Patriot, Liberty };
const char* PolhemusModelText(PolhemusModel model); ///< "Patriot" or "Liberty"
int PolhemusStations(PolhemusModel model);          ///< how many sensors it can have: 2 or 16

enum class PolhemusFormat { Binary, Ascii };

/// What of a record can be asked for; the numbers are the device's. Binary numbers are 4 bytes, little endian.
enum class PolhemusItem : int {
  LineEnd = 1,          ///< CR LF
  Position = 2,         ///< x, y, z
  PositionExtended = 3, ///< the same; more digits in ASCII
  EulerExtended = 5,    ///< azimuth, elevation, roll in degrees
  Quaternion = 7,       ///< w, x, y, z
  Time = 8,             ///< milliseconds
  Frame = 9,            ///< measurements since the start
  Distortion = 11,      ///< of the field, as the device judges it
};

/// What a record holds, in order.
using PolhemusLayout = std::vector<PolhemusItem>;

/// Ready layouts. The protocol has no checksum; Twofold asks for position and orientation twice, in two forms, for time and frame
/// number, and for the line end: a record that is damaged contradicts itself.
PolhemusLayout PolhemusTwofold(bool distortion);
PolhemusLayout PolhemusSingle(bool distortion); ///< without the repetition and the frame number
PolhemusLayout PolhemusBare();                  ///< nothing but the pose: its time is that of arrival

/// Bytes of a binary record, its header included; of an ASCII record, about.
std::size_t PolhemusRecordBytes(const PolhemusLayout& layout, PolhemusFormat format);

/// How the device was told to speak.
struct PolhemusSpeech {
  PolhemusModel model = PolhemusModel::Patriot;
  PolhemusFormat format = PolhemusFormat::Binary;
  PolhemusLayout layout = PolhemusTwofold(true); ///< position and quaternion at least, and LineEnd at the end
  std::uint32_t stations = 3;                    ///< bit n: station n + 1 is there
  double unitMm = 10.0, rangeMm = 1800.0, distortion = 1e300;

  bool Has(int station) const; ///< \a station from 1
  void Check() const;          ///< Throws Error(InvalidParameter): ranges, and whether layout and stations are possible.
};
ParameterList Describe(PolhemusSpeech& p);

/// One station at one moment.
struct PolhemusRecord {
  int station = 0; ///< from 1
  TransformStatus status = TransformStatus::Valid;
  Pose pose = Pose::Identity(); ///< from the sensor to the source, mm
  std::optional<std::uint32_t> milliseconds;
};

/// From the device's bytes, in pieces of any size, to records.
///
/// Nothing is taken on trust. A record counts only when its tag, station, command, error and size are as agreed, every number
/// is finite, the position lies within reach, the quaternion has unit length to 1e-3, position and orientation agree with their
/// second copies (to the rounding of the shorter form), and time and frame number go on from the last record: a time more than
/// \a LongestPause on, or back, is believed when a second record confirms it; so is a pose that leaps further from the last one
/// of its station than a hand moves it (10 mm and 3 degrees, and 5 m/s and 2000 degrees/s). Whatever is not a record is skipped
/// to the next byte that can begin one, and each such stretch counts once.
///
/// Not detected: without the second copies, damage to a number that moves the pose by less than that.
class PolhemusDecoder {
public:
  static constexpr double LongestPause = 0.25; ///< s

  /// \throws Error(InvalidParameter), see PolhemusSpeech::Check.
  explicit PolhemusDecoder(const PolhemusSpeech& speech);

  /// The records that \a bytes complete, in order.
  std::vector<PolhemusRecord> Take(const unsigned char* bytes, std::size_t count);
  /// Forgets half records and the last time: after a break in the line.
  void Reset();

  std::uint64_t Malformed() const { return malformed_; } ///< stretches of bytes, and records, that were not believed
  const std::string& LastComplaint() const { return complaint_; }

private:
  struct Fields;
  struct Moment {
    std::uint32_t milliseconds = 0, frame = 0;
    bool hasFrame = false;
    bool Follows(const Moment& before, PolhemusModel model) const;
  };
  bool NextBinary(std::vector<PolhemusRecord>& out);
  bool NextLine(std::vector<PolhemusRecord>& out);
  std::string ReadLine(std::string_view line, Fields& fields); ///< what is wrong with it, or ""
  std::string Understand(const Fields& fields, PolhemusRecord& record) const;
  void Settle(const PolhemusRecord& record, std::vector<PolhemusRecord>& out);
  void Deliver(const Fields& fields, const PolhemusRecord& record, std::vector<PolhemusRecord>& out);
  void Complain(const std::string& what);
  void Skip(std::size_t count, const std::string& why);

  PolhemusSpeech speech_;
  std::string buffer_;
  std::size_t begin_ = 0; // of what was not yet looked at
  bool inGarbage_ = false, lineTooLong_ = false;
  std::size_t columns_ = 0, strangeColumns_ = 0; // that the numbers of a line fill: as agreed, of the last line
  int strangeLines_ = 0;                         // of that length in a row
  std::uint64_t malformed_ = 0;
  std::string complaint_;
  std::optional<Moment> last_;
  std::optional<std::pair<Moment, PolhemusRecord>> held_; // its time is not confirmed yet
  struct Station {
    std::optional<PolhemusRecord> last, leapt; // leapt: not confirmed yet
  };
  std::array<Station, 32> seen_;
};

/// What a device said to a command in binary form.
struct PolhemusReply {
  PolhemusModel model = PolhemusModel::Patriot;
  int station = 0;
  unsigned char command = 0, error = 0;
  std::string data;
};

/// The first binary reply to \a command (its letter in any case, or the code of the control key) in \a bytes, which is cut
/// behind it. Nothing, and \a bytes as it was, when there is none yet.
std::optional<PolhemusReply> TakePolhemusReply(std::string& bytes, unsigned char command);

/// What an error byte of a pose record says: Valid, Missing (the source does not send) or OutOfRange (outside of its map, or
/// the built-in test complains); nothing when there is no such code.
std::optional<TransformStatus> PolhemusStatusOf(unsigned char error);

} // namespace echorama
