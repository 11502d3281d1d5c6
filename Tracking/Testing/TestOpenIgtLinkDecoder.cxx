// SPDX-License-Identifier: BSD-3-Clause
// Bytes against the library's own packing and unpacking, whole and in pieces, right and wrong.
#include "Core/Base/Error.h"
#include "Tracking/Devices/BigEndian.h"
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Tracking/Devices/OpenIgtLinkSum.h"
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <igtl_util.h>
#include <igtlImageMessage.h>
#include <igtlPositionMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#include <numeric>

using namespace echorama;
using Kind = OpenIgtLinkMessage::Kind;
using Bytes = std::vector<unsigned char>;

namespace {

constexpr unsigned Seconds = 1700000000, Fraction = 0x40000000;
constexpr double Time = 1700000000.25;

template <class Message>
Bytes Packed(Message& message, const char* device = "ProbeToTracker")
{
  message->SetDeviceName(device);
  message->SetTimeStamp(Seconds, Fraction);
  message->Pack();
  const auto* bytes = static_cast<const unsigned char*>(message->GetPackPointer());
  return Bytes(bytes, bytes + message->GetPackSize());
}

// The library's reading of our bytes.
template <class Message>
typename Message::Pointer Unpacked(const Bytes& bytes)
{
  igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), bytes.data(), static_cast<std::size_t>(header->GetPackSize()));
  header->Unpack();
  typename Message::Pointer message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  EXPECT_EQ(static_cast<std::size_t>(message->GetPackBodySize()), bytes.size() - 58);
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + 58, bytes.size() - 58);
  EXPECT_TRUE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY);
  return message;
}

Pose SomePose(double angle = 0.7)
{
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pose.translation() << 10.5, -20.25, 300.125;
  return pose;
}

void ToLibrary(const Pose& pose, igtl::Matrix4x4& matrix)
{
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      matrix[row][column] = static_cast<float>(pose.matrix()(row, column));
}

Pose FromLibrary(const igtl::Matrix4x4& matrix)
{
  Pose result = Pose::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      result.matrix()(row, column) = static_cast<double>(matrix[row][column]);
  return result;
}

double Apart(const Pose& a, const Pose& b)
{
  return (a.linear() - b.linear()).norm() + (a.translation() - b.translation()).norm();
}

Bytes LibraryTransform(const char* device = "ProbeToTracker")
{
  igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  igtl::Matrix4x4 matrix;
  ToLibrary(SomePose(), matrix);
  message->SetMatrix(matrix);
  return Packed(message, device);
}

std::vector<OpenIgtLinkMessage> Decode(const Bytes& bytes, const OpenIgtLinkDecoding& decoding = {})
{
  OpenIgtLinkDecoder decoder(decoding);
  return decoder.Feed(bytes.data(), bytes.size());
}

OpenIgtLinkMessage DecodeOne(const Bytes& bytes, const OpenIgtLinkDecoding& decoding = {})
{
  auto messages = Decode(bytes, decoding);
  EXPECT_EQ(messages.size(), 1u);
  return messages.empty() ? OpenIgtLinkMessage() : messages[0];
}

void SetSum(Bytes& bytes)
{
  Bytes sum;
  big_endian::Write(sum, static_cast<std::uint64_t>(crc64(bytes.data() + 58, bytes.size() - 58, 0)));
  std::copy(sum.begin(), sum.end(), bytes.begin() + 50);
}

void SetSize(Bytes& bytes, std::uint64_t size)
{
  Bytes number;
  big_endian::Write(number, size);
  std::copy(number.begin(), number.end(), bytes.begin() + 42);
}

// A message of header version 2 around a body's content.
Bytes Version2(const Bytes& version1, const Bytes& index, const Bytes& text, std::uint16_t version = 2,
               std::size_t extendedSize = 12)
{
  Bytes bytes(version1.begin(), version1.begin() + 58), extended;
  big_endian::Write(extended, static_cast<std::uint16_t>(extendedSize));
  big_endian::Write(extended, static_cast<std::uint16_t>(index.size()));
  big_endian::Write(extended, static_cast<std::uint32_t>(text.size()));
  big_endian::Write(extended, std::uint32_t{77});
  extended.resize(extendedSize, 0xee); // a longer one, of the future
  bytes[1] = static_cast<unsigned char>(version);
  for (const Bytes* part : {static_cast<const Bytes*>(&extended), static_cast<const Bytes*>(nullptr), &index, &text}) {
    if (part)
      bytes.insert(bytes.end(), part->begin(), part->end());
    else
      bytes.insert(bytes.end(), version1.begin() + 58, version1.end());
  }
  SetSize(bytes, bytes.size() - 58);
  SetSum(bytes);
  return bytes;
}

