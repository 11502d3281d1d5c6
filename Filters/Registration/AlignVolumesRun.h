// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AlignVolumes.h"
#include "FinishedPairs.h"
#include "Index.h"
#include "OverlappingPairs.h"
#include "PoseGraph.h"
#include <map>

namespace echorama {

/// One run of AlignVolumes: what it is about while it goes on (AlignVolumes.cxx), and what it says in the end
/// (AlignVolumesReport.cxx).
class AlignVolumesRun {
public:
  using Numbers = std::pair<int, int>; ///< of two volumes, the one that stays first

  AlignVolumesRun(const std::vector<VolumeOnDemand>& volumes, int fixed, const AlignVolumesParameters& p,
                  const PairAligner& aligner)
    : sources_(volumes), fixed_(fixed), p_(p), aligner_(aligner), shared_(p.shared ? *p.shared : alone_),
      prepared_(
          BudgetBytes(p.resources) / (p.resources.memoryGb > 0.0 ? 1 : shared_.Ranks()), // they may be on one machine
          [this](int v, const Progress& progress) { return AlignableVolume::Of(sources_[Index(v)], p_.pair.metric, progress); }),
      finished_(shared_.Rank() == 0 ? p.resources.finishedPairs : ""), troubles_(volumes.size()), held_(volumes.size(), false)
  {
    for (const VolumeOnDemand& volume : volumes)
      volumes_.push_back(volume.placed);
    held_[Index(fixed)] = true;
    for (const int v : p.held)
      held_[Index(v)] = true;
  }

  AlignVolumesResult Run(const Progress& progress);
  AlignVolumesPlan Plan(const Progress& progress);

private:
  // What a pair found, seen from its fixed volume.
  struct Attempt {
    PairOfVolumes pair;
    PoseEdge edge;
    bool votedDown = false, contested = false, stands = false;
    double residualMm = 0.0; // when it was voted down
  };

  struct Question {
    PlacedVolume fixed, moving;
    AlignPairParameters parameters;
    std::string key;
  };
  struct FirstPairs {
    std::vector<Numbers> sure, near;
    AlignStart start = AlignStart::Automatic; // of those that are near
  };

  int Count() const { return static_cast<int>(volumes_.size()); }
  bool CanBeAligned(int v) const { return troubles_[Index(v)].empty(); }
  std::string NameOfPair(const Numbers& pair) const
  {
    return volumes_[Index(pair.first)].name + " and " + volumes_[Index(pair.second)].name;
  }
  bool IsHeld(int v) const { return held_[Index(v)]; } // the fixed one too
  bool IsPair(int a, int b) const { return CanBeAligned(a) && CanBeAligned(b) && !(IsHeld(a) && IsHeld(b)); }
  Numbers Ordered(int a, int b) const { return IsHeld(b) || (!IsHeld(a) && b < a) ? Numbers(b, a) : Numbers(a, b); }

  // Whether pairs may have been aligned before, so that not all volumes will be asked for.
  bool MayBeKnown() const { return shared_.Ranks() == 1 ? !finished_.Empty() : !p_.resources.finishedPairs.empty(); }
  void Outline(int v, bool isPlan, const Progress& progress);
  void OutlineAll(bool isPlan, const Progress& progress);
  void ShareOutlines();
  std::vector<Numbers> PairsAt(const std::vector<Pose>& poses, double reachMm) const;
  std::vector<Numbers> PairsWithLandmarks() const;
  std::vector<PairAlignment> FirstAnswers(const std::vector<Numbers>& pairs, AlignStart start, const std::vector<Pose>& poses,
                                          const Progress& progress);
  std::vector<PairAlignment> Answers(const std::vector<Numbers>& pairs, AlignStart start, const std::vector<Pose>& poses,
                                     const Progress& progress);
  void Take(const Numbers& pair, const std::vector<Pose>& poses, const PairAlignment& found);
  void TryAll(const std::vector<Numbers>& pairs, AlignStart start, const std::vector<Pose>& poses, const Progress& progress);
  void Solve(const Progress& progress);
  PoseEdge AsSeenFromFixed(PoseEdge edge) const;
  void FindTheLost(const Progress& progress);
  std::vector<Numbers> PairsToTryAgain() const;
  std::vector<Pose> Start() const;
  FirstPairs ChooseFirst() const;
  Question Ask(const Numbers& pair, AlignStart start, const std::vector<Pose>& poses) const;
  AlignVolumesResult Report() const;
  std::vector<bool> JoinedByClearPairs() const;
  void StateErrors(AlignVolumesResult& result) const;
  void StateCost(AlignVolumesResult& result);
  std::string WhyDoubtful(int v) const;
  std::string WhyFailed(int v) const;

  const std::vector<VolumeOnDemand>& sources_;
  std::vector<PlacedVolume> volumes_; // without resolutions where these are made on demand
  const int fixed_;
  const AlignVolumesParameters& p_;
  const PairAligner& aligner_;
  SharedWork alone_;
  SharedWork& shared_;
  PreparedVolumes prepared_;
  FinishedPairs finished_;
  int finishedBefore_ = 0;
  std::vector<std::string> troubles_; // why a volume cannot be aligned
  std::vector<bool> held_;
  std::vector<VolumeOutline> outlines_;
  std::map<Numbers, Attempt> attempts_;
  std::vector<Numbers> edges_; // of the graph, as last solved
  PoseGraphResult graph_;
  double outlineSeconds_ = 0.0, pairSeconds_ = 0.0, graphSeconds_ = 0.0;
};

} // namespace echorama
