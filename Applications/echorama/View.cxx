// SPDX-License-Identifier: BSD-3-Clause
// echorama view: three slice views and a 3D view of the volumes.
//
// The slices are parallel to the axes of the first volume, so a volume that lies obliquely is seen along its own axes, and
// all volumes are cut by the same planes of the world, which is what shows whether they fit.
#include "Commands.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/Percentile.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ValidPoints.h"
#include "Display.h"
#include "Filters/Embedding/Feather.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <array>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkCamera.h>
#include <vtkCoordinate.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkUltrasoundAlignmentSession.h>
#include <vtkUltrasoundSliceView.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundVolumeView.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

namespace echorama {
namespace {

struct ViewOptions {
  VolumeReading reading;
  std::vector<std::string> files;
  std::string poses, screenshot;
  std::vector<int> size{1200, 900};
  bool labels = false;
};

// How a plane lies on the screen, as axes of the first volume: down, and into the screen. Depth (the last axis of most
// ultrasound volumes) points down where it can.
struct PlaneAxes {
  int down, inward;
  double inwardSign; ///< so that right, down, inward are right-handed
  std::array<double, 3> colour;
};
constexpr PlaneAxes Planes[3] = {
    {2, 0, 1.0, {0.95, 0.45, 0.4}}, {2, 1, -1.0, {0.45, 0.85, 0.45}}, {1, 2, 1.0, {0.45, 0.65, 1.0}}};

// The colours of data, mixed and invented voxels of an embedded volume.
constexpr std::pair<EmbeddedVoxel, std::array<double, 3>> LabelTints[3] = {{EmbeddedVoxel::Data, {1.0, 1.0, 1.0}},
                                                                           {EmbeddedVoxel::Blend, {1.0, 0.85, 0.4}},
                                                                           {EmbeddedVoxel::Invented, {0.45, 0.65, 1.0}}};

// Fully bright colours whose hues are evenly spread: their mean is grey.
std::array<double, 3> TintOf(std::size_t i, std::size_t count)
{
  if (count == 1)
    return {1.0, 1.0, 1.0};
  const double hue = 6.0 * (static_cast<double>(i) / static_cast<double>(count) + 30.0 / 360.0);
  std::array<double, 3> tint;
  for (std::size_t c = 0; c < 3; ++c)
    tint[c] = 0.25 + 0.75 * std::clamp(2.0 - std::fabs(std::remainder(hue - 2.0 * static_cast<double>(c), 6.0)), 0.0, 1.0);
  return tint;
}

// An embedded volume whose valid region are the voxels of one label, or with Outside all that is there.
vtkSmartPointer<vtkImageData> PartOf(vtkImageData* volume, vtkDataArray* labels, EmbeddedVoxel part)
{
  vtkNew<vtkUnsignedCharArray> valid;
  valid->SetName(vtkUltrasoundVolume::ValidRegionName());
  valid->SetNumberOfValues(labels->GetNumberOfTuples());
  const auto voxels = vtkUltrasoundVolume::ViewOf<const EmbeddedVoxel>(labels, volume);
  std::transform(voxels.begin(), voxels.end(), valid->GetPointer(0), [part](EmbeddedVoxel voxel) -> unsigned char {
    return voxel != EmbeddedVoxel::Outside && (part == EmbeddedVoxel::Outside || part == voxel);
  });
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->ShallowCopy(volume);
  image->GetPointData()->AddArray(valid);
  image->GetPointData()->RemoveArray(vtkUltrasoundVolume::EmbeddingName()); // else the session shows all of the background
  return image;
}

vtkSmartPointer<vtkTextActor> AddText(vtkRenderer* view, int size, const std::array<double, 3>& colour, double top)
{
  auto text = vtkSmartPointer<vtkTextActor>::New();
  text->GetTextProperty()->SetFontSize(size);
  text->GetTextProperty()->SetColor(colour[0], colour[1], colour[2]);
  text->GetTextProperty()->SetVerticalJustificationToTop();
  text->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  text->SetPosition(0.012, top);
  view->AddActor2D(text);
  return text;
}

class ViewWindow {
public:
  ViewWindow(const std::vector<LoadedVolume>& volumes, const ViewOptions& options);

  vtkRenderWindow* RenderWindow() { return window_; }
  void Start();

