// SPDX-License-Identifier: BSD-3-Clause
// Voxels go from the file straight into the caller's memory; swapping bytes and reversing slices happen in place. What a
// header promises is compared with what the disk holds first: a lying header must not make us ask for terabytes.
#include "Readers/VolumeFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Readers/ByteOrder.h"
#include "Readers/Compression.h"
#include "Readers/DataFile.h"
#include "Readers/HeaderLines.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

namespace fs = std::filesystem;

namespace echorama {
namespace {

std::uint64_t SizeOfData(const ImageHeader& header)
{
  const std::string& path = header.dataPath;
  std::error_code error;
  if (!fs::exists(path, error))
    throw Error(Error::Kind::FileSystem, path + ": there is no such file, though " + header.path + " names it");
  return FileSize(path);
}

template <class T>
void ReadText(std::istream& stream, const ImageHeader& header, T* out, const Progress& progress)
{
  const std::size_t count = header.geometry.VoxelCount();
  std::string word;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(stream >> word))
      FailFile(header.dataPath, "the data end early, after " + std::to_string(i) + " of " + std::to_string(count) + " numbers");
    // Some programs write whole numbers with a decimal point.
    double real = 0.0;
    if (!ParseNumber(word, out[i])) {
      if (!ParseNumber(word, real) || std::is_floating_point_v<T> || real != std::floor(real) ||
          !(real >= static_cast<double>(std::numeric_limits<T>::lowest()) && std::fabs(real) < 9e15 &&
            real <= static_cast<double>(std::numeric_limits<T>::max())))
        FailFile(header.dataPath,
                 "voxel " + std::to_string(i + 1) + " is \"" + word.substr(0, 40) + "\", which its type cannot hold");
      out[i] = static_cast<T>(real);
    }
    if (i % 1000000 == 0)
      progress(static_cast<double>(i) / static_cast<double>(count));
  }
  if (stream >> word)
    FailFile(header.dataPath, "it holds more numbers than its dimensions (" + SizeText(header.geometry.dimensions) + ") say");
}

void ReverseSlices(char* bytes, std::size_t slice, int slices)
{
  for (std::size_t front = 0, back = static_cast<std::size_t>(slices) - 1; front < back; ++front, --back)
    std::swap_ranges(bytes + front * slice, bytes + (front + 1) * slice, bytes + back * slice);
}

// To the first byte of the data.
void SeekData(const ImageHeader& header, std::istream& stream)
{
  if (header.dataOffset < 0)
    stream.seekg(-static_cast<std::streamoff>(header.ByteCount()), std::ios::end);
  else
    stream.seekg(header.dataOffset);
}

// Checks all of CheckVolume but the memory for the voxels.
void CheckContent(const ImageHeader& header)
{
  const std::string& path = header.path;
  if (!header.typeIsKnown)
    FailFile(path, "its voxels are of a type that is not supported");
  if (header.components != 1)
    FailFile(path, "it has " + std::to_string(header.components) + " numbers per voxel; one is needed");
  CheckGeometry(path, header.geometry);
  const double voxels = static_cast<double>(header.geometry.VoxelCount()),
               bytes = voxels * static_cast<double>(SizeOf(header.type));
  const std::uint64_t fileBytes = SizeOfData(header);
  const std::uint64_t offset = static_cast<std::uint64_t>(std::max<std::int64_t>(0, header.dataOffset));
  const double there = fileBytes > offset ? static_cast<double>(fileBytes - offset) : 0.0;
  const std::string says = "its dimensions (" + SizeText(header.geometry.dimensions) + ")";
  if (header.encoding != ImageHeader::Encoding::Text)
    CheckBytes(header.dataPath, says, bytes, there, header.encoding == ImageHeader::Encoding::Zlib, header.dataOffset >= 0);
  else if ((there + 1.0) / 2.0 < voxels)
    FailFile(header.dataPath, says + " need more numbers than " + NumberText(there) + " characters can hold");
}

class HeaderVolume : public VolumeSource {
public:
  explicit HeaderVolume(const std::string& path) : VolumeSource(path, FileFormat::Unknown), header_(ReadImageHeader(path))
  {
    CheckContent(header_);
    content_.format = header_.format;
    content_.geometry = header_.geometry;
    content_.lastSliceFirst = header_.reverseSlices;
    content_.type = header_.type;
    content_.fields = header_.fields;
    content_.notes = header_.notes;
  }

