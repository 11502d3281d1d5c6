// SPDX-License-Identifier: BSD-3-Clause
// Whatever a method does to the kernel's session it does inside Change(), which compares the state before and after, brings
// the images to where the state says, and tells those who listen what has changed. So undo, a drag and a project that was
// opened tell the same events, and none can be forgotten.
#include "vtkUltrasoundAlignmentSession.h"

#include "vtkCallbackCommand.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundReader.h"
#include "vtkUltrasoundSessionVoxels.h"
#include "vtkUltrasoundVolume.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/TextFile.h"
#include "Core/Base/VtkMessage.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Registration/Percentile.h"
#include "Filters/Registration/ValidPoints.h"
#include "Widgets/Session/BackupWriter.h"
#include "Widgets/Session/LiveScore.h"
#include "Widgets/Session/ProjectFile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <sys/stat.h>
#include <utility>

using namespace echorama;
namespace fs = std::filesystem;

namespace {
constexpr std::ptrdiff_t GreySamples = 50000; // per volume
constexpr int ScorePoints = 2000;             // per volume
constexpr std::uint64_t ScoreSeed = 1;
constexpr const char* Damaged = "damaged";

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

// Throws when the pose was found for another geometry.
std::optional<Pose> PoseAmong(const std::vector<VolumePose>& poses, const SessionVolume& volume)
{
  const std::string file = volume.file.empty() ? volume.name : volume.file;
  const bool named = std::any_of(poses.begin(), poses.end(), [&](const VolumePose& pose) {
    return fs::path(pose.file).filename() == fs::path(file).filename();
  });
  return named ? std::optional<Pose>(PoseFor(poses, file, volume.geometry).volumeToWorld) : std::nullopt;
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

// A file that is being read: made and let go by one thread, read by another.
struct ReadingFile {
  std::string Path;
  vtkSmartPointer<vtkUltrasoundReader> Reader = vtkSmartPointer<vtkUltrasoundReader>::New();
  vtkNew<vtkCallbackCommand> Listener;
  std::vector<std::string> Errors;
  bool Done = false;

  explicit ReadingFile(const std::string& path) : Path(path)
  {
    this->Listener->SetClientData(&this->Errors);
    this->Listener->SetCallback([](vtkObject*, unsigned long, void* errors, void* text) {
      static_cast<std::vector<std::string>*>(errors)->push_back(SentenceOfVtkMessage(text ? static_cast<const char*>(text) : ""));
    });
    this->Reader->AddObserver(vtkCommand::ErrorEvent, this->Listener);
    this->Reader->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, this->Listener);
    this->Reader->SetFileName(path.c_str());
  }

  void Read() { this->Done = this->Reader->GetExecutive()->Update() != 0; }

  vtkImageData* Image() const
  {
    if (this->Done && this->Errors.empty() && this->Reader->GetOutput()->GetNumberOfPoints() > 0) {
      return this->Reader->GetOutput();
    }
    const std::string reason = ReasonAmong(this->Errors);
    throw Error(Error::Kind::BadFile, reason.find(this->Path) != std::string::npos
                                          ? reason
                                          : this->Path + ": " + (reason.empty() ? "it cannot be read as a volume" : reason));
  }
};

// Whatever can be read of \a paths, side by side. Throws for the first that cannot.
std::vector<vtkSmartPointer<vtkImageData>> ReadImages(const std::vector<std::string>& paths)
{
  std::vector<std::unique_ptr<ReadingFile>> files;
  for (const std::string& path : paths) {
    files.push_back(std::make_unique<ReadingFile>(path));
  }
  ParallelFor(static_cast<std::ptrdiff_t>(files.size()),
              [&files](std::ptrdiff_t i) { files[static_cast<std::size_t>(i)]->Read(); });
  std::vector<vtkSmartPointer<vtkImageData>> images;
  for (const auto& file : files) {
    images.emplace_back(file->Image());
  }
  return images;
}

// No two volumes of a project are one file: where a name was looked for, both may have been found in the same place.
void CheckDistinct(const std::string& path, const std::vector<SessionVolume>& volumes)
{
  std::set<std::string> files;
  for (const SessionVolume& volume : volumes) {
    if (!volume.file.empty() && !files.insert(volume.file).second) {
      throw Error(Error::Kind::BadInput, path + ": two of its volumes are the file " + volume.file + " (" + volume.name +
                                             " is the second); put each where the project names it");
    }
  }
}

// What a project file says, to notice that somebody else has written it. 0: it cannot be read.
std::size_t Fingerprint(const std::string& path)
{
  try {
    return std::hash<std::string>()(ReadTextFile(path, std::size_t{512} << 20)) | 1;
  } catch (const Error&) {
    return 0;
  }
}

// The same work, whatever the ids: geometries pass through files.
bool SameWork(const SessionState& a, const SessionState& b)
{
  return std::equal(a.volumes.begin(), a.volumes.end(), b.volumes.begin(), b.volumes.end(),
                    [](const SessionVolume& left, SessionVolume right) {
                      if (left.geometry.AgreesWith(right.geometry)) {
                        right.geometry = left.geometry;
                      }
                      right.id = left.id;
                      return left == right;
                    });
}

void CheckSameGeometry(const ImageGeometry& recorded, const ImageGeometry& found, const std::string& file)
{
  if (recorded.VoxelCount() > 0 && !recorded.AgreesWith(found)) {
    throw Error(Error::Kind::BadInput, file + ": its geometry is not the one that the project was saved with "
                                              "(has it been moved or resampled since?)");
  }
}
std::vector<std::string> AbandonedFolders()
{
  try {
    return Backups::Abandoned();
  } catch (const Error&) // no folder of the user, so nothing in it
  {
    return {};
  }
}

int Tell(const std::vector<Backup>& backups, vtkStringArray* paths, vtkStringArray* labels, vtkDoubleArray* times)
{
  for (vtkAbstractArray* array :
       {static_cast<vtkAbstractArray*>(paths), static_cast<vtkAbstractArray*>(labels), static_cast<vtkAbstractArray*>(times)}) {
    if (array) {
      array->Initialize();
    }
  }
  for (const Backup& backup : backups) {
    if (paths) {
      paths->InsertNextValue(backup.path);
    }
    if (labels) {
      labels->InsertNextValue(backup.readable ? backup.label : Damaged);
    }
    if (times) {
      times->InsertNextValue(static_cast<double>(backup.time));
    }
  }
  return static_cast<int>(backups.size());
}
} // namespace

