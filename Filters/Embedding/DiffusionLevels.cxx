// SPDX-License-Identifier: BSD-3-Clause
//
// D varies on the scale of the distance to the sources, so it need not be summed at every voxel. Each lattice has twice the
// steps of the one before. A node that lies farther from all sources than some coarse steps is interpolated between coarse
// nodes: half-way between them, along one axis after the other, with six taps (their error falls with the sixth power of step
// over distance). The others are summed. Coarse nodes know this of their own lattice, so every node is summed at most once, and
// the number of sums is that of the voxels near the surface, not of the volume.
//
// Axes with small spacing are doubled first, so steps grow alike in mm; axes of few nodes are not doubled at all.
//
// From the voxels up, each level says which nodes of the next it will read. Nothing else is summed there, so a mask of wanted
// voxels saves its share of the time.
#include "DiffusionLevels.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

constexpr int Side = 3; // taps on each side
constexpr int Border = Side - 1;
constexpr float Taps[Side] = {150.0f / 256.0f, -25.0f / 256.0f, 3.0f / 256.0f};
constexpr int FewestNodes = 12; // axes with fewer are not doubled

constexpr auto Unused = static_cast<unsigned char>(DiffusionNode::Unused);
constexpr auto Source = static_cast<unsigned char>(DiffusionNode::Source);
constexpr auto Summed = static_cast<unsigned char>(DiffusionNode::Summed);
constexpr auto Coarse = static_cast<unsigned char>(DiffusionNode::Coarse);

// What a coarse node is to the next finer level: bits.
constexpr unsigned char Copied = 1;  // one node there is at its place
constexpr unsigned char Between = 2; // a node there lies between it and the next

int CoarseIndex(const DiffusionLevel& coarse, std::size_t axis, int fine)
{
  return coarse.doubled[axis] ? fine / 2 + Border : fine;
}

void ClassifyNodes(DiffusionLevel& level, const DiffusionLevel* coarse, const Eigen::Vector3d& spacing,
                   VolumeView<const float> squaredDistance, const Progress& progress)
{
  const auto& grid = squaredDistance.Dimensions();
  const double reach2 = coarse ? coarse->reach * coarse->reach : 0.0;
  ParallelFor(level.size[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < level.size[1]; ++j) {
      unsigned char* const row = level.nodes.View().Row(j, k);
      const auto start = level.Voxel(0, j, k);
      const int y = std::clamp(start[1], 0, grid[1] - 1), z = std::clamp(start[2], 0, grid[2] - 1);
      const double beyondRow = std::pow((start[1] - y) * spacing[1], 2.0) + std::pow((start[2] - z) * spacing[2], 2.0);
      const float* const distances = squaredDistance.Row(y, z);
      const bool evenRow = coarse && !(coarse->doubled[1] && j % 2 != 0) && !(coarse->doubled[2] && k % 2 != 0);
      for (int i = 0; i < level.size[0]; ++i) {
        if (row[i] == Unused)
          continue;
        const int voxel = start[0] + i * level.step[0], x = std::clamp(voxel, 0, grid[0] - 1);
        // The grid is convex, so this is a lower bound for nodes beyond it.
        const double beyond = (voxel - x) * spacing[0];
        const double distance2 = static_cast<double>(distances[x]) + beyondRow + beyond * beyond;
        if (distance2 == 0.0)
          row[i] = Source;
        else if (coarse && (distance2 >= reach2 || (evenRow && !(coarse->doubled[0] && i % 2 != 0))))
          row[i] = Coarse;
        else
          row[i] = Summed;
      }
    }
  });
}

// Spreads the marks of one line to the nodes that interpolation reads.
void SpreadAlong(unsigned char* line, std::ptrdiff_t stride, int count, std::vector<unsigned char>& copy)
{
  for (int c = 0; c < count; ++c)
    copy[static_cast<std::size_t>(c)] = line[c * stride] & Between;
  for (int c = 0; c < count; ++c)
    for (int from = std::max(0, c - Side); from <= std::min(count - 1, c + Border); ++from)
      line[c * stride] = static_cast<unsigned char>(line[c * stride] | copy[static_cast<std::size_t>(from)]);
}

