// SPDX-License-Identifier: BSD-3-Clause
// Least squares cannot tell a wrong edge from its neighbours, and a robust loss only when it starts near the right answer.
// So the start is a vote: a spanning tree that happens to hold no wrong edge explains all right edges at once, whatever the
// wrong ones say. Trees are drawn so that edges which close triangles (or squares) come first; the first tree is not random,
// and where all edges agree with it nothing else is done.
//
// Then: a Cauchy solution from the best tree; edges beyond the gate are put aside; plain least squares of the rest; edges are
// judged anew by what the rest predicts of them (its covariance included, which matters after a long chain), until nothing
// changes. Edges are never put aside if that would break the graph apart.
//
// Last, the edges put aside are asked whether they agree with each other: k of them that want the same motion of some part
// of the graph win if less than k edges hold that part in place, which a minimum cut tells. With exactly k nobody knows.
//
// Cost: trees times edges; a solution is a few sparse Cholesky factors. Ten volumes take milliseconds.
#include "PoseGraph.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedSets.h"
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Index.h"
#include "PlacedVolume.h"
#include "PoseGraphSolver.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <string>

namespace echorama {
namespace {

using Flags = std::vector<bool>;

constexpr int CyclesPerEdge = 64;          // as many short cycles are tried for an edge
constexpr double TreeEdgesAtMost = 200000; // trees times edges
constexpr int Rounds = 50;                 // of putting edges aside and taking them back
constexpr int MostFalls = 3;               // an edge that was put aside so often stays there
constexpr int Regroupings = 5;             // of parts that a majority of edges wants elsewhere

double DistanceMm(const Twist& disagreement, double radiusMm)
{
  return std::sqrt(disagreement.head<3>().squaredNorm() + 2.0 / 3.0 * radiusMm * radiusMm * disagreement.tail<3>().squaredNorm());
}

// Edges that were put aside and agree on a motion: `moved` would follow it, `still` stay.
struct Party {
  std::vector<std::size_t> edges;
  std::vector<int> still, moved; // ends of its edges
  Pose motion;
};

class Graph {
public:
  Graph(std::vector<WeighedEdge> edges, std::vector<Pose> begin, int fixed, const PoseGraphParameters& p)
    : edges_(std::move(edges)), poses(std::move(begin)), stands(edges_.size(), false), fixed_(fixed), p_(p),
      neighbours_(poses.size())
  {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      neighbours_[Index(edges_[e].from)].push_back({edges_[e].to, e});
      neighbours_[Index(edges_[e].to)].push_back({edges_[e].from, e});
    }
  }

  void Solve(const Flags& take, const Flags& keep, const Progress& progress);
  void Regroup(const Flags& take, const Progress& progress);
  void Contest(const Flags& asked, Flags& isContested, Flags& isDoubtful) const;

  Flags Bridges(const Flags& used) const;
  /// Per volume: the root of its part, which is the fixed volume or the part's first.
  std::vector<int> Roots(const Flags& used) const;
  Flags IsRoot(const Flags& used) const;
  double ResidualMm(std::size_t e) const { return DistanceMm(ResidualOf(e), p_.radiusMm); }
  double ResidualSigmas(std::size_t e) const { return (edges_[e].root * ResidualOf(e)).norm(); }

private:
  struct Neighbour {
    int volume;
    std::size_t edge;
  };
  struct Tree {
    std::vector<std::size_t> order; // volumes, parents before children
    std::vector<int> parents;       // -1: a root
    std::vector<std::size_t> edges; // to the parent
    std::vector<int> depths;
    std::vector<double> variances; // of the way from the root
    std::vector<Pose> poses;
  };

  struct Gap {
    double mm, sigmas;
  };

