// SPDX-License-Identifier: BSD-3-Clause
//
// From triangles to media, and how it survives bad meshes.
//
// 1. Shells. Triangles of a body that share corners are one shell (union-find). A sum of signed hashes of the directed edges is
//    zero just when each edge is passed both ways, so closed and consistent shells, the usual case, cost one pass and no
//    sort. For bodies where it is not, equal points are welded and the test is made again; shells that still fail have their
//    edges sorted, triangles turned to agree with their neighbours, and their holes measured.
// 2. Which way round. The sign of a shell's volume tells where its inside is, whatever the order of corners. Only for bodies
//    with shells of both signs does a ray tell whether a negative one is a cavity or inside out.
// 3. Rays. Single precision about the middle of the scene; rays that start outside of its box begin where they enter it, so
//    that far-away probes cost no precision. After the nearest hit a short ray collects all hits within the tolerance; per
//    shell the balance of entering and leaving counts. Reflected rays may meet again the surface that they left, by
//    rounding: entering what they are in, or leaving what they are not in, changes nothing.
// 4. Lattice. Cells of about one per triangle know the shells at their middle (one ray per row of cells) and whether a surface
//    may pass through them. Points in other cells cost a look-up, these a short ray.
//
// Cost: the tree dominates (Embree), some 0.4 s per million triangles on two cores.
#include "AcousticScene.h"
#include "Core/Base/Parallel.h"
#include "EmbreeQuery.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace echorama {

bool BodySet::Contains(std::int32_t shell) const
{
  return std::binary_search(begin(), end(), shell);
}

void BodySet::Insert(std::int32_t shell)
{
  const auto place = std::lower_bound(begin(), end(), shell) - begin();
  if (place < count_ && begin()[place] == shell)
    return;
  if (count_ < few) {
    std::copy_backward(few_.begin() + place, few_.begin() + count_, few_.begin() + count_ + 1);
    few_[static_cast<std::size_t>(place)] = shell;
  } else {
    if (count_ == few)
      many_.assign(few_.begin(), few_.end());
    many_.insert(many_.begin() + place, shell);
  }
  ++count_;
}

void BodySet::Erase(std::int32_t shell)
{
  const auto place = std::lower_bound(begin(), end(), shell) - begin();
  if (place == count_ || begin()[place] != shell)
    return;
  if (count_ <= few) {
    std::copy(few_.begin() + place + 1, few_.begin() + count_, few_.begin() + place);
  } else {
    many_.erase(many_.begin() + place);
    if (count_ - 1 == few) {
      std::copy(many_.begin(), many_.end(), few_.begin());
      many_.clear();
    }
  }
  --count_;
}

bool BodySet::operator==(const BodySet& other) const
{
  return count_ == other.count_ && std::equal(begin(), end(), other.begin());
}

namespace {

using CornerNumbers = std::array<std::uint32_t, 3>;

constexpr double infinity = std::numeric_limits<double>::infinity();
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

struct ClosedShell {
  std::int32_t body = 0;
  double volume = 0.0; // with the order of corners
  double area = 0.0;
  std::uint64_t balance = 0; // of directed edges
  std::uint32_t first = 0;   // a triangle of it
  int facing = 1;            // -1: the corners are clockwise as seen from outside
  int sign = 1;              // -1: bounds a cavity
  bool sheet = false;
};

// The surface taken apart: shells in the order of their bodies.
class Shells {
public:
  Shells(const TissueSurface& surface, const Eigen::Vector3d& centre);

  std::vector<Eigen::Vector3f> points; // about the centre
  std::vector<CornerNumbers> triangles;
  std::vector<std::int32_t> shellOf; // of each triangle
  std::vector<ClosedShell> shells;
  AcousticScene::Notes notes;

private:
  void Split(const TissueSurface& surface);
  void Weld(const TissueSurface& surface);
  void Mend(std::int32_t shell, const std::vector<std::uint32_t>& members);
  void Measure();