  void Read(std::size_t, void* voxels, unsigned char*, const Progress& progress) override
  {
    ReadVoxels(header_, voxels, progress);
  }

  bool ReadsSlices() const override { return header_.encoding != ImageHeader::Encoding::Text; }

  void ReadSlices(std::size_t, int first, int count, void* voxels, const Progress& progress) override
  {
    ImageHeader part = header_;
    part.geometry.dimensions[2] = count;
    const int slices = header_.geometry.dimensions[2], from = header_.reverseSlices ? slices - first - count : first;
    const std::uint64_t before = header_.ByteCount() / static_cast<std::uint64_t>(slices) * static_cast<std::uint64_t>(from);
    if (header_.encoding == ImageHeader::Encoding::Raw) {
      std::ifstream stream = OpenToRead(header_.dataPath);
      SeekData(header_, stream);
      stream.seekg(static_cast<std::streamoff>(before), std::ios::cur);
      if (const std::uint64_t there = ReadPieces(stream, voxels, part.ByteCount(), progress); there < part.ByteCount())
        FailFile(header_.dataPath, "the data end early, after " + std::to_string(before + there) + " of " +
                                       std::to_string(header_.ByteCount()) + " bytes");
    } else {
      const std::uint64_t position = header_.skipDecoded + before;
      std::unique_ptr<Inflater> inflater = std::move(inflater_); // gone after an error
      if (!inflater || inflater->Position() > position) {
        stream_ = OpenToRead(header_.dataPath);
        SeekData(header_, stream_);
        inflater =
            std::make_unique<Inflater>(stream_, stream_.tellg(), header_.dataPath, header_.skipDecoded + header_.ByteCount());
      }
      inflater->Read(nullptr, position - inflater->Position());
      inflater->Read(voxels, part.ByteCount(), progress);
      if (from + count == slices)
        inflater->Finish();
      else
        inflater_ = std::move(inflater);
    }
    ArrangeVoxels(part, voxels);
  }

private:
  ImageHeader header_;
  std::ifstream stream_; // of compressed data that are read slice by slice
  std::unique_ptr<Inflater> inflater_;
};

} // namespace

void CheckVolume(const ImageHeader& header)
{
  CheckContent(header);
  CheckMemory(header.path, static_cast<double>(header.ByteCount()));
}

void ReadVoxels(const ImageHeader& header, void* voxels, const Progress& progress)
{
  const std::uint64_t bytes = header.ByteCount();
  std::ifstream stream = OpenToRead(header.dataPath);
  SeekData(header, stream);

  switch (header.encoding) {
  case ImageHeader::Encoding::Raw:
    if (const std::uint64_t there = ReadPieces(stream, voxels, bytes, progress); there < bytes)
      FailFile(header.dataPath, "the data end early, after " + std::to_string(there) + " of " + std::to_string(bytes) + " bytes");
    break;
  case ImageHeader::Encoding::Zlib:
    Decompress(stream, header.dataPath, header.skipDecoded, voxels, bytes, progress);
    break;
  case ImageHeader::Encoding::Text:
    DispatchVoxelType(header.type, [&](auto zero) { ReadText(stream, header, static_cast<decltype(zero)*>(voxels), progress); });
    break;
  }
  ArrangeVoxels(header, voxels);
}

void ArrangeVoxels(const ImageHeader& header, void* voxels)
{
  char* const bytes = static_cast<char*>(voxels);
  if (header.encoding != ImageHeader::Encoding::Text && header.bigEndian != HostIsBigEndian)
    SwapBytes(bytes, SizeOf(header.type), header.geometry.VoxelCount());
  if (header.reverseSlices)
    ReverseSlices(bytes, header.ByteCount() / static_cast<std::size_t>(header.geometry.dimensions[2]),
                  header.geometry.dimensions[2]);
}

std::unique_ptr<VolumeSource> OpenHeaderVolume(const std::string& path)
{
  return std::make_unique<HeaderVolume>(path);
}

std::string CompanionPath(const std::string& path, const std::string& array)
{
  const fs::path main = path;
  fs::path stem = main.stem(), extension = main.extension();
  if (FormatOfName(path) == FileFormat::Nifti && stem.has_extension() && extension.string().size() == 3) { // .nii.gz is one
    extension = stem.extension().string() + extension.string();
    stem = stem.stem();
  }
  return (main.parent_path() / (stem.string() + "." + array + extension.string())).string();
}

} // namespace echorama
