// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

using namespace echorama;

namespace {

template <class T>
struct Result {
  explicit Result(const ImageGeometry& grid) : intensity(grid.dimensions), valid(grid.dimensions), coverage(grid.dimensions) {}
  ReconstructionOutput<T> Output() { return {intensity.View(), valid.View(), coverage.View()}; }
  bool operator==(const Result& other) const
  {
    const auto same = [](const auto& a, const auto& b) { return std::equal(a.View().begin(), a.View().end(), b.View().begin()); };
    return same(intensity, other.intensity) && same(valid, other.valid) && same(coverage, other.coverage);
  }
  Volume<T> intensity;
  Volume<unsigned char> valid;
  Volume<unsigned short> coverage;
};

template <class T>
struct Image {
  Volume<T> pixels;
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  TrackedFrame<T> Frame() const { return {pixels.View(), {}, pose}; }
};

ImageGeometry Grid(int nx, int ny, int nz, double spacing = 1.0)
{
  ImageGeometry grid;
  grid.dimensions = {nx, ny, nz};
  grid.spacing.setConstant(spacing);
  return grid;
}

template <class T>
Image<T> Noise(int nx, int ny, std::uint64_t seed, double most = 255.0)
{
  Image<T> image{Volume<T>({nx, ny, 1})};
  Random random(seed);
  for (T& pixel : image.pixels.View())
    pixel = static_cast<T>(random.Uniform(0.0, most));
  return image;
}

// Frames in oblique poses that wander through a grid.
template <class T>
std::vector<Image<T>> Sweep(int frames, double pixel = 0.6)
{
  std::vector<Image<T>> sweep;
  for (int k = 0; k < frames; ++k) {
    Image<T> image = Noise<T>(50, 40, 7u + static_cast<unsigned>(k));
    image.pose.linear() = ExpRotation({0.3 + 0.02 * k, -0.4, 0.2 + 0.01 * k}) * pixel;
    image.pose.translation() = Eigen::Vector3d(2.0 + 0.1 * k, 6.0 - 0.2 * k, 1.0 + 0.9 * k);
    sweep.push_back(image);
  }
  return sweep;
}

template <class T>
Result<T> Reconstruct(const ReconstructionParameters& parameters, const ImageGeometry& grid, const std::vector<Image<T>>& sweep)
{
  Result<T> result(grid);
  VolumeReconstruction<T> reconstruction(parameters, grid, result.Output());
  for (const Image<T>& image : sweep)
    EXPECT_EQ(reconstruction.Add(image.Frame()), FrameUse::Used);
  return result;
}

ReconstructionParameters Plain(SplatMethod splat = SplatMethod::Nearest, Compounding compounding = Compounding::Mean)
{
  ReconstructionParameters parameters;
  parameters.splat = splat;
  parameters.compounding = compounding;
  parameters.between = BetweenFrames::Nothing;
  return parameters;
}

// The straightforward way: every pixel of every frame, in doubles.
struct Reference {
  Volume<double> sum, weight, most;
};

template <class T>
Reference BruteForce(const ImageGeometry& grid, const std::vector<Image<T>>& sweep, bool linear)
{
  Reference reference{Volume<double>(grid.dimensions), Volume<double>(grid.dimensions), Volume<double>(grid.dimensions)};
  for (const Image<T>& image : sweep)
    for (int y = 0; y < image.pixels.Dimensions()[1]; ++y)
      for (int x = 0; x < image.pixels.Dimensions()[0]; ++x) {
        const Eigen::Vector3d at = grid.WorldToIndex() * (image.pose * Eigen::Vector3d(x, y, 0.0));
        for (int corner = 0; corner < (linear ? 8 : 1); ++corner) {
          int index[3];
          double weight = 1.0;
          bool inside = true;
          for (int a = 0; a < 3; ++a) {
            const double below = std::floor(linear ? at[a] : at[a] + 0.5);
            const int up = corner >> a & 1;
            index[a] = static_cast<int>(below) + up;
            weight *= linear ? (up ? at[a] - below : 1.0 - at[a] + below) : 1.0;
            inside = inside && index[a] >= 0 && index[a] < grid.dimensions[static_cast<std::size_t>(a)];
          }
          if (!inside || weight <= 0.0)
            continue;
          const double value = image.pixels.View()(x, y, 0);
          reference.sum.View()(index[0], index[1], index[2]) += weight * value;
          reference.weight.View()(index[0], index[1], index[2]) += weight;
          double& most = reference.most.View()(index[0], index[1], index[2]);
          most = weight >= 0.125 ? std::max(most, value) : most;
        }
      }
  return reference;
}

// Voxels of three lengths, turned.
ImageGeometry ObliqueGrid()
{
  ImageGeometry grid = Grid(31, 33, 29);
  grid.spacing = {0.8, 1.1, 1.3};
  grid.direction = ExpRotation({0.2, -0.3, 0.4});
  grid.origin = {1.0, -2.0, 0.5};
  return grid;
}

} // namespace

