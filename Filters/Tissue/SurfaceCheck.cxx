// SPDX-License-Identifier: BSD-3-Clause
// Edges: all three of every triangle are sorted by their points, so that those of one edge lie together: one is open, two are
// neighbours, more are a crowd.
//
// Orientation: a flood over neighbours says of each triangle whether it faces the same side as the first of its component; the
// sign of the component's volume then says which side is outside. Components inside an odd number of others are cavities. That is
// found by rays from some of their points: nearly all must cross another component an odd number of times, so that components
// which overlap are not taken for nested.
//
// Self-intersections: a tree of boxes yields the pairs whose boxes meet, and signs of volumes of tetrahedra tell whether an
// edge of one goes through the other. Signs within the rounding error count as zero, and zero as touching.
//
// Holes: open edges, followed against the way of their triangles, run around each hole, which triangles about its middle cover.
#include "SurfaceCheck.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace echorama {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Corners = std::array<std::uint32_t, 3>;
using FloatBox = Eigen::AlignedBox3f;

class Mesh {
public:
  explicit Mesh(const TriangleSurface& surface) : surface_(surface) {}
  std::size_t Size() const { return surface_.triangles.size(); }
  const Corners& At(std::size_t triangle) const { return surface_.triangles[triangle]; }
  Vector3d Point(std::uint32_t point) const { return surface_.points[point].cast<double>(); }
  Vector3d Corner(std::size_t triangle, int corner) const { return Point(At(triangle)[static_cast<std::size_t>(corner)]); }
  Vector3f Middle(std::size_t triangle) const
  {
    return ((Corner(triangle, 0) + Corner(triangle, 1) + Corner(triangle, 2)) / 3.0).cast<float>();
  }
  FloatBox Bounds(std::size_t triangle) const
  {
    FloatBox box;
    for (const std::uint32_t corner : At(triangle))
      box.extend(surface_.points[corner]);
    return box;
  }
  bool IsFinite(std::size_t triangle) const
  {
    const auto& [a, b, c] = At(triangle);
    return surface_.points[a].allFinite() && surface_.points[b].allFinite() && surface_.points[c].allFinite();
  }
  bool IsDegenerate(std::size_t triangle) const
  {
    const auto& [a, b, c] = At(triangle);
    if (a == b || b == c || c == a || !IsFinite(triangle))
      return true;
    const Vector3d p = Point(b) - Point(a), q = Point(c) - Point(a);
    const double longest = std::max({p.squaredNorm(), q.squaredNorm(), (p - q).squaredNorm()});
    return !(p.cross(q).norm() > 1e-6 * longest); // about as flat as the rounding of floats
  }

private:
  const TriangleSurface& surface_;
};

void CheckIndices(const TriangleSurface& surface)
{
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    for (const std::uint32_t corner : surface.triangles[i])
      if (corner >= surface.points.size())
        throw Error(Error::Kind::BadInput, "the surface has a triangle (" + std::to_string(i) + ") with a corner (" +
                                               std::to_string(corner) + ") that is none of its " +
                                               std::to_string(surface.points.size()) + " points");
}

// ---------------------------------------------------------------------------------------------------------------- edges

struct Edge {
  std::uint32_t low, high; // points
  std::uint32_t triangle;
  bool upwards; // whether the triangle goes from low to high
};

std::vector<Edge> SortedEdges(const Mesh& mesh)
{
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.Size());
  for (std::size_t i = 0; i < mesh.Size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.At(i)[k], to = mesh.At(i)[(k + 1) % 3];
      if (from != to)
        edges.push_back({std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(i), from < to});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

// Calls visit(first, last) for the triangles of each edge.
template <class Function>
void ForEachEdge(const std::vector<Edge>& edges, const Function& visit)
{
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first + 1;
    while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high)
      ++last;
    visit(&edges[first], &edges[last]);
    first = last;
  }
}

// ---------------------------------------------------------------------------------------------------------------- tree