  JoinedSets<int> Joined(const Flags& used) const;
  Gap GapOf(std::size_t e, const MarginalCovariances& covariances) const;
  Twist ResidualOf(std::size_t e) const
  {
    return Disagreement(edges_[e], poses[Index(edges_[e].from)], poses[Index(edges_[e].to)]);
  }
  const Pose& Step(std::size_t e, int from) const { return edges_[e].from == from ? edges_[e].toInFrom : edges_[e].fromInTo; }
  double GateMm(double variance) const { return std::max(p_.outlierMm, p_.outlierSigmas * std::sqrt(variance / 3.0)); }

  std::vector<double> CycleWeights(const Flags& take) const;
  Tree GrowTree(const Flags& take, const Flags& isRoot, const std::vector<double>& lengths, bool isShort) const;
  void StartFromBestTree(const Flags& take, const Flags& keep);
  void Settle(const Flags& take, const Flags& keep);
  std::vector<Party> Parties(const Flags& asked) const;
  int Cut(const Party& party, Flags& isMoved) const;

  const std::vector<WeighedEdge> edges_;

public:
  std::vector<Pose> poses; ///< per volume, in the fixed volume's frame
  Flags stands;            ///< per edge

private:
  const int fixed_;
  const PoseGraphParameters& p_;
  std::vector<std::vector<Neighbour>> neighbours_;
};

JoinedSets<int> Graph::Joined(const Flags& used) const
{
  JoinedSets<int> sets(poses.size());
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (used[e])
      sets.Join(edges_[e].from, edges_[e].to);
  return sets;
}

std::vector<int> Graph::Roots(const Flags& used) const
{
  JoinedSets<int> sets = Joined(used);
  std::vector<int> roots(poses.size());
  const int ofFixed = sets.Of(fixed_);
  for (std::size_t v = 0; v < roots.size(); ++v) {
    const int root = sets.Of(static_cast<int>(v));
    roots[v] = root == ofFixed ? fixed_ : root;
  }
  return roots;
}

Flags Graph::IsRoot(const Flags& used) const
{
  const std::vector<int> roots = Roots(used);
  Flags is(roots.size());
  for (std::size_t v = 0; v < roots.size(); ++v)
    is[v] = roots[v] == static_cast<int>(v);
  return is;
}

// Depth first: an edge is a bridge when nothing below it reaches above it.
Flags Graph::Bridges(const Flags& used) const
{
  struct Visit {
    int volume;
    std::size_t arrived, next;
  };
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  Flags bridges(edges_.size(), false);
  std::vector<int> order(poses.size(), -1), low(poses.size(), 0);
  int count = 0;
  for (std::size_t root = 0; root < poses.size(); ++root) {
    if (order[root] >= 0)
      continue;
    std::vector<Visit> stack{{static_cast<int>(root), none, 0}};
    order[root] = low[root] = count++;
    while (!stack.empty()) {
      Visit& visit = stack.back();
      const std::size_t v = Index(visit.volume);
      if (visit.next < neighbours_[v].size()) {
        const Neighbour& n = neighbours_[v][visit.next++];
        if (!used[n.edge] || n.edge == visit.arrived)
          continue;
        if (order[Index(n.volume)] >= 0) {
          low[v] = std::min(low[v], order[Index(n.volume)]);
          continue;
        }
        order[Index(n.volume)] = low[Index(n.volume)] = count++;
        stack.push_back({n.volume, n.edge, 0});
        continue;
      }
      const Visit done = visit;
      stack.pop_back();
      if (stack.empty())
        continue;
      const std::size_t above = Index(stack.back().volume);
      low[above] = std::min(low[above], low[v]);
      bridges[done.arrived] = low[v] > order[above];
    }
  }
  return bridges;
}

// Per edge: the share of its short cycles that close, in (0, 1); cycles of two and three edges, or of four if there are none.
std::vector<double> Graph::CycleWeights(const Flags& take) const
{
  std::vector<double> weights(edges_.size(), 0.5);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    if (!take[e])
      continue;
    const WeighedEdge& edge = edges_[e];
    int closed = 0, tried = 0;
    const auto walk = [&](const auto& self, int at, const Pose& pose, double variance, int steps) -> void {
      for (const Neighbour& n : neighbours_[Index(at)]) {
        if (tried >= CyclesPerEdge)
          return;
        if (!take[n.edge] || n.edge == e || n.volume == edge.from)
          continue;
        if (n.volume == edge.to) {
          const Twist gap = Disagreement(edge, Pose::Identity(), pose * Step(n.edge, at));
          ++tried;
          closed += DistanceMm(gap, p_.radiusMm) <= GateMm(variance + edges_[n.edge].variance) ? 1 : 0;
        } else if (steps > 1) {
          self(self, n.volume, pose * Step(n.edge, at), variance + edges_[n.edge].variance, steps - 1);
        }
      }
    };
    walk(walk, edge.from, Pose::Identity(), edge.variance, 2);
    if (tried == 0)
      walk(walk, edge.from, Pose::Identity(), edge.variance, 3);
    weights[e] = (closed + 0.25) / (tried + 0.5);
  }
  return weights;
}

