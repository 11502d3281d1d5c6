// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate pivot: where the tip of a tracked tool is, from turning it about the tip.
#include "Calibrate.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Geometry/TransformFile.h"
#include "Filters/Calibration/CalibrationJson.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "TrackedVolumes.h"
#include <cmath>
#include <memory>

namespace echorama {
namespace {

struct PivotOptions {
  std::string log, tool, output;
  PoseLogOptions reading;
  double from = -INFINITY, to = INFINITY;
  PivotParameters parameters;
};

void CalibrateTip(Session& session, const PivotOptions& options)
{
  CheckOutput(options.output, {options.log});
  const ToolTrack tool = ReadTool(session, options.log, options.tool, options.reading);
  std::vector<TimedPose> poses;
  for (const TimedPose& pose : tool.poses)
    if (!(pose.time < options.from) && !(pose.time > options.to))
      poses.push_back(pose);
  PivotResult result;
  session.Work("calibrate", options.log,
               [&](const Progress& progress) { result = CalibratePivot(poses, options.parameters, progress); });
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

CalibrateKind CalibratePivotCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<PivotOptions>();
  CLI::App* options = calibrate.add_subcommand("pivot", "Where the tip of a tracked tool is, from turning it about its tip");
  options->add_option("--tracker", values->log, "Recording of the tool while its tip rests in one place: a sequence or a table")
      ->type_name("FILE")
      ->required();
  options->add_option("--tool", values->tool, "The tool, as the recording calls it (default: its only one)");
  options->add_option("-o,--output", values->output, "Calibration to write (JSON)")->type_name("FILE")->required();
  AddParameter(options, Describe(values->reading), "UnitMm", "--unit");
  options->add_option("--from", values->from, "Leave out what came before, in seconds of the recording");
  options->add_option("--to", values->to, "Leave out what came after");
  options
      ->add_option_function<std::vector<double>>(
          "--noise",
          [values](const std::vector<double>& noise) {
            values->parameters.noise = {noise[0], noise[1]};
            values->parameters.estimateNoise = false;
          },
          "Noise of the tracker: degrees and mm per axis (default: from the residuals)")
      ->expected(2);
  options->add_flag_callback(
      "--keep-all", [values] { values->parameters.rejectOutliers = false; }, "Use every pose, however badly it fits");
  return {options, [values](Session& session) { CalibrateTip(session, *values); }};
}

} // namespace echorama
