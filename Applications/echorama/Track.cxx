// SPDX-License-Identifier: BSD-3-Clause
// echorama track: a tracker, live, replayed or simulated: what it sees, recorded, and passed on over OpenIGTLink.
#include "Commands.h"
#include "Core/Base/JoinedText.h"
#include "Core/Geometry/TransformFile.h"
#include "Readers/OutputFiles.h"
#include "Tracking/Devices/OpenIgtLinkServer.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Stream/Clock.h"
#include "Tracking/Stream/LiveTransforms.h"
#include "Tracking/Stream/StreamRecorder.h"
#include "Tracking/Stream/StreamReport.h"
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
    if (statistics.tools.empty() || statistics.state != DeviceState::Running)
      std::cerr << DeviceStateText(statistics.state) << (statistics.message.empty() ? "" : ": " + statistics.message) << '\n';
    for (const ToolStatistics& tool : statistics.tools) {
      if (statistics.live && tool.secondsSinceLast > LiveTransforms::defaultFreshSeconds) {
        std::cerr << tool.name << ": " << TransformStatusText(TransformStatus::Missing) << "  came last "
                  << Fixed(tool.secondsSinceLast, 1) << " s ago\n";
        continue;
      }
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
  session.result.update(ToJson(statistics));
  for (const ToolStatistics& tool : statistics.tools)
    session.Say(tool.name + ": " + std::to_string(tool.valid) + " poses, " + Fixed(tool.rateHz, 1) + " Hz, jitter " +
                Fixed(1e3 * tool.jitterSeconds, 2) + " ms, " + Fixed(100.0 * tool.DropoutShare(), 1) +
                "% lost or out of range, " + std::to_string(tool.gaps) + " gaps" +
                (std::isfinite(tool.latencySpreadSeconds)
                     ? ", latency within " + Fixed(1e3 * tool.latencySpreadSeconds, 2) + " ms of the smallest"
                     : ""));
  if (const std::uint64_t all = statistics.Rejected(); all > 0)
    session.Note(std::to_string(all) + " messages were not taken; the last: " + statistics.lastRejection);
}

// What clients did not get.
void ReportServer(Session& session, const OpenIgtLinkServer& server)
{
  const OpenIgtLinkServerStatistics statistics = server.Statistics();
  session.result["served"] = {{"clients", statistics.accepted},
                              {"sent", statistics.sent},
                              {"dropped", statistics.dropped},
                              {"lost", statistics.lost},
                              {"unnameable", statistics.unnameable}};
  if (statistics.dropped + statistics.lost > 0)
    session.Note(std::to_string(statistics.dropped + statistics.lost) +
                 " poses were not passed on: clients did not take them in time");
  if (statistics.unnameable > 0)
    session.Note(std::to_string(statistics.unnameable) +
                 " poses were not passed on: their names do not fit into OpenIGTLink's 20 bytes");
}

