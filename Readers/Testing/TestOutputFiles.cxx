// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Readers/FileKind.h"
#include "Readers/OutputFiles.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>

using namespace echorama;
namespace fs = std::filesystem;

namespace {

class OutputFiles : public echorama::testing::TemporaryFolder {
protected:
  // The message of a refusal, empty when there is none.
  template <class Function>
  static std::string Refusal(const Function& function)
  {
    try {
      function();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  std::vector<std::string> Names() const
  {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      names.push_back(fs::relative(entry.path(), folder).string());
    std::sort(names.begin(), names.end());
    return names;
  }
};

bool Says(const std::string& text, const std::string& words)
{
  return text.find(words) != std::string::npos;
}

} // namespace

TEST_F(OutputFiles, CompanionsBelongToTheirVolume)
{
  const std::vector<std::string> files{"in/a.nii.gz", "./in/a.ValidRegion.nii.gz", "in/b.Coverage.mha", "in/a.ValidRegion.mha"};
  // The first is a volume; the next is spelled otherwise; b is not there; the last is of another format.
  EXPECT_EQ(AreCompanions(files), (std::vector<bool>{false, true, false, false}));
  EXPECT_EQ(CompanionPaths("a.mha").front(), "a.ValidRegion.mha");
}

TEST_F(OutputFiles, InputsAndWhatBelongsToThemAreNeverOverwritten)
{
  const std::string volume = Put("a.mha", "x"), region = Put("a.ValidRegion.mha", "x");
  fs::create_symlink(volume, Path("link.mha"));
  for (const std::string& output : {volume, region, Path("link.mha")})
    EXPECT_TRUE(Says(Refusal([&] { CheckOutput(output, {volume}); }), "inputs are never overwritten")) << output;
  EXPECT_EQ(Refusal([&] { CheckOutput(Path("b.mha"), {volume}); }), "");
  Put("b.ValidRegion.mha", "x"); // what b.mha would replace is an input
  EXPECT_TRUE(Says(Refusal([&] { CheckOutput(Path("b.mha"), {Path("b.ValidRegion.mha")}); }), "inputs are never"));
  EXPECT_TRUE(Says(Refusal([&] { CheckOutput(folder.string(), {}); }), "it is a folder"));
  EXPECT_TRUE(Says(Refusal([&] { CheckOutput(Path("absent/b.mha"), {}); }), "its folder does not exist"));
  EXPECT_TRUE(Says(Refusal([&] { CheckVolumeOutput(Path("b.txt"), {}); }), "names none of the formats"));
}

TEST_F(OutputFiles, DetachedPixelsOfVolumesAndSequencesAreInputs)
{
  const std::string pixels = Put("rec.igs.zraw", "x");
  const std::string kinds[] = {"", "Kinds = domain domain list\nSeq_Frame0000_Timestamp = 1\n"};
  for (const std::string& fields : kinds) {
    const std::string header =
        Put("fixed.igs.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n" +
                                 fields + "ElementDataFile = rec.igs.zraw\n");
    EXPECT_TRUE(Says(Refusal([&] { CheckOutput(Path("rec.igs.mhd"), {header}); }), "rec.igs.zraw")) << fields;
    EXPECT_EQ(FilesOfVolume(header), (std::vector<std::string>{header, pixels})) << fields;
  }
}

TEST_F(OutputFiles, AFolderOfFilesAppearsWholeOrNotAtAll)
{
  const std::string place = Path("new/set");
  {
    OutputFolder set(place, {});
    WriteTextFile(set.Stage("a.mha"), "new");
    EXPECT_TRUE(Says(Refusal([&] { set.Stage("a.mha"); }), "it would be written twice"));
    EXPECT_FALSE(fs::exists(set.Final("a.mha")));
  }
  EXPECT_EQ(Names(), std::vector<std::string>()); // not committed: nothing is left, also no folder
  {
    OutputFolder set(place, {});
    WriteTextFile(set.Stage("a.mha"), "old");
    WriteTextFile(set.StageFolder() + "/a.ValidRegion.mha", "old"); // as a writer adds it
    set.Commit();
  }
  EXPECT_EQ(Names(), (std::vector<std::string>{"new", "new/set", "new/set/a.ValidRegion.mha", "new/set/a.mha"}));
  {
    OutputFolder set(place, {});
    WriteTextFile(set.Stage("a.mha"), "new");
    set.Commit();
  }
  EXPECT_EQ(ReadTextFile(place + "/a.mha"), "new");
  EXPECT_FALSE(fs::exists(place + "/a.ValidRegion.mha")); // it belonged to the earlier one
}

TEST_F(OutputFiles, AFolderAndOtherFilesTakeTheirPlacesTogether)
{
  const std::string place = Path("set"), poses = Put("poses.json", "old");
  fs::create_directory(place);
  Put("set/a.mha", "old");
  Put("set/a.ValidRegion.mha", "old");
  for (const bool fails : {true, false}) {
    OutputFolder set(place, {});
    FileReplacement files;
    WriteTextFile(set.Stage("a.mha"), "new");
    const std::string staged = files.Stage(poses);
    WriteTextFile(staged, "new");
    EXPECT_EQ(ReadTextFile(poses) + ReadTextFile(place + "/a.mha"), "oldold");
    if (fails) {
      fs::remove(staged); // so it cannot be put in place
      EXPECT_NE(Refusal([&] { set.Commit(files); }), "");
      EXPECT_EQ(ReadTextFile(poses) + ReadTextFile(place + "/a.mha") + ReadTextFile(place + "/a.ValidRegion.mha"), "oldoldold");
    } else {
      set.Commit(files);
      EXPECT_EQ(ReadTextFile(poses) + ReadTextFile(place + "/a.mha"), "newnew");
      EXPECT_FALSE(fs::exists(place + "/a.ValidRegion.mha"));
    }
  }
  EXPECT_EQ(Names(), (std::vector<std::string>{"poses.json", "set", "set/a.mha"}));
}

TEST_F(OutputFiles, AFileIsWrittenWholeOrLeftAsItWas)
{
  const std::string path = Put("text", "old");
  WriteTextFile(path, "new\r\n");
  EXPECT_EQ(ReadTextFile(path), "new\r\n");
  EXPECT_EQ(Names(), std::vector<std::string>{"text"});
  EXPECT_NE(Refusal([&] { WriteTextFile(Path("absent/text"), "x"); }), "");
}

TEST_F(OutputFiles, TheKindIsThatOfTheContentElseOfTheName)
{
  EXPECT_EQ(KindOf(Put("a.txt", R"({"schema": "echorama-transforms-1"})")), FileKind::Transforms);
  EXPECT_EQ(KindOf(Put("b.json", R"({"schema": "echorama-poses-1"})")), FileKind::Poses);
  EXPECT_EQ(KindOf(Put("c.mha", "ObjectType = Image\nNDims = 3\nSeq_Frame0000_Timestamp = 1\nElementDataFile = LOCAL\n")),
            FileKind::Sequence);
  EXPECT_EQ(KindOf(Put("d.mha", "ObjectType = Image\nNDims = 3\nElementDataFile = LOCAL\n")), FileKind::Volume);
  EXPECT_EQ(KindOf(Path("absent.xml")), FileKind::Transforms);
}
