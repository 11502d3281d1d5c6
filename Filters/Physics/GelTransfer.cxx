// SPDX-License-Identifier: BSD-3-Clause
// Both transfers go over the 27 nodes of one particle after the other, in vectors of four doubles: the components of a node. That
// needs no conflict to be resolved, where several particles at a time would. Doubles cost what floats would, and keep
// momentum to rounding. Strains are advanced for eight particles at a time.
//
// A particle hands a node at the offset d the momentum w (m v + A d) with A = m C - dt V (4 / h^2) stress: along a row of nodes
// one addition per node.
#include "GelTransfer.h"
#include <algorithm>
#include <array>

namespace echorama {
namespace {

using GelQuad = double __attribute__((vector_size(32)));

// A wall keeps this much of the gel that it has touched, in cells: gel parts within itself, not from what it wets.
constexpr double filmCells = 0.35;
constexpr double roomy = 0.6, crowded = 1.15; // the part of space that is filled, beyond what particles' places make of it
constexpr double trust = 0.1;                 // in that, a step

// The lowest node of a particle, its weights along one axis, and the distance to that node.
struct GelSpline {
  int lowest;
  double weight[3];
  double toLowest; // mm
};

[[gnu::always_inline]] inline void FindGelSpline(double position, double origin, double cell, double perCell, GelSpline& spline)
{
  const double at = (position - origin) * perCell;
  int lowest = static_cast<int>(at - 0.5);
  lowest = lowest < 0 ? 0 : lowest > 3 ? 3 : lowest; // rounding at a block's border
  const double f = at - lowest;
  spline.lowest = lowest;
  spline.weight[0] = 0.5 * (1.5 - f) * (1.5 - f);
  spline.weight[2] = 0.5 * (f - 0.5) * (f - 0.5);
  spline.weight[1] = 1.0 - spline.weight[0] - spline.weight[2];
  spline.toLowest = -f * cell;
}

void ScatterGelParticles(const GelLaw& law, const GelTransferFrame& frame, const GelParticle* particles,
                         const std::int32_t* order, int count, GelNode* tile)
{
  const double cell = frame.cellMm, perCell = 1.0 / cell;
  for (int n = 0; n < count; ++n) {
    const GelParticle& p = particles[order[n]];
    GelSpline x, y, z;
    FindGelSpline(p.position[0], frame.origin[0], cell, perCell, x);
    FindGelSpline(p.position[1], frame.origin[1], cell, perCell, y);
    FindGelSpline(p.position[2], frame.origin[2], cell, perCell, z);

    const double mass = law.density * p.volume;
    const double* b = p.strain.b;
    const double pull = -frame.seconds * p.volume * 4.0 * perCell * perCell, shear = pull * law.shear;
    const double mean = (b[0] + b[1] + b[2]) * (1.0 / 3.0);
    const double pressure = pull * 0.5 * law.bulk * (p.strain.J * p.strain.J - 1.0);
    const double xx = shear * (b[0] - mean) + pressure, yy = shear * (b[1] - mean) + pressure,
                 zz = shear * (b[2] - mean) + pressure;
    const double xy = shear * b[3], xz = shear * b[4], yz = shear * b[5];
    const double* C = p.gradient;
    const GelQuad alongX = {mass * C[0] + xx, mass * C[3] + xy, mass * C[6] + xz, 0.0};
    const GelQuad alongY = {mass * C[1] + xy, mass * C[4] + yy, mass * C[7] + yz, 0.0};
    const GelQuad alongZ = {mass * C[2] + xz, mass * C[5] + yz, mass * C[8] + zz, 0.0};
    const GelQuad own = {mass * p.velocity[0], mass * p.velocity[1], mass * p.velocity[2], mass};
    const GelQuad stepX = alongX * cell, stepY = alongY * cell, stepZ = alongZ * cell;
    GelQuad slice = own + alongX * x.toLowest + alongY * y.toLowest + alongZ * z.toLowest;
    GelNode* corner = tile + (z.lowest * GelGrid::TileSize + y.lowest) * GelGrid::TileSize + x.lowest;
    for (int k = 0; k < 3; ++k) {
      GelQuad row = slice;
      for (int j = 0; j < 3; ++j) {
        GelQuad* nodes = reinterpret_cast<GelQuad*>(corner + (k * GelGrid::TileSize + j) * GelGrid::TileSize);
        const double weight = z.weight[k] * y.weight[j];
        GelQuad value = row;
        nodes[0] += value * (weight * x.weight[0]);
        value += stepX;
        nodes[1] += value * (weight * x.weight[1]);
        value += stepX;
        nodes[2] += value * (weight * x.weight[2]);
        row += stepY;
      }
      slice += stepZ;
    }
  }
}

// Holds back what would leave the film. \param corner the distances of the particle's 27 nodes; \param at its place in cells
[[gnu::always_inline]] inline void KeepGelFilm(const GelTransferFrame& frame, const double* corner, std::array<double, 3> at,
                                               GelQuad& velocity)
{
  static constexpr std::ptrdiff_t stride[3] = {1, GelGrid::TileSize, GelGrid::TileSize * GelGrid::TileSize};
  for (std::size_t axis = 0; axis < 3; ++axis) // to the cell that holds it
    if (at[axis] >= 1.0) {
      at[axis] -= 1.0;
      corner += stride[axis];
    }
  const double fx = at[0], fy = at[1], fz = at[2];
  const auto d = [corner](int x, int y, int z) { return corner[x + y * stride[1] + z * stride[2]]; };
  const double x00 = d(1, 0, 0) - d(0, 0, 0), x10 = d(1, 1, 0) - d(0, 1, 0);
  const double x01 = d(1, 0, 1) - d(0, 0, 1), x11 = d(1, 1, 1) - d(0, 1, 1);
  const double a00 = d(0, 0, 0) + fx * x00, a10 = d(0, 1, 0) + fx * x10;
  const double a01 = d(0, 0, 1) + fx * x01, a11 = d(0, 1, 1) + fx * x11;
  const double low = a00 + fy * (a10 - a00), high = a01 + fy * (a11 - a01), wall = low + fz * (high - low);
  const double film = filmCells * frame.cellMm;
  if (wall > 1.15 * film)
    return;
  const double perCell = 1.0 / frame.cellMm;
  const double nx = perCell * ((1.0 - fz) * ((1.0 - fy) * x00 + fy * x10) + fz * ((1.0 - fy) * x01 + fy * x11));
  const double ny = perCell * ((1.0 - fz) * (a10 - a00) + fz * (a11 - a01)), nz = perCell * (high - low);
  const double square = nx * nx + ny * ny + nz * nz;
  const double over = wall + frame.seconds * (nx * velocity[0] + ny * velocity[1] + nz * velocity[2]) - film;
  if (over > 0.0 && square > 0.25)
    velocity -= GelQuad{nx, ny, nz, 0.0} * (over / (frame.seconds * square));
}

// Velocity and gradient of up to GelLanes particles.
void GatherGelParticles(const GelTransferFrame& frame, GelParticle* particles, const std::int32_t* order, int count,
                        const GelNode* tile, GelStrainLanes& lanes, double* fill)
{
  const double cell = frame.cellMm, perCell = 1.0 / cell, spread = 4.0 * perCell * perCell;
  for (int n = 0; n < count; ++n) {
    GelParticle& p = particles[order[n]];
    GelSpline x, y, z;
    FindGelSpline(p.position[0], frame.origin[0], cell, perCell, x);
    FindGelSpline(p.position[1], frame.origin[1], cell, perCell, y);
    FindGelSpline(p.position[2], frame.origin[2], cell, perCell, z);
    const double x0 = x.weight[0], x1 = x.weight[1], x2 = x.weight[2];
    const double m0 = x0 * x.toLowest, m1 = x1 * (x.toLowest + cell), m2 = x2 * (x.toLowest + 2.0 * cell);
    GelQuad velocity = {}, alongX = {}, alongY = {}, alongZ = {};
    const GelNode* corner = tile + (z.lowest * GelGrid::TileSize + y.lowest) * GelGrid::TileSize + x.lowest;
    for (int k = 0; k < 3; ++k) {
      GelQuad slice = {}, sliceX = {}, sliceY = {};
      for (int j = 0; j < 3; ++j) {
        const GelQuad* nodes = reinterpret_cast<const GelQuad*>(corner + (k * GelGrid::TileSize + j) * GelGrid::TileSize);
        const GelQuad a = nodes[0], b = nodes[1], c = nodes[2];
        const GelQuad row = (a * x0 + b * x1 + c * x2) * y.weight[j];
        slice += row;
        sliceX += (a * m0 + b * m1 + c * m2) * y.weight[j];
        sliceY += row * (y.toLowest + j * cell);
      }
      velocity += slice * z.weight[k];
      alongX += sliceX * z.weight[k];
      alongY += sliceY * z.weight[k];
      alongZ += slice * (z.weight[k] * (z.toLowest + k * cell));
    }
    fill[n] = velocity[3];
    if (frame.walls)
      KeepGelFilm(frame, frame.walls + (z.lowest * GelGrid::TileSize + y.lowest) * GelGrid::TileSize + x.lowest,
                  {-x.toLowest * perCell, -y.toLowest * perCell, -z.toLowest * perCell}, velocity);
    for (int axis = 0; axis < 3; ++axis) {
      p.velocity[axis] = velocity[axis];
      p.position[axis] += frame.seconds * velocity[axis];
      lanes.C[3 * axis][n] = p.gradient[3 * axis] = spread * alongX[axis];
      lanes.C[3 * axis + 1][n] = p.gradient[3 * axis + 1] = spread * alongY[axis];
      lanes.C[3 * axis + 2][n] = p.gradient[3 * axis + 2] = spread * alongZ[axis];
    }
    for (int c = 0; c < 6; ++c)
      lanes.b[c][n] = p.strain.b[c];
    lanes.J[n] = p.strain.J;
  }
}

} // namespace

void ScatterGel(const GelLaw& law, const GelTransferFrame& frame, const GelParticle* particles, const std::int32_t* order,
                int count, GelNode* tile)
{
  std::fill(tile, tile + GelGrid::TileNodes, GelNode{});
  ScatterGelParticles(law, frame, particles, order, count, tile);
}

int GatherGel(const GelLaw& law, const GelTransferFrame& frame, GelParticle* particles, const std::int32_t* order, int count,
              const GelNode* tile)
{
  int torn = 0;
  GelStrainLanes lanes{};
  double fill[GelLanes];
  for (int begin = 0; begin < count; begin += GelLanes) {
    const int some = std::min(GelLanes, count - begin);
    for (int l = some; l < GelLanes; ++l) { // at rest
      for (auto& component : lanes.C)
        component[l] = 0.0;
      for (int c = 0; c < 6; ++c)
        lanes.b[c][l] = c < 3 ? 1.0 : 0.0;
      lanes.J[l] = 1.0;
    }
    GatherGelParticles(frame, particles, order + begin, some, tile, lanes, fill);
    torn += AdvanceGelStrain(law, frame.seconds, some, lanes);
    for (int l = 0; l < some; ++l) {
      GelStrain& strain = particles[order[begin + l]].strain;
      for (int c = 0; c < 6; ++c)
        strain.b[c] = lanes.b[c][l];
      strain.J = lanes.J[l];
      // Compressed where there is room, or stretched where there is none: the flow did not tell J the truth, as before a wall
      // that gel has not touched yet.
      if (strain.J < 1.0 ? fill[l] < roomy : fill[l] > crowded)
        strain.J += trust * (1.0 - strain.J);
    }
  }
  return torn;
}

} // namespace echorama
