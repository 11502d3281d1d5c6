// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a pose packet: once as they are, once with the check sum put right, which no fuzzer would guess. What is accepted
// must be written again, to the same packet.
#include "Testing/Fuzzing.h"
#include "Tracking/Devices/PosePacket.h"

using namespace echorama;

namespace {

void Try(const std::vector<unsigned char>& bytes)
{
  PosePacket packet, again;
  if (!DecodePosePacket(bytes.data(), bytes.size(), packet).empty())
    return;
  const std::vector<unsigned char> written = EncodePosePacket(packet, (bytes[6] & 1) != 0); // throws: a finding
  if (!DecodePosePacket(written.data(), written.size(), again).empty() || again.poses.size() != packet.poses.size() ||
      again.session != packet.session || again.sequence != packet.sequence || again.time != packet.time)
    std::abort();
  for (std::size_t i = 0; i < packet.poses.size(); ++i)
    if (again.poses[i].name != packet.poses[i].name || again.poses[i].status != packet.poses[i].status ||
        !packet.poses[i].pose.matrix().allFinite() || !IsRotation(packet.poses[i].pose.linear(), 1e-9))
      std::abort();
}

std::uint32_t Crc(const unsigned char* bytes, std::size_t count)
{
  std::uint32_t crc = 0xffffffffu;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit)
      crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return ~crc;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  std::vector<unsigned char> bytes(data, data + size);
  Try(bytes);
  if (size < 4)
    return 0;
  const std::uint32_t sum = Crc(bytes.data(), size - 4);
  for (std::size_t i = 0; i < 4; ++i)
    bytes[size - 4 + i] = static_cast<unsigned char>(sum >> (8 * i));
  Try(bytes);
  return 0;
}
