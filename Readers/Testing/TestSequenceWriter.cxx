// SPDX-License-Identifier: BSD-3-Clause
// What is written comes back: pixels, matrices and times to the last bit. What cannot be written leaves nothing behind.
#include "Core/Base/Random.h"
#include "Readers/SequenceWriter.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>

using namespace echorama;
using namespace echorama::testing;

namespace {

class SequenceWriterTest : public TemporaryFolder {
protected:
  void Write(const std::string& path, const SequenceContent& content, bool compress, const std::vector<SequenceFrame>& frames,
             const std::vector<std::string>& pixels) const
  {
    FileReplacement files;
    SequenceWriter writer(path, content, compress, files);
    for (std::size_t i = 0; i < frames.size(); ++i)
      writer.Append(frames[i], i < pixels.size() && !pixels[i].empty() ? pixels[i].data() : nullptr);
    writer.Finish();
    files.Commit();
  }
};

SequenceTransform RandomTransform(Random& random, const std::string& name, const std::string& status)
{
  SequenceTransform transform;
  transform.name = name;
  for (Eigen::Index i = 0; i < 12; ++i)
    transform.matrix.matrix()(i % 3, i / 3) = random.Normal() * std::pow(10.0, random.Uniform(-8.0, 4.0));
  transform.statusText = status;
  transform.status = TransformStatusOf(status);
  return transform;
}

std::vector<SequenceFrame> SomeFrames(int count)
{
  Random random(8);
  std::vector<SequenceFrame> frames(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    SequenceFrame& frame = frames[static_cast<std::size_t>(i)];
    frame.time = 1000.0 + i / 3.0;
    frame.imageValid = i != 2;
    frame.transforms.push_back(RandomTransform(random, "ProbeToTracker", i % 3 == 1 ? "OUT_OF_VIEW" : "OK"));
    if (i != 1)
      frame.transforms.push_back(RandomTransform(random, "ReferenceToTracker", i == 0 ? "REQ_TIMEOUT" : "OK"));
    frame.fields = {{"FrameNumber", std::to_string(77 + i)}, {"Remark", "a = b: \\n c"}};
  }
  frames[3].time = std::numeric_limits<double>::quiet_NaN();
  return frames;
}

} // namespace

TEST_F(SequenceWriterTest, EverythingComesBack)
{
  struct Case {
    std::array<int, 3> dimensions;
    VoxelType type;
    std::uint64_t components;
  };
  const std::vector<SequenceFrame> frames = SomeFrames(5);
  for (const Case& c :
       {Case{{7, 5, 1}, VoxelType::UInt8, 1}, Case{{7, 5, 1}, VoxelType::Int16, 1}, Case{{3, 2, 4}, VoxelType::Float32, 1},
        Case{{4, 4, 1}, VoxelType::UInt8, 3}, Case{{1, 1, 1}, VoxelType::Float64, 1}})
    for (const char* name : {"a.igs.mha", "a.mhd", "a.seq.nrrd", "a.nhdr"})
      for (const bool compress : {false, true}) {
        SCOPED_TRACE(std::string(name) + (compress ? " compressed" : ""));
        SequenceContent content;
        content.dimensions = c.dimensions;
        content.type = c.type;
        content.components = c.components;
        content.imageType = "BRIGHTNESS";
        content.fields = {{"Operator", "nobody"}, {"Depth.mm", "120"}};
        Random random(4);
        std::vector<std::string> pixels(frames.size());
        for (std::string& frame : pixels)
          for (std::uint64_t i = 0; i < content.FrameBytes(); ++i)
            frame.push_back(static_cast<char>(random.Bits()));
        pixels[4].clear(); // no image
        const std::string path = Path(name);
        Write(path, content, compress, frames, pixels);

        SequenceFile file(path);
        EXPECT_EQ(file.Content().dimensions, c.dimensions);
        EXPECT_EQ(file.Content().type, c.type);
        EXPECT_EQ(file.Content().components, c.components);
        EXPECT_EQ(file.Content().orientation, "MF");
        EXPECT_EQ(file.Content().imageType, "BRIGHTNESS");
        EXPECT_EQ(file.Content().fields, content.fields);
        ASSERT_EQ(file.Content().frames, 5);
        for (int i = 0; i < 5; ++i) {
          const SequenceFrame &in = frames[static_cast<std::size_t>(i)], out = file.Frame(i);
          EXPECT_TRUE(in.time == out.time || (std::isnan(in.time) && std::isnan(out.time)));
          EXPECT_EQ(out.imageValid, i != 2 && i != 4);
          EXPECT_EQ(out.fields, in.fields);
          ASSERT_EQ(out.transforms.size(), in.transforms.size());
          for (std::size_t t = 0; t < in.transforms.size(); ++t) {
            EXPECT_EQ(out.transforms[t].name, in.transforms[t].name);
            EXPECT_EQ(out.transforms[t].statusText, in.transforms[t].statusText);
            EXPECT_EQ(out.transforms[t].status, in.transforms[t].status);
            EXPECT_EQ(out.transforms[t].matrix.matrix(), in.transforms[t].matrix.matrix());
          }
          std::string back(content.FrameBytes(), 'x');
          file.ReadFrame(i, back.data());
          EXPECT_TRUE(back == (i == 4 ? std::string(back.size(), '\0') : pixels[static_cast<std::size_t>(i)]));
        }
        // The reader of volumes sends people to that of sequences.
        ExpectRefused([&] { ReadImageHeader(path); }, Error::Kind::BadFile, path, "vtkUltrasoundSequenceReader");
      }
  EXPECT_EQ(FileCount(), 7); // 4 headers and .raw, .zraw and .raw.gz beside them: nothing temporary
}

