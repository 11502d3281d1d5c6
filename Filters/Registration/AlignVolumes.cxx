// SPDX-License-Identifier: BSD-3-Clause
// What a metric sees of a volume is computed once and serves all its pairs while memory lasts (PreparedVolumes). The coarsest
// resolution of every volume is kept: it tells which volumes overlap. Pairs are aligned several at once, for one by itself leaves
// threads waiting; then the pose graph votes. Pairs that were voted down, failed from a bad start or were not expected to overlap
// are aligned again from where others place their volumes, which is as good a start as a tracker's.
//
// Ranks share the coarsest resolutions, of which each makes some, and the pairs of a round: each aligns a piece of their order
// for reuse, so that it prepares few of the volumes. Every rank hears of all that was found and solves the graph itself.
#include "AlignVolumesRun.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Core/Sharing/ShareOut.h"
#include "Core/Sharing/SideBySide.h"
#include "Index.h"
#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

namespace echorama {
namespace {

constexpr int EnoughPairs = 3;         // a volume with fewer overlaps at the start is also paired with those farther off
constexpr int FarTries = 3;            // searches over all rotations for one volume
constexpr std::size_t PlanSamples = 3; // pairs that are aligned to see how long they take, at least
constexpr double TrackedReachMm = 20.0;
constexpr std::size_t PairsPerExchange = 32; // of a rank; what fails on one is heard by the others no later

std::string About(const std::vector<std::pair<int, int>>& pairs, const std::vector<Pose>& poses)
{
  Packed all;
  for (const auto& [fixed, moving] : pairs)
    all(fixed, moving);
  for (const Pose& pose : poses)
    all(pose);
  return std::to_string(pairs.size()) + " pairs " + Checksum(all.Bytes().data(), all.Bytes().size());
}

} // namespace

// All that pairs will ask for is made while there is room, unless they may be known already, or only a plan is wanted.
void AlignVolumesRun::Outline(int v, bool isPlan, const Progress& progress)
{
  const VolumeOnDemand& source = sources_[Index(v)];
  PreparedVolume resolutions;
  PlacedVolume placed = source.placed;
  const auto prepareOutline = [&] {
    if (source.prepare) {
      const Clock::time_point start = Clock::now();
      resolutions = source.prepare(false, progress);
      outlineSeconds_ += SecondsSince(start);
      placed.pyramid = &resolutions.pyramid;
    }
  };
  try {
    if (!isPlan && !MayBeKnown() && prepared_.HasRoomFor({v})) {
      outlines_.emplace_back(prepared_.Get(v, progress)->placed);
      return;
    }
    prepareOutline();
    CheckPlacedVolume(placed);
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::BadInput || v == fixed_)
      throw;
    troubles_[Index(v)] = error.what();
    if (placed.pyramid == nullptr)
      prepareOutline();
  }
  outlines_.emplace_back(placed);
}

void AlignVolumesRun::OutlineAll(bool isPlan, const Progress& progress)
{
  const auto [first, last] = shared_.Share(Count());
  const auto part = [first = first, last = last, &progress](std::ptrdiff_t begin, std::ptrdiff_t end) {
    return progress.Part(static_cast<double>(begin - first) / (last - first), static_cast<double>(end - first) / (last - first));
  };
  std::set<int> ahead; // made side by side; two first, for nobody knows how large they are
  for (auto v = static_cast<int>(first); v < last; ++v) {
    if (ahead.count(v) == 0 && !isPlan && !MayBeKnown()) {
      const auto end = std::min<std::ptrdiff_t>(last, v + (ahead.empty() ? 2 : TasksAtOnce()));
      for (int next = v; next < end; ++next)
        ahead.insert(next);
      prepared_.MakeAhead({ahead.find(v), ahead.end()}, part(v, end));
    }
    Outline(v, isPlan, part(v + 1, v + 1));
  }
  if (shared_.Ranks() > 1)
    ShareOutlines();
  const auto trouble = std::find_if(troubles_.rbegin(), troubles_.rend(), [](const std::string& text) { return !text.empty(); });
  if (std::count(troubles_.begin(), troubles_.end(), std::string()) < 2)
    throw Error(Error::Kind::BadInput, *trouble);
}

