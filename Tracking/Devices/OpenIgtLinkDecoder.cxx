// SPDX-License-Identifier: BSD-3-Clause
// A message is a header of 58 bytes and a body of the length that it states; since header version 2, the body begins with an
// extended header and ends with meta data. The header is judged as soon as it is complete, before anything is held for its body;
// the body's buffer grows with what comes, not with what was announced. Every length inside a body is compared with what is
// there before it is used.
//
// Layouts are read here by hand: Debian's library (1.11) knows header version 1 alone, unpacks bodies in place without looking at
// their lengths, and has its own overruns. The tests hold every layout against what it packs and unpacks.
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/BigEndian.h"
#include "Tracking/Devices/OpenIgtLinkSum.h"
#include "Tracking/Devices/OpenIgtLinkVoxels.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <igtl_header.h>
#include <igtl_image.h>
#include <igtl_position.h>
#include <igtl_tdata.h>
#include <igtl_transform.h>
#include <igtl_util.h>

namespace echorama {
namespace {

using Message = OpenIgtLinkMessage;
using big_endian::Read;
using big_endian::ReadText;

constexpr std::uint64_t LargestSkip = std::uint64_t{1} << 30;
constexpr std::size_t ImageOverhead = 65536; // header and meta data of an image
constexpr std::size_t ExtendedHeaderSize = 12, StatusHeaderSize = 30;

// Why a body is refused.
struct DecodingComplaint {
  std::string text;
};

[[noreturn]] void Complain(const std::string& text)
{
  throw DecodingComplaint{text};
}

// Names end up in files and on screens.
std::string Clean(std::string text)
{
  for (char& c : text)
    if ((c >= 0 && c < ' ') || c == 127)
      c = '_';
  return text;
}

bool IsWord(const std::string& text)
{
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 127; });
}

bool IsRequest(const std::string& type)
{
  return type.compare(0, 4, "GET_") == 0;
}

std::string Lower(std::string text)
{
  for (char& c : text)
    if (c >= 'A' && c <= 'Z')
      c = static_cast<char>(c - 'A' + 'a');
  return text;
}

// A piece of the body.
struct BodyBytes {
  const unsigned char* data;
  std::size_t size;
};

// Cuts extended header and meta data off the body.
BodyBytes Content(BodyBytes body, Message& message)
{
  if (message.headerVersion < 2)
    return body;
  if (body.size < ExtendedHeaderSize)
    Complain("is too short for its extended header");
  const std::size_t extended = Read<std::uint16_t>(body.data), indexSize = Read<std::uint16_t>(body.data + 2),
                    textSize = Read<std::uint32_t>(body.data + 4);
  if (extended < ExtendedHeaderSize || extended > body.size || indexSize + textSize > body.size - extended)
    Complain("is too short for its meta data");
  const BodyBytes content{body.data + extended, body.size - extended - indexSize - textSize};
  if (indexSize == 0)
    return content;
  // The index is a count and entries of eight bytes; some senders leave out the count.
  const unsigned char* index = content.data + content.size;
  const unsigned char* text = index + indexSize;
  const unsigned char* const end = text + textSize;
  std::size_t entries = indexSize / 8;
  if (indexSize % 8 == 2 && Read<std::uint16_t>(index) == entries)
    index += 2;
  else if (indexSize % 8 != 0)
    Complain("has meta data whose index is of the wrong length");
  for (; entries > 0; --entries, index += 8) {
    const std::size_t key = Read<std::uint16_t>(index), value = Read<std::uint32_t>(index + 4);
    if (key + value > static_cast<std::size_t>(end - text))
      Complain("has meta data that reach beyond its end");
    message.metaData[Clean(std::string(text, text + key))] = Clean(std::string(text + key, text + key + value));
    text += key + value;
  }
  return content;
}

// How Plus and 3D Slicer mark transforms that are not valid.
TransformStatus StatusOf(const Message& message)
{
  if (const auto status = message.metaData.find("TransformStatus"); status != message.metaData.end())
    return TransformStatusOf(status->second);
  if (const auto valid = message.metaData.find("TransformValid"); valid != message.metaData.end()) {
    const std::string word = Lower(valid->second);
    return word == "true" || word == "1" ? TransformStatus::Valid : TransformStatus::Missing;
  }
  return TransformStatus::Valid;
}

