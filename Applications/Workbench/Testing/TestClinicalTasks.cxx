// SPDX-License-Identifier: BSD-3-Clause
// The twelve tasks of Documentation/clinical-tasks.md, step by step as they stand there, in a small window or, with
// ECHORAMA_LARGE_WINDOW, in a large one. Hands
// find controls by what is written on them and only where they can be seen; eyes find things in what slices show. What is asked
// is what came of it, beside the truth of the samples. The pictures of that page are made here.
#include "Core/Geometry/ProbeGeometry.h"
#include "DisagreementBox.h"
#include "Filters/Phantoms/Phantom.h"
#include "MeasureTool.h"
#include "Samples.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "vtkUltrasoundSliceView.h"
#include "Widgets/Session/LiveScore.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QAbstractButton>
#include <QApplication>
#include <QDockWidget>
#include <QFileDialog>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QMenuBar>
#include <QProcess>
#include <QRegularExpression>
#include <QScrollArea>
#include <QSet>
#include <QTabBar>
#include <QTableView>
#include <QTableWidget>
#include <QTemporaryDir>
#include <QToolButton>
#include <QtTest>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

enum View { Axial, Coronal, Sagittal };

std::vector<double> Values(vtkDataArray* array)
{
  std::vector<double> values(static_cast<std::size_t>(array->GetNumberOfTuples()));
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = array->GetComponent(static_cast<vtkIdType>(i), 0);
  return values;
}

std::vector<double> GreysOf(vtkImageData* image)
{
  return Values(vtkUltrasoundVolume::GetIntensity(image));
}

std::vector<double> ValidOf(vtkImageData* image)
{
  return Values(vtkUltrasoundVolume::GetValidRegion(image));
}

Vector3d PlaceOf(vtkImageData* image, std::size_t voxel)
{
  Vector3d place;
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image);
  const auto nx = static_cast<std::size_t>(geometry.dimensions[0]), ny = static_cast<std::size_t>(geometry.dimensions[1]);
  return geometry.IndexToWorld() *
         Vector3d(static_cast<double>(voxel % nx), static_cast<double>(voxel / nx % ny), static_cast<double>(voxel / nx / ny));
}

/// Somebody at the workbench who has the page and nothing else.
class Reader : public WindowUnderTest {
public:
  Reader()
  {
    Window().resize(IsLarge() ? QSize(1920, 1200) : QSize(1280, 800));
    Window().Start({}, {}); // with backups
    Settle();
  }

