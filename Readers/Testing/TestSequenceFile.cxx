// SPDX-License-Identifier: BSD-3-Clause
// Sequences as Plus and Slicer write them, every orientation against its definition, real recordings, and files that lie.
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Readers/Compression.h"
#include "Readers/SequenceFile.h"
#include "Readers/Testing/Effort.h"
#include "Readers/Testing/ObliqueVolume.h"
#include "Readers/VolumeFile.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <map>
#include <numeric>
#include <zlib.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

using Fields = std::map<std::string, std::string>;

const std::string Still = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";

std::string Bytes(std::size_t count)
{
  std::string bytes(count, '\0');
  std::iota(bytes.begin(), bytes.end(), 1);
  return bytes;
}

/// A sequence of 3 frames of 4 x 2 bytes, 1, 2, 3 ..., as MetaImage; single lines are replaced, "" drops them.
std::string Meta(const Fields& changes = {}, const std::string& frameLines = "", const std::string& data = Bytes(24))
{
  const std::vector<HeaderField> lines = {{"ObjectType", "Image"},
                                          {"NDims", "3"},
                                          {"BinaryData", "True"},
                                          {"BinaryDataByteOrderMSB", "False"},
                                          {"CompressedData", "False"},
                                          {"DimSize", "4 2 3             "},
                                          {"Kinds", "domain domain list"},
                                          {"ElementSpacing", "1 1 1"},
                                          {"ElementType", "MET_UCHAR"},
                                          {"Offset", "0 0 0"},
                                          {"TransformMatrix", "1 0 0 0 1 0 0 0 1"},
                                          {"UltrasoundImageOrientation", "MF"},
                                          {"UltrasoundImageType", "BRIGHTNESS"}};
  return MetaImageLines(lines, changes) + frameLines + "ElementDataFile = LOCAL\n" + data;
}

/// As NRRD, with the axes and kinds given.
std::string Nrrd(const std::string& sizes, const std::string& kinds, const Fields& changes = {}, const std::string& keys = "",
                 const std::string& data = Bytes(24))
{
  Fields fields{{"type", "unsigned char"},
                {"dimension", std::to_string(std::count(kinds.begin(), kinds.end(), ' ') + 1)},
                {"sizes", sizes},
                {"kinds", kinds},
                {"encoding", "raw"}};
  for (const auto& [field, value] : changes)
    fields[field] = value;
  std::string text = "NRRD0004\n";
  for (const auto& [field, value] : fields)
    text += field + ": " + value + "\n";
  return text + keys + "\n" + data;
}

std::string Read(SequenceFile& file, int index)
{
  std::string pixels(file.Content().FrameBytes(), '\0');
  file.ReadFrame(index, pixels.data());
  return pixels;
}

