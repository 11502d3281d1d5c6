// SPDX-License-Identifier: BSD-3-Clause
// What a metric sees of a volume is made once and serves all its pairs. Pairs are aligned one after the other; each uses all
// threads itself. Then the pose graph votes.
//
// A wrong pair is not lost: once its volumes are placed by others it is aligned again from there, and then it is right and
// adds to what is known. The same goes for pairs that failed from a bad start, and for those that nobody had thought to
// overlap. That round is cheap, because the start is then as good as a tracker's.
//
// Cost: pairs times AlignPair. Which pairs overlap costs next to nothing (OverlappingPairs).
#include "AlignVolumes.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedSets.h"
#include "Index.h"
#include "OverlappingPairs.h"
#include "PoseGraph.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>

namespace echorama {
namespace {

constexpr int EnoughPairs = 3; // a volume with fewer overlaps at the start is also paired with those farther off
constexpr int FarTries = 3;    // searches over all rotations for one volume
constexpr double TrackedReachMm = 20.0;

using Features = std::shared_ptr<const MetricPyramid>;
using Numbers = std::pair<int, int>; // of two volumes, the one that stays first

std::string Millimetres(double mm)
{
  char text[64];
  std::snprintf(text, sizeof text, "%.1f mm", mm);
  return text;
}

// A motion's information in other axes.
Information Turned(const Information& information, const Eigen::Matrix3d& rotation)
{
  Information turn = Information::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = rotation;
  return turn * information * turn.transpose();
}

class Alignment {
public:
  Alignment(const std::vector<PlacedVolume>& volumes, int fixed, const AlignVolumesParameters& p, const PairAligner& aligner)
    : volumes_(volumes), fixed_(fixed), p_(p), aligner_(aligner), features_(volumes.size()), troubles_(volumes.size()),
      held_(volumes.size(), false)
  {
    held_[Index(fixed)] = true;
    for (const int v : p.held)
      held_[Index(v)] = true;
  }

  AlignVolumesResult Run(const Progress& progress);

private:
  // What a pair found, seen from its fixed volume.
  struct Attempt {
    PairOfVolumes pair;
    PoseEdge edge;
    bool votedDown = false, contested = false, stands = false;
    double residualMm = 0.0; // when it was voted down
  };

  int Count() const { return static_cast<int>(volumes_.size()); }
  bool CanBeAligned(int v) const { return features_[Index(v)] != nullptr; }
  std::string NameOfPair(const Numbers& pair) const
  {
    return volumes_[Index(pair.first)].name + " and " + volumes_[Index(pair.second)].name;
  }
  bool IsHeld(int v) const { return held_[Index(v)]; } // the fixed one too
  bool IsPair(int a, int b) const { return CanBeAligned(a) && CanBeAligned(b) && !(IsHeld(a) && IsHeld(b)); }
  Numbers Ordered(int a, int b) const { return IsHeld(b) || (!IsHeld(a) && b < a) ? Numbers(b, a) : Numbers(a, b); }

  void BuildFeatures(const Progress& progress);
  std::vector<Numbers> PairsAt(const std::vector<Pose>& poses, double reachMm) const;
  std::vector<Numbers> PairsWithLandmarks() const;
  void Try(const Numbers& pair, AlignStart start, const std::vector<Pose>& poses, const Progress& progress);
  void TryAll(const std::vector<Numbers>& pairs, AlignStart start, const std::vector<Pose>& poses, const Progress& progress);
  void Solve(const Progress& progress);
  PoseEdge AsSeenFromFixed(PoseEdge edge) const;
  void FindTheLost(const Progress& progress);
  std::vector<Numbers> PairsToTryAgain() const;
  AlignVolumesResult Report() const;
  std::vector<bool> JoinedByClearPairs() const;
  void StateErrors(AlignVolumesResult& result) const;
  std::string WhyDoubtful(int v) const;
  std::string WhyFailed(int v) const;