TEST(VolumeReconstruction, NearestMeanIsThatOfBruteForce)
{
  for (const ImageGeometry& grid : {Grid(31, 33, 29), ObliqueGrid()}) {
    const auto sweep = Sweep<unsigned char>(20);
    const auto result = Reconstruct(Plain(), grid, sweep);
    const Reference reference = BruteForce(grid, sweep, false);
    std::ptrdiff_t seen = 0;
    for (std::ptrdiff_t at = 0; at < reference.sum.View().Size(); ++at) {
      const double weight = reference.weight.View()[at];
      ASSERT_EQ(result.coverage.View()[at], weight);
      ASSERT_EQ(result.valid.View()[at], weight > 0.0);
      ASSERT_EQ(result.intensity.View()[at], weight > 0.0 ? std::floor(reference.sum.View()[at] / weight + 0.5) : 0.0);
      seen += weight > 0.0;
    }
    EXPECT_GT(seen, 1000);
  }
}

TEST(VolumeReconstruction, LinearMeanIsThatOfBruteForce)
{
  for (const ImageGeometry& grid : {Grid(31, 33, 29), ObliqueGrid()}) {
    const auto sweep = Sweep<float>(20);
    const auto result = Reconstruct(Plain(SplatMethod::Linear), grid, sweep);
    const Reference reference = BruteForce(grid, sweep, true);
    for (std::ptrdiff_t at = 0; at < reference.sum.View().Size(); ++at) {
      const double weight = reference.weight.View()[at];
      if (weight < 1e-4) // a weight that rounding could make or take
        continue;
      ASSERT_EQ(result.valid.View()[at], 1);
      ASSERT_NEAR(result.intensity.View()[at], reference.sum.View()[at] / weight, 0.05);
      ASSERT_NEAR(result.coverage.View()[at], std::max(1.0, weight), 0.51);
    }
  }
}

TEST(VolumeReconstruction, MaximumIsThatOfBruteForce)
{
  const ImageGeometry grid = Grid(31, 33, 29);
  const auto sweep = Sweep<unsigned short>(12);
  for (const bool linear : {false, true}) {
    const auto result =
        Reconstruct(Plain(linear ? SplatMethod::Linear : SplatMethod::Nearest, Compounding::Maximum), grid, sweep);
    const Reference reference = BruteForce(grid, sweep, linear);
    for (std::ptrdiff_t at = 0; at < reference.most.View().Size(); ++at)
      ASSERT_EQ(result.intensity.View()[at], reference.most.View()[at]);
  }
}

TEST(VolumeReconstruction, MaximumOfNegativeValues)
{
  Image<short> image{Volume<short>({4, 4, 1}, -7)};
  const auto result = Reconstruct<short>(Plain(SplatMethod::Nearest, Compounding::Maximum), Grid(4, 4, 1), {image});
  for (const short value : result.intensity.View())
    EXPECT_EQ(value, -7);
}

