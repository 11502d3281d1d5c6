// SPDX-License-Identifier: BSD-3-Clause
// One layout, read and written byte by byte, so that neither the machine's byte order nor its alignment matters. The sum is
// looked at before anything else: behind it, what is wrong was sent wrong. That a pose is rigid is checked all the same, for
// senders are written by people.
#include "Tracking/Devices/PosePacket.h"
#include "Core/Base/Error.h"
#include "Core/Base/Utf8.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <zlib.h>

namespace echorama {
namespace {

constexpr char Magic[] = "EPPK";
constexpr std::size_t HeadBytes = 34, SumBytes = 4;
constexpr std::uint16_t Version = 1, Doubles = 1;
constexpr double PacketUnitTolerance = 1e-4; // of a quaternion in floats: 1e-6 is usual

std::uint32_t SumOf(const unsigned char* bytes, std::size_t count)
{
  return static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), bytes, static_cast<uInt>(count)));
}

class Writer {
public:
  template <class Integer>
  void Whole(Integer number)
  {
    for (std::size_t i = 0; i < sizeof number; ++i)
      bytes.push_back(static_cast<unsigned char>(static_cast<std::uint64_t>(number) >> (8 * i)));
  }
  void Real(double number, bool asDouble)
  {
    if (asDouble) {
      std::uint64_t bits;
      std::memcpy(&bits, &number, 8);
      Whole(bits);
    } else {
      const float single = static_cast<float>(number);
      std::uint32_t bits;
      std::memcpy(&bits, &single, 4);
      Whole(bits);
    }
  }
  std::vector<unsigned char> bytes;
};

/// Beyond the end it gives zeros, and remembers that.
class Reader {
public:
  Reader(const unsigned char* bytes, std::size_t count) : at_(bytes), left_(count) {}
  template <class Integer>
  Integer Whole()
  {
    if (left_ < sizeof(Integer)) {
      short_ = true;
      left_ = 0;
      return 0;
    }
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      number |= static_cast<std::uint64_t>(at_[i]) << (8 * i);
    at_ += sizeof(Integer);
    left_ -= sizeof(Integer);
    return static_cast<Integer>(number);
  }
  double Real(bool asDouble)
  {
    if (asDouble) {
      const auto bits = Whole<std::uint64_t>();
      double number;
      std::memcpy(&number, &bits, 8);
      return number;
    }
    const auto bits = Whole<std::uint32_t>();
    float number;
    std::memcpy(&number, &bits, 4);
    return number;
  }
  std::string Text(std::size_t length)
  {
    if (left_ < length) {
      short_ = true;
      left_ = 0;
      return "";
    }
    const std::string text(reinterpret_cast<const char*>(at_), length);
    at_ += length;
    left_ -= length;
    return text;
  }
  bool TooShort() const { return short_; }
  std::size_t Left() const { return left_; }

private:
  const unsigned char* at_;
  std::size_t left_;
  bool short_ = false;
};

std::string Complaint(const PosePacket& packet)
{
  if (packet.session == 0)
    return "its session is 0";
  if (!std::isfinite(packet.time))
    return "its time is not finite";
  if (packet.poses.empty() || packet.poses.size() > PosePacket::MostPoses)
    return "it must hold 1 to " + std::to_string(PosePacket::MostPoses) + " poses";
  std::set<std::string> names;
  for (const ToolPose& pose : packet.poses) {
    if (pose.name.empty() || pose.name.size() > PosePacket::LongestName)
      return "a name must have 1 to " + std::to_string(PosePacket::LongestName) + " bytes";
    if (!IsPrintableUtf8(pose.name))
      return "a name must be printable UTF-8";
    if (!names.insert(pose.name).second)
      return "two of its poses have one name";
    Pose rigid;
    if (pose.status != TransformStatus::Missing && !NearestPose(pose.pose.matrix(), rigid))
      return "one of its poses is not rigid";
  }
  return "";
}

} // namespace

