// SPDX-License-Identifier: BSD-3-Clause
#include "CalibrationStage.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <numeric>
#include <set>

namespace {

using namespace echorama;
using namespace echorama::calibration_stage;
using Event = CalibrationStep::Event;

TEST(SurfaceCalibration, MarksComeThinnedOutAndEveryOneOnce)
{
  Stage stage(30);
  SurfaceCalibrationParameters p;
  const auto order = [&](int passes) {
    p.passes = passes;
    SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace, p);
    std::vector<int> numbers;
    for (int i = 0; i < 30; ++i) {
      numbers.push_back(session.Next());
      session.Skip();
    }
    EXPECT_EQ(session.Next(), numbers.front());
    return numbers;
  };
  const std::vector<int> plain = order(1), four = order(4);
  for (int i = 0; i < 30; ++i)
    EXPECT_EQ(plain[static_cast<std::size_t>(i)], i + 1);
  EXPECT_EQ(std::vector<int>(four.begin(), four.begin() + 10), (std::vector<int>{1, 5, 9, 13, 17, 21, 25, 29, 3, 7}));
  for (const int passes : {2, 3, 4, 5, 16}) {
    const std::vector<int> numbers = order(passes);
    EXPECT_EQ(std::set<int>(numbers.begin(), numbers.end()).size(), 30u) << passes;
  }
}

TEST(SurfaceCalibration, OneMayGoBackAndAnywhere)
{
  Stage stage(30);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  for (const int mark : {1, 5, 9}) {
    ASSERT_EQ(session.Next(), mark);
    stage.VisitNext(session);
  }
  EXPECT_EQ(session.Status().taken, 3);
  session.Back();
  EXPECT_EQ(session.Next(), 9);
  EXPECT_EQ(session.Status().taken, 2);
  session.GoTo(17);
  EXPECT_EQ(session.Next(), 17);
  EXPECT_EQ(stage.VisitNext(session).mark, 17);
  EXPECT_EQ(session.Next(), 9);
  session.GoTo(1); // again
  EXPECT_EQ(session.Status().taken, 2);
  EXPECT_THROW(session.GoTo(31), Error);
  EXPECT_THROW(session.GoTo(0), Error);
  stage.VisitAll(session);
  EXPECT_EQ(session.Status().taken, 30);
}

TEST(SurfaceCalibration, FindsACameraThatIsTurnedAsNobodyKnows)
{
  for (const double turn : {0.1, 1.5, 3.1, -1.2}) {
    Stage stage(80, turn);
    SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
    stage.VisitAll(session);
    const FittedSurfaceMap& fitted = session.Fit();
    EXPECT_LT(stage.Error95(fitted.map), 0.3) << turn;
    EXPECT_LT((fitted.map.State().cameraToShell.translation() - stage.place.translation()).norm(), 1.0) << turn;
    EXPECT_LT(fitted.report.heldOut95Mm, 0.5);
    EXPECT_NEAR(session.Status().scatterMm, stage.placementMm, 0.03) << "how well the light was put down";
    EXPECT_EQ(session.Status().coverage, 1.0);
  }
}

// Marks and hands are the same, the order is not.
TEST(SurfaceCalibration, TheMapDoesNotDependOnTheWayThere)
{
  SurfaceMapState states[2];
  for (int way = 0; way < 2; ++way) {
    Stage stage(60);
    stage.placementMm = 0.0;
    SurfaceCalibrationParameters p;
    p.passes = way == 0 ? 1 : 4;
    SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace, p);
    while (session.Next() > 0) {
      stage.visits = session.Next(); // what names the noise
      stage.VisitNext(session);
    }
    states[way] = session.Fit().map.State();
  }
  EXPECT_EQ(states[0].cameraToShell.matrix(), states[1].cameraToShell.matrix());
  EXPECT_EQ(states[0].optics.lens.focal, states[1].optics.lens.focal);
  EXPECT_EQ(states[0].covariance, states[1].covariance);
}