// Triangles in a tree of boxes, halved at the median of their middles along the longest side.
class Tree {
public:
  explicit Tree(const Mesh& mesh) : mesh_(mesh)
  {
    for (std::size_t i = 0; i < mesh.Size(); ++i)
      if (!mesh.IsDegenerate(i))
        order_.push_back(static_cast<std::uint32_t>(i));
    boxes_.resize(mesh.Size());
    for (const std::uint32_t i : order_)
      boxes_[i] = mesh.Bounds(i);
    nodes_.reserve(order_.size());
    if (!order_.empty())
      Build(0, order_.size());
  }

  // Calls visit(triangle) for all whose box meets one.
  template <class Function>
  void Meet(const FloatBox& box, const Function& visit) const
  {
    Walk([&box](const FloatBox& other) { return box.intersects(other); }, visit);
  }

  // Calls visit(triangle) for all that a ray crosses.
  template <class Function>
  void Cross(const Vector3d& origin, const Vector3d& direction, const Function& visit) const
  {
    const Vector3d inverse = direction.cwiseInverse();
    Walk(
        [&](const FloatBox& box) {
          const Eigen::Array3d a = ((box.min().cast<double>() - origin).cwiseProduct(inverse)).array();
          const Eigen::Array3d b = ((box.max().cast<double>() - origin).cwiseProduct(inverse)).array();
          return a.min(b).maxCoeff() <= a.max(b).minCoeff() && a.max(b).minCoeff() >= 0.0;
        },
        [&](std::uint32_t i) {
          const Vector3d a = mesh_.Corner(i, 0), p = mesh_.Corner(i, 1) - a, q = mesh_.Corner(i, 2) - a;
          const Vector3d normal = direction.cross(q);
          const double scale = p.dot(normal);
          const Vector3d from = (origin - a) / scale, turned = from.cross(p);
          const double u = from.dot(normal), v = direction.dot(turned);
          if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && q.dot(turned) > 0.0)
            visit(i);
        });
  }

  const FloatBox& BoxOf(std::size_t triangle) const { return boxes_[triangle]; }

private:
  struct Node {
    FloatBox box;
    std::uint32_t first, last; // of order_
    std::uint32_t right;       // the left one follows; 0: a leaf
  };

  std::uint32_t Build(std::size_t first, std::size_t last)
  {
    const auto self = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({FloatBox(), static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last), 0});
    FloatBox box, middles;
    for (std::size_t i = first; i < last; ++i) {
      box.extend(boxes_[order_[i]]);
      middles.extend(boxes_[order_[i]].center());
    }
    nodes_[self].box = box;
    if (last - first > 4) {
      Eigen::Index axis;
      middles.sizes().maxCoeff(&axis);
      const std::size_t half = (first + last) / 2;
      const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
      std::nth_element(at(first), at(half), at(last), [&](std::uint32_t a, std::uint32_t b) {
        const float p = boxes_[a].center()[axis], q = boxes_[b].center()[axis];
        return p < q || (p == q && a < b);
      });
      Build(first, half);
      nodes_[self].right = Build(half, last);
    }
    return self;
  }

  template <class Test, class Function>
  void Walk(const Test& enter, const Function& visit) const
  {
    std::array<std::uint32_t, 64> waiting; // halves of at most 2^32 triangles
    std::size_t count = 0;
    if (!nodes_.empty())
      waiting[count++] = 0;
    while (count > 0) {
      const std::uint32_t at = waiting[--count];
      const Node& node = nodes_[at];
      if (!enter(node.box))
        continue;
      if (node.right) {
        waiting[count++] = node.right;
        waiting[count++] = at + 1;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.last; ++i)
        visit(order_[i]);
    }
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<FloatBox> boxes_;
  std::vector<Node> nodes_;
};

// ---------------------------------------------------------------------------------------------------------------- orientation

// Which triangles must be turned, and how they hang together.
struct Orientation {
  std::vector<std::uint32_t> component; // of each triangle
  std::vector<unsigned char> turn;      // of each triangle
  std::vector<unsigned char> cavity;    // of each component
};

