// SPDX-License-Identifier: BSD-3-Clause
// What is opaque must be drawn before the particles (see ParticleCloud): their actor is always the last.
#include "vtkUltrasoundVolumeView.h"

#include "vtkAutoInit.h"
#include "vtkBoundingBox.h"
#include "vtkImageData.h"
#include "vtkObjectFactory.h"
#include "vtkRenderWindow.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundErrorArrows.h"
#include "vtkUltrasoundLineOfSight.h"
#include "vtkUltrasoundParticleCloud.h"
#include "vtkUltrasoundShownVolume.h"
#include "vtkUltrasoundViewProps.h"
#include "vtkWeakPointer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <vector>

// The view makes text and ray casters at once: whoever uses it need not know what draws them.
VTK_MODULE_INIT(vtkRenderingFreeType);
VTK_MODULE_INIT(vtkRenderingOpenGL2);
VTK_MODULE_INIT(vtkRenderingVolumeOpenGL2);

using echorama::ParticleCloud;
using echorama::ParticleParameters;
using echorama::SessionVolume;
using echorama::ShownVolume;

struct vtkUltrasoundVolumeView::Internals {
  vtkUltrasoundVolumeView* View;
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  std::vector<unsigned long> Observers;
  vtkNew<vtkRenderer> Renderer;

  bool EverFitted = false, Updating = false;
  bool Deferred = false;                     ///< voxels or grey window changed and are not shown yet
  std::map<std::string, double> FullSeconds; ///< of the last full picture, by style
  std::vector<int> VisibleIds;               ///< of the last frame
  std::chrono::steady_clock::time_point Begin, DrawBegin;

  bool VolumesDirty = true, PosesDirty = true;
  vtkWeakPointer<vtkRenderWindow> Window;   ///< that was asked last what draws it
  bool Software = true, OnProcessor = true; ///< what it answered, and what follows
  bool Remade = false;                      ///< this frame began with new particles: its time says nothing about the next
  std::map<int, ShownVolume> Volumes;
  std::map<int, echorama::FramedPicture> Planes;
  ParticleCloud Cloud;
  echorama::ErrorArrows Errors{this->Renderer};
  echorama::OrientationMarker Marker{this->Renderer};

  explicit Internals(vtkUltrasoundVolumeView* view) : View(view)
  {
    this->Renderer->SetBackground(0.0, 0.0, 0.0);
    this->Renderer->AddActor(this->Cloud.Actor);
  }

  const std::vector<SessionVolume>& State() const { return this->Session->GetKernel().State().volumes; }
  const SessionVolume* Find(int id) const { return this->Session->GetKernel().State().Find(id); }

  // Before the particles, which are to be drawn last.
  void AddProps(vtkProp* one, vtkProp* other)
  {
    this->Renderer->RemoveViewProp(this->Cloud.Actor);
    this->Renderer->AddViewProp(one);
    this->Renderer->AddViewProp(other);
    this->Renderer->AddViewProp(this->Cloud.Actor);
  }

  bool IsShown(const SessionVolume& volume) const
  {
    const std::vector<int>& only = this->View->Only;
    return only.empty() ? volume.visible : std::find(only.begin(), only.end(), volume.id) != only.end();
  }

  double KnownSeconds() const
  {
    const auto known = this->FullSeconds.find(this->View->Style);
    return known != this->FullSeconds.end() ? known->second : 0.0;
  }

  // What the full picture takes, s. Before one was drawn: what it takes where there is no graphics card.
  double ExpectedSeconds() const
  {
    if (this->FullSeconds.count(this->View->Style) > 0) {
      return this->KnownSeconds();
    }
    if (this->View->Style == "outline") {
      return 0.0;
    }
    constexpr double PerParticle = 2e-6, PerVoxel = 2e-7;
    double blocks = 0.0, voxels = 0.0;
    for (const int id : this->VisibleIds) {
      const double count = this->Volumes.at(id).RealVoxels();
      voxels += count;
      blocks += count / std::pow(this->View->Parameters.downsampling, 3);
    }
    return this->View->Style == "points" ? PerParticle * std::min<double>(blocks, this->View->Parameters.budget)
                                         : PerVoxel * voxels;
  }

