// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Stream/PoseStream.h"

namespace echorama {

/// For devices that can wait, as recordings can: those who subscribed to their poses lose none. Who takes nothing for ten seconds
/// is waited for no more, until it has taken enough again.
class ReaderPatience {
public:
  /// Before the next pose. \returns false when it was stopped meanwhile
  bool Wait(const PoseStream& poses, const Worker::Signal& signal);

private:
  bool isAnybodyThere_ = true;
};

} // namespace echorama