bool HasNote(const SequenceContent& content, const std::string& words)
{
  return std::any_of(content.notes.begin(), content.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

/// The largest memory of this process while it lives, beyond what there was at first.
class MemoryPeak {
public:
  MemoryPeak()
  {
    std::ofstream("/proc/self/clear_refs") << "5"; // the peak is what is there now
    before_ = Now();
  }
  long Kilobytes() const { return Now() - before_; }

private:
  static long Now()
  {
    std::ifstream stream("/proc/self/status");
    std::string word;
    long kilobytes = -1;
    while (stream >> word)
      if (word == "VmHWM:" && stream >> kilobytes)
        break;
    return kilobytes;
  }
  long before_ = 0;
};

class SequenceFileTest : public TemporaryFolder {
protected:
  void Refused(const std::string& name, const std::string& content, const std::string& words) const
  {
    const std::string path = Put(name, content);
    const auto read = [&] {
      SequenceFile file(path);
      for (int i = 0; i < file.Content().frames; ++i)
        Read(file, i);
    };
    ExpectRefused(read, Error::Kind::BadFile, path, words);
  }
};

} // namespace

TEST_F(SequenceFileTest, WhatPlusWritesIsRead)
{
  SequenceFile file(Put("a.igs.mha", Meta({}, "Seq_Frame0000_ProbeToTrackerTransform = 0.5 -8.43482e-005 0 10 0 1 0 20 0 0 1 "
                                              "30 -0 0 -0 1 \n"
                                              "Seq_Frame0000_ProbeToTrackerTransformStatus = OK\n"
                                              "Seq_Frame0000_Timestamp = 12.25\n"
                                              "Seq_Frame0000_FrameNumber = 332203\n"
                                              "Seq_Frame0000_ImageStatus = OK\n"
                                              "CustomField = some text\n"
                                              "Seq_Frame0001_ProbeToTrackerTransform = " +
                                                  Still +
                                                  "\n"
                                                  "Seq_Frame0001_ProbeToTrackerTransformStatus = OUT_OF_VIEW\n"
                                                  "Seq_Frame0001_Timestamp = 12.5\n"
                                                  "Seq_Frame0001_ImageStatus = INVALID\n"
                                                  "Seq_Frame0002_ProbeToTrackerTransform = " +
                                                  Still + "\n")));
  const SequenceContent& content = file.Content();
  EXPECT_EQ(content.dimensions, (std::array<int, 3>{4, 2, 1}));
  EXPECT_EQ(content.frames, 3);
  EXPECT_EQ(content.orientation, "MF");
  EXPECT_EQ(content.imageType, "BRIGHTNESS");
  EXPECT_EQ(content.transforms, std::vector<std::string>{"ProbeToTracker"});
  EXPECT_EQ(content.fields, (std::vector<HeaderField>{{"CustomField", "some text"}}));
  EXPECT_TRUE(HasNote(content, "ProbeToTrackerTransform is valid in 2 of 3 frames"));
  EXPECT_TRUE(HasNote(content, "the image is marked as not valid in frame 1"));

  const SequenceFrame first = file.Frame(0), second = file.Frame(1), third = file.Frame(2);
  EXPECT_EQ(first.time, 12.25);
  EXPECT_TRUE(first.imageValid);
  EXPECT_EQ(first.fields, (std::vector<HeaderField>{{"FrameNumber", "332203"}}));
  ASSERT_EQ(first.transforms.size(), 1u);
  Eigen::Matrix4d matrix;
  matrix << 0.5, -8.43482e-005, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1;
  EXPECT_EQ(first.transforms[0].matrix.matrix(), matrix);
  EXPECT_EQ(first.transforms[0].status, TransformStatus::Valid);
  EXPECT_EQ(second.transforms[0].status, TransformStatus::OutOfRange);
  EXPECT_EQ(second.transforms[0].statusText, "OUT_OF_VIEW");
  EXPECT_FALSE(second.imageValid);
  EXPECT_TRUE(third.imageValid);
  EXPECT_TRUE(std::isnan(third.time));
  EXPECT_EQ(third.transforms[0].status, TransformStatus::Valid); // without a status
  EXPECT_EQ(third.Find("ProbeToTracker"), &third.transforms[0]);
  EXPECT_EQ(third.Find("StylusToTracker"), nullptr);
  for (const int i : {2, 0, 1})
    EXPECT_EQ(Read(file, i), Bytes(24).substr(static_cast<std::size_t>(8 * i), 8));
  EXPECT_TRUE(LooksLikeSequence(content.path));
}

TEST_F(SequenceFileTest, FieldsComeInAnyOrderAndNumbersInAnyLength)
{
  // Before the sizes are known, backwards, with more and fewer digits, and one of them twice.
  const std::string text = "Seq_Frame0002_Timestamp = 3\nSeq_Frame00000001_Timestamp = 2\nSeq_Frame0_Timestamp = 1\n"
                           "Seq_Frame0002_AToBTransformStatus = INVALID\nSeq_Frame0001_AToBTransform = " +
                           Still + "\nSeq_Frame0002_AToBTransform = " + Still + "\nSeq_Frame0002_Timestamp = 3.0\n";
  SequenceFile file(Put("a.mha", text + Meta()));
  EXPECT_EQ(file.Time(0), 1.0);
  EXPECT_EQ(file.Time(1), 2.0);
  EXPECT_EQ(file.Time(2), 3.0);
  EXPECT_TRUE(file.Frame(0).transforms.empty());
  EXPECT_EQ(file.Frame(1).transforms.at(0).status, TransformStatus::Valid);
  EXPECT_EQ(file.Frame(2).transforms.at(0).status, TransformStatus::Missing);
  EXPECT_TRUE(HasNote(file.Content(), "AToBTransform is valid in 1 of 3 frames"));

  std::string many;
  for (int i = 0; i < 20000; ++i)
    many += "Seq_Frame" + std::string(i < 1000 ? 4 - std::to_string(i).size() : 0, '0') + std::to_string(i) +
            "_Timestamp = " + std::to_string(i) + ".5\n";
  SequenceFile large(Put("b.mha", Meta({{"DimSize", "1 1 20000"}}, many, std::string(20000, 'x'))));
  EXPECT_EQ(large.Time(10000), 10000.5);
  EXPECT_EQ(large.Time(19999), 19999.5);
}

TEST_F(SequenceFileTest, EveryOrientationIsTurnedToMF)
{
  const std::array<int, 3> n{4, 3, 2};
  const std::string letters = "MUFNAD";
  int codes = 0;
  const auto check = [&](const std::string& code, const std::string& axes, const std::string& name) {
    std::array<int, 3> size{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      size[letters.find(axes[axis]) / 2] = n[axis];
    std::vector<std::uint16_t> data(24), expected(24);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          const std::array<int, 3> inFile{i, j, k};
          std::array<int, 3> at{};
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t letter = letters.find(axes[axis]);
            at[letter / 2] = letter % 2 == 0 ? inFile[axis] : n[axis] - 1 - inFile[axis];
          }
          const std::uint16_t value = static_cast<std::uint16_t>(1000 + 24 * i + 7 * j + k);
          data[static_cast<std::size_t>(i + n[0] * (j + n[1] * k))] = value;
          expected[static_cast<std::size_t>(at[0] + size[0] * (at[1] + size[1] * at[2]))] = value;
        }
    const std::string raw(reinterpret_cast<const char*>(data.data()), 48);
    SequenceFile file(Put(name, Meta({{"NDims", "4"},
                                      {"DimSize", "4 3 2 1"},
                                      {"Kinds", "domain domain domain list"},
                                      {"ElementSpacing", "0.5 0.25 2 1"},
                                      {"Offset", "0 0 0 0"},
                                      {"TransformMatrix", Still},
                                      {"ElementType", "MET_USHORT"},
                                      {"UltrasoundImageOrientation", code}},
                                     "", raw)));
    EXPECT_EQ(file.Content().dimensions, size) << code;
    EXPECT_EQ(Read(file, 0), std::string(reinterpret_cast<const char*>(expected.data()), 48)) << code;
    EXPECT_EQ(HasNote(file.Content(), "turned from " + code + " to MF"), axes != "MFA") << code;
    ++codes;
  };
  for (const char a : letters)
    for (const char b : letters)
      for (const char c : letters) {
        const std::string code{a, b, c};
        const auto axis = [&](char letter) { return letters.find(letter) / 2; };
        if (axis(a) != axis(b) && axis(a) != axis(c) && axis(b) != axis(c))
          check(code, code, "a.mha");
        else if (c == 'M')
          Refused("a.mha", Meta({{"UltrasoundImageOrientation", code}}), "\"" + code + "\"");
      }
  // Two letters mean the third that makes them right-handed; these are Plus's own equivalents.
  for (const auto& [two, three] : Fields{{"MF", "MFA"}, {"MN", "MND"}, {"UF", "UFD"}, {"UN", "UNA"}})
    check(two, three, "b.mha");
  // And those that it has no word for: x cross y of the letters.
  for (const auto& [two, three] : Fields{{"FM", "FMD"}, {"NU", "NUD"}, {"FU", "FUA"}, {"NM", "NMA"}})
    check(two, three, "c.mha");
  EXPECT_EQ(codes, 56);
}

