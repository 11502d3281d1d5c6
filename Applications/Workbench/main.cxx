// SPDX-License-Identifier: BSD-3-Clause
#include "CommandLine.h"
#include "MainWindow.h"
#include "Preferences.h"
#include "Theme.h"
#include "Translation.h"
#include "Workspace.h"
#include <QApplication>
#include <QCommandLineParser>
#include <QSurfaceFormat>
#include <QVTKOpenGLNativeWidget.h>

int main(int argc, char** argv)
{
  const QCommandLineOption project("project", "Open a project.", "FILE");
  const echorama::CommandLine line{"echorama-workbench",
                                   "Aligns, paints, stitches and scores overlapping 3D ultrasound volumes by hand.",
                                   {project},
                                   "VOLUME",
                                   "Volumes (or folders of slices, or poses) to open."};
  if (line.PrintManPage(argc, argv))
    return 0;
  QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
  format.setSamples(0); // slices are pictures; without a GPU smoothed edges cost more than they are worth
  QSurfaceFormat::setDefaultFormat(format);
  QApplication application(argc, argv);
  QApplication::setOrganizationName("Echorama");
  QApplication::setApplicationName("Workbench");
  QApplication::setApplicationVersion(ECHORAMA_VERSION);

  QCommandLineParser options;
  line.AddTo(options);
  options.process(application);

  const echorama::Preferences preferences = echorama::Preferences::Kept();
  echorama::InstallTranslation(application, preferences.language);
  echorama::ApplyTheme(application, preferences.theme);
  echorama::Workspace workspace;
  echorama::MainWindow window(workspace);
  window.show();
  window.Start(options.value(project), options.positionalArguments());
  return QApplication::exec();
}
