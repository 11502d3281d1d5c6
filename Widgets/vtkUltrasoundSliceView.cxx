// SPDX-License-Identifier: BSD-3-Clause
// The picture is drawn by DrawSlice in the pixels of the viewport and laid on a rectangle of the world, one texel on one pixel.
// With a parallel camera it does not matter how far behind the plane the rectangle lies: it lies far behind, so that whatever is
// drawn in the plane is in front of it. Lines of the view itself are few and are drawn in pixels, on top.
//
// Nothing is drawn before Update(), and then only what is out of date: poses that change ten times between two frames cost one
// picture.
#include "vtkUltrasoundSliceView.h"

#include "vtkActor.h"
#include "vtkActor2D.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkPolyDataMapper2D.h"
#include "vtkProperty.h"
#include "vtkProperty2D.h"
#include "vtkRenderer.h"
#include "vtkSmartPointer.h"
#include "vtkTextActor.h"
#include "vtkTextProperty.h"
#include "vtkTexture.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include "Core/Base/Error.h"
#include "Widgets/Slices/SlicePicture.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {
constexpr double DrawSeconds = 1.0 / 60.0; // half a frame's at 30 a second: the other half is the rendering's
constexpr int CoarsestStep = 4;            // beyond, speckle is gone

struct Axis {
  const char* Name;
  Vector3d Right, Up, Along; // Along: what its position counts along
  const char* Sides[4];      // letters of the body: left, right, lower and upper side of the picture
  std::array<unsigned char, 3> Colour;
};

const std::array<Axis, 4>& Axes()
{
  static const std::array<Axis, 4> axes{
      {{"x", Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::UnitX(), {"A", "P", "I", "S"}, {235, 110, 95}},
       {"y", Vector3d::UnitX(), Vector3d::UnitZ(), Vector3d::UnitY(), {"R", "L", "I", "S"}, {120, 205, 110}},
       {"z", Vector3d::UnitX(), -Vector3d::UnitY(), Vector3d::UnitZ(), {"R", "L", "P", "A"}, {105, 160, 245}},
       {"oblique", Vector3d::UnitX(), -Vector3d::UnitY(), -Vector3d::UnitZ(), {"", "", "", ""}, {240, 205, 90}}}};
  return axes;
}

constexpr std::array<const char*, 3> ShownNames{"all", "selected", "others"};
constexpr std::array<const char*, 3> ModeNames{"blend", "difference", "checkerboard"}; // in the order of SliceMode

// The place of a name in a list; the list's size when it is not there.
template <class Names>
std::size_t PlaceOf(const Names& names, const char* name)
{
  std::size_t place = 0;
  while (place < names.size() && !(name && std::string(names[place]) == name)) {
    ++place;
  }
  return place;
}

bool Finite(double a, double b, double c)
{
  return std::isfinite(a) && std::isfinite(b) && std::isfinite(c);
}

// The volume's voxels and where they are, for the kernel.
AnyPosedVolume PosedVolumeOf(vtkImageData* image)
{
  vtkUltrasoundVolume::Input input;
  input.Image = image;
  input.Intensity = vtkUltrasoundVolume::GetIntensity(image);
  input.ValidRegion = vtkUltrasoundVolume::GetValidRegion(image);
  AnyPosedVolume volume;
  vtkUltrasoundVolume::Dispatch(input.Intensity,
                                [&](auto type) { volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input); });
  return volume;
}

// Lines in pixels with colours, RGBA, on top of everything.
class Lines {
public:
  Lines()
  {
    this->Colours->SetNumberOfComponents(4);
    this->Data->SetPoints(this->Points);
    this->Data->SetLines(this->Cells);
    this->Data->GetCellData()->SetScalars(this->Colours);
    this->Mapper->SetInputData(this->Data);
    this->Actor->SetMapper(this->Mapper);
    this->Actor->SetPickable(false);
  }
  void Clear()
  {
    this->Points->Reset();
    this->Cells->Reset();
    this->Colours->Reset();
  }
  void Add(const std::vector<Vector2d>& path, const std::array<unsigned char, 3>& colour, unsigned char opacity)
  {
    this->Cells->InsertNextCell(static_cast<vtkIdType>(path.size()));
    for (const Vector2d& p : path) {
      this->Cells->InsertCellPoint(this->Points->InsertNextPoint(p.x(), p.y(), 0.0));
    }
    this->Colours->InsertNextTuple4(colour[0], colour[1], colour[2], opacity);
  }
  void Done()
  {
    this->Points->Modified();
    this->Cells->Modified();
    this->Colours->Modified();
    this->Data->Modified();
  }
  vtkNew<vtkActor2D> Actor;

private:
  vtkNew<vtkPoints> Points;
  vtkNew<vtkCellArray> Cells;
  vtkNew<vtkUnsignedCharArray> Colours;
  vtkNew<vtkPolyData> Data;
  vtkNew<vtkPolyDataMapper2D> Mapper;
};

