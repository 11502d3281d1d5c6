// SPDX-License-Identifier: BSD-3-Clause
// A teacher saves tasks, a learner does them, and is scored.
#include "ScanLog.h"
#include "SimulatorUnderTest.h"
#include "TaskPanel.h"
#include "Widgets/Session/LiveScore.h"
#include <QCheckBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QtTest>

using namespace echorama;

class TestScanTasks : public FolderTest {
  Q_OBJECT

private slots:
  void aPlaneIsFoundAndScored();
  void aLengthIsMeasuredAndScored();
  void aTaskForAnotherBodyIsRefused();
  void aTrackedToolHasToComeToTheStart();
  void aLengthIsSavedWhereItWasDrawn();
  void aLineFromOnePictureToAnotherIsNoAnswer();
  void theSolutionIsShownAfterTheAnswer();
  void closingAsksWhileAnAttemptRuns();

private:
  QString Press(SimulatorUnderTest& window, const char* button)
  {
    window.Part<QPushButton>(button)->click();
    window.Settle();
    return window.Part<QLabel>("taskScore")->text();
  }
};

void TestScanTasks::aPlaneIsFoundAndScored()
{
  const QString body = body::WriteWithBall(Folder());
  for (const bool hint : {false, true}) {
    SimulatorUnderTest teacher;
    QVERIFY(teacher.Open({body}));
    teacher.Part<TaskPanel>("taskPanel")->SetFolder(Folder());
    teacher.Move(Qt::Key_Right, Qt::ShiftModifier);
    teacher.Move(Qt::Key_Down, Qt::ControlModifier, 4);
    teacher.Part<QLineEdit>("taskName")->setText(hint ? "with hint" : "plain");
    teacher.Part<QCheckBox>("taskHint")->setChecked(hint);
    Press(teacher, "savePlane");
    QVERIFY2(teacher.HasMessage("task.json"), qPrintable(teacher.Messages().join('\n')));
    Press(teacher, "savePlane"); // nothing is replaced
    QVERIFY(teacher.HasMessage("there already"));
  }
  SimulatorUnderTest window;
  QVERIFY(window.Open({body}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Part<QLineEdit>("trainee")->setText("A. Learner");
  const Pose top = window.Scan().ProbeToWorld();
  panel->OpenTask(Folder().filePath("plain.task.json"));
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Part<QLabel>("task")->text().contains("plain"));
  // The start takes all away that the last ones left.
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  Press(window, "startTask");
  QVERIFY(panel->IsRunning());
  QVERIFY((window.Place() - top.translation()).norm() < 1e-6);
  QCOMPARE(window.Scan().Cine().Count(), 1);
  QVERIFY(!window.Part<QPushButton>("replay")->isEnabled());
  QVERIFY(!window.Part<QLabel>("taskState")->text().contains("mm")); // no hint was allowed
  // At the top it is not found: 4 tilts of 2 degrees and 10 mm away.
  QVERIFY2(Press(window, "submitTask").startsWith("Not passed"), qPrintable(window.Part<QLabel>("taskScore")->text()));
  QVERIFY(window.Part<QPushButton>("replay")->isEnabled());
  // By the same keys it is.
  panel->OpenTask(Folder().filePath("with hint.task.json"));
  Press(window, "startTask");
  QTRY_VERIFY(window.Part<QLabel>("taskState")->text().contains("mm"));
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  window.Move(Qt::Key_Down, Qt::ControlModifier, 4);
  window.Grab("simulator-task");
  const QString score = Press(window, "submitTask");
  QVERIFY2(score.startsWith("Passed: 0.0 mm off and 0.0"), qPrintable(score));
  const auto attempts = ReadAttempts(Folder().filePath("attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(2));
  QCOMPARE(attempts[1].trainee, std::string("A. Learner"));
  QVERIFY(attempts[0].scoreMm > 5.0);
  QVERIFY(attempts[1].scoreMm < 1e-3);
}

void TestScanTasks::aLengthIsMeasuredAndScored()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Part<QLineEdit>("taskName")->setText("ball");
  Press(window, "saveLength");
  QVERIFY(window.HasMessage("Measure first"));
  const double depth = -window.Place()[1];
  const auto measure = [&](double half) {
    for (double x : {-half, half})
      window.Click(&window.Image(), window.Image().ToWidget({x, depth}).toPoint());
  };
  window.Key(Qt::Key_C);
  measure(5.0);
  Press(window, "saveLength");
  panel->OpenTask(Folder().filePath("ball.task.json"));
  Press(window, "startTask");
  QVERIFY(window.Image().Callipers().empty()); // the teacher's line is gone
  Press(window, "submitTask");
  QVERIFY(window.HasMessage("measure first"));
  QVERIFY(panel->IsRunning());
  measure(5.0);
  QVERIFY2(Press(window, "submitTask").startsWith("Passed"), qPrintable(window.Part<QLabel>("taskScore")->text()));
  Press(window, "startTask");
  measure(8.0);
  QVERIFY2(Press(window, "submitTask").startsWith("Not passed"), qPrintable(window.Part<QLabel>("taskScore")->text()));
  const auto attempts = ReadAttempts(Folder().filePath("attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(2));
  QVERIFY(std::abs(attempts[1].scoreMm - 6.0) < 0.6); // to a pixel at each end
}

void TestScanTasks::aTaskForAnotherBodyIsRefused()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Part<QLineEdit>("taskName")->setText("plane");
  Press(window, "savePlane");
  QVERIFY(window.Open({body::Write(Folder(), "other.mha", [](const Eigen::Vector3d&) { return 90.0; })}));
  panel->OpenTask(Folder().filePath("plane.task.json"));
  QVERIFY2(window.HasMessage("body.mha") && window.HasMessage("other.mha"), qPrintable(window.Messages().join('\n')));
  QVERIFY(!window.Part<QPushButton>("startTask")->isEnabled());
}

void TestScanTasks::aTrackedToolHasToComeToTheStart()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  const Pose start = window.Scan().ProbeToWorld();
  window.Move(Qt::Key_Right, Qt::ShiftModifier, 3);
  const Pose solution = window.Scan().ProbeToWorld();
  window.Part<QLineEdit>("taskName")->setText("plane");
  Press(window, "savePlane");
  panel->OpenTask(Folder().filePath("plane.task.json"));
  // The tool is held at the solution, and the attempt is started.
  window.Scan().Follow(solution.matrix());
  window.Frame();
  Press(window, "startTask");
  QVERIFY(panel->IsWaiting() && !panel->IsRunning());
  QVERIFY(!window.Part<QPushButton>("submitTask")->isEnabled());
  QVERIFY(!window.Part<QPushButton>("replay")->isEnabled());
  QVERIFY(!window.Part<QWidget>("trackerPanel")->isEnabled());
  QTRY_VERIFY(window.Part<QLabel>("taskState")->text().contains("29 mm away")); // 30 mm of skin, to the start
  window.Grab("simulator-to-start");
  Pose near = start;
  near.translation()[0] += 10.5;
  window.Scan().Follow(near.matrix());
  window.Settle();
  QVERIFY(panel->IsWaiting());
  near.translation()[0] -= 1.0;
  window.Scan().Follow(near.matrix());
  window.Settle();
  QVERIFY(panel->IsRunning() && !panel->IsWaiting());
  // The clock began there: the way to the solution counts.
  window.Scan().Follow(solution.matrix());
  window.Frame();
  const QString score = Press(window, "submitTask");
  QVERIFY2(score.startsWith("Passed: 0.0 mm off"), qPrintable(score));
  QVERIFY(window.Part<QWidget>("trackerPanel")->isEnabled());
  const auto attempts = ReadAttempts(Folder().filePath("attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(1));
  QVERIFY(attempts[0].startMm > 15.0); // how far it was at the start
  // Given up while it waits; and one that is at the start already begins at once.
  Press(window, "startTask");
  QVERIFY(panel->IsWaiting());
  Press(window, "startTask");
  QVERIFY(!panel->IsWaiting() && !panel->IsRunning());
  window.Scan().Follow(start.matrix());
  QVERIFY(!panel->IsRunning());
  Press(window, "startTask");
  QVERIFY(panel->IsRunning());
}

void TestScanTasks::aLengthIsSavedWhereItWasDrawn()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Part<TaskPanel>("taskPanel")->SetFolder(Folder());
  const double depth = -window.Place()[1];
  const auto click = [&window](double x, double y) { window.Click(&window.Image(), window.Image().ToWidget({x, y}).toPoint()); };
  window.Key(Qt::Key_C);
  click(-5.0, depth);
  click(5.0, depth);
  window.Move(Qt::Key_Right, Qt::ShiftModifier, 2); // the probe goes on, the line was of before
  window.Part<QLineEdit>("taskName")->setText("ball");
  Press(window, "saveLength");
  const ScanTask task = ReadScanTask(Folder().filePath("ball.task.json").toStdString());
  const auto& goal = std::get<MeasureLength>(task.goal);
  const double pixelMm = std::abs(window.Image().ToPlane({1, 0}).x() - window.Image().ToPlane({0, 0}).x());
  QVERIFY2((goal.from - Eigen::Vector3d(-5.0, 0.0, 0.0)).norm() < 1.5 * pixelMm, "in the world, at the ball's edge");
  QVERIFY((goal.to - Eigen::Vector3d(5.0, 0.0, 0.0)).norm() < 1.5 * pixelMm);
  // A line from one picture to another measures nothing.
  click(-5.0, 20.0);
  window.Move(Qt::Key_Left, Qt::ShiftModifier);
  click(5.0, 20.0);
  window.Part<QLineEdit>("taskName")->setText("nothing");
  Press(window, "saveLength");
  QVERIFY2(window.HasMessage("moved between"), qPrintable(window.Messages().join('\n')));
  QVERIFY(!Folder().exists("nothing.task.json"));
}

void TestScanTasks::aLineFromOnePictureToAnotherIsNoAnswer()
{
  {
    SimulatorUnderTest teacher;
    QVERIFY(teacher.Open({body::WriteWithBall(Folder())}));
    teacher.Part<TaskPanel>("taskPanel")->SetFolder(Folder());
    teacher.Part<QLineEdit>("taskName")->setText("ten");
    teacher.Key(Qt::Key_C);
    for (double x : {-5.0, 5.0})
      teacher.Click(&teacher.Image(), teacher.Image().ToWidget({x, 20.0}).toPoint());
    Press(teacher, "saveLength");
  }
  SimulatorUnderTest window;
  QVERIFY(window.Open({Folder().filePath("body.mha")}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  panel->OpenTask(Folder().filePath("ten.task.json"));
  Press(window, "startTask");
  const auto click = [&window](double x, double y) { window.Click(&window.Image(), window.Image().ToWidget({x, y}).toPoint()); };
  window.Key(Qt::Key_C);
  click(-5.0, 20.0);
  window.Move(Qt::Key_Left, Qt::ShiftModifier);
  click(5.0, 20.0); // as long as what was asked for, on the screen
  QCOMPARE(Press(window, "submitTask"), QString());
  QVERIFY2(window.HasMessage("moved between"), qPrintable(window.Messages().join('\n')));
  QVERIFY(panel->IsRunning()); // it is no answer, and none was written down
  QVERIFY(!Folder().exists("attempts.csv"));
  for (double x : {-5.0, 5.0})
    click(x, 32.0); // away from the ends that are there
  QVERIFY2(Press(window, "submitTask").startsWith("Passed"), qPrintable(window.Part<QLabel>("taskScore")->text()));
}

void TestScanTasks::theSolutionIsShownAfterTheAnswer()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Move(Qt::Key_Down, Qt::ControlModifier, 4);
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  const QImage wanted = window.Scan().Picture().image;
  window.Part<QLineEdit>("taskName")->setText("plane");
  Press(window, "savePlane");
  panel->OpenTask(Folder().filePath("plane.task.json"));
  auto* show = window.Part<QPushButton>("showSolution");
  auto* solution = window.Part<ImageView>("solutionView");
  QVERIFY(!show->isEnabled());
  Press(window, "startTask");
  QVERIFY(!show->isEnabled());
  window.Move(Qt::Key_Left, Qt::ShiftModifier);
  Press(window, "submitTask");
  QVERIFY(window.Scan().IsFrozen()); // the answer stays
  const QImage own = window.Scan().Picture().image;
  const QByteArray ownSum = SumOf(window.Scan().Scanner().Output());
  QVERIFY(show->isEnabled() && solution->isHidden());
  Press(window, "showSolution");
  QVERIFY(solution->isVisible());
  QVERIFY(solution->Picture().image == wanted);
  QVERIFY(own != wanted);
  QVERIFY(window.Image().Picture().image == own);
  QCOMPARE(SumOf(window.Scan().Scanner().Output()), ownSum);
  window.Frame();
  window.Grab("simulator-solution");
  Press(window, "showSolution");
  QVERIFY(solution->isHidden());
  Press(window, "showSolution");
  Press(window, "startTask"); // with the next attempt it goes
  QVERIFY(solution->isHidden() && !show->isEnabled());
  QVERIFY(!window.Scan().IsFrozen());
}

void TestScanTasks::closingAsksWhileAnAttemptRuns()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Part<QLineEdit>("taskName")->setText("plane");
  Press(window, "savePlane");
  panel->OpenTask(Folder().filePath("plane.task.json"));
  Press(window, "startTask");
  QVERIFY(!window.Window().close());
  QVERIFY(window.HasMessage("attempt is running"));
  QVERIFY(window.Answer("Stay"));
  QVERIFY(panel->IsRunning());
  QVERIFY(!window.Window().close());
  QVERIFY(window.Answer("End it and close"));
  QTRY_VERIFY(!window.Window().isVisible());
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanTasks test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanTasks.moc"
