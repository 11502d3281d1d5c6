// SPDX-License-Identifier: BSD-3-Clause
#include "BodyView.h"
#include "Controls.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Messages.h"
#include "NeedleTool.h"
#include "NeedleView.h"
#include "Redraw.h"
#include "Scan.h"
#include <algorithm>
#include <cmath>
#include <QLineF>
#include <QMouseEvent>
#include <QVBoxLayout>
#include <QVTKInteractor.h>
#include <QVTKOpenGLNativeWidget.h>
#include <QWheelEvent>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCylinderSource.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkImageProperty.h>
#include <vtkImageSlice.h>
#include <vtkImageSliceMapper.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUltrasoundProbeSource.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

constexpr int BodyMs = 40, MostBodyMs = 250; ///< between pictures of the body: the image comes first
constexpr double BodyShare = 0.2;            ///< of the time, that pictures of the body may take where drawing is slow
constexpr double DegreesPerPixel = 0.3;      ///< of a drag
constexpr double AdvancePerPixel = 0.2, NeedlePixels = 7.0;
constexpr double LeastSlope = 0.05;            ///< of the sight to the skin
constexpr int MostSteps = 6;                   ///< for one motion of the mouse, until the probe is under it
constexpr double MostMm = 20.0, CloseMm = 0.2; ///< of a step; when it is

/// The right button turns, for the left one has the probe. VTK's own keys are off.
class ViewStyle : public vtkInteractorStyleTrackballCamera {
public:
  static ViewStyle* New();
  vtkTypeMacro(ViewStyle, vtkInteractorStyleTrackballCamera);
  void OnChar() override {}
  void OnRightButtonDown() override { vtkInteractorStyleTrackballCamera::OnLeftButtonDown(); }
  void OnRightButtonUp() override { vtkInteractorStyleTrackballCamera::OnLeftButtonUp(); }
};
vtkStandardNewMacro(ViewStyle);

vtkSmartPointer<vtkPolyData> SurfaceOfProbe(const ProbeGeometry& probe)
{
  if (probe.fanAngle > M_PI) { // a catheter: the plane is across it
    vtkNew<vtkCylinderSource> shaft;
    shaft->SetRadius(std::max(1.0, probe.fanWidth / probe.fanAngle));
    shaft->SetHeight(60.0);
    shaft->SetResolution(32);
    shaft->Update();
    return shaft->GetOutput();
  }
  vtkNew<vtkUltrasoundProbeSource> source;
  source->SetPresetToCustom();
  source->SetFanAngle(probe.fanAngle * 180.0 / M_PI);
  if (probe.fanAngle > 0.0)
    source->SetFanRadius(probe.fanWidth / probe.fanAngle);
  source->SetFanWidth(probe.fanWidth);
  source->SetSweepAngle(0.0);
  source->SetSweepWidth(0.0);
  source->SetElements(2);
  source->SetSweepSteps(1);
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputConnection(source->GetOutputPort());
  normals->SetFeatureAngle(40.0);
  const Messages::OfThread messages; // a probe that has no surface is not drawn
  normals->Update();
  return normals->GetOutput();
}

} // namespace