//----------------------------------------------------------------------------
struct vtkUltrasoundAlignmentSession::Internals {
  /** A stroke in the making. */
  struct Painting {
    int Id = 0;
    Stroke Drawn;
  };

  AlignmentSession Session;
  std::map<int, SessionVoxels> Volumes; ///< also those that undo could bring back
  std::optional<Painting> Brushing;
  std::optional<std::array<double, 2>> GreyWindow;
  bool GreyWindowChosen = false;

  std::vector<std::string> SearchFolders;
  std::string ProjectPath, Comment;
  Project Saved;             ///< what is in the project file
  std::size_t SavedText = 0; ///< its Fingerprint
  SessionState Unworked;     ///< the state as it would be if volumes had been opened and nothing else was done
  bool Forgotten = false;    ///< a person does not want what is not saved
  std::string Recovered;     ///< the folder of the abandoned session that goes on here

  bool AutomaticBackups = false;
  std::unique_ptr<BackupWriter> Writer;
  std::string BackupTrouble;       ///< why there is no writer, told once
  bool BackedUpUnfinished = false; ///< the last backup is of an edit that goes on

  std::string TruthFile;
  std::map<int, Pose> Truths;         ///< of those that the score has
  std::vector<VolumePose> TruthPoses; ///< of the file, also of volumes that may still come
  LiveScore Score;
  int FixedVolume = -1; ///< chosen; -1: the first
  std::optional<LiveScoreResult> Scored;
  bool ScoreIsCurrent = false;

  // With the stroke in the making, so that a backup has it too.
  Project Now() const
  {
    Project now{this->Session.State(), this->TruthFile, this->Comment};
    if (this->Brushing && !this->Brushing->Drawn.pathMm.empty()) {
      if (SessionVolume* volume = now.state.Find(this->Brushing->Id)) {
        volume->strokes = Append(volume->strokes, this->Brushing->Drawn);
      }
    }
    return now;
  }

  // A stroke ends with its edit, and with its volume. Returns whether voxels have changed.
  bool StopBrushing()
  {
    if (!this->Brushing || (this->Session.Editing() && this->Find(this->Brushing->Id))) {
      return false;
    }
    const int id = this->Brushing->Id;
    this->Brushing.reset();
    this->Session.End();
    const auto voxels = this->Volumes.find(id);
    return voxels != this->Volumes.end() && voxels->second.TakeBack();
  }

  // Before all volumes become others.
  void DropStroke()
  {
    if (this->Brushing) {
      const auto voxels = this->Volumes.find(this->Brushing->Id);
      this->Brushing.reset();
      if (voxels != this->Volumes.end()) {
        voxels->second.TakeBack();
      }
    }
  }

  // A mistyped name must not cost a volume.
  void CheckIsNoVolume(const std::string& path) const
  {
    std::error_code error;
    for (const SessionVolume& volume : this->Session.State().volumes) {
      if (!volume.file.empty() && (volume.file == path || fs::equivalent(volume.file, path, error))) {
        throw Error(Error::Kind::InvalidParameter, path + ": it is the file of the volume " + volume.name + " and stays");
      }
    }
  }

  const SessionVolume* Find(int id) const { return this->Session.State().Find(id); }

  void Hold(const SessionVolume& volume, vtkImageData* image)
  {
    this->Volumes.insert_or_assign(volume.id, SessionVoxels(volume, image));
  }

