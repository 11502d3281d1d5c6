// SPDX-License-Identifier: BSD-3-Clause
// A NIfTI header is a fixed block of 348 (version 1) or 540 bytes (version 2), in the byte order of whoever wrote it, then
// extensions, then the voxels. We take it apart ourselves rather than with libnifti, which prints to stderr, believes every
// length and ends where a file does without saying so: here each number is checked against the file's size before anything
// is allocated, and voxels go through the same code as those of the other formats.
//
// The header's affine maps indices to RAS; two signs make it LPS.
//
// Compressed time series are inflated in order; going back to an earlier volume starts over.
#include "Readers/NiftiFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Readers/AffinePose.h"
#include "Readers/Compression.h"
#include "Readers/HeaderLines.h"
#include "Readers/VolumeFile.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <type_traits>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr int SizeOfHeader[] = {0, 348, 540}; // by version
constexpr int CommentCode = 6;
const std::string CommentStart = "Echorama volume", OwnDescription = "Echorama";

template <class T>
T Swapped(T value)
{
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  std::reverse(bytes, bytes + sizeof(T));
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// What we use of a header of either version, as numbers of this machine.
struct Fields {
  int version = 1;
  bool bigEndian = false;
  bool pair = false; // .hdr and .img
  std::array<std::int64_t, 8> dim{};
  std::array<double, 8> pixdim{};
  int datatype = 0, qformCode = 0, sformCode = 0, units = 0;
  double offset = 0.0, slope = 0.0, intercept = 0.0, timeOffset = 0.0;
  std::array<double, 6> quaternion{}; // b c d, then the offset
  std::array<double, 12> srow{};
  std::string description, intentName;
};

// Where each version has what. The types differ, too: see Parse.
struct Layout {
  std::size_t dim, pixdim, datatype, offset, slope, intercept, timeOffset, units, description, qformCode, sformCode, quaternion,
      srow, intentName, magic;
};
constexpr Layout Layouts[] = {{},
                              {40, 76, 70, 108, 112, 116, 136, 123, 148, 252, 254, 256, 280, 328, 344},
                              {16, 104, 12, 168, 176, 184, 216, 500, 240, 344, 348, 352, 400, 508, 4}};

class Bytes {
public:
  Bytes(std::string_view bytes, bool swap) : bytes_(bytes), swap_(swap) {}
  template <class T>
  T At(std::size_t offset) const
  {
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return swap_ ? Swapped(value) : value;
  }
  std::string Text(std::size_t offset, std::size_t length) const
  {
    std::string text(bytes_.substr(offset, length));
    text.erase(std::min(text.find('\0'), text.size()));
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
      text.pop_back();
    return text;
  }

private:
  std::string_view bytes_;
  bool swap_;
};

// The version that the first four bytes name, 0 for none.
int VersionOf(std::string_view start, bool& swap)
{
  if (start.size() < 4)
    return 0;
  for (const bool swapped : {false, true})
    for (const int version : {1, 2})
      if (Bytes(start, swapped).At<std::int32_t>(0) == SizeOfHeader[version]) {
        swap = swapped;
        return version;
      }
  return 0;
}

template <int Version>
Fields Parse(const Bytes& bytes)
{
  constexpr bool one = Version == 1;
  using Real = std::conditional_t<one, float, double>;
  using Size = std::conditional_t<one, std::int16_t, std::int64_t>;
  using Code = std::conditional_t<one, std::int16_t, std::int32_t>;
  using Offset = std::conditional_t<one, float, std::int64_t>;
  const Layout& at = Layouts[Version];
  const auto reals = [&](std::size_t offset, auto& target) {
    for (std::size_t i = 0; i < target.size(); ++i)
      target[i] = static_cast<double>(bytes.At<Real>(offset + i * sizeof(Real)));
  };
  Fields f;
  f.version = Version;
  for (std::size_t i = 0; i < 8; ++i)
    f.dim[i] = bytes.At<Size>(at.dim + i * sizeof(Size));
  reals(at.pixdim, f.pixdim);
  reals(at.quaternion, f.quaternion);
  reals(at.srow, f.srow);
  f.datatype = bytes.At<std::int16_t>(at.datatype);
  f.offset = static_cast<double>(bytes.At<Offset>(at.offset));
  f.slope = static_cast<double>(bytes.At<Real>(at.slope));
  f.intercept = static_cast<double>(bytes.At<Real>(at.intercept));
  f.timeOffset = static_cast<double>(bytes.At<Real>(at.timeOffset));
  f.units = one ? bytes.At<unsigned char>(at.units) : bytes.At<std::int32_t>(at.units);
  f.qformCode = bytes.At<Code>(at.qformCode);
  f.sformCode = bytes.At<Code>(at.sformCode);
  f.description = bytes.Text(at.description, 80);
  f.intentName = bytes.Text(at.intentName, 16);
  return f;
}

// The voxel type of a NIfTI code; Fails, with what it is, for the others.
struct TypeCode {
  int code;
  VoxelType type;
};
constexpr TypeCode TypeCodes[] = {{256, VoxelType::Int8},   {2, VoxelType::UInt8},     {4, VoxelType::Int16},
                                  {512, VoxelType::UInt16}, {8, VoxelType::Int32},     {768, VoxelType::UInt32},
                                  {1024, VoxelType::Int64}, {1280, VoxelType::UInt64}, {16, VoxelType::Float32},
                                  {64, VoxelType::Float64}};

const char* NameOfOther(int code)
{
  switch (code) {
  case 1:
    return "single bits";
  case 32:
  case 1792:
  case 2048:
    return "complex numbers";
  case 128:
  case 2304:
    return "colours";
  case 1536:
    return "128-bit numbers";
  default:
    return "an unknown type";
  }
}

// Reads a file, plain or gzip, from its beginning on; going back starts over.
class PlainOrGzip {
public:
  explicit PlainOrGzip(const std::string& path) : path_(path), stream_(path, std::ios::binary)
  {
    if (!stream_)
      throw Error(Error::Kind::FileSystem, path + ": it cannot be opened (is reading permitted?)");
    unsigned char magic[2] = {0, 0};
    stream_.read(reinterpret_cast<char*>(magic), 2);
    compressed_ = stream_.gcount() == 2 && magic[0] == 0x1f && magic[1] == 0x8b;
    std::error_code error;
    fileBytes_ = fs::file_size(path, error);
    if (error)
      throw Error(Error::Kind::FileSystem, path + ": " + error.message());
  }
  bool Compressed() const { return compressed_; }
  double FileBytes() const { return static_cast<double>(fileBytes_); }
  void SetTotal(std::uint64_t total) { total_ = total; } // what the file should hold, for messages

  void Read(std::uint64_t offset, void* out, std::uint64_t bytes, const Progress& progress = {})
  {
    if (compressed_) {
      if (!inflater_ || offset < inflater_->Position()) {
        stream_.clear();
        inflater_ = std::make_unique<Inflater>(stream_, 0, path_, std::max(total_, offset + bytes));
      }
      inflater_->Read(nullptr, offset - inflater_->Position());
      inflater_->Read(out, bytes, progress);
      return;
    }
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    for (std::uint64_t done = 0; done < bytes;) {
      const std::uint64_t piece = std::min<std::uint64_t>(bytes - done, 1 << 24);
      stream_.read(static_cast<char*>(out) + done, static_cast<std::streamsize>(piece));
      done += static_cast<std::uint64_t>(stream_.gcount());
      if (!stream_)
        throw Error(Error::Kind::BadFile, path_ + ": the data end early, after " + std::to_string(offset + done) + " of " +
                                              std::to_string(std::max(total_, offset + bytes)) + " bytes: the file is truncated");
      progress(static_cast<double>(done) / static_cast<double>(bytes));
    }
  }
  // After the last byte of the file's content was read.
  void Finish()
  {
    if (compressed_)
      inflater_->Finish();
  }

private:
  std::string path_;
  std::ifstream stream_;
  bool compressed_ = false;
  std::uint64_t fileBytes_ = 0, total_ = 0;
  std::unique_ptr<Inflater> inflater_;
};

// stored * slope + intercept. The stored numbers are the last bytes of the memory that the results fill, which are at least
// as long: from front to back no number is overwritten before it is used.
template <class Stored, class Scaled>
void ScaleInPlace(Scaled* values, std::size_t count, double slope, double intercept)
{
  static_assert(sizeof(Scaled) >= sizeof(Stored));
  const char* stored = reinterpret_cast<const char*>(values) + count * (sizeof(Scaled) - sizeof(Stored));
  for (std::size_t i = 0; i < count; ++i, stored += sizeof(Stored)) {
    Stored value;
    std::memcpy(&value, stored, sizeof value);
    const Scaled scaled = static_cast<Scaled>(static_cast<double>(value) * slope + intercept);
    std::memcpy(values + i, &scaled, sizeof scaled);
  }
}

class NiftiSource : public VolumeSource {
public:
  explicit NiftiSource(const std::string& path)
  {
    content_.path = stored_.path = path;
    content_.format = FileFormat::Nifti;
    ReadHeader();
  }
  void Read(std::size_t index, void* voxels, unsigned char* valid, const Progress& progress) override;

private:
  [[noreturn]] void Fail(const std::string& reason) const { throw Error(Error::Kind::BadFile, content_.path + ": " + reason); }
  void Note(const std::string& note) { content_.notes.push_back(note); }
  void ReadHeader();
  void ReadDimensions(const Fields& fields);
  void ReadTimes(const Fields& fields);
  void ReadType(const Fields& fields);
  void ReadGeometry(const Fields& fields);
  Eigen::Matrix<double, 3, 4> AffineOf(const Fields& fields);
  void ReadExtensions(PlainOrGzip& file, std::uint64_t at, bool swap);
  void ReadComment(const std::string& text);
  void CheckSizes();
  PlainOrGzip& Data();

  ImageHeader stored_; // geometry, type and order of the voxels as they are in the file
  double slope_ = 1.0, intercept_ = 0.0, offset_ = 0.0;
  std::int64_t volumes_ = 1;
  std::unique_ptr<PlainOrGzip> data_;
};

void NiftiSource::ReadHeader()
{
  PlainOrGzip file(content_.path);
  std::string bytes(4, '\0');
  file.Read(0, bytes.data(), bytes.size());
  bool swap = false;
  const int version = VersionOf(bytes, swap);
  if (version == 0)
    Fail("the content is not NIfTI");
  const std::size_t size = static_cast<std::size_t>(SizeOfHeader[version]);
  bytes.resize(size);
  file.SetTotal(size);
  file.Read(4, bytes.data() + 4, size - 4);
  const std::string magic = bytes.substr(Layouts[version].magic, 4);
  const std::string number = std::to_string(version);
  if (magic != "n+" + number + std::string(1, '\0') && magic != "ni" + number + std::string(1, '\0'))
    Fail(version == 1 ? "it is an ANALYZE 7.5 header (or the magic of NIfTI is damaged), which says nothing of the orientation"
                      : "the magic of NIfTI-2 is damaged");
  const Bytes view(bytes, swap);
  Fields fields = version == 1 ? Parse<1>(view) : Parse<2>(view);
  fields.bigEndian = (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) != swap;
  fields.pair = magic[1] == 'i';

  stored_.bigEndian = fields.bigEndian;
  ReadDimensions(fields);
  ReadType(fields);
  offset_ = fields.offset;
  stored_.dataPath = content_.path;
  if (fields.pair) {
    std::string stem = content_.path;
    const std::string end = fs::path(stem).extension() == ".gz" ? ".hdr.gz" : ".hdr";
    if (stem.size() <= end.size() || stem.compare(stem.size() - end.size(), end.size(), end) != 0)
      Fail("it is the header of a pair (.hdr, .img), and its name does not end in .hdr");
    stem.resize(stem.size() - end.size());
    std::error_code error;
    stored_.dataPath =
        fs::exists(stem + ".img", error) || !fs::exists(stem + ".img.gz", error) ? stem + ".img" : stem + ".img.gz";
    if (!fs::exists(stored_.dataPath, error))
      throw Error(Error::Kind::FileSystem, stored_.dataPath + ": there is no such file, though " + content_.path + " needs it");
  } else {
    const double least = static_cast<double>(size) + 4.0;
    if (offset_ == 0.0) {
      Note("the file does not say where its voxels begin: right after the header was assumed");
      offset_ = least;
    }
    if (!(offset_ >= static_cast<double>(size)))
      Fail("vox_offset is " + NumberText(offset_) + ", inside the header");
  }
  if (!(offset_ >= 0.0 && offset_ <= 9e15) || offset_ != std::floor(offset_))
    Fail("vox_offset is " + NumberText(offset_) + ", which is no place in a file");
  CheckSizes(); // before loops whose length the header tells
  ReadTimes(fields);
  ReadGeometry(fields);
  if (!fields.description.empty() && fields.description != OwnDescription)
    content_.fields.emplace_back("descrip", fields.description);
  if (!fields.intentName.empty())
    content_.fields.emplace_back("intent_name", fields.intentName);
  ReadExtensions(file, size, swap);
}

void NiftiSource::ReadDimensions(const Fields& fields)
{
  const std::int64_t count = fields.dim[0];
  if (count < 1 || count > 7)
    Fail("dim[0] is " + std::to_string(count) + "; a file has 1 to 7 dimensions");
  std::array<std::int64_t, 8> dim;
  dim.fill(1);
  for (std::size_t i = 1; i <= static_cast<std::size_t>(count); ++i) {
    dim[i] = fields.dim[i];
    if (dim[i] < 1 || dim[i] > std::numeric_limits<int>::max())
      Fail("dim[" + std::to_string(i) + "] is " + std::to_string(dim[i]) + ", which is not a possible size");
  }
  if (dim[5] * dim[6] > 1 || dim[7] > 1)
    Fail("it has several numbers per voxel (dim[5] to dim[7] are " + std::to_string(dim[5]) + ", " + std::to_string(dim[6]) +
         ", " + std::to_string(dim[7]) + "); one is needed");
  stored_.geometry.dimensions = {static_cast<int>(dim[1]), static_cast<int>(dim[2]), static_cast<int>(dim[3])};
  volumes_ = dim[4];
}

void NiftiSource::ReadType(const Fields& fields)
{
  const auto* found = std::find_if(std::begin(TypeCodes), std::end(TypeCodes),
                                   [&](const TypeCode& known) { return known.code == fields.datatype; });
  if (found == std::end(TypeCodes))
    Fail("its voxels are " + std::string(NameOfOther(fields.datatype)) + " (datatype " + std::to_string(fields.datatype) +
         "), which are not supported");
  stored_.type = content_.type = found->type;
  if (fields.slope == 0.0 || std::isnan(fields.slope) || (fields.slope == 1.0 && fields.intercept == 0.0))
    return;
  if (!std::isfinite(fields.slope) || !std::isfinite(fields.intercept))
    Fail("scl_slope or scl_inter is not finite");
  slope_ = fields.slope;
  intercept_ = fields.intercept;
  const bool narrow = SizeOf(stored_.type) <= 2 || stored_.type == VoxelType::Float32;
  content_.type = narrow ? VoxelType::Float32 : VoxelType::Float64;
  Note("the stored numbers were scaled as the file says: times " + NumberText(slope_) + " plus " + NumberText(intercept_));
}

void NiftiSource::ReadTimes(const Fields& fields)
{
  if (volumes_ == 1)
    return;
  double unit = 1.0;
  switch (fields.units & 0x38) {
  case 0:
  case 8:
    break;
  case 16:
    unit = 1e-3;
    break;
  case 24:
    unit = 1e-6;
    break;
  default:
    Fail("its fourth axis is not time (xyzt_units is " + std::to_string(fields.units) + ")");
  }
  double step = fields.pixdim[4] * unit, start = fields.timeOffset * unit;
  if (!(step > 0.0) || !std::isfinite(step)) {
    Note("the file does not say how far its " + std::to_string(volumes_) + " volumes are apart: 1 s was assumed");
    step = 1.0;
  } else if ((fields.units & 0x38) == 0)
    Note("the file does not name the unit of its time steps: seconds were assumed");
  if (!std::isfinite(start))
    start = 0.0;
  for (std::int64_t i = 0; i < volumes_; ++i)
    content_.times.push_back(start + static_cast<double>(i) * step);
  if (!(content_.times[0] < content_.times[1]) || !std::isfinite(content_.times.back()))
    Fail("its times do not increase (pixdim[4] is " + NumberText(fields.pixdim[4]) + ", toffset " +
         NumberText(fields.timeOffset) + ")");
}

// Index to RAS in the file's unit.
Eigen::Matrix<double, 3, 4> NiftiSource::AffineOf(const Fields& fields)
{
  Eigen::Matrix<double, 3, 4> affine;
  if (fields.sformCode > 0) {
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        affine(row, column) = fields.srow[static_cast<std::size_t>(4 * row + column)];
    if (!affine.allFinite())
      Fail("its sform holds a number that is not finite");
    return affine;
  }
  Eigen::Vector3d spacing(fields.pixdim[1], fields.pixdim[2], fields.pixdim[3]);
  if (stored_.geometry.dimensions[2] == 1 && !(spacing[2] > 0.0))
    spacing[2] = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    if (!(spacing[axis] > 0.0) || !std::isfinite(spacing[axis]))
      Fail("pixdim[" + std::to_string(axis + 1) + "] is " + NumberText(spacing[axis]) + "; a spacing must be positive");
  affine.setIdentity();
  affine.leftCols<3>() *= spacing.asDiagonal();
  if (fields.qformCode <= 0) {
    Note("the file holds no pose (sform and qform are not set): its axes were taken as right, anterior, superior, from the "
         "origin");
    return affine;
  }
  const Eigen::Map<const Eigen::Vector3d> imaginary(fields.quaternion.data()), offset(fields.quaternion.data() + 3);
  const double squares = imaginary.squaredNorm();
  if (!imaginary.allFinite() || !offset.allFinite())
    Fail("its qform holds a number that is not finite");
  if (squares > 1.001)
    Fail("the quaternion of its qform is longer than 1");
  const Eigen::Quaterniond rotation(std::sqrt(std::max(0.0, 1.0 - squares)), imaginary[0], imaginary[1], imaginary[2]);
  if (fields.pixdim[0] < 0.0) // qfac: a mirrored third axis
    spacing[2] = -spacing[2];
  affine.leftCols<3>() = rotation.normalized().toRotationMatrix() * spacing.asDiagonal();
  affine.col(3) = offset;
  return affine;
}

void NiftiSource::ReadGeometry(const Fields& fields)
{
  Eigen::Matrix<double, 3, 4> affine = AffineOf(fields);
  affine.topRows<2>() = -affine.topRows<2>().eval(); // RAS to LPS
  switch (fields.units & 7) {
  case 0:
    Note("the file does not name its unit of length: mm was assumed");
    break;
  case 1:
    affine *= 1000.0;
    break;
  case 2:
    break;
  case 3:
    affine *= 0.001;
    break;
  default:
    Fail("its unit of length is unknown (xyzt_units is " + std::to_string(fields.units) + ")");
  }
  PlaceAffine(stored_, affine);
  for (const std::string& note : stored_.notes)
    Note(note);
  content_.geometry = stored_.geometry;
}

void NiftiSource::ReadExtensions(PlainOrGzip& file, std::uint64_t at, bool swap)
{
  const bool pair = stored_.dataPath != content_.path; // then they go on to the end of the header's file
  if (pair && file.Compressed())
    return Note("extensions of a compressed header are not looked for");
  const std::uint64_t end = pair ? static_cast<std::uint64_t>(file.FileBytes()) : static_cast<std::uint64_t>(offset_);
  char announcement = 0;
  if (at + 4 > end)
    return;
  file.SetTotal(end);
  file.Read(at, &announcement, 1);
  if (announcement == 0)
    return;
  int others = 0;
  for (at += 4; at + 16 <= end;) {
    char head[8];
    file.Read(at, head, 8);
    const std::int32_t size = Bytes({head, 8}, swap).At<std::int32_t>(0), code = Bytes({head, 8}, swap).At<std::int32_t>(4);
    if (size == 0 && code == 0)
      break; // padding
    if (size < 16 || at + static_cast<std::uint64_t>(size) > end)
      Fail("an extension of the header has " + std::to_string(size) + " bytes, which do not fit before the voxels");
    // Ours begins with a known line; another program's comment is not worth reading, however long.
    const std::uint64_t length = static_cast<std::uint64_t>(size) - 8;
    std::string text(std::min<std::uint64_t>(length, CommentStart.size()), '\0');
    file.Read(at + 8, text.data(), text.size());
    if (code == CommentCode && text == CommentStart) {
      while (text.size() < length) { // piece by piece: only what is there is allocated
        const std::size_t done = text.size();
        text.resize(std::min<std::uint64_t>(length, done + 65536));
        file.Read(at + 8 + done, text.data() + done, text.size() - done);
      }
      text.erase(std::min(text.find('\0'), text.size()));
      ReadComment(text);
    } else
      ++others;
    at += static_cast<std::uint64_t>(size);
  }
  if (others > 0)
    Note(std::to_string(others) + (others > 1 ? " extensions" : " extension") +
         " of the header (of other programs) cannot be kept");
}

// What NiftiHeaderText made: a line with the exact geometry, then key=value lines.
void NiftiSource::ReadComment(const std::string& text)
{
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string_view> words = HeaderLines::Words(std::string_view(line).substr(CommentStart.size()));
  std::array<double, 15> numbers;
  bool good = words.size() == numbers.size();
  for (std::size_t i = 0; good && i < numbers.size(); ++i)
    good = ParseNumber(words[i], numbers[i]);
  if (!good)
    Fail("the geometry in the extension of its header is damaged");
  ImageGeometry exact = stored_.geometry;
  exact.origin = Eigen::Map<const Eigen::Vector3d>(numbers.data());
  exact.spacing = Eigen::Map<const Eigen::Vector3d>(numbers.data() + 3);
  exact.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data() + 6);
  bool agrees = exact.AgreesWith(stored_.geometry, 1e-2) && !stored_.reverseSlices;
  try {
    exact.Check(content_.path);
  } catch (const Error&) {
    agrees = false;
  }
  if (agrees)
    content_.geometry = exact;
  else
    Note("another program has changed the geometry since Echorama wrote it: the new one was taken");
  while (std::getline(lines, line))
    if (const std::size_t equals = line.find('='); equals != std::string::npos)
      content_.fields.emplace_back(line.substr(0, equals), line.substr(equals + 1));
}

