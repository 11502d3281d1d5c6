// SPDX-License-Identifier: BSD-3-Clause
//
// From triangles to media, and how it survives bad meshes.
//
// 1. Shells (SceneShells): pieces of surfaces, mended. The sign of a shell's volume tells where its inside is. Only for bodies
// with
//    shells of both signs does a ray tell whether a negative one is a cavity or inside out.
// 2. Rays (SceneTree). Single precision about the middle of the scene; rays that start outside of its box begin where they enter
// it,
//    so that far-away probes cost no precision. All hits within the tolerance of the nearest one are taken together; per shell
//    the balance of entering and leaving counts. Reflected rays may meet again the surface that they left, by rounding:
//    entering what they are in, or leaving what they are not in, changes nothing.
// 3. Media of many points (SceneLattice).
//
// Cost: the tree dominates, some 0.4 s per million triangles on two cores.
#include "AcousticScene.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <tuple>

namespace echorama {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

} // namespace

AcousticScene::AcousticScene(const TissueSurface& surface, const Progress& progress, double creaseDegrees)
  : materials_(surface.materials)
{
  if (!(creaseDegrees >= 0.0 && creaseDegrees <= 180.0))
    throw Error(Error::Kind::InvalidParameter, "creaseDegrees must be in [0, 180]");
  surface.Check();
  for (const TissueSurface::Body& body : surface.bodies)
    materialOf_.push_back(body.material);
  const SceneShells parts(surface);
  shells_ = parts.shells;
  notes_ = parts.notes;
  centre_ = parts.centre;
  low_ = parts.low;
  high_ = parts.high;
  tolerance_ = parts.tolerance;
  progress(0.3);

  std::vector<std::uint32_t> kept; // those with an area
  kept.reserve(parts.triangles.size());
  for (std::size_t i = 0; i < parts.triangles.size(); ++i) {
    const auto& [a, b, c] = parts.triangles[i];
    if ((parts.Point(b) - parts.Point(a)).cross(parts.Point(c) - parts.Point(a)).squaredNorm() > 0.0)
      kept.push_back(static_cast<std::uint32_t>(i));
  }
  notes_.degenerateTriangles = static_cast<std::int64_t>(parts.triangles.size() - kept.size());
  if (kept.empty())
    return;
  tree_.emplace(parts.points, parts.triangles, kept);
  progress(0.7);
  const std::vector<CornerNormals> normals = MakeCornerNormals(parts.points, parts.triangles, kept, creaseDegrees);
  triangles_.reserve(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i)
    triangles_.push_back({parts.shellOf[kept[i]], normals[i]});
  FindCavities(parts);
  lattice_ = SceneLattice(*this, parts, progress.Part(0.7, 1.0));
}

std::size_t AcousticScene::MemoryBytes() const
{
  return static_cast<std::size_t>(tree_ ? std::max<std::int64_t>(0, tree_->Bytes()) : 0) +
         shells_.capacity() * sizeof(SceneShells::Shell) + triangles_.capacity() * sizeof(Triangle) + lattice_.Bytes();
}