Bytes Index(const std::vector<std::pair<std::string, std::string>>& metaData, Bytes& text, bool count = true)
{
  Bytes index;
  if (count)
    big_endian::Write(index, static_cast<std::uint16_t>(metaData.size()));
  for (const auto& [key, value] : metaData) {
    big_endian::Write(index, static_cast<std::uint16_t>(key.size()));
    big_endian::Write(index, std::uint16_t{3});
    big_endian::Write(index, static_cast<std::uint32_t>(value.size()));
    text.insert(text.end(), key.begin(), key.end());
    text.insert(text.end(), value.begin(), value.end());
  }
  return index;
}

ImageGeometry SomeGeometry()
{
  ImageGeometry geometry;
  geometry.dimensions = {5, 4, 3};
  geometry.origin << 10, -20, 30;
  geometry.spacing << 0.5, 0.75, 2.0;
  geometry.direction = SomePose().linear();
  return geometry;
}

// By the library: 16-bit voxels 0, 1, 2 ... at the geometry, whose axes it says are RAS or LPS.
Bytes LibraryImage(const ImageGeometry& geometry, int axes, int scalarType = igtl::ImageMessage::TYPE_INT16, bool big = false)
{
  igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
  message->SetDimensions(geometry.dimensions[0], geometry.dimensions[1], geometry.dimensions[2]);
  message->SetSubVolume(geometry.dimensions[0], geometry.dimensions[1], geometry.dimensions[2], 0, 0, 0);
  message->SetSpacing(static_cast<float>(geometry.spacing[0]), static_cast<float>(geometry.spacing[1]),
                      static_cast<float>(geometry.spacing[2]));
  message->SetScalarType(scalarType);
  message->SetEndian(big ? igtl::ImageMessage::ENDIAN_BIG : igtl::ImageMessage::ENDIAN_LITTLE);
  message->SetCoordinateSystem(axes);
  message->AllocateScalars();
  Pose place = Pose::Identity();
  place.linear() = geometry.direction;
  place.translation() = geometry.Centre();
  igtl::Matrix4x4 matrix;
  ToLibrary(place, matrix);
  message->SetMatrix(matrix);
  auto* bytes = static_cast<unsigned char*>(message->GetScalarPointer());
  if (message->GetScalarSize() == 2)
    for (int i = 0; i < message->GetImageSize() / 2; ++i) {
      bytes[2 * i + (big ? 1 : 0)] = static_cast<unsigned char>(i & 255);
      bytes[2 * i + (big ? 0 : 1)] = static_cast<unsigned char>(i >> 8);
    }
  return Packed(message, "Volume");
}

StreamedImage SomeImage()
{
  StreamedImage image;
  image.name = "Volume";
  image.time = Time;
  image.geometry = SomeGeometry();
  image.type = VoxelType::Int16;
  auto voxels = std::make_shared<Bytes>(image.geometry.VoxelCount() * 2);
  for (std::size_t i = 0; i < voxels->size() / 2; ++i) {
    const auto number = static_cast<std::int16_t>(i);
    std::memcpy(voxels->data() + 2 * i, &number, 2);
  }
  image.voxels = voxels;
  return image;
}

} // namespace

TEST(OpenIgtLinkSum, IsThatOfTheLibrary)
{
  Bytes bytes(300);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<unsigned char>(i * i * 31 + 7 * i + 200);
  for (std::size_t begin = 0; begin < 9; ++begin)
    for (std::size_t size = 0; size < 280; ++size)
      ASSERT_EQ(OpenIgtLinkSum(bytes.data() + begin, size), crc64(bytes.data() + begin, size, 0)) << begin << " " << size;
}

TEST(OpenIgtLinkDecoder, ReadsTheTransformsOfTheLibrary)
{
  const OpenIgtLinkMessage message = DecodeOne(LibraryTransform());
  ASSERT_EQ(message.kind, Kind::Poses);
  EXPECT_EQ(message.type, "TRANSFORM");
  EXPECT_EQ(message.device, "ProbeToTracker");
  EXPECT_EQ(message.time, Time);
  ASSERT_EQ(message.poses.size(), 1u);
  EXPECT_EQ(message.poses[0].name, "ProbeToTracker");
  EXPECT_EQ(message.poses[0].time, Time);
  EXPECT_EQ(message.poses[0].status, TransformStatus::Valid);
  EXPECT_LT(Apart(message.poses[0].pose, SomePose()), 1e-5);
  EXPECT_EQ(DecodeOne(LibraryTransform("my probe")).poses.at(0).name, "My_probeToTracker");
}

TEST(OpenIgtLinkDecoder, TakesAZeroStampForNone)
{
  Bytes bytes = LibraryTransform();
  std::fill(bytes.begin() + 34, bytes.begin() + 42, static_cast<unsigned char>(0));
  EXPECT_TRUE(std::isnan(DecodeOne(bytes).poses.at(0).time));
}

