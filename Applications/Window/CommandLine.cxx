// SPDX-License-Identifier: BSD-3-Clause
#include "CommandLine.h"
#include "Applications/echorama/ManPage.h"
#include <cstdio>
#include <cstring>
#include <QCommandLineParser>

namespace echorama {

void CommandLine::AddTo(QCommandLineParser& parser) const
{
  parser.setApplicationDescription(help);
  parser.addHelpOption();
  parser.addVersionOption();
  parser.addOptions(options);
  parser.addPositionalArgument(argument, argumentHelp, "[" + argument + "...]");
}

bool CommandLine::PrintManPage(int argc, char** argv) const
{
  if (argc != 2 || std::strcmp(argv[1], "--man") != 0)
    return false;
  ManPage page{program.toStdString(), help.toStdString(), {}, {}, "0 when its window was closed; anything else: wrong usage."};
  page.options.push_back({argument.toStdString(), "", argumentHelp.toStdString(), true});
  for (const QCommandLineOption& option : options)
    page.options.push_back(
        {"--" + option.names().last().toStdString(), option.valueName().toStdString(), option.description().toStdString()});
  std::fputs(page.Text().c_str(), stdout);
  return true;
}

} // namespace echorama
