// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Core/Imaging/ValidPoints.h"
#include "Testing/TemporaryFolder.h"
#include "Widgets/Session/LiveScore.h"
#include <cmath>
#include <csignal>
#include <gtest/gtest.h>
#include <limits>
#include <sys/wait.h>

namespace echorama {
namespace {

using testing::ExpectRefused;

ImageGeometry Grid(const Eigen::Vector3d& origin)
{
  ImageGeometry geometry;
  geometry.dimensions = {21, 21, 21};
  geometry.spacing = {1.0, 1.5, 0.5};
  geometry.origin = origin;
  geometry.direction = ExpRotation({0.1, 0.2, -0.3});
  return geometry;
}

std::vector<Eigen::Vector3d> Points(int count, std::uint64_t seed = 3)
{
  const Volume<float> intensity({21, 21, 21}, 1.0f);
  return ValidPoints<float>(intensity.View(), {}, count, seed);
}

// Three volumes, of which the ids are not 0, 1, 2.
const ImageGeometry A = Grid({0.0, 0.0, 0.0}), B = Grid({12.0, 1.0, -3.0}), C = Grid({-4.0, 9.0, 2.0});

LiveScore Three(int points = 500)
{
  LiveScore live;
  live.Set(9, "C", C, Points(points, 5));
  live.Set(2, "A", A, Points(points, 3));
  live.Set(5, "B", B, Points(points, 4));
  return live;
}

TEST(LiveScore, IsTheDistanceOfATranslation)
{
  const LiveScore live = Three();
  Pose slip = Pose::Identity();
  slip.translation() = Eigen::Vector3d(2.0, -1.0, 2.0);
  const LiveScoreResult score = live.Update({{2, A}, {5, B.Moved(slip)}, {9, C}}, 2);
  ASSERT_EQ(score.ids, (std::vector<int>{2, 5, 9}));
  EXPECT_EQ(score.IndexOf(9), 2);
  EXPECT_EQ(score.IndexOf(3), -1);
  EXPECT_NEAR(score.volumes[1].mean, 3.0, 1e-12);
  EXPECT_NEAR(score.mean, 1.5, 1e-12);
  for (const Eigen::Vector3d& error : score.volumes[1].errors)
    EXPECT_LT((error - slip.translation()).norm(), 1e-12);
  for (const double degrees : score.degrees)
    EXPECT_NEAR(degrees, 0.0, 1e-6);
}

TEST(LiveScore, OfARotationIsTheChord)
{
  LiveScore live = Three();
  const auto points = Points(400, 4);
  const double theta = 0.3;
  const Eigen::Vector3d axis(0.6, 0.0, 0.8), centre = B.Centre();
  const LiveScoreResult score =
      live.Update({{2, A}, {5, B.Moved(MotionAbout(centre, theta * axis, Eigen::Vector3d::Zero()))}, {9, C}}, 2);
  EXPECT_NEAR(score.degrees[1], theta * 180.0 / M_PI, 1e-9);
  EXPECT_NEAR(score.degrees[2], 0.0, 1e-6);
  live.Set(5, "B", B, points);
  const LiveScoreResult again =
      live.Update({{2, A}, {5, B.Moved(MotionAbout(centre, theta * axis, Eigen::Vector3d::Zero()))}, {9, C}}, 2);
  double sum = 0.0; // a point at distance r from the axis goes 2 r sin(theta / 2)
  for (const Eigen::Vector3d& u : points)
    sum += 2.0 * std::sin(theta / 2.0) * axis.cross(B.IndexToWorld() * u - centre).norm();
  EXPECT_NEAR(again.volumes[1].mean, sum / 400.0, 1e-10);
}

// Whatever the poses, the live figures are those of the final one, to the last bit.
TEST(LiveScore, AgreesWithTheAlignmentScore)
{
  const LiveScore live = Three();
  const ImageGeometry a = A.Moved(MotionAbout({1, 2, 3}, {0.1, 0.2, 0.3}, {4, 5, 6}));
  const ImageGeometry b = B.Moved(MotionAbout({-1, 2, 0}, {0.5, -0.2, 0.1}, {-4, 0.5, 1}));
  const LiveScoreResult score = live.Update({{2, a}, {5, b}, {7, a}, {9, C}}, 5); // 7 has no truth
  const AlignmentScore whole =
      ScoreAlignment({{a, A, Points(500, 3), "A"}, {b, B, Points(500, 4), "B"}, {C, C, Points(500, 5), "C"}}, 1);
  EXPECT_EQ(score.mean, whole.mean);
  ASSERT_EQ(score.volumes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(score.volumes[i].mean, whole.volumes[i].mean);
    EXPECT_EQ(score.volumes[i].rms, whole.volumes[i].rms);
    EXPECT_EQ(score.volumes[i].percentile95, whole.volumes[i].percentile95);
    EXPECT_EQ(score.volumes[i].errors, whole.volumes[i].errors);
    EXPECT_EQ(score.volumes[i].points, whole.volumes[i].points);
  }
  EXPECT_EQ(score.volumes[1].max < 1e-9, true); // the fixed one
  EXPECT_GT(score.mean, 1.0);
}

TEST(LiveScore, Limits)
{
  LiveScore live;
  EXPECT_TRUE(live.Empty());
  EXPECT_THROW(live.Update({{2, A}, {5, B}}, 2), Error); // no truth at all
  live.Set(2, "A", A, Points(10));
  EXPECT_THROW(live.Update({{2, A}, {5, B}}, 2), Error); // of one alone
  live.Set(5, "B", B, Points(10));
  EXPECT_NEAR(live.Update({{2, A}, {5, B}}, 2).mean, 0.0, 1e-12);
  EXPECT_THROW(live.Update({{2, A}}, 2), Error); // the other is gone
  ExpectRefused([&] { live.Update({{2, A}, {5, B}}, 9); }, Error::Kind::InvalidParameter, "9", "fixed volume");
  ImageGeometry coarse = B;
  coarse.spacing *= 2.0;
  ExpectRefused([&] { live.Update({{2, A}, {5, coarse}}, 2); }, Error::Kind::BadInput, "B", "spacing");
  EXPECT_THROW(live.Set(5, "B", B, {}), Error);
  EXPECT_THROW(live.Set(5, "B", ImageGeometry(), Points(3)), Error);
  EXPECT_TRUE(live.Has(5)); // as it was
  EXPECT_NEAR(live.Update({{2, A}, {5, B}}, 5).mean, 0.0, 1e-12);
  live.Clear();
  EXPECT_TRUE(live.Empty());
}

class Attempts : public testing::TemporaryFolder {};

Attempt Try(const std::string& trainee, double score = 1.25)
{
  Attempt attempt;
  attempt.time = "2024-05-17T09:30:00Z";
  attempt.trainee = trainee;
  attempt.project = "liver.json";
  attempt.seconds = 93.5;
  attempt.scoreMm = score;
  attempt.worstMm = 0.1 + 0.2;
  attempt.degrees = 1e-17;
  attempt.startMm = 17.0;
  attempt.edits = 42;
  return attempt;
}

void ExpectSame(const Attempt& a, const Attempt& b)
{
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.trainee, b.trainee);
  EXPECT_EQ(a.project, b.project);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.scoreMm, b.scoreMm);
  EXPECT_EQ(a.worstMm, b.worstMm);
  EXPECT_EQ(a.degrees, b.degrees);
  EXPECT_EQ(a.startMm, b.startMm);
  EXPECT_EQ(a.edits, b.edits);
  EXPECT_EQ(a.help, b.help);
  EXPECT_EQ(a.outOfPlaneSeconds, b.outOfPlaneSeconds);
}

