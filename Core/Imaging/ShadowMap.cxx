// SPDX-License-Identifier: BSD-3-Clause
// The question is whether sound was at a voxel at all, and the only witness is an echo from there or from farther down the same
// beam. So in beam space the answer is a running maximum from the far end:
//
//   1. Cells. One pass over the voxels gathers blocks of about size / resolution: mean, least and largest value. Speckle is
//      averaged, and everything between here and step 5 is small.
//   2. Beams. The cells are read along beams, which are straight: a start and a step each. Each depth gets the grey of ordinary
//      tissue there, a quantile over beams, smoothed; it may follow attenuation down, but not below half of the whole image's.
//      Brightness becomes a level: 0 black, 1 ordinary tissue.
//   3. Witnesses. An opening along the beam (a minimum over the least length of an echo) takes specks away; the running maximum
//      from the far end is the best witness from each depth on; what most of the neighbouring beams agree on removes what is
//      not coherent. It never grows with depth, so each beam is reliable down to where it ruptures. Short dark tails are excused.
//   4. Back to cells, by the exact inverse of the geometry, clamped to the fan, so that ragged rims get their neighbours' answer;
//      times what saturation leaves: the share of voxels at the top value among 3 x 3 x 3 cells.
//   5. Cells to voxels, linearly; 0 where a voxel is not real.
//
// Random walks (Karamalis et al. 2012) ask for the same with a sparse system as large as the image, in which a bright reflector
// and a cyst both hold walkers up; here fluid is excused by the tissue behind it.
#include "Core/Imaging/ShadowMap.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

constexpr float Unreal = std::numeric_limits<float>::quiet_NaN();

// Quantiles, see the essay. Black: of the cells' least values. Tissue: of the cells' means at a depth. Bright: of all means.
constexpr double BlackQuantile = 0.01, TissueQuantile = 0.7, BrightQuantile = 0.99;
// Ordinary tissue at a depth is at least this part of what it is in the whole image, and of what is bright there.
constexpr float LeastOfImage = 0.5f, LeastOfBright = 0.25f;
// Half of the range of depths over which the grey of tissue is smoothed, as a part of the beam.
constexpr double DepthWindow = 0.05;
// Tissue is above black by at least this part of the range of all values, and so many steps of an integer.
constexpr float LeastOfRange = 0.02f, LeastSteps = 4.0f;
// Values closer to the largest, as a part of the range, are as large: interpolation has rounded them.
constexpr double TopMargin = 1e-3;

