// SPDX-License-Identifier: BSD-3-Clause
// echorama track: a tracker, live, replayed or simulated: what it sees, recorded, and passed on over OpenIGTLink.
#include "Commands.h"
#include "Outputs.h"
#include "Readers/TransformFile.h"
#include "Tracking/Devices/OpenIgtLinkServer.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/LiveTransforms.h"
#include "Tracking/Stream/StreamRecorder.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

namespace echorama {
namespace {

struct TrackOptions {
  std::string tracker, record, serve, transforms;
  std::vector<std::string> shown;
  double seconds = 0.0, everySeconds = 1.0;
};

// How the tools are, or where the frames that were asked for are: one line each.
void ShowNow(const TrackOptions& options, const PoseStream& poses, const LiveTransforms& transforms)
{
  if (options.shown.empty()) {
    const StreamStatistics statistics = poses.Statistics();
    if (statistics.tools.empty())
      std::cerr << DeviceStateText(statistics.state) << (statistics.message.empty() ? "" : ": " + statistics.message) << '\n';
    for (const ToolStatistics& tool : statistics.tools) {
      const ToolPose latest = poses.Latest(tool.name);
      std::cerr << tool.name << ": " << TransformStatusText(latest.status) << "  "
                << (latest.status == TransformStatus::Missing ? "-" : Triple(latest.pose.translation(), " ", 2) + " mm") << "  "
                << Fixed(tool.rateHz, 1) << " Hz\n";
    }
  }
  for (const std::string& name : options.shown) {
    const LiveTransform found = transforms.Find(name);
    std::cerr << name << ": " << TransformStatusText(found.Status());
    if (found.Status() != TransformStatus::Missing)
      std::cerr << "  " << Triple(found.transform.matrix.translation(), " ", 2) << " mm";
    if (found.transform.errorMm)
      std::cerr << "  error " << Fixed(*found.transform.errorMm, 2) << " mm";
    std::cerr << (found.message.empty() ? "" : "  " + found.message) << '\n';
  }
}

void Report(Session& session, const StreamStatistics& statistics)
{
  session.result["state"] = DeviceStateText(statistics.state);
  if (!statistics.message.empty())
    session.result["message"] = statistics.message;
  session.result["tools"] = nlohmann::ordered_json::array();
  for (const ToolStatistics& tool : statistics.tools) {
    session.result["tools"].push_back({{"name", tool.name},
                                       {"valid", tool.valid},
                                       {"missing", tool.missing},
                                       {"out_of_range", tool.outOfRange},
                                       {"gaps", tool.gaps},
                                       {"clock_jumps", tool.clockJumps},
                                       {"rate_hz", tool.rateHz},
                                       {"jitter_ms", 1e3 * tool.jitterSeconds},
                                       {"latency_ms", 1e3 * tool.medianLatencySeconds},
                                       {"latency_spread_ms", 1e3 * tool.latencySpreadSeconds}});
    session.Say(tool.name + ": " + std::to_string(tool.valid) + " poses, " + Fixed(tool.rateHz, 1) + " Hz, jitter " +
                Fixed(1e3 * tool.jitterSeconds, 2) + " ms, " + Fixed(100.0 * tool.DropoutShare(), 1) +
                "% lost or out of range, " + std::to_string(tool.gaps) + " gaps, latency within " +
                Fixed(1e3 * tool.latencySpreadSeconds, 2) + " ms of the smallest");
  }
  nlohmann::ordered_json rejected = nlohmann::ordered_json::object();
  std::uint64_t all = 0;
  for (int i = 0; i < RejectionCount; ++i) {
    const auto reason = static_cast<Rejection>(i);
    if (statistics.Rejected(reason) > 0)
      rejected[RejectionText(reason)] = statistics.Rejected(reason);
    all += statistics.Rejected(reason);
  }
  session.result["rejected"] = rejected;
  if (all > 0)
    session.Note(std::to_string(all) + " messages were not taken; the last: " + statistics.lastRejection);
}

void Track(Session& session, TrackOptions options)
{
  if (std::filesystem::exists(options.tracker))
    options.tracker = "replay:" + options.tracker;
  const auto device = MakeTracker(options.tracker);
  std::vector<std::string> inputs;
  const TrackerAddress address = TrackerAddress::Parse(options.tracker);
  if (address.scheme == "replay")
    inputs.push_back(address.place);
  if (!options.record.empty())
    CheckOutput(options.record, inputs);

  PoseStream poses;
  const LiveTransforms transforms(poses, options.transforms.empty() ? std::vector<NamedTransform>()
                                                                    : ReadTransforms(options.transforms));
  std::unique_ptr<OpenIgtLinkServer> server;
  if (!options.serve.empty()) {
    const bool portAlone = options.serve.find_first_not_of("0123456789") == std::string::npos;
    const auto place = TrackerAddress::Parse("igtl-listen://" + std::string(portAlone ? ":" : "") + options.serve)
                           .HostAndPort("127.0.0.1", 18944);
    OpenIgtLinkServerParameters parameters;
    parameters.host = place.host;
    parameters.port = place.port;
    server = std::make_unique<OpenIgtLinkServer>(parameters);
    server->Start(&poses);
    std::cerr << "serving OpenIGTLink on " << place.host << ":" << server->Port() << '\n';
  }
  std::unique_ptr<StreamRecorder> recorder;
  if (!options.record.empty()) {
    SequenceRecorderOptions recording;
    recording.replace = true; // CheckOutput has looked at it
    recorder = std::make_unique<StreamRecorder>(options.record, poses.Subscribe(), recording);
  }
  device->Start(poses, nullptr);

  const double start = ClockNow();
  double shown = start;
  try {
    session.Work("track", options.tracker, [&](const Progress& progress) {
      for (std::uint64_t seen = 0;;) {
        seen = poses.WaitBeyond(seen, 0.1);
        const double now = ClockNow();
        if (now - shown >= options.everySeconds) {
          shown = now;
          ShowNow(options, poses, transforms);
        }
        const DeviceState state = poses.Statistics().state;
        if (state == DeviceState::Ended || state == DeviceState::Failed ||
            (options.seconds > 0.0 && now - start >= options.seconds))
          return;
        progress(options.seconds > 0.0 ? std::min(1.0, (now - start) / options.seconds) : 0.0);
      }
    });
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::Cancelled) // how a live tracker is ended is not an error
      throw;
  }
  device->Stop();
  const StreamStatistics statistics = poses.Statistics();
  session.result["tracker"] = options.tracker;
  session.result["lasted_seconds"] = ClockNow() - start;
  if (recorder) {
    const RecordingState before = recorder->State();
    recorder->Stop();
    session.result["recording"] = options.record;
    session.Say("recorded to " + options.record);
    if (before.lost > 0)
      session.Note(options.record + ": " + std::to_string(before.lost) + " poses came faster than they could be written");
  }
  if (server) {
    server->Flush(1.0);
    server->Stop();
  }
  Report(session, statistics);
  if (statistics.state == DeviceState::Failed)
    throw Error(Error::Kind::FileSystem, options.tracker + ": " + statistics.message);
  if (statistics.tools.empty())
    throw Error(Error::Kind::NotPossible,
                options.tracker + ": no pose came" + (statistics.message.empty() ? "" : "; " + statistics.message));
}

} // namespace

