// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "LatticeMap.h"
#include <functional>

namespace echorama {

/// How geometry and images follow a LatticeMap (dissertation 3.3.3).
struct DeformGeometryParameters {
  enum class Direction { Forward, Backward } direction = Direction::Forward;
  enum class Outside { Refuse, Mask, Keep, Nearest } outside = Outside::Refuse;
  bool maskFolds = false;    ///< instead of refusing them
  bool nearestVoxel = false; ///< instead of linear interpolation
};
ParameterList Describe(DeformGeometryParameters&);

/// What became of points, or of the voxels of the image that comes out.
struct DeformReport {
  LatticeFolds folds;      ///< of the lattice; with Outside::Nearest, of what lies around it too
  std::size_t count = 0;   ///< points or voxels
  std::size_t outside = 0; ///< of them: what the lattice says nothing about
  std::size_t folded = 0;  ///< in a tetrahedron that folds, or reached from several places
};

/// Moves points of the world: forward from x to x + u(x), backward from x + u(x) to x.
/// \param points finite; they are moved in place
/// \param valid comes back with 1 or 0 per point: 0 where Outside::Mask or maskFolds left one out. Of a fold forward has an
/// answer all the same, backward the first of several; what is outside stays. \param gradients none, or comes back with the
/// derivative of where each point went by where it was; the identity where it stayed \throws Error(BadInput) for a point that is
/// not finite, and for points outside with Outside::Refuse; Error(NotPossible) for folds without maskFolds; the message counts
/// them. Error(Cancelled).
DeformReport DeformPoints(const DeformGeometryParameters&, const LatticeMap&, std::vector<Eigen::Vector3d>& points,
                          std::vector<unsigned char>& valid, std::vector<Eigen::Matrix3d>* gradients = nullptr,
                          const Progress& progress = {});

/// The voxels of an image that one of the output is mixed from.
struct VoxelMix {
  int count = 0; ///< 0: nothing is there
  std::ptrdiff_t nearest = 0;
  std::array<std::ptrdiff_t, 8> voxels;
  std::array<double, 8> weights; ///< their sum is 1
};

/// Writes the values of one array at a voxel of the output. Called from several threads.
using VoxelWriter = std::function<void(std::ptrdiff_t voxel, const VoxelMix& mix)>;

/// Numbers of the types of ECHORAMA_FOR_EACH_VOXEL_TYPE, mixed linearly and rounded to the type; 0 where nothing is.
template <class T>
VoxelWriter MixedArray(const T* from, T* to, int components);

/// Whatever it is, \a bytes per voxel, from the nearest voxel; bytes of 0 where nothing is.
VoxelWriter NearestArray(const void* from, void* to, std::size_t bytes);

/// An image that is deformed, and where it comes out.
struct DeformedImage {
  ImageGeometry geometry;                    ///< of what comes in
  VolumeView<const unsigned char> real;      ///< which of its voxels are; empty: all
  ImageGeometry grid;                        ///< of what comes out
  std::vector<VoxelWriter> writers;          ///< for each array
  VolumeView<unsigned char> valid;           ///< comes back with 1 where there is something, else 0
  VolumeView<Eigen::Vector3d> displacements; ///< if not empty, it alone is written: where a voxel is read, in the image or not,
                                             ///< less where it is, mm; 0 where nothing is
};

/// Deforms an image: forward a voxel at x + u(x) of the output shows what lay at x (the exact inverse of the map), backward a
/// voxel at x shows what lies at x + u(x). With Outside::Keep what neither lies nor lay in the lattice stays as it is. \throws as
/// DeformPoints. With Outside::Refuse all real voxels of the input (forward), or all voxels of the output (backward) must lie in
/// the lattice.
DeformReport DeformImage(const DeformGeometryParameters&, const LatticeMap&, const DeformedImage& image,
                         const Progress& progress = {});

} // namespace echorama
