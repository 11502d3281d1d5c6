// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Widgets/Painting/VoxelEdits.h"
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;
using Eigen::Vector3d;

// A volume of its own, anisotropic and oblique, with holes in its valid region and, where the type has them, voxels that are
// not finite.
template <class T>
struct Painted {
  Volume<T> intensity;
  Volume<unsigned char> valid;
  ImageGeometry geometry;

  explicit Painted(const std::array<int, 3>& dimensions = {29, 23, 17}) : intensity(dimensions), valid(dimensions, 1)
  {
    Random random(3);
    geometry.dimensions = dimensions;
    geometry.spacing = Vector3d(0.5, 0.75, 1.25);
    geometry.direction = ExpRotation(Vector3d(0.4, -0.3, 0.9));
    geometry.origin = Vector3d(10, -20, 30);
    for (T& voxel : intensity.View())
      voxel = static_cast<T>(random.Uniform(0.0, 200.0));
    for (unsigned char& voxel : valid.View())
      voxel = random.Uniform() < 0.2 ? 0 : 1;
    if (std::is_floating_point_v<T>)
      for (int n = 0; n < 30; ++n)
        intensity.View()[static_cast<std::ptrdiff_t>(random.Below(static_cast<std::uint64_t>(intensity.View().Size())))] =
            std::numeric_limits<T>::quiet_NaN();
  }
  Vector3d At(double i, double j, double k) const { return geometry.IndexToWorld() * Vector3d(i, j, k); }
  VoxelEdits<T> Edits() { return {intensity.View(), valid.View(), geometry}; }
  bool SameBits(const Painted& other) const
  {
    return std::memcmp(intensity.View().Data(), other.intensity.View().Data(),
                       sizeof(T) * static_cast<std::size_t>(intensity.View().Size())) == 0 &&
           std::equal(valid.View().begin(), valid.View().end(), other.valid.View().begin());
  }
};

