// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/ProbePresets.h"
#include <gtest/gtest.h>
#include <set>

using namespace echorama;

TEST(ProbePresets, AreSoundAndNamedOnce)
{
  std::set<std::string> names;
  for (const ProbePreset& preset : ProbePresets()) {
    SCOPED_TRACE(preset.name);
    EXPECT_TRUE(names.insert(preset.name).second);
    EXPECT_NO_THROW(preset.probe.Check());
    EXPECT_NO_THROW(CheckRanges(preset.transducer));
    EXPECT_EQ(preset.probe.IsPlane(), preset.sweepSteps == 1);
    EXPECT_FALSE(preset.probe.ReachesBehindAxis());
    EXPECT_GE(preset.elements, 2);
    EXPECT_FALSE(preset.label.empty());
    EXPECT_FALSE(preset.source.empty());
    // Samples resolve the pulse, and the foci lie within the depth.
    const double step = (preset.probe.depthMax - preset.probe.depthMin) / (preset.samples - 1);
    EXPECT_LT(step, preset.transducer.WavelengthMm(1540.0));
    EXPECT_LT(preset.transducer.lateralFocusMm, preset.probe.depthMax);
    EXPECT_LT(preset.transducer.elevationFocusMm, preset.probe.depthMax);
  }
  for (const char* name : {"curvilinear", "linear", "phased", "endocavity-3d", "mechanical-3d"})
    EXPECT_EQ(ProbePresetOf(name).name, name);
}

TEST(ProbePresets, HaveTheSizesTheyAreSaidToHave)
{
  const ProbeGeometry curved = ProbePresetOf("curvilinear").probe;
  EXPECT_NEAR(curved.fanWidth, 64.516, 1e-9);
  EXPECT_NEAR(curved.fanWidth / curved.fanAngle, 49.57, 1e-9);
  EXPECT_NEAR(ProbePresetOf("linear").probe.fanWidth, 38.1, 1e-9);
  EXPECT_EQ(ProbePresetOf("phased").probe.fanWidth, 0.0);
  const ProbeGeometry endocavity = ProbePresetOf("endocavity-3d").probe;
  EXPECT_NEAR(endocavity.sweepWidth / endocavity.sweepAngle, endocavity.fanWidth / endocavity.fanAngle, 1e-9);
}

TEST(ProbePresets, ListsTheNamesThereAre)
{
  try {
    ProbePresetOf("curvy");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    EXPECT_STREQ(error.what(),
                 "there is no probe preset \"curvy\"; there are curvilinear, linear, phased, endocavity-3d, mechanical-3d");
  }
}
