// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include <string>
#include <vector>

namespace echorama {

/// A solid with its name, mm.
struct PrintedBody {
  std::string name;
  TriangleSurface surface;
};

/// Writes a 3MF file (core specification 1.2): an object per body, in mm, compressed. Bodies are moved so that each stands on the
/// plate, side by side. \throws Error(BadInput) when there are none or one has a point that is not finite, Error(TooLarge) beyond
/// 4 GB of XML, Error(FileSystem)
void WritePrintFile(const std::string& path, const std::vector<PrintedBody>& bodies);

} // namespace echorama
