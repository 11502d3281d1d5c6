// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

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
  void SetPose(int id, const Pose& volumeToWorld); ///< Error(InvalidParameter) when not rigid
  void SetName(int id, const std::string& name);   ///< Error(InvalidParameter) when empty or another volume's
  void SetColour(int id, const std::array<double, 3>& rgb);
  void SetOpacity(int id, double opacity);
  void SetVisible(int id, bool visible);
  void AddStroke(int id, Stroke stroke);
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
  int GroupSelection();                   ///< returns the group's number; of fewer than two volumes: Error(NotPossible)
  void UngroupSelection();
  ///@}
  /// Where rotations turn about, world: what the user chose, else the middle of what is selected, else of all. The middle is the
  /// mean of the volumes' centres: it stays where it is while they turn about it.
  Eigen::Vector3d CentreOfRotation() const;
  const std::optional<Eigen::Vector3d>& ChosenCentre() const { return centre_; }
  void SetCentreOfRotation(const std::optional<Eigen::Vector3d>& centre); ///< Error(InvalidParameter) when not finite

  /// Takes over a state whole (a project that was opened): no undo beyond it. Volumes get new ids, in the order of the state.
  void Reset(SessionState state);
  /// Takes over a state as one edit (a backup that was restored). Volumes keep their ids; those with id 0 get one.
  void Replace(SessionState state, const std::string& label);
  /// Whether a volume is here, or could come back by undo or redo.
  bool Remembers(int id) const;

private:
  struct Entry {
    std::string label;
    SessionState state; ///< before the edit; of what was undone: after it
  };
  class Edit;
  SessionVolume& Volume(int id);
  void CheckNew(const SessionVolume& volume) const;
  void TidySelection();
  SessionState state_, start_;
  std::vector<Entry> done_, undone_;
  std::string label_;
  int depth_ = 0, nextId_ = 1;
  long long version_ = 0;
  std::set<int> selection_;
  std::optional<Eigen::Vector3d> centre_;
};

} // namespace echorama