TEST(OpenIgtLinkDecoder, ReadsTheTrackingDataOfTheLibrary)
{
  igtl::TrackingDataMessage::Pointer message = igtl::TrackingDataMessage::New();
  for (const char* name : {"Probe", "ReferenceToTracker", "TwentyBytesToTracker"}) {
    igtl::TrackingDataElement::Pointer element = igtl::TrackingDataElement::New();
    element->SetName(name);
    element->SetType(igtl::TrackingDataElement::TYPE_6D);
    igtl::Matrix4x4 matrix;
    ToLibrary(SomePose(0.1 * static_cast<double>(std::strlen(name))), matrix);
    element->SetMatrix(matrix);
    message->AddTrackingDataElement(element);
  }
  const OpenIgtLinkMessage read = DecodeOne(Packed(message));
  ASSERT_EQ(read.poses.size(), 3u);
  EXPECT_EQ(read.poses[0].name, "ProbeToTracker");
  EXPECT_EQ(read.poses[1].name, "ReferenceToTracker");
  EXPECT_EQ(read.poses[2].name, "TwentyBytesToTracker");
  EXPECT_LT(Apart(read.poses[0].pose, SomePose(0.5)), 1e-5);
  EXPECT_LT(Apart(read.poses[2].pose, SomePose(2.0)), 1e-5);
  EXPECT_EQ(read.poses[1].time, Time);
}

// The library writes beyond its own buffer when it packs the two shorter forms, which are beginnings of the longest.
TEST(OpenIgtLinkDecoder, ReadsThePositionsOfTheLibraryInAllThreeLengths)
{
  const Eigen::Quaterniond turn(SomePose().linear());
  igtl::PositionMessage::Pointer message = igtl::PositionMessage::New();
  message->SetPosition(10.5f, -20.25f, 300.125f);
  message->SetQuaternion(static_cast<float>(turn.x()), static_cast<float>(turn.y()), static_cast<float>(turn.z()),
                         static_cast<float>(turn.w()));
  for (const std::size_t size : {28u, 24u, 12u}) {
    Bytes bytes = Packed(message);
    bytes.resize(58 + size);
    SetSize(bytes, size);
    SetSum(bytes);
    Pose expected = SomePose();
    if (size == 12)
      expected.linear().setIdentity();
    const OpenIgtLinkMessage read = DecodeOne(bytes);
    ASSERT_EQ(read.poses.size(), 1u);
    EXPECT_LT(Apart(read.poses[0].pose, expected), 1e-5) << size;
  }
}

TEST(OpenIgtLinkDecoder, LeavesQuaternionsThatAreNoneToTheStream)
{
  for (const float w : {0.0f, 5.0f, std::numeric_limits<float>::quiet_NaN()}) {
    igtl::PositionMessage::Pointer message = igtl::PositionMessage::New();
    message->SetPosition(1, 2, 3);
    message->SetQuaternion(0, 0, 0, w);
    Pose pose;
    EXPECT_FALSE(NearestPose(DecodeOne(Packed(message)).poses.at(0).pose.matrix(), pose)) << w;
  }
}

TEST(OpenIgtLinkDecoder, ReadsTheStatusOfTheLibrary)
{
  igtl::StatusMessage::Pointer message = igtl::StatusMessage::New();
  message->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
  message->SetSubCode(5);
  message->SetErrorName("Warming up");
  message->SetStatusString("two minutes more");
  const OpenIgtLinkMessage read = DecodeOne(Packed(message));
  EXPECT_EQ(read.kind, Kind::Status);
  EXPECT_EQ(read.statusCode, 13);
  EXPECT_EQ(read.statusText, "Warming up: two minutes more");
}

TEST(OpenIgtLinkDecoder, ReadsTheRequestsOfTheLibrary)
{
  igtl::StartTrackingDataMessage::Pointer start = igtl::StartTrackingDataMessage::New();
  start->SetResolution(50);
  start->SetCoordinateName("Patient");
  const OpenIgtLinkMessage started = DecodeOne(Packed(start));
  EXPECT_EQ(started.kind, Kind::StartTracking);
  EXPECT_DOUBLE_EQ(started.resolutionSeconds, 0.05);
  EXPECT_EQ(started.coordinateName, "Patient");
  igtl::StopTrackingDataMessage::Pointer stop = igtl::StopTrackingDataMessage::New();
  EXPECT_EQ(DecodeOne(Packed(stop)).kind, Kind::StopTracking);
  igtl::GetStatusMessage::Pointer status = igtl::GetStatusMessage::New();
  EXPECT_EQ(DecodeOne(Packed(status)).kind, Kind::Request);
  igtl::GetImageMessage::Pointer image = igtl::GetImageMessage::New();
  const OpenIgtLinkMessage asked = DecodeOne(Packed(image));
  EXPECT_EQ(asked.kind, Kind::Request);
  EXPECT_EQ(asked.type, "GET_IMAGE");
}

TEST(OpenIgtLinkDecoder, SkipsWhatItHasNoUseFor)
{
  igtl::SensorMessage::Pointer sensor = igtl::SensorMessage::New();
  sensor->SetLength(6);
  Bytes bytes = Packed(sensor);
  const Bytes transform = LibraryTransform();
  bytes.insert(bytes.end(), transform.begin(), transform.end());
  const auto messages = Decode(bytes);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].kind, Kind::Other);
  EXPECT_EQ(messages[0].type, "SENSOR");
  EXPECT_EQ(messages[1].kind, Kind::Poses);
}

