// SPDX-License-Identifier: BSD-3-Clause
// echorama view: three planes through the volumes, and a volume rendering.
//
// The planes are parallel to the axes of the first volume, so a volume that lies obliquely is seen along its own axes, and
// all volumes are cut by the same planes of the world, which is what shows whether they fit.
#include "Commands.h"
#include "Core/Base/FileReplacement.h"
#include "Display.h"
#include "Outputs.h"
#include "ShownVolumes.h"
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkImageSlice.h>
#include <vtkImageSliceMapper.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPNGWriter.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkSmartVolumeMapper.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>
#include <vtkWindowToImageFilter.h>

namespace echorama {
namespace {

struct ViewOptions {
  std::vector<std::string> files;
  std::string poses, screenshot;
  std::vector<int> size{1200, 900};
  bool labels = false;
};

// How a plane lies on the screen, as axes of the frame: to the right, down, and into the screen. Depth (the last axis of
// most ultrasound volumes) points down where it can.
struct PlaneAxes {
  int right, down, inward;
  double inwardSign; ///< so that right, down, inward are right-handed
};
constexpr PlaneAxes Planes[3] = {{1, 2, 0, 1.0}, {0, 2, 1, -1.0}, {0, 1, 2, 1.0}};
constexpr double PlaneColours[3][3] = {{0.95, 0.45, 0.4}, {0.45, 0.85, 0.45}, {0.45, 0.65, 1.0}};

vtkSmartPointer<vtkActor> LineActor(vtkPolyData* lines, const double* colour, double width)
{
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(lines);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
  actor->GetProperty()->SetLineWidth(static_cast<float>(width));
  actor->GetProperty()->LightingOff();
  actor->PickableOff();
  return actor;
}

vtkSmartPointer<vtkPolyData> Lines(const std::vector<Eigen::Vector3d>& points, const std::vector<std::pair<int, int>>& pairs)
{
  auto lines = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> coordinates;
  coordinates->SetDataTypeToDouble();
  for (const Eigen::Vector3d& point : points)
    coordinates->InsertNextPoint(point.data());
  vtkNew<vtkCellArray> cells;
  for (const auto& [a, b] : pairs) {
    const vtkIdType ids[2] = {a, b};
    cells->InsertNextCell(2, ids);
  }
  lines->SetPoints(coordinates);
  lines->SetLines(cells);
  return lines;
}

class ViewWindow {
public:
  ViewWindow(const std::vector<LoadedVolume>& volumes, const ViewOptions& options, bool offScreen);

  vtkRenderWindow* RenderWindow() { return window_; }
  void Start();

  // What the user does. Plane 3 is the rendering.
  int PlaneAt(int x, int y);
  void Scroll(int plane, int steps);
  void LookAt(int plane, int x, int y);
  void ChangeWindow(int dx, int dy);
  void Toggle(std::size_t volume);
  void ToggleLabels();
  void ResetCameras();
  void Render() { window_->Render(); }

private:
  void AddRendering();
  void Refresh();
  ImageGeometry GridOf(int plane) const;
  std::string NameOf(int plane) const;

  ShownVolumes volumes_;
  std::vector<std::string> names_;
  GreyWindow grey_;
  std::vector<bool> shown_;
  bool labels_;
  Eigen::Matrix3d frame_;   ///< columns: the axes of the planes
  Eigen::AlignedBox3d box_; ///< of all volumes, in coordinates of the frame
  Eigen::Vector3d focus_;   ///< where the planes meet, in coordinates of the frame
  double pixel_ = 1.0, step_ = 1.0;

  vtkNew<vtkRenderWindow> window_;
  vtkSmartPointer<vtkRenderer> views_[4];
  vtkSmartPointer<vtkImageSlice> slices_[3];
  vtkSmartPointer<vtkActor> crosses_[3][2], frames_[3];
  vtkSmartPointer<vtkTextActor> titles_[3];
  std::vector<vtkSmartPointer<vtkVolume>> renderings_;
};

class ViewStyle : public vtkInteractorStyleTrackballCamera {
public:
  static ViewStyle* New();
  vtkTypeMacro(ViewStyle, vtkInteractorStyleTrackballCamera);
  ViewWindow* View = nullptr;

