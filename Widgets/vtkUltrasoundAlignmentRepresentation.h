// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAlignmentRepresentation
 * @brief the geometry of vtkUltrasoundAlignmentWidget: handles, what is under the mouse, and what its motion means
 *
 * Shows handles around the centre of rotation of a vtkUltrasoundAlignmentSession, as large on the screen at any zoom and over all
 * else, and moves what is selected there. In a slice (a renderer with a parallel camera: the slice lies across the view, through
 * the focal point) there are two arrows, a square and a ring in the plane, along the world's axes where the slice is across one,
 * and volumes are taken hold of where they are seen. In 3D there are three of each along the world's axes, and a ring that faces
 * the viewer. SetSlice() says which it is when the camera does not: a parallel 3D view.
 *
 * Positions are those of the mouse's events: pixels from the lower left of the window.
 *
 * @sa vtkUltrasoundAlignmentWidget, vtkUltrasoundAlignmentSession
 */
#ifndef vtkUltrasoundAlignmentRepresentation_h
#define vtkUltrasoundAlignmentRepresentation_h

#include "EchoramaWidgetsModule.h"
#include "vtkWidgetRepresentation.h"
#ifndef __VTK_WRAP__
#include <memory>
#include <vector>
#endif
#include <string>

class vtkMatrix4x4;
class vtkUltrasoundAlignmentSession;

