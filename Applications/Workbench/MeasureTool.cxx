// SPDX-License-Identifier: BSD-3-Clause
#include "MeasureTool.h"
#include "vtkUltrasoundSliceView.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QLineF>

namespace echorama {

namespace {

constexpr double Reach = 4.0;   // pixels that a hand trembles in a click
constexpr double DepthMm = 5.0; // of points that slices draw

Eigen::Vector3d PlaceAt(const vtkUltrasoundSliceView* view, const QPointF& pixel)
{
  Eigen::Vector3d place;
  view->PixelToWorld(pixel.x(), pixel.y(), place.data());
  return place;
}

} // namespace

MeasureTool::MeasureTool(Workbench* bench) : QObject(bench), bench_(bench)
{
  connect(bench, &Workbench::ToolChanged, this, &MeasureTool::Cancel);
}

bool MeasureTool::TakePointAt(const vtkUltrasoundSliceView* view, const QPointF& pixel, double reach)
{
  const SliceFrame& frame = view->GetFrame();
  dragged_ = 0;
  for (const Measurement& each : bench_->Session()->GetKernel().State().measurements)
    for (std::size_t i = 0; i < each.points.size(); ++i) {
      const double distance = (frame.PixelOf(each.points[i]) - Eigen::Vector2d(pixel.x(), pixel.y())).norm();
      if (distance > reach || std::abs(frame.DepthOf(each.points[i])) > DepthMm)
        continue;
      reach = distance;
      dragged_ = each.number;
      point_ = i;
    }
  return dragged_ > 0;
}

void MeasureTool::Press(const vtkUltrasoundSliceView* view, const QPointF& pixel, double reach)
{
  pressed_ = pixel;
  const Eigen::Vector3d place = PlaceAt(view, pixel);
  if (!draft_.empty()) {
    draft_.back() = place;
  } else if (TakePointAt(view, pixel, reach)) {
    bench_->Session()->BeginEdit(tr("Change measurement %1").arg(dragged_).toUtf8());
    Choose(dragged_);
  } else {
    draft_ = {place, place};
    isClick_ = true;
  }
  emit Changed();
}

void MeasureTool::Move(const vtkUltrasoundSliceView* view, const QPointF& pixel)
{
  const Eigen::Vector3d place = PlaceAt(view, pixel);
  if (dragged_ > 0) {
    const auto& all = bench_->Session()->GetKernel().State().measurements;
    const auto found = std::find_if(all.begin(), all.end(), [this](const Measurement& each) { return each.number == dragged_; });
    if (found == all.end() || point_ >= found->points.size())
      return;
    Measurement changed = *found;
    changed.points[point_] = place;
    bench_->Session()->SetMeasurement(changed);
  } else if (!draft_.empty()) {
    isClick_ = isClick_ && QLineF(pressed_, pixel).length() <= Reach;
    draft_.back() = place;
    emit Changed();
  }
}

void MeasureTool::Release(const vtkUltrasoundSliceView* view, const QPointF& pixel)
{
  if (dragged_ > 0) {
    dragged_ = 0;
    bench_->Session()->EndEdit();
  } else if (!draft_.empty()) {
    Move(view, pixel);
    if (!isClick_)
      Place();
    isClick_ = false;
  }
}

// The last point stays where it is.
void MeasureTool::Place()
{
  if (draft_.back() == draft_[draft_.size() - 2])
    return;
  const std::size_t wanted = bench_->CurrentTool() == Tool::Angle ? 3 : 2;
  if (draft_.size() < wanted) {
    draft_.push_back(draft_.back());
    emit Changed();
    return;
  }
  const int number = bench_->Session()->GetNextMeasurementNumber();
  const bool made = bench_->Session()->SetMeasurement({number, draft_});
  draft_.clear();
  if (made)
    chosen_ = number;
  emit Changed();
}

bool MeasureTool::Cancel()
{
  const bool was = dragged_ > 0 || !draft_.empty();
  if (dragged_ > 0)
    bench_->Session()->CancelEdit();
  dragged_ = 0;
  draft_.clear();
  isClick_ = false;
  if (was)
    emit Changed();
  return was;
}

void MeasureTool::Choose(int number)
{
  if (number == chosen_)
    return;
  chosen_ = number;
  emit Changed();
}

} // namespace echorama
