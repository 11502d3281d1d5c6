// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Live/SkinShape.h"
#include <Eigen/Geometry>

namespace echorama {

ParameterList Describe(SkinParameters& p)
{
  return {
      Parameter("MostCells", p.mostCells, {1000, 50000000}, "",
                "In how many cells, at most, the valid region of a volume is looked at: more follow it closer, and take longer."),
      Parameter("SmoothingSteps", p.smoothingSteps, {0, 200}, "", "How often its points are smoothed; 0: steps of cells stay."),
      Parameter("PassBand", p.passBand, {0.001, 2}, "", "Smaller values take more of what is rough away, and of what is fine.")
          .Advanced(),
  };
}

int OutermostBody(const TissueSurface& tissue)
{
  std::vector<Eigen::AlignedBox3f> boxes(tissue.bodies.size());
  for (std::size_t i = 0; i < tissue.triangles.size(); i++)
    for (const std::uint32_t corner : tissue.triangles[i])
      boxes[static_cast<std::size_t>(tissue.bodyOfTriangle[i])].extend(tissue.points[corner]);
  int outermost = -1;
  float longest = -1.0f;
  for (std::size_t body = 0; body < boxes.size(); body++)
    if (!boxes[body].isEmpty() && boxes[body].diagonal().norm() > longest) {
      outermost = static_cast<int>(body);
      longest = boxes[body].diagonal().norm();
    }
  return outermost;
}

} // namespace echorama
