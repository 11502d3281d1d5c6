// SPDX-License-Identifier: BSD-3-Clause
// echorama convert: from one file format to another.
#include "Commands.h"
#include "Outputs.h"
#include "Volumes.h"
#include <memory>

namespace echorama {
namespace {

void Convert(Session& session, const std::string& from, const std::string& to)
{
  CheckVolumeOutput(to, {from});
  const LoadedVolume volume = LoadVolume(session, from);
  const std::vector<std::string> lost = SaveVolume(session, volume.image, to);
  session.result["input"] = from;
  session.result["output"] = to;
  session.result["lost"] = lost;
  session.Say("wrote " + to);
}

} // namespace

Command ConvertCommand(CLI::App& program)
{
  auto files = std::make_shared<std::pair<std::string, std::string>>();
  CLI::App* options = program.add_subcommand("convert", "Write a volume in another file format");
  options->add_option("input", files->first, "Volume to read (.mha .mhd .nrrd .nhdr .vti)")->required();
  options->add_option("output", files->second, "File to write; its extension names the format")->required();
  return {options, [files](Session& session) { Convert(session, files->first, files->second); }};
}

} // namespace echorama
