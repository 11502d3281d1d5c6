// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/TemporalCalibration.h"
#include "Readers/PoseLog.h"
#include "Testing/Sanitized.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

// A hand's motion without a rhythm: sums of waves of random frequencies.
class Motion {
public:
  explicit Motion(std::uint64_t seed, double degrees = 20.0, double mm = 40.0)
  {
    Random random(seed);
    for (std::size_t axis = 0; axis < 6; ++axis)
      for (Wave& wave : waves_[axis])
        wave = {(axis < 3 ? mm : degrees / DegreesPerRadian) * random.Uniform(0.1, 1.0), random.Uniform(0.05, 0.8),
                random.Uniform(0.0, 2.0 * Pi)};
  }
  Pose At(double time) const
  {
    Vector3d place = Vector3d::Zero(), turn = Vector3d::Zero();
    for (std::size_t axis = 0; axis < 6; ++axis)
      for (const Wave& wave : waves_[axis])
        (axis < 3 ? place : turn)[static_cast<Eigen::Index>(axis % 3)] +=
            wave.size * std::sin(2.0 * Pi * wave.frequency * time + wave.phase);
    Pose pose = Pose::Identity();
    pose.linear() = ExpRotation(turn);
    pose.translation() = place;
    return pose;
  }

private:
  struct Wave {
    double size = 0.0, frequency = 0.0, phase = 0.0;
  };
  std::array<std::array<Wave, 5>, 6> waves_;
};

struct Recording {
  double from = 0.0, to = 30.0, rate = 60.0; // true time
  double clock = 0.0, drift = 0.0;           // what the clock shows: time + clock + drift * time
  double degrees = 0.1, mm = 0.3;            // noise
  double dropped = 0.0;                      // share of poses that are not there
  Pose frame = Pose::Identity(), mount = Pose::Identity();
};

std::vector<TimedPose> Record(const std::function<Pose(double)>& motion, const Recording& r, std::uint64_t seed)
{
  Random random(seed);
  std::vector<TimedPose> poses;
  for (double time = r.from; time < r.to; time += 1.0 / r.rate) {
    const double jittered = time + random.Uniform(-0.2, 0.2) / r.rate;
    Pose noise = Pose::Identity();
    const Vector3d w(random.Normal(), random.Normal(), random.Normal());
    noise.linear() = ExpRotation(r.degrees / DegreesPerRadian * w);
    noise.translation() = r.mm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    const Pose pose = r.frame * motion(jittered) * r.mount * noise;
    if (random.Uniform() >= r.dropped)
      poses.push_back({jittered + r.clock + r.drift * jittered, pose});
  }
  return poses;
}

// Another tracker, with its own frame and its sensor elsewhere on the body.
Recording Other(double clock)
{
  Recording other;
  Twist frame, mount;
  frame << 300.0, -200.0, 50.0, 1.0, -0.5, 2.0;
  mount << 20.0, 30.0, -120.0, 0.3, 2.0, -0.7;
  other.frame = Exp(frame);
  other.mount = Exp(mount);
  other.clock = clock;
  other.rate = 37.0;
  other.from = -3.0;
  other.to = 26.0;
  return other;
}

std::function<Pose(double)> Moving(std::uint64_t seed)
{
  const Motion motion(seed);
  return [motion](double time) { return motion.At(time); };
}

void Refused(const std::vector<TimedPose>& a, const std::vector<TimedPose>& b, Error::Kind kind, const std::string& words,
             TemporalParameters parameters = {})
{
  ExpectRefused([&] { CalibrateTime(a, b, parameters); }, kind,
                kind == Error::Kind::InvalidParameter ? "" : "temporal calibration", words);
}

bool HasNote(const TemporalResult& result, const std::string& words)
{
  for (const std::string& note : result.notes)
    if (note.find(words) != std::string::npos)
      return true;
  return false;
}

std::string Data(const std::string& name)
{
  const std::string path = std::string(ECHORAMA_SOURCE_DIR) + "/../shared/data/" + name;
  return std::filesystem::exists(path) ? path : "";
}

std::vector<TimedPose> Valid(const std::vector<ToolPose>& poses)
{
  std::vector<TimedPose> valid;
  for (const ToolPose& pose : poses)
    if (pose.status == TransformStatus::Valid)
      valid.push_back({pose.time, pose.pose});
  return valid;
}

} // namespace