TEST(OpenIgtLinkDecoder, DoesNotCareWhereTheBytesAreCut)
{
  Bytes bytes = LibraryTransform();
  for (const Bytes& more : {LibraryImage(SomeGeometry(), 1), OpenIgtLinkEncoder().Bare("GET_STATUS"),
                            OpenIgtLinkEncoder().Bare("UNHEARDOF"), LibraryTransform("StylusToTracker")})
    bytes.insert(bytes.end(), more.begin(), more.end());
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    OpenIgtLinkDecoder decoder;
    auto messages = decoder.Feed(bytes.data(), cut);
    for (OpenIgtLinkMessage& message : decoder.Feed(bytes.data() + cut, bytes.size() - cut))
      messages.push_back(std::move(message));
    ASSERT_EQ(messages.size(), 5u) << cut;
    EXPECT_EQ(messages[0].poses.at(0).name, "ProbeToTracker");
    EXPECT_EQ(messages[1].image.voxels->size(), 120u);
    EXPECT_EQ(messages[4].poses.at(0).name, "StylusToTracker");
    EXPECT_FALSE(decoder.InMessage());
  }
  OpenIgtLinkDecoder decoder;
  std::size_t count = 0;
  for (const unsigned char& byte : bytes)
    count += decoder.Feed(&byte, 1).size();
  EXPECT_EQ(count, 5u);
}

TEST(OpenIgtLinkDecoder, ReadsMetaDataAndStatus)
{
  const Bytes plain = LibraryTransform();
  for (const std::uint16_t version : {2, 3})
    for (const bool count : {true, false})
      for (const std::size_t extended : {12, 20}) {
        Bytes text;
        const Bytes index = Index({{"TransformStatus", "OUT_OF_VIEW"}, {"Empty", ""}}, text, count);
        const OpenIgtLinkMessage read = DecodeOne(Version2(plain, index, text, version, extended));
        ASSERT_EQ(read.kind, Kind::Poses) << read.complaint;
        EXPECT_EQ(read.headerVersion, version);
        EXPECT_EQ(read.metaData.size(), 2u);
        EXPECT_EQ(read.poses.at(0).status, TransformStatus::OutOfRange);
        EXPECT_LT(Apart(read.poses[0].pose, SomePose()), 1e-5);
      }
  const std::vector<std::pair<std::string, TransformStatus>> words = {{"True", TransformStatus::Valid},
                                                                      {"1", TransformStatus::Valid},
                                                                      {"False", TransformStatus::Missing},
                                                                      {"0", TransformStatus::Missing}};
  for (const auto& [word, status] : words) {
    Bytes text;
    const Bytes index = Index({{"TransformValid", word}}, text);
    EXPECT_EQ(DecodeOne(Version2(plain, index, text)).poses.at(0).status, status) << word;
  }
  EXPECT_EQ(DecodeOne(Version2(plain, {}, {})).poses.at(0).status, TransformStatus::Valid);
}

TEST(OpenIgtLinkDecoder, RefusesMetaDataThatReachBeyondTheBody)
{
  const Bytes plain = LibraryTransform();
  Bytes text;
  const Bytes index = Index({{"TransformStatus", "OK"}}, text);
  const Bytes good = Version2(plain, index, text);
  for (const std::size_t at : {58u, 59u, 60u, 61u, 62u, 63u, 64u, 65u, 118u, 119u, 120u, 121u, 124u, 125u, 126u, 127u}) {
    for (const int value : {0, 1, 127, 255}) {
      Bytes bad = good;
      if (bad[at] == value || at >= bad.size())
        continue;
      bad[at] = static_cast<unsigned char>(value);
      SetSum(bad);
      const OpenIgtLinkMessage read = DecodeOne(bad); // whatever it is, it stays within its bytes (the sanitizers look)
      EXPECT_TRUE(read.kind == Kind::Refused || read.kind == Kind::Poses);
    }
  }
  Bytes large = good;
  large[62] = 255; // 4 GB of meta data
  SetSum(large);
  EXPECT_EQ(DecodeOne(large).kind, Kind::Refused);
}

