// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/VoxelTypes.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;
constexpr double degree = RadiansPerDegree;

struct Case {
  const char* name;
  ProbeGeometry probe;
};

std::vector<Case> Cases()
{
  const auto convex = [](double fan, double fanRadius, double sweep, double sweepRadius, double depthMin) {
    return ProbeGeometry::Convex(fan * degree, fanRadius, sweep * degree, sweepRadius, depthMin, 90.0);
  };
  return {{"convex", convex(70, 40, 60, 25, 0)},
          {"convex, starting deep", convex(70, 40, 60, 25, 30)},
          {"equal radii, half circle", convex(180, 40, 60, 40, 0)},
          {"tiny radii", convex(80, 1e-7, 75, 1e-9, 0)},
          {"wider than half a circle", convex(250, 15, 90, 60, 5)},
          {"behind the sweep axis", convex(140, 40, 60, 20, 0)},
          {"wide sweep", convex(60, 10, 300, 40, 0)},
          {"flat", ProbeGeometry::Linear(50, 40, 0, 60)},
          {"nearly flat", {1e-9, 50, 1e-7, 40, 0, 60}},
          {"slightly bent", {0.05, 50, 0.02, 40, 0, 60}},
          {"phased", ProbeGeometry::Phased(90 * degree, 80 * degree, 0, 100)},
          {"off centre", {35 * degree, 6.0, 40 * degree, 7.0, 14.0, 60.0, 0.41}},
          {"off centre, wide", {100 * degree, 30.0, 50 * degree, 20.0, 0.0, 60.0, -0.6}},
          {"flat, off centre", {0.0, 20.0, 0.0, 40.0, 0.0, 60.0, 1.3}},
          {"flat array, turned", {0.0, 50.0, 60 * degree, 20.0, 0.0, 80.0}},
          {"phased array, moved", {90 * degree, 0.0, 0.0, 40.0, 2.0, 80.0}}};
}

template <class T>
Volume<T> RandomBeams(const std::array<int, 3>& dimensions, double low, double high)
{
  Volume<T> beams(dimensions);
  Random random(3);
  for (T& sample : beams.View())
    sample = static_cast<T>(random.Uniform(low, high));
  return beams;
}

// Sample, beam and step of a world point, in double precision through the exact inverse; and whether the point is so near
// the edge that either answer is right.
struct Place {
  bool inside = false, atEdge = false;
  Eigen::Vector3d index;
};

Place PlaceOf(const ProbeGeometry& probe, const std::array<int, 3>& n, const Eigen::Vector3d& point)
{
  Place place;
  const auto beam = BeamPointAt(probe, point);
  place.inside = beam.has_value();
  place.atEdge = !beam && BeamPointAt(probe, point, 1e-4);
  if (beam)
    place.index = {(beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin) * (n[0] - 1),
                   (beam->fan + 0.5) * (n[1] - 1), (beam->sweep + 0.5) * (n[2] - 1)};
  for (int axis = 0; beam && axis < 3; ++axis)
    place.atEdge = place.atEdge || place.index[axis] < 1e-3 || place.index[axis] > n[axis] - 1 - 1e-3;
  return place;
}

template <class T>
double Interpolated(VolumeView<const T> beams, const Eigen::Vector3d& index)
{
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    int at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int last = beams.Dimensions()[axis] - 1;
      const int before = std::max(0, std::min(static_cast<int>(index[axis]), last - 1));
      const double t = index[axis] - before;
      at[axis] = std::min(before + (corner >> axis & 1), last);
      weight *= corner >> axis & 1 ? t : 1.0 - t;
    }
    sum += weight * static_cast<double>(beams(at[0], at[1], at[2]));
  }
  return sum;
}

struct Converted {
  explicit Converted(const ImageGeometry& g) : grid(g), intensity(g.dimensions, -1.0f), valid(g.dimensions, 77) {}
  ImageGeometry grid;
  Volume<float> intensity;
  Volume<unsigned char> valid;
};

