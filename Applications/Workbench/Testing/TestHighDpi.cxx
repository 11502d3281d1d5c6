// SPDX-License-Identifier: BSD-3-Clause
// A screen of two device pixels for each of the window's: views are drawn in device pixels, and the mouse means the place it is
// over.
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "vtkUltrasoundSliceView.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <cmath>
#include <QApplication>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>

using namespace echorama;

class TestHighDpi : public WindowTest {
  Q_OBJECT

private slots:
  void viewsAreDrawnInDevicePixels();
  void theMouseMeansThePlaceItIsOver();
  void aDragMovesAVolumeAsFarAsTheMouse();
  void handlesAreAsLargeForTheHand();
};

void TestHighDpi::viewsAreDrawnInDevicePixels()
{
  WindowUnderTest window;
  QCOMPARE(window.Slice(0)->devicePixelRatioF(), 2.0);
  QVERIFY(window.Open({A(), B()}));
  const QImage picture = window.Screenshot("high-dpi");
  QCOMPARE(picture.width(), 2 * window.Window().width());
  for (int i = 0; i < 3; i++) {
    SliceCanvas* slice = window.Slice(i);
    const int* size = slice->View()->GetPicture()->GetDimensions();
    QCOMPARE(QSize(size[0], size[1]), slice->size() * 2);
    const int* drawn = slice->renderWindow()->GetSize();
    QCOMPARE(QSize(drawn[0], drawn[1]), slice->size() * 2);
  }
  QVTKOpenGLNativeWidget* volume = window.Window().Views()->Volume()->Canvas();
  const int* drawn = volume->renderWindow()->GetSize();
  QCOMPARE(QSize(drawn[0], drawn[1]), volume->size() * 2);
}

void TestHighDpi::theMouseMeansThePlaceItIsOver()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  window.Window().Bench()->SetTool(Tool::Look);
  SliceCanvas* slice = window.Slice(0);
  vtkUltrasoundSliceView* view = slice->View();
  // Where the view draws a place of the world, there the click finds it.
  const double place[3] = {7.0, -5.0, 0.0};
  double pixel[2];
  view->WorldToPixel(place[0], place[1], place[2], pixel);
  const QPoint at(qRound(pixel[0] / 2.0), qRound(slice->height() - (pixel[1] + 1.0) / 2.0));
  QVERIFY(slice->rect().contains(at));
  window.Click(slice, at);
  double cursor[3];
  view->GetCursor(cursor);
  const double mm = view->GetMillimetresPerPixel();
  QVERIFY2(std::abs(cursor[0] - place[0]) <= 1.5 * mm && std::abs(cursor[1] - place[1]) <= 1.5 * mm,
           qPrintable(QString("%1 %2").arg(cursor[0]).arg(cursor[1])));
}

void TestHighDpi::aDragMovesAVolumeAsFarAsTheMouse()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  const auto before = window.Pose(2);
  const QPoint from = slice->rect().center() + QPoint(18, 34), by(30, -20);
  window.Drag(slice, from, from + by);
  const auto after = window.Pose(2);
  const double mm = 2.0 * slice->View()->GetMillimetresPerPixel(); // of the window's pixels
  double right[3], up[3];
  slice->View()->GetRight(right);
  slice->View()->GetUp(up);
  for (std::size_t axis = 0; axis < 3; axis++) {
    const double moved = after[4 * axis + 3] - before[4 * axis + 3], wanted = mm * (right[axis] * by.x() - up[axis] * by.y());
    QVERIFY2(std::abs(moved - wanted) < 1.01 * mm, qPrintable(QString("%1: %2 for %3").arg(axis).arg(moved).arg(wanted)));
  }
}

// 80 of the window's pixels beside the centre there is the arrow along x, which is 100 long: it moves along x alone.
void TestHighDpi::handlesAreAsLargeForTheHand()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  double centre[3], pixel[2];
  window.Session()->GetCentreOfRotation(centre);
  slice->View()->WorldToPixel(centre[0], centre[1], centre[2], pixel);
  const QPoint middle(qRound(pixel[0] / 2.0), qRound(slice->height() - (pixel[1] + 1.0) / 2.0)), from = middle + QPoint(80, 0);
  const auto before = window.Pose(2);
  window.Drag(slice, from, from + QPoint(20, 15));
  const auto after = window.Pose(2);
  QVERIFY(std::abs(after[3] - before[3]) > 1.0);
  QVERIFY2(std::abs(after[7] - before[7]) < 1e-9, qPrintable(QString::number(after[7] - before[7])));
}

int main(int argc, char** argv)
{
  qputenv("QT_SCALE_FACTOR", "2"); // before there is an application
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestHighDpi test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestHighDpi.moc"