TEST(OpenIgtLinkDecoder, PlacesImagesAsTheLibraryDoes)
{
  const ImageGeometry geometry = SomeGeometry();
  for (const bool big : {false, true}) {
    const OpenIgtLinkMessage lps =
        DecodeOne(LibraryImage(geometry, igtl::ImageMessage::COORDINATE_LPS, igtl::ImageMessage::TYPE_INT16, big));
    ASSERT_EQ(lps.kind, Kind::Image) << lps.complaint;
    EXPECT_TRUE(lps.image.geometry.AgreesWith(geometry, 1e-4));
    EXPECT_EQ(lps.image.name, "Volume");
    EXPECT_EQ(lps.image.time, Time);
    EXPECT_EQ(lps.image.type, VoxelType::Int16);
    ASSERT_EQ(lps.image.voxels->size(), 120u);
    for (int i = 0; i < 60; ++i) {
      std::int16_t number = -1;
      std::memcpy(&number, lps.image.voxels->data() + 2 * i, 2);
      ASSERT_EQ(number, i) << big;
    }
  }
  const Bytes bytes = LibraryImage(geometry, igtl::ImageMessage::COORDINATE_RAS);
  Pose turn = Pose::Identity(); // R, A, S to L, P, S
  turn.linear().diagonal() << -1, -1, 1;
  EXPECT_TRUE(DecodeOne(bytes).image.geometry.AgreesWith(geometry.Moved(turn), 1e-4));
  OpenIgtLinkDecoding asItIs;
  asItIs.turnImages = false;
  EXPECT_TRUE(DecodeOne(bytes, asItIs).image.geometry.AgreesWith(geometry, 1e-4));
}

// The middle of a volume of an even size lies between voxels. By hand: two voxels along x, 1 mm, the middle at 0.
TEST(OpenIgtLinkDecoder, PlacesTheMiddleBetweenTheVoxels)
{
  ImageGeometry geometry;
  geometry.dimensions = {2, 1, 1};
  geometry.origin << -0.5, 0, 0;
  const OpenIgtLinkMessage read = DecodeOne(LibraryImage(geometry, igtl::ImageMessage::COORDINATE_LPS));
  EXPECT_NEAR(read.image.geometry.origin[0], -0.5, 1e-6);
}

TEST(OpenIgtLinkDecoder, PlacesPartsOfImages)
{
  igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
  message->SetDimensions(8, 6, 4);
  message->SetSubVolume(3, 2, 1, 4, 1, 2);
  message->SetSpacing(2, 3, 4);
  message->SetScalarTypeToUint8();
  message->SetCoordinateSystem(igtl::ImageMessage::COORDINATE_LPS);
  message->AllocateScalars();
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  message->SetMatrix(matrix);
  std::memset(message->GetScalarPointer(), 7, 6);
  const OpenIgtLinkMessage read = DecodeOne(Packed(message));
  ASSERT_EQ(read.kind, Kind::Image) << read.complaint;
  EXPECT_EQ(read.image.geometry.dimensions, (std::array<int, 3>{3, 2, 1}));
  EXPECT_LT((read.image.geometry.origin - Eigen::Vector3d(2 * (4 - 3.5), 3 * (1 - 2.5), 4 * (2 - 1.5))).norm(), 1e-5);
  EXPECT_EQ(read.image.voxels->size(), 6u);
}

TEST(OpenIgtLinkDecoder, TurnsMirroredImagesRound)
{
  // The library's matrix with its third axis reversed: slice k lies where slice 2 - k was.
  ImageGeometry geometry = SomeGeometry();
  const Eigen::Vector3d lastSlice = geometry.IndexToWorld() * Eigen::Vector3d(0, 0, 2);
  ImageGeometry mirrored = geometry;
  mirrored.direction.col(2) *= -1.0;
  mirrored.origin = lastSlice;
  const OpenIgtLinkMessage read = DecodeOne(LibraryImage(mirrored, igtl::ImageMessage::COORDINATE_LPS));
  ASSERT_EQ(read.kind, Kind::Image) << read.complaint;
  EXPECT_TRUE(read.image.geometry.AgreesWith(geometry, 1e-4));
  std::int16_t first = -1;
  std::memcpy(&first, read.image.voxels->data(), 2);
  EXPECT_EQ(first, 40); // the first voxel of the slice that was sent last
}

TEST(OpenIgtLinkDecoder, RefusesImagesThatContradictThemselves)
{
  const Bytes good = LibraryImage(SomeGeometry(), 1);
  struct Case {
    const char* what;
    std::size_t at;
    std::vector<unsigned char> bytes;
  };
  const std::vector<Case> cases = {
      {"version", 58, {0, 9}},
      {"components", 60, {0}},
      {"more components", 60, {2}},
      {"type", 61, {9}},
      {"wider type", 61, {11}},
      {"endian", 62, {3}},
      {"axes", 63, {0}},
      {"whole", 64, {0, 4}},
      {"step is NaN", 70, {0x7f, 0xc0}},
      {"step is infinite", 70, {0x7f, 0x80, 0, 0}},
      {"offset", 118, {0, 1}},
      {"part is empty", 124, {0, 0}},
      {"part is larger", 124, {0, 6}},
      {"part is smaller", 124, {0, 4}},
      {"part is huge", 124, {255, 255, 255, 255, 255, 255}},
  };
  for (const Case& test : cases) {
    Bytes bad = good;
    std::copy(test.bytes.begin(), test.bytes.end(), bad.begin() + static_cast<std::ptrdiff_t>(test.at));
    SetSum(bad);
    const OpenIgtLinkMessage read = DecodeOne(bad);
    EXPECT_EQ(read.kind, Kind::Refused) << test.what;
    EXPECT_EQ(read.reason, Rejection::Malformed) << test.what;
    EXPECT_NE(read.complaint.find("IMAGE Volume"), std::string::npos) << read.complaint;
  }
  Bytes flat = good; // two axes the same
  std::copy(flat.begin() + 70, flat.begin() + 82, flat.begin() + 82);
  SetSum(flat);
  EXPECT_EQ(DecodeOne(flat).kind, Kind::Refused);
}