// Every rank gets the coarsest resolutions that the others have made.
void AlignVolumesRun::ShareOutlines()
{
  Packed mine, about;
  auto v = static_cast<std::size_t>(shared_.Share(Count()).first);
  for (const VolumeOutline& outline : outlines_)
    mine(troubles_[v++], outline.coarsest.geometry, outline.coarsest.realVoxels, outline.coarsest.intensity);
  for (const PlacedVolume& volume : volumes_)
    about(volume.name, volume.volumeToWorld);
  AlignVolumesParameters described = p_;
  for (const Parameter& parameter : Describe(described))
    about(parameter.Text());
  const std::string checksum = Checksum(about.Bytes().data(), about.Bytes().size());
  outlines_.clear();
  for (const std::string& told : shared_.Exchange(mine.Bytes(), std::to_string(Count()) + " volumes " + checksum))
    for (Unpacked from(told); !from.AtEnd();) {
      PlacedVolume placed = volumes_[outlines_.size()];
      std::vector<PyramidLevel> coarsest(1);
      placed.pyramid = &coarsest;
      from(troubles_[outlines_.size()], coarsest[0].geometry, coarsest[0].realVoxels, coarsest[0].intensity);
      outlines_.emplace_back(placed);
    }
}

std::vector<AlignVolumesRun::Numbers> AlignVolumesRun::PairsAt(const std::vector<Pose>& poses, double reachMm) const
{
  std::vector<OverlappingPair> pairs =
      OverlappingPairs(outlines_, poses, reachMm, p_.pair.minimumOverlap, [this](int a, int b) { return IsPair(a, b); });
  for (OverlappingPair& pair : pairs)
    std::tie(pair.a, pair.b) = Ordered(pair.a, pair.b);
  return MostOverlapping(pairs, Count(), p_.pairsPerVolume, EnoughPairs);
}

// Those in which one place was found twice: they overlap, however far apart they are.
std::vector<AlignVolumesRun::Numbers> AlignVolumesRun::PairsWithLandmarks() const
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

// The pair where these poses put it, with no resolutions yet.
AlignVolumesRun::Question AlignVolumesRun::Ask(const Numbers& numbers, AlignStart start, const std::vector<Pose>& poses) const
{
  Question question{volumes_[Index(numbers.first)], volumes_[Index(numbers.second)], p_.pair, {}};
  question.fixed.volumeToWorld = poses[Index(numbers.first)];
  question.moving.volumeToWorld = poses[Index(numbers.second)];
  question.parameters.start = start;
  question.key = finished_.KeyOf(question.fixed, sources_[Index(numbers.first)].content, question.moving,
                                 sources_[Index(numbers.second)].content, question.parameters);
  return question;
}

// Of the first of the pairs, side by side: as many as keep all threads busy and there is memory for, and at least one. A pair by
// itself is too small for many threads. Those that are done when one fails are kept.
std::vector<PairAlignment> AlignVolumesRun::FirstAnswers(const std::vector<Numbers>& pairs, AlignStart start,
                                                         const std::vector<Pose>& poses, const Progress& progress)
{
  std::vector<Question> questions;
  std::vector<std::pair<PreparedVolumes::Made, PreparedVolumes::Made>> made;
  std::vector<PairAlignment> answers;
  const auto attempt = [&](std::size_t i, const auto& body) {
    try {
      body();
    } catch (const Error& error) {
      if (Count() == 2 || (error.GetKind() != Error::Kind::BadInput && error.GetKind() != Error::Kind::NotPossible))
        throw;
      answers[i].volumeToWorld = questions[i].moving.volumeToWorld;
      answers[i].reason = error.what();
    }
  };
  for (std::size_t i = 0; i < std::min(pairs.size(), Index(TasksAtOnce())); ++i) {
    const int a = pairs[i].first, b = pairs[i].second;
    if (i > 0 && !prepared_.HasRoomFor({a, b}))
      break;
    questions.push_back(Ask(pairs[i], start, poses));
    made.emplace_back();
    answers.emplace_back();
    attempt(i, [&] { made[i] = {prepared_.Get(a, progress.Part(0.0, 0.0)), prepared_.Get(b, progress.Part(0.0, 0.0))}; });
  }
  const Clock::time_point clock = Clock::now();
  const double share = static_cast<double>(questions.size()) / static_cast<double>(pairs.size());
  std::vector<char> isDone(questions.size(), 0);
  try {
    SideBySide(static_cast<std::ptrdiff_t>(questions.size()), progress.Part(0.0, share),
               [&](std::ptrdiff_t task, const Progress& part) {
                 const auto i = Index(task);
                 const auto &fixed = made[i].first, &moving = made[i].second;
                 if (moving)
                   attempt(i, [&] {
                     answers[i] =
                         aligner_(fixed->At(questions[i].fixed.volumeToWorld), fixed->features,
                                  moving->At(questions[i].moving.volumeToWorld), moving->features, questions[i].parameters, part);
                   });
                 isDone[i] = 1;
               });
  } catch (...) {
    for (std::size_t i = 0; i < questions.size(); ++i)
      if (isDone[i] != 0)
        finished_.Add(questions[i].key, answers[i]);
    throw;
  }
  pairSeconds_ += SecondsSince(clock);
  return answers;
}

