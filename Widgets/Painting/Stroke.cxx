// SPDX-License-Identifier: BSD-3-Clause
// Strokes hang together from the last to the first, so that a state of an editing session is one pointer and every earlier
// state shares what it has in common with it.
#include "Widgets/Painting/Stroke.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cstring>

namespace echorama {
namespace {

const std::vector<std::string> modeNames{"paint", "carve", "restore"}; // in their order

// FNV-1a, eight bytes at a time; the shift lets high bits reach low ones.
void Add(std::uint64_t& digest, double number)
{
  std::uint64_t bits = 0;
  std::memcpy(&bits, &number, sizeof bits);
  digest = (digest ^ bits) * 1099511628211u;
  digest ^= digest >> 32;
}

} // namespace

std::string NameOf(BrushMode mode)
{
  return modeNames.at(static_cast<std::size_t>(mode));
}

std::optional<BrushMode> BrushModeNamed(const std::string& name)
{
  const auto found = std::find(modeNames.begin(), modeNames.end(), name);
  return found == modeNames.end() ? std::nullopt : std::optional(static_cast<BrushMode>(found - modeNames.begin()));
}

ParameterList Describe(Brush& b)
{
  return {
      Parameter("Mode", Choice(b.mode, modeNames), "What the brush does to the voxels that it touches."),
      Parameter("RadiusMm", b.radiusMm, {0, 1000, true}, "mm", "Radius of the brush."),
      Parameter("Intensity", b.intensity, {}, "grey levels", "What is painted, as far as the volume's type can hold it."),
      Parameter("Opacity", b.opacity, {0, 1}, "", "How far paint changes intensities at the middle of the brush."),
      Parameter("Hardness", b.hardness, {0, 1}, "",
                "Share of the radius that is painted in full; from there it falls off smoothly."),
      Parameter("InsideValid", b.insideValid,
                "Whether paint leaves voxels alone that are not real; otherwise it makes them real."),
  };
}

bool operator==(const Brush& a, const Brush& b)
{
  return a.mode == b.mode && a.radiusMm == b.radiusMm && a.intensity == b.intensity && a.opacity == b.opacity &&
         a.hardness == b.hardness && a.insideValid == b.insideValid;
}

bool operator==(const Stroke& a, const Stroke& b)
{
  return a.brush == b.brush && a.pathMm == b.pathMm;
}

StrokeNode::StrokeNode(Stroke s, std::shared_ptr<const StrokeNode> b)
  : stroke(std::move(s)), before(std::move(b)), count(before ? before->count + 1 : 1),
    digest(before ? before->digest : 14695981039346656037u)
{
  const Brush& brush = stroke.brush;
  for (const double number : {static_cast<double>(brush.mode), brush.radiusMm, brush.intensity, brush.opacity, brush.hardness,
                              brush.insideValid ? 1.0 : 0.0, static_cast<double>(stroke.pathMm.size())})
    Add(digest, number);
  for (const Eigen::Vector3d& point : stroke.pathMm)
    for (int axis = 0; axis < 3; ++axis)
      Add(digest, point[axis]);
}

StrokeNode::~StrokeNode()
{
  // Each node would destroy the one before it, as deep as the chain is long; so those that only this chain holds are let go
  // in a loop.
  std::shared_ptr<const StrokeNode> rest = std::move(before);
  while (rest && rest.use_count() == 1)
    rest = std::move(const_cast<StrokeNode&>(*rest).before);
}

StrokeChain Append(const StrokeChain& chain, Stroke stroke)
{
  CheckRanges(stroke.brush);
  if (stroke.pathMm.empty())
    throw Error(Error::Kind::InvalidParameter, "the stroke has no points");
  for (const Eigen::Vector3d& point : stroke.pathMm)
    if (!point.allFinite())
      throw Error(Error::Kind::InvalidParameter, "a point of the stroke is not finite");
  return std::make_shared<StrokeNode>(std::move(stroke), chain);
}

std::vector<Stroke> StrokesOf(const StrokeChain& chain)
{
  std::vector<Stroke> strokes;
  strokes.reserve(chain ? static_cast<std::size_t>(chain->count) : 0);
  for (const StrokeNode* node = chain.get(); node; node = node->before.get())
    strokes.push_back(node->stroke);
  std::reverse(strokes.begin(), strokes.end());
  return strokes;
}

} // namespace echorama
