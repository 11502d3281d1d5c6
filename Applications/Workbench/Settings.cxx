// SPDX-License-Identifier: BSD-3-Clause
// A settings file may be of another version or edited by hand: what it says is taken when it makes sense.
#include "Settings.h"
#include <QSettings>
#include <QStringList>

namespace echorama {

namespace {

// What is remembered, under which key, in which range or of which words. What is shown, and how, starts the same each day: a
// window that opens with a difference picture looks broken.
template <class Visitor>
void ForEach(Settings& settings, const Visitor& visit)
{
  auto& [brush, slices, volume, handling] = settings;
  visit("brush/radiusMm", brush.radiusMm, 0.1, 100.0);
  visit("brush/intensity", brush.intensity, -1e9, 1e9);
  visit("brush/opacity", brush.opacity, 0.0, 1.0);
  visit("brush/hardness", brush.hardness, 0.0, 1.0);
  visit("brush/insideValid", brush.insideValid);
  visit("slices/linear", slices.linear);
  visit("slices/squarePixels", slices.squarePixels, 4, 400);
  visit("volume/style", volume.style, QStringList{"points", "volume", "outline"});
  visit("volume/downsampling", volume.downsampling, 1, 64);
  visit("volume/particleSize", volume.particleSize, 0.1, 10.0);
  visit("volume/opacity", volume.opacity, 0.0, 1.0);
  visit("volume/valueOpacity", volume.valueOpacity);
  visit("volume/slices", volume.slices);
  visit("handling/translationSensitivity", handling.translationSensitivity, 0.01, 10.0);
  visit("handling/rotationSensitivity", handling.rotationSensitivity, 0.01, 10.0);
  visit("handling/translationStepMm", handling.translationStepMm, 0.001, 100.0);
  visit("handling/rotationStepDegrees", handling.rotationStepDegrees, 0.001, 90.0);
}

struct Read {
  const QSettings& file;
  template <class Value>
  void operator()(const char* key, Value& value, double least, double most) const
  {
    bool isNumber = false;
    const double stored = file.value(key).toDouble(&isNumber);
    if (isNumber && stored >= least && stored <= most)
      value = static_cast<Value>(stored);
  }
  void operator()(const char* key, bool& value) const { value = file.value(key, value).toBool(); }
  void operator()(const char* key, QString& value, const QStringList& words) const
  {
    const QString stored = file.value(key).toString();
    if (words.contains(stored))
      value = stored;
  }
};

} // namespace

Settings Remembered()
{
  Settings settings;
  const QSettings file;
  ForEach(settings, Read{file});
  return settings;
}

void Remember(Settings settings)
{
  QSettings file;
  ForEach(settings, [&file](const char* key, const auto& value, const auto&...) { file.setValue(key, value); });
}

} // namespace echorama