  // What the user does. View 3 is the rendering.
  int ViewAt(int x, int y);
  void Scroll(int plane, int steps);
  void LookAt(int plane, int x, int y);
  void Pan(int plane, int dx, int dy);
  void Zoom(int plane, int dy);
  void ChangeWindow(int dx, int dy);
  void Toggle(std::size_t volume);
  void ToggleLabels();
  void Fit();
  void Reset();
  void Render(); ///< coarsely: Refine follows

private:
  struct Shown {
    int whole = 0;
    std::vector<int> parts; ///< of an embedded volume, by label
    bool visible = true;
  };
  void Add(const LoadedVolume& volume, const std::array<double, 3>& tint);
  void ShowVolumes();
  void Prepare();
  void Refine();

  vtkNew<vtkUltrasoundAlignmentSession> session_;
  std::vector<Shown> volumes_;
  double firstWindow_[2] = {0.0, 255.0}; ///< the grey window at first
  bool labels_;
  Eigen::Matrix3d frame_; ///< columns: the axes of the planes
  double step_ = 0.0;

  vtkNew<vtkRenderWindow> window_;
  vtkNew<vtkUltrasoundSliceView> slices_[3];
  vtkNew<vtkUltrasoundVolumeView> volume_;
  vtkRenderer* views_[4];
  vtkSmartPointer<vtkTextActor> titles_[3];
  vtkNew<vtkRenderWindowInteractor> interactor_;
};

class ViewStyle : public vtkInteractorStyleTrackballCamera {
public:
  static ViewStyle* New();
  vtkTypeMacro(ViewStyle, vtkInteractorStyleTrackballCamera);
  ViewWindow* View = nullptr;
  bool IsBusy() const { return drag_ != Drag::None || this->State != VTKIS_NONE; }

  void OnLeftButtonDown() override
  {
    if (!Begin(this->Interactor->GetControlKey() ? Drag::Window : Drag::Look))
      this->Superclass::OnLeftButtonDown();
    else if (drag_ == Drag::Look)
      this->View->LookAt(plane_, X(), Y());
  }
  void OnMiddleButtonDown() override
  {
    if (!Begin(Drag::Pan))
      this->Superclass::OnMiddleButtonDown();
  }
  void OnRightButtonDown() override
  {
    if (!Begin(Drag::Zoom))
      this->Superclass::OnRightButtonDown();
  }
  void OnMouseMove() override
  {
    const int dx = X() - lastX_, dy = Y() - lastY_;
    lastX_ = X();
    lastY_ = Y();
    switch (drag_) {
    case Drag::None:
      return this->Superclass::OnMouseMove();
    case Drag::Look:
      return this->View->LookAt(plane_, X(), Y());
    case Drag::Window:
      return this->View->ChangeWindow(dx, dy);
    case Drag::Pan:
      return this->View->Pan(plane_, dx, dy);
    case Drag::Zoom:
      return this->View->Zoom(plane_, dy);
    }
  }
  void OnLeftButtonUp() override
  {
    drag_ = Drag::None;
    this->Superclass::OnLeftButtonUp();
  }
  void OnMiddleButtonUp() override
  {
    drag_ = Drag::None;
    this->Superclass::OnMiddleButtonUp();
  }
  void OnRightButtonUp() override
  {
    drag_ = Drag::None;
    this->Superclass::OnRightButtonUp();
  }
  void OnMouseWheelForward() override { Wheel(1); }
  void OnMouseWheelBackward() override { Wheel(-1); }
  void OnChar() override
  {
    const char key = this->Interactor->GetKeyCode();
    const std::string name = this->Interactor->GetKeySym() ? this->Interactor->GetKeySym() : "";
    if (key >= '1' && key <= '9')
      this->View->Toggle(static_cast<std::size_t>(key - '1'));
    else if (key == 'l')
      this->View->ToggleLabels();
    else if (key == 'r')
      this->View->Reset();
    else if (name == "Up" || name == "Down")
      Wheel(name == "Up" ? 1 : -1);
    else if (key == 'q' || key == 'e')
      this->Interactor->TerminateApp();
  }

private:
  enum class Drag { None, Look, Window, Pan, Zoom };

  int X() const { return this->Interactor->GetEventPosition()[0]; }
  int Y() const { return this->Interactor->GetEventPosition()[1]; }
  bool Begin(Drag drag)
  {
    plane_ = this->View->ViewAt(X(), Y());
    drag_ = plane_ < 3 ? drag : Drag::None;
    lastX_ = X();
    lastY_ = Y();
    return plane_ < 3;
  }
  void Wheel(int steps)
  {
    const int view = this->View->ViewAt(X(), Y());
    if (view < 3)
      this->View->Scroll(view, steps);
    else if (steps > 0)
      this->Superclass::OnMouseWheelForward();
    else
      this->Superclass::OnMouseWheelBackward();
  }

