// SPDX-License-Identifier: BSD-3-Clause
// VTK sees the events that belong to the alignment widget (the left button and keys, with the tool Align) and no others: the
// rest is the same with every tool and is done here.
#include "SliceCanvas.h"
#include "AlignmentHandles.h"
#include "Flicker.h"
#include "MeasureTool.h"
#include "Redraw.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundSliceView.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QMouseEvent>
#include <QVTKInteractor.h>
#include <vtkCommand.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

namespace echorama {

namespace {

constexpr int SliceWatchingMs = 1; ///< while something is dragged in another view: that one is drawn first
constexpr int WatchingStep = 2;    ///< and with every other pixel
constexpr int PointerMs = 15;      ///< and while the mouse points at something there
constexpr double Reach = 8.0;      ///< of points that are dragged, pixels

const char* BrushModeOf(Tool tool)
{
  return tool == Tool::Paint ? "paint" : tool == Tool::Carve ? "carve" : "restore";
}

bool IsBrush(Tool tool)
{
  return tool == Tool::Paint || tool == Tool::Carve || tool == Tool::Restore;
}

bool IsMeasure(Tool tool)
{
  return tool == Tool::Measure || tool == Tool::Angle;
}

} // namespace

SliceCanvas::SliceCanvas(Workbench* bench, QWidget* parent)
  : QVTKOpenGLNativeWidget(parent), bench_(bench), view_(vtkSmartPointer<vtkUltrasoundSliceView>::New())
{
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setMinimumSize(120, 100);
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  window->SetMultiSamples(0);
  setRenderWindow(window);
  interactor()->SetInteractorStyle(nullptr);
  interactor()->AddObserver(vtkCommand::RenderEvent, this, &SliceCanvas::OnRenderAsked);
  view_->SetSession(bench->Session());
  window->AddRenderer(view_->GetRenderer());
  redraw_ = new Redraw(this, [this] { DrawNow(); });
  handles_ = new AlignmentHandles(bench, interactor(), view_->GetRenderer(), this);

  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::SelectionChanged,
                       &Workbench::VoxelsChanged, &Workbench::ToolChanged})
    connect(bench, changed, this, &SliceCanvas::Ask);
  connect(bench, &Workbench::ToolChanged, this, [this] { view_->HideBrush(); });
  connect(bench, &Workbench::HandChanged, this, &SliceCanvas::Ask); // the axis that motions keep to is drawn
  connect(bench, &Workbench::LookChanged, this, &SliceCanvas::Look);
  connect(bench, &Workbench::OnlyChanged, this, &SliceCanvas::Look);
  connect(bench, &Workbench::PointerChanged, this, &SliceCanvas::ShowPointer);
  connect(bench, &Workbench::MeasurementsChanged, this, &SliceCanvas::Ask);
  connect(bench, &Workbench::ShiftsChanged, this, [this] {
    view_->SetShifts(bench_->Shifts().map, bench_->Shifts().mostMm, bench_->Shifts().isStale);
    Ask();
  });
  connect(bench->Measuring(), &MeasureTool::Changed, this, &SliceCanvas::ShowDraft);
  connect(bench, &Workbench::InteractingChanged, this, [this](bool on) {
    view_->SetInteractive(on);
    Ask();
  });
  Look();
}

SliceCanvas::~SliceCanvas() = default;

vtkUltrasoundSliceView* SliceCanvas::View() const
{
  return view_;
}

void SliceCanvas::Look()
{
  const SliceLook& look = bench_->Slices();
  view_->SetShown(look.shown.toUtf8().constData());
  view_->SetMode(look.mode.toUtf8().constData());
  view_->SetLinear(look.linear);
  view_->SetSquarePixels(look.squarePixels);
  const QVector<int>& only = bench_->OnlyInSlices();
  view_->SetOnly({only.begin(), only.end()});
  Ask();
}

bool SliceCanvas::IsWatching() const
{
  return bench_->Interacting() && drag_ == Drag::None;
}

void SliceCanvas::Ask()
{
  redraw_->Ask(IsWatching() ? SliceWatchingMs : 0);
}

// While something is dragged nobody looks at where the mouse is in other views.
void SliceCanvas::ShowPointer()
{
  const auto& place = bench_->Pointer();
  const bool isWanted = place && bench_->PointerIn() != this && !bench_->Interacting();
  if (!isWanted && !isPointed_)
    return;
  isPointed_ = isWanted;
  if (isWanted)
    view_->SetPointer(place->x(), place->y(), place->z());
  else
    view_->HidePointer();
  redraw_->Ask(PointerMs);
}

void SliceCanvas::ShowDraft()
{
  view_->SetDraft(bench_->Measuring()->Draft());
  Ask();
}