  // What a drag will begin with, while nobody waits for it.
  void Prepare()
  {
    const int level = this->View->Detail.LevelFor(this->ExpectedSeconds());
    for (auto& [id, shown] : this->Volumes) {
      const SessionVolume* volume = this->Session ? this->Find(id) : nullptr;
      if (volume && this->IsShown(*volume) && this->View->Style == "points") {
        shown.ParticlesAt(level, *volume, this->Session->GetShownImage(id));
      } else if (volume && this->IsShown(*volume) && this->View->Style == "volume") {
        shown.BytesAt(level, *volume, this->Session->GetShownImage(id));
      }
    }
  }

  // Before it draws, for then its context is current.
  void AskWindow()
  {
    if (this->Renderer->GetRenderWindow() != this->Window) {
      this->Window = this->Renderer->GetRenderWindow();
      this->Software = echorama::DrawsInSoftware(this->Window);
    }
    const bool before = this->OnProcessor;
    this->OnProcessor = this->View->DrawnBy == "automatic" ? this->Software : this->View->DrawnBy == "processor";
    this->VolumesDirty = this->VolumesDirty || this->OnProcessor != before;
  }

  void UpdateVolumes();
  void UpdatePlaces();
  void FitCamera();
};

// Which volumes there are and how they look.
void vtkUltrasoundVolumeView::Internals::UpdateVolumes()
{
  for (auto each = this->Volumes.begin(); each != this->Volumes.end();) {
    if (this->Session && this->Find(each->first)) {
      ++each;
      continue;
    }
    this->Renderer->RemoveViewProp(each->second.Volume);
    this->Renderer->RemoveViewProp(each->second.Box);
    each = this->Volumes.erase(each);
  }
  this->Cloud.Actor->VisibilityOff();
  const std::vector<int> before = std::move(this->VisibleIds);
  this->VisibleIds.clear();
  if (!this->Session) {
    return;
  }
  // A stroke and a drag of the grey window change all particles at each step: those of a volume that is shown already wait for
  // the end of the gesture.
  const bool waits = this->View->Detail.Dragging();
  this->Deferred = false;
  std::vector<int> visible;
  for (const SessionVolume& volume : this->State()) {
    if (this->IsShown(volume)) {
      visible.push_back(volume.id);
    }
  }
  ParticleParameters parameters = this->View->Parameters;
  double window[2];
  this->Session->GetGreyWindow(window);
  parameters.black = window[0];
  parameters.white = window[1];
  parameters.budget = std::max(1, this->View->Parameters.budget / std::max(1, static_cast<int>(visible.size())));
  for (const SessionVolume& volume : this->State()) {
    const bool isNew = this->Volumes.count(volume.id) == 0;
    ShownVolume& shown = this->Volumes[volume.id];
    if (isNew) {
      this->AddProps(shown.Box, shown.Volume);
    }
    ParticleParameters wanted = parameters;
    if (waits && !isNew) {
      wanted.black = shown.Look().black;
      wanted.white = shown.Look().white;
      this->Deferred = this->Deferred || shown.VoxelsDirty || wanted.black != window[0] || wanted.white != window[1];
    }
    const bool takes = isNew || (shown.VoxelsDirty && !waits), looksOther = shown.SetLook(wanted);
    if (takes) {
      shown.TakeVoxels(volume, this->Session->GetShownImage(volume.id));
    } else if (looksOther) {
      this->FullSeconds.clear();
    }
    shown.Box->SetVisibility(this->IsShown(volume) && (this->View->Style == "outline" || this->Session->IsSelected(volume.id)));
    shown.Box->GetProperty()->SetColor(volume.colour[0], volume.colour[1], volume.colour[2]);
    shown.Volume->SetVisibility(this->IsShown(volume) && this->View->Style == "volume");
  }
  this->VisibleIds = visible;
  if (visible != before) {
    this->FullSeconds.clear();
    if (this->View->Detail.Interactive()) {
      this->View->Detail.Begin(this->ExpectedSeconds());
    }
  }
  std::vector<ParticleCloud::Part> parts;
  for (const int id : visible) {
    const SessionVolume& volume = *this->Find(id);
    if (this->View->Style == "volume") {
      this->Volumes.at(id).CastRays(this->View->Detail.Level(), volume, this->Session->GetShownImage(id), this->OnProcessor);
    } else if (this->View->Style == "points") {
      const auto& particles =
          this->Volumes.at(id).ParticlesAt(this->View->Detail.Level(), volume, this->Session->GetShownImage(id));
      parts.push_back({{&particles, volume.colour, volume.opacity, volume.volumeToWorld}, id, {}});
    }
  }
  if (this->View->Style == "points") {
    this->Cloud.Fill(std::move(parts), this->View->ParticleSize);
    this->Cloud.Actor->VisibilityOn();
  }
}

