// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAlignmentSession
 * @brief volumes that a person aligns, paints and scores by hand: poses, selection, undo, backups, projects
 *
 * No window and no widget inside: the workbench, the views and the alignment widget show and change one of these, and so can
 * a script. A volume's image shares its voxels with what was given until it is painted; then it has its own copy. Moving a
 * volume changes the geometry of its image (the geometry is the pose) and its `ProbeToWorld`.
 *
 * Volumes are named by ids, from 1, that are never given twice. Methods that fail report an error and return false (0, -1 or
 * nullptr), and change nothing.
 *
 * Events (the id of the volume as int* call data, nullptr when several or all):
 *
 * | event                  | when                                                                    |
 * | ---------------------- | ----------------------------------------------------------------------- |
 * | VolumesChangedEvent    | volumes came or went, or names, groups, looks, landmarks; a backup was restored |
 * | PosesChangedEvent      | at every step of a drag                                                  |
 * | SelectionChangedEvent  | the selection, or the centre of rotation                                 |
 * | VoxelsChangedEvent     | painted, carved                                                         |
 * | MeasurementsChangedEvent | measurements came, went or moved                                       |
 * | HistoryChangedEvent    | there is an entry more or less to undo or redo, or the project was saved |
 *
 * Source: dissertation 4.3, 4.4.
 */
#ifndef vtkUltrasoundAlignmentSession_h
#define vtkUltrasoundAlignmentSession_h

#include "EchoramaWidgetsModule.h"
#include "vtkCommand.h"
#include "vtkObject.h"
#ifndef __VTK_WRAP__
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/ProjectFolder.h"
#include "Widgets/Session/SessionStorage.h"
#include "Widgets/Session/SessionTruth.h"
#include <algorithm>
#include <functional>
#include <memory>
#include <type_traits>
#endif
#include <string>

class vtkDoubleArray;
class vtkImageData;
class vtkIntArray;
class vtkMatrix4x4;
class vtkMultiBlockDataSet;
class vtkPolyData;
class vtkStringArray;
#ifndef __VTK_WRAP__
namespace echorama {
class SessionImages;
}
#endif

