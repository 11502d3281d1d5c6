// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <cstddef>

namespace echorama {

/// What goes into a hole.
enum class HoleFilling {
  Nothing, ///< holes stay
  Mean,    ///< the mean of all voxels that were seen in the smallest cube that reaches across the hole
  Stick,   ///< linear interpolation along the shortest straight line across the hole; the mean, where several are as short
};

struct HoleFillingParameters {
  HoleFilling method = HoleFilling::Mean;
  int reach = 1; ///< the stick length of the Plus toolkit is this plus 2
};
ParameterList Describe(HoleFillingParameters& p);

/// Fills holes: voxels without coverage for which, along one of 13 lines (axes, diagonals of faces and of the cube), voxels that
/// were seen lie on both sides with no more than \a reach others between them. Their valid becomes 1, their coverage stays 0, so
/// that valid and not covered means filled. What an earlier call has filled is forgotten first.
///
/// Mean takes the cube with half edge (gap + 1) / 2, rounded up, of the narrowest gap at the voxel: for a single voxel the 3^3
/// mean. Both work on what was seen alone, so the order of voxels does not matter.
/// \returns how many voxels were filled.
/// \throws Error(InvalidParameter) for a reach out of range, Error(Cancelled).
template <class T>
std::size_t FillHoles(const HoleFillingParameters& parameters, VolumeView<T> intensity, VolumeView<unsigned char> valid,
                      VolumeView<const unsigned short> coverage, const Progress& progress = {});

} // namespace echorama