  Eigen::Vector3d Point(std::uint32_t i) const { return points[i].cast<double>(); }
};

Shells::Shells(const TissueSurface& surface, const Eigen::Vector3d& centre) : triangles(surface.triangles)
{
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
  if (std::any_of(shells.begin(), shells.end(), [](const ClosedShell& shell) { return shell.balance != 0; })) {
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

void Shells::Split(const TissueSurface& surface)
{
  Groups groups(points.size());
  for (const auto& [a, b, c] : triangles) {
    groups.Join(a, b);
    groups.Join(b, c);
  }
  // Numbered in the order of bodies, then of triangles.
  std::vector<std::int32_t> shellOfRoot(points.size(), -1);
  std::vector<ClosedShell> found;
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
void Shells::Weld(const TissueSurface& surface)
{
  std::vector<char> open(surface.bodies.size(), 0);
  for (const ClosedShell& shell : shells)
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
void Shells::Mend(std::int32_t shell, const std::vector<std::uint32_t>& members)
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

void Shells::Measure()
{
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    ClosedShell& shell = shells[static_cast<std::size_t>(shellOf[i])];
    const Eigen::Vector3d origin = Point(triangles[shell.first][0]);
    const Eigen::Vector3d a = Point(triangles[i][0]) - origin, b = Point(triangles[i][1]) - origin,
                          c = Point(triangles[i][2]) - origin;
    shell.volume += a.dot(b.cross(c)) / 6.0;
    shell.area += 0.5 * (b - a).cross(c - a).norm();
  }
  for (ClosedShell& shell : shells)
    shell.facing = shell.volume < 0.0 ? -1 : 1;
}

// What a short ray collects: all hits, each triangle once.
struct Hit {
  float distance;
  std::uint32_t triangle;
  Eigen::Vector3f normal; // of the triangle, any length
  float u, v;             // where in the triangle
};

struct Collector {
  EmbreeQuery query;
  std::vector<Hit> hits;
};

void Collect(const RTCFilterFunctionNArguments* arguments)
{
  auto& hits = reinterpret_cast<Collector*>(arguments->context)->hits;
  for (unsigned int i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0)
      continue;
    const std::uint32_t triangle = RTCHitN_primID(arguments->hit, arguments->N, i);
    if (std::none_of(hits.begin(), hits.end(), [triangle](const Hit& hit) { return hit.triangle == triangle; }))
      hits.push_back({RTCRayN_tfar(arguments->ray, arguments->N, i),
                      triangle,
                      {RTCHitN_Ng_x(arguments->hit, arguments->N, i), RTCHitN_Ng_y(arguments->hit, arguments->N, i),
                       RTCHitN_Ng_z(arguments->hit, arguments->N, i)},
                      RTCHitN_u(arguments->hit, arguments->N, i),
                      RTCHitN_v(arguments->hit, arguments->N, i)});
    arguments->valid[i] = 0; // go on
  }
}

// What a hit needs to know of a triangle, in a quarter of a cache line.
struct Record {
  std::int32_t shell;
  std::array<std::uint32_t, 3> normals; // at the corners, packed
};

// A unit vector in 32 bits, right to 4e-5: the octahedron unfolded into a square.
constexpr std::uint32_t flatCorner = 0xffffffffu; // stands for the normal of the triangle itself
constexpr float packSteps = 65534.0f;

std::uint32_t Packed(const Eigen::Vector3f& normal)
{
  const Eigen::Vector3f n = normal / normal.lpNorm<1>();
  float u = n[0], v = n[1];
  if (n[2] < 0.0f) {
    u = std::copysign(1.0f - std::abs(n[1]), n[0]);
    v = std::copysign(1.0f - std::abs(n[0]), n[1]);
  }
  const auto bits = [](float x) { return static_cast<std::uint32_t>(std::lround((0.5f * x + 0.5f) * packSteps)); };
  return bits(u) << 16 | bits(v);
}

Eigen::Vector3f Unpacked(std::uint32_t bits)
{
  const auto number = [](std::uint32_t x) { return 2.0f / packSteps * static_cast<float>(x) - 1.0f; };
  const float u = number(bits >> 16), v = number(bits & 0xffffu), w = 1.0f - std::abs(u) - std::abs(v);
  const float fold = std::max(-w, 0.0f);
  return Eigen::Vector3f(u - std::copysign(fold, u), v - std::copysign(fold, v), w).normalized();
}

// A ray as Embree takes it. All lengths are along the line from where the ray begins or enters the scene's box.
struct Line {
  Eigen::Vector3f origin, direction; // local
  double base = 0.0;                 // where along the ray the origin lies
  double exit = -infinity;           // where the ray leaves the box; before the base: it misses it

  RTCRayHit From(double from, double to) const
  {
    RTCRayHit ray;
    ray.ray.org_x = origin[0];
    ray.ray.org_y = origin[1];
    ray.ray.org_z = origin[2];
    ray.ray.dir_x = direction[0];
    ray.ray.dir_y = direction[1];
    ray.ray.dir_z = direction[2];
    ray.ray.tnear = static_cast<float>(from - base);
    ray.ray.tfar = static_cast<float>(to - base);
    ray.ray.time = 0.0f;
    ray.ray.mask = 0xffffffffu;
    ray.ray.id = 0;
    ray.ray.flags = 0;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return ray;
  }
};

// Hits within the tolerance, taken as one.
struct Meeting {
  struct Change {
    std::int32_t shell;
    int balance; // how often it was entered less how often it was left
    Hit hit;     // one of them
  };
  std::vector<Change> changes; // of which shells; sheets have a balance of 0
  double first = 0.0, last = 0.0;
};

bool CountMemory(void* bytes, ssize_t more, bool)
{
  *static_cast<std::atomic<std::int64_t>*>(bytes) += more;
  return true;
}

// Embree's handles, let go of however their holder ends.
struct EmbreeDevice {
  RTCDevice handle = nullptr;
  EmbreeDevice() = default;
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;
  ~EmbreeDevice()
  {
    if (handle)
      rtcReleaseDevice(handle);
  }
  operator RTCDevice() const { return handle; }
};

struct EmbreeScene {
  RTCScene handle = nullptr;
  EmbreeScene() = default;
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene()
  {
    if (handle)
      rtcReleaseScene(handle);
  }
  operator RTCScene() const { return handle; }
};

} // namespace

struct AcousticScene::State {
  State(const TissueSurface& surface, const Progress& progress, double creaseDegrees);
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  Line LineOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  bool Meet(const Line& line, double from, double to, Meeting& meeting, SceneRay* ray) const;
  void Pass(const Meeting& meeting, BodySet& inside) const;
  int MediumOf(const BodySet& inside) const;
  BodySet BodiesAt(const Eigen::Vector3d& point) const;
  void SetNormals(const Hit& hit, const Eigen::Vector3d& direction, Crossing& crossing) const;
  int Walk(const Eigen::Vector3d& from, const Eigen::Vector3d& to, BodySet inside) const;

  std::vector<std::uint32_t> Build(const Shells& parts);
  void FindCavities(const Shells& parts);
  void MakeNormals(const Shells& parts, const std::vector<std::uint32_t>& kept, double creaseDegrees);
  void MakeLattice(const Shells& parts, const Progress& progress);

  std::vector<Material> materials;
  std::vector<int> materialOf; // of a body
  std::vector<ClosedShell> shells;
  std::vector<Record> records; // of the tree's triangles
  Notes notes;
  std::size_t triangles = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();                              // of the box, world
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero(); // of the box, about the centre
  double tolerance = 1e-9;
  std::atomic<std::int64_t> treeBytes{0};
  EmbreeDevice device; // after what it counts in, before what it holds
  EmbreeScene scene;

  struct Lattice {
    std::array<int, 3> cells{0, 0, 0};
    Eigen::Vector3d low = Eigen::Vector3d::Zero(), size = Eigen::Vector3d::Ones(); // of a cell
    std::vector<std::int32_t> setOf; // twice the index of the set in the middle, plus one where a surface may pass
    std::vector<BodySet> sets;
    std::vector<std::int32_t> media; // of the sets

    Eigen::Vector3d Middle(int i, int j, int k) const
    {
      return low + size.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
    }
  } lattice;
};

AcousticScene::State::State(const TissueSurface& surface, const Progress& progress, double creaseDegrees)
{
  if (!(creaseDegrees >= 0.0 && creaseDegrees <= 180.0))
    throw Error(Error::Kind::InvalidParameter, "creaseDegrees must be in [0, 180]");
  surface.Check();
  materials = surface.materials;
  for (const TissueSurface::Body& body : surface.bodies)
    materialOf.push_back(body.material);
  if (surface.triangles.empty())
    return;
  Eigen::Vector3f least = surface.points[surface.triangles[0][0]], most = least;
  for (const auto& triangle : surface.triangles)
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

  const Shells parts(surface, centre);
  shells = parts.shells;
  notes = parts.notes;
  progress(0.3);
  const std::vector<std::uint32_t> kept = Build(parts);
  progress(0.7);
  if (triangles == 0)
    return;
  FindCavities(parts);
  if (creaseDegrees > 0.0)
    MakeNormals(parts, kept, creaseDegrees);
  MakeLattice(parts, progress.Part(0.7, 1.0));
}

// \returns the triangles that the tree got.
std::vector<std::uint32_t> AcousticScene::State::Build(const Shells& parts)
{
  std::vector<std::uint32_t> kept;
  kept.reserve(parts.triangles.size());
  for (std::size_t i = 0; i < parts.triangles.size(); ++i) {
    const auto& [a, b, c] = parts.triangles[i];
    const Eigen::Vector3d origin = parts.points[a].cast<double>();
    const Eigen::Vector3d normal = (parts.points[b].cast<double>() - origin).cross(parts.points[c].cast<double>() - origin);
    if (normal.squaredNorm() > 0.0)
      kept.push_back(static_cast<std::uint32_t>(i));
  }
  triangles = kept.size();
  notes.degenerateTriangles = static_cast<std::int64_t>(parts.triangles.size() - kept.size());
  if (triangles == 0)
    return kept;

  device.handle = rtcNewDevice(nullptr);
  if (!device.handle)
    throw Error(Error::Kind::NotPossible, "Embree does not start on this machine");
  rtcSetDeviceMemoryMonitorFunction(device, CountMemory, &treeBytes);
  scene.handle = rtcNewScene(device);
  rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | embreeQueryFilters));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const coordinates = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), parts.points.size()));
  auto* const indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles));
  if (coordinates && indices) {
    for (std::size_t i = 0; i < parts.points.size(); ++i)
      std::copy_n(parts.points[i].data(), 3, coordinates + 3 * i);
    records.resize(triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
      std::copy_n(parts.triangles[kept[i]].data(), 3, indices + 3 * i);
      records[i] = {parts.shellOf[kept[i]], {flatCorner, flatCorner, flatCorner}};
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  const RTCError problem = rtcGetDeviceError(device);
  if (problem == RTC_ERROR_OUT_OF_MEMORY || !coordinates || !indices)
    throw Error(Error::Kind::TooLarge, "the scene's " + std::to_string(triangles) + " triangles do not fit in memory");
  if (problem != RTC_ERROR_NONE)
    throw Error(Error::Kind::NotPossible, "Embree cannot build the scene (its error " + std::to_string(problem) + ")");
  return kept;
}

// Which negative shells are cavities, and which are inside out.
void AcousticScene::State::FindCavities(const Shells& parts)
{
  for (std::size_t first = 0, next; first < shells.size(); first = next) {
    double volume = 0.0;
    bool negative = false;
    for (next = first; next < shells.size() && shells[next].body == shells[first].body; ++next) {
      if (shells[next].sheet)
        continue;
      volume += shells[next].volume;
      negative = negative || shells[next].volume < 0.0;
    }
    if (!negative)
      continue;
    // The greatest first, for those within depend on it.
    std::vector<std::size_t> order;
    for (std::size_t s = first; s < next; ++s)
      if (!shells[s].sheet)
        order.push_back(s);
    std::stable_sort(order.begin(), order.end(),
                     [this](std::size_t a, std::size_t b) { return std::abs(shells[a].volume) > std::abs(shells[b].volume); });
    for (const std::size_t s : order) {
      ClosedShell& shell = shells[s];
      const int said = (shell.volume < 0.0) != (volume < 0.0) ? -1 : 1;
      shell.sign = 1;
      if (said < 0) {
        int depth = 0;
        for (const std::int32_t holder : BodiesAt(centre + parts.points[parts.triangles[shell.first][0]].cast<double>())) {
          const ClosedShell& other = shells[static_cast<std::size_t>(holder)];
          if (other.body == shell.body && std::abs(other.volume) > std::abs(shell.volume))
            depth += other.sign;
        }
        if (depth > 0)
          shell.sign = -1;
      }
      notes.cavities += shell.sign < 0;
      notes.turnedShells += (shell.volume < 0.0) != (shell.sign < 0);
    }
  }
}

Line AcousticScene::State::LineOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  Line line;
  const Eigen::Vector3d local = origin - centre;
  double enter = -infinity, exit = infinity;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (local[axis] < low[axis] || local[axis] > high[axis])
        return line;
      continue;
    }
    const double a = (low[axis] - local[axis]) / direction[axis], b = (high[axis] - local[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, b));
    exit = std::min(exit, std::max(a, b));
  }
  if (!(enter <= exit))
    return line;
  line.base = std::max(enter, -tolerance); // what touches the origin is met
  line.exit = exit;
  line.origin = (local + line.base * direction).cast<float>();
  line.direction = direction.cast<float>();
  return line;
}

