// SPDX-License-Identifier: BSD-3-Clause
// Deflate is sequential to read but not to write: blocks of one megabyte are compressed at the same time, each with the
// last 32 KiB of its predecessor as dictionary (so that almost nothing is lost) and flushed to a whole byte, so that their
// concatenation is one stream. The checksums of the blocks combine into that of the whole. Blocks go out in batches, so the
// memory needed is a few megabytes whatever the volume's size. Decompression writes straight into the caller's buffer.
#include "Readers/Compression.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <istream>
#include <memory>
#include <ostream>
#include <vector>
#include <zlib.h>

namespace echorama {
namespace {

constexpr std::uint64_t BlockBytes = 1 << 20, DictionaryBytes = 1 << 15;
constexpr std::ptrdiff_t BatchBlocks = 32;
// Speckle hardly compresses: higher levels cost several times the time for a few per cent.
constexpr int Level = 2;

[[noreturn]] void Fail(const std::string& name, const std::string& reason)
{
  throw Error(Error::Kind::BadFile, name + ": " + reason);
}

struct Block {
  std::vector<unsigned char> data;
  uLong checksum = 0;
};

Block CompressBlock(const unsigned char* all, std::uint64_t begin, std::uint64_t end, bool last, CompressedForm form)
{
  z_stream z{};
  if (deflateInit2(&z, Level, Z_DEFLATED, -15, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_streamp)> cleanup(&z, deflateEnd);
  const std::uint64_t dictionary = std::min(begin, DictionaryBytes);
  if (dictionary > 0)
    deflateSetDictionary(&z, all + begin - dictionary, static_cast<uInt>(dictionary));
  Block block;
  block.data.resize(deflateBound(&z, static_cast<uLong>(end - begin)) + 16);
  z.next_in = const_cast<unsigned char*>(all + begin);
  z.avail_in = static_cast<uInt>(end - begin);
  z.next_out = block.data.data();
  z.avail_out = static_cast<uInt>(block.data.size());
  deflate(&z, last ? Z_FINISH : Z_SYNC_FLUSH);
  block.data.resize(z.total_out);
  const auto checksum = form == CompressedForm::Gzip ? crc32_z : adler32_z;
  block.checksum = checksum(checksum(0, nullptr, 0), all + begin, end - begin);
  return block;
}

std::uint64_t Put(std::ostream& stream, const std::vector<unsigned char>& data)
{
  stream.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  return data.size();
}

} // namespace

std::uint64_t Compress(std::ostream& stream, CompressedForm form, const void* in, std::uint64_t bytes, const Progress& progress)
{
  return Compress(stream, form, std::string(), in, bytes, progress);
}

std::uint64_t Compress(std::ostream& stream, CompressedForm form, const std::string& start, const void* in, std::uint64_t bytes,
                       const Progress& progress)
{
  const bool gzip = form == CompressedForm::Gzip;
  const auto* all = static_cast<const unsigned char*>(in);
  std::uint64_t written = gzip ? Put(stream, {0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255}) : Put(stream, {0x78, 0x5e});
  uLong checksum = gzip ? crc32(0, nullptr, 0) : adler32(0, nullptr, 0);
  if (!start.empty()) {
    const Block block =
        CompressBlock(reinterpret_cast<const unsigned char*>(start.data()), 0, start.size(), false, form);
    checksum = block.checksum;
    written += Put(stream, block.data);
  }
  const std::ptrdiff_t blocks = static_cast<std::ptrdiff_t>(std::max<std::uint64_t>(1, (bytes + BlockBytes - 1) / BlockBytes));
  for (std::ptrdiff_t first = 0; first < blocks && stream; first += BatchBlocks) {
    std::vector<Block> batch(static_cast<std::size_t>(std::min(BatchBlocks, blocks - first)));
    const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(batch.size());
    const Progress part = progress.Part(static_cast<double>(first) / static_cast<double>(blocks),
                                        static_cast<double>(first + count) / static_cast<double>(blocks));
    ParallelFor(count, part, [&](std::ptrdiff_t i) {
      const std::uint64_t begin = static_cast<std::uint64_t>(first + i) * BlockBytes;
      batch[static_cast<std::size_t>(i)] =
          CompressBlock(all, begin, std::min(begin + BlockBytes, bytes), first + i + 1 == blocks, form);
    });
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      const std::uint64_t begin = static_cast<std::uint64_t>(first + i) * BlockBytes;
      const z_off_t length = static_cast<z_off_t>(std::min(BlockBytes, bytes - begin));
      const Block& block = batch[static_cast<std::size_t>(i)];
      checksum = gzip ? crc32_combine(checksum, block.checksum, length) : adler32_combine(checksum, block.checksum, length);
      written += Put(stream, block.data);
    }
  }
  const std::uint64_t whole = start.size() + bytes;
  const auto byte = [](std::uint64_t value, int i) { return static_cast<unsigned char>(value >> (8 * i)); };
  if (gzip)
    return written + Put(stream, {byte(checksum, 0), byte(checksum, 1), byte(checksum, 2), byte(checksum, 3), byte(whole, 0),
                                  byte(whole, 1), byte(whole, 2), byte(whole, 3)});
  return written + Put(stream, {byte(checksum, 3), byte(checksum, 2), byte(checksum, 1), byte(checksum, 0)});
}

struct Inflater::State {
  std::istream& stream;
  std::string name;
  z_stream z{};
  bool ended = false; // after the checksum of a stream
  std::vector<unsigned char> input = std::vector<unsigned char>(1 << 18);