// Three columns of the rotation, then the translation.
void ReadTransform(const unsigned char* bytes, Pose& pose)
{
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      pose.matrix()(row, column) = static_cast<double>(Read<float>(bytes + 4 * (3 * column + row)));
}

ToolPose PoseFrom(const Message& message, const std::string& name)
{
  ToolPose pose;
  pose.name = ToolTransformName(name);
  pose.time = message.time;
  pose.status = StatusOf(message);
  return pose;
}

void DecodeTransform(BodyBytes content, Message& message)
{
  if (content.size != IGTL_TRANSFORM_SIZE)
    Complain("holds " + std::to_string(content.size) + " bytes, not " + std::to_string(IGTL_TRANSFORM_SIZE));
  message.kind = Message::Kind::Poses;
  message.poses.push_back(PoseFrom(message, message.device));
  ReadTransform(content.data, message.poses[0].pose);
}

void DecodePosition(BodyBytes content, Message& message)
{
  std::array<double, 7> numbers{0, 0, 0, 0, 0, 0, 1}; // place; x, y, z, w of the quaternion
  if (content.size != IGTL_POSITION_MESSAGE_DEFAULT_SIZE && content.size != IGTL_POSITION_MESSAGE_WITH_QUATERNION3_SIZE &&
      content.size != IGTL_POSITION_MESSAGE_POSITON_ONLY_SIZE)
    Complain("holds " + std::to_string(content.size) + " bytes, not 12, 24 or 28");
  for (std::size_t i = 0; i < content.size / 4; ++i)
    numbers[i] = static_cast<double>(Read<float>(content.data + 4 * i));
  if (content.size == IGTL_POSITION_MESSAGE_WITH_QUATERNION3_SIZE) { // the fourth is not negative and follows from the others
    const double rest = 1.0 - numbers[3] * numbers[3] - numbers[4] * numbers[4] - numbers[5] * numbers[5];
    numbers[6] = rest > 0.0 ? std::sqrt(rest) : rest == rest ? 0.0 : rest;
  }
  const Eigen::Quaterniond turn(numbers[6], numbers[3], numbers[4], numbers[5]);
  message.kind = Message::Kind::Poses;
  message.poses.push_back(PoseFrom(message, message.device));
  Pose& pose = message.poses[0].pose;
  pose.translation() << numbers[0], numbers[1], numbers[2];
  if (std::fabs(turn.norm() - 1.0) <= 1e-3)
    pose.linear() = turn.normalized().toRotationMatrix();
  else
    pose.linear().setZero(); // no pose: the stream says so
}

void DecodeTrackingData(BodyBytes content, Message& message)
{
  if (content.size % IGTL_TDATA_ELEMENT_SIZE != 0)
    Complain("holds " + std::to_string(content.size) + " bytes, which is no multiple of " +
             std::to_string(IGTL_TDATA_ELEMENT_SIZE));
  message.kind = Message::Kind::Poses;
  for (std::size_t at = 0; at < content.size; at += IGTL_TDATA_ELEMENT_SIZE) {
    const unsigned char* element = content.data + at;
    message.poses.push_back(PoseFrom(message, Clean(ReadText(element, IGTL_TDATA_LEN_NAME))));
    ReadTransform(element + IGTL_TDATA_LEN_NAME + 2, message.poses.back().pose);
  }
}

VoxelType VoxelTypeOf(int type)
{
  for (const OpenIgtLinkVoxel& one : OpenIgtLinkVoxels)
    if (one.number == type)
      return one.type;
  Complain("has voxels of an unknown type (" + std::to_string(type) + ")");
}