TEST_F(Attempts, ComeBackWhateverTheNames)
{
  const std::string path = Path("history.csv");
  const std::vector<std::string> names{"",       "Ada",       "O'Brien, Dr.", "\"Q\"", "two\nlines", "a\r\nb", " blank",
                                       "Müller", "=1+1;2\t3", "\"",           "a\"",   ",",          "\r",     "x\r"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    Attempt attempt = Try(names[i]);
    attempt.project = names[names.size() - 1 - i];
    AppendAttempt(path, attempt);
    const auto all = ReadAttempts(path);
    ASSERT_EQ(all.size(), i + 1);
    ExpectSame(all.back(), attempt);
  }
  const std::string text = ReadTextFile(path);
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,help,out_of_plane_s,project");
}

// A crash may leave any first part of the file: the next attempt mends it, and nothing before is lost.
TEST_F(Attempts, HalfALineIsRemoved)
{
  const std::string path = Path("history.csv");
  AppendAttempt(path, Try("first"));
  const std::size_t one = ReadTextFile(path).size();
  AppendAttempt(path, Try("second, \"quoted\""));
  const std::string two = ReadTextFile(path);
  for (std::size_t size = 0; size <= two.size(); ++size) {
    Put("history.csv", two.substr(0, size));
    const std::size_t whole = size >= two.size() - 1 ? 2 : size >= one - 1 ? 1 : 0; // the line end alone may be missing
    ASSERT_EQ(ReadAttempts(path).size(), whole) << size;
    AppendAttempt(path, Try("third"));
    const auto all = ReadAttempts(path);
    ASSERT_EQ(all.size(), whole + 1) << size;
    ExpectSame(all.back(), Try("third"));
    if (whole > 0)
      ExpectSame(all.front(), Try("first"));
  }
}

