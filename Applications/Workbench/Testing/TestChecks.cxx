// SPDX-License-Identifier: BSD-3-Clause
// How a person checks an alignment in the workbench: the linked pointer with its grey levels, callipers, angles and profiles,
// flicker, the map of what disagrees, the graph of pairs, oblique planes in numbers. Real mouse and key events; what is asked is
// what the session then holds and what the window shows.
#include "CheckPanel.h"
#include "DisagreementBox.h"
#include "Flicker.h"
#include "MeasureTool.h"
#include "PairGraph.h"
#include "ProfilePlot.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "vtkUltrasoundSliceView.h"
#include "vtkUltrasoundVolumeView.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <cmath>
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QPushButton>
#include <QTableWidget>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

Vector3d WorldAt(SliceCanvas* slice, const QPoint& position)
{
  const QPointF pixel = slice->PixelOf(position);
  Vector3d world;
  slice->View()->PixelToWorld(pixel.x(), pixel.y(), world.data());
  return world;
}

QPoint PositionAt(SliceCanvas* slice, const Vector3d& world)
{
  double pixel[2];
  slice->View()->WorldToPixel(world.x(), world.y(), world.z(), pixel);
  return slice->PositionOf({pixel[0], pixel[1]}).toPoint();
}

// Pixels of a slice that have the colour of the pointer's cross, within so many pixels of a position.
int PointerPixels(WindowUnderTest& window, SliceCanvas* slice, const QPoint& at, int reach)
{
  const QImage picture = window.Grab("pointer");
  const QPoint corner = slice->mapTo(&window.Window(), QPoint(0, 0));
  int found = 0;
  for (int y = std::max(0, at.y() - reach); y <= std::min(slice->height() - 1, at.y() + reach); ++y)
    for (int x = std::max(0, at.x() - reach); x <= std::min(slice->width() - 1, at.x() + reach); ++x) {
      const QColor colour = picture.pixelColor(corner + QPoint(x, y));
      found += colour.green() - colour.red() > 60 && std::abs(colour.green() - colour.blue()) < 25;
    }
  return found;
}

QByteArray PictureOf(SliceCanvas* slice)
{
  vtkDataArray* pixels = slice->View()->GetPicture()->GetPointData()->GetScalars();
  return {static_cast<const char*>(pixels->GetVoidPointer(0)), static_cast<int>(pixels->GetNumberOfValues())};
}

} // namespace

class TestChecks : public WindowTest {
  Q_OBJECT

private slots:
  void thePointerIsSeenInTheOtherSlices();
  void theReadoutTellsEveryVolume();
  void twoClicksMeasureADistance();
  void aDistanceMayGoFromSliceToSlice();
  void threeClicksMeasureAnAngle();
  void pointsOfMeasurementsAreDragged();
  void whatWasMeasuredIsKept();
  void theProfileShowsAShift();
  void flickerShowsBothSidesByTurns();
  void flickerEndsWhenSomethingIsDragged();
  void disagreementIsFoundShownAndGoesStale();
  void pairsAreAGraphAndOneIsLookedAtAlone();
  void aLandmarkIsFoundAgain();
  void aClickIn3DSelectsAVolume();
  void anObliquePlaneIsTyped();
  void thePictureOfTheManual();

private:
  void Raise(WindowUnderTest& window, const char* panel)
  {
    auto* dock = window.Part<QDockWidget>((QByteArray(panel) + "Dock").constData());
    dock->show();
    dock->raise();
    window.Settle();
  }
  static const std::vector<Measurement>& Measured(WindowUnderTest& window)
  {
    return window.Session()->GetKernel().State().measurements;
  }
  // A distance along the right of a slice, drawn with one drag.
  static Measurement DragDistance(WindowUnderTest& window, SliceCanvas* slice, const QPoint& from, const QPoint& to)
  {
    window.Key(Qt::Key_7);
    window.Drag(slice, from, to);
    return Measured(window).empty() ? Measurement() : Measured(window).back();
  }
};

