// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAlignmentWidget.h"

#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkEvent.h"
#include "vtkObjectFactory.h"
#include "vtkRenderer.h"
#include "vtkRenderWindow.h"
#include "vtkRenderWindowInteractor.h"
#include "vtkUltrasoundAlignmentRepresentation.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkWidgetCallbackMapper.h"
#include "vtkWidgetEvent.h"

#include <algorithm>
#include <cctype>

using Representation = vtkUltrasoundAlignmentRepresentation;

vtkStandardNewMacro(vtkUltrasoundAlignmentWidget);

namespace {
constexpr int ClickReach = 2; // pixels that a hand trembles during a click
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentWidget::vtkUltrasoundAlignmentWidget()
{
  this->KeyPressActivationOff(); // the key i would turn it off
  this->CallbackMapper->SetCallbackMethod(vtkCommand::LeftButtonPressEvent, vtkWidgetEvent::Select, this, SelectAction);
  this->CallbackMapper->SetCallbackMethod(vtkCommand::MouseMoveEvent, vtkWidgetEvent::Move, this, MoveAction);
  this->CallbackMapper->SetCallbackMethod(vtkCommand::LeftButtonReleaseEvent, vtkWidgetEvent::EndSelect, this, EndSelectAction);
  this->CallbackMapper->SetCallbackMethod(vtkCommand::LeaveEvent, vtkWidgetEvent::HoverLeave, this, LeaveAction);
  this->CallbackMapper->SetCallbackMethod(vtkCommand::KeyPressEvent, vtkWidgetEvent::ModifyEvent, this, KeyAction);
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentWidget::~vtkUltrasoundAlignmentWidget()
{
  this->CancelDrag();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::SetRepresentation(vtkUltrasoundAlignmentRepresentation* representation)
{
  this->CancelDrag();
  this->SetWidgetRepresentation(representation);
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentRepresentation* vtkUltrasoundAlignmentWidget::GetAlignmentRepresentation()
{
  this->CreateDefaultRepresentation();
  return static_cast<Representation*>(this->WidgetRep);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::CreateDefaultRepresentation()
{
  if (!this->WidgetRep) {
    this->WidgetRep = Representation::New();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::SetSession(vtkUltrasoundAlignmentSession* session)
{
  if (session != this->GetSession()) {
    this->CancelDrag();
    this->ToolHolds = false;
    this->GetAlignmentRepresentation()->SetSession(session);
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentWidget::StepTool(vtkMatrix4x4* toolToWorld, bool grasping)
{
  const bool begins = grasping && !this->ToolHolds, ends = !grasping && this->ToolHolds;
  const bool good = this->GetAlignmentRepresentation()->StepTool(toolToWorld, grasping);
  if (begins) {
    this->InvokeEvent(vtkCommand::StartInteractionEvent);
  }
  if (grasping || ends) {
    this->InvokeEvent(vtkCommand::InteractionEvent);
  }
  if (ends) {
    this->InvokeEvent(vtkCommand::EndInteractionEvent);
  }
  this->ToolHolds = grasping;
  if ((grasping || ends) && this->Interactor) {
    this->Render();
  }
  return good;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::CancelDrag()
{
  if (this->Now == Gesture::Drag) {
    this->GetAlignmentRepresentation()->CancelInteraction();
    this->Now = Gesture::Cancelled; // until the button is released
    this->InvokeEvent(vtkCommand::InteractionEvent);
    this->InvokeEvent(vtkCommand::EndInteractionEvent);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::SetEnabled(int enabling)
{
  if (!enabling && this->Now != Gesture::None) {
    this->CancelDrag();
    this->Release();
  }
  this->Superclass::SetEnabled(enabling);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::Begin(bool turn)
{
  Representation* representation = this->GetAlignmentRepresentation();
  if (turn) {
    representation->StartTurning(this->Pressed);
  } else {
    representation->StartWidgetInteraction(this->Pressed);
  }
  if (representation->IsInteracting()) {
    this->Now = Gesture::Drag;
    representation->Highlight(1);
    this->InvokeEvent(vtkCommand::StartInteractionEvent);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::Release()
{
  if (this->Now != Gesture::None) {
    this->Now = Gesture::None;
    this->ReleaseFocus();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::SelectAction(vtkAbstractWidget* widget)
{
  auto* self = static_cast<vtkUltrasoundAlignmentWidget*>(widget);
  const int x = self->Interactor->GetEventPosition()[0], y = self->Interactor->GetEventPosition()[1];
  if (self->Now != Gesture::None || !self->GetSession() || !self->CurrentRenderer || !self->CurrentRenderer->IsInViewport(x, y)) {
    return;
  }
  const bool shift = self->Interactor->GetShiftKey(), control = self->Interactor->GetControlKey();
  Representation* representation = self->GetAlignmentRepresentation();
  const int state = representation->ComputeInteractionState(x, y);
  const bool onVolume = state == Representation::OnSelected || state == Representation::OnOther;
  self->Pressed[0] = x;
  self->Pressed[1] = y;
  self->Moved = false;
  self->Adding = control;
  if (state == Representation::OnOther || (state == Representation::OnSelected && control)) {
    self->Now = Gesture::Click;
  } else if (state != Representation::Outside) {
    self->Begin(shift && onVolume);
  } else if (shift && !representation->IsSlice()) {
    self->Begin(true);
  }
  if (self->Now != Gesture::None) {
    self->GrabFocus(self->EventCallbackCommand);
    self->EventCallbackCommand->SetAbortFlag(1);
    self->Render();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::Hover(bool draw, bool here)
{
  const int x = this->Interactor->GetEventPosition()[0], y = this->Interactor->GetEventPosition()[1];
  here = here && this->GetSession() && this->CurrentRenderer && this->CurrentRenderer->IsInViewport(x, y);
  if (!here && !this->Hovers) { // the mouse belongs to others
    return;
  }
  this->Hovers = here;
  Representation* representation = this->GetAlignmentRepresentation();
  const vtkMTimeType before = representation->GetMTime();
  const int state = here ? representation->ComputeInteractionState(x, y) : static_cast<int>(Representation::Outside);
  representation->Highlight(here ? 1 : 0);
  this->RequestCursorShape(state == Representation::Outside      ? VTK_CURSOR_DEFAULT
                           : state == Representation::OnSelected ? VTK_CURSOR_SIZEALL
                                                                 : VTK_CURSOR_HAND);
  if (draw && representation->GetMTime() != before) {
    this->Render();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::MoveAction(vtkAbstractWidget* widget)
{
  auto* self = static_cast<vtkUltrasoundAlignmentWidget*>(widget);
  if (self->Now == Gesture::None) {
    self->Hover(true, true);
    return;
  }
  const int* event = self->Interactor->GetEventPosition();
  double position[2] = {static_cast<double>(event[0]), static_cast<double>(event[1])};
  self->Moved =
      self->Moved || std::max(std::abs(position[0] - self->Pressed[0]), std::abs(position[1] - self->Pressed[1])) > ClickReach;
  // Until the mouse has gone farther than a hand trembles it is a click, which moves nothing; from then on, all of its way
  // counts.
  if (self->Now == Gesture::Drag && self->Moved) {
    self->GetAlignmentRepresentation()->WidgetInteraction(position);
    self->InvokeEvent(vtkCommand::InteractionEvent);
    self->Render();
  }
  self->EventCallbackCommand->SetAbortFlag(1);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::LeaveAction(vtkAbstractWidget* widget)
{
  auto* self = static_cast<vtkUltrasoundAlignmentWidget*>(widget);
  if (self->Now == Gesture::None) {
    self->Hover(true, false);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::EndSelectAction(vtkAbstractWidget* widget)
{
  auto* self = static_cast<vtkUltrasoundAlignmentWidget*>(widget);
  if (self->Now == Gesture::None) {
    return;
  }
  Representation* representation = self->GetAlignmentRepresentation();
  const int* event = self->Interactor->GetEventPosition();
  double position[2] = {static_cast<double>(event[0]), static_cast<double>(event[1])};
  const bool onVolume = representation->GetInteractionState() == Representation::OnSelected;
  const Gesture gesture = self->Now;
  self->Release();
  if (gesture == Gesture::Drag) {
    representation->EndWidgetInteraction(self->Moved ? position : self->Pressed);
    self->InvokeEvent(vtkCommand::EndInteractionEvent);
  }
  if (!self->Moved && (gesture == Gesture::Click || (gesture == Gesture::Drag && onVolume))) {
    representation->SelectAt(self->Pressed[0], self->Pressed[1], self->Adding);
  }
  self->Hover(false, true);
  self->EventCallbackCommand->SetAbortFlag(1);
  self->Render();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::KeyAction(vtkAbstractWidget* widget)
{
  auto* self = static_cast<vtkUltrasoundAlignmentWidget*>(widget);
  const int x = self->Interactor->GetEventPosition()[0], y = self->Interactor->GetEventPosition()[1];
  // A drag may have left the view: its Escape is still meant.
  const bool here = self->Now != Gesture::None || (self->CurrentRenderer && self->CurrentRenderer->IsInViewport(x, y));
  if (!self->GetSession() || !here) {
    return;
  }
  const char* key = self->Interactor->GetKeySym();
  if (key && self->Key(key, self->Interactor->GetControlKey() != 0)) {
    self->EventCallbackCommand->SetAbortFlag(1);
    self->Render();
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentWidget::Key(const std::string& key, bool control)
{
  Representation* representation = this->GetAlignmentRepresentation();
  if (key == "Escape") {
    const bool dragging = this->IsDragging();
    this->CancelDrag();
    return dragging;
  }
  if (this->Now != Gesture::None) { // the hand is on the mouse
    return false;
  }

  // right, up, towards
  const struct {
    const char* Name;
    double Move[3], Turn[3];
  } steps[] = {
      {"Left", {-1, 0, 0}, {0, 0, 1}}, {"Right", {1, 0, 0}, {0, 0, -1}}, {"Up", {0, 1, 0}, {-1, 0, 0}},
      {"Down", {0, -1, 0}, {1, 0, 0}}, {"Prior", {0, 0, 1}, {0, 1, 0}},  {"Next", {0, 0, -1}, {0, -1, 0}},
  };
  for (const auto& step : steps) {
    if (key == step.Name) {
      if (this->GetSession()->GetNumberOfSelected() == 0) {
        return false;
      }
      this->InvokeEvent(vtkCommand::StartInteractionEvent);
      if (control) {
        const double by = this->RotationStep;
        representation->RotateInView(by * step.Turn[0], by * step.Turn[1], by * step.Turn[2]);
      } else {
        const double by = this->TranslationStep;
        representation->TranslateInView(by * step.Move[0], by * step.Move[1], by * step.Move[2]);
      }
      this->InvokeEvent(vtkCommand::InteractionEvent);
      this->InvokeEvent(vtkCommand::EndInteractionEvent);
      return true;
    }
  }
  if (control) { // Ctrl+Z and its kind belong to the window
    return false;
  }
  const bool more = key == "plus" || key == "KP_Add" || key == "equal"; // + without Shift
  if (more || key == "minus" || key == "KP_Subtract") {
    const double factor = more ? 2.0 : 0.5;
    this->SetTranslationStep(factor * this->TranslationStep);
    this->SetRotationStep(factor * this->RotationStep);
    return true;
  }
  if (key == "x" || key == "y" || key == "z") {
    const std::string now = this->GetConstraint(), plane = key == "x" ? "yz" : (key == "y" ? "xz" : "xy");
    this->SetConstraint(now == key ? plane.c_str() : (now == plane ? "free" : key.c_str()));
    this->Modified();
    return true;
  }
  if (key == "c" || key == "C") {
    double world[3];
    const int* position = this->Interactor->GetEventPosition();
    if (key == "C") {
      this->GetSession()->ResetCentreOfRotation();
    } else if (representation->PositionToWorld(position[0], position[1], world)) {
      this->GetSession()->SetCentreOfRotation(world[0], world[1], world[2]);
    }
    return true;
  }
  return false;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentWidget::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "TranslationStep: " << this->TranslationStep << "\n";
  os << indent << "RotationStep: " << this->RotationStep << "\n";
}