// The part of the line through a point that is inside the viewport.
std::optional<std::array<Vector2d, 2>> Clipped(const Vector2d& point, const Vector2d& along, int width, int height)
{
  double from = -1e30, to = 1e30;
  for (int axis = 0; axis < 2; ++axis) {
    const double size = axis == 0 ? width : height;
    if (std::fabs(along[axis]) < 1e-12) {
      if (point[axis] < 0.0 || point[axis] > size) {
        return {};
      }
      continue;
    }
    const double a = -point[axis] / along[axis], b = (size - point[axis]) / along[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (!(from < to)) {
    return {};
  }
  return std::array<Vector2d, 2>{point + from * along, point + to * along};
}

// 1, 2 or 5 times a power of ten, not above a number.
double RoundBelow(double number)
{
  const double power = std::pow(10.0, std::floor(std::log10(number)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= number) {
      return digit * power;
    }
  }
  return power;
}
} // namespace

struct vtkUltrasoundSliceView::Internals {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  std::vector<unsigned long> Observers;

  // The plane.
  std::size_t AxisPlace = 2;
  Vector3d Right = Axes()[2].Right, Up = Axes()[2].Up, Along = Axes()[2].Along;
  Vector3d Focus = Vector3d::Zero(), Cursor = Vector3d::Zero();
  double Millimetres = 0.5; // per pixel
  int Width = 400, Height = 400;
  bool NeverFitted = true;
  // Those who share zoom and cursor, with this view; one alone when it is not linked.
  std::shared_ptr<std::vector<vtkUltrasoundSliceView*>> Linked;

  // How.
  std::size_t Shown = 0;
  SliceParameters Parameters;
  bool Interactive = false, Annotated = true;
  int InteractiveStep = 0;
  std::optional<Vector3d> Brush;
  double BrushMm = 0.0;

  // What is out of date: drawing the picture, or the lines and the camera alone.
  bool PictureDirty = true, LinesDirty = true;
  int PictureStep = 1;
  double PictureSeconds = 0.0, FullSeconds = 0.0;

  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkCamera> Camera;
  vtkNew<vtkImageData> Picture;
  vtkNew<vtkTexture> Texture;
  vtkNew<vtkPoints> Corners;
  vtkNew<vtkPolyData> Rectangle;
  vtkNew<vtkPolyDataMapper> Mapper;
  vtkNew<vtkActor> Actor;
  Lines Overlay;
  vtkNew<vtkTextActor> ScaleText;
  std::array<vtkNew<vtkTextActor>, 4> Letters;

  Vector3d Towards() const { return this->Right.cross(this->Up); }
  Vector2d Middle() const { return {0.5 * (this->Width - 1), 0.5 * (this->Height - 1)}; }
  Vector3d WorldOf(double x, double y) const
  {
    const Vector2d d = this->Millimetres * (Vector2d(x, y) - this->Middle());
    return this->Focus + d.x() * this->Right + d.y() * this->Up;
  }
  Vector2d PixelOf(const Vector3d& world) const
  {
    const Vector3d d = (world - this->Focus) / this->Millimetres;
    return this->Middle() + Vector2d(d.dot(this->Right), d.dot(this->Up));
  }
  // Moves the plane, not the view, so that it goes through the cursor.
  void FollowCursor() { this->Focus += (this->Cursor - this->Focus).dot(this->Towards()) * this->Towards(); }

  SlicePlane Plane() const
  {
    SlicePlane plane;
    plane.origin = this->WorldOf(0.0, 0.0);
    plane.right = this->Millimetres * this->Right;
    plane.up = this->Millimetres * this->Up;
    plane.width = this->Width;
    plane.height = this->Height;
    return plane;
  }

  // The visible volumes, and of these what is to be shown.
  std::vector<int> Visible() const
  {
    std::vector<int> ids;
    for (int i = 0; this->Session && i < this->Session->GetNumberOfVolumes(); ++i) {
      const int id = this->Session->GetVolumeId(i);
      if (this->Session->GetVisible(id) && this->Session->GetImage(id)) {
        ids.push_back(id);
      }
    }
    return ids;
  }

  std::vector<SliceLayer> Layers() const
  {
    std::vector<SliceLayer> layers;
    double window[2] = {0.0, 255.0};
    if (this->Session) {
      this->Session->GetGreyWindow(window);
    }
    for (const int id : this->Visible()) {
      SliceLayer layer;
      layer.selected = this->Session->IsSelected(id);
      if (this->Shown != 0 && layer.selected != (this->Shown == 1)) {
        continue;
      }
      layer.volume = PosedVolumeOf(this->Session->GetImage(id));
      this->Session->GetColour(id, layer.colour.data());
      layer.opacity = this->Session->GetOpacity(id);
      layer.black = window[0];
      layer.white = window[1];
      layers.push_back(layer);
    }
    const auto selected = std::count_if(layers.begin(), layers.end(), [](const SliceLayer& layer) { return layer.selected; });
    if (selected == 0 || selected == static_cast<std::ptrdiff_t>(layers.size())) {
      for (std::size_t i = 0; i < layers.size(); ++i) {
        layers[i].selected = i == 0;
      }
    }
    return layers;
  }

  // Calls body(corner) with the eight corners of each visible volume.
  template <class Body>
  void ForCorners(const Body& body) const
  {
    for (const int id : this->Visible()) {
      const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(this->Session->GetImage(id));
      for (int corner = 0; corner < 8; ++corner) {
        Vector3d index;
        for (int axis = 0; axis < 3; ++axis) {
          index[axis] = (corner >> axis & 1) != 0 ? geometry.dimensions[axis] - 0.5 : -0.5;
        }
        body(Vector3d(geometry.IndexToWorld() * index));
      }
    }
  }

  int StepNow() const
  {
    if (!this->Interactive) {
      return 1;
    }
    if (this->InteractiveStep > 0) {
      return this->InteractiveStep;
    }
    return std::clamp(static_cast<int>(std::ceil(std::sqrt(this->FullSeconds / DrawSeconds))), 1, CoarsestStep);
  }

  void Draw()
  {
    this->Parameters.step = this->StepNow();
    const SlicePlane plane = this->Plane();
    ImageGeometry geometry;
    geometry.dimensions = {plane.width, plane.height, 1};
    geometry.origin = plane.origin;
    geometry.spacing.setConstant(this->Millimetres);
    geometry.direction << this->Right, this->Up, this->Towards();
    const int* size = this->Picture->GetDimensions();
    if (size[0] != plane.width || size[1] != plane.height) {
      vtkUltrasoundVolume::SetGeometry(this->Picture, geometry);
      this->Picture->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
    }
    vtkUltrasoundVolume::SetGeometry(this->Picture, geometry);
    const auto start = std::chrono::steady_clock::now();
    DrawSlice(this->Layers(), plane, this->Parameters, static_cast<std::uint8_t*>(this->Picture->GetScalarPointer()));
    this->PictureSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    this->PictureStep = this->Parameters.step;
    this->FullSeconds = this->PictureSeconds * this->PictureStep * this->PictureStep;
    this->Picture->GetPointData()->GetScalars()->Modified();
    this->Picture->Modified();
  }

  void PlaceCamera()
  {
    const double height = this->Height * this->Millimetres, far = 20.0 * std::max(height, this->Width * this->Millimetres);
    const Vector3d towards = this->Towards(), eye = this->Focus + far * towards;
    this->Camera->SetParallelProjection(true);
    this->Camera->SetFocalPoint(this->Focus.data());
    this->Camera->SetPosition(eye.data());
    this->Camera->SetViewUp(this->Up.data());
    this->Camera->SetParallelScale(0.5 * height);
    this->Camera->SetClippingRange(0.001 * far, 2.0 * far);
    const Vector3d behind = -0.9 * far * towards;
    const double right = this->Width - 0.5, top = this->Height - 0.5;
    const std::array<Vector3d, 4> corners{this->WorldOf(-0.5, -0.5), this->WorldOf(right, -0.5), this->WorldOf(right, top),
                                          this->WorldOf(-0.5, top)};
    for (vtkIdType i = 0; i < 4; ++i) {
      const Vector3d corner = corners[static_cast<std::size_t>(i)] + behind;
      this->Corners->SetPoint(i, corner.data());
    }
    this->Corners->Modified();
  }

  void DrawLinkedPlanes()
  {
    constexpr double gap = 8.0; // pixels around the cursor that stay free
    const Vector2d cursor = this->PixelOf(this->Cursor);
    for (const vtkUltrasoundSliceView* other : *this->Linked) {
      const Vector3d along = this->Towards().cross(other->Parts->Towards());
      if (along.norm() < 1e-6) // the same plane, or one beside it
      {
        continue;
      }
      const Vector2d direction = Vector2d(along.dot(this->Right), along.dot(this->Up)).normalized();
      const auto line = Clipped(cursor, direction, this->Width - 1, this->Height - 1);
      if (!line) {
        continue;
      }
      const auto& colour = Axes()[other->Parts->AxisPlace].Colour;
      for (const double side : {-1.0, 1.0}) {
        const Vector2d near = cursor + side * gap * direction;
        const Vector2d& end = (*line)[side < 0.0 ? 0 : 1];
        if (side * (end - near).dot(direction) > 0.0) {
          this->Overlay.Add({near, end}, colour, 110);
        }
      }
    }
  }

  void DrawBrush()
  {
    const double off = (*this->Brush - this->Focus).dot(this->Towards());
    const double square = this->BrushMm * this->BrushMm - off * off;
    if (!(square > 0.0)) {
      return;
    }
    const Vector2d middle = this->PixelOf(*this->Brush);
    const double radius = std::sqrt(square) / this->Millimetres;
    constexpr int Parts = 64;
    std::vector<Vector2d> circle;
    for (int i = 0; i <= Parts; ++i) {
      const double angle = 2.0 * EIGEN_PI * i / Parts;
      circle.emplace_back(middle + radius * Vector2d(std::cos(angle), std::sin(angle)));
    }
    this->Overlay.Add(circle, {255, 255, 255}, 200);
  }

  void DrawScaleBar()
  {
    const double length = RoundBelow(0.25 * this->Width * this->Millimetres);
    const double pixels = length / this->Millimetres, left = 12.0, bottom = 12.0, tick = 4.0;
    this->Overlay.Add({{left, bottom + tick}, {left, bottom}, {left + pixels, bottom}, {left + pixels, bottom + tick}},
                      {230, 230, 230}, 220);
    char text[32];
    std::snprintf(text, sizeof text, "%g mm", length);
    this->ScaleText->SetInput(text);
    this->ScaleText->SetPosition(left, bottom + tick + 2.0);
  }

  void DrawLines()
  {
    this->Overlay.Clear();
    const bool room = this->Annotated && this->Width >= 64 && this->Height >= 64;
    if (this->Annotated && this->Linked->size() > 1) {
      this->DrawLinkedPlanes();
    }
    if (this->Brush) {
      this->DrawBrush();
    }
    if (room) {
      this->DrawScaleBar();
    }
    this->Overlay.Done();
    this->ScaleText->SetVisibility(room);
    const double x[4] = {6.0, this->Width - 6.0, 0.5 * this->Width, 0.5 * this->Width};
    const double y[4] = {0.5 * this->Height, 0.5 * this->Height, 6.0, this->Height - 6.0};
    for (std::size_t side = 0; side < 4; ++side) {
      const char* letter = Axes()[this->AxisPlace].Sides[side];
      this->Letters[side]->SetVisibility(room && *letter);
      this->Letters[side]->SetInput(letter);
      this->Letters[side]->SetPosition(x[side], y[side]);
    }
  }
};

vtkStandardNewMacro(vtkUltrasoundSliceView);

vtkUltrasoundSliceView::vtkUltrasoundSliceView() : Parts(std::make_unique<Internals>())
{
  Internals& parts = *this->Parts;
  parts.Linked = std::make_shared<std::vector<vtkUltrasoundSliceView*>>(1, this);

  parts.Corners->SetNumberOfPoints(4);
  vtkNew<vtkCellArray> face;
  face->InsertNextCell({0, 1, 2, 3});
  vtkNew<vtkFloatArray> places;
  places->SetNumberOfComponents(2);
  for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(1.0, 1.0), std::pair(0.0, 1.0)}) {
    places->InsertNextTuple2(u, v);
  }
  parts.Rectangle->SetPoints(parts.Corners);
  parts.Rectangle->SetPolys(face);
  parts.Rectangle->GetPointData()->SetTCoords(places);
  parts.Texture->SetInputData(parts.Picture);
  parts.Texture->SetColorModeToDirectScalars();
  parts.Texture->InterpolateOff();
  parts.Mapper->SetInputData(parts.Rectangle);
  parts.Actor->SetMapper(parts.Mapper);
  parts.Actor->SetTexture(parts.Texture);
  parts.Actor->GetProperty()->LightingOff();
  parts.Actor->ForceOpaqueOn();
  parts.Actor->SetPickable(false);
  parts.Actor->SetVisibility(false);
  parts.Renderer->SetActiveCamera(parts.Camera);
  parts.Renderer->AddActor(parts.Actor);
  parts.Renderer->AddActor2D(parts.Overlay.Actor);

  const auto prepare = [&](vtkTextActor* actor, int size, double grey) {
    actor->GetTextProperty()->SetFontSize(size);
    actor->GetTextProperty()->SetColor(grey, grey, grey);
    actor->GetTextProperty()->SetFontFamilyToArial();
    actor->SetPickable(false);
    parts.Renderer->AddActor2D(actor);
  };
  prepare(parts.ScaleText, 12, 0.9);
  for (std::size_t side = 0; side < 4; ++side) {
    prepare(parts.Letters[side], 13, 0.65);
    vtkTextProperty* text = parts.Letters[side]->GetTextProperty();
    side == 0 ? text->SetJustificationToLeft() : side == 1 ? text->SetJustificationToRight() : text->SetJustificationToCentered();
    side == 2   ? text->SetVerticalJustificationToBottom()
    : side == 3 ? text->SetVerticalJustificationToTop()
                : text->SetVerticalJustificationToCentered();
  }
}

