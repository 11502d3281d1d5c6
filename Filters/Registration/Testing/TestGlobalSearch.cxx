// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/GlobalSearch.h"
#include "Filters/Registration/MaskedCorrelation.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

namespace echorama {
namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;
using Complex = MaskedCorrelator::Complex;

// Uniform over all rotations.
Eigen::Matrix3d AnyRotation(Random& random)
{
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal()).normalized().toRotationMatrix();
}

double DegreesBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b)
{
  return std::acos(std::clamp(0.5 * (a.cwiseProduct(b).sum() - 1.0), -1.0, 1.0)) / RadiansPerDegree;
}

std::string MessageOf(const std::function<void()>& call, Error::Kind kind)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

// The distance from \a count random rotations of the cone to the nearest of the cover, the largest, degrees.
double CoveringRadius(const std::vector<Eigen::Matrix3d>& cover, double coneDegrees, int count)
{
  double largest = 0.0;
  for (int i = 0; i < count; ++i) {
    Random random(5, static_cast<std::uint64_t>(i));
    const Eigen::Vector3d axis = random.Direction();
    const Eigen::Matrix3d R = coneDegrees < 180.0
                                  ? ExpRotation(coneDegrees * RadiansPerDegree * std::cbrt(random.Uniform()) * axis)
                                  : AnyRotation(random);
    double trace = -1.0;
    for (const Eigen::Matrix3d& other : cover)
      trace = std::max(trace, R.cwiseProduct(other).sum());
    largest = std::max(largest, std::acos(std::clamp(0.5 * (trace - 1.0), -1.0, 1.0)) / RadiansPerDegree);
  }
  return largest;
}

TEST(RotationCoverTest, LeavesNoRotationFarFromOne)
{
  for (const double cone : {180.0, 120.0, 60.0, 25.0})
    for (const double step : {20.0, 33.0}) {
      const auto cover = RotationCover(cone, step);
      EXPECT_LT(CoveringRadius(cover, cone, 2000), 0.8 * step) << cone << " " << step << " " << cover.size();
      EXPECT_EQ(cover.front(), Eigen::Matrix3d::Identity());
      for (const Eigen::Matrix3d& R : cover) {
        EXPECT_LE(DegreesBetween(R, cover.front()), cone + 1e-6);
        EXPECT_TRUE(IsRotation(R, 1e-12));
      }
    }
}

// The thinnest lattice cover needs 8 pi^2 / (0.77 step^3) rotations; the seams of the 24 pieces and the curvature cost some.
TEST(RotationCoverTest, IsThin)
{
  const double step = 20.0 * RadiansPerDegree, thinnest = 8.0 * 9.8696044 / (0.7698 * step * step * step);
  const auto cover = RotationCover(180.0, 20.0);
  EXPECT_GT(static_cast<double>(cover.size()), 0.95 * thinnest);
  EXPECT_LT(static_cast<double>(cover.size()), 1.25 * thinnest);
  EXPECT_EQ(RotationCover(0.0, 20.0).size(), 1u);
}

TEST(RotationCoverTest, RefusesWhatIsOutOfRange)
{
  for (const double cone : {-1.0, 181.0, std::nan("")})
    MessageOf([&] { RotationCover(cone, 20.0); }, Error::Kind::InvalidParameter);
  for (const double step : {0.0, 1.0, 91.0, std::nan("")})
    MessageOf([&] { RotationCover(30.0, step); }, Error::Kind::InvalidParameter);
}

// Random voxels of mean 0.2, a third of them not real, the others of different weights.
Volume<Complex> RandomVoxels(const std::array<int, 3>& dimensions, std::uint64_t seed)
{
  Volume<Complex> volume(dimensions);
  Random random(seed);
  for (Complex& voxel : volume.View()) {
    const double weight = random.Uniform() < 1.0 / 3.0 ? 0.0 : random.Uniform(0.2, 1.0), value = 0.2 + random.Normal();
    voxel = {static_cast<float>(weight), static_cast<float>(weight * value)};
  }
  return volume;
}

struct Sums {
  double n = 0.0, f = 0.0, m = 0.0, ff = 0.0, mm = 0.0, fm = 0.0;
  double Ncc() const { return (fm / n - f / n * m / n) / std::sqrt((ff / n - f / n * f / n) * (mm / n - m / n * m / n)); }
};

