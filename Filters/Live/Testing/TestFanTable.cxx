// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Live/BeamVolumes.h"
#include "Filters/Live/FanTable.h"
#include "Filters/Live/LiveProbe.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

namespace {

using namespace echorama;

struct Pixels {
  explicit Pixels(const FanTable& table)
    : intensity(table.Grid().dimensions, 77), valid(table.Grid().dimensions, 77), label(table.Grid().dimensions, 77)
  {
  }
  Volume<unsigned char> intensity, valid, label;
};

Pixels Convert(const FanTable& table, const Volume<float>& value, const Volume<unsigned char>& content)
{
  Pixels pixels(table);
  table.Convert(value.View(), content.View(), pixels.intensity.View(), pixels.valid.View(), pixels.label.View());
  return pixels;
}

FanImage ImageOf(LiveProbe kind, bool flipped = false)
{
  LiveProbeSettings settings;
  settings.kind = kind;
  FanImage image;
  image.beams = 96;
  image.samples = 200;
  image.probe = GeometryOf(settings, image.beams);
  image.width = 321;
  image.height = 240;
  image.flipped = flipped;
  return image;
}

const std::vector<LiveProbe> probes{LiveProbe::Convex, LiveProbe::Linear, LiveProbe::Phased, LiveProbe::Endocavity,
                                    LiveProbe::Radial};

Volume<float> Beams(const FanImage& image, const std::function<double(int sample, int beam)>& valueOf)
{
  Volume<float> value({image.samples, image.beams, 1});
  for (int beam = 0; beam < image.beams; ++beam)
    for (int sample = 0; sample < image.samples; ++sample)
      value.View()(sample, beam, 0) = static_cast<float>(valueOf(sample, beam));
  return value;
}

Volume<unsigned char> AllData(const FanImage& image)
{
  return Volume<unsigned char>({image.samples, image.beams, 1}, ContentData);
}

Eigen::Vector3d PointInProbe(const FanTable& table, int i, int j)
{
  return table.Grid().IndexToWorld() * Eigen::Vector3d(i, j, 0);
}

TEST(FanTable, IsScanConversionOnItsOwnGrid)
{
  for (const LiveProbe kind : probes) {
    const FanImage image = ImageOf(kind);
    const FanTable table(image);
    Random random(4);
    const Volume<float> value = Beams(image, [&random](int, int) { return random.Uniform(0.0, 255.0); });
    const Pixels pixels = Convert(table, value, AllData(image));
    Volume<float> expected(table.Grid().dimensions);
    Volume<unsigned char> inside(table.Grid().dimensions);
    ScanConvert<float>(value.View(), image.probe, Pose::Identity(), table.Grid(), expected.View(), inside.View());
    int compared = 0, onlyOne = 0;
    for (std::ptrdiff_t i = 0; i < expected.View().Size(); ++i) {
      onlyOne += pixels.valid.View()[i] != inside.View()[i];
      if (pixels.valid.View()[i] && inside.View()[i]) {
        ASSERT_NEAR(pixels.intensity.View()[i], expected.View()[i], 0.6);
        ++compared;
      } else if (!pixels.valid.View()[i]) {
        ASSERT_EQ(pixels.intensity.View()[i], 0);
        ASSERT_EQ(pixels.label.View()[i], 0);
      }
    }
    EXPECT_GT(compared, 15000);
    // The radial image also has pixels between its last beam and its first.
    const bool radial = kind == LiveProbe::Radial;
    EXPECT_LE(onlyOne, radial ? compared / 60 : 4);
    EXPECT_EQ(onlyOne > 100, radial);
  }
}

TEST(FanTable, TheFanIsCentredAndAsLargeAsTheImageAllows)
{
  for (const LiveProbe kind : probes) {
    const FanImage image = ImageOf(kind);
    const FanTable table(image);
    table.Grid().Check("the grid");
    EXPECT_EQ(table.Grid().spacing.minCoeff(), table.Grid().spacing.maxCoeff());
    const Pixels pixels = Convert(table, Beams(image, [](int, int) { return 200.0; }), AllData(image));
    Eigen::AlignedBox2i box;
    for (int j = 0; j < image.height; ++j)
      for (int i = 0; i < image.width; ++i)
        if (pixels.valid.View()(i, j, 0)) {
          box.extend(Eigen::Vector2i(i, j));
          ASSERT_EQ(pixels.intensity.View()(i, j, 0), 200);
          ASSERT_EQ(pixels.label.View()(i, j, 0), 1);
        }
    const Eigen::Vector2i free = Eigen::Vector2i(image.width - 1, image.height - 1) - box.max();
    EXPECT_LE((free - box.min()).cwiseAbs().maxCoeff(), 1);
    EXPECT_GE(box.min().minCoeff(), 1);
    EXPECT_LE(box.min().minCoeff(), 3);
  }
}

TEST(FanTable, ABrightSampleIsSeenWhereItsBeamIs)
{
  for (const LiveProbe kind : probes)
    for (const bool flipped : {false, true}) {
      const FanImage image = ImageOf(kind, flipped);
      const FanTable table(image);
      constexpr int brightSample = 120, brightBeam = 20;
      const Pixels pixels = Convert(table,
                                    Beams(image,
                                          [](int sample, int beam) {
                                            const double s = sample - brightSample, b = beam - brightBeam;
                                            return 250.0 * std::exp(-0.5 * (s * s / 16.0 + b * b / 4.0));
                                          }),
                                    AllData(image));
      double weights = 0.0;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int j = 0; j < image.height; ++j)
        for (int i = 0; i < image.width; ++i) {
          weights += pixels.intensity.View()(i, j, 0);
          sum += pixels.intensity.View()(i, j, 0) * PointInProbe(table, i, j);
        }
      const double depth =
          image.probe.depthMin + (image.probe.depthMax - image.probe.depthMin) * brightSample / (image.samples - 1);
      const Eigen::Vector3d expected =
          PointOf(image.probe, {depth, static_cast<double>(brightBeam) / (image.beams - 1) - 0.5, 0.0});
      EXPECT_LT((sum / weights - expected).norm(), 0.02 * image.probe.depthMax) << static_cast<int>(kind);
      // Flipping moves it to the other side of the image, not of the world.
      const double column = (table.Grid().WorldToIndex() * expected).x();
      EXPECT_EQ(column > 0.5 * image.width, flipped) << column;
    }
}