// By all ranks, each a piece of those that are not known from the first one's file.
std::vector<PairAlignment> AlignVolumesRun::Answers(const std::vector<Numbers>& pairs, AlignStart start,
                                                    const std::vector<Pose>& poses, const Progress& progress)
{
  const std::string about = About(pairs, poses);
  Packed mine;
  for (const Numbers& pair : pairs) {
    const auto answer = finished_.Find(Ask(pair, start, poses).key);
    mine(answer.has_value());
    if (answer)
      Pack(mine, *answer);
  }
  const std::string told = p_.resources.finishedPairs.empty() ? mine.Bytes() : shared_.Exchange(mine.Bytes(), about).front();
  Unpacked known(told);
  std::vector<PairAlignment> answers(pairs.size());
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    bool isKnown = false;
    known(isKnown);
    if (isKnown)
      Unpack(known, answers[i]);
    else
      left.push_back(i);
  }
  finishedBefore_ += static_cast<int>(pairs.size() - left.size());
  const auto answer = [&](std::size_t first, std::size_t count, double begin, double end) {
    std::vector<Numbers> next;
    for (std::size_t i = first; i < first + count; ++i)
      next.push_back(pairs[left[i]]);
    return FirstAnswers(next, start, poses, progress.Part(begin, end));
  };
  const auto hear = [&](std::size_t i, const PairAlignment& found) {
    answers[left[i]] = found;
    finished_.Add(Ask(pairs[left[i]], start, poses).key, found);
  };
  ShareOut<PairAlignment>(shared_, left.size(), PairsPerExchange, about, answer, hear);
  return answers;
}

void AlignVolumesRun::Take(const Numbers& numbers, const std::vector<Pose>& poses, const PairAlignment& found)
{
  Attempt& attempt = attempts_[numbers];
  attempt.pair.fixed = numbers.first;
  attempt.pair.moving = numbers.second;
  ++attempt.pair.attempts;
  // An answer that does not stand is replaced by any other that may; one that does is only replaced by a surer one.
  if (attempt.pair.attempts == 1 || !attempt.stands || found.verdict < attempt.pair.alignment.verdict) {
    attempt.pair.alignment = found;
    const Pose back = poses[Index(numbers.first)].inverse(Eigen::Isometry);
    attempt.edge.from = numbers.first;
    attempt.edge.to = numbers.second;
    attempt.edge.toInFrom = back * found.volumeToWorld;
    attempt.edge.toInFrom.linear() = Eigen::Quaterniond(attempt.edge.toInFrom.linear()).normalized().toRotationMatrix();
    attempt.edge.centre = back * found.centre;
    attempt.edge.information = Turned(found.information, back.linear());
    attempt.edge.verified = found.verdict == Verdict::Aligned;
  }
}

void AlignVolumesRun::TryAll(const std::vector<Numbers>& tried, AlignStart start, const std::vector<Pose>& poses,
                             const Progress& progress)
{
  const std::vector<Numbers> pairs = OrderedForReuse(tried);
  const std::vector<PairAlignment> found = Answers(pairs, start, poses, progress);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    Take(pairs[i], poses, found[i]);
  finished_.Write();
  progress(1.0);
}