  const std::vector<PlacedVolume>& volumes_;
  const int fixed_;
  const AlignVolumesParameters& p_;
  const PairAligner& aligner_;
  std::vector<Features> features_;
  std::vector<std::string> troubles_; // why a volume cannot be aligned
  std::vector<bool> held_;
  std::vector<VolumeOutline> outlines_;
  std::map<Numbers, Attempt> attempts_;
  std::vector<Numbers> edges_; // of the graph, as last solved
  PoseGraphResult graph_;
  double featureSeconds_ = 0.0, pairSeconds_ = 0.0, graphSeconds_ = 0.0;
};

void Alignment::BuildFeatures(const Progress& progress)
{
  const Clock::time_point start = Clock::now();
  int good = 0;
  std::optional<Error> trouble;
  for (int v = 0; v < Count(); ++v) {
    try {
      features_[Index(v)] = BuildMetricPyramid(volumes_[Index(v)], p_.pair.metric,
                                               progress.Part(static_cast<double>(v) / Count(), (v + 1.0) / Count()));
      ++good;
    } catch (const Error& error) {
      if (error.GetKind() != Error::Kind::BadInput || v == fixed_)
        throw;
      troubles_[Index(v)] = error.what();
      trouble = error;
    }
  }
  if (good < 2)
    throw *trouble;
  for (int v = 0; v < Count(); ++v)
    outlines_.emplace_back(volumes_[Index(v)]);
  featureSeconds_ = SecondsSince(start);
}

// For each volume those it overlaps most; where these are few, those too that it would overlap if it were closer.
std::vector<Numbers> Alignment::PairsAt(const std::vector<Pose>& poses, double reachMm) const
{
  using Ranked = std::pair<double, Numbers>; // minus the overlap
  std::vector<std::vector<Ranked>> near(volumes_.size()), far(volumes_.size());
  for (const OverlappingPair& pair :
       OverlappingPairs(outlines_, poses, reachMm, p_.pair.minimumOverlap, [this](int a, int b) { return IsPair(a, b); }))
    for (const int v : {pair.a, pair.b})
      (pair.isFar ? far : near)[Index(v)].push_back({-pair.overlap, Ordered(pair.a, pair.b)});
  std::vector<Numbers> pairs;
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    std::sort(near[v].begin(), near[v].end());
    std::sort(far[v].begin(), far[v].end());
    near[v].resize(std::min(near[v].size(), Index(p_.pairsPerVolume)));
    for (const Ranked& ranked : far[v])
      if (near[v].size() < Index(std::min(EnoughPairs, p_.pairsPerVolume)))
        near[v].push_back(ranked);
    for (const Ranked& ranked : near[v])
      pairs.push_back(ranked.second);
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

// Those in which one place was found twice: they overlap, however far apart they are.
std::vector<Numbers> Alignment::PairsWithLandmarks() const
{
  std::vector<Numbers> pairs;
  for (int a = 0; a < Count(); ++a)
    for (int b = a + 1; b < Count() && !volumes_[Index(a)].landmarks.empty(); ++b)
      if (IsPair(a, b) && !volumes_[Index(b)].landmarks.empty() &&
          !PairLandmarks(volumes_[Index(a)].landmarks, {}, volumes_[Index(b)].landmarks, {}).empty())
        pairs.push_back(Ordered(a, b));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

void Alignment::Try(const Numbers& numbers, AlignStart start, const std::vector<Pose>& poses, const Progress& progress)
{
  const Clock::time_point clock = Clock::now();
  const auto a = Index(numbers.first), b = Index(numbers.second);
  PlacedVolume first = volumes_[a], second = volumes_[b];
  first.volumeToWorld = poses[a];
  second.volumeToWorld = poses[b];
  AlignPairParameters parameters = p_.pair;
  parameters.start = start;
  PairAlignment found;
  try {
    found = aligner_(first, features_[a], second, features_[b], parameters, progress);
  } catch (const Error& error) {
    if (Count() == 2 || (error.GetKind() != Error::Kind::BadInput && error.GetKind() != Error::Kind::NotPossible))
      throw;
    found.volumeToWorld = second.volumeToWorld;
    found.reason = error.what();
  }
  Attempt& attempt = attempts_[numbers];
  attempt.pair.fixed = numbers.first;
  attempt.pair.moving = numbers.second;
  ++attempt.pair.attempts;
  // An answer that does not stand is replaced by any other that may; one that does is only replaced by a surer one.
  if (attempt.pair.attempts == 1 || !attempt.stands || found.verdict < attempt.pair.alignment.verdict) {
    attempt.pair.alignment = found;
    const Pose back = poses[a].inverse(Eigen::Isometry);
    attempt.edge.from = numbers.first;
    attempt.edge.to = numbers.second;
    attempt.edge.toInFrom = back * found.volumeToWorld;
    attempt.edge.toInFrom.linear() = Eigen::Quaterniond(attempt.edge.toInFrom.linear()).normalized().toRotationMatrix();
    attempt.edge.centre = back * found.centre;
    attempt.edge.information = Turned(found.information, back.linear());
    attempt.edge.verified = found.verdict == Verdict::Aligned;
  }
  pairSeconds_ += SecondsSince(clock);
}

void Alignment::TryAll(const std::vector<Numbers>& pairs, AlignStart start, const std::vector<Pose>& poses,
                       const Progress& progress)
{
  for (std::size_t i = 0; i < pairs.size(); ++i)
    Try(pairs[i], start, poses,
        progress.Part(static_cast<double>(i) / static_cast<double>(pairs.size()),
                      static_cast<double>(i + 1) / static_cast<double>(pairs.size())));
  progress(1.0);
}

void Alignment::Solve(const Progress& progress)
{
  const Clock::time_point clock = Clock::now();
  std::vector<Pose> start;
  for (const PlacedVolume& volume : volumes_)
    start.push_back(volume.volumeToWorld);
  std::vector<PoseEdge> edges;
  edges_.clear();
  std::vector<double> voxels;
  for (const auto& [numbers, attempt] : attempts_)
    if (attempt.pair.alignment.verdict != Verdict::Failed) {
      edges_.push_back(numbers);
      edges.push_back(AsSeenFromFixed(attempt.edge));
      voxels.push_back(attempt.pair.alignment.voxelMm);
    }
  PoseGraphParameters graph;
  graph.seed = p_.seed;
  graph.outlierSigmas = p_.outlierSigmas;
  if (!voxels.empty()) {
    std::sort(voxels.begin(), voxels.end());
    const double voxelMm = voxels[voxels.size() / 2];
    graph.floorMm = std::min(100.0, p_.floorVoxels * voxelMm);
    graph.outlierMm = std::min(1000.0, p_.outlierVoxels * voxelMm);
  }
  double radius = 0.0;
  for (const VolumeOutline& outline : outlines_)
    radius += outline.shape.radius / Count();
  graph.radiusMm = std::clamp(radius, 1.0, 10000.0);
  graph_ = SolvePoseGraph(start, edges, fixed_, graph, progress);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    Attempt& attempt = attempts_[edges_[e]];
    attempt.contested = graph_.isContested[e];
    attempt.stands = !graph_.isWrong[e];
    if (graph_.isWrong[e] && edges[e].verified) {
      attempt.votedDown = true;
      attempt.residualMm = graph_.residualMm[e];
    }
  }
  for (int v = 0; v < Count(); ++v)
    if (IsHeld(v)) {
      graph_.isPlaced[Index(v)] = graph_.isDetermined[Index(v)] = true;
      graph_.information[Index(v)] = Information::Zero();
    }
  graphSeconds_ += SecondsSince(clock);
}

// The volumes that are held are one body with the fixed one: what was measured against them was measured against it.
PoseEdge Alignment::AsSeenFromFixed(PoseEdge edge) const
{
  if (edge.from != fixed_ && IsHeld(edge.from)) {
    const Pose way = volumes_[Index(fixed_)].volumeToWorld.inverse(Eigen::Isometry) * volumes_[Index(edge.from)].volumeToWorld;
    edge.from = fixed_;
    edge.toInFrom = way * edge.toInFrom;
    edge.centre = way * edge.centre;
    edge.information = Turned(edge.information, way.linear());
  }
  return edge;
}

// Volumes that are not placed are looked for in any rotation beside those that are.
void Alignment::FindTheLost(const Progress& progress)
{
  for (int v = 0; v < Count(); ++v) {
    if (graph_.isPlaced[Index(v)] || !CanBeAligned(v))
      continue;
    std::vector<std::pair<double, int>> others; // by distance
    for (int other = 0; other < Count(); ++other)
      if (graph_.isPlaced[Index(other)] && CanBeAligned(other))
        others.push_back({(graph_.volumeToWorld[Index(other)] * outlines_[Index(other)].shape.centroid -
                           graph_.volumeToWorld[Index(v)] * outlines_[Index(v)].shape.centroid)
                              .norm(),
                          other});
    std::sort(others.begin(), others.end());
    bool isFound = false;
    for (std::size_t i = 0; i < std::min(others.size(), Index(FarTries)) && !isFound; ++i) {
      const Numbers pair = Ordered(v, others[i].second);
      Try(pair, AlignStart::Unknown, graph_.volumeToWorld, progress.Part(static_cast<double>(v) / Count(), (v + 1.0) / Count()));
      isFound = attempts_[pair].pair.alignment.verdict == Verdict::Aligned;
    }
    if (isFound)
      Solve({});
  }
  progress(1.0);
}

// Pairs of placed volumes that overlap there, but were not tried, or do not stand though their volumes are sure to lie there.
std::vector<Numbers> Alignment::PairsToTryAgain() const
{
  std::vector<Numbers> pairs;
  for (const Numbers& numbers : PairsAt(graph_.volumeToWorld, 0.0)) {
    const auto a = Index(numbers.first), b = Index(numbers.second);
    const auto found = attempts_.find(numbers);
    const bool isNew = found == attempts_.end(), isSure = !graph_.isDoubtful[a] && !graph_.isDoubtful[b];
    if (graph_.isPlaced[a] && graph_.isPlaced[b] && (isNew || (isSure && !found->second.stands)))
      pairs.push_back(numbers);
  }
  return pairs;
}

std::string Alignment::WhyDoubtful(int v) const
{
  std::string contested, unsure;
  double residual = 0.0;
  int count = 0;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Attempt& attempt = attempts_.at(edges_[e]);
    if (graph_.isContested[e]) {
      contested += (contested.empty() ? "" : "; ") + NameOfPair(edges_[e]);
      residual = std::max(residual, graph_.residualMm[e]);
      ++count;
    }
    if (!graph_.isWrong[e] && graph_.isBridge[e] && !attempt.edge.verified && (edges_[e].first == v || edges_[e].second == v))
      unsure += (unsure.empty() ? "" : "; ") + NameOfPair(edges_[e]) + " (" + attempt.pair.alignment.reason + ")";
  }
  if (!unsure.empty())
    return "its pose depends on an ambiguous pair alone: " + unsure;
  if (count > 0)
    return std::string(count == 1 ? "the pair " : "the pairs ") + contested + (count == 1 ? " disagrees" : " disagree") +
           " with the others by " + Millimetres(residual) + ", and as many pairs support it as contradict it";
  return "volumes between it and " + volumes_[Index(fixed_)].name + " are placed by ambiguous pairs only";
}

std::string Alignment::WhyFailed(int v) const
{
  if (!troubles_[Index(v)].empty())
    return troubles_[Index(v)];
  std::string reasons, others;
  for (const auto& [numbers, attempt] : attempts_) {
    if (numbers.first != v && numbers.second != v)
      continue;
    if (attempt.pair.alignment.verdict == Verdict::Failed)
      reasons += (reasons.empty() ? "" : "; ") + NameOfPair(numbers) + ": " + attempt.pair.alignment.reason;
    else
      others += (others.empty() ? "" : ", ") + volumes_[Index(numbers.first == v ? numbers.second : numbers.first)].name;
  }
  if (!others.empty())
    return "it is aligned with " + others + " only, which no pair joins to " + volumes_[Index(fixed_)].name;
  if (reasons.empty())
    return "it overlaps no other volume at its start pose or within the allowed distance from it";
  return "no pair places it: " + reasons;
}

AlignVolumesResult Alignment::Report() const
{
  AlignVolumesResult result;
  result.featureSeconds = featureSeconds_;
  result.pairSeconds = pairSeconds_;
  result.graphSeconds = graphSeconds_;
  result.consistency = graph_.consistency;
  result.volumes.resize(volumes_.size());
  for (int v = 0; v < Count(); ++v) {
    VolumeAlignment& volume = result.volumes[Index(v)];
    volume.volumeToWorld = graph_.volumeToWorld[Index(v)];
    volume.centre = graph_.centre[Index(v)];
    if (graph_.isPlaced[Index(v)])
      volume.information = graph_.information[Index(v)];
    if (IsHeld(v)) {
      volume.verdict = Verdict::Aligned;
    } else if (!graph_.isPlaced[Index(v)]) {
      volume.reason = WhyFailed(v);
    } else if (graph_.isDoubtful[Index(v)]) {
      volume.verdict = Verdict::Ambiguous;
      volume.reason = WhyDoubtful(v);
    } else if (!graph_.isDetermined[Index(v)]) {
      volume.verdict = Verdict::Ambiguous;
      volume.reason = "the pairs with other volumes do not fully determine its pose";
    } else {
      volume.verdict = Verdict::Aligned;
    }
  }

  std::vector<double> weights(volumes_.size(), 0.0);
  for (const auto& [numbers, attempt] : attempts_) {
    PairOfVolumes pair = attempt.pair;
    const PairAlignment& own = pair.alignment;
    pair.verdict = own.verdict;
    pair.reason = own.reason;
    pair.votedDown = attempt.votedDown;
    pair.contested = attempt.contested;
    pair.residualMm = attempt.residualMm;
    const auto edge = std::lower_bound(edges_.begin(), edges_.end(), numbers); // they are in the attempts' order
    const bool isEdge = edge != edges_.end() && *edge == numbers;
    if (!isEdge && attempt.votedDown)
      pair.reason = "it disagreed with the other pairs by " + Millimetres(pair.residualMm) +
                    "; aligned again from where they place it: " + own.reason;
    if (isEdge) {
      const std::size_t e = Index(static_cast<int>(edge - edges_.begin()));
      pair.stands = !graph_.isWrong[e];
      if (!attempt.votedDown)
        pair.residualMm = graph_.residualMm[e];
      const std::string disagrees = "it disagrees with the other pairs by " + Millimetres(pair.residualMm);
      if (graph_.isContested[e]) {
        pair.verdict = Verdict::Ambiguous;
        pair.reason = disagrees + ", but as many pairs speak for it as against it";
      } else if (!pair.stands) {
        pair.verdict = Verdict::Failed;
        pair.reason = disagrees + (own.reason.empty() ? "" : "; by itself: " + own.reason);
      } else if (attempt.votedDown) {
        pair.reason = "it disagreed with the other pairs by " + Millimetres(pair.residualMm) +
                      "; aligned again from where they place it, it agrees";
      } else if (own.verdict == Verdict::Ambiguous && !graph_.isBridge[e]) {
        pair.verdict = Verdict::Aligned;
        pair.reason = "the other pairs agree with it; by itself: " + own.reason;
      }
    }
    // From where its fixed volume is in the end.
    const Pose& onto = graph_.volumeToWorld[Index(numbers.first)];
    pair.alignment.volumeToWorld = onto * attempt.edge.toInFrom;
    pair.alignment.centre = onto * attempt.edge.centre;
    pair.alignment.information = Turned(attempt.edge.information, onto.linear());
    if (pair.stands)
      for (const int v : {numbers.first, numbers.second}) {
        VolumeAlignment& volume = result.volumes[Index(v)];
        volume.overlap = std::max(volume.overlap, own.overlap);
        volume.similarity += own.overlap * own.similarity;
        weights[Index(v)] += own.overlap;
      }
    result.pairs.push_back(pair);
  }
  for (int v = 0; v < Count(); ++v)
    result.volumes[Index(v)].similarity /= weights[Index(v)] > 0.0 ? weights[Index(v)] : 1.0;
  return result;
}

// Which volumes pairs that were clear by themselves join to those that stay.
std::vector<bool> Alignment::JoinedByClearPairs() const
{
  JoinedSets<int> sets(volumes_.size());
  for (int v = 0; v < Count(); ++v)
    if (IsHeld(v))
      sets.Join(fixed_, v);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (!graph_.isWrong[e] && attempts_.at(edges_[e]).edge.verified)
      sets.Join(edges_[e].first, edges_[e].second);
  std::vector<bool> joined(volumes_.size());
  for (int v = 0; v < Count(); ++v)
    joined[Index(v)] = sets.Of(v) == sets.Of(fixed_);
  return joined;
}

// What the images leave open, along all pairs to the fixed volume, and what they cannot show: sound that is faster or slower than
// the scanner takes it for stretches what each volume shows about its own face. Rays that are bent do about the same. Two views
// that lie apart then fit best where neither is, by that share of their distance, and no pair of a chain sees it.
// Pairs that leave a pose open do not determine it by agreeing: what misled one (a rig that can turn about an axis) may have
// misled all. So what no clear pair places must be known as exactly from all as from one.
void Alignment::StateErrors(AlignVolumesResult& result) const
{
  const std::vector<bool> isClear = JoinedByClearPairs();
  std::vector<double> voxelsMm(volumes_.size(), 0.0);
  for (const auto& [numbers, attempt] : attempts_)
    for (const int v : {numbers.first, numbers.second})
      if (attempt.stands)
        voxelsMm[Index(v)] = std::max(voxelsMm[Index(v)], attempt.pair.alignment.voxelMm);
  const auto middle = [&](int v) { return result.volumes[Index(v)].volumeToWorld * outlines_[Index(v)].shape.centroid; };
  for (int v = 0; v < Count(); ++v) {
    VolumeAlignment& volume = result.volumes[Index(v)];
    volume.name = volumes_[Index(v)].name;
    if (v == fixed_)
      continue;
    constexpr double FarMm = 100.0; // where what nothing is known of is 1 km off
    volume.covariance = CovarianceOf(volume.information, FarMm);
    if (IsHeld(v) || volume.verdict == Verdict::Failed)
      continue;
    const double bentMm = p_.pair.soundSpeedError * (middle(v) - middle(fixed_)).norm();
    const double openMm = outlines_[Index(v)].shape.Error(volume.covariance, volume.centre, volume.volumeToWorld);
    volume.errorMm = std::hypot(openMm, bentMm);
    if (volume.verdict == Verdict::Aligned && !isClear[Index(v)] && openMm > p_.pair.maximumErrorVoxels * voxelsMm[Index(v)]) {
      volume.verdict = Verdict::Ambiguous;
      volume.reason =
          "the image contents do not determine its pose: by all pairs together it may be off by " + Millimetres(openMm);
    }
    if (volume.verdict == Verdict::Aligned && volume.errorMm > p_.pair.maximumErrorMm) {
      volume.verdict = Verdict::Ambiguous;
      volume.reason =
          "it may be off by " + Millimetres(volume.errorMm) + ", and at most " + Millimetres(p_.pair.maximumErrorMm) +
          " are accepted" +
          (bentMm > 0.5 * volume.errorMm
               ? "; most of it is what the speed of sound may have bent over the distance to " + volumes_[Index(fixed_)].name
               : "");
    }
  }
}

AlignVolumesResult Alignment::Run(const Progress& progress)
{
  BuildFeatures(progress.Part(0.0, 0.1));
  std::vector<Pose> start;
  double reachMm = 0.0;
  for (int v = 0; v < Count(); ++v) {
    start.push_back(volumes_[Index(v)].volumeToWorld);
    reachMm = std::max(reachMm, 2.0 / 3.0 * outlines_[Index(v)].shape.reach);
  }
  if (Count() == 2) {
    TryAll({Ordered(0, 1)}, p_.pair.start, start, progress.Part(0.1, 1.0));
    Solve({});
    AlignVolumesResult result = Report();
    const PairOfVolumes& pair = result.pairs.front();
    VolumeAlignment& moving = result.volumes[Index(pair.moving)];
    moving.volumeToWorld = pair.alignment.volumeToWorld;
    moving.verdict = pair.alignment.verdict;
    moving.reason = pair.alignment.reason;
    moving.information = pair.alignment.information;
    moving.centre = pair.alignment.centre;
    StateErrors(result);
    return result;
  }

  std::vector<Numbers> pairs;
  AlignStart near = p_.pair.start;
  if (p_.pair.start == AlignStart::Unknown) {
    for (int a = 0; a < Count(); ++a)
      for (int b = a + 1; b < Count(); ++b)
        if (IsPair(a, b))
          pairs.push_back(Ordered(a, b));
  } else {
    near = near == AlignStart::Automatic ? AlignStart::HandMade : near;
    pairs = PairsAt(start, near == AlignStart::Tracked ? TrackedReachMm : reachMm);
  }
  const std::vector<Numbers> sure = PairsWithLandmarks();
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [&sure](const Numbers& pair) { return std::binary_search(sure.begin(), sure.end(), pair); }),
              pairs.end());
  TryAll(sure, p_.pair.start, start, progress.Part(0.1, sure.empty() ? 0.1 : 0.4));
  TryAll(pairs, near, start, progress.Part(sure.empty() ? 0.1 : 0.4, 0.7));
  Solve({});
  if (p_.pair.start == AlignStart::Automatic)
    FindTheLost(progress.Part(0.7, 0.8));
  for (int round = 1; round < p_.rounds; ++round) {
    const std::vector<Numbers> again = PairsToTryAgain();
    if (again.empty())
      break;
    TryAll(again, AlignStart::Tracked, graph_.volumeToWorld,
           progress.Part(0.8 + 0.2 * (round - 1) / p_.rounds, 0.8 + 0.2 * round / p_.rounds));
    Solve({});
  }
  progress(1.0);
  AlignVolumesResult result = Report();
  StateErrors(result);
  return result;
}

} // namespace

