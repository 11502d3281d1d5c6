// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Embedding/BeamNoise.h"
#include "Filters/Embedding/EmbedSlabs.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>

namespace echorama {
namespace {

using Byte = unsigned char;

// Speckle of 1 mm in an ellipsoid, brighter towards its end.
struct Data {
  ImageGeometry geometry;
  Volume<Byte> intensity, region;

  explicit Data(const std::array<int, 3>& n) : intensity(n), region(n)
  {
    geometry.dimensions = n;
    geometry.spacing = {0.6, 0.5, 0.55};
    geometry.origin = {5, -3, 20};
    BeamNoiseParameters p;
    p.samples = n[0];
    p.elements = n[1];
    p.steps = n[2];
    p.depthCorrelationMm = 1.2;
    p.fanCorrelation = 1.2 / (0.5 * n[1]);
    p.sweepCorrelation = 1.2 / (0.55 * n[2]);
    p.mean = 100.0;
    const Volume<float> speckle = MakeBeamNoise(p, ProbeGeometry::Linear(0.5 * n[1], 0.55 * n[2], 0.0, 0.6 * n[0]));
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          const Eigen::Vector3d at(2.0 * i / (n[0] - 1) - 1.0, 2.0 * j / (n[1] - 1) - 1.0, 2.0 * k / (n[2] - 1) - 1.0);
          region.View()(i, j, k) = at.norm() < 0.9;
          intensity.View()(i, j, k) =
              static_cast<Byte>(std::min(255.0, (0.7 + 0.3 * at[2]) * static_cast<double>(speckle.View()(i, j, k))));
        }
  }

  /// Slices from \a first on.
  void Show(int first, const std::function<void(const void*, const Byte*)>& use) const
  {
    const std::ptrdiff_t slice = region.View().SliceStride();
    use(intensity.View().Data() + slice * first, region.View().Data() + slice * first);
  }
};

std::unique_ptr<EmbedSlabs> Planned(const Data& data, int atATime, EmbedSlabs::Settings settings = {})
{
  settings.bytes = settings.bytes > 0.0 ? settings.bytes : 2e9;
  settings.embed.featherMm = -1.0;
  settings.enclosing.marginMm = 2.0;
  auto slabs = EmbedSlabs::Make<Byte>(settings, data.geometry);
  const int slices = data.geometry.dimensions[2];
  for (int first = 0; first < slices; first += atATime) {
    const int count = std::min(atATime, slices - first);
    data.Show(first, [&](const void* intensity, const Byte* region) { slabs->Look(first, count, intensity, region); });
  }
  slabs->Plan();
  return slabs;
}

struct Result {
  Volume<Byte> intensity, region, labels;
};

Result Made(const Data& data, EmbedSlabs& slabs, int thick, int atATime)
{
  const std::array<int, 3> n = slabs.Grid().dimensions;
  Result result{Volume<Byte>(n), Volume<Byte>(n), Volume<Byte>(n)};
  for (int first = 0; first < n[2]; first += thick) {
    const int count = std::min(thick, n[2] - first);
    auto [from, to] = slabs.Missing(first, first + count);
    for (; from < to; from += std::min(atATime, to - from)) {
      const int some = std::min(atATime, to - from), at = from;
      data.Show(at, [&](const void* intensity, const Byte* region) { slabs.Take(at, some, intensity, region); });
    }
    const auto [none, left] = slabs.Missing(first, first + count);
    EXPECT_GE(none, left);
    const std::ptrdiff_t skip = result.region.View().SliceStride() * first;
    slabs.Render(first, count, result.intensity.View().Data() + skip, result.region.View().Data() + skip,
                 result.labels.View().Data() + skip);
  }
  return result;
}

// More than a brick along x, so that bricks meet.
const std::array<int, 3> size{300, 40, 60};

TEST(EmbedSlabs, DataStayWhereTheyAreAndAsTheyAre)
{
  const Data data(size);
  const auto slabs = Planned(data, 7);
  const Result result = Made(data, *slabs, 11, 5);
  const ImageGeometry& grid = slabs->Grid();
  const Eigen::Vector3d place = data.geometry.WorldToIndex() * grid.origin;
  const std::array<int, 3> offset{static_cast<int>(std::lround(place[0])), static_cast<int>(std::lround(place[1])),
                                  static_cast<int>(std::lround(place[2]))};
  EXPECT_NEAR((place - Eigen::Vector3d(offset[0], offset[1], offset[2])).norm(), 0.0, 1e-9);
  const auto& n = grid.dimensions;
  int found = 0, blended = 0, invented = 0, wrong = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const int x = i + offset[0], y = j + offset[1], z = k + offset[2];
        const bool isData =
            x >= 0 && y >= 0 && z >= 0 && x < size[0] && y < size[1] && z < size[2] && data.region.View()(x, y, z);
        const auto label = static_cast<EmbeddedVoxel>(result.labels.View()(i, j, k));
        wrong += (result.region.View()(i, j, k) != 0) != isData;
        wrong += (label == EmbeddedVoxel::Data || label == EmbeddedVoxel::Blend) != isData;
        wrong += label == EmbeddedVoxel::Data && result.intensity.View()(i, j, k) != data.intensity.View()(x, y, z);
        wrong += label == EmbeddedVoxel::Outside && result.intensity.View()(i, j, k) != 0;
        found += label == EmbeddedVoxel::Data;
        blended += label == EmbeddedVoxel::Blend;
        invented += label == EmbeddedVoxel::Invented;
      }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(found, 50000);
  EXPECT_GT(blended, 10000);
  EXPECT_GT(invented, 50000);
}

