// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/PoseStream.h"
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace echorama {

struct OpenIgtLinkServerParameters {
  std::string host = "127.0.0.1";
  int port = 18944;
  std::size_t clients = 16;
  std::size_t queuedBytes = std::size_t{1} << 20; ///< 5 s of 8 tools at 250 Hz
  std::size_t rememberedImages = 4;
  bool turnImages = true; ///< see OpenIgtLinkEncoder::Image
};
ParameterList Describe(OpenIgtLinkServerParameters& p);

struct OpenIgtLinkServerStatistics {
  std::size_t clients = 0;      ///< now
  std::uint64_t accepted = 0;   ///< so far
  std::uint64_t turnedAway = 0; ///< as there were too many
  std::uint64_t sent = 0;       ///< messages that went out whole, over all clients
  std::uint64_t dropped = 0;    ///< messages that slow clients did not take in time, and images that a newer one replaced
  std::uint64_t lost = 0;       ///< poses that this server itself did not take in time
  std::uint64_t unnameable = 0; ///< poses whose names do not fit into OpenIGTLink's 20 bytes
  std::uint64_t refused = 0;    ///< messages of clients that were malformed or too large
  std::string lastEvent;        ///< a sentence about the newest client that came or went, or was refused
};

/// Gives the poses of a stream, and images, to any number of OpenIGTLink clients: 3D Slicer, Plus, ourselves.
///
/// Every pose goes to every client as TRANSFORM, or as TDATA (with the resolution asked for) to those that sent STT_TDATA, until
/// STP_TDATA. Poses that are not valid go only to clients that have shown header version 2, with the meta data TransformStatus
/// and TransformValid; others do not get them, which is how Plus does it. GET_TRANS, GET_IMAGE and GET_STATUS are answered.
/// A client that does not read loses the oldest messages, and holds up nobody. A client that sends what is no OpenIGTLink is
/// disconnected.
class OpenIgtLinkServer {
public:
  /// \throws Error(InvalidParameter) for what is out of its range.
  explicit OpenIgtLinkServer(const OpenIgtLinkServerParameters& parameters = {});
  ~OpenIgtLinkServer();
  OpenIgtLinkServer(const OpenIgtLinkServer&) = delete;
  OpenIgtLinkServer& operator=(const OpenIgtLinkServer&) = delete;

  /// Listens, and serves what \a poses gets from now on (nullptr: only what Send is given). \throws Error(FileSystem) when
  /// the port is taken.
  void Start(PoseStream* poses = nullptr);
  /// Ends within a quarter of a second; what waits to be sent is lost, see Flush.
  void Stop();
  bool Running() const;
  int Port() const; ///< where it listens; 0 before Start()

  /// To every client, and to those that come later on GET_TRANS. \throws Error(InvalidParameter) when the name is too long.
  void Send(const ToolPose& pose);
  /// To every client, and to those that come later. \throws Error as OpenIgtLinkEncoder::Image.
  void SendImage(const StreamedImage& image);

  /// Waits for up to \a seconds until everything that had come before has been handed to the system. \returns whether it has;
  /// false when it is not started
  bool Flush(double seconds) const;
  /// Waits for up to \a seconds until there is a client. \returns whether there is
  bool WaitForClient(double seconds) const;
  OpenIgtLinkServerStatistics Statistics() const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
