// SPDX-License-Identifier: BSD-3-Clause
// A NIfTI file is a header (NiftiHeader.h), then extensions, then the voxels. We take it apart ourselves rather than with
// libnifti, which prints to stderr, believes every length and ends where a file does without saying so: here each number is
// checked against the file's size before anything is allocated, and voxels go through the same code as those of the other
// formats.
//
// Compressed time series are inflated in order; going back to an earlier volume starts over.
#include "Readers/NiftiFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Words.h"
#include "Readers/AffinePose.h"
#include "Readers/Compression.h"
#include "Readers/DataFile.h"
#include "Readers/HeaderLines.h"
#include "Readers/NiftiHeader.h"
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

// Reads a file, plain or gzip, from its beginning on; going back starts over.
class PlainOrGzip {
public:
  explicit PlainOrGzip(const std::string& path) : path_(path), stream_(OpenToRead(path)), fileBytes_(FileSize(path))
  {
    unsigned char magic[2] = {0, 0};
    stream_.read(reinterpret_cast<char*>(magic), 2);
    compressed_ = stream_.gcount() == 2 && magic[0] == 0x1f && magic[1] == 0x8b;
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
    if (const std::uint64_t there = ReadPieces(stream_, out, bytes, progress); there < bytes)
      FailFile(path_, "the data end early, after " + std::to_string(offset + there) + " of " +
                          std::to_string(std::max(total_, offset + bytes)) + " bytes: the file is truncated");
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
  std::uint64_t fileBytes_, total_ = 0;
  bool compressed_ = false;
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
  explicit NiftiSource(const std::string& path) : VolumeSource(path, FileFormat::Nifti)
  {
    stored_.path = path;
    ReadHeader();
  }
  void Read(std::size_t index, void* voxels, unsigned char*, const Progress& progress) override
  {
    ReadPart(index, 0, stored_.geometry.dimensions[2], voxels, progress);
  }
  bool ReadsSlices() const override { return true; }
  void ReadSlices(std::size_t index, int first, int count, void* voxels, const Progress& progress) override
  {
    ReadPart(index, first, count, voxels, progress);
  }

private:
  void ReadPart(std::size_t index, int first, int slices, void* voxels, const Progress& progress);
  void ReadHeader();
  void ReadDimensions(const NiftiHeader& fields);
  void ReadTimes(const NiftiHeader& fields);
  void ReadType(const NiftiHeader& fields);
  void ReadGeometry(const NiftiHeader& fields);
  Eigen::Matrix<double, 3, 4> AffineOf(const NiftiHeader& fields);
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
  const int version = NiftiVersion(bytes, swap);
  if (version == 0)
    Fail("the content is not NIfTI");
  const std::size_t size = NiftiHeaderSize(version);
  bytes.resize(size);
  file.SetTotal(size);
  file.Read(4, bytes.data() + 4, size - 4);
  const NiftiHeader fields = ParseNiftiHeader(version, {bytes, swap});
  const bool pair = fields.magic[1] == 'i';
  if (fields.magic != (pair ? "ni" : "n+") + std::to_string(version) + std::string(1, '\0'))
    Fail(version == 1 ? "it is an ANALYZE 7.5 header (or the magic of NIfTI is damaged), which says nothing of the orientation"
                      : "the magic of NIfTI-2 is damaged");

  stored_.bigEndian = HostIsBigEndian != swap;
  ReadDimensions(fields);
  ReadType(fields);
  offset_ = fields.offset;
  stored_.dataPath = content_.path;
  if (pair) {
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
  if (!fields.description.empty() && fields.description != NiftiDescription)
    content_.fields.emplace_back("descrip", fields.description);
  if (!fields.intentName.empty())
    content_.fields.emplace_back("intent_name", fields.intentName);
  ReadExtensions(file, size, swap);
}

void NiftiSource::ReadDimensions(const NiftiHeader& fields)
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

void NiftiSource::ReadType(const NiftiHeader& fields)
{
  const std::optional<VoxelType> type = NiftiVoxelType(fields.datatype);
  if (!type)
    Fail("its voxels are " + std::string(NiftiTypeName(fields.datatype)) + " (datatype " + std::to_string(fields.datatype) +
         "), which are not supported");
  stored_.type = content_.type = *type;
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

void NiftiSource::ReadTimes(const NiftiHeader& fields)
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
  content_.times.reserve(static_cast<std::size_t>(volumes_));
  for (std::int64_t i = 0; i < volumes_; ++i)
    content_.times.push_back(start + static_cast<double>(i) * step);
  if (!(content_.times[0] < content_.times[1]) || !std::isfinite(content_.times.back()))
    Fail("its times do not increase (pixdim[4] is " + NumberText(fields.pixdim[4]) + ", toffset " +
         NumberText(fields.timeOffset) + ")");
}

// Index to RAS in the file's unit.
Eigen::Matrix<double, 3, 4> NiftiSource::AffineOf(const NiftiHeader& fields)
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

void NiftiSource::ReadGeometry(const NiftiHeader& fields)
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
  content_.lastSliceFirst = stored_.reverseSlices;
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
    const NiftiBytes numbers({head, 8}, swap);
    const std::int32_t size = numbers.At<std::int32_t>(0), code = numbers.At<std::int32_t>(4);
    if (size == 0 && code == 0)
      break; // padding
    if (size < 16 || at + static_cast<std::uint64_t>(size) > end)
      Fail("an extension of the header has " + std::to_string(size) + " bytes, which do not fit before the voxels");
    // Ours begins with a known line; another program's comment is not worth reading, however long.
    const std::uint64_t length = static_cast<std::uint64_t>(size) - 8;
    std::string text(std::min<std::uint64_t>(length, NiftiCommentStart.size()), '\0');
    file.Read(at + 8, text.data(), text.size());
    if (code == NiftiCommentCode && text == NiftiCommentStart) {
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
  line.erase(0, NiftiCommentStart.size());
  const auto exact = GeometryOfText(line, stored_.geometry.dimensions);
  if (!exact)
    Fail("the geometry in the extension of its header is damaged");
  bool agrees = exact->AgreesWith(stored_.geometry, 1e-2) && !stored_.reverseSlices;
  try {
    exact->Check(content_.path);
  } catch (const Error&) {
    agrees = false;
  }
  if (agrees)
    content_.geometry = *exact;
  else {
    Note("another program has changed the geometry since Echorama wrote it: the new one was taken");
    content_.fields.emplace_back(GeometryField, line);
  }
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
  const std::string says =
      "its dimensions (" + SizeText(d) + (volumes_ > 1 ? ", " + std::to_string(volumes_) + " volumes" : "") + ")";
  PlainOrGzip& data = Data();
  CheckBytes(stored_.dataPath, says, bytes, data.FileBytes(), data.Compressed(), true);
  // A list of times costs memory per volume. Few are always possible: as many as NIfTI-1 can have.
  if (static_cast<double>(volumes_) > std::max(32767.0, data.FileBytes()))
    Fail("it says that it has " + std::to_string(volumes_) + " volumes, more than the bytes of the file");
  data.SetTotal(static_cast<std::uint64_t>(bytes));
}

// Some slices of a volume.
void NiftiSource::ReadPart(std::size_t index, int first, int slices, void* voxels, const Progress& progress)
{
  ImageHeader part = stored_;
  part.geometry.dimensions[2] = slices;
  const int all = stored_.geometry.dimensions[2], from = stored_.reverseSlices ? all - first - slices : first;
  const std::uint64_t bytes = part.ByteCount();
  const std::uint64_t begin = static_cast<std::uint64_t>(offset_) + index * stored_.ByteCount() +
                              stored_.ByteCount() / static_cast<std::uint64_t>(all) * static_cast<std::uint64_t>(from);
  const std::size_t count = part.geometry.VoxelCount();
  const bool scaled = slope_ != 1.0 || intercept_ != 0.0;
  char* const target = static_cast<char*>(voxels) + (scaled ? count * SizeOf(content_.type) - bytes : 0);
  try {
    Data().Read(begin, target, bytes, progress);
    if (index + 1 == content_.Volumes() && from + slices == all)
      data_->Finish();
  } catch (...) {
    data_.reset(); // it cannot go on from here
    throw;
  }
  ArrangeVoxels(part, target);
  if (scaled)
    DispatchVoxelType(stored_.type, [&](auto zero) {
      using Stored = decltype(zero);
      if (content_.type == VoxelType::Float64)
        ScaleInPlace<Stored>(static_cast<double*>(voxels), count, slope_, intercept_);
      else if constexpr (sizeof(Stored) <= sizeof(float))
        ScaleInPlace<Stored>(static_cast<float*>(voxels), count, slope_, intercept_);
    });
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
  return NiftiVersion(start, swap) != 0;
}

std::unique_ptr<VolumeSource> OpenNifti(const std::string& path)
{
  return std::make_unique<NiftiSource>(path);
}

} // namespace echorama