Converted Convert(VolumeView<const float> beams, const ProbeGeometry& probe, const Pose& pose, const ImageGeometry& grid)
{
  Converted out(grid);
  ScanConvert<float>(beams, probe, pose, grid, out.intensity.View(), out.valid.View());
  return out;
}

// Every voxel against trilinear interpolation at the exact inverse. Returns how many were inside.
int ExpectReference(const char* name, VolumeView<const float> beams, const ProbeGeometry& probe, const Pose& pose,
                    const Converted& out, double tolerance)
{
  const Eigen::Affine3d toProbe = pose.inverse() * out.grid.IndexToWorld();
  const auto& n = out.grid.dimensions;
  int inside = 0, wrong = 0;
  double worst = 0.0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Place place = PlaceOf(probe, beams.Dimensions(), toProbe * Eigen::Vector3d(i, j, k));
        const int valid = out.valid.View()(i, j, k);
        const double value = out.intensity.View()(i, j, k);
        if (!place.atEdge && valid != (place.inside ? 1 : 0))
          ++wrong;
        if (valid == 0 && value != 0.0)
          ++wrong;
        if (valid == 1 && place.inside) {
          ++inside;
          worst = std::max(worst, std::abs(value - Interpolated(beams, place.index)));
        }
      }
  EXPECT_EQ(wrong, 0) << name;
  EXPECT_LT(worst, tolerance) << name;
  return inside;
}

TEST(ScanConversion, AgreesWithTheExactInverse)
{
  for (const Case& c : Cases()) {
    const Volume<float> beams = RandomBeams<float>({61, 23, 17}, 0, 255);
    const ImageGeometry grid = ScanConversionGrid(c.probe, Pose::Identity(), 3.1, 1u << 24);
    const int inside = ExpectReference(c.name, beams.View(), c.probe, Pose::Identity(),
                                       Convert(beams.View(), c.probe, Pose::Identity(), grid), 0.05);
    EXPECT_GT(inside, 1000) << c.name;
  }
}

TEST(ScanConversion, AgreesOnAnyGrid)
{
  const Pose pose = MotionAbout({3, 5, 7}, {0.4, -1.1, 0.3}, {20, -10, 5});
  for (const Case& c : Cases()) {
    const Volume<float> beams = RandomBeams<float>({61, 23, 17}, 0, 255);
    ImageGeometry grid = ScanConversionGrid(c.probe, Pose::Identity(), 4.3, 1u << 24);
    grid.spacing = {4.1, 5.3, 4.7};
    const ImageGeometry turned = grid.Moved(MotionAbout(grid.Centre(), {0.5, 0.2, -0.9}, {1, 2, 3}));
    int inside = ExpectReference(c.name, beams.View(), c.probe, pose, Convert(beams.View(), c.probe, pose, turned), 0.05);
    EXPECT_GT(inside, 50) << c.name << ", oblique";
    // Rows along the array, backwards, and slices that are turned about it.
    const ImageGeometry along = grid.Moved(MotionAbout(grid.Centre(), {0.7, 0, 0}, {1, 2, 3}) *
                                           MotionAbout(grid.Centre(), {0, 3.14159265358979, 0}, {0, 0, 0}))
                                    .Moved(pose);
    inside = ExpectReference(c.name, beams.View(), c.probe, pose, Convert(beams.View(), c.probe, pose, along), 0.05);
    EXPECT_GT(inside, 50) << c.name << ", along the array";
  }
}