void vtkUltrasoundVolumeView::Internals::UpdatePlaces()
{
  for (auto& [id, shown] : this->Volumes) {
    shown.Place(*this->Find(id));
  }
  if (this->Cloud.Actor->GetVisibility()) {
    for (ParticleCloud::Part& part : this->Cloud.Parts()) {
      part.volumeToWorld = this->Find(part.volume)->volumeToWorld;
    }
    this->Cloud.Move();
  }
  this->Errors.Update(this->View->ShowErrors ? this->Session.Get() : nullptr);
}

void vtkUltrasoundVolumeView::Internals::FitCamera()
{
  vtkBoundingBox box;
  for (const int id : this->VisibleIds) {
    box.AddBounds(this->Volumes.at(id).Box->GetBounds());
  }
  if (!box.IsValid()) {
    return;
  }
  if (!this->EverFitted) {
    // Towards posterior, a little from the left and above.
    vtkCamera* camera = this->Renderer->GetActiveCamera();
    camera->SetFocalPoint(0.0, 0.0, 0.0);
    camera->SetPosition(0.6, -1.0, 0.45);
    camera->SetViewUp(0.0, 0.0, 1.0);
    this->EverFitted = true;
  }
  double bounds[6];
  box.GetBounds(bounds);
  this->Renderer->ResetCamera(bounds);
}

vtkStandardNewMacro(vtkUltrasoundVolumeView);

vtkUltrasoundVolumeView::vtkUltrasoundVolumeView() : Parts(std::make_unique<Internals>(this))
{
  this->Parts->Renderer->AddObserver(vtkCommand::StartEvent, this, &vtkUltrasoundVolumeView::OnStart);
  this->Parts->Renderer->AddObserver(vtkCommand::EndEvent, this, &vtkUltrasoundVolumeView::OnEnd);
}

vtkUltrasoundVolumeView::~vtkUltrasoundVolumeView()
{
  this->SetSession(nullptr);
}

void vtkUltrasoundVolumeView::SetSession(vtkUltrasoundAlignmentSession* session)
{
  Internals& parts = *this->Parts;
  if (parts.Session == session) {
    return;
  }
  for (const unsigned long observer : parts.Observers) {
    parts.Session->RemoveObserver(observer);
  }
  parts.Observers.clear();
  parts.Session = nullptr;
  parts.UpdateVolumes(); // what was shown goes
  parts.Session = session;
  if (session) {
    parts.Observers = echorama::ObserveSession(session, this, &vtkUltrasoundVolumeView::OnSession);
  }
  parts.VolumesDirty = parts.PosesDirty = true;
  this->Modified();
}

vtkUltrasoundAlignmentSession* vtkUltrasoundVolumeView::GetSession() const
{
  return this->Parts->Session;
}

vtkRenderer* vtkUltrasoundVolumeView::GetRenderer() const
{
  return this->Parts->Renderer;
}