double DistanceFromPath(const Vector3d& p, const std::vector<Vector3d>& path)
{
  double least = (p - path.front()).norm();
  for (std::size_t n = 1; n < path.size(); ++n) {
    const Vector3d ab = path[n] - path[n - 1], ap = p - path[n - 1];
    const double t = ab.squaredNorm() > 0.0 ? std::clamp(ap.dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
    least = std::min(least, (ap - t * ab).norm());
  }
  return least;
}

// One stroke on the whole volume, by definition. \a file: what Restore gives back.
template <class T>
void PaintByDefinition(Painted<T>& volume, const Painted<T>& file, const Stroke& stroke)
{
  const Brush& brush = stroke.brush;
  std::ptrdiff_t at = 0;
  for (int k = 0; k < volume.geometry.dimensions[2]; ++k)
    for (int j = 0; j < volume.geometry.dimensions[1]; ++j)
      for (int i = 0; i < volume.geometry.dimensions[0]; ++i, ++at) {
        const double d = DistanceFromPath(volume.At(i, j, k), stroke.pathMm);
        T& value = volume.intensity.View()[at];
        unsigned char& valid = volume.valid.View()[at];
        if (d > brush.radiusMm)
          continue;
        if (brush.mode == BrushMode::Carve) {
          valid = 0;
        } else if (brush.mode == BrushMode::Restore) {
          value = file.intensity.View()[at];
          valid = file.valid.View()[at];
        } else {
          const double s = std::max(0.0, (d / brush.radiusMm - brush.hardness) / (1.0 - brush.hardness + 1e-300));
          const double weight =
              brush.opacity * (d <= brush.hardness * brush.radiusMm ? 1.0 : 1.0 - 3.0 * s * s + 2.0 * s * s * s);
          const bool finite = std::isfinite(static_cast<double>(value));
          if (weight <= 0.0 || (brush.insideValid && !(finite && valid)))
            continue;
          const double before = finite ? static_cast<double>(value) : 0.0;
          double painted = before + weight * (brush.intensity - before);
          if (std::is_integral_v<T>)
            painted = std::clamp(std::floor(painted + 0.5), static_cast<double>(std::numeric_limits<T>::min()),
                                 static_cast<double>(std::numeric_limits<T>::max()));
          value = static_cast<T>(painted);
          valid = valid ? valid : 1;
        }
      }
}

// How many voxels are not as they should be; values to one grey level (a weight's rounding may turn a half).
template <class T>
int CountWrong(const Painted<T>& volume, const Painted<T>& expected)
{
  int wrong = 0;
  for (std::ptrdiff_t v = 0; v < volume.intensity.View().Size(); ++v) {
    const double a = static_cast<double>(volume.intensity.View()[v]), b = static_cast<double>(expected.intensity.View()[v]);
    const bool same = std::isnan(a) ? std::isnan(b) : std::fabs(a - b) <= (std::is_integral_v<T> ? 1.0 : 1e-4);
    wrong += !same || volume.valid.View()[v] != expected.valid.View()[v];
  }
  return wrong;
}

template <class T>
int CountDifferent(const Painted<T>& a, const Painted<T>& b)
{
  int different = 0;
  for (std::ptrdiff_t v = 0; v < a.intensity.View().Size(); ++v)
    different +=
        std::memcmp(&a.intensity.View()[v], &b.intensity.View()[v], sizeof(T)) != 0 || a.valid.View()[v] != b.valid.View()[v];
  return different;
}

Stroke RandomStroke(std::uint64_t seed, const ImageGeometry& geometry)
{
  Random random(99, seed);
  Stroke stroke;
  stroke.brush.mode = static_cast<BrushMode>(random.Below(3));
  stroke.brush.radiusMm = random.Uniform(0.2, 4.0);
  stroke.brush.intensity = random.Uniform(-50.0, 300.0);
  stroke.brush.opacity = random.Uniform();
  stroke.brush.hardness = random.Uniform();
  stroke.brush.insideValid = random.Uniform() < 0.5;
  for (std::uint64_t n = 1 + random.Below(5); n > 0; --n)
    stroke.pathMm.push_back(geometry.IndexToWorld() * Vector3d(random.Uniform(-4.0, geometry.dimensions[0] + 4.0),
                                                               random.Uniform(-4.0, geometry.dimensions[1] + 4.0),
                                                               random.Uniform(-4.0, geometry.dimensions[2] + 4.0)));
  return stroke;
}

template <class T>
class VoxelEditsOf : public testing::Test {
};
using VoxelTypes = testing::Types<unsigned char, short, unsigned short, float, double>;
TYPED_TEST_SUITE(VoxelEditsOf, VoxelTypes);

TYPED_TEST(VoxelEditsOf, StrokesAreWhatTheDefinitionSays)
{
  Painted<TypeParam> volume, expected;
  const Painted<TypeParam> file;
  auto edits = volume.Edits();
  StrokeChain chain;
  for (std::uint64_t n = 0; n < 12; ++n) {
    chain = Append(chain, RandomStroke(n, volume.geometry));
    edits.GoTo(chain);
    // Each stroke by itself, so that a grey level's difference does not grow.
    PaintByDefinition(expected, file, chain->stroke);
    EXPECT_EQ(CountWrong(volume, expected), 0) << n;
    expected = volume;
  }
}

TYPED_TEST(VoxelEditsOf, RandomStepsThroughATreeOfStrokesAreExactToTheBit)
{
  Painted<TypeParam> volume;
  auto edits = volume.Edits();
  struct State {
    StrokeChain chain;
    std::unique_ptr<Painted<TypeParam>> voxels;
  };
  // 200 strokes; now and then on an older state, so that there are branches.
  std::vector<State> states;
  states.push_back({nullptr, std::make_unique<Painted<TypeParam>>(volume)});
  Random random(4);
  for (std::uint64_t n = 0; n < 200; ++n) {
    const std::size_t from = n % 10 == 9 ? random.Below(states.size()) : states.size() - 1;
    const StrokeChain chain = Append(states[from].chain, RandomStroke(1000 + n, volume.geometry));
    edits.GoTo(chain);
    states.push_back({chain, std::make_unique<Painted<TypeParam>>(volume)});
  }
  for (int n = 0; n < 200; ++n) {
    const State& state = states[random.Below(states.size())];
    edits.GoTo(state.chain);
    ASSERT_TRUE(volume.SameBits(*state.voxels)) << n;
  }
  edits.GoTo(nullptr);
  EXPECT_TRUE(volume.SameBits(*states.front().voxels));
  EXPECT_EQ(edits.MemoryBytes(), 0u);
}

TYPED_TEST(VoxelEditsOf, AStrokeInTheMakingIsTheFinishedOne)
{
  Painted<TypeParam> live, whole, before;
  auto liveEdits = live.Edits(), wholeEdits = whole.Edits();
  for (std::uint64_t n = 0; n < 30; ++n) {
    const Stroke stroke = RandomStroke(2000 + n, live.geometry);
    liveEdits.Begin(stroke.brush);
    for (const Vector3d& point : stroke.pathMm)
      liveEdits.Extend(point);
    if (n % 3 == 0) { // taken back
      liveEdits.End(nullptr);
      ASSERT_TRUE(live.SameBits(before));
      continue;
    }
    const StrokeChain chain = Append(nullptr, stroke);
    wholeEdits.GoTo(chain);
    ASSERT_TRUE(live.SameBits(whole)) << n;
    EXPECT_TRUE(liveEdits.End(chain).Empty()) << "what is painted stays";
    ASSERT_TRUE(live.SameBits(whole)) << n;
    liveEdits.GoTo(nullptr);
    ASSERT_TRUE(live.SameBits(before)) << n;
  }
}

TEST(VoxelEdits, AStraightStrokeDoesNotDependOnHowItIsSampled)
{
  for (const BrushMode mode : {BrushMode::Paint, BrushMode::Carve}) {
    Painted<float> coarse, fine;
    auto coarseEdits = coarse.Edits(), fineEdits = fine.Edits();
    Stroke stroke;
    stroke.brush.mode = mode;
    stroke.brush.radiusMm = 3.0;
    stroke.brush.intensity = 222.0;
    stroke.brush.opacity = 0.7;
    const Vector3d a = coarse.At(2, 3, 4), b = coarse.At(25, 18, 12);
    stroke.pathMm = {a, b};
    coarseEdits.GoTo(Append(nullptr, stroke));
    Random random(5);
    stroke.pathMm = {a};
    for (double t = 0.0; t < 1.0; t += random.Uniform(0.0, 0.02))
      stroke.pathMm.push_back(a + t * (b - a));
    stroke.pathMm.push_back(b);
    fineEdits.GoTo(Append(nullptr, stroke));
    EXPECT_EQ(CountWrong(coarse, fine), 0);
    EXPECT_GT(CountDifferent(coarse, Painted<float>()), 500) << "it painted";
  }
}

TEST(VoxelEdits, KeepsInsideTheValidRegionWhenAsked)
{
  Painted<unsigned char> volume;
  const Painted<unsigned char> file;
  auto edits = volume.Edits();
  Stroke stroke;
  stroke.brush.radiusMm = 100.0;
  stroke.brush.intensity = 250.0;
  stroke.brush.hardness = 1.0;
  stroke.pathMm = {volume.geometry.Centre()};
  edits.GoTo(Append(nullptr, stroke));
  for (std::ptrdiff_t v = 0; v < volume.valid.View().Size(); ++v) {
    ASSERT_EQ(volume.valid.View()[v], file.valid.View()[v]);
    ASSERT_EQ(volume.intensity.View()[v], file.valid.View()[v] ? 250 : file.intensity.View()[v]);
  }
  stroke.brush.insideValid = false;
  edits.GoTo(Append(nullptr, stroke));
  for (std::ptrdiff_t v = 0; v < volume.valid.View().Size(); ++v) {
    ASSERT_EQ(volume.valid.View()[v], 1);
    ASSERT_EQ(volume.intensity.View()[v], 250);
  }
}

TEST(VoxelEdits, CarvingHidesAndRestoringBringsBackTheFile)
{
  Painted<float> volume;
  const Painted<float> file;
  auto edits = volume.Edits();
  Stroke paint, carve, restore;
  paint.brush.radiusMm = carve.brush.radiusMm = 4.0;
  paint.brush.intensity = 77.0;
  carve.brush.mode = BrushMode::Carve;
  restore.brush.mode = BrushMode::Restore;
  restore.brush.radiusMm = 50.0;
  paint.pathMm = carve.pathMm = restore.pathMm = {volume.geometry.Centre()};
  StrokeChain chain = Append(Append(nullptr, paint), carve);
  edits.GoTo(chain);
  EXPECT_EQ(volume.valid.View()(14, 11, 8), 0);
  EXPECT_EQ(volume.intensity.View()(14, 11, 8), 77.0f) << "carving leaves intensities alone";
  chain = Append(chain, restore);
  edits.GoTo(chain);
  EXPECT_TRUE(volume.SameBits(file));
  edits.GoTo(chain->before->before);
  EXPECT_EQ(volume.valid.View()(14, 11, 8), file.valid.View()(14, 11, 8));
}

TEST(VoxelEdits, BrushesAtTheRimOutsideAndSmallerThanAVoxel)
{
  Painted<short> volume;
  const Painted<short> file;
  auto edits = volume.Edits();
  Stroke stroke;
  stroke.brush.intensity = -300.0;
  stroke.brush.insideValid = false;
  stroke.brush.hardness = 1.0;
  stroke.brush.radiusMm = 1e-3;
  const auto paint = [&](const Vector3d& at) {
    stroke.pathMm = {at};
    edits.GoTo(nullptr);
    return edits.GoTo(Append(nullptr, stroke));
  };
  EXPECT_TRUE(paint(volume.At(3.5, 4.0, 5.0)).Empty()) << "between voxels";
  EXPECT_TRUE(volume.SameBits(file));
  const auto box = paint(volume.At(3.0, 4.0, 16.0)); // on a voxel of the rim
  EXPECT_EQ(CountDifferent(volume, file), 1);
  EXPECT_EQ(volume.intensity.View()(3, 4, 16), -300);
  EXPECT_LE(box.begin[2], 16);
  EXPECT_EQ(box.end[2], 17) << "the box ends with the volume";
  stroke.brush.radiusMm = 3.0;
  EXPECT_TRUE(paint(volume.At(-20.0, 4.0, 5.0)).Empty());
  EXPECT_TRUE(paint(Vector3d(1e9, -1e9, 1e9)).Empty());
  EXPECT_TRUE(volume.SameBits(file));
  EXPECT_FALSE(paint(volume.At(-2.0, -1.0, -1.0)).Empty()) << "from outside into a corner";
  Painted<short> expected;
  PaintByDefinition(expected, file, stroke);
  EXPECT_EQ(CountWrong(volume, expected), 0);
}

TEST(VoxelEdits, TheBoxHoldsAllThatChanged)
{
  Painted<unsigned char> volume;
  auto edits = volume.Edits();
  StrokeChain chain;
  for (std::uint64_t n = 0; n < 60; ++n) {
    const Painted<unsigned char> before = volume;
    chain = n % 4 == 3 ? chain->before : Append(chain, RandomStroke(3000 + n, volume.geometry));
    const auto box = edits.GoTo(chain);
    for (int k = 0; k < 17; ++k)
      for (int j = 0; j < 23; ++j)
        for (int i = 0; i < 29; ++i) {
          const bool inside =
              i >= box.begin[0] && i < box.end[0] && j >= box.begin[1] && j < box.end[1] && k >= box.begin[2] && k < box.end[2];
          ASSERT_TRUE(inside || (volume.intensity.View()(i, j, k) == before.intensity.View()(i, j, k) &&
                                 volume.valid.View()(i, j, k) == before.valid.View()(i, j, k)));
        }
  }
}

TEST(VoxelEdits, MemoryGrowsWithWhatIsTouchedAlone)
{
  Painted<unsigned char> volume({128, 128, 128});
  auto edits = volume.Edits();
  Stroke dab;
  dab.brush.radiusMm = 2.0;
  dab.brush.intensity = 255.0;
  dab.pathMm = {volume.At(64, 64, 64)};
  edits.GoTo(Append(nullptr, dab));
  EXPECT_GT(edits.MemoryBytes(), 0u);
  EXPECT_LT(edits.MemoryBytes(), 32u * 1024u);
  Stroke nothing = dab;
  nothing.brush.opacity = 0.0;
  const std::size_t bytes = edits.MemoryBytes();
  EXPECT_TRUE(edits.GoTo(Append(Append(nullptr, dab), nothing)).Empty());
  EXPECT_EQ(edits.MemoryBytes(), bytes) << "a stroke that changes nothing keeps nothing; the same stroke read again is the same";
}

TEST(VoxelEdits, OneAndManyThreadsPaintTheSame)
{
  Painted<float> many({90, 80, 70}), one({90, 80, 70});
  auto manyEdits = many.Edits(), oneEdits = one.Edits();
  Stroke stroke;
  stroke.brush.radiusMm = 20.0;
  stroke.brush.intensity = 90.0;
  stroke.pathMm = {many.At(20, 20, 20), many.At(60, 50, 40)};
  manyEdits.GoTo(Append(nullptr, stroke));
  const ThreadLimit limit(1);
  oneEdits.GoTo(Append(nullptr, stroke));
  EXPECT_TRUE(many.SameBits(one));
}

TEST(VoxelEdits, RefusesWhatMakesNoSense)
{
  Painted<float> volume;
  const Painted<float> file;
  auto edits = volume.Edits();
  EXPECT_THROW(edits.Extend(Vector3d(0, 0, 0)), Error) << "nothing has begun";
  EXPECT_THROW(VoxelEdits<float>(volume.intensity.View(), {}, volume.geometry), Error);
  ImageGeometry other = volume.geometry;
  other.dimensions[0] = 5;
  EXPECT_THROW(VoxelEdits<float>(volume.intensity.View(), volume.valid.View(), other), Error);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Brush brush;
  for (const double radius : {0.0, -1.0, nan, 1001.0}) {
    brush.radiusMm = radius;
    EXPECT_THROW(edits.Begin(brush), Error) << radius;
  }
  brush = {};
  brush.hardness = nan;
  EXPECT_THROW(edits.Begin(brush), Error);
  edits.Begin({});
  EXPECT_THROW(edits.Begin({}), Error) << "one at a time";
  EXPECT_THROW(edits.Extend(Vector3d(0, nan, 0)), Error);
  edits.Extend(volume.geometry.Centre());
  edits.GoTo(nullptr);
  EXPECT_TRUE(volume.SameBits(file)) << "a stroke in the making is taken back";
  EXPECT_THROW(Append(nullptr, Stroke{}), Error) << "no points";
}

TEST(StrokeChain, LongChainsEndWithoutRecursion)
{
  StrokeChain chain;
  for (int n = 0; n < 300000; ++n)
    chain = Append(chain, Stroke{{}, {Vector3d(n, 0, 0)}});
  EXPECT_EQ(chain->count, 300000);
  const StrokeChain half = chain->before->before;
  chain.reset();
  EXPECT_EQ(StrokesOf(half).size(), 299998u);
}

} // namespace
