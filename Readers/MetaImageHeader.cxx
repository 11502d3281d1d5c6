// SPDX-License-Identifier: BSD-3-Clause
// MetaImage: "Key = value" lines; ElementDataFile is the last and says where the voxels are. Several keys have older
// names (Position and Origin for Offset, and so on). CenterOfRotation and AnatomicalOrientation do not move voxels: ITK
// ignores them too, and the axes are LPS. MET_LONG has four bytes, whatever a compiler's long has.
#include "Core/Base/Error.h"
#include "Core/Base/Words.h"
#include "Readers/HeaderLines.h"
#include "Readers/ImageHeader.h"
#include <algorithm>
#include <map>
#include <set>

namespace echorama {
namespace {

struct TypeName {
  const char* name;
  VoxelType type;
};
// The first name of each type is the one that we write.
constexpr TypeName MetaImageTypeNames[] = {
    {"MET_CHAR", VoxelType::Int8},         {"MET_UCHAR", VoxelType::UInt8},   {"MET_SHORT", VoxelType::Int16},
    {"MET_USHORT", VoxelType::UInt16},     {"MET_INT", VoxelType::Int32},     {"MET_UINT", VoxelType::UInt32},
    {"MET_LONG", VoxelType::Int32},        {"MET_ULONG", VoxelType::UInt32},  {"MET_LONG_LONG", VoxelType::Int64},
    {"MET_ULONG_LONG", VoxelType::UInt64}, {"MET_FLOAT", VoxelType::Float32}, {"MET_DOUBLE", VoxelType::Float64}};

// Older names of a key, and the name under which we keep it.
const std::map<std::string, std::string> Synonyms = {{"Position", "Offset"},
                                                     {"Origin", "Offset"},
                                                     {"Rotation", "TransformMatrix"},
                                                     {"Orientation", "TransformMatrix"},
                                                     {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}};

// The keys that say what and where the voxels are. They are not passed on: the geometry holds what they say.
const std::set<std::string> OwnKeys = {"ObjectType",
                                       "ObjectSubType",
                                       "NDims",
                                       "BinaryData",
                                       "BinaryDataByteOrderMSB",
                                       "CompressedData",
                                       "CompressedDataSize",
                                       "TransformMatrix",
                                       "Offset",
                                       "CenterOfRotation",
                                       "AnatomicalOrientation",
                                       "ElementSpacing",
                                       "ElementSize",
                                       "DimSize",
                                       "ElementType",
                                       "ElementNumberOfChannels",
                                       "HeaderSize",
                                       "DistanceUnits",
                                       "Kinds",
                                       "ElementMin",
                                       "ElementMax",
                                       "ElementToIntensityFunctionSlope",
                                       "ElementToIntensityFunctionOffset",
                                       "ElementDataFile"};

class HeaderValues {
public:
  HeaderValues(const HeaderLines& lines, const std::map<std::string, std::string>& values) : lines_(lines), values_(values) {}