Orientation Orient(const Mesh& mesh, const std::vector<Edge>& edges)
{
  // Neighbours across edges of two, and whether they face the same side.
  struct Link {
    std::uint32_t from, to;
    bool alike;
  };
  std::vector<Link> links;
  ForEachEdge(edges, [&links](const Edge* first, const Edge* last) {
    if (last - first == 2) {
      const bool alike = first[0].upwards != first[1].upwards;
      links.push_back({first[0].triangle, first[1].triangle, alike});
      links.push_back({first[1].triangle, first[0].triangle, alike});
    }
  });
  std::sort(links.begin(), links.end(),
            [](const Link& a, const Link& b) { return std::tie(a.from, a.to) < std::tie(b.from, b.to); });
  std::vector<std::size_t> start(mesh.Size() + 1);
  for (const Link& link : links)
    ++start[link.from + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());

  constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  Orientation result;
  result.component.assign(mesh.Size(), none);
  result.turn.assign(mesh.Size(), 0);
  std::uint32_t components = 0;
  std::vector<std::uint32_t> waiting;
  for (std::size_t seed = 0; seed < mesh.Size(); ++seed) {
    if (result.component[seed] != none)
      continue;
    result.component[seed] = components++;
    waiting.assign(1, static_cast<std::uint32_t>(seed));
    while (!waiting.empty()) {
      const std::uint32_t from = waiting.back();
      waiting.pop_back();
      for (std::size_t i = start[from]; i < start[from + 1]; ++i)
        if (result.component[links[i].to] == none) {
          result.component[links[i].to] = result.component[from];
          result.turn[links[i].to] = result.turn[from] ^ static_cast<unsigned char>(links[i].alike ? 0 : 1);
          waiting.push_back(links[i].to);
        }
    }
  }

  // The volume of each, about its middle, so that a hole matters little.
  std::vector<Eigen::AlignedBox3d> bounds(components);
  for (std::size_t i = 0; i < mesh.Size(); ++i)
    if (mesh.IsFinite(i))
      bounds[result.component[i]].extend(mesh.Bounds(i).cast<double>());
  std::vector<double> volume(components, 0.0);
  for (std::size_t i = 0; i < mesh.Size(); ++i)
    if (mesh.IsFinite(i)) {
      const Vector3d middle = bounds[result.component[i]].center();
      const double part = (mesh.Corner(i, 0) - middle).dot((mesh.Corner(i, 1) - middle).cross(mesh.Corner(i, 2) - middle));
      volume[result.component[i]] += result.turn[i] ? -part : part;
    }

  // Cavities: rays from up to seven points of each component, in a direction that meshes do not favour.
  result.cavity.assign(components, 0);
  if (components > 1) {
    const Tree tree(mesh);
    std::vector<std::vector<std::uint32_t>> samples(components); // the first seven, and later ones in their stead
    std::vector<std::uint32_t> seen(components, 0);
    for (std::size_t i = 0; i < mesh.Size(); ++i) {
      auto& list = samples[result.component[i]];
      const std::uint32_t number = seen[result.component[i]]++;
      if (mesh.IsDegenerate(i))
        continue;
      if (list.size() < 7)
        list.push_back(static_cast<std::uint32_t>(i));
      else if ((number & (number - 1)) == 0) // spread out: one at each power of two
        list[number % 7] = static_cast<std::uint32_t>(i);
    }
    const Vector3d direction = Vector3d(0.5377, 0.3141, 0.7826).normalized();
    ParallelFor(static_cast<std::ptrdiff_t>(components), [&](std::ptrdiff_t which) {
      const auto own = static_cast<std::uint32_t>(which);
      std::unordered_map<std::uint32_t, std::size_t> inside; // how many samples lie in another component
      for (const std::uint32_t sample : samples[own]) {
        std::unordered_map<std::uint32_t, int> crossings;
        tree.Cross(mesh.Middle(sample).cast<double>(), direction, [&](std::uint32_t i) { ++crossings[result.component[i]]; });
        for (const auto& [other, count] : crossings)
          inside[other] += other != own && count % 2 == 1;
      }
      std::size_t depth = 0;
      for (const auto& [other, count] : inside)
        depth += count > 0 && count + samples[own].size() / 7 >= samples[own].size();
      result.cavity[own] = depth % 2;
    });
  }
  for (std::size_t i = 0; i < mesh.Size(); ++i) {
    const std::uint32_t own = result.component[i];
    if ((volume[own] < 0.0) != (result.cavity[own] != 0))
      result.turn[i] ^= 1;
  }
  return result;
}

