// SPDX-License-Identifier: BSD-3-Clause
// A node lies where eight blocks meet; the depth of one that touches a block that is taken is 0, that of another its exact
// distance to the nearest such node. So a block that is taken has eight nodes of depth 0, and is 0 all over.
//
// Cost: once a distance map of the nodes, a 64th of the voxels; then eight nodes for a place.
#include "Filters/Live/BorderDistance.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include <algorithm>
#include <cmath>

namespace echorama {

BorderDistance::BorderDistance(const ImageGeometry& geometry, const std::function<bool(int, int, int)>& isTaken)
{
  std::array<int, 3> nodes, ring;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    nodes[axis] = (geometry.dimensions[axis] + blockEdge - 2) / blockEdge + 1;
    ring[axis] = nodes[axis] + 1; // the blocks between them, and one on each side
  }
  Volume<unsigned char> taken(ring), border(nodes);
  ParallelFor(ring[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < ring[1]; ++j)
      for (int i = 0; i < ring[0]; ++i)
        taken.View()(i, j, k) = isTaken(i - 1, j - 1, k - 1) ? 1 : 0;
  });
  ParallelFor(nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < nodes[1]; ++j)
      for (int i = 0; i < nodes[0]; ++i)
        for (int corner = 0; corner < 8; ++corner)
          border.View()(i, j, k) |= taken.View()(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
  });
  Volume<float> squares(nodes);
  SquaredDistanceMap(border.View(), blockEdge * geometry.spacing, squares.View());
  mm_.resize(static_cast<std::size_t>(squares.View().Size()));
  std::transform(squares.View().begin(), squares.View().end(), mm_.begin(),
                 [](float square) { return std::min(std::sqrt(square), farthestMm); });
  std::copy(nodes.begin(), nodes.end(), nodes_);
}

float BorderDistance::At(float x, float y, float z) const
{
  const float at[3] = {x / blockEdge, y / blockEdge, z / blockEdge};
  int cell[3];
  std::ptrdiff_t next[3] = {1, nodes_[0], static_cast<std::ptrdiff_t>(nodes_[0]) * nodes_[1]};
  float part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float place = std::clamp(at[axis], 0.0f, static_cast<float>(nodes_[axis] - 1));
    cell[axis] = std::min(static_cast<int>(place), std::max(0, nodes_[axis] - 2));
    part[axis] = place - static_cast<float>(cell[axis]);
    if (nodes_[axis] < 2)
      next[axis] = 0; // a single voxel
  }
  const float* node = mm_.data() + cell[2] * next[2] + cell[1] * next[1] + cell[0];
  const auto along = [&](const float* a) { return a[0] + part[0] * (a[next[0]] - a[0]); };
  const auto plane = [&](const float* a) { return along(a) + part[1] * (along(a + next[1]) - along(a)); };
  return plane(node) + part[2] * (plane(node + next[2]) - plane(node));
}

} // namespace echorama
