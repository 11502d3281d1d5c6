// SPDX-License-Identifier: BSD-3-Clause
// One thread. It sleeps on the subscription to the poses, so that a pose leaves as soon as it has come, and looks at its sockets
// at least every five milliseconds, which is soon enough for clients that come or ask, or read slowly. Messages are encoded
// once per header version, whatever the number of clients.
#include "Tracking/Devices/OpenIgtLinkServer.h"
#include "Core/Base/Error.h"
#include "Core/Base/Worker.h"
#include "Tracking/Devices/OpenIgtLinkDecoder.h"
#include "Tracking/Devices/OpenIgtLinkEncoder.h"
#include "Tracking/Devices/TcpSocket.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <deque>
#include <list>
#include <map>
#include <mutex>
#include <set>

namespace echorama {
namespace {

using SharedBytes = SendQueue::Bytes;

constexpr double LookAround = 0.005;     // s
constexpr std::size_t MostTools = 4096;  // whose newest poses are remembered
constexpr std::size_t MostGiven = 65536; // poses

SharedBytes Shared(OpenIgtLinkEncoder::Bytes bytes)
{
  return std::make_shared<const std::vector<unsigned char>>(std::move(bytes));
}

OpenIgtLinkDecoding SmallMessages()
{
  OpenIgtLinkDecoding decoding;
  decoding.imageBytes = 1024; // images of clients are of no use here; they are skipped
  return decoding;
}

struct Client {
  Client(TcpSocket connection, const OpenIgtLinkServerParameters& parameters)
    : socket(std::move(connection)), decoder(SmallMessages()), queue(parameters.queuedBytes, parameters.rememberedImages)
  {
  }

  enum class Wants { Transforms, TrackingData, Nothing };

  TcpSocket socket;
  OpenIgtLinkDecoder decoder;
  SendQueue queue;
  int headerVersion = 1; // the highest it has shown
  Wants wants = Wants::Transforms;
  double resolution = 0.0;
  std::map<std::string, double> lastTimes; // of the tools, with TDATA
  std::vector<ToolPose> together;          // of one time, for the next TDATA
  std::set<std::string> asked;             // whose newest pose it has asked for in this turn; "": all
};

} // namespace

struct OpenIgtLinkServer::Parts {
  OpenIgtLinkServerParameters parameters;
  TcpSocket listener;
  std::shared_ptr<PoseSubscription> subscription;
  Worker worker;

  mutable std::mutex mutex; // guards what follows
  std::deque<ToolPose> given;
  std::uint64_t givenLost = 0;
  struct NamedImage {
    std::string name;
    SharedBytes bytes;
  };
  std::list<NamedImage> images; // the newest of each name, the oldest first
  std::vector<NamedImage> newImages;
  OpenIgtLinkServerStatistics statistics;
  // Who wants to know when everything has gone draws the next number; whatever was there when a turn began and its last number
  // was read has gone when nothing is left at the end of one.
  std::uint64_t asked = 0, flushed = 0;

  // The thread's own.
  std::list<Client> clients;
  std::map<std::string, ToolPose> newest;
  std::uint64_t sentByGone = 0, droppedByGone = 0;

  void Run(const Worker::Signal& signal);
  void Accept();
  void Serve(const std::vector<ToolPose>& poses);
  void Collect(Client& client, const ToolPose& pose);
  void SendTogether(Client& client);
  bool Listen(Client& client); // to what it says, and answers; false when it must go
  bool Hear(Client& client);
  void Answer(Client& client, const OpenIgtLinkMessage& message);
  void Event(const std::string& text)
  {
    const std::lock_guard<std::mutex> lock(mutex);
    statistics.lastEvent = text;
  }
};

void OpenIgtLinkServer::Parts::Run(const Worker::Signal& signal)
{
  while (!signal.Stopped()) {
    std::uint64_t ticket = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      ticket = asked;
    }
    std::vector<ToolPose> poses;
    if (subscription)
      poses = subscription->Take(LookAround);
    else
      WaitForSockets({}, {}, LookAround);
    std::vector<NamedImage> fresh;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      poses.insert(poses.end(), given.begin(), given.end());
      given.clear();
      fresh.swap(newImages);
    }
    for (Client& client : clients)
      for (const NamedImage& image : fresh)
        client.queue.PushNewest(image.name, image.bytes);
    Accept(); // after the new images: newcomers get all that are remembered
    Serve(poses);

    bool nothingWaits = true;
    std::uint64_t sent = sentByGone, dropped = droppedByGone;
    for (auto client = clients.begin(); client != clients.end();) {
      const bool stays = Listen(*client) && client->queue.Flush(client->socket);
      if (stays) {
        nothingWaits = nothingWaits && client->queue.Empty();
        sent += client->queue.Sent();
        dropped += client->queue.Dropped();
        ++client;
        continue;
      }
      if (!client->socket.EndReason().empty())
        Event(client->socket.Peer() + ": " + client->socket.EndReason());
      sentByGone += client->queue.Sent();
      droppedByGone += client->queue.Dropped();
      sent += client->queue.Sent();
      dropped += client->queue.Dropped();
      client = clients.erase(client);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    statistics.clients = clients.size();
    statistics.sent = sent;
    statistics.dropped = dropped;
    statistics.lost = givenLost + (subscription ? subscription->Lost() : 0);
    if (nothingWaits)
      flushed = ticket;
  }
  clients.clear();
  const std::lock_guard<std::mutex> lock(mutex);
  statistics.clients = 0;
}