void MarkCoarse(const DiffusionLevel& fine, DiffusionLevel& coarse, const Progress& progress)
{
  const VolumeView<unsigned char> marks = coarse.nodes.View();
  ParallelFor(coarse.size[2], progress.Part(0.0, 0.8), [&](std::ptrdiff_t slice) {
    const int c = static_cast<int>(slice);
    const int k0 = coarse.doubled[2] ? 2 * (c - Border) : c, k1 = coarse.doubled[2] ? k0 + 2 : k0 + 1;
    for (int k = std::max(k0, 0); k < std::min(k1, fine.size[2]); ++k)
      for (int j = 0; j < fine.size[1]; ++j) {
        const unsigned char* const from = fine.nodes.View().Row(j, k);
        unsigned char* const to = marks.Row(CoarseIndex(coarse, 1, j), c);
        const bool odd = (coarse.doubled[1] && j % 2 != 0) || (coarse.doubled[2] && k % 2 != 0);
        for (int i = 0; i < fine.size[0]; ++i)
          if (from[i] == Coarse)
            to[CoarseIndex(coarse, 0, i)] |= odd || (coarse.doubled[0] && i % 2 != 0) ? Between : Copied;
      }
    if (coarse.doubled[0]) {
      std::vector<unsigned char> copy(static_cast<std::size_t>(coarse.size[0]));
      for (int j = 0; j < coarse.size[1]; ++j)
        SpreadAlong(marks.Row(j, c), 1, coarse.size[0], copy);
    }
    if (coarse.doubled[1]) {
      std::vector<unsigned char> copy(static_cast<std::size_t>(coarse.size[1]));
      for (int i = 0; i < coarse.size[0]; ++i)
        SpreadAlong(marks.Row(0, c) + i, marks.RowStride(), coarse.size[1], copy);
    }
  });
  if (coarse.doubled[2])
    ParallelFor(coarse.size[1], progress.Part(0.8, 1.0), [&](std::ptrdiff_t j) {
      std::vector<unsigned char> copy(static_cast<std::size_t>(coarse.size[2]));
      for (int i = 0; i < coarse.size[0]; ++i)
        SpreadAlong(marks.Row(static_cast<int>(j), 0) + i, marks.SliceStride(), coarse.size[2], copy);
    });
}

// The line half-way between the middle two of six.
void CombineLines(const float* const* lines, std::ptrdiff_t count, float* to)
{
  const float *a = lines[0], *b = lines[1], *c = lines[2], *d = lines[3], *e = lines[4], *f = lines[5];
  for (std::ptrdiff_t i = 0; i < count; ++i)
    to[i] = Taps[0] * (c[i] + d[i]) + (Taps[1] * (b[i] + e[i]) + Taps[2] * (a[i] + f[i]));
}

void ExpandLine(const float* from, int pairs, float* to)
{
  for (int i = 0; i < pairs; ++i) {
    const float* const at = from + i + Border;
    to[2 * i] = at[0];
    to[2 * i + 1] = Taps[0] * (at[0] + at[1]) + (Taps[1] * (at[-1] + at[2]) + Taps[2] * (at[-2] + at[3]));
  }
}

void PutCoarse(const float* from, const unsigned char* nodes, float offset, float least, float most, int count, float* to)
{
  for (int i = 0; i < count; ++i) {
    const float value = std::min(std::max(from[i] + offset, least), most);
    to[i] = nodes[i] == Coarse ? value : to[i];
  }
}

} // namespace

