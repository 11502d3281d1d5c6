// SPDX-License-Identifier: BSD-3-Clause
// Whatever a method does to the kernel's session it does inside Change(), which compares the state before and after, brings
// the images to where the state says, and tells those who listen what has changed. So undo, a drag and a project that was
// opened tell the same events, and none can be forgotten.
#include "vtkUltrasoundAlignmentSession.h"

#include "vtkExecutive.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundReader.h"
#include "vtkUltrasoundVolume.h"

#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Registration/Percentile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

using namespace echorama;
namespace fs = std::filesystem;

namespace {
constexpr double RadiansPerDegree = EIGEN_PI / 180.0;
constexpr std::ptrdiff_t GreySamples = 50000; // per volume

Pose PoseOf(vtkMatrix4x4* matrix)
{
  Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
  return pose;
}

// Rotations about the world's z, then y, then x.
Eigen::Matrix3d RotationOf(const Eigen::Vector3d& degrees)
{
  const Eigen::Vector3d angle = degrees * RadiansPerDegree;
  return (Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

Eigen::Vector3d DegreesOf(const Eigen::Matrix3d& R)
{
  Eigen::Vector3d angle;
  const double across = std::hypot(R(0, 0), R(0, 1));
  angle.y() = std::atan2(R(0, 2), across);
  if (across > 1e-9) {
    angle.x() = std::atan2(-R(1, 2), R(2, 2));
    angle.z() = std::atan2(-R(0, 1), R(0, 0));
  } else // x and z turn about the same line: all of it is told as x
  {
    angle.x() = std::atan2(R(2, 1), R(1, 1));
    angle.z() = 0.0;
  }
  return angle / RadiansPerDegree;
}

std::string AbsolutePath(const std::string& path)
{
  if (path.empty()) {
    return path;
  }
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(fs::absolute(path), error);
  return (error ? fs::absolute(path).lexically_normal() : resolved).string();
}

std::string TextOf(const char* text)
{
  return text ? text : "";
}

// Some of the grey levels that are real.
void SampleGreyLevels(vtkImageData* image, std::vector<double>& levels)
{
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
  vtkDataArray* region = vtkUltrasoundVolume::GetValidRegion(image);
  const auto valid = vtkUltrasoundVolume::ViewOf<const unsigned char>(region, image);
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    const auto view = vtkUltrasoundVolume::ViewOf<const decltype(type)>(intensity, image);
    const std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, view.Size() / GreySamples) | 1; // odd: not along columns alone
    for (std::ptrdiff_t i = 0; i < view.Size(); i += step) {
      if ((valid.Empty() || valid[i]) && std::isfinite(static_cast<double>(view[i]))) {
        levels.push_back(static_cast<double>(view[i]));
      }
    }
  });
}
} // namespace

//----------------------------------------------------------------------------
struct vtkUltrasoundAlignmentSession::Internals {
  /** The voxels of one volume. */
  struct Voxels {
    vtkSmartPointer<vtkImageData> Source; ///< as the file stands, sharing what was given
    vtkSmartPointer<vtkImageData> Image;  ///< where it lies now
  };

  AlignmentSession Session;
  std::map<int, Voxels> Volumes; ///< also those that undo could bring back
  std::optional<std::array<double, 2>> GreyWindow;
  bool GreyWindowChosen = false;
  std::vector<std::string> SearchFolders;
  std::string ProjectPath;
  SessionState Saved;

  const SessionVolume* Find(int id) const { return this->Session.State().Find(id); }

  void Place(const SessionVolume& volume)
  {
    Voxels& voxels = this->Volumes.at(volume.id);
    voxels.Image->ShallowCopy(voxels.Source);
    vtkUltrasoundVolume::Move(voxels.Image, volume.volumeToWorld);
  }

  // Voxels that nothing can bring back are let go.
  void Forget()
  {
    for (auto each = this->Volumes.begin(); each != this->Volumes.end();) {
      each = this->Session.Remembers(each->first) ? std::next(each) : this->Volumes.erase(each);
    }
  }
};

