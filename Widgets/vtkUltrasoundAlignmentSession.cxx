// SPDX-License-Identifier: BSD-3-Clause
// Whatever a method does to the kernel's session it does inside Change(), which compares the state before and after, brings
// the images to where the state says, and tells those who listen what has changed. So undo, a drag and a project that was
// opened tell the same events, and none can be forgotten.
//
// What has an idea of its own lies in kernels without VTK: AlignmentSession (poses, looks, selection, undo), SessionTruth (the
// score), SessionStorage (project file and backups), ProjectVolumes (which volume is which), VoxelEdits (strokes). Here are the
// images.
#include "vtkUltrasoundAlignmentSession.h"

#include "vtkImageData.h"
#include "vtkIntArray.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundSessionImages.h"
#include "vtkUltrasoundSessionTables.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

constexpr std::ptrdiff_t GreySamples = 50000; // per volume
constexpr int ScorePoints = 2000;             // per volume
constexpr std::uint64_t ScoreSeed = 1;

std::string TextOf(const char* text)
{
  return text ? text : "";
}
} // namespace

vtkStandardNewMacro(vtkUltrasoundAlignmentSession);

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession::vtkUltrasoundAlignmentSession()
  : Images(std::make_unique<SessionImages>(this->Session)),
    PointsOf([this](int id) { return this->Images->At(id).Points(ScorePoints, ScoreSeed); })
{
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession::~vtkUltrasoundAlignmentSession()
{
  this->Storage.Leave(this->Session.State(), this->Comment);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Try(const std::function<void()>& change)
{
  try {
    change();
    return true;
  } catch (const std::bad_alloc&) {
    vtkErrorMacro("there is not enough memory");
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
  }
  return false;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Change(const std::function<void()>& change, const std::string& label,
                                           const std::function<void()>& takeNotes)
{
  const SessionState before = this->Session.State();
  const Project notes = this->Notes();
  const std::set<int> selection = this->Session.Selection();
  const std::optional<Eigen::Vector3d> centre = this->Session.ChosenCentre();
  const long long version = this->Session.HistoryVersion();
  const bool modified = this->GetModifiedSinceSave();
  const bool done = this->Try(change);

  const SessionImages::Changes changes = this->Images->Follow(before);
  for (const std::string& name : changes.Unpainted) {
    vtkErrorMacro(<< name << ": there is not enough memory to paint it");
  }
  if (changes.OthersAreHere && !this->GreyWindowChosen) {
    this->GreyWindow.reset();
  }
  const bool moved = changes.Poses != 0 || changes.Volumes != 0;
  if (moved) {
    this->Truth.Outdate();
  }
  const bool taken = done && takeNotes;
  if (taken) {
    this->Try(takeNotes);
  }
  const bool history = version != this->Session.HistoryVersion(), noted = !SameNotes(notes, this->Notes());
  if (history || noted) {
    this->Storage.SetForgotten(false);
    this->Images->Forget();
  }
  const bool ended = this->Storage.EndsUnfinished() && !this->Session.Editing();
  if (this->AutomaticBackups && done && (moved || history || noted || ended) && !this->Storage.IsFresh(this->Now())) {
    this->BackUpInTheBackground(!label.empty()            ? label
                                : this->Session.Editing() ? this->Session.EditLabel()
                                                          : this->Session.UndoLabel());
  }

  const bool selected = selection != this->Session.Selection() || centre != this->Session.ChosenCentre();
  const auto tell = [this](unsigned long event, int of) {
    if (of != 0) {
      this->Modified();
      this->InvokeEvent(event, of > 0 ? &of : nullptr);
    }
  };
  tell(VolumesChangedEvent, taken ? -1 : changes.Volumes); // who shows poses shows how far they are from the truth
  tell(PosesChangedEvent, taken ? -1 : changes.Poses);
  tell(VoxelsChangedEvent, changes.Voxels);
  tell(MeasurementsChangedEvent, before.measurements == this->Session.State().measurements ? 0 : -1);
  tell(SelectionChangedEvent, selected ? -1 : 0);
  tell(HistoryChangedEvent, history || modified != this->GetModifiedSinceSave() ? -1 : 0);
  return done;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::AddVolume(vtkImageData* image, const char* file, const char* name)
{
  SessionVolume volume;
  volume.file = ResolvedPath(TextOf(file));
  volume.name = name && *name ? name : fs::path(volume.file).stem().string();
  return this->AddNew(image, std::move(volume));
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::AddNew(vtkImageData* image, SessionVolume volume)
{
  int id = 0;
  this->Change([&]() {
    const std::string called = volume.name.empty() ? "the volume" : volume.name;
    if (!image) {
      throw Error(Error::Kind::BadInput, called + ": there is no image");
    }
    vtkUltrasoundVolume::CheckInput(nullptr, image, called);
    volume.geometry = vtkUltrasoundVolume::GeometryOf(image);
    const bool unworked = !volume.madeOf && this->Storage.IsUnworked(this->Session.State()); // to make one is work
    const int added = this->Session.Add(std::move(volume));
    const SessionVolume& known = *this->Find(added);
    try {
      this->Images->Hold(known, image);
    } catch (...) { // no memory
      this->Session.Remove(added);
      throw;
    }
    if (unworked) {
      this->Storage.SetUnworked(this->Session.State());
    }
    id = added;
    try {
      this->Truth.Match(known, this->PointsOf);
    } catch (const std::exception& error) { // the volume is welcome all the same
      vtkWarningMacro("the truth was not taken: " << error.what());
    }
  });
  return id;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::OpenVolume(const char* file)
{
  SessionImage image;
  const auto read = [&]() {
    if (!file || !*file) {
      throw Error(Error::Kind::InvalidParameter, "a volume's file needs a name");
    }
    image = ReadImages({file}).front();
  };
  return this->Change(read) ? this->AddVolume(image, file) : 0;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::RecordSources(vtkIntArray* volumes, const char* options)
{
  std::string record;
  this->Change([&]() {
    std::vector<int> ids;
    for (vtkIdType i = 0; volumes && i < volumes->GetNumberOfValues(); ++i) {
      ids.push_back(volumes->GetValue(i));
    }
    MadeOf madeOf = echorama::RecordSources(this->Session.State(), ids, {});
    if (options && *options) {
      madeOf.options = OptionsOfText(options, "the options");
    }
    record = echorama::TextOf(madeOf);
  });
  return record;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::AddResult(vtkImageData* image, const char* name, const char* record)
{
  SessionVolume volume;
  volume.name = name && *name ? name : "result";
  const auto read = [&]() { volume.madeOf = std::make_shared<const MadeOf>(MadeOfText(TextOf(record), "the record")); };
  return this->Change(read) ? this->AddNew(image, std::move(volume)) : 0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RemakeResult(int id, vtkImageData* image, const char* record)
{
  return this->Change([&]() {
    if (!image) {
      throw Error(Error::Kind::BadInput, this->GetName(id) + ": there is no image");
    }
    if (this->Images->GetBrushed() == id) {
      throw Error(Error::Kind::NotPossible, this->GetName(id) + ": a stroke on it has not ended");
    }
    vtkUltrasoundVolume::CheckInput(nullptr, image, this->GetName(id));
    this->Session.Remake(id, vtkUltrasoundVolume::GeometryOf(image), MadeOfText(TextOf(record), "the record"),
                         [&](const SessionVolume& volume) { this->Images->Hold(volume, image); });
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetUnpainted(int id, vtkImageData* image)
{
  return this->Change([&]() {
    if (this->Images->GetBrushed() == id) {
      throw Error(Error::Kind::NotPossible, this->GetName(id) + ": a stroke on it has not ended");
    }
    image->ShallowCopy(this->Images->At(id).Unpainted());
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetFile(int id, const char* file)
{
  const auto set = [&]() {
    const std::string path = ResolvedPath(TextOf(file));
    if (!fs::is_regular_file(path)) {
      throw Error(Error::Kind::FileSystem, (path.empty() ? "a volume's file" : path) + ": there is no such file");
    }
    this->Session.SetFile(id, path);
    this->Images->At(id).Known.file = path;
  };
  return this->Change(set, "Save " + this->GetName(id));
}

//----------------------------------------------------------------------------
vtkImageData* vtkUltrasoundAlignmentSession::GetImage(int id) const
{
  return this->Find(id) ? this->Images->At(id).Image.Get() : nullptr;
}

//----------------------------------------------------------------------------
vtkImageData* vtkUltrasoundAlignmentSession::GetShownImage(int id) const
{
  return this->Find(id) ? this->Images->At(id).Shown() : nullptr;
}

//----------------------------------------------------------------------------
vtkIdType vtkUltrasoundAlignmentSession::GetVoxelAt(int id, const double world[3]) const
{
  return this->Find(id) ? this->Images->At(id).VoxelAt(Eigen::Vector3d(world)) : -1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetVolumes(vtkMultiBlockDataSet* blocks, bool onlyVisible) const
{
  blocks->Initialize();
  for (const SessionVolume& volume : this->Session.State().volumes) {
    if (volume.visible || !onlyVisible) {
      const unsigned int index = blocks->GetNumberOfBlocks();
      blocks->SetBlock(index, this->Images->At(volume.id).Snapshot());
      blocks->GetMetaData(index)->Set(vtkCompositeDataSet::NAME(), volume.name.c_str());
    }
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetSnapshot(int id, vtkImageData* image) const
{
  if (image && this->Find(id)) {
    image->ShallowCopy(this->Images->At(id).Snapshot());
  }
  return image && this->Find(id);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetGreyWindow(double window[2]) const
{
  if (!this->GreyWindow) {
    this->GreyWindow = this->Images->GreyWindow(0.001, 0.999, GreySamples);
  }
  std::copy(this->GreyWindow->begin(), this->GreyWindow->end(), window);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetGreyWindow(double black, double white)
{
  if (!(std::isfinite(black) && std::isfinite(white) && black < white)) {
    vtkErrorMacro("the grey window goes from " << black << " to " << white << "; black must be below white");
    return;
  }
  this->GreyWindow = {black, white};
  this->GreyWindowChosen = true;
  this->Modified();
  this->InvokeEvent(VolumesChangedEvent, nullptr);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetVolumeToWorld(int id, vtkMatrix4x4* pose) const
{
  const SessionVolume* volume = this->Find(id);
  return Take(volume ? &volume->volumeToWorld : nullptr, pose);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetVolumeToWorld(int id, vtkMatrix4x4* pose)
{
  return this->Change([&]() { this->Session.SetPose(id, PoseOf(pose, "pose")); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetPlacement(int id, double middle[3], double degrees[3]) const
{
  const SessionVolume* volume = this->Find(id);
  if (volume) {
    const Placement placement = PlacementOf(*volume);
    Eigen::Map<Eigen::Vector3d>{middle} = placement.middle;
    Eigen::Map<Eigen::Vector3d>{degrees} = placement.degrees;
  }
  return volume != nullptr;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::MoveSelection(vtkMatrix4x4* motion)
{
  return this->Change([&]() { this->Session.MoveSelection(PoseOf(motion, "motion")); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::BeginStroke(int id, const char* mode, double radiusMm, double intensity, double opacity,
                                                double hardness, bool insideValid)
{
  const Brush brush{{}, radiusMm, intensity, opacity, hardness, insideValid};
  return this->Change([&]() { this->Images->BeginStroke(id, TextOf(mode), brush); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ExtendStroke(double x, double y, double z)
{
  int id = this->Images->GetBrushed();
  if (id == 0) {
    vtkErrorMacro("no stroke was begun");
    return false;
  }
  bool changed = false;
  try {
    changed = this->Images->ExtendStroke({x, y, z});
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
  if (this->AutomaticBackups) {
    this->BackUpInTheBackground(this->Session.EditLabel());
  }
  if (changed) {
    this->Modified();
    this->InvokeEvent(VoxelsChangedEvent, &id);
  }
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::EndStroke()
{
  return this->Change([this]() { this->Images->EndStroke(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::PrepareToPaint(int id)
{
  return this->Change([&]() { this->Images->At(id).Prepare(); });
}

//----------------------------------------------------------------------------
std::vector<std::string> vtkUltrasoundAlignmentSession::Folders() const
{
  std::vector<std::string> folders = this->SearchFolders;
  if (!this->GetProjectPath().empty()) {
    folders.push_back(fs::path(this->GetProjectPath()).parent_path().string());
  }
  return folders;
}

//----------------------------------------------------------------------------
Project vtkUltrasoundAlignmentSession::Now() const
{
  Project now = this->Notes();
  now.state = this->Images->State();
  return now;
}

//----------------------------------------------------------------------------
// Without truths a project is open all the same.
void vtkUltrasoundAlignmentSession::TakeNotes(const std::string& path, const Project& project)
{
  this->Comment = project.comment;
  this->Truth = {};
  this->Truth.SetFile(project.truth);
  if (!project.truth.empty()) {
    const std::string found = FindVolume(path, project.truth, this->Folders());
    this->Try([&] { this->Truth.Read(found.empty() ? project.truth : found, this->Session.State(), this->PointsOf); });
  }
  for (const SessionVolume& volume : this->Session.State().volumes) {
    if (const auto byHand = project.truths.find(volume.name); byHand != project.truths.end()) {
      this->Try([&] { this->Truth.SetByHand(volume, byHand->second, this->PointsOf); });
    }
  }
  this->Truth.SetFixedName(project.fixed, this->Session.State());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::OpenProject(const char* path, vtkMultiBlockDataSet* blocks)
{
  const std::string name = TextOf(path);
  Project project;
  const auto open = [&]() {
    BackupStamp stamp;
    const std::size_t fingerprint = SessionStorage::FingerprintOf(name);
    project = ReadProject(name, &stamp);
    std::vector<SessionVolume>& volumes = project.state.volumes;
    for (SessionVolume& volume : volumes) {
      volume.id = 0;
    }
    if (stamp.number > 0) {
      this->Warn(LeaveOutFileless(name, volumes));
    }
    const std::vector<SessionImage> images = LoadImages(name, volumes, this->Folders(), blocks);
    this->Images->DropStroke();
    this->Storage.Leave(this->Session.State(), this->Comment);
    this->Session.Reset(project.state);
    for (std::size_t i = 0; i < images.size(); ++i) {
      this->Images->Hold(this->Session.State().volumes[i], images[i]);
    }
    this->Warn(DisplacementNote(name));
    if (stamp.number > 0) {
      this->Storage.Recovered(name);
    } else {
      project.state = this->Images->State();
      this->Storage.Opened(name, project, fingerprint);
    }
  };
  return this->Change(open, "Open", [&]() {
    this->TakeNotes(name, project);
    this->Storage.SetSavedTruth(this->Truth.File(), this->Truth.ByHand(this->Session.State()));
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SaveProject(const char* path, bool withoutUnsavedResults)
{
  return this->Change([&]() { this->Warn(this->Storage.Save(TextOf(path), this->Now(), withoutUnsavedResults)); }, "Save");
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetProjectFiles(const char* path, vtkStringArray* files)
{
  return this->Change([&]() {
    const std::string name = TextOf(path);
    files->Initialize();
    BackupStamp stamp;
    for (const SessionVolume& volume : ReadProject(name, &stamp).state.volumes) {
      if (stamp.number == 0 || !volume.file.empty()) { // a backup opens without those that were in no file
        files->InsertNextValue(FindVolume(name, volume.file, this->Folders()));
      }
    }
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ReadPoses(const char* path)
{
  return this->Change([&]() {
    const std::map<int, Pose> poses = ReadPosesOf(this->Session.State(), TextOf(path));
    this->Warn(DisplacementNote(TextOf(path)));
    this->Session.Begin("Poses of " + fs::path(TextOf(path)).filename().string());
    for (const auto& [id, pose] : poses) {
      this->Session.SetPose(id, pose);
    }
    this->Session.End();
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::WritePoses(const char* path)
{
  return this->Change([&]() { WritePosesOf(this->Session.State(), TextOf(path), this->Truth.File()); });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetAutomaticBackups(bool on)
{
  if (this->AutomaticBackups != on) {
    this->AutomaticBackups = on;
    this->Modified();
    if (on && this->GetModifiedSinceSave()) {
      this->BackUpInTheBackground(this->GetUndoLabel());
    }
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::BackUp()
{
  return this->Change([this]() { this->Storage.BackUp(this->Now(), this->GetUndoLabel(), !this->Session.Editing()); });
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetBackups(vtkStringArray* paths, vtkStringArray* labels, vtkDoubleArray* times)
{
  std::string trouble;
  const std::vector<Backup> backups = this->Storage.List(trouble);
  this->TellTrouble(trouble);
  return Tell(backups, paths, labels, times);
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetBackupsIn(const char* folder, vtkStringArray* paths, vtkStringArray* labels,
                                                vtkDoubleArray* times)
{
  return Tell(folder && *folder ? Backups::List(folder) : std::vector<Backup>(), paths, labels, times);
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetAbandonedSessions(vtkStringArray* folders)
{
  return Tell(SessionStorage::Abandoned(), folders);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RestoreBackup(const char* path)
{
  const std::string name = TextOf(path);
  Project project;
  const auto restore = [&]() {
    project = ReadProject(name);
    SessionState& state = project.state;
    if (this->Session.Editing()) {
      throw Error(Error::Kind::NotPossible, "no backup can be restored during an edit");
    }
    Recognize(state.volumes, this->Images->Known(), [this](int id) { return this->HasVolume(id); });
    this->Warn(LeaveOutFileless(name, state.volumes));
    const std::vector<SessionImage> images = LoadImages(name, state.volumes, this->Folders(), nullptr);
    this->Session.Replace(state, "Restore " + fs::path(name).stem().string());
    for (std::size_t i = 0, read = 0; i < state.volumes.size(); ++i) {
      if (state.volumes[i].id == 0) {
        this->Images->Hold(this->Session.State().volumes[i], images[read++]);
      }
    }
  };
  return this->Change(restore, {}, [&]() { this->TakeNotes(name, project); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetTruth(int id, vtkMatrix4x4* volumeToWorld)
{
  return this->DoTruth([&] {
    this->Images->At(id); // throws when it is not there
    this->Truth.SetByHand(*this->Find(id), PoseOf(volumeToWorld, "truth"), this->PointsOf);
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetTruth(int id, vtkMatrix4x4* volumeToWorld) const
{
  return Take(this->Truth.Find(id), volumeToWorld);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetErrorVectors(vtkPolyData* vectors, int pointsPerVolume) const
{
  TellErrors(this->Truth.Score(this->Session.State()), vectors, pointsPerVolume);
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "ProjectPath: " << this->GetProjectPath() << "\n";
  os << indent << "UndoCount: " << this->GetUndoCount() << "\n";
  for (const SessionVolume& volume : this->Session.State().volumes) {
    os << indent << "Volume " << volume.id << ": " << volume.name << (this->IsSelected(volume.id) ? " (selected)" : "") << "\n";
  }
}
