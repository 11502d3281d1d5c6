// SPDX-License-Identifier: BSD-3-Clause
// 1. Triangles of a body that share corners are one shell (union-find). A sum of signed hashes of the directed edges is zero
//    just when each edge is passed both ways, so closed and consistent shells, the usual case, cost one pass and no sort.
// 2. For bodies where it is not, equal points are welded and the test is made again; shells that still fail have their edges
//    sorted, triangles turned to agree with their neighbours, and their holes measured.
// 3. The sign of a shell's volume tells where its inside is, whatever the order of corners.
#include "SceneShells.h"
#include <algorithm>
#include <Eigen/Geometry>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace echorama {
namespace {

constexpr double step = 1.0 / 8388608.0; // of single precision
constexpr double leak = 0.1;             // share of its area that the holes of a shell may have

std::uint64_t Mixed(std::uint64_t x)
{
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// Of the edge from a to b; the other way round it has the other sign.
std::uint64_t EdgeHash(std::uint32_t a, std::uint32_t b)
{
  if (a == b)
    return 0;
  const std::uint64_t hash = Mixed((static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b)) + 0x9e3779b97f4a7c15u);
  return a < b ? hash : 0u - hash;
}

// Union-find with path halving.
struct Groups {
  explicit Groups(std::size_t count) : parent(count) { std::iota(parent.begin(), parent.end(), 0u); }
  std::uint32_t Root(std::uint32_t i)
  {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  }
  void Join(std::uint32_t a, std::uint32_t b)
  {
    a = Root(a);
    b = Root(b);
    parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<std::uint32_t> parent;
};

} // namespace

SceneShells::SceneShells(const TissueSurface& surface) : triangles(surface.triangles)
{
  if (triangles.empty())
    return;
  Eigen::Vector3f least = surface.points[triangles[0][0]], most = least;
  for (const Corners& triangle : triangles)
    for (const std::uint32_t corner : triangle) {
      least = least.cwiseMin(surface.points[corner]);
      most = most.cwiseMax(surface.points[corner]);
    }
  centre = 0.5 * (least.cast<double>() + most.cast<double>());
  const double reach = std::max<double>(least.cwiseAbs().maxCoeff(), most.cwiseAbs().maxCoeff());
  const double size = (most - least).cast<double>().norm();
  tolerance = std::max(1e-9, step * (4.0 * reach + 8.0 * size));
  high = 0.5 * (most.cast<double>() - least.cast<double>()) + Eigen::Vector3d::Constant(2.0 * tolerance);
  low = -high;

  points.reserve(surface.points.size());
  for (const Eigen::Vector3f& point : surface.points)
    points.emplace_back((point.cast<double>() - centre).cast<float>());

  // A point that several bodies share becomes one for each.
  std::vector<std::int32_t> user(points.size(), -1);
  std::unordered_map<std::uint64_t, std::uint32_t> copies;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const std::int32_t body = surface.bodyOfTriangle[i];
    for (std::uint32_t& corner : triangles[i]) {
      if (user[corner] < 0)
        user[corner] = body;
      if (user[corner] == body)
        continue;
      const std::uint64_t key = static_cast<std::uint64_t>(corner) << 32 | static_cast<std::uint32_t>(body);
      const auto [found, isNew] = copies.try_emplace(key, static_cast<std::uint32_t>(points.size()));
      if (isNew) {
        const Eigen::Vector3f point = points[corner];
        points.push_back(point);
      }
      corner = found->second;
    }
  }

  Split(surface);
  if (std::any_of(shells.begin(), shells.end(), [](const Shell& shell) { return shell.balance != 0; })) {
    Weld(surface);
    Split(surface);
    std::vector<std::vector<std::uint32_t>> members(shells.size());
    for (std::size_t i = 0; i < triangles.size(); ++i)
      if (shells[static_cast<std::size_t>(shellOf[i])].balance != 0)
        members[static_cast<std::size_t>(shellOf[i])].push_back(static_cast<std::uint32_t>(i));
    for (std::size_t s = 0; s < shells.size(); ++s)
      if (!members[s].empty())
        Mend(static_cast<std::int32_t>(s), members[s]);
  }
  Measure();
  notes.shells = static_cast<int>(shells.size());
}

