// SPDX-License-Identifier: BSD-3-Clause
// Deflate is sequential to read but not to write: blocks of one megabyte are compressed at the same time, each with the
// last 32 KiB of its predecessor as dictionary (so that almost nothing is lost) and flushed to a whole byte, so that their
// concatenation is one stream. The checksums of the blocks combine into that of the whole. Blocks are collected and go out
// in batches, so the memory needed is the same whatever the volume's size. Decompression writes straight into the caller's
// buffer. Its state, with the 32 KiB that it looks back on, can be copied at any point: that is all it takes to go on there.
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
constexpr std::uint64_t BatchBlocks = 32;
// Speckle hardly compresses: higher levels cost several times the time for a few per cent.
constexpr int Level = 2;

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

struct Deflater::Parts {
  std::ostream& stream;
  CompressedForm form;
  uLong checksum;
  std::uint64_t done = 0, written = 0;    // bytes taken in and compressed, bytes put out
  std::vector<unsigned char> collected{}; // what is to be compressed, after the end of what has been (the dictionary)
  std::uint64_t dictionary = 0;

  // Compresses all that was collected; \a last: nothing follows.
  void Flush(bool last, const Progress& progress)
  {
    const std::uint64_t bytes = collected.size() - dictionary;
    std::vector<Block> batch(std::max<std::size_t>(1, (bytes + BlockBytes - 1) / BlockBytes));
    ParallelFor(static_cast<std::ptrdiff_t>(batch.size()), progress, [&](std::ptrdiff_t i) {
      const std::uint64_t begin = dictionary + static_cast<std::uint64_t>(i) * BlockBytes,
                          end = std::min<std::uint64_t>(begin + BlockBytes, collected.size());
      batch[static_cast<std::size_t>(i)] = CompressBlock(collected.data(), begin, end, last && end == collected.size(), form);
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const z_off_t length = static_cast<z_off_t>(std::min(BlockBytes, bytes - i * BlockBytes));
      checksum = form == CompressedForm::Gzip ? crc32_combine(checksum, batch[i].checksum, length)
                                              : adler32_combine(checksum, batch[i].checksum, length);
      written += Put(stream, batch[i].data);
    }
    done += bytes;
    dictionary = std::min<std::uint64_t>(DictionaryBytes, collected.size());
    collected.erase(collected.begin(), collected.end() - static_cast<std::ptrdiff_t>(dictionary));
  }
};

Deflater::Deflater(std::ostream& stream, CompressedForm form)
  : parts_(new Parts{stream, form, form == CompressedForm::Gzip ? crc32(0, nullptr, 0) : adler32(0, nullptr, 0)})
{
  const bool gzip = form == CompressedForm::Gzip;
  parts_->written = gzip ? Put(stream, {0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255}) : Put(stream, {0x78, 0x5e});
}

Deflater::~Deflater() = default;

void Deflater::Append(const void* in, std::uint64_t bytes, const Progress& progress)
{
  Parts& p = *parts_;
  const auto* next = static_cast<const unsigned char*>(in);
  const std::uint64_t total = bytes;
  while (bytes > 0 && p.stream) {
    const std::uint64_t room = p.dictionary + BatchBlocks * BlockBytes - p.collected.size();
    if (room == 0) {
      p.Flush(false, progress.Part(static_cast<double>(total - bytes) / static_cast<double>(total), 1.0));
      continue;
    }
    const std::uint64_t piece = std::min(bytes, room);
    p.collected.insert(p.collected.end(), next, next + piece);
    next += piece;
    bytes -= piece;
  }
}

std::uint64_t Deflater::Finish(const Progress& progress)
{
  Parts& p = *parts_;
  p.Flush(true, progress);
  const auto byte = [](std::uint64_t value, int i) { return static_cast<unsigned char>(value >> (8 * i)); };
  const std::uint64_t sum = p.checksum;
  p.written += p.form == CompressedForm::Gzip
                   ? Put(p.stream, {byte(sum, 0), byte(sum, 1), byte(sum, 2), byte(sum, 3), byte(p.done, 0), byte(p.done, 1),
                                    byte(p.done, 2), byte(p.done, 3)})
                   : Put(p.stream, {byte(sum, 3), byte(sum, 2), byte(sum, 1), byte(sum, 0)});
  return p.written;
}

std::uint64_t Compress(std::ostream& stream, CompressedForm form, const void* in, std::uint64_t bytes, const Progress& progress)
{
  Deflater deflater(stream, form);
  const double flushed = static_cast<double>(bytes) / (static_cast<double>(bytes) + BatchBlocks * BlockBytes);
  deflater.Append(in, bytes, progress.Part(0.0, flushed));
  return deflater.Finish(progress.Part(flushed, 1.0));
}

struct Inflater::State {
  State() = default;
  ~State()
  {
    if (z.state)
      inflateEnd(&z);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  z_stream z{};
  std::int64_t input = 0;     // where the next compressed byte is in the file
  std::uint64_t position = 0; // bytes given out
  bool ended = false;         // the member that was read last is complete
};

struct Inflater::Parts {
  std::istream& stream;
  std::string name;
  std::uint64_t total;
  std::vector<unsigned char> input, dropped{};
  State now{}; // its input is that of the next byte to be read from the stream

