// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VdbFile.h"

namespace echorama {

/// What this folder does for VdbFile.h. It is a library of its own, loaded with the first file in question: relocating OpenVDB
/// takes longer than starting all else that a program needs to read a volume.
struct VdbLibrary {
  decltype(&OpenVdb) open;
  decltype(&WriteVdb) write;
};

} // namespace echorama

extern "C" const echorama::VdbLibrary* EchoramaVdbLibrary();