// A spanning tree of each part, of short ways from the root (Dijkstra) or of few long edges anywhere (Kruskal).
Graph::Tree Graph::GrowTree(const Flags& take, const Flags& isRoot, const std::vector<double>& lengths, bool isShort) const
{
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  const std::size_t volumes = poses.size();
  Flags allowed = take;
  if (!isShort) {
    std::vector<std::size_t> order;
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (take[e])
        order.push_back(e);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return lengths[a] < lengths[b]; });
    JoinedSets<int> sets(volumes);
    for (const std::size_t e : order)
      allowed[e] = sets.Join(edges_[e].from, edges_[e].to);
  }
  Tree tree;
  tree.parents.assign(volumes, -1);
  tree.edges.assign(volumes, none);
  tree.depths.assign(volumes, 0);
  tree.variances.assign(volumes, 0.0);
  tree.poses = poses;
  std::vector<double> ways(volumes, std::numeric_limits<double>::infinity());
  using Way = std::pair<double, std::size_t>;
  std::priority_queue<Way, std::vector<Way>, std::greater<Way>> queue;
  Flags isDone(volumes, false);
  for (std::size_t v = 0; v < volumes; ++v)
    if (isRoot[v]) {
      ways[v] = 0.0;
      queue.push({0.0, v});
    }
  while (!queue.empty()) {
    const std::size_t v = queue.top().second;
    queue.pop();
    if (isDone[v])
      continue;
    isDone[v] = true;
    tree.order.push_back(v);
    if (tree.parents[v] >= 0) {
      const std::size_t parent = Index(tree.parents[v]), e = tree.edges[v];
      tree.poses[v] = tree.poses[parent] * Step(e, tree.parents[v]);
      tree.depths[v] = tree.depths[parent] + 1;
      tree.variances[v] = tree.variances[parent] + edges_[e].variance;
    }
    for (const Neighbour& n : neighbours_[v]) {
      const std::size_t to = Index(n.volume);
      if (!allowed[n.edge] || isDone[to] || ways[v] + lengths[n.edge] >= ways[to])
        continue;
      ways[to] = ways[v] + lengths[n.edge];
      tree.parents[to] = static_cast<int>(v);
      tree.edges[to] = n.edge;
      queue.push({ways[to], to});
    }
  }
  return tree;
}