PlainOrGzip& NiftiSource::Data()
{
  if (!data_)
    data_ = std::make_unique<PlainOrGzip>(stored_.dataPath);
  return *data_;
}

void NiftiSource::CheckSizes()
{
  const auto& d = stored_.geometry.dimensions;
  const double voxels = static_cast<double>(d[0]) * d[1] * d[2],
               bytes = offset_ + voxels * static_cast<double>(SizeOf(stored_.type)) * static_cast<double>(volumes_);
  const double there = Data().FileBytes();
  std::string says = "its dimensions (" + std::to_string(d[0]) + " x " + std::to_string(d[1]) + " x " + std::to_string(d[2]);
  says += (volumes_ > 1 ? ", " + std::to_string(volumes_) + " volumes" : "") + ") need " + NumberText(bytes) + " bytes";
  const auto fail = [&](const std::string& reason) {
    throw Error(Error::Kind::BadFile, stored_.dataPath + ": " + says + reason);
  };
  if (data_->Compressed()) {
    if (bytes > there * static_cast<double>(LargestCompressionRatio))
      fail(", more than " + NumberText(there) + " compressed bytes can hold");
  } else if (bytes > there)
    fail(", and it holds " + NumberText(there) + ": it is truncated or the dimensions are wrong");
  else if (bytes < there)
    fail(", and it holds " + NumberText(there) + ": the dimensions or the type are wrong");
  data_->SetTotal(static_cast<std::uint64_t>(bytes));
  CheckMemory(content_.path, voxels * static_cast<double>(SizeOf(content_.type)));
}

