// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#include <Eigen/Core>
#include <string>
#include <vector>

namespace echorama {

constexpr std::size_t LargestMeshFile = std::size_t{2} << 30; ///< bytes, with the files that it names

/// The polygons of a mesh file, as they stand there.
struct PolygonMesh {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> corners; ///< places in points, of one polygon after the other
  std::vector<std::size_t> ends;      ///< of each polygon, in corners; each has three corners and more
};

///@{
/// Decoders for formats whose readers in VTK do not survive damaged files.
/// \throws Error(FileSystem) when the file cannot be read, Error(BadFile) when it is damaged or has more than 2 GiB.

/// PLY 1.0, as text and binary: x, y and z of the element vertex, and vertex_indices (or vertex_index) of the element face. Other
/// elements and properties are passed over.
PolygonMesh ReadPly(const std::string& path);

/// Wavefront OBJ: v and f. Faces that differ in normals or texture alone share their points; other statements are passed over.
PolygonMesh ReadObj(const std::string& path);

/// glTF 2.0, as text or binary (.glb): the triangles of the default scene, where its nodes place them. Refused are sparse
/// accessors, skins, morph targets with a weight, and files that require an extension that is not of materials, textures or
/// lights.
PolygonMesh ReadGltf(const std::string& path);

/// All of a file, as these read it: the size is looked at first.
std::string ReadMeshContent(const std::string& path);
///@}

} // namespace echorama