void TestChecks::thePointerIsSeenInTheOtherSlices()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Key(Qt::Key_1); // the handles of the tool Align are not to be taken for it
  const QPoint here = window.Slice(0)->rect().center() + QPoint(37, -22);
  window.Move(window.Slice(0), here + QPoint(1, 0));
  window.Move(window.Slice(0), here);
  const Vector3d world = WorldAt(window.Slice(0), here);
  QTest::qWait(100);
  for (int i : {1, 2}) {
    const QPoint there = PositionAt(window.Slice(i), world);
    QVERIFY(window.Slice(i)->rect().contains(there));
    QVERIFY2(PointerPixels(window, window.Slice(i), there, 14) >= 20, qPrintable(QString::number(i)));
    // Nowhere else.
    QCOMPARE(PointerPixels(window, window.Slice(i), there, 1000), PointerPixels(window, window.Slice(i), there, 14));
  }
  QCOMPARE(PointerPixels(window, window.Slice(0), here, 14), 0);
  // It goes with the mouse, and when the mouse leaves.
  window.Move(window.Part<QWidget>("volumes"), QPoint(5, 5));
  QTest::qWait(100);
  for (int i : {0, 1, 2})
    QCOMPARE(PointerPixels(window, window.Slice(i), QPoint(0, 0), 2000), 0);
}

void TestChecks::theReadoutTellsEveryVolume()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B(), WriteVolume("third.mha", 3, {-14, 0, 0})}));
  Raise(window, "checkPanel");
  window.Key(Qt::Key_1);
  // x = -20: in the first and the third, outside of the second, which begins at 12 - 22 mm.
  double cursor[3];
  window.Slice(0)->View()->GetCursor(cursor);
  const QPoint here = PositionAt(window.Slice(0), {-20.0, cursor[1], cursor[2]});
  window.Move(window.Slice(0), here + QPoint(1, 0));
  window.Move(window.Slice(0), here);
  window.Settle();
  const Vector3d world = WorldAt(window.Slice(0), here);
  auto* table = window.Part<QTableWidget>("greyLevels");
  QCOMPARE(table->rowCount(), 3);
  const QString text = window.Part<QLabel>("readout")->text();
  int outside = 0;
  for (int row = 0; row < 3; ++row) {
    const std::string name = table->item(row, 0)->text().toStdString();
    for (int id : {1, 2, 3}) {
      if (window.Session()->GetName(id) != name)
        continue;
      const vtkIdType voxel = window.Session()->GetVoxelAt(id, world.data());
      const QString expected =
          voxel < 0 ? QString("outside")
                    : QString::number(vtkUltrasoundVolume::GetIntensity(window.Session()->GetImage(id))->GetComponent(voxel, 0),
                                      'g', 5);
      QCOMPARE(table->item(row, 1)->text(), expected);
      QVERIFY2(text.contains(QString::fromStdString(name) + ": " + expected), qPrintable(text));
      double rgb[3];
      window.Session()->GetColour(id, rgb);
      QVERIFY2(text.contains(QColor::fromRgbF(rgb[0], rgb[1], rgb[2]).name()), qPrintable(text));
      outside += voxel < 0;
    }
  }
  QCOMPARE(outside, 1);
}

void TestChecks::twoClicksMeasureADistance()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  window.Key(Qt::Key_7);
  const QPoint from = slice->rect().center() + QPoint(-40, 10), to = slice->rect().center() + QPoint(20, -35);
  window.Move(slice, from);
  window.Click(slice, from);
  QVERIFY(Measured(window).empty());
  window.Move(slice, to); // without a button: the line follows
  QCOMPARE(window.Window().Bench()->Measuring()->Draft().size(), std::size_t(2));
  window.Click(slice, to);
  QCOMPARE(Measured(window).size(), std::size_t(1));
  const double mm = slice->View()->GetMillimetresPerPixel(), expected = mm * std::hypot(60.0, 45.0);
  QVERIFY(std::abs(Measured(window)[0].Value() - expected) < 1.5 * mm);
  auto* table = window.Part<QTableWidget>("measurements");
  QCOMPARE(table->rowCount(), 1);
  QCOMPARE(table->item(0, 2)->text(), QString("%1 mm").arg(Measured(window)[0].Value(), 0, 'f', 2));
  QVERIFY(window.Window().Bench()->Measuring()->Draft().empty());
  // Escape drops what is not finished; another tool, too.
  window.Click(slice, from + QPoint(0, 30));
  window.Key(Qt::Key_Escape);
  window.Click(slice, from + QPoint(0, 40));
  window.Key(Qt::Key_1);
  QVERIFY(window.Window().Bench()->Measuring()->Draft().empty());
  QCOMPARE(Measured(window).size(), std::size_t(1));
  QVERIFY(window.Pose(1) == window.Pose(1) && window.Session()->GetUndoLabel() == "Measurement 1");
}

