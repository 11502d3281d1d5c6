// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Live/BeamThickness.h"
#include "Filters/Live/MachineControls.h"
#include <optional>

namespace echorama {

/// A straight tool in the world.
struct Needle {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();        ///< mm
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(); ///< unit, the way it goes in; the shaft lies behind the tip

  /// Of a tool's pose: the tip is its origin, the direction its z axis. \throws Error(BadInput) when it is not rigid
  static Needle Of(const Pose& toolToWorld);
  Pose ToWorld() const; ///< such a pose
  /// \throws Error(BadInput) when it is not finite, or the direction is no unit vector
  void Check() const;
};

/// How a needle looks in an image. For the eye: a model of what is seen, not of sound. Levels are in dB of white at a gain of 0.
struct NeedleLook {
  double lengthMm = 150.0;       ///< of the shaft
  double echoDb = 6.0;           ///< square to the beam, in the middle of the plane
  double mirrorDegrees = 12.0;   ///< standard deviation of the mirror's lobe: how fast it fades away from 90 degrees to the beam
  double roughDb = -28.0;        ///< what is left at any angle
  double widthMm = 1.2;          ///< across the beams, full width at half of the height
  double pulseMm = 0.6;          ///< along the beams, likewise
  double reverberationMm = 1.5;  ///< between echoes within the needle; 0: there are none
  double reverberationDb = -7.0; ///< from one to the next
  double shadowDb = 6.0;         ///< below it, where it covers the middle of the plane
  bool showTip = false;          ///< the tip echoes at any angle and is marked: what a learner must not see
  double tipDb = 0.0;
};

ParameterList Describe(NeedleLook& look);

/// Where a needle is as the plane of a probe sees it.
struct NeedleSight {
  double seenMm = 0.0;             ///< of the shaft, within the fan and half of the plane's sensitivity (-6 dB)
  double strongestDb = -Unlimited; ///< echo of what is drawn
  bool tipInPlane = false;         ///< the tip is within the fan and -6 dB of the plane's middle
  double tipOffPlaneMm = 0.0;      ///< along y of the probe
  std::optional<BeamPoint> tip;    ///< where a mark belongs: only when it may be shown, and is in the plane
};

/// Draws a needle into the beams of a plane: greys from 0 to 255 as BeamDevelopment makes them (samples x beams x 1, evenly over
/// depths and fan). It is bright where it crosses the thickness of the plane, by the Gaussian of the image itself; fades away
/// from 90 degrees to the beam; rings below that, the less the more it is tilted; and darkens what lies below. Out of the plane
/// there is nothing. Echoes add up as powers with the image's own, before they become greys. \param controls those that the greys
/// were made with: range, gain and the time-gain curve \param content of each sample (BeamContent), or empty: where there is no
/// image there is no needle either \throws Error(InvalidParameter) for a look out of range, a probe that sweeps or a view of
/// other dimensions, Error(BadInput) for a needle or a pose that is not finite and rigid
NeedleSight DrawNeedle(const NeedleLook& look, const Needle& needle, const PlacedProbe& probe, const BeamThickness& thickness,
                       const MachineControls& controls, VolumeView<float> value, VolumeView<const unsigned char> content = {});

} // namespace echorama
