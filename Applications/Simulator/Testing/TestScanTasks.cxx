// SPDX-License-Identifier: BSD-3-Clause
// A teacher saves tasks, a learner does them, and is scored.
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

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanTasks test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanTasks.moc"