  const std::string* Find(const std::string& key) const
  {
    const auto found = values_.find(key);
    return found == values_.end() ? nullptr : &found->second;
  }
  const std::string& Need(const std::string& key) const
  {
    const std::string* value = Find(key);
    if (!value)
      lines_.Fail("the header has no " + key);
    return *value;
  }
  bool Flag(const std::string& key, bool otherwise) const
  {
    const std::string* value = Find(key);
    if (!value)
      return otherwise;
    const char first = value->empty() ? '?' : (*value)[0];
    const bool yes = std::string("TtYy1").find(first) != std::string::npos;
    if (!yes && std::string("FfNn0").find(first) == std::string::npos)
      lines_.Fail(key + " is \"" + *value + "\"; True or False is needed");
    return yes;
  }

private:
  const HeaderLines& lines_;
  const std::map<std::string, std::string>& values_;
};

// How many of the axes lie in space; the last may count frames.
int SpatialAxes(const HeaderLines& lines, const HeaderValues& values, int axes, FrameAxis* sequence)
{
  if (!sequence)
    return axes;
  const std::string* kinds = values.Find("Kinds");
  if (!kinds)
    return axes == 2 ? 2 : axes - 1;
  const std::vector<std::string_view> words = SplitWords(*kinds);
  const auto counts = [](std::string_view kind) { return kind == "list" || kind == "time"; };
  const auto frames = std::find_if(words.begin(), words.end(), counts);
  if (frames != words.end() && (words.size() != static_cast<std::size_t>(axes) || frames + 1 != words.end()))
    lines.Fail("Kinds is \"" + *kinds + "\"; the frames must be along the last of " + std::to_string(axes) + " axes");
  return frames == words.end() ? axes : axes - 1;
}

void ParseGeometry(ImageHeader& header, const HeaderLines& lines, const HeaderValues& values, int all, FrameAxis* sequence)
{
  const int axes = SpatialAxes(lines, values, all, sequence);
  if (axes != 2 && axes != 3)
    lines.Fail("it has " + std::to_string(axes) + " axes in space; 2 or 3 are needed");
  const std::size_t count = static_cast<std::size_t>(all);
  ImageGeometry& g = header.geometry;
  const std::vector<int> sizes = lines.Sizes("DimSize", values.Need("DimSize"), count);
  std::copy(sizes.begin(), sizes.begin() + axes, g.dimensions.begin());
  if (sequence && axes < all)
    sequence->frames = sizes.back();

  double unit = 1.0;
  if (const std::string* name = values.Find("DistanceUnits"))
    unit = *name == "um" ? 1e-3 : *name == "cm" ? 10.0 : 1.0;

  const char* spacingKey = values.Find("ElementSpacing") ? "ElementSpacing" : "ElementSize";
  if (const std::string* text = values.Find(spacingKey)) {
    const auto spacing = lines.Numbers<double>(spacingKey, *text, count);
    std::copy(spacing.begin(), spacing.begin() + axes, g.spacing.data());
    g.spacing *= unit;
  } else
    header.notes.push_back("the file has no spacing: 1 mm was assumed");

  // The space of a file has as many axes as the file, but what lies beyond the third is time.
  const int inSpace = std::min(all, 3);
  if (const std::string* text = values.Find("Offset")) {
    const auto origin = lines.Numbers<double>("Offset", *text, count);
    std::copy(origin.begin(), origin.begin() + inSpace, g.origin.data());
    g.origin *= unit;
  } else
    header.notes.push_back("the file has no origin: 0 0 0 was assumed");

  if (const std::string* text = values.Find("TransformMatrix")) {
    const auto matrix = lines.Numbers<double>("TransformMatrix", *text, count * count);
    for (int axis = 0; axis < axes; ++axis)
      for (int i = 0; i < inSpace; ++i)
        g.direction(i, axis) = matrix[static_cast<std::size_t>(axis * all + i)];
  } else
    header.notes.push_back("the file has no direction: its axes were taken as those of the world");
  PlaceAxes(header, axes);
}

void ParseData(ImageHeader& header, const HeaderLines& lines, const HeaderValues& values)
{
  if (const std::string* channels = values.Find("ElementNumberOfChannels"))
    header.components = lines.Numbers<std::uint64_t>("ElementNumberOfChannels", *channels, 1)[0];
  const std::string& typeName = values.Need("ElementType");
  // Arrays of numbers have types of their own (MET_UCHAR_ARRAY), which mean the same together with the channels.
  const std::string single = typeName.substr(0, typeName.find("_ARRAY"));
  const auto type = std::find_if(std::begin(MetaImageTypeNames), std::end(MetaImageTypeNames),
                                 [&](const TypeName& t) { return single == t.name; });
  header.typeIsKnown = type != std::end(MetaImageTypeNames);
  if (header.typeIsKnown)
    header.type = type->type;

  header.bigEndian = values.Flag("BinaryDataByteOrderMSB", false);
  const bool text = !values.Flag("BinaryData", true), compressed = values.Flag("CompressedData", false);
  header.encoding = text ? ImageHeader::Encoding::Text : compressed ? ImageHeader::Encoding::Zlib : ImageHeader::Encoding::Raw;

  std::int64_t headerSize = 0;
  if (const std::string* size = values.Find("HeaderSize"))
    headerSize = lines.Numbers<std::int64_t>("HeaderSize", *size, 1)[0];
  if (headerSize < -1)
    lines.Fail("HeaderSize is " + std::to_string(headerSize));
  const std::string& file = values.Need("ElementDataFile");
  const bool local = file == "LOCAL" || file == "Local" || file == "local";
  if (file.empty())
    lines.Fail("ElementDataFile is empty");
  if (file.compare(0, 4, "LIST") == 0 || file.find('%') != std::string::npos)
    lines.Fail("the voxels lie in one file per slice, which is not supported; join them with another program first");
  header.dataPath = local ? header.path : DetachedPath(header.path, file);
  header.dataOffset = headerSize != 0 ? headerSize : local ? lines.Position() : 0;
}

} // namespace

void ParseMetaImage(ImageHeader& header, FrameAxis* axis)
{
  HeaderLines lines(header.path);
  std::map<std::string, std::string> known;
  std::string line;
  while (!known.count("ElementDataFile")) {
    if (!lines.Next(line))
      lines.FailHere("the header ends before ElementDataFile: the file is truncated");
    if (TrimBlanks(line).empty())
      continue;
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos)
      lines.FailHere("\"Key = value\" is needed");
    std::string key(TrimBlanks(std::string_view(line).substr(0, equals)));
    const std::string value(TrimBlanks(std::string_view(line).substr(equals + 1)));
    if (const auto synonym = Synonyms.find(key); synonym != Synonyms.end())
      key = synonym->second;
    if (axis && TakeFrameField(lines, *axis, key, value))
      continue;
    if (!OwnKeys.count(key))
      header.fields.emplace_back(key, value);
    else if (const auto [place, fresh] = known.emplace(key, value); !fresh && place->second != value)
      lines.FailHere(key + " is given twice, with different values");
  }