class ECHORAMAWIDGETS_EXPORT vtkUltrasoundAlignmentSession : public vtkObject {
public:
  static vtkUltrasoundAlignmentSession* New();
  vtkTypeMacro(vtkUltrasoundAlignmentSession, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Events {
    VolumesChangedEvent = vtkCommand::UserEvent + 9001,
    PosesChangedEvent,
    SelectionChangedEvent,
    VoxelsChangedEvent,
    HistoryChangedEvent,
    MeasurementsChangedEvent
  };

  ///@{
  /** Volumes. AddVolume takes an image that was read from \a file (may be nullptr: from a pipeline), where it stands. Returns
   * the id. OpenVolume reads the file first. */
  int AddVolume(vtkImageData* image, const char* file, const char* name = nullptr);
  int OpenVolume(const char* file);
  bool RemoveVolume(int id) { return this->Do(&Kernel::Remove, id); }
  int GetNumberOfVolumes() const { return static_cast<int>(this->GetKernel().State().volumes.size()); }
  int GetVolumeId(int index) const { return this->GetKernel().State().IdAt(index); } ///< -1: none
  bool HasVolume(int id) const { return this->Find(id) != nullptr; }
  /** Where it lies now, with what was painted: not to be changed. nullptr: no such volume. */
  vtkImageData* GetImage(int id) const;
  /** What views show of it. The same; of an embedded volume the background, too, which is invented and so not in its ValidRegion.
   */
  vtkImageData* GetShownImage(int id) const;
  /** The voxel (its point id) that is nearest to a point of the world; -1: none, or none that is real. */
  vtkIdType GetVoxelAt(int id, const double world[3]) const;
  /** All (or the visible) volumes as blocks with NAME(): for filters. Voxels are shared. */
  void GetVolumes(vtkMultiBlockDataSet* blocks, bool onlyVisible = false) const;
  /** The same for one volume: as it is now, whatever is painted later. For jobs beside the work. */
  bool GetSnapshot(int id, vtkImageData* image) const;
  ///@}

  ///@{
  /** Results: volumes that were made of others of the session, and stay linked to them. RecordSources takes down what the sources
   * are now (ids; as JSON), with \a options, an object of texts, for whoever makes it again; call it before the work begins.
   * AddResult takes what came of it; RemakeResult gives a result other voxels: looks stay, strokes and landmarks stay where they
   * are in the world. GetSourcesChanged: what has become of the sources since ("A was moved; B is gone"); empty: nothing, or it
   * is no result. GetSource: an id, 0: gone. Pose files leave results out. */
  std::string RecordSources(vtkIntArray* volumes, const char* options = nullptr);
  int AddResult(vtkImageData* image, const char* name, const char* record);
  bool RemakeResult(int id, vtkImageData* image, const char* record);
  bool IsResult(int id) const { return this->Of(id, &echorama::SessionVolume::madeOf) != nullptr; }
  std::string GetSourcesChanged(int id) const
  {
    return this->IsResult(id) ? echorama::ChangesSince(this->GetKernel().State(), *this->Find(id)) : std::string();
  }
  int GetNumberOfSources(int id) const
  {
    return this->IsResult(id) ? static_cast<int>(this->Find(id)->madeOf->sources.size()) : 0;
  }
  int GetSource(int id, int index) const
  {
    const bool isThere = index >= 0 && index < this->GetNumberOfSources(id);
    return isThere ? echorama::SourcesOf(this->GetKernel().State(), *this->Find(id)->madeOf)[static_cast<std::size_t>(index)] : 0;
  }
  /** Empty: it has no such. */
  std::string GetResultOption(int id, const char* name) const
  {
    return this->IsResult(id) && name ? echorama::OptionOf(*this->Find(id)->madeOf, name) : std::string();
  }
  /** A volume that is in no file, for saving: as it was given, without strokes (a project keeps those), and where it stood.
   * SetFile says in which file that is now. It is no edit. */
  bool GetUnpainted(int id, vtkImageData* image);
  bool SetFile(int id, const char* file);
  ///@}

  ///@{
  /** Of a volume. Colours are RGB in [0, 1]. File is empty when there is none. */
  std::string GetName(int id) const { return this->Of(id, &echorama::SessionVolume::name); }
  bool SetName(int id, const char* name) { return this->Do(&Kernel::SetName, id, name ? name : ""); }
  std::string GetFile(int id) const { return this->Of(id, &echorama::SessionVolume::file); }
  bool GetColour(int id, double rgb[3]) const
  {
    const echorama::SessionVolume* volume = this->Find(id);
    return volume && std::copy(volume->colour.begin(), volume->colour.end(), rgb) != rgb;
  }
  bool SetColour(int id, double r, double g, double b) { return this->Do(&Kernel::SetColour, id, {r, g, b}); }
  /** The tints that volumes get: "many" (seven), "grey-amber" or "blue-orange" (three, that people who see no red or no green
   * can tell apart). Those that wear one change, in one edit. */
  bool SetTints(const char* set) { return this->Do(&Kernel::SetTints, set ? set : ""); }
  double GetOpacity(int id) const { return this->Of(id, &echorama::SessionVolume::opacity); }
  bool SetOpacity(int id, double opacity) { return this->Do(&Kernel::SetOpacity, id, opacity); }
  bool GetVisible(int id) const { return this->Of(id, &echorama::SessionVolume::visible); }
  bool SetVisible(int id, bool visible) { return this->Do(&Kernel::SetVisible, id, visible); }
  int GetGroup(int id) const { return this->Of(id, &echorama::SessionVolume::group); }
  /** Grey levels drawn black and white: by default the 0.1 and 99.9 percentile of all volumes. Not an edit. */
  void GetGreyWindow(double window[2]) const;
  void SetGreyWindow(double black, double white);
  /** By default again. */
  void ResetGreyWindow()
  {
    this->GreyWindow.reset();
    this->GreyWindowChosen = false;
    this->Modified();
    this->InvokeEvent(VolumesChangedEvent);
  }
  ///@}

  ///@{
  /** The pose: from where the volume's file (or what was given) has it to where it lies, mm. */
  bool GetVolumeToWorld(int id, vtkMatrix4x4* pose) const;
  bool SetVolumeToWorld(int id, vtkMatrix4x4* pose);
  /** The same in numbers: the middle of the volume, mm, and rotations about the world's z, then y, then x, degrees. */
  bool GetPlacement(int id, double middle[3], double degrees[3]) const;
  bool SetPlacement(int id, double x, double y, double z, double degreesX, double degreesY, double degreesZ)
  {
    return this->Do(&Kernel::SetPlacement, id, {{x, y, z}, {degreesX, degreesY, degreesZ}});
  }
  ///@}

  ///@{
  /** Selection: with all of the volume's group. Not an edit. */
  bool Select(int id, bool on = true, bool alone = false) { return this->Do(&Kernel::Select, id, on, alone); }
  void SelectAll() { this->Do(&Kernel::SelectAll); }
  void SelectNone() { this->Do(&Kernel::SelectNone); }
  void InvertSelection() { this->Do(&Kernel::InvertSelection); }
  bool IsSelected(int id) const { return this->GetKernel().Selection().count(id) > 0; }
  int GetNumberOfSelected() const { return static_cast<int>(this->GetKernel().Selection().size()); }
  bool GroupSelection() { return this->Do(&Kernel::GroupSelection); }
  bool UngroupSelection() { return this->Do(&Kernel::UngroupSelection); }
  ///@}

  ///@{
  /** Moves all that is selected by a motion of the world; translates, mm; turns about the centre of rotation by a rotation
   * vector, degrees. */
  bool MoveSelection(vtkMatrix4x4* motion);
  bool TranslateSelection(double x, double y, double z)
  {
    return this->Do(&Kernel::MoveSelection, echorama::Pose(Eigen::Translation3d(x, y, z)));
  }
  bool RotateSelection(double x, double y, double z) { return this->Do(&Kernel::RotateSelection, {x, y, z}); }
  /** Choosing the centre of rotation is an edit. */
  void GetCentreOfRotation(double centre[3]) const { Eigen::Map<Eigen::Vector3d>{centre} = this->Session.CentreOfRotation(); }
  void SetCentreOfRotation(double x, double y, double z) { this->Do(&Kernel::SetCentreOfRotation, Eigen::Vector3d(x, y, z)); }
  /** The middle of what is selected. */
  void ResetCentreOfRotation() { this->Do(&Kernel::SetCentreOfRotation, std::nullopt); }
  ///@}

  ///@{
  /** Edits: what happens between Begin and End is one entry of undo, or none when nothing changed. Cancel goes back. */
  void BeginEdit(const char* label) { this->Session.Begin(label ? label : ""); }
  bool EndEdit() { return this->Ask(&Kernel::End, {}); }
  void CancelEdit() { this->Do(&Kernel::Cancel); }
  bool Undo() { return this->Ask(&Kernel::Undo, "Undo: " + this->GetUndoLabel()); }
  bool Redo() { return this->Ask(&Kernel::Redo, "Redo: " + this->GetRedoLabel()); }
  int GetUndoCount() const { return this->GetKernel().UndoCount(); }
  int GetRedoCount() const { return this->GetKernel().RedoCount(); }
  std::string GetUndoLabel() const { return this->GetKernel().UndoLabel(); }
  std::string GetRedoLabel() const { return this->GetKernel().RedoLabel(); }
  /** What was done stays done: nothing before can be undone, and volumes that were removed are let go. */
  bool ForgetHistory() { return this->Do(&Kernel::ForgetHistory); }
  ///@}

  ///@{
  /** Landmarks: places with labels, which are the same place of the body in every volume that has one of that label. A place of
   * the world, mm: it moves with the volume from then on. RemoveLandmark: from all volumes. GetNextLandmarkLabel: the first that
   * other volumes have and this one has not, else a new number. */
  bool SetLandmark(int id, const char* label, double x, double y, double z)
  {
    return this->Do(&Kernel::SetLandmark, id, label ? label : "", {x, y, z});
  }
  bool RemoveLandmark(const char* label) { return this->Do(&Kernel::RemoveLandmark, label ? label : ""); }
  bool ClearLandmarks() { return this->Do(&Kernel::ClearLandmarks); }
  std::string GetNextLandmarkLabel(int id) const { return this->GetKernel().NextLandmarkLabel(id); }
  int GetNumberOfLandmarks(int id) const { return static_cast<int>(this->Of(id, &echorama::SessionVolume::landmarks).size()); }
  /** Empty: there are not so many. */
  std::string GetLandmarkLabel(int id, int index) const
  {
    return index >= 0 && index < this->GetNumberOfLandmarks(id) ? this->Find(id)->landmarks[static_cast<std::size_t>(index)].label
                                                                : std::string();
  }
  bool GetLandmark(int id, const char* label, double place[3]) const
  {
    const auto found = this->GetKernel().PlaceOfLandmark(id, label ? label : "");
    return found && std::copy_n(found->data(), 3, place) != place;
  }
  ///@}

  ///@{
  /** Measurements: distances of two points of the world and angles of three (at the second), mm and degrees. They stay where they
   * are when volumes move. SetDistance and SetAngle add one, or change the one with that number. By index: the number (0: there
   * are not so many) and the value. */
  bool SetDistance(int number, const double from[3], const double to[3])
  {
    return this->SetMeasurement({number, {Eigen::Vector3d(from), Eigen::Vector3d(to)}});
  }
  bool SetAngle(int number, const double from[3], const double at[3], const double to[3])
  {
    return this->SetMeasurement({number, {Eigen::Vector3d(from), Eigen::Vector3d(at), Eigen::Vector3d(to)}});
  }
  bool RemoveMeasurement(int number) { return this->Do(&Kernel::RemoveMeasurement, number); }
  bool ClearMeasurements() { return this->Do(&Kernel::ClearMeasurements); }
  int GetNextMeasurementNumber() const { return this->GetKernel().NextMeasurementNumber(); }
  int GetNumberOfMeasurements() const { return static_cast<int>(this->GetKernel().State().measurements.size()); }
  int GetMeasurementNumber(int index) const { return this->MeasurementAt(index).number; }
  double GetMeasurementValue(int index) const { return this->MeasurementAt(index).Value(); }
  ///@}

  ///@{
  /** A stroke of the brush: Begin (mode "paint", "carve" or "restore"), then points of the world, then End: one entry of undo. */
  bool BeginStroke(int id, const char* mode, double radiusMm, double intensity, double opacity, double hardness,
                   bool insideValid);
  bool ExtendStroke(double x, double y, double z);
  bool EndStroke();
  /** Copies the voxels of a volume, which the first stroke on it would do otherwise: when a brush is taken in hand. */
  bool PrepareToPaint(int id);
  ///@}

  ///@{
  /** Projects: JSON, paths relative where they can be (see Documentation/session.md). What cannot be read is named by the error
   * and nothing is opened. A pose file opens as well, as a project of its volumes; a backup opens as a session that was never
   * saved. \a volumes: read already (blocks with NAME() the file as GetProjectFiles tells), so that a window need not wait.
   * Without, files are read side by side. A backup opens without its volumes that were in no file, with a warning that names
   * them; the backups of an abandoned session become those of the session that opens one. Saving is atomic; volumes that are in
   * no file cannot be saved; \a withoutUnsavedResults leaves such results out, and they count as not saved. When somebody else
   * has changed the project file since it was opened or saved here, saving is refused once; saving again replaces it. Never
   * replaced are files of volumes and of the truth, and poses that name displacements, which a session does not keep. */
  bool OpenProject(const char* path, vtkMultiBlockDataSet* volumes = nullptr);
  bool SaveProject(const char* path, bool withoutUnsavedResults = false);
  /** The project with all that it needs in one new folder, which opens on another machine: FOLDER/NAME.json, FOLDER/volumes, and
   * the truth. The session goes on where it is. */
  bool CopyProject(const char* folder)
  {
    return this->Change([&] { echorama::CopyProject(this->Now(), folder ? folder : ""); });
  }
  /** The files a project needs, where they are now; an empty string for one that is nowhere. */
  bool GetProjectFiles(const char* path, vtkStringArray* files);
  /** Where else volumes of projects are looked for. */
  void AddSearchFolder(const char* folder)
  {
    if (folder && *folder) {
      this->SearchFolders.push_back(echorama::ResolvedPath(folder));
    }
  }
  std::string GetProjectPath() const { return this->Storage.ProjectPath(); } ///< empty: never saved
  bool GetModifiedSinceSave() const
  {
    const echorama::Project& saved = this->Storage.Saved();
    return this->Session.State() != saved.state || !SameNotes(this->Notes(), saved);
  }
  /** For people: who, what. Saved with the project. */
  std::string GetComment() const { return this->Comment; }
  void SetComment(const char* comment)
  {
    this->Change([&] { this->Comment = comment ? comment : ""; }, "Change comment");
  }
  /** Poses alone: the file that echorama align and stitch read and write. ReadPoses is an edit, of the volumes that the file
   * names. */
  bool ReadPoses(const char* path);
  bool WritePoses(const char* path);
  ///@}

  ///@{
  /** Backups after each edit or change of comment and truth, and at least once a second while an edit goes on; a thread of its
   * own waits for the disk. Default off: scripts do not write by surprise; the workbench turns it on. */
  void SetAutomaticBackups(bool on);
  bool GetAutomaticBackups() const { return this->AutomaticBackups; }
  /** NAME.backups beside the project NAME.json; of a session that was never saved a folder under the user's data folder. Empty:
   * of a session without project and without backups. */
  std::string GetBackupFolder() const { return this->Storage.BackupFolder(); }
  /** Now; returns when it is on the disk. */
  bool BackUp();
  /** Paths, newest first; labels and times (seconds since 1970) in the same order; unreadable ones have the label "damaged".
   * Returns how many. GetBackupsIn: of another session's folder. */
  int GetBackups(vtkStringArray* paths, vtkStringArray* labels = nullptr, vtkDoubleArray* times = nullptr);
  static int GetBackupsIn(const char* folder, vtkStringArray* paths, vtkStringArray* labels = nullptr,
                          vtkDoubleArray* times = nullptr);
  /** Of the project that is open: its newest readable backup, when that is later than the project file and differs from what is
   * open. Empty: there is none. For a window that has opened a project: work that was not saved. */
  std::string GetLaterBackup() { return this->Storage.LaterBackup(this->Now(), this->Folders()); }
  /** A person decided not to keep what was not saved: its backups go at the end of the session, or when it opens another project.
   * A further edit takes this back. Without edits (volumes were opened, no more) an unsaved session leaves no backups anyway. */
  void ForgetUnsavedWork() { this->Storage.SetForgotten(true); }
  /** Restoring is an edit: it can be undone. Volumes that are here keep their ids, others are read. Comment and truth come back,
   * too, and are not undone. */
  bool RestoreBackup(const char* path);
  /** Folders of sessions that ended without being saved, and whose process is gone: the newest first. OpenProject opens the
   * newest backup in one, DiscardBackups removes them. */
  static int GetAbandonedSessions(vtkStringArray* folders);
  bool DiscardBackups(const char* folder)
  {
    return this->Change([&] { echorama::Backups::Discard(folder ? folder : ""); });
  }
  ///@}

  ///@{
  /** The truth: a pose file that names the volumes. The score (mm, dissertation 4.4.2) follows poses at once: NaN without truth
   * or with fewer than two volumes that have one. FixedVolume: on which both agree, default the first that has a truth. A project
   * keeps it. */
  bool ReadTruth(const char* path)
  {
    return this->DoTruth([&] { this->Truth.Read(path ? path : "", this->Session.State(), this->PointsOf); });
  }
  bool SetTruth(int id, vtkMatrix4x4* volumeToWorld);
  void ClearTruth()
  {
    this->DoTruth([this] { this->Truth.Clear(); });
  }
  bool HasTruth() const { return !this->Truth.Empty(); }
  /** Where a volume belongs: its VolumeToWorld by the truth. Returns false, and leaves the pose alone, when nothing is known. */
  bool GetTruth(int id, vtkMatrix4x4* volumeToWorld) const;
  double GetScore() const { return this->Truth.Mean(this->Session.State()); }
  double GetVolumeScore(int id) const { return this->Truth.MeanOf(id, this->Session.State()); }
  double GetRotationError(int id) const { return this->Truth.DegreesOf(id, this->Session.State()); } ///< degrees
  /** Points of the volumes where they are, with the array Error (3 doubles, mm) from where they belong, and Volume (ids). */
  void GetErrorVectors(vtkPolyData* vectors, int pointsPerVolume = 200) const;
  void SetFixedVolume(int id)
  {
    this->DoTruth([&] { this->Truth.SetFixed(id); });
  }
  int GetFixedVolume() const { return this->Truth.Fixed(this->Session.State()); } ///< -1: none has a truth
  ///@}

protected:
  vtkUltrasoundAlignmentSession();
  ~vtkUltrasoundAlignmentSession() override;

private:
  vtkUltrasoundAlignmentSession(const vtkUltrasoundAlignmentSession&) = delete;
  void operator=(const vtkUltrasoundAlignmentSession&) = delete;

#ifndef __VTK_WRAP__
public:
  /** The kernel session: to read. */
  const echorama::AlignmentSession& GetKernel() const
  {
    return this->Session;
  }
  /** The same as with a matrix. */
  bool SetVolumeToWorld(int id, const echorama::Pose& pose)
  {
    return this->Do(&Kernel::SetPose, id, pose);
  }
  bool SetMeasurement(const echorama::Measurement& measurement)
  {
    return this->Do(&Kernel::SetMeasurement, measurement);
  }
  /** As GetTruth; none: nothing is known. */
  std::optional<echorama::Pose> GetTruthOf(int id) const
  {
    const echorama::Pose* truth = this->Truth.Find(id);
    return truth ? std::optional<echorama::Pose>(*truth) : std::nullopt;
  }
  /** What SaveProject writes: for jobs beside the work. */
  echorama::Project Now() const;
  /** For tools that drag: see AlignmentSession::MoveHeld. */
  bool MoveHeld(const echorama::AlignmentSession::Grip& grip, const echorama::Pose& motion)
  {
    return this->Do(&Kernel::MoveHeld, grip, motion);
  }

private:
  using Kernel = echorama::AlignmentSession;
  const echorama::SessionVolume* Find(int id) const
  {
    return this->GetKernel().State().Find(id);
  }
  echorama::Measurement MeasurementAt(int index) const
  {
    const auto& all = this->GetKernel().State().measurements;
    return index >= 0 && index < static_cast<int>(all.size()) ? all[static_cast<std::size_t>(index)] : echorama::Measurement();
  }
  template <class T>
  T Of(int id, T echorama::SessionVolume::*what) const
  {
    const echorama::SessionVolume* volume = this->Find(id);
    return volume ? volume->*what : T();
  }
  /** Does it, and reports an error that it throws. Returns whether it went well. */
  bool Try(const std::function<void()>& change);
  /** The same, and tells what has changed. \a label: of the backup, when it is not the edit's. \a takeNotes: what follows when
   * the images are where the state says. */
  bool Change(const std::function<void()>& change, const std::string& label = {}, const std::function<void()>& takeNotes = {});
  template <class Result, class... Parameters>
  bool Do(Result (Kernel::*edit)(Parameters...), const std::decay_t<Parameters>&... arguments)
  {
    return this->Change([&] { (this->Session.*edit)(arguments...); });
  }
  /** The same, and returns what the kernel says. */
  bool Ask(bool (Kernel::*edit)(), const std::string& label)
  {
    bool answer = false;
    this->Change([&] { answer = (this->Session.*edit)(); }, label);
    return answer;
  }
  /** The same for the truth, which the kernel knows nothing of: whoever shows poses shows how far they are from it. */
  bool DoTruth(const std::function<void()>& change)
  {
    const bool done = this->Change(change, "Change truth");
    this->Modified();
    this->InvokeEvent(PosesChangedEvent, nullptr);
    return done;
  }
  int AddNew(vtkImageData* image, echorama::SessionVolume volume);
  void BackUpInTheBackground(const std::string& label)
  {
    this->TellTrouble(this->Storage.Post(this->Now(), label, !this->Session.Editing()));
  }
  void TellTrouble(const std::string& trouble)
  {
    if (!trouble.empty()) {
      vtkErrorMacro("there is no new backup: " << trouble);
    }
  }
  void Warn(const std::string& text) ///< unless it is empty
  {
    if (!text.empty()) {
      vtkWarningMacro(<< text);
    }
  }
  /** What a project holds beside the state. */
  echorama::Project Notes() const
  {
    const echorama::SessionState& state = this->Session.State();
    return {{}, this->Truth.File(), this->Comment, this->Truth.ByHand(state), this->Truth.FixedName(state)};
  }
  /** Those of the project \a path, whose volumes are here. */
  void TakeNotes(const std::string& path, const echorama::Project& project);
  std::vector<std::string> Folders() const;

  echorama::AlignmentSession Session;
  std::unique_ptr<echorama::SessionImages> Images;
  echorama::SessionTruth Truth;
  echorama::SessionTruth::PointsOf PointsOf;
  echorama::SessionStorage Storage;
  std::string Comment;
  std::vector<std::string> SearchFolders;
  bool AutomaticBackups = false;
  mutable std::optional<std::array<double, 2>> GreyWindow; ///< found when somebody asks
  bool GreyWindowChosen = false;
#endif
};

#endif