void Graph::StartFromBestTree(const Flags& take, const Flags& keep)
{
  const std::size_t volumes = poses.size();
  const std::vector<double> weights = CycleWeights(take);
  const std::vector<int> roots = Roots(take);
  const Flags isRoot = IsRoot(take);
  const auto taken = static_cast<double>(std::count(take.begin(), take.end(), true));
  const int trees = std::min(p_.trees, std::max(10, static_cast<int>(TreeEdgesAtMost / std::max(1.0, taken))));
  std::vector<double> best(volumes, -1.0); // per root
  std::vector<Pose> bestPoses = poses;
  bool isUnanimous = false;
  for (int t = 0; t < trees && !isUnanimous; ++t) {
    std::vector<double> lengths(edges_.size(), 0.0);
    Random random(p_.seed, static_cast<std::uint64_t>(t));
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (!take[e])
        continue;
      const double chance = t == 0 ? 1.0 : -std::log1p(-random.Uniform());
      lengths[e] = keep[e] ? 1e-9 : chance * std::sqrt(edges_[e].variance) / (weights[e] * weights[e]);
    }
    const Tree tree = GrowTree(take, isRoot, lengths, t % 2 == 0);
    std::vector<double> votes(volumes, 0.0);
    isUnanimous = true;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (!take[e])
        continue;
      const std::size_t from = Index(edges_[e].from), to = Index(edges_[e].to);
      if (tree.edges[from] == e || tree.edges[to] == e) {
        votes[Index(roots[from])] += 1.0;
        continue;
      }
      std::size_t a = from, b = to; // up to where their ways meet
      while (a != b)
        (tree.depths[a] >= tree.depths[b] ? a : b) = Index(tree.parents[tree.depths[a] >= tree.depths[b] ? a : b]);
      const double variance = edges_[e].variance + tree.variances[from] + tree.variances[to] - 2.0 * tree.variances[a];
      const double distance = DistanceMm(Disagreement(edges_[e], tree.poses[from], tree.poses[to]), p_.radiusMm);
      const double gate = GateMm(variance);
      votes[Index(roots[from])] += 1.0 / (1.0 + distance * distance / (gate * gate));
      isUnanimous = isUnanimous && distance <= gate;
    }
    for (std::size_t v = 0; v < volumes; ++v)
      if (votes[Index(roots[v])] > best[Index(roots[v])])
        bestPoses[v] = tree.poses[v];
    for (std::size_t v = 0; v < volumes; ++v)
      best[v] = std::max(best[v], votes[v]);
  }
  poses = bestPoses;
}

// How far an edge disagrees with what all the others that stand predict for it.
Graph::Gap Graph::GapOf(std::size_t e, const MarginalCovariances& covariances) const
{
  const Twist gap = ResidualOf(e), whitened = edges_[e].root * gap;
  const Information predicted = edges_[e].root * covariances.OfEdge(e) * edges_[e].root.transpose();
  if (!stands[e]) {
    const Information covariance = Information::Identity() + predicted;
    const Twist weighed = SolveSymmetric(covariance, whitened);
    return {DistanceMm(gap, p_.radiusMm), std::sqrt(whitened.dot(weighed))};
  }
  // It stands, and has pulled the prediction towards itself: that is taken back. Directions in which nothing but the edge
  // itself holds its volumes cannot be judged.
  const Information others = Information::Identity() - predicted;
  const SymmetricEigen solver = EigenOfSymmetric(others);
  Twist alone = Twist::Zero();
  double square = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double share = solver.values[i];
    if (share < 1e-6)
      continue;
    const double along = solver.vectors.col(i).dot(whitened);
    alone += solver.vectors.col(i) * (along / share);
    square += along * along / share;
  }
  return {DistanceMm(edges_[e].root.partialPivLu().solve(alone), p_.radiusMm), std::sqrt(square)};
}