TEST_F(Attempts, OtherFilesAreRefusedAndLeftAlone)
{
  for (const std::string text : {"hello", "time,trainee\n", "\n", "a,b,c\n1,2,3\n",
                                 "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,projects\n"}) {
    const std::string path = Put("other.csv", text);
    ExpectRefused([&] { ReadAttempts(path); }, Error::Kind::BadFile, path, "history of attempts");
    ExpectRefused([&] { AppendAttempt(path, Try("x")); }, Error::Kind::BadFile, path, "history of attempts");
    EXPECT_EQ(ReadTextFile(path), text);
  }
  const std::string path = Path("history.csv");
  AppendAttempt(path, Try("first"));
  const std::string good = ReadTextFile(path);
  const std::string stray = good + "2024,\"stray,1,2,3,4,5,6,7,8,\"p\"\n" + good.substr(good.find('\n') + 1);
  for (const std::string& text : {good + "x,y\n", good + "t,n,1,2,nan,4,5,6,7,8,p\n", good + "t,n,1,2,3,4,5,6.5,7,8,p\n",
                                  good + "t,n,1,2,3,4,5,6,7,inf,p\n", good + "t,n,1,2,3,4,5,6,p\n", stray}) {
    Put("history.csv", text);
    ExpectRefused([&] { AppendAttempt(path, Try("x")); }, Error::Kind::BadFile, path, "line 3");
    EXPECT_EQ(ReadTextFile(path), text);
  }
  ExpectRefused([&] { ReadAttempts(Path("none.csv")); }, Error::Kind::FileSystem, "none.csv", "cannot be read");
  ExpectRefused([&] { AppendAttempt(Path("no/such.csv"), Try("x")); }, Error::Kind::FileSystem, "such.csv", "written");
  ExpectRefused([&] { AppendAttempt(folder.string(), Try("x")); }, Error::Kind::FileSystem, folder.string(), "plain file");
  ExpectRefused([&] { AppendAttempt(Path("nan.csv"), Try("x", std::numeric_limits<double>::quiet_NaN())); },
                Error::Kind::InvalidParameter, "", "score is not a finite number");
  EXPECT_FALSE(std::filesystem::exists(Path("nan.csv")));
}

// What other programs make of it: line ends of DOS, a mark of UTF-8, empty lines.
TEST_F(Attempts, OfASpreadsheetAreRead)
{
  const std::string path = Path("history.csv");
  AppendAttempt(path, Try("first"));
  std::string text = "\xef\xbb\xbf";
  for (const char c : ReadTextFile(path) + "\n2024-05-18,\"a, b\",1,2,3,4,5,6,7,8,plain\n")
    text += c == '\n' ? "\r\n" : std::string(1, c);
  Put("history.csv", text);
  AppendAttempt(path, Try("third"));
  const auto all = ReadAttempts(path);
  ASSERT_EQ(all.size(), 3u);
  ExpectSame(all[0], Try("first"));
  EXPECT_EQ(all[1].trainee, "a, b");
  EXPECT_EQ(all[1].project, "plain");
  EXPECT_EQ(all[1].edits, 6);
}