void TestChecks::aDistanceMayGoFromSliceToSlice()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Key(Qt::Key_7);
  const QPoint from = window.Slice(0)->rect().center() + QPoint(-30, 25), to = window.Slice(1)->rect().center() + QPoint(30, -50);
  const Vector3d a = WorldAt(window.Slice(0), from), b = WorldAt(window.Slice(1), to);
  window.Click(window.Slice(0), from);
  window.Click(window.Slice(1), to);
  QCOMPARE(Measured(window).size(), std::size_t(1));
  QVERIFY(std::abs(Measured(window)[0].Value() - (b - a).norm()) < 1e-9);
  QVERIFY((b - a).cwiseAbs().minCoeff() > 1.0); // it lies in none of the planes
}

void TestChecks::threeClicksMeasureAnAngle()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(1);
  window.Key(Qt::Key_8);
  const QPoint at = slice->rect().center();
  // From the right to straight up, and a little beyond: 90 degrees and atan(20 / 60).
  for (const QPoint& by : {QPoint(60, 0), QPoint(0, 0), QPoint(-20, -60)}) {
    QVERIFY(Measured(window).empty());
    window.Move(slice, at + by);
    window.Click(slice, at + by);
  }
  QCOMPARE(Measured(window).size(), std::size_t(1));
  QVERIFY(std::abs(Measured(window)[0].Value() - (90.0 + 180.0 / M_PI * std::atan2(20.0, 60.0))) < 1.0);
  QVERIFY(window.Part<QTableWidget>("measurements")->item(0, 2)->text().endsWith(QString::fromUtf8("°")));
}

void TestChecks::pointsOfMeasurementsAreDragged()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  const QPoint from = slice->rect().center() + QPoint(-50, 0), to = slice->rect().center() + QPoint(30, 0);
  const Measurement before = DragDistance(window, slice, from, to);
  QCOMPARE(before.points.size(), std::size_t(2));
  const int entries = window.Session()->GetUndoCount();
  window.Drag(slice, to + QPoint(2, 1), to + QPoint(2, 41));
  QCOMPARE(Measured(window).size(), std::size_t(1));
  QVERIFY(Measured(window)[0].points[0] == before.points[0]);
  const double mm = slice->View()->GetMillimetresPerPixel();
  QVERIFY(std::abs((Measured(window)[0].points[1] - before.points[1]).norm() - mm * std::hypot(2.0, 41.0)) < 1.5 * mm);
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QVERIFY(Measured(window)[0] == before);
  // Escape takes a drag back.
  window.Press(slice, to);
  window.Move(slice, to + QPoint(5, 25));
  QVERIFY(!(Measured(window)[0] == before));
  window.Key(Qt::Key_Escape);
  window.Release(slice, to + QPoint(5, 25));
  QVERIFY(Measured(window)[0] == before);
  // Away from the plane nothing is there to be taken: a new one begins.
  window.Wheel(slice, 12);
  window.Drag(slice, to, to + QPoint(0, 40));
  QCOMPARE(Measured(window).size(), std::size_t(2));
}

void TestChecks::whatWasMeasuredIsKept()
{
  const QStringList files{A(), B()};
  const QString project = Folder().filePath("measured.json");
  Measurement made;
  {
    WindowUnderTest window;
    QVERIFY(window.Open(files));
    made = DragDistance(window, window.Slice(2), window.Slice(2)->rect().center(),
                        window.Slice(2)->rect().center() + QPoint(30, 40));
    QVERIFY(window.Window().isWindowModified()); // closing asks
    QVERIFY(window.Session()->SaveProject(project.toUtf8()));
    window.Settle();
    QVERIFY(!window.Window().isWindowModified());
    // Removed by the key Delete in the list; undo brings it back.
    Raise(window, "checkPanel");
    auto* table = window.Part<QTableWidget>("measurements");
    table->setFocus();
    table->selectRow(0);
    window.Key(Qt::Key_Delete);
    QVERIFY(Measured(window).empty());
    QCOMPARE(table->rowCount(), 0);
    window.Slice(0)->setFocus();
    window.Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(table->rowCount(), 1);
  }
  WindowUnderTest window;
  QVERIFY(window.Open({project}));
  QCOMPARE(Measured(window).size(), std::size_t(1));
  QVERIFY(Measured(window)[0] == made);
}