void SliceCanvas::DrawNow()
{
  if (!isVisible())
    return;
  view_->SetInteractiveStep(IsWatching() ? WatchingStep : 0);
  view_->Update();
  renderWindow()->Render();
  emit Drawn();
}

QPointF SliceCanvas::PixelOf(const QPointF& position) const
{
  const double ratio = devicePixelRatioF();
  return {position.x() * ratio, (height() - position.y()) * ratio - 1.0};
}

QPointF SliceCanvas::PositionOf(const QPointF& pixel) const
{
  const double ratio = devicePixelRatioF();
  return {pixel.x() / ratio, height() - (pixel.y() + 1.0) / ratio};
}

bool SliceCanvas::IsForHandles(QEvent* event) const
{
  if (bench_->CurrentTool() != Tool::Align)
    return false;
  switch (event->type()) {
  case QEvent::MouseButtonPress:
  case QEvent::MouseButtonRelease:
    return static_cast<QMouseEvent*>(event)->button() == Qt::LeftButton;
  case QEvent::MouseMove:
    return drag_ == Drag::None || drag_ == Drag::Widget;
  case QEvent::KeyPress:
  case QEvent::KeyRelease:
  case QEvent::Enter:
  case QEvent::Leave:
    return true;
  default:
    return false;
  }
}

bool SliceCanvas::event(QEvent* event)
{
  switch (event->type()) {
  case QEvent::Show:
    Ask(); // what was asked for while it was hidden was not drawn
    break;
  case QEvent::Hide:
  case QEvent::WindowDeactivate:
  case QEvent::WindowBlocked:
    EndDrag(); // the button is released elsewhere
    break;
  case QEvent::MouseMove:
    if (drag_ != Drag::None && !(static_cast<QMouseEvent*>(event)->buttons() & ButtonOfDrag()))
      EndDrag();
    break;
  case QEvent::MouseButtonPress:
    selected_ = bench_->SelectedVolumes();
    break;
  default:
    break;
  }
  switch (event->type()) {
  case QEvent::MouseButtonPress:
  case QEvent::MouseButtonRelease:
  case QEvent::MouseButtonDblClick:
  case QEvent::MouseMove:
  case QEvent::Wheel:
  case QEvent::KeyPress:
  case QEvent::KeyRelease:
  case QEvent::Enter:
  case QEvent::Leave:
  case QEvent::ContextMenu:
    return IsForHandles(event) ? HandleEvent(event) : QOpenGLWidget::event(event);
  default:
    return QVTKOpenGLNativeWidget::event(event);
  }
}

void SliceCanvas::OnRenderAsked()
{
  if (!interactor()->GetEnableRender())
    Ask();
}

// The widget draws at once whatever it does; here one picture a frame will do, with what the session has told besides.
bool SliceCanvas::HandleEvent(QEvent* event)
{
  interactor()->EnableRenderOff();
  const bool isTaken = QVTKOpenGLNativeWidget::event(event);
  interactor()->EnableRenderOn();
  return isTaken;
}

void SliceCanvas::resizeEvent(QResizeEvent* event)
{
  QVTKOpenGLNativeWidget::resizeEvent(event);
  const double ratio = devicePixelRatioF();
  view_->SetPixelSize(std::max(1, qRound(width() * ratio)), std::max(1, qRound(height() * ratio)));
  Ask();
}

void SliceCanvas::mousePressEvent(QMouseEvent* event)
{
  event->accept();
  setFocus(Qt::MouseFocusReason);
  if (drag_ != Drag::None)
    return; // one button at a time
  last_ = event->localPos();
  double point[3];
  const QPointF pixel = PixelOf(last_);
  view_->PixelToWorld(pixel.x(), pixel.y(), point);
  if (event->button() == Qt::MiddleButton) {
    drag_ = event->modifiers() & Qt::ShiftModifier ? Drag::Turn : Drag::Pan;
  } else if (event->button() == Qt::RightButton) {
    drag_ = Drag::Window;
    bench_->SetInteracting(true);
  } else if (event->button() == Qt::LeftButton && bench_->CurrentTool() == Tool::Align) {
    drag_ = Drag::Widget;
  } else if (event->button() == Qt::LeftButton && IsBrush(bench_->CurrentTool())) {
    BeginStroke(point);
  } else if (event->button() == Qt::LeftButton && bench_->CurrentTool() == Tool::Mark) {
    BeginLandmark(pixel, point);
  } else if (event->button() == Qt::LeftButton && IsMeasure(bench_->CurrentTool())) {
    drag_ = Drag::Measure;
    bench_->Measuring()->Press(view_, pixel, Reach * devicePixelRatioF());
  } else if (event->button() == Qt::LeftButton) {
    drag_ = Drag::Cursor;
    view_->SetCursor(point[0], point[1], point[2]);
    ChangePlane();
  }
}