TEST(FanTable, FlippingMirrorsThePixels)
{
  const FanTable table(ImageOf(LiveProbe::Convex)), mirrored(ImageOf(LiveProbe::Convex, true));
  Random random(4);
  const Volume<float> value = Beams(table.Image(), [&random](int, int) { return random.Uniform(0.0, 255.0); });
  const Pixels there = Convert(table, value, AllData(table.Image())), here = Convert(mirrored, value, AllData(table.Image()));
  int differences = 0;
  for (int j = 0; j < 240; ++j)
    for (int i = 0; i < 321; ++i)
      differences += std::abs(there.intensity.View()(i, j, 0) - here.intensity.View()(320 - i, j, 0)) > 1;
  EXPECT_LE(differences, 4);
}

TEST(FanTable, ARadialImageHasNoSeam)
{
  FanImage image = ImageOf(LiveProbe::Radial);
  ASSERT_TRUE(ClosesCircle(image.probe, image.beams));
  EXPECT_FALSE(ClosesCircle(image.probe, image.beams + 1));
  EXPECT_FALSE(ClosesCircle(ImageOf(LiveProbe::Convex).probe, image.beams));
  const FanTable table(image);
  // A function of the direction that has no seam itself, the same in each beam.
  const auto valueAt = [](double angle) { return 128.0 + 60.0 * std::cos(angle) + 50.0 * std::sin(2.0 * angle); };
  const Volume<float> value = Beams(image, [&](int, int beam) {
    return valueAt(image.probe.fanAngle * (static_cast<double>(beam) / (image.beams - 1) - 0.5));
  });
  const Pixels pixels = Convert(table, value, AllData(image));
  const double radius = image.probe.fanWidth / image.probe.fanAngle;
  int inside = 0, behind = 0;
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      const Eigen::Vector3d point = PointInProbe(table, i, j) + Eigen::Vector3d(0, 0, radius);
      const double depth = point.norm() - radius, angle = std::atan2(point.x(), point.z());
      const bool isInside = depth > 0.01 && depth < image.probe.depthMax - 0.01;
      if (!isInside)
        continue;
      ++inside;
      behind += std::abs(angle) > Pi * (1.0 - 1.0 / image.beams); // between the last beam and the first
      ASSERT_EQ(pixels.valid.View()(i, j, 0), 1) << i << " " << j;
      ASSERT_NEAR(pixels.intensity.View()(i, j, 0), valueAt(angle), 1.0) << i << " " << j;
    }
  EXPECT_GT(inside, 35000);
  EXPECT_GT(behind, 100);
}