float Smoothstep(float from, float to, float x)
{
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// The value below which the part \a q of the values lies; they are put in another order.
float Quantile(std::vector<float>& values, double q)
{
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Whether a voxel is real, and as a float still a number.
template <class T>
class Reality {
public:
  explicit Reality(const PosedVolume<T>& volume) : sampler_(volume.intensity, volume.valid), intensity_(volume.intensity) {}
  bool operator()(std::ptrdiff_t voxel) const
  {
    if constexpr (std::is_same_v<T, double>)
      if (!(std::abs(intensity_[voxel]) <= static_cast<double>(std::numeric_limits<float>::max())))
        return false;
    return sampler_.IsReal(voxel);
  }

private:
  Sampler<T> sampler_;
  VolumeView<const T> intensity_;
};

//----------------------------------------------------------------------------------------------------------------------
// 1. Cells

struct Cells {
  std::array<int, 3> block{1, 1, 1}; // voxels of a cell along each axis
  ImageGeometry geometry;
  Volume<float> mean, least, largest; // of the real voxels; NaN where there are none
  Volume<int> count;                  // of real voxels
};

Cells CellsFor(const ImageGeometry& voxels, int resolution)
{
  Cells cells;
  cells.geometry = voxels;
  double size = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    size = std::max(size, voxels.dimensions[axis] * voxels.spacing[axis]);
  for (int axis = 0; axis < 3; ++axis) {
    const int n = voxels.dimensions[axis];
    const double wanted = size / resolution / voxels.spacing[axis];
    cells.block[axis] = static_cast<int>(std::clamp(std::floor(wanted + 0.5), 1.0, static_cast<double>(n)));
    cells.geometry.dimensions[axis] = (n + cells.block[axis] - 1) / cells.block[axis];
    cells.geometry.spacing[axis] *= cells.block[axis];
    cells.geometry.origin += 0.5 * (cells.block[axis] - 1) * voxels.spacing[axis] * voxels.direction.col(axis);
  }
  const auto& n = cells.geometry.dimensions;
  cells.mean = cells.least = cells.largest = Volume<float>(n, Unreal);
  cells.count = Volume<int>(n, 0);
  return cells;
}

// Calls body(cell, first voxel, count) for the pieces of rows that make up each cell of a slice of cells.
template <class Body>
void ForPieces(const Cells& cells, const std::array<int, 3>& n, int slice, const Body& body)
{
  const auto& m = cells.geometry.dimensions;
  const auto& b = cells.block;
  for (int k = slice * b[2]; k < std::min(n[2], (slice + 1) * b[2]); ++k)
    for (int j = 0; j < n[1]; ++j) {
      const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(k) * n[1] + j) * n[0];
      const std::ptrdiff_t cellRow = (static_cast<std::ptrdiff_t>(slice) * m[1] + j / b[1]) * m[0];
      for (int c = 0; c < m[0]; ++c)
        body(cellRow + c, row + static_cast<std::ptrdiff_t>(c) * b[0], std::min(b[0], n[0] - c * b[0]));
    }
}

template <class T>
Cells GatherCells(const PosedVolume<T>& volume, int resolution, const Progress& progress)
{
  Cells cells = CellsFor(volume.geometry, resolution);
  const Reality<T> isReal(volume);
  const auto mean = cells.mean.View(), least = cells.least.View(), largest = cells.largest.View();
  const auto count = cells.count.View();
  ParallelFor(cells.geometry.dimensions[2], progress, [&](std::ptrdiff_t slice) {
    std::vector<double> sums(static_cast<std::size_t>(mean.SliceStride()), 0.0);
    const std::ptrdiff_t first = slice * mean.SliceStride();
    ForPieces(cells, volume.geometry.dimensions, static_cast<int>(slice), [&](std::ptrdiff_t cell, std::ptrdiff_t voxel, int n) {
      for (std::ptrdiff_t i = voxel; i < voxel + n; ++i)
        if (isReal(i)) {
          const float value = static_cast<float>(volume.intensity[i]);
          const bool isFirst = count[cell]++ == 0;
          sums[static_cast<std::size_t>(cell - first)] += static_cast<double>(volume.intensity[i]);
          least[cell] = isFirst || value < least[cell] ? value : least[cell];
          largest[cell] = isFirst || value > largest[cell] ? value : largest[cell];
        }
    });
    for (std::ptrdiff_t cell = first; cell < first + mean.SliceStride(); ++cell)
      if (count[cell] > 0)
        mean[cell] = static_cast<float>(sums[static_cast<std::size_t>(cell - first)] / count[cell]);
  });
  return cells;
}

std::vector<float> RealValues(VolumeView<const float> values)
{
  std::vector<float> real;
  std::copy_if(values.begin(), values.end(), std::back_inserter(real), [](float v) { return v == v; });
  return real;
}

//----------------------------------------------------------------------------------------------------------------------
// 2. Beams

// How beams run through the cells: beam space has depth along x, then the fan, then the sweep (as in ScanConversion.h).
class BeamGrid {
public:
  // Along the beams of a probe.
  BeamGrid(const ImageGeometry& cells, const PlacedProbe& probe, int resolution)
    : probe_(probe.geometry), cellToProbe_(probe.probeToWorld.inverse() * cells.IndexToWorld()),
      probeToCell_(cellToProbe_.inverse()), behind_(probe.geometry.ReachesBehindAxis())
  {
    double cell = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      if (cells.dimensions[axis] > 1)
        cell = std::min(cell, cells.spacing[axis]);
    const double range = probe_.depthMax - probe_.depthMin, deep = probe_.depthMin + 2.0 / 3.0 * range;
    const auto cellsOf = [cell, resolution](double mm) {
      return static_cast<int>(std::clamp(std::ceil(std::abs(mm) / cell), 1.0, 4.0 * resolution)) + 1;
    };
    size_ = {cellsOf(range), cellsOf(probe_.Fan().Span(deep)), probe_.IsPlane() ? 1 : cellsOf(probe_.Sweep().Span(deep))};
  }

  // Along an axis of the grid.
  BeamGrid(const ImageGeometry& cells, int axis, bool reversed) : axis_(axis), reversed_(reversed)
  {
    for (int a = 0; a < 3; ++a)
      size_[a] = cells.dimensions[(axis + a) % 3];
  }

  const std::array<int, 3>& Size() const { return size_; }

  // The positions of the samples of a beam, in cells: first + step * sample.
  void Beam(int fan, int sweep, Eigen::Vector3d& first, Eigen::Vector3d& step) const
  {
    if (axis_ >= 0) {
      first[axis_] = reversed_ ? size_[0] - 1 : 0;
      first[(axis_ + 1) % 3] = fan;
      first[(axis_ + 2) % 3] = sweep;
      step = Eigen::Vector3d::Zero();
      step[axis_] = reversed_ ? -1.0 : 1.0;
      return;
    }
    BeamPoint place{probe_.depthMin, fan / (size_[1] - 1.0) - 0.5, size_[2] > 1 ? sweep / (size_[2] - 1.0) - 0.5 : 0.0};
    first = probeToCell_ * PointOf(probe_, place);
    place.depth = probe_.depthMax;
    step = (probeToCell_ * PointOf(probe_, place) - first) / (size_[0] - 1.0);
  }

  // Where a cell lies in beam space, in samples, clamped to it.
  Eigen::Vector3f SampleOf(const Eigen::Vector3d& cell) const
  {
    Eigen::Vector3d place;
    if (axis_ >= 0) {
      place = {reversed_ ? size_[0] - 1 - cell[axis_] : cell[axis_], cell[(axis_ + 1) % 3], cell[(axis_ + 2) % 3]};
    } else {
      const Eigen::Vector3d point = cellToProbe_ * cell;
      ProbeArc::Place plane = probe_.Sweep().PlaceOf(point.y(), point.z());
      if (behind_ && std::abs(plane.along) > 0.5) {
        const ProbeArc::Place other = probe_.Sweep().PlaceOf(point.y(), point.z(), true);
        plane = std::abs(other.along) <= 0.5 ? other : plane;
      }
      const ProbeArc::Place beam = probe_.Fan().PlaceOf(point.x(), plane.depth);
      place = {(beam.depth - probe_.depthMin) / (probe_.depthMax - probe_.depthMin) * (size_[0] - 1),
               (beam.along - probe_.fanOffset + 0.5) * (size_[1] - 1), (plane.along + 0.5) * (size_[2] - 1)};
    }
    for (int a = 0; a < 3; ++a)
      place[a] = std::min(std::max(place[a], 0.0), size_[a] - 1.0);
    return place.cast<float>();
  }

private:
  ProbeGeometry probe_;
  Eigen::Affine3d cellToProbe_ = Eigen::Affine3d::Identity(), probeToCell_ = Eigen::Affine3d::Identity();
  bool behind_ = false;
  int axis_ = -1;
  bool reversed_ = false;
  std::array<int, 3> size_{1, 1, 1};
};

// The means of the cells along the beams; NaN where nothing is real.
Volume<float> AlongBeams(const Cells& cells, const BeamGrid& grid, const Progress& progress)
{
  Volume<float> beams(grid.Size(), Unreal);
  const auto out = beams.View();
  const Sampler<float> sampler(cells.mean.View(), {});
  ParallelFor(out.Slices(), progress, [&](std::ptrdiff_t sweep) {
    for (int fan = 0; fan < grid.Size()[1]; ++fan) {
      Eigen::Vector3d first, step;
      grid.Beam(fan, static_cast<int>(sweep), first, step);
      float* beam = out.Row(fan, static_cast<int>(sweep));
      for (int d = 0; d < grid.Size()[0]; ++d) {
        const Eigen::Vector3d at = first + d * step;
        double value = 0.0;
        if (sampler.Linear(at.x(), at.y(), at.z(), value))
          beam[d] = static_cast<float>(value);
      }
    }
  });
  return beams;
}

// What is black, and how much brighter ordinary tissue is at each depth.
struct Greys {
  float black = 0.0f;
  std::vector<float> tissue;
};

Greys GreysOf(const Cells& cells, VolumeView<const float> beams, float leastTissue)
{
  Greys greys;
  std::vector<float> values = RealValues(cells.least.View());
  greys.black = Quantile(values, BlackQuantile);
  values = RealValues(cells.mean.View());
  const float bright = Quantile(values, BrightQuantile) - greys.black;
  const int samples = beams.Dimensions()[0];
  const std::ptrdiff_t lines = beams.Size() / samples;
  std::vector<float> quantiles(static_cast<std::size_t>(samples), Unreal);
  ParallelFor(samples, [&](std::ptrdiff_t d) {
    std::vector<float> real;
    for (std::ptrdiff_t line = 0; line < lines; ++line)
      if (const float value = beams[line * samples + d]; value == value)
        real.push_back(value);
    if (!real.empty())
      quantiles[static_cast<std::size_t>(d)] = Quantile(real, TissueQuantile) - greys.black;
  });
  std::vector<float> known;
  std::copy_if(quantiles.begin(), quantiles.end(), std::back_inserter(known), [](float v) { return v == v; });
  const float whole = known.empty() ? 0.0f : Quantile(known, 0.5);
  const float least = std::max({LeastOfImage * whole, LeastOfBright * bright, leastTissue});
  const int half = std::max(1, static_cast<int>(DepthWindow * samples + 0.5));
  for (int d = 0; d < samples; ++d) {
    float sum = 0.0f;
    int count = 0;
    for (int e = std::max(0, d - half); e <= std::min(samples - 1, d + half); ++e)
      if (const float value = quantiles[static_cast<std::size_t>(e)]; value == value) {
        sum += value;
        ++count;
      }
    greys.tissue.push_back(std::max(least, count > 0 ? sum / static_cast<float>(count) : 0.0f));
  }
  return greys;
}

//----------------------------------------------------------------------------------------------------------------------
// 3. Witnesses

// For each sample of a beam the best level from there to its end: never growing. Samples that are not real say nothing.
void FindWitnesses(float* beam, int samples, const Greys& greys, int echo, std::vector<float>& levels)
{
  levels.clear();
  for (int d = 0; d < samples; ++d)
    if (beam[d] == beam[d])
      levels.push_back((beam[d] - greys.black) / greys.tissue[static_cast<std::size_t>(d)]);
  const int real = static_cast<int>(levels.size());
  // An echo of the least length that begins here, and the best of those that begin here or below. Only whole ones count, so
  // the last few samples share the last one's answer.
  std::vector<float>& best = levels;
  const int last = std::max(0, real - echo);
  for (int d = 0; d <= last && d < real; ++d)
    best[static_cast<std::size_t>(d)] = *std::min_element(levels.begin() + d, levels.begin() + std::min(real, d + echo));
  for (int d = last + 1; d < real; ++d)
    best[static_cast<std::size_t>(d)] = best[static_cast<std::size_t>(last)];
  for (int d = last - 1; d >= 0; --d)
    best[static_cast<std::size_t>(d)] = std::max(best[static_cast<std::size_t>(d)], best[static_cast<std::size_t>(d) + 1]);
  for (int d = samples - 1, r = real - 1; d >= 0; --d)
    if (beam[d] == beam[d])
      beam[d] = best[static_cast<std::size_t>(r--)];
}

// What a beam and its neighbours agree on at one depth: of nine values the third smallest. A dark beam alone, or two, are noise;
// beside the straight edge of a shadow three are dark, so that shadows grow by a beam: their rims are half dark, and a voxel
// that is wrongly distrusted costs less than one that is wrongly trusted.
float Agreed(VolumeView<const float> beams, int d, int fan, int sweep)
{
  const auto& n = beams.Dimensions();
  std::array<float, 9> values;
  int count = 0;
  for (int s = std::max(0, sweep - 1); s <= std::min(n[2] - 1, sweep + 1); ++s)
    for (int f = std::max(0, fan - 1); f <= std::min(n[1] - 1, fan + 1); ++f)
      if (const float value = beams(d, f, s); value == value)
        values[static_cast<std::size_t>(count++)] = value;
  const int rank = std::max(std::min(1, count - 1), count / 3 - 1); // of three, in a single plane, the median
  std::nth_element(values.begin(), values.begin() + rank, values.begin() + count);
  return values[static_cast<std::size_t>(rank)];
}

// From witnesses to reliability, in place: levels to [0, 1], short tails excused, samples that are not real filled from their
// neighbours on the beam, so that voxels near the rim find numbers on all sides. Beams without any are trusted.
void Judge(float* beam, int samples, const ReliabilityParameters& p)
{
  int first = samples, last = -1, dark = samples;
  for (int d = 0; d < samples; ++d)
    if (beam[d] == beam[d]) {
      first = std::min(first, d);
      last = d;
      beam[d] = Smoothstep(static_cast<float>(p.shadowLevel), static_cast<float>(p.tissueLevel), beam[d]);
      if (beam[d] < 0.5f)
        dark = std::min(dark, d);
    }
  if (last < 0) {
    std::fill(beam, beam + samples, 1.0f);
    return;
  }
  const float length = static_cast<float>(last + 1 - dark) / static_cast<float>(samples);
  const float least = static_cast<float>(p.leastShadow);
  const float counts = dark > last ? 0.0f : least > 0.0f ? Smoothstep(0.5f * least, least, length) : 1.0f;
  float before = 1.0f - counts * (1.0f - beam[first]);
  for (int d = 0; d < samples; ++d) {
    beam[d] = beam[d] == beam[d] ? 1.0f - counts * (1.0f - beam[d]) : before;
    before = beam[d];
  }
}

Volume<float> BeamReliability(const Cells& cells, const BeamGrid& grid, const ReliabilityParameters& p, float leastTissue,
                              const Progress& progress)
{
  Volume<float> witnesses = AlongBeams(cells, grid, progress.Part(0.0, 0.6));
  const auto beams = witnesses.View();
  const Greys greys = GreysOf(cells, beams, leastTissue);
  const int samples = grid.Size()[0];
  const int echo = std::max(1, static_cast<int>(p.leastEcho * samples + 0.5));
  ParallelFor(beams.Slices(), progress.Part(0.6, 0.7), [&](std::ptrdiff_t sweep) {
    std::vector<float> levels;
    for (int fan = 0; fan < grid.Size()[1]; ++fan)
      FindWitnesses(beams.Row(fan, static_cast<int>(sweep)), samples, greys, echo, levels);
  });
  Volume<float> reliability(grid.Size());
  const auto out = reliability.View();
  ParallelFor(beams.Slices(), progress.Part(0.7, 1.0), [&](std::ptrdiff_t slice) {
    const int sweep = static_cast<int>(slice);
    for (int fan = 0; fan < grid.Size()[1]; ++fan) {
      float* beam = out.Row(fan, sweep);
      for (int d = 0; d < samples; ++d)
        beam[d] = beams(d, fan, sweep) == beams(d, fan, sweep) ? Agreed(beams, d, fan, sweep) : Unreal;
      Judge(beam, samples, p);
    }
  });
  return reliability;
}

//----------------------------------------------------------------------------------------------------------------------
// 4. Back to cells

// Whether some voxel will ask for the cell: it, or one beside it, has real voxels.
bool IsNeeded(VolumeView<const int> count, int i, int j, int k)
{
  if (count(i, j, k) > 0)
    return true;
  const auto& n = count.Dimensions();
  for (int c = std::max(0, k - 1); c <= std::min(n[2] - 1, k + 1); ++c)
    for (int b = std::max(0, j - 1); b <= std::min(n[1] - 1, j + 1); ++b)
      for (int a = std::max(0, i - 1); a <= std::min(n[0] - 1, i + 1); ++a)
        if (count(a, b, c) > 0)
          return true;
  return false;
}

Volume<float> ShadowOfCells(const Cells& cells, const BeamGrid& grid, VolumeView<const float> beams, const Progress& progress)
{
  Volume<float> result(cells.geometry.dimensions, 1.0f);
  const auto out = result.View();
  const Sampler<float> sampler(beams, {});
  ParallelFor(out.Slices(), progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < cells.geometry.dimensions[1]; ++j)
      for (int i = 0; i < cells.geometry.dimensions[0]; ++i) {
        if (!IsNeeded(cells.count.View(), i, j, k))
          continue;
        const Eigen::Vector3f at = grid.SampleOf(Eigen::Vector3d(i, j, k));
        double value = 1.0;
        sampler.Linear(at.x(), at.y(), at.z(), value);
        out(i, j, k) = static_cast<float>(value);
      }
  });
  return result;
}