ParameterList Describe(AlignVolumesParameters& p)
{
  return Join(
      {Describe(p.pair),
       {Parameter("PairsPerVolume", p.pairsPerVolume, {1, 1000}, "",
                  "A volume is paired with so many others, those that it overlaps most."),
        Parameter("Rounds", p.rounds, {1, 5}, "",
                  "1: every pair is aligned once; more: pairs are aligned again from where the others place them."),
        Parameter("FloorVoxels", p.floorVoxels, {0, 10}, "voxels",
                  "No pair is believed to be better than this standard deviation."),
        Parameter("OutlierVoxels", p.outlierVoxels, {0, 100}, "voxels", "Pairs that disagree by less are never voted down."),
        Parameter("OutlierSigmas", p.outlierSigmas, {0, 1000, true}, "standard deviations",
                  "Nor are those that disagree by less of their own.")}});
}

AlignVolumesResult AlignVolumes(const std::vector<PlacedVolume>& volumes, int fixed, const AlignVolumesParameters& p,
                                const Progress& progress, const PairAligner& aligner)
{
  CheckRanges(p);
  const std::size_t count = volumes.size();
  if (count < 2)
    throw Error(Error::Kind::BadInput,
                "two volumes are needed to align; there " + std::string(count == 1 ? "is one" : "are none"));
  CheckFixedVolume(fixed, count);
  std::set<int> staying{fixed};
  for (const int v : p.held) {
    if (v < 0 || Index(v) >= count)
      throw Error(Error::Kind::InvalidParameter, "those held must be among the " + std::to_string(count) +
                                                     " volumes, numbered from 0; there is no " + std::to_string(v));
    staying.insert(v);
  }
  if (staying.size() == count)
    throw Error(Error::Kind::InvalidParameter, "every volume is fixed or held: none is left to be aligned");
  for (const PlacedVolume& volume : volumes) {
    if (!volume.pyramid || volume.pyramid->empty())
      throw Error(Error::Kind::BadInput, volume.name + ": it has no voxels");
    PairLandmarks(volume.landmarks, volume.name, {}, {}); // for its checks
  }
  return Alignment(volumes, fixed, p, aligner).Run(progress);
}

} // namespace echorama