// Some samples, beams and steps of many: what lies between them is as with all, and nothing else is there.
TEST(ScanConversion, APartOfTheBeamsFillsItsPart)
{
  const std::array<int, 3> all{61, 23, 17}, first{9, 5, 4}, count{37, 12, 8};
  const Pose turned = MotionAbout({3, 5, 7}, {0.4, -1.1, 0.3}, {20, -10, 5});
  const Volume<float> beams = RandomBeams<float>(all, 0, 255);
  Volume<float> part(count);
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      std::copy_n(beams.View().Row(j + first[1], k + first[2]) + first[0], count[0], part.View().Row(j, k));
  const BeamWindow window{all, first};
  for (const Case& c : Cases())
    for (const Pose& pose : {Pose::Identity(), turned}) {
      SCOPED_TRACE(c.name);
      const ImageGeometry grid = ScanConversionGrid(c.probe, Pose::Identity(), 3.1, 1u << 24);
      const Converted whole = Convert(beams.View(), c.probe, pose, grid);
      Converted some(grid);
      ScanConvert<float>(std::as_const(part).View(), c.probe, pose, grid, some.intensity.View(), some.valid.View(), {}, &window);
      const Eigen::Affine3d toProbe = pose.inverse() * grid.IndexToWorld();
      const auto& n = grid.dimensions;
      int inside = 0, wrong = 0;
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const Place place = PlaceOf(c.probe, all, toProbe * Eigen::Vector3d(i, j, k));
            double within = place.inside ? 1.0 : -1.0; // in distances between samples, beams or steps
            for (int axis = 0; place.inside && axis < 3; ++axis)
              within = std::min({within, place.index[axis] - first[axis], first[axis] + count[axis] - 1 - place.index[axis]});
            const bool valid = some.valid.View()(i, j, k) != 0;
            wrong += (within > 0.01 && !valid) || (within < -0.51 && valid);
            wrong += valid && !(whole.valid.View()(i, j, k) != 0);
            if (valid && within > 0.01) {
              ++inside;
              wrong += std::abs(some.intensity.View()(i, j, k) - whole.intensity.View()(i, j, k)) > 0.05f;
            }
          }
      EXPECT_EQ(wrong, 0);
      EXPECT_GT(inside, 100);
    }
  const BeamWindow beyond{all, {30, 5, 4}};
  Converted none(ScanConversionGrid(Cases()[0].probe, turned, 3.1, 1u << 24));
  EXPECT_THROW(ScanConvert<float>(std::as_const(part).View(), Cases()[0].probe, turned, none.grid, none.intensity.View(),
                                  none.valid.View(), {}, &beyond),
               Error);
}

TEST(ScanConversion, RampsAreCoordinates)
{
  // Beams that hold their own depth give the depth of each voxel, to single precision.
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 10, 110);
  Volume<float> beams({401, 65, 33});
  for (int k = 0; k < 33; ++k)
    for (int j = 0; j < 65; ++j)
      for (int i = 0; i < 401; ++i)
        beams.View()(i, j, k) = static_cast<float>(10.0 + i * 0.25);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 2.0, 1u << 24);
  const Converted out = Convert(beams.View(), probe, Pose::Identity(), grid);
  int inside = 0;
  for (int k = 0; k < grid.dimensions[2]; ++k)
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i) {
        if (!out.valid.View()(i, j, k))
          continue;
        ++inside;
        const Eigen::Vector3d p = grid.IndexToWorld() * Eigen::Vector3d(i, j, k);
        const double depth = std::hypot(p.x(), std::hypot(p.y(), p.z() + 25) - 25 + 40) - 40;
        ASSERT_NEAR(out.intensity.View()(i, j, k), std::fmin(std::fmax(depth, 10.0), 110.0), 5e-5);
      }
  EXPECT_GT(inside, 10000);
}

template <class T>
void ExpectConstant(T value)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 10, 60);
  const Volume<T> beams({37, 19, 11}, value);
  for (const Pose& pose : {Pose(Pose::Identity()), MotionAbout({0, 0, 0}, {0.3, 0.2, 0.1}, {0, 0, 0})}) {
    const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 2.3, 1u << 24);
    Volume<T> out(grid.dimensions);
    Volume<unsigned char> valid(grid.dimensions);
    ScanConvert<T>(beams.View(), probe, pose, grid, out.View(), valid.View());
    int inside = 0;
    for (std::ptrdiff_t i = 0; i < out.View().Size(); ++i) {
      inside += valid.View()[i];
      ASSERT_EQ(out.View()[i], valid.View()[i] ? value : T(0));
    }
    EXPECT_GT(inside, 1000);
  }
}