// Least squares of the edges that stand, and which edges that makes stand, until both agree.
void Graph::Settle(const Flags& take, const Flags& keep)
{
  const Flags isFixed = IsRoot(take);
  std::vector<int> falls(edges_.size(), 0);
  for (int round = 0; round < Rounds; ++round) {
    MinimiseDisagreement(edges_, stands, isFixed, 0.0, poses);
    const MarginalCovariances covariances(edges_, stands, take, isFixed, poses);
    Flags next = stands;
    std::vector<std::pair<double, std::size_t>> bad; // minus the standard deviations: the worst first
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (!take[e] || (stands[e] && keep[e]) || (!stands[e] && falls[e] >= MostFalls))
        continue;
      const Gap gap = GapOf(e, covariances);
      const bool isGood = gap.mm <= p_.outlierMm || gap.sigmas <= p_.outlierSigmas;
      if (!stands[e])
        next[e] = isGood;
      else if (!isGood)
        bad.push_back({-gap.sigmas, e});
    }
    bool isChanged = next != stands;
    stands = next;
    if (!isChanged) {
      // What is wrong makes its neighbours look bad: of edges that share a volume only the worst goes.
      std::sort(bad.begin(), bad.end());
      Flags isTouched(poses.size(), false);
      for (const auto& [minusSigmas, e] : bad) {
        const std::size_t from = Index(edges_[e].from), to = Index(edges_[e].to);
        if (minusSigmas > 0.7 * bad.front().first || isTouched[from] || isTouched[to] || Bridges(stands)[e])
          continue;
        stands[e] = false;
        ++falls[e];
        isChanged = isTouched[from] = isTouched[to] = true;
      }
    }
    if (!isChanged)
      return;
  }
}

void Graph::Solve(const Flags& take, const Flags& keep, const Progress& progress)
{
  StartFromBestTree(take, keep);
  progress(0.4);
  stands = take;
  const Flags bridges = Bridges(take);
  bool hasCycles = false;
  for (std::size_t e = 0; e < edges_.size(); ++e)
    hasCycles = hasCycles || (take[e] && !bridges[e]);
  if (!hasCycles)
    return; // the tree is all there is, and is exact
  MinimiseDisagreement(edges_, take, IsRoot(take), p_.lossSigmas, poses);
  progress(0.6);
  std::vector<std::pair<double, std::size_t>> aside;
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (take[e] && !keep[e] && ResidualMm(e) > p_.outlierMm && ResidualSigmas(e) > p_.outlierSigmas) {
      stands[e] = false;
      aside.push_back({ResidualSigmas(e), e});
    }
  std::sort(aside.begin(), aside.end());
  JoinedSets<int> sets = Joined(stands);
  for (const auto& [sigmas, e] : aside)
    stands[e] = sets.Join(edges_[e].from, edges_[e].to); // nothing else joins its volumes
  Settle(take, keep);
  progress(1.0);
}

// Edges put aside that want the same motion of one part against another; each party twice, once for either part to move.
std::vector<Party> Graph::Parties(const Flags& asked) const
{
  const std::vector<int> roots = Roots(stands);
  std::vector<Party> parties;
  Flags isDone(edges_.size(), false);
  const auto motionOf = [&](std::size_t e) {
    return poses[Index(edges_[e].from)] * edges_[e].toInFrom * poses[Index(edges_[e].to)].inverse(Eigen::Isometry);
  };
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    if (!asked[e] || stands[e] || isDone[e])
      continue;
    Party party{{e}, {edges_[e].from}, {edges_[e].to}, motionOf(e)};
    isDone[e] = true;
    for (std::size_t other = e + 1; other < edges_.size(); ++other) {
      const WeighedEdge& edge = edges_[other];
      if (!asked[other] || stands[other] || isDone[other] || roots[Index(edge.from)] != roots[Index(edges_[e].from)])
        continue;
      const double gate = 2.0 * GateMm(edges_[e].variance + edge.variance);
      const Pose motion = motionOf(other);
      const auto differs = [&](const Pose& wanted) {
        const Pose gap = wanted.inverse(Eigen::Isometry) * party.motion;
        const Eigen::Vector3d centre = poses[Index(edge.to)] * (edge.fromInTo * edge.centre);
        Twist twist;
        twist.head<3>() = gap * centre - centre;
        twist.tail<3>() = LogRotation(gap.linear());
        return DistanceMm(twist, p_.radiusMm);
      };
      const bool isAlike = differs(motion) <= gate;
      if (!isAlike && differs(motion.inverse(Eigen::Isometry)) > gate)
        continue;
      party.edges.push_back(other);
      party.still.push_back(isAlike ? edge.from : edge.to);
      party.moved.push_back(isAlike ? edge.to : edge.from);
      isDone[other] = true;
    }
    parties.push_back(party);
    parties.push_back({party.edges, party.moved, party.still, party.motion.inverse(Eigen::Isometry)});
  }
  return parties;
}

