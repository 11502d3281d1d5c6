// SPDX-License-Identifier: BSD-3-Clause
// A recorder is killed, and its disk is full, at every sort of moment: the file must open each time, with what was safe.
#include "Core/Base/Random.h"
#include "Readers/SequenceWriter.h"
#include "Testing/TemporaryFolder.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include <chrono>
#include <cmath>
#include <cstring>
#include <sys/mman.h>
#include <sys/wait.h>
#include <thread>

using namespace echorama;
using namespace echorama::testing;

namespace {

class SequenceRecorderTest : public TemporaryFolder {};

double Seconds()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Two tools, of which the second comes later and is missing now and then.
SequenceFrame FrameOf(int number, double time)
{
  SequenceFrame frame;
  frame.time = time;
  Twist twist;
  twist << number, 1.0 / 3.0, 2.0, 0.1, 0.01 * number, 0.3;
  frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d(Exp(twist).matrix()), TransformStatus::Valid, "OK"});
  if (number >= 3)
    frame.transforms.push_back({"StylusToTracker", Eigen::Affine3d::Identity(),
                                number % 4 ? TransformStatus::Valid : TransformStatus::Missing, number % 4 ? "OK" : "MISSING"});
  frame.fields = {{"FrameNumber", std::to_string(number)}};
  return frame;
}

void ExpectFrame(const SequenceFrame& frame, int number)
{
  const SequenceFrame truth = FrameOf(number, frame.time);
  ASSERT_EQ(frame.transforms.size(), truth.transforms.size()) << number;
  for (std::size_t i = 0; i < truth.transforms.size(); ++i) {
    EXPECT_EQ(frame.transforms[i].matrix.matrix(), truth.transforms[i].matrix.matrix());
    EXPECT_EQ(frame.transforms[i].status, truth.transforms[i].status);
  }
  EXPECT_EQ(frame.fields, truth.fields);
}

std::string PixelsOf(int number, std::uint64_t bytes)
{
  return std::string(bytes, static_cast<char>('a' + number % 26));
}

// What a recording holds: the frames from 0 on, each as it was. \returns their number
int CheckRecording(const std::string& path)
{
  SequenceFile file(path);
  const SequenceContent& content = file.Content();
  std::string pixels(content.HasImages() ? content.FrameBytes() : 0, ' ');
  for (int i = 0; i < content.frames; ++i) {
    ExpectFrame(file.Frame(i), i);
    if (content.HasImages()) {
      file.ReadFrame(i, pixels.data());
      EXPECT_EQ(pixels, PixelsOf(i, pixels.size()));
    }
  }
  return content.frames;
}

SequenceContent Images(int width, int height)
{
  SequenceContent content;
  content.dimensions = {width, height, 1};
  content.imageType = "BRIGHTNESS";
  return content;
}

} // namespace

TEST_F(SequenceRecorderTest, AFrameWithoutPixelsIsZeros)
{
  SequenceRecorder recorder(Path("a.igs.mhd"), Images(5, 3));
  for (int i = 0; i < 3; ++i)
    recorder.Append(FrameOf(i, i), i == 1 ? nullptr : PixelsOf(i, 15).data());
  recorder.Finish();
  SequenceFile file(Path("a.igs.mhd"));
  ASSERT_EQ(file.Content().frames, 3);
  std::string pixels(15, 'x');
  for (int i = 0; i < 3; ++i) {
    file.ReadFrame(i, pixels.data());
    EXPECT_EQ(pixels, i == 1 ? std::string(15, '\0') : PixelsOf(i, 15));
    EXPECT_EQ(file.Frame(i).imageValid, i != 1);
  }
}

TEST_F(SequenceRecorderTest, ComesBack)
{
  for (const bool images : {false, true}) {
    const std::string path = Path(images ? "a.igs.mhd" : "a.igs.mha");
    SequenceContent content = images ? Images(5, 3) : SequenceContent();
    content.fields = {{"Operator", "nobody"}};
    SequenceRecorder recorder(path, content, {false, 0.0, true});
    for (int i = 0; i < 30; ++i) {
      recorder.Append(FrameOf(i, 0.1 * i), images ? PixelsOf(i, 15).data() : nullptr);
      EXPECT_EQ(recorder.SafeFrames(), i + 1);
    }
    EXPECT_EQ(CheckRecording(path), 30); // while it is being recorded
    recorder.Finish();
    EXPECT_EQ(CheckRecording(path), 30);
    const SequenceFile file(path);
    EXPECT_EQ(file.Time(7), 0.1 * 7);
    EXPECT_EQ(file.Content().fields.front(), (HeaderField{"Operator", "nobody"}));
    for (const std::string& note : file.Content().notes)
      EXPECT_EQ(note.find("cut off"), std::string::npos) << note;
    ExpectRefused([&] { recorder.Append({}); }, Error::Kind::InvalidParameter, path, "finished");
  }
}

