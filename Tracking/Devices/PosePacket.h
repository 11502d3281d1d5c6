// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ToolPose.h"
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// Poses of one moment, as one UDP datagram. Numbers are little endian, positions mm.
///
/// | bytes            | what                                                                                     |
/// | ---------------- | ---------------------------------------------------------------------------------------- |
/// | 0 - 3            | "EPPK"                                                                                   |
/// | 4, 5             | version, 16 bits: 1                                                                      |
/// | 6, 7             | flags, 16 bits: 1 = the numbers of poses are doubles, else floats; all others 0          |
/// | 8 - 15           | session: a number that the sender draws when it starts; not 0                            |
/// | 16 - 23          | sequence: counts up from any number with every packet of the session                     |
/// | 24 - 31          | time, double: seconds on the sender's clock                                              |
/// | 32, 33           | number of poses, 16 bits, 1 to MostPoses                                                 |
/// | then, for each   | length of the name (1 byte, 1 to 64), the name (printable UTF-8), status (1 byte:      |
/// |                  | 0 valid, 1 missing, 2 out of range), x, y, z, and the unit quaternion qw, qx, qy, qz     |
/// | the last 4       | CRC-32 (that of zlib, gzip and PNG) of all bytes before it                               |
///
/// The numbers of a pose that is missing are 0, but for qw, which is 1.
struct PosePacket {
  static constexpr std::size_t MostBytes = 1400; ///< fits the frames of every usual network: never torn apart on its way
  static constexpr std::size_t MostPoses = 32;
  static constexpr std::size_t LongestName = 64;

  std::uint64_t session = 0, sequence = 0;
  double time = 0.0;
  std::vector<ToolPose> poses; ///< their own times are those of the packet; arrival is not sent
};

/// \throws Error(InvalidParameter) when that does not make a packet: session 0, a time that is not finite, no poses, too many, or
/// two of one name, a name that is empty, too long or not printable UTF-8, a pose that is not finite or not rigid, more bytes
/// than MostBytes.
std::vector<unsigned char> EncodePosePacket(const PosePacket& packet, bool doubles = true);

/// The packet in \a bytes. \returns what is wrong, as a sentence, else nothing: then \a packet holds what EncodePosePacket would
/// accept, and each pose has the packet's time. Never throws, never reads beyond \a count.
std::string DecodePosePacket(const unsigned char* bytes, std::size_t count, PosePacket& packet);

/// Which packets of a stream are taken: those of one session, in rising order.
///
/// The first session that is heard is kept. Packets of another are foreign until the kept one has been silent for \a silence
/// seconds; then the next that is heard is kept, and sessions that were kept before stay foreign for good (of the last 64):
/// their packets can only be recordings.
class PosePacketOrder {
public:
  enum class Verdict { New, Replayed, Foreign };

  explicit PosePacketOrder(double silence) : silence_(silence) {}
  Verdict Judge(const PosePacket& packet, double arrival);

private:
  double silence_;
  std::uint64_t session_ = 0, sequence_ = 0;
  double last_ = 0.0;
  std::vector<std::uint64_t> over_;
};

} // namespace echorama
