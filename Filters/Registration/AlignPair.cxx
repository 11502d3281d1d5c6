// SPDX-License-Identifier: BSD-3-Clause
// The candidates of the global search, and the start itself, are refined at a middle level, where that takes some ten
// milliseconds each; so are the best of what a coarse level makes of them. Those that meet are one. The best goes on to the
// finest. They are ranked as a test of correlation would: likeness times the square root of how much is compared. The likeness
// alone prefers chance matches of small overlaps, the sum over the overlap those of large ones.
//
// What is trusted. A measure alone cannot tell: any two volumes have a best pose. So the answer is questioned from four
// sides, each of which sees what the others do not. Overlap and similarity above chance: nothing in common. The next best of
// the different poses: repeated or symmetric structure. The covariance: a motion that changes nothing (a sphere about its
// middle, a slab along itself). Two halves of the voxels, a checkerboard, refined each for itself from the same pose: where
// the match is an accident of the noise, the halves share no optimum and part.
//
// Landmarks are one more witness. Candidates that they contradict are moved, by as little as can be, to where they do not, and
// poses that slide back are dropped: so a repeated structure is told from the next one. But landmarks may be wrong, and then they
// drop the right pose and leave an accident without a rival. So candidates are also refined without them: a pose that they
// contradict may fit about as well as the answer, but not better; and where one does, the automatic start looks everywhere.
//
// The search widens as long as there is no clear answer: the automatic start's to larger cones, and beyond a tracker's cone,
// where little is alike, to more candidates (between ribs, whose shadows look alike at low resolution, the right pose may be the
// fiftieth). Near the start a search costs a few milliseconds, over all rotations some seconds. What is clear already at the
// middle level to be no answer is not refined; nor, while other searches are to come, what is hopeless one level below: there
// right poses are determined to less than a voxel, and accidents, if they are still alike, to many. It is a candidate of the next
// search, so nothing is lost by that but time.
#include "AlignPair.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Core/Sharing/SideBySide.h"
#include "Index.h"
#include "VolumeShape.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {
namespace {

constexpr double HighestRatio = 99.0;
constexpr int MostCandidates = 1000;
constexpr double FinalStop = 2e-5; // voxels: where the answer stops should tell little of the CPU
constexpr double Slack = 1.5;      // how much further from the start than was said an answer may be
constexpr double TrackedDegrees = 12.0, TrackedMm = 20.0, HandMadeDegrees = 35.0;
constexpr int ManyCandidates = 4;   // times as many
constexpr int FewPoints = 4;        // candidates are compared by this many times fewer points than the answer,
constexpr int EnoughPoints = 20000; // but not by fewer than these, if it has as many
constexpr std::size_t Rivals = 3;
constexpr std::size_t Finalists = 5; // of the coarse level
// Less similarity needs a pose that is better determined. Where two bodies have nothing in common but layers that run alike, the
// layers still fit, by a similarity of some 0.1, and what they say nothing of is nearly undetermined (bench of bodies: other
// bodies, mirror images).
constexpr double SureSimilarity = 0.15;
// A pose whose predicted error is larger, in voxels of the level below the middle, is none that would be called aligned: right
// poses have 0.1 to 0.8 there, those of accidents 3 to 60 (phantom, bodies, liver; overlaps of 25 to 75%).
constexpr double HopelessVoxels = 2.5;
// More candidates can help where the best are less alike than this; what is alike and yet not unique they do not tell apart.
constexpr double WeakSimilarity = 2.0 * SureSimilarity;

std::string Number(double value, int digits)
{
  return Format("%.*f", digits, value);
}

// The motion that is least determined, in words.
std::string LeastDetermined(const Information& covariance, double radius)
{
  Information scaled = covariance; // rotations by what they move at the rim
  scaled.rightCols<3>() *= radius;
  scaled.bottomRows<3>() *= radius;
  const SymmetricEigen eigen = EigenOfSymmetric(scaled);
  const Eigen::Matrix<double, 6, 1> worst = eigen.vectors.col(5);
  const bool turns = worst.tail<3>().norm() > worst.head<3>().norm();
  const Eigen::Vector3d axis = (turns ? worst.tail<3>() : worst.head<3>()).normalized();
  return Format("%s the direction (%.2f, %.2f, %.2f)", turns ? "a turn about" : "a move along", axis.x(), axis.y(), axis.z());
}

// One search: how far around the start, and how many of its candidates are refined.
struct Stage {
  double coneDegrees, reachMm;
  int candidates;
  double costs;            // share of the time of all, about
  bool onlyIfWeak = false; // skipped when what was found before is alike
};

class Pair {
public:
  Pair(const PlacedVolume& fixed, const MetricPyramid& fixedFeatures, const PlacedVolume& moving,
       const MetricPyramid& movingFeatures, const AlignPairParameters& p)
    : fixed_(fixed), moving_(moving), fixedFeatures_(fixedFeatures), movingFeatures_(movingFeatures), p_(p), shape_(moving),
      fixedShape_(fixed)
  {
    const auto finest = [](const PlacedVolume& v) { return std::cbrt(v.pyramid->front().geometry.spacing.prod()); };
    finestMm_ = std::max({p.finestMm, finest(fixed), finest(moving)});
    // Coarse: some 32 voxels along the smaller of both; never finer than what there is.
    coarseMm_ = std::max(finestMm_, std::min(shape_.extent, fixedShape_.extent) / 32.0);
    middleMm_ = std::max(finestMm_, 0.5 * coarseMm_);
    landmarks_ = LandmarkTerm(PairLandmarks(fixed.landmarks, fixed.name, moving.landmarks, moving.name), fixed.volumeToWorld,
                              p.landmarkSigmaMm);
  }

