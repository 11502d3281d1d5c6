// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>

namespace echorama {

/// A fluid, as an interface meets it.
struct Fluid {
  double impedance = 1.54;    ///< MRayl, > 0
  double soundSpeed = 1540.0; ///< m/s, > 0
};

/// What a plane interface of two fluids does to a plane wave. With rough numbers: water to liver turns back 0.2% of the
/// energy, muscle to bone 40%, tissue to air all but 0.1%.
struct InterfaceResponse {
  /// Pressure of the reflected wave beside the incoming one, in [-1, 1]: negative when the other side is softer. Beyond the
  /// critical angle its size is 1 and its sign that of the real part: phases between are not told.
  double reflected = 0.0;
  double reflectedEnergy = 0.0;   ///< R, in [0, 1]
  double transmittedEnergy = 1.0; ///< T = 1 - R; also the amplitude of an echo that passes there and back
  double cosTransmitted = 1.0;    ///< of the angle between the transmitted ray and the normal; 0 beyond the critical angle
  bool total = false;             ///< total reflection
};

/// The response to a ray that comes in at an angle of arccos(\a cosIncidence) from the normal; clamped to [0, 1], and at 0
/// (grazing) all is reflected, unless the two fluids are equal.
/// Source: the reflection of plane waves at the plane interface of two fluids, e.g. Kinsler, Fundamentals of Acoustics, 6.4.
InterfaceResponse MeetInterface(const Fluid& from, const Fluid& to, double cosIncidence);

/// How much of the pressure that a surface reflects turns back to where it came from, in [0, 1]: a Gaussian in the angle to the
/// normal (of standard deviation \a acceptance, radians) and, by the roughness, a Lambert lobe of which the aperture catches a
/// part.
double TurnedBack(double cosIncidence, double roughness, double acceptance);

/// The mirrored direction. \a normal is a unit vector, on either side.
Eigen::Vector3d Mirrored(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal);

/// The direction of the transmitted ray by Snell's law. \a normal is a unit vector against \a direction (also a unit vector),
/// \a speedRatio the speed of sound behind the interface over that before it. Not for total reflection.
Eigen::Vector3d Refracted(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal, double speedRatio,
                          double cosTransmitted);

/// \a across carried along when the ray turns from one direction to another: turned by the smallest rotation between them.
Eigen::Vector3d CarriedThroughBend(const Eigen::Vector3d& across, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

} // namespace echorama
