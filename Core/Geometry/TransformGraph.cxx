// SPDX-License-Identifier: BSD-3-Clause
// A breadth-first search from one frame finds the shortest ways to all others; neighbours are visited in the order of their
// names, so that among equally short ways the first in that order wins. The same search gives the spanning trees whose missing
// edges close the fundamental cycles: when all of these close, every cycle does. Graphs have a dozen edges; nothing is kept.
#include "Core/Geometry/TransformGraph.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <Eigen/SVD>
#include <limits>

namespace echorama {
namespace {

bool IsBlank(char c)
{
  return static_cast<unsigned char>(c) <= ' ' || c == '\x7f';
}

bool IsFrameName(std::string_view name)
{
  return !name.empty() && std::none_of(name.begin(), name.end(), IsBlank);
}

bool IsLower(char c)
{
  return c >= 'a' && c <= 'z';
}

std::string Capitalized(std::string_view name)
{
  std::string text(name);
  if (IsLower(text[0]))
    text[0] = static_cast<char>(text[0] - 'a' + 'A');
  return text;
}

// To within the rounding of doubles, whatever the units of the frames.
bool IsInvertible(const Eigen::Affine3d& matrix)
{
  if (!matrix.matrix().allFinite())
    return false;
  const Eigen::Vector3d sizes = matrix.linear().jacobiSvd().singularValues();
  return sizes[2] > 1e-12 * sizes[0];
}

// Missing last: it is the worst.
int Badness(TransformStatus status)
{
  return status == TransformStatus::Valid ? 0 : status == TransformStatus::OutOfRange ? 1 : 2;
}

std::string Rounded(double value)
{
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 3).ptr);
}

} // namespace

TransformStatus TransformStatusOf(std::string_view word)
{
  std::string upper;
  for (const char c : word)
    upper += IsLower(c) ? static_cast<char>(c - 'a' + 'A') : c;
  if (upper.compare(0, 5, "TOOL_") == 0)
    upper.erase(0, 5);
  return upper == "OK"                                        ? TransformStatus::Valid
         : upper == "OUT_OF_VIEW" || upper == "OUT_OF_VOLUME" ? TransformStatus::OutOfRange
                                                              : TransformStatus::Missing;
}

const char* TransformStatusText(TransformStatus status)
{
  return status == TransformStatus::Valid ? "OK" : status == TransformStatus::OutOfRange ? "OUT_OF_VIEW" : "MISSING";
}

