// SPDX-License-Identifier: BSD-3-Clause
// echorama: the program for the command line. Each subcommand is a library, loaded when it was chosen; see
// Documentation/command-line.md.
#include "Commands.h"
#include "Core/Base/Parallel.h"
#include "Describe.h"
#include <algorithm>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <cstring>
#include <dlfcn.h>
#include <iostream>
#include <vtkSMPTools.h>

using namespace echorama;

namespace {

constexpr int ExitFailed = 1, ExitMisused = 2;

// In the order in which a user needs them. Their libraries are in Applications/CMakeLists.txt.
constexpr struct {
  const char *name, *help;
} Commands[] = {
    {"info", "Tell what files hold: volumes, tracked sequences, poses, transforms"},
    {"convert", "Write a volume, a tracked sequence or transforms in another file format"},
    {"reconstruct", "Make a volume of a tracked sequence of 2D images"},
    {"align", "Find where overlapping volumes belong"},
    {"score", "Tell how far poses are from the truth"},
    {"stitch", "Blend overlapping volumes into one"},
    {"embed", "Put a stitched volume into a background, so that it looks as one scan"},
    {"noise", "Make noise as an ultrasound machine does, in the fan of a probe"},
    {"probe-fit", "Find the geometry of the probe from a volume's valid region"},
    {"phantom", "Make overlapping volumes of an invented body, out of place by a known amount"},
    {"synthesize", "Make overlapping volumes of a scene by simulating ultrasound, out of place by a known amount"},
    {"view", "Show volumes: three slices and the volumes in 3D"},
    {"calibrate", "Find how sensor, volume, tip and clocks of a tracked probe belong together, or a camera and a skin"},
    {"track", "Follow a tracker: what it sees, recorded, and passed on over OpenIGTLink"},
    {"motion", "Smooth and resample a recorded motion"},
    {"shell", "Make a body's surface into a skin to print, with a base for a camera (STL, 3MF)"},
};

// The library of a command lies beside the others that the program needs, and is found as they are.
void Load(CLI::App* options, Action& action)
{
  const std::string name = options->get_name();
  // Lazily: of what it brings with it little is called.
  void* const library = dlopen(("libEchoramaCommand-" + name + ".so").c_str(), RTLD_LAZY | RTLD_LOCAL); // it stays
  const auto add = library ? reinterpret_cast<decltype(&EchoramaCommand)>(dlsym(library, "EchoramaCommand")) : nullptr;
  if (!add)
    throw Error(Error::Kind::NotPossible, name + ": what this command needs cannot be loaded (" + dlerror() +
                                              "); install Echorama again, with all that it depends on");
  add(options, action);
}

constexpr const char* ExitStatus =
    "Exit status: 0 done, 1 it could not be done, 2 wrong usage, 3 done, but the result must be checked (align, calibrate).";

struct Common {
  bool json = false;
  int threads = 0;
  Action action; // of the command that was chosen
};

void Load(CLI::App* options, Common& common)
{
  Load(options, common.action);
  options->add_flag("--json", common.json, "Print one JSON object of results and seconds on standard output");
  options->add_option("--threads", common.threads, "Number of threads (0: as many as there are cores)")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
}

// What the program or one of its commands says of itself for other programs: echorama [COMMAND...] --xml, --man or --completion.
// \returns false when something else was asked for.
bool Describe(CLI::App& program, Common& common, const std::vector<std::string>& words)
{
  const std::string what = words.empty() ? "" : words.back();
  if (what != "--xml" && what != "--man" && what != "--completion")
    return false;
  CLI::App* app = &program;
  std::string name;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::vector<CLI::App*> found = app->get_subcommands([&](const CLI::App* each) { return each->get_name() == words[i]; });
    if (found.empty())
      Misused(words[i] + ": there is no such command");
    app = found.front();
    if (i == 0)
      Load(app, common);
    name += (i == 0 ? "" : " ") + words[i];
  }
  const auto all = [](const CLI::App*) { return true; };
  if (what == "--man") {
    std::cout << ManPageOf(*app, name.empty() ? "echorama" : "echorama " + name, ExitStatus);
  } else if (what == "--xml") {
    if (!app->get_subcommands(all).empty())
      Misused("--xml: of a single command, as echorama align --xml");
    std::cout << SlicerDescription(*app, name);
  } else {
    if (app != &program)
      Misused("--completion: of all commands at once, echorama --completion");
    for (CLI::App* each : program.get_subcommands(all))
      Load(each, common);
    std::cout << BashCompletion(program);
  }
  return true;
}

// 3D Slicer knows no hyphens in names of options: --save_poses is --save-poses.
void TakeUnderscores(int argc, char** argv)
{
  for (int i = 1; i < argc && std::strcmp(argv[i], "--") != 0; ++i)
    if (std::strncmp(argv[i], "--", 2) == 0)
      std::replace(argv[i], argv[i] + std::strcspn(argv[i], "="), '_', '-');
}

int Run(const std::string& command, const Action& action, bool json, int threads)
{
  Session session(command, json);
  try {
    const ThreadLimit limit(threads);
    vtkSMPTools::Initialize(threads);
    action(session);
    return session.Finish();
  } catch (const Error& error) {
    return session.Fail(error.what(), error.GetKind() == Error::Kind::InvalidParameter ? ExitMisused : ExitFailed);
  } catch (const std::bad_alloc&) {
    return session.Fail(command + ": there is not enough memory", ExitFailed);
  } catch (const std::exception& error) {
    return session.Fail(error.what(), ExitFailed);
  }
}

} // namespace

int main(int argc, char** argv)
{
  TakeUnderscores(argc, argv);
  CLI::App program("Reconstruct, align, stitch, embed and look at 3D ultrasound volumes.", "echorama");
  program.set_version_flag("--version", "echorama " ECHORAMA_VERSION);
  program.require_subcommand(1);
  program.footer(std::string("Every subcommand explains itself: echorama align --help\n") + ExitStatus);

  Common common;
  for (const auto& command : Commands) {
    CLI::App* options = program.add_subcommand(command.name, command.help);
    options->preparse_callback([&common, options](std::size_t) { Load(options, common); }); // before its options are read
  }

  const auto fail = [&](const std::string& name, const std::string& reason, int status) {
    // The parser may have stopped before it came to --json.
    for (int i = 1; i < argc; ++i)
      common.json = common.json || std::strcmp(argv[i], "--json") == 0;
    return Session(name, common.json).Fail(reason, status);
  };
  const auto chosen = [&program] { return program.get_subcommands().empty() ? nullptr : program.get_subcommands().front(); };
  try {
    if (Describe(program, common, {argv + 1, argv + argc}))
      return 0;
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      return program.exit(error);   // --help, --version
    std::string path = "echorama "; // to the help that lists the options, of "calibrate rig", not of "calibrate"
    for (const CLI::App* app = chosen(); app; app = app->get_subcommands().empty() ? nullptr : app->get_subcommands().front())
      path += app->get_name() + " ";
    const bool unknown = !chosen() && argc > 1 && argv[1][0] != '-';
    const std::string reason = unknown ? argv[1] + std::string(": there is no such command") : error.what();
    return fail(chosen() ? chosen()->get_name() : "", reason + " (see " + path + "--help)", ExitMisused);
  } catch (const Error& error) { // it cannot be loaded, or cannot say that of itself
    return fail(chosen() ? chosen()->get_name() : "", error.what(),
                error.GetKind() == Error::Kind::InvalidParameter ? ExitMisused : ExitFailed);
  }
  return Run(chosen()->get_name(), common.action, common.json, common.threads);
}