void NiftiSource::Read(std::size_t index, void* voxels, unsigned char*, const Progress& progress)
{
  const std::uint64_t bytes = stored_.ByteCount(), begin = static_cast<std::uint64_t>(offset_) + index * bytes;
  const std::size_t count = stored_.geometry.VoxelCount();
  const bool scaled = slope_ != 1.0 || intercept_ != 0.0;
  char* const target = static_cast<char*>(voxels) + (scaled ? count * SizeOf(content_.type) - bytes : 0);
  try {
    Data().Read(begin, target, bytes, progress);
    if (index + 1 == content_.Volumes())
      data_->Finish();
  } catch (...) {
    data_.reset(); // it cannot go on from here
    throw;
  }
  ArrangeVoxels(stored_, target);
  if (scaled)
    DispatchVoxelType(stored_.type, [&](auto zero) {
      using Stored = decltype(zero);
      if (content_.type == VoxelType::Float64)
        ScaleInPlace<Stored>(static_cast<double*>(voxels), count, slope_, intercept_);
      else if constexpr (sizeof(Stored) <= sizeof(float))
        ScaleInPlace<Stored>(static_cast<float*>(voxels), count, slope_, intercept_);
    });
}

// Puts numbers into a header of zeros.
class HeaderBytes {
public:
  explicit HeaderBytes(int version) : bytes_(static_cast<std::size_t>(SizeOfHeader[version]), '\0')
  {
    Put<std::int32_t>(0, SizeOfHeader[version]);
  }
  template <class T>
  void Put(std::size_t offset, T value)
  {
    std::memcpy(bytes_.data() + offset, &value, sizeof value);
  }
  void PutText(std::size_t offset, const std::string& text) { bytes_.replace(offset, text.size(), text); }
  const std::string& Content() const { return bytes_; }

private:
  std::string bytes_;
};