// ---------------------------------------------------------------------------------------------------------------- crossing

// The sign of the volume of a tetrahedron; 0 within rounding.
int Side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)
{
  const Vector3d p = a - d, q = b - d, r = c - d;
  const double volume = p.dot(q.cross(r));
  const Vector3d size = p.cwiseAbs(), across = q.cwiseAbs(), more = r.cwiseAbs();
  const double bound = 1e-15 * (size.x() * (across.y() * more.z() + across.z() * more.y()) +
                                size.y() * (across.z() * more.x() + across.x() * more.z()) +
                                size.z() * (across.x() * more.y() + across.y() * more.x()));
  return volume > bound ? 1 : volume < -bound ? -1 : 0;
}

using Triangle = std::array<Vector3d, 3>;

// Whether a segment goes through a triangle, from one side to the other. Where it meets an edge it does, for the triangle
// beyond says the same; where it meets a corner it touches.
bool Pierces(const Vector3d& from, const Vector3d& to, const Triangle& t)
{
  const int a = Side(t[0], t[1], t[2], from), b = Side(t[0], t[1], t[2], to);
  if (a * b >= 0)
    return false;
  const int u = Side(from, to, t[0], t[1]), v = Side(from, to, t[1], t[2]), w = Side(from, to, t[2], t[0]);
  return std::abs(u + v + w) >= 2 && u * v >= 0 && v * w >= 0 && w * u >= 0;
}

// Whether two triangles of one plane share more than a border: no edge has them on two sides.
bool OverlapInPlane(const Triangle& s, const Triangle& t)
{
  const Vector3d normal = (s[1] - s[0]).cross(s[2] - s[0]);
  Eigen::Index drop;
  normal.cwiseAbs().maxCoeff(&drop);
  const Eigen::Index x = (drop + 1) % 3, y = (drop + 2) % 3;
  const auto apart = [x, y](const Triangle& one, const Triangle& other) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d &a = one[k], &b = one[(k + 1) % 3], &c = one[(k + 2) % 3];
      const auto side = [&](const Vector3d& p) {
        const double area = (b[x] - a[x]) * (p[y] - a[y]) - (b[y] - a[y]) * (p[x] - a[x]);
        const double bound = 1e-12 * (std::abs((b[x] - a[x]) * (p[y] - a[y])) + std::abs((b[y] - a[y]) * (p[x] - a[x])));
        return area > bound ? 1 : area < -bound ? -1 : 0;
      };
      const int own = side(c);
      if (own * side(other[0]) <= 0 && own * side(other[1]) <= 0 && own * side(other[2]) <= 0)
        return true;
    }
    return false;
  };
  return !apart(s, t) && !apart(t, s);
}

bool Cross(const Mesh& mesh, std::size_t i, std::size_t j)
{
  const Triangle s{mesh.Corner(i, 0), mesh.Corner(i, 1), mesh.Corner(i, 2)};
  const Triangle t{mesh.Corner(j, 0), mesh.Corner(j, 1), mesh.Corner(j, 2)};
  int sides[3], others = 0;
  for (int k = 0; k < 3; ++k) {
    sides[k] = Side(s[0], s[1], s[2], t[static_cast<std::size_t>(k)]);
    others += sides[k] != 0;
  }
  if (others == 0)
    return OverlapInPlane(s, t);
  const auto has = [](const Corners& corners, std::uint32_t point) {
    return corners[0] == point || corners[1] == point || corners[2] == point;
  };
  // Edges that end in a shared corner cannot go through.
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    if (!has(mesh.At(j), mesh.At(i)[k]) && !has(mesh.At(j), mesh.At(i)[l]) && Pierces(s[k], s[l], t))
      return true;
    if (!has(mesh.At(i), mesh.At(j)[k]) && !has(mesh.At(i), mesh.At(j)[l]) && Pierces(t[k], t[l], s))
      return true;
  }
  return false;
}