// How few standing edges hold the party's moved ends to its still ends and to the root (at most one more than the party has
// edges), and which volumes would move; of all cuts that are as small, the one that moves most.
int Graph::Cut(const Party& party, Flags& isMoved) const
{
  const std::size_t volumes = poses.size();
  const int enough = static_cast<int>(party.edges.size()) + 1;
  const std::vector<int> roots = Roots(stands);
  const int root = roots[Index(party.still.front())];
  Flags isSource(volumes, false), isSink(volumes, false);
  isSource[Index(root)] = true;
  for (const int v : party.still)
    isSource[Index(v)] = true;
  for (const int v : party.moved)
    isSink[Index(v)] = true;
  for (std::size_t v = 0; v < volumes; ++v)
    if (isSource[v] && isSink[v])
      return enough;

  std::vector<int> flow(edges_.size(), 0); // at most one unit through an edge, either way
  for (int units = 0; units < enough; ++units) {
    Flags isReached = isSource;
    std::vector<std::size_t> arrivals(volumes, 0);
    std::queue<int> queue;
    for (std::size_t v = 0; v < volumes; ++v)
      if (isSource[v])
        queue.push(static_cast<int>(v));
    int at = -1;
    while (!queue.empty() && at < 0) {
      const int v = queue.front();
      queue.pop();
      for (const Neighbour& n : neighbours_[Index(v)]) {
        const bool isOpen = edges_[n.edge].from == v ? flow[n.edge] < 1 : flow[n.edge] > -1;
        if (!stands[n.edge] || isReached[Index(n.volume)] || !isOpen)
          continue;
        isReached[Index(n.volume)] = true;
        arrivals[Index(n.volume)] = n.edge;
        queue.push(n.volume);
        if (isSink[Index(n.volume)])
          at = n.volume;
      }
    }
    if (at < 0) {
      isMoved.assign(volumes, false);
      for (std::size_t v = 0; v < volumes; ++v)
        isMoved[v] = roots[v] == root && !isReached[v];
      return units;
    }
    while (!isSource[Index(at)]) {
      const std::size_t e = arrivals[Index(at)];
      flow[e] += edges_[e].to == at ? 1 : -1;
      at = edges_[e].to == at ? edges_[e].from : edges_[e].to;
    }
  }
  return enough;
}

// Parties that outnumber what holds them back get their way.
void Graph::Regroup(const Flags& take, const Progress& progress)
{
  for (int turn = 0; turn < Regroupings; ++turn) {
    progress(static_cast<double>(turn) / Regroupings);
    Flags isMoved;
    const std::vector<Party> parties = Parties(take);
    const auto party = std::find_if(parties.begin(), parties.end(),
                                    [&](const Party& one) { return Cut(one, isMoved) < static_cast<int>(one.edges.size()); });
    if (party == parties.end())
      return;
    for (std::size_t v = 0; v < poses.size(); ++v)
      if (isMoved[v])
        poses[v] = party->motion * poses[v];
    for (std::size_t e = 0; e < edges_.size(); ++e)
      stands[e] = stands[e] && isMoved[Index(edges_[e].from)] == isMoved[Index(edges_[e].to)];
    for (const std::size_t e : party->edges)
      stands[e] = true;
    Settle(take, Flags(edges_.size(), false)); // the others are not what they were
  }
}