  /// The searches, one after the other until there is a clear answer. A later one sees what an earlier one has seen.
  std::vector<Stage> Stages() const
  {
    const int many = std::min(ManyCandidates * p_.candidates, MostCandidates);
    const double handMadeMm = std::max(shape_.extent, fixedShape_.extent) / 3.0;
    const Stage tracked{TrackedDegrees, TrackedMm, p_.candidates, 0.05},
        handMade{HandMadeDegrees, handMadeMm, p_.candidates, 0.1}, closer{HandMadeDegrees, handMadeMm, many, 0.2, true},
        unknown{180.0, std::numeric_limits<double>::infinity(), many, 0.75};
    switch (p_.start) {
    case AlignStart::Tracked:
      return {tracked};
    case AlignStart::HandMade:
      return {handMade, closer};
    case AlignStart::Unknown:
      return {unknown};
    default:
      return {tracked, handMade, closer, unknown};
    }
  }

  /// \param isLast whether nobody will search further, so that a doubtful answer is worth its refinement
  PairAlignment Align(const Stage& stage, bool isLast, const Progress& progress)
  {
    PairAlignment result;
    // Whether the true pose is said to lie in the cone and reach: what slides out of them is no answer.
    const bool isKnown = p_.start != AlignStart::Automatic;
    largestTurn_ = isKnown ? Slack * stage.coneDegrees * EIGEN_PI / 180.0 : HUGE_VAL;
    largestMoveMm_ = isKnown ? Slack * stage.reachMm : HUGE_VAL;
    result.volumeToWorld = moving_.volumeToWorld;
    result.anywhere = stage.coneDegrees >= 180.0;
    PlacedVolume from = moving_;
    from.volumeToWorld = Reconciled(moving_.volumeToWorld);
    if (!landmarks_.Agrees(from.volumeToWorld)) {
      result.reason = "the landmarks contradict each other: where they fit best, " + landmarks_.Worst(from.volumeToWorld);
      return result;
    }
    if (!IsNearStart(from.volumeToWorld)) {
      result.reason = "the landmarks are further from each other at the start than the start is said to be from the truth";
      return result;
    }

    // 1. where it could be
    Clock::time_point start = Clock::now();
    GlobalSearchParameters global;
    global.coneDegrees = stage.coneDegrees;
    global.reachMm = stage.reachMm;
    global.minimumOverlap = p_.minimumOverlap;
    global.candidates = stage.candidates;
    std::vector<Pose> poses{from.volumeToWorld}, free{moving_.volumeToWorld}; // with and without the landmarks
    poses.insert(poses.end(), refused_.begin(), refused_.end());
    const auto search = [&](const PlacedVolume& moving, const Progress& part) {
      for (const GlobalCandidate& candidate : GlobalSearch(fixed_, moving, global, part).candidates) {
        free.push_back(candidate.volumeToWorld);
        if (const Pose pose = Reconciled(candidate.volumeToWorld); landmarks_.Empty() || IsNew(pose, poses))
          poses.push_back(pose);
      }
    };
    search(from, progress.Part(0.0, 0.6));
    if (from.volumeToWorld.matrix() != moving_.volumeToWorld.matrix() && !result.anywhere)
      search(moving_, progress.Part(0.6, 0.6));
    result.globalSeconds = SecondsSince(start);

    // 2. refined, at the middle level: at the coarse one the layers alongside the face weigh most, and poses slide along them.
    // But from there what is sparse is found from farther away, so the best of it are tried beside the others; and beside a
    // tracker's start alone, where it keeps a rig that can turn about an axis nearer to where the tracker has it.
    start = Clock::now();
    std::vector<LocalAlignResult> found = Refine(poses, 0.0, coarseMm_, progress.Part(0.6, 0.65));
    if (p_.start == AlignStart::Tracked)
      poses.clear();
    for (std::size_t i = 0; i < std::min<std::size_t>(Finalists, found.size()); ++i)
      poses.push_back(found[i].volumeToWorld);
    found = Refine(poses, middleMm_, middleMm_, progress.Part(0.65, 0.8));
    if (found.empty()) {
      result.reason = "no pose was found " + std::string(isKnown && !result.anywhere ? "near the start " : "") +
                      "in which they overlap by " + Number(100.0 * p_.minimumOverlap, 0) + "% of the smaller one" +
                      (landmarks_.Empty() ? "" : " and agree with the landmarks");
      return result;
    }
    const double rival = landmarks_.Empty() ? 0.0 : Contradicting(free, progress.Part(0.8, 0.8)), own = Evidence(found.front());
    landmarksDecide_ = rival * p_.minimumPeakRatio > own;
    if (rival > p_.minimumPeakRatio * own) {
      result.reason = "the images agree better in a pose that the landmarks contradict";
      return result;
    }

    // What this level cannot tell apart a finer one may.
    double middleMm = middleMm_;
    while (Ratio(found) < p_.minimumPeakRatio && middleMm > finestMm_) {
      const double finerMm = std::max(finestMm_, 0.5 * middleMm);
      poses.clear();
      for (std::size_t i = 0; i < std::min<std::size_t>(Rivals, found.size()); ++i)
        poses.push_back(found[i].volumeToWorld);
      std::vector<LocalAlignResult> closer = Refine(poses, middleMm, finerMm, progress.Part(0.8, 0.8));
      if (closer.empty())
        break;
      found = std::move(closer);
      middleMm = finerMm;
    }
    result.peakRatio = Ratio(found);
    isLast |= p_.start == AlignStart::HandMade && found.front().similarity >= WeakSimilarity;
    if (!isLast && (result.peakRatio < p_.minimumPeakRatio || found.front().similarity < p_.minimumSimilarity)) {
      result.similarity = found.front().similarity;
      result.localSeconds = SecondsSince(start);
      return result;
    }
    const double closerMm = std::max(finestMm_, 0.5 * middleMm);
    if (closerMm > finestMm_) {
      const LocalAlignResult closer = Local(found.front().volumeToWorld, middleMm, closerMm, FewerPoints(), 0, {}, true);
      if (!isLast && ErrorOf(closer) > HopelessVoxels * closer.voxelMm) {
        refused_.push_back(found.front().volumeToWorld);
        result.similarity = closer.similarity;
        result.localSeconds = SecondsSince(start);
        return result;
      }
      found.front() = closer;
    }
    const LocalAlignResult best =
        Local(found.front().volumeToWorld, closerMm, finestMm_, p_.points, 0, progress.Part(0.8, 0.9), true);
    result.localSeconds = SecondsSince(start);
    if (!landmarks_.Agrees(best.volumeToWorld)) {
      result.reason = "the pose that fits best contradicts the landmarks: " + landmarks_.Worst(best.volumeToWorld);
      return result;
    }
    if (!IsNearStart(best.volumeToWorld)) {
      result.reason = "the pose that fits best is not near the start";
      return result;
    }

    // 3. what that is worth
    start = Clock::now();
    result.volumeToWorld = best.volumeToWorld;
    result.similarity = best.similarity;
    result.overlap = best.overlap;
    result.score = best.score;
    result.voxelMm = best.voxelMm;
    result.centre = best.centre;
    result.information = best.information;
    const Information covariance = CovarianceOf(best.information, shape_.radius);
    result.errorMm = ErrorOf(best);
    std::array<Pose, 2> halves;
    SideBySide(2, progress.Part(0.9, 1.0), [&](std::ptrdiff_t half, const Progress& part) {
      halves[Index(half)] =
          Local(best.volumeToWorld, closerMm, finestMm_, p_.points, static_cast<int>(half) + 1, part).volumeToWorld;
    });
    result.splitMm = shape_.Distance(halves[0], halves[1]);
    Judge(p_, covariance, shape_.radius, result);
    result.confidenceSeconds = SecondsSince(start);
    return result;
  }