  if (std::any_of(header.fields.begin(), header.fields.end(), [](const HeaderField& field) { return IsFrameField(field.first); }))
    lines.Fail(NotAVolume);
  const HeaderValues values(lines, known);
  if (const std::string* object = values.Find("ObjectType"); object && *object != "Image")
    lines.Fail("it holds an object of type " + *object + ", not an image");
  const int axes = lines.Numbers<int>("NDims", values.Need("NDims"), 1)[0];
  if (axes != 2 && axes != 3 && !(axes == 4 && axis))
    lines.Fail("it has " + std::to_string(axes) + " dimensions; 2 or 3 are needed");
  ParseGeometry(header, lines, values, axes, axis);
  ParseData(header, lines, values);
  if (axis)
    axis->headerBytes = lines.Position();
}

const char* MetaImageTypeName(VoxelType type)
{
  return std::find_if(std::begin(MetaImageTypeNames), std::end(MetaImageTypeNames),
                      [&](const TypeName& t) { return t.type == type; })
      ->name;
}

std::string MetaImageHeaderText(const ImageHeader& header, const std::string& dataFile, std::size_t& compressedSizeAt)
{
  const ImageGeometry& g = header.geometry;
  const bool compressed = header.encoding == ImageHeader::Encoding::Zlib;
  std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = ";
  text += header.bigEndian ? "True\n" : "False\n";
  text += compressed ? "CompressedData = True\n" : "CompressedData = False\n";
  compressedSizeAt = 0;
  if (compressed) {
    text += "CompressedDataSize = ";
    compressedSizeAt = text.size();
    text += std::string(20, ' ') + "\n";
  }
  text += "TransformMatrix = " + JoinedNumbers(g.direction.data(), 9) + "\n"; // Eigen stores columns: axis after axis
  text += "Offset = " + JoinedNumbers(g.origin.data(), 3) + "\nCenterOfRotation = 0 0 0\n";
  text += "ElementSpacing = " + JoinedNumbers(g.spacing.data(), 3) + "\n";
  text +=
      "DimSize = " + NumberText(g.dimensions[0]) + " " + NumberText(g.dimensions[1]) + " " + NumberText(g.dimensions[2]) + "\n";
  text += std::string("ElementType = ") + MetaImageTypeName(header.type) + "\n";
  for (const auto& [key, value] : FieldsInFile(header))
    text += key + " = " + value + "\n";
  return text + "ElementDataFile = " + (dataFile.empty() ? "LOCAL" : dataFile) + "\n";
}

bool CanHold(const HeaderField& field)
{
  const auto& [key, value] = field;
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' || c == '-';
  });
  return plain && !OwnKeys.count(key) && !Synonyms.count(key) && key.size() + value.size() < 900000 &&
         TrimBlanks(value).size() == value.size() &&
         std::none_of(value.begin(), value.end(), [](unsigned char c) { return c < 32 && c != '\t'; });
}

} // namespace echorama
