// SPDX-License-Identifier: BSD-3-Clause
// What the workbench says: each warning has a way out, errors and progress are in one place, and nothing stays that is no longer
// so.
#include "ExportActions.h"
#include "FileActions.h"
#include "HistoryPanel.h"
#include "Job.h"
#include "JobBar.h"
#include "MessageBar.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <algorithm>
#include <QAction>
#include <QApplication>
#include <QClipboard>
#include <QDockWidget>
#include <QFileDialog>
#include <QFrame>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QThread>
#include <QtTest>
#include <vtkNew.h>
#include <vtkObject.h>

using namespace echorama;

class TestMessages : public WindowTest {
  Q_OBJECT

private slots:
  void everyWarningHasAWayOut();
  void whatVtkSaysCanBeCopied();
  void anErrorGoesWhenItIsMended();
  void aQuestionGoesWhenItIsAnsweredOtherwise();
  void progressIsWhereErrorsAre();
  void signsTellKindsApartWithoutColours();
};

namespace {

// The answers to the one message that holds a text; {"none"}: there is none such.
QStringList AnswersTo(WindowUnderTest& window, const QString& part)
{
  for (auto* row : window.Part<MessageBar>("messageBar")->findChildren<QFrame*>("messageRow")) {
    if (row->isHidden() || !row->findChild<QLabel*>("messageText")->text().contains(part, Qt::CaseInsensitive))
      continue;
    QStringList labels;
    for (auto* answer : row->findChildren<QPushButton*>("messageAnswer"))
      labels.append(answer->text());
    return labels;
  }
  return {"none"};
}

QString Written(const QDir& folder, const QString& name, const QByteArray& text)
{
  QFile file(folder.filePath(name));
  if (!file.open(QIODevice::WriteOnly) || file.write(text) != text.size())
    qFatal("cannot write");
  return file.fileName();
}

} // namespace

// Made to fail one by one, by what a person can do.
void TestMessages::everyWarningHasAWayOut()
{
  WindowUnderTest window;
  auto* files = window.Window().Files();
  const auto expect = [&window](const QString& text, const QStringList& answers) {
    const QStringList found = AnswersTo(window, text);
    return found == answers ? QByteArray() : (text + ": " + found.join('|') + " of " + window.Messages().join('\n')).toUtf8();
  };
  const QByteArray nothing;
  const auto trigger = [&window](const char* name) {
    window.Part<QAction>(name)->trigger();
    window.Settle();
  };

  QVERIFY(window.Open({Folder().filePath("missing.mha")}));
  QCOMPARE(expect("missing.mha", {"Open other files..."}), nothing);
  QVERIFY(window.Open({Written(Folder(), "broken.json", "{")}));
  QCOMPARE(expect("broken.json", {"Open another project..."}), nothing);
  trigger("refineAction");
  QCOMPARE(expect("two volumes are needed; open another one", {"Show panel Align"}), nothing);
  QVERIFY(window.Open({A(), B()}));
  for (const char* past : {"missing.mha", "broken.json", "two volumes are needed"})
    QCOMPARE(AnswersTo(window, past), QStringList("none"));
  QVERIFY(window.Open({A()}));
  QCOMPARE(expect("it is open already, as left", {"Open other files..."}), nothing);
  files->Open(
      {Written(Folder(), "poses.json", R"({"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS", "volumes": []})")});
  QCOMPARE(expect("names none of the volumes", {"Read another file..."}), nothing);
  QVERIFY(!files->SaveTo(Folder().filePath("nowhere/deep/a.json")));
  QCOMPARE(expect("nowhere/deep", {"Save as...", "Try again"}), nothing);
  QVERIFY(!files->SaveTo(A()));
  QCOMPARE(expect("it is the file of the volume", {"Save as...", "Try again"}), nothing);

  auto* address = window.Part<QLineEdit>("trackerAddress");
  address->setText("replay:" + Folder().filePath("no-recording.mha"));
  window.Part<QPushButton>("trackerConnect")->click();
  QVERIFY(window.Wait());
  QCOMPARE(expect("no-recording", {"Show panel Tracker"}), nothing);
  // Its button leads there.
  QVERIFY(window.Answer("Show panel Tracker"));
  QVERIFY(address->isVisible() && !address->visibleRegion().isEmpty());
  window.Screenshot("way-out");

  window.Part<QLineEdit>("placeRecording")->setText(Folder().filePath("none.csv"));
  window.Part<QPushButton>("placeByTracker")->click();
  QVERIFY(window.Wait());
  QCOMPARE(expect("none.csv", {"Show panel Align"}), nothing);

  window.Window().findChild<ExportActions*>()->ExportVolumes(Folder().path()); // where left.mha is
  QVERIFY(window.Wait());
  QCOMPARE(expect("choose another folder", {"Choose another place..."}), nothing);
  window.Window().Bench()->BeginAttempt(false);
  trigger("refineAction");
  QCOMPARE(expect("not during an attempt", {"Show panel Train"}), nothing);
  window.Window().Bench()->EndAttempt();
  QCOMPARE(AnswersTo(window, "not during an attempt"), QStringList("none"));

  window.Session()->SetAutomaticBackups(true);
  QVERIFY(window.Session()->BackUp());
  auto* history = window.Part<QDockWidget>("historyPanelDock");
  history->raise();
  auto* backups = window.Part<QListWidget>("backups");
  QTRY_VERIFY(backups->count() > 0);
  const QString backup = backups->item(0)->data(Qt::UserRole).toString();
  QVERIFY(QFile::remove(backup));
  window.Click(backups->viewport(), backups->visualItemRect(backups->item(0)).center());
  QCOMPARE(expect(backup, {"Choose another backup"}), nothing);
}