TEST_F(SequenceFileTest, FlatFramesAreTurnedInTheirPlane)
{
  const auto turned = [&](const std::string& code) {
    SequenceFile file(Put("a.mha", Meta({{"UltrasoundImageOrientation", code}}, "", "abcdefgh" + std::string(16, 'x'))));
    return std::to_string(file.Content().dimensions[0]) + Read(file, 0);
  };
  EXPECT_EQ(turned("MF"), "4abcdefgh");
  EXPECT_EQ(turned("mfa"), "4abcdefgh");
  EXPECT_EQ(turned("MFD"), "4abcdefgh"); // one slice is not turned
  EXPECT_EQ(turned("UF"), "4dcbahgfe");
  EXPECT_EQ(turned("MN"), "4efghabcd");
  EXPECT_EQ(turned("UN"), "4hgfedcba");
  EXPECT_EQ(turned("FM"), "2aebfcgdh"); // a line after the other
  EXPECT_EQ(turned("NU"), "2hdgcfbea");
  EXPECT_EQ(turned("XX"), "4abcdefgh");
  EXPECT_EQ(turned(""), "4abcdefgh");
  for (const char* code : {"M", "MFAA", "MM", "MX", "RAI", "UltrasoundImageOrientation"})
    Refused("b.mha", Meta({{"UltrasoundImageOrientation", code}}), "orientation");
  SequenceFile unnamed(
      Put("c.mha", Meta({{"UltrasoundImageOrientation", ""}}, "Seq_Frame0000_ImageToReferenceTransform = " + Still + "\n")));
  EXPECT_TRUE(HasNote(unnamed.Content(), "MF was assumed"));
  // Pairs of numbers along a line must not change their order.
  Refused("d.mha", Meta({{"UltrasoundImageOrientation", "NM"}, {"UltrasoundImageType", "RF_IQ_LINE"}}), "pairs");
  EXPECT_TRUE(HasNote(SequenceFile(Put("e.mha", Meta({{"UltrasoundImageType", "RF_REAL"}}))).Content(), "RF_REAL"));
}

