// SPDX-License-Identifier: BSD-3-Clause
// Projects that travel: with their volumes to another machine, after their files moved, and beside another session.
#include "FileActions.h"
#include "ProjectActions.h"
#include "ResultPanel.h"
#include "SliceCanvas.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QDialog>
#include <QDirIterator>
#include <QFileDialog>
#include <QLineEdit>
#include <QPushButton>
#include <QTableWidget>
#include <QtTest>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;

class TestProjects : public WindowTest {
  Q_OBJECT

private slots:
  void aProjectGoesToAnotherMachineWithItsVolumes();
  void aCopyThatCannotBeMadeSaysWhere();
  void aResultInNoFileIsInTheCopyAlone();
  void openingTheCopyAsksOnlyForWorkThatIsNotInIt();
  void afterFilesMovedAFolderIsAskedFor();
  void twoSessionsAreCompared();

private:
  // By the menu's dialog, into a folder of that name.
  bool Copy(WindowUnderTest& window, const QString& name)
  {
    window.Part<QAction>("copyProject")->trigger();
    if (!QTest::qWaitFor([&window] { return window.Window().findChild<QFileDialog*>("copyDialog") != nullptr; }))
      return false;
    auto* dialog = window.Part<QFileDialog>("copyDialog");
    dialog->setDirectory(Folder());
    auto* line = dialog->findChild<QLineEdit*>();
    line->setText(name);
    QTest::keyClick(line, Qt::Key_Return);
    const QString said = "are in " + Folder().filePath(name);
    return window.Wait() && QTest::qWaitFor([&] { return window.HasMessage(said); });
  }
};

namespace {

std::vector<double> GreysOf(const WindowUnderTest& window, int id)
{
  vtkDataArray* greys = vtkUltrasoundVolume::GetIntensity(window.Session()->GetImage(id));
  std::vector<double> values;
  for (vtkIdType i = 0; i < greys->GetNumberOfTuples(); ++i)
    values.push_back(greys->GetComponent(i, 0));
  return values;
}

} // namespace

void TestProjects::aProjectGoesToAnotherMachineWithItsVolumes()
{
  std::array<double, 16> pose{};
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    window.Session()->SetPlacement(2, 10, -3, 5, 10, 20, 30);
    pose = window.Pose(2);
    QVERIFY2(Copy(window, "travels"), qPrintable(window.Messages().join('\n')));
    window.Screenshot("copied-project");
    QVERIFY(window.Session()->GetProjectPath().empty()); // the session goes on where it is
    QVERIFY(window.Window().Files()->HasUnsavedWork());
  }
  QVERIFY(Folder().mkpath("machine"));
  QVERIFY(QFile::rename(Folder().filePath("travels"), Folder().filePath("machine/travels")));
  for (const char* file : {"left.mha", "right.mha"})
    QVERIFY(QFile::remove(Folder().filePath(file)));
  WindowUnderTest window;
  window.Drop({Folder().filePath("machine/travels/travels.json")});
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 2);
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Pose(2), pose);
}

void TestProjects::aCopyThatCannotBeMadeSaysWhere()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* actions = window.Window().findChild<ProjectActions*>();
  actions->CopyTo(Folder().path()); // which holds the volumes
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("not empty; name a new folder"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Answer("Choose another place..."));
  QTRY_VERIFY(window.Window().findChild<QFileDialog*>("copyDialog"));
  window.Part<QFileDialog>("copyDialog")->reject();
  actions->CopyTo(Folder().filePath("copy"));
  QVERIFY(window.Wait());
  QVERIFY(window.Answer("Open the copy"));
  QVERIFY(window.Wait());
  QTRY_COMPARE(QString::fromStdString(window.Session()->GetProjectPath()), Folder().filePath("copy/copy.json"));
}

// A copy holds files, and a result that was just made is in none: it is written into the copy, and nowhere else.
void TestProjects::aResultInNoFileIsInTheCopyAlone()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Part<ResultPanel>("resultPanel")->Make(true);
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 3);
  const std::vector<double> made = GreysOf(window, 3);
  QVERIFY(Copy(window, "copy"));
  QStringList files;
  for (QDirIterator each(Folder().path(), {"result*"}, QDir::Files, QDirIterator::Subdirectories); each.hasNext();)
    files.append(Folder().relativeFilePath(each.next()));
  files.sort();
  QVERIFY(files.contains("copy/volumes/result.mha"));
  for (const QString& file : files) // with what belongs to it, and no other
    QVERIFY2(file.startsWith("copy/volumes/result.") && !file.endsWith(".part"), qPrintable(file));
  QVERIFY(window.Session()->GetFile(3).empty()); // the folder may be given away: what is here does not need it
  QVERIFY(window.Answer("Open the copy"));
  QVERIFY(window.Wait());
  QTRY_COMPARE(QString::fromStdString(window.Session()->GetProjectPath()), Folder().filePath("copy/copy.json"));
  const int id = window.Session()->GetVolumeId(2);
  QVERIFY(window.Session()->IsResult(id) && window.Session()->GetSourcesChanged(id).empty());
  QVERIFY(GreysOf(window, id) == made);
}

