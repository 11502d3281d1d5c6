// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/Transducer.h"
#include "Filters/Live/BeamThickness.h"

namespace echorama {

/// The probes of a live image: each is a single plane.
enum class LiveProbe {
  Convex,
  Linear,
  Phased,
  Endocavity,
  Radial, ///< all round, as in vessels and bronchi
  Custom,
};

struct LiveProbeSettings {
  LiveProbe kind = LiveProbe::Convex;
  double fanAngle = 60.0; ///< degrees; 360: all round. As what follows of a custom probe alone
  double fanWidth = 50.0, depthMin = 0.0;
  double depthMm = 0.0; ///< of any; 0: as usual for the probe
};

ParameterList Describe(LiveProbeSettings& s);

/// The middle plane of the probe. All round there is one beam in each of \a beams equal angles.
/// \throws Error(InvalidParameter)
ProbeGeometry GeometryOf(const LiveProbeSettings& settings, int beams);

/// How the probe sends, by its preset.
Transducer TransducerOf(const LiveProbeSettings& settings);

/// Where the lens of the probe focuses, mm (of a custom one: half as deep as the image).
double FocusOf(const LiveProbeSettings& settings);

/// How thick the plane of the probe is, by its lens (aperture and frequency of the preset): a Gaussian beam there and back, as
/// WidthAt() has it. It is thinnest a little before the focus.
BeamThickness ThicknessOf(const LiveProbeSettings& settings, double focusMm);

} // namespace echorama