std::vector<DiffusionLevel> MakeDiffusionLevels(const std::array<int, 3>& grid, const Eigen::Vector3d& spacing,
                                                double stepsPerNode, double farthest, int channels)
{
  std::vector<DiffusionLevel> levels(1);
  levels[0].size = grid;
  levels[0].nodes = Volume<unsigned char>(grid, Unused);
  for (;;) {
    const DiffusionLevel& fine = levels.back();
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (fine.size[axis] >= FewestNodes)
        shortest = std::min(shortest, fine.step[axis] * spacing[static_cast<Eigen::Index>(axis)]);
    DiffusionLevel coarse;
    double longest = 0.0;
    coarse.size = fine.size;
    coarse.step = fine.step;
    coarse.first = fine.first;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = fine.step[axis] * spacing[static_cast<Eigen::Index>(axis)];
      if (fine.size[axis] < FewestNodes || step > 1.5 * shortest)
        continue;
      coarse.doubled[axis] = true;
      coarse.step[axis] = 2 * fine.step[axis];
      coarse.first[axis] = fine.first[axis] - Border * coarse.step[axis];
      coarse.size[axis] = (fine.size[axis] + 1) / 2 + 2 * Side - 1;
      longest = std::max(longest, 2.0 * step);
    }
    coarse.reach = stepsPerNode * longest;
    if (longest == 0.0 || coarse.reach > farthest)
      return levels;
    coarse.nodes = Volume<unsigned char>(coarse.size, Unused);
    for (int channel = 0; channel < channels; ++channel)
      coarse.values.emplace_back(coarse.size, 0.0f);
    levels.push_back(std::move(coarse));
  }
}

void PlanDiffusionLevels(std::vector<DiffusionLevel>& levels, const Eigen::Vector3d& spacing,
                         VolumeView<const float> squaredDistance, const Progress& progress)
{
  for (std::size_t number = 0; number < levels.size(); ++number) {
    const bool last = number + 1 == levels.size();
    const auto done = static_cast<double>(number), all = static_cast<double>(levels.size());
    ClassifyNodes(levels[number], last ? nullptr : &levels[number + 1], spacing, squaredDistance,
                  progress.Part(done / all, (done + 0.5) / all));
    if (!last)
      MarkCoarse(levels[number], levels[number + 1], progress.Part((done + 0.5) / all, (done + 1.0) / all));
  }
}

void RefineDiffusionLevel(const DiffusionLevel& coarse, const DiffusionLevel& fine, std::size_t channel, VolumeView<float> result,
                          float offset, float least, float most, const Progress& progress)
{
  const VolumeView<const float> values = coarse.values[channel].View();
  const auto width = static_cast<std::size_t>(coarse.size[0]);
  ParallelFor(fine.size[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    const unsigned char* const nodes = fine.nodes.View().Row(0, k);
    if (std::find(nodes, nodes + result.SliceStride(), Coarse) == nodes + result.SliceStride())
      return;
    const float* lines[2 * Side];
    std::vector<float> plane, line(width), row(static_cast<std::size_t>(fine.size[0]) + 1);
    const int c = CoarseIndex(coarse, 2, k);
    const float* from = values.Row(0, c);
    if (coarse.doubled[2] && k % 2 != 0) {
      plane.resize(static_cast<std::size_t>(values.SliceStride()));
      for (int tap = 0; tap < 2 * Side; ++tap)
        lines[tap] = values.Row(0, c - Border + tap);
      CombineLines(lines, values.SliceStride(), plane.data());
      from = plane.data();
    }
    for (int j = 0; j < fine.size[1]; ++j) {
      const unsigned char* const rowNodes = fine.nodes.View().Row(j, k);
      if (std::find(rowNodes, rowNodes + fine.size[0], Coarse) == rowNodes + fine.size[0])
        continue;
      const int b = CoarseIndex(coarse, 1, j);
      const float* expanded = from + static_cast<std::size_t>(b) * width;
      if (coarse.doubled[1] && j % 2 != 0) {
        for (int tap = 0; tap < 2 * Side; ++tap)
          lines[tap] = from + static_cast<std::size_t>(b - Border + tap) * width;
        CombineLines(lines, static_cast<std::ptrdiff_t>(width), line.data());
        expanded = line.data();
      }
      if (coarse.doubled[0]) {
        ExpandLine(expanded, (fine.size[0] + 1) / 2, row.data());
        expanded = row.data();
      }
      PutCoarse(expanded, rowNodes, offset, least, most, fine.size[0], result.Row(j, k));
    }
  });
}

} // namespace echorama
