// SPDX-License-Identifier: BSD-3-Clause
// Both formats are lines of text before (or beside) the voxels. What they share is here: telling files apart, lines and
// numbers with the place in every complaint, and the step from "axes as the file has them" to a rigid pose. The fields of
// each are in MetaImageHeader.cxx and NrrdHeader.cxx. Numbers are read and written without the locale: ParaView's
// interface sets one, and "0,5" would end a number at its zero.
#include "Readers/ImageHeader.h"
#include "Core/Base/Error.h"
#include "Readers/DataFile.h"
#include "Readers/DicomFile.h"
#include "Readers/DicomHeader.h"
#include "Readers/HeaderLines.h"
#include "Readers/ImageStackFile.h"
#include "Readers/KretzFile.h"
#include "Readers/NiftiFile.h"
#include "Readers/VdbFile.h"
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr std::size_t LongestLine = 1000000;

// Whether a text has a line "key = ..." (the key at the beginning of the text or of a line).
bool HasKey(const std::string& text, const std::string& key)
{
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    const std::size_t after = text.find_first_not_of(Blanks, at + key.size());
    if ((at == 0 || text[at - 1] == '\n') && after != std::string::npos && text[after] == '=')
      return true;
  }
  return false;
}

constexpr std::string_view FramePrefix = "Seq_Frame";

ImageHeader ReadHeader(const std::string& path, FrameAxis* axis)
{
  ImageHeader header;
  header.path = path;
  header.format = FormatOfContent(path);
  if (header.format == FileFormat::MetaImage)
    ParseMetaImage(header, axis);
  else if (header.format == FileFormat::Nrrd)
    ParseNrrd(header, axis);
  else
    FailFile(path, "the content is neither MetaImage nor NRRD");
  return header;
}

} // namespace

FileFormat FormatOfContent(const std::string& path)
{
  const auto fail = [&path](Error::Kind kind, const std::string& reason) { throw Error(kind, path + ": " + reason); };
  std::error_code error;
  if (path.empty())
    throw Error(Error::Kind::FileSystem, "no file name was given");
  if (!fs::exists(path, error))
    fail(Error::Kind::FileSystem, "there is no such file");
  if (fs::is_directory(path, error)) {
    if (IsDicomFolder(path))
      return FileFormat::Dicom;
    if (HoldsImages(path))
      return FileFormat::ImageStack;
    fail(Error::Kind::FileSystem, "it is a folder, not a file, and holds no images");
  }
  std::ifstream stream = OpenToRead(path);
  std::string start(4096, '\0');
  start.resize(ReadPieces(stream, start.data(), start.size()));
  if (start.empty())
    fail(stream.bad() ? Error::Kind::FileSystem : Error::Kind::BadFile, stream.bad() ? "it cannot be read" : "the file is empty");

  for (const auto& [looksLike, format] : {std::pair(&LooksLikeDicom, FileFormat::Dicom),
                                          {&LooksLikeKretz, FileFormat::Kretz},
                                          {&LooksLikeNifti, FileFormat::Nifti},
                                          {&LooksLikeVdb, FileFormat::Vdb},
                                          {&LooksLikeImage, FileFormat::ImageStack}})
    if (looksLike(start))
      return format;
  if (start.compare(0, 4, "NRRD") == 0)
    return FileFormat::Nrrd;
  if (start.find("<VTKFile") != std::string::npos && start.find("ImageData") != std::string::npos)
    return FileFormat::VtkXmlImage;
  if (HasKey(start, "NDims") || HasKey(start, "ObjectType"))
    return FileFormat::MetaImage;
  return FileFormat::Unknown;
}

const char* KnownFormats()
{
  return "MetaImage, NRRD, NIfTI, DICOM, GE Kretz, OpenVDB, VTK image file and images (PNG, JPEG, TIFF)";
}

