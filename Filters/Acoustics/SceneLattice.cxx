// SPDX-License-Identifier: BSD-3-Clause
// About one cell per triangle. One ray per row of cells finds the shells at their middles; a cell that no surface passes has the
// medium of its middle, so points in it cost a look-up. Of the others it is known between which two parallel planes all their
// triangles lie: what is left of a cell in front of both, and behind both, is convex and nothing passes through it, so it has one
// medium. A ray to its far corner tells which, when it is asked for first. Only for points between the planes a short ray goes
// from the middle.
#include "SceneLattice.h"
#include "AcousticScene.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <map>

namespace echorama {

SceneLattice::SceneLattice(const AcousticScene& scene, const SceneShells& parts, const Progress& progress) : centre_(parts.centre)
{
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // A box that is a little larger than the scene by amounts that keep the rows off the surfaces of well-aligned boxes.
  const Eigen::Vector3d size = parts.high - parts.low;
  const Eigen::Vector3d pad = Eigen::Vector3d(0.00917, 0.01127, 0.01361) * size.maxCoeff();
  low_ = parts.low - pad;
  const Eigen::Vector3d whole = size + pad + Eigen::Vector3d(pad[1], pad[2], pad[0]);
  const double cells = std::clamp(2.0 * static_cast<double>(scene.triangles_.size()), 4096.0, 4e6);
  const double edge = std::cbrt(whole.prod() / cells);
  for (int axis = 0; axis < 3; ++axis) {
    cells_[static_cast<std::size_t>(axis)] = std::clamp(static_cast<int>(std::ceil(whole[axis] / edge)), 1, 1024);
    size_[axis] = whole[axis] / cells_[static_cast<std::size_t>(axis)];
  }
  const auto [nx, ny, nz] = cells_;
  setOf_.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 0);

  // The sets in the middles, row by row; each slice lists its own first.
  std::vector<std::vector<BodySet>> setsOfSlice(static_cast<std::size_t>(nz));
  ParallelFor(nz, progress.Part(0.0, 0.7), [&, nx = nx, ny = ny](std::ptrdiff_t k) {
    std::vector<BodySet>& sets = setsOfSlice[static_cast<std::size_t>(k)];
    sets.emplace_back();
    for (int j = 0; j < ny; ++j) {
      std::int32_t* const row = setOf_.data() + (k * ny + j) * nx;
      Eigen::Vector3d start = Middle(0, j, static_cast<int>(k));
      start[0] = low_[0]; // outside of the scene
      const SceneTree::Line line = scene.LineOf(parts.centre + start, Eigen::Vector3d::UnitX());
      BodySet inside;
      std::int32_t set = 0;
      int i = 0;
      const auto fill = [&](double to) {
        for (; i < nx && (i + 0.5) * size_[0] < to; ++i)
          row[i] = set;
      };
      scene.EachMeeting(line, 0.0, infinity, [&](const AcousticScene::Meeting& meeting) {
        fill(meeting.first);
        AcousticScene::Pass(meeting, inside);
        if (inside.Count() > 0 && !(sets.back() == inside))
          sets.push_back(inside);
        set = inside.Count() == 0 ? 0 : static_cast<std::int32_t>(sets.size()) - 1;
      });
      fill(infinity);
    }
  });
  std::map<std::vector<std::int32_t>, std::int32_t> index;
  for (int k = 0; k < nz; ++k) {
    std::vector<std::int32_t> global;
    for (const BodySet& set : setsOfSlice[static_cast<std::size_t>(k)]) {
      const auto [found, isNew] =
          index.try_emplace(std::vector<std::int32_t>(set.begin(), set.end()), static_cast<std::int32_t>(sets_.size()));
      if (isNew) {
        sets_.push_back(set);
        media_.push_back(scene.MediumOf(set));
      }
      global.push_back(found->second);
    }
    std::int32_t* const slice = setOf_.data() + static_cast<std::ptrdiff_t>(k) * nx * ny;
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(nx) * ny; ++i)
      slice[i] = 2 * global[static_cast<std::size_t>(slice[i])];
  }
  progress(0.8);
  FindPasses(scene, parts);
  progress(1.0);
}

