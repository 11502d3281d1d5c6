// SPDX-License-Identifier: BSD-3-Clause
#include "WindowUnderTest.h"
#include "FileActions.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include <cmath>
#include <QFile>
#include <QSettings>
#include <QtTest>
#include <vtkMatrix4x4.h>

using namespace echorama;

WindowUnderTest::WindowUnderTest() : window_(std::make_unique<MainWindow>(workspace_))
{
  ShowWindow(window_.get());
}

WindowUnderTest::~WindowUnderTest() = default;

SliceCanvas* WindowUnderTest::Slice(int i)
{
  return window_->Views()->Slices()[static_cast<std::size_t>(i)]->Canvas();
}

bool WindowUnderTest::Open(const QStringList& paths)
{
  window_->Files()->Open(paths);
  return Wait(30000);
}

std::array<double, 16> WindowUnderTest::Pose(int id) const
{
  vtkNew<vtkMatrix4x4> matrix;
  Session()->GetVolumeToWorld(id, matrix);
  std::array<double, 16> pose;
  std::copy_n(matrix->GetData(), 16, pose.begin());
  return pose;
}

QImage WindowUnderTest::Screenshot(const QString& name)
{
  QTest::qWait(400); // full quality comes a moment after the last motion
  for (SlicePane* pane : window_->Views()->Slices())
    pane->Canvas()->DrawNow();
  window_->Views()->Volume()->DrawNow();
  Settle();
  return Grab(name);
}

// Without the guide, which a person closes who knows the way: the views have its place.
void WindowTest::init()
{
  FolderTest::init();
  QSettings().setValue("window/guide", false);
}

QString WindowTest::WriteVolume(const QString& name, int seed, std::array<double, 3> middle, int side, bool repeats)
{
  return ::WriteVolume(Folder(), name, seed, middle, side, repeats);
}

QString WriteVolume(const QDir& folder, const QString& name, int seed, std::array<double, 3> middle, int side, bool repeats)
{
  QByteArray voxels(side * side * side, '\0');
  unsigned int state = 12345u + static_cast<unsigned int>(seed);
  const auto random = [&state] { return (state = state * 1664525u + 1013904223u) >> 8; };
  for (int k = 2; k < side - 2; k++)
    for (int j = 2; j < side - 2; j++)
      for (int i = 2; i < side - 2; i++) {
        // The anatomy belongs to the world, so that volumes of different middles overlap in it.
        const double x = i - side / 2 + middle[0], y = j - side / 2 + middle[1], z = k - side / 2 + middle[2];
        const double wave = std::sin(0.21 * x + 0.5) * std::cos(0.17 * y) * std::sin(0.19 * z + 1.0);
        const double shell = std::exp(-std::pow(std::sqrt(x * x + y * y + 0.6 * z * z) - 17.0, 2) / 6.0);
        const double anatomy = (70.0 + 60.0 * wave + 90.0 * shell) * (0.7 + 0.6 * (random() % 1000) / 1000.0);
        const double turn = 2.0 * M_PI / 16.0; // per voxel
        const double grey = repeats ? 100.0 + 60.0 * std::sin(turn * x) * std::sin(turn * y) * std::sin(turn * z) : anatomy;
        voxels[(k * side + j) * side + i] = static_cast<char>(static_cast<unsigned char>(std::fmin(std::fmax(grey, 1.0), 255.0)));
      }
  const QString path = folder.filePath(name);
  QFile file(path);
  if (!file.open(QIODevice::WriteOnly))
    qFatal("cannot write %s", qPrintable(path));
  const auto corner = [&](int axis) { return QByteArray::number(middle[static_cast<std::size_t>(axis)] - side / 2); };
  const QByteArray size = QByteArray::number(side);
  file.write("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
             "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = " +
             corner(0) + " " + corner(1) + " " + corner(2) + "\nElementSpacing = 1 1 1\nDimSize = " + size + " " + size + " " +
             size + "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + voxels);
  return path;
}