void AlignVolumesRun::Solve(const Progress& progress)
{
  const Clock::time_point clock = Clock::now();
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
  graph_ = SolvePoseGraph(Start(), edges, fixed_, graph, progress);
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
PoseEdge AlignVolumesRun::AsSeenFromFixed(PoseEdge edge) const
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

// Volumes that are not placed are looked for in any rotation beside the nearest that are; beside others as long as that places
// any.
void AlignVolumesRun::FindTheLost(const Progress& progress)
{
  const auto centre = [this](std::size_t v) { return Eigen::Vector3d(graph_.volumeToWorld[v] * outlines_[v].shape.centroid); };
  std::set<Numbers> tried;
  for (auto [turn, isNew] = std::pair(0, true); std::exchange(isNew, false); ++turn)
    for (int v = 0; v < Count(); ++v) {
      if (graph_.isPlaced[Index(v)] || !CanBeAligned(v))
        continue;
      std::vector<std::pair<double, Numbers>> others; // by distance
      for (int other = 0; other < Count(); ++other)
        if (graph_.isPlaced[Index(other)] && CanBeAligned(other) && tried.count(Ordered(v, other)) == 0)
          others.push_back({(centre(Index(other)) - centre(Index(v))).norm(), Ordered(v, other)});
      std::sort(others.begin(), others.end());
      others.resize(std::min(others.size(), Index(FarTries)));
      const Progress part = progress.Part(1.0 - std::exp2(-turn), 1.0 - std::exp2(-turn - 1)); // nobody knows how many turns
      bool isFound = false, isPlacing = false;
      // As many at once as there are ranks; what comes after the first that is found does not count.
      for (std::size_t i = 0, end = 0; i < others.size() && !isFound; i = end) {
        end = std::min(i + Index(shared_.Ranks()), others.size());
        std::vector<Numbers> pairs;
        for (std::size_t next = i; next < end; ++next)
          pairs.push_back(others[next].second);
        const std::vector<PairAlignment> found = Answers(pairs, AlignStart::Unknown, graph_.volumeToWorld,
                                                         part.Part(static_cast<double>(v) / Count(), (v + 1.0) / Count()));
        for (std::size_t pair = 0; pair < pairs.size() && !isFound; ++pair) {
          tried.insert(pairs[pair]);
          Take(pairs[pair], graph_.volumeToWorld, found[pair]);
          isFound = found[pair].verdict == Verdict::Aligned;
          isPlacing = isPlacing || found[pair].verdict != Verdict::Failed;
        }
      }
      if (isPlacing)
        Solve({});
      isNew = isNew || graph_.isPlaced[Index(v)];
    }
}

// Pairs of placed volumes that overlap there, but were not tried, or do not stand though their volumes are sure to lie there.
std::vector<AlignVolumesRun::Numbers> AlignVolumesRun::PairsToTryAgain() const
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

std::vector<Pose> AlignVolumesRun::Start() const
{
  std::vector<Pose> start;
  for (const PlacedVolume& volume : volumes_)
    start.push_back(volume.volumeToWorld);
  return start;
}

// Which pairs are tried first: those that share landmarks, and those that may overlap.
AlignVolumesRun::FirstPairs AlignVolumesRun::ChooseFirst() const
{
  FirstPairs first;
  if (Count() == 2) {
    first.sure = {Ordered(0, 1)};
    return first;
  }
  first.sure = PairsWithLandmarks();
  first.start = p_.pair.start;
  std::vector<Numbers> pairs;
  if (p_.pair.start == AlignStart::Unknown) {
    for (int a = 0; a < Count(); ++a)
      for (int b = a + 1; b < Count(); ++b)
        if (IsPair(a, b))
          pairs.push_back(Ordered(a, b));
  } else {
    if (first.start == AlignStart::Automatic)
      first.start = AlignStart::HandMade;
    double reachMm = 0.0;
    for (const VolumeOutline& outline : outlines_)
      reachMm = std::max(reachMm, 2.0 / 3.0 * outline.shape.reach);
    pairs = PairsAt(Start(), first.start == AlignStart::Tracked ? TrackedReachMm : reachMm);
  }
  for (const Numbers& pair : pairs)
    if (!std::binary_search(first.sure.begin(), first.sure.end(), pair))
      first.near.push_back(pair);
  return first;
}

AlignVolumesResult AlignVolumesRun::Run(const Progress& progress)
{
  OutlineAll(false, progress.Part(0.0, 0.1));
  const FirstPairs first = ChooseFirst();
  AlignVolumesResult result;
  if (Count() == 2) {
    TryAll(first.sure, p_.pair.start, Start(), progress.Part(0.1, 1.0));
    Solve({});
    result = Report();
    const PairOfVolumes& pair = result.pairs.front();
    VolumeAlignment& moving = result.volumes[Index(pair.moving)];
    moving.verdict = pair.alignment.verdict;
    moving.reason = pair.alignment.reason;
    if (moving.verdict != Verdict::Failed) { // else it stays where it was
      moving.volumeToWorld = pair.alignment.volumeToWorld;
      moving.information = pair.alignment.information;
      moving.centre = pair.alignment.centre;
    }
  } else {
    const double middle = first.sure.empty() ? 0.1 : 0.4;
    TryAll(first.sure, p_.pair.start, Start(), progress.Part(0.1, middle));
    TryAll(first.near, first.start, Start(), progress.Part(middle, 0.7));
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
    result = Report();
  }
  StateErrors(result);
  StateCost(result);
  return result;
}

AlignVolumesPlan AlignVolumesRun::Plan(const Progress& progress)
{
  OutlineAll(true, progress.Part(0.0, 0.5));
  AlignVolumesPlan plan;
  plan.seconds = std::exchange(outlineSeconds_, 0.0);
  const std::vector<Pose> starts = Start();
  std::vector<Numbers> pairs; // that are left
  const FirstPairs first = ChooseFirst();
  const auto ask = [&](const std::vector<Numbers>& asked, AlignStart start) {
    for (const Numbers& pair : OrderedForReuse(asked)) {
      plan.pairs.push_back(pair);
      if (finished_.Find(Ask(pair, start, starts).key))
        ++plan.pairsFinishedBefore;
      else
        pairs.push_back(pair);
    }
  };
  ask(first.sure, p_.pair.start);
  ask(first.near, first.start);
  const std::size_t samples = std::min(std::max(PlanSamples, Index(TasksAtOnce()) / 2), pairs.size());
  std::vector<Numbers> sampled;
  for (std::size_t i = 0; i < samples; ++i)
    sampled.push_back(pairs[(2 * i + 1) * pairs.size() / (2 * samples)]);
  Answers(sampled, first.near.empty() ? p_.pair.start : first.start, starts, progress.Part(0.5, 1.0));
  plan.budgetBytes = BudgetBytes(p_.resources);
  plan.bytesPerVolume = prepared_.LargestBytes();
  plan.bytesOfAll = plan.bytesPerVolume * Count();
  plan.timesPrepared =
      TimesMade(pairs, plan.bytesPerVolume > 0.0 ? static_cast<int>(std::min(plan.budgetBytes / plan.bytesPerVolume, 1e9)) : 0);
  if (samples > 0) {
    plan.secondsPerPair = pairSeconds_ / static_cast<double>(samples);
    plan.secondsPerVolume = prepared_.Seconds() / std::max(prepared_.TimesMade(), 1);
  }
  plan.seconds += plan.secondsPerPair * static_cast<double>(pairs.size()) + plan.secondsPerVolume * plan.timesPrepared;
  return plan;
}

namespace {

void Check(const std::vector<VolumeOnDemand>& volumes, int fixed, const AlignVolumesParameters& p)
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
  for (const VolumeOnDemand& volume : volumes)
    PairLandmarks(volume.placed.landmarks, volume.placed.name, {}, {}); // for its checks
}

} // namespace

ParameterList Describe(AlignVolumesParameters& p)
{
  return Join(
      {Describe(p.pair),
       Describe(p.resources),
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
  std::vector<VolumeOnDemand> sources;
  for (const PlacedVolume& volume : volumes) {
    if (!volume.pyramid || volume.pyramid->empty())
      throw Error(Error::Kind::BadInput, volume.name + ": it has no voxels");
    sources.push_back({volume, {}, {}});
  }
  return AlignVolumesOnDemand(sources, fixed, p, progress, aligner);
}

AlignVolumesResult AlignVolumesOnDemand(const std::vector<VolumeOnDemand>& volumes, int fixed, const AlignVolumesParameters& p,
                                        const Progress& progress, const PairAligner& aligner)
{
  Check(volumes, fixed, p);
  return AlignVolumesRun(volumes, fixed, p, aligner).Run(progress);
}

AlignVolumesPlan PlanAlignment(const std::vector<VolumeOnDemand>& volumes, int fixed, const AlignVolumesParameters& p,
                               const Progress& progress, const PairAligner& aligner)
{
  Check(volumes, fixed, p);
  return AlignVolumesRun(volumes, fixed, p, aligner).Plan(progress);
}

} // namespace echorama
