// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ToolPose.h"
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/PoseStream.h"
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// What a decoder takes.
struct OpenIgtLinkDecoding {
  std::size_t imageBytes = std::size_t{64} << 20, otherBytes = std::size_t{1} << 20;
  bool checkSums = true, turnImages = true;
};
ParameterList Describe(OpenIgtLinkDecoding& p);

/// One message, checked and taken apart.
struct OpenIgtLinkMessage {
  enum class Kind {
    Poses, ///< TRANSFORM, TDATA, POSITION
    Image,
    Status,
    StartTracking, ///< STT_TDATA: the peer asks for TDATA
    StopTracking,  ///< STP_TDATA
    Request,       ///< GET_...: the peer asks for what the rest of the word says
    Other,         ///< well formed, and of no use to us; it was skipped
    Refused,       ///< see reason and complaint
  };
  Kind kind = Kind::Other;
  std::string type;                                       ///< "TRANSFORM"
  std::string device;                                     ///< the name in the header
  int headerVersion = 1;                                  ///< 2 and 3 have meta data
  double time = std::numeric_limits<double>::quiet_NaN(); ///< seconds on the sender's clock; NaN: its stamp is zero
  std::map<std::string, std::string> metaData;

  std::vector<ToolPose> poses; ///< matrices as they came, in single precision: PoseStream tells whether they are rigid
  StreamedImage image;
  int statusCode = 0; ///< 1: all is well
  std::string statusText;
  double resolutionSeconds = 0.0; ///< of StartTracking: the shortest time between two poses of a tool; 0: all of them
  std::string coordinateName;     ///< of StartTracking

  Rejection reason = Rejection::Malformed;
  std::string complaint; ///< a sentence
};

/// OpenIGTLink's bytes to messages, in whatever pieces they come. No I/O, no clock.
///
/// Header versions 1, 2 and 3. The length in a header is believed up to the limits only: longer messages up to 1 GiB are
/// skipped as they come, without being held, and count as TooLarge; beyond that and the limits, the stream cannot be what it
/// says. A wrong check sum, or a body that contradicts itself, costs that message (Malformed). After a header that is none, the
/// decoder is out of step for good and takes nothing more: TCP neither loses nor reorders, so such a peer never spoke OpenIGTLink
/// or has stopped in the middle of a message, and where the next one begins could only be guessed. The connection should be
/// closed.
class OpenIgtLinkDecoder {
public:
  explicit OpenIgtLinkDecoder(const OpenIgtLinkDecoding& decoding = {});

  /// Takes the next bytes. \returns the messages that they complete, in order
  std::vector<OpenIgtLinkMessage> Feed(const unsigned char* bytes, std::size_t size);

  /// Whether it still knows where messages begin.
  bool InStep() const { return inStep_; }
  /// Whether bytes of a message that is not complete are there.
  bool InMessage() const { return !header_.empty(); }

private:
  OpenIgtLinkMessage Begin();
  OpenIgtLinkMessage Finish();

  OpenIgtLinkDecoding decoding_;
  bool inStep_ = true;
  std::vector<unsigned char> header_, body_;
  OpenIgtLinkMessage message_;                      // what the header says
  std::uint64_t bodySize_ = 0, skip_ = 0, sum_ = 0; // of the message whose header is complete
};

} // namespace echorama
