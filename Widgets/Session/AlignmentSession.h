// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// A pose in numbers: the middle of the volume, world, mm, and rotations about the world's z, then y, then x, degrees.
struct Placement {
  Eigen::Vector3d middle, degrees;
};
Placement PlacementOf(const SessionVolume& volume);

/// \throws Error(InvalidParameter) that calls the pose \a what.
void CheckRigid(const Pose& pose, const char* what);

/// How edits that draw are called: "Paint".
std::string VerbOf(BrushMode mode);

/// What a person does to a set of volumes by hand: poses, looks, groups and strokes, with undo and redo of every edit.
///
/// Edits happen between Begin and End; each setter that is called outside is an edit by itself. An edit that leaves the state
/// as it was makes no entry. So a drag is one entry, and a click that moves nothing none. No voxels are held here. Every method
/// that throws leaves the session as it was.
///
/// An entry keeps the state as it was before: some hundred bytes per volume, as strokes are shared.
class AlignmentSession {
public:
  const SessionState& State() const { return state_; }

  ///@{ Edits. \a label names it for people ("Move liver_A"). Begin/End nest: only the outermost counts.
  void Begin(const std::string& label);
  bool End();    ///< whether there is a new entry
  void Cancel(); ///< back to where the outermost Begin was; no edit is open afterwards
  bool Editing() const { return depth_ > 0; }
  const std::string& EditLabel() const { return label_; } ///< of the edit that is open, or was the last
  ///@}
  ///@{ Undo and redo, one entry at a time; false when there is none. During an edit: Error(NotPossible).
  bool Undo();
  bool Redo();
  int UndoCount() const { return static_cast<int>(done_.size()); }
  int RedoCount() const { return static_cast<int>(undone_.size()); }
  std::string UndoLabel() const; ///< empty: nothing to undo
  std::string RedoLabel() const;
  /// What was done stays done from now on. During an edit: Error(NotPossible).
  void ForgetHistory();
  /// Counts every change of the history: the same number means the same entries.
  long long HistoryVersion() const { return version_; }
  ///@}
  ///@{ Volumes. Ids that do not exist: Error(InvalidParameter).
  /// Gives an id, a name that is unique ("liver (2)") and, when the colour is white and other volumes are there, a tint.
  /// \returns the id. \throws Error(InvalidParameter) for a file that is in the session already, an impossible geometry, a pose
  /// that is not rigid, or looks out of range.
  int Add(SessionVolume volume);
  void Remove(int id);
  /// A result takes other voxels, of \a geometry, and lies where they were made. Looks stay; strokes and landmarks stay where
  /// they are in the world; it is in no file any more. \a hold is called with the volume as it is then, to put the voxels in
  /// their place; when it throws, nothing has changed. \throws Error(InvalidParameter) for a volume that is no result, an
  /// impossible geometry, and for one that would be its own source.
  void Remake(int id, const ImageGeometry& geometry, MadeOf madeOf, const std::function<void(const SessionVolume&)>& hold = {});
  /// Says in which file its voxels are, without strokes. That is a fact and no edit: earlier states know it, too.
  /// \throws Error(InvalidParameter) when another volume is that file.
  void SetFile(int id, const std::string& file);
  void SetPose(int id, const Pose& volumeToWorld); ///< Error(InvalidParameter) when not rigid
  /// Numbers that are as PlacementOf tells leave the last bits alone.
  void SetPlacement(int id, const Placement& placement);
  void SetName(int id, const std::string& name); ///< Error(InvalidParameter) when empty or another volume's
  void SetColour(int id, const std::array<double, 3>& rgb);
  void SetOpacity(int id, double opacity);
  /// Volumes get the tints of this set (TintSets()) from now on; those that wear one of the set before get its counterpart, which
  /// is one edit. \throws Error(InvalidParameter) for a name that none has.
  void SetTints(const std::string& set);
  void SetVisible(int id, bool visible);
  void AddStroke(int id, Stroke stroke);
  ///@}
  ///@{ Landmarks: places with labels. Those with one label in several volumes are the same place of the body.
  /// Sets or moves one. Error(InvalidParameter) for an empty label or a place (of the world, mm) that is not finite.
  void SetLandmark(int id, const std::string& label, const Eigen::Vector3d& place);
  void RemoveLandmark(const std::string& label); ///< of all volumes
  void ClearLandmarks();
  /// Where one is in the world; none: the volume has no such landmark.
  std::optional<Eigen::Vector3d> PlaceOfLandmark(int id, const std::string& label) const;
  /// For the next one in a volume: the first label that others have and it has not; else a number that none has.
  std::string NextLandmarkLabel(int id) const;
  ///@}
  ///@{ Measurements: see Measurement.
  /// Adds one, or takes the place of the one with its number. Error(InvalidParameter) for a number below 1, points that are not
  /// two or three, or not finite.
  void SetMeasurement(const Measurement& measurement);
  void RemoveMeasurement(int number); ///< Error(InvalidParameter) when there is none
  void ClearMeasurements();
  int NextMeasurementNumber() const; ///< above all there are
  ///@}
  ///@{ Selection: no edits.
  const std::set<int>& Selection() const { return selection_; }
  void Select(int id, bool on, bool alone = false); ///< with all of its group; \a alone: nothing else
  void SelectAll();
  void SelectNone();
  void InvertSelection();
  ///@}
  ///@{ Of what is selected.
  void MoveSelection(const Pose& motion); ///< world: pose becomes motion * pose
  /// What is selected, as it lies when somebody takes hold of it.
  struct Grip {
    std::vector<std::pair<int, Pose>> volumes; ///< ids and poses; none: nothing is selected
    Eigen::Vector3d centre;                    ///< of rotation
    bool isCentreChosen = false;               ///< then it goes with the volumes
  };
  Grip TakeHold() const;
  /// Everything that is held and still there goes from where it was taken hold of by a motion of the world.
  void MoveHeld(const Grip& grip, const Pose& motion);
  /// "Turn liver_A", "Turn 2 volumes".
  std::string LabelOf(const char* verb) const;
  void RotateSelection(const Eigen::Vector3d& degrees); ///< a rotation vector, about the centre of rotation
  int GroupSelection(); ///< returns the group's number; of fewer than two volumes: Error(NotPossible)
  void UngroupSelection();
  ///@}
  /// Where rotations turn about, world: what the user chose, else the middle of what is selected, else of all. The middle is the
  /// mean of the volumes' centres: it stays where it is while they turn about it.
  Eigen::Vector3d CentreOfRotation() const;
  const std::optional<Eigen::Vector3d>& ChosenCentre() const { return state_.centre; }
  void SetCentreOfRotation(const std::optional<Eigen::Vector3d>& centre); ///< an edit; Error(InvalidParameter) when not finite

  /// Takes over a state whole (a project that was opened): no undo beyond it. Volumes get new ids, in the order of the state.
  void Reset(SessionState state);
  /// Takes over a state as one edit (a backup that was restored). Volumes keep their ids; those with id 0 get one.
  void Replace(SessionState state, const std::string& label);
  /// Whether these voxels of a volume are here, or could come back by undo or redo.
  bool Remembers(int id, int edition = 0) const;

private:
  struct Entry {
    std::string label;
    SessionState state; ///< before the edit; of what was undone: after it
  };
  SessionVolume& Volume(int id);
  void Edit(const std::string& label, const std::function<void()>& change);
  void EditOne(const std::string& verb, int id, const std::function<void(SessionVolume&)>& change);
  bool Step(std::vector<Entry>& from, std::vector<Entry>& to);
  void TidySelection();
  SessionState state_, start_;
  std::vector<Entry> done_, undone_;
  std::string label_;
  int depth_ = 0, nextId_ = 1, lastEdition_ = 0;
  long long version_ = 0;
  std::string tints_ = "many";
  std::set<int> selection_;
};

} // namespace echorama