std::string LowerExtension(const std::string& path)
{
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

FileFormat FormatOfName(const std::string& path)
{
  const std::string extension = LowerExtension(path);
  if (extension == ".mha" || extension == ".mhd")
    return FileFormat::MetaImage;
  if (extension == ".nrrd" || extension == ".nhdr")
    return FileFormat::Nrrd;
  if (extension == ".nii" || (extension == ".gz" && LowerExtension(fs::path(path).stem().string()) == ".nii"))
    return FileFormat::Nifti;
  if (extension == ".vdb")
    return FileFormat::Vdb;
  return extension == ".vti" ? FileFormat::VtkXmlImage : FileFormat::Unknown;
}

std::uint64_t ImageHeader::ByteCount() const
{
  return geometry.VoxelCount() * components * SizeOf(type);
}

ImageHeader ReadImageHeader(const std::string& path)
{
  return ReadHeader(path, nullptr);
}

ImageHeader ReadSequenceHeader(const std::string& path, FrameAxis& axis)
{
  return ReadHeader(path, &axis);
}

bool IsFrameField(std::string_view key)
{
  return key.substr(0, FramePrefix.size()) == FramePrefix;
}

bool TakeFrameField(const HeaderLines& lines, FrameAxis& axis, std::string_view key, std::string_view value)
{
  if (!IsFrameField(key))
    return false;
  const std::string_view rest = key.substr(FramePrefix.size());
  const std::size_t end = rest.find_first_not_of("0123456789");
  std::int64_t frame = -1;
  if (end == std::string_view::npos || rest[end] != '_' || end + 1 == rest.size() || !ParseNumber(rest.substr(0, end), frame))
    lines.FailHere("\"" + std::string(key.substr(0, 60)) + "\" is not the field of a frame");
  axis.field(frame, rest.substr(end + 1), value);
  return true;
}

HeaderLines::HeaderLines(const std::string& path) : path_(path), stream_(OpenToRead(path)) {}

bool HeaderLines::Next(std::string& line)
{
  line.clear();
  ++line_;
  std::streambuf& bytes = *stream_.rdbuf();
  for (int c = bytes.sbumpc(); c != std::char_traits<char>::eof(); c = bytes.sbumpc()) {
    ++position_;
    if (c == '\n')
      return true;
    if ((c < 32 && c != '\t' && c != '\r') || line.size() == LongestLine)
      FailHere("this is not text (truncated, or a file of another type?)");
    if (c != '\r')
      line.push_back(static_cast<char>(c));
  }
  return !line.empty();
}

void HeaderLines::Fail(const std::string& reason) const
{
  FailFile(path_, reason);
}

void HeaderLines::FailAt(std::int64_t line, const std::string& reason) const
{
  throw Error(Error::Kind::BadFile, path_ + ", line " + std::to_string(line) + ": " + reason);
}

std::vector<int> HeaderLines::Sizes(const std::string& key, std::string_view text, std::size_t count) const
{
  std::vector<int> sizes;
  for (const long long size : Numbers<long long>(key, text, count)) {
    if (size < 0 || size > std::numeric_limits<int>::max())
      Fail(key + " holds " + std::to_string(size) + ", which is not a possible size");
    sizes.push_back(static_cast<int>(size));
  }
  return sizes;
}

void PlaceAxes(ImageHeader& header, int axes)
{
  ImageGeometry& g = header.geometry;
  if (axes == 2) {
    g.dimensions[2] = 1;
    g.spacing[2] = 1.0;
    g.direction.col(2) = g.direction.col(0).cross(g.direction.col(1));
  } else if (g.direction.determinant() < 0.0) {
    g.origin += g.direction.col(2) * (g.spacing[2] * (g.dimensions[2] - 1));
    g.direction.col(2) = -g.direction.col(2);
    header.reverseSlices = g.dimensions[2] > 1;
    if (header.reverseSlices)
      header.notes.push_back(
          "the axes in the file are left-handed: the slices were taken in reverse, so that the pose is a rigid one");
  }
}

std::optional<double> Millimetres(const std::string& unit)
{
  static const std::map<std::string, double> lengths = {
      {"", 1.0},         {"mm", 1.0},      {"millimeter", 1.0}, {"millimetre", 1.0}, {"cm", 10.0},    {"m", 1000.0},
      {"inch", 25.4},    {"um", 1e-3},     {"\xC2\xB5m", 1e-3}, {"\xCE\xBCm", 1e-3}, {"\xB5m", 1e-3}, {"\\u00B5m", 1e-3},
      {"&#181;m", 1e-3}, {"micron", 1e-3}, {"microns", 1e-3},   {"nm", 1e-6}};
  const auto found = lengths.find(unit);
  return found == lengths.end() ? std::nullopt : std::optional<double>(found->second);
}

std::string JoinedNumbers(const double* numbers, int count)
{
  std::string text;
  for (int i = 0; i < count; ++i)
    text += (i ? " " : "") + NumberText(numbers[i]);
  return text;
}

std::string GeometryText(const ImageGeometry& g)
{
  const Eigen::Matrix3d rows = g.direction.transpose(); // Eigen stores columns
  return JoinedNumbers(g.origin.data(), 3) + " " + JoinedNumbers(g.spacing.data(), 3) + " " + JoinedNumbers(rows.data(), 9);
}

std::optional<ImageGeometry> GeometryOfText(std::string_view text, const std::array<int, 3>& dimensions)
{
  std::array<double, 15> numbers;
  const std::vector<std::string_view> words = SplitWords(text);
  bool good = words.size() == numbers.size();
  for (std::size_t i = 0; good && i < numbers.size(); ++i)
    good = ParseNumber(words[i], numbers[i]);
  if (!good)
    return std::nullopt;
  using Vector = Eigen::Map<const Eigen::Vector3d>;
  const Eigen::Map<const Eigen::Matrix3d> rows(numbers.data() + 6);
  return ImageGeometry{dimensions, Vector(numbers.data()), Vector(numbers.data() + 3), rows.transpose()};
}

bool IsPose(const HeaderField& field)
{
  return field.first == OurFields + "ProbeToWorld" || field.first == OurFields + "ImageToWorld";
}

std::vector<HeaderField> FieldsInFile(const ImageHeader& header)
{
  std::vector<HeaderField> fields = header.fields;
  if (std::any_of(fields.begin(), fields.end(), IsPose))
    fields.emplace_back(GeometryField, GeometryText(header.geometry));
  return fields;
}

std::string DetachedName(const std::string& path, const std::string& extension)
{
  const std::string name = fs::path(path).stem().string() + extension;
  if (TrimBlanks(name) != name || name.compare(0, 4, "LIST") == 0 ||
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return c == '%' || c < 32; }))
    throw Error(
        Error::Kind::InvalidParameter,
        path + ": its header cannot name the file of voxels beside it: a name with a line break or %, or that begins with a " +
            "blank or LIST, is not found again; choose another name, or .mha or .nrrd");
  return name;
}

std::string DetachedPath(const std::string& path, const std::string& file)
{
  return (fs::path(path).parent_path() / file).string(); // an absolute name replaces the folder
}

} // namespace echorama
