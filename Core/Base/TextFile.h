// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <string>

namespace echorama {

/// All of a small file. \throws Error(FileSystem) when it cannot be read or is not a plain file, Error(BadFile) when it has
/// more than \a limit bytes: then it is something else.
std::string ReadTextFile(const std::string& path, std::size_t limit = 16 << 20);

/// Writes \a text under a temporary name and renames, so that a failure leaves what was there. \throws Error(FileSystem)
void WriteTextFile(const std::string& path, const std::string& text);

} // namespace echorama
