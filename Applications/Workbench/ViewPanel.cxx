// SPDX-License-Identifier: BSD-3-Clause
#include "ViewPanel.h"
#include "Controls.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundSliceView.h"
#include "Workbench.h"
#include <cmath>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QGroupBox>
#include <QHBoxLayout>
#include <QVBoxLayout>

namespace echorama {

ViewPanel::ViewPanel(Workbench* bench, ViewGrid* views, QWidget* parent) : QWidget(parent), bench_(bench), views_(views)
{
  setObjectName("viewPanel");
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 0, 6, 4);
  layout->addWidget(SliceControls());
  layout->addWidget(ObliqueControls());
  layout->addWidget(VolumeControls());
  layout->addStretch(1);
  for (SlicePane* pane : views->Slices())
    for (auto changed : {&SliceCanvas::PlaneChanged, &SliceCanvas::Drawn}) // linked planes move without a word of their own
      connect(pane->Canvas(), changed, this, &ViewPanel::ShowOblique);
  connect(bench, &Workbench::LookChanged, this, &ViewPanel::ShowLook);
  connect(bench, &Workbench::VolumesChanged, this, &ViewPanel::ShowWindow);
  ShowLook();
  ShowWindow();
}

QWidget* ViewPanel::SliceControls()
{
  auto* box = new QGroupBox(tr("Slices"), this);
  auto* form = new QFormLayout(box);
  form->setContentsMargins(2, 2, 2, 2);
  shown_ = ChoiceField(box, "shown", tr("Which volumes slices show (A all, S selected, O others, Space switches)"),
                       {{"all", tr("All")}, {"selected", tr("Selected")}, {"others", tr("Others")}},
                       bench_->Setter(&SliceLook::shown));
  mode_ = ChoiceField(box, "mode", tr("How volumes that overlap are shown (B blend, D difference, K checkerboard)"),
                      {{"blend", tr("Blend")}, {"difference", tr("Difference")}, {"checkerboard", tr("Checkerboard")}},
                      bench_->Setter(&SliceLook::mode));
  interpolation_ = ChoiceField(box, "interpolation", tr("Between voxels (N switches)"),
                               {{"linear", tr("Trilinear")}, {"nearest", tr("Nearest voxel")}},
                               [this](const QString& word) { bench_->Set(&SliceLook::linear, word == "linear"); });
  squares_ = NumberField(box, {"squares", tr("Side of the squares of the checkerboard, pixels"), 4.0, 400.0, 0, 10.0, " px"},
                         bench_->Setter(&SliceLook::squarePixels));
  const auto setWindow = [this](double) { bench_->Session()->SetGreyWindow(black_->value(), white_->value()); };
  black_ = NumberField(box,
                       {"black",
                        tr("Grey level that is drawn black (right drag in a slice changes both, G brings them back)"),
                        -1e6,
                        1e6,
                        0,
                        5.0,
                        {}},
                       setWindow);
  white_ = NumberField(box,
                       {"white",
                        tr("Grey level that is drawn white (right drag in a slice changes both, G brings them back)"),
                        -1e6,
                        1e6,
                        0,
                        5.0,
                        {}},
                       setWindow);
  form->addRow(tr("Show"), shown_);
  form->addRow(tr("Mode"), mode_);
  form->addRow(tr("Voxels"), interpolation_);
  form->addRow(tr("Squares"), squares_);
  form->addRow(tr("Black"), black_);
  form->addRow(tr("White"), white_);
  return box;
}

QWidget* ViewPanel::ObliqueControls()
{
  auto* box = new QGroupBox(tr("Plane in numbers"), this);
  auto* form = new QFormLayout(box);
  form->setContentsMargins(2, 2, 2, 2);
  obliqueIn_ = ChoiceField(box, "obliqueIn", tr("The slice whose plane this is"),
                           {{"0", tr("Upper left")}, {"1", tr("Upper right")}, {"2", tr("Lower left")}},
                           [this](const QString&) { ShowOblique(); });
  const QString help =
      tr("The direction that the slice is seen from (left, posterior, superior); any length. It becomes oblique. Shift "
         "and middle drag in the slice turns it, too.");
  auto* row = new QVBoxLayout; // one below the other: side by side they would be cut off
  row->setSpacing(2);
  const char* const names[] = {"normalX", "normalY", "normalZ"};
  for (int axis = 0; axis < 3; ++axis) {
    normal_[axis] = NumberField(box, {names[axis], help, -1000.0, 1000.0, 4, 0.1, {}}, [this](double) { SetOblique(); });
    normal_[axis]->setButtonSymbols(QAbstractSpinBox::NoButtons);
    row->addWidget(normal_[axis]);
  }
  offset_ = NumberField(
      box,
      {"planeOffset", tr("How far the plane is from the origin of the world, along its normal"), -1e5, 1e5, 2, 1.0, tr(" mm")},
      [this](double) { SetOblique(); });
  form->addRow(tr("Of"), obliqueIn_);
  form->addRow(tr("Normal"), row);
  form->addRow(tr("Offset"), offset_);
  ShowOblique();
  return box;
}