vtkUltrasoundSliceView::~vtkUltrasoundSliceView()
{
  this->Unlink();
  this->SetSession(nullptr);
}

void vtkUltrasoundSliceView::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const Internals& parts = *this->Parts;
  os << indent << "Session: " << parts.Session.GetPointer() << "\n";
  os << indent << "PixelSize: " << parts.Width << " " << parts.Height << "\n";
  os << indent << "Axis: " << this->GetAxis() << "\n";
  os << indent << "Position: " << this->GetPosition() << " mm\n";
  os << indent << "Focus: " << parts.Focus.transpose() << "\n";
  os << indent << "Cursor: " << parts.Cursor.transpose() << "\n";
  os << indent << "MillimetresPerPixel: " << parts.Millimetres << "\n";
  os << indent << "Linked: " << this->IsLinked() << "\n";
  os << indent << "Shown: " << this->GetShown() << "\n";
  os << indent << "Mode: " << this->GetMode() << "\n";
  os << indent << "Linear: " << this->GetLinear() << "\n";
  os << indent << "SquarePixels: " << this->GetSquarePixels() << "\n";
  os << indent << "Interactive: " << parts.Interactive << "\n";
  os << indent << "InteractiveStep: " << parts.InteractiveStep << "\n";
  os << indent << "Annotated: " << parts.Annotated << "\n";
}

