// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/StreamReport.h"
#include <gtest/gtest.h>

using namespace echorama;

TEST(StreamReport, SaysWhatTheStatisticsSay)
{
  PoseStream stream;
  stream.SetState(DeviceState::Running, "to \"whom\"");
  for (int i = 0; i < 5; ++i)
    stream.Add({"ProbeToTracker", 0.1 * i, 0.1 * i + 0.02, Pose::Identity(), TransformStatus::Valid});
  stream.Add({"ProbeToTracker", 0.4, 0.5, Pose::Identity(), TransformStatus::Valid});
  const auto report = nlohmann::json::parse(StreamReport(stream.Statistics()));
  EXPECT_EQ(report["state"], "running");
  EXPECT_EQ(report["message"], "to \"whom\"");
  EXPECT_EQ(report["live"], true);
  ASSERT_EQ(report["tools"].size(), 1u);
  EXPECT_EQ(report["tools"][0]["name"], "ProbeToTracker");
  EXPECT_EQ(report["tools"][0]["valid"], 5);
  EXPECT_NEAR(report["tools"][0]["rate_hz"].get<double>(), 10.0, 1e-9);
  EXPECT_NEAR(report["tools"][0]["median_latency_seconds"].get<double>(), 0.02, 1e-9);
  EXPECT_EQ(report["rejected"], nlohmann::json({{"duplicate", 1}}));
}

TEST(StreamReport, UnknownIsNullAndForeignTextsAreMended)
{
  PoseStream stream;
  stream.SetLive(false);
  stream.Add({"Probe\xff", 0.0, 0.0, Pose::Identity(), TransformStatus::Valid});
  stream.Reject(Rejection::Malformed, "\xc3\x28");
  const auto report = nlohmann::json::parse(StreamReport(stream.Statistics()));
  EXPECT_TRUE(report["tools"][0]["median_latency_seconds"].is_null());
  EXPECT_EQ(report["live"], false);
  EXPECT_EQ(report["rejected"]["malformed"], 1);
}