// How many of each cell's real voxels are at the top value.
template <class T>
Volume<int> SaturatedVoxels(const PosedVolume<T>& volume, const Cells& cells, float top, const Progress& progress)
{
  Volume<int> saturated(cells.geometry.dimensions, 0);
  const auto out = saturated.View();
  const auto largest = cells.largest.View();
  const Reality<T> isReal(volume);
  ParallelFor(out.Slices(), progress, [&](std::ptrdiff_t slice) {
    ForPieces(cells, volume.geometry.dimensions, static_cast<int>(slice), [&](std::ptrdiff_t cell, std::ptrdiff_t voxel, int n) {
      if (!(largest[cell] >= top))
        return;
      for (std::ptrdiff_t i = voxel; i < voxel + n; ++i)
        out[cell] += isReal(i) && static_cast<float>(volume.intensity[i]) >= top ? 1 : 0;
    });
  });
  return saturated;
}

// What saturation leaves of each cell's reliability, by the share of saturated voxels among it and its neighbours.
Volume<float> SaturationOfCells(const Cells& cells, VolumeView<const int> saturated, double share)
{
  const auto& n = cells.geometry.dimensions;
  const auto count = cells.count.View();
  Volume<float> result(n, 1.0f);
  const auto out = result.View();
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (saturated(i, j, k) == 0)
          continue;
        std::ptrdiff_t top = 0, all = 0;
        for (int c = std::max(0, k - 1); c <= std::min(n[2] - 1, k + 1); ++c)
          for (int b = std::max(0, j - 1); b <= std::min(n[1] - 1, j + 1); ++b)
            for (int a = std::max(0, i - 1); a <= std::min(n[0] - 1, i + 1); ++a) {
              top += saturated(a, b, c);
              all += count(a, b, c);
            }
        out(i, j, k) = 1.0f - Smoothstep(static_cast<float>(share), 1.0f, static_cast<float>(top) / static_cast<float>(all));
      }
  });
  return result;
}