  ///@{ Controls by what is written on them. They say why when that is not possible.
  bool Press(const char* where, const QString& label, Qt::KeyboardModifiers keys = {})
  {
    used_ << label;
    for (auto* button : Place(where)->findChildren<QAbstractButton*>())
      if (Plain(button->text()) == label && button->isVisible())
        return ClickOn(button, button->inherits("QCheckBox") ? QPoint(8, button->height() / 2) : button->rect().center(), keys);
    qWarning("there is no button %s in %s", qPrintable(label), where);
    return false;
  }
  bool GoTo(const QString& panel)
  {
    used_ << panel;
    for (auto* tabs : Window().findChildren<QTabBar*>())
      for (int i = 0; i < tabs->count(); ++i)
        if (tabs->isVisible() && tabs->tabText(i) == panel)
          return ClickOn(tabs, tabs->tabRect(i).center());
    qWarning("there is no panel %s", qPrintable(panel));
    return false;
  }
  bool Choose(const QString& menu, const QString& entry)
  {
    used_ << menu << entry;
    QMenuBar* bar = Window().menuBar();
    for (QAction* title : bar->actions())
      if (Plain(title->text()) == menu)
        QTest::mouseClick(bar, Qt::LeftButton, {}, bar->actionGeometry(title).center());
    auto* popup = qobject_cast<QMenu*>(QApplication::activePopupWidget());
    if (popup)
      for (QAction* action : popup->actions())
        if (Plain(action->text()) == entry && action->isEnabled()) {
          QTest::mouseClick(popup, Qt::LeftButton, {}, popup->actionGeometry(action).center());
          Settle();
          return true;
        }
    qWarning("there is no %s in the menu %s", qPrintable(entry), qPrintable(menu));
    return false;
  }
  bool Fill(const char* where, const QString& label, const QString& text)
  {
    used_ << label;
    for (auto* form : Place(where)->findChildren<QFormLayout*>())
      for (int row = 0; row < form->rowCount(); ++row) {
        QLayoutItem *name = form->itemAt(row, QFormLayout::LabelRole), *field = form->itemAt(row, QFormLayout::FieldRole);
        auto* title = name ? qobject_cast<QLabel*>(name->widget()) : nullptr;
        if (!title || Plain(title->text()) != label || !field || !field->widget())
          continue;
        if (!ClickOn(field->widget(), QPoint(12, field->widget()->height() / 2)))
          return false;
        Type(field->widget(), text);
        return true;
      }
    qWarning("there is no field %s in %s", qPrintable(label), where);
    return false;
  }
  void CloseMessage(const QString& beginning)
  {
    for (auto* text : Window().findChildren<QLabel*>("messageText"))
      if (text->isVisible() && text->text().startsWith(beginning))
        ClickOn(text->parentWidget()->findChild<QToolButton*>("messageClose"), QPoint(4, 4));
  }
  /// Types a path into the dialog that is open.
  bool Name(const char* dialogName, const QString& path)
  {
    if (!QTest::qWaitFor([&] { return Window().findChild<QFileDialog*>(dialogName) != nullptr; }))
      return false;
    auto* dialog = Part<QFileDialog>(dialogName);
    auto* field = dialog->findChild<QLineEdit*>();
    QTest::keyClick(field, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(field, path);
    QTest::keyClick(field, Qt::Key_Return);
    const bool isGone = QTest::qWaitFor([&] { return Window().findChild<QFileDialog*>(dialogName) == nullptr; });
    QApplication::setActiveWindow(&Window()); // no window manager does it
    return isGone && Wait();
  }
  bool Pick(const QString& volume, Qt::KeyboardModifiers keys = {})
  {
    used_ << volume;
    auto* table = Part<QTableView>("volumes");
    for (int row = 0; row < table->model()->rowCount(); ++row)
      if (const QModelIndex index = table->model()->index(row, 2); index.data() == volume)
        return ClickOn(table->viewport(), table->visualRect(index).center(), keys);
    return false;
  }
  ///@}

  /// All that was named so far, by any reader.
  static QSet<QString> Used() { return used_; }

  bool OpenSample(const QString& label)
  {
    return Press("emptyPage", label) && Wait() && QTest::qWaitFor([this] { return Session()->HasTruth(); });
  }

  ///@{ What eyes see in a slice.
  Vector3d WorldAt(View view, const QPoint& position)
  {
    const QPointF pixel = Slice(view)->PixelOf(position);
    Vector3d world;
    Slice(view)->View()->PixelToWorld(pixel.x(), pixel.y(), world.data());
    return world;
  }
  QPoint At(View view, const Vector3d& world)
  {
    double pixel[2];
    Slice(view)->View()->WorldToPixel(world.x(), world.y(), world.z(), pixel);
    return Slice(view)->PositionOf({pixel[0], pixel[1]}).toPoint();
  }
  double MmPerPixel(View view) { return Slice(view)->View()->GetMillimetresPerPixel(); }
  /// The middle of the brightest spot within so many mm of a place.
  QPoint BrightSpot(View view, const Vector3d& near, double reachMm)
  {
    Slice(view)->DrawNow();
    const QPoint at = At(view, near);
    const int reach = static_cast<int>(reachMm / MmPerPixel(view));
    vtkImageData* picture = Slice(view)->View()->GetPicture();
    const auto brightness = [&](const QPoint& position) {
      const QPoint pixel = Slice(view)->PixelOf(position).toPoint();
      int size[3];
      picture->GetDimensions(size);
      double sum = 0.0;
      for (int part = 0; part < 3; ++part)
        sum += picture->GetScalarComponentAsDouble(std::clamp(pixel.x(), 0, size[0] - 1), std::clamp(pixel.y(), 0, size[1] - 1),
                                                   0, part);
      return sum;
    };
    double most = 0.0, weight = 0.0;
    QPointF middle;
    for (int pass = 0; pass < 2; ++pass)
      for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x) {
          const double here = brightness(at + QPoint(x, y));
          if (pass == 0)
            most = std::max(most, here);
          else if (here > 0.9 * most) {
            middle += QPointF(at + QPoint(x, y));
            weight += 1.0;
          }
        }
    return (middle / weight).toPoint();
  }
  ///@}

  /// Turns the wheel until a view shows a place.
  void WheelTo(View view, const Vector3d& place)
  {
    for (int i = 0; i < 200; ++i) {
      const SliceFrame& frame = Slice(view)->View()->GetFrame();
      const double depth = frame.DepthOf(place), step = Window().Bench()->SmallestSpacing();
      if (std::abs(depth) <= 0.51 * step)
        return;
      const double before = std::abs(depth);
      Wheel(Slice(view), wheelSign_);
      if (std::abs(Slice(view)->View()->GetFrame().DepthOf(place)) > before)
        wheelSign_ = -wheelSign_;
    }
  }
  void Drag(View view, const QPoint& from, const QPoint& to, Qt::MouseButton button = Qt::LeftButton)
  {
    WindowHands::Drag(Slice(view), from, to, button);
  }
  /// A drag of the selected volume, beside its handles, that ends so far beside where it should, mm.
  void DragInto(View view, int id, const Vector3d& wrongBy)
  {
    const SessionVolume& volume = *Session()->GetKernel().State().Find(id);
    const Vector3d middle = volume.volumeToWorld * volume.geometry.Centre();
    const Vector3d wanted = *Session()->GetTruthOf(id) * volume.geometry.Centre() + wrongBy;
    const QPoint hand = At(view, middle) + QPoint(-34, 26);
    Drag(view, hand, hand + At(view, wanted) - At(view, middle));
  }
  /// By the wheel over the panel.
  void ScrollTo(QWidget* part, const QPoint& at)
  {
    for (QWidget* above = part->parentWidget(); above; above = above->parentWidget())
      if (auto* area = qobject_cast<QScrollArea*>(above)) {
        const auto isSeen = [&] { return area->viewport()->rect().contains(part->mapTo(area->viewport(), at)); };
        for (int i = 0; i < 60 && !isSeen(); ++i)
          Wheel(area->viewport(), part->mapTo(area->viewport(), at).y() < 0 ? 1 : -1);
      }
  }
  double Score() const { return Session()->GetScore(); }
  vtkImageData* Image(int id) const { return Session()->GetImage(id); }
  QString Text(const char* label) { return Part<QLabel>(label)->text(); }

