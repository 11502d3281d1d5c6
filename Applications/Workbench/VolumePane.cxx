// SPDX-License-Identifier: BSD-3-Clause
// Full quality can take longer than a person waits for a mouse. So whatever happens is drawn coarsely first; once nothing has
// happened for a moment the picture becomes finer step by step, with a look at the mouse in between.
#include "VolumePane.h"
#include "AlignmentHandles.h"
#include "Controls.h"
#include "Redraw.h"
#include "SliceCanvas.h"
#include "vtkUltrasoundAlignmentRepresentation.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundAlignmentWidget.h"
#include "vtkUltrasoundSliceView.h"
#include "vtkUltrasoundVolumeView.h"
#include "Workbench.h"
#include <QComboBox>
#include <QHBoxLayout>
#include <QLineF>
#include <QMouseEvent>
#include <QToolButton>
#include <QVBoxLayout>
#include <QVTKInteractor.h>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderer.h>
#include <vtkRenderingVolumeModule.h> // the OpenGL part of the mappers that the view makes is registered here

namespace echorama {

namespace {
constexpr int VolumeWatchingMs = 2;  ///< while something is dragged: slices are drawn first, for 3D shows their pictures
constexpr double FrameBudgetMs = 20; ///< of the 33 of all four views, while something is dragged
constexpr int RefineMs = 120;        ///< how long nothing must happen before the picture becomes finer
constexpr int StepMs = 20;           ///< between its steps

/// Turns and pans. VTK's own keys (wireframe, stereo, leaving the program) would come between those of the workbench.
class CameraStyle : public vtkInteractorStyleTrackballCamera {
public:
  static CameraStyle* New();
  vtkTypeMacro(CameraStyle, vtkInteractorStyleTrackballCamera);
  void OnChar() override {}
};
vtkStandardNewMacro(CameraStyle);
} // namespace

VolumePane::VolumePane(Workbench* bench, QWidget* parent)
  : QWidget(parent), bench_(bench), canvas_(new QVTKOpenGLNativeWidget(this)),
    view_(vtkSmartPointer<vtkUltrasoundVolumeView>::New())
{
  setObjectName("volumePane");
  MakeOwnWindow(this);
  canvas_->setObjectName("volumeCanvas");
  canvas_->setAccessibleName(tr("3D view"));
  canvas_->setFocusPolicy(Qt::StrongFocus);
  canvas_->setMinimumSize(120, 100);
  canvas_->installEventFilter(this);
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  window->SetMultiSamples(0);
  canvas_->setRenderWindow(window);
  view_->SetSession(bench->Session());
  view_->SetFrameBudget(FrameBudgetMs);
  window->AddRenderer(view_->GetRenderer());
  vtkNew<CameraStyle> style;
  style->SetDefaultRenderer(view_->GetRenderer());
  style->AddObserver(vtkCommand::StartInteractionEvent, this, &VolumePane::OnTurning);
  style->AddObserver(vtkCommand::EndInteractionEvent, this, &VolumePane::OnTurning);
  canvas_->interactor()->SetInteractorStyle(style);
  redraw_ = new Redraw(this, [this] { DrawNow(); });
  refine_ = new Redraw(this, [this] { Refine(); });
  handles_ = new AlignmentHandles(bench, canvas_->interactor(), view_->GetRenderer(), this);

  style_ = ChoiceField(this, "volumeStyle", tr("How volumes are drawn in 3D"),
                       {{"points", tr("Particles")}, {"volume", tr("Volume")}, {"outline", tr("Outline")}},
                       bench->Setter(&VolumeLook::style));
  auto* fit = SmallButton(this, "volumeFit", tr("Fit"), tr("Show everything (F)"));
  auto* large =
      SmallButton(this, "volumeLarge", QString(QChar(0x2922)), tr("Make this view large, and back (M, or a double click)"));
  auto* row = new QHBoxLayout;
  row->setContentsMargins(2, 0, 2, 0);
  row->setSpacing(3);
  row->addWidget(style_);
  row->addStretch(1);
  row->addWidget(fit);
  row->addWidget(large);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(1);
  layout->addLayout(row);
  layout->addWidget(canvas_, 1);
  connect(fit, &QToolButton::clicked, this, &VolumePane::Fit);
  connect(large, &QToolButton::clicked, this, &VolumePane::LargeAsked);

  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::SelectionChanged,
                       &Workbench::VoxelsChanged, &Workbench::ToolChanged})
    connect(bench, changed, this, &VolumePane::Ask);
  connect(bench, &Workbench::HandChanged, this, &VolumePane::Ask);
  connect(bench, &Workbench::LookChanged, this, &VolumePane::Look);
  connect(bench, &Workbench::OnlyChanged, this, [this] {
    const QVector<int>& only = bench_->Only();
    if (view_->SetOnly({only.begin(), only.end()}))
      Ask();
  });
  connect(bench, &Workbench::VolumesChanged, this, &VolumePane::FitToNew);
  connect(bench, &Workbench::InteractingChanged, this, &VolumePane::Ask);
  Look();
}

VolumePane::~VolumePane()
{
  canvas_->interactor()->SetInteractorStyle(nullptr);
}

vtkUltrasoundVolumeView* VolumePane::View() const
{
  return view_;
}