TEST(VolumeReconstruction, LatestIsTheMeanOfTheLastFrameThere)
{
  const ImageGeometry grid = Grid(31, 33, 29);
  const auto sweep = Sweep<unsigned char>(12);
  const auto result = Reconstruct(Plain(SplatMethod::Nearest, Compounding::Latest), grid, sweep);
  Volume<unsigned char> expected(grid.dimensions);
  for (const auto& image : sweep) {
    const Reference one = BruteForce<unsigned char>(grid, {image}, false);
    for (std::ptrdiff_t at = 0; at < one.sum.View().Size(); ++at)
      if (one.weight.View()[at] > 0.0)
        expected.View()[at] = static_cast<unsigned char>(std::floor(one.sum.View()[at] / one.weight.View()[at] + 0.5));
  }
  EXPECT_TRUE(std::equal(expected.View().begin(), expected.View().end(), result.intensity.View().begin()));
}

TEST(VolumeReconstruction, AlphaLaysFramesOverEachOther)
{
  const ImageGeometry grid = Grid(6, 5, 1);
  std::vector<Image<float>> frames(3, Image<float>{Volume<float>({6, 5, 1})});
  const float values[] = {100.0f, 20.0f, 60.0f};
  for (int k = 0; k < 3; ++k)
    std::fill(frames[static_cast<std::size_t>(k)].pixels.View().begin(), frames[static_cast<std::size_t>(k)].pixels.View().end(),
              values[k]);
  auto parameters = Plain(SplatMethod::Nearest, Compounding::Alpha);
  parameters.alpha = 0.25;
  const auto result = Reconstruct(parameters, grid, frames);
  const double expected = 0.75 * (0.75 * 100.0 + 0.25 * 20.0) + 0.25 * 60.0;
  for (const float value : result.intensity.View())
    EXPECT_NEAR(value, expected, 1e-4);
  for (const unsigned short count : result.coverage.View())
    EXPECT_EQ(count, 3);
}

TEST(VolumeReconstruction, RunningMeanRoundsAfterEachPixel)
{
  // 10 then 255 with weight 1 each: 132.5 rounds to 133; then 0: 88.67 to 89.
  const ImageGeometry grid = Grid(2, 2, 2);
  std::vector<Image<unsigned char>> frames(3, Image<unsigned char>{Volume<unsigned char>({1, 1, 1})});
  frames[0].pixels.View()[0] = 10;
  frames[1].pixels.View()[0] = 255;
  const auto result = Reconstruct(Plain(SplatMethod::Linear, Compounding::RunningMean), grid, frames);
  EXPECT_EQ(result.intensity.View()(0, 0, 0), 89);
  // A weight below 1/512 is not kept: the voxel counts as not seen.
  frames.resize(1);
  frames[0].pose.translation() = Eigen::Vector3d(0.001, 0.0, 0.0);
  const auto faint = Reconstruct(Plain(SplatMethod::Linear, Compounding::RunningMean), grid, frames);
  EXPECT_EQ(faint.valid.View()(0, 0, 0), 1);
  EXPECT_EQ(faint.valid.View()(1, 0, 0), 0);
  EXPECT_EQ(Reconstruct(Plain(SplatMethod::Linear), grid, frames).valid.View()(1, 0, 0), 1);
}

TEST(VolumeReconstruction, ResultsDoNotDependOnThreads)
{
  const ImageGeometry grid = Grid(47, 45, 43, 0.8);
  const auto sweep = Sweep<float>(16);
  for (const SplatMethod splat : {SplatMethod::Nearest, SplatMethod::Linear})
    for (const Compounding compounding :
         {Compounding::Mean, Compounding::Maximum, Compounding::Latest, Compounding::Alpha, Compounding::RunningMean})
      for (const BetweenFrames between : {BetweenFrames::Nothing, BetweenFrames::Forward, BetweenFrames::Backward}) {
        auto parameters = Plain(splat, compounding);
        parameters.between = between;
        const auto many = Reconstruct(parameters, grid, sweep);
        const ThreadLimit limit(1);
        EXPECT_TRUE(Reconstruct(parameters, grid, sweep) == many);
      }
}

