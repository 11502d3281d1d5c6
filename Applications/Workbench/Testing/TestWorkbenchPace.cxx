// SPDX-License-Identifier: BSD-3-Clause
// How fast the whole window is while a volume is dragged with the mouse: three slices and the 3D view over five volumes. It
// prints what it measures, and asserts no time: machines differ. ECHORAMA_PACE_SIDE (64) says how many voxels a side the volumes
// have, ECHORAMA_PACE_FRAMES (40) how many steps the mouse makes. ctest runs it short; how the numbers of the manual were made is
// told there.
#include "Core/Base/ElapsedTime.h"
#include "SliceCanvas.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "vtkUltrasoundSliceView.h"
#include "vtkUltrasoundVolumeView.h"
#include "WindowUnderTest.h"
#include <algorithm>
#include <ctime>
#include <QComboBox>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkCallbackCommand.h>
#include <vtkRenderWindow.h>

using namespace echorama;

class TestWorkbenchPace : public WindowTest {
  Q_OBJECT

private slots:
  void everyViewFollowsTheMouse_data();
  void everyViewFollowsTheMouse();

private:
  static int Setting(const char* name, int otherwise)
  {
    bool isNumber = false;
    const int value = qEnvironmentVariableIntValue(name, &isNumber);
    return isNumber ? value : otherwise;
  }
  static QString Spread(std::vector<double> seconds)
  {
    std::sort(seconds.begin(), seconds.end());
    const auto at = [&](double share) {
      return 1e3 * seconds[static_cast<std::size_t>(share * static_cast<double>(seconds.size() - 1))];
    };
    return QString("%1 ms in the median, %2 in 95 %, %3 at most")
        .arg(at(0.5), 0, 'f', 1)
        .arg(at(0.95), 0, 'f', 1)
        .arg(at(1.0), 0, 'f', 1);
  }
};

void TestWorkbenchPace::everyViewFollowsTheMouse_data()
{
  QTest::addColumn<QString>("style");
  for (const char* style : {"points", "volume", "outline"})
    QTest::newRow(style) << QString(style);
}

void TestWorkbenchPace::everyViewFollowsTheMouse()
{
  QFETCH(const QString, style);
  const int side = Setting("ECHORAMA_PACE_SIDE", 64), steps = std::max(10, Setting("ECHORAMA_PACE_FRAMES", 40));
  WindowUnderTest window;
  window.Window().resize(1280, 800);
  QStringList paths;
  for (int v = 0; v < 5; v++)
    paths << WriteVolume(QString("volume%1.mha").arg(v), v + 1, {0.15 * side * v, 0.1 * side * (v % 2), 0.05 * side * v}, side);
  QVERIFY(window.Open(paths));
  auto* styles = window.Part<QComboBox>("volumeStyle");
  styles->setCurrentIndex(styles->findData(style));
  emit styles->activated(styles->currentIndex());
  window.Key(Qt::Key_F);
  VolumePane* volume = window.Window().Views()->Volume();
  window.Settle();

  // How often each view has drawn.
  std::array<vtkRenderWindow*, 4> views{};
  std::array<int, 4> drawn{};
  for (std::size_t i = 0; i < 3; i++)
    views[i] = window.Slice(static_cast<int>(i))->renderWindow();
  views[3] = volume->Canvas()->renderWindow();
  std::array<unsigned long, 4> tags{};
  for (std::size_t i = 0; i < 4; i++) {
    vtkNew<vtkCallbackCommand> ended;
    ended->SetClientData(&drawn[i]);
    ended->SetCallback([](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
    tags[i] = views[i]->AddObserver(vtkCommand::EndEvent, ended);
  }

  // When the last of the pictures was there that come without a move of the mouse, and how fine the 3D view is then.
  const auto untilNothingIsDrawn = [&] {
    Clock::time_point last = Clock::now();
    for (auto before = drawn; SecondsSince(last) < 1.5;) {
      QApplication::processEvents(QEventLoop::AllEvents, 1);
      if (drawn != before) {
        last = Clock::now();
        before = drawn;
      }
    }
    return last;
  };
  untilNothingIsDrawn();
  const int rest = volume->View()->GetDetailLevel();

  SliceCanvas* slice = window.Slice(0);
  const QPoint middle = slice->rect().center() + QPoint(18, 34); // off the middle, where the handles are
  const auto places = [&] {
    std::vector<std::array<double, 16>> all;
    for (int i = 0; i < window.Session()->GetNumberOfVolumes(); i++)
      all.push_back(window.Pose(window.Session()->GetVolumeId(i)));
    return all;
  };
  const auto before = places();
  window.Press(slice, middle);
  std::vector<double> frames;
  const std::clock_t processors = std::clock();
  Clock::time_point moved;
  QPoint at;
  for (int step = 1; step <= steps; step++) {
    const double turn = 0.2 * step;
    drawn.fill(0);
    moved = Clock::now();
    at = middle + QPoint(qRound(40.0 * std::sin(turn)), qRound(30.0 * std::cos(turn)));
    window.Move(slice, at);
    while (*std::min_element(drawn.begin(), drawn.end()) == 0 && SecondsSince(moved) < 5.0)
      QApplication::processEvents(QEventLoop::AllEvents, 1);
    frames.push_back(SecondsSince(moved));
  }
  const double processorMs = 1e3 * static_cast<double>(std::clock() - processors) / CLOCKS_PER_SEC / steps;
  const int level = volume->View()->GetDetailLevel();
  window.Release(slice, at);
  const double whole = std::chrono::duration<double>(untilNothingIsDrawn() - moved).count();
  qInfo("%s, five volumes of %d^3: a frame of all four views takes %s; %.1f ms of processors; level %d of the 3D view; that of "
        "rest, %d, is there %.0f ms after the last move",
        qPrintable(style), side, qPrintable(Spread(frames)), processorMs, level, volume->View()->GetDetailLevel(), 1e3 * whole);
  for (std::size_t i = 0; i < 4; i++)
    views[i]->RemoveObserver(tags[i]);
  QVERIFY(places() != before);
  QVERIFY2(*std::max_element(frames.begin(), frames.end()) < 5.0, "a view was not drawn again");
  QCOMPARE(volume->View()->GetDetailLevel(), rest);
  QVERIFY(!slice->View()->GetInteractive());
}

int main(int argc, char** argv)
{
  qputenv("QTEST_FUNCTION_TIMEOUT", "2147483647"); // the most that Qt takes: as long as it is asked to run
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestWorkbenchPace test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestWorkbenchPace.moc"
