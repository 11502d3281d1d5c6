// SPDX-License-Identifier: BSD-3-Clause
// A place is tried against the spheres near it only. Their sizes may span orders of magnitude, so there is a grid per factor of
// two in radius, with cells as wide as its largest spheres: in each, the neighbours lie within the two or three cells per axis
// that the candidate reaches. A sphere is filed in the one cell of its centre, and cells are short lists; grids come
// into being with their first sphere, and have no more cells than there may be spheres.
//
// Random: sizes are placed in descending order, because a large one finds room only while there is much. Which sizes
// come is drawn before, so the order changes nothing about their distribution, until a size finds no room. Then that size and
// all above are over, the limit drops by a tenth, and what is missing is drawn below it: so a packing ends after few such
// steps whatever is asked for.
//
// A size that keeps missing is tried at thousands of places, nearly all of them taken: a bitmap tells most of those at once.
//
// EmptySpace: the way to the nearest surface is looked for from the coarsest grid on, and what is found narrows the search
// in the finer ones, where most spheres are.
//
// Places come from one stream of random numbers, one after the other: this is a sequential process, on one thread.
#include "SpherePacking.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

namespace echorama {
namespace {

using Eigen::Vector3d;
using Parameters = SpherePackingParameters;

constexpr double missesToMark = 20.0;               // of a sphere; until then marking would cost more than it saves
constexpr double sphereVolume = 4.1887902047863905; // of radius 1

double VolumeOf(double radius)
{
  return sphereVolume * radius * radius * radius;
}

// Spheres in one grid per octave of their radii.
class Neighbourhood {
public:
  explicit Neighbourhood(const Parameters& p)
    : min_(p.boxMin), size_(p.boxMax - p.boxMin), gap_(p.gapMm), largest_(p.radiusMax),
      octaves_(1 + static_cast<std::size_t>(std::floor(std::log2(p.radiusMax / p.radiusMin))))
  {
  }

  const std::vector<Sphere>& Spheres() const { return spheres_; }
  std::vector<Sphere> Take() { return std::move(spheres_); }

  void Add(const Sphere& sphere)
  {
    const auto octave = static_cast<std::size_t>(std::max(0.0, std::floor(std::log2(largest_ / sphere.radius))));
    Octave& grid = octaves_[std::min(octave, octaves_.size() - 1)];
    if (grid.members.empty())
      grid.Start(size_, 2.0 * sphere.radius);
    grid.largest = std::max(grid.largest, sphere.radius);
    const auto index = static_cast<std::int32_t>(spheres_.size());
    std::int32_t& head = grid.heads[grid.IndexOf(sphere.centre - min_)];
    spheres_.push_back(sphere);
    next_.push_back(head);
    head = index;
    grid.members.push_back(index);
  }

  // Whether a sphere keeps the gap to all others.
  bool Fits(const Vector3d& centre, double radius) const
  {
    for (const Octave& grid : octaves_) {
      if (grid.members.empty())
        continue;
      const bool clear = grid.Visit(centre - min_, radius + gap_ + grid.largest, [&](std::int32_t i) {
        for (; i >= 0; i = next_[static_cast<std::size_t>(i)]) {
          const Sphere& other = spheres_[static_cast<std::size_t>(i)];
          const double reach = radius + gap_ + other.radius;
          if ((other.centre - centre).squaredNorm() < reach * reach)
            return false;
        }
        return true;
      });
      if (!clear)
        return false;
    }
    return true;
  }

  // The largest radius up to room that keeps the gap, or something below least when there is none from least on.
  double Room(const Vector3d& centre, double least, double room) const
  {
    const auto meet = [&](const Sphere& other) {
      const double reach = room + gap_ + other.radius, squared = (other.centre - centre).squaredNorm();
      if (squared < reach * reach) // a trace less than the distance, so that rounding never makes them overlap
        room = std::sqrt(squared) * (1.0 - 1e-12) - gap_ - other.radius;
      return room >= least;
    };
    for (const Octave& grid : octaves_) {
      if (grid.members.empty())
        continue;
      const double reach = room + gap_ + grid.largest;
      if (grid.CellsWithin(reach) > static_cast<double>(grid.members.size())) { // few spheres in a fine grid
        for (const std::int32_t i : grid.members)
          if (!meet(spheres_[static_cast<std::size_t>(i)]))
            return room;
        continue;
      }
      const bool clear = grid.Visit(centre - min_, reach, [&](std::int32_t i) {
        for (; i >= 0; i = next_[static_cast<std::size_t>(i)])
          if (!meet(spheres_[static_cast<std::size_t>(i)]))
            return false;
        return true;
      });
      if (!clear)
        return room;
    }
    return room;
  }

private:
  struct Octave {
    std::vector<std::int32_t> heads;   // first sphere of each cell, -1: none; the others follow in next_
    std::vector<std::int32_t> members; // all of its spheres
    std::array<int, 3> cells{1, 1, 1};
    double perCell = 1.0; // 1 / edge
    double largest = 0.0;

