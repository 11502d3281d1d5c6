// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Readers/KretzFile.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>

using namespace echorama;
using namespace echorama::testing;

namespace {

constexpr double degree = RadiansPerDegree;

template <class T>
std::string Bytes(const T& value)
{
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string Bytes(const std::vector<double>& values)
{
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

std::vector<double> Even(double firstDegrees, double lastDegrees, int count)
{
  std::vector<double> angles;
  for (int i = 0; i < count; ++i)
    angles.push_back((firstDegrees + (lastDegrees - firstDegrees) * (count > 1 ? i / (count - 1.0) : 0.0)) * degree);
  return angles;
}

// A Kretz file of known geometry, as text: what a scanner would write, item by item.
struct Written {
  using Tag = std::pair<int, int>;
  std::array<int, 3> dimensions{9, 6, 5};
  std::map<Tag, std::string> items;
  std::string end = Head({0xFFFF, 0xFFFF}, 0);

  Written()
  {
    for (int axis = 0; axis < 3; ++axis)
      items[{0xC000, axis + 1}] = Bytes(static_cast<std::uint16_t>(dimensions[static_cast<std::size_t>(axis)]));
    items[{0x0110, 2}] = std::string("Doe^Jane\0", 9);
    items[{0x0120, 1}] = "St. Elsewhere";
    items[{0x0130, 1}] = std::string("RIC6-12-D\0", 10);
    items[{0x0140, 3}] = "20170919";
    items[{0xC100, 1}] = Bytes(0.5e-3); // metres
    items[{0xC200, 1}] = Bytes(50.0);   // times the resolution: 25 mm
    items[{0xC200, 2}] = Bytes(-8.0);   // the axis 4 mm before the centre of the arc
    items[{0xC200, 4}] = Bytes(22.0);   // the face at 11 mm
    items[{0xC300, 1}] = Bytes(Even(75, 111, dimensions[2]));
    items[{0xC300, 2}] = Bytes(Even(86, 120, dimensions[1]));
    items[{0xD000, 1}] = Samples(0);
  }

  std::string Samples(int seed) const
  {
    std::string samples;
    for (int i = 0; i < dimensions[0] * dimensions[1] * dimensions[2]; ++i)
      samples += static_cast<char>((i * 37 + seed * 11) % 251);
    return samples;
  }

  static std::string Head(Tag tag, std::uint32_t bytes)
  {
    return Bytes(static_cast<std::uint16_t>(tag.first)) + Bytes(static_cast<std::uint16_t>(tag.second)) + Bytes(bytes);
  }

  std::string Text() const
  {
    std::string text = "KRETZFILE 1.0   ";
    for (const auto& [tag, value] : items)
      text += Head(tag, static_cast<std::uint32_t>(value.size())) + value;
    return text + end;
  }

  Written With(const std::function<void(Written&)>& change) const
  {
    Written copy = *this;
    change(copy);
    return copy;
  }
};

class KretzFile : public TemporaryFolder {
protected:
  std::unique_ptr<VolumeSource> Open(const Written& written, double spacingMm = 0.0) const
  {
    VolumeReadParameters parameters;
    parameters.spacingMm = spacingMm;
    return OpenVolume(Put("test.vol", written.Text()), parameters);
  }

  void ExpectBad(const Written& written, const std::string& words) const
  {
    ExpectRefused([&] { Open(written); }, Error::Kind::BadFile, "test.vol", words);
  }
};

TEST_F(KretzFile, SamplesLieOnTheTorusOfTheFile)
{
  const auto source = Open({});
  const VolumeContent& content = source->Content();
  ASSERT_TRUE(content.beams && content.probe && content.probeToWorld);
  EXPECT_EQ(content.format, FileFormat::Kretz);
  EXPECT_EQ(content.beams->dimensions, (std::array<int, 3>{9, 6, 5}));
  EXPECT_TRUE(content.holdsValidRegion);
  EXPECT_TRUE(content.notes.empty()) << content.notes.front();
  std::vector<unsigned char> beams(9 * 6 * 5);
  source->ReadBeams(0, beams.data());
  const std::string file = Written().Samples(0);
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 9; ++i) {
        // Straight from the definition: angles from 90 degrees, the axis of the sweep at z = b.
        const double r = (50 + i) * 0.5, b = 4.0, theta = (86 + j * 34 / 5.0 - 90) * degree, phi = (75 + k * 9 - 90) * degree;
        const Eigen::Vector3d there(r * std::sin(theta), -(r * std::cos(theta) - b) * std::sin(phi),
                                    b + (r * std::cos(theta) - b) * std::cos(phi));
        const BeamPoint point{content.probe->depthMin + 0.5 * i, j / 5.0 - 0.5, (4 - k) / 4.0 - 0.5};
        const Eigen::Vector3d here = *content.probeToWorld * PointOf(*content.probe, point);
        EXPECT_LT((here - there).norm(), 1e-12) << i << " " << j << " " << k;
        EXPECT_EQ(beams[static_cast<std::size_t>(i + 9 * (j + 6 * (4 - k)))],
                  static_cast<unsigned char>(file[static_cast<std::size_t>(i + 9 * (j + 6 * k))]));
      }
  EXPECT_NEAR(content.probe->depthMin, 14.0, 1e-12) << "from the face";
  EXPECT_NEAR(content.probe->depthMax, 18.0, 1e-12);
}

TEST_F(KretzFile, VolumeIsTheScanConversionOfItsBeams)
{
  for (const double spacing : {0.0, 0.7}) {
    const auto source = Open({}, spacing);
    const VolumeContent& content = source->Content();
    const double expected = spacing > 0.0 ? spacing : SampleSpacing(content.beams->dimensions, *content.probe);
    EXPECT_NEAR(content.geometry.spacing.x(), expected, 1e-15);
    const std::size_t count = content.geometry.VoxelCount();
    std::vector<unsigned char> voxels(count, 99), valid(count, 99);
    source->Read(0, voxels.data(), valid.data());
    Volume<unsigned char> beams(content.beams->dimensions), wanted(content.geometry.dimensions),
        inside(content.geometry.dimensions);
    source->ReadBeams(0, beams.View().Data());
    ScanConvert<unsigned char>(beams.View(), *content.probe, *content.probeToWorld, content.geometry, wanted.View(),
                               inside.View());
    EXPECT_TRUE(std::equal(voxels.begin(), voxels.end(), wanted.View().begin()));
    EXPECT_TRUE(std::equal(valid.begin(), valid.end(), inside.View().begin()));
    EXPECT_GT(std::count(valid.begin(), valid.end(), 1), static_cast<std::ptrdiff_t>(count / 6));
  }
}

TEST_F(KretzFile, NobodyIsNamed)
{
  const auto source = Open({});
  ASSERT_EQ(source->Content().fields.size(), 1u);
  EXPECT_EQ(source->Content().fields[0], HeaderField("TransducerType", "RIC6-12-D"));
}

TEST_F(KretzFile, FacesAndAxes)
{
  // Without a radius of the face, depths count from the first sample; the world stays.
  const auto source = Open(Written().With([](Written& w) { w.items.erase({0xC200, 4}); }));
  EXPECT_NEAR(source->Content().probe->depthMin, 0.0, 1e-12);
  ASSERT_EQ(source->Content().notes.size(), 1u);
  EXPECT_NE(source->Content().notes[0].find("face"), std::string::npos);
  const Eigen::Vector3d first = PointOf(*source->Content().probe, {0.0, -0.5, 0.5});
  const auto whole = Open({});
  EXPECT_LT((*source->Content().probeToWorld * first -
             *whole->Content().probeToWorld * PointOf(*whole->Content().probe, {14.0, -0.5, 0.5}))
                .norm(),
            1e-12);
  // An axis behind the centre of the arc, and one beyond the face.
  for (const double offset : {6.0, -40.0}) {
    const auto other = Open(Written().With([offset](Written& w) { w.items[{0xC200, 2}] = Bytes(offset); }));
    const double b = -0.5 * offset, r = 27.0, phi = -15 * degree;
    const Eigen::Vector3d there(r * std::sin(-4 * degree), -(r * std::cos(4 * degree) - b) * std::sin(phi),
                                b + (r * std::cos(4 * degree) - b) * std::cos(phi));
    const double depth = r - 25.0 + other->Content().probe->depthMin;
    EXPECT_LT((*other->Content().probeToWorld * PointOf(*other->Content().probe, {depth, -0.5, 0.5}) - there).norm(), 1e-12);
  }
}

TEST_F(KretzFile, ASinglePlaneIsAnImage)
{
  const auto source = Open(Written().With([](Written& w) {
    w.dimensions[2] = 1;
    w.items[{0xC000, 3}] = Bytes(std::uint16_t{1});
    w.items[{0xC300, 1}] = Bytes(Even(80, 80, 1));
    w.items[{0xD000, 1}] = w.Samples(0);
  }));
  EXPECT_EQ(source->Content().geometry.dimensions[2], 1);
  std::vector<unsigned char> voxels(source->Content().geometry.VoxelCount()), valid(voxels.size());
  source->Read(0, voxels.data(), valid.data());
  EXPECT_GT(std::count(valid.begin(), valid.end(), 1), 30);
}

TEST_F(KretzFile, UnevenAnglesAreResampled)
{
  // Samples that grow linearly with the angle, on uneven angles: on even ones they still do.
  const auto angle = [](int j) { return 86 + 34 * std::pow(j / 5.0, 1.3); };
  const auto turn = [](int k) { return 75 + 36 * std::pow(k / 4.0, 0.8); };
  const auto source = Open(Written().With([&](Written& w) {
    std::vector<double> fan, sweep;
    for (int j = 0; j < 6; ++j)
      fan.push_back(angle(j) * degree);
    for (int k = 0; k < 5; ++k)
      sweep.push_back(turn(k) * degree);
    w.items[{0xC300, 2}] = Bytes(fan);
    w.items[{0xC300, 1}] = Bytes(sweep);
    std::string& samples = w.items[{0xD000, 1}];
    for (int i = 0; i < 9 * 6 * 5; ++i)
      samples[static_cast<std::size_t>(i)] =
          static_cast<char>(std::lround(10 + 4 * (angle(i / 9 % 6) - 86) + 2 * (turn(i / 54) - 75)));
  }));
  ASSERT_EQ(source->Content().notes.size(), 2u);
  EXPECT_NE(source->Content().notes[0].find("the angles of the fan deviate from them by up to"), std::string::npos);
  EXPECT_NE(source->Content().notes[1].find("the angles of the sweep"), std::string::npos);
  std::vector<unsigned char> beams(9 * 6 * 5);
  source->ReadBeams(0, beams.data());
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(beams[static_cast<std::size_t>(9 * (j + 6 * (4 - k)))], 10 + 4 * 34 * j / 5.0 + 2 * 36 * k / 4.0, 1.01);
}

TEST_F(KretzFile, AnUncompressedMovieIsATimeSeries)
{
  const auto movie = [](std::vector<double> times) {
    return Written().With([&times](Written& w) {
      w.items.erase({0xD000, 1});
      w.items[{0xD400, 1}] = Bytes(std::uint32_t{3});
      w.items[{0xD400, 5}] = Bytes(times);
      w.items[{0xD600, 1}] = w.Samples(0) + w.Samples(1) + w.Samples(2);
    });
  };
  const auto source = Open(movie({0.0, 0.04, 0.09}));
  EXPECT_EQ(source->Content().times, (std::vector<double>{0.0, 0.04, 0.09}));
  std::vector<unsigned char> beams(9 * 6 * 5);
  source->ReadBeams(2, beams.data());
  EXPECT_EQ(beams[9 * 6 * 4], static_cast<unsigned char>(Written().Samples(2)[0]));
  const auto untimed = Open(movie({0.0, 0.0, 0.0}));
  EXPECT_EQ(untimed->Content().times, (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(untimed->Content().notes.size(), 1u);

  ExpectBad(movie({0, 1, 2}).With([](Written& w) { w.items[{0xD600, 1}].resize(200); }), "movie (D600,0001) is compressed");
  const auto beside = Open(movie({0, 1, 2}).With([](Written& w) {
    w.items[{0xD600, 1}].resize(200);
    w.items[{0xD000, 1}] = w.Samples(0);
  }));
  EXPECT_TRUE(beside->Content().times.empty());
  EXPECT_NE(beside->Content().notes.at(0).find("left out"), std::string::npos);
}

TEST_F(KretzFile, VoxelsWithoutAngles)
{
  const auto voxels = Written().With([](Written& w) {
    w.items.erase({0xC300, 1});
    w.items.erase({0xC300, 2});
    w.items[{0x0010, 0x22}] = Bytes(0.5);
  });
  const auto source = Open(voxels);
  EXPECT_FALSE(source->Content().beams);
  EXPECT_EQ(source->Content().geometry.spacing, Eigen::Vector3d(0.5, 0.5, 0.5));
  EXPECT_NE(source->Content().notes.at(0).find("not confirmed"), std::string::npos);
  std::vector<unsigned char> out(9 * 6 * 5);
  source->Read(0, out.data(), nullptr);
  EXPECT_EQ(std::string(out.begin(), out.end()), Written().Samples(0));
  EXPECT_THROW(source->ReadBeams(0, out.data()), Error);
  ExpectBad(voxels.With([](Written& w) { w.items.erase({0x0010, 0x22}); }), "angles");
  ExpectBad(voxels.With([](Written& w) { w.items[{0x0010, 0x22}] = Bytes(0.0); }), "spacing");
}

TEST_F(KretzFile, InsideAnotherFile)
{
  const std::string text = Written().Text();
  const std::string path = Put("holder", "0123456789" + text + "and more");
  const auto source = OpenKretzWithin(path, 10, text.size());
  std::vector<unsigned char> beams(9 * 6 * 5);
  source->ReadBeams(0, beams.data());
  EXPECT_EQ(beams[9 * 6 * 4], static_cast<unsigned char>(Written().Samples(0)[0]));
  ExpectRefused([&] { OpenKretzWithin(path, 10, text.size() - 100); }, Error::Kind::BadFile, path, "truncated");
  ExpectRefused([&] { OpenKretzWithin(path, 0, text.size()); }, Error::Kind::BadFile, path, "begin");
}

TEST_F(KretzFile, RefusesWhatEndsEarly)
{
  const Written written;
  std::string text = written.Text();
  text.resize(text.size() - 8); // without the mark of the end
  EXPECT_NO_THROW(OpenVolume(Put("whole.vol", text)));
  for (const std::size_t length : {17ul, 30ul, text.size() - 300, text.size() - 1}) {
    const std::string path = Put("cut.vol", text.substr(0, length));
    ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, length < 25 ? "head of an item" : "");
  }
  const std::string path = Put("cut.vol", text.substr(0, text.size() - 1));
  ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, "truncated");
}

TEST_F(KretzFile, RefusesLengthsBeyondTheFile)
{
  // 2 GB and 4 GB are promised; nothing is allocated for them.
  for (const std::uint32_t bytes : {0x7FFFFFFFu, 0xFFFFFFFFu})
    for (const Written::Tag& tag : {Written::Tag{0xD000, 1}, {0xC300, 1}, {0xC000, 1}, {0x0130, 1}})
      ExpectBad(Written().With([&](Written& w) {
        w.items.erase(tag);
        w.end = Written::Head(tag, bytes) + std::string(64, '\0');
      }),
                "only 64 follow");
}

TEST_F(KretzFile, RefusesWhatIsMissingOrOutOfRange)
{
  const auto without = [](int group, int element) {
    return Written().With([=](Written& w) { w.items.erase({group, element}); });
  };
  const auto with = [](int group, int element, const std::string& value) {
    return Written().With([&](Written& w) { w.items[{group, element}] = value; });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ExpectBad(without(0xC000, 2), "(C000,0002)");
  ExpectBad(with(0xC000, 2, Bytes(std::uint16_t{0})), "is 0");
  ExpectBad(with(0xC000, 2, Bytes(std::uint32_t{6})), "4 bytes long");
  ExpectBad(with(0xC000, 2, Bytes(std::uint16_t{7})), "need 315 bytes");
  ExpectBad(Written().With([](Written& w) {
    for (int axis = 1; axis <= 3; ++axis)
      w.items[{0xC000, axis}] = Bytes(std::uint16_t{65535});
  }),
            "2^31");
  ExpectBad(without(0xC100, 1), "the resolution is missing");
  for (const double bad : {0.0, -1e-4})
    ExpectBad(with(0xC100, 1, Bytes(bad)), "must be positive");
  ExpectBad(with(0xC100, 1, Bytes(nan)), "not finite");
  ExpectBad(with(0xC100, 1, Bytes(1e307)), "probe geometry");
  ExpectBad(with(0xC100, 1, "1234"), "(C100,0001): 4 bytes");
  ExpectBad(without(0xC200, 1), "the radius of the first sample is missing");
  ExpectBad(with(0xC200, 1, Bytes(-1.0)), "at least 0");
  ExpectBad(without(0xC300, 1), "the angles of the sweep is missing");
  ExpectBad(without(0xC300, 2), "the angles of the fan is missing");
  ExpectBad(with(0xC300, 2, Bytes(Even(86, 120, 7))), "56 bytes");
  ExpectBad(with(0xC300, 2, Bytes(Even(120, 86, 6))), "do not increase");
  ExpectBad(with(0xC300, 2, Bytes(Even(90, 90, 6))), "do not increase");
  ExpectBad(with(0xC300, 1, Bytes(std::vector<double>{1, 2, nan, 4, 5})), "not finite");
  ExpectBad(with(0xC300, 2, Bytes(Even(86, 500, 6))), "fan angle");
  ExpectBad(with(0xC300, 2, Bytes(Even(300, 340, 6))), "offset of the fan");
  ExpectBad(without(0xD000, 1), "no samples");
  ExpectBad(with(0xD000, 1, Written().Samples(0).substr(1)), "compressed or the dimensions are wrong");
  ExpectBad(Written().With([](Written& w) { w.end = Written::Head({0xC100, 1}, 8) + Bytes(2e-3); }), "twice");
}

TEST_F(KretzFile, RefusesGridsThatAreTooLarge)
{
  ExpectRefused([&] { Open({}, 1e-4); }, Error::Kind::TooLarge, "test.vol", "larger spacing");
  ExpectRefused([&] { Open({}, -1.0); }, Error::Kind::InvalidParameter, "test.vol",
                "SpacingMm is -1 mm; it must be in [0, 1000]");
  // A shell of one thousandth of its radius: its box is all but empty.
  ExpectRefused(
      [&] {
        Open(Written().With([](Written& w) {
          w.items[{0xC200, 1}] = Bytes(1e7);
          w.items[{0xC300, 2}] = Bytes(Even(60, 120, 6));
        }));
      },
      Error::Kind::TooLarge, "test.vol", "million voxels");
}

TEST_F(KretzFile, ManyEmptyItems)
{
  std::string text = "KRETZFILE 1.0   ";
  for (int i = 0; i < 100001; ++i)
    text += Written::Head({0x0200, i % 60000}, 0);
  ExpectRefused([&] { OpenVolume(Put("many.vol", text)); }, Error::Kind::BadFile, "many.vol", "100000 items");
}

TEST_F(KretzFile, CanBeStopped)
{
  const auto source = Open({});
  std::vector<unsigned char> voxels(source->Content().geometry.VoxelCount()), valid(voxels.size());
  EXPECT_THROW(source->Read(0, voxels.data(), valid.data(), Progress([](double) { return false; })), Error);
}

} // namespace
