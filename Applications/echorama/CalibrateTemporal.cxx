// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate temporal: the offset between the clocks of two recordings of one motion.
#include "Calibrate.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/TextFile.h"
#include "Filters/Calibration/CalibrationJson.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "TrackedVolumes.h"
#include <memory>

namespace echorama {
namespace {

struct TemporalOptions {
  std::string first, firstTool, second, secondTool, output;
  PoseLogOptions reading;
  TemporalParameters parameters;
};

void CalibrateClocks(Session& session, const TemporalOptions& options)
{
  if (!options.output.empty())
    CheckOutput(options.output, {options.first, options.second});
  const ToolTrack first = ReadTool(session, options.first, options.firstTool, options.reading);
  const ToolTrack second = ReadTool(session, options.second, options.secondTool, options.reading);
  TemporalResult result;
  session.Work("calibrate", "", [&](const Progress& progress) {
    result = CalibrateTime(first.poses, second.poses, options.parameters, progress);
  });
  for (const std::string& note : result.notes)
    session.Note(note);
  const nlohmann::ordered_json report = ToJson(result, first.name, second.name);
  session.result = report;
  session.result.erase("correlation_by_offset"); // thousands of lines, for a plot; in the file
  session.Say("offset: " + Fixed(1e3 * result.offsetSeconds, 2) + " ms (standard error " +
              Fixed(1e3 * result.standardErrorSeconds, 2) + " ms) to be added to the times of " + options.second + " " +
              second.name);
  session.Say("from speeds of " + session.result["signal"].get<std::string>() + ", correlation " + Fixed(result.correlation, 3) +
              ", over " + Fixed(result.overlapSeconds, 1) + " s");
  if (!options.output.empty()) {
    WriteTextFile(options.output, JsonPlace::Print(report) + "\n");
    session.Say("wrote " + options.output);
  }
}

} // namespace

CalibrateKind CalibrateTemporalCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<TemporalOptions>();
  CLI::App* options = calibrate.add_subcommand("temporal", "The offset between the clocks of two recordings of one motion");
  options->add_option("first", values->first, "Recording whose clock counts")->type_name("FILE")->required();
  options->add_option("second", values->second, "Recording of the same motion; may be the same file, with another tool")
      ->type_name("FILE")
      ->required();
  options->add_option("--tool", values->firstTool, "The tool in the first recording (default: its only one)");
  options->add_option("--second-tool", values->secondTool, "The tool in the second (default: its only one)");
  AddParameter(options, Describe(values->parameters), "Signal");
  AddParameter(options, Describe(values->parameters), "LargestOffset", "--largest");
  AddParameter(options, Describe(values->reading), "UnitMm", "--unit");
  options->add_option("-o,--output", values->output, "Write the result as JSON")->type_name("FILE");
  return {options, [values](Session& session) { CalibrateClocks(session, *values); }};
}

} // namespace echorama
