// SPDX-License-Identifier: BSD-3-Clause
// echorama-leds: switches the lights of the optical tracker; see Documentation/optical-hardware.md.
#include "Applications/echorama/Describe.h"
#include "Applications/echorama/ParameterOptions.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "GpioLines.h"
#include <chrono>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <cmath>
#include <csignal>
#include <iostream>
#include <limits>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

using namespace echorama;

namespace {

constexpr int ExitDone = 0, ExitFailed = 1, ExitMisused = 2, ExitDoubtful = 3;
constexpr double MostLate = 0.01; // of all changes

volatile std::sig_atomic_t interrupted = 0;

extern "C" void Interrupt(int)
{
  interrupted = 1;
}

// Also what would stop the process, with its lights on.
void InstallSignalHandlers()
{
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler == SIG_IGN) // nohup, or a background job
      continue;
    action.sa_handler = Interrupt;
    action.sa_flags = 0; // a sleep ends
    sigaction(signal, &action, nullptr);
  }
  std::signal(SIGPIPE, SIG_IGN);
}

void Note(const std::string& text)
{
  std::cerr << "echorama-leds: note: " << text << std::endl;
}

void BePunctual()
{
  prctl(PR_SET_TIMERSLACK, 1UL); // otherwise 50 microseconds may be added to every sleep
  mlockall(MCL_CURRENT);
  sched_param priority{};
  priority.sched_priority = 50;
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0)
    Note("real-time priority is not permitted; when the machine is busy, lights change late (limits.conf: rtprio 50)");
}

double SecondsSince1970()
{
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

struct NoLines : LightLines {
  void Set(std::uint32_t) override {}
};

struct Options {
  GpioPlace place;
  LightScheduleParameters schedule;
  std::string trigger;
  double seconds = 0.0;
  bool dryRun = false, csv = false;
};

int Run(Options options)
{
  options.schedule.lights = static_cast<int>(options.place.lines.size());
  options.schedule.trigger = !options.trigger.empty();
  if (options.schedule.trigger)
    options.place.lines.push_back(options.trigger);
  const LightSchedule schedule(options.schedule);
  if (options.dryRun) {
    std::cout << (options.csv ? schedule.Csv() : schedule.Picture(options.place.lines)) << std::flush;
    if (options.seconds == 0.0)
      return std::cout ? ExitDone : ExitFailed;
  }
  InstallSignalHandlers();
  const std::unique_ptr<LightLines> lines = options.dryRun ? std::make_unique<NoLines>() : OpenGpioLines(options.place);
  BePunctual();
  SystemLightClock clock;
  LightRun run;
  std::int64_t toldBegin = 0, toldChanges = 0, toldLate = 0;
  const auto goOn = [&] {
    if (run.begin != toldBegin) {
      toldBegin = run.begin;
      std::cerr << Format("slot 0 begins %.6f s after 1970 began\n",
                          SecondsSince1970() + 1e-9 * static_cast<double>(run.begin - clock.Now()))
                << std::flush;
    }
    if (run.changes - toldChanges >= 1000) {
      const std::int64_t late = run.late + run.missed - toldLate;
      if (static_cast<double>(late) > MostLate * static_cast<double>(run.changes - toldChanges))
        Note(Format("of the last %lld changes %lld were late", static_cast<long long>(run.changes - toldChanges),
                    static_cast<long long>(late)));
      toldChanges = run.changes;
      toldLate = run.late + run.missed;
    }
    return interrupted == 0;
  };
  RehearseLights(schedule, *lines, clock, goOn);
  const double slots = std::ceil(options.seconds * options.schedule.rateHz);
  RunLights(schedule, *lines, clock,
            options.seconds > 0.0 ? static_cast<std::int64_t>(slots) : std::numeric_limits<std::int64_t>::max(), goOn, run);
  std::cerr << Format("%lld slots, %lld changes: %s later than they should be; %lld late, %lld slots missed\n",
                      static_cast<long long>(run.slots), static_cast<long long>(run.changes), run.Punctuality().c_str(),
                      static_cast<long long>(run.late), static_cast<long long>(run.missed));
  return run.ShareOfLate() > MostLate ? ExitDoubtful : ExitDone;
}

} // namespace

int main(int argc, char** argv)
{
  CLI::App program("Switch the lights of the optical tracker, each by its own code, on GPIO lines.", "echorama-leds");
  program.set_version_flag("--version", "echorama-leds " ECHORAMA_VERSION ", " + GpioLibrary());
  const std::string ending =
      "Ctrl-C ends it, with all lights off.\n"
      "Exit status: 0 done, 1 it could not be done, 2 wrong usage, 3 done, but more than 1% of all changes were late.";
  program.footer(ending);
  Options options;
  program
      .add_option("-l,--line", options.place.lines,
                  "The line of a light, a number or a name such as GPIO17; again for each light")
      ->required()
      ->expected(1, 4);
  program.add_option("-t,--trigger", options.trigger, "A line that triggers the camera: it rises as any slot begins");
  program.add_option("--chip", options.place.chip, "The GPIO chip: its name, number or device")->capture_default_str();
  program.add_flag("--active-low", options.place.activeLow, "Lines are low for on (the trigger's, too)");
  for (const Parameter& parameter : Describe(options.schedule))
    AddParameter(&program, parameter, {}, {});
  program.add_option("--seconds", options.seconds, "End after this time (default: when interrupted)")
      ->check(CLI::Range(0.0, 1e7));
  CLI::Option* dryRun =
      program.add_flag("--dry-run", options.dryRun,
                       "Touch no line: print when each changes; with --seconds, also try how punctual this machine is");
  program.add_flag("--csv", options.csv, "Print it as a table for programs")->needs(dryRun);
  if (argc == 2 && std::string(argv[1]) == "--man") {
    std::cout << ManPageOf(program, "echorama-leds", ending);
    return ExitDone;
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      return program.exit(error); // --help, --version
    std::cerr << "echorama-leds: " << error.what() << " (see echorama-leds --help)" << std::endl;
    return ExitMisused;
  }
  try {
    return Run(options);
  } catch (const Error& error) {
    std::cerr << "echorama-leds: " << error.what() << std::endl;
    return error.GetKind() == Error::Kind::InvalidParameter ? ExitMisused : ExitFailed;
  } catch (const std::exception& error) {
    std::cerr << "echorama-leds: " << error.what() << std::endl;
    return ExitFailed;
  }
}
