// SPDX-License-Identifier: BSD-3-Clause
// The handles, their picture and what a motion of the mouse means are kernels (Widgets/Session). Here is what they need of VTK:
// the view of a renderer, what is under the mouse, and the session whose volumes go with it.
#include "vtkUltrasoundAlignmentRepresentation.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/MatrixRows.h"
#include "vtkActor2D.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkMath.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper2D.h"
#include "vtkPropCollection.h"
#include "vtkRenderer.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUnsignedCharArray.h"
#include "Widgets/Session/HandlePicture.h"

#include <algorithm>
#include <cmath>
#include <optional>

using echorama::Drag;
using echorama::DragKind;
using echorama::Handle;
using echorama::MotionConstraint;
using echorama::MouseView;
using echorama::Pose;
using Eigen::Vector2d;
using Eigen::Vector3d;

vtkStandardNewMacro(vtkUltrasoundAlignmentRepresentation);

namespace {
template <class Vector>
void CopyTo(double* numbers, const Vector& vector)
{
  std::copy(vector.data(), vector.data() + vector.size(), numbers);
}

// \a corner: of the viewport in the window.
void Show(const echorama::HandlePicture& picture, const Vector2d& corner, vtkPolyData* data)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkUnsignedCharArray> colours;
  vtkNew<vtkCellArray> polygons;
  points->SetDataTypeToFloat();
  colours->SetNumberOfComponents(4);
  colours->SetName("Colours");
  for (std::size_t i = 0; i < picture.points.size(); ++i) {
    const Vector2d point = picture.points[i] - corner;
    points->InsertNextPoint(point.x(), point.y(), 0.0);
    colours->InsertNextTypedTuple(picture.colours[i].data());
  }
  for (const std::vector<int>& polygon : picture.polygons) {
    polygons->InsertNextCell(static_cast<int>(polygon.size()));
    for (const int point : polygon) {
      polygons->InsertCellPoint(point);
    }
  }
  data->Initialize();
  data->SetPoints(points);
  data->SetPolys(polygons);
  data->GetPointData()->SetScalars(colours);
}

MouseView ViewOf(vtkRenderer* renderer)
{
  MouseView view;
  view.mmPerPixel = 0.0; // not usable
  if (!renderer || !renderer->GetVTKWindow() || !renderer->IsActiveCameraCreated()) {
    return view;
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  const int* size = renderer->GetSize();
  const int* origin = renderer->GetOrigin();
  if (size[0] < 1 || size[1] < 1) {
    return view;
  }
  const Vector3d sight(camera->GetDirectionOfProjection()), up(camera->GetViewUp());
  view.focus = Vector3d(camera->GetFocalPoint());
  view.towards = -sight.normalized();
  view.right = sight.cross(up).normalized();
  view.up = view.towards.cross(view.right);
  const double* shift = camera->GetWindowCenter();
  view.middle = Vector2d(origin[0] + 0.5 * size[0] * (1.0 - shift[0]) - 0.5, origin[1] + 0.5 * size[1] * (1.0 - shift[1]) - 0.5);
  if (camera->GetParallelProjection()) {
    view.mmPerPixel = 2.0 * camera->GetParallelScale() / size[1];
  } else {
    view.eyeDistance = (view.focus - Vector3d(camera->GetPosition())).norm();
    const int across = camera->GetUseHorizontalViewAngle() ? size[0] : size[1];
    view.mmPerPixel = 2.0 * view.eyeDistance * std::tan(0.5 * vtkMath::RadiansFromDegrees(camera->GetViewAngle())) / across;
  }
  return view;
}
} // namespace

//----------------------------------------------------------------------------
struct vtkUltrasoundAlignmentRepresentation::Internals {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  echorama::HandleSizes Sizes;
  std::vector<Handle> Handles;
  bool AlongWorld = true;
  int MarkedState = Outside;
  vtkNew<vtkPolyData> Picture;
  vtkNew<vtkPolyDataMapper2D> Mapper;
  vtkNew<vtkActor2D> Actor;

  // What is held, by the mouse or by a tool, stays in its session whatever session is set.
  struct Held : echorama::AlignmentSession::Grip {
    vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  };
  std::optional<Held> Hand, ToolHand;
  std::optional<Drag> Mouse;
  std::optional<echorama::ToolDrag> Tool;
  bool MovesCentre = false;

  std::optional<Held> TakeHold() const
  {
    if (!this->Session || this->Session->GetNumberOfSelected() == 0) {
      return std::nullopt;
    }
    return Held{this->Session->GetKernel().TakeHold(), this->Session};
  }

  void BeginEdit(const char* verb, const char* how = "") const
  {
    this->Session->BeginEdit((this->Session->GetKernel().LabelOf(verb) + how).c_str());
  }