// Cells near triangles, those of its box that lie close to its plane, and the planes: parallel to the first triangle of the cell.
// Any direction would be right, but where surfaces are smooth this one keeps them close together.
void SceneLattice::FindPasses(const AcousticScene& scene, const SceneShells& parts)
{
  const auto [nx, ny, nz] = cells_;
  const double reach = 0.5 * size_.norm() + scene.Tolerance();
  for (const SceneShells::Corners& triangle : parts.triangles) {
    const Eigen::Vector3d a = parts.Point(triangle[0]), b = parts.Point(triangle[1]), c = parts.Point(triangle[2]);
    const Eigen::Array3d margin = Eigen::Array3d::Constant(scene.Tolerance());
    const Eigen::Array3d from = (a.cwiseMin(b).cwiseMin(c) - low_).array() - margin;
    const Eigen::Array3d to = (a.cwiseMax(b).cwiseMax(c) - low_).array() + margin;
    const Eigen::Array3i first = (from / size_.array()).floor().cast<int>().max(0);
    const Eigen::Array3i last = (to / size_.array()).floor().cast<int>().min(Eigen::Array3i(nx - 1, ny - 1, nz - 1));
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    const bool hasArea = normal.squaredNorm() > 0.5, flat = (last - first).maxCoeff() > 1 && hasArea;
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int i = first[0]; i <= last[0]; ++i) {
          const Eigen::Vector3d middle = Middle(i, j, k);
          if (flat && std::abs(normal.dot(middle - a)) > reach)
            continue;
          std::int32_t& code = setOf_[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * ny + j) * nx + i)];
          if ((code & 1) == 0) {
            Pass& pass = passes_.emplace_back();
            pass.normal = hasArea ? Eigen::Vector3f(normal.cast<float>()) : Eigen::Vector3f::UnitX();
            pass.set = code >> 1;
            code = 2 * (static_cast<std::int32_t>(passes_.size()) - 1) + 1;
          }
          Pass& pass = passes_[static_cast<std::size_t>(code >> 1)];
          for (const std::uint32_t corner : triangle) {
            const float height = pass.normal.dot((parts.Point(corner) - middle).cast<float>());
            pass.low = std::min(pass.low, height);
            pass.high = std::max(pass.high, height);
          }
        }
  }
  const auto slack = static_cast<float>(4.0 * scene.Tolerance()); // single precision, and hits within the tolerance are one
  for (Pass& pass : passes_) {
    pass.low -= slack;
    pass.high += slack;
  }
}

// The medium on one side of the planes of a cell.
std::int32_t SceneLattice::MediumBehind(const AcousticScene& scene, const Pass& pass, const Eigen::Vector3d& middle,
                                        bool above) const
{
  LazyMedium& known = above ? pass.above : pass.below;
  std::int32_t medium = known.load(std::memory_order_relaxed);
  if (medium != unknown)
    return medium;
  if (above ? 0.0f > pass.high : 0.0f < pass.low) {
    medium = media_[static_cast<std::size_t>(pass.set)];
  } else {
    Eigen::Vector3d corner = 0.499 * size_; // the farthest in front
    for (int axis = 0; axis < 3; ++axis)
      if ((pass.normal[axis] < 0.0f) == above)
        corner[axis] = -corner[axis];
    medium = MediumByRay(scene, pass, middle, middle + corner);
  }
  known.store(medium, std::memory_order_relaxed); // whoever asks finds the same
  return medium;
}

// The medium at a place of a cell, by a ray from its middle.
std::int32_t SceneLattice::MediumByRay(const AcousticScene& scene, const Pass& pass, const Eigen::Vector3d& from,
                                       const Eigen::Vector3d& local) const
{
  const double length = (local - from).norm();
  BodySet inside = sets_[static_cast<std::size_t>(pass.set)];
  if (length > 0.0)
    scene.EachMeeting(scene.LineOf(centre_ + from, (local - from) / length), 0.0, length,
                      [&inside](const AcousticScene::Meeting& meeting) { AcousticScene::Pass(meeting, inside); });
  return scene.MediumOf(inside);
}

void SceneLattice::MediumAt(const AcousticScene& scene, const Eigen::Vector3f* points, std::size_t count,
                            std::int32_t* materials) const
{
  const auto [nx, ny, nz] = cells_;
  if (nx == 0) {
    std::fill_n(materials, count, 0);
    return;
  }
  const Eigen::Vector3d inverse = size_.cwiseInverse();
  for (std::size_t p = 0; p < count; ++p) {
    const Eigen::Vector3d local = points[p].cast<double>() - centre_;
    const Eigen::Vector3d place = (local - low_).cwiseProduct(inverse);
    if (!(place.minCoeff() >= 0.0 && place[0] < nx && place[1] < ny && place[2] < nz)) { // not finite either
      materials[p] = 0;
      continue;
    }
    const int i = static_cast<int>(place[0]), j = static_cast<int>(place[1]), k = static_cast<int>(place[2]);
    const std::int32_t code = setOf_[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * ny + j) * nx + i)];
    const auto index = static_cast<std::size_t>(code >> 1);
    if ((code & 1) == 0) {
      materials[p] = media_[index];
      continue;
    }
    const Pass& pass = passes_[index];
    const Eigen::Vector3d middle = Middle(i, j, k);
    const float height = pass.normal.dot((local - middle).cast<float>());
    materials[p] = height > pass.high || height < pass.low ? MediumBehind(scene, pass, middle, height > pass.high)
                                                           : MediumByRay(scene, pass, middle, local);
  }
}

std::size_t SceneLattice::Bytes() const
{
  std::size_t bytes = setOf_.capacity() * sizeof(std::int32_t) + passes_.capacity() * sizeof(Pass);
  for (const BodySet& set : sets_)
    bytes += sizeof(BodySet) + (set.Count() > 10 ? sizeof(std::int32_t) * static_cast<std::size_t>(set.Count()) : 0);
  return bytes;
}

} // namespace echorama
