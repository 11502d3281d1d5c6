// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate pivot: where the tip of a tracked tool is, from turning it about the tip.
#include "Calibrate.h"
#include "Core/Base/JsonPlace.h"
#include "Readers/OutputFiles.h"
#include "Readers/TransformFile.h"
#include "TrackedVolumes.h"
#include "Tracking/Calibration/CalibrationJson.h"
#include <CLI/Validators.hpp>
#include <cmath>
#include <memory>

namespace echorama {
namespace {

struct PivotOptions {
  std::string log, tool, output;
  double unitMm = 0.0, from = -INFINITY, to = INFINITY;
  std::vector<double> noise;
  bool keepAll = false;
};

void CalibrateTip(Session& session, const PivotOptions& options)
{
  CheckOutput(options.output, {options.log});
  const ToolTrack tool = ReadTool(session, options.log, options.tool, options.unitMm);
  std::vector<TimedPose> poses;
  for (const TimedPose& pose : tool.poses)
    if (!(pose.time < options.from) && !(pose.time > options.to))
      poses.push_back(pose);
  PivotParameters parameters;
  parameters.rejectOutliers = !options.keepAll;
  if (!options.noise.empty()) {
    parameters.noise = {options.noise[0], options.noise[1]};
    parameters.estimateNoise = false;
  }
  PivotResult result;
  session.Work("calibrate", options.log, [&](const Progress& progress) { result = CalibratePivot(poses, parameters, progress); });
  for (const std::string& note : result.notes)
    session.Note(note);

  NamedTransform tip;
  tip.from = tool.from + "Tip";
  tip.to = tool.from;
  tip.matrix = Eigen::Translation3d(result.tip);
  tip.errorMm = result.tipRmsMm;
  const nlohmann::ordered_json report = ToJson(result, tool.name);
  session.result["output"] = options.output;
  session.result["report"] = report;
  session.Say(tip.Name() + ": " + Triple(result.tip, ", ", 2) + " mm, from " + std::to_string(result.inliers) + " of " +
              std::to_string(poses.size()) + " poses");
  session.Say("error of the tip: " + Fixed(result.tipRmsMm, 3) + " mm RMS, within " + Fixed(result.tipRadius95Mm, 3) +
              " mm with 95%; poses place it " + Fixed(result.rmsMm, 2) + " mm (RMS) from the fixed point");
  WriteTransforms(options.output, {tip}, JsonPlace::Print(report));
  session.Say("wrote " + options.output);
}

} // namespace

Command CalibratePivotCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<PivotOptions>();
  CLI::App* options = calibrate.add_subcommand("pivot", "Where the tip of a tracked tool is, from turning it about its tip");
  options->add_option("--tracker", values->log, "Recording of the tool while its tip rests in one place: a sequence or a table")
      ->required();
  options->add_option("--tool", values->tool, "The tool, as the recording calls it (default: its only one)");
  options->add_option("-o,--output", values->output, "Calibration to write (JSON)")->required();
  options->add_option("--unit", values->unitMm, "Unit of the recording's lengths in mm; 1000: metres (default: as the file says)")
      ->check(CLI::Range(1e-3, 1e6));
  options->add_option("--from", values->from, "Leave out what came before, in seconds of the recording");
  options->add_option("--to", values->to, "Leave out what came after");
  options->add_option("--noise", values->noise, "Noise of the tracker: degrees and mm per axis (default: from the residuals)")
      ->expected(2);
  options->add_flag("--keep-all", values->keepAll, "Use every pose, however badly it fits");
  return {options, [values](Session& session) { CalibrateTip(session, *values); }};
}

} // namespace echorama