TEST(OpenIgtLinkDecoder, RefusesBodiesOfTheWrongLength)
{
  for (const char* type : {"TRANSFORM", "POSITION", "TDATA", "IMAGE", "STATUS", "STT_TDATA"})
    for (const std::size_t size : {1u, 11u, 29u, 35u, 47u, 49u, 69u, 71u}) {
      Bytes bytes(58 + size, 1);
      bytes[0] = 0;
      std::fill(bytes.begin() + 2, bytes.begin() + 34, static_cast<unsigned char>(0));
      std::memcpy(bytes.data() + 2, type, std::strlen(type));
      SetSize(bytes, size);
      SetSum(bytes);
      const OpenIgtLinkMessage read = DecodeOne(bytes);
      if (std::string(type) == "STATUS" && size >= 30)
        EXPECT_EQ(read.kind, Kind::Status);
      else
        EXPECT_EQ(read.kind, Kind::Refused) << type << " " << size;
    }
}

TEST(OpenIgtLinkDecoder, AWrongCheckSumCostsOneMessage)
{
  Bytes bytes = LibraryTransform();
  bytes[70] ^= 1;
  const Bytes good = LibraryTransform();
  Bytes both = bytes;
  both.insert(both.end(), good.begin(), good.end());
  const auto messages = Decode(both);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].kind, Kind::Refused);
  EXPECT_EQ(messages[0].reason, Rejection::Malformed);
  EXPECT_NE(messages[0].complaint.find("check sum"), std::string::npos);
  EXPECT_EQ(messages[1].kind, Kind::Poses);
  OpenIgtLinkDecoding careless;
  careless.checkSums = false;
  EXPECT_EQ(DecodeOne(bytes, careless).kind, Kind::Poses);
}

TEST(OpenIgtLinkDecoder, SkipsWhatIsTooLargeAndGoesOn)
{
  OpenIgtLinkDecoding small;
  small.imageBytes = 1024;
  ImageGeometry geometry = SomeGeometry();
  geometry.dimensions = {64, 64, 32};
  Bytes bytes = LibraryImage(geometry, 1);
  const Bytes transform = LibraryTransform();
  bytes.insert(bytes.end(), transform.begin(), transform.end());
  for (const std::size_t piece : {std::size_t{7}, bytes.size()}) {
    OpenIgtLinkDecoder decoder(small);
    std::vector<OpenIgtLinkMessage> messages;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      for (OpenIgtLinkMessage& message : decoder.Feed(bytes.data() + at, std::min(piece, bytes.size() - at)))
        messages.push_back(std::move(message));
    ASSERT_EQ(messages.size(), 2u);
    EXPECT_EQ(messages[0].reason, Rejection::TooLarge);
    EXPECT_EQ(messages[1].kind, Kind::Poses);
    EXPECT_TRUE(decoder.InStep());
  }
}

TEST(OpenIgtLinkDecoder, TakesImagesUpToTheLimit)
{
  ImageGeometry geometry = SomeGeometry();
  geometry.dimensions = {4, 4, 4};
  for (const std::uint64_t mebibytes : {1, 64, 1024, 1025, 2047}) {
    OpenIgtLinkDecoding decoding;
    decoding.imageBytes = static_cast<std::size_t>(mebibytes) << 20;
    Bytes header = LibraryImage(geometry, 1);
    header.resize(58);
    for (const std::uint64_t size : {(mebibytes << 20) + 72, (mebibytes << 20) + 65537}) { // voxels and their header; too many
      SetSize(header, size);
      OpenIgtLinkDecoder decoder(decoding);
      const auto messages = decoder.Feed(header.data(), header.size());
      if (size % 2 == 0) {
        EXPECT_TRUE(messages.empty()) << mebibytes;
      } else {
        ASSERT_EQ(messages.size(), 1u) << mebibytes;
        EXPECT_EQ(messages[0].reason, Rejection::TooLarge);
      }
      EXPECT_EQ(decoder.InStep(), size % 2 == 0 || mebibytes < 1024) << mebibytes;
    }
  }
}

TEST(OpenIgtLinkDecoder, DoesNotBelieveALengthOfTwoGigabytes)
{
  for (const std::uint64_t size : {std::uint64_t{1} << 31, std::uint64_t{1} << 63, ~std::uint64_t{0}}) {
    Bytes bytes = LibraryTransform();
    SetSize(bytes, size);
    OpenIgtLinkDecoder decoder;
    const auto messages = decoder.Feed(bytes.data(), bytes.size());
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_EQ(messages[0].reason, Rejection::TooLarge);
    EXPECT_FALSE(decoder.InStep());
    const Bytes good = LibraryTransform();
    EXPECT_TRUE(decoder.Feed(good.data(), good.size()).empty());
  }
}