void OpenIgtLinkServer::Parts::Accept()
{
  while (true) {
    TcpSocket socket = listener.Accept();
    if (!socket.IsOpen())
      return;
    const std::string peer = socket.Peer();
    const bool room = clients.size() < parameters.clients;
    if (room)
      clients.emplace_back(std::move(socket), parameters);
    const std::lock_guard<std::mutex> lock(mutex);
    ++(room ? statistics.accepted : statistics.turnedAway);
    statistics.lastEvent = peer + (room ? ": connected" : ": turned away, as there are too many");
    if (room)
      for (const NamedImage& image : images)
        clients.back().queue.PushNewest(image.name, image.bytes);
  }
}

void OpenIgtLinkServer::Parts::Serve(const std::vector<ToolPose>& poses)
{
  for (const ToolPose& pose : poses) {
    if (OpenIgtLinkEncoder::WireName(pose.name).empty()) {
      const std::lock_guard<std::mutex> lock(mutex);
      ++statistics.unnameable;
      continue;
    }
    if (newest.size() < MostTools || newest.count(pose.name) > 0)
      newest[pose.name] = pose;
    SharedBytes plain, marked; // by header version
    for (Client& client : clients) {
      if (client.wants == Client::Wants::TrackingData) {
        Collect(client, pose);
      } else if (client.wants == Client::Wants::Transforms) {
        const bool knowsStatus = client.headerVersion >= 2;
        if (pose.status != TransformStatus::Valid && !knowsStatus)
          continue;
        SharedBytes& bytes = knowsStatus ? marked : plain;
        if (!bytes)
          bytes = Shared(OpenIgtLinkEncoder(knowsStatus ? 2 : 1).Transform(pose));
        client.queue.Push(bytes);
      }
    }
  }
  for (Client& client : clients)
    SendTogether(client);
}

// A TDATA has one time for all its tools, so only what was measured together goes together.
void OpenIgtLinkServer::Parts::Collect(Client& client, const ToolPose& pose)
{
  if (pose.status != TransformStatus::Valid)
    return;
  const auto last = client.lastTimes.find(pose.name);
  const double since = last == client.lastTimes.end() ? client.resolution : pose.time - last->second;
  if (since >= 0.0 && since < client.resolution * (1.0 - 1e-6)) // after a jump back of the clock it goes on
    return;
  if (client.lastTimes.size() < MostTools || last != client.lastTimes.end())
    client.lastTimes[pose.name] = pose.time;
  if (!client.together.empty() && client.together[0].time != pose.time)
    SendTogether(client);
  client.together.push_back(pose);
}

void OpenIgtLinkServer::Parts::SendTogether(Client& client)
{
  if (client.together.empty())
    return;
  client.queue.Push(Shared(OpenIgtLinkEncoder(client.headerVersion).TrackingData(client.together)));
  client.together.clear();
}

bool OpenIgtLinkServer::Parts::Listen(Client& client)
{
  const bool stays = Hear(client);
  if (!client.asked.empty() && stays) { // once, however often it asks: others wait meanwhile
    const OpenIgtLinkEncoder encoder(client.headerVersion);
    for (const auto& [name, pose] : newest)
      if ((client.asked.count("") > 0 || client.asked.count(OpenIgtLinkEncoder::WireName(name)) > 0) &&
          (pose.status == TransformStatus::Valid || client.headerVersion >= 2))
        client.queue.Push(Shared(encoder.Transform(pose)));
  }
  client.asked.clear();
  return stays;
}

bool OpenIgtLinkServer::Parts::Hear(Client& client)
{
  unsigned char bytes[16384];
  for (int piece = 0; piece < 16; ++piece) { // then the others
    const auto size = client.socket.Receive(bytes, sizeof bytes);
    if (!size)
      return false;
    if (*size == 0)
      return true;
    for (const OpenIgtLinkMessage& message : client.decoder.Feed(bytes, *size))
      Answer(client, message);
    if (!client.decoder.InStep()) {
      Event(client.socket.Peer() + ": does not speak OpenIGTLink; disconnected");
      return false;
    }
  }
  return true;
}