std::string NamedTransform::Complaint() const
{
  if (!IsFrameName(from) || !IsFrameName(to))
    return "the frames \"" + from + "\" and \"" + to + "\" need names without blanks";
  if (from == to)
    return Name() + " leads from a frame to itself";
  if (status == TransformStatus::Valid) { // else the matrix says nothing
    if (!matrix.matrix().allFinite())
      return Name() + ": the matrix holds a number that is not finite";
    if (matrix.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
      return Name() + ": the last row of the matrix is not 0 0 0 1";
  }
  if (errorMm && !(*errorMm >= 0.0 && std::isfinite(*errorMm)))
    return Name() + ": the error is negative or not finite";
  return {};
}

std::optional<std::pair<std::string, std::string>> FramesOf(std::string_view name)
{
  constexpr std::string_view suffix = "Transform";
  if (name.size() > suffix.size() && name.substr(name.size() - suffix.size()) == suffix)
    name.remove_suffix(suffix.size());
  if (!IsFrameName(name))
    return {};
  std::size_t cut = std::string_view::npos;
  for (std::size_t at = name.find("To"); at != std::string_view::npos; at = name.find("To", at + 2)) {
    if (at + 2 >= name.size() || IsLower(name[at + 2]))
      continue;
    if (cut != std::string_view::npos)
      return {};
    cut = at;
  }
  if (cut == std::string_view::npos || cut == 0)
    return {};
  const std::string_view from = name.substr(0, cut), to = name.substr(cut + 2);
  if (to.find(suffix) != std::string_view::npos) // "ImageToProbeTransformStatus"
    return {};
  return std::pair(Capitalized(from), Capitalized(to));
}

std::string ComposedTransform::PathText() const
{
  return Joined(path);
}

std::string OpenCycle::Text() const
{
  return "the cycle " + Joined(edges) + " does not close: it is off by " + Rounded(mm) + " mm and " + Rounded(degrees) +
         " degrees in " + frame;
}

TransformGraph::TransformGraph(const std::vector<NamedTransform>& edges)
{
  for (const NamedTransform& edge : edges)
    Set(edge);
}

void TransformGraph::Set(const NamedTransform& edge)
{
  if (const std::string complaint = edge.Complaint(); !complaint.empty())
    throw Error(Error::Kind::BadInput, complaint);
  edges_[{edge.from, edge.to}] = edge;
  neighbours_[edge.from].insert(edge.to);
  neighbours_[edge.to].insert(edge.from);
}

std::string TransformGraph::Step::Name() const
{
  return (inverse ? "inverse of " : "") + edge->Name();
}

Eigen::Affine3d TransformGraph::Step::Matrix() const
{
  if (!inverse)
    return edge->matrix;
  if (IsInvertible(edge->matrix))
    return edge->matrix.inverse();
  Eigen::Affine3d none = Eigen::Affine3d::Identity();
  none.affine().setConstant(std::numeric_limits<double>::quiet_NaN());
  return none;
}

// One step to each neighbour, the neighbours in the order of their names. Only where it can be walked both ways and is Valid,
// or wherever it can be walked: what is not Valid leads on, so that a way is the same with and without a measurement.
std::vector<TransformGraph::Step> TransformGraph::StepsFrom(const std::string& frame, bool trustedOnly) const
{
  const auto isSafe = [](const NamedTransform* edge) {
    return edge->status == TransformStatus::Valid && IsInvertible(edge->matrix);
  };
  std::vector<Step> steps;
  for (const std::string& next : neighbours_.at(frame)) {
    const NamedTransform* along = Edge(frame, next);
    const NamedTransform* against = Edge(next, frame);
    // Of the two edges of a pair the one that is Valid counts; of equals, the one that points along.
    const bool turned = against && isSafe(against) && along && along->status != TransformStatus::Valid;
    if (along && !turned && (!trustedOnly || isSafe(along)))
      steps.push_back({along, false});
    else if (against && (isSafe(against) || (!trustedOnly && against->status != TransformStatus::Valid)))
      steps.push_back({against, true});
  }
  return steps;
}

// For each frame that a way leads to from \a root: the last step of that way.
std::map<std::string, TransformGraph::Step> TransformGraph::Tree(const std::string& root, bool trustedOnly) const
{
  std::map<std::string, Step> tree{{root, Step()}};
  for (std::deque<std::string> queue{root}; !queue.empty(); queue.pop_front())
    for (const Step& step : StepsFrom(queue.front(), trustedOnly)) {
      const std::string& next = step.inverse ? step.edge->from : step.edge->to;
      if (tree.emplace(next, step).second)
        queue.push_back(next);
    }
  return tree;
}

std::vector<TransformGraph::Step> TransformGraph::Way(const std::map<std::string, Step>& tree, std::string to)
{
  std::vector<Step> way;
  for (Step step = tree.at(to); step.edge; step = tree.at(to))
    to = way.emplace_back(step).From();
  std::reverse(way.begin(), way.end());
  return way;
}

ComposedTransform TransformGraph::Find(const std::string& from, const std::string& to) const
{
  for (const std::string& frame : {from, to})
    if (neighbours_.count(frame) == 0)
      throw Error(Error::Kind::BadInput, "there is no frame \"" + frame + "\"; " +
                                             (Empty() ? "there are none at all" : "the frames are " + Joined(Frames())));
  const std::map<std::string, Step> tree = Tree(from, false);
  if (tree.count(to) == 0) {
    const std::vector<std::string> reachable = ReachableFrom(from);
    throw Error(Error::Kind::NotPossible, "no transforms lead from " + from + " to " + to + "; " +
                                              (reachable.empty() ? "none leads anywhere" : "they lead to " + Joined(reachable)));
  }
  ComposedTransform result;
  result.errorIsComplete = true;
  double squares = 0.0;
  for (const Step& step : Way(tree, to)) {
    result.matrix = step.Matrix() * result.matrix;
    if (Badness(step.edge->status) > Badness(result.status))
      result.status = step.edge->status;
    if (step.edge->errorMm) {
      squares += *step.edge->errorMm * *step.edge->errorMm;
      result.errorMm = std::sqrt(squares);
    } else {
      result.errorIsComplete = false;
    }
    result.path.push_back(step.Name());
  }
  return result;
}

std::vector<OpenCycle> TransformGraph::CheckCycles(const CycleTolerance& tolerance) const
{
  std::vector<OpenCycle> open;
  std::map<std::string, std::map<std::string, Step>> trees; // by the first frame of each component
  std::map<std::string, std::string> rootOf;
  for (const auto& [frame, neighbours] : neighbours_) {
    if (rootOf.count(frame) != 0)
      continue;
    for (const auto& reached : trees[frame] = Tree(frame, true))
      rootOf.emplace(reached.first, frame);
  }

  for (const auto& item : edges_) {
    const NamedTransform& edge = item.second;
    if (edge.status != TransformStatus::Valid || !IsInvertible(edge.matrix))
      continue;
    const std::map<std::string, Step>& tree = trees.at(rootOf.at(edge.from));
    const auto treeEdge = [&tree, self = &edge](const std::string& frame) { return tree.at(frame).edge == self; };
    if (tree.count(edge.to) == 0 || treeEdge(edge.from) || treeEdge(edge.to))
      continue;

    // Along the edge, then back through the tree, without the stretch to the root that both ways share.
    std::vector<Step> there = Way(tree, edge.from), back = Way(tree, edge.to);
    std::size_t shared = 0;
    while (shared < std::min(there.size(), back.size()) && there[shared].edge == back[shared].edge)
      ++shared;
    std::vector<Step> cycle{{&edge, false}};
    for (std::size_t i = back.size(); i > shared; --i)
      cycle.push_back({back[i - 1].edge, !back[i - 1].inverse});
    cycle.insert(cycle.end(), there.begin() + static_cast<std::ptrdiff_t>(shared), there.end());

    // Where along it is the unit largest? Coordinates grow by the scale of each step, the unit shrinks.
    double logUnit = 0.0, largest = 0.0;
    std::size_t begin = 0;
    for (std::size_t i = 0; i + 1 < cycle.size(); ++i) {
      logUnit -= std::log(std::abs(cycle[i].Matrix().linear().determinant())) / 3.0;
      if (logUnit > largest + 1e-3) {
        largest = logUnit;
        begin = i + 1;
      }
    }
    std::rotate(cycle.begin(), cycle.begin() + static_cast<std::ptrdiff_t>(begin), cycle.end());

    OpenCycle result;
    result.frame = cycle.front().From();
    Eigen::Affine3d product = Eigen::Affine3d::Identity();
    for (const Step& step : cycle) {
      product = step.Matrix() * product;
      result.edges.push_back(step.Name());
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> change(product.linear() - Eigen::Matrix3d::Identity());
    result.mm = product.translation().norm() + tolerance.leverMm * change.singularValues()[0];
    result.degrees = DegreesPerRadian * std::abs(Eigen::AngleAxisd(product.rotation()).angle());
    if (!(result.mm <= tolerance.mm && result.degrees <= tolerance.degrees)) // NaN does not close either
      open.push_back(result);
  }
  return open;
}

std::vector<std::string> TransformGraph::Frames() const
{
  std::vector<std::string> frames;
  for (const auto& [frame, neighbours] : neighbours_)
    frames.push_back(frame);
  return frames;
}

std::vector<NamedTransform> TransformGraph::Edges() const
{
  std::vector<NamedTransform> edges;
  for (const auto& [name, edge] : edges_)
    edges.push_back(edge);
  return edges;
}

std::vector<std::string> TransformGraph::ReachableFrom(const std::string& frame) const
{
  std::vector<std::string> reachable;
  if (neighbours_.count(frame) != 0)
    for (const auto& [reached, step] : Tree(frame, false))
      if (reached != frame)
        reachable.push_back(reached);
  return reachable;
}

const NamedTransform* TransformGraph::Edge(const std::string& from, const std::string& to) const
{
  const auto found = edges_.find({from, to});
  return found == edges_.end() ? nullptr : &found->second;
}

} // namespace echorama