// The next hits along the line, as one. from and to are along the ray.
bool AcousticScene::State::Meet(const Line& line, double from, double to, Meeting& meeting, SceneRay* ray) const
{
  const double begin = std::max(from, line.base), end = std::min(to, line.exit);
  if (!(begin < end))
    return false;
  RTCRayHit query = line.From(begin, end);
  const auto ask = [ray, &line](const RTCRayHit& asked) {
    if (!ray)
      return;
    ++ray->asked;
    if (ray->record)
      ray->record->push_back({{asked.ray.org_x, asked.ray.org_y, asked.ray.org_z},
                              {line.direction[0], line.direction[1], line.direction[2]},
                              asked.ray.tnear,
                              asked.ray.tfar});
  };
  thread_local Collector collector;
  collector.hits.clear();
  ask(query);
  collector.query.Ask(scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID)
    return false;
  const float first = query.ray.tfar;
  __builtin_prefetch(&records[query.hit.primID]);
  collector.hits.push_back(
      {first, query.hit.primID, Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z), query.hit.u, query.hit.v});

  RTCRayHit others = line.From(begin, end);
  others.ray.tnear = std::max(query.ray.tnear, first - static_cast<float>(0.01 * tolerance));
  others.ray.tfar = first + static_cast<float>(tolerance);
  ask(others);
  collector.query.Ask(scene, others, Collect);

  meeting.changes.clear();
  float last = first;
  for (const Hit& hit : collector.hits) {
    last = std::max(last, hit.distance);
    const std::int32_t shell = records[hit.triangle].shell;
    const ClosedShell& about = shells[static_cast<std::size_t>(shell)];
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
  meeting.first = line.base + first;
  meeting.last = line.base + last;
  return true;
}