void SceneShells::Split(const TissueSurface& surface)
{
  Groups groups(points.size());
  for (const auto& [a, b, c] : triangles) {
    groups.Join(a, b);
    groups.Join(b, c);
  }
  // Numbered in the order of bodies, then of triangles.
  std::vector<std::int32_t> shellOfRoot(points.size(), -1);
  std::vector<Shell> found;
  shellOf.resize(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::int32_t& shell = shellOfRoot[groups.Root(triangles[i][0])];
    if (shell < 0) {
      shell = static_cast<std::int32_t>(found.size());
      found.emplace_back();
      found.back().body = surface.bodyOfTriangle[i];
      found.back().first = static_cast<std::uint32_t>(i);
    }
    shellOf[i] = shell;
    const auto& [a, b, c] = triangles[i];
    found[static_cast<std::size_t>(shell)].balance += EdgeHash(a, b) + EdgeHash(b, c) + EdgeHash(c, a);
  }
  std::vector<std::int32_t> order(found.size()), rank(found.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&found](std::int32_t a, std::int32_t b) {
    return found[static_cast<std::size_t>(a)].body < found[static_cast<std::size_t>(b)].body;
  });
  shells.clear();
  for (const std::int32_t shell : order) {
    rank[static_cast<std::size_t>(shell)] = static_cast<std::int32_t>(shells.size());
    shells.push_back(found[static_cast<std::size_t>(shell)]);
  }
  for (std::int32_t& shell : shellOf)
    shell = rank[static_cast<std::size_t>(shell)];
}

// Equal points of a body become one, in bodies that seem to be open.
void SceneShells::Weld(const TissueSurface& surface)
{
  std::vector<char> open(surface.bodies.size(), 0);
  for (const Shell& shell : shells)
    if (shell.balance != 0)
      open[static_cast<std::size_t>(shell.body)] = 1;
  using Key = std::pair<std::int32_t, std::array<float, 3>>;
  struct Hash {
    std::size_t operator()(const Key& key) const
    {
      std::uint64_t hash = static_cast<std::uint64_t>(key.first);
      for (const float number : key.second)
        hash = Mixed(hash * 31 + std::hash<float>()(number) + 1);
      return static_cast<std::size_t>(hash);
    }
  };
  std::unordered_map<Key, std::uint32_t, Hash> places;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto body = surface.bodyOfTriangle[i];
    if (!open[static_cast<std::size_t>(body)])
      continue;
    for (std::uint32_t& corner : triangles[i]) {
      const Eigen::Vector3f& p = points[corner];
      corner = places.try_emplace({body, {p[0], p[1], p[2]}}, corner).first->second;
    }
  }
}