TEST(OpenIgtLinkDecoder, TellsGarbage)
{
  for (const std::string& garbage : {std::string(200, '\0'), std::string(200, '\xff'),
                                     std::string("GET / HTTP/1.1\r\nHost: tracker\r\n\r\n") + std::string(100, ' '),
                                     std::string("\0\1", 2) + std::string(100, '\0')}) {
    OpenIgtLinkDecoder decoder;
    const auto messages = decoder.Feed(reinterpret_cast<const unsigned char*>(garbage.data()), garbage.size());
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_EQ(messages[0].kind, Kind::Refused);
    EXPECT_EQ(messages[0].reason, Rejection::Malformed);
    EXPECT_FALSE(decoder.InStep());
  }
}

TEST(OpenIgtLinkDecoder, NamesLimitsThatAreOutOfRange)
{
  OpenIgtLinkDecoding decoding;
  decoding.imageBytes = 10;
  EXPECT_THROW(OpenIgtLinkDecoder{decoding}, Error);
  decoding = OpenIgtLinkDecoding();
  decoding.otherBytes = std::size_t{1} << 40;
  EXPECT_THROW(OpenIgtLinkDecoder{decoding}, Error);
}

TEST(OpenIgtLinkEncoder, WritesTransformsToTheLastByteLikeTheLibrary)
{
  ToolPose pose;
  pose.name = "ProbeToTracker";
  pose.time = Time;
  pose.pose = SomePose();
  EXPECT_EQ(OpenIgtLinkEncoder().Transform(pose), LibraryTransform());
}

TEST(OpenIgtLinkEncoder, WritesTrackingDataThatTheLibraryReads)
{
  std::vector<ToolPose> poses(3);
  for (int i = 0; i < 3; ++i) {
    poses[static_cast<std::size_t>(i)].name = i == 2   ? "AVeryLongToolNameToTracker"
                                              : i == 1 ? "ReferenceToTracker"
                                                       : "ProbeToTracker";
    poses[static_cast<std::size_t>(i)].time = Time;
    poses[static_cast<std::size_t>(i)].pose = SomePose(0.3 * (i + 1));
  }
  poses[1].status = TransformStatus::Missing;
  const Bytes bytes = OpenIgtLinkEncoder().TrackingData(poses);
  const auto message = Unpacked<igtl::TrackingDataMessage>(bytes);
  ASSERT_EQ(message->GetNumberOfTrackingDataElements(), 2);
  igtl::TrackingDataElement::Pointer element;
  message->GetTrackingDataElement(1, element);
  EXPECT_STREQ(element->GetName(), "AVeryLongToolName");
  EXPECT_EQ(element->GetType(), igtl::TrackingDataElement::TYPE_6D);
  igtl::Matrix4x4 matrix;
  element->GetMatrix(matrix);
  EXPECT_LT(Apart(FromLibrary(matrix), poses[2].pose), 1e-5);
  EXPECT_EQ(DecodeOne(bytes).poses.at(1).name, "AVeryLongToolNameToTracker");
}

TEST(OpenIgtLinkEncoder, WritesImagesThatTheLibraryReads)
{
  const StreamedImage image = SomeImage();
  for (const bool turn : {true, false}) {
    const Bytes bytes = OpenIgtLinkEncoder().Image(image, turn);
    const auto message = Unpacked<igtl::ImageMessage>(bytes);
    EXPECT_EQ(message->GetCoordinateSystem(), igtl::ImageMessage::COORDINATE_RAS);
    EXPECT_EQ(message->GetScalarType(), igtl::ImageMessage::TYPE_INT16);
    int size[3], part[3], offset[3];
    message->GetDimensions(size);
    message->GetSubVolume(part, offset);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(size[axis], image.geometry.dimensions[static_cast<std::size_t>(axis)]);
      EXPECT_EQ(part[axis], size[axis]);
      EXPECT_EQ(offset[axis], 0);
    }
    // What the library calls its matrix: the axes, unscaled in version 1.11 or not, and the middle.
    float spacing[3];
    message->GetSpacing(spacing);
    igtl::Matrix4x4 matrix;
    message->GetMatrix(matrix);
    const Pose place = FromLibrary(matrix);
    const Eigen::Vector3d sign = turn ? Eigen::Vector3d(-1, -1, 1) : Eigen::Vector3d(1, 1, 1);
    EXPECT_LT((place.translation() - sign.cwiseProduct(image.geometry.Centre())).norm(), 1e-4);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(static_cast<double>(spacing[axis]), image.geometry.spacing[axis], 1e-5);
      const Eigen::Vector3d direction = place.linear().col(axis).normalized();
      EXPECT_LT((direction - sign.cwiseProduct(image.geometry.direction.col(axis))).norm(), 1e-5);
    }
    EXPECT_EQ(std::memcmp(message->GetScalarPointer(), image.voxels->data(), image.voxels->size()), 0);
  }
  const OpenIgtLinkMessage back = DecodeOne(OpenIgtLinkEncoder(2).Image(image));
  EXPECT_TRUE(back.image.geometry.AgreesWith(image.geometry, 1e-4));
  EXPECT_EQ(*back.image.voxels, *image.voxels);
}