TEST_F(SequenceWriterTest, TheHeaderIsWhatPlusExpects)
{
  SequenceContent content;
  content.dimensions = {2, 1, 1};
  SequenceFrame frame;
  frame.time = 0.5;
  frame.transforms.emplace_back();
  frame.transforms[0].name = "ImageToReference";
  Write(Path("a.igs.mha"), content, false, {frame}, {"ab"});
  std::stringstream text;
  text << std::ifstream(Path("a.igs.mha"), std::ios::binary).rdbuf();
  EXPECT_EQ(text.str(),
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            "DimSize = 2 1 1         \nKinds = domain domain list\nElementNumberOfChannels = 1\n"
            "ElementSpacing = 1 1 1\nElementType = MET_UCHAR\nOffset = 0 0 0\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n"
            "UltrasoundImageOrientation = MF\nUltrasoundImageType = BRIGHTNESS\n"
            "Seq_Frame0000_ImageToReferenceTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"
            "Seq_Frame0000_ImageToReferenceTransformStatus = OK\nSeq_Frame0000_Timestamp = 0.5\n"
            "Seq_Frame0000_ImageStatus = OK\nElementDataFile = LOCAL\nab");
}

TEST_F(SequenceWriterTest, NothingFollowsTheSizesOfNrrd) // Teem, and so ITK and 3D Slicer, would count one more
{
  SequenceContent content;
  content.dimensions = {2, 1, 1};
  Write(Path("a.seq.nrrd"), content, false, std::vector<SequenceFrame>(12), std::vector<std::string>(12, "ab"));
  std::stringstream text;
  text << std::ifstream(Path("a.seq.nrrd"), std::ios::binary).rdbuf();
  EXPECT_NE(text.str().find("\nsizes: 2 1 1         12\n"), std::string::npos) << text.str();
}

TEST_F(SequenceWriterTest, PosesAloneAndManyFrames)
{
  SequenceContent content;
  std::vector<SequenceFrame> frames(10002);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].time = static_cast<double>(i);
    frames[i].transforms.emplace_back();
    frames[i].transforms[0].name = "StylusToTracker";
  }
  Write(Path("a.igs.mha"), content, true, frames, {});
  SequenceFile file(Path("a.igs.mha"));
  EXPECT_FALSE(file.Content().HasImages());
  ASSERT_EQ(file.Content().frames, 10002);
  EXPECT_EQ(file.Time(10001), 10001.0);
  EXPECT_EQ(file.Frame(10001).transforms.size(), 1u);
  ExpectRefused([&] { Write(Path("a.seq.nrrd"), content, true, frames, {}); }, Error::Kind::InvalidParameter, "a.seq.nrrd",
                "without images");
}