TEST_F(SequenceRecorderTest, KilledAtAnyMoment)
{
  struct Shared {
    volatile int begun, safe; // frames whose Append has begun, and that are safe
    volatile double newest;   // time of the frame that was appended last
  };
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  Shared* shared = static_cast<Shared*>(memory);
  Random random(3);
  int shortened = 0;
  for (int trial = 0; trial < 80; ++trial) {
    const bool images = trial % 3 == 2;
    const std::string path = Path("run" + std::to_string(trial) + (images ? ".igs.mhd" : ".igs.mha"));
    const double flush = trial % 2 ? 0.0 : 0.01;
    shared->begun = shared->safe = 0;
    shared->newest = 0.0;
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      try {
        SequenceRecorder recorder(path, images ? Images(64, 50) : SequenceContent(), {false, flush, trial % 8 == 0});
        for (int i = 0;; ++i) {
          const double now = Seconds();
          shared->begun = i + 1;
          recorder.Append(FrameOf(i, now), images ? PixelsOf(i, 3200).data() : nullptr);
          shared->newest = now;
          shared->safe = recorder.SafeFrames();
        }
      } catch (...) {
      }
      _exit(1);
    }
    while (shared->safe < 1)
      std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random.Below(15000)));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the recorder ended by itself";
    const int frames = CheckRecording(path);
    EXPECT_GE(frames, shared->safe);
    EXPECT_LE(frames, shared->begun);
    EXPECT_GE(SequenceFile(path).Time(frames - 1), shared->newest - 1.0);
    shortened += frames < shared->begun;
    std::filesystem::remove(path);
    if (images)
      std::filesystem::remove(std::filesystem::path(path).replace_extension(".raw"));
  }
  EXPECT_GT(shortened, 10); // the kills did hit recorders at work
  munmap(memory, sizeof(Shared));
}

// A write that is cut anywhere leaves the recording as it was before.
TEST_F(SequenceRecorderTest, FullDisk)
{
  for (const bool images : {false, true}) {
    const std::string path = Path(images ? "a.igs.mhd" : "a.igs.mha");
    int most = 0;
    for (rlim_t bytes = 600; bytes < 7000; bytes += images ? 97 : 13) {
      SequenceRecorder recorder(path, images ? Images(8, 8) : SequenceContent(), {true, 0.0, false});
      int appended = 0;
      {
        const class FullDisk full(bytes);
        try {
          for (; appended < 100; ++appended)
            recorder.Append(FrameOf(appended, appended), images ? PixelsOf(appended, 64).data() : nullptr);
          ADD_FAILURE() << "the disk is not full";
        } catch (const Error& error) {
          EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
          EXPECT_NE(std::string(error.what()).find("its first " + std::to_string(appended) + " frames are kept"),
                    std::string::npos)
              << error.what();
        }
      }
      // It goes on refusing, also when there is room again.
      ExpectRefused([&] { recorder.Append(FrameOf(0, 0)); }, Error::Kind::FileSystem, path, "frames are kept");
      ExpectRefused([&] { recorder.Finish(); }, Error::Kind::FileSystem, path, "frames are kept");
      EXPECT_EQ(recorder.SafeFrames(), appended);
      if (appended > 0) {
        EXPECT_EQ(CheckRecording(path), appended);
      }
      EXPECT_LE(std::filesystem::file_size(path), bytes);
      most = std::max(most, appended);
    }
    EXPECT_GT(most, 10);
  }
}

TEST_F(SequenceRecorderTest, CostDoesNotGrow)
{
  SequenceRecorder recorder(Path("a.igs.mha"), {}, {false, 0.0, false});
  std::vector<std::uint64_t> bytes;
  for (int block = 0; block < 6; ++block) {
    const std::uint64_t before = recorder.BytesWritten();
    for (int i = 0; i < 500; ++i)
      recorder.Append(FrameOf(7, 1.5));
    bytes.push_back(recorder.BytesWritten() - before);
  }
  EXPECT_LT(static_cast<double>(bytes.back()), 1.02 * static_cast<double>(bytes.front())); // digits of the number of frames
}