  Drag drag_ = Drag::None;
  int plane_ = 3, lastX_ = 0, lastY_ = 0;
};
vtkStandardNewMacro(ViewStyle);

ViewWindow::ViewWindow(const std::vector<LoadedVolume>& volumes, const ViewOptions& options)
  : labels_(options.labels), frame_(vtkUltrasoundVolume::GeometryOf(volumes.front().image).direction)
{
  window_->SetWindowName("Echorama");
  window_->SetOffScreenRendering(!options.screenshot.empty());
  window_->SetSize(options.size[0], options.size[1]);
  window_->SetMultiSamples(0);
  constexpr double places[4][2] = {{0.0, 0.0}, {0.0, 0.5}, {0.5, 0.5}, {0.5, 0.0}};
  for (int view = 0; view < 4; ++view) {
    views_[view] = view < 3 ? slices_[view]->GetRenderer() : volume_->GetRenderer();
    views_[view]->SetViewport(places[view][0] + 0.001, places[view][1] + 0.001, places[view][0] + 0.499, places[view][1] + 0.499);
    window_->AddRenderer(views_[view]);
  }
  window_->AddObserver(vtkCommand::StartEvent, this, &ViewWindow::Prepare);
  for (int plane = 0; plane < 3; ++plane) {
    const PlaneAxes& axes = Planes[plane];
    const Eigen::Vector3d normal = -axes.inwardSign * frame_.col(axes.inward), up = -frame_.col(axes.down);
    slices_[plane]->SetSession(session_);
    slices_[plane]->SetNormalAndUp(normal.x(), normal.y(), normal.z(), up.x(), up.y(), up.z());
    slices_[plane]->SetColour(axes.colour[0], axes.colour[1], axes.colour[2]);
    if (plane > 0)
      slices_[plane]->LinkTo(slices_[0]);
    titles_[plane] = AddText(views_[plane], 15, axes.colour, 0.98);
  }
  views_[3]->SetBackground(0.06, 0.07, 0.09);
  volume_->SetOrientationMarker(false); // the volumes need not know the patient's axes
  volume_->SetSession(session_);

  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::ptrdiff_t real = 0;
  std::vector<double> levels; // some hundred thousand per volume
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    Add(volumes[i], TintOf(i, volumes.size()));
    vtkImageData* image = session_->GetImage(volumes_.back().whole);
    const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image);
    step_ = i == 0 ? geometry.spacing.minCoeff() : std::min(step_, geometry.spacing.minCoeff());
    const auto input = vtkUltrasoundVolume::CheckInput(nullptr, image, volumes[i].file);
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
      const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
      std::ptrdiff_t count = 0;
      const Eigen::Vector3d index = ValidCentroid<decltype(type)>(posed.intensity, posed.valid, count);
      middle += static_cast<double>(count) * (geometry.IndexToWorld() * index);
      real += count;
      const Sampler<decltype(type)> sampler(posed.intensity, posed.valid);
      for (std::ptrdiff_t v = 0, step = posed.intensity.Size() / 300000 | 1; v < posed.intensity.Size(); v += step)
        if (sampler.IsReal(v))
          levels.push_back(static_cast<double>(posed.intensity[v]));
    });
  }
  if (levels.empty())
    throw Error(Error::Kind::BadInput, volumes.front().file + ": nothing to show: no voxel is valid");
  middle /= static_cast<double>(real);
  session_->GetGreyWindow(firstWindow_);
  session_->SelectNone();
  volume_->SetMinimum(Percentile(levels, 0.9)); // fluid and weak speckle stay clear, so that one sees into the volume
  ShowVolumes();
  Prepare();
  slices_[0]->SetCursor(middle.x(), middle.y(), middle.z());
  Fit();
}

