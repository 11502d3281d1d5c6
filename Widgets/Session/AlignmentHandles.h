// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "DragMotion.h"
#include <array>
#include <vector>

namespace echorama {

/// What a person takes hold of to move volumes.
struct Handle {
  enum class Kind { Centre, Arrow, Square, Ring };
  Kind kind = Kind::Centre;
  int axis = 0; ///< of the frame: along the arrow, across square and ring; 3: the view's own normal
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(); ///< that axis in the world
  std::vector<Eigen::Vector2d> line; ///< as it is seen, pixels: an arrow from tail to tip; corners of a square; a closed ring
  std::vector<bool> behind;          ///< of a ring: whether the piece that begins here lies behind the centre
};

/// Sizes on the screen, pixels.
struct HandleSizes {
  double arrowStart = 14.0, arrowEnd = 100.0;
  double squareStart = 26.0, squareEnd = 44.0;
  double ring = 78.0;
  double viewRing = 112.0;
  double centre = 6.0; ///< radius
  double reach = 6.0;  ///< how far from a line it can be taken hold of
  /// All of them times a factor.
  HandleSizes Times(double factor) const;
};

/// The handles around \a centre along the columns of \a frame, as large on the screen at any zoom.
///
/// In a slice (\a slice; the frame's third column is its normal): arrows along the first two, a square and a ring. Else: three
/// of each and a ring that faces the viewer. What is seen so obliquely that it could not be used is left out. None when the view
/// is not usable or the centre is behind the viewer.
std::vector<Handle> MakeHandles(const MouseView& view, const Eigen::Vector3d& centre, const Eigen::Matrix3d& frame, bool slice,
                                const HandleSizes& sizes);

/// The world's axis that a handle stands for; of handles that do not lie along the world's axes: the view's.
int AxisOf(const Handle& handle, bool alongWorld);

/// Where a handle can be taken hold of: the tip of an arrow, the middle of a square, a point of a ring in front of the others.
/// None: it lies behind others.
std::optional<Eigen::Vector2d> GripOf(const std::vector<Handle>& handles, std::size_t index, const HandleSizes& sizes);

/// Index of the handle under a pixel; -1: none. The centre wins, then squares, then what is nearest.
int HandleAt(const std::vector<Handle>& handles, const Eigen::Vector2d& pixel, const HandleSizes& sizes);

/// The frame of handles in a slice: the world's axes when the slice is across one of them, else those of the view.
/// \a alongWorld tells which it is.
Eigen::Matrix3d SliceFrame(const MouseView& view, bool& alongWorld);

} // namespace echorama