  // Inflates up to \a room bytes and counts them in \a made. \returns false when there is no more input.
  bool Step(unsigned char* out, std::uint64_t room, std::uint64_t& made)
  {
    if (z.avail_in == 0) {
      stream.read(reinterpret_cast<char*>(input.data()), static_cast<std::streamsize>(input.size()));
      z.avail_in = static_cast<uInt>(stream.gcount());
      z.next_in = input.data();
      if (z.avail_in == 0)
        return false;
    }
    if (ended) // another gzip member
      inflateReset(&z);
    z.next_out = out;
    z.avail_out = static_cast<uInt>(room);
    const int status = inflate(&z, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
      Fail(name, std::string("the compressed data are damaged (") + (z.msg ? z.msg : "not a zlib or gzip stream") + ")");
    ended = status == Z_STREAM_END;
    made += room - z.avail_out;
    return true;
  }
};

Inflater::Inflater(std::istream& stream, std::string name) : state_(new State{stream, std::move(name)})
{
  if (inflateInit2(&state_->z, 15 + 32) != Z_OK) // zlib or gzip, told by the first bytes
    throw std::bad_alloc();
}

Inflater::~Inflater()
{
  inflateEnd(&state_->z);
}

std::uint64_t Inflater::Read(void* out, std::uint64_t bytes, const Progress& progress)
{
  constexpr std::uint64_t LargestPiece = 1 << 24;
  std::uint64_t made = 0;
  while (made < bytes && state_->Step(static_cast<unsigned char*>(out) + made, std::min(bytes - made, LargestPiece), made))
    progress(static_cast<double>(made) / static_cast<double>(bytes));
  return made;
}

Inflater::Ending Inflater::Finish()
{
  unsigned char beyond = 0;
  std::uint64_t made = 0;
  while (!state_->ended && made == 0)
    if (!state_->Step(&beyond, 1, made))
      return Ending::Truncated;
  return made > 0 ? Ending::MoreFollows : Ending::Complete;
}

std::uint64_t Inflater::Skip(std::uint64_t bytes)
{
  unsigned char dropped[1 << 14];
  std::uint64_t done = 0;
  while (done < bytes) {
    const std::uint64_t piece = std::min<std::uint64_t>(bytes - done, sizeof dropped), made = Read(dropped, piece);
    done += made;
    if (made < piece)
      break;
  }
  return done;
}

void Decompress(std::istream& stream, const std::string& name, std::uint64_t skip, void* out, std::uint64_t bytes,
                const Progress& progress)
{
  Inflater inflater(stream, name);
  const std::uint64_t made = inflater.Skip(skip) < skip ? 0 : inflater.Read(out, bytes, progress);
  const Inflater::Ending ending = made < bytes ? Inflater::Ending::Truncated : inflater.Finish();
  if (ending == Inflater::Ending::MoreFollows)
    Fail(name, "the compressed data hold more than the dimensions say");
  if (ending == Inflater::Ending::Truncated)
    Fail(name, "the compressed data end early, after " + std::to_string(made) + " of " + std::to_string(bytes) +
                   " bytes: the file is truncated or its dimensions are wrong");
}

} // namespace echorama