// As the fields say. A plane along an axis stays one when only its offset changed.
void ViewPanel::SetOblique()
{
  SlicePane* pane = views_->Slices()[static_cast<std::size_t>(obliqueIn_->currentIndex())];
  vtkUltrasoundSliceView* view = pane->Canvas()->View();
  const Eigen::Vector3d normal(normal_[0]->value(), normal_[1]->value(), normal_[2]->value());
  const double offset = offset_->value(); // fields follow the plane
  if (!(normal.norm() > 0.0)) {
    bench_->Note(tr("A plane needs a normal that is not zero."));
    return ShowOblique();
  }
  const SliceFrame before = view->GetFrame();
  const Eigen::Vector3d unit = normal.normalized();
  // Numbers that were only rounded are no other direction.
  if ((unit - before.Towards()).norm() > 2e-4) {
    // What is up stays up, unless it is the normal now.
    const Eigen::Vector3d up = std::abs(before.up.dot(unit)) < 0.99 ? before.up : before.right;
    view->SetNormalAndUp(unit.x(), unit.y(), unit.z(), up.x(), up.y(), up.z());
  }
  const SliceFrame& now = view->GetFrame();
  const Eigen::Vector3d cursor = now.cursor + (offset - now.cursor.dot(now.Towards())) * now.Towards();
  view->SetCursor(cursor.x(), cursor.y(), cursor.z());
  pane->Canvas()->SetPlaced(true);
  pane->Canvas()->Ask();
  emit pane->Canvas()->PlaneChanged();
}

void ViewPanel::ShowOblique()
{
  const SliceFrame& frame = views_->Slices()[static_cast<std::size_t>(obliqueIn_->currentIndex())]->Canvas()->View()->GetFrame();
  const Eigen::Vector3d normal = frame.Towards();
  for (int axis = 0; axis < 3; ++axis)
    Show(normal_[axis], normal[axis] + 0.0);
  Show(offset_, frame.focus.dot(normal));
}

QWidget* ViewPanel::VolumeControls()
{
  auto* box = new QGroupBox(tr("3D view"), this);
  auto* form = new QFormLayout(box);
  form->setContentsMargins(2, 2, 2, 2);
  style_ = ChoiceField(box, "style", tr("How volumes are drawn in 3D"),
                       {{"points", tr("Particles")}, {"volume", tr("Volume")}, {"outline", tr("Outline")}},
                       bench_->Setter(&VolumeLook::style));
  downsampling_ = NumberField(
      box,
      {"downsampling", tr("One particle for so many voxels along each axis; more is faster and coarser"), 1.0, 64.0, 0, 1.0, {}},
      bench_->Setter(&VolumeLook::downsampling));
  particleSize_ = NumberField(box, {"particleSize", tr("Size of particles; at 1 they touch"), 0.1, 10.0, 2, 0.1, {}},
                              bench_->Setter(&VolumeLook::particleSize));
  opacity_ = NumberField(box, {"volumeOpacity", tr("Opacity; lower values let you see into the volumes"), 0.0, 1.0, 2, 0.05, {}},
                         bench_->Setter(&VolumeLook::opacity));
  valueOpacity_ = CheckField(this, "valueOpacity", tr("Dark is transparent"),
                             tr("Opacity grows with the grey level, so that fluid and shadows are seen through"),
                             bench_->Setter(&VolumeLook::valueOpacity));
  minimum_ = NumberField(box, {"minimum", tr("Darker voxels are hidden in 3D"), -1e6, 1e6, 0, 5.0, {}},
                         bench_->Setter(&VolumeLook::minimum));
  maximum_ = NumberField(box, {"maximum", tr("Brighter voxels are hidden in 3D"), -1e6, 1e6, 0, 5.0, {}},
                         bench_->Setter(&VolumeLook::maximum));
  slices_ = CheckField(this, "slicesIn3D", tr("Slices in 3D"), tr("Draws the slices with their pictures in the 3D view"),
                       bench_->Setter(&VolumeLook::slices));
  form->addRow(tr("Drawn as"), style_);
  form->addRow(tr("Downsampling"), downsampling_);
  form->addRow(tr("Particle size"), particleSize_);
  form->addRow(tr("Opacity"), opacity_);
  form->addRow(valueOpacity_);
  form->addRow(tr("Hide below"), minimum_);
  form->addRow(tr("Hide above"), maximum_);
  form->addRow(slices_);
  return box;
}

void ViewPanel::ShowLook()
{
  const SliceLook& slices = bench_->Slices();
  Show(shown_, slices.shown);
  Show(mode_, slices.mode);
  Show(interpolation_, slices.linear ? "linear" : "nearest");
  Show(squares_, slices.squarePixels);
  squares_->setEnabled(slices.mode == "checkerboard");
  const VolumeLook& volume = bench_->Volume();
  Show(style_, volume.style);
  Show(downsampling_, volume.downsampling);
  Show(particleSize_, volume.particleSize);
  Show(opacity_, volume.opacity);
  Show(minimum_, volume.minimum);
  Show(maximum_, volume.maximum);
  Show(valueOpacity_, volume.valueOpacity);
  Show(slices_, volume.slices);
  for (QWidget* field : {static_cast<QWidget*>(downsampling_), static_cast<QWidget*>(particleSize_)})
    field->setEnabled(volume.style == "points");
  for (QWidget* field : {static_cast<QWidget*>(opacity_), static_cast<QWidget*>(valueOpacity_), static_cast<QWidget*>(minimum_),
                         static_cast<QWidget*>(maximum_)})
    field->setEnabled(volume.style != "outline");
}

void ViewPanel::ShowWindow()
{
  double window[2];
  bench_->Session()->GetGreyWindow(window);
  Show(black_, window[0]);
  Show(white_, window[1]);
}

} // namespace echorama
