// SPDX-License-Identifier: BSD-3-Clause
// A binary record is a header of 8 bytes (two letters for the model, station, the command it answers, error, nothing, size) and
// the numbers that were asked for. A line of text is the station, an error letter, and the same numbers. Neither has a checksum,
// and bytes get lost on serial lines; so all that is known of a record beforehand is held against it, and the layouts ask for
// what can be checked: a quaternion, which has unit length, rather than angles; a line end, which shifts when a byte is lost;
// position and orientation in two forms.
//
// Where something does not fit, one byte is skipped, not the record: when bytes were lost, the next record begins within it.
#include "Tracking/Devices/PolhemusDecoder.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

constexpr std::size_t HeaderBytes = 8;
constexpr std::size_t LongestLine = 400;      // the longest record of text has some 190
constexpr double UnitTolerance = 1e-3;        // length of a quaternion
constexpr double OrientationTolerance = 2e-3; // radians between the two copies: 0.1 degrees; text rounds to 5 decimals
constexpr double BinaryCopyTolerance = 1e-3;  // of the device's units between the two copies of a position
constexpr double AsciiCopyTolerance = 6e-3;   // the shorter form has two decimals

int NumbersOf(PolhemusItem item)
{
  using Item = PolhemusItem;
  const bool single = item == Item::Time || item == Item::Frame || item == Item::Distortion;
  return item == Item::LineEnd ? 0 : item == Item::Quaternion ? 4 : single ? 1 : 3;
}

/// How long a frame of the device may last, ms: 60 Hz; 240 or 120 Hz.
std::array<double, 2> FrameDuration(PolhemusModel model)
{
  return model == PolhemusModel::Patriot ? std::array<double, 2>{16.0, 17.5} : std::array<double, 2>{4.0, 8.5};
}

bool IsWhole(PolhemusItem item)
{
  return item == PolhemusItem::Time || item == PolhemusItem::Frame;
}

std::uint32_t Word(const char* bytes)
{
  unsigned char b[4];
  std::memcpy(b, bytes, 4);
  return b[0] | static_cast<std::uint32_t>(b[1]) << 8 | static_cast<std::uint32_t>(b[2]) << 16 |
         static_cast<std::uint32_t>(b[3]) << 24;
}

double Float(const char* bytes)
{
  const std::uint32_t word = Word(bytes);
  float number;
  std::memcpy(&number, &word, 4);
  return number;
}

const char* TagOf(PolhemusModel model)
{
  return model == PolhemusModel::Patriot ? "PA" : "LY";
}

/// Whether a hand could have moved the sensor from \a a to \a b in the time between, or in \a pause seconds when they have none.
bool WithinReach(const PolhemusRecord& a, const PolhemusRecord& b, double pause)
{
  constexpr double Mm = 10.0, MmPerSecond = 5000.0, Radians = 0.05, RadiansPerSecond = 35.0;
  const double seconds =
      a.milliseconds && b.milliseconds ? 0.001 * static_cast<std::int32_t>(*b.milliseconds - *a.milliseconds) : pause;
  return (b.pose.translation() - a.pose.translation()).norm() <= Mm + MmPerSecond * std::fabs(seconds) &&
         RotationAngle(a.pose.inverse() * b.pose) <= Radians + RadiansPerSecond * std::fabs(seconds);
}

/// Characters from the point on, those of an exponent too.
std::size_t Decimals(std::string_view number)
{
  return number.size() - std::min(number.find('.'), number.size());
}