  // The images of volumes from files: taken from blocks that have the names of the files, else read.
  std::vector<vtkSmartPointer<vtkImageData>> Load(const std::vector<std::string>& files, vtkMultiBlockDataSet* blocks) const
  {
    std::vector<vtkSmartPointer<vtkImageData>> images(files.size());
    std::vector<std::string> paths;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < files.size(); ++i) {
      for (unsigned int block = 0; blocks && block < blocks->GetNumberOfBlocks(); ++block) {
        const char* name = blocks->HasMetaData(block) ? blocks->GetMetaData(block)->Get(vtkCompositeDataSet::NAME()) : nullptr;
        if (name && files[i] == AbsolutePath(name)) {
          images[i] = vtkImageData::SafeDownCast(blocks->GetBlock(block));
        }
      }
      if (!images[i]) {
        paths.push_back(files[i]);
        places.push_back(i);
      }
    }
    const std::vector<vtkSmartPointer<vtkImageData>> read = ReadImages(paths);
    for (std::size_t i = 0; i < read.size(); ++i) {
      images[places[i]] = read[i];
    }
    return images;
  }

  // Where the volumes of a project are now. Throws an error that names all that are nowhere.
  void FindFiles(const std::string& path, std::vector<SessionVolume*>& volumes) const
  {
    std::string missing;
    int count = 0;
    for (SessionVolume* volume : volumes) {
      const std::string found = this->FindFile(path, volume->file);
      if (found.empty()) {
        missing += (count++ > 0 ? ", " : "") + (volume->file.empty() ? volume->name + " (it was in no file)" : volume->file);
      } else {
        volume->file = AbsolutePath(found);
      }
    }
    if (count > 0) {
      throw Error(Error::Kind::FileSystem, path + ": " + std::to_string(count) + " of its volumes are not there: " + missing +
                                               " (they are also looked for beside the project and in the search folders)");
    }
  }

  std::string FindFile(const std::string& path, const std::string& file) const
  {
    std::vector<std::string> folders = this->SearchFolders;
    if (!this->ProjectPath.empty()) {
      folders.push_back(fs::path(this->ProjectPath).parent_path().string());
    }
    return FindVolume(path, file, folders);
  }

  // The truth of a volume, when there is one for it.
  void SetTruthOf(const SessionVolume& volume, const Pose& truth)
  {
    vtkImageData* image = this->Volumes.at(volume.id).GetBase();
    vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
    const auto valid = vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(image), image);
    std::vector<Eigen::Vector3d> points;
    vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
      points = ValidPoints(vtkUltrasoundVolume::ViewOf<const decltype(type)>(intensity, image), valid, ScorePoints, ScoreSeed);
    });
    this->Score.Set(volume.id, volume.name, volume.geometry.Moved(truth), std::move(points));
    this->Truths[volume.id] = truth;
    this->ScoreIsCurrent = false;
  }

  bool MatchTruth(const SessionVolume& volume)
  {
    const std::optional<Pose> truth = PoseAmong(this->TruthPoses, volume);
    if (truth) {
      this->SetTruthOf(volume, *truth);
    }
    return truth.has_value();
  }

  int Fixed() const
  {
    if (this->FixedVolume > 0 && this->Find(this->FixedVolume) && this->Score.Has(this->FixedVolume)) {
      return this->FixedVolume;
    }
    for (const SessionVolume& volume : this->Session.State().volumes) {
      if (this->Score.Has(volume.id)) {
        return volume.id;
      }
    }
    return -1;
  }

  // nullptr: there is none.
  const LiveScoreResult* CurrentScore()
  {
    if (!this->ScoreIsCurrent) {
      this->Scored.reset();
      this->ScoreIsCurrent = true;
      std::map<int, ImageGeometry> aligned;
      for (const SessionVolume& volume : this->Session.State().volumes) {
        if (this->Score.Has(volume.id)) {
          aligned[volume.id] = volume.geometry.Moved(volume.volumeToWorld);
        }
      }
      if (aligned.size() >= 2) {
        this->Scored = this->Score.Update(aligned, this->Fixed());
      }
    }
    return this->Scored ? &*this->Scored : nullptr;
  }

  // The folder of the project's backups, or of the session's while it was never saved.
  std::string BackupFolder() const
  {
    if (this->Writer) {
      return this->Writer->Folder();
    }
    return this->ProjectPath.empty() ? std::string() : Backups::FolderFor(this->ProjectPath);
  }

  // With the backups of the abandoned session that goes on here: so it is offered no more, and nothing is lost.
  BackupWriter& NeedWriter()
  {
    if (!this->Writer) {
      this->Writer = std::make_unique<BackupWriter>(Backups::FolderFor(this->ProjectPath));
      this->TakeOver(this->Writer->Folder());
    }
    return *this->Writer;
  }

  void TakeOver(const std::string& folder)
  {
    const std::string from = std::exchange(this->Recovered, {});
    try {
      if (!from.empty()) {
        Backups::Move(from, folder);
      }
    } catch (const Error&) // they are offered again
    {
    }
  }

  // A session that was never saved leaves backups behind only while there is work in them. Never throws.
  void LeaveBackups()
  {
    try {
      const bool work = this->Session.State() != this->Unworked || this->Comment != this->Saved.comment;
      if (this->Writer && this->Forgotten) {
        this->Writer->DiscardUnsaved();
      }
      const std::string folder = this->Writer ? this->Writer->Folder() : std::string();
      this->Writer.reset();
      if (!folder.empty() && this->ProjectPath.empty() && (this->Forgotten || !work)) {
        Backups::Discard(folder);
      }
    } catch (const std::exception&) // what cannot be removed stays
    {
    }
    this->Recovered.clear();
    this->Forgotten = false;
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
vtkUltrasoundAlignmentSession::~vtkUltrasoundAlignmentSession()
{
  this->Parts->LeaveBackups();
}

//----------------------------------------------------------------------------
const AlignmentSession& vtkUltrasoundAlignmentSession::GetKernel() const
{
  return this->Parts->Session;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Change(const std::function<void()>& change, const std::string& label)
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
  int volumes = 0, poses = 0, painted = 0;
  const auto add = [](int& to, int id) { to = to == 0 || to == id ? id : -1; };
  if (this->Parts->StopBrushing()) {
    painted = -1;
  }
  const SessionState after = session.State();
  for (const SessionVolume& volume : after.volumes) {
    const SessionVolume* old = before.Find(volume.id);
    if (!old || old->volumeToWorld.matrix() != volume.volumeToWorld.matrix()) {
      this->Parts->Volumes.at(volume.id).Place(volume.volumeToWorld);
      add(poses, volume.id);
    }
    try {
      if (this->Parts->Volumes.at(volume.id).GoTo(volume.strokes)) {
        add(painted, volume.id);
      }
    } catch (const std::bad_alloc&) {
      vtkErrorMacro(<< volume.name << ": there is not enough memory to paint it");
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
    this->Parts->Forgotten = false;
  }
  if (poses != 0 || volumes != 0) {
    this->Parts->ScoreIsCurrent = false;
  }
  const bool ended = this->Parts->BackedUpUnfinished && !session.Editing();
  // A project that was just opened is its own backup: another would be later than the last work that was not saved.
  const bool fresh = !this->Parts->Writer && session.State() == this->Parts->Saved.state;
  if (this->Parts->AutomaticBackups && done && !fresh && (poses != 0 || volumes != 0 || history || ended)) {
    this->BackUpInTheBackground(!label.empty()      ? label
                                : session.Editing() ? session.EditLabel()
                                                    : session.UndoLabel(),
                                !session.Editing());
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
  tell(VoxelsChangedEvent, painted);
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
    Internals& parts = *this->Parts;
    const bool unworked = parts.Session.State() == parts.Unworked;
    const int added = parts.Session.Add(std::move(volume));
    const SessionVolume& known = *parts.Find(added);
    try {
      parts.Hold(known, image);
    } catch (...) // no memory
    {
      parts.Session.Remove(added);
      throw;
    }
    if (unworked) {
      parts.Unworked = parts.Session.State();
    }
    id = added;
    try {
      parts.MatchTruth(known);
    } catch (const std::exception& error) // the volume is welcome all the same
    {
      vtkWarningMacro("the truth was not taken: " << error.what());
    }
  });
  return id;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::OpenVolume(const char* file)
{
  vtkSmartPointer<vtkImageData> image;
  const bool read = this->Change([&]() {
    if (!file || !*file) {
      throw Error(Error::Kind::InvalidParameter, "a volume's file needs a name");
    }
    image = ReadImages({file}).front();
  });
  return read ? this->AddVolume(image, file) : 0;
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
      const vtkSmartPointer<vtkImageData> block = this->Parts->Volumes.at(volume.id).Snapshot();
      const unsigned int index = blocks->GetNumberOfBlocks();
      blocks->SetBlock(index, block);
      blocks->GetMetaData(index)->Set(vtkCompositeDataSet::NAME(), volume.name.c_str());
    }
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetSnapshot(int id, vtkImageData* image) const
{
  const bool there = image && this->Parts->Find(id);
  if (there) {
    image->ShallowCopy(this->Parts->Volumes.at(id).Snapshot());
  }
  return there;
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
      SampleGreyLevels(this->Parts->Volumes.at(volume.id).GetBase(), levels);
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
  const std::string label = this->GetUndoLabel();
  this->Change([&]() { undone = this->Parts->Session.Undo(); }, "Undo: " + label);
  return undone;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ForgetHistory()
{
  return this->Change([&]() { this->Parts->Session.ForgetHistory(); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::Redo()
{
  bool redone = false;
  const std::string label = this->GetRedoLabel();
  this->Change([&]() { redone = this->Parts->Session.Redo(); }, "Redo: " + label);
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
bool vtkUltrasoundAlignmentSession::BeginStroke(int id, const char* mode, double radiusMm, double intensity, double opacity,
                                                double hardness, bool insideValid)
{
  return this->Change([&]() {
    Internals& parts = *this->Parts;
    const SessionVolume* volume = parts.Find(id);
    if (!volume) {
      throw Error(Error::Kind::InvalidParameter, "there is no volume " + std::to_string(id));
    }
    if (parts.Brushing) {
      throw Error(Error::Kind::NotPossible, "another stroke has not ended");
    }
    const std::string name = TextOf(mode);
    Internals::Painting painting{id, {}};
    Brush& brush = painting.Drawn.brush;
    brush.mode = name == "paint" ? BrushMode::Paint : name == "carve" ? BrushMode::Carve : BrushMode::Restore;
    if (brush.mode == BrushMode::Restore && name != "restore") {
      throw Error(Error::Kind::InvalidParameter, "the brush's mode is \"" + name + "\"; paint, carve or restore is needed");
    }
    brush.radiusMm = radiusMm;
    brush.intensity = intensity;
    brush.opacity = opacity;
    brush.hardness = hardness;
    brush.insideValid = insideValid;
    parts.Volumes.at(id).Begin(brush);
    parts.Session.Begin((brush.mode == BrushMode::Paint   ? "Paint "
                         : brush.mode == BrushMode::Carve ? "Carve "
                                                          : "Restore ") +
                        volume->name);
    parts.Brushing = std::move(painting);
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ExtendStroke(double x, double y, double z)
{
  Internals& parts = *this->Parts;
  if (!parts.Brushing) {
    vtkErrorMacro("no stroke was begun");
    return false;
  }
  int id = parts.Brushing->Id;
  bool changed = false;
  try {
    const Eigen::Vector3d point = parts.Find(id)->volumeToWorld.inverse() * Eigen::Vector3d(x, y, z);
    changed = parts.Volumes.at(id).Extend(point);
    parts.Brushing->Drawn.pathMm.push_back(point);
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
  if (parts.AutomaticBackups) {
    this->BackUpInTheBackground(parts.Session.EditLabel(), false);
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
  return this->Change([this]() {
    Internals& parts = *this->Parts;
    if (!parts.Brushing) {
      throw Error(Error::Kind::NotPossible, "no stroke was begun");
    }
    if (parts.Brushing->Drawn.pathMm.empty()) {
      parts.Session.End();
      return;
    }
    const Internals::Painting painting = *std::exchange(parts.Brushing, std::nullopt);
    try {
      parts.Session.AddStroke(painting.Id, painting.Drawn);
      parts.Volumes.at(painting.Id).End(parts.Find(painting.Id)->strokes);
    } catch (...) // no memory: what was painted goes, and the edit ends all the same
    {
      parts.Session.Cancel();
      parts.Volumes.at(painting.Id).TakeBack();
      throw;
    }
    parts.Session.End();
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::PrepareToPaint(int id)
{
  return this->Change([&]() {
    if (!this->Parts->Find(id)) {
      throw Error(Error::Kind::InvalidParameter, "there is no volume " + std::to_string(id));
    }
    this->Parts->Volumes.at(id).Prepare();
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::LeaveOut(const std::string& path, std::vector<SessionVolume>& volumes,
                                             const std::function<bool(const SessionVolume&)>& out)
{
  const auto end = std::stable_partition(volumes.begin(), volumes.end(), [&](const SessionVolume& each) { return !out(each); });
  std::string names;
  for (auto each = end; each != volumes.end(); ++each) {
    names += (names.empty() ? "" : ", ") + each->name;
  }
  volumes.erase(end, volumes.end());
  if (volumes.empty() && !names.empty()) {
    throw Error(Error::Kind::BadInput, path + ": its volumes were in no file: " + names);
  }
  if (!names.empty()) {
    vtkWarningMacro(<< path << ": it opens without what was in no file: " << names);
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::OpenProject(const char* path, vtkMultiBlockDataSet* volumes)
{
  Internals& parts = *this->Parts;
  std::string truth;
  const bool opened = this->Change(
      [&]() {
        const std::string name = TextOf(path);
        BackupStamp stamp;
        const std::size_t text = Fingerprint(name);
        Project project = ReadProject(name, &stamp);
        const bool isBackup = stamp.number > 0;
        if (isBackup) {
          this->LeaveOut(name, project.state.volumes, [](const SessionVolume& volume) { return volume.file.empty(); });
        }
        std::vector<SessionVolume*> all;
        std::vector<std::string> files;
        for (SessionVolume& volume : project.state.volumes) {
          all.push_back(&volume);
        }
        parts.FindFiles(name, all);
        CheckDistinct(name, project.state.volumes);
        for (const SessionVolume* volume : all) {
          files.push_back(volume->file);
        }
        const std::vector<vtkSmartPointer<vtkImageData>> images = parts.Load(files, volumes);
        for (std::size_t i = 0; i < images.size(); ++i) {
          vtkUltrasoundVolume::CheckInput(nullptr, images[i], files[i]);
          const ImageGeometry found = vtkUltrasoundVolume::GeometryOf(images[i]);
          CheckSameGeometry(all[i]->geometry, found, files[i]);
          all[i]->geometry = found;
        }

        std::vector<SessionVoxels> held;
        for (std::size_t i = 0; i < images.size(); ++i) {
          held.emplace_back(*all[i], images[i]);
        }
        parts.DropStroke();
        parts.LeaveBackups();
        parts.Session.Reset(project.state);
        for (std::size_t i = 0; i < held.size(); ++i) {
          const int id = parts.Session.State().volumes[i].id;
          held[i].Known.id = id;
          parts.Volumes.insert_or_assign(id, std::move(held[i]));
        }
        parts.BackedUpUnfinished = false;
        parts.Unworked = isBackup ? SessionState() : parts.Session.State();
        if (isBackup) {
          const std::vector<std::string> abandoned = AbandonedFolders();
          const std::string folder = fs::absolute(name).parent_path().lexically_normal().string();
          parts.Recovered = std::count(abandoned.begin(), abandoned.end(), folder) > 0 ? folder : std::string();
        }
        parts.SavedText = text;
        parts.ProjectPath = isBackup ? std::string() : AbsolutePath(name);
        parts.Comment = project.comment;
        parts.TruthFile = project.truth;
        parts.TruthPoses.clear();
        parts.Score.Clear();
        parts.FixedVolume = -1;
        truth = project.truth;
        parts.Saved = isBackup ? Project() : parts.Now();
      },
      "Open");
  if (opened && !truth.empty()) {
    const std::string found = parts.FindFile(parts.ProjectPath, truth);
    this->ReadTruth(found.empty() ? truth.c_str() : found.c_str()); // without it the project is open all the same
    if (!parts.ProjectPath.empty()) {
      parts.Saved.truth = parts.TruthFile;
    }
  }
  return opened;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SaveProject(const char* path)
{
  return this->Change(
      [&]() {
        Internals& parts = *this->Parts;
        const std::string name = AbsolutePath(TextOf(path));
        if (name.empty()) {
          throw Error(Error::Kind::InvalidParameter, "a project needs a file name");
        }
        for (const SessionVolume& volume : parts.Session.State().volumes) {
          if (volume.file.empty()) {
            throw Error(Error::Kind::InvalidParameter,
                        name + ": the volume " + volume.name + " is in no file; write it to one and add that instead");
          }
        }
        parts.CheckIsNoVolume(name);
        const std::size_t there = Fingerprint(name);
        if (parts.ProjectPath == name && there != 0 && there != std::exchange(parts.SavedText, there)) {
          throw Error(Error::Kind::NotPossible, name + ": somebody else has changed it since it was opened or saved here; "
                                                       "save again to replace it, or save under another name");
        }
        const Project project = parts.Now();
        WriteProject(name, project);
        parts.Saved = project;
        parts.SavedText = Fingerprint(name);
        parts.Unworked = parts.Session.State();
        parts.Forgotten = false;
        if (parts.Writer) {
          parts.Writer->MarkSaved();
        }
        if (parts.ProjectPath == name) {
          return;
        }
        // From now on backups lie beside the project. Those that were made before it was a project come along.
        const std::string before = parts.Writer && parts.ProjectPath.empty() ? parts.Writer->Folder() : std::string();
        parts.Writer.reset();
        parts.ProjectPath = name;
        try {
          parts.TakeOver(Backups::FolderFor(name));
          if (!before.empty()) {
            Backups::Move(before, Backups::FolderFor(name));
          }
        } catch (const std::exception& error) // the project is saved all the same
        {
          vtkWarningMacro("the earlier backups stay in " << before << ": " << error.what());
        }
      },
      "Save");
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetProjectFiles(const char* path, vtkStringArray* files)
{
  return this->Change([&]() {
    const std::string name = TextOf(path);
    files->Initialize();
    BackupStamp stamp;
    for (const SessionVolume& volume : ReadProject(name, &stamp).state.volumes) {
      if (stamp.number == 0 || !volume.file.empty()) // a backup opens without those that were in no file
      {
        files->InsertNextValue(this->Parts->FindFile(name, volume.file));
      }
    }
  });
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
  const Internals& parts = *this->Parts;
  return parts.Session.State() != parts.Saved.state || parts.TruthFile != parts.Saved.truth ||
         parts.Comment != parts.Saved.comment;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetComment() const
{
  return this->Parts->Comment;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetComment(const char* comment)
{
  this->Change([&]() { this->Parts->Comment = TextOf(comment); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ReadPoses(const char* path)
{
  return this->Change([&]() {
    const std::string name = TextOf(path);
    const std::vector<VolumePose> poses = echorama::ReadPoses(name);
    std::map<int, Pose> found;
    for (const SessionVolume& volume : this->Parts->Session.State().volumes) {
      if (const std::optional<Pose> pose = PoseAmong(poses, volume)) {
        found[volume.id] = *pose;
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
    this->Parts->CheckIsNoVolume(AbsolutePath(TextOf(path)));
    echorama::WritePoses(TextOf(path), poses);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::BackUpInTheBackground(const std::string& label, bool finished)
{
  Internals& parts = *this->Parts;
  std::string trouble;
  try {
    parts.NeedWriter().Post(parts.Now(), label, finished);
    parts.BackedUpUnfinished = !finished;
    parts.BackupTrouble.clear();
    trouble = parts.Writer->TakeFailure();
  } catch (const std::exception& error) {
    if (std::exchange(parts.BackupTrouble, error.what()).empty()) // once: the folder's name may be another each time
    {
      trouble = parts.BackupTrouble;
    }
  }
  if (!trouble.empty()) {
    vtkErrorMacro("there is no new backup: " << trouble);
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetAutomaticBackups(bool on)
{
  if (this->Parts->AutomaticBackups == on) {
    return;
  }
  this->Parts->AutomaticBackups = on;
  this->Modified();
  if (on && this->GetModifiedSinceSave()) {
    this->BackUpInTheBackground(this->GetUndoLabel(), true);
  }
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetAutomaticBackups() const
{
  return this->Parts->AutomaticBackups;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetBackupFolder() const
{
  return this->Parts->BackupFolder();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::BackUp()
{
  return this->Change([this]() {
    BackupWriter& writer = this->Parts->NeedWriter();
    writer.Post(this->Parts->Now(), this->GetUndoLabel(), !this->Parts->Session.Editing());
    writer.Flush();
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetBackups(vtkStringArray* paths, vtkStringArray* labels, vtkDoubleArray* times)
{
  if (this->Parts->Writer) {
    this->Parts->Writer->Wait();
    const std::string trouble = this->Parts->Writer->TakeFailure();
    if (!trouble.empty()) {
      vtkErrorMacro("there is no new backup: " << trouble);
    }
  }
  if (!this->Parts->ProjectPath.empty()) {
    return Tell(Backups::ListFor(this->Parts->ProjectPath), paths, labels, times);
  }
  return GetBackupsIn(this->GetBackupFolder().c_str(), paths, labels, times);
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAlignmentSession::GetLaterBackup()
{
  Internals& parts = *this->Parts;
  struct stat saved {};
  if (parts.ProjectPath.empty() || stat(parts.ProjectPath.c_str(), &saved) != 0) {
    return {};
  }
  if (parts.Writer) {
    parts.Writer->Wait();
  }
  try {
    if (const std::optional<Backup> newest = Backups::NewestFor(parts.ProjectPath, saved.st_mtime)) {
      SessionState state = ReadProject(newest->path).state;
      for (SessionVolume& volume : state.volumes) {
        const std::string found = parts.FindFile(newest->path, volume.file);
        volume.file = found.empty() ? volume.file : AbsolutePath(found);
      }
      return SameWork(parts.Session.State(), state) ? std::string() : newest->path;
    }
  } catch (const Error&) // it went meanwhile
  {
  }
  return {};
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::ForgetUnsavedWork()
{
  this->Parts->Forgotten = true;
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
  const std::vector<std::string> found = AbandonedFolders();
  if (folders) {
    folders->Initialize();
    for (const std::string& folder : found) {
      folders->InsertNextValue(folder);
    }
  }
  return static_cast<int>(found.size());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::DiscardBackups(const char* folder)
{
  return this->Change([&]() { Backups::Discard(TextOf(folder)); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::RestoreBackup(const char* path)
{
  return this->Change([&]() {
    Internals& parts = *this->Parts;
    const std::string name = TextOf(path);
    BackupStamp stamp;
    Project project = ReadProject(name, &stamp);
    if (parts.Session.Editing()) {
      throw Error(Error::Kind::NotPossible, "no backup can be restored during an edit");
    }
    std::set<int> taken;
    const auto take = [&](SessionVolume& volume, const std::function<bool(const SessionVolume&)>& same) {
      int id = 0;
      for (const auto& [each, voxels] : parts.Volumes) {
        if (taken.count(each) == 0 && same(voxels.Known) && voxels.Known.geometry.AgreesWith(volume.geometry) &&
            (id == 0 || parts.Find(each))) {
          id = each; // rather one that is to be seen than one that was removed
        }
      }
      volume.id = id;
      if (id > 0) {
        taken.insert(id);
        volume.file = parts.Volumes.at(id).Known.file;
        volume.geometry = parts.Volumes.at(id).Known.geometry;
      }
    };
    std::vector<SessionVolume>& volumes = project.state.volumes;
    for (SessionVolume& volume : volumes) {
      take(volume, [&](const SessionVolume& known) {
        return known.file == volume.file && (!volume.file.empty() || known.name == volume.name);
      });
    }
    // The same name in another folder: only when the recorded file is gone and no other is meant.
    const auto called = [](const SessionVolume& volume) { return fs::path(volume.file).filename().string(); };
    std::map<std::string, std::set<std::string>> known, wanted;
    for (const auto& [id, voxels] : parts.Volumes) {
      known[called(voxels.Known)].insert(voxels.Known.file);
    }
    for (const SessionVolume& volume : volumes) {
      wanted[called(volume)].insert(volume.file);
    }
    std::error_code error;
    for (SessionVolume& volume : volumes) {
      const std::string file = called(volume);
      if (volume.id == 0 && !file.empty() && known[file].size() == 1 && wanted[file].size() == 1 &&
          !fs::exists(volume.file, error)) {
        take(volume, [&](const SessionVolume& each) { return called(each) == file; });
      }
    }
    this->LeaveOut(name, volumes, [](const SessionVolume& volume) { return volume.id == 0 && volume.file.empty(); });
    std::vector<SessionVolume*> others;
    std::vector<std::string> files;
    for (SessionVolume& volume : volumes) {
      if (volume.id == 0) {
        others.push_back(&volume);
      }
    }
    parts.FindFiles(name, others);
    CheckDistinct(name, volumes);
    for (const SessionVolume* volume : others) {
      files.push_back(volume->file);
    }
    const std::vector<vtkSmartPointer<vtkImageData>> images = parts.Load(files, nullptr);
    for (std::size_t i = 0; i < images.size(); ++i) {
      vtkUltrasoundVolume::CheckInput(nullptr, images[i], files[i]);
      const ImageGeometry found = vtkUltrasoundVolume::GeometryOf(images[i]);
      CheckSameGeometry(others[i]->geometry, found, files[i]);
      others[i]->geometry = found;
    }
    parts.Session.Replace(project.state, "Restore " + fs::path(name).stem().string());
    for (std::size_t i = 0, read = 0; i < project.state.volumes.size(); ++i) {
      if (project.state.volumes[i].id == 0) {
        parts.Hold(parts.Session.State().volumes[i], images[read++]);
      }
    }
  });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::ReadTruth(const char* path)
{
  const bool read = this->Change([&]() {
    Internals& parts = *this->Parts;
    const std::string name = TextOf(path);
    std::vector<VolumePose> poses = echorama::ReadPoses(name);
    bool found = false;
    for (const SessionVolume& volume : parts.Session.State().volumes) {
      found = PoseAmong(poses, volume).has_value() || found; // throws before anything has changed
    }
    if (!found) {
      throw Error(Error::Kind::BadInput, name + ": it names none of the volumes");
    }
    const LiveScore score = parts.Score;
    std::swap(parts.TruthPoses, poses);
    try {
      parts.Score.Clear();
      for (const SessionVolume& volume : parts.Session.State().volumes) {
        parts.MatchTruth(volume);
      }
    } catch (...) // no memory
    {
      parts.Score = score;
      std::swap(parts.TruthPoses, poses);
      throw;
    }
    parts.TruthFile = AbsolutePath(name);
  });
  this->Modified();
  this->InvokeEvent(PosesChangedEvent, nullptr);
  return read;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::SetTruth(int id, vtkMatrix4x4* volumeToWorld)
{
  const bool set = this->Change([&]() {
    const SessionVolume* volume = this->Parts->Find(id);
    if (!volume || !volumeToWorld) {
      throw Error(Error::Kind::InvalidParameter, "there is no volume " + std::to_string(id) + ", or no truth for it");
    }
    const Pose truth = PoseOf(volumeToWorld);
    if (!IsRotation(truth.linear()) || !truth.translation().allFinite() ||
        truth.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
      throw Error(Error::Kind::InvalidParameter, "the truth is not rigid");
    }
    this->Parts->SetTruthOf(*volume, truth);
  });
  this->Modified();
  this->InvokeEvent(PosesChangedEvent, nullptr);
  return set;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::ClearTruth()
{
  this->Change([this]() {
    this->Parts->Score.Clear();
    this->Parts->ScoreIsCurrent = false;
    this->Parts->TruthPoses.clear();
    this->Parts->TruthFile.clear();
  });
  this->Modified();
  this->InvokeEvent(PosesChangedEvent, nullptr);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::GetTruth(int id, vtkMatrix4x4* volumeToWorld) const
{
  const auto truth = this->Parts->Truths.find(id);
  if (truth == this->Parts->Truths.end() || !this->Parts->Score.Has(id) || !volumeToWorld) {
    return false;
  }
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = truth->second.matrix();
  volumeToWorld->DeepCopy(rows.data());
  return true;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAlignmentSession::HasTruth() const
{
  return !this->Parts->Score.Empty();
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetScore() const
{
  const LiveScoreResult* score = this->Parts->CurrentScore();
  return score ? score->mean : std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetVolumeScore(int id) const
{
  const LiveScoreResult* score = this->Parts->CurrentScore();
  const int index = score ? score->IndexOf(id) : -1;
  return index >= 0 ? score->volumes[static_cast<std::size_t>(index)].mean : std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
double vtkUltrasoundAlignmentSession::GetRotationError(int id) const
{
  const LiveScoreResult* score = this->Parts->CurrentScore();
  const int index = score ? score->IndexOf(id) : -1;
  return index >= 0 ? score->degrees[static_cast<std::size_t>(index)] : std::numeric_limits<double>::quiet_NaN();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::GetErrorVectors(vtkPolyData* vectors, int pointsPerVolume) const
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkDoubleArray> errors;
  errors->SetName("Error");
  errors->SetNumberOfComponents(3);
  vtkNew<vtkIntArray> ids;
  ids->SetName("Volume");
  const LiveScoreResult* score = this->Parts->CurrentScore();
  for (std::size_t i = 0; score && i < score->volumes.size(); ++i) {
    const VolumeScore& volume = score->volumes[i];
    const std::size_t count = std::min(volume.points.size(), static_cast<std::size_t>(std::max(pointsPerVolume, 0)));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = k * volume.points.size() / count; // spread over all: they come in the order of their voxels
      points->InsertNextPoint(volume.points[at].data());
      errors->InsertNextTuple(volume.errors[at].data());
      ids->InsertNextValue(score->ids[i]);
    }
  }
  vectors->Initialize();
  vectors->SetPoints(points);
  vectors->GetPointData()->AddArray(errors);
  vectors->GetPointData()->AddArray(ids);
  vectors->GetPointData()->SetActiveVectors("Error");
}

//----------------------------------------------------------------------------
void vtkUltrasoundAlignmentSession::SetFixedVolume(int id)
{
  this->Change([&]() {
    if (id > 0 && !this->Parts->Score.Has(id)) {
      throw Error(Error::Kind::InvalidParameter, "volume " + std::to_string(id) + " has no truth and cannot be the fixed one");
    }
    this->Parts->FixedVolume = id;
    this->Parts->ScoreIsCurrent = false;
  });
  this->Modified();
  this->InvokeEvent(PosesChangedEvent, nullptr);
}

//----------------------------------------------------------------------------
int vtkUltrasoundAlignmentSession::GetFixedVolume() const
{
  return this->Parts->Fixed();
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
