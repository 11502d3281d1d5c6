// SPDX-License-Identifier: BSD-3-Clause
// echorama motion: a recorded motion, smoothed and resampled, as a path for a probe (dissertation 3.2).
#include "Commands.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Readers/SequenceWriter.h"
#include "TrackedVolumes.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <cmath>
#include <memory>

namespace echorama {
namespace {

struct MotionOptions {
  std::string log, tool, output;
  PoseLogOptions reading;
  double rate = 50.0, from = NAN, to = NAN;
  MotionSmoothing smoothing;
};

void ResampleMotion(Session& session, const MotionOptions& options)
{
  CheckOutput(options.output, {options.log});
  if (!NamesSequence(options.output))
    throw Error(Error::Kind::InvalidParameter, options.output + ": a sequence ends in .igs.mha or .seq.mha");
  const ToolTrack tool = ReadTool(session, options.log, options.tool, options.reading);
  std::unique_ptr<MotionPath> path;
  session.Work("smooth", "",
               [&](const Progress& progress) { path = std::make_unique<MotionPath>(tool.Path(options.smoothing, progress)); });
  const double first = std::isnan(options.from) ? path->FirstTime() : std::max(options.from, path->FirstTime());
  const double last = std::isnan(options.to) ? path->LastTime() : std::min(options.to, path->LastTime());
  if (!(last >= first))
    throw Error(Error::Kind::InvalidParameter, options.log + ": there is nothing between --from and --to; it lasts from " +
                                                   Fixed(path->FirstTime(), 3) + " to " + Fixed(path->LastTime(), 3) + " s");
  constexpr double rounding = 1e-6; // of a step: 1.2 - 1 is less than 0.2, and the end belongs to it
  const double steps = std::floor((last - first) * options.rate + rounding);
  if (steps > 1e7)
    throw Error(Error::Kind::TooLarge, options.log + ": at this rate it would have more than ten million poses");
  SequenceContent content;
  content.dimensions = {0, 0, 1};
  FileReplacement files;
  SequenceWriter writer(options.output, content, false, files);
  int gaps = 0;
  double length = 0.0, largest = 0.0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  bool hasBefore = false;
  for (int i = 0; i <= static_cast<int>(steps); ++i) {
    SequenceFrame frame;
    frame.time = std::min(first + i / options.rate, last);
    SequenceTransform transform;
    transform.name = tool.name;
    if (path->Covers(frame.time)) {
      const Pose pose = path->At(frame.time);
      transform.matrix = pose;
      if (hasBefore) {
        const double step = (pose.translation() - before).norm();
        length += step;
        largest = std::max(largest, step * options.rate);
      }
      before = pose.translation();
      hasBefore = true;
    } else {
      transform.status = TransformStatus::Missing;
      transform.statusText = TransformStatusText(transform.status);
      ++gaps;
      hasBefore = false;
    }
    frame.transforms = {transform};
    writer.Append(frame, nullptr);
  }
  writer.Finish();
  files.Commit();
  session.result["output"] = options.output;
  session.result["tool"] = tool.name;
  session.result["poses"] = static_cast<int>(steps) + 1;
  session.result["missing"] = gaps;
  session.result["lasts_seconds"] = last - first; // "seconds" is the session's own
  session.result["path_mm"] = length;
  session.result["fastest_mm_per_second"] = largest;
  session.Say(tool.name + ": " + std::to_string(static_cast<int>(steps) + 1) + " poses over " + Fixed(last - first, 2) +
              " s, a path of " + Fixed(length, 1) + " mm, at most " + Fixed(largest, 1) + " mm/s");
  if (gaps > 0)
    session.Note(std::to_string(gaps) + " poses lie in gaps of the recording and are marked as missing");
  session.Say("wrote " + options.output);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<MotionOptions>();
  options->add_option("recording", values->log, "Recording of a tracker: a sequence or a table")->type_name("FILE")->required();
  options->add_option("-o,--output", values->output, "Sequence to write (.igs.mha)")->type_name("FILE")->required();
  options->add_option("--tool", values->tool, "The tool, as the recording calls it (default: its only one)");
  AddParameter(options, Describe(values->reading), "UnitMm", "--unit");
  options->add_option("--rate", values->rate, "Poses a second")->check(CLI::Range(1e-3, 1e5))->capture_default_str();
  AddParameter(options, Describe(values->smoothing), "WindowSeconds", "--smooth");
  AddParameter(options, Describe(values->smoothing), "LongestGapSeconds", "--gap");
  options->add_option("--from", values->from, "Begin at this time of the recording, in seconds");
  options->add_option("--to", values->to, "End at this time");
  action = [values](Session& session) { ResampleMotion(session, *values); };
}

} // namespace echorama