  /// Whether without the landmarks a different pose would have done as well.
  bool LandmarksDecide() const { return landmarksDecide_; }

private:
  LocalAlignResult Local(const Pose& start, double coarsestMm, double finestMm, int points, int part, const Progress& progress,
                         bool isAnswer = false) const
  {
    LocalAlignParameters local;
    local.coarsestMm = coarsestMm;
    local.finestMm = finestMm;
    local.points = points;
    local.minimumOverlap = 0.5 * p_.minimumOverlap;
    local.part = part;
    local.withInformation = isAnswer;
    if (isAnswer)
      local.stopVoxels = FinalStop;
    local.seed = p_.seed;
    local.landmarks = landmarks_;
    return LocalAlign(fixedFeatures_, fixed_.volumeToWorld, movingFeatures_, Rounded(start), local, progress);
  }

  int FewerPoints() const { return std::min(p_.points, std::max(p_.points / FewPoints, EnoughPoints)); }

  // The predicted root mean square error over the moving volume, mm.
  double ErrorOf(const LocalAlignResult& found) const
  {
    return shape_.Error(CovarianceOf(found.information, shape_.radius), found.centre, found.volumeToWorld);
  }

  // To a thousandth of a voxel. The last bits of what an earlier step found depend on the CPU, and would choose other points to
  // compare and so end elsewhere. A quaternion and its negative, the same rotation, are rounded to the same rotation.
  Pose Rounded(const Pose& pose) const
  {
    const double mm = 1e-3 * finestMm_, part = 0.5 * mm / std::max(shape_.radius, finestMm_);
    const auto toMultiple = [](double step) { return [step](double x) { return step * std::round(x / step); }; };
    const Eigen::Vector3d middle = (pose * shape_.centroid).unaryExpr(toMultiple(mm));
    const Eigen::Vector4d turn = Eigen::Quaterniond(pose.linear()).coeffs().unaryExpr(toMultiple(part));
    Pose rounded = Pose::Identity();
    rounded.linear() = Eigen::Quaterniond(turn).normalized().toRotationMatrix();
    rounded.translation() = middle - rounded.linear() * shape_.centroid;
    return rounded;
  }