BodyView::BodyView(Scan* scan, NeedleTool* needle, QWidget* parent)
  : QWidget(parent), scan_(scan), needle_(needle), canvas_(new QVTKOpenGLNativeWidget(this)), waitMs_(BodyMs)
{
  setObjectName("bodyView");
  canvas_->setObjectName("bodyCanvas");
  MakeOwnWindow(this); // for the image changes often
  canvas_->setAccessibleName(tr("Body and probe"));
  canvas_->setFocusPolicy(Qt::StrongFocus);
  canvas_->setMinimumSize(200, 160);
  canvas_->installEventFilter(this);
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  window->SetMultiSamples(0);
  canvas_->setRenderWindow(window);
  window->AddRenderer(renderer_);
  renderer_->SetBackground(0.13, 0.14, 0.16);
  vtkNew<ViewStyle> style;
  style->SetDefaultRenderer(renderer_);
  canvas_->interactor()->SetInteractorStyle(style);

  skinMapper_->ScalarVisibilityOff();
  skin_->SetMapper(skinMapper_);
  skin_->GetProperty()->SetColor(0.86, 0.66, 0.55);
  skin_->GetProperty()->SetOpacity(0.35);
  skin_->GetProperty()->SetAmbient(0.25);
  skin_->GetProperty()->BackfaceCullingOn(); // one layer: what is inside is seen
  skin_->GetProperty()->SetSpecular(0.1);
  skin_->ForceOpaqueOn(); // blended last over all else, without the pass that averages many layers
  probeMapper_->ScalarVisibilityOff();
  probe_->SetMapper(probeMapper_);
  probe_->GetProperty()->SetColor(0.75, 0.78, 0.82);
  probe_->GetProperty()->SetSpecular(0.3);
  imageMapper_->SetOrientationToZ();
  imageMapper_->BorderOn();
  image_->SetMapper(imageMapper_);
  image_->GetProperty()->SetInterpolationTypeToLinear();
  image_->SetVisibility(false);
  needleView_ = std::make_unique<NeedleView>(renderer_);
  marks_->SetMapper(marksMapper_);
  marks_->GetProperty()->SetColor(0.98, 0.86, 0.35);
  marks_->GetProperty()->SetLineWidth(3.0);
  marks_->GetProperty()->LightingOff();
  marks_->SetVisibility(false);
  for (vtkProp* prop : {static_cast<vtkProp*>(image_), static_cast<vtkProp*>(probe_), static_cast<vtkProp*>(marks_),
                        static_cast<vtkProp*>(skin_)})
    renderer_->AddViewProp(prop);

  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(canvas_);
  redraw_ = new Redraw(this, [this] { DrawNow(); });
  connect(scan, &Scan::SubjectChanged, this, &BodyView::ShowSubject);
  connect(scan, &Scan::ProbeMoved, this, [this] { redraw_->Ask(waitMs_); });
  connect(needle, &NeedleTool::Changed, this, [this] { redraw_->Ask(waitMs_); });
  connect(scan, &Scan::FrameMade, this, [this] { redraw_->Ask(waitMs_); });
}

BodyView::~BodyView()
{
  canvas_->interactor()->SetInteractorStyle(nullptr);
}

void BodyView::ShowSubject()
{
  vtkPolyData* skin = scan_->Body().skin;
  skin_->SetVisibility(skin != nullptr);
  if (skin)
    skinMapper_->SetInputData(skin);
  QMetaObject::invokeMethod(this, &BodyView::Fit, Qt::QueuedConnection); // once the probe is in its place
}

void BodyView::ShowMarks(vtkPolyData* lines)
{
  marks_->SetVisibility(lines != nullptr);
  if (lines)
    marksMapper_->SetInputData(lines);
  redraw_->Ask();
}

// The probe from the side and a little from above, in front of the body.
void BodyView::Fit()
{
  ShowProbe();
  ShowImage();
  ShowNeedle();
  const Eigen::Vector3d up = scan_->SkinNormal(), x = scan_->ProbeToWorld().linear().col(0), y = -up.cross(x).normalized();
  const Eigen::Vector3d from = (0.85 * y - 0.35 * x + 0.4 * up).normalized();
  vtkCamera* camera = renderer_->GetActiveCamera();
  camera->SetFocalPoint(0.0, 0.0, 0.0);
  camera->SetPosition(from.data());
  camera->SetViewUp(up.data());
  FitToSize();
  redraw_->Ask();
}

void BodyView::FitToSize()
{
  renderer_->ResetCamera();
  renderer_->ResetCameraClippingRange();
  renderer_->GetActiveCamera()->GetPosition(fittedFrom_.data());
  std::copy_n(canvas_->renderWindow()->GetSize(), 2, fittedSize_.begin());
  isNeedleFitted_ = needle_->IsShown();
}

void BodyView::ShowProbe()
{
  const ProbeGeometry probe = scan_->Scanner().Probe();
  const QString key = QString("%1 %2").arg(probe.fanAngle).arg(probe.fanWidth);
  if (key != shownProbe_) {
    shownProbe_ = key;
    probeMapper_->SetInputData(SurfaceOfProbe(probe));
  }
  vtkNew<vtkMatrix4x4> pose;
  vtkUltrasoundVolume::SetMatrix(pose, scan_->ProbeToWorld());
  probe_->SetUserMatrix(pose);
}