// By the definition, one shift at a time.
Sums SumsAt(VolumeView<const Complex> fixed, VolumeView<const Complex> moving, const std::array<int, 3>& shift)
{
  Sums sums;
  const auto &n = fixed.Dimensions(), &o = moving.Dimensions();
  for (int k = 0; k < o[2]; ++k)
    for (int j = 0; j < o[1]; ++j)
      for (int i = 0; i < o[0]; ++i) {
        const int x = i + shift[0], y = j + shift[1], z = k + shift[2];
        if (x < 0 || y < 0 || z < 0 || x >= n[0] || y >= n[1] || z >= n[2])
          continue;
        const std::complex<double> a = fixed(x, y, z), b = moving(i, j, k);
        const double w = a.real() * b.real();
        if (w <= 0.0)
          continue;
        const double f = a.imag() / a.real(), m = b.imag() / b.real();
        sums.n += w;
        sums.f += w * f;
        sums.m += w * m;
        sums.ff += w * f * f;
        sums.mm += w * m * m;
        sums.fm += w * f * m;
      }
  return sums;
}

TEST(MaskedCorrelatorTest, EqualsTheDefinition)
{
  const Volume<Complex> fixed = RandomVoxels({9, 7, 8}, 1), moving = RandomVoxels({6, 8, 5}, 2);
  // All shifts; some about none; some that leave the first, and the last, voxels of the fixed volume behind.
  const std::vector<ShiftRange> ranges{
      {{-5, -7, -4}, {8, 6, 7}}, {{-1, -2, 0}, {1, 1, 2}}, {{2, 1, 3}, {8, 6, 7}}, {{-5, -7, -4}, {-2, -3, -1}}};
  const double least = 12.0;
  int compared = 0;
  for (const ShiftRange& range : ranges) {
    const MaskedCorrelator correlator(fixed.View(), moving.Dimensions(), range);
    MaskedCorrelator::Work work;
    const auto counts = range.Counts();
    Volume<Complex> products(counts), normalised(counts);
    correlator.Products(moving.View(), products.View(), work);
    correlator.Normalised(moving.View(), least, normalised.View(), work);
    for (int k = 0; k < counts[2]; ++k)
      for (int j = 0; j < counts[1]; ++j)
        for (int i = 0; i < counts[0]; ++i) {
          const Sums sums = SumsAt(fixed.View(), moving.View(), {range.first[0] + i, range.first[1] + j, range.first[2] + k});
          EXPECT_NEAR(products.View()(i, j, k).real(), sums.n, 1e-4);
          EXPECT_NEAR(products.View()(i, j, k).imag(), sums.fm, 1e-4);
          EXPECT_NEAR(normalised.View()(i, j, k).real(), sums.n, 1e-4);
          if (sums.n >= least + 1e-3) {
            EXPECT_NEAR(normalised.View()(i, j, k).imag(), sums.Ncc(), 1e-4);
            ++compared;
          } else if (sums.n < least - 1e-3) {
            EXPECT_EQ(normalised.View()(i, j, k).imag(), 0.0f);
          }
        }
  }
  EXPECT_GT(compared, 500);
}

TEST(MaskedCorrelatorTest, MakesTransformsNoLargerThanTheShiftsNeed)
{
  const Volume<Complex> fixed = RandomVoxels({20, 20, 20}, 1);
  const auto size = [&](int first, int last) {
    return MaskedCorrelator(fixed.View(), {16, 16, 16}, {{first, first, first}, {last, last, last}}).TransformSize();
  };
  EXPECT_EQ(size(-15, 19), (std::array<int, 3>{35, 35, 35})); // 20 + 16 - 1
  EXPECT_EQ(size(-8, 12), (std::array<int, 3>{28, 28, 28}));
  EXPECT_EQ(size(1, 3), (std::array<int, 3>{20, 20, 20}));
}

TEST(MaskedCorrelatorTest, NeverGivesWhatIsNotANumber)
{
  const Volume<Complex> flat({6, 6, 6}, Complex(1.0f, 0.5f)), nothing({6, 6, 6}), voxels = RandomVoxels({6, 6, 6}, 3);
  const ShiftRange range{{-5, -5, -5}, {5, 5, 5}};
  for (const auto& [fixed, moving] : {std::pair(&flat, &voxels), std::pair(&voxels, &flat), std::pair(&flat, &nothing)}) {
    const MaskedCorrelator correlator(fixed->View(), moving->Dimensions(), range);
    MaskedCorrelator::Work work;
    Volume<Complex> out(range.Counts());
    correlator.Normalised(moving->View(), 0.0, out.View(), work);
    for (const Complex& c : out.View()) {
      EXPECT_TRUE(std::isfinite(c.real()) && std::isfinite(c.imag()));
      EXPECT_LE(std::abs(c.imag()), 1.0f);
    }
    EXPECT_NEAR(out.View()(5, 5, 5).imag(), 0.0, 1e-6); // one of the two is constant
  }
}