void SliceCanvas::ChangePlane()
{
  isPlaced_ = true;
  emit PlaneChanged();
  Ask();
}

int SliceCanvas::VolumeToChange(const QString& toSelectOne)
{
  const QVector<int> volumes = bench_->Volumes();
  const int id = volumes.size() == 1 ? volumes.first() : bench_->ActiveVolume();
  if (id != 0 && bench_->SelectedVolumes().size() <= 1)
    return id;
  bench_->Note(volumes.isEmpty() ? tr("Open a volume first.") : toSelectOne);
  return 0;
}

// A press beside a landmark of the volume takes hold of it, any other makes a new one. Until the release it is one edit.
void SliceCanvas::BeginLandmark(const QPointF& pixel, const double point[3])
{
  auto* session = bench_->Session();
  const int id = VolumeToChange(tr("Select the one volume to mark in."));
  if (id == 0)
    return;
  landmark_ = {id, session->GetNextLandmarkLabel(id)};
  double nearest = Reach * devicePixelRatioF();
  for (int i = 0; i < session->GetNumberOfLandmarks(id); ++i) {
    const std::string label = session->GetLandmarkLabel(id, i);
    double place[3] = {0.0, 0.0, 0.0}, at[2], shown[3];
    session->GetLandmark(id, label.c_str(), place);
    view_->WorldToPixel(place[0], place[1], place[2], at);
    view_->PixelToWorld(at[0], at[1], shown);
    const double distance = std::hypot(at[0] - pixel.x(), at[1] - pixel.y());
    const double depth = std::hypot(place[0] - shown[0], place[1] - shown[1], place[2] - shown[2]);
    if (distance < nearest && depth < nearest * view_->GetMillimetresPerPixel()) {
      nearest = distance;
      landmark_.second = label;
    }
  }
  session->BeginEdit(tr("Mark %1 in %2").arg(QString::fromStdString(landmark_.second), bench_->NameOf(id)).toUtf8());
  drag_ = Drag::Landmark;
  DragLandmark(point);
}

void SliceCanvas::DragLandmark(const double point[3])
{
  bench_->Session()->SetLandmark(landmark_.first, landmark_.second.c_str(), point[0], point[1], point[2]);
  view_->SetCursor(point[0], point[1], point[2]);
  ChangePlane();
}

void SliceCanvas::BeginStroke(const double point[3])
{
  auto* session = bench_->Session();
  const int id = VolumeToChange(tr("Select the one volume to paint in."));
  if (id == 0)
    return;
  const BrushSettings& brush = bench_->Brush();
  if (!session->BeginStroke(id, BrushModeOf(bench_->CurrentTool()), brush.radiusMm, brush.intensity, brush.opacity,
                            brush.hardness, brush.insideValid))
    return;
  drag_ = Drag::Stroke;
  bench_->SetInteracting(true);
  view_->SetInteractive(false); // what is painted in is seen as it is
  session->ExtendStroke(point[0], point[1], point[2]);
}

void SliceCanvas::mouseMoveEvent(QMouseEvent* event)
{
  event->accept();
  const QPointF now = event->localPos(), by = now - last_;
  const QPointF pixel = PixelOf(now);
  const double ratio = devicePixelRatioF();
  double point[3];
  view_->PixelToWorld(pixel.x(), pixel.y(), point);
  switch (drag_) {
  case Drag::Cursor:
    view_->SetCursor(point[0], point[1], point[2]);
    ChangePlane();
    break;
  case Drag::Stroke:
    bench_->Session()->ExtendStroke(point[0], point[1], point[2]);
    break;
  case Drag::Landmark:
    DragLandmark(point);
    break;
  case Drag::Measure:
    bench_->Measuring()->Move(view_, pixel);
    break;
  case Drag::Pan:
    bench_->Flickering()->Stop();
    view_->Pan(by.x() * ratio, -by.y() * ratio);
    ChangePlane();
    break;
  case Drag::Turn:
    bench_->Flickering()->Stop();
    view_->Turn(-0.4 * by.y(), 0.4 * by.x());
    ChangePlane();
    break;
  case Drag::Window:
    ChangeWindow(by);
    break;
  case Drag::None:
    if (!bench_->Measuring()->Draft().empty())
      bench_->Measuring()->Move(view_, pixel);
    break;
  default:
    break;
  }
  last_ = now;
  ShowBrush(point);
  bench_->SetPointer(Eigen::Vector3d(point), this);
}

void SliceCanvas::ShowBrush(const double point[3])
{
  if (!IsBrush(bench_->CurrentTool()))
    return;
  view_->SetBrush(point[0], point[1], point[2], bench_->Brush().radiusMm);
  Ask();
}

void SliceCanvas::mouseReleaseEvent(QMouseEvent* event)
{
  event->accept();
  if (event->button() == ButtonOfDrag())
    EndDrag();
}