  /// The picture of a task, in the size that the page has. Of what the program says only \a message is in it: notes go after
  /// some seconds, and whether that long has passed is not the same on all machines.
  void Show(const QString& name, const QString& message = {})
  {
    for (const QString& text : Messages())
      if (message.isEmpty() || !text.startsWith(message))
        CloseMessage(text);
    if (IsLarge())
      Grab(name + "-large");
    else
      ComparePicture(Screenshot(name), name);
  }

private:
  static bool IsLarge() { return qEnvironmentVariableIsSet("ECHORAMA_LARGE_WINDOW"); }
  static QString Plain(QString text) { return text.remove('&'); }
  QWidget* Place(const char* name)
  {
    for (auto* dock : Window().findChildren<QDockWidget*>())
      if (dock->windowTitle() == name)
        return dock;
    return Part<QWidget>(name);
  }
  // A click where the part can be seen.
  bool ClickOn(QWidget* part, const QPoint& at, Qt::KeyboardModifiers keys = {})
  {
    ScrollTo(part, at);
    const QPoint place = part->mapTo(&Window(), at);
    QWidget* there = Window().childAt(place);
    if (!there || (there != part && !part->isAncestorOf(there)) || !part->isEnabled()) {
      qWarning("%s cannot be clicked", qPrintable(part->objectName()));
      return false;
    }
    QTest::mouseMove(Window().windowHandle(), place);
    QTest::mouseClick(Window().windowHandle(), Qt::LeftButton, keys, place);
    Settle();
    return true;
  }

  int wheelSign_ = 1;
  inline static QSet<QString> used_;
};

/// What a sample was made of, for the truth of it.
struct Made {
  vtkNew<vtkUltrasoundPhantomSource> source;
  std::vector<Vector3d> clips; ///< where slices are at first

  explicit Made(vtkImageData* image)
  {
    const PhantomScene scene = PhantomFromJson(*vtkUltrasoundAcquisition::SceneOf(image));
    const Vector3d middle = BoxAround(source->Phantom().probe).center();
    for (const Inclusion& body : scene.inclusions)
      if (body.name == "clip")
        clips.push_back(std::get<Ellipsoid>(body.shape).centre - middle);
    source->SetScene(PhantomToJson(scene).c_str());
  }
};

} // namespace

class TestClinicalTasks : public WindowTest {
  Q_OBJECT

private slots:
  void initTestCase() { qputenv("TZ", "UTC"); }
  void lookThroughAVolume();
  void bringTwoFarVolumesTogether();
  void showPlacesAndTakeAMistakeBack();
  void findTheWrongPair();
  void aCaseFromShadowToColleague();
  void runAnExercise();
  void whatWasUsedIsOnThePage();

protected:
  // Samples are made once for all, and the guide is there as for anybody who comes for the first time.
  void init() override
  {
    FolderTest::init();
    QVERIFY(Folder().mkpath("data/echorama"));
    QVERIFY(QFile::link(samples_.path(), Folder().filePath("data/echorama/samples")));
  }

private:
  void Carve(Reader& hand);
  void Stitch(Reader& hand);
  void Measure(Reader& hand);
  void Embed(Reader& hand);
  void Paint(Reader& hand);
  void HandOver(Reader& hand);

  QTemporaryDir samples_;
  double expectedMm_ = 0.0;         ///< from clip to clip
  std::vector<std::size_t> shadow_; ///< voxels of the first volume
  std::vector<double> clean_;       ///< the first volume without it
};