// Parties that are as many as what holds them back.
void Graph::Contest(const Flags& asked, Flags& isContested, Flags& isDoubtful) const
{
  for (const Party& party : Parties(asked)) {
    Flags isMoved;
    if (Cut(party, isMoved) > static_cast<int>(party.edges.size()))
      continue;
    for (const std::size_t e : party.edges)
      isContested[e] = true;
    for (std::size_t v = 0; v < poses.size(); ++v)
      isDoubtful[v] = isDoubtful[v] || isMoved[v];
  }
}

void CheckGraph(const std::vector<Pose>& start, const std::vector<PoseEdge>& edges, int fixed)
{
  const auto check = [](bool good, const std::string& message) {
    if (!good)
      throw Error(Error::Kind::InvalidParameter, message);
  };
  const int volumes = static_cast<int>(start.size());
  CheckFixedVolume(fixed, start.size());
  for (int v = 0; v < volumes; ++v)
    check(start[Index(v)].matrix().allFinite() && IsRotation(start[Index(v)].linear()),
          "the start pose of volume " + std::to_string(v) + " is not a rotation and a translation");
  for (const PoseEdge& edge : edges) {
    const std::string name = "the edge " + std::to_string(edge.from) + "-" + std::to_string(edge.to);
    check(edge.from >= 0 && edge.from < volumes && edge.to >= 0 && edge.to < volumes && edge.from != edge.to,
          name + " does not join two of the " + std::to_string(volumes) + " volumes");
    check(edge.toInFrom.matrix().allFinite() && IsRotation(edge.toInFrom.linear()),
          name + ": its pose is not a rotation and a translation");
    check(edge.centre.allFinite() && edge.information.allFinite(), name + ": its centre and information must be finite");
  }
}

} // namespace

ParameterList Describe(PoseGraphParameters& p)
{
  return {
      Parameter("RadiusMm", p.radiusMm, {1, 10000}, "mm",
                "Where a rotation is felt: it counts as the distance that it moves points so far away."),
      Parameter("FloorMm", p.floorMm, {0, 100}, "mm", "Standard deviation added to every edge's own, at the radius."),
      Parameter("OutlierMm", p.outlierMm, {0, 1000}, "mm", "Edges that disagree by less are never wrong."),
      Parameter("OutlierSigmas", p.outlierSigmas, {0, 1000, true}, "standard deviations",
                "Nor are edges that disagree by less of their own."),
      Parameter("LossSigmas", p.lossSigmas, {0, 1000, true}, "standard deviations", "Scale of the robust (Cauchy) loss."),
      Parameter("UndeterminedMm", p.undeterminedMm, {0, 1000, true}, "mm",
                "A volume with a larger standard deviation in some direction beside its neighbours is not determined."),
      Parameter("Trees", p.trees, {1, 100000}, "", "Spanning trees that are tried as starts, at most."),
  };
}