//----------------------------------------------------------------------------------------------------------------------
// 5. Cells to voxels

// For each voxel along an axis the two cells around it and how far it is to the second.
struct AxisPlan {
  AxisPlan(int voxels, int cells, int block) : below(static_cast<std::size_t>(voxels)), above(below), t(below.size())
  {
    for (int i = 0; i < voxels; ++i) {
      const float at =
          std::clamp((static_cast<float>(i) + 0.5f) / static_cast<float>(block) - 0.5f, 0.0f, static_cast<float>(cells - 1));
      const auto v = static_cast<std::size_t>(i);
      below[v] = static_cast<int>(at);
      above[v] = std::min(below[v] + 1, cells - 1);
      t[v] = at - static_cast<float>(below[v]);
    }
  }
  std::vector<int> below, above;
  std::vector<float> t;
};

template <class T>
void Spread(const PosedVolume<T>& volume, const Cells& cells, VolumeView<const float> from, VolumeView<float> map,
            const Progress& progress)
{
  const auto& n = map.Dimensions();
  const auto& m = from.Dimensions();
  const AxisPlan x(n[0], m[0], cells.block[0]), y(n[1], m[1], cells.block[1]), z(n[2], m[2], cells.block[2]);
  const Reality<T> isReal(volume);
  ParallelFor(n[2], progress, [&](std::ptrdiff_t slice) {
    std::vector<float> row(static_cast<std::size_t>(m[0]));
    const auto k = static_cast<std::size_t>(slice);
    for (int line = 0; line < n[1]; ++line) {
      const auto j = static_cast<std::size_t>(line);
      const float *a = from.Row(y.below[j], z.below[k]), *b = from.Row(y.above[j], z.below[k]);
      const float *c = from.Row(y.below[j], z.above[k]), *d = from.Row(y.above[j], z.above[k]);
      for (int i = 0; i < m[0]; ++i) {
        const float near = a[i] + y.t[j] * (b[i] - a[i]), far = c[i] + y.t[j] * (d[i] - c[i]);
        row[static_cast<std::size_t>(i)] = near + z.t[k] * (far - near);
      }
      float* out = map.Row(line, static_cast<int>(slice));
      const std::ptrdiff_t first = out - map.Data();
      for (int i = 0; i < n[0]; ++i) {
        const auto v = static_cast<std::size_t>(i);
        const float left = row[static_cast<std::size_t>(x.below[v])], right = row[static_cast<std::size_t>(x.above[v])];
        out[i] = isReal(first + i) ? left + x.t[v] * (right - left) : 0.0f;
      }
    }
  });
}

