// SPDX-License-Identifier: BSD-3-Clause
// Streams in pieces: the same bytes as in one go, and going back to a moment that was kept.
#include "Core/Base/Random.h"
#include "Readers/Compression.h"
#include "Testing/TemporaryFolder.h"

using namespace echorama;
using namespace echorama::testing;

namespace {

std::string SomeText(std::size_t size)
{
  Random random(21);
  std::string text;
  while (text.size() < size)
    text.append(1 + random.Below(20), static_cast<char>(random.Below(200)));
  text.resize(size);
  return text;
}

std::string Packed(CompressedForm form, const std::string& plain)
{
  std::stringstream stream;
  Compress(stream, form, plain.data(), plain.size());
  return stream.str();
}

} // namespace

TEST(Compression, PiecesGiveTheSameBytesAsTheWhole)
{
  const std::string plain = SomeText(34'000'000); // more than a batch
  for (const CompressedForm form : {CompressedForm::Zlib, CompressedForm::Gzip}) {
    std::stringstream stream;
    Deflater deflater(stream, form);
    Random random(5);
    for (std::size_t at = 0; at < plain.size();) {
      const std::size_t piece = std::min<std::size_t>(plain.size() - at, random.Below(9'000'000));
      deflater.Append(plain.data() + at, piece);
      at += piece;
    }
    const std::uint64_t size = deflater.Finish();
    EXPECT_EQ(size, stream.str().size());
    EXPECT_TRUE(stream.str() == Packed(form, plain));
  }
  std::stringstream empty;
  Deflater(empty, CompressedForm::Zlib).Finish();
  Inflater(empty, 0, "nothing", 0).Finish();
}

TEST(Compression, ReadingGoesOnFromAnyMomentThatWasKept)
{
  const std::string plain = SomeText(3'000'000);
  // The second holds two members, the first of which ends between two pieces.
  for (const std::string& packed :
       {Packed(CompressedForm::Zlib, plain),
        Packed(CompressedForm::Gzip, plain.substr(0, 500'000)) + Packed(CompressedForm::Gzip, plain.substr(500'000))}) {
    std::stringstream stream("before" + packed);
    Inflater inflater(stream, 6, "test", plain.size());
    std::vector<std::shared_ptr<const Inflater::State>> moments;
    for (int i = 0; i < 30; ++i) {
      moments.push_back(inflater.Save());
      inflater.Read(nullptr, 100'000);
    }
    inflater.Finish();
    for (const std::size_t i : {29, 3, 0, 5, 6, 4}) {
      inflater.Restore(*moments[i]);
      EXPECT_EQ(inflater.Position(), i * 100'000);
      std::string piece(150'000, '\0');
      piece.resize(std::min<std::size_t>(piece.size(), plain.size() - i * 100'000));
      inflater.Read(piece.data(), piece.size());
      EXPECT_TRUE(piece == plain.substr(i * 100'000, piece.size()));
    }
    inflater.Read(nullptr, plain.size() - inflater.Position());
    inflater.Finish();
  }
}

TEST(Compression, WhatDoesNotFitIsRefused)
{
  const std::string plain = SomeText(1000), packed = Packed(CompressedForm::Zlib, plain);
  const auto read = [&](const std::string& data, std::uint64_t bytes) {
    std::stringstream stream(data);
    Inflater inflater(stream, 0, "some file", bytes);
    inflater.Read(nullptr, bytes);
    inflater.Finish();
  };
  read(packed, 1000);
  const auto refused = [&](const std::string& data, std::uint64_t bytes, const std::string& words) {
    ExpectRefused([&] { read(data, bytes); }, Error::Kind::BadFile, "some file", words);
  };
  refused(packed, 999, "more than the dimensions say");
  refused(packed, 1001, "end early");
  refused(packed.substr(0, packed.size() / 2), 1000, "end early");
  refused(packed.substr(0, packed.size() - 1), 1000, "end early");
  refused("not compressed at all", 1000, "damaged");
  std::string changed = packed;
  changed.back() ^= 1; // the checksum
  refused(changed, 1000, "damaged");
}