  void OnLeftButtonDown() override
  {
    plane_ = this->View->PlaneAt(X(), Y());
    windowing_ = this->Interactor->GetControlKey() != 0;
    dragging_ = plane_ < 3;
    lastX_ = X();
    lastY_ = Y();
    if (!dragging_)
      this->Superclass::OnLeftButtonDown();
    else if (!windowing_)
      this->View->LookAt(plane_, X(), Y());
  }
  void OnMouseMove() override
  {
    if (!dragging_)
      this->Superclass::OnMouseMove();
    else if (windowing_)
      this->View->ChangeWindow(X() - lastX_, Y() - lastY_);
    else
      this->View->LookAt(plane_, X(), Y());
    lastX_ = X();
    lastY_ = Y();
  }
  void OnLeftButtonUp() override
  {
    if (!dragging_)
      this->Superclass::OnLeftButtonUp();
    dragging_ = false;
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
      this->View->ResetCameras();
    else if (name == "Up" || name == "Down")
      Wheel(name == "Up" ? 1 : -1);
    else if (key == 'q' || key == 'e')
      this->Interactor->TerminateApp();
  }

private:
  int X() const { return this->Interactor->GetEventPosition()[0]; }
  int Y() const { return this->Interactor->GetEventPosition()[1]; }
  void Wheel(int steps)
  {
    const int plane = this->View->PlaneAt(X(), Y());
    if (plane < 3)
      this->View->Scroll(plane, steps);
    else if (steps > 0)
      this->Superclass::OnMouseWheelForward();
    else
      this->Superclass::OnMouseWheelBackward();
  }