    void Start(const Vector3d& size, double edge)
    {
      constexpr double mostCells = 1 << 21;
      const auto count = [&size](double e) { return (size / e).array().floor() + 1.0; };
      while (count(edge).prod() > mostCells)
        edge *= 1.25;
      for (int axis = 0; axis < 3; ++axis)
        cells[static_cast<std::size_t>(axis)] = static_cast<int>(count(edge)[axis]);
      perCell = 1.0 / edge;
      heads.assign(static_cast<std::size_t>(count(edge).prod()), -1);
    }

    int Cell(double place, int axis) const
    {
      const int last = cells[static_cast<std::size_t>(axis)] - 1;
      return static_cast<int>(std::clamp(place * perCell, 0.0, static_cast<double>(last)));
    }
    std::size_t Index(int x, int y, int z) const
    {
      return static_cast<std::size_t>(x) +
             static_cast<std::size_t>(cells[0]) *
                 (static_cast<std::size_t>(y) + static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(z));
    }
    std::size_t IndexOf(const Vector3d& place) const { return Index(Cell(place.x(), 0), Cell(place.y(), 1), Cell(place.z(), 2)); }

    double CellsWithin(double reach) const
    {
      const double perAxis = 2.0 * reach * perCell + 2.0;
      return std::min(perAxis, double(cells[0])) * std::min(perAxis, double(cells[1])) * std::min(perAxis, double(cells[2]));
    }

    // Calls visit(first sphere) for the cells within reach until it returns false. \returns whether it never did.
    template <class Function>
    bool Visit(const Vector3d& place, double reach, const Function& visit) const
    {
      std::array<int, 3> from, to;
      for (int axis = 0; axis < 3; ++axis) {
        from[static_cast<std::size_t>(axis)] = Cell(place[axis] - reach, axis);
        to[static_cast<std::size_t>(axis)] = Cell(place[axis] + reach, axis);
      }
      for (int z = from[2]; z <= to[2]; ++z)
        for (int y = from[1]; y <= to[1]; ++y)
          for (int x = from[0]; x <= to[0]; ++x)
            if (!visit(heads[Index(x, y, z)]))
              return false;
      return true;
    }
  };

  Vector3d min_, size_;
  double gap_, largest_;
  std::vector<Octave> octaves_; // [k]: radii above largest_ / 2^(k+1), up to largest_ / 2^k
  std::vector<Sphere> spheres_;
  std::vector<std::int32_t> next_;
};

// Voxels in which no centre can lie any more, however small its sphere: a quick no, and never a wrong one.
class TakenVoxels {
public:
  TakenVoxels() = default;
  explicit TakenVoxels(const Parameters& p)
    : min_(p.boxMin), keptFromAll_(p.radiusMin + p.gapMm), edge_(0.6 * p.radiusMin + 0.3 * p.gapMm)
  {
    constexpr double mostVoxels = 1 << 27; // 16 MiB, a bit each
    const Vector3d size = p.boxMax - p.boxMin;
    for (;; edge_ *= 1.25) {
      const Eigen::Array3d count = (size / edge_).array().floor() + 1.0,
                           whole{64.0 * std::ceil(count.x() / 64.0), count.y(), count.z()};
      voxels_ = count.min(mostVoxels).cast<std::ptrdiff_t>();
      if (whole.prod() <= mostVoxels)
        break;
    }
    perEdge_ = 1.0 / edge_;
    rowWords_ = (voxels_.x() + 63) / 64;
    taken_.assign(static_cast<std::size_t>(rowWords_ * voxels_.y() * voxels_.z()), 0);
  }

  bool AreKnown() const { return !taken_.empty(); }
  bool Has(const Vector3d& place) const
  {
    const Voxel voxel = VoxelOf(place);
    return (*Word(voxel) >> (voxel.x() % 64) & 1) != 0;
  }
  // What Has(place) will read.
  void Fetch(const Vector3d& place) const { __builtin_prefetch(Word(VoxelOf(place))); }

