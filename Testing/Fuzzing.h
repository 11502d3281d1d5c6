// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include <cstdint>
#include <cstdlib>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

namespace echorama {

/// Bytes as a file that lies in memory, for decoders that are given a path.
class MemoryFile {
public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : file_(memfd_create("fuzz", 0))
  {
    if (file_ < 0 || write(file_, data, size) != static_cast<ssize_t>(size))
      std::abort(); // the machine, not the decoder
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string Path() const { return "/proc/self/fd/" + std::to_string(file_); }

private:
  int file_;
};

/// What a fuzzer's entry returns after \a decode: refusing is fine, everything else that is thrown is a finding.
template <class Decode>
int Survives(Decode&& decode)
{
  try {
    decode();
  } catch (const Error&) {
  }
  return 0;
}

} // namespace echorama