TEST(SurfaceCalibration, WrongMarksAreNamedAndAskedForAgain)
{
  Stage stage(80);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  // While there is no map nobody notices: the 4th and the 9th visit go to another mark.
  std::vector<std::pair<int, double>> wrong;
  for (int visit = 0; visit < 30; ++visit) {
    const int mark = session.Next();
    if (visit == 4 || visit == 9) {
      wrong.emplace_back(mark, (stage.marks[static_cast<std::size_t>(mark)] - session.PlaceOf(mark)).norm());
      EXPECT_EQ(stage.Visit(session, stage.marks[static_cast<std::size_t>(mark)]).event, Event::Taken);
    } else
      EXPECT_EQ(stage.VisitNext(session).event, Event::Taken);
  }
  session.Fit();
  ASSERT_EQ(session.Status().outliers.size(), 2u);
  std::vector<int> asked;
  while (session.Next() > 0) {
    asked.push_back(session.Next());
    stage.VisitNext(session);
    for (const CalibrationOutlier& outlier : session.Status().outliers)
      for (const auto& [mark, mm] : wrong)
        if (outlier.mark == mark && session.Status().report.inliers > 60) {
          EXPECT_NEAR(outlier.distanceMm, mm, 0.6);
        }
  }
  for (const auto& [mark, mm] : wrong)
    EXPECT_EQ(std::count(asked.begin(), asked.end(), mark), 1) << mark;
  session.Fit();
  EXPECT_TRUE(session.Status().outliers.empty());
  EXPECT_LT(stage.Error95(session.Fit().map), 0.3);
}

TEST(SurfaceCalibration, AMarkThatIsElsewhereOnThePrintIsLeftOutAfterOneRepetition)
{
  Stage stage(60);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  const Vector3d elsewhere = stage.skin->NearestTo(stage.marks[0] + Vector3d(2.0, 1.0, 0.0))->point; // of mark 1
  int visits = 0;
  while (session.Next() > 0 && visits < 100) {
    stage.Visit(session, session.Next() == 1 ? elsewhere : session.PlaceOf(session.Next()));
    ++visits;
  }
  session.Fit();
  EXPECT_EQ(visits, 61);
  ASSERT_EQ(session.Status().outliers.size(), 1u);
  EXPECT_EQ(session.Status().outliers[0].mark, 1);
  EXPECT_TRUE(session.Status().outliers[0].wasRepeated);
  EXPECT_NEAR(session.Status().outliers[0].distanceMm, std::hypot(2.0, 1.0), 0.5);
}

TEST(SurfaceCalibration, KnowsWhichMarkALightRestsOn)
{
  Stage stage(80);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  for (int visit = 0; visit < 30; ++visit)
    stage.VisitNext(session);
  const int asked = session.Next(), other = asked + 8; // its neighbour in the spiral
  const CalibrationStep mistaken = stage.Visit(session, session.PlaceOf(other));
  EXPECT_EQ(mistaken.event, Event::TakenFor);
  EXPECT_EQ(mistaken.mark, other);
  ASSERT_TRUE(mistaken.distanceMm);
  EXPECT_LT(*mistaken.distanceMm, 1.0);
  EXPECT_EQ(session.Next(), asked) << "which is still to come";

  const Vector3d between = stage.skin->NearestTo(session.PlaceOf(asked) + Vector3d(5.0, 5.0, 0.0))->point;
  const int before = session.Status().taken;
  const CalibrationStep nobodys = stage.Visit(session, between);
  EXPECT_EQ(nobodys.event, Event::Nobodys);
  EXPECT_NEAR(*nobodys.distanceMm, (between - session.PlaceOf(asked)).norm(), 1.0);
  EXPECT_EQ(session.Status().taken, before);
  const CalibrationStep elsewhere =
      stage.Visit(session, stage.skin->NearestTo(session.PlaceOf(asked) + Vector3d(-5.0, -5.0, 0.0))->point);
  EXPECT_EQ(elsewhere.event, Event::Nobodys) << "another place is no insisting";
  EXPECT_EQ(stage.Visit(session, between).event, Event::Nobodys);
  const CalibrationStep insisted = stage.Visit(session, between);
  EXPECT_EQ(insisted.event, Event::Taken);
  EXPECT_EQ(insisted.mark, asked);
}