void AcousticScene::State::Pass(const Meeting& meeting, BodySet& inside) const
{
  for (const Meeting::Change& change : meeting.changes)
    if (change.balance > 0)
      inside.Insert(change.shell);
    else if (change.balance < 0)
      inside.Erase(change.shell);
}

int AcousticScene::State::MediumOf(const BodySet& inside) const
{
  const std::int32_t* next = inside.end();
  while (next != inside.begin()) {
    const std::int32_t body = shells[static_cast<std::size_t>(next[-1])].body;
    int depth = 0;
    for (; next != inside.begin() && shells[static_cast<std::size_t>(next[-1])].body == body; --next)
      depth += shells[static_cast<std::size_t>(next[-1])].sign;
    if (depth > 0)
      return materialOf[static_cast<std::size_t>(body)];
  }
  return 0;
}

BodySet AcousticScene::State::BodiesAt(const Eigen::Vector3d& point) const
{
  BodySet result;
  const Eigen::Vector3d local = point - centre;
  if (triangles == 0 || (local.array() < low.array()).any() || (local.array() > high.array()).any())
    return result;
  // Directions that no modeller would choose. Along each, the first meeting with a shell tells whether it holds the point.
  static const std::array<Eigen::Vector3d, 5> directions{
      Eigen::Vector3d(0.3127, 0.1733, 0.9339).normalized(), Eigen::Vector3d(-0.8151, 0.5367, 0.2183).normalized(),
      Eigen::Vector3d(0.2719, -0.9263, -0.2609).normalized(), Eigen::Vector3d(0.7457, 0.4079, -0.5267).normalized(),
      Eigen::Vector3d(-0.4637, -0.2381, -0.8534).normalized()};
  std::map<std::int32_t, int> votes;
  Meeting meeting;
  const auto ask = [&](const Eigen::Vector3d& direction) {
    const Line line = LineOf(point, direction);
    BodySet seen;
    for (double from = 0.0; Meet(line, from, infinity, meeting, nullptr); from = meeting.first + tolerance)
      for (const Meeting::Change& change : meeting.changes)
        if (change.balance != 0 && !seen.Contains(change.shell)) {
          seen.Insert(change.shell);
          if (change.balance < 0)
            ++votes[change.shell];
        }
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

// Normals at corners: the mean of the triangles around each point, by their area. Where one of them differs from it by more
// than the crease, the point lies on an edge, and its triangles are flat there.
void AcousticScene::State::MakeNormals(const Shells& parts, const std::vector<std::uint32_t>& kept, double creaseDegrees)
{
  std::vector<Eigen::Vector3f> normals(parts.points.size(), Eigen::Vector3f::Zero());
  const auto normalOf = [&parts](const CornerNumbers& t) -> Eigen::Vector3f {
    return (parts.points[t[1]] - parts.points[t[0]]).cross(parts.points[t[2]] - parts.points[t[0]]);
  };
  for (const CornerNumbers& triangle : parts.triangles) {
    const Eigen::Vector3f normal = normalOf(triangle);
    for (const std::uint32_t corner : triangle)
      normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : normals)
    normal.normalize();
  const auto least = static_cast<float>(std::cos(creaseDegrees * 0.017453292519943295));
  std::vector<bool> edged(normals.size(), false);
  for (const CornerNumbers& triangle : parts.triangles) {
    const Eigen::Vector3f normal = normalOf(triangle).normalized();
    for (const std::uint32_t corner : triangle)
      if (normals[corner].dot(normal) < least && normal.squaredNorm() > 0.5f)
        edged[corner] = true;
  }
  constexpr float plane = 1.0f - 1e-6f; // so flat that the triangle's own normal is more exact
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const CornerNumbers& triangle = parts.triangles[kept[i]];
    const Eigen::Vector3f normal = normalOf(triangle).normalized();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t point = triangle[corner];
      const bool curved = !edged[point] && normals[point].squaredNorm() > 0.5f && normals[point].dot(normal) < plane;
      records[i].normals[corner] = curved ? Packed(normals[point]) : flatCorner;
    }
  }
}