TEST(ScanConversion, AConstantStaysThatConstant)
{
#define EXPECT_CONSTANT(T)                                                                                                       \
  ExpectConstant<T>(std::numeric_limits<T>::max());                                                                              \
  ExpectConstant<T>(std::numeric_limits<T>::lowest());                                                                           \
  ExpectConstant<T>(static_cast<T>(7.3));
  ECHORAMA_FOR_EACH_VOXEL_TYPE(EXPECT_CONSTANT)
#undef EXPECT_CONSTANT
}

template <class T>
void ExpectRounded(double low, double high)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 10, 60);
  const Volume<T> beams = RandomBeams<T>({37, 19, 11}, low, high);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 2.3, 1u << 24);
  Volume<T> out(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions);
  ScanConvert<T>(beams.View(), probe, Pose::Identity(), grid, out.View(), valid.View());
  double worst = 0.0, bias = 0.0;
  int count = 0;
  for (int k = 0; k < grid.dimensions[2]; ++k)
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i) {
        const Place place = PlaceOf(probe, beams.Dimensions(), grid.IndexToWorld() * Eigen::Vector3d(i, j, k));
        if (!place.inside || !valid.View()(i, j, k))
          continue;
        const double difference = out.View()(i, j, k) - Interpolated<T>(beams.View(), place.index);
        worst = std::max(worst, std::abs(difference));
        bias += difference;
        ++count;
      }
  const double positions = 2e-4 * (high - low);
  EXPECT_LT(worst, 0.5 + positions);
  EXPECT_LT(std::abs(bias / count), 0.02 + positions) << "rounding, not cutting off";
}

TEST(ScanConversion, IntegersAreRounded)
{
  ExpectRounded<unsigned char>(0, 256);
  ExpectRounded<short>(-100, 100);
  ExpectRounded<short>(-32768, 32767);
  ExpectRounded<unsigned short>(0, 65535);
}

TEST(ScanConversion, DoublesKeepTheirDigits)
{
  const ProbeGeometry probe = ProbeGeometry::Linear(50, 40, 0, 60);
  Volume<double> beams({61, 51, 41});
  for (int k = 0; k < 41; ++k)
    for (int j = 0; j < 51; ++j)
      for (int i = 0; i < 61; ++i)
        beams.View()(i, j, k) = 1e9 + i;
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 1.0, 1u << 24);
  Volume<double> out(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions);
  ScanConvert<double>(beams.View(), probe, Pose::Identity(), grid, out.View(), valid.View());
  EXPECT_NEAR(out.View()(25, 20, 33), 1e9 + 33, 1e-4);
}

TEST(ScanConversion, SamplesOnVoxelsComeBack)
{
  // A flat probe whose samples lie on the voxels is the identity.
  const ProbeGeometry probe = ProbeGeometry::Linear(20, 10, 5, 35);
  const Volume<unsigned char> beams = RandomBeams<unsigned char>({31, 21, 11}, 0, 256);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 1.0, 1u << 24);
  ASSERT_EQ(grid.dimensions, (std::array<int, 3>{21, 11, 31}));
  Volume<unsigned char> out(grid.dimensions), valid(grid.dimensions);
  ScanConvert<unsigned char>(beams.View(), probe, Pose::Identity(), grid, out.View(), valid.View());
  for (int k = 0; k < 31; ++k)
    for (int j = 0; j < 11; ++j)
      for (int i = 0; i < 21; ++i) {
        ASSERT_EQ(valid.View()(i, j, k), 1);
        ASSERT_EQ(out.View()(i, j, k), beams.View()(k, i, j));
      }
}

TEST(ScanConversion, SamplesThatAreNotFiniteAreNotReal)
{
  const ProbeGeometry probe = ProbeGeometry::Linear(20, 10, 5, 35);
  Volume<float> beams({31, 21, 11}, 3.0f);
  beams.View()(15, 10, 5) = std::numeric_limits<float>::quiet_NaN();
  beams.View()(5, 3, 2) = std::numeric_limits<float>::infinity();
  ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 1.0, 1u << 24);
  grid.origin += Eigen::Vector3d(0.4, 0.4, 0.4);
  const Converted out = Convert(beams.View(), probe, Pose::Identity(), grid);
  int hidden = 0;
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 20; ++i) {
        const bool near15 = (k == 14 || k == 15) && (i == 9 || i == 10) && (j == 4 || j == 5);
        const bool near5 = (k == 4 || k == 5) && (i == 2 || i == 3) && (j == 1 || j == 2);
        hidden += near15 || near5;
        ASSERT_EQ(out.valid.View()(i, j, k), near15 || near5 ? 0 : 1) << i << " " << j << " " << k;
        ASSERT_EQ(out.intensity.View()(i, j, k), near15 || near5 ? 0.0f : 3.0f);
      }
  EXPECT_EQ(hidden, 16);
}

