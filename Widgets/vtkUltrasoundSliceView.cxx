// SPDX-License-Identifier: BSD-3-Clause
// The picture is drawn by DrawSlice in the pixels of the viewport and laid on a rectangle of the world, one texel on one pixel.
// With a parallel camera it does not matter how far behind the plane the rectangle lies: it lies far behind, so that whatever is
// drawn in the plane is in front of it. Lines of the view itself are few and are drawn in pixels, on top.
//
// Nothing is drawn before Update(), and then only what is out of date: poses that change ten times between two frames cost one
// picture.
#include "vtkUltrasoundSliceView.h"

#include "vtkCamera.h"
#include "vtkImageData.h"
#include "vtkObjectFactory.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundSliceInput.h"
#include "vtkUltrasoundSliceLines.h"
#include "vtkUltrasoundViewProps.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {
constexpr double DrawSeconds = 1.0 / 60.0; // half a frame's at 30 a second: the other half is the rendering's
constexpr int CoarsestStep = 4;            // beyond, speckle is gone
constexpr double FinestMm = 1e-4, CoarsestMm = 1000.0;

constexpr std::array<const char*, 3> ShownNames{"all", "selected", "others"};          // in the order of SliceShown
constexpr std::array<const char*, 3> ModeNames{"blend", "difference", "checkerboard"}; // in the order of SliceMode

// The place of a name in a list; the list's size when it is not there.
template <class Names>
std::size_t PlaceOf(const Names& names, const char* name)
{
  const auto found =
      std::find_if(names.begin(), names.end(), [&](const char* each) { return name && std::string(each) == name; });
  return static_cast<std::size_t>(found - names.begin());
}

bool Finite(double a, double b, double c = 0.0)
{
  return std::isfinite(a) && std::isfinite(b) && std::isfinite(c);
}

} // namespace

struct vtkUltrasoundSliceView::Internals {
  vtkUltrasoundSliceView* View;
  SliceFrame& Frame;
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  std::vector<unsigned long> Observers;
  double FullSeconds = 0.0;

  // What is out of date: drawing the picture, or the lines and the camera alone.
  bool PictureDirty = true, LinesDirty = true;

  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkCamera> Camera;
  vtkNew<vtkImageData> Picture;
  PlanePicture Laid;
  SliceLines Lines{Renderer};
  vtkSmartPointer<vtkImageData> Shifts; ///< a map that is laid over the picture
  vtkMTimeType ShiftsTime = 0;
  double ShiftsMm = 1.0;

  explicit Internals(vtkUltrasoundSliceView* view) : View(view), Frame(view->Frame)
  {
    this->Laid.Texture->SetInputData(this->Picture);
    this->Laid.Texture->InterpolateOff();
    this->Laid.Actor->VisibilityOff();
    this->Renderer->SetActiveCamera(this->Camera);
    this->Renderer->AddActor(this->Laid.Actor);
  }

  int StepNow() const
  {
    if (!this->View->Interactive) {
      return 1;
    }
    if (this->View->InteractiveStep > 0) {
      return this->View->InteractiveStep;
    }
    return std::clamp(static_cast<int>(std::ceil(std::sqrt(this->FullSeconds / DrawSeconds))), 1, CoarsestStep);
  }

  void Draw()
  {
    const SlicePlane plane = this->Frame.Plane();
    SliceParameters& parameters = this->View->Parameters;
    parameters.step = this->StepNow();
    ImageGeometry geometry;
    geometry.dimensions = {plane.width, plane.height, 1};
    geometry.origin = plane.origin;
    geometry.spacing.setConstant(this->Frame.mmPerPixel);
    geometry.direction << this->Frame.right, this->Frame.up, this->Frame.Towards();
    const int* size = this->Picture->GetDimensions();
    const bool fits = size[0] == plane.width && size[1] == plane.height;
    vtkUltrasoundVolume::SetGeometry(this->Picture, geometry);
    if (!fits) {
      this->Picture->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
    }
    const auto start = std::chrono::steady_clock::now();
    auto* pixels = static_cast<std::uint8_t*>(this->Picture->GetScalarPointer());
    DrawSlice(LayersOf(this->Session, this->View->Shown, this->View->Only), plane, parameters, pixels);
    if (this->Shifts) {
      vtkUltrasoundVolume::Input input;
      input.Image = this->Shifts;
      input.Intensity = this->Shifts->GetPointData()->GetScalars();
      LayShifts(vtkUltrasoundVolume::PosedVolumeOf<float>(input), this->ShiftsMm, this->Lines.IsLegendStale ? 0.2 : 0.55, plane,
                pixels);
    }
    this->View->PictureSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    this->FullSeconds = this->View->PictureSeconds * parameters.step * parameters.step;
    this->Picture->GetPointData()->GetScalars()->Modified();
    this->Picture->Modified();
  }

