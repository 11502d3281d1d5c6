// SPDX-License-Identifier: BSD-3-Clause
// OpenVDB's conversion of meshes visits the voxels near each triangle, and widens the band from there: many times faster than to
// ask a tree at each node. But a distance may be that to a triangle which is not quite the nearest; whoever needs it exact asks
// BodySurface.
#include "BodyLevelSet.h"
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

namespace echorama {
namespace {

// What OpenVDB asks of a mesh.
struct MeshInCells {
  const TriangleSurface& surface;
  const Eigen::Vector3d& origin;
  double cellMm;

  std::size_t polygonCount() const { return surface.triangles.size(); }
  std::size_t pointCount() const { return surface.points.size(); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t polygon, std::size_t corner, openvdb::Vec3d& place) const
  {
    const Eigen::Vector3d point = (surface.points[surface.triangles[polygon][corner]].cast<double>() - origin) / cellMm;
    place = openvdb::Vec3d(point.x(), point.y(), point.z());
  }
};

} // namespace

struct BodyLevelSet::Grid {
  openvdb::FloatGrid::Ptr distances;
};

BodyLevelSet::BodyLevelSet(const BodySurface& body, const Eigen::Vector3d& origin, double cellMm, double insideMm,
                           double outsideMm)
  : grid_(new Grid)
{
  const auto lattice = openvdb::math::Transform::createLinearTransform(cellMm);
  grid_->distances = openvdb::tools::meshToVolume<openvdb::FloatGrid>(MeshInCells{body.Surface(), origin, cellMm}, *lattice,
                                                                      static_cast<float>(outsideMm / cellMm),
                                                                      static_cast<float>(insideMm / cellMm));
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