// One anatomy twice, the second one moved by 4 mm: so are its grey levels along the line.
void TestChecks::theProfileShowsAShift()
{
  WindowUnderTest window;
  QVERIFY(window.Open({WriteVolume("one.mha", 1, {0, 0, 0}), WriteVolume("two.mha", 1, {0, 0, 0})}));
  Raise(window, "checkPanel");
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(4.0, 0.0, 0.0);
  SliceCanvas* slice = window.Slice(0);
  double cursor[3];
  slice->View()->GetCursor(cursor);
  const QPoint from = PositionAt(slice, {-15.0, cursor[1], cursor[2]}), to = PositionAt(slice, {15.0, cursor[1], cursor[2]});
  const Measurement made = DragDistance(window, slice, from, to);
  auto* plot = window.Part<ProfilePlot>("profile");
  QCOMPARE(plot->Curves().size(), 2);
  QVERIFY(std::abs(plot->LengthMm() - made.Value()) < 1e-9);
  const auto &one = plot->Curves()[0].values, &two = plot->Curves()[1].values;
  const double stepMm = plot->LengthMm() / static_cast<double>(one.size() - 1);
  double bestMm = 0.0, best = 1e300;
  for (int shift = -20; shift <= 20; ++shift) {
    double sum = 0.0;
    int count = 0;
    for (int i = 20; i < static_cast<int>(one.size()) - 20; ++i, ++count)
      sum += std::pow(one[static_cast<std::size_t>(i)] - two[static_cast<std::size_t>(i + shift)], 2);
    if (sum / count < best) {
      best = sum / count;
      bestMm = shift * stepMm;
    }
  }
  QVERIFY2(std::abs(bestMm - 4.0) <= stepMm, qPrintable(QString::number(bestMm)));
  // The mouse over the plot points at the place in all slices.
  window.Move(plot, QPoint(plot->width() / 2, plot->height() / 2));
  window.Move(plot, QPoint(plot->width() / 2 + 1, plot->height() / 2));
  QTest::qWait(100);
  QVERIFY(window.Window().Bench()->Pointer().has_value());
  for (int i : {0, 1, 2}) {
    const QPoint there = PositionAt(window.Slice(i), *window.Window().Bench()->Pointer());
    QVERIFY(PointerPixels(window, window.Slice(i), there, 14) >= 10);
  }
  window.Screenshot("profile");
  // Moved back, both curves are one.
  window.Session()->TranslateSelection(-4.0, 0.0, 0.0);
  window.Settle();
  for (std::size_t i = 0; i < plot->Curves()[0].values.size(); ++i)
    QVERIFY(std::abs(plot->Curves()[0].values[i] - plot->Curves()[1].values[i]) < 1e-6);
}