TEST(VolumeReconstruction, FramesInBetweenAreInterpolated)
{
  // Two parallel planes 4 mm apart, values 0 and 80: with steps of 1 mm each slice in between has its share.
  const ImageGeometry grid = Grid(10, 8, 5);
  std::vector<Image<unsigned char>> frames{{Volume<unsigned char>({10, 8, 1}, 0)}, {Volume<unsigned char>({10, 8, 1}, 80)}};
  frames[1].pose.translation() = Eigen::Vector3d(0.0, 0.0, 4.0);
  ReconstructionParameters parameters;
  parameters.stepMm = 1.0;
  Result<unsigned char> result(grid);
  VolumeReconstruction<unsigned char> reconstruction(parameters, grid, result.Output());
  for (const auto& frame : frames)
    reconstruction.Add(frame.Frame());
  EXPECT_EQ(reconstruction.FramesUsed(), 2);
  EXPECT_EQ(reconstruction.FramesBetween(), 3);
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 10; ++i) {
        ASSERT_EQ(result.intensity.View()(i, j, k), 20 * k);
        ASSERT_EQ(result.coverage.View()(i, j, k), 1);
      }
  // Backward gives the same here, but for the last plane, which belongs to the next pair.
  parameters.between = BetweenFrames::Backward;
  const auto backward = Reconstruct(parameters, grid, frames);
  for (int k = 0; k < 4; ++k)
    ASSERT_EQ(backward.intensity.View()(3, 3, k), 20 * k);
}

TEST(VolumeReconstruction, FramesFarApartAreNotJoined)
{
  const ImageGeometry grid = Grid(10, 8, 5);
  std::vector<Image<unsigned char>> frames{{Volume<unsigned char>({10, 8, 1}, 50)}, {Volume<unsigned char>({10, 8, 1}, 80)}};
  frames[1].pose.translation() = Eigen::Vector3d(0.0, 0.0, 4.0);
  ReconstructionParameters parameters;
  parameters.maximumGapMm = 3.9;
  for (const BetweenFrames between : {BetweenFrames::Forward, BetweenFrames::Backward}) {
    parameters.between = between;
    const auto result = Reconstruct(parameters, grid, frames);
    EXPECT_EQ(result.valid.View()(3, 3, 2), 0);
    EXPECT_EQ(result.intensity.View()(3, 3, 4), 80);
  }
  // Nor where that would take more than 1000 frames; and no gap is too wide for those who want it so.
  parameters.between = BetweenFrames::Forward;
  parameters.maximumGapMm = std::numeric_limits<double>::max();
  EXPECT_EQ(Reconstruct(parameters, grid, frames).valid.View()(3, 3, 2), 1);
  parameters.stepMm = 1e-12;
  EXPECT_EQ(Reconstruct(parameters, grid, frames).valid.View()(3, 3, 2), 0);
  parameters.stepMm = 0.0;
  parameters.maximumGapMm = 10.0;
  Result<unsigned char> result(grid);
  VolumeReconstruction<unsigned char> reconstruction(parameters, grid, result.Output());
  reconstruction.Add(frames[0].Frame());
  reconstruction.Break();
  reconstruction.Add(frames[1].Frame());
  EXPECT_EQ(result.valid.View()(3, 3, 2), 0);
}

// No gap is too wide: a first frame, and one of another size, have no neighbour all the same.
TEST(VolumeReconstruction, FramesWithoutANeighbourAreNotJoined)
{
  const ImageGeometry grid = Grid(10, 8, 5);
  const Image<unsigned char> large{Volume<unsigned char>({10, 8, 1}, 50)};
  Image<unsigned char> small{Volume<unsigned char>({6, 5, 1}, 80)}, far = large;
  small.pose.translation() = Eigen::Vector3d(0.0, 0.0, 4.0);
  far.pose.translation() = Eigen::Vector3d(0.0, 0.0, 1e200); // the square of the distance is not finite
  ReconstructionParameters parameters;
  parameters.maximumGapMm = std::numeric_limits<double>::max();
  for (const BetweenFrames between : {BetweenFrames::Forward, BetweenFrames::Backward})
    for (const double stepMm : {0.0, 1e-300, 1e308}) {
      parameters.between = between;
      parameters.stepMm = stepMm;
      Result<unsigned char> result(grid);
      VolumeReconstruction<unsigned char> reconstruction(parameters, grid, result.Output());
      EXPECT_EQ(reconstruction.Add(large.Frame()), FrameUse::Used);
      EXPECT_EQ(reconstruction.Add(small.Frame()), FrameUse::Used);
      EXPECT_EQ(reconstruction.Add(far.Frame()), FrameUse::Outside);
      EXPECT_EQ(reconstruction.FramesBetween(), 0);
      EXPECT_EQ(result.intensity.View()(9, 7, 0), 50);
      EXPECT_EQ(result.valid.View()(3, 3, 2), 0);
      EXPECT_EQ(result.intensity.View()(3, 3, 4), 80);
      EXPECT_EQ(result.valid.View()(9, 7, 4), 0);
    }
}