// What was copied is in the copy; only what was done since would be lost.
void TestProjects::openingTheCopyAsksOnlyForWorkThatIsNotInIt()
{
  WindowUnderTest window;
  window.Window().Start({}, {A(), B()}); // with backups
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  const auto press = [&window](Qt::Key key) {
    window.Move(window.Slice(0), window.Slice(0)->rect().center() + QPoint(5, 50));
    window.Key(key);
  };
  press(Qt::Key_Right);
  QVERIFY(window.Window().Files()->HasUnsavedWork());
  QVERIFY(Copy(window, "one"));
  const auto earlier = window.Pose(2);
  press(Qt::Key_Up); // not in the copy
  QVERIFY(window.Pose(2) != earlier);
  const auto later = window.Pose(2);
  QVERIFY(window.Answer("Open the copy"));
  QVERIFY2(window.HasMessage("Save what you did"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Answer("Cancel"));
  QVERIFY(window.Session()->GetProjectPath().empty());
  QCOMPARE(window.Pose(2), later);

  QVERIFY(Copy(window, "two"));
  QVERIFY(window.Answer("Open the copy"));
  QVERIFY(window.Wait());
  QTRY_COMPARE(QString::fromStdString(window.Session()->GetProjectPath()), Folder().filePath("two/two.json"));
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Pose(window.Session()->GetVolumeId(1)), later);
  QVERIFY(!window.Window().Files()->HasUnsavedWork());
  // And the session that it was is not offered at the next start.
  WindowUnderTest next;
  next.Window().Start({}, {});
  QVERIFY2(next.Messages().isEmpty(), qPrintable(next.Messages().join('\n')));
}

void TestProjects::afterFilesMovedAFolderIsAskedFor()
{
  const QString project = Folder().filePath("pair.json");
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    QVERIFY(window.Window().Files()->SaveTo(project));
  }
  QVERIFY(Folder().mkpath("away"));
  for (const char* file : {"left.mha", "right.mha"})
    QVERIFY(QFile::rename(Folder().filePath(file), Folder().filePath(QString("away/") + file)));
  WindowUnderTest window;
  QVERIFY(window.Open({project}));
  QCOMPARE(window.Messages().size(), 1); // one message: what is missing, and what to do
  QVERIFY(window.HasMessage("right.mha") && window.HasMessage("Where are they now?"));
  QVERIFY(window.Answer("Look in a folder..."));
  auto* dialog = window.Part<QFileDialog>("folderDialog");
  dialog->selectFile(Folder().filePath("away"));
  emit dialog->fileSelected(Folder().filePath("away"));
  dialog->close();
  QVERIFY(window.Wait());
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Window().Files()->Save()); // from now on it knows where they are
  WindowUnderTest again;
  QVERIFY(again.Open({project}));
  QCOMPARE(again.Session()->GetNumberOfVolumes(), 2);
}

void TestProjects::twoSessionsAreCompared()
{
  const QString project = Folder().filePath("other.json");
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  QVERIFY(window.Window().Files()->SaveTo(project));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(3, 4, 0);
  window.Part<QAction>("compareProject")->trigger();
  QTRY_VERIFY(window.Window().findChild<QFileDialog*>("compareDialog"));
  auto* chooser = window.Part<QFileDialog>("compareDialog");
  auto* name = chooser->findChild<QLineEdit*>();
  name->setText(project);
  QTest::keyClick(name, Qt::Key_Return);
  QTRY_VERIFY(window.Window().findChild<QDialog*>("comparison"));
  auto* dialog = window.Part<QDialog>("comparison");
  QVERIFY(QTest::qWaitForWindowExposed(dialog));
  auto* table = window.Part<QTableWidget>("differences");
  const auto row = [table](int number) {
    QStringList texts;
    for (int column = 0; column < table->columnCount(); column++)
      texts.append(table->item(number, column)->text());
    return texts;
  };
  QCOMPARE(row(0), QStringList({"left", "0.00", "0.00", "0.00"}));
  QCOMPARE(row(1), QStringList({"right", "5.00", "5.00", "0.00"}));
  dialog->grab().save(QString::fromLocal8Bit(qgetenv("ECHORAMA_BUILD_DIR")) + "/screenshots/comparison.png");
  // It follows what is done, and all moved together is no difference unless one asks for it.
  QVERIFY(window.Session()->Undo());
  QTRY_COMPARE(row(1)[1], QString("0.00"));
  window.Session()->SelectAll();
  window.Session()->TranslateSelection(0, 0, 7);
  QCOMPARE(row(1)[1], QString("0.00"));
  QTest::mouseClick(window.Part<QCheckBox>("besideFirst"), Qt::LeftButton, {}, QPoint(6, 8));
  QCOMPARE(row(0)[1], QString("7.00"));
  for (auto* button : dialog->findChildren<QPushButton*>())
    if (button->text() == "Copy &table")
      QTest::mouseClick(button, Qt::LeftButton);
  QVERIFY(QApplication::clipboard()->text().contains("left\t7.00\t7.00\t0.00\n"));
  // Not while somebody is scored: it may be the solution.
  window.Window().Bench()->BeginAttempt(false);
  QTRY_VERIFY(!window.Window().findChild<QDialog*>("comparison"));
  QVERIFY(!window.Part<QAction>("compareProject")->isEnabled());
  window.Window().Bench()->EndAttempt();

  QFile empty(Folder().filePath("nothing.json"));
  QVERIFY(empty.open(QIODevice::WriteOnly) && empty.write("{}") == 2);
  empty.close();
  window.Window().findChild<ProjectActions*>()->CompareWith(empty.fileName());
  QVERIFY(window.HasMessage("nothing.json"));
  QVERIFY(window.Answer("Compare with another..."));
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestProjects test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestProjects.moc"