void AcousticScene::State::SetNormals(const Hit& hit, const Eigen::Vector3d& direction, Crossing& crossing) const
{
  const Eigen::Vector3d flat = hit.normal.cast<double>().normalized();
  const double side = flat.dot(direction) > 0.0 ? -1.0 : 1.0;
  crossing.facet = side * flat;
  crossing.normal = crossing.facet;
  const std::array<std::uint32_t, 3>& corners = records[hit.triangle].normals;
  if (corners[0] == flatCorner && corners[1] == flatCorner && corners[2] == flatCorner)
    return;
  const float weights[] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    sum += static_cast<double>(weights[i]) *
           (corners[i] == flatCorner ? flat : Eigen::Vector3d(Unpacked(corners[i]).cast<double>()));
  const Eigen::Vector3d curved = side * sum.normalized();
  // At grazing angles a ray may come from behind the curved normal, or be mirrored into the triangle: flat, then.
  const double cosine = -curved.dot(direction);
  if (cosine > 0.0 && (direction + 2.0 * cosine * curved).dot(crossing.facet) > 0.0)
    crossing.normal = curved;
}

// The medium at the end of a short way (local points) from where the shells are known.
int AcousticScene::State::Walk(const Eigen::Vector3d& from, const Eigen::Vector3d& to, BodySet inside) const
{
  const double length = (to - from).norm();
  if (length > 0.0) {
    Meeting meeting;
    const Line line = LineOf(centre + from, (to - from) / length);
    for (double passed = 0.0; Meet(line, passed, length, meeting, nullptr); passed = meeting.first + tolerance)
      Pass(meeting, inside);
  }
  return MediumOf(inside);
}