TEST_F(SequenceFileTest, WhatSlicerWritesIsRead)
{
  // Frames along the last axis, of one slice or flat.
  const std::string keys = "ultrasound image orientation:=UF\nultrasound image type:=BRIGHTNESS\n"
                           "Seq_Frame0001_ProbeToTrackerTransform:=" +
                           Still + "\nSeq_Frame0001_Status:=INVALID\nSeq_Frame0002_Timestamp:=7\nSomething:=else\n";
  for (const auto& [sizes, kinds, directions] :
       {std::tuple{"4 2 3", "domain domain list", "(1,0) (0,1) none"},
        std::tuple{"4 2 1 3", "domain domain domain time", "(1,0,0) (0,1,0) (0,0,1) none"}}) {
    SequenceFile file(Put("a.seq.nrrd", Nrrd(sizes, kinds, {{"space directions", directions}}, keys)));
    EXPECT_EQ(file.Content().dimensions, (std::array<int, 3>{4, 2, 1}));
    EXPECT_EQ(file.Content().frames, 3);
    EXPECT_EQ(file.Content().orientation, "UF");
    EXPECT_EQ(file.Content().fields, (std::vector<HeaderField>{{"Something", "else"}}));
    EXPECT_FALSE(file.Frame(1).imageValid);
    EXPECT_EQ(file.Frame(1).transforms.at(0).name, "ProbeToTracker");
    EXPECT_EQ(file.Time(2), 7.0);
    EXPECT_EQ(Read(file, 1), "\x0c\x0b\x0a\x09\x10\x0f\x0e\x0d");
    EXPECT_TRUE(LooksLikeSequence(file.Content().path));
  }
  // Volumes over time: no transforms, a pose in the header. The frames may be interleaved.
  const std::string space = "left-posterior-superior", directions = "(0,2,0) (-2,0,0) (0,0,3)";
  SequenceFile last(
      Put("b.seq.nrrd", Nrrd("2 2 2 3", "domain domain domain list",
                             {{"space", space}, {"space origin", "(5,6,7)"}, {"space directions", directions + " none"}})));
  SequenceFile first(
      Put("c.seq.nrrd", Nrrd("3 2 2 2", "list domain domain domain",
                             {{"space", space}, {"space origin", "(5,6,7)"}, {"space directions", "none " + directions}})));
  for (SequenceFile* file : {&last, &first}) {
    EXPECT_EQ(file->Content().dimensions, (std::array<int, 3>{2, 2, 2}));
    EXPECT_EQ(file->Content().frames, 3);
    EXPECT_EQ(file->Content().geometry.origin, Eigen::Vector3d(5, 6, 7));
    EXPECT_EQ(file->Content().geometry.spacing, Eigen::Vector3d(2, 2, 3));
    EXPECT_EQ(file->Content().geometry.direction.col(0), Eigen::Vector3d(0, 1, 0));
  }
  EXPECT_EQ(Read(last, 2), Bytes(24).substr(16));
  EXPECT_EQ(Read(first, 2), "\x03\x06\x09\x0c\x0f\x12\x15\x18");
  EXPECT_EQ(Read(first, 0), "\x01\x04\x07\x0a\x0d\x10\x13\x16");
  // Colours.
  SequenceFile colour(
      Put("d.seq.nrrd", Nrrd("3 2 2 2", "vector domain domain list", {{"space directions", "none (1,0) (0,1) none"}})));
  EXPECT_EQ(colour.Content().components, 3u);
  EXPECT_EQ(Read(colour, 1), Bytes(24).substr(12));

  EXPECT_FALSE(LooksLikeSequence(Put("e.nrrd", Nrrd("2 3 4", "domain domain domain"))));
  EXPECT_FALSE(LooksLikeSequence(Put("e.mha", Meta({{"Kinds", ""}}))));
  EXPECT_FALSE(LooksLikeSequence(Put("e.txt", "nothing")));
  EXPECT_FALSE(LooksLikeSequence(Path("missing.mha")));
}

TEST_F(SequenceFileTest, RecordingsOfTrackersAloneHaveNoImages)
{
  const Fields empty{{"DimSize", "0 0 2              "}, {"ElementType", "MET_OTHER"}, {"UltrasoundImageOrientation", "XX"}};
  SequenceFile file(Put("a.igs.mha", Meta(empty, "Seq_Frame0001_StylusToTrackerTransform = " + Still + "\n", "")));
  EXPECT_FALSE(file.Content().HasImages());
  EXPECT_EQ(file.Content().frames, 2);
  EXPECT_EQ(file.Content().FrameBytes(), 0u);
  EXPECT_FALSE(file.Frame(1).imageValid);
  EXPECT_EQ(file.Frame(1).transforms.size(), 1u);
  char nothing;
  ExpectRefused([&] { file.ReadFrame(0, &nothing); }, Error::Kind::InvalidParameter, "a.igs.mha", "no images");
  Refused("b.mha", Meta({{"DimSize", "0 0 2000000000"}, {"ElementType", "MET_OTHER"}}, "", ""), "more than the bytes");
  Refused("b.mha", Meta({{"DimSize", "0 0 0"}, {"ElementType", "MET_OTHER"}}, "", ""), "no frames");
}