// A smooth field, sampled by a fan of frames that turns about a line, comes back within a bound.
TEST(VolumeReconstruction, AFieldComesBackFromARotatedFan)
{
  const auto field = [](const Eigen::Vector3d& p) {
    return 128.0 + 60.0 * std::sin(0.15 * p[0]) * std::cos(0.12 * p[1]) + 1.5 * p[2];
  };
  std::vector<Image<float>> sweep;
  for (int k = 0; k <= 20; ++k) {
    Image<float> image{Volume<float>({60, 50, 1})};
    image.pose.linear() = ExpRotation({0.0, -0.6 + 0.06 * k, 0.0}) * 0.5; // about y
    image.pose.translation() = Eigen::Vector3d(0.0, 3.0, 20.0);
    for (int y = 0; y < 50; ++y)
      for (int x = 0; x < 60; ++x)
        image.pixels.View()(x, y, 0) = static_cast<float>(field(image.pose * Eigen::Vector3d(x, y, 0.0)));
    sweep.push_back(image);
  }
  const ImageGeometry grid = Grid(32, 32, 40);
  struct Case {
    SplatMethod splat;
    BetweenFrames between;
    double mean, largest;
  };
  for (const Case& c : {Case{SplatMethod::Nearest, BetweenFrames::Nothing, 2.0, 13.0},
                        Case{SplatMethod::Linear, BetweenFrames::Nothing, 2.0, 13.0},
                        Case{SplatMethod::Nearest, BetweenFrames::Forward, 1.5, 10.0},
                        Case{SplatMethod::Linear, BetweenFrames::Forward, 1.0, 10.0},
                        Case{SplatMethod::Linear, BetweenFrames::Backward, 0.1, 2.5}}) {
    auto parameters = Plain(c.splat);
    parameters.between = c.between;
    const auto result = Reconstruct(parameters, grid, sweep);
    const Eigen::Vector3d normal = sweep[0].pose.linear().col(2).normalized();
    double sum = 0.0, largest = 0.0;
    int count = 0;
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 32; ++j)
        for (int i = 0; i < 32; ++i)
          // Backward, the first frame alone is splatted: near its plane values are off by up to a voxel.
          if (result.valid.View()(i, j, k) &&
              (c.between != BetweenFrames::Backward ||
               std::abs(normal.dot(Eigen::Vector3d(i, j, k) - sweep[0].pose.translation())) > 1.75)) {
            const double error = std::abs(result.intensity.View()(i, j, k) - field({1.0 * i, 1.0 * j, 1.0 * k}));
            sum += error;
            largest = std::max(largest, error);
            ++count;
          }
    EXPECT_GT(count, 8000);
    EXPECT_LT(sum / count, c.mean) << static_cast<int>(c.splat) << static_cast<int>(c.between);
    EXPECT_LT(largest, c.largest) << static_cast<int>(c.splat) << static_cast<int>(c.between);
  }
}

TEST(VolumeReconstruction, ASingleFrameAndFramesInOnePlace)
{
  const ImageGeometry grid = Grid(12, 10, 3);
  Image<unsigned char> image = Noise<unsigned char>(12, 10, 3);
  image.pose.translation() = Eigen::Vector3d(0.0, 0.0, 1.0);
  for (const BetweenFrames between : {BetweenFrames::Nothing, BetweenFrames::Forward, BetweenFrames::Backward}) {
    auto parameters = Plain();
    parameters.between = between;
    for (const int times : {1, 4}) {
      const auto result =
          Reconstruct(parameters, grid, std::vector<Image<unsigned char>>(static_cast<std::size_t>(times), image));
      for (int j = 0; j < 10; ++j)
        for (int i = 0; i < 12; ++i) {
          ASSERT_EQ(result.intensity.View()(i, j, 1), image.pixels.View()(i, j, 0));
          ASSERT_EQ(result.valid.View()(i, j, 0) + result.valid.View()(i, j, 2), 0);
        }
    }
  }
}

