// SPDX-License-Identifier: BSD-3-Clause
// Eight tools at 250 Hz over OpenIGTLink on loopback: what is lost, how much later a pose is there for its reader than it was for
// its sender, and what that costs. Ours: stream, server, client, stream. The peer: the library's own blocking sockets and
// messages, which is the loop that programs are built around. And how long a volume of 16 MB takes.
//
// BenchmarkTracker [--seconds S] [ours] [library] [volume]
#include "Core/Base/Worker.h"
#include "Testing/Benchmark.h"
#include "Tracking/Devices/OpenIgtLinkClient.h"
#include "Tracking/Devices/OpenIgtLinkServer.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/PoseStream.h"
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlServerSocket.h>
#include <igtlTransformMessage.h>
#include <set>
#include <sys/resource.h>
#include <unistd.h>

using namespace echorama;

namespace {

constexpr int Tools = 8;
constexpr double Interval = 0.004; // s

std::string ToolName(int tool)
{
  return "Tool" + std::to_string(tool) + "ToTracker";
}

double ResidentMb()
{
  std::ifstream file("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

double CpuSeconds()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// What the reader finds, in microseconds: memory stays flat however long it runs.
class Latencies {
public:
  void Add(double seconds)
  {
    const double us = std::max(0.0, seconds * 1e6);
    ++counts_[static_cast<std::size_t>(std::min<double>(us, static_cast<double>(counts_.size() - 1)))];
    ++count_;
    largest_ = std::max(largest_, seconds);
  }
  double Quantile(double share) const
  {
    std::uint64_t below = 0;
    for (std::size_t us = 0; us < counts_.size(); ++us)
      if ((below += counts_[us]) >= share * static_cast<double>(count_))
        return 1e-6 * (static_cast<double>(us) + 0.5);
    return 1e-6 * static_cast<double>(counts_.size());
  }
  std::uint64_t Count() const { return count_; }
  double Largest() const { return largest_; }

private:
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(1000000);
  std::uint64_t count_ = 0;
  double largest_ = 0.0;
};

// Calls send(tick) every four milliseconds, on time.
template <class Send>
std::uint64_t Tick(double seconds, const Worker::Signal& signal, const Send& send)
{
  const auto ticks = static_cast<std::uint64_t>(seconds / Interval);
  const double start = ClockNow();
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    const double wait = start + Interval * static_cast<double>(tick) - ClockNow();
    if (wait > 0.0 && !signal.Sleep(wait))
      return tick;
    send(tick);
  }
  return ticks;
}

struct Run {
  std::uint64_t sent = 0;
  Latencies latencies;
  double seconds = 0.0, cpuSeconds = 0.0, startMb = 0.0, endMb = 0.0;
};

void Print(const char* method, const Run& run, nlohmann::ordered_json more = {})
{
  nlohmann::ordered_json keys{{"sent", run.sent},
                              {"received", run.latencies.Count()},
                              {"run_seconds", run.seconds},
                              {"median_ms", 1e3 * run.latencies.Quantile(0.5)},
                              {"p95_ms", 1e3 * run.latencies.Quantile(0.95)},
                              {"p999_ms", 1e3 * run.latencies.Quantile(0.999)},
                              {"largest_ms", 1e3 * run.latencies.Largest()},
                              {"start_mb", run.startMb},
                              {"end_mb", run.endMb},
                              {"cpu_share", run.cpuSeconds / run.seconds}};
  if (more.is_object())
    keys.update(more);
  benchmark::Report("tracker", "8 tools, 250 Hz, loopback", method, run.latencies.Quantile(0.5),
                    static_cast<double>(run.sent) - static_cast<double>(run.latencies.Count()), "poses lost", keys);
}

void Ours(double seconds)
{
  PoseStream from, to;
  OpenIgtLinkServerParameters parameters;
  parameters.port = 0;
  OpenIgtLinkServer server(parameters);
  server.Start(&from);
  OpenIgtLinkClient client(TrackerAddress::Parse("igtl://127.0.0.1:" + std::to_string(server.Port())));
  const auto reader = to.Subscribe();
  client.Start(to, nullptr);
  server.WaitForClient(10.0);

  Run run;
  std::atomic<std::uint64_t> sent{0};
  Worker sender;
  const double start = ClockNow(), cpu = CpuSeconds();
  sender.Start([&](const Worker::Signal& signal) {
    Tick(seconds, signal, [&](std::uint64_t tick) {
      ToolPose pose;
      pose.time = ClockNow();
      for (int tool = 0; tool < Tools; ++tool) {
        pose.name = ToolName(tool);
        pose.pose.translation() << static_cast<double>(tick), tool, 0.0;
        from.Add(pose);
        ++sent;
      }
    });
  });
  double last = ClockNow();
  while (sender.Running() || ClockNow() - last < 1.0) {
    for (const ToolPose& pose : reader->Take(0.1)) {
      last = ClockNow();
      run.latencies.Add(pose.arrival - pose.time);
    }
    if (run.startMb == 0.0 && ClockNow() - start > std::min(30.0, 0.2 * seconds)) // when all streams are full
      run.startMb = ResidentMb();
  }
  run.sent = sent;
  run.endMb = ResidentMb();
  run.cpuSeconds = CpuSeconds() - cpu;
  run.seconds = ClockNow() - start;
  Print("echorama", run,
        {{"dropped", server.Statistics().dropped}, {"rejected", to.Statistics().Rejected(Rejection::Malformed)}});
}

// The port that the next listener is likely to get.
int FreePort()
{
  OpenIgtLinkServerParameters parameters;
  parameters.port = 0;
  OpenIgtLinkServer server(parameters);
  server.Start();
  return server.Port();
}

bool ReceiveHeader(igtl::Socket& socket, igtl::MessageHeader& header)
{
  header.InitPack();
  return socket.Receive(header.GetPackPointer(), header.GetPackSize()) == header.GetPackSize() && (header.Unpack(), true);
}

struct LibraryPair { // connected with each other
  igtl::ServerSocket::Pointer listener = igtl::ServerSocket::New();
  igtl::ClientSocket::Pointer to = igtl::ClientSocket::New();
  igtl::Socket::Pointer from;
  LibraryPair()
  {
    const int port = FreePort();
    listener->CreateServer(port);
    to->ConnectToServer("127.0.0.1", port);
    from = listener->WaitForConnection(10000);
    to->SetReceiveTimeout(1000);
  }
  ~LibraryPair()
  {
    if (from.IsNotNull())
      from->CloseSocket();
    to->CloseSocket();
    listener->CloseSocket();
  }
};

void Library(double seconds)
{
  LibraryPair pair;
  Run run;
  std::atomic<std::uint64_t> sent{0};
  Worker sender;
  const double start = ClockNow(), cpu = CpuSeconds();
  sender.Start([&](const Worker::Signal& signal) {
    Tick(seconds, signal, [&](std::uint64_t tick) {
      const double time = ClockNow(), whole = std::floor(time);
      for (int tool = 0; tool < Tools; ++tool) {
        igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
        igtl::Matrix4x4 matrix;
        igtl::IdentityMatrix(matrix);
        matrix[0][3] = static_cast<float>(tick);
        message->SetDeviceName(ToolName(tool).c_str());
        message->SetMatrix(matrix);
        message->SetTimeStamp(static_cast<unsigned int>(whole), static_cast<unsigned int>((time - whole) * 4294967296.0));
        message->Pack();
        pair.from->Send(message->GetPackPointer(), message->GetPackSize());
        ++sent;
      }
    });
  });
  igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  while ((sender.Running() || run.latencies.Count() < sent) && ReceiveHeader(*pair.to, *header)) {
    igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    pair.to->Receive(message->GetPackBodyPointer(), message->GetPackBodySize());
    if (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) {
      unsigned int whole = 0, fraction = 0;
      header->GetTimeStamp(&whole, &fraction);
      run.latencies.Add(ClockNow() - (whole + fraction / 4294967296.0));
    }
    if (run.startMb == 0.0 && ClockNow() - start > std::min(30.0, 0.2 * seconds))
      run.startMb = ResidentMb();
  }
  run.sent = sent;
  run.endMb = ResidentMb();
  run.cpuSeconds = CpuSeconds() - cpu;
  run.seconds = ClockNow() - start;
  Print("library", run);
}

void Volume()
{
  StreamedImage image;
  image.name = "Volume";
  image.geometry.dimensions = {256, 256, 256};
  auto voxels = std::make_shared<std::vector<unsigned char>>(image.geometry.VoxelCount());
  for (std::size_t i = 0; i < voxels->size(); ++i)
    (*voxels)[i] = static_cast<unsigned char>(i * 2654435761u >> 24);
  image.voxels = voxels;

  PoseStream poses;
  ImageStream images;
  OpenIgtLinkServerParameters parameters;
  parameters.port = 0;
  OpenIgtLinkServer server(parameters);
  server.Start();
  OpenIgtLinkClient client(TrackerAddress::Parse("igtl://127.0.0.1:" + std::to_string(server.Port())));
  client.Start(poses, &images);
  server.WaitForClient(10.0);
  const auto ours = [&] {
    const std::uint64_t seen = images.Version();
    server.SendImage(image);
    while (images.Version() == seen)
      usleep(200);
  };

  LibraryPair pair;
  Worker sender;
  std::vector<unsigned char> got(voxels->size());
  const auto library = [&] {
    sender.Start([&](const Worker::Signal&) {
      igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
      message->SetDeviceName("Volume");
      message->SetDimensions(256, 256, 256);
      message->SetSubVolume(256, 256, 256, 0, 0, 0);
      message->SetScalarTypeToUint8();
      message->AllocateScalars();
      std::memcpy(message->GetScalarPointer(), voxels->data(), voxels->size());
      message->Pack();
      pair.from->Send(message->GetPackPointer(), message->GetPackSize());
    });
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    if (!ReceiveHeader(*pair.to, *header))
      return;
    igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    pair.to->Receive(message->GetPackBodyPointer(), message->GetPackBodySize());
    if (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY)
      std::memcpy(got.data(), message->GetScalarPointer(), got.size());
    sender.Stop();
  };
  const auto [a, b] = benchmark::Duel(ours, library, 9);
  const auto wrong = [&](const std::vector<unsigned char>& other) {
    double count = 0.0;
    for (std::size_t i = 0; i < other.size(); ++i)
      count += other[i] != (*voxels)[i];
    return count;
  };
  benchmark::Report("tracker", "a volume of 256^3 bytes, loopback", "echorama", a, wrong(*images.Latest().voxels),
                    "voxels wrong");
  benchmark::Report("tracker", "a volume of 256^3 bytes, loopback", "library", b, wrong(got), "voxels wrong");
}

} // namespace

int main(int argc, char** argv)
{
  double seconds = benchmark::Smoke() ? 2.0 : 60.0;
  std::set<std::string> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--seconds" && i + 1 < argc)
      seconds = std::atof(argv[++i]);
    else
      wanted.insert(argument);
  }
  const std::set<std::string> all{"ours", "library", "volume"};
  if (!(seconds >= 1.0) || !std::includes(all.begin(), all.end(), wanted.begin(), wanted.end())) {
    std::cerr << "usage: BenchmarkTracker [--seconds S] [ours] [library] [volume]\n";
    return 2;
  }
  const auto runs = [&wanted](const char* name) { return wanted.empty() || wanted.count(name) > 0; };
  if (runs("ours"))
    Ours(seconds);
  if (runs("library"))
    Library(seconds);
  if (runs("volume"))
    Volume();
  return 0;
}