void TestMessages::whatVtkSaysCanBeCopied()
{
  WindowUnderTest window;
  const vtkNew<vtkObject> object;
  vtkErrorWithObjectMacro(object, "something inside is wrong");
  window.Settle();
  QVERIFY(window.HasMessage("something inside is wrong"));
  QVERIFY(window.Answer("Copy the text"));
  QVERIFY(QApplication::clipboard()->text().contains("something inside is wrong"));
  QVERIFY(window.Messages().isEmpty());
}

void TestMessages::anErrorGoesWhenItIsMended()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const QString project = Folder().filePath("sub/pair.json");
  QVERIFY(!window.Window().Files()->SaveTo(project));
  QVERIFY(window.HasMessage("sub/pair.json"));
  QVERIFY(Folder().mkpath("sub"));
  QVERIFY(window.Answer("Try again"));
  QVERIFY(QFile::exists(project));
  QCOMPARE(window.Messages(), QStringList("Saved " + project));
}

void TestMessages::aQuestionGoesWhenItIsAnsweredOtherwise()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->TranslateSelection(5, 0, 0);
  window.Window().close();
  QVERIFY(window.HasMessage("before the window closes"));
  QVERIFY(window.Window().Files()->SaveTo(Folder().filePath("pair.json"))); // by the menu instead
  QVERIFY(!window.HasMessage("before the window closes"));

  auto* job = Job::Start(
      &window.Window(), "Something long",
      [](const Progress& progress) {
        for (int i = 0; i < 3000; i++) {
          progress(0.5);
          QThread::msleep(10);
        }
      },
      [] {}, [](const QString&) {});
  window.Window().Jobs()->Watch(job);
  window.Window().close();
  QVERIFY(window.HasMessage("Something long is still running"));
  job->Cancel();
  QVERIFY(window.Wait());
  QVERIFY(window.Window().isVisible() && !window.HasMessage("still running"));
}

// Above the views: what runs, and below it what came of it. Nothing jumps, and what is soon done is not shown at all.
void TestMessages::progressIsWhereErrorsAre()
{
  WindowUnderTest window;
  auto* jobs = window.Part<JobBar>("jobBar");
  auto* bar = window.Part<MessageBar>("messageBar");
  QCOMPARE(jobs->parentWidget(), bar->parentWidget());
  QVERIFY(window.Open({A(), B()}));
  window.Key(Qt::Key_R);
  QTRY_VERIFY(window.Part<QWidget>("jobCancel")->isVisible() || window.Window().Jobs()->Count() == 0);
  window.Screenshot("progress");
  const auto isShown = [jobs] {
    const auto buttons = jobs->findChildren<QWidget*>("jobCancel");
    return std::any_of(buttons.begin(), buttons.end(), [](const QWidget* each) { return each->isVisible(); });
  };
  bool isLeft = false; // of a job that has ended
  const QObject untilHere;
  connect(jobs, &JobBar::CountChanged, &untilHere, [&](int count) { isLeft |= count == 0 && isShown(); });
  QVERIFY(window.Wait());
  QVERIFY(!isLeft && !isShown());
  QVERIFY(window.HasMessage("Refine: done"));
  QVERIFY(jobs->geometry().bottom() <= bar->geometry().top() && jobs->x() == bar->x());
}

void TestMessages::signsTellKindsApartWithoutColours()
{
  WindowUnderTest window;
  auto* bench = window.Window().Bench();
  bench->Note("a note");
  bench->Warn("a warning", {{"Mend", {}}});
  bench->Ask("a question?", {{"Yes", {}}});
  window.Settle();
  QStringList signs;
  for (auto* row : window.Part<MessageBar>("messageBar")->findChildren<QFrame*>("messageRow"))
    signs.append(row->findChildren<QLabel*>().first()->text());
  signs.removeDuplicates();
  QCOMPARE(signs.size(), 3);
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestMessages test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestMessages.moc"
