// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodyView.h"
#include "ImageView.h"
#include "Scan.h"
#include "SimulatorWindow.h"
#include "WindowHands.h"
#include <cmath>
#include <functional>
#include <QFile>

/// A simulator on the screen.
class SimulatorUnderTest : public WindowHands {
public:
  SimulatorUnderTest() { ShowWindow(&window_); }

  echorama::SimulatorWindow& Window() { return window_; }
  echorama::Scan& Scan() { return *window_.TheScan(); }
  echorama::ImageView& Image() { return *window_.Image(); }
  bool Open(const QStringList& files, const QString& skin = {})
  {
    window_.Open(files, skin);
    const bool done = Wait(30000);
    Frame();
    return done;
  }
  /// Makes and shows what waits.
  void Frame()
  {
    Settle();
    Scan().MakeNow();
    window_.Body()->DrawNow();
    Settle();
  }
  /// Presses a key that moves the probe, and shows what it then sees.
  void Move(Qt::Key key, Qt::KeyboardModifiers keys = {}, int times = 1)
  {
    for (int i = 0; i < times; i++)
      Key(key, keys);
    Frame();
  }
  Eigen::Vector3d Place() { return Scan().ProbeToWorld().translation(); }
  Eigen::Vector3d Axis(int i) { return Scan().ProbeToWorld().linear().col(i); }
  /// The grey level at a place of the plane (mm), -1 where nothing is seen.
  int GreyAt(double across, double depth)
  {
    const echorama::PlanePicture& picture = Scan().Picture();
    const QPoint pixel = picture.PixelAt({across, depth});
    if (!picture.image.rect().contains(pixel) || qAlpha(picture.image.pixel(pixel)) == 0)
      return -1;
    return qGray(picture.image.pixel(pixel));
  }

private:
  echorama::SimulatorWindow window_;
};

/// An ellipsoid of tissue: half axes of 40, 35 and 45 mm about the origin, voxels of 1.5 mm.
namespace body {
inline const Eigen::Vector3d HalfAxes(40.0, 35.0, 45.0);
inline double Level(const Eigen::Vector3d& at) ///< 1 on the skin
{
  return at.cwiseQuotient(HalfAxes).norm();
}

/// Writes a MetaImage of bytes; \a grey says what is inside. \param scale how much larger everything is, \a grey is not told
inline QString Write(const QDir& folder, const QString& name, const std::function<double(const Eigen::Vector3d&)>& grey,
                     double scale = 1.0)
{
  constexpr int side = 68;
  constexpr double spacing = 1.5, first = -0.5 * (side - 1) * spacing;
  QByteArray voxels(side * side * side, '\0');
  for (int k = 0; k < side; k++)
    for (int j = 0; j < side; j++)
      for (int i = 0; i < side; i++) {
        const Eigen::Vector3d at = Eigen::Vector3d::Constant(first) + spacing * Eigen::Vector3d(i, j, k);
        if (Level(at) <= 1.0)
          voxels[(k * side + j) * side + i] =
              static_cast<char>(static_cast<unsigned char>(std::lround(std::fmin(std::fmax(grey(at), 0.0), 255.0))));
      }
  const QString path = folder.filePath(name);
  QFile file(path);
  if (!file.open(QIODevice::WriteOnly))
    qFatal("cannot write %s", qPrintable(path));
  const QByteArray size = QByteArray::number(side), corner = QByteArray::number(scale * first),
                   mm = QByteArray::number(scale * spacing);
  file.write("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
             "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = " +
             corner + " " + corner + " " + corner + "\nElementSpacing = " + mm + " " + mm + " " + mm + "\nDimSize = " + size +
             " " + size + " " + size + "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + voxels);
  return path;
}

/// Grey tissue with a bright ball of 5 mm in the middle.
inline QString WriteWithBall(const QDir& folder, const QString& name = "body.mha")
{
  return Write(folder, name, [](const Eigen::Vector3d& at) { return at.norm() < 5.0 ? 250.0 : 100.0; });
}

/// A ball of liver in air, with one of another material 30 mm below its top, which is at the origin.
inline QString WriteScene(const QDir& folder, const QString& name = "scene.json", const QByteArray& stone = "bone")
{
  QFile file(folder.filePath(name));
  if (!file.open(QIODevice::WriteOnly))
    qFatal("cannot write %s", qPrintable(file.fileName()));
  file.write(R"({"schema": "echorama-scene-1", "name": "ball", "background": "air", "tissue": [
    {"name": "body", "sphere": {"centre": [0, 0, 60], "radius": 60, "material": "liver"}},
    {"name": "stone", "sphere": {"centre": [0, 0, 30], "radius": 6, "material": ")" +
             stone + R"("}}],
    "views": {"poses": [{"face": [0, 0, 0], "target": [0, 0, 50], "fan": [1, 0, 0]}]}})");
  return file.fileName();
}
} // namespace body
