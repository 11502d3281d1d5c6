// SPDX-License-Identifier: BSD-3-Clause
#include "ManPage.h"
#include <algorithm>
#include <cctype>

namespace echorama {
namespace {

std::string Troff(const std::string& plain)
{
  std::string text;
  for (const char letter : plain) {
    const bool begins = text.empty() || text.back() == '\n';
    if (begins && (letter == '.' || letter == '\''))
      text += "\\&";
    text += letter == '\\' ? "\\e" : letter == '-' ? "\\-" : letter == '\n' ? "\n.br\n" : std::string(1, letter);
  }
  return text;
}

std::string Entries(const std::vector<ManEntry>& entries)
{
  std::string text;
  for (const ManEntry& entry : entries)
    text += ".TP\n\\fB" + Troff(entry.name) + "\\fR" + (entry.value.empty() ? "" : " \\fI" + Troff(entry.value) + "\\fR") +
            (entry.several ? " ..." : "") + "\n" + Troff(entry.help) + "\n" +
            (entry.parts.empty() ? "" : ".RS\n" + Entries(entry.parts) + ".RE\n");
  return text;
}

} // namespace

std::string ManPage::Text() const
{
  std::string title = command, capitals;
  std::replace(title.begin(), title.end(), ' ', '-');
  for (const char letter : title)
    capitals += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  std::string text = ".TH " + Troff(capitals) + " 1 \"\" \"echorama " ECHORAMA_VERSION "\" \"Echorama\"\n.SH NAME\n" +
                     Troff(title) + " \\- " + Troff(help) + "\n.SH SYNOPSIS\n\\fB" + Troff(command) + "\\fR";
  for (const ManEntry& entry : options)
    if (entry.name[0] != '-')
      text += " \\fI" + Troff(entry.name) + "\\fR" + (entry.several ? " ..." : "");
  text += commands.empty() ? " [\\fIoptions\\fR]\n" : " \\fIcommand\\fR ...\n.SH COMMANDS\n" + Entries(commands);
  return text + (options.empty() ? "" : ".SH OPTIONS\n" + Entries(options)) + ".SH EXIT STATUS\n" + Troff(ending) + "\n" +
         (command == "echorama" ? "" : ".SH SEE ALSO\n.BR echorama (1)\n");
}

} // namespace echorama
