// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/FileKind.h"
#include "Core/Geometry/TransformFile.h"
#include "Readers/DataFile.h"
#include "Readers/SequenceFile.h"
#include <filesystem>
#include <fstream>

namespace echorama {
namespace {

std::string FirstBytes(const std::string& path)
{
  std::error_code none;
  std::ifstream stream(std::filesystem::is_regular_file(path, none) ? path : "", std::ios::binary); // a pipe would not even open
  std::string bytes(1 << 16, '\0');
  bytes.resize(ReadPieces(stream, bytes.data(), bytes.size()));
  return bytes;
}

} // namespace

FileKind KindOf(const std::string& path)
{
  if (LooksLikeTransforms(FirstBytes(path)))
    return FileKind::Transforms;
  if (LooksLikeSequence(path))
    return FileKind::Sequence;
  const std::string extension = std::filesystem::path(path).extension().string();
  return extension == ".json" ? FileKind::Poses : extension == ".xml" ? FileKind::Transforms : FileKind::Volume;
}

const char* FormatText(FileFormat format)
{
  static const char* const texts[] = {"unknown", "MetaImage", "NRRD",    "VTK XML image",    "NIfTI",
                                      "DICOM",   "GE Kretz",  "OpenVDB", "stack of pictures"};
  return texts[static_cast<int>(format)];
}

} // namespace echorama