void Track(Session& session, TrackOptions options)
{
  std::error_code noFile;
  if (std::filesystem::exists(options.tracker, noFile))
    options.tracker = "replay:" + options.tracker;
  PoseStream poses; // outlives what writes to it
  ImageStream images;
  const auto device = MakeTracker(options.tracker);
  std::vector<std::string> inputs;
  const TrackerAddress address = TrackerAddress::Parse(options.tracker);
  if (address.scheme == "replay")
    inputs.push_back(address.place);
  if (!options.record.empty())
    CheckOutput(options.record, inputs);

  const LiveTransforms transforms(poses, options.transforms.empty() ? std::vector<NamedTransform>()
                                                                    : ReadTransforms(options.transforms));
  std::unique_ptr<OpenIgtLinkServer> server;
  if (!options.serve.empty()) {
    const bool portAlone = options.serve.find_first_not_of("0123456789") == std::string::npos;
    OpenIgtLinkServerParameters parameters;
    const auto place = TrackerAddress::Parse("igtl-listen://" + std::string(portAlone ? ":" : "") + options.serve)
                           .HostAndPort(parameters.host, parameters.port);
    parameters.host = place.host;
    parameters.port = place.port;
    server = std::make_unique<OpenIgtLinkServer>(parameters);
    server->Start(&poses);
    std::cerr << "serving OpenIGTLink on " << place.host << ":" << server->Port() << '\n';
  }
  std::unique_ptr<StreamRecorder> recorder;
  if (!options.record.empty()) {
    // A recording is never replaced: it grows in its place, so that the old one would be gone at once.
    recorder = std::make_unique<StreamRecorder>(options.record, poses.Subscribe(1 << 20));
  }
  device->Start(poses, server ? &images : nullptr);

  const double start = ClockNow();
  double shown = start, checked = start;
  try {
    session.Work("track", options.tracker, [&](const Progress& progress) {
      std::uint64_t sentImages = 0;
      for (std::uint64_t seen = 0;;) {
        seen = poses.WaitBeyond(seen, 0.1);
        const double now = ClockNow();
        if (server && images.Version() != sentImages) {
          sentImages = images.Version();
          server->SendImage(images.Latest());
        }
        if (recorder && now - checked > 0.5) {
          checked = now;
          const std::string problem = recorder->State().problem;
          if (!problem.empty())
            throw Error(Error::Kind::FileSystem, problem);
        }
        if (now - shown >= options.everySeconds) {
          shown = now;
          ShowNow(options, poses, transforms);
        }
        const DeviceState state = poses.State().first;
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
  const StreamStatistics last = poses.Statistics(); // what it was doing; once stopped, it does nothing
  device->Stop();
  StreamStatistics statistics = poses.Statistics();
  statistics.state = last.state;
  statistics.message = last.message;
  session.result["tracker"] = options.tracker;
  session.result["lasted_seconds"] = ClockNow() - start;
  if (recorder) {
    if (!statistics.tools.empty())
      recorder->Stop();
    const RecordingState state = recorder->State();
    session.result["recording"] = {
        {"file", options.record}, {"poses", state.poses}, {"frames", state.frames}, {"lost", state.lost}};
    session.Say("recorded " + std::to_string(state.poses) + " poses to " + options.record);
    if (state.lost > 0)
      session.Note(options.record + ": " + std::to_string(state.lost) + " poses came faster than they could be written");
    if (state.leftOut > 0)
      session.Note(options.record + ": " + std::to_string(state.leftOut) +
                   " poses were left out; the last: " + state.lastLeftOut);
  }
  if (server) {
    if (!server->Flush(5.0))
      session.Note("clients had not taken everything when it ended");
    server->Stop();
    ReportServer(session, *server);
  }
  Report(session, statistics);
  if (statistics.state == DeviceState::Failed)
    throw Error(Error::Kind::FileSystem, options.tracker + ": " + statistics.message);
  if (statistics.tools.empty())
    throw Error(Error::Kind::NotPossible,
                options.tracker + ": no pose came" + (statistics.message.empty() ? "" : "; " + statistics.message));
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<TrackOptions>();
  options
      ->add_option(
          "tracker", values->tracker,
          "The tracker, as SCHEME:PLACE?OPTION=VALUE (igtl://localhost:18944, polhemus:/dev/ttyUSB0, simulated: ...; schemes: " +
              Joined(TrackerSchemes()) + "), or a recording")
      ->required();
  options
      ->add_option("--record", values->record,
                   "Record to this sequence (.igs.mha), which must not be there yet; safe against a sudden end")
      ->type_name("FILE");
  options->add_option("--serve", values->serve,
                      "Pass poses and images on to OpenIGTLink clients at PORT or HOST:PORT (PORT alone: this machine only)");
  options->add_option("--transforms", values->transforms, "Fixed transforms, such as a calibration")->type_name("FILE");
  options->add_option("--show", values->shown, "A transform to show while it runs, such as VolumeToTracker; again for each");
  options->add_option("--every", values->everySeconds, "How often it is shown, in seconds")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  options->add_option("--seconds", values->seconds, "End after this time (default: at the recording's end, or when interrupted)")
      ->check(CLI::Range(0.0, 1e7));
  action = [values](Session& session) { Track(session, *values); };
}

} // namespace echorama
