// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Registration/AlignmentScore.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// An AlignmentScore that knows which volume is which.
struct LiveScoreResult : AlignmentScore {
  std::vector<int> ids;        ///< of `volumes`, in the same order: ascending
  std::vector<double> degrees; ///< rotation left, of each: the angle between where a volume is and where it belongs, [0, 180]
  /// Where \a id is in `volumes`, -1: it was not scored.
  int IndexOf(int id) const;
};

/// The score of ScoreAlignment while poses change: points are drawn once, an update costs some operations per point.
class LiveScore {
public:
  /// A volume with its truth; one that is known already gets another. \a points: ValidPoints of it.
  /// \throws Error(BadInput) when the truth is not a geometry or there are no points; what was known then stays.
  void Set(int id, const std::string& name, const ImageGeometry& truth, std::vector<Eigen::Vector3d> points);
  void Clear() { volumes_.clear(); }
  bool Empty() const { return volumes_.empty(); }
  bool Has(int id) const { return volumes_.count(id) != 0; }

  /// \a aligned: where each volume lies now; volumes without truth are left out. \a fixed: the id of the volume on which both
  /// agree. The figures are those of ScoreAlignment on the same volumes, to the last bit.
  /// \throws as ScoreAlignment: Error(InvalidParameter) when \a fixed is not among those scored, Error(BadInput) when they are
  /// fewer than two or a geometry does not fit its truth.
  LiveScoreResult Update(const std::map<int, ImageGeometry>& aligned, int fixed) const;

private:
  std::map<int, ScoredVolume> volumes_;
};

/// One attempt at an alignment, as the history across attempts holds it.
struct Attempt {
  std::string time;               ///< ISO 8601, UTC: 2024-05-17T09:30:00Z
  std::string trainee;            ///< may be empty
  std::string project;            ///< what was to be aligned
  double seconds = 0.0;           ///< from the start to the submission
  double scoreMm = 0.0;           ///< mean, dissertation 4.4.2
  double worstMm = 0.0;           ///< the largest score of a volume
  double degrees = 0.0;           ///< mean rotation left
  double startMm = 0.0;           ///< score at the start
  int edits = 0;                  ///< entries of undo between the start and the submission; of a needle, its redirections
  int help = 0;                   ///< how often the program did what was to be done by hand
  double outOfPlaneSeconds = 0.0; ///< of a needle: with its tip in the body and not in the image
};

/// Adds a line to the history, a table (CSV, RFC 4180, UTF-8) with the columns time, trainee, seconds, score_mm, worst_mm,
/// rotation_deg, start_mm, edits, help, out_of_plane_s, project; with a header line when the file is new. A line is whole or not
/// there: what a full disk leaves of it is taken back, and half a line that a crash left at the end is removed by the next one.
/// Programs that append at once wait for each other. It is on the disk when this returns. A table without the columns help and
/// out_of_plane_s, as older versions wrote it, gets them.
/// \throws Error(InvalidParameter) when a number is not finite, Error(FileSystem), Error(BadFile) when the file is something
/// else; it is then left as it was.
void AppendAttempt(const std::string& path, const Attempt& attempt);

/// All attempts, the oldest first; half a line at the end is left out. \throws Error(FileSystem), Error(BadFile) that names file
/// and line.
std::vector<Attempt> ReadAttempts(const std::string& path);

} // namespace echorama