void ViewWindow::Add(const LoadedVolume& volume, const std::array<double, 3>& tint)
{
  const std::string name = std::filesystem::path(volume.file).filename().string();
  const auto add = [&](vtkImageData* image, const std::array<double, 3>& colour) {
    const int id = session_->AddVolume(image, nullptr, name.c_str());
    if (id <= 0)
      throw Error(Error::Kind::BadInput, Session::TakeReportedError());
    session_->SetColour(id, tint[0] * colour[0], tint[1] * colour[1], tint[2] * colour[2]);
    return id;
  };
  Shown shown;
  vtkDataArray* labels = volume.image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
  if (!labels || labels->GetDataType() != VTK_UNSIGNED_CHAR || labels->GetNumberOfComponents() != 1) {
    shown.whole = add(volume.image, {1.0, 1.0, 1.0});
  } else {
    shown.whole = add(PartOf(volume.image, labels, EmbeddedVoxel::Outside), {1.0, 1.0, 1.0});
    for (const auto& [label, colour] : LabelTints)
      shown.parts.push_back(add(PartOf(volume.image, labels, label), colour));
  }
  volumes_.push_back(shown);
  AddText(views_[3], 14, tint, 0.98)->SetInput((std::string(volumes_.size() - 1, '\n') + name).c_str());
}

void ViewWindow::ShowVolumes()
{
  for (const Shown& shown : volumes_) {
    const bool labelled = labels_ && !shown.parts.empty();
    session_->SetVisible(shown.whole, shown.visible && !labelled);
    for (const int part : shown.parts)
      session_->SetVisible(part, shown.visible && labelled);
  }
}

// Whatever the window's size is now, and whoever asked for a picture.
void ViewWindow::Prepare()
{
  // In coordinates along the axes of the planes: where they meet, and the box of the volumes.
  Eigen::Vector3d cursor, low, high;
  slices_[0]->GetCursor(cursor.data());
  cursor = (frame_.transpose() * cursor).eval();
  for (int plane = 0; plane < 3; ++plane) {
    const int* size = views_[plane]->GetSize();
    slices_[plane]->SetPixelSize(size[0], size[1]);
    slices_[plane]->Update();
    const int inward = Planes[plane].inward;
    const double sign = Planes[plane].inwardSign;
    double range[2];
    slices_[plane]->GetPositionRange(range);
    low[inward] = std::min(-sign * range[0], -sign * range[1]);
    high[inward] = std::max(-sign * range[0], -sign * range[1]);

    std::string name = "along axis " + std::string(1, "ijk"[inward]);
    for (int world = 0; world < 3; ++world)
      if (frame_(world, inward) > 1.0 - 1e-9)
        name = "xyz"[world];
    titles_[plane]->SetInput((name + " " + Fixed(cursor[inward], 1) + " mm").c_str());
  }
  for (int plane = 0; plane < 3; ++plane) {
    const auto& [down, inward, sign, colour] = Planes[plane];
    const int right = 3 - down - inward;
    Eigen::Matrix<double, 3, 4> corners = cursor.replicate<1, 4>();
    corners.row(right) << low[right], high[right], high[right], low[right];
    corners.row(down) << high[down], high[down], low[down], low[down];
    corners = (frame_ * corners).eval();
    volume_->SetPlane(plane, corners.data());
    volume_->SetPlaneColour(plane, colour[0], colour[1], colour[2]);
  }
}

void ViewWindow::Fit()
{
  slices_[0]->Fit();
  // From the side and a little from above, the second axis away from the viewer, depth down; the volumes fill the view.
  volume_->Fit();
  vtkCamera* camera = views_[3]->GetActiveCamera();
  const Eigen::Vector3d position = Eigen::Vector3d(camera->GetFocalPoint()) + frame_ * Eigen::Vector3d(0.4, -0.8, -0.45);
  const Eigen::Vector3d up = -frame_.col(2);
  camera->SetPosition(position.data());
  camera->SetViewUp(up.data());
  volume_->Fit();
}

void ViewWindow::Render()
{
  volume_->SetInteractive(true);
  window_->Render();
}

int ViewWindow::ViewAt(int x, int y)
{
  return static_cast<int>(std::find_if(views_, views_ + 3, [&](vtkRenderer* view) { return view->IsInViewport(x, y); }) - views_);
}

void ViewWindow::Scroll(int plane, int steps)
{
  double range[2];
  slices_[plane]->GetPositionRange(range);
  const double position = slices_[plane]->GetPosition() - Planes[plane].inwardSign * steps * step_;
  slices_[plane]->SetPosition(std::clamp(position, range[0], range[1]));
  Render();
}

void ViewWindow::LookAt(int plane, int x, int y)
{
  const int* corner = views_[plane]->GetOrigin();
  double at[3], range[2];
  slices_[plane]->PixelToWorld(x - corner[0], y - corner[1], at);
  slices_[plane]->SetCursor(at[0], at[1], at[2]);
  for (auto& slice : slices_) {
    slice->GetPositionRange(range);
    slice->SetPosition(std::clamp(slice->GetPosition(), range[0], range[1]));
  }
  Render();
}