// Task 1.
void TestClinicalTasks::lookThroughAVolume()
{
  Reader hand;
  QVERIFY(hand.OpenSample("Two volumes"));
  SliceCanvas* coronal = hand.Slice(Coronal);
  const QPoint middle = coronal->rect().center();
  QVERIFY(hand.Press("toolBar", "Look"));
  // One place in all views, and its grey levels below.
  const QPoint here = middle + QPoint(-25, 15);
  const Vector3d place = hand.WorldAt(Coronal, here);
  hand.Click(coronal, here);
  for (View view : {Axial, Sagittal}) {
    QVERIFY(std::abs(hand.Slice(view)->View()->GetFrame().DepthOf(place)) < 1e-6);
  }
  hand.Move(coronal, here + QPoint(1, 0));
  QVERIFY2(hand.Text("readout").contains("volume_1") && hand.Text("readout").contains("mm"), qPrintable(hand.Text("readout")));
  hand.Show("task-01-look");
  // Through the slices, and fast.
  coronal->DrawNow();
  const double before = coronal->View()->GetPosition();
  hand.Move(coronal, middle);
  hand.Wheel(coronal, 5);
  QCOMPARE(std::abs(coronal->View()->GetPosition() - before), 5.0);
  hand.Wheel(coronal, 1, Qt::ShiftModifier);
  QCOMPARE(std::abs(coronal->View()->GetPosition() - before), 15.0);
  // Nearer, and aside.
  const double mm = hand.MmPerPixel(Coronal);
  hand.Wheel(coronal, 3, Qt::ControlModifier);
  QVERIFY(std::abs(hand.MmPerPixel(Coronal) - mm / std::pow(1.2, 3)) < 1e-9);
  const Vector3d seen = hand.WorldAt(Coronal, middle);
  hand.Drag(Coronal, middle, middle + QPoint(40, 20), Qt::MiddleButton);
  QVERIFY((hand.WorldAt(Coronal, middle + QPoint(40, 20)) - seen).norm() < 1e-6);
  // Brighter: the window of grey levels goes down.
  double greys[2], now[2];
  hand.Session()->GetGreyWindow(greys);
  hand.Drag(Coronal, middle, middle + QPoint(0, -40), Qt::RightButton);
  hand.Session()->GetGreyWindow(now);
  QVERIFY(now[1] < greys[1] - 5.0);
  hand.Key(Qt::Key_G);
  hand.Session()->GetGreyWindow(now);
  QVERIFY(now[0] == greys[0] && now[1] == greys[1]);
  hand.Drag(Coronal, middle, middle + QPoint(30, 40), Qt::RightButton);
  QTest::mouseDClick(coronal, Qt::RightButton, {}, middle);
  hand.Settle();
  hand.Session()->GetGreyWindow(now);
  QVERIFY(now[0] == greys[0] && now[1] == greys[1]);
  // Large, and back; all is seen again.
  QTest::mouseDClick(coronal, Qt::LeftButton, {}, here);
  hand.Settle();
  QVERIFY(coronal->isVisible() && !hand.Slice(Axial)->isVisible());
  QTest::mouseDClick(coronal, Qt::LeftButton, {}, here);
  hand.Settle();
  QVERIFY(hand.Slice(Axial)->isVisible());
  hand.Key(Qt::Key_F);
  QVERIFY(hand.MmPerPixel(Coronal) > 0.8 * mm);
  QCOMPARE(hand.Session()->GetKernel().State().volumes[1].volumeToWorld.matrix(),
           Pose::Identity().matrix()); // looking moved nothing
}

// Task 2.
void TestClinicalTasks::bringTwoFarVolumesTogether()
{
  Reader hand;
  QVERIFY(hand.OpenSample("Two far apart"));
  QVERIFY2(std::abs(hand.Score() - 70.0) < 3.0, qPrintable(QString::number(hand.Score())));
  QCOMPARE(hand.Text("scoreReadout"), QString("%1 mm").arg(hand.Score(), 0, 'f', 2));
  // By eye alone, in two views: some millimetres beside, and as turned as it was.
  hand.DragInto(Axial, 2, {4.0, -5.0, 0.0});
  hand.DragInto(Sagittal, 2, {0.0, -5.0, 4.0});
  QVERIFY2(hand.Score() < 15.0, qPrintable(QString::number(hand.Score())));
  hand.Show("task-02-far");
  hand.Key(Qt::Key_R);
  QVERIFY(hand.Wait());
  QVERIFY2(hand.HasMessage("Refine: done, 1 moved"), qPrintable(hand.Messages().join('\n')));
  QVERIFY2(hand.Score() < 0.5, qPrintable(QString::number(hand.Score())));
}

// Tasks 3 and 4.
void TestClinicalTasks::showPlacesAndTakeAMistakeBack()
{
  Reader hand;
  auto* session = hand.Session();
  QVERIFY(hand.OpenSample("Two far apart"));
  const Made made(hand.Image(1));
  QCOMPARE(made.clips.size(), std::size_t(3));
  QVERIFY(hand.Press("toolBar", "Mark"));
  for (const int id : {1, 2}) {
    QVERIFY(hand.Pick(QString("volume_%1").arg(id)));
    hand.Slice(Axial)->setFocus();
    hand.Key(Qt::Key_S);
    for (const Vector3d& clip : made.clips) {
      const Vector3d there = session->GetTruthOf(id)->inverse() * clip; // where this volume shows it
      hand.WheelTo(Axial, there);
      hand.Click(hand.Slice(Axial), hand.BrightSpot(Axial, there, 5.0));
    }
    QCOMPARE(session->GetNumberOfLandmarks(id), 3);
    for (int i = 0; i < 3; ++i) {
      Vector3d place = Vector3d::Zero();
      QVERIFY(session->GetLandmark(id, std::to_string(i + 1).c_str(), place.data()));
      QVERIFY((place - session->GetTruthOf(id)->inverse() * made.clips[static_cast<std::size_t>(i)]).norm() < 3.0);
    }
  }
  hand.Key(Qt::Key_A);
  QVERIFY(hand.GoTo("Align"));
  auto* list = hand.Part<QTableWidget>("landmarkTable");
  QCOMPARE(list->rowCount(), 3);
  for (int row = 0; row < 3; ++row)
    QVERIFY(list->item(row, 2)->text().split(' ')[0].toDouble() > 50.0);
  hand.ScrollTo(list, QPoint(10, list->height() + 30));
  hand.Show("task-03-places");
  QVERIFY(hand.Press("Align", "Align all"));
  QVERIFY(hand.Wait());
  QVERIFY2(hand.HasMessage("done, 1 moved"), qPrintable(hand.Messages().join('\n')));
  QVERIFY2(hand.Score() < 0.5, qPrintable(QString::number(hand.Score())));
  for (int row = 0; row < 3; ++row)
    QVERIFY(list->item(row, 2)->text().split(' ')[0].toDouble() < 3.0);

  // Task 4: a mistake, and another one; back by one step, and back to what it was after the alignment.
  const auto right = hand.Pose(2);
  QVERIFY(hand.Press("toolBar", "Align"));
  hand.Slice(Axial)->setFocus();
  hand.Key(Qt::Key_F);
  hand.DragInto(Axial, 2, {40.0, 0.0, 0.0});
  const auto wrong = hand.Pose(2);
  hand.Key(Qt::Key_Up, Qt::ControlModifier);
  QVERIFY(hand.Pose(2) != wrong && wrong != right);
  hand.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(hand.Pose(2), wrong);
  QVERIFY(hand.GoTo("History"));
  auto* backups = hand.Part<QListWidget>("backups");
  const auto refined = [backups] { return backups->findItems("Align all", Qt::MatchContains); };
  QTRY_VERIFY(!refined().isEmpty() && !backups->findItems("Undo:", Qt::MatchContains).isEmpty()); // the last of them
  hand.Show("task-04-back");
  hand.Click(backups->viewport(), backups->visualItemRect(refined().first()).center());
  QCOMPARE(hand.Pose(2), right);
  hand.Key(Qt::Key_Z, Qt::ControlModifier); // and even that
  QCOMPARE(hand.Pose(2), wrong);
}