  // How much speaks for a pose, as a test of correlation weighs it: the likeness times the square root of how much is compared.
  static double Evidence(const LocalAlignResult& found) { return found.similarity * std::sqrt(found.overlap); }

  // Whether a pose is as near the start as that is known.
  bool IsNearStart(const Pose& pose) const
  {
    const Pose& start = moving_.volumeToWorld;
    return RotationAngle(pose * start.inverse()) <= largestTurn_ &&
           (pose * shape_.centroid - start * shape_.centroid).norm() <= largestMoveMm_;
  }

  // The nearest pose that the landmarks do not contradict.
  Pose Reconciled(const Pose& pose) const { return landmarks_.Agrees(pose) ? pose : landmarks_.Nearest(pose); }

  // The most evidence for a pose that the landmarks contradict.
  double Contradicting(const std::vector<Pose>& poses, const Progress& progress)
  {
    LandmarkTerm landmarks;
    std::swap(landmarks, landmarks_);
    const std::vector<LocalAlignResult> found = Refine(poses, middleMm_, middleMm_, progress);
    std::swap(landmarks, landmarks_);
    for (const LocalAlignResult& one : found) // the best first
      if (!landmarks_.Agrees(one.volumeToWorld, 0.5 * one.voxelMm))
        return Evidence(one);
    return 0.0;
  }

  bool IsNew(const Pose& pose, const std::vector<Pose>& others) const
  {
    return std::none_of(others.begin(), others.end(),
                        [&](const Pose& other) { return shape_.Distance(pose, other) < coarseMm_; });
  }

