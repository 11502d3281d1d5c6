// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Base/Utf8.h"
#include "Core/Geometry/ToolPose.h"
#include <gtest/gtest.h>

using namespace echorama;

TEST(ToolTransformName, KeepsWhatIsOneAndMakesOneOfWhatIsNot)
{
  for (const auto& [given, expected] : std::vector<std::pair<std::string, std::string>>{
           {"ProbeToTracker", "ProbeToTracker"},
           {"TestToolToTracker", "TestToolToTracker"},
           {"ImageToProbeTransform", "ImageToProbe"},
           {"S\xc3\xb6ndeToTracker", "S\xc3\xb6ndeToTracker"},
           {"Probe", "ProbeToTracker"},
           {"probe 2", "Probe_2ToTracker"},
           {"Probe#1 (left)", "Probe_1__left_ToTracker"},
           {"", "ToolToTracker"},
           {"AToBToC", "ATOBTOCToTracker"},
           {"GoTo", "GoTOToTracker"},
           {"ToBack", "TOBackToTracker"},
           {"toXToTracker", "TOXToTracker"},
           {"A=B\n\x7f", "A_B__ToTracker"},
           {"\xc3(\xff\xc2\x85", "_____ToTracker"}}) // half a letter, no letter, a control character
    EXPECT_EQ(ToolTransformName(given), expected) << given;
}

TEST(ToolTransformName, IsAlwaysAName)
{
  const std::string pieces[] = {"To",      "T", "o", "t",    "to",       "A",  "b", "Transform",
                                "Tracker", " ", "=", "\xff", "\xc3\xa9", "\n", "2"};
  Random random(3);
  for (int trial = 0; trial < 20000; ++trial) {
    std::string name;
    for (double left = 8.0 * random.Uniform(); left > 0.0; left -= 1.0)
      name += pieces[static_cast<std::size_t>(15.0 * random.Uniform())];
    const std::string made = ToolTransformName(name);
    const auto frames = FramesOf(made);
    ASSERT_TRUE(frames) << name << " " << made;
    EXPECT_EQ(frames->first + "To" + frames->second, made) << name;
    EXPECT_EQ(FramesOf(made + "Transform"), frames) << name; // as recordings name it
    EXPECT_EQ(ToolTransformName(made), made) << name;
    EXPECT_TRUE(IsPrintableUtf8(made)) << name;
    EXPECT_EQ(made.find('='), std::string::npos) << name;
  }
}

TEST(PrintableUtf8, TellsCharactersFromBytes)
{
  const auto size = [](const char* text) { return PrintableUtf8(text); };
  EXPECT_EQ(size("a"), 1u);
  EXPECT_EQ(size("\xc3\xa9"), 2u);
  EXPECT_EQ(size("\xe2\x82\xac"), 3u);
  EXPECT_EQ(size("\xf0\x9f\x98\x80"), 4u);
  for (const char* none : {"", "\t", "\x7f", "\x80", "\xc0\xaf", "\xc2\x80", "\xc3", "\xe0\x80\xaf", "\xed\xa0\x80", "\xe2\x82",
                           "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff"})
    EXPECT_EQ(size(none), 0u) << none;
}

TEST(PrintableUtf8, BytesThatATerminalWouldObeyAreSpeltOut)
{
  EXPECT_EQ(Printable("gr\xc3\xb6\xc3\x9f"
                      "e\n"),
            "gr\xc3\xb6\xc3\x9f"
            "e\n");
  EXPECT_EQ(Printable("\x1b[2J\t\x7f"), "\\x1b[2J\\x09\\x7f");
  EXPECT_EQ(Printable(std::string("a\0b\xff", 4)), "a\\x00b\\xff");
  EXPECT_EQ(Printable("\xc2\x9b"
                      "1m"),
            "\\xc2\\x9b1m"); // what begins such an order, as one character
  EXPECT_EQ(Printable("\xc3"), "\\xc3");
}
