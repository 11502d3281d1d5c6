// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/Landmark.h"
#include "Filters/Tissue/TissueSurface.h"
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace echorama {

/// A rig of balls on pins, glued to a glass plate in a bath of water, to calibrate a tracked probe by (dissertation 4.1.2). A
/// probe at the origin looks down on it along +z.
///
/// Sound is slower in water than a scanner assumes, so that depths come out too large: by 1540 / 1482 at 20 degrees, 3.9 %.
struct CalibrationRigParameters {
  struct Ball {
    std::string name;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< mm, in the rig: z = 0 is the plate's upper side, -z is up to the probe
    double radius = 4.0;                              ///< mm, in [0.5, 30]
  };

  /// Seven balls of different radii and heights. The distances of any two pairs differ by 1.7 mm at least, so that
  /// each ball is known by its neighbours, too. None lies above another.
  std::vector<Ball> balls = DefaultBalls();
  double scale = 1.0;             ///< size of the whole rig, in [0.2, 5]
  double plateDepthMm = 105.0;    ///< z of the plate's upper side in the world, in [10, 500]
  double plateMm = 6.0;           ///< thickness of the glass, in [0, 50]; 0: no plate, base and stems
  double baseMm = 2.0;            ///< thickness of the slab on the glass that the pins stand on, in [0, 20]; 0: none
  double stemRadiusMm = 1.2;      ///< of the pins that carry the balls, in [0, 5]; 0: none
  double waterCelsius = 20.0;     ///< in [0, 95]; the bath's speed of sound follows
  double detailMm = 0.5;          ///< edge of the triangles of the balls, in [0.1, 5]
  std::string material = "nylon"; ///< of the balls and stems, a standard one

  static std::vector<Ball> DefaultBalls();

  /// Throws Error(InvalidParameter) that names what is out of its range; also for balls that touch each other, the plate or the
  /// base.
  void Check() const;

  /// Radius of the pin under a ball, mm: never wider than the ball.
  double StemRadius(const Ball& ball) const;
  /// What the base covers, mm, at the rig's scale: the feet of all pins and 6 mm around them (less below a scale of 0.3).
  Eigen::AlignedBox2d BaseOutline() const;
};

/// Speed of sound in pure water at atmospheric pressure, m/s, for a temperature in [0, 95] degrees Celsius: the polynomial of
/// Marczak, J. Acoust. Soc. Am. 102, 1997.
double WaterSoundSpeed(double celsius);

/// Makes the rig: the background is water of that temperature, the bodies are plate, base, stems and balls.
/// \throws Error(InvalidParameter) as Check(), Error(Cancelled).
TissueSurface MakeCalibrationRig(const CalibrationRigParameters& parameters, const Progress& progress = {});

/// The truth: the centres of the balls in the world, mm, each by its name.
std::vector<Landmark> CalibrationLandmarks(const CalibrationRigParameters& parameters);

} // namespace echorama
