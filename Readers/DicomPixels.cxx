// SPDX-License-Identifier: BSD-3-Clause
// Compressed pixels are given to gdcm's codecs, fragment by fragment; this is the one file that sees gdcm. They print, and
// damaged pixels can end them by an assertion or worse, so they run in a process of their own, which writes to memory shared with
// this one.
#include "Readers/DicomPixels.h"
#include "Core/Base/Error.h"
#include "Core/Sharing/IsolatedTask.h"
#include "Readers/DicomElements.h"
#include <algorithm>
#include <fstream>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <limits>
#include <new>
#include <string_view>
#include <sys/mman.h>

namespace echorama {
namespace {

constexpr std::size_t longestHead = 1 << 20; // of a JPEG, with the profiles of colour that it may hold
constexpr const char* ofUnknownKind = "they are damaged or of a kind that is not supported";

[[noreturn]] void FailPixels(const DicomHeader& header, const std::string& reason)
{
  FailFile(header.path, "its pixels cannot be decoded: " + reason);
}

// Four bytes, the lowest first.
std::uint32_t Number(const std::string& bytes, std::size_t at)
{
  std::uint32_t number = 0;
  for (std::size_t i = 4; i > 0; --i)
    number = number << 8 | (at + i <= bytes.size() ? static_cast<unsigned char>(bytes[at + i - 1]) : 0u);
  return number;
}

// The items of compressed pixels, one after the other: a table of the offsets of the pictures, which may be empty, and fragments.
class Items {
public:
  explicit Items(const DicomHeader& header)
    : header_(header), stream_(header.path, std::ios::binary), at_(header.pixelOffset), end_(at_ + header.pixelBytes)
  {
    stream_.seekg(static_cast<std::streamoff>(at_));
  }

