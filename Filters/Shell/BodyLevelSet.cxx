// SPDX-License-Identifier: BSD-3-Clause
// OpenVDB's conversion of meshes visits the voxels near each triangle, and widens the band from there: many times faster than to
// ask a tree at each node. But a distance may be that to a triangle which is not quite the nearest; whoever needs it exact asks
// BodySurface.
#include "BodyLevelSet.h"
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <vector>

namespace echorama {

struct BodyLevelSet::Grid {
  openvdb::FloatGrid::Ptr distances;
};

BodyLevelSet::BodyLevelSet(const BodySurface& body, const Eigen::Vector3d& origin, double cellMm, double insideMm,
                           double outsideMm)
  : grid_(new Grid)
{
  const TriangleSurface& surface = body.Surface();
  std::vector<openvdb::Vec3s> points;
  points.reserve(surface.points.size());
  for (const auto& point : surface.points) {
    const Eigen::Vector3f place = (point.cast<double>() - origin).cast<float>();
    points.emplace_back(place.x(), place.y(), place.z());
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(surface.triangles.size());
  for (const auto& corners : surface.triangles)
    triangles.emplace_back(corners[0], corners[1], corners[2]);
  // This one conversion is compiled into OpenVDB's library; any other would take minutes to compile here.
  openvdb::util::NullInterrupter interrupter;
  grid_->distances = openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(
      interrupter, *openvdb::math::Transform::createLinearTransform(cellMm), points, triangles, {},
      static_cast<float>(outsideMm / cellMm), static_cast<float>(insideMm / cellMm));
}

BodyLevelSet::~BodyLevelSet() = default;

bool BodyLevelSet::Touches(const Eigen::Array3i& first) const
{
  static_assert(openvdb::FloatTree::LeafNodeType::DIM == LevelSet::blockCells, "blocks are OpenVDB's leaves");
  const auto reader = grid_->distances->getConstUnsafeAccessor();
  for (int corner = 0; corner < 8; ++corner) {
    const openvdb::Coord leaf(first.x() + LevelSet::blockCells * (corner & 1),
                              first.y() + LevelSet::blockCells * (corner >> 1 & 1),
                              first.z() + LevelSet::blockCells * (corner >> 2));
    if (reader.probeConstLeaf(leaf))
      return true;
  }
  return false;
}

bool BodyLevelSet::IsOutside(const Eigen::Array3i& node) const
{
  return grid_->distances->getConstUnsafeAccessor().getValue(openvdb::Coord(node.x(), node.y(), node.z())) > 0.0f;
}

void BodyLevelSet::Fill(const Eigen::Array3i& first, LevelSet::Values& values) const
{
  const auto reader = grid_->distances->getConstUnsafeAccessor(); // nobody writes
  std::size_t at = 0;
  for (int k = 0; k < LevelSet::blockNodes; ++k)
    for (int j = 0; j < LevelSet::blockNodes; ++j)
      for (int i = 0; i < LevelSet::blockNodes; ++i)
        values[at++] = reader.getValue(openvdb::Coord(first.x() + i, first.y() + j, first.z() + k));
}

} // namespace echorama
