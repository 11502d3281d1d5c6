// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Session.h"
#include <CLI/App.hpp>
#include <functional>
#include <string>

namespace echorama {

/// A subcommand: its options, and what it does when it was chosen. It reports failure by throwing; an Error of the kind
/// InvalidParameter means wrong usage.
struct Command {
  CLI::App* options = nullptr;
  std::function<void(Session&)> run;
};

/// Throws Error(InvalidParameter).
[[noreturn]] inline void Misused(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

// Each adds one subcommand to the program; they lie in files of their own.
Command InfoCommand(CLI::App& program);
Command ConvertCommand(CLI::App& program);
Command ReconstructCommand(CLI::App& program);
Command AlignCommand(CLI::App& program);
Command CalibrateCommand(CLI::App& program);
Command MotionCommand(CLI::App& program);
Command TrackCommand(CLI::App& program);
Command ScoreCommand(CLI::App& program);
Command StitchCommand(CLI::App& program);
Command EmbedCommand(CLI::App& program);
Command NoiseCommand(CLI::App& program);
Command ProbeFitCommand(CLI::App& program);
Command PhantomCommand(CLI::App& program);
Command SynthesizeCommand(CLI::App& program);
Command ShellCommand(CLI::App& program);
Command ViewCommand(CLI::App& program);

} // namespace echorama
