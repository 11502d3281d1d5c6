// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/LoadedLibrary.h"
#include "Core/Base/Error.h"
#include <dlfcn.h>
#include <filesystem>

namespace echorama {
namespace {

// Of the library of this function.
std::filesystem::path OwnFolder()
{
  Dl_info info{};
  std::error_code none;
  return dladdr(reinterpret_cast<const void*>(&LoadedAddress), &info) != 0 && info.dli_fname
             ? std::filesystem::canonical(info.dli_fname, none).parent_path()
             : std::filesystem::path();
}

} // namespace

void* LoadedAddress(const std::string& library, const std::string& name, const std::string& what)
{
  const std::filesystem::path beside = OwnFolder() / library;
  std::error_code none;
  const std::string path = std::filesystem::exists(beside, none) ? beside.string() : library;
  // Lazily: what a library brings with it is large, and of that little is called.
  void* const handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (!handle)
    throw Error(Error::Kind::NotPossible, what + ": a library that this needs cannot be loaded (" + dlerror() +
                                              "); install Echorama again, with all that it depends on");
  void* const address = dlsym(handle, name.c_str());
  if (!address)
    throw Error(Error::Kind::NotPossible, what + ": " + path + " is of another version of Echorama; install Echorama again");
  return address;
}

} // namespace echorama