// Fires ModifiedEvent when the picture was up to date until now.
void vtkUltrasoundSliceView::Outdate()
{
  this->Parts->PictureDirty = true;
  this->Modified();
}

void vtkUltrasoundSliceView::SetSession(vtkUltrasoundAlignmentSession* session)
{
  Internals& parts = *this->Parts;
  if (parts.Session == session) {
    return;
  }
  for (const unsigned long observer : parts.Observers) {
    parts.Session->RemoveObserver(observer);
  }
  parts.Observers.clear();
  parts.Session = session;
  if (session) {
    for (const auto event :
         {vtkUltrasoundAlignmentSession::VolumesChangedEvent, vtkUltrasoundAlignmentSession::PosesChangedEvent,
          vtkUltrasoundAlignmentSession::SelectionChangedEvent, vtkUltrasoundAlignmentSession::VoxelsChangedEvent}) {
      parts.Observers.push_back(session->AddObserver(event, this, &vtkUltrasoundSliceView::SessionChanged));
    }
  }
  this->Outdate();
}

vtkUltrasoundAlignmentSession* vtkUltrasoundSliceView::GetSession() const
{
  return this->Parts->Session;
}

void vtkUltrasoundSliceView::SessionChanged(vtkObject*, unsigned long event, void*)
{
  const Internals& parts = *this->Parts;
  const bool selectionShows = parts.Shown != 0 || parts.Parameters.mode != SliceMode::Blend;
  if (event != vtkUltrasoundAlignmentSession::SelectionChangedEvent || selectionShows) {
    this->Outdate();
  }
}

