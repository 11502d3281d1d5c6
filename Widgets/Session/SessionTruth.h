// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/PoseFile.h"
#include "Widgets/Session/LiveScore.h"
#include "Widgets/Session/SessionState.h"
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace echorama {

/// Where the volumes of a session belong, and how far they are from there (dissertation 4.4.2).
class SessionTruth {
public:
  /// ValidPoints of a volume, by its id.
  using PointsOf = std::function<std::vector<Eigen::Vector3d>(int id)>;

  /// The truths in a pose file, instead of all that was known. \throws as ReadPoses, and Error(BadInput) when the file names none
  /// of the volumes or belongs to others; nothing has changed then.
  void Read(const std::string& path, const SessionState& state, const PointsOf& pointsOf);
  /// That of a volume which came later, when the file names it. \throws as PoseFor.
  void Match(const SessionVolume& volume, const PointsOf& pointsOf);
  /// \throws Error(InvalidParameter) when it is not rigid, Error(BadInput) when the volume has no points.
  void Set(const SessionVolume& volume, const Pose& volumeToWorld, const PointsOf& pointsOf);
  /// The same by hand: no file has it, so the project must. A file that is read later takes its place.
  void SetByHand(const SessionVolume& volume, const Pose& volumeToWorld, const PointsOf& pointsOf);
  /// Those of the volumes of \a state, by name.
  std::map<std::string, Pose> ByHand(const SessionState& state) const;
  void Clear(); ///< which volume is fixed stays chosen
  /// The file that is read, absolute; empty: none. Another project: its file is named before it is read.
  const std::string& File() const { return file_; }
  void SetFile(const std::string& path) { file_ = path; }

  bool Empty() const { return score_.Empty(); }
  /// nullptr: nothing is known.
  const Pose* Find(int id) const;

  /// On which volume both agree; -1: the first that has a truth. \throws Error(InvalidParameter) when it has none.
  void SetFixed(int id);
  int Fixed(const SessionState& state) const; ///< -1: none has a truth
  ///@{ The name of the one that was chosen, for a project; empty: none was. A truth that is missing now may come later.
  std::string FixedName(const SessionState& state) const;
  void SetFixedName(const std::string& name, const SessionState& state);
  ///@}

  /// nullptr: there is none, without truth or with fewer than two volumes that have one. Valid until something changes.
  const LiveScoreResult* Score(const SessionState& state) const;
  ///@{ NaN: there is none. Of all; of one volume: mm and degrees.
  double Mean(const SessionState& state) const;
  double MeanOf(int id, const SessionState& state) const;
  double DegreesOf(int id, const SessionState& state) const;
  ///@}
  /// Poses have changed, or volumes have come or gone: the score is another.
  void Outdate() { isCurrent_ = false; }

private:
  std::string file_;
  std::map<int, Pose> truths_;
  std::set<int> byHand_;
  std::vector<VolumePose> poses_; ///< of the file, also of volumes that may still come
  LiveScore score_;
  int fixed_ = -1;
  mutable std::optional<LiveScoreResult> result_; ///< made when somebody asks
  mutable bool isCurrent_ = false;
};

} // namespace echorama