vtkStandardNewMacro(vtkUltrasoundAlignmentSession);

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession::vtkUltrasoundAlignmentSession() : Parts(std::make_unique<Internals>()) {}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession::~vtkUltrasoundAlignmentSession() = default;

//----------------------------------------------------------------------------
const AlignmentSession& vtkUltrasoundAlignmentSession::GetKernel() const
{
  return this->Parts->Session;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Change(const std::function<void()>& change)
{
  AlignmentSession& session = this->Parts->Session;
  const SessionState before = session.State();
  const std::set<int> selection = session.Selection();
  const std::optional<Eigen::Vector3d> centre = session.ChosenCentre();
  const long long version = session.HistoryVersion();
  const bool modified = this->GetModifiedSinceSave();
  bool done = false;
  try {
    change();
    done = true;
  } catch (const std::bad_alloc&) {
    vtkErrorMacro("there is not enough memory");
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
  }

  // What is different, and of which volume: 0 of none, -1 of several.
  int volumes = 0, poses = 0;
  const auto add = [](int& to, int id) { to = to == 0 || to == id ? id : -1; };
  const SessionState after = session.State();
  for (const SessionVolume& volume : after.volumes) {
    const SessionVolume* old = before.Find(volume.id);
    if (!old || old->volumeToWorld.matrix() != volume.volumeToWorld.matrix()) {
      this->Parts->Place(volume);
      add(poses, volume.id);
    }
    if (!old || old->name != volume.name || old->group != volume.group || old->colour != volume.colour ||
        old->opacity != volume.opacity || old->visible != volume.visible) {
      add(volumes, volume.id);
    }
  }
  const auto ids = [](const SessionState& state) {
    std::vector<int> list;
    for (const SessionVolume& volume : state.volumes) {
      list.push_back(volume.id);
    }
    return list;
  };
  if (ids(before) != ids(after)) {
    volumes = -1;
    if (!this->Parts->GreyWindowChosen) {
      this->Parts->GreyWindow.reset();
    }
  }
  const bool history = version != session.HistoryVersion();
  if (history) {
    this->Parts->Forget();
  }

  const bool selected = selection != session.Selection() || centre != session.ChosenCentre();
  const auto tell = [this](unsigned long event, int of) {
    if (of != 0) {
      this->Modified();
      this->InvokeEvent(event, of > 0 ? &of : nullptr);
    }
  };
  tell(VolumesChangedEvent, volumes);
  tell(PosesChangedEvent, poses);
  tell(SelectionChangedEvent, selected ? -1 : 0);
  tell(HistoryChangedEvent, history || modified != this->GetModifiedSinceSave() ? -1 : 0);
  return done;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::AddVolume(vtkImageData* image, const char* file, const char* name)
{
  int id = 0;
  this->Change([&]() {
    SessionVolume volume;
    volume.file = AbsolutePath(TextOf(file));
    volume.name = name && *name ? std::string(name) : fs::path(volume.file).stem().string();
    const std::string called = volume.name.empty() ? "the volume" : volume.name;
    if (!image) {
      throw Error(Error::Kind::BadInput, called + ": there is no image");
    }
    vtkUltrasoundVolume::CheckInput(nullptr, image, called);
    volume.geometry = vtkUltrasoundVolume::GeometryOf(image);

    Internals::Voxels voxels{vtkSmartPointer<vtkImageData>::New(), vtkSmartPointer<vtkImageData>::New()};
    voxels.Source->ShallowCopy(image);
    vtkUltrasoundVolume::SetGeometry(voxels.Source, volume.geometry);
    id = this->Parts->Session.Add(std::move(volume));
    this->Parts->Volumes[id] = std::move(voxels);
  });
  return id;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::OpenVolume(const char* file)
{
  vtkNew<vtkUltrasoundReader> reader;
  reader->SetFileName(file);
  if (!file || !*file || !reader->GetExecutive()->Update() || reader->GetOutput()->GetNumberOfPoints() == 0) {
    vtkErrorMacro(<< TextOf(file) << ": it cannot be read as a volume");
    return 0;
  }
  return this->AddVolume(reader->GetOutput(), file);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RemoveVolume(int id)
{
  return this->Change([&]() { this->Parts->Session.Remove(id); });
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetNumberOfVolumes() const
{
  return static_cast<int>(this->Parts->Session.State().volumes.size());
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetVolumeId(int index) const
{
  return index >= 0 && index < this->GetNumberOfVolumes()
             ? this->Parts->Session.State().volumes[static_cast<std::size_t>(index)].id
             : -1;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::HasVolume(int id) const
{
  return this->Parts->Find(id) != nullptr;
}

//----------------------------------------------------------------------------
vtkImageData* vtkUltrasoundAlignmentSession::GetImage(int id) const
{
  return this->Parts->Find(id) ? this->Parts->Volumes.at(id).Image.Get() : nullptr;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetVolumes(vtkMultiBlockDataSet* blocks, bool onlyVisible) const
{
  blocks->Initialize();
  for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
    if (volume.visible || !onlyVisible) {
      vtkNew<vtkImageData> block;
      block->ShallowCopy(this->Parts->Volumes.at(volume.id).Image);
      const unsigned int index = blocks->GetNumberOfBlocks();
      blocks->SetBlock(index, block);
      blocks->GetMetaData(index)->Set(vtkCompositeDataSet::NAME(), volume.name.c_str());
    }
  }
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetName(int id) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  return volume ? volume->name : std::string();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetName(int id, const char* name)
{
  return this->Change([&]() { this->Parts->Session.SetName(id, TextOf(name)); });
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetFile(int id) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  return volume ? volume->file : std::string();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetColour(int id, double rgb[3]) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  if (volume) {
    std::copy(volume->colour.begin(), volume->colour.end(), rgb);
  }
  return volume != nullptr;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetColour(int id, double r, double g, double b)
{
  return this->Change([&]() { this->Parts->Session.SetColour(id, {r, g, b}); });
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetOpacity(int id) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  return volume ? volume->opacity : 0.0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetOpacity(int id, double opacity)
{
  return this->Change([&]() { this->Parts->Session.SetOpacity(id, opacity); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetVisible(int id) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  return volume && volume->visible;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetVisible(int id, bool visible)
{
  return this->Change([&]() { this->Parts->Session.SetVisible(id, visible); });
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetGroup(int id) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  return volume ? volume->group : 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetGreyWindow(double window[2]) const
{
  std::optional<std::array<double, 2>>& grey = this->Parts->GreyWindow;
  if (!grey) {
    std::vector<double> levels;
    for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
      SampleGreyLevels(this->Parts->Volumes.at(volume.id).Source, levels);
    }
    grey = {0.0, 255.0};
    if (!levels.empty()) {
      grey = {Percentile(levels, 0.001), Percentile(levels, 0.999)};
      if (!((*grey)[0] < (*grey)[1])) // a volume of one grey level
      {
        (*grey)[1] = (*grey)[0] + 1.0;
      }
    }
  }
  std::copy(grey->begin(), grey->end(), window);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetGreyWindow(double black, double white)
{
  if (!(std::isfinite(black) && std::isfinite(white) && black < white)) {
    vtkErrorMacro("the grey window goes from " << black << " to " << white << "; black must be below white");
    return;
  }
  this->Parts->GreyWindow = {black, white};
  this->Parts->GreyWindowChosen = true;
  this->Modified();
  this->InvokeEvent(VolumesChangedEvent, nullptr);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetVolumeToWorld(int id, vtkMatrix4x4* pose) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  if (volume && pose) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = volume->volumeToWorld.matrix();
    pose->DeepCopy(matrix.data());
  }
  return volume && pose;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetVolumeToWorld(int id, vtkMatrix4x4* pose)
{
  if (!pose) {
    vtkErrorMacro("there is no pose");
    return false;
  }
  return this->Change([&]() { this->Parts->Session.SetPose(id, PoseOf(pose)); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetPlacement(int id, double middle[3], double degrees[3]) const
{
  const SessionVolume* volume = this->Parts->Find(id);
  if (volume) {
    Eigen::Map<Eigen::Vector3d>{middle} = volume->volumeToWorld * volume->geometry.Centre();
    Eigen::Map<Eigen::Vector3d>{degrees} = DegreesOf(volume->volumeToWorld.linear());
  }
  return volume != nullptr;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetPlacement(int id, double x, double y, double z, double degreesX, double degreesY,
                                                 double degreesZ)
{
  return this->Change([&]() {
    const SessionVolume* volume = this->Parts->Find(id);
    Eigen::Vector3d middle, degrees;
    const Eigen::Vector3d newMiddle(x, y, z), newDegrees(degreesX, degreesY, degreesZ);
    if (this->GetPlacement(id, middle.data(), degrees.data()) && middle == newMiddle && degrees == newDegrees) {
      return; // what was read and set again leaves the last bits alone
    }
    Pose pose = volume ? volume->volumeToWorld : Pose::Identity();
    if (degrees != newDegrees) {
      pose.linear() = RotationOf(newDegrees);
    }
    pose.translation() = newMiddle - pose.linear() * (volume ? volume->geometry.Centre() : Eigen::Vector3d::Zero());
    this->Parts->Session.SetPose(id, pose);
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Select(int id, bool on, bool alone)
{
  return this->Change([&]() { this->Parts->Session.Select(id, on, alone); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SelectAll()
{
  this->Change([this]() { this->Parts->Session.SelectAll(); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SelectNone()
{
  this->Change([this]() { this->Parts->Session.SelectNone(); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::InvertSelection()
{
  this->Change([this]() { this->Parts->Session.InvertSelection(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::IsSelected(int id) const
{
  return this->Parts->Session.Selection().count(id) > 0;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetNumberOfSelected() const
{
  return static_cast<int>(this->Parts->Session.Selection().size());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GroupSelection()
{
  return this->Change([this]() { this->Parts->Session.GroupSelection(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::UngroupSelection()
{
  return this->Change([this]() { this->Parts->Session.UngroupSelection(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::MoveSelection(vtkMatrix4x4* motion)
{
  if (!motion) {
    vtkErrorMacro("there is no motion");
    return false;
  }
  return this->Change([&]() { this->Parts->Session.MoveSelection(PoseOf(motion)); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::TranslateSelection(double x, double y, double z)
{
  return this->Change([&]() { this->Parts->Session.MoveSelection(Pose(Eigen::Translation3d(x, y, z))); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RotateSelection(double x, double y, double z)
{
  return this->Change([&]() {
    AlignmentSession& session = this->Parts->Session;
    const Eigen::Vector3d rotation = Eigen::Vector3d(x, y, z) * RadiansPerDegree;
    session.MoveSelection(rotation.isZero(0.0) ? Pose::Identity()
                                               : MotionAbout(session.CentreOfRotation(), rotation, Eigen::Vector3d::Zero()));
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetCentreOfRotation(double centre[3]) const
{
  Eigen::Map<Eigen::Vector3d>{centre} = this->Parts->Session.CentreOfRotation();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetCentreOfRotation(double x, double y, double z)
{
  this->Change([&]() { this->Parts->Session.SetCentreOfRotation(Eigen::Vector3d(x, y, z)); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::ResetCentreOfRotation()
{
  this->Change([this]() { this->Parts->Session.SetCentreOfRotation(std::nullopt); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::BeginEdit(const char* label)
{
  this->Parts->Session.Begin(TextOf(label));
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::EndEdit()
{
  bool entry = false;
  this->Change([&]() { entry = this->Parts->Session.End(); });
  return entry;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::CancelEdit()
{
  this->Change([this]() { this->Parts->Session.Cancel(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Undo()
{
  bool undone = false;
  this->Change([&]() { undone = this->Parts->Session.Undo(); });
  return undone;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Redo()
{
  bool redone = false;
  this->Change([&]() { redone = this->Parts->Session.Redo(); });
  return redone;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetUndoCount() const
{
  return this->Parts->Session.UndoCount();
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetRedoCount() const
{
  return this->Parts->Session.RedoCount();
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetUndoLabel() const
{
  return this->Parts->Session.UndoLabel();
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetRedoLabel() const
{
  return this->Parts->Session.RedoLabel();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::BeginStroke(int, const char*, double, double, double, double, bool)
{
  vtkErrorMacro("strokes are not there yet");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ExtendStroke(double, double, double)
{
  vtkErrorMacro("no stroke was begun");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::EndStroke()
{
  vtkErrorMacro("no stroke was begun");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::OpenProject(const char*, vtkMultiBlockDataSet*)
{
  vtkErrorMacro("projects are not there yet");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SaveProject(const char*)
{
  vtkErrorMacro("projects are not there yet");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetProjectFiles(const char*, vtkStringArray*)
{
  vtkErrorMacro("projects are not there yet");
  return false;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::AddSearchFolder(const char* folder)
{
  if (folder && *folder) {
    this->Parts->SearchFolders.push_back(AbsolutePath(folder));
  }
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetProjectPath() const
{
  return this->Parts->ProjectPath;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetModifiedSinceSave() const
{
  return this->Parts->Session.State() != this->Parts->Saved;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ReadPoses(const char* path)
{
  return this->Change([&]() {
    const std::string name = TextOf(path);
    const std::vector<VolumePose> poses = echorama::ReadPoses(name);
    std::map<int, Pose> found;
    for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
      const std::string file = volume.file.empty() ? volume.name : volume.file;
      const bool named = std::any_of(poses.begin(), poses.end(), [&](const VolumePose& pose) {
        return fs::path(pose.file).filename() == fs::path(file).filename();
      });
      if (named) {
        found[volume.id] = PoseFor(poses, file, volume.geometry).volumeToWorld;
      }
    }
    if (found.empty()) {
      throw Error(Error::Kind::BadInput, name + ": it names none of the volumes");
    }
    AlignmentSession& session = this->Parts->Session;
    session.Begin("Poses of " + fs::path(name).filename().string());
    for (const auto& [id, pose] : found) {
      session.SetPose(id, pose);
    }
    session.End();
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::WritePoses(const char* path)
{
  return this->Change([&]() {
    std::vector<VolumePose> poses;
    for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
      if (volume.file.empty()) {
        throw Error(Error::Kind::InvalidParameter, volume.name + ": it is in no file; poses are written of files");
      }
      poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
    }
    echorama::WritePoses(TextOf(path), poses);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetAutomaticBackups(bool on)
{
  if (on) {
    vtkErrorMacro("backups are not there yet");
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetAutomaticBackups() const
{
  return false;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetBackupFolder() const
{
  return {};
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::BackUp()
{
  vtkErrorMacro("backups are not there yet");
  return false;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetBackups(vtkStringArray*, vtkStringArray*)
{
  return 0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RestoreBackup(const char*)
{
  vtkErrorMacro("backups are not there yet");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ReadTruth(const char*)
{
  vtkErrorMacro("the truth is not there yet");
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetTruth(int, vtkMatrix4x4*)
{
  vtkErrorMacro("the truth is not there yet");
  return false;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::ClearTruth() {}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::HasTruth() const
{
  return false;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetScore() const
{
  return std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetVolumeScore(int) const
{
  return std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetRotationError(int) const
{
  return std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetErrorVectors(vtkPolyData* vectors, int) const
{
  vectors->Initialize();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetFixedVolume(int) {}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetFixedVolume() const
{
  return -1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "ProjectPath: " << this->Parts->ProjectPath << "\n";
  os << indent << "UndoCount: " << this->GetUndoCount() << "\n";
  for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
    os << indent << "Volume " << volume.id << ": " << volume.name << (this->IsSelected(volume.id) ? " (selected)" : "") << "\n";
  }
}