void AcousticScene::State::MakeLattice(const Shells& parts, const Progress& progress)
{
  // A box that is a little larger than the scene by amounts that keep the rows off the surfaces of well-aligned boxes.
  const Eigen::Vector3d size = high - low;
  const Eigen::Vector3d pad = Eigen::Vector3d(0.00917, 0.01127, 0.01361) * size.maxCoeff();
  lattice.low = low - pad;
  const Eigen::Vector3d whole = size + pad + Eigen::Vector3d(pad[1], pad[2], pad[0]);
  const double cells = std::clamp(2.0 * static_cast<double>(triangles), 4096.0, 4e6);
  const double edge = std::cbrt(whole.prod() / cells);
  for (int axis = 0; axis < 3; ++axis) {
    lattice.cells[static_cast<std::size_t>(axis)] = std::clamp(static_cast<int>(std::ceil(whole[axis] / edge)), 1, 1024);
    lattice.size[axis] = whole[axis] / lattice.cells[static_cast<std::size_t>(axis)];
  }
  const auto [nx, ny, nz] = lattice.cells;
  lattice.setOf.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 0);

  // The sets in the middles, row by row; each slice lists its own first.
  std::vector<std::vector<BodySet>> setsOfSlice(static_cast<std::size_t>(nz));
  ParallelFor(nz, progress.Part(0.0, 0.7), [&, nx = nx, ny = ny](std::ptrdiff_t k) {
    std::vector<BodySet>& sets = setsOfSlice[static_cast<std::size_t>(k)];
    sets.emplace_back();
    Meeting meeting;
    for (int j = 0; j < ny; ++j) {
      std::int32_t* const row = lattice.setOf.data() + (k * ny + j) * nx;
      Eigen::Vector3d start = lattice.Middle(0, j, static_cast<int>(k));
      start[0] = lattice.low[0]; // outside of the scene
      const Line line = LineOf(centre + start, Eigen::Vector3d::UnitX());
      BodySet inside;
      std::int32_t set = 0;
      int i = 0;
      const auto fill = [&](double to) {
        for (; i < nx && (i + 0.5) * lattice.size[0] < to; ++i)
          row[i] = set;
      };
      for (double from = 0.0; Meet(line, from, infinity, meeting, nullptr); from = meeting.first + tolerance) {
        fill(meeting.first);
        Pass(meeting, inside);
        if (inside.Count() == 0)
          set = 0;
        else if (!(sets.back() == inside)) {
          sets.push_back(inside);
          set = static_cast<std::int32_t>(sets.size()) - 1;
        } else
          set = static_cast<std::int32_t>(sets.size()) - 1;
      }
      fill(infinity);
    }
  });
  std::map<std::vector<std::int32_t>, std::int32_t> index;
  for (int k = 0; k < nz; ++k) {
    std::vector<std::int32_t> global;
    for (const BodySet& set : setsOfSlice[static_cast<std::size_t>(k)]) {
      const auto [found, isNew] =
          index.try_emplace(std::vector<std::int32_t>(set.begin(), set.end()), static_cast<std::int32_t>(lattice.sets.size()));
      if (isNew) {
        lattice.sets.push_back(set);
        lattice.media.push_back(MediumOf(set));
      }
      global.push_back(found->second);
    }
    std::int32_t* const slice = lattice.setOf.data() + static_cast<std::ptrdiff_t>(k) * nx * ny;
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(nx) * ny; ++i)
      slice[i] = 2 * global[static_cast<std::size_t>(slice[i])];
  }
  progress(0.8);

  // Cells near triangles: those of its box that lie close to its plane.
  const double reach = 0.5 * lattice.size.norm() + tolerance;
  for (const CornerNumbers& triangle : parts.triangles) {
    const Eigen::Vector3d a = parts.points[triangle[0]].cast<double>(), b = parts.points[triangle[1]].cast<double>(),
                          c = parts.points[triangle[2]].cast<double>();
    const Eigen::Array3d margin = Eigen::Array3d::Constant(tolerance);
    const Eigen::Array3d from = (a.cwiseMin(b).cwiseMin(c) - lattice.low).array() - margin;
    const Eigen::Array3d to = (a.cwiseMax(b).cwiseMax(c) - lattice.low).array() + margin;
    const Eigen::Array3i first = (from / lattice.size.array()).floor().cast<int>().max(0);
    const Eigen::Array3i last = (to / lattice.size.array()).floor().cast<int>().min(Eigen::Array3i(nx - 1, ny - 1, nz - 1));
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    const bool flat = (last - first).maxCoeff() > 1 && normal.squaredNorm() > 0.5;
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int i = first[0]; i <= last[0]; ++i)
          if (!flat || std::abs(normal.dot(lattice.Middle(i, j, k) - a)) <= reach)
            lattice.setOf[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * ny + j) * nx + i)] |= 1;
  }
  progress(1.0);
}