  void PlaceCamera()
  {
    const double mm = this->Frame.mmPerPixel, height = this->Frame.height * mm;
    const double far = 20.0 * std::max(height, this->Frame.width * mm);
    const Vector3d towards = this->Frame.Towards(), eye = this->Frame.focus + far * towards;
    this->Camera->SetParallelProjection(true);
    this->Camera->SetFocalPoint(this->Frame.focus.data());
    this->Camera->SetPosition(eye.data());
    this->Camera->SetViewUp(this->Frame.up.data());
    this->Camera->SetParallelScale(0.5 * height);
    this->Camera->SetClippingRange(0.001 * far, 2.0 * far);
    std::array<Vector3d, 4> corners = this->Frame.Corners();
    for (Vector3d& corner : corners) {
      corner -= 0.9 * far * towards;
    }
    this->Laid.Place(corners[0].data());
  }

  void DrawLines()
  {
    std::vector<OtherPlane> others;
    if (this->View->Annotated) {
      for (const vtkUltrasoundSliceView* other : *this->View->Linked) {
        others.push_back({&other->Frame, other->Colour.value_or(SliceAxes()[other->Frame.axis].colour)});
      }
    }
    this->Lines.LegendMm = this->Shifts ? this->ShiftsMm : 0.0;
    this->Lines.Draw(this->Session, this->Frame, others, this->View->Annotated);
  }
};

vtkStandardNewMacro(vtkUltrasoundSliceView);

vtkUltrasoundSliceView::vtkUltrasoundSliceView()
  : Linked(std::make_shared<std::vector<vtkUltrasoundSliceView*>>(1, this)), Parts(std::make_unique<Internals>(this))
{
}

vtkUltrasoundSliceView::~vtkUltrasoundSliceView()
{
  this->Unlink();
  this->SetSession(nullptr);
}

void vtkUltrasoundSliceView::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Session: " << this->GetSession() << "\n";
  os << indent << "PixelSize: " << this->Frame.width << " " << this->Frame.height << "\n";
  os << indent << "Axis: " << this->GetAxis() << "\n";
  os << indent << "Position: " << this->GetPosition() << " mm\n";
  os << indent << "Focus: " << this->Frame.focus.transpose() << "\n";
  os << indent << "Cursor: " << this->Frame.cursor.transpose() << "\n";
  os << indent << "MillimetresPerPixel: " << this->Frame.mmPerPixel << "\n";
  os << indent << "Linked: " << this->IsLinked() << "\n";
  os << indent << "Shown: " << this->GetShown() << "\n";
  os << indent << "Mode: " << this->GetMode() << "\n";
  os << indent << "Linear: " << this->GetLinear() << "\n";
  os << indent << "SquarePixels: " << this->GetSquarePixels() << "\n";
  os << indent << "Interactive: " << this->Interactive << "\n";
  os << indent << "InteractiveStep: " << this->InteractiveStep << "\n";
  os << indent << "Annotated: " << this->Annotated << "\n";
}

// Fires ModifiedEvent when the picture was up to date until now.
void vtkUltrasoundSliceView::Outdate()
{
  this->Parts->PictureDirty = true;
  this->Modified();
}

void vtkUltrasoundSliceView::OutdateLines()
{
  this->Parts->LinesDirty = true;
  this->Modified();
}

// The plane has moved or turned: its picture, and of the linked views where it cuts theirs.
void vtkUltrasoundSliceView::OutdatePlane()
{
  this->Outdate();
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    if (view != this) {
      view->OutdateLines();
    }
  }
}

bool vtkUltrasoundSliceView::InRange(const char* what, double value, double low, double high)
{
  if (value >= low && value <= high) {
    return true;
  }
  vtkErrorMacro(<< what << " of a slice view is " << value << "; it must be in [" << low << ", " << high << "]");
  return false;
}

// Errors name what was given.
#define EchoramaRequire(condition, sentence)                                                                                     \
  if (!(condition)) {                                                                                                            \
    vtkErrorMacro(sentence);                                                                                                     \
    return;                                                                                                                      \
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
    parts.Observers = echorama::ObserveSession(session, this, &vtkUltrasoundSliceView::OnSession);
  }
  this->Outdate();
}