TEST_F(SequenceFileTest, MatricesThatCannotBeUsedAreMarkedInvalid)
{
  const auto fault = [&](const std::string& matrix, const std::string& status = "OK") {
    SequenceFile file(Put("a.mha", Meta({}, "Seq_Frame0001_AToBTransform = " + matrix + "\nSeq_Frame0001_AToBTransformStatus = " +
                                                status + "\nSeq_Frame0002_AToBTransform = " + Still + "\n")));
    const SequenceTransform transform = file.Frame(1).transforms.at(0);
    EXPECT_EQ(file.Frame(2).transforms.at(0).status, TransformStatus::Valid);
    EXPECT_NE(transform.status, TransformStatus::Valid) << matrix;
    EXPECT_TRUE(transform.matrix.matrix().allFinite());
    EXPECT_TRUE(HasNote(file.Content(), "AToBTransform was taken as INVALID in frame 1: ")) << matrix;
    return file.Content().notes.at(0) + " [" + transform.statusText + "]";
  };
  for (const char* matrix :
       {"", "1 2 3", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0", "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
        "1 0 0 inf 0 1 0 0 0 0 1 0 0 0 0 1", "1 0 0 1e999 0 1 0 0 0 0 1 0 0 0 0 1", "1 0 0 -1.#IND 0 1 0 0 0 0 1 0 0 0 0 1"})
    EXPECT_NE(fault(matrix).find("16 finite numbers [INVALID]"), std::string::npos) << matrix;
  EXPECT_NE(fault("0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1").find("singular"), std::string::npos);
  EXPECT_NE(fault("1 0 1 0 0 1 1 0 0 0 0 0 0 0 0 1").find("singular"), std::string::npos);
  EXPECT_NE(fault("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0.1 1").find("last row"), std::string::npos);
  EXPECT_NE(fault("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2").find("last row"), std::string::npos);
  EXPECT_NE(fault("nan", "MISSING").find("[MISSING]"), std::string::npos); // what the file says is kept
  // Scales may be small (micrometres a pixel) or large.
  SequenceFile small(Put("b.mha", Meta({}, "Seq_Frame0000_AToBTransform = 1e-8 0 0 0 0 1e-8 0 0 0 0 1e-3 0 1e-15 0 0 1\n")));
  EXPECT_EQ(small.Frame(0).transforms.at(0).status, TransformStatus::Valid);
  // One note for any number of frames; and times that are none.
  std::string all;
  for (const char* frame : {"0", "1", "2"})
    all += std::string("Seq_Frame000") + frame + "_AToBTransform = nan\nSeq_Frame000" + frame + "_Timestamp = never\n";
  SequenceFile bad(Put("c.mha", Meta({}, all)));
  EXPECT_TRUE(HasNote(bad.Content(), "in frame 0 and 2 more"));
  EXPECT_EQ(bad.Content().notes.size(), 3u);
  EXPECT_TRUE(HasNote(bad.Content(), "the time is not a finite number in frame 0 and 2 more"));
  EXPECT_TRUE(std::isnan(bad.Time(1)));
  // A name that is none of a transform stays a field.
  SequenceFile odd(Put("d.mha", Meta({}, "Seq_Frame0000_ProbeTransform = 1 2 3\n")));
  EXPECT_EQ(odd.Frame(0).fields, (std::vector<HeaderField>{{"ProbeTransform", "1 2 3"}}));
}

TEST_F(SequenceFileTest, EffortGrowsWithTheNumberOfTransformsOfAFrame)
{
  const auto put = [this](int transforms) {
    std::string matrices, statuses;
    for (int i = 0; i < transforms; ++i) {
      const std::string key = "Seq_Frame0000_A" + std::to_string(i) + "ToBTransform";
      matrices += key + " = " + Still + "\n";
      statuses += key + "Status = " + (i % 4 == 1 ? "MISSING" : "OK") + "\n";
    }
    return Put(std::to_string(transforms) + ".mha",
               Meta({{"DimSize", "0 0 1"}, {"ElementType", "MET_OTHER"}}, matrices + statuses, ""));
  };
  const std::string few = put(1000), many = put(32000);
  const auto open = [](const std::string& path) { return ProcessorSeconds([&] { SequenceFile file(path); }); };
  EXPECT_LT(open(many), 400 * open(few)); // 32 times as many must not cost 1024 times the effort
  const SequenceFile fewFile(few), manyFile(many);
  const auto frame = [](const SequenceFile& file) { return ProcessorSeconds([&] { file.Frame(0); }); };
  EXPECT_LT(frame(manyFile), 400 * frame(fewFile));
  const SequenceFrame there = manyFile.Frame(0);
  ASSERT_EQ(there.transforms.size(), 32000u);
  for (std::size_t i = 0; i < 32000; ++i)
    ASSERT_EQ(there.transforms[i].status, i % 4 == 1 ? TransformStatus::Missing : TransformStatus::Valid) << i;
}

TEST_F(SequenceFileTest, NotesCountTheFramesThatATransformIsValidIn)
{
  // Said before and after the matrix, in frames in any order; a status without a matrix, and one that comes again.
  const std::string a = "_AToBTransform = " + Still + "\n", b = "_CToBTransform = " + Still + "\n",
                    bad = "TransformStatus = INVALID\n", good = "TransformStatus = OK\n";
  const SequenceFile file(
      Put("a.mha", Meta({}, "Seq_Frame0002" + a + "Seq_Frame0000_AToB" + bad + "Seq_Frame0000" + a + "Seq_Frame0000" + b +
                                "Seq_Frame0001" + b + "Seq_Frame0001_AToB" + bad + "Seq_Frame0001_CToB" + good + "Seq_Frame0002" +
                                b + "Seq_Frame0002_AToB" + good + "Seq_Frame0002_CToB" + bad + "Seq_Frame0002_CToB" + bad)));
  EXPECT_TRUE(HasNote(file.Content(), "AToBTransform is valid in 1 of 3 frames"));
  EXPECT_TRUE(HasNote(file.Content(), "CToBTransform is valid in 2 of 3 frames"));
}

