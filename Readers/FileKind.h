// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/ImageHeader.h"
#include <string>

namespace echorama {

/// What a file may hold for us.
enum class FileKind { Volume, Sequence, Poses, Transforms };

/// Told from the content; where that is no help (missing, empty, folders), from the extension: .json is poses, .xml transforms,
/// everything else a volume. Never throws.
FileKind KindOf(const std::string& path);

/// "NRRD", "GE Kretz" ...
const char* FormatText(FileFormat format);

} // namespace echorama