TEST(VolumeReconstruction, MasksAndNaNKeepPixelsOut)
{
  const ImageGeometry grid = Grid(12, 10, 5);
  std::vector<Image<float>> frames{Noise<float>(12, 10, 1), Noise<float>(12, 10, 2)};
  frames[1].pose.translation() = Eigen::Vector3d(0.0, 0.0, 4.0);
  frames[0].pixels.View()(4, 4, 0) = std::numeric_limits<float>::quiet_NaN();
  Volume<unsigned char> mask({12, 10, 1}, 1);
  mask.View()(7, 2, 0) = 0;
  for (const SplatMethod splat : {SplatMethod::Nearest, SplatMethod::Linear})
    for (const BetweenFrames between : {BetweenFrames::Forward, BetweenFrames::Backward}) {
      auto parameters = Plain(splat);
      parameters.between = between;
      Result<float> result(grid);
      VolumeReconstruction<float> reconstruction(parameters, grid, result.Output());
      for (auto& image : frames) {
        TrackedFrame<float> frame = image.Frame();
        frame.mask = mask.View();
        EXPECT_EQ(reconstruction.Add(frame), FrameUse::Used);
      }
      for (int k = 0; k < 4; ++k) {
        EXPECT_EQ(result.valid.View()(7, 2, k), 0);
        EXPECT_EQ(result.valid.View()(4, 4, k), 0);
        EXPECT_EQ(result.valid.View()(5, 4, k), 1);
      }
      for (const float value : result.intensity.View())
        ASSERT_TRUE(std::isfinite(value));
    }
}

TEST(VolumeReconstruction, CoverageSaturatesAndTheMeanMovesOn)
{
  const ImageGeometry grid = Grid(1, 1, 1);
  Image<unsigned char> image{Volume<unsigned char>({200, 200, 1}, 100)};
  image.pose.linear() *= 1e-4; // 40000 pixels in the one voxel
  Result<unsigned char> result(grid);
  VolumeReconstruction<unsigned char> reconstruction(Plain(), grid, result.Output());
  for (int k = 0; k < 2; ++k)
    reconstruction.Add(image.Frame());
  EXPECT_EQ(result.coverage.View()[0], 65535);
  EXPECT_EQ(result.intensity.View()[0], 100);
  std::fill(image.pixels.View().begin(), image.pixels.View().end(), static_cast<unsigned char>(200));
  for (int k = 0; k < 20; ++k)
    reconstruction.Add(image.Frame());
  EXPECT_EQ(result.coverage.View()[0], 65535);
  EXPECT_EQ(result.intensity.View()[0], 200);
}

TEST(VolumeReconstruction, FramesThatCannotBeUsedLeaveTheVolumeAlone)
{
  const ImageGeometry grid = Grid(12, 10, 3);
  const Image<unsigned char> good = Noise<unsigned char>(12, 10, 3);
  Result<unsigned char> result(grid);
  VolumeReconstruction<unsigned char> reconstruction(Plain(), grid, result.Output());
  EXPECT_EQ(reconstruction.Add(good.Frame()), FrameUse::Used);
  const Result<unsigned char> before = result;

  Image<unsigned char> bad = good;
  bad.pose.linear().col(1) = 2.0 * bad.pose.linear().col(0);
  EXPECT_EQ(reconstruction.Add(bad.Frame()), FrameUse::PoseSingular);
  bad.pose.linear().setZero();
  EXPECT_EQ(reconstruction.Add(bad.Frame()), FrameUse::PoseSingular);
  bad = good;
  bad.pose.translation()[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reconstruction.Add(bad.Frame()), FrameUse::PoseNotFinite);
  for (const double distance : {-1e300, -1e9, -14.0, 13.0, 1e12}) {
    bad = good;
    bad.pose.translation()[0] = distance;
    EXPECT_EQ(reconstruction.Add(bad.Frame()), FrameUse::Outside) << distance;
  }
  const Volume<unsigned char> nothing({12, 10, 1});
  TrackedFrame<unsigned char> masked = good.Frame();
  masked.mask = nothing.View();
  EXPECT_EQ(reconstruction.Add(masked), FrameUse::NoPixels);
  EXPECT_TRUE(before == result);
  EXPECT_EQ(reconstruction.FramesUsed(), 1);

  const Volume<unsigned char> small({3, 3, 1}, 1), thick({12, 10, 2}, 1);
  masked.mask = small.View();
  EXPECT_THROW(reconstruction.Add(masked), Error);
  EXPECT_THROW(reconstruction.Add({thick.View(), {}, good.pose}), Error);
  EXPECT_THROW(reconstruction.Add({}), Error);
  EXPECT_TRUE(before == result);
}

