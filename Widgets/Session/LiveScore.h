// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Registration/AlignmentScore.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// The score of ScoreAlignment while poses change: points are drawn once, an update costs some operations per point.
class LiveScore {
public:
  /// A volume with its truth. \a points: ValidPoints of it.
  void Set(int id, const std::string& name, const ImageGeometry& truth, std::vector<Eigen::Vector3d> points);
  void Clear();
  bool Empty() const;
  /// \a aligned: where each volume lies now; volumes without truth are left out. \a fixed: the id of the volume on which both agree.
  /// \throws as ScoreAlignment.
  AlignmentScore Update(const std::map<int, ImageGeometry>& aligned, int fixed) const;
};

/// One attempt at an alignment, as the history across attempts (CSV) holds it.
struct Attempt {
  std::string time;    ///< ISO 8601, UTC
  std::string trainee; ///< may be empty
  std::string project;
  double seconds = 0.0;   ///< from the start to the submission
  double scoreMm = 0.0;   ///< mean, dissertation 4.4.2
  double worstMm = 0.0;   ///< the largest score of a volume
  double degrees = 0.0;   ///< mean rotation left
  double startMm = 0.0;   ///< score at the start
  int edits = 0;
};
/// Adds a line to the history, with a header line when the file is new; a line is whole or not there.
/// \throws Error(FileSystem), Error(BadFile) when the file is something else.
void AppendAttempt(const std::string& path, const Attempt& attempt);
std::vector<Attempt> ReadAttempts(const std::string& path);

} // namespace echorama
