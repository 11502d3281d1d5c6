// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
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
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 4.0;
  };

  /// Seven balls of different radii and heights. The distances of any two pairs differ by 1.7 mm at least, so that
  /// each ball is known by its neighbours, too. None lies above another.
  std::vector<Ball> balls = DefaultBalls();
  double scale = 1.0;
  double plateDepthMm = 105.0;
  double plateMm = 6.0;
  double baseMm = 2.0;
  double stemRadiusMm = 1.2;
  double waterCelsius = 20.0;
  double detailMm = 0.5;
  std::string material = "nylon";

  static std::vector<Ball> DefaultBalls();

  /// Throws Error(InvalidParameter) that names what is out of its range; also for balls that touch each other, the plate or the
  /// base.
  void Check() const;

  /// Radius of the pin under a ball, mm: never wider than the ball.
  double StemRadius(const Ball& ball) const;
  /// What the base covers, mm, at the rig's scale: the feet of all pins and 6 mm around them (less below a scale of 0.3).
  Eigen::AlignedBox2d BaseOutline() const;
};

/// All but the balls.
ParameterList Describe(CalibrationRigParameters& p);
ParameterList Describe(CalibrationRigParameters::Ball& ball);

/// Speed of sound in pure water at atmospheric pressure, m/s, for a temperature in [0, 95] degrees Celsius: the polynomial of
/// Marczak, J. Acoust. Soc. Am. 102, 1997.
double WaterSoundSpeed(double celsius);

/// Makes the rig: the background is water of that temperature, the bodies are plate, base, stems and balls.
/// \throws Error(InvalidParameter) as Check(), Error(Cancelled).
TissueSurface MakeCalibrationRig(const CalibrationRigParameters& parameters, const Progress& progress = {});

/// The truth: the centres of the balls in the world, mm, each by its name.
std::vector<Landmark> CalibrationLandmarks(const CalibrationRigParameters& parameters);

} // namespace echorama