/// The numbers of a line. Columns may be filled to the last character, so a sign begins one too, but for that of an exponent.
std::vector<std::string_view> Words(std::string_view line)
{
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (at < line.size()) {
    if (line[at] == ' ') {
      ++at;
      continue;
    }
    std::size_t end = at + 1;
    while (end < line.size() && line[end] != ' ' &&
           !((line[end] == '-' || line[end] == '+') && line[end - 1] != 'E' && line[end - 1] != 'e'))
      ++end;
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

} // namespace

const char* PolhemusModelText(PolhemusModel model)
{
  return model == PolhemusModel::Patriot ? "Patriot" : "Liberty";
}

int PolhemusStations(PolhemusModel model)
{
  return model == PolhemusModel::Patriot ? 2 : 16;
}

PolhemusLayout PolhemusTwofold(bool distortion)
{
  using Item = PolhemusItem;
  if (distortion)
    return {Item::Time,       Item::Frame,    Item::Distortion,    Item::PositionExtended,
            Item::Quaternion, Item::Position, Item::EulerExtended, Item::LineEnd};
  return {Item::Time, Item::Frame, Item::PositionExtended, Item::Quaternion, Item::Position, Item::EulerExtended, Item::LineEnd};
}

PolhemusLayout PolhemusSingle(bool distortion)
{
  using Item = PolhemusItem;
  if (distortion)
    return {Item::Time, Item::Distortion, Item::PositionExtended, Item::Quaternion, Item::LineEnd};
  return {Item::Time, Item::PositionExtended, Item::Quaternion, Item::LineEnd};
}

PolhemusLayout PolhemusBare()
{
  return {PolhemusItem::PositionExtended, PolhemusItem::Quaternion, PolhemusItem::LineEnd};
}

std::size_t PolhemusRecordBytes(const PolhemusLayout& layout, PolhemusFormat format)
{
  std::size_t bytes = format == PolhemusFormat::Binary ? HeaderBytes : 3;
  for (const PolhemusItem item : layout) {
    const std::size_t numbers = static_cast<std::size_t>(NumbersOf(item));
    if (item == PolhemusItem::LineEnd)
      bytes += 2;
    else if (format == PolhemusFormat::Binary)
      bytes += 4 * numbers;
    else if (item == PolhemusItem::PositionExtended || item == PolhemusItem::EulerExtended)
      bytes += 15 * numbers;
    else
      bytes += 10 * numbers;
  }
  return bytes;
}

ParameterList Describe(PolhemusSpeech& p)
{
  return {Parameter("Format", Choice(p.format, {"binary", "ascii"}), "How records are written."),
          Parameter("UnitMm", p.unitMm, {0, 1000, true}, "mm", "What the device counts in."),
          Parameter("Range", p.rangeMm, {0, 20000, true}, "mm",
                    "Poses further away are out of range; those beyond three times that are damaged."),
          Parameter("Distortion", p.distortion, {}, "",
                    "From this level on, as the device judges the field, poses are out of range; the default never is.")};
}

bool PolhemusSpeech::Has(int station) const
{
  return station >= 1 && station <= 32 && (stations >> (station - 1) & 1) != 0;
}

void PolhemusSpeech::Check() const
{
  CheckRanges(*this);
  const auto refuse = [](const std::string& what) { throw Error(Error::Kind::InvalidParameter, "Polhemus: " + what); };
  const auto count = [this](PolhemusItem item) { return std::count(layout.begin(), layout.end(), item); };
  for (const PolhemusItem item : layout)
    if (count(item) > 1)
      refuse("an item is asked for twice");
  if (count(PolhemusItem::Position) + count(PolhemusItem::PositionExtended) == 0 || count(PolhemusItem::Quaternion) == 0)
    refuse("a record must hold the position and the quaternion");
  if (layout.back() != PolhemusItem::LineEnd)
    refuse("a record must end with a line end");
  if (stations == 0 || stations >> PolhemusStations(model) != 0)
    refuse(std::string("a ") + PolhemusModelText(model) + " has stations 1 to " + std::to_string(PolhemusStations(model)) +
           ", and at least one must be there");
}

std::optional<TransformStatus> PolhemusStatusOf(unsigned char error)
{
  if (error == 0 || error == ' ')
    return TransformStatus::Valid;
  if ((error >= 'a' && error <= 'g') || (error >= 'A' && error <= 'G')) // coils of the source have failed
    return TransformStatus::Missing;
  if (error == 'I' || error == 'u')
    return TransformStatus::OutOfRange;
  return std::nullopt;
}

struct PolhemusDecoder::Fields {
  int station = 0;
  unsigned char error = 0;
  std::array<std::optional<Eigen::Vector4d>, 12> items; // by their numbers; of no more than three, the rest is 0

  std::optional<Eigen::Vector4d>& operator[](PolhemusItem item) { return items[static_cast<std::size_t>(item)]; }
  const std::optional<Eigen::Vector4d>& operator[](PolhemusItem item) const { return items[static_cast<std::size_t>(item)]; }
};

PolhemusDecoder::PolhemusDecoder(const PolhemusSpeech& speech) : speech_(speech)
{
  speech_.Check();
}

void PolhemusDecoder::Reset()
{
  buffer_.clear();
  begin_ = 0;
  inGarbage_ = lineTooLong_ = false;
  columns_ = strangeColumns_ = 0;
  last_.reset();
  held_.reset();
  seen_ = {};
}

void PolhemusDecoder::Complain(const std::string& what)
{
  ++malformed_;
  complaint_ = what;
}

void PolhemusDecoder::Skip(std::size_t count, const std::string& why)
{
  if (!inGarbage_)
    Complain(why);
  inGarbage_ = true;
  begin_ += count;
}

std::vector<PolhemusRecord> PolhemusDecoder::Take(const unsigned char* bytes, std::size_t count)
{
  std::vector<PolhemusRecord> records;
  buffer_.append(reinterpret_cast<const char*>(bytes), count);
  while (speech_.format == PolhemusFormat::Binary ? NextBinary(records) : NextLine(records)) {
  }
  buffer_.erase(0, begin_);
  begin_ = 0;
  return records;
}

bool PolhemusDecoder::NextBinary(std::vector<PolhemusRecord>& out)
{
  const char* head = buffer_.data() + begin_;
  const std::size_t left = buffer_.size() - begin_;
  const char* tag = TagOf(speech_.model);
  if (left == 0)
    return false;
  if (head[0] != tag[0] || (left > 1 && head[1] != tag[1])) {
    Skip(1, "bytes that are no record");
    return true;
  }
  const std::size_t whole = PolhemusRecordBytes(speech_.layout, PolhemusFormat::Binary);
  // The header is judged as far as it is there, so that half a one does not hold up what comes behind it.
  const auto byte = [head](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  const char* wrong = nullptr;
  if (left > 2 && !speech_.Has(byte(2)))
    wrong = "a record of a station that is not there";
  else if (left > 3 && byte(3) != 'C' && byte(3) != 'P' && byte(3) != 'c' && byte(3) != 'p')
    wrong = "a record that answers another command";
  else if (left > 4 && !PolhemusStatusOf(byte(4)))
    wrong = "a record with an error that does not exist";
  else if (left > 7 && byte(6) + 256u * byte(7) != whole - HeaderBytes)
    wrong = "a record of a size that was not agreed";
  if (wrong) {
    Skip(1, wrong);
    return true;
  }
  if (left < whole)
    return false;

  Fields fields;
  fields.station = byte(2);
  fields.error = byte(4);
  const char* at = head + HeaderBytes;
  std::string complaint;
  for (const PolhemusItem item : speech_.layout) {
    if (item == PolhemusItem::LineEnd) {
      if (at[0] != '\r' || at[1] != '\n')
        complaint = "a record that does not end where it should";
      at += 2;
      continue;
    }
    Eigen::Vector4d& numbers = fields[item].emplace(Eigen::Vector4d::Zero());
    for (int i = 0; i < NumbersOf(item); ++i, at += 4)
      numbers[i] = IsWhole(item)                      ? Word(at)
                   : item == PolhemusItem::Distortion ? static_cast<double>(static_cast<std::int32_t>(Word(at)))
                                                      : Float(at);
  }
  PolhemusRecord record;
  if (complaint.empty())
    complaint = Understand(fields, record);
  if (!complaint.empty()) {
    Skip(1, complaint);
    return true;
  }
  begin_ += whole;
  inGarbage_ = false;
  Deliver(fields, record, out);
  return true;
}

bool PolhemusDecoder::NextLine(std::vector<PolhemusRecord>& out)
{
  const std::size_t end = buffer_.find('\n', begin_);
  if (end == std::string::npos) {
    if (buffer_.size() - begin_ > LongestLine) {
      if (!lineTooLong_)
        Complain("a line without an end");
      lineTooLong_ = true;
      begin_ = buffer_.size();
    }
    return false;
  }
  const std::string_view line(buffer_.data() + begin_, end - begin_);
  begin_ = end + 1;
  if (std::exchange(lineTooLong_, false))
    return true; // the rest of it; it is counted
  Fields fields;
  PolhemusRecord record;
  std::string complaint = ReadLine(line, fields);
  if (complaint.empty())
    complaint = Understand(fields, record);
  if (complaint.empty())
    Deliver(fields, record, out);
  else
    Complain(complaint);
  return true;
}

std::string PolhemusDecoder::ReadLine(std::string_view line, Fields& fields)
{
  if (line.empty() || line.back() != '\r')
    return "a line without its end";
  line.remove_suffix(1);
  if (line.size() < 4 || line.size() > LongestLine)
    return "a line that is no record";
  if (!ParseNumber(line.substr(line[0] == ' ' ? 1 : 0, line[0] == ' ' ? 1 : 2), fields.station) || !speech_.Has(fields.station))
    return "a line of a station that is not there";
  fields.error = static_cast<unsigned char>(line[2]);
  if (fields.error == 0 || !PolhemusStatusOf(fields.error))
    return "a line with an error that does not exist";
  const std::vector<std::string_view> words = Words(line.substr(3));
  std::size_t at = 0, columns = 0;
  for (const PolhemusItem item : speech_.layout) {
    Eigen::Vector4d& numbers = fields[item].emplace(Eigen::Vector4d::Zero());
    const int count = NumbersOf(item);
    if (at + static_cast<std::size_t>(count) > words.size())
      return "a line with too few numbers";
    for (int i = 0; i < count; ++i) {
      const std::string_view word = words[at + static_cast<std::size_t>(i)];
      std::uint32_t whole = 0;
      // Numbers of one item have the same decimals; where one lacks a digit, the line has lost it.
      if (!(IsWhole(item) ? ParseNumber(word, whole) : ParseNumber(word, numbers[i]) && Decimals(word) == Decimals(words[at])))
        return "a line with \"" + std::string(word.substr(0, 20)) + "\" in place of a number";
      if (IsWhole(item))
        numbers[i] = whole;
    }
    if (columns == 0 && count > 1) { // the counters before may be of any length; from here on the columns are fixed
      const char* begin = at == 0 ? line.data() + 3 : words[at - 1].data() + words[at - 1].size();
      columns = static_cast<std::size_t>(line.data() + line.size() - begin);
    }
    at += static_cast<std::size_t>(count);
  }
  if (at != words.size())
    return "a line with too many numbers";
  // A line that is shorter than those before it has lost something, a sign perhaps; three of them are how it is now.
  strangeLines_ = columns == strangeColumns_ ? strangeLines_ + 1 : 1;
  strangeColumns_ = columns;
  if (columns_ != 0 && columns != columns_ && strangeLines_ < 3)
    return "a line of another length";
  columns_ = columns;
  return "";
}

std::string PolhemusDecoder::Understand(const Fields& f, PolhemusRecord& record) const
{
  using Item = PolhemusItem;
  record.station = f.station;
  if (f[Item::Time])
    record.milliseconds = static_cast<std::uint32_t>(f[Item::Time]->x());
  record.status = *PolhemusStatusOf(f.error);
  if (record.status == TransformStatus::Missing) // its numbers mean nothing
    return "";

  const auto &longer = f[Item::PositionExtended], &shorter = f[Item::Position];
  const Eigen::Vector3d position = (longer ? *longer : *shorter).head<3>();
  const Eigen::Vector4d& q = *f[Item::Quaternion]; // w, x, y, z
  if (!position.allFinite() || !q.allFinite())
    return "a record with a number that is none";
  if (position.norm() * speech_.unitMm > 3.0 * speech_.rangeMm)
    return "a position far beyond the range of the device";
  if (std::fabs(q.norm() - 1.0) > UnitTolerance)
    return "a quaternion that is not of unit length";
  const Eigen::Quaterniond turn = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();

  const double tolerance = speech_.format == PolhemusFormat::Binary ? BinaryCopyTolerance : AsciiCopyTolerance;
  if (longer && shorter && !((*shorter - *longer).array().abs() <= tolerance).all()) // maxCoeff may pass over NaN
    return "a position that differs from its copy";
  if (const auto& euler = f[Item::EulerExtended]) {
    using Axis = Eigen::AngleAxisd;
    const Eigen::Quaterniond copy = Axis((*euler)[0] * RadiansPerDegree, Eigen::Vector3d::UnitZ()) *
                                    Axis((*euler)[1] * RadiansPerDegree, Eigen::Vector3d::UnitY()) *
                                    Axis((*euler)[2] * RadiansPerDegree, Eigen::Vector3d::UnitX());
    if (!(euler->array().abs() <= 360.0).all() || !(copy.angularDistance(turn) <= OrientationTolerance))
      return "an orientation that differs from its copy";
  }
  record.pose.linear() = turn.toRotationMatrix();
  record.pose.translation() = position * speech_.unitMm;
  const bool distorted = f[Item::Distortion] && f[Item::Distortion]->x() >= speech_.distortion;
  if (distorted || record.pose.translation().norm() > speech_.rangeMm)
    record.status = TransformStatus::OutOfRange;
  return "";
}

bool PolhemusDecoder::Moment::Follows(const Moment& before, PolhemusModel model) const
{
  const auto ms = static_cast<std::int32_t>(milliseconds - before.milliseconds); // through the wrap at 2^32
  if (ms < 0 || ms > 1000.0 * LongestPause)
    return false;
  const auto frames = static_cast<std::int32_t>(frame - before.frame);
  const auto duration = FrameDuration(model);
  return !hasFrame || (frames >= 0 && ms >= duration[0] * frames - 2.0 && ms <= duration[1] * frames + 2.0);
}

void PolhemusDecoder::Settle(const PolhemusRecord& record, std::vector<PolhemusRecord>& out)
{
  constexpr double Pause = 0.02; // s between bare records
  Station& station = seen_[static_cast<std::size_t>(record.station - 1)];
  const bool missing = record.status == TransformStatus::Missing;
  const bool goesOn = missing || !station.last || WithinReach(*station.last, record, Pause);
  const bool confirms = !goesOn && station.leapt && WithinReach(*station.leapt, record, Pause);
  if (confirms)
    out.push_back(*station.leapt);
  else if (station.leapt)
    Complain("a leap that nothing confirms");
  station.leapt.reset();
  if (!goesOn && !confirms) {
    station.leapt = record;
    return;
  }
  station.last.reset();
  if (!missing)
    station.last = record;
  out.push_back(record);
}

void PolhemusDecoder::Deliver(const Fields& fields, const PolhemusRecord& record, std::vector<PolhemusRecord>& out)
{
  if (!record.milliseconds) {
    Settle(record, out);
    return;
  }
  const auto& frame = fields[PolhemusItem::Frame];
  const Moment moment{*record.milliseconds, frame ? static_cast<std::uint32_t>(frame->x()) : 0, frame.has_value()};
  const bool goesOn = last_ && moment.Follows(*last_, speech_.model);
  if (goesOn || (held_ && moment.Follows(held_->first, speech_.model))) {
    if (held_ && !goesOn)
      Settle(held_->second, out); // the clock has jumped
    else if (held_)
      Complain("a time that nothing confirms");
    held_.reset();
    last_ = moment;
    Settle(record, out);
    return;
  }
  if (held_)
    Complain("a time that nothing confirms");
  held_.emplace(moment, record);
}

std::optional<PolhemusReply> TakePolhemusReply(std::string& bytes, unsigned char command)
{
  for (std::size_t at = 0; at + HeaderBytes <= bytes.size(); ++at) {
    for (const PolhemusModel model : {PolhemusModel::Patriot, PolhemusModel::Liberty}) {
      if (bytes.compare(at, 2, TagOf(model)) != 0)
        continue;
      const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[at + i]); };
      const std::size_t size = byte(6) + 256u * byte(7);
      const bool same = (byte(3) & 0x1f) == (command & 0x1f); // C, c and control-C
      if (!same || at + HeaderBytes + size > bytes.size())
        continue;
      PolhemusReply reply{model, byte(2), byte(3), byte(4), bytes.substr(at + HeaderBytes, size)};
      bytes.erase(0, at + HeaderBytes + size);
      return reply;
    }
  }
  return std::nullopt;
}

} // namespace echorama