TEST_F(SequenceRecorderTest, FramesThatCannotBe)
{
  const std::string path = Path("a.igs.mha");
  SequenceRecorder recorder(path);
  recorder.Append(FrameOf(0, 0.0));
  SequenceFrame bad = FrameOf(1, 1.0);
  bad.transforms[0].matrix(0, 0) = NAN;
  ExpectRefused([&] { recorder.Append(bad); }, Error::Kind::BadInput, path, "not finite");
  bad = FrameOf(1, 1.0);
  bad.transforms.push_back(bad.transforms[0]);
  ExpectRefused([&] { recorder.Append(bad); }, Error::Kind::BadInput, path, "given twice");
  recorder.Append(FrameOf(1, 1.0)); // it goes on
  recorder.Finish();
  EXPECT_EQ(CheckRecording(path), 2);
}

TEST_F(SequenceRecorderTest, Refused)
{
  const std::string there = Put("a.igs.mha", "before");
  ExpectRefused([&] { SequenceRecorder{there}; }, Error::Kind::FileSystem, there, "it is there already");
  EXPECT_EQ(std::filesystem::file_size(there), 6u);
  const auto refused = [&](const std::string& name, const SequenceContent& content, Error::Kind kind, const std::string& words) {
    ExpectRefused([&] { SequenceRecorder(Path(name), content); }, kind, "", words);
    EXPECT_FALSE(std::filesystem::exists(Path(name)));
  };
  refused("b.nrrd", {}, Error::Kind::InvalidParameter, ".mha for poses alone");
  refused("b.mha", Images(2, 2), Error::Kind::InvalidParameter, "must end in .mhd");
  refused("none/b.mha", {}, Error::Kind::FileSystem, "No such file");
  SequenceContent content = Images(2, -1);
  refused("b.mhd", content, Error::Kind::BadInput, "dimensions");
  content = Images(2, 2);
  content.fields = {{"two words", "x"}};
  refused("b.mhd", content, Error::Kind::BadInput, "cannot hold");
  refused("two\nlines.mhd", Images(2, 2), Error::Kind::InvalidParameter, "not found again");
  Put("b.raw", "pixels");
  refused("b.mhd", Images(2, 2), Error::Kind::FileSystem, "it is there already");
  EXPECT_EQ(std::filesystem::file_size(Path("b.raw")), 6u);
  ExpectRefused(
      [&] {
        SequenceRecorder(Path("c.mha"), {}, {false, 2.0, true});
      },
      Error::Kind::InvalidParameter, "", "FlushSeconds is 2 s; it must be in [0, 1]");
  {
    const class FullDisk full(100);
    refused("d.mha", {}, Error::Kind::FileSystem, "cannot be written");
  }
  SequenceRecorder empty(Path("e.igs.mha"));
  ExpectRefused([&] { empty.Finish(); }, Error::Kind::BadInput, "e.igs.mha", "nothing was recorded");
  EXPECT_FALSE(std::filesystem::exists(Path("e.igs.mha")));
}

// Pixels of more frames than the header counts are those of a recorder that was killed, and of nobody else.
TEST_F(SequenceRecorderTest, PixelsThatAreTooMany)
{
  SequenceRecorder recorder(Path("a.igs.mhd"), Images(4, 4));
  recorder.Append(FrameOf(0, 0.0), PixelsOf(0, 16).data());
  recorder.Finish();
  std::ofstream(Path("a.igs.raw"), std::ios::app) << "0123456789";
  EXPECT_EQ(CheckRecording(Path("a.igs.mhd")), 1);
  bool told = false;
  const SequenceFile file(Path("a.igs.mhd"));
  for (const std::string& note : file.Content().notes)
    told = told || note.find("cut off") != std::string::npos;
  EXPECT_TRUE(told);
  std::filesystem::resize_file(Path("a.igs.raw"), 15);
  ExpectRefused([&] { SequenceFile(Path("a.igs.mhd")); }, Error::Kind::BadFile, "a.igs.raw", "truncated");

  FileReplacement files;
  SequenceWriter writer(Path("b.mhd"), Images(4, 4), false, files);
  writer.Append(FrameOf(0, 0.0), PixelsOf(0, 16).data());
  writer.Finish();
  files.Commit();
  std::ofstream(Path("b.raw"), std::ios::app) << "0123456789";
  ExpectRefused([&] { SequenceFile(Path("b.mhd")); }, Error::Kind::BadFile, "b.raw", "the dimensions or the type are wrong");
}
