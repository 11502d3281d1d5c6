// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as what a Polhemus sends, in any form that it may have been told: the first byte chooses it. Every record must be a
// pose within reach, of a station that is there; and how the bytes are cut into pieces must make no difference.
#include "Testing/Fuzzing.h"
#include "Tracking/Devices/PolhemusDecoder.h"
#include <algorithm>
#include <cstdlib>

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  if (size == 0)
    return 0;
  PolhemusSpeech speech;
  speech.format = data[0] & 1 ? PolhemusFormat::Ascii : PolhemusFormat::Binary;
  speech.model = data[0] & 2 ? PolhemusModel::Liberty : PolhemusModel::Patriot;
  const bool distortion = (data[0] & 4) != 0;
  speech.layout = data[0] & 8 ? PolhemusTwofold(distortion) : data[0] & 16 ? PolhemusSingle(distortion) : PolhemusBare();
  speech.stations = data[0] & 32 ? 3 : 2;
  ++data;
  --size;

  PolhemusDecoder whole(speech), pieces(speech);
  const std::vector<PolhemusRecord> records = whole.Take(data, size);
  std::vector<PolhemusRecord> again;
  std::size_t piece = 1;
  for (std::size_t at = 0; at < size; at += piece, piece = 1 + (7 * piece + data[at % size]) % 61) {
    piece = std::min(piece, size - at);
    for (const PolhemusRecord& record : pieces.Take(data + at, piece))
      again.push_back(record);
  }
  if (again.size() != records.size() || pieces.Malformed() != whole.Malformed())
    std::abort();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PolhemusRecord& record = records[i];
    if (record.station < 1 || (speech.stations >> (record.station - 1) & 1) == 0 || record.station != again[i].station ||
        !record.pose.matrix().allFinite() || !IsRotation(record.pose.linear(), 1e-9) ||
        record.pose.translation().norm() > 3.0 * speech.rangeMm || record.pose.matrix() != again[i].pose.matrix())
      std::abort();
  }

  std::string bytes(reinterpret_cast<const char*>(data), size);
  while (TakePolhemusReply(bytes, 0x16)) {
  }
  return 0;
}