TEST_F(SequenceFileTest, NamesOfSequences)
{
  for (const char* name : {"a.igs.mha", "a.seq.mha", "/some/where.x/a.b.IGS.MHD", "a.seq.nrrd", "a.Seq.Nhdr"})
    EXPECT_TRUE(NamesSequence(name)) << name;
  for (const char* name : {"a.mha", "igs.mha", "a.igs", "a.igs.vti", "a.seq.nii", "a.seq.mha.txt", "a.seq/b.mha", "", ".igs.x"})
    EXPECT_FALSE(NamesSequence(name)) << name;
}

TEST_F(SequenceFileTest, FilesThatLieAreRefused)
{
  Refused("a.mha", Meta({}, "", Bytes(23)), "truncated");
  Refused("a.mha", Meta({}, "", Bytes(25)), "dimensions or the type are wrong");
  Refused("a.mha", Meta({{"DimSize", "4 2 4"}}), "truncated");
  Refused("a.mha", Meta({{"DimSize", "4 2 0"}}), "no frames");
  Refused("a.mha", Meta({{"DimSize", "4 2 -3"}}), "DimSize");
  Refused("a.mha", Meta({{"DimSize", "4 2"}}), "DimSize");
  Refused("a.mha", Meta({{"DimSize", "2147483647 2147483647 2147483647"}}), "more than the bytes");
  Refused("a.mha", Meta({{"DimSize", "2147483647 2147483647 3"}}), "truncated");
  Refused("a.mha", Meta({{"DimSize", "2147483648 2 3"}}), "DimSize");
  Refused("a.mha", Meta({{"Kinds", "list domain domain"}}), "last of 3 axes");
  Refused("a.mha", Meta({{"Kinds", "domain list"}}), "last of 3 axes");
  Refused("a.mha", Meta({{"NDims", "5"}}), "5 dimensions");
  Refused("a.mha", Meta({{"BinaryData", "False"}}), "text");
  Refused("a.mha", Meta({{"ElementType", "MET_OTHER"}}), "not supported");
  Refused("a.mha", Meta({{"ElementSpacing", "1 0 1"}}), "spacing");
  Refused("a.mha", Meta({{"CompressedData", "True"}}), "damaged");
  Refused("a.mha", Meta({{"CompressedData", "True"}, {"DimSize", "400 200 3"}}), "more than");
  Refused("a.mha", Meta({{"ObjectType", "Mesh"}}), "Mesh");
  Refused("a.mha", Meta().substr(0, 200), "truncated");
  Refused("a.mha", "nothing of the kind", "neither");
  for (const char* frame : {"3", "0003", "4", "999999999", "2147483648", "99999999999999999999999"})
    Refused("a.mha", Meta({}, "Seq_Frame" + std::string(frame) + "_Timestamp = 1\n"), "frame");
  for (const char* key : {"Seq_Frame", "Seq_Frame0000", "Seq_Frame0000_", "Seq_Frame_Timestamp", "Seq_Frame-1_Timestamp",
                          "Seq_FrameX_Timestamp", "Seq_Frame 1_Timestamp", "Seq_Frame0x1_Timestamp"})
    Refused("a.mha", Meta({}, std::string(key) + " = 1\n"), "not the field of a frame");
  Refused("a.mha", Meta({}, "Seq_Frame0001_Timestamp = 1\nSeq_Frame0001_Timestamp = 2\n"),
          "Timestamp is given twice for frame 1");
  Refused("a.mha", Meta({}, "Seq_Frame0001_Note = a\nSeq_Frame0002_Note = b\nSeq_Frame0001_Note = c\n"), "Note is given twice");
  Refused(
      "a.mha",
      Meta({}, "Seq_Frame0001_AToBTransform = " + Still + "\nSeq_Frame0001_AToBTransform = 2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"),
      "AToBTransform is given twice");

  const std::string list = "domain domain list";
  Refused("a.nrrd", Nrrd("4 3 2", "domain list domain"), "first or the last");
  Refused("a.nrrd", Nrrd("4 2 3 7", list, {{"dimension", "4"}}), "first or the last");
  Refused("a.nrrd", Nrrd("4 2 4", list), "truncated");
  Refused("a.nrrd", Nrrd("4 2 2", list), "dimensions or the type are wrong");
  Refused("a.nrrd", Nrrd("4 2 3", list, {{"encoding", "ascii"}}), "text");
  Refused("a.nrrd",
          Nrrd("3 2 2 2 1", "list vector domain domain domain", {{"space directions", "none none (1,0,0) (0,1,0) (0,0,1)"}}),
          "interleaved");
  Refused("a.nrrd", Nrrd("4 2 3", list, {}, "Seq_Frame0007_Timestamp:=1\n"), "frame 7");

  ExpectRefused([&] { SequenceFile file(Path("missing.mha")); }, Error::Kind::FileSystem, "missing.mha", "no such file");
  Put("b.mhd", "NDims = 3\nDimSize = 4 2 3\nElementType = MET_UCHAR\nElementDataFile = gone.raw\n");
  ExpectRefused([&] { SequenceFile file(Path("b.mhd")); }, Error::Kind::FileSystem, "gone.raw", "no such file");
  SequenceFile good(Put("c.mha", Meta()));
  for (const int index : {-1, 3}) {
    ExpectRefused([&] { good.Frame(index); }, Error::Kind::InvalidParameter, "c.mha", "no frame");
    ExpectRefused([&] { Read(good, index); }, Error::Kind::InvalidParameter, "c.mha", "no frame");
  }
}