  // Refines the poses and keeps those that are different, overlap, are near the start and agree with the landmarks, the best
  // first.
  std::vector<LocalAlignResult> Refine(const std::vector<Pose>& poses, double coarsestMm, double finestMm,
                                       const Progress& progress) const
  {
    std::vector<LocalAlignResult> all(poses.size()), different;
    SideBySide(static_cast<std::ptrdiff_t>(poses.size()), progress, [&](std::ptrdiff_t i, const Progress& part) {
      all[Index(i)] = Local(poses[Index(i)], coarsestMm, finestMm, FewerPoints(), 0, part);
    });
    std::stable_sort(all.begin(), all.end(),
                     [](const LocalAlignResult& a, const LocalAlignResult& b) { return Evidence(a) > Evidence(b); });
    for (const LocalAlignResult& one : all)
      if (one.overlap >= p_.minimumOverlap && IsNearStart(one.volumeToWorld) &&
          landmarks_.Agrees(one.volumeToWorld, 0.5 * one.voxelMm) &&
          std::none_of(different.begin(), different.end(), [&](const LocalAlignResult& other) {
            return shape_.Distance(one.volumeToWorld, other.volumeToWorld) < 3.0 * coarseMm_;
          }))
        different.push_back(one);
    return different;
  }

  static double Ratio(const std::vector<LocalAlignResult>& found)
  {
    if (found.size() < 2 || Evidence(found[1]) * HighestRatio <= Evidence(found[0]))
      return HighestRatio;
    return Evidence(found[0]) / Evidence(found[1]);
  }

  const PlacedVolume &fixed_, &moving_;
  const MetricPyramid &fixedFeatures_, &movingFeatures_;
  const AlignPairParameters& p_;
  LandmarkTerm landmarks_;
  bool landmarksDecide_ = false;
  std::vector<Pose> refused_; // hopeless as it seemed, when more searches were to come
  VolumeShape shape_, fixedShape_;
  double finestMm_ = 0.0, coarseMm_ = 0.0, middleMm_ = 0.0;
  double largestTurn_ = HUGE_VAL, largestMoveMm_ = HUGE_VAL; // from the start, radians and mm
};

} // namespace

std::vector<std::string> AlignStartNames()
{
  return {"automatic", "tracked", "hand-made", "unknown"};
}

const char* NameOf(Verdict verdict)
{
  return verdict == Verdict::Aligned ? "aligned" : verdict == Verdict::Ambiguous ? "ambiguous" : "failed";
}

ParameterList Describe(AlignPairParameters& p)
{
  return {
      Parameter("Start", Choice(p.start, AlignStartNames()).ByName(),
                "What is known about where the volumes belong: tracked, within some 12 degrees and 20 mm; hand-made, within some "
                "35 degrees and a third of a volume; unknown, nothing; automatic, one after the other while there is no clear "
                "answer."),
      Parameter("Metric", Choice(p.metric, MetricNames()),
                "The likeness that refines poses: normalised cross-correlation, local or over the whole overlap, the mean "
                "absolute difference, self-similarity descriptors, or local linear correlation of intensity and gradient."),
      Parameter("MinimumOverlap", p.minimumOverlap, {0.01, 1}, "",
                "The share of the smaller volume of a pair that must lie in the other for a pose to count."),
      Parameter("FinestMm", p.finestMm, {0, 1000}, "mm",
                "Refinement ends at voxels not smaller than this; larger is faster and less exact. 0: at the volumes' own."),
      Parameter("Candidates", p.candidates, {1, MostCandidates}, "",
                "Poses of the global search that are refined; four times as many when every rotation is tried, and where fewer "
                "give no clear answer.")
          .Advanced(),
      Parameter("MinimumSimilarity", p.minimumSimilarity, {0, 1}, "",
                "Less similarity in the overlap (1 identical, 0 chance) is failed.")
          .Advanced(),
      Parameter("MinimumPeakRatio", p.minimumPeakRatio, {1, HighestRatio}, "",
                "A smaller ratio of the best evidence to that of the next different pose is ambiguous.")
          .Advanced(),
      Parameter(
          "MaximumErrorVoxels", p.maximumErrorVoxels, {1e-3, 1000}, "voxels",
          "A larger predicted error is ambiguous; where volumes are hardly alike (similarity below 0.15), in proportion less.")
          .Advanced(),
      Parameter("MaximumErrorMm", p.maximumErrorMm, {1e-3, 1000}, "mm",
                "A larger predicted error is ambiguous, too, whatever the size of the voxels: what your use can bear."),
      Parameter(
          "SoundSpeedError", p.soundSpeedError, {0, 0.2}, "",
          "How far the speed of sound in the tissue may be from what the scanner takes it for, as a share. A volume may be off "
          "by this share of its distance from the fixed one although both show the same: that is added to its error.")
          .Advanced(),
      Parameter("MaximumSplitVoxels", p.maximumSplitVoxels, {1e-3, 1000}, "voxels",
                "Poses found from two halves of the voxels that lie further apart are failed.")
          .Advanced(),
      Parameter("LandmarkSigmaMm", p.landmarkSigmaMm, {1e-3, 1000}, "mm",
                "How exactly landmarks were found: the standard deviation of the difference between the two points of one, along "
                "each axis. Poses in which they differ by more than chance would have it are no answers."),
      Parameter("Points", p.points, ComparedPoints, "", "Random points of each volume that are compared on each level.")
          .Advanced(),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "The same seed draws the same points.").Advanced(),
  };
}