Command TrackCommand(CLI::App& program)
{
  auto values = std::make_shared<TrackOptions>();
  CLI::App* options = program.add_subcommand("track", "Follow a tracker: what it sees, recorded, and passed on over OpenIGTLink");
  std::string schemes;
  for (const std::string& scheme : TrackerSchemes())
    schemes += (schemes.empty() ? "" : ", ") + scheme;
  options
      ->add_option(
          "tracker", values->tracker,
          "The tracker, as SCHEME:PLACE?OPTION=VALUE (igtl://localhost:18944, polhemus:/dev/ttyUSB0, simulated: ...; schemes: " +
              schemes + "), or a recording")
      ->required();
  options->add_option("--record", values->record, "Record to this sequence (.igs.mha); safe against a sudden end");
  options->add_option("--serve", values->serve,
                      "Pass everything on to OpenIGTLink clients at PORT or HOST:PORT (PORT alone: this machine only)");
  options->add_option("--transforms", values->transforms, "Fixed transforms, such as a calibration");
  options->add_option("--show", values->shown, "A transform to show while it runs, such as VolumeToTracker; again for each");
  options->add_option("--every", values->everySeconds, "How often it is shown, in seconds")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  options->add_option("--seconds", values->seconds, "End after this time (default: at the recording's end, or when interrupted)")
      ->check(CLI::Range(0.0, 1e7));
  return {options, [values](Session& session) { Track(session, *values); }};
}

} // namespace echorama
