// SPDX-License-Identifier: BSD-3-Clause
// echorama: the program for the command line. One subcommand per file; see Documentation/command-line.md.
#include "Commands.h"

#include "Core/Base/Parallel.h"
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <cstring>
#include <iostream>
#include <vtkSMPTools.h>

using namespace echorama;

namespace {

constexpr int ExitDone = 0, ExitFailed = 1, ExitMisused = 2;

int Run(const Command& command, bool json, int threads)
{
  Session session(command.options->get_name(), json);
  try {
    const ThreadLimit limit(threads);
    vtkSMPTools::Initialize(threads);
    command.run(session);
    return session.Finish();
  } catch (const Error& error) {
    return session.Fail(error.what(), error.GetKind() == Error::Kind::InvalidParameter ? ExitMisused : ExitFailed);
  } catch (const std::bad_alloc&) {
    return session.Fail(command.options->get_name() + ": there is not enough memory", ExitFailed);
  } catch (const std::exception& error) {
    return session.Fail(error.what(), ExitFailed);
  }
}

} // namespace

int main(int argc, char** argv)
{
  CLI::App program("Reconstruct, align, stitch, embed and look at 3D ultrasound volumes.", "echorama");
  program.set_version_flag("--version", "echorama " ECHORAMA_VERSION);
  program.require_subcommand(1);
  program.footer(
      "Every subcommand explains itself: echorama align --help\n"
      "Exit status: 0 done, 1 it could not be done, 2 wrong usage, 3 done, but the result must be checked (align, calibrate).");

  bool json = false;
  int threads = 0;
  const Command commands[] = {
      InfoCommand(program),      ConvertCommand(program), ReconstructCommand(program), AlignCommand(program),
      ScoreCommand(program),     StitchCommand(program),  EmbedCommand(program),       NoiseCommand(program),
      ProbeFitCommand(program),  PhantomCommand(program), SynthesizeCommand(program),  ViewCommand(program),
      CalibrateCommand(program), TrackCommand(program),   MotionCommand(program),      ShellCommand(program)};
  for (const Command& command : commands) {
    command.options->add_flag("--json", json, "Print one JSON object of results and seconds on standard output");
    command.options->add_option("--threads", threads, "Number of threads (0: as many as there are cores)")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
  }

  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      return program.exit(error); // --help, --version
    // The parser may have stopped before it came to --json.
    for (int i = 1; i < argc; ++i)
      json = json || std::strcmp(argv[i], "--json") == 0;
    const auto chosen = program.get_subcommands();
    const std::string name = chosen.empty() ? "" : chosen.front()->get_name();
    std::string path = "echorama "; // to the help that lists the options, of "calibrate rig", not of "calibrate"
    for (const CLI::App* app = chosen.empty() ? nullptr : chosen.front(); app;
         app = app->get_subcommands().empty() ? nullptr : app->get_subcommands().front())
      path += app->get_name() + " ";
    const bool unknown = chosen.empty() && argc > 1 && argv[1][0] != '-';
    const std::string reason = unknown ? argv[1] + std::string(": there is no such command") : error.what();
    return Session(name, json).Fail(reason + " (see " + path + "--help)", ExitMisused);
  }
  for (const Command& command : commands)
    if (command.options->parsed())
      return Run(command, json, threads);
  return ExitMisused; // not reached: the parser requires a subcommand
}