void AddPlace(SurfaceFault& fault, int mostPlaces, const Vector3f& place)
{
  if (fault.count++ < mostPlaces)
    fault.places.push_back(place);
}

SurfaceFault SelfIntersections(const Mesh& mesh, int mostPlaces, const Progress& progress)
{
  const Tree tree(mesh);
  constexpr std::ptrdiff_t grain = 1024;
  std::vector<SurfaceFault> parts((mesh.Size() + grain - 1) / grain);
  ParallelRanges(static_cast<std::ptrdiff_t>(mesh.Size()), grain, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    SurfaceFault& part = parts[static_cast<std::size_t>(begin / grain)];
    std::vector<std::uint32_t> near;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      if (mesh.IsDegenerate(i))
        continue;
      near.clear();
      tree.Meet(tree.BoxOf(i), [&near, i](std::uint32_t j) {
        if (j > i)
          near.push_back(j);
      });
      std::sort(near.begin(), near.end());
      for (const std::uint32_t j : near)
        if (Cross(mesh, i, j))
          AddPlace(part, mostPlaces, tree.BoxOf(i).intersection(tree.BoxOf(j)).center());
    }
  });
  SurfaceFault all;
  for (const SurfaceFault& part : parts) {
    all.count += part.count;
    for (const Vector3f& place : part.places)
      if (all.places.size() < static_cast<std::size_t>(mostPlaces))
        all.places.push_back(place);
  }
  return all;
}

// ---------------------------------------------------------------------------------------------------------------- welding

// Points nearer than a distance become the first of them.
std::vector<std::uint32_t> Weld(const std::vector<Vector3f>& points, double distance)
{
  struct Hash {
    std::size_t operator()(const std::array<std::int64_t, 3>& cell) const
    {
      std::uint64_t mixed = 0;
      for (const std::int64_t number : cell)
        mixed = (mixed ^ static_cast<std::uint64_t>(number)) * 0x9E3779B97F4A7C15u, mixed ^= mixed >> 29;
      return mixed;
    }
  };
  // With no distance, equal points have equal cells of any size.
  const double perCell = 1.0 / std::max(distance, 1e-6), reach = distance * distance;
  const std::int64_t around = distance > 0.0 ? 1 : 0;
  std::unordered_map<std::array<std::int64_t, 3>, std::vector<std::uint32_t>, Hash> cells;
  cells.reserve(points.size());
  std::vector<std::uint32_t> target(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    target[i] = static_cast<std::uint32_t>(i);
    if (!points[i].allFinite())
      continue;
    const Vector3d place = points[i].cast<double>();
    const auto clamped = [perCell](double number) { return std::clamp(number * perCell, -9e17, 9e17); };
    const std::array<std::int64_t, 3> home{static_cast<std::int64_t>(std::floor(clamped(place.x()))),
                                           static_cast<std::int64_t>(std::floor(clamped(place.y()))),
                                           static_cast<std::int64_t>(std::floor(clamped(place.z())))};
    bool found = false;
    for (std::int64_t z = -around; z <= around && !found; ++z)
      for (std::int64_t y = -around; y <= around && !found; ++y)
        for (std::int64_t x = -around; x <= around && !found; ++x) {
          const auto cell = cells.find({home[0] + x, home[1] + y, home[2] + z});
          if (cell == cells.end())
            continue;
          for (const std::uint32_t other : cell->second)
            if ((points[other].cast<double>() - place).squaredNorm() <= reach) {
              target[i] = other;
              found = true;
              break;
            }
        }
    if (!found)
      cells[home].push_back(static_cast<std::uint32_t>(i));
  }
  return target;
}