TEST(SurfaceCalibration, ALightThatHoversIsNotTaken)
{
  Stage stage(80);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  for (int visit = 0; visit < 40; ++visit)
    stage.VisitNext(session);
  const int asked = session.Next();
  EXPECT_EQ(stage.Visit(session, session.PlaceOf(asked), 3.0, 45.0).event, Event::NotTouching);
  EXPECT_EQ(session.Next(), asked);
  EXPECT_EQ(stage.VisitNext(session).event, Event::Taken);
  EXPECT_NEAR(session.Brightness().At({320.0, 240.0}).peak, 100.0, 1.0);
}

TEST(SurfaceCalibration, NamesTheLargestGap)
{
  Stage stage(120);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  const auto isInGap = [&](int mark) { return session.PlaceOf(mark).x() > 55.0; };
  int skipped = 0;
  while (skipped < 150) {
    if (isInGap(session.Next())) {
      session.Skip();
      ++skipped;
    } else
      stage.VisitNext(session);
  }
  session.Fit();
  const CalibrationStatus& status = session.Status();
  EXPECT_LT(status.coverage, 0.9);
  EXPECT_GT(status.coverage, 0.4);
  ASSERT_GT(status.gapMark, 0);
  EXPECT_TRUE(isInGap(status.gapMark)) << status.gapMark;
  EXPECT_FALSE(status.isEnough) << "a part of the picture is missing";
  for (int mark = 1; mark <= 120; ++mark) // none is further from all that were taken
    if (isInGap(mark)) {
      double nearest = HUGE_VAL;
      for (int other = 1; other <= 120; ++other)
        if (!isInGap(other))
          nearest = std::min(nearest, (*stage.PixelOf(session.PlaceOf(mark)) - *stage.PixelOf(session.PlaceOf(other))).norm());
      EXPECT_LT(nearest, status.gapPx + 3.0);
    }
}

// It must be true that the others would not have helped.
TEST(SurfaceCalibration, SaysWhenMoreMarksWouldNotHelp)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Stage stage(350);
    stage.seed = seed;
    SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
    while (!session.Status().isEnough && session.Next() > 0)
      stage.VisitNext(session);
    ASSERT_TRUE(session.Status().isEnough) << seed;
    EXPECT_GT(session.Status().taken, 40);
    EXPECT_LT(session.Status().taken, 300) << seed;
    const double then = session.Fit().report.heldOut95Mm, own = session.Status().ownMm;
    EXPECT_LT(stage.Error95(session.Fit().map), 1.5 * own) << "as it says of itself";
    stage.VisitAll(session);
    EXPECT_GT(session.Fit().report.heldOut95Mm, 0.8 * then) << seed;
  }
}