vtkUltrasoundAlignmentSession* vtkUltrasoundSliceView::GetSession() const
{
  return this->Parts->Session;
}

void vtkUltrasoundSliceView::OnSession(vtkObject*, unsigned long event, void*)
{
  const bool selectionShows = this->Shown != SliceShown::All || this->Parameters.mode != SliceMode::Blend;
  if (event == vtkUltrasoundAlignmentSession::MeasurementsChangedEvent) {
    this->OutdateLines();
  } else if (event == vtkUltrasoundAlignmentSession::VolumesChangedEvent ||
             event == vtkUltrasoundAlignmentSession::PosesChangedEvent ||
             event == vtkUltrasoundAlignmentSession::VoxelsChangedEvent ||
             (event == vtkUltrasoundAlignmentSession::SelectionChangedEvent && selectionShows)) {
    this->Outdate();
  }
}

vtkRenderer* vtkUltrasoundSliceView::GetRenderer() const
{
  return this->Parts->Renderer;
}

void vtkUltrasoundSliceView::SetPixelSize(int width, int height)
{
  constexpr int largest = 1 << 15;
  EchoramaRequire(width >= 1 && height >= 1 && width <= largest && height <= largest,
                  "the size of a slice view is " << width << " x " << height << " pixels; each must be in [1, " << largest
                                                 << "]");
  this->Change(this->Frame.width, width);
  this->Change(this->Frame.height, height);
}

void vtkUltrasoundSliceView::SetAxis(const char* name)
{
  std::size_t place = 0;
  while (place < SliceAxes().size() && !(name && std::string(SliceAxes()[place].name) == name)) {
    ++place;
  }
  EchoramaRequire(place < SliceAxes().size(),
                  "the axis of a slice view is \"" << (name ? name : "") << "\"; it must be x, y, z or oblique");
  if (place != this->Frame.axis) {
    this->Frame.SetAxis(place);
    this->OutdatePlane();
  }
}

void vtkUltrasoundSliceView::SetColour(double r, double g, double b)
{
  EchoramaRequire(std::min({r, g, b}) >= 0.0 && std::max({r, g, b}) <= 1.0 && Finite(r, g, b),
                  "the colour of a slice view is " << r << ", " << g << ", " << b << "; each must be in [0, 1]");
  this->Colour = {r, g, b};
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    view->OutdateLines();
  }
}

void vtkUltrasoundSliceView::SetNormalAndUp(double nx, double ny, double nz, double ux, double uy, double uz)
{
  EchoramaRequire(this->Frame.SetNormalAndUp({nx, ny, nz}, {ux, uy, uz}),
                  "the normal and the up direction of a slice view must be finite, not zero and not parallel");
  this->OutdatePlane();
}

void vtkUltrasoundSliceView::Turn(double degreesAboutRight, double degreesAboutUp)
{
  EchoramaRequire(Finite(degreesAboutRight, degreesAboutUp), "the angles that a slice view turns by must be finite");
  this->Frame.Turn(degreesAboutRight, degreesAboutUp);
  this->OutdatePlane();
}

void vtkUltrasoundSliceView::SetPosition(double mm)
{
  EchoramaRequire(std::isfinite(mm), "the position of a slice view must be finite");
  const Vector3d cursor = this->Frame.cursor + (mm - this->GetPosition()) * this->Frame.along;
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

void vtkUltrasoundSliceView::GetPositionRange(double range[2]) const
{
  const Eigen::AlignedBox3d box = BoxOf(this->Parts->Session, this->Frame.along.replicate<1, 3>());
  range[0] = box.isEmpty() ? 0.0 : box.min().x();
  range[1] = box.isEmpty() ? 0.0 : box.max().x();
}

void vtkUltrasoundSliceView::SetFocus(double x, double y, double z)
{
  EchoramaRequire(Finite(x, y, z), "the focus of a slice view must be finite");
  this->NeverFitted = false;
  // The cursor keeps its place in the picture's plane, and follows the plane.
  const Vector3d focus(x, y, z), towards = this->Frame.Towards();
  const Vector3d cursor = this->Frame.cursor + (focus - this->Frame.cursor).dot(towards) * towards;
  this->Frame.focus = focus;
  this->Outdate();
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

void vtkUltrasoundSliceView::SetCursor(double x, double y, double z)
{
  EchoramaRequire(Finite(x, y, z), "the cursor of a slice view must be finite");
  const Vector3d cursor(x, y, z);
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    SliceFrame& frame = view->Frame;
    if (frame.cursor != cursor) {
      const Vector3d before = frame.focus;
      frame.cursor = cursor;
      frame.FollowCursor();
      view->Parts->PictureDirty = view->Parts->PictureDirty || frame.focus != before;
      view->OutdateLines();
    }
  }
}

void vtkUltrasoundSliceView::SetMillimetresPerPixel(double mm)
{
  if (!this->InRange("the size, in mm, of a pixel", mm, FinestMm, CoarsestMm)) {
    return;
  }
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    view->NeverFitted = false;
    view->Change(view->Frame.mmPerPixel, mm);
  }
}

