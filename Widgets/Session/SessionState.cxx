// SPDX-License-Identifier: BSD-3-Clause
// States are compared to the last bit, because "nothing has changed" decides whether there is an entry to undo. Chains of
// strokes are mostly the same object; two that are not (one was read from a file) are compared stroke by stroke.
#include "Widgets/Session/SessionState.h"
#include <algorithm>

namespace echorama {
namespace {

bool SameStrokes(const StrokeChain& a, const StrokeChain& b)
{
  const StrokeNode *left = a.get(), *right = b.get();
  if ((left ? left->count : 0) != (right ? right->count : 0) || (left && left->digest != right->digest))
    return false;
  for (; left != right; left = left->before.get(), right = right->before.get()) // what they share is the same from there on
    if (!(left->stroke == right->stroke))
      return false;
  return true;
}

bool SameMaking(const std::shared_ptr<const MadeOf>& a, const std::shared_ptr<const MadeOf>& b)
{
  return a == b || (a && b && *a == *b);
}

} // namespace

bool SameGeometry(const ImageGeometry& a, const ImageGeometry& b)
{
  return a.dimensions == b.dimensions && a.origin == b.origin && a.spacing == b.spacing && a.direction == b.direction;
}

const SessionVolume* SessionState::Find(int id) const
{
  const auto found = std::find_if(volumes.begin(), volumes.end(), [id](const SessionVolume& volume) { return volume.id == id; });
  return found == volumes.end() ? nullptr : &*found;
}

SessionVolume* SessionState::Find(int id)
{
  return const_cast<SessionVolume*>(static_cast<const SessionState&>(*this).Find(id));
}

bool operator==(const SessionVolume& a, const SessionVolume& b)
{
  return a.id == b.id && a.name == b.name && a.file == b.file && SameGeometry(a.geometry, b.geometry) &&
         a.volumeToWorld.matrix() == b.volumeToWorld.matrix() && a.colour == b.colour && a.opacity == b.opacity &&
         a.visible == b.visible && a.group == b.group && a.landmarks == b.landmarks && a.edition == b.edition &&
         SameMaking(a.madeOf, b.madeOf) && SameStrokes(a.strokes, b.strokes);
}

bool operator==(const SessionState& a, const SessionState& b)
{
  return a.centre == b.centre && a.volumes == b.volumes && a.measurements == b.measurements;
}

} // namespace echorama