vtkRenderer* vtkUltrasoundSliceView::GetRenderer() const
{
  return this->Parts->Renderer;
}

void vtkUltrasoundSliceView::SetPixelSize(int width, int height)
{
  Internals& parts = *this->Parts;
  constexpr int largest = 1 << 15;
  if (width < 1 || height < 1 || width > largest || height > largest) {
    vtkErrorMacro("the size of a slice view is " << width << " x " << height << " pixels; each must be in [1, " << largest
                                                 << "]");
    return;
  }
  if (width != parts.Width || height != parts.Height) {
    parts.Width = width;
    parts.Height = height;
    this->Outdate();
  }
}

void vtkUltrasoundSliceView::GetPixelSize(int size[2]) const
{
  size[0] = this->Parts->Width;
  size[1] = this->Parts->Height;
}

void vtkUltrasoundSliceView::SetAxis(const char* name)
{
  Internals& parts = *this->Parts;
  std::size_t place = 0;
  while (place < Axes().size() && !(name && std::string(Axes()[place].Name) == name)) {
    ++place;
  }
  if (place == Axes().size()) {
    vtkErrorMacro("the axis of a slice view is \"" << (name ? name : "") << "\"; it must be x, y, z or oblique");
    return;
  }
  if (place == parts.AxisPlace) {
    return;
  }
  parts.AxisPlace = place;
  if (place < 3) {
    parts.Right = Axes()[place].Right;
    parts.Up = Axes()[place].Up;
    parts.Along = Axes()[place].Along;
    parts.FollowCursor();
  } else {
    parts.Along = parts.Towards();
  }
  this->Outdate();
  this->OutdateLines();
}

// Of the linked views: where this one's plane cuts theirs.
void vtkUltrasoundSliceView::OutdateLines()
{
  for (vtkUltrasoundSliceView* view : *this->Parts->Linked) {
    if (view != this) {
      view->Parts->LinesDirty = true;
      view->Modified();
    }
  }
}

std::string vtkUltrasoundSliceView::GetAxis() const
{
  return Axes()[this->Parts->AxisPlace].Name;
}

void vtkUltrasoundSliceView::SetNormalAndUp(double nx, double ny, double nz, double ux, double uy, double uz)
{
  Internals& parts = *this->Parts;
  const Vector3d normal(nx, ny, nz), up(ux, uy, uz), right = up.cross(normal);
  if (!(right.norm() > 1e-9 * normal.norm() * up.norm() && right.allFinite())) {
    vtkErrorMacro("the normal and the up direction of a slice view must be finite, not zero and not parallel");
    return;
  }
  parts.AxisPlace = 3;
  parts.Right = right.normalized();
  parts.Along = normal.normalized();
  parts.Up = parts.Along.cross(parts.Right);
  parts.FollowCursor();
  this->Outdate();
  this->OutdateLines();
}

