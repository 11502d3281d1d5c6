// SPDX-License-Identifier: BSD-3-Clause
// The images of vtkUltrasoundAlignmentSession: those of its volumes, and of all that undo could bring back; how they are read,
// and the stroke that is being drawn on one of them.
#ifndef vtkUltrasoundSessionImages_h
#define vtkUltrasoundSessionImages_h

#include "vtkUltrasoundSessionVoxels.h"

#include "vtkCallbackCommand.h"
#include "vtkExecutive.h"
#include "vtkInformation.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkUltrasoundReader.h"

#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/VtkMessage.h"
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/ProjectFile.h"
#include "Widgets/Session/ProjectVolumes.h"

#include <map>
#include <optional>
#include <utility>

namespace echorama {

using SessionImage = vtkSmartPointer<vtkImageData>;

/** A file that is being read: made and let go by one thread, read by another. */
class ReadingFile {
public:
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

private:
  std::string Path;
  vtkNew<vtkUltrasoundReader> Reader;
  vtkNew<vtkCallbackCommand> Listener;
  std::vector<std::string> Errors;
  bool Done = false;
};

/** Reads files side by side. Throws for the first that cannot be read. */
inline std::vector<SessionImage> ReadImages(const std::vector<std::string>& paths)
{
  std::vector<std::unique_ptr<ReadingFile>> files;
  for (const std::string& path : paths) {
    files.push_back(std::make_unique<ReadingFile>(path));
  }
  ParallelFor(static_cast<std::ptrdiff_t>(files.size()),
              [&files](std::ptrdiff_t i) { files[static_cast<std::size_t>(i)]->Read(); });
  std::vector<SessionImage> images;
  for (const auto& file : files) {
    images.emplace_back(file->Image());
  }
  return images;
}

/** The images of the volumes of a project that are not here (id 0), in their order: from blocks that have the names of the files
 * (may be nullptr), else read. The volumes have the files and geometries that were found afterwards. */
inline std::vector<SessionImage> LoadImages(const std::string& path, std::vector<SessionVolume>& volumes,
                                            const std::vector<std::string>& folders, vtkMultiBlockDataSet* blocks)
{
  FindVolumes(path, volumes, folders);
  std::map<std::string, SessionImage> known;
  for (unsigned int block = 0; blocks && block < blocks->GetNumberOfBlocks(); ++block) {
    const char* name = blocks->HasMetaData(block) ? blocks->GetMetaData(block)->Get(vtkCompositeDataSet::NAME()) : nullptr;
    known[ResolvedPath(name ? name : "")] = vtkImageData::SafeDownCast(blocks->GetBlock(block));
  }
  std::vector<std::string> unknown;
  for (const SessionVolume& volume : volumes) {
    if (volume.id == 0 && !known[volume.file]) {
      unknown.push_back(volume.file);
    }
  }
  const std::vector<SessionImage> read = ReadImages(unknown);
  for (std::size_t i = 0; i < read.size(); ++i) {
    known[unknown[i]] = read[i];
  }
  std::vector<SessionImage> images;
  for (SessionVolume& volume : volumes) {
    if (volume.id == 0) {
      images.push_back(known[volume.file]);
      vtkUltrasoundVolume::CheckInput(nullptr, images.back(), volume.file);
      TakeGeometry(volume, vtkUltrasoundVolume::GeometryOf(images.back()));
    }
  }
  return images;
}

class SessionImages {
public:
  explicit SessionImages(AlignmentSession& session) : Session(session) {}

  void Hold(const SessionVolume& volume, vtkImageData* image)
  {
    this->Volumes.insert_or_assign(KeyOf(volume), SessionVoxels(volume, image));
  }

  /** What has changed since a state, and of which volume: 0 of none, -1 of several. */
  struct Changes {
    int Volumes = 0, Poses = 0, Voxels = 0; ///< volumes: names and looks, too
    bool OthersAreHere = false;
    std::vector<std::string> Unpainted; ///< names of volumes for which there was no memory
  };
  /** Brings the images to where the session's state says. */
  Changes Follow(const SessionState& before)
  {
    Changes changes;
    const auto add = [](int& to, int id) { to = to == 0 || to == id ? id : -1; };
    changes.Voxels = this->DropLostStroke() ? -1 : 0;
    const std::vector<SessionVolume>& after = this->Session.State().volumes;
    for (const SessionVolume& volume : after) {
      const SessionVolume* old = before.Find(volume.id);
      SessionVoxels& voxels = this->Of(volume);
      const bool hasOthers = old && old->edition != volume.edition;
      if (!old || hasOthers || old->volumeToWorld.matrix() != volume.volumeToWorld.matrix()) {
        voxels.Place(volume.volumeToWorld);
        add(changes.Poses, volume.id);
      }
      if (hasOthers) {
        add(changes.Voxels, volume.id);
      }
      try {
        if (voxels.GoTo(volume.strokes)) {
          add(changes.Voxels, volume.id);
        }
      } catch (const std::bad_alloc&) {
        changes.Unpainted.push_back(volume.name);
      }
      if (!old || old->name != volume.name || old->group != volume.group || old->colour != volume.colour ||
          old->opacity != volume.opacity || old->visible != volume.visible || !(old->landmarks == volume.landmarks) ||
          old->file != volume.file || old->madeOf != volume.madeOf) {
        add(changes.Volumes, volume.id);
      }
    }
    changes.OthersAreHere = !std::equal(before.volumes.begin(), before.volumes.end(), after.begin(), after.end(),
                                        [](const SessionVolume& a, const SessionVolume& b) { return a.id == b.id; });
    changes.Volumes = changes.OthersAreHere ? -1 : changes.Volumes;
    return changes;
  }

