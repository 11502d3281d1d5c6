// SPDX-License-Identifier: BSD-3-Clause
// The header comes before the pixels and grows with every frame, so the two are written side by side: the header, with blanks
// where the number of frames and the compressed size will stand, under the temporary name of the final file; the pixels,
// compressed on the way, in a file of their own. Finish() fills the blanks and, where one file is to hold both, appends the
// pixels: they are written twice, and the disk needs room for both copies. In memory there is never more than the 32 MB of
// the compressor.
#include "Readers/SequenceWriter.h"
#include "Core/Base/Error.h"
#include "Readers/ByteOrder.h"
#include "Readers/Compression.h"
#include "Readers/HeaderLines.h"
#include "Readers/SequenceText.h"
#include <filesystem>
#include <fstream>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr std::size_t FrameDigits = 10, SizeDigits = 20; // blanks that are left for numbers

} // namespace

struct SequenceWriter::Parts {
  std::string path;
  SequenceContent content;
  bool meta = true, compress = false;
  std::string pixelPath;   // where the pixels are written
  FileReplacement scratch; // holds that file when it is to be appended, and is never committed
  std::ofstream header, pixels;
  std::streamoff frameCountAt = 0, compressedSizeAt = 0; // 0: nowhere
  std::unique_ptr<Deflater> deflater;
  std::string dataFile; // its name, when it is detached
  int frames = 0;

  [[noreturn]] void Fail(Error::Kind kind, const std::string& reason) const { throw Error(kind, path + ": " + reason); }
  void CheckStreams() const
  {
    if (!header || (pixels.is_open() && !pixels))
      Fail(Error::Kind::FileSystem, "it cannot be written (is the disk full?); what was there is left as it was");
  }
  void Put(const std::string& key, const std::string& value) { header << key << (meta ? " = " : ": ") << value << "\n"; }
  void PutField(const std::string& key, const std::string& value)
  {
    header << key << (meta ? " = " : ":=") << (meta ? value : EscapedNrrd(value)) << "\n";
  }
  void WriteMetaImage();
  void WriteNrrd();
};

void SequenceWriter::Parts::WriteMetaImage()
{
  for (const auto& [key, value] : MetaImageSequenceFields(content, compress)) {
    if (key == "DimSize" && compress) {
      header << "CompressedDataSize = ";
      compressedSizeAt = header.tellp();
      header << std::string(SizeDigits, ' ') << "\n";
    }
    header << key << " = " << value;
    if (key == "DimSize") {
      frameCountAt = header.tellp();
      header << std::string(FrameDigits, ' ');
    }
    header << "\n";
  }
}

void SequenceWriter::Parts::WriteNrrd()
{
  const ImageGeometry& g = content.geometry;
  const bool vectors = content.components > 1; // an axis of numbers per pixel comes first
  header << "NRRD0004\n";
  Put("type", NrrdTypeName(content.type));
  Put("dimension", vectors ? "5" : "4");
  Put("space", "left-posterior-superior");
  header << "sizes: " << (vectors ? NumberText(content.components) + " " : "");
  for (const int size : content.dimensions)
    header << size << " ";
  frameCountAt = header.tellp();
  header << std::string(FrameDigits, ' ') << "\n";
  std::string directions = vectors ? "none " : "";
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    directions += VectorText(g.direction.col(axis) * g.spacing[axis]) + " ";
  Put("space directions", directions + "none");
  Put("kinds", vectors ? "vector domain domain domain list" : "domain domain domain list");
  Put("space origin", VectorText(g.origin));
  Put("encoding", compress ? "gzip" : "raw");
  Put("endian", HostIsBigEndian ? "big" : "little");
  if (!dataFile.empty())
    Put("data file", dataFile);
  PutField("ultrasound image orientation", "MF");
  PutField("ultrasound image type", content.imageType.empty() ? "BRIGHTNESS" : content.imageType);
}