// However thick slabs are, the same voxels come out; but for the last grey level of the few that rounding of the noise decides.
TEST(EmbedSlabs, DoNotShowInTheResult)
{
  ECHORAMA_SKIP_SANITIZED();
  const Data data(size);
  const auto slabs = Planned(data, 60);
  const Result whole = Made(data, *slabs, slabs->Grid().dimensions[2], 60), parts = Made(data, *slabs, 5, 60);
  std::ptrdiff_t other = 0, shown = 0;
  int worst = 0;
  for (std::ptrdiff_t at = 0; at < whole.labels.View().Size(); ++at) {
    ASSERT_EQ(whole.labels.View()[at], parts.labels.View()[at]);
    ASSERT_EQ(whole.region.View()[at], parts.region.View()[at]);
    const int difference = std::abs(whole.intensity.View()[at] - parts.intensity.View()[at]);
    shown += whole.labels.View()[at] == static_cast<Byte>(EmbeddedVoxel::Invented);
    other += difference > 0;
    worst = std::max(worst, difference);
  }
  EXPECT_LE(worst, 1);
  EXPECT_LT(static_cast<double>(other), 1e-4 * static_cast<double>(shown));
}

// The levels and the grain of the background are those that Embed gives it as a whole.
TEST(EmbedSlabs, TheBackgroundIsThatOfTheWhole)
{
  ECHORAMA_SKIP_SANITIZED();
  const Data data(size);
  const auto slabs = Planned(data, 60);
  EXPECT_GT(slabs->Noise().grains, 400.0);
  EXPECT_NEAR(slabs->Noise().grainMm, 1.2, 0.3);
  const Result parts = Made(data, *slabs, 64, 60);
  const ImageGeometry& grid = slabs->Grid();
  // The same form, noise and data on the same grid, at once.
  Volume<Byte> intensity(grid.dimensions), labels(grid.dimensions), form(grid.dimensions);
  Volume<float> noise(grid.dimensions);
  for (std::ptrdiff_t at = 0; at < intensity.View().Size(); ++at) {
    const auto label = static_cast<EmbeddedVoxel>(parts.labels.View()[at]);
    form.View()[at] = label == EmbeddedVoxel::Invented || label == EmbeddedVoxel::Blend || label == EmbeddedVoxel::Data;
    noise.View()[at] = static_cast<float>(Random(5, static_cast<std::uint64_t>(at)).Normal());
  }
  const Eigen::Vector3d place = grid.WorldToIndex() * data.geometry.origin;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (data.region.View()(i, j, k))
          intensity.View()(i + static_cast<int>(std::lround(place[0])), j + static_cast<int>(std::lround(place[1])),
                           k + static_cast<int>(std::lround(place[2]))) = data.intensity.View()(i, j, k);
  EmbedParameters p;
  p.featherMm = slabs->FeatherMm();
  Embed<Byte>(p, std::as_const(parts.region).View(), grid.spacing, noise.View(), std::as_const(form).View(), intensity.View(),
              labels.View());
  // In both halves, of which one is brighter.
  for (const bool upper : {false, true}) {
    double count = 0.0, sums[2] = {}, squares[2] = {};
    const auto& n = grid.dimensions;
    for (int k = upper ? n[2] / 2 : 0; k < (upper ? n[2] : n[2] / 2); ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (labels.View()(i, j, k) == static_cast<Byte>(EmbeddedVoxel::Invented)) {
            const double value[2] = {static_cast<double>(intensity.View()(i, j, k)),
                                     static_cast<double>(parts.intensity.View()(i, j, k))};
            count += 1.0;
            for (int which = 0; which < 2; ++which) {
              sums[which] += value[which];
              squares[which] += value[which] * value[which];
            }
          }
    const auto deviation = [&](int which) { return std::sqrt(squares[which] / count - std::pow(sums[which] / count, 2)); };
    EXPECT_NEAR(sums[1] / count, sums[0] / count, 0.03 * sums[0] / count) << upper;
    EXPECT_NEAR(deviation(1), deviation(0), 0.1 * deviation(0)) << upper;
  }
}

TEST(EmbedSlabs, SaysHowMuchMemoryItNeeds)
{
  ImageGeometry large;
  large.dimensions = {2000, 2000, 1000};
  large.spacing.setConstant(0.2);
  EmbedSlabs::Settings settings;
  settings.bytes = 3e9;
  const auto slabs = EmbedSlabs::Make<Byte>(settings, large);
  EXPECT_GE(slabs->SlicesAtATime(), 8);
  settings.bytes = 3e8;
  try {
    EmbedSlabs::Make<Byte>(settings, large);
    ADD_FAILURE() << "0.3 GB do not suffice";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::TooLarge);
    EXPECT_NE(std::string(error.what()).find("0.3 GB are allowed"), std::string::npos) << error.what();
  }
  large.dimensions[2] = 1;
  EXPECT_THROW(EmbedSlabs::Make<Byte>(settings, large), Error);
}