void TestChecks::flickerShowsBothSidesByTurns()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B(), WriteVolume("third.mha", 3, {-14, 0, 0})}));
  SliceCanvas* slice = window.Slice(0);
  window.Key(Qt::Key_1);
  Raise(window, "checkPanel");
  const QByteArray all = PictureOf(slice);
  // Two of the three, chosen in the panel.
  window.Part<QComboBox>("flickerOne")->setCurrentIndex(2);
  window.Part<QComboBox>("flickerOther")->setCurrentIndex(4);
  emit window.Part<QComboBox>("flickerOne")->activated(2);
  window.Type(window.Part<QDoubleSpinBox>("flickerRate"), "8");
  slice->setFocus();
  window.Key(Qt::Key_Space, Qt::ShiftModifier);
  QVERIFY(window.Window().Bench()->Flickering()->IsOn());
  QVERIFY(window.Part<QCheckBox>("flickers")->isChecked());
  QVector<QVector<int>> seen;
  QVector<QByteArray> pictures;
  QElapsedTimer clock;
  clock.start();
  while (clock.elapsed() < 2000) {
    const QVector<int> now = window.Window().Bench()->OnlyInSlices();
    if (seen.isEmpty() || seen.back() != now)
      seen.append(now);
    QTest::qWait(5);
    if (window.Window().Bench()->OnlyInSlices() == now && !pictures.contains(PictureOf(slice)))
      pictures.append(PictureOf(slice));
  }
  QVERIFY2(seen.size() >= 10 && seen.size() <= 18, qPrintable(QString::number(seen.size()))); // 16 changes
  for (int i = 1; i < seen.size(); ++i)
    QVERIFY(seen[i] != seen[i - 1] && seen[i] == (seen[i - 1] == QVector<int>{1} ? QVector<int>{3} : QVector<int>{1}));
  QVERIFY2(pictures.size() >= 2 && pictures.size() <= 3, qPrintable(QString::number(pictures.size()))); // and the one before
  // Off again: all are there as before, and nothing was an edit.
  window.Key(Qt::Key_Space, Qt::ShiftModifier);
  QTest::qWait(100);
  QVERIFY(!window.Window().Bench()->Flickering()->IsOn());
  QVERIFY(PictureOf(slice) == all);
  // Escape ends it as well.
  window.Key(Qt::Key_Space, Qt::ShiftModifier);
  window.Key(Qt::Key_Escape);
  QVERIFY(!window.Window().Bench()->Flickering()->IsOn());
  QVERIFY(!window.Session()->GetUndoLabel().empty());
  QCOMPARE(window.Session()->GetVisible(2), true);
}

void TestChecks::flickerEndsWhenSomethingIsDragged()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  window.Session()->SelectNone();
  window.Key(Qt::Key_Space, Qt::ShiftModifier);
  QVERIFY(!window.Window().Bench()->Flickering()->IsOn()); // there is nothing on one side
  QVERIFY(window.HasMessage("Flicker"));
  window.Session()->Select(2, true, true);
  window.Key(Qt::Key_Space, Qt::ShiftModifier);
  QVERIFY(window.Window().Bench()->Flickering()->IsOn());
  const auto before = window.Pose(2);
  const QPoint from = slice->rect().center() + QPoint(18, 34);
  window.Press(slice, from);
  window.Move(slice, from + QPoint(8, 0));
  window.Move(slice, from + QPoint(16, 0));
  QVERIFY(!window.Window().Bench()->Flickering()->IsOn());
  QVERIFY(window.Window().Bench()->OnlyInSlices().isEmpty());
  window.Release(slice, from + QPoint(16, 0));
  QVERIFY(window.Pose(2) != before);
}

// The anatomy twice, with a grain of its own each, 2 mm apart: the map says so, in colour and in numbers, and is stale once a
// volume has moved.
void TestChecks::disagreementIsFoundShownAndGoesStale()
{
  WindowUnderTest window;
  QVERIFY(window.Open({WriteVolume("one.mha", 1, {0, 0, 0}, 64), WriteVolume("two.mha", 2, {0, 0, 0}, 64)}));
  Raise(window, "checkPanel");
  window.Key(Qt::Key_1);
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(0.0, 2.0, 0.0);
  SliceCanvas* slice = window.Slice(0);
  slice->DrawNow();
  const QByteArray plain = PictureOf(slice);
  auto* button = window.Part<QPushButton>("findDisagreement");
  QTest::mouseClick(button, Qt::LeftButton);
  QVERIFY(!button->isEnabled());
  QVERIFY(window.Wait());
  QVERIFY(button->isEnabled());
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  slice->DrawNow();
  QVERIFY(PictureOf(slice) != plain);
  auto* text = window.Part<QLabel>("disagreementText");
  const QRegularExpressionMatch told =
      QRegularExpression("(\\d+) of (\\d+) blocks.*Median ([0-9.]+) mm, 95% below ([0-9.]+) mm").match(text->text());
  QVERIFY2(told.hasMatch(), qPrintable(text->text()));
  QVERIFY2(told.captured(1).toInt() > 40, qPrintable(text->text()));
  // Most of it is a shell, of which only the part across it is known: half of 2 mm in the mean, all of it at its poles.
  QVERIFY2(std::abs(told.captured(3).toDouble() - 1.0) < 0.4, qPrintable(text->text()));
  QVERIFY2(std::abs(told.captured(4).toDouble() - 2.0) < 0.3, qPrintable(text->text()));
  QVERIFY(!text->text().contains("Stale"));
  window.Screenshot("disagreement");
  // Under the mouse, with its error; somewhere on the way across the shell.
  bool isTold = false;
  for (int x = -90; x <= 90 && !isTold; x += 15) {
    window.Move(slice, slice->rect().center() + QPoint(x, 10));
    isTold = window.Part<QLabel>("disagreementHere")->text().contains(QString::fromUtf8("\u00b1"));
  }
  QVERIFY(isTold);
  // A move makes it stale, undo does not need to be told.
  const QByteArray coloured = PictureOf(slice);
  window.Session()->TranslateSelection(0.0, -1.0, 0.0);
  window.Settle();
  QVERIFY(text->text().contains("Stale"));
  QVERIFY(window.Window().Bench()->Shifts().isStale);
  window.Session()->Undo();
  window.Settle();
  QVERIFY(!text->text().contains("Stale"));
  slice->DrawNow();
  QVERIFY(PictureOf(slice) == coloured);
  // Off: the plain picture.
  window.Part<QCheckBox>("showDisagreement")->click();
  slice->DrawNow();
  QVERIFY(PictureOf(slice) == plain);
}