// Turns triangles so that components face outwards.
void TurnOutwards(TriangleSurface& surface)
{
  const Mesh mesh(surface);
  const Orientation orientation = Orient(mesh, SortedEdges(mesh));
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    if (orientation.turn[i])
      std::swap(surface.triangles[i][1], surface.triangles[i][2]);
}

// Follows the open edges around each hole and covers it. \returns how many were closed.
std::int64_t CloseHoles(TriangleSurface& surface)
{
  std::unordered_map<std::uint32_t, std::uint32_t> next; // along the border, as the new triangles go
  std::vector<std::uint32_t> starts;
  std::vector<std::uint32_t> branching;
  ForEachEdge(SortedEdges(Mesh(surface)), [&](const Edge* first, const Edge* last) {
    if (last - first == 1) {
      const std::uint32_t from = first->upwards ? first->high : first->low, to = first->upwards ? first->low : first->high;
      if (!next.emplace(from, to).second)
        branching.push_back(from);
      starts.push_back(from);
    }
  });
  for (const std::uint32_t point : branching)
    next.erase(point);
  std::int64_t closed = 0;
  for (const std::uint32_t start : starts) {
    std::vector<std::uint32_t> border;
    std::uint32_t at = start;
    do {
      const auto found = next.find(at);
      if (found == next.end())
        break;
      border.push_back(at);
      at = found->second;
      next.erase(found);
    } while (at != start);
    if (at != start || border.size() < 3)
      continue; // it was covered before, or its border branches
    ++closed;
    if (border.size() == 3) {
      surface.triangles.push_back({border[0], border[1], border[2]});
      continue;
    }
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t point : border)
      middle += surface.points[point].cast<double>() / static_cast<double>(border.size());
    const auto centre = static_cast<std::uint32_t>(surface.points.size());
    surface.points.push_back(middle.cast<float>());
    for (std::size_t i = 0; i < border.size(); ++i)
      surface.triangles.push_back({border[i], border[(i + 1) % border.size()], centre});
  }
  return closed;
}

std::string PlaceText(const SurfaceFault& fault)
{
  if (fault.places.empty())
    return "";
  const auto number = [](float value) { return NumberText(std::round(value * 100.0) / 100.0); };
  const Vector3f& place = fault.places.front();
  return " (first at " + number(place.x()) + " " + number(place.y()) + " " + number(place.z()) + ")";
}

} // namespace