// Task 5.
void TestClinicalTasks::findTheWrongPair()
{
  Reader hand;
  QVERIFY(hand.OpenSample("Five pairs, one wrong"));
  const double before = hand.Score();
  QVERIFY(hand.GoTo("Check"));
  QVERIFY(hand.Press("Check", "Find disagreement"));
  QVERIFY(hand.Wait());
  QVERIFY(hand.Press("toolBar", "Look"));
  // The mouse goes over the view; what is told of more than 2 mm is of one pair.
  QMap<QString, QPoint> told;
  const QRegularExpression line("Under the mouse: ([0-9.]+) . [0-9.]+ mm, (volume_. and volume_.)");
  const auto sweep = [&] {
    told.clear();
    const QSize all = hand.Slice(Coronal)->size();
    for (int y = all.height() / 4; y < all.height() * 3 / 4; y += all.height() / 30)
      for (int x = 0; x < all.width(); x += all.width() / 24) {
        hand.Move(hand.Slice(Coronal), {x, y});
        const auto match = line.match(hand.Text("disagreementHere"));
        if (match.hasMatch() && match.captured(1).toDouble() > 2.0)
          told[match.captured(2)] = {x, y};
      }
  };
  sweep();
  QVERIFY2(told.keys() == QStringList("volume_3 and volume_4"), qPrintable(told.keys().join("; ")));
  hand.Move(hand.Slice(Coronal), told.first());
  auto* here = hand.Part<QLabel>("disagreementHere");
  QVERIFY2(!here->visibleRegion().isEmpty() && here->visibleRegion().boundingRect().height() == here->height(),
           "what is told can be read without scrolling");
  hand.Show("task-05-pair");
  // Mended: the three that belong together go where the others are.
  QVERIFY(hand.Pick("volume_4") && hand.Pick("volume_6", Qt::ShiftModifier));
  QCOMPARE(hand.Session()->GetNumberOfSelected(), 3);
  QVERIFY(hand.Press("toolBar", "Align"));
  SliceCanvas* coronal = hand.Slice(Coronal);
  hand.Move(coronal, QPoint(20, coronal->height() - 20));
  coronal->setFocus();
  // Step by step, and a step back when it was one too many.
  const std::pair<Qt::Key, Qt::Key> ways[] = {
      {Qt::Key_Left, Qt::Key_Right}, {Qt::Key_Up, Qt::Key_Down}, {Qt::Key_PageUp, Qt::Key_PageDown}};
  for (const auto& [there, back] : ways)
    for (const auto& [key, opposite] : {std::pair(there, back), std::pair(back, there)})
      for (double last = hand.Score();; last = hand.Score()) {
        hand.Key(key);
        if (hand.Score() < last)
          continue;
        hand.Key(opposite);
        break;
      }
  qInfo("%g mm before, %g mm after", before, hand.Score());
  QVERIFY(before > 2.0 && hand.Score() < 0.6);
  QVERIFY(hand.Press("Check", "Find disagreement"));
  QVERIFY(hand.Wait());
  sweep();
  QVERIFY(told.isEmpty());
}

// Tasks 6 to 11: one case.
void TestClinicalTasks::aCaseFromShadowToColleague()
{
  Reader hand;
  for (const auto& task : {&TestClinicalTasks::Carve, &TestClinicalTasks::Stitch, &TestClinicalTasks::Measure,
                           &TestClinicalTasks::Embed, &TestClinicalTasks::Paint, &TestClinicalTasks::HandOver}) {
    (this->*task)(hand);
    if (QTest::currentTestFailed())
      return;
  }
}