TEST_F(SequenceFileTest, CompressedFramesComeInAnyOrder)
{
  // 301 frames of 256 kB: more moments of the decoder than are kept, so that every second is dropped.
  const int count = 301;
  std::stringstream packed;
  Deflater deflater(packed, CompressedForm::Zlib);
  std::vector<std::uint32_t> frame(1 << 16);
  for (int i = 0; i < count; ++i) {
    std::fill(frame.begin(), frame.end(), static_cast<std::uint32_t>(i));
    deflater.Append(frame.data(), frame.size() * 4);
  }
  deflater.Finish();
  // What the header says of the compressed size plays no role.
  const Fields changes{{"CompressedData", "True\nCompressedDataSize = 99999999999999999"},
                       {"DimSize", "256 256 301"},
                       {"ElementType", "MET_UINT"}};
  const std::string path = Put("a.igs.mha", Meta(changes, "", packed.str()));
  SequenceFile file(path);
  const auto right = [&](SequenceFile& from, int i) {
    from.ReadFrame(i, frame.data());
    return std::all_of(frame.begin(), frame.end(), [i](std::uint32_t v) { return v == static_cast<std::uint32_t>(i); });
  };
  EXPECT_TRUE(right(file, 300));
  const MemoryPeak peak;
  Random random(3);
  for (int i = 0; i < 100; ++i)
    EXPECT_TRUE(right(file, static_cast<int>(random.Below(count))));
  EXPECT_LT(peak.Kilobytes(), 30000);
  // Stopping on request, or damage, does not spoil what comes after.
  SequenceFile second(path);
  const Progress stop([](double) { return false; });
  EXPECT_THROW(second.ReadFrame(200, frame.data(), stop), Error);
  EXPECT_TRUE(right(second, 1));
  const std::string whole = packed.str();
  SequenceFile cut(Put("b.igs.mha", Meta(changes, "", whole.substr(0, whole.size() - 2))));
  EXPECT_TRUE(right(cut, 299));
  ExpectRefused([&] { cut.ReadFrame(300, frame.data()); }, Error::Kind::BadFile, cut.Content().path, "end early");
  EXPECT_TRUE(right(cut, 298));
  Fields more = changes;
  more["DimSize"] = "256 256 300";
  SequenceFile fewer(Put("c.igs.mha", Meta(more, "", whole)));
  ExpectRefused([&] { fewer.ReadFrame(299, frame.data()); }, Error::Kind::BadFile, fewer.Content().path, "more than");
}

TEST_F(SequenceFileTest, LargeNumbersHaveTheirBytesSwapped)
{
  SequenceFile file(
      Put("a.mha", Meta({{"ElementType", "MET_USHORT"}, {"BinaryDataByteOrderMSB", "True"}, {"DimSize", "2 2 3"}})));
  const std::string pixels = Read(file, 1);
  const std::uint16_t expected[] = {0x090a, 0x0b0c, 0x0d0e, 0x0f10};
  EXPECT_EQ(std::memcmp(pixels.data(), expected, 8), 0);
}

TEST_F(SequenceFileTest, FourGigabytesNeedNoMemory)
{
  // A sparse file: 4096 frames of 1 MB, of which only the last has bytes on the disk.
  const std::string path = Put("a.igs.mha", Meta({{"DimSize", "1024 1024 4096"}}, "", ""));
  const std::uintmax_t header = std::filesystem::file_size(path), bytes = std::uintmax_t{4096} << 20;
  std::error_code error;
  std::filesystem::resize_file(path, header + bytes, error);
  if (error)
    GTEST_SKIP() << "the disk holds no sparse files of 4 GB: " << error.message();
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary).seekp(static_cast<std::streamoff>(header + bytes - 1))
      << 'z';
  std::string pixels(1 << 20, 'x');
  const MemoryPeak peak;
  SequenceFile file(path);
  file.ReadFrame(4095, pixels.data());
  EXPECT_EQ(pixels[0], '\0');
  EXPECT_EQ(pixels.back(), 'z');
  EXPECT_LT(peak.Kilobytes(), 4000);
}

