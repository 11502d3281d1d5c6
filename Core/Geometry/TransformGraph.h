// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace echorama {

/// What is known of a transform at one moment.
enum class TransformStatus {
  Valid,
  Missing,    ///< nothing was measured: the matrix means nothing
  OutOfRange, ///< the tracker saw it at the border of its field or beyond: the matrix is not to be trusted
};

/// The status behind a word of Plus's files, in any case: OK; OUT_OF_VIEW and OUT_OF_VOLUME; any other word (INVALID, MISSING,
/// REQ_TIMEOUT, UNKNOWN ...) says that there is no measurement. Old files write TOOL_ before the word.
TransformStatus TransformStatusOf(std::string_view word);

/// "OK", "MISSING" or "OUT_OF_VIEW".
const char* TransformStatusText(TransformStatus status);

/// An edge: maps coordinates of the frame \a from to those of the frame \a to. Affine: a frame "Image" counts pixels.
struct NamedTransform {
  std::string from, to;
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  TransformStatus status = TransformStatus::Valid;
  std::optional<double> errorMm; ///< of the calibration, as its maker stated it
  std::string date;              ///< as its maker stated it

  /// "ImageToProbe"
  std::string Name() const { return from + "To" + to; }
  /// What is wrong with it, as a sentence; empty when nothing is: two different frames whose names are not empty and hold no
  /// blanks, a matrix that is affine and, when the status is Valid, finite, an error that is not negative.
  std::string Complaint() const;
};

/// "ImageToProbe" or "ImageToProbeTransform" as its two frames; nothing when the text is not such a name.
///
/// The rule is that of Plus: the name is cut at a "To" that no lower-case letter follows, and there must be just one. So
/// "TorsoToTorsoRef", "StylusTipToStylus" and "TestToolToTracker" are names, "AToBToC" is none. The first letter of a frame
/// is made a capital.
std::optional<std::pair<std::string, std::string>> FramesOf(std::string_view name);

/// Several edges in a row.
struct ComposedTransform {
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  TransformStatus status = TransformStatus::Valid; ///< the worst along the way; Missing is worse than OutOfRange
  /// Root of the sum of the squares of the edges' errors, as for independent ones; nothing when no edge states one. How far
  /// an error of rotation reaches along the way is not in it: the files do not tell rotation from translation.
  std::optional<double> errorMm;
  bool errorIsComplete = false;  ///< every edge states its error; else those without count as exact
  std::vector<std::string> path; ///< "ImageToProbe", "inverse of ReferenceToTracker" ...; empty from a frame to itself

  /// The path for people: "ImageToProbe, ProbeToTracker, inverse of ReferenceToTracker".
  std::string PathText() const;
};

/// Two ways between the same frames that do not agree.
struct OpenCycle {
  std::vector<std::string> edges; ///< names in order of travel, "inverse of ..." where an edge is walked backwards
  std::string frame;              ///< where it was measured: the frame of the cycle with the largest unit (mm, not pixels)
  double mm = 0.0, degrees = 0.0; ///< how far from closing it is; see CycleTolerance
  std::string Text() const;       ///< a sentence that names it
};

/// When a cycle counts as closed. The product of its edges moves points that lie within the lever arm of the frame's origin
/// by at most \a mm and turns by at most \a degrees. The defaults lie far above the rounding of files with six digits and far
/// below what a wrong calibration does.
struct CycleTolerance {
  double mm = 0.1, degrees = 0.1;
  double leverMm = 100.0;
};

/// Named transforms, and whatever follows from them by composition and inversion.
///
/// A frame is a node, a NamedTransform an edge. A pair of frames may have an edge in either direction. Edges with a singular
/// matrix cannot be walked backwards. Nothing is cached: a path takes microseconds.
class TransformGraph {
public:
  TransformGraph() = default;
  explicit TransformGraph(const std::vector<NamedTransform>& edges);

  /// Adds an edge, or replaces the one of the same name. \throws Error(BadInput) with its Complaint().
  void Set(const NamedTransform& edge);

  /// The way from \a from to \a to with the fewest edges; of several, the one whose frames come first in the order of bytes; of
  /// two edges between the same frames, the one that is Valid, else the one that points along the way. Beyond that status
  /// plays no role, so that the frames of the way are the same from moment to moment. An edge that is not Valid and whose matrix
  /// is singular gives NaN when walked backwards. \throws Error(BadInput) when a frame is unknown, Error(NotPossible) when no way
  /// leads there; both say what there is.
  ComposedTransform Find(const std::string& from, const std::string& to) const;

  /// The cycles that do not close: one for each edge beyond a spanning tree of fewest edges. Edges that are not Valid or
  /// that cannot be inverted are left out. The time may grow with the square of the edges: 0.1 s for 1000.
  std::vector<OpenCycle> CheckCycles(const CycleTolerance& tolerance = {}) const;

  bool Empty() const { return edges_.empty(); }
  std::vector<std::string> Frames() const; ///< in the order of bytes
  std::vector<NamedTransform> Edges() const;
  /// The frames that a way leads to from \a frame, itself left out.
  std::vector<std::string> ReachableFrom(const std::string& frame) const;
  const NamedTransform* Edge(const std::string& from, const std::string& to) const; ///< null when there is no such edge

private:
  struct Step { // along one edge, or against it
    const NamedTransform* edge = nullptr;
    bool inverse = false;
    const std::string& From() const { return inverse ? edge->to : edge->from; }
    std::string Name() const;
    Eigen::Affine3d Matrix() const;
  };
  std::vector<Step> StepsFrom(const std::string& frame, bool trustedOnly) const;
  std::map<std::string, Step> Tree(const std::string& root, bool trustedOnly) const;
  static std::vector<Step> Way(const std::map<std::string, Step>& tree, std::string to);

  std::map<std::pair<std::string, std::string>, NamedTransform> edges_;
  std::map<std::string, std::set<std::string>> neighbours_; // either way
};

} // namespace echorama