// Task 6.
void TestClinicalTasks::Carve(Reader& hand)
{
  QVERIFY(hand.OpenSample("Stone with a shadow"));
  hand.Key(Qt::Key_R);
  QVERIFY(hand.Wait());
  QVERIFY2(hand.Score() < 0.5, qPrintable(QString::number(hand.Score())));
  // The truth: the same volume of the same body without shadows.
  const std::vector<double> shown = GreysOf(hand.Image(1));
  if (clean_.empty()) {
    Made made(hand.Image(1));
    QCOMPARE(made.clips.size(), std::size_t(2));
    expectedMm_ = (made.clips[1] - made.clips[0]).norm();
    made.source->SetSeed(7);
    made.source->SetShadows(false);
    vtkNew<vtkMatrix4x4> probe;
    QVERIFY(vtkUltrasoundAcquisition::GetProbeToWorld(hand.Image(1), probe));
    for (int axis = 0; axis < 3; ++axis)
      probe->SetElement(axis, 3, probe->GetElement(axis, 3) + BoxAround(made.source->Phantom().probe).center()[axis]);
    made.source->SetProbeToWorld(probe);
    made.source->Update();
    clean_ = GreysOf(made.source->GetOutput());
    QCOMPARE(clean_.size(), shown.size());
    for (std::size_t i = 0; i < shown.size(); ++i)
      if (clean_[i] - shown[i] > 60.0)
        shadow_.push_back(i);
  }
  QVERIFY2(shadow_.size() > 3000, qPrintable(QString::number(shadow_.size())));
  // Seen in the coronal view: where it begins, its middle and its end.
  std::vector<std::pair<double, Vector3d>> along;
  for (const std::size_t i : shadow_) {
    const Vector3d place = PlaceOf(hand.Image(1), i);
    along.push_back({place.z(), place});
  }
  std::sort(along.begin(), along.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const double low = along[along.size() / 100].first, high = along.back().first;
  const auto middleAt = [&](double z) {
    Vector3d sum = Vector3d::Zero();
    int count = 0;
    for (const auto& [height, place] : along)
      if (std::abs(height - z) < 2.0) {
        sum += place;
        ++count;
      }
    return Vector3d(sum / count);
  };
  QVERIFY(hand.Pick("volume_1"));
  hand.Slice(Coronal)->setFocus();
  hand.Key(Qt::Key_S);
  QVERIFY(hand.Press("toolBar", "Carve"));
  QVERIFY(hand.GoTo("Brush"));
  // Narrow near the stone, wide at its end.
  const double half = 0.5 * (low + high);
  QVERIFY(hand.Fill("Brush", "Radius", "8"));
  hand.Drag(Coronal, hand.At(Coronal, middleAt(low + 1.0)), hand.At(Coronal, middleAt(half)));
  hand.Show("task-06-carve");
  QVERIFY(hand.Fill("Brush", "Radius", "10"));
  hand.Drag(Coronal, hand.At(Coronal, middleAt(half)), hand.At(Coronal, middleAt(high - 2.0)));
  const std::vector<double> valid = ValidOf(hand.Image(1));
  std::size_t left = 0, gone = 0, beside = 0;
  for (const std::size_t i : shadow_)
    left += valid[i] != 0.0;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (valid[i] != 0.0 || shown[i] == 0.0)
      continue;
    ++gone;
    const Vector3d place = PlaceOf(hand.Image(1), i);
    beside += std::none_of(shadow_.begin(), shadow_.end(),
                           [&](std::size_t s) { return (PlaceOf(hand.Image(1), s) - place).squaredNorm() < 25.0; });
  }
  qInfo("of %zu voxels in the shadow %zu are left; %zu are gone, %zu of them farther than 5 mm from it", shadow_.size(), left,
        gone, beside);
  QVERIFY(left < shadow_.size() / 50);
  QVERIFY(beside == 0);
  hand.Slice(Coronal)->setFocus();
  hand.Key(Qt::Key_A);
}

// Task 7.
void TestClinicalTasks::Stitch(Reader& hand)
{
  QVERIFY(hand.GoTo("Stitch"));
  QVERIFY(hand.Press("Stitch", "Make"));
  QVERIFY(hand.Wait());
  auto* session = hand.Session();
  QCOMPARE(session->GetNumberOfVolumes(), 3);
  QVERIFY(session->IsResult(3) && session->GetVisible(3) && !session->GetVisible(1) && !session->GetVisible(2));
  // Where the shadow was there is tissue as bright as it would have been seen without the stone.
  const std::vector<double> greys = GreysOf(hand.Image(3));
  double is = 0.0, should = 0.0, was = 0.0;
  const std::vector<double> shown = GreysOf(hand.Image(1));
  int count = 0;
  for (const std::size_t i : shadow_) {
    const Vector3d place = PlaceOf(hand.Image(1), i);
    const vtkIdType voxel = session->GetVoxelAt(3, place.data());
    if (voxel < 0)
      continue;
    is += greys[static_cast<std::size_t>(voxel)];
    should += clean_[i];
    was += shown[i];
    ++count;
  }
  qInfo("%d of %zu voxels of the shadow are filled: %g, without the stone %g, before %g", count, shadow_.size(), is / count,
        should / count, was / count);
  QVERIFY(count > 0.8 * static_cast<double>(shadow_.size())); // the second volume does not see what is close behind the stone
  QVERIFY(std::abs(is - should) < 0.15 * should && was < 0.5 * should);
  hand.Show("task-07-stitch");
  hand.Key(Qt::Key_T);
  QVERIFY(!session->GetVisible(3) && session->GetVisible(1));
  hand.Key(Qt::Key_T);
  QVERIFY(session->GetVisible(3) && !session->GetVisible(1));
}