// Which negative shells are cavities, and which are inside out.
void AcousticScene::FindCavities(const SceneShells& parts)
{
  for (std::size_t first = 0, next; first < shells_.size(); first = next) {
    double volume = 0.0;
    bool negative = false;
    for (next = first; next < shells_.size() && shells_[next].body == shells_[first].body; ++next) {
      if (shells_[next].sheet)
        continue;
      volume += shells_[next].volume;
      negative = negative || shells_[next].volume < 0.0;
    }
    if (!negative)
      continue;
    // The greatest first, for those within depend on it.
    std::vector<std::size_t> order;
    for (std::size_t s = first; s < next; ++s)
      if (!shells_[s].sheet)
        order.push_back(s);
    std::stable_sort(order.begin(), order.end(),
                     [this](std::size_t a, std::size_t b) { return std::abs(shells_[a].volume) > std::abs(shells_[b].volume); });
    for (const std::size_t s : order) {
      SceneShells::Shell& shell = shells_[s];
      const int said = (shell.volume < 0.0) != (volume < 0.0) ? -1 : 1;
      shell.sign = 1;
      if (said < 0) {
        int depth = 0;
        for (const std::int32_t holder : BodiesAt(centre_ + parts.Point(parts.triangles[shell.first][0]))) {
          const SceneShells::Shell& other = shells_[static_cast<std::size_t>(holder)];
          if (other.body == shell.body && std::abs(other.volume) > std::abs(shell.volume))
            depth += other.sign;
        }
        if (depth > 0)
          shell.sign = -1;
      }
      notes_.cavities += shell.sign < 0;
      notes_.turnedShells += (shell.volume < 0.0) != (shell.sign < 0);
    }
  }
}

SceneTree::Line AcousticScene::LineOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  SceneTree::Line line;
  const Eigen::Vector3d local = origin - centre_;
  double enter = -infinity, exit = infinity;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (local[axis] < low_[axis] || local[axis] > high_[axis])
        return line;
      continue;
    }
    const double a = (low_[axis] - local[axis]) / direction[axis], b = (high_[axis] - local[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, b));
    exit = std::min(exit, std::max(a, b));
  }
  if (!(enter <= exit))
    return line;
  line.base = std::max(enter, -tolerance_); // what touches the origin is met
  line.exit = exit;
  line.origin = (local + line.base * direction).cast<float>();
  line.direction = direction.cast<float>();
  return line;
}

bool AcousticScene::Meet(const SceneTree::Line& line, double from, double to, Meeting& meeting) const
{
  meeting.asked = 0;
  const double begin = std::max(from, line.base), end = std::min(to, line.exit);
  if (!(begin < end))
    return false;
  thread_local std::vector<SceneTree::Hit> hits;
  meeting.asked = 1;
  if (!tree_->FirstHits(line, static_cast<float>(begin - line.base), static_cast<float>(end - line.base),
                        static_cast<float>(tolerance_), hits))
    return false;

  meeting.changes.clear();
  for (const SceneTree::Hit& hit : hits) {
    const std::int32_t shell = triangles_[hit.triangle].shell;
    const SceneShells::Shell& about = shells_[static_cast<std::size_t>(shell)];
    const bool enters = (hit.normal.dot(line.direction) < 0.0f) == (about.facing > 0);
    const int change = about.sheet ? 0 : enters ? 1 : -1;
    const auto found = std::find_if(meeting.changes.begin(), meeting.changes.end(),
                                    [shell](const Meeting::Change& other) { return other.shell == shell; });
    if (found == meeting.changes.end())
      meeting.changes.push_back({shell, change, hit});
    else {
      found->balance += change;
      if (hit.triangle < found->hit.triangle)
        found->hit = hit;
    }
  }
  meeting.first = line.base + hits.front().distance;
  meeting.last = line.base + hits.back().distance;
  return true;
}

void AcousticScene::Pass(const Meeting& meeting, BodySet& inside)
{
  for (const Meeting::Change& change : meeting.changes)
    if (change.balance > 0)
      inside.Insert(change.shell);
    else if (change.balance < 0)
      inside.Erase(change.shell);
}

int AcousticScene::MediumOf(const BodySet& inside) const
{
  const std::int32_t* next = inside.end();
  while (next != inside.begin()) {
    const std::int32_t body = shells_[static_cast<std::size_t>(next[-1])].body;
    int depth = 0;
    for (; next != inside.begin() && shells_[static_cast<std::size_t>(next[-1])].body == body; --next)
      depth += shells_[static_cast<std::size_t>(next[-1])].sign;
    if (depth > 0)
      return materialOf_[static_cast<std::size_t>(body)];
  }
  return 0;
}