TEST(SurfaceDriftOfAMap, HoldsUntilTheCameraMoves)
{
  Stage stage(100);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  stage.VisitAll(session);
  const SurfaceMap map = session.Fit().map;
  const double scatter = session.Status().scatterMm;
  const std::vector<int> numbers = DriftMarks(map, stage.marks, 5);
  ASSERT_EQ(std::set<int>(numbers.begin(), numbers.end()).size(), 5u);
  for (const int a : numbers) // far from each other
    for (const int b : numbers)
      if (a != b) {
        EXPECT_GT((*stage.PixelOf(stage.marks[static_cast<std::size_t>(a) - 1]) -
                   *stage.PixelOf(stage.marks[static_cast<std::size_t>(b) - 1]))
                      .norm(),
                  120.0);
      }
  const Pose place = stage.place;
  const auto check = [&](std::uint64_t day, double significance) {
    std::vector<SurfaceObservation> again;
    for (const int number : numbers) {
      Random random(100 + day, static_cast<std::uint64_t>(number));
      const Vector3d mark = stage.marks[static_cast<std::size_t>(number) - 1];
      const Vector3d put =
          stage.skin->NearestTo(mark + stage.placementMm * Vector3d(random.Normal(), random.Normal(), random.Normal()))->point;
      again.push_back({*stage.PixelOf(put) + 0.01 * Vector2d(random.Normal(), random.Normal()),
                       1e-4 * Eigen::Matrix2d::Identity(), mark, number});
    }
    return JudgeDrift(DriftPoints(map, again, scatter), significance);
  };
  int alarms = 0;
  for (std::uint64_t day = 0; day < 200; ++day)
    alarms += check(day, 0.05).verdict != SurfaceDrift::Verdict::Holds;
  EXPECT_LE(alarms, 25) << "of 10 that are expected";
  stage.place.translation() += Vector3d(0.6, -0.8, 0.0);
  stage.place.linear() = ExpRotation({0.0, 0.01, 0.0}) * place.linear();
  for (std::uint64_t day = 0; day < 20; ++day) {
    const SurfaceDrift drift = check(day, 1e-3);
    EXPECT_EQ(drift.verdict, SurfaceDrift::Verdict::Moved) << drift.message;
    EXPECT_LT((drift.movedMm - Vector3d(0.6, -0.8, 0.0)).norm(), 0.6);
    EXPECT_LT((drift.turned - Vector3d(0.0, 0.01, 0.0)).norm(), 0.006);
  }
}

TEST(SurfaceCalibration, BadInputIsRefused)
{
  Stage stage(40);
  const auto make = [&](const std::vector<Vector3d>& marks) {
    SurfaceCalibration session(marks, stage.skin, stage.nominal, stage.nominalPlace);
  };
  const auto reason = [&](std::vector<Vector3d> marks) {
    try {
      make(marks);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(reason(stage.marks), "");
  std::vector<Vector3d> marks = stage.marks;
  marks[16] = Vector3d(0.0, 0.0, 120.0);
  EXPECT_NE(reason(marks).find("mark 17 lies 30.0 mm from the skin"), std::string::npos) << reason(marks);
  marks[16].x() = std::nan("");
  EXPECT_NE(reason(marks).find("mark 17 is not finite"), std::string::npos);
  EXPECT_NE(reason({stage.marks.begin(), stage.marks.begin() + 10}).find("24 marks at least; there are 10"), std::string::npos);
  SurfaceCalibrationParameters p;
  p.nearMm = 0.0;
  EXPECT_THROW(SurfaceCalibration(stage.marks, stage.skin, stage.nominal, stage.nominalPlace, p), Error);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  EXPECT_THROW(session.Fit(), Error) << "nothing was taken";
  EXPECT_THROW(session.Brightness(), Error);
}

// Somebody begins at another mark than was asked for: everything is one off. No camera explains that.
TEST(SurfaceCalibration, MarksThatAreAllMistakenAreNoCalibration)
{
  Stage stage(60);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  for (int visit = 0; visit < 60 && session.Next() > 0; ++visit)
    stage.Visit(session, stage.marks[static_cast<std::size_t>(session.Next()) % 60]);
  EXPECT_THROW(session.Fit(), Error);
  EXPECT_FALSE(session.Status().complaint.empty());
}

// Somebody knocks the camera while marks are done again: no camera explains both. What was there before stays.
TEST(SurfaceCalibration, TheMapStaysWhenMarksThatCameLaterFitNoCamera)
{
  Stage stage(60);
  SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
  stage.VisitAll(session);
  session.Fit();
  const Stage before = stage;
  stage.place.translation() += Vector3d(25.0, 0.0, 0.0);
  for (int mark = 1; mark <= 30; ++mark) {
    session.GoTo(mark);
    for (int visit = 0; visit < 2; ++visit) // insisted on
      if (session.Next() == mark)
        stage.VisitNext(session);
  }
  EXPECT_THROW(session.Fit(), Error);
  EXPECT_TRUE(session.Status().hasMap);
  EXPECT_LT(before.Error95(session.Fitted().map), 0.5);
}

} // namespace