TEST(VolumeReconstruction, BackwardFramesBesideTheGridAreNotUsed)
{
  const ImageGeometry grid = Grid(12, 10, 3);
  Result<unsigned char> result(grid);
  ReconstructionParameters parameters = Plain();
  parameters.between = BetweenFrames::Backward;
  parameters.maximumGapMm = 10.0;
  VolumeReconstruction<unsigned char> reconstruction(parameters, grid, result.Output());
  Image<unsigned char> frame = Noise<unsigned char>(12, 10, 3);
  frame.pose.translation()[0] += 1000.0;
  for (int k = 0; k < 3; ++k, frame.pose.translation()[2] += 1.0)
    EXPECT_EQ(reconstruction.Add(frame.Frame()), FrameUse::Outside) << k;
  EXPECT_EQ(reconstruction.FramesUsed(), 0);
  // In the grid, two in one place have nothing between them and are none the worse.
  frame = Noise<unsigned char>(12, 10, 3);
  for (int k = 0; k < 2; ++k)
    EXPECT_EQ(reconstruction.Add(frame.Frame()), FrameUse::Used) << k;
}

TEST(VolumeReconstruction, AGridSmallerThanTheFramesTakesWhatIsInIt)
{
  const auto sweep = Sweep<unsigned char>(20);
  const ImageGeometry whole = Grid(31, 33, 29);
  ImageGeometry part = Grid(7, 1, 5);
  part.origin = {8.0, 11.0, 9.0};
  for (const SplatMethod splat : {SplatMethod::Nearest, SplatMethod::Linear}) {
    const auto all = Reconstruct(Plain(splat), whole, sweep);
    Result<unsigned char> some(part);
    VolumeReconstruction<unsigned char> reconstruction(Plain(splat), part, some.Output());
    for (const auto& image : sweep)
      reconstruction.Add(image.Frame());
    for (int k = 0; k < 5; ++k)
      for (int i = 0; i < 7; ++i)
        EXPECT_NEAR(some.intensity.View()(i, 0, k), all.intensity.View()(8 + i, 11, 9 + k), splat == SplatMethod::Linear ? 1 : 0);
  }
}

TEST(VolumeReconstruction, RefusesBadParameters)
{
  const ImageGeometry grid = Grid(4, 4, 4);
  Result<unsigned char> result(grid);
  const auto refused = [&](auto change) {
    ReconstructionParameters parameters;
    change(parameters);
    EXPECT_THROW(VolumeReconstruction<unsigned char>(parameters, grid, result.Output()), Error);
  };
  refused([](auto& p) { p.alpha = 0.0; });
  refused([](auto& p) { p.alpha = 1.5; });
  refused([](auto& p) { p.stepMm = -1.0; });
  refused([](auto& p) { p.stepMm = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& p) { p.maximumGapMm = 0.0; });
  EXPECT_THROW(VolumeReconstruction<unsigned char>({}, Grid(4, 4, 5), result.Output()), Error);
  ImageGeometry sheared = grid;
  sheared.direction(0, 1) = 0.5;
  EXPECT_THROW(VolumeReconstruction<unsigned char>({}, sheared, result.Output()), Error);
}