TEST(TemporalCalibration, Exact)
{
  for (const double clock : {0.0, 0.3217, -2.75}) {
    Recording a, b = Other(clock);
    a.degrees = a.mm = b.degrees = b.mm = 0.0;
    const TemporalResult result = CalibrateTime(Record(Moving(1), a, 1), Record(Moving(1), b, 2));
    EXPECT_NEAR(result.offsetSeconds, -clock, 1e-3);
    EXPECT_LT(result.standardErrorSeconds, 1e-3);
    EXPECT_GT(result.correlation, 0.999);
    EXPECT_NEAR(result.speedRatio, 1.0, 0.01);
    EXPECT_GT(result.confidence, 0.99);
    EXPECT_EQ(result.signal, SpeedSignal::Rotation);
    EXPECT_FALSE(result.drifts);
    EXPECT_TRUE(result.notes.empty()) << result.notes[0];
  }
}

// The error by the stated standard error, over many motions and noises.
TEST(TemporalCalibration, StatedErrorHolds)
{
  ECHORAMA_SKIP_SANITIZED();
  const ThreadLimit one(1); // its loops are too short to share
  for (const double noise : {0.05, 0.25}) {
    int held = 0;
    double squares = 0.0, stated = 0.0, normalised = 0.0;
    constexpr int Trials = 60;
    for (std::uint64_t trial = 0; trial < Trials; ++trial) {
      Recording a, b = Other(0.4);
      a.degrees = b.degrees = noise;
      a.dropped = b.dropped = trial % 3 == 0 ? 0.2 : 0.0;
      const TemporalResult result = CalibrateTime(Record(Moving(trial), a, 1000 + trial), Record(Moving(trial), b, 2000 + trial));
      const double error = result.offsetSeconds + 0.4;
      held += std::fabs(error) <= 1.96 * result.standardErrorSeconds;
      squares += error * error;
      stated += result.standardErrorSeconds * result.standardErrorSeconds;
      normalised += error * error / (result.standardErrorSeconds * result.standardErrorSeconds);
    }
    SCOPED_TRACE("noise " + std::to_string(noise) + ", held " + std::to_string(held) + ", rms " +
                 std::to_string(std::sqrt(squares / Trials)) + ", stated " + std::to_string(std::sqrt(stated / Trials)));
    EXPECT_GE(held, 54);
    EXPECT_NEAR(std::sqrt(normalised / Trials), 1.0, 0.2);
    EXPECT_LT(std::sqrt(squares / Trials), 0.001);
  }
}

TEST(TemporalCalibration, ClocksThatDoNotOverlap)
{
  Recording a, b = Other(0.0);
  b.clock = 1.7e9 + 0.25;
  const TemporalResult result = CalibrateTime(Record(Moving(3), a, 1), Record(Moving(3), b, 2));
  EXPECT_NEAR(result.offsetSeconds, -1.7e9 - 0.25, 0.01);
  EXPECT_TRUE(HasNote(result, "do not overlap"));
}

TEST(TemporalCalibration, Gaps)
{
  Recording a, b = Other(0.15);
  std::vector<TimedPose> first = Record(Moving(4), a, 1), second = Record(Moving(4), b, 2);
  const auto cut = [](std::vector<TimedPose>& poses, double from, double to) {
    poses.erase(std::remove_if(poses.begin(), poses.end(), [=](const TimedPose& p) { return p.time > from && p.time < to; }),
                poses.end());
  };
  cut(first, 5.0, 8.0);
  cut(second, 15.0, 20.0);
  const TemporalResult result = CalibrateTime(first, second);
  EXPECT_NEAR(result.offsetSeconds, -0.15, 5.0 * result.standardErrorSeconds);
  EXPECT_LT(result.standardErrorSeconds, 0.005);
  EXPECT_LT(result.overlapSeconds, 19.0);
  // Poses out of order and given twice change nothing.
  std::reverse(first.begin(), first.end());
  second.insert(second.end(), second.begin(), second.begin() + 50);
  EXPECT_EQ(CalibrateTime(first, second).offsetSeconds, result.offsetSeconds);
}

TEST(TemporalCalibration, ClocksThatJump)
{
  Recording a, b = Other(0.15);
  const std::vector<TimedPose> first = Record(Moving(4), a, 1), second = Record(Moving(4), b, 2);
  for (const double jump : {1e5, 1e6, 1.7e9, 1e15}) {
    std::vector<TimedPose> jumped = first;
    jumped.back().time = jump;
    Refused(jumped, second, Error::Kind::NotPossible, "the times of the first stream jump from 29.9");
    Refused(second, jumped, Error::Kind::NotPossible, "the times of the second stream jump from 29.9");
    jumped = first;
    jumped.front().time = -jump;
    Refused(jumped, second, Error::Kind::NotPossible, "the times of the first stream jump from -1");
  }
  // A pause of ten minutes is none.
  std::vector<TimedPose> paused = first;
  paused.push_back({600.0, paused.back().pose});
  EXPECT_NEAR(CalibrateTime(paused, second).offsetSeconds, -0.15, 0.005);
}