void vtkUltrasoundSliceView::Zoom(double factor, double pixelX, double pixelY)
{
  EchoramaRequire(factor > 0.0 && Finite(factor, pixelX, pixelY),
                  "the zoom factor of a slice view is " << factor << "; it must be above 0, and the pixel finite");
  const double mm = std::clamp(this->Frame.mmPerPixel / factor, FinestMm, CoarsestMm);
  const Vector3d kept = this->Frame.WorldOf(pixelX, pixelY);
  // The focus first: who hears that the zoom has changed may draw at once.
  this->Frame.focus += (1.0 - mm / this->Frame.mmPerPixel) * (kept - this->Frame.focus);
  this->SetMillimetresPerPixel(mm);
}

void vtkUltrasoundSliceView::Pan(double pixelsX, double pixelsY)
{
  EchoramaRequire(Finite(pixelsX, pixelsY), "a slice view pans by a finite number of pixels");
  this->NeverFitted = false;
  this->Frame.focus -= this->Frame.mmPerPixel * (pixelsX * this->Frame.right + pixelsY * this->Frame.up);
  this->Outdate();
}

void vtkUltrasoundSliceView::Fit()
{
  constexpr double Margin = 1.05;
  // Where the volumes are in each of the linked views; the widest need is everybody's zoom.
  double mm = 0.0;
  std::vector<std::pair<vtkUltrasoundSliceView*, Eigen::AlignedBox3d>> boxes;
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    const SliceFrame& frame = view->Frame;
    Eigen::Matrix3d axes;
    axes << frame.right, frame.up, frame.Towards();
    const Eigen::AlignedBox3d box = BoxOf(view->Parts->Session, axes);
    if (!box.isEmpty()) {
      mm = std::max({mm, Margin * box.sizes().x() / frame.width, Margin * box.sizes().y() / frame.height});
      boxes.emplace_back(view, box);
    }
  }
  if (mm <= 0.0) {
    return;
  }
  this->SetMillimetresPerPixel(std::clamp(mm, FinestMm, CoarsestMm));
  Vector3d cursor = this->Frame.cursor;
  for (const auto& [view, box] : boxes) {
    SliceFrame& frame = view->Frame;
    const Vector3d middle = box.center(), towards = frame.Towards();
    const double depth = cursor.dot(towards);
    if (depth < box.min().z() || depth > box.max().z()) {
      cursor += (middle.z() - depth) * towards;
    }
    frame.focus = middle.x() * frame.right + middle.y() * frame.up + frame.focus.dot(towards) * towards;
    view->Outdate();
  }
  this->SetCursor(cursor.x(), cursor.y(), cursor.z());
}

void vtkUltrasoundSliceView::LinkTo(vtkUltrasoundSliceView* other)
{
  if (!other || other->Linked == this->Linked) {
    return;
  }
  this->Unlink();
  this->Linked = other->Linked;
  this->Linked->push_back(this);
  this->Frame.cursor = other->Frame.cursor;
  this->Frame.FollowCursor();
  this->Frame.mmPerPixel = other->Frame.mmPerPixel;
  this->NeverFitted = other->NeverFitted;
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    view->Outdate();
  }
}

void vtkUltrasoundSliceView::Unlink()
{
  if (!this->IsLinked()) {
    return;
  }
  this->Linked->erase(std::find(this->Linked->begin(), this->Linked->end(), this));
  for (vtkUltrasoundSliceView* view : *this->Linked) {
    view->Outdate();
  }
  this->Linked = std::make_shared<std::vector<vtkUltrasoundSliceView*>>(1, this);
  this->Outdate();
}

void vtkUltrasoundSliceView::SetShown(const char* which)
{
  const std::size_t place = PlaceOf(ShownNames, which);
  EchoramaRequire(place < ShownNames.size(),
                  "what a slice view shows is \"" << (which ? which : "") << "\"; it must be all, selected or others");
  this->Change(this->Shown, static_cast<SliceShown>(place));
}