  // Those that lie wholly within reach of the sphere.
  void Add(const Sphere& sphere)
  {
    const double reach = (sphere.radius + keptFromAll_) * (1.0 - 1e-6); // rounding takes none too many
    const Vector3d centre = sphere.centre - min_;
    const auto farther = [&](std::ptrdiff_t voxel, int axis) {
      const double from = static_cast<double>(voxel) * edge_ - centre[axis];
      return std::max(std::abs(from), std::abs(from + edge_));
    };
    const auto first = [&](double place, int axis) {
      return std::clamp(static_cast<std::ptrdiff_t>(std::ceil(place / edge_)), std::ptrdiff_t{0}, voxels_[axis]);
    };
    const auto behind = [&](double place, int axis) {
      return std::clamp(static_cast<std::ptrdiff_t>(std::floor(place / edge_)), std::ptrdiff_t{0}, voxels_[axis]);
    };
    for (std::ptrdiff_t z = first(centre.z() - reach, 2); z < behind(centre.z() + reach, 2); ++z)
      for (std::ptrdiff_t y = first(centre.y() - reach, 1); y < behind(centre.y() + reach, 1); ++y) {
        const double left = reach * reach - farther(z, 2) * farther(z, 2) - farther(y, 1) * farther(y, 1);
        if (left <= 0.0)
          continue;
        const double half = std::sqrt(left);
        const std::ptrdiff_t to = behind(centre.x() + half, 0);
        for (std::ptrdiff_t x = first(centre.x() - half, 0); x < to;) {
          const std::ptrdiff_t start = x % 64, bits = std::min<std::ptrdiff_t>(64 - start, to - x);
          taken_[IndexOf({x, y, z})] |= ~std::uint64_t{0} >> (64 - bits) << start;
          x += bits;
        }
      }
  }

private:
  using Voxel = Eigen::Array<std::ptrdiff_t, 3, 1>;

  Voxel VoxelOf(const Vector3d& place) const
  {
    return ((place - min_) * perEdge_).array().cast<std::ptrdiff_t>().min(voxels_ - 1).max(0);
  }
  std::size_t IndexOf(const Voxel& voxel) const
  {
    return static_cast<std::size_t>(voxel.x() / 64 + rowWords_ * (voxel.y() + voxels_.y() * voxel.z()));
  }
  const std::uint64_t* Word(const Voxel& voxel) const { return &taken_[IndexOf(voxel)]; }

  Vector3d min_ = Vector3d::Zero();
  double keptFromAll_ = 0.0, edge_ = 0.0, perEdge_ = 0.0;
  Voxel voxels_{0, 0, 0};
  std::ptrdiff_t rowWords_ = 0;
  std::vector<std::uint64_t> taken_;
};

// Where spheres may lie: random places of one stream, known some tries before their turn, so that memory can be asked for them.
class Site {
public:
  explicit Site(const Parameters& p)
    : ball_(p.region == Parameters::Region::Ball), min_(p.boxMin), max_(p.boxMax), middle_(0.5 * (p.boxMin + p.boxMax)),
      radius_(0.5 * (p.boxMax - p.boxMin).minCoeff()), random_(p.seed, 1)
  {
    for (std::size_t i = 0; i < ahead_.size(); ++i)
      Next(0.0);
  }

  // The next centre, uniform among those whose spheres of a radius lie wholly inside.
  Vector3d Next(double radius)
  {
    Draw& draw = ahead_[next_];
    next_ = (next_ + 1) % ahead_.size();
    const Vector3d place = PlaceOf(draw, radius);
    if (ball_) {
      draw.fromMiddle = std::cbrt(random_.Uniform());
      draw.direction = random_.Direction();
    } else
      for (int axis = 0; axis < 3; ++axis)
        draw.direction[axis] = random_.Uniform();
    return place;
  }
  // That which is farthest ahead.
  Vector3d Later(double radius) const { return PlaceOf(ahead_[(next_ + ahead_.size() - 1) % ahead_.size()], radius); }

  // How far it is to the border.
  double Room(const Vector3d& place) const
  {
    if (ball_)
      return radius_ - (place - middle_).norm();
    return std::min((place - min_).minCoeff(), (max_ - place).minCoeff());
  }

private:
  struct Draw {
    Vector3d direction = Vector3d::Zero(); // in a box: each part of 1
    double fromMiddle = 0.0;
  };

  Vector3d PlaceOf(const Draw& draw, double radius) const
  {
    if (ball_)
      return middle_ + (radius_ - radius) * draw.fromMiddle * draw.direction;
    Vector3d place;
    for (int axis = 0; axis < 3; ++axis)
      place[axis] = min_[axis] + radius + (max_[axis] - min_[axis] - 2.0 * radius) * draw.direction[axis];
    return place;
  }

