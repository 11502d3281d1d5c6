// SPDX-License-Identifier: BSD-3-Clause
#include "AlignVolumesRun.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/JoinedSets.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

// Pairs or volumes that a reason names, and how many more there are: of thousands of volumes there may be many.
class FewOfMany {
public:
  explicit FewOfMany(const char* separator) : separator_(separator) {}

  void Add(const std::string& name)
  {
    if (++count_ <= Named)
      names_ += (names_.empty() ? "" : separator_) + name;
  }
  int Count() const { return count_; }
  std::string Text() const { return count_ <= Named ? names_ : names_ + Format(" and %d more", count_ - Named); }

private:
  static constexpr int Named = 5;
  std::string separator_, names_;
  int count_ = 0;
};

} // namespace

std::string AlignVolumesRun::WhyDoubtful(int v) const
{
  FewOfMany contested("; "), unsure("; ");
  double residual = 0.0;
  for (const bool isItsOwn : {true, false}) // are named first
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if ((edges_[e].first == v || edges_[e].second == v) != isItsOwn)
        continue;
      if (graph_.isContested[e]) {
        contested.Add(NameOfPair(edges_[e]));
        residual = std::max(residual, graph_.residualMm[e]);
      }
      if (!isItsOwn || graph_.isWrong[e] || !graph_.isBridge[e])
        continue;
      if (const Attempt& attempt = attempts_.at(edges_[e]); !attempt.edge.verified)
        unsure.Add(NameOfPair(edges_[e]) + " (" + attempt.pair.alignment.reason + ")");
    }
  if (unsure.Count() > 0)
    return "its pose depends on an ambiguous pair alone: " + unsure.Text();
  if (contested.Count() > 0)
    return (contested.Count() == 1 ? "the pair " : "the pairs ") + contested.Text() +
           (contested.Count() == 1 ? " disagrees" : " disagree") + " with the others by " + Format("%.1f mm", residual) +
           ", and as many pairs support it as contradict it";
  return "volumes between it and " + volumes_[Index(fixed_)].name + " are placed by ambiguous pairs only";
}

std::string AlignVolumesRun::WhyFailed(int v) const
{
  if (!troubles_[Index(v)].empty())
    return troubles_[Index(v)];
  FewOfMany reasons("; "), others(", ");
  for (const auto& [numbers, attempt] : attempts_) {
    if (numbers.first != v && numbers.second != v)
      continue;
    if (attempt.pair.alignment.verdict == Verdict::Failed)
      reasons.Add(NameOfPair(numbers) + ": " + attempt.pair.alignment.reason);
    else
      others.Add(volumes_[Index(numbers.first == v ? numbers.second : numbers.first)].name);
  }
  if (others.Count() > 0)
    return "it is aligned with " + others.Text() + " only, which no pair joins to " + volumes_[Index(fixed_)].name;
  if (reasons.Count() == 0)
    return "it overlaps no other volume at its start pose or within the allowed distance from it";
  return "no pair places it: " + reasons.Text();
}

AlignVolumesResult AlignVolumesRun::Report() const
{
  AlignVolumesResult result;
  result.featureSeconds = outlineSeconds_ + prepared_.Seconds();
  result.pairSeconds = pairSeconds_;
  result.graphSeconds = graphSeconds_;
  result.timesPrepared = prepared_.TimesMade();
  result.preparedBytes = prepared_.PeakBytes();
  result.pairsFinishedBefore = finishedBefore_;
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
    const std::string again = "it disagreed with the other pairs by " + Format("%.1f mm", pair.residualMm) +
                              "; aligned again from where they place it"; // if it was voted down
    if (!isEdge && attempt.votedDown)
      pair.reason = again + ": " + own.reason;
    if (isEdge) {
      const std::size_t e = Index(static_cast<int>(edge - edges_.begin()));
      pair.stands = !graph_.isWrong[e];
      if (!attempt.votedDown)
        pair.residualMm = graph_.residualMm[e];
      const std::string disagrees = "it disagrees with the other pairs by " + Format("%.1f mm", pair.residualMm);
      if (graph_.isContested[e]) {
        pair.verdict = Verdict::Ambiguous;
        pair.reason = disagrees + ", but as many pairs speak for it as against it";
      } else if (!pair.stands) {
        pair.verdict = Verdict::Failed;
        pair.reason = disagrees + (own.reason.empty() ? "" : "; by itself: " + own.reason);
      } else if (attempt.votedDown) {
        pair.reason = again + ", it agrees";
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
std::vector<bool> AlignVolumesRun::JoinedByClearPairs() const
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
void AlignVolumesRun::StateErrors(AlignVolumesResult& result) const
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
          "the image contents do not determine its pose: by all pairs together it may be off by " + Format("%.1f mm", openMm);
    }
    if (volume.verdict == Verdict::Aligned && volume.errorMm > p_.pair.maximumErrorMm) {
      volume.verdict = Verdict::Ambiguous;
      volume.reason =
          "it may be off by " + Format("%.1f mm", volume.errorMm) + ", and at most " + Format("%.1f mm", p_.pair.maximumErrorMm) +
          " are accepted" +
          (bentMm > 0.5 * volume.errorMm
               ? "; most of it is what the speed of sound may have bent over the distance to " + volumes_[Index(fixed_)].name
               : "");
    }
  }
}

// Of all ranks.
void AlignVolumesRun::StateCost(AlignVolumesResult& result)
{
  Packed mine;
  mine(result.featureSeconds, result.pairSeconds, result.graphSeconds, result.preparedBytes, result.timesPrepared);
  result.timesPrepared = 0;
  for (const std::string& told : shared_.Exchange(mine.Bytes())) {
    AlignVolumesResult its;
    Unpacked from(told);
    from(its.featureSeconds, its.pairSeconds, its.graphSeconds, its.preparedBytes, its.timesPrepared);
    result.featureSeconds = std::max(result.featureSeconds, its.featureSeconds);
    result.pairSeconds = std::max(result.pairSeconds, its.pairSeconds);
    result.graphSeconds = std::max(result.graphSeconds, its.graphSeconds);
    result.preparedBytes = std::max(result.preparedBytes, its.preparedBytes);
    result.timesPrepared += its.timesPrepared;
  }
  result.ranks = shared_.Ranks();
  result.traffic = shared_.Told();
}

} // namespace echorama
