// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Tracking/Cameras/RecordedSource.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Stream/Clock.h"
#include <cstring>
#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace {

using namespace echorama;
using Outcome = CameraSource::Outcome;
namespace fs = std::filesystem;

class RecordedSourceTest : public testing::Test {
protected:
  void SetUp() override
  {
    folder = fs::path(testing::TempDir()) / ("echorama-recorded-" + std::to_string(::getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  std::string Path(const std::string& name = "film.igs.mhd") const { return (folder / name).string(); }
  std::unique_ptr<CameraSource> Simulated() const
  {
    return MakeCamera(
        "simulated:?width=64&height=48&focal=19&centreX=31.5&centreY=23.5&speed=0&frames=30&lostFrames=0.2&rowUs=9");
  }
  void Record() const
  {
    const auto source = Simulated();
    CameraRecorder recorder(Path(), source->Open());
    CameraFrame frame;
    while (source->Next(frame, 0.0) == Outcome::Frame)
      recorder.Add(frame);
    recorder.Finish();
  }
  std::string Refusal(const std::string& options = "") const
  {
    try {
      const auto source = MakeCamera("recording:" + Path() + options);
      source->Open();
      CameraFrame frame;
      while (source->Next(frame, 0.0) == Outcome::Frame) {
      }
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  void Change(const std::string& from, const std::string& to) const
  {
    std::string text = ReadTextFile(Path());
    std::size_t count = 0;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()), ++count)
      text.replace(at, from.size(), to);
    ASSERT_GT(count, 0u);
    WriteTextFile(Path(), text);
  }

  fs::path folder;
};

TEST_F(RecordedSourceTest, GivesBackFramesTimesNumbersAndWhatTheCameraWas)
{
  Record();
  const auto camera = Simulated(), film = MakeCamera("recording:" + Path() + "?speed=0");
  const CameraFormat expected = camera->Open(), format = film->Open();
  EXPECT_EQ(format.width, expected.width);
  EXPECT_EQ(format.height, expected.height);
  EXPECT_EQ(format.frameRate, expected.frameRate);
  EXPECT_EQ(format.exposureMs, expected.exposureMs);
  EXPECT_EQ(format.rowUs, expected.rowUs);
  EXPECT_FALSE(film->IsLive());
  CameraFrame a, b;
  int frames = 0;
  std::int64_t lostBefore = -1;
  while (camera->Next(a, 0.0) == Outcome::Frame) {
    ASSERT_EQ(film->Next(b, 0.0), Outcome::Frame);
    EXPECT_EQ(a.begin, b.begin);
    EXPECT_EQ(a.arrival, b.arrival);
    EXPECT_EQ(a.number, b.number);
    ASSERT_EQ(std::memcmp(a.grey.data, b.grey.data, 64 * 48), 0);
    if (lostBefore < 0)
      lostBefore = camera->Lost(); // what was lost before the first frame nobody can know
    EXPECT_EQ(film->Lost(), camera->Lost() - lostBefore);
    ++frames;
  }
  EXPECT_GT(frames, 15);
  EXPECT_GT(film->Lost(), 0);
  EXPECT_EQ(film->Next(b, 0.0), Outcome::Ended);
}

TEST_F(RecordedSourceTest, FramesWithoutAnImageAreLostOnes)
{
  Record();
  const auto numbers = [this] {
    const auto film = MakeCamera("recording:" + Path() + "?speed=0");
    film->Open();
    std::vector<std::int64_t> seen;
    CameraFrame frame;
    while (film->Next(frame, 0.0) == Outcome::Frame)
      seen.push_back(frame.number);
    EXPECT_EQ(film->Lost(), seen.back() - seen.front() + 1 - static_cast<std::int64_t>(seen.size()));
    return seen;
  };
  for (const bool areNumbered : {true, false}) {
    auto expected = numbers();
    const auto text = ReadTextFile(Path());
    Change("Seq_Frame0003_ImageStatus = OK", "Seq_Frame0003_ImageStatus = INVALID");
    Change("Seq_Frame0004_ImageStatus = OK", "Seq_Frame0004_ImageStatus = INVALID");
    expected.erase(expected.begin() + 3, expected.begin() + 5);
    EXPECT_EQ(numbers(), expected);
    WriteTextFile(Path(), text);
    if (areNumbered)
      Change("_FrameNumber", "_Elsewhere");
  }
}

TEST_F(RecordedSourceTest, AnArrivalOfAnotherClockSaysNothing)
{
  Record();
  const std::string text = ReadTextFile(Path());
  const std::string key = "Seq_Frame0002_Arrival = ";
  const std::size_t at = text.find(key) + key.size();
  ASSERT_GT(at, key.size());
  for (const auto& [after, isTaken] : {std::pair(0.5, true), std::pair(-0.5, false), std::pair(3600.0, false)}) {
    const auto film = MakeCamera("recording:" + Path() + "?speed=0");
    film->Open();
    CameraFrame frame;
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(film->Next(frame, 0.0), Outcome::Frame);
    std::string changed = text;
    changed.replace(at, text.find('\n', at) - at, std::to_string(frame.begin + after));
    WriteTextFile(Path(), changed);
    film->Open();
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(film->Next(frame, 0.0), Outcome::Frame);
    EXPECT_NEAR(frame.arrival, frame.begin + (isTaken ? after : 0.0), 1e-5) << after;
    WriteTextFile(Path(), text);
  }
}

TEST_F(RecordedSourceTest, IsReplayedInTheTimeItTook)
{
  Record();
  const auto film = MakeCamera("recording:" + Path() + "?speed=2");
  film->Open();
  CameraFrame frame;
  ASSERT_EQ(film->Next(frame, 0.0), Outcome::Frame);
  const double begun = ClockNow(), first = frame.begin;
  EXPECT_EQ(film->Next(frame, 0.0), Outcome::Nothing);
  while (film->Next(frame, 1.0) == Outcome::Frame)
    EXPECT_GE(ClockNow() - begun, 0.5 * (frame.begin - first) - 1e-3);
}

TEST_F(RecordedSourceTest, OneThatWasKilledOpensUpToThere)
{
  {
    const auto source = Simulated();
    CameraRecorder recorder(Path(), source->Open());
    CameraFrame frame;
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(source->Next(frame, 0.0), Outcome::Frame);
      recorder.Add(frame);
    }
    fs::copy(Path(), Path("copy.igs.mhd")); // as a kill would leave it: the first frame is safe at once
    fs::copy(folder / "film.igs.raw", folder / "copy.igs.raw");
  }
  std::string header = ReadTextFile(Path("copy.igs.mhd"));
  header.replace(header.rfind("film.igs.raw"), 12, "copy.igs.raw");
  WriteTextFile(Path("copy.igs.mhd"), header);
  const auto film = MakeCamera("recording:" + Path("copy.igs.mhd") + "?speed=0");
  film->Open();
  CameraFrame frame;
  int frames = 0;
  while (film->Next(frame, 0.0) == Outcome::Frame)
    ++frames;
  EXPECT_GE(frames, 1);
}

TEST_F(RecordedSourceTest, SaysWhatIsWrongWithAFile)
{
  EXPECT_NE(Refusal().find("film.igs.mhd"), std::string::npos); // missing
  Record();
  EXPECT_EQ(Refusal("?speed=0"), "");
  fs::resize_file(folder / "film.igs.raw", 64 * 48 * 7 + 100);
  EXPECT_NE(Refusal("?speed=0").find("truncated"), std::string::npos) << Refusal("?speed=0");
}

TEST_F(RecordedSourceTest, TimeStampsMustBeThereAndGoOn)
{
  Record();
  Change("_Timestamp", "_Timelessly");
  EXPECT_NE(Refusal("?speed=0").find("frame 0 has no time stamp"), std::string::npos) << Refusal("?speed=0");
  EXPECT_EQ(Refusal("?speed=0&frameRate=90"), "");
  fs::remove(Path());
  fs::remove(folder / "film.igs.raw");
  Record();
  std::string text = ReadTextFile(Path());
  const std::string key = "Seq_Frame0003_Timestamp = ";
  const std::size_t at = text.find(key);
  ASSERT_NE(at, std::string::npos);
  text.replace(at + key.size(), text.find('\n', at) - at - key.size(), "0");
  WriteTextFile(Path(), text);
  EXPECT_NE(Refusal("?speed=0").find("the time stamps do not go on: frame 3"), std::string::npos) << Refusal("?speed=0");
}

TEST_F(RecordedSourceTest, FramesOfAnotherSizeAndFilesThatAreThereAreRefused)
{
  Record();
  EXPECT_THROW(Record(), Error);
  CameraFormat format;
  format.width = 32;
  format.height = 48;
  CameraRecorder recorder(Path("other.igs.mhd"), format);
  const auto source = Simulated();
  source->Open();
  CameraFrame frame;
  ASSERT_EQ(source->Next(frame, 0.0), Outcome::Frame);
  EXPECT_THROW(recorder.Add(frame), Error);
  EXPECT_THROW(recorder.Finish(), Error);
  EXPECT_THROW(MakeCamera("recording:"), Error);
}

} // namespace
