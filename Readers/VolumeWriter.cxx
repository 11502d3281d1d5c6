// SPDX-License-Identifier: BSD-3-Clause
// Of all that a header says, only the size of compressed voxels in a MetaImage depends on the voxels; it has a place kept
// free for it, which Finish() fills. So voxels follow their header as they come, and no more than the 32 MB of the compressor are
// held.
#include "Readers/VolumeWriter.h"
#include "Core/Base/Error.h"
#include "Readers/ByteOrder.h"
#include "Readers/Compression.h"
#include "Readers/HeaderLines.h"
#include "Readers/NiftiHeader.h"
#include <algorithm>
#include <fstream>
#include <vector>

namespace echorama {
namespace {

constexpr std::uint64_t WrittenAtOnce = 1 << 24;

} // namespace

struct VolumeWriter::Parts {
  std::string path;
  FileReplacement& files;
  std::vector<std::string> temporaries{};
  std::ofstream stream{}, dataStream{}; // the second is open when the voxels have a file of their own
  std::unique_ptr<Deflater> deflater{};
  std::size_t compressedSizeAt = 0; // 0: nowhere
  std::uint64_t bytes = 0, appended = 0;
  double roundingMm = 0.0;

  std::ofstream& Target() { return dataStream.is_open() ? dataStream : stream; }
  void Open(std::ofstream& file, const std::string& target)
  {
    temporaries.push_back(files.Stage(target));
    file.open(temporaries.back(), std::ios::binary);
  }
  [[noreturn]] void Fail(Error::Kind kind, const std::string& reason) const { throw Error(kind, path + ": " + reason); }
  void CheckStreams() const
  {
    if (!stream || !dataStream)
      Fail(Error::Kind::FileSystem, "it cannot be written (is the disk full?); what was there is left as it was");
  }
};

VolumeWriter::VolumeWriter(const std::string& path, ImageHeader header, bool compress, FileReplacement& files)
  : parts_(new Parts{path, files})
{
  Parts& p = *parts_;
  header.format = FormatOfName(path);
  const bool meta = header.format == FileFormat::MetaImage, nifti = header.format == FileFormat::Nifti;
  if (!meta && !nifti && header.format != FileFormat::Nrrd)
    p.Fail(Error::Kind::InvalidParameter, "the extension must be .mha, .mhd, .nrrd, .nhdr, .nii or .nii.gz");
  header.geometry.Check(path);
  for (const HeaderField& field : header.fields)
    if (!CanHold(field))
      p.Fail(Error::Kind::BadInput, "the header cannot hold the field \"" + field.first + "\"");
  const std::string extension = LowerExtension(path);
  if (nifti)
    compress = extension == ".gz";
  header.encoding = compress ? ImageHeader::Encoding::Zlib : ImageHeader::Encoding::Raw;
  header.bigEndian = HostIsBigEndian;
  p.bytes = header.ByteCount();
  std::string dataFile;
  if (extension == ".mhd" || extension == ".nhdr")
    dataFile = DetachedName(path, !compress ? ".raw" : meta ? ".zraw" : ".raw.gz");
  const std::string text = nifti  ? NiftiHeaderText(path, header, p.roundingMm)
                           : meta ? MetaImageHeaderText(header, dataFile, p.compressedSizeAt)
                                  : NrrdHeaderText(header, dataFile);

  if (!dataFile.empty())
    p.Open(p.dataStream, DetachedPath(path, dataFile));
  p.Open(p.stream, path);
  const bool compressedHeader = nifti && compress;
  if (!compressedHeader)
    p.stream << text;
  if (compress)
    p.deflater = std::make_unique<Deflater>(p.Target(), meta ? CompressedForm::Zlib : CompressedForm::Gzip);
  if (compressedHeader)
    p.deflater->Append(text.data(), text.size());
  p.CheckStreams();
}

VolumeWriter::~VolumeWriter() = default;

double VolumeWriter::RoundingMm() const
{
  return parts_->roundingMm;
}

void VolumeWriter::Append(const void* voxels, std::uint64_t bytes, const Progress& progress)
{
  Parts& p = *parts_;
  p.appended += bytes;
  if (p.deflater)
    p.deflater->Append(voxels, bytes, progress);
  else
    for (std::uint64_t done = 0; done < bytes && p.Target(); done += WrittenAtOnce) {
      p.Target().write(static_cast<const char*>(voxels) + done,
                       static_cast<std::streamsize>(std::min(WrittenAtOnce, bytes - done)));
      progress(static_cast<double>(done) / static_cast<double>(bytes));
    }
  p.CheckStreams();
}

void VolumeWriter::Finish(const Progress& progress)
{
  Parts& p = *parts_;
  if (p.appended != p.bytes)
    p.Fail(Error::Kind::BadInput,
           std::to_string(p.appended) + " bytes of voxels came, and its geometry needs " + std::to_string(p.bytes));
  const std::uint64_t size = p.deflater ? p.deflater->Finish(progress) : 0;
  if (p.deflater && p.compressedSizeAt > 0) {
    p.stream.seekp(static_cast<std::streamoff>(p.compressedSizeAt));
    p.stream << size;
  }
  p.stream.close();
  if (p.dataStream.is_open())
    p.dataStream.close();
  p.CheckStreams();
}

void VolumeWriter::Discard()
{
  for (const std::string& temporary : parts_->temporaries)
    parts_->files.Unstage(temporary);
  parts_->temporaries.clear();
}

double WriteVolume(const std::string& path, const ImageHeader& header, const void* voxels, bool compress, FileReplacement& files,
                   const Progress& progress)
{
  VolumeWriter writer(path, header, compress, files);
  // What the compressor holds back is as much work as any other piece.
  const double bytes = static_cast<double>(header.ByteCount()), appended = bytes / (bytes + (1 << 25));
  writer.Append(voxels, header.ByteCount(), progress.Part(0.0, appended));
  writer.Finish(progress.Part(appended, 1.0));
  return writer.RoundingMm();
}

} // namespace echorama