Qt::MouseButton SliceCanvas::ButtonOfDrag() const
{
  return drag_ == Drag::Pan || drag_ == Drag::Turn ? Qt::MiddleButton : drag_ == Drag::Window ? Qt::RightButton : Qt::LeftButton;
}

void SliceCanvas::EndDrag()
{
  const Drag drag = drag_;
  if (drag == Drag::None)
    return;
  drag_ = Drag::None;
  if (drag == Drag::Widget)
    interactor()->InvokeEvent(vtkCommand::LeftButtonReleaseEvent); // the widget knows it already, unless the release was lost
  if (drag == Drag::Stroke)
    bench_->Session()->EndStroke();
  if (drag == Drag::Landmark)
    bench_->Session()->EndEdit();
  if (drag == Drag::Measure) {
    const QPointF pixel = PixelOf(last_);
    bench_->Measuring()->Release(view_, pixel);
  }
  if (drag == Drag::Stroke || drag == Drag::Window)
    bench_->SetInteracting(false);
  Ask();
}

void SliceCanvas::CancelStroke()
{
  drag_ = Drag::None;
  bench_->Session()->CancelEdit();
  bench_->SetInteracting(false);
}

void SliceCanvas::mouseDoubleClickEvent(QMouseEvent* event)
{
  event->accept();
  if (event->button() == Qt::RightButton)
    bench_->Session()->ResetGreyWindow();
  if (event->button() != Qt::LeftButton || IsBrush(bench_->CurrentTool()) || bench_->CurrentTool() == Tool::Mark ||
      IsMeasure(bench_->CurrentTool())) {
    mousePressEvent(event); // dabs in quick succession
    return;
  }
  // Its first click was meant as no choice of a volume.
  if (bench_->SelectedVolumes() != selected_) {
    bench_->Session()->SelectNone();
    for (int id : selected_)
      bench_->Session()->Select(id);
  }
  emit LargeAsked();
}

void SliceCanvas::wheelEvent(QWheelEvent* event)
{
  event->accept();
  // With Alt or Shift some systems turn the wheel sideways.
  const double steps = (event->angleDelta().y() ? event->angleDelta().y() : event->angleDelta().x()) / 120.0;
  if (event->modifiers() & Qt::ControlModifier) {
    const QPointF pixel = PixelOf(event->position());
    view_->Zoom(std::pow(1.2, steps), pixel.x(), pixel.y());
    ChangePlane();
  } else {
    Scroll(event->modifiers() & Qt::ShiftModifier ? 10.0 * steps : steps);
  }
}

void SliceCanvas::Scroll(double steps)
{
  double range[2];
  view_->GetPositionRange(range);
  view_->SetPosition(std::clamp(view_->GetPosition() + steps * bench_->SmallestSpacing(), range[0], range[1]));
  ChangePlane();
}

// The whole width of the window through the middle of the view, so that the drag is as fine as the data are dark or bright.
void SliceCanvas::ChangeWindow(const QPointF& by)
{
  double window[2];
  bench_->Session()->GetGreyWindow(window);
  const double width = window[1] - window[0], middle = 0.5 * (window[0] + window[1]);
  const double newWidth = width * std::exp(by.x() / 200.0), newMiddle = middle + width * by.y() / 300.0;
  bench_->Session()->SetGreyWindow(newMiddle - 0.5 * newWidth, newMiddle + 0.5 * newWidth);
}

void SliceCanvas::enterEvent(QEvent* event)
{
  QVTKOpenGLNativeWidget::enterEvent(event);
  FocusUnlessTyping(this);
}

void SliceCanvas::leaveEvent(QEvent* event)
{
  QVTKOpenGLNativeWidget::leaveEvent(event);
  view_->HideBrush();
  bench_->SetPointer(std::nullopt, this);
  Ask();
}

void SliceCanvas::keyPressEvent(QKeyEvent* event)
{
  if (event->key() == Qt::Key_Escape && (drag_ == Drag::Stroke || drag_ == Drag::Landmark)) {
    event->accept();
    CancelStroke();
    return;
  }
  if (event->key() == Qt::Key_Escape && bench_->Measuring()->Cancel()) {
    event->accept();
    drag_ = drag_ == Drag::Measure ? Drag::None : drag_;
    return;
  }
  if (event->key() == Qt::Key_Escape && drag_ == Drag::None && bench_->BringBack()) {
    event->accept();
    return;
  }
  // The alignment widget has had it; arrows must not wander off to the next field.
  if (bench_->CurrentTool() == Tool::Align && event->key() != Qt::Key_Tab && event->key() != Qt::Key_Backtab)
    event->accept();
  else
    QVTKOpenGLNativeWidget::keyPressEvent(event);
}

} // namespace echorama