// A smooth random field of the world, without symmetry, known everywhere.
class Scene {
public:
  explicit Scene(std::uint64_t seed)
  {
    for (std::uint64_t w = 0; w < 40; ++w) {
      Random random(seed, w);
      const double length = random.Uniform(18.0, 50.0);
      waves_.push_back({random.Direction() * (6.283185307179586 / length), random.Uniform(0.0, 6.283185307179586)});
    }
  }
  double operator()(const Eigen::Vector3d& p) const
  {
    double sum = 0.0;
    for (const auto& [k, phase] : waves_)
      sum += std::cos(k.dot(p) + phase);
    return 100.0 + 8.0 * sum;
  }

private:
  std::vector<std::pair<Eigen::Vector3d, double>> waves_;
};

ImageGeometry Box(const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing, const Eigen::Vector3d& origin)
{
  ImageGeometry geometry;
  geometry.dimensions = dimensions;
  geometry.spacing = spacing;
  geometry.origin = origin;
  return geometry;
}

// A volume of the scene and its pyramid; voxels where \a change gives NaN are not real.
struct Seen {
  Seen(
      const Scene& scene, const ImageGeometry& where,
      const std::function<double(const Eigen::Vector3d&, double)>& change = [](const Eigen::Vector3d&, double v) { return v; })
    : geometry(where)
  {
    Volume<float> voxels(where.dimensions);
    const auto view = voxels.View();
    const Eigen::Affine3d toWorld = where.IndexToWorld();
    ParallelFor(where.dimensions[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < where.dimensions[1]; ++j)
        for (int i = 0; i < where.dimensions[0]; ++i) {
          const Eigen::Vector3d p = toWorld * Eigen::Vector3d(i, j, static_cast<double>(k));
          view(i, j, static_cast<int>(k)) = static_cast<float>(change(p, scene(p)));
        }
    });
    pyramid = BuildPyramid<float>({voxels.View(), {}, where});
  }
  ImageGeometry geometry;
  std::vector<PyramidLevel> pyramid;
};

// Mean distance between where two poses put the corners of a grid.
double Distance(const Pose& a, const Pose& b, const ImageGeometry& geometry)
{
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto& n = geometry.dimensions;
    const Eigen::Vector3d p = geometry.IndexToWorld() *
                              Eigen::Vector3d(corner & 1 ? n[0] - 1 : 0, corner & 2 ? n[1] - 1 : 0, corner & 4 ? n[2] - 1 : 0);
    sum += (a * p - b * p).norm() / 8.0;
  }
  return sum;
}

// Small and coarse, for tests: some hundred rotations of some thousand voxels.
GlobalSearchParameters Quick(double coneDegrees, double reachMm = std::numeric_limits<double>::infinity())
{
  GlobalSearchParameters p;
  p.coneDegrees = coneDegrees;
  p.reachMm = reachMm;
  p.resolution = 24;
  p.stepDegrees = coneDegrees > 60.0 ? 26.0 : 20.0;
  p.candidates = 4;
  return p;
}

// Two views of one scene; the moving one lies where it belongs when its pose is the identity. Half of it is common to both.
class GlobalSearchTest : public testing::Test {
protected:
  const Scene scene{11};
  const Seen fixedSeen{scene, Box({46, 40, 34}, {2.0, 2.0, 2.0}, {0.0, 0.0, 0.0})};
  const Seen movingSeen{scene, Box({46, 40, 34}, {2.0, 2.0, 2.0}, {36.0, 8.0, -6.0})};
  const PlacedVolume fixed{&fixedSeen.pyramid, Pose::Identity(), "A"}, moving{&movingSeen.pyramid, Pose::Identity(), "B"};

  // The moving volume turned about its middle and moved.
  PlacedVolume Knocked(std::uint64_t item, double degrees, double mm) const
  {
    Random random(77, item);
    PlacedVolume knocked = moving;
    const Eigen::Vector3d axis = random.Direction(), way = random.Direction();
    knocked.volumeToWorld = MotionAbout(movingSeen.geometry.Centre(), degrees * RadiansPerDegree * axis, mm * way);
    return knocked;
  }
};

