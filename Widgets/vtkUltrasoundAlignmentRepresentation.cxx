// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAlignmentRepresentation.h"

#include "vtkActor2D.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkDataArray.h"
#include "vtkImageData.h"
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
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"
#include "Widgets/Session/AlignmentHandles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

using echorama::Drag;
using echorama::DragKind;
using echorama::Handle;
using echorama::HandleSizes;
using echorama::MotionConstraint;
using echorama::MouseView;
using echorama::Pose;
using echorama::SessionVolume;
using echorama::ToolDrag;
using Eigen::Vector2d;
using Eigen::Vector3d;

vtkStandardNewMacro(vtkUltrasoundAlignmentRepresentation);

namespace {
using Colour = std::array<unsigned char, 4>;
using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

constexpr Colour Shade{0, 0, 0, 130}; // under everything, so that it is seen on bright tissue too
constexpr Colour Marked{255, 220, 60, 255};
constexpr Colour WorldColours[4] = {{235, 75, 65, 255}, {95, 205, 85, 255}, {90, 145, 255, 255}, {225, 225, 225, 255}};
constexpr Colour ViewColours[4] = {{255, 150, 60, 255}, {70, 210, 220, 255}, {225, 225, 225, 255}, {225, 225, 225, 255}};

const std::array<std::pair<const char*, MotionConstraint>, 7> Constraints{{
    {"free", {MotionConstraint::Kind::Free, Vector3d::UnitZ()}},
    {"x", {MotionConstraint::Kind::Axis, Vector3d::UnitX()}},
    {"y", {MotionConstraint::Kind::Axis, Vector3d::UnitY()}},
    {"z", {MotionConstraint::Kind::Axis, Vector3d::UnitZ()}},
    {"yz", {MotionConstraint::Kind::Plane, Vector3d::UnitX()}},
    {"xz", {MotionConstraint::Kind::Plane, Vector3d::UnitY()}},
    {"xy", {MotionConstraint::Kind::Plane, Vector3d::UnitZ()}},
}};

Pose PoseOf(vtkMatrix4x4* matrix)
{
  Pose pose;
  pose.matrix() = Eigen::Map<const RowMajor>(matrix->GetData());
  return pose;
}

template <class Vector>
void CopyTo(double* numbers, const Vector& vector)
{
  std::copy(vector.data(), vector.data() + vector.size(), numbers);
}

// Coloured polygons in pixels of the viewport, painted one over the other.
class Drawing {
public:
  Drawing()
  {
    this->Points->SetDataTypeToFloat();
    this->Colours->SetNumberOfComponents(4);
    this->Colours->SetName("Colours");
  }

  void AddPolygon(const std::vector<Vector2d>& corners, const Colour& colour)
  {
    this->Polygons->InsertNextCell(static_cast<int>(corners.size()));
    for (const Vector2d& corner : corners) {
      this->Polygons->InsertCellPoint(this->AddPoint(corner, colour));
    }
  }

  void AddDisc(const Vector2d& centre, double radius, const Colour& colour)
  {
    std::vector<Vector2d> corners;
    for (int i = 0; i < 24; ++i) {
      const double angle = 2.0 * vtkMath::Pi() * i / 24;
      corners.push_back(centre + radius * Vector2d(std::cos(angle), std::sin(angle)));
    }
    this->AddPolygon(corners, colour);
  }

  // A line of some width; \a colours one per point.
  void AddLine(const std::vector<Vector2d>& line, const std::vector<Colour>& colours, double width, bool closed)
  {
    const std::size_t n = line.size();
    std::vector<std::array<vtkIdType, 2>> sides;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2d before = line[i > 0 ? i - 1 : (closed ? n - 1 : 0)], after = line[i + 1 < n ? i + 1 : (closed ? 0 : n - 1)];
      Vector2d along = after - before;
      if (along.norm() < 1e-6) {
        along = line[i] - before; // where a ring that is seen edge-on turns back
      }
      along = along.norm() < 1e-6 ? Vector2d(1.0, 0.0) : along.normalized();
      const Vector2d across = 0.5 * width * Vector2d(-along.y(), along.x());
      sides.push_back({this->AddPoint(line[i] - across, colours[i]), this->AddPoint(line[i] + across, colours[i])});
    }
    for (std::size_t i = 0; i + (closed ? 0 : 1) < n; ++i) {
      const auto &a = sides[i], &b = sides[(i + 1) % n];
      this->Polygons->InsertNextCell({a[0], b[0], b[1], a[1]});
    }
  }

