// SPDX-License-Identifier: BSD-3-Clause
#include "ViewGrid.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "VolumePane.h"
#include "vtkUltrasoundSliceView.h"
#include "Workbench.h"
#include <QApplication>
#include <QSplitter>
#include <QVBoxLayout>
#include <QVTKOpenGLNativeWidget.h>

namespace echorama {

ViewGrid::ViewGrid(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench)
{
  setObjectName("views");
  rows_ = new QSplitter(Qt::Vertical, this);
  above_ = new QSplitter(Qt::Horizontal, rows_);
  below_ = new QSplitter(Qt::Horizontal, rows_);
  slices_ = {new SlicePane(bench, "slice1", "z", above_), new SlicePane(bench, "slice2", "y", above_),
             new SlicePane(bench, "slice3", "x", below_)};
  volume_ = new VolumePane(bench, below_);
  for (QSplitter* splitter : {rows_, above_, below_}) {
    splitter->setChildrenCollapsible(false);
    splitter->setSizes({1000, 1000});
    splitter->setHandleWidth(4);
  }
  // One cross of borders: the two rows are divided at the same place.
  connect(above_, &QSplitter::splitterMoved, below_, [this] { below_->setSizes(above_->sizes()); });
  connect(below_, &QSplitter::splitterMoved, above_, [this] { above_->setSizes(below_->sizes()); });
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(rows_);

  for (SlicePane* pane : slices_) {
    volume_->AddSlice(pane->Canvas());
    connect(pane, &SlicePane::LargeAsked, this, [this, pane] { ToggleLarge(pane); });
    connect(pane->Canvas(), &SliceCanvas::PlaneChanged, this, [this, pane] { FollowSlice(pane); });
  }
  connect(volume_, &VolumePane::LargeAsked, this, [this] { ToggleLarge(volume_); });
  connect(bench, &Workbench::VolumesChanged, this, [this, bench] { FitToNew(bench->Session()->GetNumberOfVolumes()); });
  connect(bench, &Workbench::PairAsked, this, &ViewGrid::CentreOnOverlap);
  SetLinked(true);
}

// Volumes come one after the other: all are to be seen, until somebody has chosen what to look at.
void ViewGrid::FitToNew(int volumes)
{
  bool isPlaced = false;
  for (const SlicePane* pane : slices_)
    isPlaced = isPlaced || pane->Canvas()->IsPlaced();
  if (volumes > volumes_ && (!isPlaced || volumes_ == 0))
    for (SlicePane* pane : slices_)
      pane->Fit();
  volumes_ = volumes;
}

// The middle of what both show; of volumes that do not overlap the middle between them.
void ViewGrid::CentreOnOverlap(int a, int b)
{
  const auto& state = bench_->Session()->GetKernel().State();
  const SessionVolume *one = state.Find(a), *other = state.Find(b);
  if (!one || !other)
    return;
  constexpr int Places = 24; // along each axis
  const ImageGeometry geometry = one->geometry.Moved(one->volumeToWorld);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (int n = 0; n < Places * Places * Places; ++n) {
    Eigen::Vector3d index(n % Places, n / Places % Places, n / (Places * Places));
    for (int axis = 0; axis < 3; ++axis)
      index[axis] = (index[axis] + 0.5) / Places * geometry.dimensions[static_cast<std::size_t>(axis)] - 0.5;
    const Eigen::Vector3d place = geometry.IndexToWorld() * index;
    if (bench_->Session()->GetVoxelAt(a, place.data()) >= 0 && bench_->Session()->GetVoxelAt(b, place.data()) >= 0) {
      sum += place;
      ++count;
    }
  }
  const Eigen::Vector3d middle =
      count > 0 ? Eigen::Vector3d(sum / count)
                : Eigen::Vector3d(0.5 * (geometry.Centre() + other->geometry.Moved(other->volumeToWorld).Centre()));
  CentreOn(middle);
}

void ViewGrid::CentreOn(const Eigen::Vector3d& place)
{
  slices_[0]->Canvas()->View()->SetCursor(place.x(), place.y(), place.z());
  for (SlicePane* pane : slices_) {
    pane->Canvas()->View()->SetFocus(place.x(), place.y(), place.z());
    pane->Canvas()->SetPlaced(true);
    pane->ShowPlane();
    pane->Canvas()->Ask();
  }
}

QVector<QWidget*> ViewGrid::Views() const
{
  return {slices_[0], slices_[1], slices_[2], volume_};
}

void ViewGrid::SetLinked(bool linked)
{
  if (linked == linked_)
    return;
  linked_ = linked;
  for (std::size_t i = 1; i < slices_.size(); i++)
    if (linked)
      slices_[i]->Canvas()->View()->LinkTo(slices_[0]->Canvas()->View());
  if (!linked)
    for (SlicePane* pane : slices_)
      pane->Canvas()->View()->Unlink();
  FollowSlice(slices_[0]);
}

// The views have told each other already; here the others' controls and the 3D view follow.
void ViewGrid::FollowSlice(SlicePane* changed)
{
  for (SlicePane* pane : slices_)
    if (pane != changed && linked_) {
      pane->ShowPlane();
      pane->Canvas()->Ask();
    }
}

QWidget* ViewGrid::CurrentView() const
{
  const QWidget* focused = QApplication::focusWidget();
  for (QWidget* view : Views())
    if (view->underMouse() && view->isVisible())
      return view;
  for (QWidget* view : Views())
    if (focused && view->isAncestorOf(focused))
      return view;
  return large_ ? large_ : slices_[0];
}

SlicePane* ViewGrid::CurrentSlice() const
{
  auto* slice = qobject_cast<SlicePane*>(CurrentView());
  return slice ? slice : slices_[0];
}

void ViewGrid::ToggleLarge(QWidget* view)
{
  large_ = large_ ? nullptr : view;
  for (QWidget* other : Views())
    other->setVisible(!large_ || other == large_);
  above_->setVisible(!large_ || above_->isAncestorOf(large_));
  below_->setVisible(!large_ || below_->isAncestorOf(large_));
}

void ViewGrid::Fit()
{
  for (SlicePane* pane : slices_)
    pane->Fit();
  volume_->Fit();
}

} // namespace echorama
