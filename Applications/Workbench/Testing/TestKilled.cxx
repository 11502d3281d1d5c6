// SPDX-License-Identifier: BSD-3-Clause
// kill -9 at random moments of work in the real window: at most one second of work is lost, and never a file. Time in which the
// machine itself let nothing be written (a busy disk, more programs than processors) is measured beside the work and counts as
// no loss. ECHORAMA_KILLS (12) says how often.
#include "FileActions.h"
#include "SliceCanvas.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <QApplication>
#include <QCryptographicHash>
#include <QElapsedTimer>
#include <QProcess>
#include <QtTest>
#include <random>
#include <thread>
#include <vtkNew.h>
#include <vtkStringArray.h>

using namespace echorama;

namespace {

constexpr double MostSeconds = 1.0;
constexpr double WitnessSeconds = 0.02; // between its files

// Where the second volume lies, exactly enough to know every state again.
QString StateOf(vtkUltrasoundAlignmentSession* session)
{
  double middle[3] = {0, 0, 0}, degrees[3] = {0, 0, 0};
  session->GetPlacement(session->GetVolumeId(1), middle, degrees);
  QString text;
  for (const double number : {middle[0], middle[1], middle[2], degrees[0], degrees[1], degrees[2]})
    text += QString("%1,").arg(number, 0, 'f', 6);
  return text;
}

// Makes small files in a folder, one after another, and says "seconds written" after each: when it is late, the machine was.
void MakeFiles(const std::filesystem::path& folder, const QElapsedTimer& clock)
{
  const std::filesystem::path part = folder / "witness.part", whole = folder / "witness";
  for (;;) {
    std::ofstream(part) << std::string(4096, 'x');
    std::error_code error;
    std::filesystem::create_hard_link(part, whole, error);
    std::filesystem::remove(part);
    std::filesystem::remove(whole);
    std::printf("%.3f written\n", 0.001 * static_cast<double>(clock.elapsed()));
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::duration<double>(WitnessSeconds));
  }
}

// How long, in all, the machine let nothing be written from one time on: \a written is when something was.
double Stalled(const std::vector<double>& written, double from)
{
  double stalled = 0.0;
  for (std::size_t i = 1; i < written.size(); i++)
    if (written[i] > from)
      stalled += std::max(0.0, written[i] - std::max(written[i - 1], from) - 2.0 * WitnessSeconds);
  return stalled;
}

// The child: works until it is killed, and says "seconds state" after each step and "seconds begin" before it: what follows may
// have happened without being said.
class Worker {
public:
  Worker(const QStringList& arguments)
  {
    window_.Window().Start({}, arguments.mid(2, 2));
    if (!QTest::qWaitFor([this] { return window_.Session()->GetNumberOfVolumes() == 2; }, 30000))
      qFatal("the volumes do not come");
    window_.Settle();
    const bool isSaved = arguments.size() > 4;
    if (isSaved && !window_.Window().Files()->SaveTo(arguments[4]))
      qFatal("the project cannot be saved");
    random_.seed(arguments[1].toUInt());
    clock_.start();
    std::thread(MakeFiles, std::filesystem::path(arguments[2].toStdString()).parent_path(), std::cref(clock_)).detach();
    Say(StateOf(window_.Session()));
    for (int i = 0;; i++) {
      switch (random_() % 5) {
      case 0:
        Keys();
        break;
      case 1:
        Stroke();
        break;
      case 2:
        if (window_.Session()->GetUndoCount() > 2)
          Step([this] { window_.Key(Qt::Key_Z, Qt::ControlModifier); });
        break;
      default:
        DragVolume();
      }
      if (isSaved && random_() % 3 == 0)
        window_.Key(Qt::Key_S, Qt::ControlModifier);
    }
  }

private:
  void Say(const QString& what)
  {
    std::printf("%.3f %s\n", 0.001 * static_cast<double>(clock_.elapsed()), qPrintable(what));
    std::fflush(stdout);
  }
  void Step(const std::function<void()>& step)
  {
    Say("begin");
    step();
    Say(StateOf(window_.Session()));
  }
  void DragVolume()
  {
    SliceCanvas* slice = window_.Slice(static_cast<int>(random_() % 2));
    const QPoint from = slice->rect().center() + QPoint(18, 34);
    window_.Press(slice, from);
    const int steps = 1 + static_cast<int>(random_() % 40), across = static_cast<int>(random_() % 30),
              down = static_cast<int>(random_() % 20);
    for (int i = 1; i <= steps; i++)
      Step([&] {
        window_.Move(slice, from + QPoint(across * i / steps - 10, down * i / steps - 8));
        QTest::qWait(25);
      });
    Step([&] { window_.Release(slice, from + QPoint(across - 10, down - 8)); });
  }
  void Keys()
  {
    window_.Slice(0)->setFocus();
    for (unsigned int i = 0; i < 1 + random_() % 6; i++)
      Step([this] { window_.Key(random_() % 2 ? Qt::Key_Right : Qt::Key_Up); });
  }
  void Stroke()
  {
    window_.Window().Bench()->SetTool(Tool::Paint);
    const QPoint from = window_.Slice(0)->rect().center();
    window_.Drag(window_.Slice(0), from, from + QPoint(20, 5));
    window_.Window().Bench()->SetTool(Tool::Align);
  }

