// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/RunDevice.h"
#include <gtest/gtest.h>
#include <new>
#include <stdexcept>

using namespace echorama;

namespace {

using Said = std::pair<DeviceState, std::string>;

// The state that a job leaves when it has returned, and when it was stopped then.
std::pair<Said, Said> StatesOf(const std::function<void(PoseStream&, const Worker::Signal&)>& job)
{
  PoseStream poses;
  Worker worker;
  poses.SetState(DeviceState::Running, "there");
  RunDevice(worker, poses, [&](const Worker::Signal& signal) { job(poses, signal); });
  const auto before = [&] {
    for (int i = 0; i < 600 && worker.Running() && poses.State().second != "waits"; ++i)
      poses.WaitBeyond(poses.Version(), 0.1);
    return poses.State();
  }();
  worker.Stop();
  return {before, poses.State()};
}

} // namespace

TEST(RunDevice, WhatIsThrownIsTold)
{
  const Said runtime{DeviceState::Failed, "the cable burns"}, memory{DeviceState::Failed, std::bad_alloc().what()};
  const auto throws = [](auto what) { return StatesOf([what](PoseStream&, const Worker::Signal&) { throw what; }); };
  EXPECT_EQ(throws(std::runtime_error("the cable burns")), std::make_pair(runtime, runtime));
  EXPECT_EQ(throws(std::bad_alloc()), std::make_pair(memory, memory));
  EXPECT_EQ(throws(7).first.first, DeviceState::Failed);
}

TEST(RunDevice, WhoIsStoppedIsIdleAndAnEndStays)
{
  for (const DeviceState state : {DeviceState::Running, DeviceState::Lost, DeviceState::Connecting})
    EXPECT_EQ(StatesOf([state](PoseStream& poses, const Worker::Signal& signal) {
                poses.SetState(state, "waits");
                while (signal.Sleep(3600.0)) {
                }
              }),
              std::make_pair(Said(state, "waits"), Said(DeviceState::Idle, "")));
  for (const DeviceState state : {DeviceState::Ended, DeviceState::Failed}) {
    const Said said(state, "waits");
    EXPECT_EQ(StatesOf([state](PoseStream& poses, const Worker::Signal&) { poses.SetState(state, "waits"); }),
              std::make_pair(said, said));
  }
}
