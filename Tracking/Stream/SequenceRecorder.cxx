// SPDX-License-Identifier: BSD-3-Clause
// A MetaImage header ends where ElementDataFile stands, and the order of its other lines is free. So the lines that change with
// every flush are kept at its end: the tail, "DimSize = 0 0 N" and "ElementDataFile = ...". A flush appends the new frames and a
// new tail behind the old one, where no reader looks, waits until they are on the disk, and then overwrites the old tail, in
// one small write, by a line of the same length that says again what was said before (NDims). Before that write the file is the
// old recording, after it the new one, and there is nothing in between: a write is cut only between pages of memory (by a
// kill) or between sectors of a disk (by a loss of power), and no tail straddles a sector: blanks before it see to that.
//
// Pixels are appended to a file of their own before the header counts their frame; what a kill leaves there beyond the frames of
// the header is passed over by readers, and known to ours by the field Recorder.
#include "Tracking/Stream/SequenceRecorder.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include "Readers/HeaderLines.h"
#include "Readers/SequenceText.h"
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <limits>
#include <sys/stat.h>
#include <unistd.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr std::uint64_t SectorBytes = 512;

// A file that is written by position, and closed in the end.
class GrowingFile {
public:
  GrowingFile() = default;
  ~GrowingFile() { Close(); }
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  // \returns what is wrong, empty when nothing is
  std::string Open(const std::string& path, bool replace)
  {
    file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (replace ? O_TRUNC : O_EXCL), 0666);
    if (file_ >= 0)
      return {};
    return errno == EEXIST ? "it is there already; choose another name"
                           : std::string("it cannot be written: ") + std::strerror(errno);
  }
  bool Write(std::uint64_t at, const char* bytes, std::uint64_t count)
  {
    while (count > 0) {
      const ssize_t written = ::pwrite(file_, bytes, count, static_cast<off_t>(at));
      if (written < 0 && errno == EINTR)
        continue;
      if (written <= 0)
        return false;
      bytes += written;
      at += static_cast<std::uint64_t>(written);
      count -= static_cast<std::uint64_t>(written);
      bytesWritten_ += static_cast<std::uint64_t>(written);
    }
    return true;
  }
  bool Sync() { return ::fdatasync(file_) == 0 || errno == EINVAL; } // EINVAL: a file that has no disk below it
  bool Cut(std::uint64_t size) { return ::ftruncate(file_, static_cast<off_t>(size)) == 0; }
  bool Close()
  {
    const bool closed = file_ < 0 || ::close(file_) == 0;
    file_ = -1;
    return closed;
  }
  bool IsOpen() const { return file_ >= 0; }
  std::uint64_t BytesWritten() const { return bytesWritten_; }

private:
  int file_ = -1;
  std::uint64_t bytesWritten_ = 0;
};

} // namespace

ParameterList Describe(SequenceRecorderOptions& p)
{
  return {
      Parameter("Replace", p.replace, "Whether an existing recording may be overwritten; otherwise it is refused."),
      Parameter("FlushSeconds", p.flushSeconds, {0, 1}, "s",
                "Frames are made safe at least this often; 0: each at once. What is younger is lost when the program is killed."),
      Parameter("SyncToDisk", p.syncToDisk,
                "Whether safe also means: on the disk, so that a loss of power costs no more than a kill does.")};
}

struct SequenceRecorder::Parts {
  std::string path, pixelPath; // the latter is empty for poses alone
  SequenceContent content;
  SequenceRecorderOptions options;
  GrowingFile header, pixels;
  std::string sizes, repeated;       // "0 0 " of DimSize; the line that takes the place of a tail
  std::string pending;               // lines that are not in the file
  std::uint64_t tailAt = 0, end = 0; // of the header in the file
  std::uint64_t pixelBytes = 0, safePixels = 0;
  int frames = 0, safe = 0;
  std::string failure; // what every call says from now on
  Clock::time_point lastFlush{};
  bool finished = false;