  void AddLine(const Vector2d& from, const Vector2d& to, const Colour& colour, double width)
  {
    this->AddLine({from, to}, {colour, colour}, width, false);
  }

  void PutInto(vtkPolyData* data)
  {
    data->Initialize();
    data->SetPoints(this->Points);
    data->SetPolys(this->Polygons);
    data->GetPointData()->SetScalars(this->Colours);
  }

private:
  vtkIdType AddPoint(const Vector2d& point, const Colour& colour)
  {
    this->Colours->InsertNextTypedTuple(colour.data());
    return this->Points->InsertNextPoint(point.x(), point.y(), 0.0);
  }

  vtkNew<vtkPoints> Points;
  vtkNew<vtkCellArray> Polygons;
  vtkNew<vtkUnsignedCharArray> Colours;
};

// Whether a volume is seen at a point: the nearest voxel is real.
bool IsReal(vtkImageData* image, const Vector3d& point)
{
  const echorama::ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image);
  const Vector3d index = geometry.WorldToIndex() * point;
  vtkIdType at = 0, stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double nearest = std::round(index[axis]);
    if (!(nearest >= 0.0 && nearest < geometry.dimensions[static_cast<std::size_t>(axis)])) {
      return false;
    }
    at += stride * static_cast<vtkIdType>(nearest);
    stride *= geometry.dimensions[static_cast<std::size_t>(axis)];
  }
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(image);
  return !valid || valid->GetComponent(at, 0) != 0.0;
}
} // namespace

//----------------------------------------------------------------------------
struct vtkUltrasoundAlignmentRepresentation::Internals {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  HandleSizes Sizes;
  std::vector<Handle> Handles;
  bool AlongWorld = true;
  int MarkedState = Outside;
  vtkNew<vtkPolyData> Picture;
  vtkNew<vtkPolyDataMapper2D> Mapper;
  vtkNew<vtkActor2D> Actor;

  // What is held, by the mouse or by a tool.
  struct Held {
    int Id;
    Pose Start;
  };
  struct Grip {
    std::vector<Held> Volumes;
    Vector3d Centre;   // of rotation, at the start
    bool CentreChosen; // by the user: then it goes with the volumes
    vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  };
  std::optional<Grip> Hand, ToolHand;
  std::optional<Drag> Mouse;
  std::optional<ToolDrag> Tool;
  bool MovesCentre = false;

  std::optional<Grip> TakeHold() const
  {
    if (!this->Session || this->Session->GetNumberOfSelected() == 0) {
      return std::nullopt;
    }
    const echorama::AlignmentSession& kernel = this->Session->GetKernel();
    Grip grip{{}, kernel.CentreOfRotation(), kernel.ChosenCentre().has_value(), this->Session};
    for (const SessionVolume& volume : kernel.State().volumes) {
      if (kernel.Selection().count(volume.id) != 0) {
        grip.Volumes.push_back({volume.id, volume.volumeToWorld});
      }
    }
    return grip;
  }

  static std::string LabelOf(const Grip& grip, const char* verb)
  {
    const std::size_t count = grip.Volumes.size();
    return std::string(verb) + " " +
           (count == 1 ? grip.Session->GetName(grip.Volumes.front().Id) : std::to_string(count) + " volumes");
  }

  // Everything that is held and still there goes from where it was at the start by a motion of the world.
  static void Move(const Grip& grip, const Pose& motion)
  {
    vtkNew<vtkMatrix4x4> matrix;
    for (const Held& held : grip.Volumes) {
      const SessionVolume* now = grip.Session->GetKernel().State().Find(held.Id);
      Pose pose = motion * held.Start;
      if (!echorama::IsRotation(pose.linear(), 1e-12)) { // rounding of thousands of drags
        pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
      }
      if (now && now->volumeToWorld.matrix() != pose.matrix()) {
        Eigen::Map<RowMajor>(matrix->GetData()) = pose.matrix();
        grip.Session->SetVolumeToWorld(held.Id, matrix);
      }
    }
    if (grip.CentreChosen) {
      const Vector3d centre = motion * grip.Centre;
      grip.Session->SetCentreOfRotation(centre.x(), centre.y(), centre.z());
    }
  }

  // The world's axis that a handle stands for; in an oblique slice: the view's.
  int AxisOf(const Handle& handle) const
  {
    int axis = handle.axis;
    if (this->AlongWorld && axis < 3) {
      handle.direction.cwiseAbs().maxCoeff(&axis);
    }
    return axis;
  }

