// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Session.h"
#include <CLI/App.hpp>
#include <functional>
#include <string>

namespace echorama {

/// What a subcommand does when its options have been read. It reports failure by throwing; an Error of the kind
/// InvalidParameter means wrong usage.
using Action = std::function<void(Session&)>;

/// Throws Error(InvalidParameter).
[[noreturn]] inline void Misused(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

/// Each subcommand is a library of its own, libEchoramaCommand-NAME.so, which the program loads when the command was chosen:
/// whoever asks info what a file holds does not wait for what draws, deforms and registers. This is the function that each of
/// them defines: it adds the options of the command, and tells what is done with them. Name and help of the command lie in
/// main.cxx, which lists them without loading any.
extern "C" ECHORAMA_PROGRAM_EXPORT void EchoramaCommand(CLI::App* options, Action& action);

} // namespace echorama