// The geometry of the part that is sent. The message places the middle of the whole volume, and its axes are steps from voxel to
// voxel. \a mirrored: the third axis was turned round, since our directions are rotations; so must be the slices.
ImageGeometry DecodeGeometry(const unsigned char* header, bool turn, bool& mirrored)
{
  ImageGeometry geometry;
  Eigen::Vector3d half, first;
  std::array<int, 3> whole{};
  for (int axis = 0; axis < 3; ++axis) {
    whole[axis] = Read<std::uint16_t>(header + 6 + 2 * axis);
    const int offset = Read<std::uint16_t>(header + 60 + 2 * axis);
    geometry.dimensions[axis] = Read<std::uint16_t>(header + 66 + 2 * axis);
    if (geometry.dimensions[axis] < 1 || offset + geometry.dimensions[axis] > whole[axis])
      Complain("has a part that does not lie in the whole");
    half[axis] = 0.5 * (whole[axis] - 1);
    first[axis] = offset;
  }
  Eigen::Matrix<double, 3, 4> numbers;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      numbers(row, column) = static_cast<double>(Read<float>(header + 12 + 4 * (3 * column + row)));
  if (!numbers.allFinite())
    Complain("has a place that is not finite");
  if (turn)
    numbers.topRows<2>() *= -1.0;
  Eigen::Matrix3d steps = numbers.leftCols<3>();
  if (whole[2] == 1 && steps.col(2).isZero(0.0)) // a plane need not say how thick it is
    steps.col(2) = steps.col(0).cross(steps.col(1)).normalized();
  geometry.spacing = steps.colwise().norm();
  if (!(geometry.spacing.minCoeff() >= 1e-6 && geometry.spacing.maxCoeff() <= 1e6))
    Complain("has voxels of a size that cannot be");
  geometry.origin = numbers.col(3) + steps * (first - half);
  geometry.direction = steps * geometry.spacing.cwiseInverse().asDiagonal();
  mirrored = geometry.direction.determinant() < 0.0;
  if (mirrored) {
    geometry.origin += steps.col(2) * (geometry.dimensions[2] - 1);
    geometry.direction.col(2) *= -1.0;
  }
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = geometry.direction;
  Pose nearest;
  if (!NearestPose(matrix, nearest))
    Complain("has axes that are not at right angles");
  geometry.direction = nearest.linear();
  return geometry;
}

void DecodeImage(BodyBytes content, Message& message, bool turnImages)
{
  if (content.size < IGTL_IMAGE_HEADER_SIZE)
    Complain("is too short for its header");
  const unsigned char* header = content.data;
  const int version = Read<std::uint16_t>(header), components = header[2], endian = header[4], axes = header[5];
  if (version != 1 && version != 2)
    Complain("is of an unknown version (" + std::to_string(version) + ")");
  if (components < 1 || (endian != IGTL_IMAGE_ENDIAN_BIG && endian != IGTL_IMAGE_ENDIAN_LITTLE) ||
      (axes != IGTL_IMAGE_COORD_RAS && axes != IGTL_IMAGE_COORD_LPS))
    Complain("has a header that cannot be");
  StreamedImage& image = message.image;
  image.name = message.device;
  image.time = message.time;
  image.type = VoxelTypeOf(header[3]);
  image.components = components;
  bool mirrored = false;
  image.geometry = DecodeGeometry(header, turnImages && axes == IGTL_IMAGE_COORD_RAS, mirrored);

  const std::array<int, 3>& size = image.geometry.dimensions;
  const std::size_t scalar = SizeOf(image.type);
  const std::size_t slice = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                            static_cast<std::size_t>(components) * scalar; // at most 2^16 2^16 2^8 2^3
  const std::size_t there = content.size - IGTL_IMAGE_HEADER_SIZE, slices = static_cast<std::size_t>(size[2]);
  if (there % slice != 0 || there / slice != slices)
    Complain("holds " + std::to_string(there) + " bytes of voxels where its header asks for another number");
  auto voxels = std::make_shared<std::vector<unsigned char>>(there);
  const unsigned char* from = content.data + IGTL_IMAGE_HEADER_SIZE;
  for (std::size_t k = 0; k < slices; ++k)
    std::memcpy(voxels->data() + (mirrored ? slices - 1 - k : k) * slice, from + k * slice, slice);
  if (scalar > 1 && (endian == IGTL_IMAGE_ENDIAN_LITTLE) != (igtl_is_little_endian() != 0))
    for (std::size_t at = 0; at < there; at += scalar)
      std::reverse(voxels->begin() + static_cast<std::ptrdiff_t>(at), voxels->begin() + static_cast<std::ptrdiff_t>(at + scalar));
  image.voxels = std::move(voxels);
  message.kind = Message::Kind::Image;
}

