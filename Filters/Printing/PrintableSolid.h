// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Phantoms/CalibrationRig.h"
#include "ProbeMesh.h"
#include <functional>

namespace echorama {

/// A solid for a 3D printer, as the distance to its surface: mm, negative inside. Exact near the surface but for edges, beyond
/// which it may be too small (never too large), as for all unions and cuts of shapes.
struct PrintableSolid {
  std::function<double(const Eigen::Vector3d&)> distance;
  Eigen::AlignedBox3d bounds; ///< holds all of it; it stands on z = 0

  /// The point moved onto the surface along the distance's gradient, by no more than \a limitMm.
  Eigen::Vector3d Snapped(const Eigen::Vector3d& point, double limitMm) const;
};

/// The calibration rig without its glass plate, as one piece: base, pins and balls. It lies as it is printed, pins up: half a
/// turn about the x axis and the plate's depth away from the rig in the world, PrintToRig(). Same parameters, same geometry as
/// MakeCalibrationRig.
/// \throws Error(InvalidParameter) as CalibrationRigParameters::Check(), and for a rig without base or pins: it would fall apart.
PrintableSolid PrintableRig(const CalibrationRigParameters& parameters = {});

/// From where the rig is printed to the world of the synthetic scene.
Pose PrintToWorld(const CalibrationRigParameters& parameters);

/// A clip that holds a tracker's sensor to the handle of a probe, away from its metal and electronics (dissertation 4.1.1): a
/// sleeve, open on one side, with grooves for cable ties; an arm; and a pocket for the sensor.
struct ProbeClipParameters {
  double handleWidthMm = ProbeHousing().handleWidthMm, handleThicknessMm = ProbeHousing().handleThicknessMm;
  double lengthMm = 36.0;
  double wallMm = 3.0;
  double clearanceMm = 0.4;
  double openingMm = 12.0;
  int tieGrooves = 2;
  double tieWidthMm = 4.0; ///< the depth of a groove is a third of the wall
  double armMm = 70.0;
  double standOffMm = 15.0;
  double armWidthMm = 10.0;
  Eigen::Vector3d sensorMm{8.2, 8.2, 20.0}; ///< the Ascension 800 is 8 x 8 x 20
  double sensorClearanceMm = 0.2;

  /// \throws Error(InvalidParameter) for what is out of its range, an opening of more than 0.9 of the handle's width, and a
  /// sleeve that is too short for its arm and grooves.
  void Check() const;

  /// Where the middle of the sensor's pocket is, with x along the fan, y along the sweep and z the probe's, from the middle of
  /// the sleeve on the handle's axis: a first guess of the calibration.
  Eigen::Vector3d SensorPlace() const;
};
ParameterList Describe(ProbeClipParameters& p);

/// It stands on the front end of its sleeve: z is the probe's -z, from that end. \throws Error(InvalidParameter) as Check().
PrintableSolid PrintableClip(const ProbeClipParameters& parameters = {});

} // namespace echorama
