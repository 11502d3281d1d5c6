// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Stream/PoseStream.h"
#include <functional>

namespace echorama {

/// Starts the thread of a device. When \a job throws, whatever it is, the state of \a poses becomes Failed, with what was thrown;
/// when it returns because it was stopped, Idle, unless the job has said Ended or Failed: these stay to be read. \a poses must
/// outlive the thread.
void RunDevice(Worker& worker, PoseStream& poses, std::function<void(const Worker::Signal&)> job);

/// What becomes of the state of a device that is stopped, as above; for those that have no thread.
void SetStopped(PoseStream& poses);

} // namespace echorama
