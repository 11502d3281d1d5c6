// SPDX-License-Identifier: BSD-3-Clause
// Compressed pixels are given to gdcm's codecs, fragment by fragment; this is the one file that sees gdcm. They print, and
// damaged pixels can end them by an assertion or worse, so they run in a process of their own, which writes to memory shared with
// this one.
#include "Readers/DicomPixels.h"
#include "Core/Base/Error.h"
#include "Core/Sharing/IsolatedTask.h"
#include "Readers/DicomElements.h"
#include <fstream>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <new>
#include <sys/mman.h>

namespace echorama {
namespace {

[[noreturn]] void FailPixels(const DicomHeader& header)
{
  FailFile(header.path, "its pixels cannot be decoded: they are damaged or of a kind that is not supported");
}

bool Decode(const DicomHeader& header, const std::vector<std::string>& fragments, std::uint64_t bytes, char* out)
{
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  gdcm::Trace::DebugOff();
  gdcm::DataElement element(gdcm::Tag(0x7FE0, 0x0010));
  element.SetVR(gdcm::VR::OB);
  const auto sequence = gdcm::SequenceOfFragments::New();
  for (const std::string& bytesOfOne : fragments) {
    gdcm::Fragment fragment;
    fragment.SetByteValue(bytesOfOne.data(), static_cast<std::uint32_t>(bytesOfOne.size()));
    sequence->AddFragment(fragment);
  }
  element.SetValue(*sequence);
  gdcm::Image image;
  const auto pictures = static_cast<unsigned>(header.pictures.size());
  image.SetNumberOfDimensions(pictures > 1 ? 3 : 2);
  image.SetDimension(0, static_cast<unsigned>(header.columns));
  image.SetDimension(1, static_cast<unsigned>(header.rows));
  if (pictures > 1)
    image.SetDimension(2, pictures);
  const auto stored = static_cast<unsigned short>(header.bitsStored);
  image.SetPixelFormat(gdcm::PixelFormat(static_cast<unsigned short>(header.samples),
                                         static_cast<unsigned short>(header.bitsAllocated), stored,
                                         static_cast<unsigned short>(stored - 1), header.isSigned ? 1 : 0));
  image.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::GetPIType(header.photometric.c_str()));
  image.SetPlanarConfiguration(0);
  image.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(header.transferSyntax.c_str()));
  image.SetDataElement(element);
  return image.GetBufferLength() == bytes && image.GetBuffer(out);
}

// Memory that this process shares with those that it starts.
class SharedMemory {
public:
  explicit SharedMemory(std::size_t bytes)
    : bytes_(bytes), data_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
  {
    if (data_ == MAP_FAILED)
      throw std::bad_alloc();
  }
  ~SharedMemory() { munmap(data_, bytes_); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  char* Data() const { return static_cast<char*>(data_); }

private:
  std::size_t bytes_;
  void* data_;
};

} // namespace

std::vector<std::string> ReadDicomFragments(const DicomHeader& header)
{
  std::ifstream stream(header.path, std::ios::binary);
  const gdcm::TransferSyntax::TSType syntax = gdcm::TransferSyntax::GetTSType(header.transferSyntax.c_str());
  std::vector<std::string> fragments;
  std::uint64_t at = header.pixelOffset;
  const std::uint64_t end = at + header.pixelBytes;
  stream.seekg(static_cast<std::streamoff>(at));
  for (bool table = true; at < end; table = false) {
    unsigned char b[8];
    if (end - at < 8 || !stream.read(reinterpret_cast<char*>(b), 8))
      FailPixels(header);
    at += 8;
    const std::uint32_t bytes = std::uint32_t{b[7]} << 24 | std::uint32_t{b[6]} << 16 | std::uint32_t{b[5]} << 8 | b[4];
    if (b[2] == 0xDD) // the end of the sequence
      break;
    if (bytes > end - at)
      FailPixels(header);
    std::string fragment(bytes, '\0');
    if (!stream.read(fragment.data(), static_cast<std::streamsize>(bytes)))
      FailPixels(header);
    at += bytes;
    if (!table) // the first item is a table of offsets
      fragments.push_back(std::move(fragment));
  }
  const std::size_t pictures = header.pictures.size();
  if (syntax == gdcm::TransferSyntax::TS_END || fragments.size() < pictures || (pictures > 1 && fragments.size() != pictures))
    FailPixels(header);
  const bool isRle = syntax == gdcm::TransferSyntax::RLELossless;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const std::string& f = fragments[i];
    const auto begins = [&f](const char* mark, std::size_t count) { return f.compare(0, count, mark, count) == 0; };
    const bool first = pictures > 1 || i == 0;
    if (first && (isRle ? f.size() < 64 : !begins("\xFF\xD8", 2) && !begins("\xFF\x4F\xFF\x51", 4) && !begins("\0\0\0\x0CjP", 6)))
      FailPixels(header);
  }
  return fragments;
}

std::vector<char> DecodeDicomPixels(const DicomHeader& header, const Progress& progress, double fraction)
{
  const std::uint64_t wanted = header.PictureBytes() * header.pictures.size();
  if (header.storage == DicomStorage::Deflated) {
    std::vector<char> pixels(wanted);
    ReadInflatedDicom(header.path, header.pixelOffset, pixels.data(), wanted);
    return pixels;
  }

  const std::vector<std::string> fragments = ReadDicomFragments(header);
  const SharedMemory memory(wanted);
  char* const out = memory.Data();
  // The slowest codec, JPEG 2000, makes some 10 MB in a second, and holds several copies of what it makes.
  const double megabytes = 1e-6 * static_cast<double>(wanted);
  const TaskLimits limits{30.0 + megabytes, (std::uint64_t{1} << 28) + 16 * wanted};
  switch (RunIsolated([&] { return Decode(header, fragments, wanted, out); }, limits, progress, fraction)) {
  case TaskOutcome::Succeeded:
    break;
  case TaskOutcome::Failed:
    FailPixels(header);
  case TaskOutcome::TimedOut:
    FailFile(header.path, "its pixels are damaged: decoding them did not come to an end");
  }
  return {out, out + wanted};
}

} // namespace echorama
