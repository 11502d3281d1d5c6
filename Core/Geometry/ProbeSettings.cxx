// SPDX-License-Identifier: BSD-3-Clause
#include "ProbeSettings.h"
#include "Core/Base/Angles.h"

namespace echorama {

ParameterList Describe(ProbeSettings& p)
{
  return {
      Parameter("FanAngle", p.fanAngle, {0, 359.999}, "degrees", "Angle between the first and the last beam of a fan."),
      Parameter("FanWidth", p.fanWidth, {0, 10000}, "mm", "Length of the array along its arc."),
      Parameter("SweepAngle", p.sweepAngle, {0, 359.999}, "degrees",
                "Angle that the array sweeps. With an angle and a width of 0 the sweep is a single plane."),
      Parameter("SweepWidth", p.sweepWidth, {0, 10000}, "mm", "Length of the arc that the middle of the array travels."),
      Parameter("DepthMin", p.depthMin, {-10000, 10000}, "mm", "First depth along the beams, from the face."),
      Parameter("DepthMax", p.depthMax, {-10000, 10000}, "mm", "Last depth along the beams, from the face."),
      Parameter("Position", p.position, {}, "mm", "Where the middle of the probe's face lies in the world."),
      Parameter("Orientation", p.orientation, {}, "degrees",
                "How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x."),
  };
}

ParameterList Describe(ConvexProbeSettings& p)
{
  ParameterList list = Describe(static_cast<ProbeSettings&>(p));
  Named(list, "SweepAngle").help = "Angle that the array sweeps.";
  Named(list, "FanWidth") = Parameter("FanRadius", p.fanRadius, {0, 10000}, "mm", "Radius of the array's arc.");
  Named(list, "SweepWidth") =
      Parameter("SweepRadius", p.sweepRadius, {0, 10000}, "mm",
                "Distance of the sweep's axis behind the middle of the face. The edges of the fan must stay in front of it.");
  return list;
}

PlacedProbe ConvexProbeSettings::Place() const
{
  PlacedProbe placed = ProbeSettings::Place();
  placed.geometry.fanWidth = placed.geometry.fanAngle * fanRadius;
  placed.geometry.sweepWidth = placed.geometry.sweepAngle * sweepRadius;
  return placed;
}

PlacedProbe ProbeSettings::Place() const
{
  PlacedProbe placed;
  placed.geometry.fanAngle = fanAngle / DegreesPerRadian;
  placed.geometry.fanWidth = fanWidth;
  placed.geometry.sweepAngle = sweepAngle / DegreesPerRadian;
  placed.geometry.sweepWidth = sweepWidth;
  placed.geometry.depthMin = depthMin;
  placed.geometry.depthMax = depthMax;
  placed.probeToWorld.linear() = ExpRotation(orientation / DegreesPerRadian);
  placed.probeToWorld.translation() = position;
  return placed;
}

} // namespace echorama