// Task 8.
void TestClinicalTasks::Measure(Reader& hand)
{
  const Made made(hand.Image(1));
  QVERIFY(hand.GoTo("Check"));
  QVERIFY(hand.Press("toolBar", "Measure"));
  for (const Vector3d& clip : made.clips) {
    const QPoint at = hand.BrightSpot(Coronal, clip, 6.0);
    hand.Move(hand.Slice(Coronal), at);
    hand.Click(hand.Slice(Coronal), at);
  }
  auto* list = hand.Part<QTableWidget>("measurements");
  QCOMPARE(list->rowCount(), 1);
  const double measured = list->item(0, 2)->text().split(' ')[0].toDouble();
  qInfo("measured %g mm of %g mm", measured, expectedMm_);
  QVERIFY(std::abs(measured - expectedMm_) < 1.5);
  // Its ends are in one volume each: what is measured goes across the seam.
  const auto& points = hand.Session()->GetKernel().State().measurements[0].points;
  for (const int id : {1, 2}) {
    const auto end = static_cast<std::size_t>(id - 1);
    QVERIFY(hand.Session()->GetVoxelAt(id, points[end].data()) >= 0);
    QVERIFY(hand.Session()->GetVoxelAt(id, points[1 - end].data()) < 0);
  }
  hand.Show("task-08-length");
}

// Task 9.
void TestClinicalTasks::Embed(Reader& hand)
{
  const std::vector<double> before = GreysOf(hand.Image(3)), valid = ValidOf(hand.Image(3));
  vtkNew<vtkImageData> stitched;
  stitched->DeepCopy(hand.Image(3));
  QVERIFY(hand.GoTo("Stitch"));
  QVERIFY(hand.Press("Stitch", "Embed in a background"));
  QVERIFY(hand.Press("Stitch", "Make"));
  QVERIFY(hand.Wait());
  auto* session = hand.Session();
  QCOMPARE(session->GetNumberOfVolumes(), 3);
  vtkDataArray* embedding = hand.Image(3)->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
  QVERIFY(embedding);
  const std::vector<double> kinds = Values(embedding), greys = GreysOf(hand.Image(3));
  // The hole of the carving and all around the volumes is filled, and data as they were are as they were.
  std::size_t made = 0, kept = 0, changed = 0;
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(stitched);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    made += kinds[i] != 0.0 && kinds[i] != 1.0;
    if (kinds[i] != 1.0)
      continue;
    const Eigen::Array3d index = (geometry.WorldToIndex() * PlaceOf(hand.Image(3), i)).array().round();
    const auto at =
        static_cast<std::size_t>((index.z() * geometry.dimensions[1] + index.y()) * geometry.dimensions[0] + index.x());
    ++kept;
    changed += valid[at] == 0.0 || before[at] != greys[i];
  }
  qInfo("%zu voxels are as they were, %zu were made; %zu of the former are others", kept, made, changed);
  QVERIFY(kept > before.size() / 10 && changed == 0 && made > kept / 10);
  hand.Show("task-09-embed");
}