// As picture pixels with what is not seen transparent, where the image lies.
void BodyView::ShowImage()
{
  const PlanePicture& picture = scan_->Picture();
  vtkImageData* live = scan_->Scanner().Output();
  image_->SetVisibility(!picture.image.isNull() && live->GetNumberOfPoints() > 0);
  if (!image_->GetVisibility())
    return;
  vtkNew<vtkImageData> shown;
  vtkUltrasoundVolume::SetGeometry(shown, vtkUltrasoundVolume::GeometryOf(live));
  shown->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
  auto* out = static_cast<unsigned char*>(shown->GetScalarPointer());
  for (int y = 0; y < picture.image.height(); y++) {
    const auto* row = reinterpret_cast<const QRgb*>(picture.image.constScanLine(y));
    for (int x = 0; x < picture.image.width(); x++, out += 4) {
      out[0] = static_cast<unsigned char>(qRed(row[x]));
      out[1] = static_cast<unsigned char>(qGreen(row[x]));
      out[2] = static_cast<unsigned char>(qBlue(row[x]));
      out[3] = static_cast<unsigned char>(qAlpha(row[x]));
    }
  }
  imageMapper_->SetInputData(shown);
}

void BodyView::DrawNow()
{
  redraw_->Stop();
  if (!isVisible())
    return;
  ShowProbe();
  ShowImage();
  ShowNeedle();
  // What nobody has turned or zoomed stays fitted; a body may even be there before the view has a size. A needle that comes is
  // seen whole, unless a hand holds something here.
  isNeedleFitted_ = isNeedleFitted_ && needle_->IsShown();
  const bool needleCame = needle_->IsShown() && !isNeedleFitted_ && !isDragging_;
  if (std::equal(fittedFrom_.begin(), fittedFrom_.end(), renderer_->GetActiveCamera()->GetPosition()) &&
      (needleCame || !std::equal(fittedSize_.begin(), fittedSize_.end(), canvas_->renderWindow()->GetSize())))
    FitToSize();
  renderer_->ResetCameraClippingRange();
  const Clock::time_point start = Clock::now();
  canvas_->renderWindow()->Render();
  waitMs_ = std::clamp(static_cast<int>(1e3 * SecondsSince(start) / BodyShare), BodyMs, MostBodyMs);
}

QPointF BodyView::ToCanvas(const double world[3]) const
{
  renderer_->SetWorldPoint(world[0], world[1], world[2], 1.0);
  renderer_->WorldToDisplay();
  const double* at = renderer_->GetDisplayPoint();
  const double ratio = canvas_->devicePixelRatioF();
  return {at[0] / ratio, canvas_->height() - 1.0 - at[1] / ratio};
}

void BodyView::RayAt(const QPointF& at, double origin[3], double direction[3]) const
{
  const double ratio = canvas_->devicePixelRatioF();
  double ends[2][4];
  for (int i : {0, 1}) {
    renderer_->SetDisplayPoint(at.x() * ratio, (canvas_->height() - 1.0 - at.y()) * ratio, i);
    renderer_->DisplayToWorld();
    renderer_->GetWorldPoint(ends[i]);
  }
  for (int a = 0; a < 3; a++) {
    origin[a] = ends[0][a] / ends[0][3];
    direction[a] = ends[1][a] / ends[1][3] - origin[a];
  }
}

void BodyView::ShowNeedle()
{
  needleView_->Show(*needle_, scan_->Scanner().NeedleLengthMm());
}

bool BodyView::IsOnNeedle(const QPointF& at) const
{
  if (!needle_->IsShown())
    return false;
  // What is outside of the body can be taken.
  const QPointF hub = ToCanvas(needleView_->Hub().data()), way = ToCanvas(needle_->Entry().data()) - hub;
  const double length2 = QPointF::dotProduct(way, way);
  const double along = length2 > 0.0 ? std::clamp(QPointF::dotProduct(at - hub, way) / length2, 0.0, 1.0) : 0.0;
  return QLineF(at, hub + along * way).length() <= NeedlePixels;
}

