// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Acoustics/ProgressiveSlice.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

TissueSurface Body()
{
  TissueSurface surface = Background(StandardMaterial("liver"));
  AddSphere(surface, StandardMaterial("blood"), Vector3d(-5, 0, 25), 6.0);
  AddSphere(surface, StandardMaterial("bone"), Vector3d(6, 0, 20), 3.0);
  return surface;
}

SynthesisParameters Plane()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Linear(24.0, 0.0, 0.0, 40.0);
  p.elements = 33;
  p.samples = 160;
  p.transducer.lateralFocusMm = p.transducer.elevationFocusMm = 25.0;
  p.receiver.noiseDb = Receiver::noNoiseDb;
  return p;
}

bool Same(const Volume<unsigned char>& a, const Volume<unsigned char>& b)
{
  return a.Dimensions() == b.Dimensions() && std::equal(a.View().begin(), a.View().end(), b.View().begin());
}

double Rms(const Volume<unsigned char>& a, const Volume<unsigned char>& b)
{
  double sum = 0.0;
  for (std::ptrdiff_t i = 0; i < a.View().Size(); ++i)
    sum += std::pow(static_cast<double>(a.View()[i]) - b.View()[i], 2);
  return std::sqrt(sum / static_cast<double>(a.View().Size()));
}

std::string MessageOf(const std::function<void()>& call)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

} // namespace

TEST(ProgressiveSlice, EndsWithThePictureOfSynthesizeBeamsWhateverCameBefore)
{
  const AcousticScene scene(Body());
  for (const double room : {1e9, 1.0}) {
    ProgressiveSlice slice(scene, room);
    SynthesisParameters p = Plane();
    for (int move = 0; move < 4; ++move) {
      for (int level = move % 2 * 3; level < ProgressiveSlice::levels; ++level) {
        const ThreadLimit limit(1 + level % 2);
        const Volume<unsigned char> picture = slice.Make(p, level);
        EXPECT_EQ(picture.Dimensions(), (std::array<int, 3>{160, 33, 1}));
        if (level == ProgressiveSlice::levels - 1) {
          EXPECT_TRUE(Same(picture, SynthesizeBeams(scene, p))) << move;
        }
      }
      p.probeToWorld = MotionAbout(Vector3d::Zero(), Vector3d(0.02, 0.05, 0.1), Vector3d(1.5, 2.0, -0.5)) * p.probeToWorld;
    }
  }
}

TEST(ProgressiveSlice, GetsBetterLevelByLevel)
{
  TissueSurface surface = Background(StandardMaterial("liver")); // nothing that turns back much sound
  AddSphere(surface, StandardMaterial("blood"), Vector3d(-5, 0, 25), 6.0);
  AddSphere(surface, StandardMaterial("kidney"), Vector3d(6, 0, 20), 3.0);
  const AcousticScene scene(surface);
  ProgressiveSlice slice(scene);
  const SynthesisParameters p = Plane();
  const Volume<unsigned char> full = SynthesizeBeams(scene, p);
  SynthesisParameters otherSpeckle = p;
  otherSpeckle.seed = 2;
  double worse = Rms(SynthesizeBeams(scene, otherSpeckle), full); // a picture of another speckle is not even a first step
  for (int level = 0; level < ProgressiveSlice::levels; ++level) {
    const double error = Rms(slice.Make(p, level), full);
    EXPECT_LT(error, 0.95 * worse) << level;
    worse = error;
  }
  EXPECT_EQ(worse, 0.0);
}

TEST(ProgressiveSlice, MakesOnlyNewScatterersAndForgetsOldOnes)
{
  const AcousticScene scene(Body());
  SynthesisParameters p = Plane();
  ProgressiveSlice roomy(scene), tight(scene, 1.0);
  roomy.Make(p, 0);
  tight.Make(p, 0);
  const std::size_t one = roomy.MemoryBytes();
  EXPECT_GT(one, 100000u);
  EXPECT_EQ(tight.MemoryBytes(), one);
  roomy.Make(p, 0); // nothing is new
  EXPECT_EQ(roomy.MemoryBytes(), one);
  p.probeToWorld.translation().y() = 5.0; // little is
  roomy.Make(p, 0);
  EXPECT_GT(roomy.MemoryBytes(), one);
  EXPECT_LT(roomy.MemoryBytes(), 1.6 * static_cast<double>(one));
  for (int i = 0; i < 5; ++i) {
    p.probeToWorld.translation().y() += 60.0; // all is
    roomy.Make(p, 0);
    tight.Make(p, 0);
  }
  EXPECT_GT(roomy.MemoryBytes(), 4 * one);
  EXPECT_LT(tight.MemoryBytes(), 2 * one);
}

TEST(ProgressiveSlice, NoticesWhenTheScatterersAreOthers)
{
  const AcousticScene scene(Body());
  ProgressiveSlice slice(scene);
  SynthesisParameters p = Plane();
  slice.Make(p, 3);
  const auto change = [&](const std::function<void()>& how, const char* what) {
    how();
    EXPECT_TRUE(Same(slice.Make(p, 3), SynthesizeBeams(scene, p))) << what;
  };
  change([&] { p.seed = 5; }, "seed");
  change([&] { p.decorrelation = 0.5; }, "decorrelation");
  change([&] { p.changeSeed = 3; }, "change seed");
  change([&] { p.scatterersPerMm3 = 3.0; }, "density");
  change([&] { p.transducer.frequencyMHz = 5.0; }, "frequency");
  ImageGeometry lattice;
  lattice.dimensions = {10, 10, 10};
  lattice.origin = {-45.0, -45.0, -25.0};
  lattice.spacing = {10.0, 10.0, 10.0};
  for (const double by : {0.7, 1.3}) // in the same place of the memory
    change([&] { p.displacement = DisplacementField(lattice, std::vector<Vector3d>(1000, Vector3d(0.0, by, 0.0))); },
           "displacement");
}

TEST(ProgressiveSlice, RefusesWhatIsWrong)
{
  const AcousticScene scene(Body());
  ProgressiveSlice slice(scene);
  SynthesisParameters p = Plane();
  EXPECT_NE(MessageOf([&] { slice.Make(p, 4); }).find("level"), std::string::npos);
  EXPECT_NE(MessageOf([&] { slice.Make(p, -1); }).find("level"), std::string::npos);
  p.elements = 1; // a quarter of them would do
  EXPECT_NE(MessageOf([&] { slice.Make(p, 0); }).find("Elements"), std::string::npos);
  p = Plane();
  p.probeToWorld.translation().x() = std::nan("");
  EXPECT_NE(MessageOf([&] { slice.Make(p, 0); }).find("probeToWorld"), std::string::npos);
  p = Plane();
  p.mode = SynthesisParameters::Mode::Counting;
  EXPECT_NE(MessageOf([&] { slice.Make(p, 0); }).find("counting"), std::string::npos);
  p = Plane();
  p.probe.sweepAngle = 0.5;
  EXPECT_NE(MessageOf([&] { slice.Make(p, 0); }).find("sweeps"), std::string::npos);
}

TEST(ProgressiveSlice, CanBeStoppedAndGoesOnAfterThat)
{
  const AcousticScene scene(Body());
  ProgressiveSlice slice(scene);
  const SynthesisParameters p = Plane();
  for (const double at : {0.1, 0.3, 0.6})
    try {
      slice.Make(p, 3, Progress([at](double fraction) { return fraction < at; }));
      ADD_FAILURE() << "it was not stopped";
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
    }
  EXPECT_TRUE(Same(slice.Make(p, 3), SynthesizeBeams(scene, p)));
}