  bool ball_;
  Vector3d min_, max_, middle_;
  double radius_;
  Random random_;
  std::array<Draw, 16> ahead_;
  std::size_t next_ = 0;
};

// A radius between least and most, by the inverse of the distribution's sum.
double DrawRadius(const Parameters& p, double least, double most, Random& random)
{
  const double u = random.Uniform(), ratio = least / most;
  const double power = p.radii == Parameters::Radii::Uniform      ? 1.0
                       : p.radii == Parameters::Radii::LogUniform ? 0.0
                                                                  : 1.0 - p.exponent;
  const double start = std::pow(ratio, power);
  const double part = std::abs(power) < 1e-9 ? std::pow(ratio, 1.0 - u) : std::pow(start + u * (1.0 - start), 1.0 / power);
  return std::clamp(most * part, least, most);
}

// What was packed so far, and what is wanted.
class Packing {
public:
  Packing(const Parameters& p, const Progress& progress)
    : p_(p), site_(p), neighbours_(p), progress_(progress), wanted_(p.fillFraction * p.Volume())
  {
  }

  SpherePacking Random()
  {
    echorama::Random sizes(p_.seed, 0);
    double limit = p_.radiusMax;
    while (limit >= p_.radiusMin) {
      const std::vector<double> radii = Draw(sizes, limit);
      const auto lost = std::find_if_not(radii.begin(), radii.end(), [this](double radius) { return Insert(radius); });
      if (lost == radii.end())
        return Finish(false);
      limit = 0.9 * *lost;
    }
    return Finish(true);
  }

  SpherePacking EmptySpace()
  {
    int missed = 0;
    while (!Full()) {
      if (missed == p_.misses)
        return Finish(true);
      Report();
      const Vector3d place = site_.Next(p_.radiusMin);
      const double most = std::min(p_.radiusMax, LargestFor(wanted_ - filled_));
      const double radius = neighbours_.Room(place, p_.radiusMin, std::clamp(site_.Room(place), p_.radiusMin, most));
      if (radius < p_.radiusMin) {
        ++missed;
        continue;
      }
      Keep({place, radius});
      missed = 0;
    }
    return Finish(false);
  }

private:
  // The sizes that are still missing, none above limit, in descending order.
  std::vector<double> Draw(echorama::Random& sizes, double limit) const
  {
    std::vector<double> radii;
    const auto most = static_cast<std::size_t>(p_.count) - neighbours_.Spheres().size();
    for (double missing = wanted_ - filled_; missing > 0.0 && radii.size() < most;) {
      const double radius = std::min(DrawRadius(p_, p_.radiusMin, limit, sizes), LargestFor(missing));
      missing -= VolumeOf(radius);
      if (missing < -0.5 * VolumeOf(radius)) // nearer to what is wanted without it
        break;
      radii.push_back(radius);
      if (missing > 0.0 && radii.size() == most && p_.count == Parameters::mostSpheres)
        RefuseMore();
    }
    std::sort(radii.begin(), radii.end(), std::greater<>());
    return radii;
  }

  // The last sphere is as large as what is missing, as far as sizes go.
  double LargestFor(double volume) const { return std::max(p_.radiusMin, std::cbrt(volume / sphereVolume)); }

  bool Insert(double radius)
  {
    for (int tried = 0; tried < p_.misses; ++tried) {
      Report();
      const Vector3d place = site_.Next(radius);
      if (taken_.AreKnown()) {
        taken_.Fetch(site_.Later(radius));
        if (taken_.Has(place))
          continue;
      }
      if (neighbours_.Fits(place, radius)) {
        Keep({place, radius});
        misses_ += 0.01 * (tried - misses_);
        if (!taken_.AreKnown() && misses_ > missesToMark)
          MarkTaken();
        return true;
      }
    }
    return false;
  }

  void MarkTaken()
  {
    taken_ = TakenVoxels(p_);
    for (const Sphere& sphere : neighbours_.Spheres())
      taken_.Add(sphere);
  }

  void Keep(const Sphere& sphere)
  {
    if (neighbours_.Spheres().size() == Parameters::mostSpheres)
      RefuseMore();
    neighbours_.Add(sphere);
    if (taken_.AreKnown())
      taken_.Add(sphere);
    filled_ += VolumeOf(sphere.radius);
  }

