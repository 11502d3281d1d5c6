// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Live/LiveProbe.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/ProbePresets.h"
#include <cmath>

namespace echorama {
namespace {

// Sizes usual of radial probes for bronchi: a window of 1 mm radius, 20 MHz, some 3 cm deep. All figures are chosen.
constexpr double radialRadius = 1.0, radialDepth = 30.0, customDepth = 100.0;

const ProbePreset& PresetOf(LiveProbe kind)
{
  switch (kind) {
  case LiveProbe::Linear:
    return ProbePresetOf("linear");
  case LiveProbe::Phased:
    return ProbePresetOf("phased");
  case LiveProbe::Endocavity:
    return ProbePresetOf("endocavity-3d");
  default:
    return ProbePresetOf("curvilinear");
  }
}

// Round the whole circle, without the first beam once more.
void CloseCircle(ProbeGeometry& probe, double radius, int beams)
{
  probe.fanAngle = 2.0 * Pi * (beams - 1) / beams;
  probe.fanWidth = radius * probe.fanAngle;
}

} // namespace

Transducer TransducerOf(const LiveProbeSettings& s)
{
  Transducer lens = PresetOf(s.kind).transducer;
  if (s.kind == LiveProbe::Radial) {
    lens.frequencyMHz = 20.0;
    lens.lateralApertureMm = lens.elevationApertureMm = 2.0;
    lens.lateralFocusMm = lens.elevationFocusMm = 10.0;
  } else if (s.kind == LiveProbe::Custom) {
    lens.elevationFocusMm = 0.5 * (s.depthMm > 0.0 ? s.depthMm : customDepth);
  }
  return lens;
}

ParameterList Describe(LiveProbeSettings& s)
{
  return {
      Parameter("Probe", Choice(s.kind, {"convex", "linear", "phased", "endocavity", "radial", "custom"}),
                "The probe: its array, and how deep it usually looks. Radial: all round, as in vessels and bronchi."),
      Parameter("DepthMm", s.depthMm, {0, 1000}, "mm", "How deep the image is. 0: as usual for the probe (custom: 100 mm)."),
      Parameter("FanAngle", s.fanAngle, {0, 360}, "degrees", "Angle between the first and the last beam; 360: all round.")
          .When("Probe", "custom"),
      Parameter("FanWidth", s.fanWidth, {0, 1000}, "mm", "Length of the array along its arc.").When("Probe", "custom"),
      Parameter("DepthMin", s.depthMin, {-1000, 1000}, "mm", "First depth along the beams, from the face.")
          .When("Probe", "custom"),
  };
}

ProbeGeometry GeometryOf(const LiveProbeSettings& s, int beams)
{
  CheckRanges(s);
  ProbeGeometry probe = PresetOf(s.kind).probe;
  if (s.kind == LiveProbe::Radial) {
    CloseCircle(probe, radialRadius, beams);
    probe.depthMax = radialDepth;
  } else if (s.kind == LiveProbe::Custom) {
    probe = ProbeGeometry::Linear(s.fanWidth, 0.0, s.depthMin, customDepth);
    probe.fanAngle = s.fanAngle * RadiansPerDegree;
    if (s.fanAngle == 360.0)
      CloseCircle(probe, s.fanWidth / (2.0 * Pi), beams);
  }
  probe.sweepAngle = probe.sweepWidth = 0.0;
  if (s.depthMm > 0.0)
    probe.depthMax = s.depthMm;
  probe.Check();
  return probe;
}

double FocusOf(const LiveProbeSettings& s)
{
  return TransducerOf(s).elevationFocusMm;
}

BeamThickness ThicknessOf(const LiveProbeSettings& s, double focusMm)
{
  Transducer lens = TransducerOf(s);
  lens.elevationFocusMm = focusMm;
  constexpr double widthPerSigma = 2.3548200450309493; // 2 sqrt(2 ln 2)
  // The squared width of such a beam is face^2 (1 - z / F)^2 + waist^2 (z / F)^2: a hyperbola about a place before F.
  const double face = widthPerSigma * lens.elevationApertureMm / Transducer::sigmasPerAperture / std::sqrt(2.0);
  const double waist = widthPerSigma * WidthAt(lens, focusMm).elevationSigma, both = std::hypot(face, waist);
  BeamThickness thickness;
  thickness.focusMm = focusMm * (face / both) * (face / both);
  thickness.thicknessMm = face * waist / both;
  thickness.divergence = both / focusMm;
  return thickness;
}

} // namespace echorama