TEST_F(SequenceWriterTest, WhatCannotBeWrittenLeavesWhatWasThere)
{
  const std::string path = Put("a.igs.mha", "before");
  SequenceContent content;
  content.dimensions = {100, 100, 1};
  const std::string pixels(10000, 'p');
  const auto refused = [&](Error::Kind kind, const std::string& words, const SequenceContent& what, const SequenceFrame& frame) {
    ExpectRefused([&] { Write(path, what, false, {frame, frame}, {pixels, pixels}); }, kind, path, words);
    EXPECT_EQ(FileCount(), 1);
    EXPECT_EQ(std::filesystem::file_size(path), 6u);
  };
  SequenceFrame frame;
  for (const char* name : {"two\nlines.mhd", "two\nlines.nhdr"}) {
    ExpectRefused([&] { Write(Path(name), content, false, {frame}, {pixels}); }, Error::Kind::InvalidParameter, Path(name),
                  "not found again");
    EXPECT_EQ(FileCount(), 1);
  }
  frame.time = INFINITY;
  refused(Error::Kind::BadInput, "time of frame 0", content, frame);
  frame = {};
  frame.transforms.emplace_back();
  frame.transforms[0].name = "Probe";
  refused(Error::Kind::BadInput, "\"Probe\"", content, frame);
  frame.transforms[0].name = "ProbeToTracker";
  frame.transforms[0].matrix(1, 1) = NAN;
  refused(Error::Kind::BadInput, "ProbeToTrackerTransform", content, frame);
  frame.transforms[0].matrix(1, 1) = 1.0;
  frame.transforms.push_back(frame.transforms[0]);
  refused(Error::Kind::BadInput, "given twice", content, frame);
  frame = {};
  for (const char* key : {"Timestamp", "ImageStatus", "Status"}) {
    frame.fields = {{key, "1"}};
    refused(Error::Kind::BadInput, "given twice", content, frame);
  }
  for (const HeaderField& field :
       {HeaderField{"two words", "x"}, {"Key", "two\nlines"}, {"Key", " blank"}, {"", "x"}, {"DimSize", "1"}}) {
    frame.fields = {field};
    refused(Error::Kind::BadInput, "cannot hold", content, frame);
  }
  frame = {};
  SequenceContent wrong = content;
  for (const char* key : {"Seq_Frame0000_Note", "UltrasoundImageType", "UltrasoundImageOrientation"}) {
    wrong.fields = {{key, "x"}};
    refused(Error::Kind::BadInput, "makes itself", wrong, frame);
  }
  wrong = content;
  wrong.dimensions = {100, 100, 0};
  refused(Error::Kind::BadInput, "dimensions", wrong, frame);
  wrong = content;
  wrong.geometry.spacing[0] = -1.0;
  refused(Error::Kind::BadInput, "spacing", wrong, frame);
  ExpectRefused([&] { Write(path, content, false, {}, {}); }, Error::Kind::BadInput, path, "no frames");
  ExpectRefused([&] { Write(Path("a.txt"), content, false, {frame}, {pixels}); }, Error::Kind::InvalidParameter, "a.txt", ".mha");
  ExpectRefused([&] { Write(Path("no/a.mha"), content, false, {frame}, {pixels}); }, Error::Kind::FileSystem, "a.mha",
                "no folder");
  for (const bool compress : {false, true}) {
    std::vector<std::string> many(40, pixels);
    Random random(9);
    for (std::string& one : many)
      for (char& c : one)
        c = static_cast<char>(random.Bits());
    const FullDisk full(100000);
    ExpectRefused([&] { Write(path, content, compress, std::vector<SequenceFrame>(40), many); }, Error::Kind::FileSystem, path,
                  "disk full");
  }
  {
    // Stopped on request.
    FileReplacement files;
    SequenceWriter writer(path, content, true, files);
    writer.Append(frame, pixels.data());
    EXPECT_THROW(writer.Finish(Progress([](double) { return false; })), Error);
  }
  EXPECT_EQ(FileCount(), 1);
  EXPECT_EQ(std::filesystem::file_size(path), 6u);
}