  // The bytes of the next one, no more than \a most (then it is the last to be asked for). \returns false at the end
  bool Next(std::string& bytes, std::size_t most = std::numeric_limits<std::size_t>::max())
  {
    if (at_ >= end_)
      return false;
    std::string head(8, '\0');
    if (end_ - at_ < 8 || !stream_.read(head.data(), 8))
      FailPixels(header_, ofUnknownKind);
    at_ += 8;
    if (head[2] == '\xDD') // the end of the sequence
      return false;
    const std::uint32_t length = Number(head, 4);
    if (length > end_ - at_)
      FailPixels(header_, ofUnknownKind);
    bytes.resize(std::min<std::size_t>(length, most));
    if (!stream_.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      FailPixels(header_, ofUnknownKind);
    at_ += length;
    return true;
  }

  std::uint64_t At() const { return at_; }

private:
  const DicomHeader& header_;
  std::ifstream stream_;
  std::uint64_t at_, end_;
};

// What a stream of JPEG, JPEG-LS or JPEG 2000 says of its pixels. gdcm looks at the header alone and gives what is stored.
struct StreamHead {
  int numbers = 0, bits = 0; // per pixel, and of one of them; 0: not said
  bool lossless = false;     // JPEG's lossless process, which gdcm widens to the bits that are allocated
  std::string colours;       // RGB or YBR_FULL; empty: not said
};

StreamHead HeadOf(std::string_view s)
{
  StreamHead head;
  const auto byte = [s](std::size_t at) { return at < s.size() ? int{static_cast<unsigned char>(s[at])} : 0; };
  if (byte(0) == 0xFF && byte(1) == 0x4F) // JPEG 2000
    return {256 * byte(40) + byte(41), (byte(42) & 0x7F) + 1, false, ""};
  int transform = -1;
  bool isJfif = false;
  for (std::size_t at = 2; at + 4 <= s.size() && byte(at) == 0xFF;) {
    const int mark = byte(at + 1);
    isJfif = isJfif || (mark == 0xE0 && s.compare(at + 4, 4, "JFIF") == 0);
    if (mark == 0xEE && s.compare(at + 4, 5, "Adobe") == 0)
      transform = byte(at + 15);
    if (mark == 0xF7 || ((mark & 0xF0) == 0xC0 && mark != 0xC4 && mark != 0xC8 && mark != 0xCC)) { // the head of a frame
      head.numbers = byte(at + 9);
      head.bits = byte(at + 4);
      head.lossless = mark != 0xF7 && (mark & 3) == 3;
      const bool isRgb = transform != 1 && byte(at + 10) == 'R' && byte(at + 13) == 'G' && byte(at + 16) == 'B';
      const bool isYbr = !isRgb && (isJfif || transform == 1 || byte(at + 11) != byte(at + 14)); // RGB are sampled alike
      if (mark != 0xF7 && !head.lossless && head.numbers == 3)
        head.colours = isYbr ? "YBR_FULL" : isRgb || transform == 0 ? "RGB" : "";
      break;
    }
    at += mark == 0xFF ? 1 : 2 + static_cast<std::size_t>(256 * byte(at + 2) + byte(at + 3)); // bytes may come before a mark
  }
  return head;
}

bool IsYbr(const std::string& photometric)
{
  return photometric.compare(0, 8, "YBR_FULL") == 0;
}

void CheckHead(const DicomHeader& header, const StreamHead& head, std::size_t picture)
{
  const int room = head.bits > 16 ? 32 : head.bits > 8 ? 16 : 8;
  const bool fits = head.lossless ? room <= header.bitsAllocated : room == header.bitsAllocated;
  if (head.numbers > 0 && (head.numbers != header.samples || !fits))
    FailPixels(header, "frame " + std::to_string(picture + 1) + " is compressed with " + std::to_string(head.numbers) + " x " +
                           std::to_string(head.bits) + " bits per pixel, and the header says " + std::to_string(header.samples) +
                           " x " + std::to_string(header.bitsAllocated));
  if (!head.colours.empty() && IsYbr(head.colours) != IsYbr(header.photometric))
    FailPixels(header, "the colours of frame " + std::to_string(picture + 1) + " are " + head.colours +
                           ", others than those of the first");
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

std::string ColoursOfDicomStream(const DicomHeader& header)
{
  std::string bytes, more;
  Items items(header);
  items.Next(bytes) && items.Next(bytes, longestHead); // the table, the first fragment
  while (header.pictures.size() == 1 && HeadOf(bytes).numbers == 0 && bytes.size() < longestHead &&
         items.Next(more, longestHead - bytes.size()))
    bytes += more;
  const std::string colours = HeadOf(bytes).colours;
  return colours.empty() || IsYbr(colours) == IsYbr(header.photometric) ? header.photometric : colours;
}

std::vector<std::string> ReadDicomFragments(const DicomHeader& header)
{
  const gdcm::TransferSyntax::TSType syntax = gdcm::TransferSyntax::GetTSType(header.transferSyntax.c_str());
  if (syntax == gdcm::TransferSyntax::TS_END)
    FailPixels(header, ofUnknownKind);
  std::string table, fragment;
  Items items(header);
  items.Next(table);
  std::vector<std::string> fragments;
  std::vector<std::uint64_t> places; // of fragments, as the table counts them
  const std::uint64_t first = items.At();
  for (std::uint64_t at = first; items.Next(fragment); at = items.At()) {
    fragments.push_back(std::move(fragment));
    places.push_back(at - first);
  }
  const std::size_t pictures = header.pictures.size();
  std::vector<std::string> frames;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const std::size_t entry = 4 * frames.size(); // of the next one
    const bool isListed = entry + 4 <= table.size() && Number(table, entry) == places[i];
    if (i == 0 || (pictures > 1 && (fragments.size() == pictures || isListed)))
      frames.push_back(std::move(fragments[i]));
    else
      frames.back() += fragments[i];
  }
  if (frames.size() != pictures)
    FailPixels(header,
               "its " + std::to_string(pictures) + " frames lie in " + std::to_string(fragments.size()) + " fragments, and " +
                   (table.empty() ? "no table of offsets says" : "its table of offsets does not say") + " which belong together");
  for (std::size_t i = 0; i < pictures; ++i) {
    const std::string& f = frames[i];
    const auto begins = [&f](const char* mark, std::size_t count) { return f.compare(0, count, mark, count) == 0; };
    const bool isRle = syntax == gdcm::TransferSyntax::RLELossless;
    if (isRle ? f.size() < 64 : !begins("\xFF\xD8", 2) && !begins("\xFF\x4F\xFF\x51", 4) && !begins("\0\0\0\x0CjP", 6))
      FailPixels(header, ofUnknownKind);
    CheckHead(header, isRle ? StreamHead() : HeadOf(f), i);
  }
  return frames;
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
    FailPixels(header, ofUnknownKind);
  case TaskOutcome::TimedOut:
    FailFile(header.path, "its pixels are damaged: decoding them did not come to an end");
  }
  return {out, out + wanted};
}

} // namespace echorama