TEST_F(SequenceFileTest, RealRecordings)
{
  const std::string data = std::string(ECHORAMA_SOURCE_DIR) + "/../shared/data/";
  if (!std::filesystem::exists(data + "plus/SpinePhantomFreehand.igs.mha"))
    GTEST_SKIP() << "the real data are not there: " << data;
  struct Case {
    const char* name;
    std::array<int, 3> dimensions;
    int frames;
    std::map<std::string, int> valid; // frames in which each transform is
    double firstTime, lastTime;
  };
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::array<int, 3> none2{0, 0, 1}, plus{820, 616, 1};
  const std::vector<Case> cases = {
      {"plus/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha",
       none2,
       1000,
       {{"ReferenceToTracker", 1000}, {"StylusToTracker", 1000}},
       280.4611428572264,
       347.0668714287492},
      {"plus/NwirePhantomFreehand.igs.mha",
       plus,
       97,
       {{"ProbeToTracker", 97}, {"ReferenceToTracker", 97}, {"StylusToTracker", 0}},
       345.627957,
       355.783014},
      {"plus/SpinePhantomFreehand.igs.mha",
       plus,
       21,
       {{"ProbeToTracker", 21}, {"ReferenceToTracker", 21}, {"StylusToTracker", 21}},
       215.102186,
       216.947186},
      {"plus/USTC_3NWires_ProbeRotation.igs.mha",
       plus,
       142,
       {{"ProbeToStepperHome", 142}, {"StepperEncoderValuesToStepperHome", 142}, {"TemplateToStepperHome", 142}},
       318.878296,
       338.059766},
      {"plus/UltrasonixCurvilinearScanConvertedData.igs.mha", plus, 5, {}, 98.0, 99.04},
      {"plus/WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha",
       none2,
       801,
       {{"ProbeToTracker", 801}, {"ReferenceToTracker", 801}, {"StylusToTracker", 801}},
       7415.679586,
       7436.385229},
      {"plus/fCal_Test_Calibration_3NWires_fCal2.0.igs.mha",
       plus,
       190,
       {{"ProbeToTracker", 190}, {"ReferenceToTracker", 190}, {"StylusToTracker", 190}},
       2572.905343,
       2588.069843},
      {"liver/liver_sweep.igs.mha", {739, 593, 1}, 140, {{"ImageToReference", 140}}, none, none}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    SequenceFile file(data + c.name);
    const SequenceContent& content = file.Content();
    EXPECT_EQ(content.dimensions, c.dimensions);
    ASSERT_EQ(content.frames, c.frames);
    std::map<std::string, int> valid;
    for (const std::string& name : content.transforms)
      valid[name] = 0;
    for (int i = 0; i < content.frames; ++i)
      for (const SequenceTransform& transform : file.Frame(i).transforms)
        valid[transform.name] += transform.status == TransformStatus::Valid;
    EXPECT_EQ(valid, c.valid);
    if (std::isnan(c.firstTime))
      EXPECT_TRUE(std::isnan(file.Time(0)));
    else {
      EXPECT_EQ(file.Time(0), c.firstTime);
      EXPECT_EQ(file.Time(c.frames - 1), c.lastTime);
    }
    if (!content.HasImages())
      continue;

    // Some frames against the whole file in one piece, by zlib itself.
    std::ifstream stream(data + c.name, std::ios::binary);
    std::string all((std::istreambuf_iterator<char>(stream)), {}), mark = "ElementDataFile = LOCAL\n";
    const std::size_t begin = all.find(mark) + mark.size();
    const std::uint64_t bytes = content.FrameBytes();
    std::string pixels(bytes * static_cast<std::uint64_t>(c.frames), '\0');
    uLongf size = pixels.size();
    if (all.find("CompressedData = True") < begin)
      ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(pixels.data()), &size, reinterpret_cast<const Bytef*>(all.data()) + begin,
                           all.size() - begin),
                Z_OK);
    else
      pixels = all.substr(begin);
    for (const int i : {0, c.frames - 1, c.frames / 2, 1})
      EXPECT_TRUE(Read(file, i) == pixels.substr(static_cast<std::size_t>(i) * bytes, bytes)) << "frame " << i;
  }
  SequenceFile liver(data + "liver/liver_sweep.igs.mha");
  Eigen::Matrix4d last;
  last << 0.311917222, 0.0135013939, 0.128463131, -166.647486, -0.0340197911, 0.258813366, 0.558986146, -79.1159335,
      -0.0257008819, -0.17872769, 0.819165266, 136.817761, 0, 0, 0, 1;
  EXPECT_EQ(liver.Frame(139).transforms.at(0).matrix.matrix(), last);
  SequenceFile wires(data + "plus/NwirePhantomFreehand.igs.mha");
  EXPECT_EQ(wires.Frame(0).Find("StylusToTracker")->matrix(0, 1), -8.43482e-005);
  EXPECT_EQ(wires.Frame(0).Find("StylusToTracker")->statusText, "INVALID");
}