  /** Voxels that nothing can bring back are let go. */
  void Forget()
  {
    for (auto each = this->Volumes.begin(); each != this->Volumes.end();) {
      each = this->Session.Remembers(each->first.first, each->first.second) ? std::next(each) : this->Volumes.erase(each);
    }
  }

  /** Of a volume that is in the session. Throws Error(InvalidParameter) when there is none. */
  SessionVoxels& At(int id)
  {
    const SessionVolume* volume = this->Session.State().Find(id);
    if (!volume) {
      throw Error(Error::Kind::InvalidParameter, "there is no volume " + std::to_string(id));
    }
    return this->Of(*volume);
  }

  /** All volumes as they came. */
  std::vector<SessionVolume> Known() const
  {
    std::vector<SessionVolume> known;
    for (const auto& [key, voxels] : this->Volumes) {
      known.push_back(voxels.Known);
    }
    return known;
  }

  /** The percentiles \a dark and \a bright of the grey levels of all volumes: a window of positive width. */
  std::array<double, 2> GreyWindow(double dark, double bright, std::ptrdiff_t samplesPerVolume)
  {
    std::vector<double> levels;
    for (const SessionVolume& volume : this->Session.State().volumes) {
      this->Of(volume).SampleGreyLevels(samplesPerVolume, levels);
    }
    if (levels.empty()) {
      return {0.0, 255.0};
    }
    const double black = Percentile(levels, dark), white = Percentile(levels, bright);
    return {black, black < white ? white : black + 1.0};
  }

  ///@{
  /** A stroke of the brush, from Begin to End: an edit of the session. */
  void BeginStroke(int id, const std::string& mode, Brush brush)
  {
    SessionVoxels& voxels = this->At(id);
    if (this->Brushed) {
      throw Error(Error::Kind::NotPossible, "another stroke has not ended");
    }
    const std::optional<BrushMode> known = BrushModeNamed(mode);
    if (!known) {
      throw Error(Error::Kind::InvalidParameter, "the brush's mode is \"" + mode + "\"; paint, carve or restore is needed");
    }
    brush.mode = *known;
    voxels.Begin(brush);
    this->Session.Begin(VerbOf(*known) + " " + this->Session.State().Find(id)->name);
    this->Drawn = {brush, {}};
    this->Brushed = id;
  }
  /** The volume that is drawn on; 0: none. */
  int GetBrushed() const { return this->Brushed; }
  /** Returns whether voxels have changed. */
  bool ExtendStroke(const Eigen::Vector3d& world)
  {
    const Eigen::Vector3d point = this->Session.State().Find(this->Brushed)->volumeToWorld.inverse() * world;
    const bool changed = this->At(this->Brushed).Extend(point);
    this->Drawn.pathMm.push_back(point);
    return changed;
  }
  void EndStroke()
  {
    if (!this->Brushed) {
      throw Error(Error::Kind::NotPossible, "no stroke was begun");
    }
    if (this->Drawn.pathMm.empty()) {
      this->DropStroke();
      this->Session.End();
      return;
    }
    const int id = std::exchange(this->Brushed, 0);
    try {
      this->Session.AddStroke(id, this->Drawn);
      this->At(id).End(this->Session.State().Find(id)->strokes);
    } catch (...) // no memory: what was painted goes, and the edit ends all the same
    {
      this->Session.Cancel();
      this->At(id).TakeBack();
      throw;
    }
    this->Session.End();
  }
  /** Takes back what was drawn of a stroke in the making. Returns whether voxels have changed. */
  bool DropStroke()
  {
    bool changed = false; // its volume may be gone
    const int id = std::exchange(this->Brushed, 0);
    for (auto each = this->Volumes.lower_bound({id, 0}); each != this->Volumes.end() && each->first.first == id; ++each) {
      changed = each->second.TakeBack() || changed;
    }
    return changed;
  }
  /** The same when its edit has ended, or its volume has gone. */
  bool DropLostStroke()
  {
    if (!this->Brushed || (this->Session.Editing() && this->Session.State().Find(this->Brushed))) {
      return false;
    }
    this->Session.End();
    return this->DropStroke();
  }
  /** The session's state with the stroke in the making, so that a backup has it too. */
  SessionState State() const
  {
    SessionState state = this->Session.State();
    SessionVolume* volume = this->Brushed && !this->Drawn.pathMm.empty() ? state.Find(this->Brushed) : nullptr;
    if (volume) {
      volume->strokes = Append(volume->strokes, this->Drawn);
    }
    return state;
  }
  ///@}

private:
  using Key = std::pair<int, int>; ///< a volume's id, and the edition of its voxels
  static Key KeyOf(const SessionVolume& volume) { return {volume.id, volume.edition}; }
  SessionVoxels& Of(const SessionVolume& volume) { return this->Volumes.at(KeyOf(volume)); }

  AlignmentSession& Session;
  std::map<Key, SessionVoxels> Volumes; ///< also those that undo could bring back
  int Brushed = 0;
  Stroke Drawn; ///< on it
};

} // namespace echorama

#endif