std::string SurfaceReport::Faults() const
{
  std::string text = triangles == 0 ? "no triangles" : "";
  const auto add = [&text](const SurfaceFault& fault, const char* one, const char* many) {
    if (fault.count > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(fault.count) + " " + (fault.count == 1 ? one : many) + PlaceText(fault);
  };
  add(openEdges, "open edge", "open edges");
  add(crowdedEdges, "edge of more than two triangles", "edges of more than two triangles");
  add(inconsistentEdges, "edge whose triangles face different sides", "edges whose triangles face different sides");
  add(insideOut, "component inside out", "components inside out");
  add(selfIntersections, "self-intersection", "self-intersections");
  add(degenerateTriangles, "triangle without area", "triangles without area");
  return text;
}

ParameterList Describe(SurfaceCheckParameters& p)
{
  return {Parameter("SelfIntersections", p.selfIntersections,
                    "Whether self-intersections are looked for: by far the longest of the checks.")
              .Advanced(),
          Parameter("MostPlaces", p.mostPlaces, {0, Unlimited}, "", "Places that are kept per kind of fault.")};
}

ParameterList Describe(SurfaceMendParameters& p)
{
  return {Parameter("WeldMm", p.weldMm, {0, 10}, "mm", "Points nearer than that become one; 0: those that are equal.").Advanced(),
          Parameter("Orient", p.orient, "Whether triangles are turned so that bodies face outwards, and cavities inwards."),
          Parameter("CloseHoles", p.closeHoles,
                    "Whether holes are closed by triangles about the middle of their border. Those whose border branches stay "
                    "open.")};
}

SurfaceReport CheckSurface(const TriangleSurface& surface, const SurfaceCheckParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  CheckIndices(surface);
  const Mesh mesh(surface);
  const int most = parameters.mostPlaces;
  SurfaceReport report;
  report.triangles = static_cast<std::int64_t>(mesh.Size());
  for (std::size_t i = 0; i < mesh.Size(); ++i) {
    if (mesh.IsDegenerate(i))
      AddPlace(report.degenerateTriangles, most, mesh.Middle(i));
    if (mesh.IsFinite(i))
      report.volumeMm3 += mesh.Corner(i, 0).dot(mesh.Corner(i, 1).cross(mesh.Corner(i, 2))) / 6.0;
  }
  const std::vector<Edge> edges = SortedEdges(mesh);
  ForEachEdge(edges, [&](const Edge* first, const Edge* last) {
    const Vector3f middle = 0.5f * (surface.points[first->low] + surface.points[first->high]);
    if (last - first == 1)
      AddPlace(report.openEdges, most, middle);
    else if (last - first > 2)
      AddPlace(report.crowdedEdges, most, middle);
    else if (first[0].upwards == first[1].upwards)
      AddPlace(report.inconsistentEdges, most, middle);
  });
  progress(0.05);

  const Orientation orientation = Orient(mesh, edges);
  const std::size_t components = orientation.cavity.size();
  report.components = static_cast<std::int64_t>(components);
  report.cavities = std::count(orientation.cavity.begin(), orientation.cavity.end(), 1);
  std::vector<unsigned char> wholly(components, 1);
  std::vector<std::size_t> member(components, 0);
  for (std::size_t i = 0; i < mesh.Size(); ++i) {
    wholly[orientation.component[i]] &= orientation.turn[i];
    member[orientation.component[i]] = i;
  }
  for (std::size_t i = 0; i < components; ++i)
    if (wholly[i])
      AddPlace(report.insideOut, most, mesh.Middle(member[i]));
  progress(0.15);

  if (parameters.selfIntersections)
    report.selfIntersections = SelfIntersections(mesh, most, progress.Part(0.15, 1.0));
  return report;
}

SurfaceMending MendSurface(TriangleSurface& surface, const SurfaceMendParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  CheckIndices(surface);
  SurfaceMending mending;
  const std::vector<std::uint32_t> target = Weld(surface.points, parameters.weldMm);
  const Mesh mesh(surface);
  std::vector<Corners> kept;
  kept.reserve(surface.triangles.size());
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const Corners welded{target[mesh.At(i)[0]], target[mesh.At(i)[1]], target[mesh.At(i)[2]]};
    if (mesh.IsFinite(i) && welded[0] != welded[1] && welded[1] != welded[2] && welded[2] != welded[0])
      kept.push_back(welded);
    else
      ++mending.droppedTriangles;
  }
  progress(0.4);

  constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place(surface.points.size(), none);
  std::vector<Vector3f> points;
  for (Corners& corners : kept)
    for (std::uint32_t& corner : corners) {
      if (place[corner] == none) {
        place[corner] = static_cast<std::uint32_t>(points.size());
        points.push_back(surface.points[corner]);
      }
      corner = place[corner];
    }
  mending.weldedPoints = static_cast<std::int64_t>(surface.points.size() - points.size());
  surface.points.swap(points);
  surface.triangles.swap(kept);

  const std::vector<Corners> before = surface.triangles;
  if (parameters.orient)
    TurnOutwards(surface);
  progress(0.7);
  if (parameters.closeHoles) {
    mending.closedHoles = CloseHoles(surface);
    if (parameters.orient && mending.closedHoles > 0)
      TurnOutwards(surface); // which side is outside is certain only now
  }
  for (std::size_t i = 0; i < before.size(); ++i)
    mending.turnedTriangles += surface.triangles[i] != before[i];
  progress(1.0);
  return mending;
}

} // namespace echorama