// Turns triangles to agree with their neighbours, and measures holes.
void SceneShells::Mend(std::int32_t shell, const std::vector<std::uint32_t>& members)
{
  struct Edge {
    std::uint32_t low, high, triangle;
    bool up; // passed from low to high
  };
  std::vector<Edge> edges;
  edges.reserve(3 * members.size());
  for (std::uint32_t m = 0; m < members.size(); ++m)
    for (int side = 0; side < 3; ++side) {
      const std::uint32_t a = triangles[members[m]][static_cast<std::size_t>(side)];
      const std::uint32_t b = triangles[members[m]][static_cast<std::size_t>((side + 1) % 3)];
      if (a != b)
        edges.push_back({std::min(a, b), std::max(a, b), m, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });

  struct Neighbour {
    std::uint32_t triangle;
    bool agrees;
  };
  std::vector<std::vector<Neighbour>> neighbours(members.size());
  std::vector<Edge> border;
  for (std::size_t i = 0, next; i < edges.size(); i = next) {
    for (next = i + 1; next < edges.size() && edges[next].low == edges[i].low && edges[next].high == edges[i].high;)
      ++next;
    if (next - i == 1)
      border.push_back(edges[i]);
    if (next - i != 2)
      continue;
    const bool agrees = edges[i].up != edges[i + 1].up;
    neighbours[edges[i].triangle].push_back({edges[i + 1].triangle, agrees});
    neighbours[edges[i + 1].triangle].push_back({edges[i].triangle, agrees});
  }

  std::vector<signed char> turned(members.size(), -1); // not yet seen
  std::vector<std::uint32_t> queue;
  bool anyTurned = false;
  for (std::uint32_t seed = 0; seed < members.size(); ++seed) {
    if (turned[seed] >= 0)
      continue;
    turned[seed] = 0;
    queue.assign(1, seed);
    std::size_t count = 0;
    for (std::size_t i = 0; i < queue.size(); ++i)
      for (const Neighbour& other : neighbours[queue[i]])
        if (turned[other.triangle] < 0) {
          turned[other.triangle] = other.agrees ? turned[queue[i]] : !turned[queue[i]];
          count += turned[other.triangle] == 1;
          queue.push_back(other.triangle);
        }
    anyTurned = anyTurned || count > 0;
    if (2 * count > queue.size()) // the fewer are wrong
      for (const std::uint32_t m : queue)
        turned[m] = !turned[m];
  }
  for (std::size_t m = 0; m < members.size(); ++m)
    if (turned[m])
      std::swap(triangles[members[m]][1], triangles[members[m]][2]);
  notes.turnedShells += anyTurned;
  if (border.empty())
    return;

  // Each loop of border edges encloses an area, as a vector.
  std::unordered_map<std::uint32_t, std::uint32_t> local;
  for (const Edge& edge : border) {
    local.try_emplace(edge.low, static_cast<std::uint32_t>(local.size()));
    local.try_emplace(edge.high, static_cast<std::uint32_t>(local.size()));
  }
  Groups loops(local.size());
  for (const Edge& edge : border)
    loops.Join(local[edge.low], local[edge.high]);
  std::vector<Eigen::Vector3d> areas(local.size(), Eigen::Vector3d::Zero());
  const Eigen::Vector3d origin = Point(border[0].low);
  for (const Edge& edge : border) {
    const Eigen::Vector3d normal = (Point(edge.low) - origin).cross(Point(edge.high) - origin);
    areas[loops.Root(local[edge.low])] += edge.up != (turned[edge.triangle] == 1) ? normal : Eigen::Vector3d(-normal);
  }
  double hole = 0.0, area = 0.0;
  for (const Eigen::Vector3d& vector : areas)
    hole += 0.5 * vector.norm();
  for (const std::uint32_t i : members)
    area += 0.5 * (Point(triangles[i][1]) - Point(triangles[i][0])).cross(Point(triangles[i][2]) - Point(triangles[i][0])).norm();
  const bool sheet = hole > leak * area;
  shells[static_cast<std::size_t>(shell)].sheet = sheet;
  ++(sheet ? notes.sheets : notes.leakyShells);
}

void SceneShells::Measure()
{
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Shell& shell = shells[static_cast<std::size_t>(shellOf[i])];
    const Eigen::Vector3d origin = Point(triangles[shell.first][0]);
    const Eigen::Vector3d a = Point(triangles[i][0]) - origin, b = Point(triangles[i][1]) - origin,
                          c = Point(triangles[i][2]) - origin;
    shell.volume += a.dot(b.cross(c)) / 6.0;
    shell.area += 0.5 * (b - a).cross(c - a).norm();
  }
  for (Shell& shell : shells)
    shell.facing = shell.volume < 0.0 ? -1 : 1;
}

} // namespace echorama