TEST(ScanConversion, SinglePlaneIsAnImage)
{
  const ProbeGeometry probe{70 * degree, 48.0, 0.0, 0.0, 3.0, 80.0};
  const Volume<float> beams = RandomBeams<float>({101, 33, 1}, 0, 255);
  const Pose pose = MotionAbout({3, 5, 7}, {0.4, -1.1, 0.3}, {20, -10, 5});
  const ImageGeometry grid = ScanConversionGrid(probe, pose, 0.7, 1u << 24);
  EXPECT_EQ(grid.dimensions[2], 1);
  EXPECT_NO_THROW(grid.Check("grid"));
  EXPECT_GT(ExpectReference("plane", beams.View(), probe, pose, Convert(beams.View(), probe, pose, grid), 0.05), 3000);
  // Turned in its plane, and as the middle slice of a volume.
  const Eigen::Vector3d normal = grid.direction.col(2);
  const ImageGeometry turned = grid.Moved(MotionAbout(grid.Centre(), 0.5 * normal, {0, 0, 0}));
  EXPECT_GT(ExpectReference("turned plane", beams.View(), probe, pose, Convert(beams.View(), probe, pose, turned), 0.05), 3000);
  ImageGeometry volume = grid;
  volume.dimensions[2] = 5;
  volume.origin -= 2.1 * 0.7 * normal;
  const Converted out = Convert(beams.View(), probe, pose, volume);
  for (int k = 0; k < 5; ++k)
    EXPECT_EQ(out.valid.View()(grid.dimensions[0] / 2, 50, k), k == 2 ? 1 : 0);
}

TEST(ScanConversion, TheGridIsTheTightestAroundTheFan)
{
  for (const Case& c : Cases()) {
    const Pose pose = MotionAbout({3, 5, 7}, {0.4, -1.1, 0.3}, {20, -10, 5});
    const ImageGeometry grid = ScanConversionGrid(c.probe, pose, 0.9, std::size_t{1} << 40);
    grid.Check("grid");
    const Eigen::Affine3d toIndex = grid.WorldToIndex();
    Eigen::AlignedBox3d box;
    Random random(1);
    for (int i = 0; i < 40000; ++i) {
      // Corners, edges and faces have their share.
      const auto coordinate = [&random] { return std::fmin(std::fmax(random.Uniform(-0.7, 0.7), -0.5), 0.5); };
      const double depth = c.probe.depthMin + (c.probe.depthMax - c.probe.depthMin) * (coordinate() + 0.5);
      box.extend(toIndex * (pose * PointOf(c.probe, {depth, coordinate(), coordinate()})));
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(box.min()[axis], -1e-3) << c.name;
      EXPECT_LE(box.max()[axis], grid.dimensions[axis] - 1 + 1e-3) << c.name;
      EXPECT_LT(grid.dimensions[axis] - 1 - box.sizes()[axis], 1.3) << c.name << ": a layer too many";
    }
  }
}

TEST(ScanConversion, SampleSpacingKeepsTheNumberOfVoxels)
{
  const ProbeGeometry flat = ProbeGeometry::Linear(50, 40, 0, 60);
  EXPECT_NEAR(SampleSpacing({601, 51, 11}, flat), std::cbrt(0.1 * 1.0 * 4.0), 1e-12);
  ProbeGeometry offset = ProbeGeometry::Convex(30 * degree, 10, 1.0, 10, 20, 60);
  offset.fanOffset = 2.0; // the middle beam leaves at 60 degrees
  EXPECT_NEAR(SampleSpacing({41, 11, 11}, offset), std::cbrt(50 * 3 * degree * 25 * 0.1), 1e-12);
  EXPECT_NEAR(SampleSpacing({601, 51, 1}, {0, 50, 0, 0, 0, 60}), std::sqrt(0.1), 1e-12);
}