template <int Version>
std::string HeaderText(const ImageHeader& header, const std::string& description, std::size_t offset, double& loss)
{
  constexpr bool one = Version == 1;
  using Real = std::conditional_t<one, float, double>;
  using Size = std::conditional_t<one, std::int16_t, std::int64_t>;
  using Code = std::conditional_t<one, std::int16_t, std::int32_t>;
  using Offset = std::conditional_t<one, float, std::int64_t>;
  const Layout& at = Layouts[Version];
  const ImageGeometry& g = header.geometry;
  HeaderBytes bytes(Version);
  const auto size = [&](std::size_t i, int value) { bytes.Put(at.dim + i * sizeof(Size), static_cast<Size>(value)); };
  const auto real = [&](std::size_t offset0, std::size_t i, double value) {
    bytes.Put(offset0 + i * sizeof(Real), static_cast<Real>(value));
  };
  size(0, 3);
  real(at.pixdim, 0, 1.0); // right-handed
  for (std::size_t i = 1; i < 8; ++i) {
    size(i, i <= 3 ? g.dimensions[i - 1] : 1);
    real(at.pixdim, i, i <= 3 ? g.spacing[static_cast<Eigen::Index>(i) - 1] : 0.0);
  }
  const auto* code =
      std::find_if(std::begin(TypeCodes), std::end(TypeCodes), [&](const TypeCode& known) { return known.type == header.type; });
  bytes.Put(at.datatype, static_cast<std::int16_t>(code->code));
  bytes.Put(at.datatype + 2, static_cast<std::int16_t>(8 * SizeOf(header.type)));
  bytes.Put(at.offset, static_cast<Offset>(offset));
  real(at.slope, 0, 1.0);
  if (one)
    bytes.Put(at.units, static_cast<unsigned char>(2)); // mm
  else
    bytes.Put(at.units, std::int32_t{2});
  bytes.PutText(at.description, description);
  bytes.Put(at.qformCode, static_cast<Code>(1)); // coordinates of the scanner
  bytes.Put(at.sformCode, static_cast<Code>(1));

  Eigen::Affine3d ras = g.IndexToWorld();
  ras.matrix().topRows<2>() = -ras.matrix().topRows<2>().eval();
  Eigen::Matrix3d rotation = g.direction;
  rotation.topRows<2>() = -rotation.topRows<2>().eval();
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0.0)
    q.coeffs() = -q.coeffs();
  for (int row = 0; row < 3; ++row) {
    const std::size_t r = static_cast<std::size_t>(row);
    real(at.quaternion, r, q.vec()[row]);
    real(at.quaternion, 3 + r, ras.translation()[row]);
    for (int column = 0; column < 4; ++column)
      real(at.srow, 4 * r + static_cast<std::size_t>(column), ras(row, column));
  }
  // The loss, from the header as others will read it.
  const std::array<double, 12> srow = Parse<Version>(Bytes(bytes.Content(), false)).srow;
  Eigen::Matrix<double, 3, 4> rounding = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(srow.data());
  rounding -= ras.matrix().topRows<3>();
  loss = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector4d index(corner & 1 ? g.dimensions[0] - 1 : 0, corner & 2 ? g.dimensions[1] - 1 : 0,
                                corner & 4 ? g.dimensions[2] - 1 : 0, 1.0);
    loss = std::max(loss, (rounding * index).norm());
  }
  bytes.PutText(at.magic, one ? std::string("n+1\0", 4) : std::string("n+2\0\r\n\032\n", 8));
  return bytes.Content();
}

} // namespace