std::string vtkUltrasoundSliceView::GetShown() const
{
  return ShownNames[static_cast<std::size_t>(this->Shown)];
}

void vtkUltrasoundSliceView::SetMode(const char* mode)
{
  const std::size_t place = PlaceOf(ModeNames, mode);
  EchoramaRequire(place < ModeNames.size(),
                  "the mode of a slice view is \"" << (mode ? mode : "") << "\"; it must be blend, difference or checkerboard");
  this->Change(this->Parameters.mode, static_cast<SliceMode>(place));
}

std::string vtkUltrasoundSliceView::GetMode() const
{
  return ModeNames[static_cast<std::size_t>(this->Parameters.mode)];
}

void vtkUltrasoundSliceView::SetSquarePixels(int pixels)
{
  if (this->InRange("the width, in pixels, of the checkerboard's squares", pixels, 2, 10000)) {
    this->Change(this->Parameters.squarePixels, pixels);
  }
}

void vtkUltrasoundSliceView::SetInteractive(bool on)
{
  this->Interactive = on;
  if (!on && this->Parameters.step > 1) {
    this->Outdate();
  }
}

void vtkUltrasoundSliceView::SetInteractiveStep(int step)
{
  if (this->InRange("the interactive step", step, 0, 16)) {
    this->InteractiveStep = step;
  }
}

void vtkUltrasoundSliceView::SetBrush(double x, double y, double z, double radiusMm)
{
  EchoramaRequire(Finite(x, y, z) && radiusMm > 0.0 && std::isfinite(radiusMm),
                  "the brush of a slice view is at a point that is not finite, or its radius is not above 0");
  this->Parts->Lines.Brush = {x, y, z};
  this->Parts->Lines.BrushMm = radiusMm;
  this->OutdateLines();
}

void vtkUltrasoundSliceView::HideBrush()
{
  if (this->Parts->Lines.BrushMm > 0.0) {
    this->Parts->Lines.BrushMm = 0.0;
    this->OutdateLines();
  }
}

void vtkUltrasoundSliceView::SetPointer(double x, double y, double z)
{
  EchoramaRequire(Finite(x, y, z), "the pointer of a slice view must be finite");
  this->Parts->Lines.Pointer = Vector3d(x, y, z);
  this->OutdateLines();
}

void vtkUltrasoundSliceView::HidePointer()
{
  if (std::exchange(this->Parts->Lines.Pointer, std::nullopt)) {
    this->OutdateLines();
  }
}

void vtkUltrasoundSliceView::SetDraft(const std::vector<Vector3d>& points)
{
  if (this->Parts->Lines.Draft != points) {
    this->Parts->Lines.Draft = points;
    this->OutdateLines();
  }
}

void vtkUltrasoundSliceView::SetShifts(vtkImageData* map, double mostMm, bool stale)
{
  EchoramaRequire(!map || (mostMm > 0.0 && std::isfinite(mostMm)),
                  "the scale of a map of shifts ends at " << mostMm << " mm; it must be above 0");
  EchoramaRequire(!map || vtkFloatArray::SafeDownCast(map->GetPointData()->GetScalars()),
                  "a map of shifts needs floats, of which those that are NaN are not known");
  Internals& parts = *this->Parts;
  const vtkMTimeType time = map ? map->GetMTime() : 0; // with its values: a filter that has run again has the same output
  if (map != parts.Shifts ||
      (map && (time != parts.ShiftsTime || mostMm != parts.ShiftsMm || stale != parts.Lines.IsLegendStale))) {
    parts.Shifts = map;
    parts.ShiftsTime = time;
    parts.ShiftsMm = mostMm;
    parts.Lines.IsLegendStale = stale;
    this->Outdate();
  }
}

void vtkUltrasoundSliceView::SetAnnotated(bool on)
{
  if (on != this->Annotated) {
    this->Annotated = on;
    this->OutdateLines();
  }
}

bool vtkUltrasoundSliceView::Update()
{
  Internals& parts = *this->Parts;
  if (!parts.PictureDirty && !parts.LinesDirty) {
    return false;
  }
  if (this->NeverFitted) {
    this->Fit();
  }
  if (parts.PictureDirty) {
    try {
      parts.Draw();
      parts.Laid.Actor->VisibilityOn();
    } catch (const std::exception& error) {
      parts.Laid.Actor->VisibilityOff();
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
  std::copy_n(this->Frame.Corners()[0].data(), 12, corners);
}

#undef EchoramaRequire
