// SPDX-License-Identifier: BSD-3-Clause
#include "AlignmentHandles.h"
#include "vtkUltrasoundAlignmentWidget.h"
#include "Workbench.h"
#include <vtkCommand.h>
#include <vtkRenderer.h>
#include <vtkRenderWindowInteractor.h>

namespace echorama {

AlignmentHandles::AlignmentHandles(Workbench* bench, vtkRenderWindowInteractor* interactor, vtkRenderer* renderer,
                                   QObject* parent)
  : QObject(parent), bench_(bench), widget_(vtkSmartPointer<vtkUltrasoundAlignmentWidget>::New())
{
  widget_->SetInteractor(interactor);
  widget_->SetDefaultRenderer(renderer);
  widget_->SetSession(bench->Session());
  widget_->AddObserver(vtkCommand::StartInteractionEvent, this, &AlignmentHandles::OnWidgetEvent);
  widget_->AddObserver(vtkCommand::EndInteractionEvent, this, &AlignmentHandles::OnWidgetEvent);
  connect(bench, &Workbench::ToolChanged, this, &AlignmentHandles::Follow);
  connect(bench, &Workbench::HandChanged, this, &AlignmentHandles::Follow);
  connect(bench, &Workbench::SelectionChanged, this, &AlignmentHandles::Follow);
  Follow();
}

AlignmentHandles::~AlignmentHandles()
{
  widget_->RemoveAllObservers();
  widget_->SetEnabled(false);
  widget_->SetInteractor(nullptr);
}

vtkUltrasoundAlignmentWidget* AlignmentHandles::Widget() const
{
  return widget_;
}

void AlignmentHandles::Follow()
{
  const Handling& hand = bench_->Hand();
  widget_->SetTranslationSensitivity(hand.translationSensitivity);
  widget_->SetRotationSensitivity(hand.rotationSensitivity);
  widget_->SetTranslationStep(hand.translationStepMm);
  widget_->SetRotationStep(hand.rotationStepDegrees);
  const bool isWanted = bench_->CurrentTool() == Tool::Align;
  if (isWanted != static_cast<bool>(widget_->GetEnabled()))
    widget_->SetEnabled(isWanted);
}

void AlignmentHandles::OnWidgetEvent(vtkObject*, unsigned long event, void*)
{
  bench_->SetInteracting(event == vtkCommand::StartInteractionEvent);
}

} // namespace echorama