TEST(OpenIgtLinkEncoder, WritesEveryTypeOfVoxelThatThereIs)
{
  for (const VoxelType type : {VoxelType::Int8, VoxelType::UInt8, VoxelType::Int16, VoxelType::UInt16, VoxelType::Int32,
                               VoxelType::UInt32, VoxelType::Float32, VoxelType::Float64}) {
    StreamedImage image = SomeImage();
    image.type = type;
    image.components = 2;
    auto voxels = std::make_shared<Bytes>(image.geometry.VoxelCount() * SizeOf(type) * 2);
    std::iota(voxels->begin(), voxels->end(), static_cast<unsigned char>(0));
    image.voxels = voxels;
    const OpenIgtLinkMessage back = DecodeOne(OpenIgtLinkEncoder().Image(image));
    ASSERT_EQ(back.kind, Kind::Image) << back.complaint;
    EXPECT_EQ(back.image.type, type);
    EXPECT_EQ(back.image.components, 2);
    EXPECT_EQ(*back.image.voxels, *voxels);
  }
}

TEST(OpenIgtLinkEncoder, RefusesImagesThatCannotBeSent)
{
  const auto complaint = [](const StreamedImage& image) {
    try {
      OpenIgtLinkEncoder().Image(image);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  StreamedImage image = SomeImage();
  image.type = VoxelType::Int64;
  EXPECT_NE(complaint(image).find("64-bit"), std::string::npos);
  image = SomeImage();
  image.voxels.reset();
  EXPECT_NE(complaint(image).find("Volume"), std::string::npos);
  image = SomeImage();
  image.geometry.dimensions = {70000, 1, 1};
  EXPECT_NE(complaint(image).find("65535"), std::string::npos);
  image = SomeImage();
  image.geometry.dimensions = {2048, 2048, 2048};
  EXPECT_NE(complaint(image).find("2 GiB"), std::string::npos);
  image = SomeImage();
  image.geometry.spacing[1] = 0.0;
  EXPECT_NE(complaint(image).find("spacing"), std::string::npos);
  image = SomeImage();
  image.name = "a name of more than twenty bytes";
  EXPECT_NE(complaint(image).find("20 bytes"), std::string::npos);
  image = SomeImage();
  image.components = 0;
  EXPECT_FALSE(complaint(image).empty());
}

TEST(OpenIgtLinkEncoder, SaysTheStatusInMetaData)
{
  ToolPose pose;
  pose.name = "ProbeToTracker";
  pose.time = Time;
  for (const TransformStatus status : {TransformStatus::Valid, TransformStatus::Missing, TransformStatus::OutOfRange}) {
    pose.status = status;
    const OpenIgtLinkMessage read = DecodeOne(OpenIgtLinkEncoder(2).Transform(pose));
    EXPECT_EQ(read.headerVersion, 2);
    EXPECT_EQ(read.poses.at(0).status, status);
    EXPECT_EQ(read.metaData.at("TransformValid"), status == TransformStatus::Valid ? "True" : "False");
  }
}

TEST(OpenIgtLinkEncoder, WritesStatusAndRequestsThatTheLibraryReads)
{
  const auto status = Unpacked<igtl::StatusMessage>(OpenIgtLinkEncoder().Status(13, "not yet"));
  EXPECT_EQ(status->GetCode(), 13);
  EXPECT_STREQ(status->GetStatusString(), "not yet");
  const auto start = Unpacked<igtl::StartTrackingDataMessage>(OpenIgtLinkEncoder().StartTrackingData(0.02, "Patient"));
  EXPECT_EQ(start->GetResolution(), 20);
  EXPECT_STREQ(start->GetCoordinateName(), "Patient");
  EXPECT_EQ(Unpacked<igtl::RTSTrackingDataMessage>(OpenIgtLinkEncoder().TrackingReply(true))->GetStatus(), 0);
}

TEST(OpenIgtLinkEncoder, FitsNamesOrSaysThatTheyDoNot)
{
  EXPECT_EQ(OpenIgtLinkEncoder::WireName("ProbeToTracker"), "ProbeToTracker");
  EXPECT_EQ(OpenIgtLinkEncoder::WireName("TwentyBytesToTracker"), "TwentyBytesToTracker");
  EXPECT_EQ(OpenIgtLinkEncoder::WireName("FixedReferenceToTracker"), "FixedReference");
  EXPECT_EQ(ToolTransformName("FixedReference"), "FixedReferenceToTracker");
  EXPECT_EQ(OpenIgtLinkEncoder::WireName("FixedReferenceToStylusTip"), "");
  EXPECT_EQ(OpenIgtLinkEncoder::WireName("ThisOneIsFarTooLongToBeTrueToTracker"), "");
}
