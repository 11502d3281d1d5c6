// SPDX-License-Identifier: BSD-3-Clause
#include "CommandLine.h"
#include "SimulatorWindow.h"
#include "Theme.h"
#include <cstdio>
#include <QApplication>
#include <QCommandLineParser>
#include <QSurfaceFormat>
#include <QVTKOpenGLNativeWidget.h>

int main(int argc, char** argv)
{
  const QCommandLineOption skin("skin",
                                "A mesh (.stl, .ply, .obj, .vtp) in mm of the volume's world to scan on. Default: the "
                                "outline of the first volume.",
                                "FILE");
  const QCommandLineOption top("top",
                               "The side that is scanned: x, -x, y, -y, z or -z of the world. Default: from where the volume "
                               "was scanned, if it says so, else the front of a patient, -y.",
                               "AXIS");
  const echorama::CommandLine line{"echorama-simulator",
                                   "Moves a probe over a body and shows what it would see, live.",
                                   {skin, top},
                                   "FILE",
                                   "What is scanned: volumes (where several are real, the first counts), or a scene (.json); "
                                   "and states of it under a probe that presses (.vti)."};
  if (line.PrintManPage(argc, argv))
    return 0;
  QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
  format.setSamples(0); // without a GPU smoothed edges cost more than they are worth
  QSurfaceFormat::setDefaultFormat(format);
  QCoreApplication::setAttribute(Qt::AA_EnableHighDpiScaling);
  QApplication application(argc, argv);
  QApplication::setOrganizationName("Echorama");
  QApplication::setApplicationName("Simulator");
  QApplication::setApplicationVersion(ECHORAMA_VERSION);

  QCommandLineParser options;
  line.AddTo(options);
  options.process(application);

  const QString axis = options.value(top);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  if (options.isSet(top)) {
    const int which = axis.isEmpty() ? -1 : QString("xyz").indexOf(axis.right(1));
    if (which < 0 || (axis.size() > 1 && axis.left(axis.size() - 1) != "-")) {
      std::fprintf(stderr, "echorama-simulator: --top must be x, -x, y, -y, z or -z, not %s\n", qPrintable(axis));
      return 2;
    }
    up[which] = axis.startsWith('-') ? -1.0 : 1.0;
  }

  echorama::ApplyTheme(application);
  echorama::SimulatorWindow window;
  window.show();
  if (!options.positionalArguments().isEmpty())
    window.Open(options.positionalArguments(), options.value(skin), up);
  return QApplication::exec();
}
