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
  double handleWidthMm = ProbeHousing().handleWidthMm;         ///< of the handle along the fan, as in ProbeHousing, in [5, 200]
  double handleThicknessMm = ProbeHousing().handleThicknessMm; ///< along the sweep, in [5, 200]
  double lengthMm = 36.0;                                      ///< of the sleeve, along the handle, in [10, 200]
  double wallMm = 3.0;                                         ///< in [1, 20]
  double clearanceMm = 0.4; ///< between sleeve and handle, for a printer's tolerance or a rubber coat, in [0, 5]
  double openingMm = 12.0;  ///< width of the open side, in [0, 0.9 of the handle's width]; 0: a ring that is pushed on
  int tieGrooves = 2;       ///< in [0, 8]
  double tieWidthMm = 4.0;  ///< of a groove, in [1, 15]; its depth is a third of the wall
  double armMm = 70.0;      ///< from the handle's middle to the sensor's, backwards along the handle, in [0, 300]
  double standOffMm = 15.0; ///< from the sleeve to the sensor, sideways, in [0, 100]
  double armWidthMm = 10.0; ///< in [3, 50]
  Eigen::Vector3d sensorMm{8.2, 8.2, 20.0}; ///< across, sideways, along the handle; in [1, 80]. The Ascension 800 is 8 x 8 x 20
  double sensorClearanceMm = 0.2;           ///< on each side of the sensor, in [0, 3]

  void Check() const; ///< Throws Error(InvalidParameter) that names what is out of its range.

  /// Where the middle of the sensor's pocket is, with x along the fan, y along the sweep and z the probe's, from the middle of
  /// the sleeve on the handle's axis: a first guess of the calibration.
  Eigen::Vector3d SensorPlace() const;
};

/// It stands on the front end of its sleeve: z is the probe's -z, from that end. \throws Error(InvalidParameter) as Check().
PrintableSolid PrintableClip(const ProbeClipParameters& parameters = {});

} // namespace echorama
