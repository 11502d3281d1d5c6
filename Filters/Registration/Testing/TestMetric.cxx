// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Registration/Metric.h"
#include "LocalAlignScene.h"
#include <limits>
#include <utility>

namespace echorama {
namespace {

using namespace testing_scene;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

LocalAlignParameters Finest()
{
  LocalAlignParameters p;
  p.finestMm = 0.01; // the level that Evaluate looks at
  p.points = 20000;
  return p;
}

class MetricTest : public testing::TestWithParam<std::string> {
protected:
  const Texture texture{3};
  const ImageGeometry geometry = Box({36, 34, 32}, {1.0, 1.0, 1.0}, {-18.0, -17.0, -16.0});
  const Seen seen{geometry, [this](const Eigen::Vector3d& p) { return static_cast<float>(texture(p)); }};
};

INSTANTIATE_TEST_SUITE_P(All, MetricTest, testing::ValuesIn(MetricNames()), TestName);

TEST_P(MetricTest, IdenticalVolumesAreWhollySimilar)
{
  const auto features = seen.As(GetParam());
  const LocalAlignResult result = Evaluate(*features, Pose::Identity(), *features, Pose::Identity(), Finest());
  EXPECT_NEAR(result.similarity, 1.0, 0.02);
  EXPECT_NEAR(result.overlap, 1.0, 0.02);
  EXPECT_NEAR(result.score, 1.0, 0.08);
  EXPECT_NEAR(result.voxelMm, 1.0, 1e-9);
}

TEST_P(MetricTest, StrangersAreSimilarByChanceAlone)
{
  const Texture other(99);
  const Seen stranger(geometry, [&](const Eigen::Vector3d& p) { return static_cast<float>(other(p)); });
  const LocalAlignResult result =
      Evaluate(*seen.As(GetParam()), Pose::Identity(), *stranger.As(GetParam()), Pose::Identity(), Finest());
  EXPECT_NEAR(result.similarity, 0.0, 0.15);
}

TEST_P(MetricTest, GainAndOffsetDoNotMatter)
{
  const Seen quiet(geometry, [this](const Eigen::Vector3d& p) { return 20.0f + 0.3f * static_cast<float>(texture(p)); });
  const LocalAlignResult result =
      Evaluate(*seen.As(GetParam()), Pose::Identity(), *quiet.As(GetParam()), Pose::Identity(), Finest());
  EXPECT_NEAR(result.similarity, 1.0, 0.02);
}

// The gradient of half the loss against central differences. The texture fades to nothing towards the border, so that what
// the weights do there has no say: the derivative leaves them alone.
TEST_P(MetricTest, GradientIsThatOfTheLoss)
{
  const auto faded = [this](const Eigen::Vector3d& p) {
    const double r2 = p.squaredNorm() / (9.0 * 9.0);
    return static_cast<float>(100.0 + (texture(p) - 100.0) * std::exp(-0.5 * r2 * r2));
  };
  const Pose pose = MotionAbout(Eigen::Vector3d::Zero(), {0.02, -0.03, 0.015}, {0.4, -0.3, 0.5});
  const Seen fixed(geometry, faded), moving(geometry, [&](const Eigen::Vector3d&p) { return faded(pose * p); });
  const auto a = fixed.As(GetParam()), b = moving.As(GetParam());
  ComparisonSetup setup;
  setup.metric = &MetricNamed(GetParam());
  setup.fixed = &a->levels.front();
  setup.moving = &b->levels.front();
  setup.points = 30000;
  const auto comparison = ComparePoints(setup);
  const Eigen::Vector3d centre(1.0, -2.0, 0.5);
  BlockGradients blocks;
  const MetricSums here = comparison->At(Pose::Identity(), centre, &blocks);
  ASSERT_GT(here.weight, 0.0);
  Vector6 numeric, whole = Vector6::Zero();
  for (int d = 0; d < 6; ++d) {
    const double h = d < 3 ? 0.02 : 0.002;
    const Vector6 step = h * Vector6::Unit(d);
    const auto loss = [&](const Vector6& twist) {
      const MetricSums sums = comparison->At(MotionAbout(centre, twist.tail<3>(), twist.head<3>()), centre);
      return 0.5 * sums.loss;
    };
    numeric[d] = (loss(step) - loss(-step)) / (2.0 * h);
  }
  for (const Vector6& block : blocks)
    whole += block;
  // Windows and patches are cut by weights that move a little: some percent are theirs.
  const double tolerance = 0.06;
  EXPECT_LT((here.gradient - numeric).head<3>().norm(), tolerance * numeric.head<3>().norm()) << here.gradient.transpose() << "\n"
                                                                                              << numeric.transpose();
  EXPECT_LT((here.gradient - numeric).tail<3>().norm(), tolerance * numeric.tail<3>().norm()) << here.gradient.transpose() << "\n"
                                                                                              << numeric.transpose();
  EXPECT_LT((whole - here.gradient).norm(), 1e-3 * here.gradient.norm()) << "the blocks do not add up";
}

TEST_P(MetricTest, VoxelsThatAreNotRealHaveNoSay)
{
  const auto hole = [this](float inside) {
    return Seen(geometry,
                [this, inside](const Eigen::Vector3d& p) { return p.x() > 5.0 ? inside : static_cast<float>(texture(p)); });
  };
  const Seen cut = hole(NaN);
  const LocalAlignResult result =
      Evaluate(*seen.As(GetParam()), Pose::Identity(), *cut.As(GetParam()), Pose::Identity(), Finest());
  EXPECT_TRUE(std::isfinite(result.similarity) && std::isfinite(result.score) && result.information.allFinite());
  EXPECT_GT(result.similarity, 0.85);
  EXPECT_NEAR(result.overlap, 1.0, 0.1) << "the smaller volume is the one with the hole";
}

TEST_P(MetricTest, WhatIsNotReliableHasNoSay)
{
  // Half of the moving volume shows something else; its reliability says so.
  const Texture other(5);
  const Seen false_(geometry, [&](const Eigen::Vector3d& p) { return static_cast<float>(p.x() > 0.0 ? other(p) : texture(p)); });
  const Seen trust(geometry, [](const Eigen::Vector3d& p) { return p.x() > -2.0 ? 0.0f : 1.0f; });
  const auto weighted = BuildMetricPyramid({&false_.pyramid, Pose::Identity(), "moving", &trust.pyramid}, GetParam());
  const auto fixed = seen.As(GetParam());
  const double without = Evaluate(*fixed, Pose::Identity(), *false_.As(GetParam()), Pose::Identity(), Finest()).similarity;
  const double with = Evaluate(*fixed, Pose::Identity(), *weighted, Pose::Identity(), Finest()).similarity;
  EXPECT_GT(with, 0.85);
  EXPECT_LT(without, with - 0.2);
}

// The weights of both halves add up to those of all points.
TEST_P(MetricTest, HalvesAreDisjoint)
{
  const auto features = seen.As(GetParam());
  ComparisonSetup setup;
  setup.metric = &MetricNamed(GetParam());
  setup.fixed = setup.moving = &features->levels.front();
  setup.points = 20000;
  std::array<double, 3> weights{};
  for (int part = 0; part < 3; ++part) {
    setup.part = part;
    const auto comparison = ComparePoints(setup);
    const MetricSums sums = comparison->At(Pose::Identity(), Eigen::Vector3d::Zero());
    weights[static_cast<std::size_t>(part)] = sums.weight;
  }
  EXPECT_GT(weights[1], 0.3 * weights[0]);
  EXPECT_GT(weights[2], 0.3 * weights[0]);
  EXPECT_NEAR(weights[1] + weights[2], weights[0], 1e-4 * weights[0]);
}

TEST(MetricNames, TheDefaultComesFirstAndOthersAreRefused)
{
  EXPECT_EQ(MetricNames(), (std::vector<std::string>{"local-ncc", "ncc", "mad", "mind-ssc", "lc2"}));
  const std::string message = MessageOf([] { MetricNamed("ssd"); }, Error::Kind::InvalidParameter);
  EXPECT_NE(message.find("\"ssd\""), std::string::npos) << message;
  EXPECT_NE(message.find("mind-ssc"), std::string::npos) << message;
}

TEST(MetricPyramid, BadVolumesAreNamed)
{
  const ImageGeometry geometry = Box({20, 20, 20}, {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0});
  const Seen constant(geometry, [](const Eigen::Vector3d&) { return 7.0f; });
  const Seen empty(geometry, [](const Eigen::Vector3d& p) { return p.norm() < 3.0 ? static_cast<float>(p.x()) : NaN; });
  const Seen flat(Box({40, 40, 1}, {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}),
                  [](const Eigen::Vector3d& p) { return static_cast<float>(p.x()); });
  const auto build = [](const Seen& seen) { return [&seen] { seen.As("local-ncc", "volume B"); }; };
  for (const auto& [seen, words] :
       {std::pair<const Seen*, const char*>{&constant, "constant"}, {&empty, "real"}, {&flat, "thick"}}) {
    const std::string message = MessageOf(build(*seen), Error::Kind::BadInput);
    EXPECT_NE(message.find("volume B"), std::string::npos) << message;
    EXPECT_NE(message.find(words), std::string::npos) << message;
  }
  const Seen other(Box({10, 20, 20}, {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}), [](const Eigen::Vector3d&) { return 1.0f; });
  const Seen good(geometry, [](const Eigen::Vector3d& p) { return static_cast<float>(p.x()); });
  MessageOf([&] { BuildMetricPyramid({&good.pyramid, Pose::Identity(), "A", &other.pyramid}, "ncc"); }, Error::Kind::BadInput);
}

// Against the sum over all voxels of the kernel's weights; rows are summed 64, 16 and single voxels at a time.
TEST(GaussianSum, IsTheSeparableSum)
{
  for (const int width : {7, 16, 70, 103}) {
    const std::array<int, 3> n{width, 5, 9};
    Volume<float> volume(n);
    const auto view = volume.View();
    Random random(1);
    for (float& v : view)
      v = static_cast<float>(random.Uniform());
    const Volume<float> before = volume;
    const Eigen::Vector3d sigma(1.3, 0.1, 2.0);
    GaussianSum(view, sigma);
    const auto weight = [](int d, double s) {
      const int reach = static_cast<int>(std::lround(2.5 * s));
      double sum = 0.0;
      for (int i = -reach; i <= reach; ++i)
        sum += std::exp(-0.5 * i * i / (s * s));
      return std::abs(d) <= reach ? std::exp(-0.5 * d * d / (s * s)) / sum : 0.0;
    };
    for (const auto& [j, k] : {std::array<int, 2>{0, 0}, {2, 4}, {3, 1}, {4, 8}})
      for (int i = 0; i < width; ++i) {
        double sum = 0.0;
        for (int c = 0; c < n[2]; ++c)
          for (int a = 0; a < width; ++a)
            sum += weight(a - i, sigma.x()) * weight(c - k, sigma.z()) * static_cast<double>(before.View()(a, j, c));
        EXPECT_NEAR(view(i, j, k), sum, 1e-5) << "voxel " << i << " of " << width;
      }
  }
}

// Chunks meet, the last one is shorter, and rows are real from somewhere to somewhere, or nowhere.
TEST(SmoothSlices, IsTheGaussianSumWhereVoxelsAreReal)
{
  const std::array<int, 3> n{33, 11, 37};
  Volume<float> real(n, 1.0f);
  std::array<Volume<float>, 2> volumes{Volume<float>(n), Volume<float>(n)};
  Random random(2);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double x = i - 14.0 - 0.4 * k, y = j - 4.0;
        if (x * x + 4.0 * y * y > 100.0 || (k > 18 && k < 21))
          real.View()(i, j, k) = NaN;
        else
          for (Volume<float>& volume : volumes)
            volume.View()(i, j, k) = static_cast<float>(random.Uniform());
      }
  const RowSpans spans(std::as_const(real).View());
  for (const Eigen::Vector3d& sigma :
       {Eigen::Vector3d(0.7, 0.8, 0.9), Eigen::Vector3d(1.0, 0.1, 2.0), Eigen::Vector3d(0.1, 0.5, 0.1)}) {
    std::array<Volume<float>, 2> expected = volumes;
    for (Volume<float>& volume : expected)
      GaussianSum(volume.View(), sigma);
    std::array<Volume<float>, 2> found{Volume<float>(n, NaN), Volume<float>(n, NaN)};
    SmoothSlices(
        n, 2, sigma, spans,
        [&](int k, VolumeView<float> slices) {
          for (int volume = 0; volume < 2; ++volume)
            std::copy_n(volumes[static_cast<std::size_t>(volume)].View().Row(0, k), slices.SliceStride(), slices.Row(0, volume));
        },
        [&](int k, VolumeView<const float> smoothed) {
          for (int volume = 0; volume < 2; ++volume)
            std::copy_n(smoothed.Row(0, volume), smoothed.SliceStride(),
                        found[static_cast<std::size_t>(volume)].View().Row(0, k));
        });
    int wrong = 0;
    for (std::size_t volume = 0; volume < 2; ++volume)
      for (std::ptrdiff_t i = 0; i < real.View().Size(); ++i)
        if (real.View()[i] == 1.0f)
          wrong += !(std::abs(found[volume].View()[i] - expected[volume].View()[i]) <= 1e-5f);
    EXPECT_EQ(wrong, 0) << sigma.transpose();
  }
}

// The windows are read between cells of two voxels: still the mean and the deviation around each voxel.
TEST(LocalNcc, SeesWhatIsAroundEachVoxel)
{
  const std::array<int, 3> n{31, 28, 26};
  const ImageGeometry geometry = Box(n, {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0});
  const Texture texture{3};
  const Seen seen(geometry,
                  [&](const Eigen::Vector3d& p) { return static_cast<float>(texture(p)) + 2.0f * static_cast<float>(p.x()); });
  const auto features = seen.As("local-ncc");
  const MetricLevel& level = features->levels.front();
  const VolumeView<const float> in = seen.pyramid.front().intensity.View();
  double mean = 0.0, square = 0.0;
  for (const float v : in) {
    mean += static_cast<double>(v) / static_cast<double>(in.Size());
    square += static_cast<double>(v * v) / static_cast<double>(in.Size());
  }
  const double floor = 0.36 * (square - mean * mean);
  double error = 0.0, spread = 0.0;
  for (const auto& [i, j, k] : {std::array<int, 3>{15, 14, 13}, {12, 15, 11}, {17, 12, 14}, {14, 13, 12}, {16, 16, 15}}) {
    const auto around = [&, i = i, j = j, k = k](double sigma, double power) {
      const int reach = static_cast<int>(std::lround(2.5 * sigma));
      double sum = 0.0, weights = 0.0;
      for (int c = -reach; c <= reach; ++c)
        for (int b = -reach; b <= reach; ++b)
          for (int a = -reach; a <= reach; ++a) {
            const double w = std::exp(-0.5 * (a * a + b * b + c * c) / (sigma * sigma));
            sum += w * std::pow(static_cast<double>(in(i + a, j + b, k + c)) - mean, power);
            weights += w;
          }
      return sum / weights;
    };
    const double m = around(2.0, 1.0), expected = (around(0.6, 1.0) - m) / std::sqrt(around(2.0, 2.0) - m * m + floor);
    const double found = static_cast<double>(level.seen[static_cast<std::size_t>(&in(i, j, k) - in.Data())].Value());
    error += (found - expected) * (found - expected);
    spread += expected * expected;
  }
  EXPECT_LT(std::sqrt(error), 0.05 * std::sqrt(spread));
}

} // namespace
} // namespace echorama