class ECHORAMAWIDGETS_EXPORT vtkUltrasoundAlignmentRepresentation : public vtkWidgetRepresentation {
public:
  static vtkUltrasoundAlignmentRepresentation* New();
  vtkTypeMacro(vtkUltrasoundAlignmentRepresentation, vtkWidgetRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** What is under the mouse. In a slice the axes of arrows and the normals of squares and rings are X, Y and Z when they are the
   * world's; else those of the view: X to the right, Y upwards, Z towards the viewer. */
  enum InteractionStates {
    Outside = 0,
    OnCentre, ///< moves the centre of rotation
    OnArrowX,
    OnArrowY,
    OnArrowZ,
    OnSquareX, ///< moves in the plane across the axis
    OnSquareY,
    OnSquareZ,
    OnRingX,
    OnRingY,
    OnRingZ,
    OnViewRing, ///< turns about the line of sight
    OnSelected, ///< in a slice: a selected volume is seen here
    OnOther     ///< in a slice: volumes are seen here, none of them selected
  };

  ///@{
  /** The session whose selection is moved. Observed by nobody here: render when it changes. Default none. */
  void SetSession(vtkUltrasoundAlignmentSession* session);
  vtkUltrasoundAlignmentSession* GetSession() const;
  ///@}

  ///@{
  /** Whether the view is a slice: "automatic" (default: when the camera's projection is parallel), "slice" or "3d". Another name
   * is an error and changes nothing. */
  void SetViewKind(const char* name);
  const char* GetViewKind() const { return this->ViewKind.c_str(); }
  bool IsSlice() const;
  ///@}

  ///@{
  /** How far things go with the mouse or tool, as a factor of what follows it, in [0.001, 1000]. Default 1. */
  vtkSetClampMacro(TranslationSensitivity, double, 0.001, 1000.0);
  vtkGetMacro(TranslationSensitivity, double);
  vtkSetClampMacro(RotationSensitivity, double, 0.001, 1000.0);
  vtkGetMacro(RotationSensitivity, double);
  ///@}

  ///@{
  /**
   * What drags of volumes and tools are held to: "free" (default), an axis of the world ("x", "y", "z": along it and about it) or
   * a plane across one ("yz", "xz", "xy": in it, and about its normal). Handles are their own constraint. Another name is an
   * error and changes nothing.
   */
  void SetConstraint(const char* name);
  const char* GetConstraint() const { return this->Constraint.c_str(); }
  ///@}

  ///@{
  /** Size of the handles as a factor, in [0.2, 5]. Default 1: arrows of 100 pixels. */
  vtkSetClampMacro(HandleScale, double, 0.2, 5.0);
  vtkGetMacro(HandleScale, double);
  ///@}

  ///@{
  /** Whether handles are drawn and can be taken hold of. Default on. */
  vtkSetMacro(ShowHandles, bool);
  vtkGetMacro(ShowHandles, bool);
  vtkBooleanMacro(ShowHandles, bool);
  ///@}

  /** What is under a position; it is remembered as the interaction state. Handles win over volumes. */
  int ComputeInteractionState(int x, int y, int modify = 0) override;

  ///@{
  /**
   * A drag of what the interaction state says: Start opens an edit of the session, Widget moves what was selected at the start to
   * where the mouse wants it, End closes the edit; Cancel brings everything back. Volumes that are gone meanwhile are left out.
   * With \a turn a drag of volumes turns them: in a slice about the line of sight, in 3D like a ball whose front follows the
   * mouse.
   */
  void StartWidgetInteraction(double position[2]) override { this->Start(position, false); }
  void StartTurning(double position[2]) { this->Start(position, true); }
  void WidgetInteraction(double position[2]) override;
  void EndWidgetInteraction(double position[2]) override;
  void CancelInteraction();
  bool IsInteracting() const;
  ///@}

  /** See vtkUltrasoundAlignmentWidget::StepTool. */
  bool StepTool(vtkMatrix4x4* toolToWorld, bool grasping);

  ///@{
  /** One edit each: moves the selection along the axes of the view (right, up, towards the viewer), mm, and turns it about the
   * centre of rotation by a rotation vector along them, degrees. Sensitivity and constraint do not count. False: nothing is
   * selected. */
  bool TranslateInView(double right, double up, double towards) { return this->MoveInView(false, right, up, towards); }
  bool RotateInView(double right, double up, double towards) { return this->MoveInView(true, right, up, towards); }
  ///@}

  ///@{
  /** Volumes (ids) that are seen at a position of a slice, the last of the session first: visible, and real there. Returns how
   * many. */
  int GetNumberOfVolumesAt(double x, double y) const { return static_cast<int>(this->VolumesAt(x, y).size()); }
  int GetVolumeAt(double x, double y, int which = 0) const; ///< -1: none
  ///@}
  /**
   * Selects what is seen there alone; where several are seen and the one selected is one of them, the next below. \a add: adds it
   * to the selection, or takes it away again. False: nothing is seen there.
   */
  bool SelectAt(double x, double y, bool add);

  ///@{
  /** The point of the world at a position: of a slice in its plane, else at the depth of the centre of rotation; and where a
   * point is seen. False without a renderer, or for a point behind the viewer. */
  bool PositionToWorld(double x, double y, double world[3]) const;
  bool WorldToPosition(const double world[3], double position[2]) const;
  ///@}
  /** Where a handle can be taken hold of: the tip of an arrow, the middle of a square, a point of a ring in front of the others.
   * False when it is not shown. */
  bool GetHandlePosition(int state, double position[2]);

  /** Marks the handle of the interaction state (or nothing). */
  void Highlight(int on) override;

  ///@{
  /** As every widget representation. */
  void SetRenderer(vtkRenderer* renderer) override;
  void BuildRepresentation() override;
  void ReleaseGraphicsResources(vtkWindow* window) override;
  int RenderOverlay(vtkViewport* viewport) override;
  void GetActors2D(vtkPropCollection* actors) override;
  ///@}

protected:
  vtkUltrasoundAlignmentRepresentation();
  ~vtkUltrasoundAlignmentRepresentation() override;

private:
  vtkUltrasoundAlignmentRepresentation(const vtkUltrasoundAlignmentRepresentation&) = delete;
  void operator=(const vtkUltrasoundAlignmentRepresentation&) = delete;

#ifndef __VTK_WRAP__
  void MakeHandles();
  void Start(double position[2], bool turn);
  bool MoveInView(bool turn, double right, double up, double towards);
  std::vector<int> VolumesAt(double x, double y) const;

  double TranslationSensitivity = 1.0;
  double RotationSensitivity = 1.0;
  double HandleScale = 1.0;
  bool ShowHandles = true;
  std::string ViewKind = "automatic";
  std::string Constraint = "free";
  struct Internals;
  std::unique_ptr<Internals> Parts;
#endif
};

#endif