void BodyView::DragNeedle(const QPoint& to)
{
  const QPoint by = to - last_;
  last_ = to;
  const bool both = (dragKeys_ & Qt::ShiftModifier) && (dragKeys_ & Qt::ControlModifier);
  if (!both && dragKeys_ & Qt::ShiftModifier) {
    needle_->Steer(DegreesPerPixel * by.x(), DegreesPerPixel * by.y());
  } else if (!both && dragKeys_ & Qt::ControlModifier) {
    needle_->Advance(AdvancePerPixel * by.y());
  } else {
    Eigen::Vector3d origin, direction;
    RayAt(to - grabbed_, origin.data(), direction.data());
    if (const auto hit = scan_->HasSkin() ? scan_->Body().mesh->FirstHit(origin, direction) : std::nullopt)
      needle_->PutEntry(scan_->Body().mesh->PointAt(hit->place));
  }
}

// The probe walks towards the skin that is under the mouse, all the way, so that neither a crease nor a fold makes it jump.
void BodyView::Drag(const QPoint& to)
{
  const QPoint by = to - last_;
  last_ = to;
  if (dragKeys_ & Qt::ShiftModifier) {
    scan_->Hold(DegreesPerPixel * by.y(), DegreesPerPixel * by.x());
    return;
  }
  if (dragKeys_ & Qt::ControlModifier) {
    scan_->Rotate(DegreesPerPixel * by.x());
    return;
  }
  Eigen::Vector3d origin, direction;
  RayAt(to - grabbed_, origin.data(), direction.data());
  const auto hit = scan_->HasSkin() ? scan_->Body().mesh->FirstHit(origin, direction) : std::nullopt;
  for (int i = 0; i < MostSteps; i++) {
    const Eigen::Vector3d place = scan_->ProbeToWorld().translation(), normal = scan_->SkinNormal();
    const double slope = direction.normalized().dot(normal);
    Eigen::Vector3d way;
    if (hit)
      way = scan_->Body().mesh->PointAt(hit->place) - place;
    else if (std::fabs(slope) > LeastSlope) // beside the body: towards there, as far as it goes
      way = origin + direction * ((place - origin).dot(normal) / direction.dot(normal)) - place;
    else
      return;
    if (way.norm() > MostMm)
      way *= MostMm / way.norm();
    scan_->SlideInWorld(way);
    if (!hit || way.norm() < CloseMm)
      return;
  }
}

bool BodyView::eventFilter(QObject* object, QEvent* event)
{
  auto* mouse = static_cast<QMouseEvent*>(event);
  switch (event->type()) {
  case QEvent::Resize:
    redraw_->Ask();
    break;
  case QEvent::MouseButtonPress:
    if (mouse->button() != Qt::LeftButton)
      break;
    isDragging_ = true;
    dragKeys_ = mouse->modifiers(); // what is begun is gone on with
    last_ = mouse->pos();
    isDraggingNeedle_ = needle_->IsShown() && (dragKeys_ == (Qt::ShiftModifier | Qt::ControlModifier) || IsOnNeedle(last_));
    // The needle comes to the mouse, or stays under it; so does the probe.
    grabbed_ = !isDraggingNeedle_  ? last_ - ToCanvas(scan_->ProbeToWorld().translation().data())
               : IsOnNeedle(last_) ? last_ - ToCanvas(needle_->Entry().data())
                                   : QPointF();
    if (isDraggingNeedle_ && grabbed_.isNull())
      DragNeedle(last_);
    canvas_->setFocus();
    return true;
  case QEvent::MouseMove:
    if (!isDragging_)
      break;
    if (mouse->buttons() & Qt::LeftButton)
      isDraggingNeedle_ ? DragNeedle(mouse->pos()) : Drag(mouse->pos());
    else
      isDragging_ = false; // its release was lost
    return true;
  case QEvent::MouseButtonRelease:
    if (mouse->button() != Qt::LeftButton)
      break;
    isDragging_ = false;
    return true;
  case QEvent::Wheel: {
    auto* wheel = static_cast<QWheelEvent*>(event);
    if (!IsOnNeedle(wheel->position()))
      break;
    needle_->Advance(wheel->angleDelta().y() / -120.0);
    return true;
  }
  case QEvent::MouseButtonDblClick: {
    if (mouse->button() != Qt::LeftButton)
      break;
    Eigen::Vector3d origin, direction;
    RayAt(mouse->localPos(), origin.data(), direction.data());
    scan_->PlaceWhereHit(origin, direction);
    return true;
  }
  default:
    break;
  }
  return QWidget::eventFilter(object, event);
}

} // namespace echorama