void OpenIgtLinkServer::Parts::Answer(Client& client, const OpenIgtLinkMessage& message)
{
  using Kind = OpenIgtLinkMessage::Kind;
  if (message.kind == Kind::Refused) {
    const std::lock_guard<std::mutex> lock(mutex);
    ++statistics.refused;
    statistics.lastEvent = client.socket.Peer() + ": " + message.complaint;
    return;
  }
  client.headerVersion = std::max(client.headerVersion, std::min(message.headerVersion, 2));
  const OpenIgtLinkEncoder encoder(client.headerVersion);
  if (message.kind == Kind::StartTracking) {
    client.wants = Client::Wants::TrackingData;
    client.resolution = message.resolutionSeconds;
    client.lastTimes.clear();
    client.queue.Push(Shared(encoder.TrackingReply(true)));
  } else if (message.kind == Kind::StopTracking) {
    client.wants = Client::Wants::Nothing;
    client.queue.Push(Shared(encoder.TrackingReply(true)));
  } else if (message.kind == Kind::Request && message.type == "GET_STATUS") {
    client.queue.Push(Shared(encoder.Status(1, "serving")));
  } else if (message.kind == Kind::Request && (message.type == "GET_TRANS" || message.type == "GET_TRANSFORM")) {
    client.asked.insert(message.device);
  } else if (message.kind == Kind::Request && message.type == "GET_IMAGE") {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const NamedImage& image : images)
      if (message.device.empty() || image.name == message.device)
        client.queue.PushNewest(image.name, image.bytes);
  }
}

ParameterList Describe(OpenIgtLinkServerParameters& p)
{
  return {
      Parameter("Host", p.host,
                "Where it listens: 127.0.0.1 for this machine alone, 0.0.0.0 for all that can reach it (OpenIGTLink knows no "
                "passwords).")
          .Advanced(),
      Parameter("Port", p.port, {0, 65535}, "", "The port that clients connect to; 0 takes one that is free."),
      Parameter("Clients", p.clients, {1, 256}, "", "How many at once; those beyond are turned away."),
      Parameter("QueuedBytes", p.queuedBytes, {4096, 1073741824}, "bytes", "Of poses that wait for a client."),
      Parameter("RememberedImages", p.rememberedImages, {1, 64}, "",
                "Names of images of which the newest is kept for clients that come later."),
  };
}

OpenIgtLinkServer::OpenIgtLinkServer(const OpenIgtLinkServerParameters& parameters) : parts_(std::make_unique<Parts>())
{
  CheckRanges(parameters);
  parts_->parameters = parameters;
}

OpenIgtLinkServer::~OpenIgtLinkServer()
{
  Stop();
}

void OpenIgtLinkServer::Start(PoseStream* poses)
{
  Stop();
  parts_->listener = TcpSocket::Listen(parts_->parameters.host, parts_->parameters.port);
  parts_->subscription = poses ? poses->Subscribe() : nullptr;
  parts_->worker.Start([parts = parts_.get()](const Worker::Signal& signal) { parts->Run(signal); });
}

void OpenIgtLinkServer::Stop()
{
  parts_->worker.Stop();
  parts_->listener.Close();
  parts_->subscription.reset();
}

bool OpenIgtLinkServer::Running() const
{
  return parts_->worker.Running();
}

int OpenIgtLinkServer::Port() const
{
  return parts_->listener.IsOpen() ? parts_->listener.Port() : 0;
}

void OpenIgtLinkServer::Send(const ToolPose& pose)
{
  if (OpenIgtLinkEncoder::WireName(pose.name).empty())
    throw Error(Error::Kind::InvalidParameter,
                "\"" + pose.name + "\" is no name for OpenIGTLink, where names have 1 to 20 bytes");
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->given.push_back(pose);
  if (parts_->given.size() > MostGiven) { // nobody serves
    parts_->given.pop_front();
    ++parts_->givenLost;
    ++parts_->statistics.lost;
  }
}

void OpenIgtLinkServer::SendImage(const StreamedImage& image)
{
  const std::string& name = image.name;
  const SharedBytes bytes = Shared(OpenIgtLinkEncoder().Image(image, parts_->parameters.turnImages));
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  const auto put = [&](auto& list) {
    list.erase(std::remove_if(list.begin(), list.end(), [&](const Parts::NamedImage& other) { return other.name == name; }),
               list.end());
    list.push_back({name, bytes});
    if (list.size() > parts_->parameters.rememberedImages)
      list.erase(list.begin());
  };
  put(parts_->images);
  put(parts_->newImages);
}

bool OpenIgtLinkServer::Flush(double seconds) const
{
  const double until = ClockNow() + seconds;
  Parts& parts = *parts_;
  std::uint64_t mine = 0;
  {
    const std::lock_guard<std::mutex> lock(parts.mutex);
    mine = ++parts.asked;
  }
  while (true) {
    {
      const std::lock_guard<std::mutex> lock(parts.mutex);
      if (parts.flushed >= mine)
        return true;
    }
    if (ClockNow() >= until || !Running())
      return false;
    WaitForSockets({}, {}, LookAround);
  }
}

bool OpenIgtLinkServer::WaitForClient(double seconds) const
{
  const double until = ClockNow() + seconds;
  while (Statistics().clients == 0) {
    if (ClockNow() >= until || !Running())
      return false;
    WaitForSockets({}, {}, LookAround);
  }
  return true;
}

OpenIgtLinkServerStatistics OpenIgtLinkServer::Statistics() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->statistics;
}

} // namespace echorama
