// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/OpenIgtLinkReceiver.h"
#include "Core/Base/Error.h"
#include "Core/Base/Utf8.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Tracking/Stream/Clock.h"

namespace echorama {
namespace {

constexpr std::size_t LongestComplaint = 512; // bytes: a peer may send anything, and it is shown
constexpr double Silence = 2.0;               // s, after which a tool's peer may have gone without a word

} // namespace

bool ToolOwners::Owns(const OpenIgtLinkReceiver* peer, const std::string& tool, double now)
{
  if (owners_.size() >= MostTools && owners_.count(tool) == 0)
    return true; // the stream takes no more tools
  Owner& owner = owners_.try_emplace(tool, Owner{peer, now}).first->second;
  if (owner.peer != peer && now - owner.last < Silence)
    return false;
  owner = {peer, now};
  return true;
}

void ToolOwners::Forget(const OpenIgtLinkReceiver* peer)
{
  for (auto owner = owners_.begin(); owner != owners_.end();)
    owner = owner->second.peer == peer ? owners_.erase(owner) : std::next(owner);
}

bool OpenIgtLinkReceiver::Serve(PoseStream& poses, ImageStream* images, ToolOwners* owners)
{
  unsigned char bytes[65536];
  for (int piece = 0; piece < 64; ++piece) { // then others have their turn, and a stop is seen
    const auto size = socket_.Receive(bytes, sizeof bytes);
    if (!size) {
      end_ = socket_.EndReason();
      if (decoder_.InMessage()) {
        end_ += " in the middle of a message";
        poses.Reject(Rejection::Malformed, socket_.Peer() + ": " + end_);
      }
      return false;
    }
    if (*size == 0)
      break;
    const double arrival = ClockNow();
    for (OpenIgtLinkMessage& message : decoder_.Feed(bytes, *size))
      Take(std::move(message), arrival, poses, images, owners);
    if (!decoder_.InStep()) {
      end_ = "it does not speak OpenIGTLink, or has lost the thread";
      return false;
    }
    if (*size < sizeof bytes)
      break;
  }
  if (!replies_.Flush(socket_)) {
    end_ = socket_.EndReason();
    return false;
  }
  return true;
}

void OpenIgtLinkReceiver::Take(OpenIgtLinkMessage message, double arrival, PoseStream& poses, ImageStream* images,
                               ToolOwners* owners)
{
  using Kind = OpenIgtLinkMessage::Kind;
  switch (message.kind) {
  case Kind::Poses:
    for (ToolPose& pose : message.poses) {
      pose.arrival = arrival;
      if (owners && !owners->Owns(this, pose.name, arrival))
        poses.Reject(Rejection::Foreign, socket_.Peer() + ": another peer sends " + pose.name + " already");
      else
        poses.Add(std::move(pose));
    }
    break;
  case Kind::Image:
    if (images) {
      message.image.arrival = arrival;
      images->Add(std::move(message.image));
    }
    break;
  case Kind::Status:
    complaint_ = message.statusCode == 1 ? ""
                                         : "status " + std::to_string(message.statusCode) + " " +
                                               Printable(std::string_view(message.statusText).substr(0, LongestComplaint));
    break;
  case Kind::Request:
    if (message.type == "GET_STATUS")
      replies_.Push(
          std::make_shared<const std::vector<unsigned char>>(OpenIgtLinkEncoder(message.headerVersion).Status(1, "receiving")));
    break;
  case Kind::Refused:
    poses.Reject(message.reason, socket_.Peer() + ": " + message.complaint);
    break;
  default:
    break;
  }
}

OpenIgtLinkDecoding OpenIgtLinkDecodingOf(const TrackerAddress& address, ParameterList others)
{
  OpenIgtLinkDecoding decoding;
  enum class Axes { Sender, Patient } axes = Axes::Patient;
  int megabytes = static_cast<int>(decoding.imageBytes >> 20);
  address.Set(
      Join({Without(Describe(decoding), {"TurnImages", "ImageBytes", "OtherBytes"}),
            {Parameter("Axes", Choice(axes, {"sender", "patient"}),
                       "Whether the numbers of images stay as they are, and match those of the poses, or become L, P, S."),
             Parameter("ImageMb", megabytes, {1, 2047}, "MiB", "Largest image.")},
            std::move(others)}));
  decoding.turnImages = axes == Axes::Patient;
  decoding.imageBytes = static_cast<std::size_t>(megabytes) << 20;
  return decoding;
}

} // namespace echorama
