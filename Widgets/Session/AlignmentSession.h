// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "SessionState.h"
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// What a person does to a set of volumes by hand: poses, looks, groups and strokes, with undo and redo of every edit.
///
/// Edits happen between Begin and End; each setter that is called outside is an edit by itself. An edit that leaves the state
/// as it was makes no entry. So a drag is one entry, and a click that moves nothing none. No voxels are held here.
class AlignmentSession {
public:
  const SessionState& State() const { return state_; }

  ///@{ Edits. \a label names it for people ("Move liver_A"). Begin/End nest: only the outermost counts.
  void Begin(const std::string& label);
  bool End();    ///< whether there is a new entry
  void Cancel(); ///< back to where the outermost Begin was
  bool Editing() const { return depth_ > 0; }
  ///@}
  ///@{ Undo and redo, one entry at a time; false when there is none. During an edit: Error(NotPossible).
  bool Undo();
  bool Redo();
  int UndoCount() const;
  int RedoCount() const;
  std::string UndoLabel() const; ///< empty: nothing to undo
  std::string RedoLabel() const;
  ///@}
  ///@{ Volumes. Ids that do not exist: Error(InvalidParameter).
  int Add(SessionVolume volume);             ///< gives id, a unique name and, when white, a tint; returns the id
  void Remove(int id);
  void SetPose(int id, const Pose& volumeToWorld); ///< Error(InvalidParameter) when not rigid
  void SetName(int id, const std::string& name);
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
  /// Where rotations turn about, world: what the user chose, else the middle of what is selected, else of all.
  Eigen::Vector3d CentreOfRotation() const;
  void SetCentreOfRotation(const std::optional<Eigen::Vector3d>& centre) { centre_ = centre; }

  /// Takes over a state whole (a project that was opened): no undo beyond it.
  void Reset(SessionState state);
  /// Takes over a state as one edit (a backup that was restored). Volumes keep their ids.
  void Replace(SessionState state, const std::string& label);

private:
  struct Entry {
    std::string label;
    SessionState before, after;
  };
  SessionState state_, start_;
  std::vector<Entry> done_, undone_;
  std::string label_;
  int depth_ = 0, nextId_ = 1;
  std::set<int> selection_;
  std::optional<Eigen::Vector3d> centre_;
};

} // namespace echorama