// Slabs may be asked for in any order, and on any number of threads: the sums of what was passed by are made again.
TEST(EmbedSlabs, InAnyOrderTheyAreTheSame)
{
  ECHORAMA_SKIP_SANITIZED();
  const Data data({60, 40, 60});
  const auto slabs = Planned(data, 60);
  const auto& n = slabs->Grid().dimensions;
  const auto made = [&](int first) {
    const auto [from, to] = slabs->Missing(first, first + 5);
    if (from < to)
      data.Show(from, [&, at = from, count = to - from](const void* intensity, const Byte* region) {
        slabs->Take(at, count, intensity, region);
      });
    std::vector<Byte> out(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * 5), region(out.size()),
        labels(out.size());
    slabs->Render(first, 5, out.data(), region.data(), labels.data());
    return out;
  };
  const int last = n[2] - 5;
  const std::vector<Byte> middle = made(last / 2), end = made(last), beginning = made(0);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(made(last / 2), middle);
    EXPECT_EQ(made(last), end);
    EXPECT_EQ(made(0), beginning);
  }
  const Result whole = Made(data, *slabs, n[2], 60);
  std::ptrdiff_t other = 0;
  for (const auto& [first, slab] : {std::pair(0, &beginning), std::pair(last / 2, &middle), std::pair(last, &end)})
    for (std::size_t at = 0; at < slab->size(); ++at)
      other += (*slab)[at] != whole.intensity.View().Row(0, first)[at];
  EXPECT_LT(other, 5);
}

TEST(EmbedSlabs, RefusesWhatIsMissingAndStopsOnRequest)
{
  const Data data({60, 40, 60});
  const auto slabs = Planned(data, 60);
  std::vector<Byte> out(static_cast<std::size_t>(slabs->Grid().dimensions[0]) *
                        static_cast<std::size_t>(slabs->Grid().dimensions[1]) * 5);
  std::vector<Byte> region(out.size()), labels(out.size());
  EXPECT_THROW(slabs->Render(20, 5, out.data(), region.data(), labels.data()), Error);
  data.Show(0, [&](const void* intensity, const Byte* real) { slabs->Take(0, 60, intensity, real); });
  const Progress stop([](double fraction) { return fraction < 0.3; });
  EXPECT_THROW(slabs->Render(20, 5, out.data(), region.data(), labels.data(), stop), Error);
  slabs->Render(20, 5, out.data(), region.data(), labels.data());

  EmbedSlabs::Settings settings;
  settings.bytes = 2e9;
  const auto empty = EmbedSlabs::Make<Byte>(settings, data.geometry);
  const std::vector<Byte> none(static_cast<std::size_t>(60 * 40 * 60));
  empty->Look(0, 60, none.data(), none.data());
  EXPECT_THROW(empty->Plan(), Error);
}

} // namespace
} // namespace echorama
