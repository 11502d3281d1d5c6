// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What commands say of themselves for other programs. All of it follows from their options, so from the descriptions of
// parameters.
#include <CLI/App.hpp>
#include <string>

namespace echorama {

/// The description of a command in the XML of Slicer's Execution Model, from which 3D Slicer makes a form. \a name is that of the
/// whole command: "calibrate rig".
std::string SlicerDescription(const CLI::App& command, const std::string& name);

/// The manual page, in troff, of a program or of one of its commands: \a command is "echorama", with its commands, or "echorama
/// align", with its options. \a ending is what the exit status tells.
std::string ManPageOf(const CLI::App& app, const std::string& command, const std::string& ending);

/// A script for bash that completes commands, options, and what options may be.
std::string BashCompletion(const CLI::App& program);

} // namespace echorama