void DecodeStatus(BodyBytes content, Message& message)
{
  if (content.size < StatusHeaderSize)
    Complain("is too short for its header");
  message.kind = Message::Kind::Status;
  message.statusCode = Read<std::uint16_t>(content.data);
  const std::string name = ReadText(content.data + 10, 20);
  const std::string text = ReadText(content.data + StatusHeaderSize, content.size - StatusHeaderSize);
  message.statusText = Clean(name.empty() || text.empty() ? name + text : name + ": " + text);
}

void DecodeStartTracking(BodyBytes content, Message& message)
{
  message.kind = Message::Kind::StartTracking;
  if (content.size == 0)
    return; // all of it
  if (content.size != IGTL_STT_TDATA_SIZE)
    Complain("holds " + std::to_string(content.size) + " bytes, not " + std::to_string(IGTL_STT_TDATA_SIZE));
  message.resolutionSeconds = std::max(0, Read<std::int32_t>(content.data)) / 1000.0;
  message.coordinateName = Clean(ReadText(content.data + 4, IGTL_STT_TDATA_LEN_COORDNAME));
}

bool IsDecoded(const std::string& type)
{
  return type == "TRANSFORM" || type == "TDATA" || type == "POSITION" || type == "IMAGE" || type == "STATUS" ||
         type == "STT_TDATA" || type == "STP_TDATA" || IsRequest(type);
}

void DecodeBody(BodyBytes content, Message& message, bool turnImages)
{
  if (message.type == "TRANSFORM")
    DecodeTransform(content, message);
  else if (message.type == "TDATA")
    DecodeTrackingData(content, message);
  else if (message.type == "POSITION")
    DecodePosition(content, message);
  else if (message.type == "IMAGE")
    DecodeImage(content, message, turnImages);
  else if (message.type == "STATUS")
    DecodeStatus(content, message);
  else if (message.type == "STT_TDATA")
    DecodeStartTracking(content, message);
  else if (message.type == "STP_TDATA")
    message.kind = Message::Kind::StopTracking;
  else if (IsRequest(message.type))
    message.kind = Message::Kind::Request;
}

std::string Name(const Message& message)
{
  return message.type + (message.device.empty() ? "" : " " + message.device);
}

Message Refused(const Message& header, Rejection reason, const std::string& complaint)
{
  Message refused;
  refused.kind = Message::Kind::Refused;
  refused.type = header.type;
  refused.device = header.device;
  refused.headerVersion = header.headerVersion;
  refused.time = header.time;
  refused.reason = reason;
  refused.complaint = complaint;
  return refused;
}

} // namespace

ParameterList Describe(OpenIgtLinkDecoding& p)
{
  return {Parameter("Check", p.checkSums, "Whether check sums are looked at; off is for peers that do not compute them."),
          Parameter(
              "TurnImages", p.turnImages,
              "Whether images that say that their axes are R, A, S become L, P, S. Off: their numbers stay as they are, so that "
              "images lie where the poses of the same sender lie; Plus marks every frame of reference as R, A, S."),
          Parameter("ImageBytes", p.imageBytes, {1024, 2147483647}, "bytes", "Voxels of the largest image."),
          Parameter("OtherBytes", p.otherBytes, {1024, 67108864}, "bytes", "Largest of all other messages that are decoded.")};
}

OpenIgtLinkDecoder::OpenIgtLinkDecoder(const OpenIgtLinkDecoding& decoding) : decoding_(decoding)
{
  CheckRanges(decoding);
}