void TestChecks::pairsAreAGraphAndOneIsLookedAtAlone()
{
  WindowUnderTest window;
  QVERIFY(window.Open({WriteVolume("one.mha", 1, {0, 0, 0}, 64), WriteVolume("two.mha", 2, {8, 0, 0}, 64),
                       WriteVolume("three.mha", 3, {0, 9, 3}, 64)}));
  Raise(window, "registrationPanel");
  window.Part<QComboBox>("alignStart")->setCurrentText("tracked");
  QTest::mouseClick(window.Part<QPushButton>("alignAll"), Qt::LeftButton);
  QVERIFY(window.Wait());
  auto* graph = window.Part<PairGraph>("pairGraph");
  auto* table = window.Part<QTableWidget>("pairTable");
  QCOMPARE(graph->Nodes().size(), 3);
  QCOMPARE(graph->Edges().size(), 3);
  QCOMPARE(table->rowCount(), 3);
  for (const PairGraph::Edge& edge : graph->Edges()) {
    QVERIFY(edge.a != edge.b && edge.stands && !edge.votedDown);
    QVERIFY2(edge.errorMm > 0.0 && edge.errorMm < 3.0, qPrintable(QString::number(edge.errorMm)));
  }
  // What is drawn: the edge in the colour of its verdict.
  const QImage drawn = graph->grab().toImage();
  int green = 0;
  for (int y = 0; y < drawn.height(); ++y)
    for (int x = 0; x < drawn.width(); ++x)
      green += drawn.pixelColor(x, y) == PairGraph::ColourOf("aligned");
  QVERIFY2(green > 100, qPrintable(QString::number(green)));
  // A click on an edge shows its volumes alone, where they overlap, in slices and in 3D; nothing is an edit.
  const int entries = window.Session()->GetUndoCount();
  const int edge = 2;
  const QVector<int> pair{graph->Edges()[edge].a, graph->Edges()[edge].b};
  window.Click(graph, graph->MiddleOf(edge).toPoint());
  QCOMPARE(window.Window().Bench()->Only(), pair);
  QCOMPARE(graph->Chosen(), edge);
  QCOMPARE(table->currentRow(), edge);
  for (int i : {0, 1, 2}) {
    double focus[3];
    window.Slice(i)->View()->GetFocus(focus);
    for (int id : pair)
      QVERIFY(window.Session()->GetVoxelAt(id, focus) >= 0);
  }
  window.Screenshot("pair");
  auto* volumes = window.Window().Views()->Volume()->View();
  volumes->Update();
  const int particles = volumes->GetNumberOfParticles();
  // Again: all are back.
  window.Click(graph, graph->MiddleOf(edge).toPoint());
  QVERIFY(window.Window().Bench()->Only().isEmpty());
  QCOMPARE(graph->Chosen(), -1);
  QTRY_VERIFY(volumes->GetNumberOfParticles() > particles);
  QCOMPARE(window.Session()->GetUndoCount(), entries);
  // By keys, in the list; Escape brings all back, there and in a view.
  table->setFocus();
  table->setCurrentCell(0, 0);
  window.Key(Qt::Key_Down);
  QCOMPARE(window.Window().Bench()->Only(), (QVector<int>{graph->Edges()[1].a, graph->Edges()[1].b}));
  window.Key(Qt::Key_Escape);
  QVERIFY(window.Window().Bench()->Only().isEmpty());
  window.Click(table->viewport(), table->visualItemRect(table->item(0, 0)).center());
  QVERIFY(!window.Window().Bench()->Only().isEmpty());
  window.Click(table->viewport(), table->visualItemRect(table->item(0, 0)).center());
  QVERIFY(window.Window().Bench()->Only().isEmpty());
  window.Click(graph, graph->MiddleOf(0).toPoint());
  window.Slice(1)->setFocus();
  window.Key(Qt::Key_Escape);
  QVERIFY(window.Window().Bench()->Only().isEmpty());
  // A volume that goes takes its pairs along, and what was looked at alone with it gives way to all.
  window.Click(graph, graph->MiddleOf(2).toPoint());
  QVERIFY(window.Window().Bench()->Only().contains(3));
  window.Session()->RemoveVolume(3);
  window.Settle();
  QVERIFY(window.Window().Bench()->Only().isEmpty());
  QCOMPARE(graph->Edges().size(), 1);
  QCOMPARE(table->rowCount(), 1);
}

