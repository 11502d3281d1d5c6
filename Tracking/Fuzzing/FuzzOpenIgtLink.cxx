// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as what an OpenIGTLink peer sends, in pieces; what is accepted goes into a stream, and out and in again. The first
// byte says how: the size of the pieces, and whether check sums are looked at (nobody guesses one).
#include "Testing/Fuzzing.h"
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include <algorithm>

using namespace echorama;

namespace {

void Again(const OpenIgtLinkMessage& message)
{
  using Kind = OpenIgtLinkMessage::Kind;
  const OpenIgtLinkEncoder encoder(message.headerVersion);
  std::vector<unsigned char> bytes;
  if (message.kind == Kind::Image) {
    const StreamedImage& image = message.image;
    image.geometry.Check(image.name); // what was accepted is a geometry
    if (image.voxels->size() != image.geometry.VoxelCount() * static_cast<std::size_t>(image.components) * SizeOf(image.type))
      std::abort();
    bytes = encoder.Image(image);
  } else if (message.kind == Kind::Poses && !message.poses.empty()) {
    bytes = message.type == "TDATA" ? encoder.TrackingData(message.poses) : encoder.Transform(message.poses[0]);
  } else {
    return;
  }
  OpenIgtLinkDecoder decoder;
  const auto read = decoder.Feed(bytes.data(), bytes.size());
  if (read.size() != 1 || read[0].kind != message.kind)
    std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  if (size == 0)
    return 0;
  OpenIgtLinkDecoding decoding;
  decoding.imageBytes = decoding.otherBytes = 1 << 16;
  decoding.checkSums = (data[0] & 0x80) != 0;
  decoding.turnImages = (data[0] & 0x40) != 0;
  const std::size_t piece = 1 + (data[0] & 0x3f) * std::size_t{37};
  OpenIgtLinkDecoder decoder(decoding);
  PoseStream poses;
  for (std::size_t at = 1; at < size; at += piece)
    for (const OpenIgtLinkMessage& message : decoder.Feed(data + at, std::min(piece, size - at))) {
      for (const ToolPose& pose : message.poses)
        poses.Add(pose);
      Again(message);
    }
  return 0;
}