void vtkUltrasoundVolumeView::OnSession(vtkObject*, unsigned long event, void* data)
{
  Internals& parts = *this->Parts;
  if (event == vtkUltrasoundAlignmentSession::PosesChangedEvent) {
    parts.PosesDirty = true;
  } else if (event == vtkUltrasoundAlignmentSession::VolumesChangedEvent ||
             event == vtkUltrasoundAlignmentSession::SelectionChangedEvent ||
             event == vtkUltrasoundAlignmentSession::VoxelsChangedEvent) {
    parts.VolumesDirty = true;
  } else {
    return;
  }
  if (event == vtkUltrasoundAlignmentSession::VoxelsChangedEvent) {
    for (auto& [id, shown] : parts.Volumes) {
      shown.VoxelsDirty = shown.VoxelsDirty || !data || *static_cast<int*>(data) == id;
    }
  }
  this->Modified();
}

bool vtkUltrasoundVolumeView::SetOnly(const std::vector<int>& ids)
{
  if (this->Only == ids) {
    return false;
  }
  this->Only = ids;
  this->Parts->VolumesDirty = true;
  this->Modified();
  return true;
}

int vtkUltrasoundVolumeView::GetVolumeAt(double pixelX, double pixelY, int which)
{
  Internals& parts = *this->Parts;
  const double least = this->Style == "outline" ? -1e300 : this->GetMinimum(),
               most = this->Style == "outline" ? 1e300 : this->GetMaximum();
  const auto ids = echorama::VolumesOnLine(parts.Session, parts.VisibleIds, echorama::LineOfSight(parts.Renderer, pixelX, pixelY),
                                           least, most);
  return which >= 0 && which < static_cast<int>(ids.size()) ? ids[static_cast<std::size_t>(which)] : 0;
}

void vtkUltrasoundVolumeView::Update()
{
  Internals& parts = *this->Parts;
  if (parts.Updating) {
    return;
  }
  parts.Updating = true;
  try {
    if (parts.VolumesDirty) {
      parts.UpdateVolumes();
      parts.VolumesDirty = false;
      parts.Remade = true;
      parts.PosesDirty = true;
    }
    if (parts.PosesDirty) {
      parts.UpdatePlaces();
    }
    parts.PosesDirty = false;
    if (!parts.EverFitted) {
      parts.FitCamera();
    }
  } catch (const std::exception& error) {
    parts.VolumesDirty = parts.PosesDirty = false; // said once
    parts.Cloud.Actor->VisibilityOff();
    vtkErrorMacro(<< error.what());
  }
  parts.Updating = false;
}

void vtkUltrasoundVolumeView::OnStart()
{
  Internals& parts = *this->Parts;
  parts.Begin = std::chrono::steady_clock::now();
  parts.AskWindow();
  this->Update();
  parts.Renderer->ResetCameraClippingRange(); // planes and arrows come and go
  parts.Cloud.Face(parts.Renderer, parts.OnProcessor);
  parts.Marker.Update(parts.Renderer->GetActiveCamera(), this->ShowMarker);
  parts.DrawBegin = std::chrono::steady_clock::now();
}

void vtkUltrasoundVolumeView::OnEnd()
{
  Internals& parts = *this->Parts;
  parts.Renderer->GetRenderWindow()->WaitForCompletion();
  const auto now = std::chrono::steady_clock::now();
  this->LastSeconds = std::chrono::duration<double>(now - parts.Begin).count();
  const bool typical = !parts.Remade;
  parts.Remade = false;
  if (this->Detail.Measure(this->LastSeconds, std::chrono::duration<double>(now - parts.DrawBegin).count(), typical)) {
    parts.VolumesDirty = true;
  }
  if (this->Detail.Full() && (typical || parts.FullSeconds.count(this->Style) == 0)) {
    parts.FullSeconds[this->Style] = this->LastSeconds;
  }
  if (this->Detail.Interactive()) {
    return; // coarser levels are there already
  }
  try {
    parts.Prepare();
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
  }
}

