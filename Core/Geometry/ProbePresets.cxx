// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/ProbePresets.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <algorithm>

namespace echorama {
namespace {

Transducer Array(double frequencyMHz, double bandwidth, double lateralAperture, double lateralFocus, double elevationAperture,
                 double elevationFocus)
{
  Transducer transducer;
  transducer.frequencyMHz = frequencyMHz;
  transducer.bandwidth = bandwidth;
  transducer.lateralApertureMm = lateralAperture;
  transducer.lateralFocusMm = lateralFocus;
  transducer.elevationApertureMm = elevationAperture;
  transducer.elevationFocusMm = elevationFocus;
  return transducer;
}

} // namespace

const std::vector<ProbePreset>& ProbePresets()
{
  static const std::vector<ProbePreset> presets{
      {"curvilinear", "Curvilinear (2D)", ProbeGeometry::Convex(127 * 0.508 / 49.57, 49.57, 0.0, 0.0, 0.0, 150.0), 128, 1, 640,
       Array(3.57, 0.79, 24.0, 80.0, 13.5, 60.0),
       "Verasonics C5-2v as the MUST toolbox lists it: radius 49.57 mm, 128 elements at a pitch of 0.508 mm, 3.57 MHz, 79%, "
       "13.5 mm high, lens at 60 mm. Depth, and the aperture and focus along the fan, are chosen."},
      {"linear", "Linear (2D)", ProbeGeometry::Linear(127 * 0.3, 0.0, 0.0, 50.0), 128, 1, 512,
       Array(7.6, 0.77, 12.0, 30.0, 5.0, 18.0),
       "Verasonics L11-5v as the MUST toolbox lists it: 128 elements at a pitch of 0.3 mm, 7.6 MHz, 77%, 5 mm high, lens at "
       "18 mm. Depth, and the aperture and focus along the fan, are chosen."},
      {"phased", "Phased (2D)", ProbeGeometry::Phased(80.0 * RadiansPerDegree, 0.0, 0.0, 160.0), 128, 1, 512,
       Array(2.72, 0.74, 19.2, 80.0, 14.0, 60.0),
       "Verasonics P4-2v as the MUST toolbox lists it: 64 elements at a pitch of 0.3 mm, all of which make each beam, 2.72 "
       "MHz, 74%, 14 mm high, lens at 60 mm. Angle, beams, depth and the focus along the fan are chosen."},
      {"endocavity-3d", "Endocavity 3D",
       ProbeGeometry::Convex(120.0 * RadiansPerDegree, 10.35, 75.0 * RadiansPerDegree, 10.35, 0.0, 60.0), 128, 96, 512,
       Array(9.0, 0.67, 7.0, 30.0, 5.0, 30.0),
       "Both radii are those that a Kretz file of a GE RIC6-12-D records (10.35 mm); 9 MHz and 67% make the 6 to 12 MHz of "
       "its name. Angles, beams, planes, depth, apertures and foci are chosen."},
      {"mechanical-3d", "Mechanical 3D (curvilinear)",
       ProbeGeometry::Convex(70.0 * RadiansPerDegree, 40.0, 65.0 * RadiansPerDegree, 30.0, 0.0, 150.0), 128, 128, 512,
       Array(3.5, 0.7, 20.0, 80.0, 12.0, 70.0),
       "No one model: sizes usual of abdominal probes whose curved array is swept by a motor (array of 40 mm radius, 2 to 5 "
       "MHz). All figures are chosen."},
  };
  return presets;
}

const ProbePreset& ProbePresetOf(const std::string& name)
{
  const std::vector<ProbePreset>& all = ProbePresets();
  const auto found = std::find_if(all.begin(), all.end(), [&name](const ProbePreset& preset) { return preset.name == name; });
  if (found != all.end())
    return *found;
  std::string names;
  for (const ProbePreset& preset : all)
    names += (names.empty() ? "" : ", ") + preset.name;
  throw Error(Error::Kind::InvalidParameter, "there is no probe preset \"" + name + "\"; there are " + names);
}

} // namespace echorama