BodySet AcousticScene::BodiesAt(const Eigen::Vector3d& point) const
{
  BodySet result;
  const Eigen::Vector3d local = point - centre_;
  if (Empty() || (local.array() < low_.array()).any() || (local.array() > high_.array()).any())
    return result;
  // Directions that no modeller would choose. Along each, the first meeting with a shell tells whether it holds the point.
  static const std::array<Eigen::Vector3d, 5> directions{
      Eigen::Vector3d(0.3127, 0.1733, 0.9339).normalized(), Eigen::Vector3d(-0.8151, 0.5367, 0.2183).normalized(),
      Eigen::Vector3d(0.2719, -0.9263, -0.2609).normalized(), Eigen::Vector3d(0.7457, 0.4079, -0.5267).normalized(),
      Eigen::Vector3d(-0.4637, -0.2381, -0.8534).normalized()};
  std::map<std::int32_t, int> votes;
  const auto ask = [&](const Eigen::Vector3d& direction) {
    BodySet seen;
    EachMeeting(LineOf(point, direction), 0.0, infinity, [&](const Meeting& meeting) {
      for (const Meeting::Change& change : meeting.changes)
        if (change.balance != 0 && !seen.Contains(change.shell)) {
          seen.Insert(change.shell);
          if (change.balance < 0)
            ++votes[change.shell];
        }
    });
  };
  for (int i = 0; i < 3; ++i)
    ask(directions[static_cast<std::size_t>(i)]);
  int needed = 2;
  if (std::any_of(votes.begin(), votes.end(), [](const auto& vote) { return vote.second < 3; })) {
    ask(directions[3]);
    ask(directions[4]);
    needed = 3;
  }
  for (const auto& [shell, count] : votes)
    if (count >= needed)
      result.Insert(shell);
  return result;
}

bool AcousticScene::NextCrossing(SceneRay& ray, double limit, Crossing& crossing) const
{
  if (Empty())
    return false;
  const SceneTree::Line line = LineOf(ray.origin, ray.direction);
  if (line.exit < line.base)
    return false;
  const bool begins = ray.passed == 0.0;
  double from = !begins ? ray.passed : ray.fromSurface ? tolerance_ : -tolerance_;
  const int before = MediumOf(ray.inside);
  thread_local Meeting meeting;
  for (;;) {
    const bool met = Meet(line, from, limit, meeting);
    ray.asked += meeting.asked;
    if (!met)
      return false;
    ray.came = ray.inside;
    Pass(meeting, ray.inside);
    from = meeting.first + tolerance_;
    ray.passed = std::max(from, tolerance_);
    const int after = MediumOf(ray.inside);
    const Meeting::Change* border = nullptr;
    crossing.sheet = -1;
    for (const Meeting::Change& change : meeting.changes) {
      const SceneShells::Shell& shell = shells_[static_cast<std::size_t>(change.shell)];
      if (shell.sheet) { // not the one that the ray has just left, which it may graze by rounding
        const double cosine = std::abs(change.hit.normal.normalized().dot(line.direction));
        if (ray.fromSurface && begins && meeting.first * cosine < tolerance_)
          continue;
        crossing.sheet = materialOf_[static_cast<std::size_t>(shell.body)];
      } else if (change.balance == 0)
        continue;
      if (!border || change.hit.triangle < border->hit.triangle)
        border = &change;
    }
    if (!border || (before == after && crossing.sheet < 0))
      continue;
    if (before != after)
      crossing.sheet = -1; // a border counts more
    crossing.distance = std::max(0.0, meeting.first);
    crossing.behind = std::max(0.0, meeting.last);
    crossing.before = before;
    crossing.after = after;
    std::tie(crossing.facet, crossing.normal) =
        NormalsAt(triangles_[border->hit.triangle].normals, border->hit.normal.cast<double>().normalized(), border->hit.u,
                  border->hit.v, ray.direction);
    return true;
  }
}

} // namespace echorama