void vtkUltrasoundVolumeView::SetInteractive(bool on)
{
  Internals& parts = *this->Parts;
  const int before = this->Detail.Level();
  if (!this->Detail.SetInteractive(on, parts.ExpectedSeconds())) {
    return;
  }
  if (this->Detail.Level() != before || (!on && parts.Deferred)) {
    parts.VolumesDirty = true;
  }
  this->Modified();
}

bool vtkUltrasoundVolumeView::Refine()
{
  Internals& parts = *this->Parts;
  if (!this->Detail.Interactive()) {
    return false;
  }
  this->Update();
  if (parts.Deferred) {
    this->Detail.Stay();
  } else if (this->Detail.Level() == 0) {
    this->SetInteractive(false); // the same picture
    return false;
  } else if (!this->Detail.Refine(parts.KnownSeconds())) {
    return false;
  }
  parts.VolumesDirty = true;
  this->Modified();
  return true;
}

void vtkUltrasoundVolumeView::SetRestBudget(double milliseconds)
{
  if (milliseconds >= 5.0 && milliseconds <= 1e6) {
    this->Detail.restSeconds = milliseconds / 1000.0;
    this->Modified();
  } else {
    vtkErrorMacro("the time of a frame at rest must be in [5, 1000000] ms; it is " << milliseconds);
  }
}

void vtkUltrasoundVolumeView::SetFrameBudget(double milliseconds)
{
  if (milliseconds >= 5.0 && milliseconds <= 10000.0) {
    this->Detail.SetBudget(milliseconds / 1000.0);
    this->Modified();
  } else {
    vtkErrorMacro("the time of a frame must be in [5, 10000] ms; it is " << milliseconds);
  }
}

int vtkUltrasoundVolumeView::GetNumberOfParticles() const
{
  return this->Parts->Cloud.Count();
}

void vtkUltrasoundVolumeView::Fit()
{
  this->Update();
  this->Parts->FitCamera();
  this->Modified();
}

bool vtkUltrasoundVolumeView::SetStyle(const char* style)
{
  const std::string name = style ? style : "";
  if (name != "points" && name != "volume" && name != "outline") {
    vtkErrorMacro("the style is \"" << name << "\"; it must be \"points\", \"volume\" or \"outline\"");
    return false;
  }
  if (name != this->Style) {
    this->Style = name;
    if (this->Detail.Interactive()) {
      this->Detail.Begin(this->Parts->ExpectedSeconds());
    }
    this->Parts->VolumesDirty = true;
    this->Modified();
  }
  return true;
}

bool vtkUltrasoundVolumeView::SetDrawnBy(const char* who)
{
  const std::string name = who ? who : "";
  if (name != "automatic" && name != "processor" && name != "graphics") {
    vtkErrorMacro("the view is drawn by \"" << name << "\"; it must be \"automatic\", \"processor\" or \"graphics\"");
    return false;
  }
  this->DrawnBy = name;
  this->Parts->FullSeconds.clear();
  this->Modified();
  return true;
}

