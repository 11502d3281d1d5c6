// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/TextFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include <filesystem>
#include <fstream>

namespace echorama {

std::string ReadTextFile(const std::string& path, std::size_t limit)
{
  std::error_code error;
  const bool isPlain = std::filesystem::is_regular_file(path, error); // a pipe would not even open
  std::ifstream stream(isPlain ? path : std::string(), std::ios::binary);
  if (!stream)
    throw Error(Error::Kind::FileSystem, path + ": the file cannot be read");
  // The size is measured by reading: files of the system say 0.
  std::string text;
  char block[1 << 14];
  while (stream.read(block, sizeof block) || stream.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > limit)
      throw Error(Error::Kind::BadFile,
                  path + ": it has more than " + std::to_string(limit) + " bytes, too many for a file of its kind");
  }
  if (stream.bad())
    throw Error(Error::Kind::FileSystem, path + ": reading it failed");
  return text;
}

void WriteTextFile(const std::string& path, const std::string& text)
{
  FileReplacement replacement;
  std::ofstream stream(replacement.Stage(path), std::ios::binary);
  stream << text;
  stream.close();
  if (!stream)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written (is the disk full?)");
  replacement.Commit();
}

} // namespace echorama
