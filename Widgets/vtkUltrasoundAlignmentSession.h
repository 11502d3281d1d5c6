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
 * | VolumesChangedEvent    | volumes came or went, or names, groups, colours, opacity, visibility     |
 * | PosesChangedEvent      | at every step of a drag                                                  |
 * | SelectionChangedEvent  | the selection, or the centre of rotation                                 |
 * | VoxelsChangedEvent     | painted, carved                                                         |
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
#include <functional>
#include <memory>
#endif
#include <string>

class vtkDoubleArray;
class vtkImageData;
class vtkMatrix4x4;
class vtkMultiBlockDataSet;
class vtkPolyData;
class vtkStringArray;

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
    HistoryChangedEvent
  };

  ///@{
  /** Volumes. AddVolume takes an image that was read from \a file (may be nullptr: from a pipeline), where it stands. Returns
   * the id. OpenVolume reads the file first. */
  int AddVolume(vtkImageData* image, const char* file, const char* name = nullptr);
  int OpenVolume(const char* file);
  bool RemoveVolume(int id);
  int GetNumberOfVolumes() const;
  int GetVolumeId(int index) const; ///< -1: none
  bool HasVolume(int id) const;
  /** Where it lies now, with what was painted: not to be changed. nullptr: no such volume. */
  vtkImageData* GetImage(int id) const;
  /** All (or the visible) volumes as blocks with NAME(): for filters. Voxels are shared. */
  void GetVolumes(vtkMultiBlockDataSet* blocks, bool onlyVisible = false) const;
  /** The same for one volume: as it is now, whatever is painted later. For jobs beside the work. */
  bool GetSnapshot(int id, vtkImageData* image) const;
  ///@}

  ///@{
  /** Of a volume. Colours are RGB in [0, 1]. File is empty when there is none. */
  std::string GetName(int id) const;
  bool SetName(int id, const char* name);
  std::string GetFile(int id) const;
  bool GetColour(int id, double rgb[3]) const;
  bool SetColour(int id, double r, double g, double b);
  double GetOpacity(int id) const;
  bool SetOpacity(int id, double opacity);
  bool GetVisible(int id) const;
  bool SetVisible(int id, bool visible);
  int GetGroup(int id) const;
  /** Grey levels drawn black and white: by default the 0.1 and 99.9 percentile of all volumes. Not an edit. */
  void GetGreyWindow(double window[2]) const;
  void SetGreyWindow(double black, double white);
  ///@}

  ///@{
  /** The pose: from where the volume's file (or what was given) has it to where it lies, mm. */
  bool GetVolumeToWorld(int id, vtkMatrix4x4* pose) const;
  bool SetVolumeToWorld(int id, vtkMatrix4x4* pose);
  /** The same in numbers: the middle of the volume, mm, and rotations about the world's z, then y, then x, degrees. */
  bool GetPlacement(int id, double middle[3], double degrees[3]) const;
  bool SetPlacement(int id, double x, double y, double z, double degreesX, double degreesY, double degreesZ);
  ///@}

  ///@{
  /** Selection: with all of the volume's group. Not an edit. */
  bool Select(int id, bool on = true, bool alone = false);
  void SelectAll();
  void SelectNone();
  void InvertSelection();
  bool IsSelected(int id) const;
  int GetNumberOfSelected() const;
  bool GroupSelection();
  bool UngroupSelection();
  ///@}

  ///@{
  /** Moves all that is selected by a motion of the world; translates, mm; turns about the centre of rotation by a rotation
   * vector, degrees. */
  bool MoveSelection(vtkMatrix4x4* motion);
  bool TranslateSelection(double x, double y, double z);
  bool RotateSelection(double x, double y, double z);
  void GetCentreOfRotation(double centre[3]) const;
  void SetCentreOfRotation(double x, double y, double z);
  void ResetCentreOfRotation(); ///< the middle of what is selected
  ///@}

  ///@{
  /** Edits: what happens between Begin and End is one entry of undo, or none when nothing changed. Cancel goes back. */
  void BeginEdit(const char* label);
  bool EndEdit();
  void CancelEdit();
  bool Undo();
  bool Redo();
  int GetUndoCount() const;
  int GetRedoCount() const;
  std::string GetUndoLabel() const;
  std::string GetRedoLabel() const;
  /** What was done stays done: nothing before can be undone, and volumes that were removed are let go. */
  bool ForgetHistory();
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
   * no file cannot be saved. When somebody else has changed the project file since it was opened or saved here, saving is
   * refused once; saving again replaces it. A file of one of the volumes is never replaced. */
  bool OpenProject(const char* path, vtkMultiBlockDataSet* volumes = nullptr);
  bool SaveProject(const char* path);
  /** The files a project needs, where they are now; an empty string for one that is nowhere. */
  bool GetProjectFiles(const char* path, vtkStringArray* files);
  /** Where else volumes of projects are looked for. */
  void AddSearchFolder(const char* folder);
  std::string GetProjectPath() const; ///< empty: never saved
  bool GetModifiedSinceSave() const;
  /** For people: who, what. Saved with the project. */
  std::string GetComment() const;
  void SetComment(const char* comment);
  /** Poses alone: the file that echorama align and stitch read and write. ReadPoses is an edit, of the volumes that the file
   * names. */
  bool ReadPoses(const char* path);
  bool WritePoses(const char* path);
  ///@}

  ///@{
  /** Backups after each edit, and at least once a second while one goes on; a thread of its own waits for the disk. Default off:
   * scripts do not write by surprise; the workbench turns it on. */
  void SetAutomaticBackups(bool on);
  bool GetAutomaticBackups() const;
  /** NAME.backups beside the project NAME.json; of a session that was never saved a folder under the user's data folder. Empty:
   * of a session without project and without backups. */
  std::string GetBackupFolder() const;
  /** Now; returns when it is on the disk. */
  bool BackUp();
  /** Paths, newest first; labels and times (seconds since 1970) in the same order; unreadable ones have the label "damaged".
   * Returns how many. GetBackupsIn: of another session's folder. */
  int GetBackups(vtkStringArray* paths, vtkStringArray* labels = nullptr, vtkDoubleArray* times = nullptr);
  static int GetBackupsIn(const char* folder, vtkStringArray* paths, vtkStringArray* labels = nullptr,
                          vtkDoubleArray* times = nullptr);
  /** Of the project that is open: its newest readable backup, when that is later than the project file and differs from what is
   * open. Empty: there is none. For a window that has opened a project: work that was not saved. */
  std::string GetLaterBackup();
  /** A person decided not to keep what was not saved: its backups go at the end of the session, or when it opens another project.
   * A further edit takes this back. Without edits (volumes were opened, no more) an unsaved session leaves no backups anyway. */
  void ForgetUnsavedWork();
  /** Restoring is an edit: it can be undone. Volumes that are here keep their ids, others are read. */
  bool RestoreBackup(const char* path);
  /** Folders of sessions that ended without being saved, and whose process is gone: the newest first. OpenProject opens the
   * newest backup in one, DiscardBackups removes them. */
  static int GetAbandonedSessions(vtkStringArray* folders);
  bool DiscardBackups(const char* folder);
  ///@}

  ///@{
  /** The truth: a pose file that names the volumes. The score (mm, dissertation 4.4.2) follows poses at once: NaN without truth
   * or with fewer than two volumes that have one. FixedVolume: on which both agree, default the first that has a truth. */
  bool ReadTruth(const char* path);
  bool SetTruth(int id, vtkMatrix4x4* volumeToWorld);
  void ClearTruth();
  bool HasTruth() const;
  /** Where a volume belongs: its VolumeToWorld by the truth. Returns false, and leaves the pose alone, when nothing is known. */
  bool GetTruth(int id, vtkMatrix4x4* volumeToWorld) const;
  double GetScore() const;
  double GetVolumeScore(int id) const;
  double GetRotationError(int id) const; ///< degrees
  /** Points of the volumes where they are, with the array Error (3 doubles, mm) from where they belong, and Volume (ids). */
  void GetErrorVectors(vtkPolyData* vectors, int pointsPerVolume = 200) const;
  void SetFixedVolume(int id);
  int GetFixedVolume() const; ///< -1: none has a truth
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
  const echorama::AlignmentSession& GetKernel() const;

private:
  struct Internals;
  /** Does it, reports an error that it throws, and tells what has changed. \a label: of the backup, when it is not the edit's.
   * Returns whether it went well. */
  bool Change(const std::function<void()>& change, const std::string& label = {});
  void BackUpInTheBackground(const std::string& label, bool finished);
  /** Takes volumes out, with a warning that names them. Throws when nothing is left. */
  void LeaveOut(const std::string& path, std::vector<echorama::SessionVolume>& volumes,
                const std::function<bool(const echorama::SessionVolume&)>& out);
  std::unique_ptr<Internals> Parts;
#endif
};

#endif