  WindowUnderTest window_;
  std::mt19937 random_;
  QElapsedTimer clock_;
};

QByteArray Sum(const QString& path)
{
  QFile file(path);
  if (!file.open(QIODevice::ReadOnly))
    return "gone";
  return QCryptographicHash::hash(file.readAll(), QCryptographicHash::Sha1);
}

} // namespace

class TestKilled : public WindowTest {
  Q_OBJECT

private slots:
  void killsLoseAtMostASecond();

private:
  QStringList KillAt(const QStringList& arguments, bool fromStart, int milliseconds);
  QString Recovered(const QString& project);
};

// Lets a child work, kills it so long after it began to work (or was started), and returns what it had said.
QStringList TestKilled::KillAt(const QStringList& arguments, bool fromStart, int milliseconds)
{
  QProcess child;
  child.start(QCoreApplication::applicationFilePath(), arguments);
  if (!child.waitForStarted())
    return {};
  QByteArray said;
  const auto read = [&](int wait) {
    child.waitForReadyRead(wait);
    said += child.readAllStandardOutput();
  };
  QElapsedTimer clock;
  clock.start();
  while (!fromStart && said.isEmpty() && clock.elapsed() < 60000)
    read(50);
  clock.start();
  while (clock.elapsed() < milliseconds)
    read(milliseconds - static_cast<int>(clock.elapsed()));
  ::kill(static_cast<pid_t>(child.processId()), SIGKILL);
  child.waitForFinished();
  said += child.readAllStandardOutput();
  QStringList lines = QString::fromUtf8(said).split('\n');
  lines.removeLast(); // what follows the last end of a line, if anything, was not said whole
  return lines;
}

// What the next start has, taking all that is offered; empty: nothing.
QString TestKilled::Recovered(const QString& project)
{
  vtkNew<vtkUltrasoundAlignmentSession> session;
  if (QFile::exists(project)) {
    if (!session->OpenProject(project.toUtf8().constData()))
      return "the project does not open";
    const std::string later = session->GetLaterBackup();
    if (!later.empty() && !session->RestoreBackup(later.c_str()))
      return "the backup does not open";
    return StateOf(session);
  }
  vtkNew<vtkStringArray> folders, paths, labels;
  if (vtkUltrasoundAlignmentSession::GetAbandonedSessions(folders) == 0)
    return {};
  const int count = vtkUltrasoundAlignmentSession::GetBackupsIn(folders->GetValue(0).c_str(), paths, labels);
  for (int i = 0; i < count; i++) {
    if (labels->GetValue(i) == "damaged")
      return "a backup is damaged";
    if (i == 0 && !session->OpenProject(paths->GetValue(0).c_str()))
      return "the backup does not open";
  }
  return count > 0 ? StateOf(session) : QString();
}

