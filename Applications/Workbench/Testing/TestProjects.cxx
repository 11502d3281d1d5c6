// SPDX-License-Identifier: BSD-3-Clause
// Projects that travel: with their volumes to another machine, after their files moved, and beside another session.
#include "FileActions.h"
#include "ProjectActions.h"
#include "ResultPanel.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QDialog>
#include <QFileDialog>
#include <QLineEdit>
#include <QPushButton>
#include <QTableWidget>
#include <QtTest>

using namespace echorama;

class TestProjects : public WindowTest {
  Q_OBJECT

private slots:
  void aProjectGoesToAnotherMachineWithItsVolumes();
  void aCopyThatCannotBeMadeSaysWhere();
  void aResultInNoFileIsSavedBeforeTheCopy();
  void afterFilesMovedAFolderIsAskedFor();
  void twoSessionsAreCompared();
};

void TestProjects::aProjectGoesToAnotherMachineWithItsVolumes()
{
  std::array<double, 16> pose{};
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    window.Session()->SetPlacement(2, 10, -3, 5, 10, 20, 30);
    pose = window.Pose(2);
    window.Part<QAction>("copyProject")->trigger();
    QTRY_VERIFY(window.Window().findChild<QFileDialog*>("copyDialog"));
    auto* dialog = window.Part<QFileDialog>("copyDialog");
    dialog->setDirectory(Folder());
    auto* name = dialog->findChild<QLineEdit*>();
    name->setText("travels");
    QTest::keyClick(name, Qt::Key_Return);
    QVERIFY(window.Wait());
    QVERIFY2(window.HasMessage("are in " + Folder().filePath("travels")), qPrintable(window.Messages().join('\n')));
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
  QVERIFY(window.Answer("Do not save") || true); // volumes that were only opened are no work
  QVERIFY(window.Wait());
  QTRY_COMPARE(QString::fromStdString(window.Session()->GetProjectPath()), Folder().filePath("copy/copy.json"));
}

// A result that was just made is in no file, and a copy holds files: it says so, and leads on.
void TestProjects::aResultInNoFileIsSavedBeforeTheCopy()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Part<ResultPanel>("resultPanel")->Make(true);
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 3);
  auto* actions = window.Window().findChild<ProjectActions*>();
  const QString folder = Folder().filePath("copy");
  actions->CopyTo(folder);
  QVERIFY2(window.HasMessage("result is in no file yet"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Answer("Cancel"));
  QVERIFY(window.Wait());
  QVERIFY(!QFile::exists(folder) && !QFile::exists(Folder().filePath("result.mha")));
  actions->CopyTo(folder);
  QVERIFY(window.Answer("Save it there"));
  QTRY_VERIFY(window.HasMessage("are in " + folder));
  QVERIFY(QFile::exists(Folder().filePath("copy/volumes/result.mha")));
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