// The share of real voxels in cells below one half.
double ShareBelowHalf(const Cells& cells, VolumeView<const float> values)
{
  double low = 0.0, all = 0.0;
  for (std::ptrdiff_t i = 0; i < values.Size(); ++i) {
    const double voxels = cells.count.View()[i];
    all += voxels;
    low += values[i] < 0.5f ? voxels : 0.0;
  }
  return all > 0.0 ? low / all : 0.0;
}

int DepthAxisOf(const ReliabilityParameters& p, const std::array<int, 3>& n)
{
  if (p.depthAxis >= 0)
    return p.depthAxis;
  return n[2] > 1 ? 2 : n[1] > 1 ? 1 : 0;
}

} // namespace

ParameterList Describe(ReliabilityParameters& p)
{
  return {
      Parameter("DepthAxis", p.depthAxis, {-1, 2}, "",
                "Where no probe is known: the index axis along which depth grows. -1: the last one with several voxels.")
          .Advanced(),
      Parameter("DepthReversed", p.depthReversed, "Whether, where no probe is known, depth grows towards smaller indices.")
          .Advanced(),
      Parameter("Resolution", p.resolution, {16, 512}, "cells",
                "How finely shadows are sought: cells along the longest side of the volume, at most one per voxel. More show "
                "narrower shadows, and more noise.")
          .Advanced(),
      Parameter("ShadowLevel", p.shadowLevel, {0, 1}, "",
                "The end of a beam that gets no brighter than this is in shadow, reliability 0: a part of the way from black to "
                "ordinary tissue at its depth."),
      Parameter("TissueLevel", p.tissueLevel, {0, 1}, "",
                "The end of a beam that gets as bright as this is fully reliable; above ShadowLevel."),
      Parameter("LeastEcho", p.leastEcho, {0, 0.25}, "",
                "What is bright over less than this part of a beam is a speck, and no proof of sound.")
          .Advanced(),
      Parameter("LeastShadow", p.leastShadow, {0, 1}, "",
                "Dark ends shorter than half of this part of a beam are left alone, those longer than it count in full.")
          .Advanced(),
      Parameter("SaturatedShare", p.saturatedShare, {0, 0.999}, "",
                "Where more than this part of 3 x 3 x 3 cells has the largest value of the volume, reliability falls, to 0 where "
                "all of it has.")
          .Advanced(),
  };
}