void VolumePane::AddSlice(SliceCanvas* slice)
{
  const int i = slices_.size();
  slices_.append({slice->View()});
  connect(slice, &SliceCanvas::Drawn, this, [this, i] {
    if (bench_->OnlyInSlices() == bench_->Only() && TakePlane(i)) // planes do not flicker
      Ask();
  });
}

// False: what is seen of it here is what was seen before.
bool VolumePane::TakePlane(int i)
{
  Plane& plane = slices_[i];
  std::array<double, 12> corners;
  plane.view->GetPlaneCorners(corners.data());
  const vtkMTimeType drawn = plane.view->GetPicture()->GetMTime();
  if (!bench_->Volume().slices || (drawn == plane.drawn && corners == plane.corners))
    return false;
  plane.corners = corners;
  plane.drawn = drawn;
  return view_->SetPlane(i, corners.data(), plane.view->GetPicture());
}

void VolumePane::Look()
{
  const VolumeLook& look = bench_->Volume();
  view_->SetStyle(look.style.toUtf8().constData());
  view_->SetDownsampling(look.downsampling);
  view_->SetParticleSize(look.particleSize);
  view_->SetOpacity(look.opacity);
  view_->SetValueOpacity(look.valueOpacity);
  view_->SetMinimum(look.minimum);
  view_->SetMaximum(look.maximum);
  view_->SetShowPlanes(look.slices);
  view_->SetErrorVectors(look.errorVectors);
  Show(style_, look.style);
  Ask();
}

void VolumePane::Fit()
{
  view_->Fit();
  isPlaced_ = false;
  Ask();
}

// Volumes come one after the other: all are to be seen, until somebody has chosen what to look at.
void VolumePane::FitToNew()
{
  const int count = bench_->Session()->GetNumberOfVolumes();
  if (count > volumes_ && (!isPlaced_ || volumes_ == 0))
    Fit();
  volumes_ = count;
}

void VolumePane::Ask()
{
  view_->SetInteractive(true);
  redraw_->Ask(bench_->Interacting() ? VolumeWatchingMs : 0);
  if (turning_ || bench_->Interacting())
    refine_->Stop();
  else
    refine_->AskAnew(RefineMs);
}

void VolumePane::DrawNow()
{
  if (!isVisible())
    return;
  for (int i = 0; i < slices_.size(); i++)
    TakePlane(i);
  view_->Update();
  canvas_->renderWindow()->Render();
}

void VolumePane::Refine()
{
  if (turning_ || bench_->Interacting() || !isVisible() || !view_->Refine())
    return;
  DrawNow();
  refine_->AskAnew(StepMs);
}

void VolumePane::OnTurning(vtkObject*, unsigned long event, void*)
{
  turning_ = event == vtkCommand::StartInteractionEvent;
  isPlaced_ = true;
  Ask();
}

// The nearest; where it (or its group) is all that is selected, the next behind it.
void VolumePane::SelectAt(const QPointF& position, bool add)
{
  auto* session = bench_->Session();
  const double ratio = devicePixelRatioF();
  const double x = position.x() * ratio, y = (canvas_->height() - position.y()) * ratio - 1.0;
  QVector<int> ids;
  for (int id = view_->GetVolumeAt(x, y); id > 0; id = view_->GetVolumeAt(x, y, ids.size()))
    ids.append(id);
  if (ids.isEmpty())
    return;
  int chosen = ids.first();
  for (int i = 0; i < ids.size(); ++i) {
    if (!add && session->IsSelected(ids[i]))
      chosen = ids[(i + 1) % ids.size()];
    if (add && !session->IsSelected(ids[i])) {
      chosen = ids[i];
      break;
    }
  }
  session->Select(chosen, !add || !session->IsSelected(chosen), !add);
}

bool VolumePane::eventFilter(QObject* object, QEvent* event)
{
  constexpr double reach = 4.0; // pixels that a hand trembles in a click
  const auto* mouse = static_cast<QMouseEvent*>(event);
  if (event->type() == QEvent::MouseButtonPress) {
    using Representation = vtkUltrasoundAlignmentRepresentation;
    const bool onHandle = bench_->CurrentTool() == Tool::Align &&
                          handles_->Widget()->GetAlignmentRepresentation()->GetInteractionState() != Representation::Outside;
    isClick_ = mouse->button() == Qt::LeftButton && !onHandle && !(mouse->modifiers() & Qt::ShiftModifier);
    pressed_ = mouse->localPos();
  } else if (event->type() == QEvent::MouseMove) {
    isClick_ = isClick_ && QLineF(pressed_, mouse->localPos()).length() <= reach;
  } else if (event->type() == QEvent::MouseButtonRelease && mouse->button() == Qt::LeftButton && isClick_) {
    isClick_ = false;
    SelectAt(pressed_, mouse->modifiers() & Qt::ControlModifier);
  } else if (event->type() == QEvent::KeyPress && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape &&
             bench_->BringBack()) {
    return true;
  }
  if (event->type() == QEvent::MouseButtonDblClick && static_cast<QMouseEvent*>(event)->button() == Qt::LeftButton) {
    emit LargeAsked();
    return true;
  }
  if (event->type() == QEvent::Enter)
    FocusUnlessTyping(canvas_);
  else if (event->type() == QEvent::Show)
    Ask(); // what was asked for while it was hidden was not drawn
  return QWidget::eventFilter(object, event);
}

} // namespace echorama
