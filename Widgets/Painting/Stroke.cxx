// SPDX-License-Identifier: BSD-3-Clause
// Strokes hang together from the last to the first, so that a state of an editing session is one pointer and every earlier
// state shares what it has in common with it.
#include "Widgets/Painting/Stroke.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr std::pair<const char*, BrushMode> Modes[] = {
    {"paint", BrushMode::Paint}, {"carve", BrushMode::Carve}, {"restore", BrushMode::Restore}};

void CheckRange(const char* name, double value, double from, double to, bool openBelow = false)
{
  if (!(value <= to && (openBelow ? value > from : value >= from)))
    throw Error(Error::Kind::InvalidParameter, std::string("the brush's ") + name + " is " + NumberText(value) +
                                                   "; it must be in " + (openBelow ? "(" : "[") + NumberText(from) + ", " +
                                                   NumberText(to) + "]");
}

} // namespace

std::string NameOf(BrushMode mode)
{
  const auto found = std::find_if(std::begin(Modes), std::end(Modes), [&](const auto& each) { return each.second == mode; });
  return found == std::end(Modes) ? "" : found->first;
}

std::optional<BrushMode> BrushModeNamed(const std::string& name)
{
  const auto found = std::find_if(std::begin(Modes), std::end(Modes), [&](const auto& each) { return name == each.first; });
  return found == std::end(Modes) ? std::nullopt : std::optional(found->second);
}

void Brush::Check() const
{
  if (NameOf(mode).empty())
    throw Error(Error::Kind::InvalidParameter, "the brush's mode is none of paint, carve and restore");
  CheckRange("radius (mm)", radiusMm, 0.0, 1000.0, true);
  if (!std::isfinite(intensity))
    throw Error(Error::Kind::InvalidParameter, "the brush's intensity is not finite");
  CheckRange("opacity", opacity, 0.0, 1.0);
  CheckRange("hardness", hardness, 0.0, 1.0);
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
  stroke.brush.Check();
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