std::vector<unsigned char> EncodePosePacket(const PosePacket& packet, bool doubles)
{
  const auto refuse = [](const std::string& what) { throw Error(Error::Kind::InvalidParameter, "pose packet: " + what); };
  const std::string complaint = Complaint(packet);
  if (!complaint.empty())
    refuse(complaint);
  Writer out;
  out.bytes.assign(Magic, Magic + 4);
  out.Whole(Version);
  out.Whole(static_cast<std::uint16_t>(doubles ? Doubles : 0));
  out.Whole(packet.session);
  out.Whole(packet.sequence);
  out.Real(packet.time, true);
  out.Whole(static_cast<std::uint16_t>(packet.poses.size()));
  for (const ToolPose& pose : packet.poses) {
    out.Whole(static_cast<std::uint8_t>(pose.name.size()));
    out.bytes.insert(out.bytes.end(), pose.name.begin(), pose.name.end());
    const bool missing = pose.status == TransformStatus::Missing;
    out.Whole(static_cast<std::uint8_t>(missing ? 1 : pose.status == TransformStatus::OutOfRange ? 2 : 0));
    const Eigen::Vector3d p = missing ? Eigen::Vector3d::Zero() : Eigen::Vector3d(pose.pose.translation());
    const Eigen::Quaterniond q = missing ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(pose.pose.linear()).normalized();
    for (const double number : {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()})
      out.Real(number, doubles);
  }
  out.Whole(SumOf(out.bytes.data(), out.bytes.size()));
  if (out.bytes.size() > PosePacket::MostBytes)
    refuse("it has " + std::to_string(out.bytes.size()) + " bytes; at most " + std::to_string(PosePacket::MostBytes) +
           " go into one");
  return out.bytes;
}

std::string DecodePosePacket(const unsigned char* bytes, std::size_t count, PosePacket& packet)
{
  packet = {};
  if (count < HeadBytes + SumBytes)
    return "a packet of " + std::to_string(count) + " bytes is too short";
  if (count > PosePacket::MostBytes)
    return "a packet of " + std::to_string(count) + " bytes is too long";
  if (std::memcmp(bytes, Magic, 4) != 0)
    return "it is no pose packet";
  const std::size_t body = count - SumBytes;
  if (Reader(bytes + body, SumBytes).Whole<std::uint32_t>() != SumOf(bytes, body))
    return "its check sum is wrong";

  Reader in(bytes + 4, body - 4);
  const auto version = in.Whole<std::uint16_t>();
  if (version != Version)
    return "it is of version " + std::to_string(version) + "; known is " + std::to_string(Version);
  const auto flags = in.Whole<std::uint16_t>();
  if ((flags & ~Doubles) != 0)
    return "it has flags that are not known";
  const bool doubles = (flags & Doubles) != 0;
  packet.session = in.Whole<std::uint64_t>();
  packet.sequence = in.Whole<std::uint64_t>();
  packet.time = in.Real(true);
  const auto poses = in.Whole<std::uint16_t>();
  if (poses == 0 || poses > PosePacket::MostPoses)
    return "it says that it holds " + std::to_string(poses) + " poses";
  for (int i = 0; i < poses; ++i) {
    ToolPose pose;
    pose.name = in.Text(in.Whole<std::uint8_t>());
    pose.time = packet.time;
    const auto status = in.Whole<std::uint8_t>();
    double numbers[7];
    for (double& number : numbers)
      number = in.Real(doubles);
    if (in.TooShort())
      return "it ends in the middle of a pose";
    if (status > 2)
      return "a status of " + std::to_string(status) + " does not exist";
    pose.status = status == 0 ? TransformStatus::Valid : status == 1 ? TransformStatus::Missing : TransformStatus::OutOfRange;
    if (pose.status != TransformStatus::Missing) {
      const Eigen::Vector3d position(numbers[0], numbers[1], numbers[2]);
      const Eigen::Quaterniond turn(numbers[3], numbers[4], numbers[5], numbers[6]);
      if (!position.allFinite() || !(std::fabs(turn.norm() - 1.0) <= PacketUnitTolerance)) // not >, for NaN
        return "pose " + std::to_string(i + 1) + " is none";
      pose.pose.linear() = turn.normalized().toRotationMatrix();
      pose.pose.translation() = position;
    }
    packet.poses.push_back(std::move(pose));
  }
  if (in.Left() != 0)
    return "bytes are left over behind its poses";
  return Complaint(packet);
}

PosePacketOrder::Verdict PosePacketOrder::Judge(const PosePacket& packet, double arrival)
{
  if (packet.session != session_) {
    if (session_ != 0 && arrival - last_ < silence_)
      return Verdict::Foreign;
    if (std::find(over_.begin(), over_.end(), packet.session) != over_.end())
      return Verdict::Foreign;
    if (session_ != 0)
      over_.push_back(session_);
    if (over_.size() > 64)
      over_.erase(over_.begin());
    session_ = packet.session;
  } else if (packet.sequence <= sequence_) {
    return Verdict::Replayed;
  }
  sequence_ = packet.sequence;
  last_ = arrival;
  return Verdict::New;
}

} // namespace echorama
