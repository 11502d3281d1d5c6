// SPDX-License-Identifier: BSD-3-Clause
#include "AlignmentHandles.h"
#include "vtkUltrasoundAlignmentWidget.h"
#include "Workbench.h"
#include <algorithm>
#include <QAbstractButton>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QTextEdit>
#include <vtkCommand.h>
#include <vtkRenderer.h>
#include <vtkRenderWindowInteractor.h>

namespace echorama {

void FocusUnlessTyping(QWidget* view)
{
  const QWidget* focused = QApplication::focusWidget();
  if (focused == view || QApplication::activePopupWidget() || QApplication::activeModalWidget())
    return;
  // A button was reached by Tab, or is the answer to a question.
  bool isTyping = qobject_cast<const QAbstractButton*>(focused) || qobject_cast<const QLineEdit*>(focused) ||
                  qobject_cast<const QTextEdit*>(focused) || qobject_cast<const QPlainTextEdit*>(focused);
  if (qobject_cast<const QAbstractSpinBox*>(focused)) {
    const auto* text = focused->findChild<QLineEdit*>();
    isTyping = text && text->isModified(); // a field that was only stepped or tabbed to gives the keys away
  }
  if (!isTyping)
    view->setFocus(Qt::MouseFocusReason);
}

AlignmentHandles::AlignmentHandles(Workbench* bench, vtkRenderWindowInteractor* interactor, vtkRenderer* renderer,
                                   QObject* parent)
  : QObject(parent), bench_(bench), widget_(vtkSmartPointer<vtkUltrasoundAlignmentWidget>::New())
{
  widget_->SetInteractor(interactor);
  widget_->SetDefaultRenderer(renderer);
  widget_->SetSession(bench->Session());
  widget_->AddObserver(vtkCommand::StartInteractionEvent, this, &AlignmentHandles::OnWidgetEvent);
  widget_->AddObserver(vtkCommand::EndInteractionEvent, this, &AlignmentHandles::OnWidgetEvent);
  widget_->AddObserver(vtkCommand::ModifiedEvent, this, &AlignmentHandles::OnKey);
  connect(bench, &QObject::destroyed, this, [this] { widget_->RemoveAllObservers(); }); // a window that closes
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
  isFollowing_ = true;
  const auto* view = qobject_cast<const QWidget*>(parent()); // handles are as large for the eye on any screen
  widget_->GetAlignmentRepresentation()->SetHandleScale(view ? view->devicePixelRatioF() : 1.0);
  widget_->SetTranslationSensitivity(hand.translationSensitivity);
  widget_->SetRotationSensitivity(hand.rotationSensitivity);
  widget_->SetTranslationStep(hand.translationStepMm);
  widget_->SetRotationStep(hand.rotationStepDegrees);
  widget_->SetConstraint(hand.constraint.toUtf8().constData());
  isFollowing_ = false;
  const bool isWanted = bench_->CurrentTool() == Tool::Align;
  if (isWanted != static_cast<bool>(widget_->GetEnabled()))
    widget_->SetEnabled(isWanted);
}

// A key changed a step or the constraint: so it is in all views and in the pose panel.
void AlignmentHandles::OnKey(vtkObject*, unsigned long, void*)
{
  Handling hand = bench_->Hand();
  const QString constraint = widget_->GetConstraint();
  const double mm = std::clamp(widget_->GetTranslationStep(), 0.001, 100.0), degrees = widget_->GetRotationStep();
  if (isFollowing_ || !widget_->GetInteractor() ||
      (hand.constraint == constraint && hand.translationStepMm == mm && hand.rotationStepDegrees == degrees))
    return;
  hand.constraint = constraint;
  hand.translationStepMm = mm;
  hand.rotationStepDegrees = degrees;
  bench_->Set(hand);
}

void AlignmentHandles::OnWidgetEvent(vtkObject*, unsigned long event, void*)
{
  bench_->SetInteracting(event == vtkCommand::StartInteractionEvent);
}

} // namespace echorama
