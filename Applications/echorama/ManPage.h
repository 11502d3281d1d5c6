// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Manual pages in troff. What they say comes from where options are read: those of CLI11 by Describe.h, those of Qt by
// Applications/Window/CommandLine.h.
#include <string>
#include <vector>

namespace echorama {

/// An option ("-o, --output", with the value "FILE"), something positional (a name alone), or a command.
struct ManEntry {
  std::string name, value, help;
  bool several = false; ///< it may be given again and again
  std::vector<ManEntry> parts{};
};

struct ManPage {
  std::string command, help;               ///< "echorama align", and what it does
  std::vector<ManEntry> commands, options; ///< of the options, positional ones are in order
  std::string ending;                      ///< what the exit status tells

  std::string Text() const;
};

} // namespace echorama