AcousticScene::AcousticScene(const TissueSurface& surface, const Progress& progress, double creaseDegrees)
  : state_(std::make_unique<State>(surface, progress, creaseDegrees))
{
}
AcousticScene::~AcousticScene() = default;
AcousticScene::AcousticScene(AcousticScene&&) noexcept = default;
AcousticScene& AcousticScene::operator=(AcousticScene&&) noexcept = default;

const std::vector<Material>& AcousticScene::Materials() const
{
  return state_->materials;
}

const AcousticScene::Notes& AcousticScene::GetNotes() const
{
  return state_->notes;
}

bool AcousticScene::Empty() const
{
  return state_->triangles == 0;
}

double AcousticScene::Tolerance() const
{
  return state_->tolerance;
}

int AcousticScene::MediumOf(const BodySet& inside) const
{
  return state_->MediumOf(inside);
}

BodySet AcousticScene::BodiesAt(const Eigen::Vector3d& point) const
{
  return state_->BodiesAt(point);
}

void AcousticScene::MediumAt(const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials) const
{
  const State::Lattice& lattice = state_->lattice;
  const auto [nx, ny, nz] = lattice.cells;
  if (nx == 0) {
    std::fill_n(materials, count, 0);
    return;
  }
  const Eigen::Vector3d inverse = lattice.size.cwiseInverse();
  for (std::size_t p = 0; p < count; ++p) {
    const Eigen::Vector3d local = points[p].cast<double>() - state_->centre;
    const Eigen::Vector3d place = (local - lattice.low).cwiseProduct(inverse);
    if (!(place.minCoeff() >= 0.0 && place[0] < nx && place[1] < ny && place[2] < nz)) { // not finite either
      materials[p] = 0;
      continue;
    }
    const int i = static_cast<int>(place[0]), j = static_cast<int>(place[1]), k = static_cast<int>(place[2]);
    const std::int32_t set = lattice.setOf[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * ny + j) * nx + i)];
    materials[p] = set & 1 ? state_->Walk(lattice.Middle(i, j, k), local, lattice.sets[static_cast<std::size_t>(set >> 1)])
                           : lattice.media[static_cast<std::size_t>(set >> 1)];
  }
}

