// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QCommandLineOption>
#include <QList>
#include <QString>

class QCommandLineParser;

namespace echorama {

/// The command line of a program with a window, told once: for its parser, its help and its manual page.
struct CommandLine {
  QString program, help;
  QList<QCommandLineOption> options;
  QString argument, argumentHelp; ///< of the files to open, any number

  void AddTo(QCommandLineParser& parser) const; ///< and help and version
  /// Prints the manual page when \a argv is --man alone. Called before there is an application, which needs a screen.
  /// \returns whether it was.
  bool PrintManPage(int argc, char** argv) const;
};

} // namespace echorama