// Marked by clicks in two volumes, told apart in mm, and found again by the list.
void TestChecks::aLandmarkIsFoundAgain()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  Raise(window, "registrationPanel");
  window.Key(Qt::Key_6);
  SliceCanvas* slice = window.Slice(0);
  const QPoint here = slice->rect().center() + QPoint(20, -30);
  const Vector3d place = WorldAt(slice, here);
  window.Session()->Select(1, true, true);
  window.Click(slice, here);
  window.Session()->Select(2, true, true);
  window.Click(slice, here + QPoint(12, 0));
  auto* table = window.Part<QTableWidget>("landmarkTable");
  QCOMPARE(table->rowCount(), 1);
  const double mm = 12.0 * slice->View()->GetMillimetresPerPixel();
  QVERIFY(std::abs(table->item(0, 2)->text().split(' ')[0].toDouble() - mm) < 0.01 + 1e-6);
  window.Key(Qt::Key_F); // all of the volumes
  window.Wheel(slice, 5);
  table->setFocus();
  table->selectRow(0);
  window.Settle();
  double right[3];
  slice->View()->GetRight(right);
  const Vector3d middle = place + 0.5 * mm * Vector3d(right);
  for (int i : {0, 1, 2}) {
    Vector3d focus;
    window.Slice(i)->View()->GetFocus(focus.data());
    QVERIFY((focus - middle).norm() < 1e-6);
  }
}

void TestChecks::aClickIn3DSelectsAVolume()
{
  WindowUnderTest window;
  // Side by side, as seen from the front.
  QVERIFY(window.Open({WriteVolume("one.mha", 1, {-40, 0, 0}), WriteVolume("two.mha", 2, {40, 0, 0})}));
  VolumePane* pane = window.Window().Views()->Volume();
  vtkRenderer* renderer = pane->View()->GetRenderer();
  const auto at = [&](int id) {
    double middle[3], degrees[3];
    window.Session()->GetPlacement(id, middle, degrees);
    renderer->SetWorldPoint(middle[0], middle[1], middle[2], 1.0);
    renderer->WorldToDisplay();
    const double* place = renderer->GetDisplayPoint();
    return QPoint(static_cast<int>(place[0]), pane->Canvas()->height() - 1 - static_cast<int>(place[1]));
  };
  window.Session()->SelectNone();
  const auto click = [&](int id, Qt::KeyboardModifiers keys = {}) {
    window.Move(pane->Canvas(), at(id) + QPoint(9, 14));
    window.Press(pane->Canvas(), at(id) + QPoint(9, 14), Qt::LeftButton, keys);
    window.Release(pane->Canvas(), at(id) + QPoint(9, 14), Qt::LeftButton, keys);
    window.Settle();
  };
  for (const Qt::Key tool : {Qt::Key_1, Qt::Key_2}) {
    window.Session()->SelectNone();
    window.Key(tool);
    click(1);
    QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
    click(2);
    QVERIFY(!window.Session()->IsSelected(1) && window.Session()->IsSelected(2));
    click(1, Qt::ControlModifier);
    QVERIFY(window.Session()->IsSelected(1) && window.Session()->IsSelected(2));
    // A drag turns the view and selects nothing.
    window.Session()->Select(1, true, true);
    window.Drag(pane->Canvas(), QPoint(12, 12), QPoint(30, 20));
    QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
    QCOMPARE(window.Session()->GetUndoCount(), 2);
  }
  // Beside all volumes a click changes nothing.
  window.Click(pane->Canvas(), QPoint(8, 8));
  QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
}

