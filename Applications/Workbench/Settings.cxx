// SPDX-License-Identifier: BSD-3-Clause
// A settings file may be of another version or edited by hand: what it says is taken when it makes sense.
#include "Settings.h"
#include <QSettings>
#include <QStringList>

namespace echorama {

namespace {

void Read(const QSettings& file, const char* key, double& value, double least, double most)
{
  bool isNumber = false;
  const double stored = file.value(key).toDouble(&isNumber);
  if (isNumber && stored >= least && stored <= most)
    value = stored;
}

void Read(const QSettings& file, const char* key, int& value, int least, int most)
{
  double stored = value;
  Read(file, key, stored, least, most);
  value = static_cast<int>(stored);
}

void Read(const QSettings& file, const char* key, bool& value)
{
  value = file.value(key, value).toBool();
}

void Read(const QSettings& file, const char* key, QString& value, const QStringList& words)
{
  const QString stored = file.value(key).toString();
  if (words.contains(stored))
    value = stored;
}

} // namespace

void Load(QSettings& file, BrushSettings& brush)
{
  Read(file, "brush/radiusMm", brush.radiusMm, 0.1, 100.0);
  Read(file, "brush/intensity", brush.intensity, -1e9, 1e9);
  Read(file, "brush/opacity", brush.opacity, 0.0, 1.0);
  Read(file, "brush/hardness", brush.hardness, 0.0, 1.0);
  Read(file, "brush/insideValid", brush.insideValid);
}

void Save(QSettings& file, const BrushSettings& brush)
{
  file.setValue("brush/radiusMm", brush.radiusMm);
  file.setValue("brush/intensity", brush.intensity);
  file.setValue("brush/opacity", brush.opacity);
  file.setValue("brush/hardness", brush.hardness);
  file.setValue("brush/insideValid", brush.insideValid);
}

// What is shown, and how, starts the same each day: a window that opens with a difference picture looks broken.
void Load(QSettings& file, SliceLook& look)
{
  Read(file, "slices/linear", look.linear);
  Read(file, "slices/squarePixels", look.squarePixels, 4, 400);
}

void Save(QSettings& file, const SliceLook& look)
{
  file.setValue("slices/linear", look.linear);
  file.setValue("slices/squarePixels", look.squarePixels);
}

void Load(QSettings& file, VolumeLook& look)
{
  Read(file, "volume/style", look.style, {"points", "volume", "outline"});
  Read(file, "volume/downsampling", look.downsampling, 1, 64);
  Read(file, "volume/particleSize", look.particleSize, 0.1, 10.0);
  Read(file, "volume/opacity", look.opacity, 0.0, 1.0);
  Read(file, "volume/valueOpacity", look.valueOpacity);
  Read(file, "volume/slices", look.slices);
}

void Save(QSettings& file, const VolumeLook& look)
{
  file.setValue("volume/style", look.style);
  file.setValue("volume/downsampling", look.downsampling);
  file.setValue("volume/particleSize", look.particleSize);
  file.setValue("volume/opacity", look.opacity);
  file.setValue("volume/valueOpacity", look.valueOpacity);
  file.setValue("volume/slices", look.slices);
}

void Load(QSettings& file, Handling& handling)
{
  Read(file, "handling/translationSensitivity", handling.translationSensitivity, 0.01, 10.0);
  Read(file, "handling/rotationSensitivity", handling.rotationSensitivity, 0.01, 10.0);
  Read(file, "handling/translationStepMm", handling.translationStepMm, 0.001, 100.0);
  Read(file, "handling/rotationStepDegrees", handling.rotationStepDegrees, 0.001, 90.0);
}

void Save(QSettings& file, const Handling& handling)
{
  file.setValue("handling/translationSensitivity", handling.translationSensitivity);
  file.setValue("handling/rotationSensitivity", handling.rotationSensitivity);
  file.setValue("handling/translationStepMm", handling.translationStepMm);
  file.setValue("handling/rotationStepDegrees", handling.rotationStepDegrees);
}

} // namespace echorama