// Parameters are clamped to their ranges; what is not a number is left out.
#define EchoramaParameter(Name, Type, Member, Lowest, Highest)                                                                   \
  void vtkUltrasoundVolumeView::Set##Name(Type value)                                                                            \
  {                                                                                                                              \
    const Type clamped = std::clamp<Type>(value, Lowest, Highest);                                                               \
    if (std::isnan(static_cast<double>(value))) {                                                                                \
      vtkErrorMacro(#Name " must be a number");                                                                                  \
    } else if (this->Member != clamped) {                                                                                        \
      this->Member = clamped;                                                                                                    \
      this->Parts->VolumesDirty = true;                                                                                          \
      this->Modified();                                                                                                          \
    }                                                                                                                            \
  }
EchoramaParameter(Downsampling, int, Parameters.downsampling, 1, 64);
EchoramaParameter(Budget, int, Parameters.budget, 1000, 1000000000);
EchoramaParameter(ParticleSize, double, ParticleSize, 0.1, 10.0);
EchoramaParameter(Opacity, double, Parameters.opacity, 0.0, 1.0);
EchoramaParameter(ValueOpacity, bool, Parameters.valueOpacity, false, true);
EchoramaParameter(Minimum, double, Parameters.minimum, -1e300, 1e300);
EchoramaParameter(Maximum, double, Parameters.maximum, -1e300, 1e300);
EchoramaParameter(ErrorVectors, bool, ShowErrors, false, true);
EchoramaParameter(OrientationMarker, bool, ShowMarker, false, true);
#undef EchoramaParameter

bool vtkUltrasoundVolumeView::SetPlane(int plane, const double corners[12], vtkImageData* picture)
{
  Internals& parts = *this->Parts;
  if (!std::all_of(corners, corners + 12, [](double x) { return std::isfinite(x); })) {
    vtkErrorMacro("the corners of plane " << plane << " are not finite");
    return false;
  }
  if (picture && picture->GetNumberOfPoints() > 0 &&
      (!picture->GetPointData()->GetScalars() || picture->GetScalarType() != VTK_UNSIGNED_CHAR ||
       picture->GetNumberOfScalarComponents() < 3)) {
    vtkErrorMacro("the picture of plane " << plane << " must be of RGB or RGBA bytes");
    return false;
  }
  const bool isNew = parts.Planes.count(plane) == 0;
  echorama::FramedPicture& shown = parts.Planes[plane];
  if (isNew) {
    parts.AddProps(shown.Picture.Actor, shown.Outline);
  }
  shown.Picture.Place(corners);
  shown.Picture.Texture->SetInputData(picture && picture->GetNumberOfPoints() > 0 ? picture : nullptr);
  shown.Show(this->ShowPlanes);
  this->Modified();
  return true;
}

void vtkUltrasoundVolumeView::SetPlaneColour(int plane, double r, double g, double b)
{
  const auto found = this->Parts->Planes.find(plane);
  if (found == this->Parts->Planes.end()) {
    vtkErrorMacro("there is no plane " << plane);
    return;
  }
  found->second.Outline->GetProperty()->SetColor(r, g, b);
  this->Modified();
}

void vtkUltrasoundVolumeView::RemovePlane(int plane)
{
  const auto found = this->Parts->Planes.find(plane);
  if (found != this->Parts->Planes.end()) {
    this->Parts->Renderer->RemoveViewProp(found->second.Picture.Actor);
    this->Parts->Renderer->RemoveViewProp(found->second.Outline);
    this->Parts->Planes.erase(found);
    this->Modified();
  }
}

int vtkUltrasoundVolumeView::GetNumberOfPlanes() const
{
  return static_cast<int>(this->Parts->Planes.size());
}

void vtkUltrasoundVolumeView::SetShowPlanes(bool on)
{
  this->ShowPlanes = on;
  for (auto& [number, plane] : this->Parts->Planes) {
    plane.Show(on);
  }
  this->Modified();
}

void vtkUltrasoundVolumeView::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Session: " << this->GetSession() << "\n";
  os << indent << "Style: " << this->Style << "\n" << indent << "DrawnBy: " << this->DrawnBy << "\n";
  os << indent << "Downsampling: " << this->Parameters.downsampling << "\n";
  os << indent << "Budget: " << this->Parameters.budget << "\n";
  os << indent << "ParticleSize: " << this->ParticleSize << "\n";
  os << indent << "Opacity: " << this->Parameters.opacity << "\n";
  os << indent << "ValueOpacity: " << this->Parameters.valueOpacity << "\n";
  os << indent << "Minimum: " << this->Parameters.minimum << "\n";
  os << indent << "Maximum: " << this->Parameters.maximum << "\n";
  os << indent << "Interactive: " << this->Detail.Interactive() << "\n";
  os << indent << "FrameBudget: " << this->GetFrameBudget() << "\n";
  os << indent << "RestBudget: " << this->GetRestBudget() << "\n";
  os << indent << "DetailLevel: " << this->Detail.Level() << "\n";
  os << indent << "Planes: " << this->GetNumberOfPlanes() << "\n";
}