void TestChecks::anObliquePlaneIsTyped()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  Raise(window, "viewPanel");
  auto* view = window.Slice(0)->View();
  const auto field = [&](const char* name) { return window.Part<QDoubleSpinBox>(name); };
  QVERIFY(std::abs(field("normalZ")->value() + 1.0) < 1e-9); // axial: seen from the feet
  window.Type(field("planeOffset"), "5.5");
  QCOMPARE(view->GetAxis(), std::string("z"));
  QVERIFY(std::abs(view->GetPosition() + 5.5) < 1e-9);
  window.Type(field("normalX"), "0.6");
  QCOMPARE(view->GetAxis(), std::string("oblique"));
  Vector3d normal, focus;
  view->GetNormal(normal.data());
  QVERIFY2((normal - Vector3d(0.6, 0.0, -1.0).normalized()).norm() < 1e-3, qPrintable(QString::number(normal.x())));
  view->GetFocus(focus.data());
  QVERIFY(std::abs(focus.dot(normal) - 5.5) < 0.01);
  // In step with the mouse, and with the choice of the slice.
  window.Drag(window.Slice(0), window.Slice(0)->rect().center(), window.Slice(0)->rect().center() + QPoint(30, 20),
              Qt::MiddleButton, Qt::ShiftModifier);
  Vector3d turned;
  view->GetNormal(turned.data());
  QVERIFY((turned - normal).norm() > 0.1);
  const char* const names[] = {"normalX", "normalY", "normalZ"};
  for (int axis = 0; axis < 3; ++axis)
    QVERIFY(std::abs(field(names[axis])->value() - turned[axis]) < 1e-4);
  auto* which = window.Part<QComboBox>("obliqueIn");
  which->setFocus();
  window.Key(Qt::Key_Down);
  QCOMPARE(which->currentIndex(), 1);
  window.Slice(1)->View()->GetNormal(normal.data());
  for (int axis = 0; axis < 3; ++axis)
    QVERIFY(std::abs(field(names[axis])->value() - normal[axis]) < 1e-4);
  // No direction: said, and nothing changes.
  window.Type(field("normalY"), "0");
  QVERIFY(window.HasMessage("normal"));
  Vector3d after;
  window.Slice(1)->View()->GetNormal(after.data());
  QVERIFY(after == normal);
  QVERIFY(std::abs(field("normalY")->value() - normal.y()) < 1e-4);
}

// Two volumes of a liver, one moved by 2 mm: where they disagree, and a profile.
void TestChecks::thePictureOfTheManual()
{
  const QDir liver(ECHORAMA_SOURCE_DIR "/../shared/data/liver");
  if (!liver.exists("liver_volume_A.mha"))
    QSKIP("the liver pair is not there");
  WindowUnderTest window;
  QVERIFY(window.Open({liver.filePath("liver_volume_A.mha"), liver.filePath("liver_volume_B.mha")}));
  Raise(window, "checkPanel");
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(2.0, 0.0, 0.0);
  SliceCanvas* slice = window.Slice(1);
  DragDistance(window, slice, slice->rect().center() + QPoint(-60, -20), slice->rect().center() + QPoint(60, -20));
  QTest::mouseClick(window.Part<QPushButton>("findDisagreement"), Qt::LeftButton);
  QVERIFY(window.Wait());
  window.Key(Qt::Key_1);
  window.Move(window.Part<QWidget>("volumes"), QPoint(40, 140));
  ComparePicture(window.Screenshot("workbench-check"), "workbench-check");
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestChecks test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestChecks.moc"