bool LooksLikeNifti(std::string_view start)
{
  std::string inflated(4, '\0');
  if (start.size() >= 2 && static_cast<unsigned char>(start[0]) == 0x1f && static_cast<unsigned char>(start[1]) == 0x8b) {
    std::istringstream stream{std::string(start)};
    try {
      Inflater(stream, 0, "", inflated.size()).Read(inflated.data(), inflated.size());
    } catch (const Error&) {
      return false;
    }
    start = inflated;
  }
  bool swap = false;
  return VersionOf(start, swap) != 0;
}

std::unique_ptr<VolumeSource> OpenNifti(const std::string& path)
{
  return std::make_unique<NiftiSource>(path);
}

std::string NiftiHeaderText(const std::string& path, const ImageHeader& header, double& roundingMm)
{
  const ImageGeometry& g = header.geometry;
  if (!(std::max(g.origin.norm(), g.spacing.norm()) < static_cast<double>(std::numeric_limits<float>::max())))
    throw Error(Error::Kind::BadInput,
                path + ": its geometry is beyond the range of 32-bit floats, which is all that NIfTI-1 has");
  std::string description = OwnDescription;
  std::string comment = CommentStart;
  const auto add = [&](const auto& numbers) {
    for (Eigen::Index i = 0; i < numbers.size(); ++i)
      comment += " " + NumberText(numbers.data()[i]);
  };
  add(g.origin);
  add(g.spacing);
  add(Eigen::Matrix3d(g.direction.transpose())); // row by row
  comment += "\n";
  for (const HeaderField& field : header.fields) {
    if (field.first == "descrip" && field.second.size() < 80)
      description = field.second;
    else
      comment += field.first + "=" + field.second + "\n";
  }
  comment.resize((comment.size() + 8 + 15) / 16 * 16 - 8, '\0');
  if (comment.size() > (1u << 27)) // vox_offset is a float
    throw Error(Error::Kind::BadInput, path + ": its fields are too long for a header");

  const int version = *std::max_element(g.dimensions.begin(), g.dimensions.end()) > 32767 ? 2 : 1;
  const std::size_t offset = static_cast<std::size_t>(SizeOfHeader[version]) + 4 + 8 + comment.size();
  std::string start = version == 1 ? HeaderText<1>(header, description, offset, roundingMm)
                                   : HeaderText<2>(header, description, offset, roundingMm);
  start += std::string("\1\0\0\0", 4);
  for (const std::int32_t number : {static_cast<std::int32_t>(comment.size() + 8), std::int32_t{CommentCode}})
    start.append(reinterpret_cast<const char*>(&number), sizeof number);
  return start + comment;
}

} // namespace echorama
