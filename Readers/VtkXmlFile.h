// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <vector>

namespace echorama {

/// Checks a VTK file of a \a type, ImageData (.vti) or PolyData (.vtp), before VTK's reader sees it. That reader ends the
/// process on some damaged files (a DataArray of an unknown type, blocks of no bytes), and silently puts other numbers in the
/// place of those that it cannot read. Checked are the elements that it looks at, with their types, counts, extents and places,
/// and the lengths in front of the data.
/// \returns notes on Origin, Spacing and Direction of an image, where they are missing
/// \throws Error(BadFile) naming the element and the reason; Error(FileSystem) when the file cannot be opened.
std::vector<std::string> CheckVtkXmlFile(const std::string& path, const std::string& type = "ImageData");

} // namespace echorama