TEST(TemporalCalibration, Drift)
{
  Recording a, b = Other(0.2);
  a.to = 120.0;
  b.to = 110.0;
  b.drift = 300e-6;
  a.degrees = b.degrees = 0.05;
  const TemporalResult result = CalibrateTime(Record(Moving(5), a, 1), Record(Moving(5), b, 2));
  EXPECT_TRUE(result.drifts);
  EXPECT_NEAR(result.driftPpm, -300.0, 5.0 * result.driftErrorPpm);
  EXPECT_LT(result.driftErrorPpm, 60.0);
  EXPECT_NEAR(result.offsetSeconds, -0.2 - 300e-6 * result.middleSeconds, 5.0 * result.standardErrorSeconds);
  EXPECT_TRUE(HasNote(result, "drifts"));
}

TEST(TemporalCalibration, Translation)
{
  const Motion motion(6);
  const auto sliding = [&motion](double time) {
    Pose pose = motion.At(time);
    pose.linear().setIdentity();
    return pose;
  };
  Recording a, b = Other(-0.6);
  a.degrees = b.degrees = 0.02;
  const TemporalResult result = CalibrateTime(Record(sliding, a, 1), Record(sliding, b, 2));
  EXPECT_EQ(result.signal, SpeedSignal::Translation);
  EXPECT_NEAR(result.offsetSeconds, 0.6, 0.01);
  EXPECT_TRUE(HasNote(result, "follow the same point"));
  TemporalParameters rotation;
  rotation.signal = SpeedSignal::Rotation;
  Refused(Record(sliding, a, 1), Record(sliding, b, 2), Error::Kind::NotPossible, "", rotation);
}

TEST(TemporalCalibration, MotionsThatDoNotTell)
{
  Recording a, b = Other(0.3);
  const auto refused = [&](const std::function<Pose(double)>& motion, const std::string& words) {
    Refused(Record(motion, a, 1), Record(motion, b, 2), Error::Kind::NotPossible, words);
  };
  const auto rotating = [](const std::function<double(double)>& angle) {
    return [angle](double time) {
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation(Vector3d(0.6, 0.0, 0.8) * angle(time));
      return pose;
    };
  };
  refused(rotating([](double) { return 0.0; }), "");
  refused(rotating([](double time) { return 2.0 * time; }), "hardly changes");
  refused(rotating([](double time) { return 0.5 * std::sin(2.0 * Pi * time); }), "the motion repeats itself");
  a.degrees = a.mm = b.degrees = b.mm = 0.0;
  refused(rotating([](double) { return 0.0; }), "hardly turns");
  refused(rotating([](double time) { return 0.5 * std::sin(2.0 * Pi * time); }), "the motion repeats itself");
  // Different motions.
  a = Recording();
  b = Other(0.3);
  Refused(Record(Moving(8), a, 1), Record(Moving(9), b, 2), Error::Kind::NotPossible, "");
  // Too far apart for the range, and exactly at its end.
  TemporalParameters parameters;
  parameters.largestOffsetSeconds = 1.0;
  b.clock = 2.0;
  Refused(Record(Moving(8), a, 1), Record(Moving(8), b, 2), Error::Kind::NotPossible, "", parameters);
  b.clock = 1.1;
  Refused(Record(Moving(8), a, 1), Record(Moving(8), b, 2), Error::Kind::NotPossible, "end of what was looked at", parameters);
}