TEST(FanTable, PixelsNextToSamplesWithoutContentHaveNone)
{
  const FanImage image = ImageOf(LiveProbe::Convex);
  const FanTable table(image);
  Volume<unsigned char> content = AllData(image);
  for (int beam = 0; beam < image.beams; ++beam)
    for (int sample = 0; sample < image.samples; ++sample)
      content.View()(sample, beam, 0) = beam >= 48     ? (sample < 100 ? ContentInvented : ContentData | ContentInvented)
                                        : sample < 100 ? ContentData
                                                       : ContentNothing;
  const Pixels pixels = Convert(table, Beams(image, [](int, int) { return 90.0; }), content);
  int counts[4] = {};
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      const auto beam = BeamPointAt(image.probe, PointInProbe(table, i, j));
      const int label = pixels.label.View()(i, j, 0);
      ++counts[label];
      EXPECT_EQ(pixels.valid.View()(i, j, 0), label != 0);
      EXPECT_EQ(pixels.intensity.View()(i, j, 0), label != 0 ? 90 : 0);
      if (!beam)
        continue;
      const double b = (beam->fan + 0.5) * 95, s = beam->depth / image.probe.depthMax * 199;
      const int expected = b < 47.0 ? (s < 99.0 ? 1 : 0) : b > 48.0 ? (s < 99.0 ? 3 : 2) : s < 99.0 ? 2 : 0;
      if (std::abs(b - 47.0) > 0.01 && std::abs(b - 48.0) > 0.01 && std::abs(s - 99.0) > 0.01 && std::abs(s - 100.0) > 0.01 &&
          (s < 99.0 || s > 100.0)) {
        EXPECT_EQ(label, expected) << b << " " << s;
      }
    }
  for (const int count : counts)
    EXPECT_GT(count, 100);
}

TEST(FanTable, APixelIsMadeOfAllFourSamplesAroundIt)
{
  const FanImage image = ImageOf(LiveProbe::Convex);
  const FanTable table(image);
  Volume<unsigned char> content = AllData(image);
  content.View()(100, 40, 0) = ContentInvented;
  const Pixels pixels = Convert(table, Beams(image, [](int, int) { return 90.0; }), content);
  int around = 0;
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i)
      if (const auto beam = BeamPointAt(image.probe, PointInProbe(table, i, j))) {
        const double b = std::abs((beam->fan + 0.5) * 95 - 40.0), s = std::abs(beam->depth / image.probe.depthMax * 199 - 100.0);
        if (std::abs(b - 1.0) < 0.01 || std::abs(s - 1.0) < 0.01)
          continue;
        const bool touches = b < 1.0 && s < 1.0;
        around += touches;
        ASSERT_EQ(pixels.label.View()(i, j, 0), touches ? 2 : 1) << b << " " << s;
      }
  EXPECT_GE(around, 4);
}

TEST(FanTable, ThreadsChangeNothing)
{
  const FanTable table(ImageOf(LiveProbe::Phased));
  Random random(4);
  const Volume<float> value = Beams(table.Image(), [&random](int, int) { return random.Uniform(0.0, 255.0); });
  const Pixels many = Convert(table, value, AllData(table.Image()));
  const ThreadLimit limit(1);
  const Pixels one = Convert(FanTable(table.Image()), value, AllData(table.Image()));
  EXPECT_TRUE(std::equal(one.intensity.View().begin(), one.intensity.View().end(), many.intensity.View().begin()));
}

TEST(FanTable, RefusesSizesAndProbesThatItCannotServe)
{
  const FanImage good = ImageOf(LiveProbe::Convex);
  FanImage swept = good, thin = good, single = good;
  swept.probe.sweepAngle = 0.3;
  thin.width = 3;
  single.beams = 1;
  for (const FanImage& image : {swept, thin, single})
    EXPECT_THROW(FanTable table(image), Error);
  const FanTable table(good);
  Pixels pixels(table);
  const Volume<float> few({good.samples, good.beams - 1, 1});
  EXPECT_THROW(table.Convert(few.View(), AllData(good).View(), pixels.intensity.View(), pixels.valid.View(), {}), Error);
}

} // namespace