Information CovarianceOf(const Information& information, double radiusMm)
{
  // In units in which a rotation moves the rim as far as a translation does, so that one bound serves both.
  constexpr double FarMm = 1e6;
  Eigen::Matrix<double, 6, 1> unit;
  unit << 1.0, 1.0, 1.0, radiusMm, radiusMm, radiusMm;
  Information scaled = unit.cwiseInverse().asDiagonal() * information * unit.cwiseInverse().asDiagonal();
  if (!scaled.allFinite())
    scaled.setZero(); // nothing is known
  scaled = 0.5 * (scaled + scaled.transpose()).eval();
  const SymmetricEigen eigen = EigenOfSymmetric(scaled);
  const Eigen::Matrix<double, 6, 1> variances = eigen.values.cwiseMax(1.0 / (FarMm * FarMm)).cwiseInverse();
  return unit.cwiseInverse().asDiagonal() * eigen.vectors * variances.asDiagonal() * eigen.vectors.transpose() *
         unit.cwiseInverse().asDiagonal();
}

void Judge(const AlignPairParameters& p, const Information& covariance, double radiusMm, PairAlignment& result)
{
  const double voxel = result.voxelMm;
  result.reason.clear();
  if (result.overlap < p.minimumOverlap) {
    result.verdict = Verdict::Failed;
    result.reason = "they overlap by only " + Number(100.0 * result.overlap, 0) + "% of the smaller one";
  } else if (!(result.similarity >= p.minimumSimilarity)) {
    result.verdict = Verdict::Failed;
    result.reason = "even at the best pose the volumes are hardly more similar than by chance (similarity " +
                    Number(result.similarity, 3) + ")";
  } else if (result.errorMm > p.maximumErrorVoxels * voxel * std::min(1.0, result.similarity / SureSimilarity)) {
    result.verdict = Verdict::Ambiguous;
    result.reason = "the image contents do not determine the pose (predicted error " +
                    Number(std::min(result.errorMm, 999.0), 1) + " mm); the least certain motion is " +
                    LeastDetermined(covariance, radiusMm);
  } else if (result.errorMm > p.maximumErrorMm) {
    result.verdict = Verdict::Ambiguous;
    result.reason = "the predicted error is " + Number(result.errorMm, 2) + " mm, and at most " + Number(p.maximumErrorMm, 2) +
                    " mm are accepted";
  } else if (result.splitMm > p.maximumSplitVoxels * voxel) {
    result.verdict = Verdict::Failed;
    result.reason = "aligning two halves of the voxels separately gives poses " + Number(result.splitMm, 1) + " mm apart";
  } else if (result.peakRatio < p.minimumPeakRatio) {
    result.verdict = Verdict::Ambiguous;
    result.reason = "a different pose fits nearly as well (ratio " + Number(result.peakRatio, 2) + ")";
  } else {
    result.verdict = Verdict::Aligned;
  }
}

PairAlignment AlignPair(const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures,
                        const PlacedVolume& moving, const std::shared_ptr<const MetricPyramid>& movingFeatures,
                        const AlignPairParameters& p, const Progress& progress)
{
  CheckRanges(p);
  Pair pair(fixed, *fixedFeatures, moving, *movingFeatures, p);
  const std::vector<Stage> stages = pair.Stages();
  double all = 0.0, done = 0.0;
  for (const Stage& stage : stages)
    all += stage.costs;
  PairAlignment result;
  for (const Stage& stage : stages) {
    const double end = done + stage.costs / all;
    if (stage.onlyIfWeak && result.similarity >= WeakSimilarity)
      continue;
    PairAlignment found = pair.Align(stage, &stage == &stages.back(), progress.Part(done, end));
    done = end;
    found.globalSeconds += result.globalSeconds;
    found.localSeconds += result.localSeconds;
    found.confidenceSeconds += result.confidenceSeconds;
    result = found;
    if (result.verdict == Verdict::Aligned && !pair.LandmarksDecide())
      break;
  }
  return result;
}

} // namespace echorama