std::vector<Message> OpenIgtLinkDecoder::Feed(const unsigned char* bytes, std::size_t size)
{
  std::vector<Message> messages;
  while (inStep_) {
    if (header_.size() < IGTL_HEADER_SIZE) {
      if (size == 0)
        return messages;
      const std::size_t part = std::min(size, IGTL_HEADER_SIZE - header_.size());
      header_.insert(header_.end(), bytes, bytes + part);
      bytes += part;
      size -= part;
      if (header_.size() < IGTL_HEADER_SIZE)
        return messages;
      Message refused = Begin();
      if (refused.kind == Message::Kind::Refused)
        messages.push_back(std::move(refused));
      if (!inStep_)
        return messages;
    }
    if (skip_ > 0) {
      const std::size_t part = static_cast<std::size_t>(std::min<std::uint64_t>(size, skip_));
      bytes += part;
      size -= part;
      skip_ -= part;
      if (skip_ > 0)
        return messages;
      header_.clear();
      if (message_.kind != Message::Kind::Refused)
        messages.push_back(std::move(message_));
      continue;
    }
    const std::size_t part = std::min(size, static_cast<std::size_t>(bodySize_) - body_.size());
    body_.insert(body_.end(), bytes, bytes + part);
    bytes += part;
    size -= part;
    if (body_.size() < bodySize_)
      return messages;
    messages.push_back(Finish());
    header_.clear();
    body_.clear();
    if (body_.capacity() > decoding_.otherBytes) // an image's
      std::vector<unsigned char>().swap(body_);
  }
  return messages;
}

// Judges the header that is complete. \returns a refusal, or any other message when there is none.
Message OpenIgtLinkDecoder::Begin()
{
  message_ = Message();
  skip_ = 0;
  const unsigned char* header = header_.data();
  message_.headerVersion = Read<std::uint16_t>(header);
  message_.type = ReadText(header + 2, IGTL_HEADER_TYPE_SIZE);
  message_.device = Clean(ReadText(header + 14, IGTL_HEADER_NAME_SIZE));
  const std::uint32_t seconds = Read<std::uint32_t>(header + 34), fraction = Read<std::uint32_t>(header + 38);
  if (seconds != 0 || fraction != 0)
    message_.time = seconds + fraction / 4294967296.0;
  bodySize_ = Read<std::uint64_t>(header + 42);
  sum_ = Read<std::uint64_t>(header + 50);
  if (message_.headerVersion < 1 || message_.headerVersion > 3 || !IsWord(message_.type)) {
    inStep_ = false;
    message_.type.clear();
    message_.device.clear();
    return Refused(message_, Rejection::Malformed, "what comes is not OpenIGTLink");
  }
  const bool decoded = IsDecoded(message_.type), image = message_.type == "IMAGE";
  const std::uint64_t most = image ? std::uint64_t{decoding_.imageBytes} + ImageOverhead : decoding_.otherBytes;
  if (bodySize_ > std::max(LargestSkip, most)) {
    inStep_ = false;
    return Refused(message_, Rejection::TooLarge,
                   Name(message_) + " says that it is " + std::to_string(bodySize_) + " bytes long, which cannot be");
  }
  if (decoded && bodySize_ > most) {
    skip_ = bodySize_;
    message_.kind = Message::Kind::Refused; // said once, now
    return Refused(message_, Rejection::TooLarge,
                   Name(message_) + " is " + std::to_string(bodySize_) + " bytes long; at most " + std::to_string(most) +
                       " are taken");
  }
  if (!decoded)
    skip_ = bodySize_;
  return message_;
}

Message OpenIgtLinkDecoder::Finish()
{
  if (decoding_.checkSums && !body_.empty() && OpenIgtLinkSum(body_.data(), body_.size()) != sum_)
    return Refused(message_, Rejection::Malformed, Name(message_) + " has a wrong check sum");
  try {
    DecodeBody(Content({body_.data(), body_.size()}, message_), message_, decoding_.turnImages);
  } catch (const DecodingComplaint& complaint) {
    return Refused(message_, Rejection::Malformed, Name(message_) + " " + complaint.text);
  }
  return std::move(message_);
}

} // namespace echorama
