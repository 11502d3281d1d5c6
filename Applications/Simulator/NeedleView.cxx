// SPDX-License-Identifier: BSD-3-Clause
#include "NeedleView.h"
#include "NeedleTool.h"
#include <vtkActor.h>
#include <vtkLineSource.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSphereSource.h>
#include <vtkTubeFilter.h>

namespace echorama {

namespace {

constexpr double ShaftMm = 0.7, BallMm = 2.6; ///< radii; thicker than real ones, to be seen

} // namespace

NeedleView::NeedleView(vtkRenderer* renderer)
{
  vtkNew<vtkTubeFilter> tube;
  tube->SetInputConnection(line_->GetOutputPort());
  tube->SetRadius(ShaftMm);
  tube->SetNumberOfSides(10);
  tube->CappingOn();
  ball_->SetRadius(BallMm);
  ball_->SetThetaResolution(16);
  ball_->SetPhiResolution(12);
  vtkNew<vtkPolyDataMapper> shaftMapper, endMapper;
  shaftMapper->SetInputConnection(tube->GetOutputPort());
  endMapper->SetInputConnection(ball_->GetOutputPort());
  shaft_->SetMapper(shaftMapper);
  shaft_->GetProperty()->SetColor(0.95, 0.95, 0.8);
  end_->SetMapper(endMapper);
  end_->GetProperty()->SetColor(0.45, 0.85, 0.55);
  for (vtkActor* actor : {shaft_.Get(), end_.Get()}) {
    actor->SetVisibility(false);
    renderer->AddActor(actor);
  }
}

NeedleView::~NeedleView() = default;

void NeedleView::Show(const NeedleTool& needle, double lengthMm)
{
  for (vtkActor* actor : {shaft_.Get(), end_.Get()})
    actor->SetVisibility(needle.IsShown());
  if (!needle.IsShown())
    return;
  const Needle now = needle.Now();
  const Eigen::Vector3d end = needle.IsBlind() && needle.InsideMm() > 0.0 ? needle.Entry() : now.tip;
  hub_ = now.tip - lengthMm * now.direction;
  line_->SetPoint1(end[0], end[1], end[2]);
  line_->SetPoint2(hub_[0], hub_[1], hub_[2]);
  ball_->SetCenter(hub_[0], hub_[1], hub_[2]);
}

} // namespace echorama