TEST(ScanConversion, SameForAnyNumberOfThreads)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 0, 90);
  const Volume<float> beams = RandomBeams<float>({61, 23, 17}, 0, 255);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 2.0, 1u << 24);
  const Converted many = Convert(beams.View(), probe, Pose::Identity(), grid);
  const ThreadLimit limit(1);
  const Converted one = Convert(beams.View(), probe, Pose::Identity(), grid);
  for (std::ptrdiff_t i = 0; i < one.intensity.View().Size(); ++i)
    ASSERT_EQ(one.intensity.View()[i], many.intensity.View()[i]);
}

template <class Function>
std::string Refusal(Error::Kind kind, const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  return "no error";
}

TEST(ScanConversion, RefusesWhatDoesNotFit)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 0, 90), plane{1.2, 48, 0, 0, 0, 90};
  const auto check = [](const std::array<int, 3>& n, const ProbeGeometry& g, Error::Kind kind = Error::Kind::BadInput) {
    return Refusal(kind, [&] { CheckBeamVolume(n, g); });
  };
  EXPECT_EQ(check({2, 2, 2}, probe), "no error");
  EXPECT_EQ(check({2, 2, 1}, plane), "no error");
  EXPECT_NE(check({1, 9, 9}, probe).find("1 samples"), std::string::npos);
  EXPECT_NE(check({9, 1, 9}, probe).find("1 beams"), std::string::npos);
  EXPECT_NE(check({9, 9, 1}, probe).find("single step"), std::string::npos);
  EXPECT_NE(check({9, 9, 2}, plane).find("does not sweep"), std::string::npos);
  EXPECT_NE(check({9, 9, 9}, {}, Error::Kind::InvalidParameter).find("fan"), std::string::npos);
  EXPECT_NE(check({2000, 2000, 2000}, probe, Error::Kind::TooLarge).find("2^31"), std::string::npos);

  for (const double spacing : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_NE(Refusal(Error::Kind::InvalidParameter, [&] { ScanConversionGrid(probe, Pose::Identity(), spacing, 1000); })
                  .find("spacing"),
              std::string::npos);
  EXPECT_NE(
      Refusal(Error::Kind::TooLarge, [&] { ScanConversionGrid(probe, Pose::Identity(), 1.0, 1000); }).find("larger spacing"),
      std::string::npos);
  Refusal(Error::Kind::TooLarge, [&] { ScanConversionGrid(probe, Pose::Identity(), 1e-12, std::size_t(-1)); });

  const Volume<float> beams({9, 9, 9});
  ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 5.0, 1u << 24);
  Volume<float> out(grid.dimensions), small({2, 2, 2});
  Volume<unsigned char> valid(grid.dimensions);
  const auto convert = [&](const Pose& pose, VolumeView<float> to) {
    return Refusal(Error::Kind::BadInput, [&] { ScanConvert<float>(beams.View(), probe, pose, grid, to, valid.View()); });
  };
  EXPECT_NE(convert(Pose::Identity(), small.View()).find("dimensions"), std::string::npos);
  Pose sheared = Pose::Identity();
  sheared.linear()(0, 1) = 0.5;
  EXPECT_NE(convert(sheared, out.View()).find("rigid"), std::string::npos);
  grid.spacing[1] = -1.0;
  EXPECT_NE(convert(Pose::Identity(), out.View()).find("spacing"), std::string::npos);
}

TEST(ScanConversion, StopsOnRequest)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40, 1.0, 25, 0, 90);
  const Volume<float> beams({9, 9, 9});
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 1.0, 1u << 24);
  Volume<float> out(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions);
  const Progress stop([](double fraction) { return fraction < 0.2; });
  Refusal(Error::Kind::Cancelled,
          [&] { ScanConvert<float>(beams.View(), probe, Pose::Identity(), grid, out.View(), valid.View(), stop); });
}

} // namespace