void TestKilled::killsLoseAtMostASecond()
{
  bool isNumber = false;
  const int asked = qEnvironmentVariableIntValue("ECHORAMA_KILLS", &isNumber), kills = isNumber ? asked : 12;
  std::mt19937 random(20);
  double most = 0.0, sum = 0.0, longestStall = 0.0;
  int measured = 0, saved = 0, early = 0;
  for (int kill = 0; kill < kills; kill++) {
    QTemporaryDir place;
    const QDir folder(place.path());
    qputenv("XDG_DATA_HOME", folder.filePath("data").toLocal8Bit());
    const QStringList volumes{::WriteVolume(folder, "left.mha", 1, {0, 0, 0}), ::WriteVolume(folder, "right.mha", 2, {12, 4, 0})};
    const QByteArray sums = Sum(volumes[0]) + Sum(volumes[1]);
    const QString project = folder.filePath("pair.json");
    const unsigned int seed = random();
    const bool hasProject = random() % 2 == 0, fromStart = random() % 10 == 0;
    QStringList arguments{"--work", QString::number(seed), volumes[0], volumes[1]};
    if (hasProject)
      arguments.append(project);
    const QStringList said = KillAt(arguments, fromStart, static_cast<int>(random() % (fromStart ? 1500 : 2500)));
    const QString about = QString("kill %1, seed %2%3").arg(kill).arg(seed).arg(hasProject ? ", with a project" : "");
    QVERIFY2(Sum(volumes[0]) + Sum(volumes[1]) == sums, qPrintable(about + ": a volume has changed"));

    const QString kept = Recovered(project);
    QVERIFY2(!kept.contains(' '), qPrintable(about + ": " + kept));
    saved += QFile::exists(project);
    // What is kept was the state until the next step began: how long nothing was done before is no loss.
    double last = -1.0, keptTime = -1.0;
    QString first, state, step;
    std::vector<double> written;
    for (const QString& line : said) {
      const double time = line.section(' ', 0, 0).toDouble();
      const QString what = line.section(' ', 1);
      if (what == "written") {
        written.push_back(time);
        continue;
      }
      step = what;
      if (what != "begin") {
        last = time;
        state = what;
        first = first.isEmpty() ? state : first;
      }
      if (!state.isEmpty() && state == (kept.isEmpty() ? first : kept)) // volumes that were opened and not moved are no work yet
        keptTime = time;
    }
    if (last < 0.0) { // it was still opening its files
      early++;
      continue;
    }
    if (keptTime < 0.0 && step == "begin")
      keptTime = last;
    QVERIFY2(keptTime >= 0.0, qPrintable(QString("%1: %2 was never said").arg(about, kept)));
    const double lost = std::max(0.0, last - keptTime);
    written.push_back(last); // it may have been kept from the one after
    std::sort(written.begin(), written.end());
    const double stalled = Stalled(written, keptTime - MostSeconds);
    QVERIFY2(
        lost <= MostSeconds + stalled,
        qPrintable(QString("%1: %2 s are lost; nothing could be written in %3 s of them").arg(about).arg(lost).arg(stalled)));
    most = std::max(most, lost);
    longestStall = std::max(longestStall, stalled);
    sum += lost;
    measured++;
    if (measured % 20 == 0)
      qInfo("%d kills during work: %.3f s lost at most", measured, most);
  }
  qInfo("%d kills during work lost %.3f s at most, %.3f s in the mean; %d before it; %d left a project; the machine stalled for "
        "%.3f s at most",
        measured, most, sum / std::max(1, measured), early, saved, longestStall);
  QVERIFY(measured > 0.7 * kills && saved > 0.3 * kills);
}

int main(int argc, char** argv)
{
  qputenv("QTEST_FUNCTION_TIMEOUT", "2400000"); // ms; a hundred take some 5 minutes
  return WindowTest::Run(argc, argv, [argc, argv] {
    const QStringList arguments = QApplication::arguments();
    if (arguments.value(1) == "--work")
      Worker(arguments.mid(1));
    TestKilled test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestKilled.moc"
