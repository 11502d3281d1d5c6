// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAlignmentWidget
 * @brief moves and turns what is selected in a vtkUltrasoundAlignmentSession, by mouse, keys and tracker
 *
 * One widget per view: SetInteractor(), SetDefaultRenderer() when the window has several, SetSession(), On(). What it means is
 * computed by its vtkUltrasoundAlignmentRepresentation. A drag is one entry of undo; a click or a drag that comes back to where
 * it began is none.
 *
 * | event                                | what happens                                                                  |
 * | ------------------------------------ | ----------------------------------------------------------------------------- |
 * | drag a handle                        | arrow: along it; square: in its plane; ring: about it; ball: moves the centre |
 * | drag a selected volume (slice)       | moves all that is selected with the mouse                                     |
 * | Shift-drag a selected volume (slice) | turns all that is selected about the line of sight                            |
 * | Shift-drag (3D)                      | turns like a ball whose front follows the mouse                               |
 * | click on a volume (slice)            | selects it alone; click again: the next one below                             |
 * | Ctrl-click on a volume (slice)       | adds it to the selection, or takes it away                                    |
 * | arrows, Page Up, Page Down           | move by TranslationStep; pages: towards and away from the viewer              |
 * | Ctrl + left, right                   | turn by RotationStep in the plane of the view                                 |
 * | Ctrl + up, down                      | turn by RotationStep about the horizontal of the view                         |
 * | Ctrl + Page Up, Page Down            | turn by RotationStep about the vertical of the view                           |
 * | + and -                              | double and halve both steps                                                   |
 * | x, y, z                              | hold drags to this axis of the world; again: to the plane across; again: free |
 * | c, Shift + c                         | the centre of rotation goes under the mouse; back to the middle               |
 * | Escape                               | cancels the drag, also when the mouse has left the view                       |
 *
 * Mouse events that mean nothing here go on to the interactor's style. Invokes StartInteractionEvent, InteractionEvent and
 * EndInteractionEvent (drags, keys and tools), and ModifiedEvent when a key changed a step or the constraint.
 *
 * Source: dissertation 4.3.
 */
#ifndef vtkUltrasoundAlignmentWidget_h
#define vtkUltrasoundAlignmentWidget_h

#include "EchoramaWidgetsModule.h"
#include "vtkAbstractWidget.h"
#include "vtkUltrasoundAlignmentRepresentation.h"
#ifndef __VTK_WRAP__
#include <string>
#endif

class vtkMatrix4x4;
class vtkUltrasoundAlignmentSession;

class ECHORAMAWIDGETS_EXPORT vtkUltrasoundAlignmentWidget : public vtkAbstractWidget {
public:
  static vtkUltrasoundAlignmentWidget* New();
  vtkTypeMacro(vtkUltrasoundAlignmentWidget, vtkAbstractWidget);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The geometry. A default one is made when it is first asked for. */
  void SetRepresentation(vtkUltrasoundAlignmentRepresentation* representation);
  vtkUltrasoundAlignmentRepresentation* GetAlignmentRepresentation();
  void CreateDefaultRepresentation() override;
  ///@}

  ///@{
  /** Of the representation. A session that is taken away cancels the drag. */
  void SetSession(vtkUltrasoundAlignmentSession* session);
  vtkUltrasoundAlignmentSession* GetSession() { return this->GetAlignmentRepresentation()->GetSession(); }
  void SetTranslationSensitivity(double factor) { this->GetAlignmentRepresentation()->SetTranslationSensitivity(factor); }
  double GetTranslationSensitivity() { return this->GetAlignmentRepresentation()->GetTranslationSensitivity(); }
  void SetRotationSensitivity(double factor) { this->GetAlignmentRepresentation()->SetRotationSensitivity(factor); }
  double GetRotationSensitivity() { return this->GetAlignmentRepresentation()->GetRotationSensitivity(); }
  void SetConstraint(const char* name) { this->GetAlignmentRepresentation()->SetConstraint(name); }
  const char* GetConstraint() { return this->GetAlignmentRepresentation()->GetConstraint(); }
  ///@}

  ///@{
  /** Steps of the keys: mm in [0.001, 1000], default 1; degrees in [0.001, 90], default 1. */
  vtkSetClampMacro(TranslationStep, double, 0.001, 1000.0);
  vtkGetMacro(TranslationStep, double);
  vtkSetClampMacro(RotationStep, double, 0.001, 90.0);
  vtkGetMacro(RotationStep, double);
  ///@}

  /**
   * The pose of a six-degree tool, mm. From the first call with \a grasping on, what is selected follows the tool as if held in
   * the hand (by the sensitivities, and held to the constraint), until a call with it off: one edit. Returns false, with an
   * error, when the pose is not rigid; what is held then stays where it is.
   */
  bool StepTool(vtkMatrix4x4* toolToWorld, bool grasping);

  /** Whether something is dragged now; and brings it back. */
  bool IsDragging() { return this->Now == Gesture::Drag; }
  void CancelDrag();

  /** Turning it off cancels a drag. */
  void SetEnabled(int enabling) override;

protected:
  vtkUltrasoundAlignmentWidget();
  ~vtkUltrasoundAlignmentWidget() override;

  static void SelectAction(vtkAbstractWidget* widget);
  static void MoveAction(vtkAbstractWidget* widget);
  static void LeaveAction(vtkAbstractWidget* widget);
  static void EndSelectAction(vtkAbstractWidget* widget);
  static void KeyAction(vtkAbstractWidget* widget);

private:
  vtkUltrasoundAlignmentWidget(const vtkUltrasoundAlignmentWidget&) = delete;
  void operator=(const vtkUltrasoundAlignmentWidget&) = delete;

#ifndef __VTK_WRAP__
  enum class Gesture { None, Drag, Click, Cancelled };

  void Begin(bool turn);
  void Release();
  bool Key(const std::string& key, bool control);
  void Hover(bool draw, bool here);

  Gesture Now = Gesture::None;
  double TranslationStep = 1.0;
  double RotationStep = 1.0;
  double Pressed[2] = {0.0, 0.0};
  bool Moved = false;
  bool Adding = false;
  bool ToolHolds = false;
  bool Hovers = false;
#endif
};

#endif