TEST_F(GlobalSearchTest, FindsTheWayBackFromACone)
{
  ECHORAMA_SKIP_SANITIZED();
  for (std::uint64_t item = 0; item < 2; ++item) {
    const GlobalSearchResult result = GlobalSearch(fixed, Knocked(item, 25.0, 30.0), Quick(30.0, 40.0));
    ASSERT_FALSE(result.candidates.empty());
    const GlobalCandidate& best = result.candidates.front();
    EXPECT_LT(Distance(best.volumeToWorld, Pose::Identity(), movingSeen.geometry), 4.0) << item;
    EXPECT_GT(best.ncc, 0.8);
    EXPECT_NEAR(best.overlap, 56.0 / 92.0 * 72.0 / 80.0 * 62.0 / 68.0, 0.1);
    EXPECT_GT(best.sharpness, 3.0);
    EXPECT_TRUE(IsRotation(best.volumeToWorld.linear(), 1e-12));
    EXPECT_EQ(result.rotations, static_cast<int>(RotationCover(30.0, 20.0).size()));
    EXPECT_NEAR(result.voxelMm, 92.0 / 24.0, 0.2);
  }
}

TEST_F(GlobalSearchTest, FindsTheWayBackFromAnywhere)
{
  ECHORAMA_SKIP_SANITIZED();
  const GlobalSearchResult result = GlobalSearch(fixed, Knocked(3, 170.0, 200.0), Quick(180.0));
  ASSERT_FALSE(result.candidates.empty());
  EXPECT_LT(Distance(result.candidates.front().volumeToWorld, Pose::Identity(), movingSeen.geometry), 5.0);
}

TEST_F(GlobalSearchTest, TurnsAndMovesTheFixedVolumeToo)
{
  const Pose placed = MotionAbout({10.0, 20.0, 30.0}, {0.3, -0.8, 0.5}, {100.0, -50.0, 20.0});
  PlacedVolume away = fixed, knocked = Knocked(1, 20.0, 20.0);
  away.volumeToWorld = placed;
  knocked.volumeToWorld = placed * knocked.volumeToWorld;
  const GlobalSearchResult result = GlobalSearch(away, knocked, Quick(25.0, 30.0));
  ASSERT_FALSE(result.candidates.empty());
  EXPECT_LT(Distance(result.candidates.front().volumeToWorld, placed, movingSeen.geometry), 4.0);
}

TEST_F(GlobalSearchTest, DoesNotDependOnTheThreads)
{
  ECHORAMA_SKIP_SANITIZED();
  GlobalSearchResult results[2];
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    results[threads - 1] = GlobalSearch(fixed, Knocked(2, 20.0, 20.0), Quick(25.0, 30.0));
  }
  ASSERT_EQ(results[0].candidates.size(), results[1].candidates.size());
  for (std::size_t i = 0; i < results[0].candidates.size(); ++i) {
    EXPECT_EQ(results[0].candidates[i].volumeToWorld.matrix(), results[1].candidates[i].volumeToWorld.matrix());
    EXPECT_EQ(results[0].candidates[i].ncc, results[1].candidates[i].ncc);
  }
}

// Gain, an offset, and brightness that changes slowly leave the answer alone.
TEST_F(GlobalSearchTest, IsNotMisledByGain)
{
  ECHORAMA_SKIP_SANITIZED();
  const Seen dim(scene, movingSeen.geometry,
                 [](const Eigen::Vector3d& p, double v) { return 0.3 * v * (1.0 - 0.006 * (p.z() + 6.0)) + 40.0; });
  PlacedVolume knocked = Knocked(0, 25.0, 30.0);
  knocked.pyramid = &dim.pyramid;
  const GlobalSearchResult result = GlobalSearch(fixed, knocked, Quick(30.0, 40.0));
  ASSERT_FALSE(result.candidates.empty());
  EXPECT_LT(Distance(result.candidates.front().volumeToWorld, Pose::Identity(), movingSeen.geometry), 4.0);
}

