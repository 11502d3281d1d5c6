// SPDX-License-Identifier: BSD-3-Clause
// OpenVDB takes longer to load than all else that reads a volume. So what needs it is a library of its own, Readers/OpenVdb,
// which lies beside this one and is loaded with the first of its files.
#include "Readers/VdbFile.h"
#include "Core/Base/Error.h"
#include <dlfcn.h>

namespace echorama {
namespace {

const VdbLibrary& Library(const std::string& path)
{
  void* const library = dlopen(ECHORAMA_VDB_LIBRARY, RTLD_NOW | RTLD_LOCAL); // it stays
  const auto functions =
      library ? reinterpret_cast<decltype(&EchoramaVdbLibrary)>(dlsym(library, "EchoramaVdbLibrary")) : nullptr;
  if (!functions)
    throw Error(Error::Kind::NotPossible, path + ": what reads and writes OpenVDB cannot be loaded (" + dlerror() +
                                              "); install Echorama again, with all that it depends on");
  return *functions();
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