void vtkUltrasoundSliceView::Turn(double degreesAboutRight, double degreesAboutUp)
{
  Internals& parts = *this->Parts;
  if (!std::isfinite(degreesAboutRight) || !std::isfinite(degreesAboutUp)) {
    vtkErrorMacro("the angles that a slice view turns by must be finite");
    return;
  }
  const double radians = EIGEN_PI / 180.0;
  const Eigen::Matrix3d turn =
      ExpRotation(radians * degreesAboutRight * parts.Right) * ExpRotation(radians * degreesAboutUp * parts.Up);
  const Vector3d normal = turn * parts.Towards(), up = turn * parts.Up;
  parts.Focus = parts.Cursor + turn * (parts.Focus - parts.Cursor);
  this->SetNormalAndUp(normal.x(), normal.y(), normal.z(), up.x(), up.y(), up.z());
}

void vtkUltrasoundSliceView::GetRight(double right[3]) const
{
  std::copy_n(this->Parts->Right.data(), 3, right);
}

void vtkUltrasoundSliceView::GetUp(double up[3]) const
{
  std::copy_n(this->Parts->Up.data(), 3, up);
}

void vtkUltrasoundSliceView::GetNormal(double normal[3]) const
{
  const Vector3d towards = this->Parts->Towards();
  std::copy_n(towards.data(), 3, normal);
}

