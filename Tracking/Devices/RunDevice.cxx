// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/RunDevice.h"
#include <exception>
#include <utility>

namespace echorama {

void RunDevice(Worker& worker, PoseStream& poses, std::function<void(const Worker::Signal&)> job)
{
  worker.Start([&poses, job = std::move(job)](const Worker::Signal& signal) {
    try {
      job(signal);
    } catch (const std::exception& error) {
      poses.SetState(DeviceState::Failed, error.what());
    } catch (...) {
      poses.SetState(DeviceState::Failed, "it threw something that is no exception");
    }
    if (signal.Stopped())
      SetStopped(poses);
  });
}

void SetStopped(PoseStream& poses)
{
  const DeviceState state = poses.State().first;
  if (state != DeviceState::Ended && state != DeviceState::Failed)
    poses.SetState(DeviceState::Idle);
}

} // namespace echorama