// What older versions wrote has no columns for help and for needles.
TEST_F(Attempts, OfFewerColumnsGetTheOthers)
{
  const std::string header = "time,trainee,seconds,score_mm,worst_mm,rotation_deg,start_mm,edits,project";
  const std::string path =
      Put("old.csv", header + "\n2024-05-17,\"Doe, J\",1.5,2,3,4,5,6,\"a\"\n2024-05-18,B,2,3,4,5,6,7,\"b\"\n2024-05-19,C");
  ASSERT_EQ(ReadAttempts(path).size(), 2u);
  AppendAttempt(path, Try("third"));
  const auto all = ReadAttempts(path);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].trainee, "Doe, J");
  EXPECT_EQ(all[0].seconds, 1.5);
  EXPECT_EQ(all[0].edits, 6);
  EXPECT_EQ(all[0].help, 0);
  EXPECT_EQ(all[1].project, "b");
  ExpectSame(all[2], Try("third"));
  EXPECT_EQ(ReadTextFile(path).find(header), std::string::npos);
  ASSERT_EQ(ReadAttempts(Put("empty.csv", header)).size(), 0u);
  AppendAttempt(Path("empty.csv"), Try("first"));
  ExpectSame(ReadAttempts(Path("empty.csv")).at(0), Try("first"));
}

TEST_F(Attempts, FullDisk)
{
  const std::string path = Path("history.csv");
  AppendAttempt(path, Try("first"));
  const std::string before = ReadTextFile(path);
  for (std::size_t room = 0; room < 30; room += 7) {
    {
      const testing::FullDisk full(before.size() + room);
      ExpectRefused([&] { AppendAttempt(path, Try("second")); }, Error::Kind::FileSystem, path, "written");
    }
    EXPECT_EQ(ReadTextFile(path), before);
  }
}

// Four programs at once: every line is whole and none is lost.
TEST_F(Attempts, OfProgramsAtOnce)
{
  const std::string path = Path("history.csv");
  std::vector<pid_t> children;
  for (int child = 0; child < 4; ++child) {
    const pid_t id = fork();
    ASSERT_GE(id, 0);
    if (id == 0) {
      try {
        for (int i = 0; i < 25; ++i)
          AppendAttempt(path, Try("trainee, " + std::to_string(child), i));
      } catch (...) {
        _exit(1);
      }
      _exit(0);
    }
    children.push_back(id);
  }
  for (const pid_t id : children) {
    int status = 1;
    waitpid(id, &status, 0);
    EXPECT_EQ(status, 0);
  }
  std::array<int, 4> next{};
  for (const Attempt& attempt : ReadAttempts(path)) {
    const auto child = static_cast<std::size_t>(attempt.trainee.back() - '0');
    EXPECT_EQ(attempt.scoreMm, next[child]++);
  }
  EXPECT_EQ(next, (std::array<int, 4>{25, 25, 25, 25}));
}

// Killed at any moment: what was finished is there.
TEST_F(Attempts, Killed)
{
  const std::string path = Path("history.csv");
  int told[2];
  ASSERT_EQ(pipe(told), 0);
  std::size_t finished = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      try {
        for (;;) {
          AppendAttempt(path, Try("x"));
          if (write(told[1], "x", 1) != 1)
            break;
        }
      } catch (...) {
      }
      _exit(1);
    }
    char done;
    for (int i = 0; i < 3; ++i)
      finished += static_cast<std::size_t>(read(told[0], &done, 1));
    usleep(static_cast<useconds_t>(trial * 300));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_GE(ReadAttempts(path).size(), finished);
    finished = ReadAttempts(path).size();
    // The rest of what the child told.
    char rest[4096];
    ASSERT_EQ(write(told[1], "e", 1), 1);
    EXPECT_GT(read(told[0], rest, sizeof rest), 0);
  }
}

} // namespace
} // namespace echorama
