// SPDX-License-Identifier: BSD-3-Clause
// Evenly spaced planes, not the nodes of a Gauss-Hermite rule: what lies across the plane is texture, no polynomial. The sum over
// even nodes follows the Gaussian for all structure that is larger than two distances between them. Five planes are one standard
// deviation apart, nine a little more than half of one.
#include "Filters/Live/BeamThickness.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double sigmaPerWidth = 0.42466090014400953; // 1 / (2 sqrt(2 ln 2))
constexpr double reach = 2.5;                         // where the Gaussian is cut, in standard deviations

} // namespace

double BeamThickness::SigmaMm(double depthMm) const
{
  return thicknessMm > 0.0 ? sigmaPerWidth * std::hypot(thicknessMm, divergence * (depthMm - focusMm)) : 0.0;
}

double BeamThickness::ReachMm(double depthMin, double depthMax) const
{
  return reach * std::max(SigmaMm(depthMin), SigmaMm(depthMax));
}

ParameterList Describe(BeamThickness& t)
{
  return {
      Parameter(
          "ThicknessMm", t.thicknessMm, {0, 100}, "mm",
          "How thick the plane is that is seen, at the focus: full width at half of its sensitivity. 0: a slice as thin as a "
          "razor."),
      Parameter("FocusMm", t.focusMm, {0, 1000}, "mm", "Depth at which the plane is thinnest."),
      Parameter("Divergence", t.divergence, {0, 10}, "mm/mm", "How much thicker it becomes with the distance from the focus.")
          .Advanced(),
      Parameter("ThicknessPlanes", t.planes, {1, 65}, "",
                "How many planes are averaged for the thickness: the time of a frame is in proportion.")
          .Advanced(),
  };
}

std::vector<ThicknessPlane> PlanesOf(const BeamThickness& thickness)
{
  CheckRanges(thickness);
  if (thickness.thicknessMm == 0.0 || thickness.planes == 1)
    return {ThicknessPlane()};
  // Both sides of a Gaussian up to \a x standard deviations.
  const auto within = [](double x) { return std::erf(x / std::sqrt(2.0)); };
  const double step = 2.0 * reach / thickness.planes;
  std::vector<ThicknessPlane> planes;
  for (int p = 0; p < thickness.planes; ++p) {
    const double from = -reach + p * step;
    planes.push_back(
        {static_cast<float>(from + 0.5 * step), static_cast<float>(0.5 * (within(from + step) - within(from)) / within(reach))});
  }
  return planes;
}

} // namespace echorama