// Enough to correlate, and too few to fit: the ends of a piecewise cubic are not known.
TEST(TemporalCalibration, TooFewMoments)
{
  Recording a;
  a.degrees = a.mm = 0.0;
  a.to = 1.75;
  TemporalParameters parameters;
  parameters.smoothingSeconds = 0.5;
  parameters.leastOverlapSeconds = 0.5;
  parameters.largestOffsetSeconds = 0.4;
  int few = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<TimedPose> poses = Record(Moving(seed), a, 1);
    try {
      CalibrateTime(poses, poses, parameters);
      ADD_FAILURE() << "nothing was refused";
    } catch (const Error& error) {
      EXPECT_EQ(static_cast<int>(error.GetKind()), static_cast<int>(Error::Kind::NotPossible)) << error.what();
      few += std::string(error.what()).find("overlap in too few moments") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GT(few, 0);
}

TEST(TemporalCalibration, BadInput)
{
  const std::vector<TimedPose> good = Record(Moving(1), Recording(), 1);
  std::vector<TimedPose> bad = good;
  Refused({}, good, Error::Kind::NotPossible, "the first stream has only 0 poses");
  Refused(good, {good.begin(), good.begin() + 5}, Error::Kind::NotPossible, "the second stream has only 5 poses");
  bad[7].time = NAN;
  Refused(good, bad, Error::Kind::BadInput, "a time of the second stream is not finite");
  bad = good;
  bad[7].pose.translation()[0] = NAN;
  Refused(good, bad, Error::Kind::BadInput, "the second stream");
  bad = good;
  bad[7].pose.linear() *= 2.0;
  Refused(bad, good, Error::Kind::BadInput, "the first stream");
  Refused(good, {good.begin(), good.begin() + 60}, Error::Kind::NotPossible, "overlap for less than 3 s");
  for (const auto& [parameters, words] :
       {std::pair{TemporalParameters{SpeedSignal::Automatic, 0.0}, "LargestOffset is 0 s; it must be in (0, 3600]"},
        std::pair{TemporalParameters{SpeedSignal::Automatic, 5.0, 3.0}, "Smoothing is 3 s"},
        std::pair{TemporalParameters{SpeedSignal::Automatic, 5.0, 0.05, NAN}, "LongestGap is nan s"},
        std::pair{TemporalParameters{SpeedSignal::Automatic, 5.0, 0.05, 0.5, 0.0}, "LeastOverlap is 0 s"}})
    Refused(good, good, Error::Kind::InvalidParameter, words, parameters);
  EXPECT_THROW(CalibrateTime(good, good, {}, Progress([](double) { return false; })), Error);
}

// Both streams of these files were put onto one clock by their makers.
TEST(TemporalCalibration, RecordedPairsAreAligned)
{
  const std::string arm = Data("handeye_ethz/paired_robot_arm_sim.csv");
  if (arm.empty())
    GTEST_SKIP() << "the recordings are not there";
  const PoseLog log = ReadPoseLog(arm);
  const TemporalResult result = CalibrateTime(Valid(log.Of("HandToBase")), Valid(log.Of("TargetToCamera")));
  EXPECT_NEAR(result.offsetSeconds, 0.0, 0.01);
  for (const char* name : {"handeye_ethz/paired_vicon_1.csv", "handeye_ethz/paired_vicon_2.csv"}) {
    PoseLogOptions options;
    options.rowsPerSecond = 15.0; // the times in the files have too few digits
    const PoseLog pairs = ReadPoseLog(Data(name), options);
    const TemporalResult vicon = CalibrateTime(Valid(pairs.Of("HandToBase")), Valid(pairs.Of("TargetToCamera")));
    EXPECT_NEAR(vicon.offsetSeconds, 0.0, 0.01);
  }
}

// Every second pose of a recording against the others, which an offset was added to. What hardly moved is refused.
TEST(TemporalCalibration, HalvesOfRecordings)
{
  struct Case {
    const char *file, *tool;
    bool moves;
  };
  for (const Case& c : {Case{"plus/NwirePhantomFreehand.igs.mha", "ProbeToTracker", true},
                        Case{"plus/USTC_3NWires_ProbeRotation.igs.mha", "ProbeToStepperHome", true},
                        Case{"plus/USTC_3NWires_ProbeTranslation.igs.mha", "ProbeToStepperHome", true},
                        Case{"plus/WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha", "ProbeToTracker", true},
                        Case{"plus/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha", "StylusToTracker", true},
                        Case{"plus/WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha", "StylusToTracker", false},
                        Case{"plus/USTC_3NWires_ProbeRotation.igs.mha", "TemplateToStepperHome", false},
                        Case{"aurora/NDIdata_snakeravenTest_2_2_21.csv", "SensorAToTracker", false}}) {
    const std::string path = Data(c.file);
    if (path.empty())
      GTEST_SKIP() << "the recordings are not there";
    SCOPED_TRACE(path);
    const std::vector<TimedPose> all = Valid(ReadPoseLog(path).Of(c.tool));
    std::vector<TimedPose> odd, even;
    for (std::size_t i = 0; i < all.size(); ++i)
      (i % 2 ? odd : even).push_back(all[i]);
    for (TimedPose& pose : odd)
      pose.time += 0.321;
    if (!c.moves) {
      Refused(even, odd, Error::Kind::NotPossible, "hardly");
      continue;
    }
    const TemporalResult result = CalibrateTime(even, odd);
    EXPECT_NEAR(result.offsetSeconds, -0.321, 4.0 * result.standardErrorSeconds);
    EXPECT_LT(result.standardErrorSeconds, 0.02); // of poses 0.02 to 0.2 s apart
  }
}