  int StateOf(const Handle& handle) const
  {
    const int axis = echorama::AxisOf(handle, this->AlongWorld);
    switch (handle.kind) {
    case Handle::Kind::Arrow:
      return OnArrowX + axis;
    case Handle::Kind::Square:
      return OnSquareX + axis;
    case Handle::Kind::Ring:
      return axis == 3 ? static_cast<int>(OnViewRing) : OnRingX + axis;
    default:
      return OnCentre;
    }
  }

  // The index of a handle; -1: there is none.
  int Find(int state) const
  {
    const auto found = std::find_if(this->Handles.begin(), this->Handles.end(),
                                    [&](const Handle& handle) { return this->StateOf(handle) == state; });
    return found == this->Handles.end() ? -1 : static_cast<int>(found - this->Handles.begin());
  }
};

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentRepresentation::vtkUltrasoundAlignmentRepresentation() : Parts(std::make_unique<Internals>())
{
  this->InteractionState = Outside;
  this->Parts->Mapper->SetInputData(this->Parts->Picture);
  this->Parts->Actor->SetMapper(this->Parts->Mapper);
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentRepresentation::~vtkUltrasoundAlignmentRepresentation() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::SetSession(vtkUltrasoundAlignmentSession* session)
{
  if (this->Parts->Session != session) {
    this->CancelInteraction();
    this->StepTool(nullptr, false);
    this->Parts->Session = session;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession* vtkUltrasoundAlignmentRepresentation::GetSession() const
{
  return this->Parts->Session;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::SetViewKind(const char* name)
{
  const std::string kind = name ? name : "";
  if (kind != "automatic" && kind != "slice" && kind != "3d") {
    vtkErrorMacro(<< "there is no kind of view \"" << kind << "\"; known are automatic, slice and 3d");
  } else if (kind != this->ViewKind) {
    this->ViewKind = kind;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::IsSlice() const
{
  if (this->ViewKind != "automatic") {
    return this->ViewKind == "slice";
  }
  return this->Renderer && this->Renderer->IsActiveCameraCreated() && this->Renderer->GetActiveCamera()->GetParallelProjection();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::SetConstraint(const char* name)
{
  const std::string wanted = name ? name : "";
  if (!echorama::ConstraintNamed(wanted)) {
    vtkErrorMacro(<< "there is no constraint \"" << wanted << "\"; known are free, x, y, z, yz, xz and xy");
  } else if (wanted != this->Constraint) {
    this->Constraint = wanted;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::SetRenderer(vtkRenderer* renderer)
{
  if (renderer != this->Renderer) {
    this->CancelInteraction(); // what the mouse means belongs to the view it was pressed in
  }
  this->Superclass::SetRenderer(renderer);
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentRepresentation::ComputeInteractionState(int x, int y, int)
{
  Internals& parts = *this->Parts;
  this->MakeHandles();
  const int handle = echorama::HandleAt(parts.Handles, Vector2d(x, y), parts.Sizes);
  this->InteractionState = Outside;
  if (handle >= 0) {
    this->InteractionState = parts.StateOf(parts.Handles[static_cast<std::size_t>(handle)]);
  } else {
    for (const int id : this->VolumesAt(x, y)) {
      this->InteractionState = parts.Session->IsSelected(id) || this->InteractionState == OnSelected ? OnSelected : OnOther;
    }
  }
  return this->InteractionState;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::Start(double position[2], bool turn)
{
  this->CancelInteraction();
  Internals& parts = *this->Parts;
  const MouseView view = ViewOf(this->Renderer);
  parts.Hand = parts.TakeHold();
  if (!parts.Hand || !view.Usable()) {
    parts.Hand.reset();
    return;
  }
  this->MakeHandles();

  const int state = this->InteractionState, index = parts.Find(state);
  const Handle* handle = index < 0 ? nullptr : &parts.Handles[static_cast<std::size_t>(index)];
  const MotionConstraint constraint = *echorama::ConstraintNamed(this->Constraint);
  const bool free = constraint.kind == MotionConstraint::Kind::Free;
  echorama::DragParameters drag;
  drag.centre = parts.Hand->centre;
  drag.radiusPixels = parts.Sizes.ring;
  drag.translationSensitivity = this->TranslationSensitivity;
  drag.rotationSensitivity = this->RotationSensitivity;
  parts.MovesCentre = state == OnCentre && !turn;
  if (parts.MovesCentre) {
    drag.kind = DragKind::InPlane;
    drag.axis = view.towards;
    drag.translationSensitivity = 1.0;
  } else if (handle && handle->kind != Handle::Kind::Centre) {
    drag.axis = handle->direction;
    drag.kind = handle->kind == Handle::Kind::Arrow    ? DragKind::AlongAxis
                : handle->kind == Handle::Kind::Square ? DragKind::InPlane
                                                       : DragKind::AboutAxis;
    if (state == OnViewRing) {
      drag.radiusPixels = parts.Sizes.viewRing;
    }
  } else if (turn) {
    drag.axis = free ? view.towards : constraint.axis;
    drag.kind = free && !this->IsSlice() ? DragKind::Trackball : DragKind::AboutAxis;
  } else {
    drag.axis = free ? view.towards : constraint.axis;
    drag.kind = constraint.kind == MotionConstraint::Kind::Axis ? DragKind::AlongAxis : DragKind::InPlane;
  }
  parts.Mouse.emplace(view, drag, Vector2d(position));
  const bool turns = drag.kind == DragKind::AboutAxis || drag.kind == DragKind::Trackball;
  parts.BeginEdit(parts.MovesCentre ? "Move the centre of" : turns ? "Turn" : "Move");
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::WidgetInteraction(double position[2])
{
  Internals& parts = *this->Parts;
  if (!parts.Mouse || !parts.Hand) {
    return;
  }
  const Pose motion = parts.Mouse->To(Vector2d(position));
  if (parts.MovesCentre) {
    const Vector3d centre = motion * parts.Hand->centre;
    parts.Session->SetCentreOfRotation(centre.x(), centre.y(), centre.z());
  } else {
    parts.Hand->Session->MoveHeld(*parts.Hand, motion);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::EndWidgetInteraction(double position[2])
{
  Internals& parts = *this->Parts;
  if (parts.Hand) {
    this->WidgetInteraction(position);
    parts.Hand->Session->EndEdit();
  }
  parts.Hand.reset();
  parts.Mouse.reset();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::CancelInteraction()
{
  Internals& parts = *this->Parts;
  if (parts.Hand) {
    parts.Hand->Session->CancelEdit();
  }
  parts.Hand.reset();
  parts.Mouse.reset();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::IsInteracting() const
{
  return this->Parts->Hand.has_value();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::StepTool(vtkMatrix4x4* toolToWorld, bool grasping)
{
  Internals& parts = *this->Parts;
  bool good = true;
  if (toolToWorld && (grasping || parts.Tool)) {
    try {
      const auto tool = echorama::FromRows<Pose>(toolToWorld->GetData());
      if (!parts.Tool) {
        parts.ToolHand = parts.TakeHold();
        if (parts.ToolHand) {
          parts.Tool.emplace(tool, *echorama::ConstraintNamed(this->Constraint), this->TranslationSensitivity,
                             this->RotationSensitivity);
          parts.BeginEdit("Move", " with the tracker");
        }
      } else {
        parts.ToolHand->Session->MoveHeld(*parts.ToolHand, parts.Tool->To(tool));
      }
    } catch (const echorama::Error& error) {
      vtkErrorMacro(<< error.what());
      good = false;
    }
  }
  if (!grasping && parts.Tool) {
    parts.ToolHand->Session->EndEdit();
    parts.Tool.reset();
    parts.ToolHand.reset();
  }
  return good;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::MoveInView(bool turn, double right, double up, double towards)
{
  const MouseView view = ViewOf(this->Renderer);
  const auto held = this->Parts->TakeHold();
  if (!held || !view.Usable()) {
    return false;
  }
  const Vector3d along = right * view.right + up * view.up + towards * view.towards, none = Vector3d::Zero();
  this->Parts->BeginEdit(turn ? "Turn" : "Move");
  held->Session->MoveHeld(*held, turn ? echorama::MotionAbout(held->centre, along * (echorama::Pi / 180.0), none)
                                      : echorama::MotionAbout(none, none, along));
  held->Session->EndEdit();
  return true;
}

//----------------------------------------------------------------------------
std::vector<int> vtkUltrasoundAlignmentRepresentation::VolumesAt(double x, double y) const
{
  std::vector<int> ids;
  const MouseView view = ViewOf(this->Renderer);
  if (this->Parts->Session && this->IsSlice() && view.Usable()) {
    const Vector3d point = view.PointAtDepthOf(view.focus, Vector2d(x, y));
    const auto& volumes = this->Parts->Session->GetKernel().State().volumes;
    for (auto volume = volumes.rbegin(); volume != volumes.rend(); ++volume) {
      if (volume->visible && this->Parts->Session->GetVoxelAt(volume->id, point.data()) >= 0) {
        ids.push_back(volume->id);
      }
    }
  }
  return ids;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentRepresentation::GetVolumeAt(double x, double y, int which) const
{
  const std::vector<int> ids = this->VolumesAt(x, y);
  return which >= 0 && which < static_cast<int>(ids.size()) ? ids[static_cast<std::size_t>(which)] : -1;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::SelectAt(double x, double y, bool add)
{
  vtkUltrasoundAlignmentSession* session = this->Parts->Session;
  const std::vector<int> ids = this->VolumesAt(x, y);
  if (ids.empty()) {
    return false;
  }
  int id = ids.front();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    // The only one (or group) that is selected gives way to the next below; one that could be added goes before those that are
    // in.
    if (!add && session->IsSelected(ids[i])) {
      id = ids[(i + 1) % ids.size()];
    } else if (add && !session->IsSelected(ids[i])) {
      id = ids[i];
      break;
    }
  }
  return session->Select(id, !add || !session->IsSelected(id), !add);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::PositionToWorld(double x, double y, double world[3]) const
{
  const MouseView view = ViewOf(this->Renderer);
  if (!view.Usable()) {
    return false;
  }
  const bool slice = this->IsSlice() || !this->Parts->Session;
  const Vector3d depth = slice ? view.focus : this->Parts->Session->GetKernel().CentreOfRotation();
  CopyTo(world, view.PointAtDepthOf(depth, Vector2d(x, y)));
  return view.PixelOf(depth).has_value();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::WorldToPosition(const double world[3], double position[2]) const
{
  const MouseView view = ViewOf(this->Renderer);
  const auto pixel = view.Usable() ? view.PixelOf(Vector3d(world)) : std::nullopt;
  if (pixel) {
    CopyTo(position, *pixel);
  }
  return pixel.has_value();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::GetHandlePosition(int state, double position[2])
{
  this->MakeHandles();
  const Internals& parts = *this->Parts;
  const int index = parts.Find(state);
  const auto grip = index < 0 ? std::nullopt : echorama::GripOf(parts.Handles, static_cast<std::size_t>(index), parts.Sizes);
  if (grip) {
    CopyTo(position, *grip);
  }
  return grip.has_value();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::Highlight(int on)
{
  const int state = on ? this->InteractionState : static_cast<int>(Outside);
  if (state != this->Parts->MarkedState) {
    this->Parts->MarkedState = state;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::MakeHandles()
{
  Internals& parts = *this->Parts;
  const MouseView view = ViewOf(this->Renderer);
  parts.Sizes = echorama::HandleSizes().Times(this->HandleScale);
  parts.Handles.clear();
  parts.AlongWorld = true;
  if (this->ShowHandles && parts.Session && parts.Session->GetNumberOfSelected() > 0 && view.Usable()) {
    const bool slice = this->IsSlice();
    const Eigen::Matrix3d frame = slice ? echorama::SliceFrame(view, parts.AlongWorld) : Eigen::Matrix3d::Identity().eval();
    parts.Handles = echorama::MakeHandles(view, parts.Session->GetKernel().CentreOfRotation(), frame, slice, parts.Sizes);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::BuildRepresentation()
{
  // Some hundred points, made anew for every picture: cheaper than to watch session, camera and window for changes.
  this->MakeHandles();
  Internals& parts = *this->Parts;
  echorama::HandlePicture picture;
  if (!parts.Handles.empty()) {
    echorama::DrawConstraint(ViewOf(this->Renderer), *echorama::ConstraintNamed(this->Constraint),
                             parts.Session->GetKernel().CentreOfRotation(), picture);
    echorama::DrawHandles(parts.Handles, parts.Find(parts.MarkedState), parts.AlongWorld, parts.Sizes, picture);
  }
  const int* origin = this->Renderer ? this->Renderer->GetOrigin() : nullptr;
  Show(picture, origin ? Vector2d(origin[0], origin[1]) : Vector2d(0.0, 0.0), parts.Picture);
  this->BuildTime.Modified();
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentRepresentation::RenderOverlay(vtkViewport* viewport)
{
  this->BuildRepresentation();
  return this->Parts->Handles.empty() ? 0 : this->Parts->Actor->RenderOverlay(viewport);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Parts->Actor->ReleaseGraphicsResources(window);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::GetActors2D(vtkPropCollection* actors)
{
  actors->AddItem(this->Parts->Actor);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Session: " << this->Parts->Session << "\n";
  os << indent << "ViewKind: " << this->ViewKind << "\n";
  os << indent << "TranslationSensitivity: " << this->TranslationSensitivity << "\n";
  os << indent << "RotationSensitivity: " << this->RotationSensitivity << "\n";
  os << indent << "Constraint: " << this->Constraint << "\n";
  os << indent << "HandleScale: " << this->HandleScale << "\n";
  os << indent << "ShowHandles: " << this->ShowHandles << "\n";
}