  int plane_ = 3, lastX_ = 0, lastY_ = 0;
  bool dragging_ = false, windowing_ = false;
};
vtkStandardNewMacro(ViewStyle);

ViewWindow::ViewWindow(const std::vector<LoadedVolume>& volumes, const ViewOptions& options, bool offScreen)
  : volumes_(volumes), grey_(volumes_.Window()), shown_(volumes.size(), true), labels_(options.labels),
    frame_(volumes_.Geometry(0).direction), box_(volumes_.Box()), focus_(volumes_.Middle())
{
  for (const LoadedVolume& volume : volumes)
    names_.push_back(std::filesystem::path(volume.file).filename().string());
  step_ = volumes_.SmallestSpacing();
  pixel_ = std::max(step_, box_.sizes().maxCoeff() / 700.0);

  window_->SetWindowName("Echorama");
  window_->SetOffScreenRendering(offScreen);
  window_->SetSize(options.size[0], options.size[1]);
  window_->SetMultiSamples(0);
  constexpr double places[4][2] = {{0.0, 0.0}, {0.0, 0.5}, {0.5, 0.5}, {0.5, 0.0}};
  for (int view = 0; view < 4; ++view) {
    views_[view] = vtkSmartPointer<vtkRenderer>::New();
    views_[view]->SetViewport(places[view][0] + 0.001, places[view][1] + 0.001, places[view][0] + 0.499, places[view][1] + 0.499);
    window_->AddRenderer(views_[view]);
  }
  for (int plane = 0; plane < 3; ++plane) {
    views_[plane]->SetBackground(0.0, 0.0, 0.0);
    slices_[plane] = vtkSmartPointer<vtkImageSlice>::New();
    vtkNew<vtkImageSliceMapper> mapper;
    slices_[plane]->SetMapper(mapper);
    views_[plane]->AddViewProp(slices_[plane]);
    for (int line = 0; line < 2; ++line) {
      const int other = line == 0 ? Planes[plane].right : Planes[plane].down; // the plane that this line is the trace of
      crosses_[plane][line] = LineActor(nullptr, PlaneColours[other], 1.0);
      crosses_[plane][line]->GetProperty()->SetOpacity(0.6);
      views_[plane]->AddActor(crosses_[plane][line]);
    }
    frames_[plane] = LineActor(nullptr, PlaneColours[plane], 1.5);
    views_[3]->AddActor(frames_[plane]);
    titles_[plane] = vtkSmartPointer<vtkTextActor>::New();
    titles_[plane]->GetTextProperty()->SetFontSize(15);
    titles_[plane]->GetTextProperty()->SetColor(PlaneColours[plane][0], PlaneColours[plane][1], PlaneColours[plane][2]);
    titles_[plane]->SetPosition(8, 8);
    views_[plane]->AddActor2D(titles_[plane]);
  }
  AddRendering();
  Refresh();
  ResetCameras();
}

void ViewWindow::AddRendering()
{
  vtkRenderer* view = views_[3];
  view->SetBackground(0.06, 0.07, 0.09);
  const auto byteOf = [this](double share) { return 2.0 + 251.0 * grey_(volumes_.Percentile(share)); };
  for (std::size_t i = 0; i < volumes_.Count(); ++i) {
    const auto bytes = volumes_.Bytes(i, grey_, 256);
    vtkNew<vtkSmartVolumeMapper> mapper;
    mapper->SetInputData(bytes);
    mapper->SetRequestedRenderModeToGPU(); // the other mappers ignore the direction of a volume
    mapper->SetAutoAdjustSampleDistances(!window_->GetOffScreenRendering());
    vtkNew<vtkColorTransferFunction> colour;
    const auto& tint = volumes_.Tint(i);
    colour->AddRGBPoint(0.0, 0.0, 0.0, 0.0);
    colour->AddRGBPoint(byteOf(0.95), 0.6 * tint[0], 0.6 * tint[1], 0.6 * tint[2]);
    colour->AddRGBPoint(255.0, tint[0], tint[1], tint[2]);
    // Zero is what is not real. Fluid and weak speckle stay clear, so that one sees into the volume.
    vtkNew<vtkPiecewiseFunction> opacity;
    opacity->AddPoint(0.0, 0.0);
    opacity->AddPoint(byteOf(0.6), 0.0);
    opacity->AddPoint(byteOf(0.95), 0.08);
    opacity->AddPoint(255.0, 0.5);
    vtkNew<vtkVolumeProperty> property;
    property->SetColor(colour);
    property->SetScalarOpacity(opacity);
    property->SetInterpolationTypeToLinear();
    property->SetScalarOpacityUnitDistance(box_.diagonal().norm() / 150.0);
    auto rendering = vtkSmartPointer<vtkVolume>::New();
    rendering->SetMapper(mapper);
    rendering->SetProperty(property);
    view->AddVolume(rendering);
    renderings_.push_back(rendering);

    vtkNew<vtkTextActor> name;
    name->SetInput(names_[i].c_str());
    name->GetTextProperty()->SetFontSize(14);
    name->GetTextProperty()->SetColor(tint[0], tint[1], tint[2]);
    name->SetPosition(8, 8 + 18 * static_cast<double>(volumes_.Count() - 1 - i));
    view->AddActor2D(name);
  }
}

ImageGeometry ViewWindow::GridOf(int plane) const
{
  const PlaneAxes& axes = Planes[plane];
  ImageGeometry grid;
  grid.spacing.setConstant(pixel_);
  grid.direction.col(0) = frame_.col(axes.right);
  grid.direction.col(1) = frame_.col(axes.down);
  grid.direction.col(2) = axes.inwardSign * frame_.col(axes.inward);
  grid.dimensions = {static_cast<int>(box_.sizes()[axes.right] / pixel_ + 1.5),
                     static_cast<int>(box_.sizes()[axes.down] / pixel_ + 1.5), 1};
  Eigen::Vector3d first = box_.min();
  first[axes.inward] = focus_[axes.inward];
  grid.origin = frame_ * first;
  return grid;
}

std::string ViewWindow::NameOf(int plane) const
{
  const int axis = Planes[plane].inward;
  const std::string at = " " + Fixed(focus_[axis], 1) + " mm";
  for (int world = 0; world < 3; ++world)
    if (frame_(world, axis) > 1.0 - 1e-9)
      return std::string(1, "xyz"[world]) + at;
  return "along axis " + std::string(1, "ijk"[axis]) + at;
}

void ViewWindow::Refresh()
{
  for (int plane = 0; plane < 3; ++plane) {
    const ImageGeometry grid = GridOf(plane);
    auto* mapper = static_cast<vtkImageSliceMapper*>(slices_[plane]->GetMapper());
    mapper->SetInputData(volumes_.Picture(grid, grey_, shown_, labels_));
    titles_[plane]->SetInput(NameOf(plane).c_str());

    const PlaneAxes& axes = Planes[plane];
    const auto point = [&](double right, double down) {
      Eigen::Vector3d p = focus_;
      p[axes.right] = right;
      p[axes.down] = down;
      return Eigen::Vector3d(frame_ * p);
    };
    const double left = box_.min()[axes.right], right = box_.max()[axes.right];
    const double top = box_.min()[axes.down], bottom = box_.max()[axes.down];
    const double x = focus_[axes.right], y = focus_[axes.down];
    // Lines lie a little before the picture, as seen from the camera.
    const Eigen::Vector3d before = -0.5 * pixel_ * grid.direction.col(2);
    const auto show = [](vtkActor* actor, vtkPolyData* lines) {
      static_cast<vtkPolyDataMapper*>(actor->GetMapper())->SetInputData(lines);
    };
    show(crosses_[plane][0], Lines({point(x, top) + before, point(x, bottom) + before}, {{0, 1}}));
    show(crosses_[plane][1], Lines({point(left, y) + before, point(right, y) + before}, {{0, 1}}));
    show(frames_[plane], Lines({point(left, top), point(right, top), point(right, bottom), point(left, bottom)},
                               {{0, 1}, {1, 2}, {2, 3}, {3, 0}}));
  }
}

void ViewWindow::ResetCameras()
{
  const Eigen::Vector3d centre = frame_ * box_.center();
  const double diagonal = box_.diagonal().norm();
  for (int plane = 0; plane < 3; ++plane) {
    const PlaneAxes& axes = Planes[plane];
    const Eigen::Vector3d position = centre - 2.0 * diagonal * axes.inwardSign * frame_.col(axes.inward);
    const Eigen::Vector3d up = -frame_.col(axes.down);
    vtkCamera* camera = views_[plane]->GetActiveCamera();
    camera->ParallelProjectionOn();
    camera->SetFocalPoint(centre.data());
    camera->SetPosition(position.data());
    camera->SetViewUp(up.data());
    const double* viewport = views_[plane]->GetViewport();
    const double aspect =
        (viewport[2] - viewport[0]) * window_->GetSize()[0] / ((viewport[3] - viewport[1]) * window_->GetSize()[1]);
    camera->SetParallelScale(0.53 * std::max(box_.sizes()[axes.down], box_.sizes()[axes.right] / aspect));
    views_[plane]->ResetCameraClippingRange();
  }
  // From the side and a little from above, the second axis away from the viewer, depth down; the box fills the view.
  vtkCamera* camera = views_[3]->GetActiveCamera();
  const Eigen::Vector3d position = centre + 1.6 * diagonal * (frame_ * Eigen::Vector3d(0.4, -0.8, -0.45).normalized());
  const Eigen::Vector3d up = -frame_.col(2);
  camera->SetFocalPoint(centre.data());
  camera->SetPosition(position.data());
  camera->SetViewUp(up.data());
  camera->SetViewAngle(30.0);
  views_[3]->ResetCameraClippingRange();
}

int ViewWindow::PlaneAt(int x, int y)
{
  for (int view = 0; view < 4; ++view)
    if (views_[view]->IsInViewport(x, y))
      return view;
  return 3;
}

void ViewWindow::Scroll(int plane, int steps)
{
  const int axis = Planes[plane].inward;
  focus_[axis] = std::clamp(focus_[axis] + steps * step_, box_.min()[axis], box_.max()[axis]);
  Refresh();
  Render();
}

void ViewWindow::LookAt(int plane, int x, int y)
{
  views_[plane]->SetDisplayPoint(x, y, 0.0);
  views_[plane]->DisplayToWorld();
  const double* world = views_[plane]->GetWorldPoint();
  const Eigen::Vector3d at = frame_.transpose() * Eigen::Vector3d(world[0], world[1], world[2]) / world[3];
  for (const int axis : {Planes[plane].right, Planes[plane].down})
    focus_[axis] = std::clamp(at[axis], box_.min()[axis], box_.max()[axis]);
  Refresh();
  Render();
}

void ViewWindow::ChangeWindow(int dx, int dy)
{
  const double range = volumes_.Window().white - volumes_.Window().black;
  const double middle = 0.5 * (grey_.black + grey_.white) - 0.003 * range * dy;
  const double half = std::max(0.5 * (grey_.white - grey_.black) + 0.002 * range * dx, 0.005 * range);
  grey_ = {middle - half, middle + half};
  Refresh();
  Render();
}

void ViewWindow::Toggle(std::size_t volume)
{
  if (volume >= shown_.size())
    return;
  shown_[volume] = !shown_[volume];
  renderings_[volume]->SetVisibility(shown_[volume]);
  Refresh();
  Render();
}

void ViewWindow::ToggleLabels()
{
  labels_ = !labels_;
  Refresh();
  Render();
}

void ViewWindow::Start()
{
  vtkNew<vtkTextActor> help;
  help->SetInput("drag: look there   wheel: scroll   ctrl+drag: grey levels   middle: move   right: zoom\n"
                 "1-9: show or hide a volume   l: colour what is invented   r: reset the views   q: quit");
  help->GetTextProperty()->SetFontSize(12);
  help->GetTextProperty()->SetColor(0.6, 0.6, 0.6);
  help->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  help->SetPosition(0.02, 0.92);
  views_[3]->AddActor2D(help);

  vtkNew<vtkRenderWindowInteractor> interactor;
  vtkNew<ViewStyle> style;
  style->View = this;
  interactor->SetRenderWindow(window_);
  interactor->SetInteractorStyle(style);
  interactor->Initialize();
  vtkNew<vtkCallbackCommand> stopped;
  stopped->SetClientData(interactor);
  stopped->SetCallback([](vtkObject*, unsigned long, void* client, void*) {
    if (Session::Interrupted())
      static_cast<vtkRenderWindowInteractor*>(client)->TerminateApp();
  });
  interactor->AddObserver(vtkCommand::TimerEvent, stopped);
  interactor->CreateRepeatingTimer(200);
  Render();
  interactor->Start();
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
  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files);
  ApplyPoses(session, volumes, options.poses);
  session.result["files"] = options.files;

  ViewWindow view(volumes, options, !options.screenshot.empty());
  if (options.screenshot.empty()) {
    view.Start();
    return;
  }
  vtkNew<vtkPNGWriter> writer;
  session.Time("render", [&] {
    view.Render();
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

Command ViewCommand(CLI::App& program)
{
  auto values = std::make_shared<ViewOptions>();
  CLI::App* options = program.add_subcommand("view", "Show volumes: three planes and a volume rendering");
  options->add_option("file", values->files, "Volumes of any format")->required();
  options->add_option("--poses", values->poses, "Pose file that says where the volumes belong");
  options->add_option("--screenshot", values->screenshot, "Write a picture to this PNG file instead of opening a window");
  options->add_flag("--labels", values->labels,
                    "Colour what of an embedded volume is invented (blue) or mixed with that (yellow)");
  options->add_option("--size", values->size, "Width and height of the window in pixels")
      ->expected(2)
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  return {options, [values](Session& session) { View(session, *values); }};
}

} // namespace echorama
