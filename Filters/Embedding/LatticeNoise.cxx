// SPDX-License-Identifier: BSD-3-Clause
// White noise draws each row from a stream of its own. Gradient noise tabulates, for each octave, the directions at the
// corners of its cells and the blending along each axis; a voxel is then eight ramps.
#include "LatticeNoise.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace echorama {

ParameterList Describe(LatticeNoiseParameters& p)
{
  return {
      Parameter("Deviation", p.deviation, {0, Unlimited}, "", "Standard deviation of the intensities of white and Perlin noise.")
          .When("Kind", "white")
          .When("Kind", "perlin"),
      Parameter("CellMm", p.cellMm, {0, Unlimited, true}, "mm",
                "Distance of the gradients of Perlin noise, at least that of the voxels.")
          .When("Kind", "perlin"),
      Parameter("Octaves", p.octaves, {1, 10}, "",
                "Octaves of Perlin noise, each with half the cell and half the amplitude of the one before.")
          .When("Kind", "perlin"),
  };
}

namespace {

[[noreturn]] void Fail(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, "noise: " + reason);
}

void Check(const LatticeNoiseParameters& p)
{
  if (!std::isfinite(p.mean))
    Fail("Mean is not finite");
  CheckRanges(p);
}

// From 0 to 1, with no slope and no curvature at both ends.
double Blend(double t)
{
  return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

// The variance of one octave of amplitude 1, in the mean over a cell: eight corners, each (w |d|)^2 / 3 for unit directions, w
// being the product of the weights along the axes and d the offset.
double CellVariance()
{
  constexpr int steps = 1000;
  double weight = 0.0, moment = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) / steps, w = 1.0 - Blend(t);
    weight += w * w / steps;
    moment += w * w * t * t / steps;
  }
  return 8.0 * moment * weight * weight;
}

// Where the voxels of one axis lie in the cells.
struct CellAxis {
  CellAxis(int count, double cellsPerVoxel)
  {
    for (int i = 0; i < count; ++i) {
      const double at = i * cellsPerVoxel;
      cell.push_back(static_cast<int>(at));
      offset.push_back(static_cast<float>(at - cell.back()));
      share.push_back(static_cast<float>(Blend(at - cell.back())));
    }
  }
  int Corners() const { return cell.back() + 2; }
  std::vector<int> cell;
  std::vector<float> offset, share;
};

void AddOctave(const LatticeNoiseParameters& p, const ImageGeometry& grid, int octave, float amplitude, VolumeView<float> noise,
               const Progress& progress)
{
  const Eigen::Vector3d cells = grid.spacing / (p.cellMm / (1 << octave));
  const auto& n = grid.dimensions;
  const CellAxis x(n[0], cells[0]), y(n[1], cells[1]), z(n[2], cells[2]);
  std::vector<Eigen::Vector3f> gradients(static_cast<std::size_t>(x.Corners()) * static_cast<std::size_t>(y.Corners()) *
                                         static_cast<std::size_t>(z.Corners()));
  const std::ptrdiff_t rowCorners = x.Corners(), sliceCorners = rowCorners * y.Corners();
  ParallelFor(z.Corners(), progress.Part(0.0, 0.5), [&](std::ptrdiff_t slice) {
    Random random(p.seed, static_cast<std::uint64_t>(octave) << 32 | static_cast<std::uint64_t>(slice));
    for (std::ptrdiff_t i = 0; i < sliceCorners; ++i)
      gradients[static_cast<std::size_t>(slice * sliceCorners + i)] = random.Direction().cast<float>();
  });
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  ParallelFor(n[2], progress.Part(0.5, 1.0), [&](std::ptrdiff_t slice) {
    const auto k = static_cast<std::size_t>(slice);
    for (int row = 0; row < n[1]; ++row) {
      const auto j = static_cast<std::size_t>(row);
      const Eigen::Vector3f* corner = gradients.data() + z.cell[k] * sliceCorners + y.cell[j] * rowCorners;
      float* out = noise.Row(row, static_cast<int>(slice));
      for (std::size_t i = 0; i < x.cell.size(); ++i) {
        const auto ramp = [&](int dx, int dy, int dz) {
          const Eigen::Vector3f& g = corner[dz * sliceCorners + dy * rowCorners + x.cell[i] + dx];
          return g.x() * (x.offset[i] - static_cast<float>(dx)) + g.y() * (y.offset[j] - static_cast<float>(dy)) +
                 g.z() * (z.offset[k] - static_cast<float>(dz));
        };
        const auto line = [&](int dy, int dz) { return mix(ramp(0, dy, dz), ramp(1, dy, dz), x.share[i]); };
        const auto plane = [&](int dz) { return mix(line(0, dz), line(1, dz), y.share[j]); };
        out[i] += amplitude * mix(plane(0), plane(1), z.share[k]);
      }
    }
  });
}

} // namespace

Volume<float> MakeWhiteNoise(const LatticeNoiseParameters& p, const std::array<int, 3>& n, const Progress& progress)
{
  Check(p);
  if (n[0] < 1 || n[1] < 1 || n[2] < 1)
    throw Error(Error::Kind::BadInput, "noise: the dimensions of its grid are not positive");
  Volume<float> noise(n);
  ParallelFor(static_cast<std::ptrdiff_t>(n[1]) * n[2], progress, [&](std::ptrdiff_t row) {
    Random random(p.seed, static_cast<std::uint64_t>(row));
    float* out = noise.View().Data() + row * n[0];
    for (int i = 0; i < n[0]; ++i)
      out[i] = static_cast<float>(p.mean + p.deviation * random.Normal());
  });
  return noise;
}

Volume<float> MakePerlinNoise(const LatticeNoiseParameters& p, const ImageGeometry& grid, const Progress& progress)
{
  Check(p);
  grid.Check("the grid of the noise");
  const double voxel = grid.spacing.maxCoeff();
  if (!(p.cellMm >= voxel && std::isfinite(p.cellMm)))
    Fail("cellMm is " + NumberText(p.cellMm) + "; it is at least the spacing of the grid, " + NumberText(voxel));
  int octaves = 1;
  double power = 1.0; // sum of the squares of the amplitudes
  while (octaves < p.octaves && p.cellMm / (1 << octaves) >= voxel)
    power += std::pow(0.25, octaves++);
  const double first = p.deviation / std::sqrt(CellVariance() * power);
  Volume<float> noise(grid.dimensions, static_cast<float>(p.mean));
  for (int octave = 0; octave < octaves; ++octave)
    AddOctave(p, grid, octave, static_cast<float>(first * std::pow(0.5, octave)), noise.View(),
              progress.Part(static_cast<double>(octave) / octaves, (octave + 1.0) / octaves));
  return noise;
}

} // namespace echorama