  [[noreturn]] void RefuseMore() const
  {
    throw Error(Error::Kind::TooLarge, "a fill fraction of " + NumberText(p_.fillFraction) + " takes more than " +
                                           std::to_string(Parameters::mostSpheres) +
                                           " spheres of these radii; raise radiusMin, or make the box smaller");
  }

  bool Full() const
  {
    const auto there = static_cast<std::int64_t>(neighbours_.Spheres().size());
    return filled_ >= wanted_ || (there >= p_.count && p_.count < Parameters::mostSpheres);
  }

  void Report()
  {
    if (tries_++ % 8192 == 0)
      progress_(
          std::max(wanted_ > 0.0 ? std::min(filled_ / wanted_, 1.0) : 1.0,
                   static_cast<double>(neighbours_.Spheres().size()) / static_cast<double>(std::max<std::int64_t>(p_.count, 1))));
  }

  SpherePacking Finish(bool saturated)
  {
    progress_(1.0);
    return {neighbours_.Take(), filled_ / p_.Volume(), tries_, saturated};
  }

  const Parameters& p_;
  Site site_;
  Neighbourhood neighbours_;
  TakenVoxels taken_;   // empty until sizes miss often
  double misses_ = 0.0; // of a sphere, in the mean of the last hundred
  const Progress& progress_;
  const double wanted_;
  double filled_ = 0.0;
  std::int64_t tries_ = 0;
};

} // namespace

ParameterList Describe(SpherePackingParameters& p)
{
  constexpr double far = 1e6;
  return {
      Parameter("Method", Choice(p.method, {"random", "empty-space"}),
                "How spheres find their places. Random: sizes are drawn first, and each is tried at random places, large ones "
                "first. Empty space: at random places of the empty space, each with the largest sphere that fits (Manna 1992)."),
      Parameter("Region", Choice(p.region, {"box", "ball"}), "What is filled: the box, or the largest ball about its middle."),
      Parameter("BoxMin", p.boxMin, {-far, far}, "mm", "Least x, y and z of the box."),
      Parameter("BoxMax", p.boxMax, {-far, far}, "mm", "Greatest x, y and z of the box."),
      Parameter("Radii", Choice(p.radii, {"uniform", "log-uniform", "power-law"}),
                "How radii are distributed: all alike, all factors alike (density 1 / r), or of density r^-Exponent.")
          .When("Method", "random"),
      Parameter("Exponent", p.exponent, {-10, 10}, "", "Exponent of the power law.").When("Radii", "power-law").Advanced(),
      Parameter("RadiusMin", p.radiusMin, {1e-6, far}, "mm", "The smallest radius."),
      Parameter("RadiusMax", p.radiusMax, {1e-6, far}, "mm", "The largest radius; a sphere of it must fit into the region."),
      Parameter("GapMm", p.gapMm, {0, 1000}, "mm", "Least way between two surfaces; 0: they may touch."),
      Parameter("FillFraction", p.fillFraction, {0, 1}, "",
                "Wanted share of the region within spheres. Above 0.6 few packings get there, and take seconds."),
      Parameter("Count", p.count, {0, static_cast<double>(SpherePackingParameters::mostSpheres)}, "",
                "Packing ends at so many spheres, or at the fill fraction, whichever comes first."),
      Parameter("Misses", p.misses, {1, 1e9}, "", "So many misses in a row mean that there is no more room.").Advanced(),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "Seed of sizes, places, materials and turns."),
  };
}

void SpherePackingParameters::Check() const
{
  CheckRanges(*this);
  const auto refuse = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, reason); };
  if (!((boxMax - boxMin).minCoeff() > 0.0))
    refuse("the packing's box has no volume: BoxMax must be above BoxMin on every axis");
  if (radiusMax < radiusMin)
    refuse("RadiusMax is " + NumberText(radiusMax) + " mm; it must be at least RadiusMin, " + NumberText(radiusMin));
  const double room = 0.5 * (boxMax - boxMin).minCoeff();
  if (radiusMax > room)
    refuse("RadiusMax is " + NumberText(radiusMax) + " mm; a sphere of more than " + NumberText(room) +
           " mm does not fit into the region");
}

double SpherePackingParameters::Volume() const
{
  const Vector3d size = boxMax - boxMin;
  const double radius = 0.5 * size.minCoeff();
  return region == Region::Ball ? VolumeOf(radius) : size.prod();
}

SpherePacking PackSpheres(const SpherePackingParameters& parameters, const Progress& progress)
{
  parameters.Check();
  Packing packing(parameters, progress);
  return parameters.method == Parameters::Method::Random ? packing.Random() : packing.EmptySpace();
}

} // namespace echorama