  [[noreturn]] void Fail(Error::Kind kind, const std::string& reason) const { throw Error(kind, path + ": " + reason); }

  std::string Tail(int count) const
  {
    return "DimSize = " + sizes + std::to_string(count) +
           "\nElementDataFile = " + (pixelPath.empty() ? "LOCAL" : fs::path(pixelPath).filename().string()) + "\n";
  }

  // Lines and a tail for a place in the file, with blanks at the end of the last line so that the tail lies in one sector.
  std::string WithTail(std::string lines, std::uint64_t at, int count, std::uint64_t& tail) const
  {
    const std::string text = Tail(count);
    tail = at + lines.size();
    const std::uint64_t room = SectorBytes - tail % SectorBytes;
    if (text.size() > room) {
      lines.insert(lines.size() - 1, room, ' ');
      tail += room;
    }
    return lines + text;
  }

  void CheckGoing() const
  {
    if (!failure.empty())
      throw Error(Error::Kind::FileSystem, failure);
    if (finished)
      Fail(Error::Kind::InvalidParameter, "the recording is finished; nothing can be added");
  }

  [[noreturn]] void Break(const std::string& why)
  {
    failure = path + ": it cannot be written (" + why + "); its first " + std::to_string(safe) + " frames are kept";
    pending.clear();
    static_cast<void>(header.Cut(end)); // where that fails, readers pass over what lies beyond the tail
    static_cast<void>(pixels.IsOpen() && pixels.Cut(safePixels));
    throw Error(Error::Kind::FileSystem, failure);
  }

  void Flush()
  {
    if (safe == frames)
      return;
    std::uint64_t tail = 0;
    const std::string text = WithTail(std::move(pending), end, frames, tail);
    pending.clear();
    const auto sync = [this](GrowingFile& file) { return !options.syncToDisk || file.Sync(); };
    if ((pixels.IsOpen() && !sync(pixels)) || !header.Write(end, text.data(), text.size()) || !sync(header))
      Break(std::strerror(errno));
    const std::uint64_t length = end - tailAt;
    const std::string line = repeated + std::string(length - repeated.size() - 1, ' ') + "\n";
    if (!header.Write(tailAt, line.data(), line.size()))
      Break(std::strerror(errno));
    end += text.size();
    tailAt = tail;
    safe = frames;
    safePixels = pixelBytes;
    if (!sync(header))
      Break(std::strerror(errno));
    lastFlush = Clock::now();
  }

  void FlushWhenDue()
  {
    if (safe == 0 || std::chrono::duration<double>(Clock::now() - lastFlush).count() >= options.flushSeconds)
      Flush();
  }
};

