// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QString>
#include <tuple>

namespace echorama {

/// What the left mouse button does in a slice.
enum class Tool { Look, Align, Paint, Carve, Restore, Mark, Measure, Angle };

/// The brush of Paint, Carve and Restore; see echorama::Brush.
struct BrushSettings {
  double radiusMm = 3.0;
  double intensity = 128.0;
  double opacity = 1.0;
  double hardness = 0.5;
  bool insideValid = true;
};

/// How slices are drawn; the words are those of vtkUltrasoundSliceView.
struct SliceLook {
  QString shown = "all";  ///< all, selected, others
  QString mode = "blend"; ///< blend, difference, checkerboard
  bool linear = true;
  int squarePixels = 40;
};

/// How the 3D view draws; the words are those of vtkUltrasoundVolumeView.
struct VolumeLook {
  QString style = "points"; ///< points, volume, outline
  int downsampling = 2;
  double particleSize = 1.0;
  double opacity = 0.3;
  bool valueOpacity = true;
  double minimum = 1.0, maximum = 255.0;
  bool slices = true;
  bool errorVectors = false;
};

/// How volumes follow the mouse (1: exactly) and keys.
struct Handling {
  double translationSensitivity = 1.0, rotationSensitivity = 1.0;
  double translationStepMm = 1.0, rotationStepDegrees = 1.0;
  QString constraint = "free"; ///< the word of vtkUltrasoundAlignmentRepresentation; not remembered
};

/// All that one window shares between its parts, and remembers from one start to the next.
using Settings = std::tuple<BrushSettings, SliceLook, VolumeLook, Handling>;

/// Values out of range are left as they are by default.
Settings Remembered();
void Remember(Settings settings);

} // namespace echorama