// Task 10.
void TestClinicalTasks::Paint(Reader& hand)
{
  QVERIFY(hand.Pick("result"));
  const std::vector<double> before = GreysOf(hand.Image(3));
  QVERIFY(hand.Press("toolBar", "Paint"));
  QVERIFY(hand.GoTo("Brush"));
  QVERIFY(hand.Fill("Brush", "Radius", "4"));
  QVERIFY(hand.Fill("Brush", "Grey level", "230"));
  const QPoint from = hand.At(Coronal, {-18.0, 0.0, 6.0}), to = hand.At(Coronal, {18.0, 0.0, 0.0});
  const Vector3d a = hand.WorldAt(Coronal, from), b = hand.WorldAt(Coronal, to);
  hand.Drag(Coronal, from, to);
  const std::vector<double> after = GreysOf(hand.Image(3));
  std::size_t core = 0, beyond = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const Vector3d place = PlaceOf(hand.Image(3), i);
    const double share = std::clamp((place - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    const double distance = (place - a - share * (b - a)).norm();
    if (distance < 1.8) { // half of the radius is painted in full
      ++core;
      QCOMPARE(after[i], 230.0);
    } else if (distance > 4.01) {
      beyond += after[i] != before[i];
    }
  }
  QVERIFY(core > 200);
  QCOMPARE(beyond, std::size_t(0));
  hand.Show("task-10-paint");
  hand.Slice(Coronal)->setFocus();
  hand.Key(Qt::Key_Z, Qt::ControlModifier);
  QVERIFY(GreysOf(hand.Image(3)) == before);
  hand.Key(Qt::Key_Y, Qt::ControlModifier);
  QVERIFY(GreysOf(hand.Image(3)) == after);
}

// Task 11.
void TestClinicalTasks::HandOver(Reader& hand)
{
  const SessionState given = hand.Session()->GetKernel().State();
  const std::vector<double> painted = GreysOf(hand.Image(3)), carved = ValidOf(hand.Image(1));
  const double score = hand.Score();
  const QTemporaryDir shared("/tmp/WorkbenchTest-XXXXXX"); // its name is in the picture: as long wherever tests keep their files
  const QDir place(shared.path());
  QVERIFY(hand.Choose("File", "Save project with its volumes..."));
  QVERIFY(hand.Name("copyDialog", place.filePath("for a colleague")));
  QVERIFY(QTest::qWaitFor([&] { return hand.HasMessage("The project and its volumes are in"); }, 30000));
  hand.Show("task-11-colleague", "The project and its volumes are in");
  QVERIFY(hand.Answer("Open the copy")); // and nothing is asked
  QTRY_COMPARE(QString::fromStdString(hand.Session()->GetProjectPath()), place.filePath("for a colleague/for a colleague.json"));
  // It goes to a machine that has nothing else of it.
  QVERIFY(place.mkpath("machine"));
  QVERIFY(QFile::rename(place.filePath("for a colleague"), place.filePath("machine/for a colleague")));
  QVERIFY(!QFile::exists(place.filePath("result.mha"))); // what is in no file here is in the copy alone
  QVERIFY(QFile::remove(Folder().filePath("data/echorama/samples")));
  Reader colleague;
  QVERIFY(colleague.Choose("File", "Open project..."));
  QVERIFY(colleague.Name("openDialog", place.filePath("machine/for a colleague/for a colleague.json")));
  QTRY_COMPARE(colleague.Session()->GetNumberOfVolumes(), 3);
  const SessionState& got = colleague.Session()->GetKernel().State();
  QCOMPARE(got.measurements.size(), given.measurements.size());
  QVERIFY(got.measurements[0] == given.measurements[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    QVERIFY(got.volumes[i].name == given.volumes[i].name);
    QVERIFY(got.volumes[i].volumeToWorld.matrix() == given.volumes[i].volumeToWorld.matrix());
    QVERIFY(got.volumes[i].visible == given.volumes[i].visible);
  }
  QVERIFY(colleague.Session()->IsResult(3) && colleague.Session()->GetSourcesChanged(3).empty());
  QVERIFY(GreysOf(colleague.Image(3)) == painted && ValidOf(colleague.Image(1)) == carved);
  QVERIFY(std::abs(colleague.Score() - score) < 1e-6);
}

// Task 12.
void TestClinicalTasks::runAnExercise()
{
  Reader hand;
  QVERIFY(hand.OpenSample("Two volumes"));
  QVERIFY(hand.GoTo("Train"));
  QVERIFY(hand.Fill("Train", "Trainee", "Anna"));
  QVERIFY(hand.Fill("Train", "Scatter by", "25"));
  QVERIFY(hand.Fill("Train", "and", "0"));
  QVERIFY(hand.Fill("Train", "Seed", "3"));
  QVERIFY(hand.Press("Train", "Scatter volumes"));
  const double start = hand.Score();
  QVERIFY(std::abs(start - 25.0) < 0.1);
  QVERIFY(hand.Press("Train", "Start"));
  QCOMPARE(hand.Text("score"), QString("hidden until you submit"));
  QVERIFY(hand.Text("scoreReadout").isEmpty());
  hand.Slice(Axial)->setFocus();
  hand.Key(Qt::Key_R); // the program does not help
  QVERIFY(hand.HasMessage("not during an attempt"));
  hand.DragInto(Axial, 2, {3.0, 2.0, 0.0});
  hand.DragInto(Coronal, 2, {3.0, 0.0, -1.0});
  hand.Move(hand.Slice(Coronal), hand.Slice(Coronal)->rect().center() + QPoint(60, 60));
  for (int i = 0; i < 3; ++i)
    hand.Key(Qt::Key_Left);
  hand.Key(Qt::Key_Up);
  QVERIFY(hand.Text("scoreReadout").isEmpty());
  QVERIFY(hand.Press("Train", "Submit"));
  const double score = hand.Score();
  qInfo("%g mm at the start, %g mm at the end", start, score);
  QVERIFY(score < 4.0);
  QVERIFY2(hand.HasMessage(QString("Submitted: %1 mm").arg(score, 0, 'f', 2)), qPrintable(hand.Messages().join('\n')));
  QCOMPARE(hand.Text("score"), QString("%1 mm").arg(score, 0, 'f', 2));
  auto* table = hand.Part<QTableWidget>("attempts");
  QCOMPARE(table->rowCount(), 1);
  QCOMPARE(table->item(0, 0)->text(), QString::number(score, 'f', 2));
  QCOMPARE(table->item(0, 1)->text(), QString::number(start, 'f', 2));
  QCOMPARE(table->item(0, 4)->text(), QString("Anna"));
  const auto attempts = ReadAttempts(Folder().filePath("data/echorama/attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(1));
  QVERIFY(attempts[0].trainee == "Anna" && std::abs(attempts[0].scoreMm - score) < 0.01 && attempts[0].help == 0);
  table->setColumnHidden(5, true); // when it was is another time in each picture
  hand.Show("task-12-exercise");
}

// Nothing was needed that the page does not name.
void TestClinicalTasks::whatWasUsedIsOnThePage()
{
  QFile file(ECHORAMA_SOURCE_DIR "/Documentation/clinical-tasks.md");
  QVERIFY(file.open(QIODevice::ReadOnly));
  const QString page = QString::fromUtf8(file.readAll());
  for (const QString& label : Reader::Used())
    QVERIFY2(page.contains('*' + label + '*'), qPrintable(label));
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestClinicalTasks test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestClinicalTasks.moc"