SequenceRecorder::SequenceRecorder(const std::string& path, const SequenceContent& content,
                                   const SequenceRecorderOptions& options)
  : parts_(new Parts)
{
  Parts& p = *parts_;
  p.path = path;
  p.content = content;
  p.options = options;
  CheckRanges(options);
  if (FormatOfName(path) != FileFormat::MetaImage)
    p.Fail(Error::Kind::InvalidParameter, "the extension must be .mha for poses alone, or .mhd");
  CheckSequence(path, p.content);
  if (p.content.HasImages()) {
    const char letter = path.back(); // .mha, .mhd
    if (letter != 'd' && letter != 'D')
      p.Fail(Error::Kind::InvalidParameter, "a recording with images must end in .mhd; the pixels are written beside it");
    p.pixelPath = DetachedPath(path, DetachedName(path, ".raw"));
    if (fs::path(p.pixelPath).filename().string().size() > 255)
      p.Fail(Error::Kind::InvalidParameter, "the name is too long");
  }

  std::string lines;
  for (const auto& [key, value] : MetaImageSequenceFields(p.content, false)) {
    if (key == "DimSize")
      p.sizes = value;
    else
      lines += key + " = " + value + "\n";
    if (key == "NDims")
      p.repeated = "NDims = " + value;
  }
  for (const auto& [key, value] : p.content.fields)
    if (key != RecorderField.first)
      lines += key + " = " + value + "\n";
  lines += RecorderField.first + " = " + RecorderField.second + "\n";
  if (p.Tail(std::numeric_limits<int>::max()).size() > SectorBytes)
    p.Fail(Error::Kind::InvalidParameter, "the name is too long");

  if (const std::string wrong = p.header.Open(path, options.replace); !wrong.empty())
    p.Fail(Error::Kind::FileSystem, wrong);
  const auto giveUp = [&p, &path](const std::string& file, const std::string& why) {
    p.header.Close();
    ::unlink(path.c_str());
    throw Error(Error::Kind::FileSystem, file + ": " + why);
  };
  if (!p.pixelPath.empty())
    if (const std::string wrong = p.pixels.Open(p.pixelPath, options.replace); !wrong.empty())
      giveUp(p.pixelPath, wrong);
  const std::string text = p.WithTail(lines, 0, 0, p.tailAt);
  if (!p.header.Write(0, text.data(), text.size())) {
    const std::string why = std::string("it cannot be written: ") + std::strerror(errno);
    if (!p.pixelPath.empty())
      ::unlink(p.pixelPath.c_str());
    giveUp(path, why);
  }
  p.end = text.size();
}

SequenceRecorder::~SequenceRecorder()
{
  try {
    if (parts_->failure.empty() && !parts_->finished)
      parts_->Flush();
  } catch (const Error&) { // what is safe stays
  }
}

void SequenceRecorder::Append(const SequenceFrame& frame, const void* pixels)
{
  Parts& p = *parts_;
  p.CheckGoing();
  if (p.frames == std::numeric_limits<int>::max())
    p.Fail(Error::Kind::TooLarge, "it cannot hold more than " + std::to_string(p.frames) + " frames");
  const std::string prefix = SequenceFramePrefix(p.frames);
  const std::vector<HeaderField> fields = SequenceFrameFields(p.path, frame, p.frames, "ImageStatus", pixels);
  if (p.pixels.IsOpen()) {
    const std::uint64_t bytes = p.content.FrameBytes();
    const std::vector<char> zeros(pixels ? 0 : bytes);
    if (!p.pixels.Write(p.pixelBytes, pixels ? static_cast<const char*>(pixels) : zeros.data(), bytes))
      p.Break(std::strerror(errno));
    p.pixelBytes += bytes;
  }
  for (const auto& [key, value] : fields)
    p.pending += prefix + key + " = " + value + "\n";
  ++p.frames;
  p.FlushWhenDue();
}

void SequenceRecorder::Flush()
{
  parts_->CheckGoing();
  parts_->Flush();
}

void SequenceRecorder::FlushWhenDue()
{
  parts_->CheckGoing();
  parts_->FlushWhenDue();
}

void SequenceRecorder::Finish()
{
  Parts& p = *parts_;
  p.CheckGoing();
  p.Flush();
  p.finished = true;
  const bool closed = p.header.Close() & p.pixels.Close();
  if (p.frames == 0) {
    ::unlink(p.path.c_str());
    if (!p.pixelPath.empty())
      ::unlink(p.pixelPath.c_str());
    p.Fail(Error::Kind::BadInput, "nothing was recorded");
  }
  if (!closed)
    p.Fail(Error::Kind::FileSystem, std::string("it cannot be written: ") + std::strerror(errno));
}

int SequenceRecorder::Frames() const
{
  return parts_->frames;
}

int SequenceRecorder::SafeFrames() const
{
  return parts_->safe;
}

std::uint64_t SequenceRecorder::BytesWritten() const
{
  return parts_->header.BytesWritten() + parts_->pixels.BytesWritten();
}

} // namespace echorama