PoseGraphResult SolvePoseGraph(const std::vector<Pose>& start, const std::vector<PoseEdge>& edges, int fixed,
                               const PoseGraphParameters& p, const Progress& progress)
{
  CheckRanges(p);
  CheckGraph(start, edges, fixed);
  const std::size_t volumes = start.size(), count = edges.size();
  std::vector<WeighedEdge> weighed;
  weighed.reserve(count);
  Flags isVerified(count), none(count, false), all(count, true);
  for (std::size_t e = 0; e < count; ++e) {
    weighed.emplace_back(edges[e], p);
    isVerified[e] = edges[e].verified;
  }
  const Pose toFixed = start[Index(fixed)].inverse(Eigen::Isometry);
  std::vector<Pose> local;
  for (const Pose& pose : start)
    local.push_back(toFixed * pose);
  local[Index(fixed)] = Pose::Identity();

  Graph graph(weighed, local, fixed, p);
  graph.Solve(isVerified, none, progress.Part(0.0, 0.5));
  graph.Regroup(isVerified, progress.Part(0.5, 0.7));
  if (isVerified != all) {
    // Those that nothing verified has to be asked about join what stands, which they cannot shake.
    const Flags stand = graph.stands;
    Flags take = stand;
    for (std::size_t e = 0; e < count; ++e)
      take[e] = take[e] || !isVerified[e];
    graph.Solve(take, stand, progress.Part(0.7, 0.9));
  }
  progress(0.9);

  PoseGraphResult result;
  result.volumeToWorld = start;
  result.isContested = result.isWrong = none;
  result.isBridge = graph.Bridges(graph.stands);
  result.isPlaced = result.isDoubtful = result.isDetermined = Flags(volumes, false);
  result.information.assign(volumes, Information::Zero());
  result.residualMm = result.residualSigmas = std::vector<double>(count, 0.0);
  graph.Contest(isVerified, result.isContested, result.isDoubtful);

  Flags isSure = graph.stands; // without the unverified edges that nothing confirms
  for (std::size_t e = 0; e < count; ++e)
    isSure[e] = isSure[e] && (isVerified[e] || !result.isBridge[e]);
  const std::vector<int> roots = graph.Roots(graph.stands), sureRoots = graph.Roots(isSure);
  for (std::size_t v = 0; v < volumes; ++v) {
    result.isPlaced[v] = roots[v] == fixed;
    result.isDoubtful[v] = result.isPlaced[v] && (result.isDoubtful[v] || sureRoots[v] != fixed);
    if (result.isPlaced[v] && static_cast<int>(v) != fixed)
      result.volumeToWorld[v] = start[Index(fixed)] * graph.poses[v];
  }
  double chiSquare = 0.0;
  int freedom = 0;
  for (std::size_t e = 0; e < count; ++e) {
    if (roots[Index(edges[e].from)] != fixed || roots[Index(edges[e].to)] != fixed)
      continue;
    result.residualMm[e] = graph.ResidualMm(e);
    result.residualSigmas[e] = graph.ResidualSigmas(e);
    result.isWrong[e] = !graph.stands[e];
    if (graph.stands[e]) {
      chiSquare += result.residualSigmas[e] * result.residualSigmas[e];
      freedom += 6;
    }
  }
  freedom -= 6 * (static_cast<int>(std::count(result.isPlaced.begin(), result.isPlaced.end(), true)) - 1);
  result.consistency = freedom > 0 ? std::sqrt(chiSquare / freedom) : 0.0;

  const MarginalCovariances covariances(weighed, graph.stands, none, graph.IsRoot(graph.stands), graph.poses);
  const Twist scale = (Twist() << 1.0, 1.0, 1.0, p.radiusMm, p.radiusMm, p.radiusMm).finished();
  const double doubt = std::max(1.0, result.consistency); // edges that disagree more than they claim are less sure of it
  const auto axes = [&](const Information& covariance) {
    return EigenOfSymmetric(Information(scale.asDiagonal() * (doubt * doubt * covariance) * scale.asDiagonal()));
  };
  // By edges that leave no direction open; what adds up along many of them is an error, and no open direction.
  JoinedSets<int> determined(volumes);
  for (std::size_t e = 0; e < count; ++e)
    if (graph.stands[e] && std::sqrt(axes(covariances.OfEdge(e)).values.maxCoeff()) <= p.undeterminedMm)
      determined.Join(edges[e].from, edges[e].to);
  for (int v = 0; v < static_cast<int>(volumes); ++v) {
    result.centre.push_back(start[Index(fixed)] * covariances.Centre(v));
    result.isDetermined[Index(v)] = determined.Of(v) == determined.Of(fixed);
    if (v == fixed || !result.isPlaced[Index(v)])
      continue;
    const SymmetricEigen solver = axes(covariances.OfVolume(v));
    const Information inverse = solver.vectors * solver.values.cwiseInverse().asDiagonal() * solver.vectors.transpose();
    result.information[Index(v)] = Turned(scale.asDiagonal() * inverse * scale.asDiagonal(), start[Index(fixed)].linear());
  }
  progress(1.0);
  return result;
}

} // namespace echorama
