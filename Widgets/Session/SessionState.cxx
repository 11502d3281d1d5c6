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
  if ((left ? left->count : 0) != (right ? right->count : 0))
    return false;
  for (; left != right; left = left->before.get(), right = right->before.get()) // what they share is the same from there on
    if (!(left->stroke == right->stroke))
      return false;
  return true;
}

bool SameGeometry(const ImageGeometry& a, const ImageGeometry& b)
{
  return a.dimensions == b.dimensions && a.origin == b.origin && a.spacing == b.spacing && a.direction == b.direction;
}

} // namespace

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
         a.visible == b.visible && a.group == b.group && a.landmarks == b.landmarks && SameStrokes(a.strokes, b.strokes);
}

bool operator==(const SessionState& a, const SessionState& b)
{
  return a.volumes == b.volumes;
}

} // namespace echorama