void vtkUltrasoundSliceView::SetPosition(double mm)
{
  if (!std::isfinite(mm)) {
    vtkErrorMacro("the position of a slice view must be finite");
    return;
  }
  const Internals& parts = *this->Parts;
  const Vector3d cursor = parts.Cursor + (mm - this->GetPosition()) * parts.Along;
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

double vtkUltrasoundSliceView::GetPosition() const
{
  return this->Parts->Focus.dot(this->Parts->Along);
}

void vtkUltrasoundSliceView::GetPositionRange(double range[2]) const
{
  const Internals& parts = *this->Parts;
  double low = VTK_DOUBLE_MAX, high = -VTK_DOUBLE_MAX;
  parts.ForCorners([&](const Vector3d& corner) {
    low = std::min(low, corner.dot(parts.Along));
    high = std::max(high, corner.dot(parts.Along));
  });
  range[0] = low <= high ? low : 0.0;
  range[1] = low <= high ? high : 0.0;
}

void vtkUltrasoundSliceView::SetFocus(double x, double y, double z)
{
  if (!Finite(x, y, z)) {
    vtkErrorMacro("the focus of a slice view must be finite");
    return;
  }
  Internals& parts = *this->Parts;
  parts.NeverFitted = false;
  // The cursor keeps its place in the picture's plane, and follows the plane.
  const Vector3d focus(x, y, z), cursor = parts.Cursor + (focus - parts.Cursor).dot(parts.Towards()) * parts.Towards();
  parts.Focus = focus;
  this->Outdate();
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

void vtkUltrasoundSliceView::GetFocus(double focus[3]) const
{
  std::copy_n(this->Parts->Focus.data(), 3, focus);
}

void vtkUltrasoundSliceView::SetCursor(double x, double y, double z)
{
  if (!Finite(x, y, z)) {
    vtkErrorMacro("the cursor of a slice view must be finite");
    return;
  }
  const Vector3d cursor(x, y, z);
  for (vtkUltrasoundSliceView* view : *this->Parts->Linked) {
    Internals& parts = *view->Parts;
    if (parts.Cursor == cursor) {
      continue;
    }
    const Vector3d before = parts.Focus;
    parts.Cursor = cursor;
    parts.FollowCursor();
    parts.LinesDirty = true;
    if (parts.Focus != before) {
      view->Outdate();
    } else {
      view->Modified();
    }
  }
}

void vtkUltrasoundSliceView::GetCursor(double cursor[3]) const
{
  std::copy_n(this->Parts->Cursor.data(), 3, cursor);
}

void vtkUltrasoundSliceView::SetMillimetresPerPixel(double mm)
{
  if (!(mm >= 1e-4 && mm <= 1000.0)) {
    vtkErrorMacro("the size of a pixel of a slice view is " << mm << " mm; it must be in [0.0001, 1000]");
    return;
  }
  for (vtkUltrasoundSliceView* view : *this->Parts->Linked) {
    view->Parts->NeverFitted = false;
    if (view->Parts->Millimetres != mm) {
      view->Parts->Millimetres = mm;
      view->Outdate();
    }
  }
}

double vtkUltrasoundSliceView::GetMillimetresPerPixel() const
{
  return this->Parts->Millimetres;
}

void vtkUltrasoundSliceView::Zoom(double factor, double pixelX, double pixelY)
{
  Internals& parts = *this->Parts;
  if (!(factor > 0.0) || !Finite(factor, pixelX, pixelY)) {
    vtkErrorMacro("the zoom factor of a slice view is " << factor << "; it must be above 0, and the pixel finite");
    return;
  }
  const Vector3d kept = parts.WorldOf(pixelX, pixelY);
  this->SetMillimetresPerPixel(std::clamp(parts.Millimetres / factor, 1e-4, 1000.0));
  parts.Focus += kept - parts.WorldOf(pixelX, pixelY);
}

void vtkUltrasoundSliceView::Pan(double pixelsX, double pixelsY)
{
  Internals& parts = *this->Parts;
  if (!std::isfinite(pixelsX) || !std::isfinite(pixelsY)) {
    vtkErrorMacro("a slice view pans by a finite number of pixels");
    return;
  }
  parts.NeverFitted = false;
  parts.Focus -= parts.Millimetres * (pixelsX * parts.Right + pixelsY * parts.Up);
  this->Outdate();
}

void vtkUltrasoundSliceView::Fit()
{
  constexpr double Margin = 1.05;
  // Where the volumes are in each of the linked views; the widest need is everybody's zoom.
  double mm = 0.0;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (vtkUltrasoundSliceView* view : *this->Parts->Linked) {
    const Internals& parts = *view->Parts;
    Eigen::AlignedBox3d box;
    parts.ForCorners(
        [&](const Vector3d& p) { box.extend(Vector3d(p.dot(parts.Right), p.dot(parts.Up), p.dot(parts.Towards()))); });
    boxes.push_back(box);
    if (!box.isEmpty()) {
      mm = std::max({mm, Margin * box.sizes().x() / parts.Width, Margin * box.sizes().y() / parts.Height});
    }
  }
  if (mm <= 0.0) {
    return;
  }
  this->SetMillimetresPerPixel(std::clamp(mm, 1e-4, 1000.0));
  Vector3d cursor = this->Parts->Cursor;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Internals& parts = *(*this->Parts->Linked)[i]->Parts;
    const Eigen::AlignedBox3d& box = boxes[i];
    if (box.isEmpty()) {
      continue;
    }
    const Vector3d middle = box.center(), towards = parts.Towards();
    const double depth = cursor.dot(towards);
    if (depth < box.min().z() || depth > box.max().z()) {
      cursor += (middle.z() - depth) * towards;
    }
    parts.Focus = middle.x() * parts.Right + middle.y() * parts.Up + parts.Focus.dot(towards) * towards;
    (*this->Parts->Linked)[i]->Outdate();
  }
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

void vtkUltrasoundSliceView::LinkTo(vtkUltrasoundSliceView* other)
{
  if (!other || other->Parts->Linked == this->Parts->Linked) {
    return;
  }
  this->Unlink();
  this->Parts->Linked = other->Parts->Linked;
  this->Parts->Linked->push_back(this);
  this->Parts->Cursor = other->Parts->Cursor;
  this->Parts->FollowCursor();
  this->Parts->Millimetres = other->Parts->Millimetres;
  this->Parts->NeverFitted = other->Parts->NeverFitted;
  for (vtkUltrasoundSliceView* view : *this->Parts->Linked) {
    view->Outdate();
  }
}

void vtkUltrasoundSliceView::Unlink()
{
  auto& linked = this->Parts->Linked;
  if (linked->size() == 1) {
    return;
  }
  linked->erase(std::find(linked->begin(), linked->end(), this));
  for (vtkUltrasoundSliceView* view : *linked) {
    view->Outdate();
  }
  linked = std::make_shared<std::vector<vtkUltrasoundSliceView*>>(1, this);
  this->Outdate();
}

bool vtkUltrasoundSliceView::IsLinked() const
{
  return this->Parts->Linked->size() > 1;
}

void vtkUltrasoundSliceView::PixelToWorld(double pixelX, double pixelY, double world[3]) const
{
  const Vector3d at = this->Parts->WorldOf(pixelX, pixelY);
  std::copy_n(at.data(), 3, world);
}

void vtkUltrasoundSliceView::WorldToPixel(double x, double y, double z, double pixel[2]) const
{
  const Vector2d at = this->Parts->PixelOf({x, y, z});
  std::copy_n(at.data(), 2, pixel);
}

void vtkUltrasoundSliceView::SetShown(const char* which)
{
  const std::size_t place = PlaceOf(ShownNames, which);
  if (place == ShownNames.size()) {
    vtkErrorMacro("what a slice view shows is \"" << (which ? which : "") << "\"; it must be all, selected or others");
    return;
  }
  if (place != this->Parts->Shown) {
    this->Parts->Shown = place;
    this->Outdate();
  }
}

std::string vtkUltrasoundSliceView::GetShown() const
{
  return ShownNames[this->Parts->Shown];
}

void vtkUltrasoundSliceView::SetMode(const char* mode)
{
  const std::size_t place = PlaceOf(ModeNames, mode);
  if (place == ModeNames.size()) {
    vtkErrorMacro("the mode of a slice view is \"" << (mode ? mode : "") << "\"; it must be blend, difference or checkerboard");
    return;
  }
  if (static_cast<SliceMode>(place) != this->Parts->Parameters.mode) {
    this->Parts->Parameters.mode = static_cast<SliceMode>(place);
    this->Outdate();
  }
}

std::string vtkUltrasoundSliceView::GetMode() const
{
  return ModeNames[static_cast<std::size_t>(this->Parts->Parameters.mode)];
}

void vtkUltrasoundSliceView::SetLinear(bool on)
{
  if (on != this->Parts->Parameters.linear) {
    this->Parts->Parameters.linear = on;
    this->Outdate();
  }
}

bool vtkUltrasoundSliceView::GetLinear() const
{
  return this->Parts->Parameters.linear;
}

void vtkUltrasoundSliceView::SetSquarePixels(int pixels)
{
  if (pixels < 2 || pixels > 10000) {
    vtkErrorMacro("the squares of the checkerboard are " << pixels << " pixels wide; they must be in [2, 10000]");
    return;
  }
  if (pixels != this->Parts->Parameters.squarePixels) {
    this->Parts->Parameters.squarePixels = pixels;
    this->Outdate();
  }
}

int vtkUltrasoundSliceView::GetSquarePixels() const
{
  return this->Parts->Parameters.squarePixels;
}

void vtkUltrasoundSliceView::SetInteractive(bool on)
{
  Internals& parts = *this->Parts;
  parts.Interactive = on;
  if (!on && parts.PictureStep > 1) {
    this->Outdate();
  }
}

bool vtkUltrasoundSliceView::GetInteractive() const
{
  return this->Parts->Interactive;
}

void vtkUltrasoundSliceView::SetInteractiveStep(int step)
{
  if (step < 0 || step > 16) {
    vtkErrorMacro("the interactive step of a slice view is " << step << "; it must be in [0, 16]");
    return;
  }
  this->Parts->InteractiveStep = step;
}

int vtkUltrasoundSliceView::GetInteractiveStep() const
{
  return this->Parts->InteractiveStep;
}

void vtkUltrasoundSliceView::SetBrush(double x, double y, double z, double radiusMm)
{
  if (!Finite(x, y, z) || !(radiusMm > 0.0 && std::isfinite(radiusMm))) {
    vtkErrorMacro("the brush of a slice view is at a point that is not finite, or its radius is not above 0");
    return;
  }
  Internals& parts = *this->Parts;
  parts.Brush = Vector3d(x, y, z);
  parts.BrushMm = radiusMm;
  parts.LinesDirty = true;
  this->Modified();
}

void vtkUltrasoundSliceView::HideBrush()
{
  if (this->Parts->Brush) {
    this->Parts->Brush.reset();
    this->Parts->LinesDirty = true;
    this->Modified();
  }
}

void vtkUltrasoundSliceView::SetAnnotated(bool on)
{
  if (on != this->Parts->Annotated) {
    this->Parts->Annotated = on;
    this->Parts->LinesDirty = true;
    this->Modified();
  }
}

bool vtkUltrasoundSliceView::GetAnnotated() const
{
  return this->Parts->Annotated;
}

bool vtkUltrasoundSliceView::Update()
{
  Internals& parts = *this->Parts;
  if (!parts.PictureDirty && !parts.LinesDirty) {
    return false;
  }
  if (parts.NeverFitted) {
    this->Fit();
  }
  if (parts.PictureDirty) {
    try {
      parts.Draw();
      parts.Actor->SetVisibility(true);
    } catch (const std::exception& error) {
      parts.Actor->SetVisibility(false);
      vtkErrorMacro(<< error.what());
    }
    parts.PlaceCamera();
  }
  parts.DrawLines();
  parts.PictureDirty = parts.LinesDirty = false;
  return true;
}

vtkImageData* vtkUltrasoundSliceView::GetPicture() const
{
  return this->Parts->Picture;
}

void vtkUltrasoundSliceView::GetPlaneCorners(double corners[12]) const
{
  const Internals& parts = *this->Parts;
  const double right = parts.Width - 0.5, top = parts.Height - 0.5;
  const std::array<Vector3d, 4> points{parts.WorldOf(-0.5, -0.5), parts.WorldOf(right, -0.5), parts.WorldOf(right, top),
                                       parts.WorldOf(-0.5, top)};
  for (std::size_t i = 0; i < 4; ++i) {
    std::copy_n(points[i].data(), 3, corners + 3 * i);
  }
}

int vtkUltrasoundSliceView::GetPictureStep() const
{
  return this->Parts->PictureStep;
}

double vtkUltrasoundSliceView::GetPictureSeconds() const
{
  return this->Parts->PictureSeconds;
}