// A fan-shaped valid region and a hole; a corner of the moving volume shows something else, and is not to be trusted.
TEST_F(GlobalSearchTest, LooksAtWhatIsRealAndTrusted)
{
  ECHORAMA_SKIP_SANITIZED();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Seen fan(scene, fixedSeen.geometry, [nan](const Eigen::Vector3d& p, double v) {
    return std::abs(p.x() - 45.0) > 20.0 + 0.5 * p.z() || (p - Eigen::Vector3d(50.0, 40.0, 30.0)).norm() < 9.0 ? nan : v;
  });
  const auto wrong = [](const Eigen::Vector3d& p) { return p.x() < 64.0 && p.y() < 50.0; };
  const Scene other(99);
  const Seen spoilt(scene, movingSeen.geometry,
                    [&](const Eigen::Vector3d& p, double v) { return wrong(p) ? other(p) + 60.0 : v; });
  const Seen trust(scene, movingSeen.geometry, [&](const Eigen::Vector3d& p, double) { return wrong(p) ? 0.0 : 1.0; });
  PlacedVolume knocked = Knocked(1, 20.0, 20.0);
  knocked.pyramid = &spoilt.pyramid;
  const GlobalSearchResult without = GlobalSearch({&fan.pyramid, Pose::Identity(), "A"}, knocked, Quick(25.0, 30.0));
  knocked.reliability = &trust.pyramid;
  const GlobalSearchResult with = GlobalSearch({&fan.pyramid, Pose::Identity(), "A"}, knocked, Quick(25.0, 30.0));
  ASSERT_FALSE(with.candidates.empty());
  EXPECT_LT(Distance(with.candidates.front().volumeToWorld, Pose::Identity(), movingSeen.geometry), 5.0);
  ASSERT_FALSE(without.candidates.empty());
  EXPECT_GT(with.candidates.front().ncc, without.candidates.front().ncc + 0.1);

  const Seen small(scene, Box({20, 20, 20}, {2.0, 2.0, 2.0}, {0.0, 0.0, 0.0}));
  knocked.reliability = &small.pyramid;
  EXPECT_NE(MessageOf([&] { GlobalSearch(fixed, knocked, Quick(25.0)); }, Error::Kind::BadInput).find("B: its reliability"),
            std::string::npos);
}

TEST_F(GlobalSearchTest, WorksAcrossSpacingsAndSizes)
{
  ECHORAMA_SKIP_SANITIZED();
  ImageGeometry other = Box({36, 38, 12}, {1.5, 1.5, 7.5}, {0.0, 0.0, 0.0}); // 1 : 1 : 5, oblique
  other.direction = ExpRotation({0.0, 0.2, 0.4});
  other.origin += fixedSeen.geometry.Centre() + Eigen::Vector3d(8.0, -4.0, 2.0) - other.Centre();
  const Seen slabs(scene, other);
  const Pose start = MotionAbout(other.Centre(), {0.2, -0.2, 0.1}, {15.0, -12.0, 8.0});
  const GlobalSearchResult result = GlobalSearch(fixed, {&slabs.pyramid, start, "B"}, Quick(25.0, 30.0));
  ASSERT_FALSE(result.candidates.empty());
  EXPECT_LT(Distance(result.candidates.front().volumeToWorld, Pose::Identity(), other), 6.0);

  // A tenth of the volume.
  const Seen part(scene, Box({40, 38, 36}, {1.0, 1.0, 1.0}, {30.0, 20.0, 16.0}));
  const Pose turned = MotionAbout(part.geometry.Centre(), {-0.1, 0.2, 0.2}, {12.0, 9.0, -15.0});
  GlobalSearchParameters p = Quick(25.0, 30.0);
  p.minimumOverlap = 0.5;
  const GlobalSearchResult inside = GlobalSearch(fixed, {&part.pyramid, turned, "B"}, p);
  ASSERT_FALSE(inside.candidates.empty());
  EXPECT_LT(Distance(inside.candidates.front().volumeToWorld, Pose::Identity(), part.geometry), 4.0);
  EXPECT_GT(inside.candidates.front().overlap, 0.9);
}