SequenceWriter::SequenceWriter(const std::string& path, const SequenceContent& content, bool compress, FileReplacement& files)
  : parts_(new Parts)
{
  Parts& p = *parts_;
  p.path = path;
  p.content = content;
  const FileFormat format = FormatOfName(path);
  const std::string extension = fs::path(path).extension().string();
  if (format != FileFormat::MetaImage && format != FileFormat::Nrrd)
    p.Fail(Error::Kind::InvalidParameter, "the extension must be .mha, .mhd, .nrrd or .nhdr");
  p.meta = format == FileFormat::MetaImage;
  const char letter = extension[p.meta ? 3 : 2]; // .mhd, .nhdr
  const bool detached = letter == (p.meta ? 'd' : 'h') || letter == (p.meta ? 'D' : 'H');
  const bool images = p.content.HasImages();
  p.compress = compress && images;
  if (!images && !p.meta)
    p.Fail(Error::Kind::InvalidParameter, "NRRD cannot hold a sequence without images; .mha can");
  CheckSequence(path, p.content);

  if (images) {
    if (detached) {
      p.dataFile = DetachedName(path, !compress ? ".raw" : p.meta ? ".zraw" : ".raw.gz");
      p.pixelPath = files.Stage(DetachedPath(path, p.dataFile));
    } else
      p.pixelPath = p.scratch.Stage(path + ".pixels");
    p.pixels.open(p.pixelPath, std::ios::binary);
    if (p.compress)
      p.deflater = std::make_unique<Deflater>(p.pixels, p.meta ? CompressedForm::Zlib : CompressedForm::Gzip);
  }
  p.header.open(files.Stage(path), std::ios::binary);
  if (p.meta)
    p.WriteMetaImage();
  else
    p.WriteNrrd();
  for (const auto& [key, value] : p.content.fields)
    p.PutField(key, value);
  p.CheckStreams();
}

SequenceWriter::~SequenceWriter() = default;

void SequenceWriter::Append(const SequenceFrame& frame, const void* pixels, const Progress& progress)
{
  Parts& p = *parts_;
  if (p.frames == std::numeric_limits<int>::max())
    p.Fail(Error::Kind::TooLarge, "it cannot hold more than " + std::to_string(p.frames) + " frames");
  const std::string prefix = SequenceFramePrefix(p.frames);
  for (const auto& [key, value] : SequenceFrameFields(p.path, frame, p.frames, p.meta ? "ImageStatus" : "Status", pixels))
    p.PutField(prefix + key, value);

  if (p.content.HasImages()) {
    const std::uint64_t bytes = p.content.FrameBytes();
    std::vector<char> zeros(pixels ? 0 : bytes);
    const void* from = pixels ? pixels : zeros.data();
    if (p.deflater)
      p.deflater->Append(from, bytes, progress);
    else
      p.pixels.write(static_cast<const char*>(from), static_cast<std::streamsize>(bytes));
  }
  p.CheckStreams();
  ++p.frames;
}

void SequenceWriter::Finish(const Progress& progress)
{
  Parts& p = *parts_;
  if (p.frames == 0)
    p.Fail(Error::Kind::BadInput, "there are no frames to write");
  const std::uint64_t compressed = p.deflater ? p.deflater->Finish(progress.Part(0.0, 0.2)) : 0;
  if (p.pixels.is_open())
    p.pixels.close();
  if (p.meta)
    p.Put("ElementDataFile", p.dataFile.empty() ? "LOCAL" : p.dataFile);
  else
    p.header << (p.dataFile.empty() ? "\n" : "");
  const std::streamoff end = p.header.tellp();
  const auto fill = [&p](std::streamoff at, const std::string& text) {
    p.header.seekp(at);
    p.header << text;
  };
  const std::string count = std::to_string(p.frames); // Teem and what is made of it read no blanks after the sizes
  fill(p.frameCountAt, p.meta ? count : std::string(FrameDigits - count.size(), ' ') + count);
  if (p.compressedSizeAt > 0)
    fill(p.compressedSizeAt, std::to_string(compressed));
  p.header.seekp(end);
  p.CheckStreams();

  if (p.content.HasImages() && p.dataFile.empty()) {
    std::ifstream from(p.pixelPath, std::ios::binary);
    std::vector<char> piece(std::size_t{1} << 22);
    std::error_code failed;
    const double all = static_cast<double>(fs::file_size(p.pixelPath, failed));
    double done = 0.0;
    while (from.read(piece.data(), static_cast<std::streamsize>(piece.size())), from.gcount() > 0) {
      p.header.write(piece.data(), from.gcount());
      done += static_cast<double>(from.gcount());
      progress.Part(0.2, 1.0)(done / all);
    }
    if (failed || done != all)
      p.Fail(Error::Kind::FileSystem, "its pixels cannot be read back from the disk (" +
                                          (failed ? failed.message() : std::string("they end early")) +
                                          "); what was there is left as it was");
  }
  p.header.close();
  p.CheckStreams();
}

} // namespace echorama