  void Seek()
  {
    now.z.avail_in = 0;
    stream.clear();
    stream.seekg(now.input);
    if (!stream)
      throw Error(Error::Kind::FileSystem, name + ": it cannot be read");
  }

  // Inflates up to \a room bytes to \a out. \returns how many came; 0 also when a member ended.
  std::uint64_t Step(unsigned char* out, std::uint64_t room)
  {
    z_stream& z = now.z;
    if (now.ended) {
      inflateReset(&z); // another gzip member, or else the end of the file is next
      now.ended = false;
    }
    if (z.avail_in == 0) {
      stream.read(reinterpret_cast<char*>(input.data()), static_cast<std::streamsize>(input.size()));
      z.avail_in = static_cast<uInt>(stream.gcount());
      z.next_in = input.data();
      now.input += stream.gcount();
      if (z.avail_in == 0)
        FailFile(name, "the compressed data end early, after " + std::to_string(now.position) + " of " + std::to_string(total) +
                           " bytes: the file is truncated or its dimensions are wrong");
    }
    z.next_out = out;
    z.avail_out = static_cast<uInt>(room);
    const int status = inflate(&z, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
      FailFile(name, std::string("the compressed data are damaged (") + (z.msg ? z.msg : "not a zlib or gzip stream") + ")");
    now.ended = status == Z_STREAM_END;
    now.position += room - z.avail_out;
    return room - z.avail_out;
  }
};

Inflater::Inflater(std::istream& stream, std::int64_t begin, std::string name, std::uint64_t total)
  : parts_(new Parts{stream, std::move(name), total, std::vector<unsigned char>(1 << 18)})
{
  if (inflateInit2(&parts_->now.z, 15 + 32) != Z_OK) // zlib or gzip, told by the first bytes
    throw std::bad_alloc();
  parts_->now.input = begin;
  parts_->Seek();
}

Inflater::~Inflater() = default;

void Inflater::Read(void* out, std::uint64_t bytes, const Progress& progress)
{
  constexpr std::uint64_t LargestPiece = 1 << 24;
  if (!out)
    parts_->dropped.resize(1 << 16);
  auto* next = static_cast<unsigned char*>(out);
  for (std::uint64_t left = bytes; left > 0;) {
    const std::uint64_t made = out ? parts_->Step(next, std::min(left, LargestPiece))
                                   : parts_->Step(parts_->dropped.data(), std::min<std::uint64_t>(left, parts_->dropped.size()));
    if (out)
      next += made;
    left -= made;
    progress(1.0 - static_cast<double>(left) / static_cast<double>(bytes));
  }
}

void Inflater::Finish()
{
  unsigned char beyond = 0;
  while (!parts_->now.ended)
    if (parts_->Step(&beyond, 1) > 0)
      FailFile(parts_->name, "the compressed data hold more than the dimensions say");
}

std::uint64_t Inflater::Position() const
{
  return parts_->now.position;
}

std::shared_ptr<const Inflater::State> Inflater::Save() const
{
  auto state = std::make_shared<State>();
  State& now = parts_->now;
  if (inflateCopy(&state->z, &now.z) != Z_OK)
    throw std::bad_alloc();
  state->input = now.input - now.z.avail_in;
  state->position = now.position;
  state->ended = now.ended;
  return state;
}

void Inflater::Restore(const State& state)
{
  State& now = parts_->now;
  inflateEnd(&now.z);
  if (inflateCopy(&now.z, const_cast<z_stream*>(&state.z)) != Z_OK)
    throw std::bad_alloc();
  now.input = state.input;
  now.position = state.position;
  now.ended = state.ended;
  parts_->Seek();
}

void Decompress(std::istream& stream, const std::string& name, std::uint64_t skip, void* out, std::uint64_t bytes,
                const Progress& progress)
{
  Inflater inflater(stream, stream.tellg(), name, skip + bytes);
  inflater.Read(nullptr, skip);
  inflater.Read(out, bytes, progress);
  inflater.Finish();
}

} // namespace echorama