// Each limit cuts candidates off that the search without it has, and leaves some.
TEST_F(GlobalSearchTest, KeepsToReachOverlapAndCount)
{
  const PlacedVolume knocked = Knocked(0, 20.0, 30.0);
  const Eigen::Vector3d centre = movingSeen.geometry.Centre();
  const auto way = [&](const GlobalCandidate& c) { return (c.volumeToWorld * centre - knocked.volumeToWorld * centre).norm(); };
  GlobalSearchParameters p = Quick(25.0, 45.0);
  p.candidates = 12;
  const std::vector<GlobalCandidate> all = GlobalSearch(fixed, knocked, p).candidates;
  ASSERT_GT(all.size(), 3u);
  ASSERT_TRUE(std::any_of(all.begin(), all.end(), [&](const GlobalCandidate& c) { return way(c) > 20.0; }));
  ASSERT_TRUE(std::any_of(all.begin(), all.end(), [](const GlobalCandidate& c) { return c.overlap < 0.4; }));

  p.candidates = 3;
  EXPECT_EQ(GlobalSearch(fixed, knocked, p).candidates.size(), 3u);
  p.candidates = 12;
  p.reachMm = 15.0;
  p.minimumOverlap = 0.4;
  const GlobalSearchResult result = GlobalSearch(fixed, knocked, p);
  ASSERT_GE(result.candidates.size(), 2u);
  for (const GlobalCandidate& c : result.candidates) {
    EXPECT_LE(way(c), 15.5);
    EXPECT_GE(c.overlap, 0.399);
    EXPECT_TRUE(std::isfinite(c.sharpness));
  }
  for (std::size_t i = 1; i < result.candidates.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT(Distance(result.candidates[i].volumeToWorld, result.candidates[j].volumeToWorld, movingSeen.geometry), 8.0);
  // Too far apart for any overlap: no candidate, and no complaint.
  PlacedVolume far = moving;
  far.volumeToWorld.translation() = Eigen::Vector3d(500.0, 0.0, 0.0);
  EXPECT_TRUE(GlobalSearch(fixed, far, Quick(10.0, 20.0)).candidates.empty());
}

TEST_F(GlobalSearchTest, RefusesVolumesWithNothingToAlign)
{
  const auto refused = [&](const PlacedVolume& volume) {
    const std::string message = MessageOf([&] { GlobalSearch(fixed, volume, Quick(20.0)); }, Error::Kind::BadInput);
    EXPECT_EQ(message, MessageOf([&] { GlobalSearch(volume, moving, Quick(20.0)); }, Error::Kind::BadInput));
    return message;
  };
  const Seen constant(scene, movingSeen.geometry, [](const Eigen::Vector3d&, double) { return 5.0; });
  EXPECT_NE(refused({&constant.pyramid, Pose::Identity(), "C"}).find("C: it is constant"), std::string::npos);
  int kept = 0;
  const ThreadLimit oneThread(1);
  const Seen nearlyEmpty(scene, movingSeen.geometry, [&kept](const Eigen::Vector3d&, double v) {
    return ++kept < 60 ? v : std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_NE(refused({&nearlyEmpty.pyramid, Pose::Identity(), "D"}).find("D: only 59"), std::string::npos);
  const Seen plane(scene, Box({64, 64, 1}, {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}));
  EXPECT_NE(refused({&plane.pyramid, Pose::Identity(), "E"}).find("E: it is not a volume"), std::string::npos);
  EXPECT_NE(refused({nullptr, Pose::Identity(), "F"}).find("F: it has no voxels"), std::string::npos);
}

TEST(GlobalSearchParametersTest, NamesWhatIsOutOfRange)
{
  const auto refused = [](void (*change)(GlobalSearchParameters&)) {
    GlobalSearchParameters p;
    change(p);
    return MessageOf([&] { p.Check(); }, Error::Kind::InvalidParameter);
  };
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.coneDegrees = 181.0; }).find("ConeDegrees"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.reachMm = 0.0; }).find("reach"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.reachMm = std::nan(""); }).find("reach"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.minimumOverlap = 0.0; }).find("MinimumOverlap"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.resolution = 8; }).find("Resolution"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.stepDegrees = 1.0; }).find("StepDegrees"), std::string::npos);
  EXPECT_NE(refused([](GlobalSearchParameters& p) { p.candidates = 0; }).find("Candidates"), std::string::npos);
}

TEST_F(GlobalSearchTest, StopsWhenAskedAndProgressGrowsToOne)
{
  int calls = 0;
  const Progress stop([&calls](double) { return ++calls < 5; });
  MessageOf([&] { GlobalSearch(fixed, moving, Quick(60.0), stop); }, Error::Kind::Cancelled);
  double last = 0.0;
  GlobalSearch(fixed, moving, Quick(10.0, 20.0), Progress([&last](double fraction) {
                 EXPECT_GE(fraction, last);
                 last = fraction;
                 return true;
               }));
  EXPECT_EQ(last, 1.0);
}

} // namespace
} // namespace echorama
