// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/DataFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/Memory.h"
#include "Core/Base/NumberText.h"
#include "Readers/Compression.h"
#include <algorithm>
#include <cmath>
#include <filesystem>

namespace echorama {

std::ifstream OpenToRead(const std::string& path)
{
  std::error_code none;
  if (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none)) // a pipe would not even open
    throw Error(Error::Kind::FileSystem, path + ": it is not a plain file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be opened (is reading permitted?)");
  return stream;
}

std::uint64_t FileSize(const std::string& path)
{
  std::error_code error;
  const bool plain = std::filesystem::is_regular_file(path, error);
  const std::uintmax_t size = plain ? std::filesystem::file_size(path, error) : 0;
  if (!plain || error)
    throw Error(Error::Kind::FileSystem, path + ": there is no such file, or it is not a plain one");
  return size;
}

std::uint64_t ReadPieces(std::istream& stream, void* out, std::uint64_t bytes, const Progress& progress)
{
  constexpr std::uint64_t most = 1 << 24;
  std::uint64_t done = 0;
  while (done < bytes) {
    stream.read(static_cast<char*>(out) + done, static_cast<std::streamsize>(std::min(most, bytes - done)));
    done += static_cast<std::uint64_t>(stream.gcount());
    if (!stream)
      break;
    progress(static_cast<double>(done) / static_cast<double>(bytes));
  }
  return done;
}

void CheckBytes(const std::string& path, const std::string& says, double needed, double there, bool compressed, bool exactly)
{
  const auto fail = [&](const std::string& but) { FailFile(path, says + " need " + NumberText(needed) + " bytes, " + but); };
  if (compressed) {
    if (needed > there * static_cast<double>(LargestCompressionRatio))
      fail("more than " + NumberText(there) + " compressed bytes can hold");
  } else if (needed > there)
    fail("and it holds " + NumberText(there) + ": it is truncated or the dimensions are wrong");
  else if (needed < there && exactly)
    fail("and it holds " + NumberText(there) + ": the dimensions or the type are wrong");
}

void CheckMemory(const std::string& path, double bytes)
{
  const double free = FreeMemory();
  if (!(bytes <= free))
    throw Error(Error::Kind::TooLarge, path + ": its voxels need " + NumberText(std::ceil(bytes / 1e6)) + " MB, and only " +
                                           NumberText(std::floor(free / 1e6)) + " MB of memory are free");
}

void CheckGeometry(const std::string& path, const ImageGeometry& geometry)
{
  try {
    geometry.Check(path);
  } catch (const Error& error) {
    throw Error(Error::Kind::BadFile, error.what());
  }
}

} // namespace echorama