bool AcousticScene::NextCrossing(SceneRay& ray, double limit, Crossing& crossing) const
{
  const State& s = *state_;
  if (s.triangles == 0)
    return false;
  const Line line = s.LineOf(ray.origin, ray.direction);
  if (line.exit < line.base)
    return false;
  const bool begins = ray.passed == 0.0;
  double from = !begins ? ray.passed : ray.fromSurface ? s.tolerance : -s.tolerance;
  const int before = s.MediumOf(ray.inside);
  thread_local Meeting meeting;
  while (s.Meet(line, from, limit, meeting, &ray)) {
    ray.came = ray.inside;
    s.Pass(meeting, ray.inside);
    from = meeting.first + s.tolerance;
    ray.passed = std::max(from, s.tolerance);
    const int after = s.MediumOf(ray.inside);
    const Meeting::Change* border = nullptr;
    crossing.sheet = -1;
    for (const Meeting::Change& change : meeting.changes) {
      const ClosedShell& shell = s.shells[static_cast<std::size_t>(change.shell)];
      if (shell.sheet) { // not the one that the ray has just left, which it may graze by rounding
        const double cosine = std::abs(change.hit.normal.normalized().dot(line.direction));
        if (ray.fromSurface && begins && meeting.first * cosine < s.tolerance)
          continue;
        crossing.sheet = s.materialOf[static_cast<std::size_t>(shell.body)];
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
    s.SetNormals(border->hit, ray.direction, crossing);
    return true;
  }
  return false;
}

std::size_t AcousticScene::MemoryBytes() const
{
  const State& s = *state_;
  std::size_t bytes = static_cast<std::size_t>(std::max<std::int64_t>(0, s.treeBytes)) +
                      s.shells.capacity() * sizeof(ClosedShell) + s.records.capacity() * sizeof(Record) +
                      s.lattice.setOf.capacity() * sizeof(std::int32_t);
  for (const BodySet& set : s.lattice.sets)
    bytes += sizeof(BodySet) + (set.Count() > 10 ? sizeof(std::int32_t) * static_cast<std::size_t>(set.Count()) : 0);
  return bytes;
}

std::int64_t AcousticScene::Ask(const SceneRay::Question* questions, std::size_t count) const
{
  if (Empty())
    return 0;
  EmbreeQuery query;
  std::int64_t hits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Line line;
    line.origin = Eigen::Map<const Eigen::Vector3f>(questions[i].origin.data());
    line.direction = Eigen::Map<const Eigen::Vector3f>(questions[i].direction.data());
    RTCRayHit ray = line.From(questions[i].from, questions[i].to);
    query.Ask(state_->scene, ray);
    hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  return hits;
}

} // namespace echorama