void ViewWindow::Pan(int plane, int dx, int dy)
{
  slices_[plane]->Pan(dx, dy);
  Render();
}

void ViewWindow::Zoom(int plane, int dy)
{
  const int* size = views_[plane]->GetSize();
  slices_[plane]->Zoom(std::pow(1.01, dy), 0.5 * size[0], 0.5 * size[1]);
  Render();
}

void ViewWindow::ChangeWindow(int dx, int dy)
{
  double grey[2];
  session_->GetGreyWindow(grey);
  const double range = firstWindow_[1] - firstWindow_[0];
  const double middle = 0.5 * (grey[0] + grey[1]) - 0.003 * range * dy;
  const double half = std::max(0.5 * (grey[1] - grey[0]) + 0.002 * range * dx, 0.005 * range);
  session_->SetGreyWindow(middle - half, middle + half);
  Render();
}

void ViewWindow::Toggle(std::size_t volume)
{
  if (volume >= volumes_.size())
    return;
  volumes_[volume].visible = !volumes_[volume].visible;
  ShowVolumes();
  Render();
}

void ViewWindow::Reset()
{
  Fit();
  Render();
}

void ViewWindow::ToggleLabels()
{
  labels_ = !labels_;
  ShowVolumes();
  Render();
}

void ViewWindow::Refine()
{
  if (Session::Interrupted())
    interactor_->TerminateApp();
  else if (!static_cast<ViewStyle*>(interactor_->GetInteractorStyle())->IsBusy() && volume_->Refine())
    window_->Render();
}

void ViewWindow::Start()
{
  AddText(views_[3], 12, {0.6, 0.6, 0.6}, 0.09)
      ->SetInput("drag: look there   wheel: scroll   ctrl+drag: grey levels   middle: move   right: zoom\n"
                 "1-9: show or hide a volume   l: colour what is invented   r: reset the views   q: quit");
  vtkNew<ViewStyle> style;
  style->View = this;
  style->AddObserver(vtkCommand::StartInteractionEvent, this, &ViewWindow::Render);
  interactor_->SetRenderWindow(window_);
  interactor_->SetInteractorStyle(style);
  interactor_->Initialize();
  interactor_->AddObserver(vtkCommand::TimerEvent, this, &ViewWindow::Refine);
  interactor_->CreateRepeatingTimer(200);
  Render();
  interactor_->Start();
}

void View(Session& session, ViewOptions options)
{
  options.files = WithoutCompanions(session, options.files);
  std::vector<std::string> inputs = options.files;
  if (!options.poses.empty())
    inputs.push_back(options.poses);
  if (!options.screenshot.empty())
    CheckOutput(options.screenshot, inputs);
  CheckDisplay();
  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files, options.reading);
  ApplyPoses(session, volumes, options.poses);
  session.result["files"] = options.files;

  ViewWindow view(volumes, options);
  if (options.screenshot.empty()) {
    view.Start();
    return;
  }
  vtkNew<vtkPNGWriter> writer;
  session.Time("render", [&] {
    view.RenderWindow()->Render();
    vtkNew<vtkWindowToImageFilter> picture;
    picture->SetInput(view.RenderWindow());
    picture->ReadFrontBufferOff();
    picture->Update();
    writer->SetInputData(picture->GetOutput());
  });
  FileReplacement replacement;
  writer->SetFileName(replacement.Stage(options.screenshot).c_str());
  session.Watch(writer, "write", {}, [&writer] { writer->Write(); });
  replacement.Commit();
  session.result["screenshot"] = options.screenshot;
  session.Say("wrote " + options.screenshot);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ViewOptions>();
  options->add_option("file", values->files, "Volumes of any format")->type_name("VOLUME")->required();
  AddParameter(options, Describe(values->reading.parameters), "Stride", "--stride");
  options->add_option("--poses", values->poses, "Pose file that says where the volumes belong")->type_name("FILE");
  options->add_option("--screenshot", values->screenshot, "Write a picture to this PNG file instead of opening a window")
      ->type_name("FILE");
  options->add_flag("--labels", values->labels,
                    "Colour what of an embedded volume is invented (blue) or mixed with that (yellow)");
  options->add_option("--size", values->size, "Width and height of the window in pixels")
      ->expected(2)
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  action = [values](Session& session) { View(session, *values); };
}

} // namespace echorama