  int StateOf(const Handle& handle) const
  {
    const int axis = this->AxisOf(handle);
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

  const Handle* Find(int state) const
  {
    const auto found = std::find_if(this->Handles.begin(), this->Handles.end(),
                                    [&](const Handle& handle) { return this->StateOf(handle) == state; });
    return found == this->Handles.end() ? nullptr : &*found;
  }

  void MakeHandles(const MouseView& view, bool slice, bool show, double scale)
  {
    this->Sizes = HandleSizes().Times(scale);
    this->Handles.clear();
    this->AlongWorld = true;
    if (show && this->Session && this->Session->GetNumberOfSelected() > 0 && view.Usable()) {
      const Eigen::Matrix3d frame = slice ? echorama::SliceFrame(view, this->AlongWorld) : Eigen::Matrix3d::Identity().eval();
      this->Handles = echorama::MakeHandles(view, this->Session->GetKernel().CentreOfRotation(), frame, slice, this->Sizes);
    }
  }

  void Draw(const MouseView& view, const MotionConstraint& constraint, const Vector2d& corner)
  {
    Drawing drawing;
    const auto local = [&](std::vector<Vector2d> line) {
      for (Vector2d& point : line) {
        point -= corner;
      }
      return line;
    };
    if (!this->Handles.empty()) {
      this->DrawConstraint(view, constraint, corner, drawing);
    }
    for (const Handle& handle : this->Handles) {
      const bool marked = this->MarkedState == this->StateOf(handle);
      Colour colour = marked ? Marked : (this->AlongWorld ? WorldColours : ViewColours)[this->AxisOf(handle)];
      const std::vector<Vector2d> line = local(handle.line);
      const double width = marked ? 4.0 : 2.5;
      switch (handle.kind) {
      case Handle::Kind::Ring: {
        const bool quiet = handle.axis == 3 && !marked;
        std::vector<Colour> front, shade;
        for (std::size_t i = 0; i < line.size(); ++i) {
          const auto part = static_cast<unsigned char>(handle.behind[i] ? 70 : (quiet ? 140 : 255));
          front.push_back({colour[0], colour[1], colour[2], part});
          shade.push_back({0, 0, 0, static_cast<unsigned char>(handle.behind[i] || quiet ? 0 : Shade[3])});
        }
        drawing.AddLine(line, shade, width + 2.0, true);
        drawing.AddLine(line, front, width, true);
        break;
      }
      case Handle::Kind::Square:
        colour[3] = marked ? 220 : 120;
        drawing.AddPolygon(line, colour);
        break;
      case Handle::Kind::Arrow: {
        const Vector2d along = (line[1] - line[0]).normalized(), across(-along.y(), along.x());
        const double length = std::min(16.0, 0.5 * (line[1] - line[0]).norm());
        const Vector2d neck = line[1] - length * along;
        drawing.AddLine(line[0] - along, neck, Shade, width + 2.0);
        drawing.AddPolygon({neck - 7.5 * across - 1.5 * along, line[1] + 2.5 * along, neck + 7.5 * across - 1.5 * along}, Shade);
        drawing.AddLine(line[0], neck, colour, width);
        drawing.AddPolygon({neck - 6.0 * across, line[1], neck + 6.0 * across}, colour);
        break;
      }
      case Handle::Kind::Centre:
        drawing.AddDisc(line[0], this->Sizes.centre + 1.5, Shade);
        drawing.AddDisc(line[0], this->Sizes.centre, marked ? Marked : Colour{250, 250, 250, 255});
        drawing.AddDisc(line[0], 0.4 * this->Sizes.centre, Colour{40, 40, 40, 255});
        break;
      }
    }
    drawing.PutInto(this->Picture);
  }

  // What drags are held to: the axis, or those of the plane, as long thin lines through the centre.
  void DrawConstraint(const MouseView& view, const MotionConstraint& constraint, const Vector2d& corner, Drawing& drawing) const
  {
    if (constraint.kind == MotionConstraint::Kind::Free) {
      return;
    }
    const Vector3d centre = this->Session->GetKernel().CentreOfRotation();
    for (int axis = 0; axis < 3; ++axis) {
      const bool along = std::abs(constraint.axis[axis]) > 0.5;
      if (along != (constraint.kind == MotionConstraint::Kind::Axis)) {
        continue;
      }
      const Vector3d reach = 400.0 * view.MmPerPixelAt(centre) * Vector3d::Unit(axis);
      const auto a = view.PixelOf(centre - reach), b = view.PixelOf(centre + reach);
      if (a && b && (*a - *b).norm() > 1.0) {
        Colour colour = WorldColours[axis];
        colour[3] = 150;
        drawing.AddLine(*a - corner, *b - corner, colour, 1.5);
      }
    }
  }
};

namespace {
MotionConstraint ConstraintOf(const std::string& name)
{
  for (const auto& [known, constraint] : Constraints) {
    if (name == known) {
      return constraint;
    }
  }
  return {};
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
const char* vtkUltrasoundAlignmentRepresentation::GetViewKind() const
{
  return this->ViewKind.c_str();
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
  if (std::none_of(Constraints.begin(), Constraints.end(), [&](const auto& each) { return wanted == each.first; })) {
    vtkErrorMacro(<< "there is no constraint \"" << wanted << "\"; known are free, x, y, z, yz, xz and xy");
  } else if (wanted != this->Constraint) {
    this->Constraint = wanted;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundAlignmentRepresentation::GetConstraint() const
{
  return this->Constraint.c_str();
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
  parts.MakeHandles(ViewOf(this->Renderer), this->IsSlice(), this->ShowHandles, this->HandleScale);
  const int handle = echorama::HandleAt(parts.Handles, Vector2d(x, y), parts.Sizes);
  this->InteractionState = Outside;
  if (handle >= 0) {
    this->InteractionState = parts.StateOf(parts.Handles[static_cast<std::size_t>(handle)]);
  } else {
    const int count = this->GetNumberOfVolumesAt(x, y);
    for (int i = 0; i < count && this->InteractionState != OnSelected; ++i) {
      this->InteractionState = parts.Session->IsSelected(this->GetVolumeAt(x, y, i)) ? OnSelected : OnOther;
    }
  }
  return this->InteractionState;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::StartWidgetInteraction(double position[2])
{
  this->Start(position, false);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::StartTurning(double position[2])
{
  this->Start(position, true);
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
  parts.MakeHandles(view, this->IsSlice(), this->ShowHandles, this->HandleScale);

  const int state = this->InteractionState;
  const Handle* handle = parts.Find(state);
  const MotionConstraint constraint = ConstraintOf(this->Constraint);
  const bool free = constraint.kind == MotionConstraint::Kind::Free;
  echorama::DragParameters drag;
  drag.centre = parts.Hand->Centre;
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
  if (!parts.MovesCentre) {
    const bool turns = drag.kind == DragKind::AboutAxis || drag.kind == DragKind::Trackball;
    parts.Session->BeginEdit(Internals::LabelOf(*parts.Hand, turns ? "Turn" : "Move").c_str());
  }
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
    const Vector3d centre = motion * parts.Hand->Centre;
    parts.Session->SetCentreOfRotation(centre.x(), centre.y(), centre.z());
  } else {
    Internals::Move(*parts.Hand, motion);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::EndWidgetInteraction(double position[2])
{
  Internals& parts = *this->Parts;
  if (parts.Hand) {
    this->WidgetInteraction(position);
    if (!parts.MovesCentre) {
      parts.Hand->Session->EndEdit();
    }
  }
  parts.Hand.reset();
  parts.Mouse.reset();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentRepresentation::CancelInteraction()
{
  Internals& parts = *this->Parts;
  if (parts.Hand) {
    vtkUltrasoundAlignmentSession* session = parts.Hand->Session;
    if (!parts.MovesCentre) {
      session->CancelEdit();
    }
    if (parts.Hand->CentreChosen) {
      const Vector3d centre = parts.Hand->Centre;
      session->SetCentreOfRotation(centre.x(), centre.y(), centre.z());
    } else if (parts.MovesCentre) {
      session->ResetCentreOfRotation();
    }
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
      const Pose tool = PoseOf(toolToWorld);
      if (!parts.Tool) {
        parts.ToolHand = parts.TakeHold();
        if (parts.ToolHand) {
          parts.Tool.emplace(tool, ConstraintOf(this->Constraint), this->TranslationSensitivity, this->RotationSensitivity);
          parts.Session->BeginEdit((Internals::LabelOf(*parts.ToolHand, "Move") + " with the tracker").c_str());
        }
      } else {
        Internals::Move(*parts.ToolHand, parts.Tool->To(tool));
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
bool vtkUltrasoundAlignmentRepresentation::TranslateInView(double right, double up, double towards)
{
  const MouseView view = ViewOf(this->Renderer);
  const auto grip = this->Parts->TakeHold();
  if (!grip || !view.Usable()) {
    return false;
  }
  grip->Session->BeginEdit(Internals::LabelOf(*grip, "Move").c_str());
  const Vector3d by = right * view.right + up * view.up + towards * view.towards;
  Internals::Move(*grip, echorama::MotionAbout(Vector3d::Zero(), Vector3d::Zero(), by));
  grip->Session->EndEdit();
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::RotateInView(double right, double up, double towards)
{
  const MouseView view = ViewOf(this->Renderer);
  const auto grip = this->Parts->TakeHold();
  if (!grip || !view.Usable()) {
    return false;
  }
  grip->Session->BeginEdit(Internals::LabelOf(*grip, "Turn").c_str());
  const Vector3d by = (right * view.right + up * view.up + towards * view.towards) * (vtkMath::Pi() / 180.0);
  Internals::Move(*grip, echorama::MotionAbout(grip->Centre, by, Vector3d::Zero()));
  grip->Session->EndEdit();
  return true;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentRepresentation::GetNumberOfVolumesAt(double x, double y) const
{
  int count = 0;
  while (this->GetVolumeAt(x, y, count) >= 0) {
    ++count;
  }
  return count;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentRepresentation::GetVolumeAt(double x, double y, int which) const
{
  const MouseView view = ViewOf(this->Renderer);
  if (!this->Parts->Session || !this->IsSlice() || !view.Usable()) {
    return -1;
  }
  const Vector3d point = view.PointAtDepthOf(view.focus, Vector2d(x, y));
  const auto& volumes = this->Parts->Session->GetKernel().State().volumes;
  for (auto volume = volumes.rbegin(); volume != volumes.rend(); ++volume) {
    if (volume->visible && IsReal(this->Parts->Session->GetImage(volume->id), point) && which-- == 0) {
      return volume->id;
    }
  }
  return -1;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentRepresentation::SelectAt(double x, double y, bool add)
{
  vtkUltrasoundAlignmentSession* session = this->Parts->Session;
  const int count = this->GetNumberOfVolumesAt(x, y);
  if (count == 0) {
    return false;
  }
  int wanted = 0;
  for (int i = 0; i < count; ++i) {
    // The only one (or group) that is selected gives way to the next below; one that could be added goes before those that are
    // in.
    if (!add && session->IsSelected(this->GetVolumeAt(x, y, i))) {
      wanted = (i + 1) % count;
    } else if (add && !session->IsSelected(this->GetVolumeAt(x, y, i))) {
      wanted = i;
      break;
    }
  }
  const int id = this->GetVolumeAt(x, y, wanted);
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
  Internals& parts = *this->Parts;
  parts.MakeHandles(ViewOf(this->Renderer), this->IsSlice(), this->ShowHandles, this->HandleScale);
  const Handle* handle = parts.Find(state);
  if (!handle) {
    return false;
  }
  Vector2d at = handle->line.front();
  if (handle->kind == Handle::Kind::Arrow) {
    at = handle->line[1];
  } else if (handle->kind == Handle::Kind::Square) {
    at = 0.25 * (handle->line[0] + handle->line[1] + handle->line[2] + handle->line[3]);
  } else if (handle->kind == Handle::Kind::Ring) {
    const auto mine = std::find_if(handle->line.begin(), handle->line.end(), [&](const Vector2d& point) {
      const int found = echorama::HandleAt(parts.Handles, point, parts.Sizes);
      return found >= 0 && &parts.Handles[static_cast<std::size_t>(found)] == handle;
    });
    if (mine == handle->line.end()) {
      return false;
    }
    at = *mine;
  }
  CopyTo(position, at);
  return true;
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
void vtkUltrasoundAlignmentRepresentation::BuildRepresentation()
{
  // Some hundred points, made anew for every picture: cheaper than to watch session, camera and window for changes.
  const MouseView view = ViewOf(this->Renderer);
  const int* origin = this->Renderer ? this->Renderer->GetOrigin() : nullptr;
  this->Parts->MakeHandles(view, this->IsSlice(), this->ShowHandles, this->HandleScale);
  this->Parts->Draw(view, ConstraintOf(this->Constraint), origin ? Vector2d(origin[0], origin[1]) : Vector2d(0.0, 0.0));
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
