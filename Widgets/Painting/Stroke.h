// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <cstdint>
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace echorama {

/// What a brush does to the voxels that it touches.
enum class BrushMode {
  Paint,   ///< intensities go towards the brush's
  Carve,   ///< voxels leave the valid region
  Restore, ///< intensities and valid region become the file's again
};

///@{ Their names: "paint", "carve", "restore". None: there is no mode of this name.
std::string NameOf(BrushMode mode);
std::optional<BrushMode> BrushModeNamed(const std::string& name);
///@}

/// A spherical brush.
struct Brush {
  BrushMode mode = BrushMode::Paint;
  double radiusMm = 3.0;
  double intensity = 0.0;
  double opacity = 1.0;
  double hardness = 0.5;
  bool insideValid = true;
};
ParameterList Describe(Brush& b);
bool operator==(const Brush&, const Brush&); ///< exact

/// One stroke from press to release: the brush goes along straight lines through the points. A voxel is painted once, however
/// often the brush passes: what counts is its least distance from the path. So the result does not depend on how finely the
/// mouse was sampled along a straight line.
struct Stroke {
  Brush brush;
  std::vector<Eigen::Vector3d> pathMm; ///< in the physical space of the volume's file, mm: strokes go where the volume goes
};
bool operator==(const Stroke&, const Stroke&); ///< exact

/// All strokes on a volume, the last one first: a list that is never changed but only lengthened, so that copies are cheap and
/// every earlier state of an editing session remains valid. nullptr: none.
struct StrokeNode {
  Stroke stroke;
  std::shared_ptr<const StrokeNode> before;
  int count = 1;            ///< of strokes up to and with this one
  std::uint64_t digest = 0; ///< of all of them: chains that say the same have the same one
  StrokeNode(Stroke s, std::shared_ptr<const StrokeNode> b);
  ~StrokeNode(); ///< not recursive: chains are long
};
using StrokeChain = std::shared_ptr<const StrokeNode>;

/// The chain with one more stroke. \throws Error(InvalidParameter) for a brush out of its ranges, and for a path without points
/// or with one that is not finite.
StrokeChain Append(const StrokeChain& chain, Stroke stroke);
/// From the first to the last.
std::vector<Stroke> StrokesOf(const StrokeChain& chain);

} // namespace echorama
