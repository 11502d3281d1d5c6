// SPDX-License-Identifier: BSD-3-Clause
// Bodies are written number by number in the order of the protocol, then extended header, meta data, check sum and header are
// put around them.
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/BigEndian.h"
#include "Tracking/Devices/OpenIgtLinkSum.h"
#include "Tracking/Devices/OpenIgtLinkVoxels.h"
#include <algorithm>
#include <cmath>
#include <igtl_header.h>
#include <igtl_image.h>
#include <igtl_tdata.h>
#include <igtl_util.h>

namespace echorama {
namespace {

using Bytes = OpenIgtLinkEncoder::Bytes;
using big_endian::Write;
using big_endian::WriteText;

constexpr std::uint16_t UsAscii = 3; // IANA's number of a character set

void WriteTransform(Bytes& bytes, const Pose& pose)
{
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      Write(bytes, static_cast<float>(pose.matrix()(row, column)));
}

int WireType(VoxelType type, const std::string& name)
{
  for (const OpenIgtLinkVoxel& one : OpenIgtLinkVoxels)
    if (one.type == type)
      return one.number;
  throw Error(Error::Kind::BadInput, name + ": OpenIGTLink has no voxels of 64-bit integers");
}

} // namespace

Bytes OpenIgtLinkEncoder::Finished(const std::string& type, const std::string& device, double time, const Bytes& content,
                                   const std::map<std::string, std::string>& metaData) const
{
  Bytes extended, index, text;
  if (headerVersion_ >= 2) {
    if (!metaData.empty())
      Write(index, static_cast<std::uint16_t>(metaData.size()));
    for (const auto& [key, value] : metaData) {
      Write(index, static_cast<std::uint16_t>(key.size()));
      Write(index, UsAscii);
      Write(index, static_cast<std::uint32_t>(value.size()));
      text.insert(text.end(), key.begin(), key.end());
      text.insert(text.end(), value.begin(), value.end());
    }
    Write(extended, std::uint16_t{12}); // its own size
    Write(extended, static_cast<std::uint16_t>(index.size()));
    Write(extended, static_cast<std::uint32_t>(text.size()));
    Write(extended, std::uint32_t{0}); // of the message, for replies
  }
  const std::size_t bodySize = extended.size() + content.size() + index.size() + text.size();
  Bytes bytes;
  bytes.reserve(IGTL_HEADER_SIZE + bodySize);
  Write(bytes, static_cast<std::uint16_t>(headerVersion_ >= 2 ? 2 : 1));
  WriteText(bytes, type, IGTL_HEADER_TYPE_SIZE);
  WriteText(bytes, device, IGTL_HEADER_NAME_SIZE);
  const bool timed = std::isfinite(time) && time >= 0.0 && time < 4294967296.0; // else zero: it is not known
  const double seconds = timed ? std::floor(time) : 0.0;
  Write(bytes, static_cast<std::uint32_t>(seconds));
  Write(bytes, static_cast<std::uint32_t>(timed ? (time - seconds) * 4294967296.0 : 0.0));
  Write(bytes, static_cast<std::uint64_t>(bodySize));
  Write(bytes, std::uint64_t{0}); // the check sum comes last
  for (const Bytes* part :
       {static_cast<const Bytes*>(&extended), &content, static_cast<const Bytes*>(&index), static_cast<const Bytes*>(&text)})
    bytes.insert(bytes.end(), part->begin(), part->end());
  Bytes sum;
  Write(sum, OpenIgtLinkSum(bytes.data() + IGTL_HEADER_SIZE, bodySize));
  std::copy(sum.begin(), sum.end(), bytes.begin() + IGTL_HEADER_SIZE - 8);
  return bytes;
}

Bytes OpenIgtLinkEncoder::Transform(const ToolPose& pose) const
{
  Bytes content;
  WriteTransform(content, pose.pose);
  return Finished("TRANSFORM", WireName(pose.name), pose.time, content,
                  {{"TransformStatus", TransformStatusText(pose.status)},
                   {"TransformValid", pose.status == TransformStatus::Valid ? "True" : "False"}});
}

Bytes OpenIgtLinkEncoder::TrackingData(const std::vector<ToolPose>& poses) const
{
  Bytes content;
  for (const ToolPose& pose : poses) {
    if (pose.status != TransformStatus::Valid)
      continue;
    WriteText(content, WireName(pose.name), IGTL_TDATA_LEN_NAME);
    content.push_back(IGTL_TDATA_TYPE_6D);
    content.push_back(0);
    WriteTransform(content, pose.pose);
  }
  return Finished("TDATA", "Echorama", poses.empty() ? 0.0 : poses[0].time, content);
}

Bytes OpenIgtLinkEncoder::Image(const StreamedImage& image, bool turn) const
{
  const ImageGeometry& geometry = image.geometry;
  const std::string name = image.name.empty() ? "the image" : image.name;
  geometry.Check(name);
  if (image.name.size() > IGTL_HEADER_NAME_SIZE)
    throw Error(Error::Kind::BadInput, name + ": OpenIGTLink has no names of more than 20 bytes");
  for (const int size : geometry.dimensions)
    if (size > 65535)
      throw Error(Error::Kind::BadInput, name + ": OpenIGTLink has no images of more than 65535 voxels along an axis");
  if (image.components < 1 || image.components > 255)
    throw Error(Error::Kind::BadInput, name + ": OpenIGTLink has no voxels of " + std::to_string(image.components) + " numbers");
  const int type = WireType(image.type, name);
  const double size = static_cast<double>(geometry.VoxelCount()) * image.components * static_cast<double>(SizeOf(image.type));
  if (size > 2147483647.0 - 65536.0) // peers count in 32 bits
    throw Error(Error::Kind::TooLarge, name + ": OpenIGTLink's peers cannot take images of 2 GiB or more");
  if (!image.voxels || static_cast<double>(image.voxels->size()) != size)
    throw Error(Error::Kind::BadInput, name + ": its voxels are not as many as its size says");

  Bytes content;
  content.reserve(IGTL_IMAGE_HEADER_SIZE + image.voxels->size());
  Write(content, std::uint16_t{IGTL_IMAGE_HEADER_VERSION});
  content.push_back(static_cast<unsigned char>(image.components));
  content.push_back(static_cast<unsigned char>(type));
  content.push_back(igtl_is_little_endian() ? IGTL_IMAGE_ENDIAN_LITTLE : IGTL_IMAGE_ENDIAN_BIG);
  content.push_back(IGTL_IMAGE_COORD_RAS);
  for (const int voxels : geometry.dimensions)
    Write(content, static_cast<std::uint16_t>(voxels));
  Eigen::Matrix<double, 3, 4> numbers; // steps from voxel to voxel; the middle of the volume
  numbers << geometry.direction * geometry.spacing.asDiagonal(), geometry.Centre();
  if (turn)
    numbers.topRows<2>() *= -1.0;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      Write(content, static_cast<float>(numbers(row, column)));
  for (int axis = 0; axis < 3; ++axis) // all of it: the part begins at 0
    Write(content, std::uint16_t{0});
  for (const int voxels : geometry.dimensions)
    Write(content, static_cast<std::uint16_t>(voxels));
  content.insert(content.end(), image.voxels->begin(), image.voxels->end());
  return Finished("IMAGE", image.name, image.time, content);
}

Bytes OpenIgtLinkEncoder::Status(int code, const std::string& text) const
{
  Bytes content;
  Write(content, static_cast<std::uint16_t>(code));
  Write(content, std::int64_t{0});
  WriteText(content, code == 1 ? "OK" : "Error", 20);
  WriteText(content, text, text.size() + 1);
  return Finished("STATUS", "Echorama", 0.0, content);
}

Bytes OpenIgtLinkEncoder::StartTrackingData(double resolutionSeconds, const std::string& coordinateName) const
{
  Bytes content;
  Write(content, static_cast<std::int32_t>(std::lround(std::clamp(resolutionSeconds, 0.0, 1e6) * 1000.0)));
  WriteText(content, coordinateName, IGTL_STT_TDATA_LEN_COORDNAME);
  return Finished("STT_TDATA", "Echorama", 0.0, content);
}

Bytes OpenIgtLinkEncoder::Bare(const std::string& type) const
{
  return Finished(type, "Echorama", 0.0, {});
}

Bytes OpenIgtLinkEncoder::TrackingReply(bool well) const
{
  return Finished("RTS_TDATA", "Echorama", 0.0, {static_cast<unsigned char>(well ? 0 : 1)});
}

std::string OpenIgtLinkEncoder::WireName(const std::string& transform)
{
  if (transform.size() <= IGTL_HEADER_NAME_SIZE)
    return transform;
  const auto frames = FramesOf(transform);
  return frames && frames->second == "Tracker" && frames->first.size() <= IGTL_HEADER_NAME_SIZE ? frames->first : "";
}

} // namespace echorama
