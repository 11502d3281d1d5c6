// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/VdbFile.h"
#include "Core/Base/LoadedLibrary.h"
#include "Readers/OpenVdb/VdbLibrary.h"

namespace echorama {
namespace {

const VdbLibrary& Library(const std::string& path)
{
  const auto library = LoadedFunction<decltype(EchoramaVdbLibrary)>("libEchoramaOpenVdb.so", "EchoramaVdbLibrary", path);
  return *library();
}

} // namespace

bool LooksLikeVdb(std::string_view start)
{
  return start.substr(0, 8) == std::string_view(" BDV\0\0\0\0", 8);
}

std::unique_ptr<VolumeSource> OpenVdb(const std::string& path)
{
  return Library(path).open(path);
}

void WriteVdb(const std::string& path, const ImageHeader& header, const void* voxels, const unsigned char* valid, bool compress,
              FileReplacement& files, const Progress& progress)
{
  Library(path).write(path, header, voxels, valid, compress, files, progress);
}

} // namespace echorama