template <class T>
Reliability MeasureReliability(const PosedVolume<T>& volume, const std::optional<PlacedProbe>& probe,
                               const ReliabilityParameters& p, const Progress& progress)
{
  CheckRanges(p);
  if (!(p.tissueLevel > p.shadowLevel))
    throw Error(Error::Kind::InvalidParameter, "TissueLevel is " + NumberText(p.tissueLevel) +
                                                   "; it must be above ShadowLevel, which is " + NumberText(p.shadowLevel));
  const auto& n = volume.geometry.dimensions;
  volume.geometry.Check("the volume");
  if (volume.intensity.Dimensions() != n || (!volume.valid.Empty() && volume.valid.Dimensions() != n))
    throw Error(Error::Kind::BadInput, "the volume: voxels, valid region and geometry differ in their dimensions");
  if (probe) {
    probe->geometry.Check();
    if (!IsRotation(probe->probeToWorld.linear()) || !probe->probeToWorld.translation().allFinite())
      throw Error(Error::Kind::BadInput, "the pose of the probe is not rigid");
  }

  const Cells cells = GatherCells(volume, p.resolution, progress.Part(0.0, 0.35));
  std::vector<float> extremes = RealValues(cells.largest.View());
  if (extremes.empty())
    throw Error(Error::Kind::BadInput, "no voxel of the volume is real (inside its valid region and finite)");
  const float largest = *std::max_element(extremes.begin(), extremes.end());
  extremes = RealValues(cells.least.View());
  const float least = *std::min_element(extremes.begin(), extremes.end());
  Reliability result;
  result.map = Volume<float>(n, 0.0f);
  if (!(largest > least)) {
    result.saturatedShare = 1.0;
    result.notes.emplace_back("All voxels have one value: nothing in the volume can be relied on.");
    return result;
  }

  const BeamGrid grid =
      probe ? BeamGrid(cells.geometry, *probe, p.resolution) : BeamGrid(cells.geometry, DepthAxisOf(p, n), p.depthReversed);
  const float leastTissue = std::max(LeastOfRange * (largest - least), std::is_integral_v<T> ? LeastSteps : 0.0f);
  const Volume<float> beams = BeamReliability(cells, grid, p, leastTissue, progress.Part(0.35, 0.6));
  Volume<float> values = ShadowOfCells(cells, grid, beams.View(), progress.Part(0.6, 0.7));
  result.shadowShare = ShareBelowHalf(cells, values.View());
  if (result.shadowShare > 0.99)
    result.notes.emplace_back("The volume is dark: no beam brings echoes, and nothing in it can be relied on.");

  const auto top = static_cast<float>(largest - TopMargin * (static_cast<double>(largest) - least));
  const Volume<int> saturated = SaturatedVoxels(volume, cells, top, progress.Part(0.7, 0.75));
  const Volume<float> unsaturated = SaturationOfCells(cells, saturated.View(), p.saturatedShare);
  result.saturatedShare = ShareBelowHalf(cells, unsaturated.View());
  const auto all = values.View();
  for (std::ptrdiff_t i = 0; i < all.Size(); ++i)
    all[i] *= unsaturated.View()[i];
  Spread(volume, cells, values.View(), result.map.View(), progress.Part(0.75, 1.0));
  return result;
}

template <class T>
std::optional<PlacedProbe> FindProbe(const PosedVolume<T>& volume, const ProbeFitParameters& parameters, std::string* note,
                                     const Progress& progress)
{
  Volume<unsigned char> region(volume.intensity.Dimensions());
  const auto inside = region.View();
  const Reality<T> isReal(volume);
  ParallelRanges(inside.Size(), 65536, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i)
      inside[i] = isReal(i) ? 1 : 0;
  });
  try {
    const ProbeFit fit = FitProbe(region.View(), volume.geometry, parameters, progress);
    return PlacedProbe{fit.geometry, fit.probeToWorld};
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::NotPossible)
      throw;
    if (note)
      *note = error.what();
    return {};
  }
}

#define EchoramaInstantiate(T)                                                                                                   \
  template Reliability MeasureReliability<T>(const PosedVolume<T>&, const std::optional<PlacedProbe>&,                           \
                                             const ReliabilityParameters&, const Progress&);                                     \
  template std::optional<PlacedProbe> FindProbe<T>(const PosedVolume<T>&, const ProbeFitParameters&, std::string*,               \
                                                   const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
