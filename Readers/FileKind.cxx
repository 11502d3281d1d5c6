// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/FileKind.h"

#include "Readers/SequenceFile.h"
#include "Readers/TransformFile.h"
#include <filesystem>
#include <fstream>

namespace echorama {
namespace {

std::string FirstBytes(const std::string& path)
{
  std::string bytes(1 << 16, '\0');
  std::error_code none;
  std::ifstream stream(path, std::ios::binary);
  if (!std::filesystem::is_regular_file(path, none) || !stream)
    return {};
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
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
  switch (format) {
  case FileFormat::MetaImage:
    return "MetaImage";
  case FileFormat::Nrrd:
    return "NRRD";
  case FileFormat::VtkXmlImage:
    return "VTK XML image";
  case FileFormat::Nifti:
    return "NIfTI";
  case FileFormat::Dicom:
    return "DICOM";
  case FileFormat::Kretz:
    return "GE Kretz";
  case FileFormat::Vdb:
    return "OpenVDB";
  case FileFormat::ImageStack:
    return "stack of pictures";
  case FileFormat::Unknown:
    break;
  }
  return "unknown";
}

} // namespace echorama
