// SPDX-License-Identifier: BSD-3-Clause
//
// A row of voxels lies between four rows of blocks, whose weighted sum is one row of values; that is read along x. Of blocks as
// thin as a voxel fewer rows take part, and nothing is left to read along x.
#include "BlockRows.h"
#include <cmath>

namespace echorama {

namespace {

// Of the form v0 + t (v1 - v0), so that a constant stays that constant.
void MixRows(const double* a, const double* b, double t, int count, double* __restrict out)
{
  for (int i = 0; i < count; ++i)
    out[i] = a[i] + t * (b[i] - a[i]);
}

void MixFourRows(const double* a, const double* b, const double* d, const double* e, double ty, double tz, int count,
                 double* __restrict out)
{
  for (int i = 0; i < count; ++i) {
    const double near = a[i] + ty * (b[i] - a[i]), far = d[i] + ty * (e[i] - d[i]);
    out[i] = near + tz * (far - near);
  }
}

void ReadAlong(const double* line, const int* below, const double* after, int count, double* __restrict out)
{
  for (int i = 0; i < count; ++i) {
    const double* v = line + below[i];
    out[i] = v[0] + after[i] * (v[1] - v[0]);
  }
}

} // namespace

Blocks::Blocks(const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing, double mm) : voxels(dimensions)
{
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double wanted = std::floor(mm / spacing[static_cast<Eigen::Index>(axis)] + 0.5);
    size[axis] = static_cast<int>(std::clamp(wanted, 1.0, static_cast<double>(std::max(dimensions[axis], 1))));
    count[axis] = (dimensions[axis] + size[axis] - 1) / size[axis];
  }
}

BlockRows::BlockRows(const Blocks& blocks, std::vector<VolumeView<const double>> channels)
  : blocks_(blocks), channels_(std::move(channels)), below_(static_cast<std::size_t>(blocks.voxels[0])),
    after_(static_cast<std::size_t>(blocks.voxels[0]))
{
  for (int i = 0; i < blocks.voxels[0]; ++i) {
    const double position = blocks.PositionOf(i, 0);
    const int below = std::min(static_cast<int>(position), std::max(blocks.count[0] - 2, 0));
    below_[static_cast<std::size_t>(i)] = below;
    after_[static_cast<std::size_t>(i)] = position - below;
  }
}

void BlockRows::Row(int j, int k, int first, int end, double* const* values) const
{
  if (first >= end)
    return;
  const double y = blocks_.PositionOf(j, 1), z = blocks_.PositionOf(k, 2);
  const int j0 = static_cast<int>(y), k0 = static_cast<int>(z);
  const int j1 = std::min(j0 + 1, blocks_.count[1] - 1), k1 = std::min(k0 + 1, blocks_.count[2] - 1);
  const double ty = y - j0, tz = z - k0;
  const bool asTheyAre = blocks_.size[0] == 1; // along x
  const int from = asTheyAre ? first : below_[static_cast<std::size_t>(first)];
  const int to = asTheyAre ? end - 1 : std::min(below_[static_cast<std::size_t>(end - 1)] + 1, blocks_.count[0] - 1);
  thread_local std::vector<double> line;
  line.resize(static_cast<std::size_t>(to - from + 2));
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    if (!values[c])
      continue;
    const double *a = channels_[c].Row(j0, k0), *b = channels_[c].Row(j1, k0);
    const double *d = channels_[c].Row(j0, k1), *e = channels_[c].Row(j1, k1);
    double* const mixed = asTheyAre ? values[c] : line.data();
    const int count = to - from + 1;
    if (ty > 0.0 && tz > 0.0)
      MixFourRows(a + from, b + from, d + from, e + from, ty, tz, count, mixed);
    else if (ty > 0.0 || tz > 0.0)
      MixRows(a + from, (ty > 0.0 ? b : d) + from, ty > 0.0 ? ty : tz, count, mixed);
    else
      std::copy_n(a + from, count, mixed);
    if (asTheyAre)
      continue;
    line[static_cast<std::size_t>(count)] = line[static_cast<std::size_t>(count - 1)];
    ReadAlong(line.data() - from, below_.data() + first, after_.data() + first, end - first, values[c]);
  }
}

} // namespace echorama
