// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/ByteOrder.h"
#include "Readers/ImageHeader.h"
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace echorama {

/// What we use of a NIfTI header of either version, as numbers of this machine.
struct NiftiHeader {
  std::string magic; ///< its four bytes
  std::array<std::int64_t, 8> dim{};
  std::array<double, 8> pixdim{};
  int datatype = 0, qformCode = 0, sformCode = 0, units = 0;
  double offset = 0.0, slope = 0.0, intercept = 0.0, timeOffset = 0.0;
  std::array<double, 6> quaternion{}; ///< b c d, then the offset
  std::array<double, 12> srow{};
  std::string description, intentName;
};

/// Numbers out of bytes, in the byte order of this machine or the other one.
class NiftiBytes {
public:
  NiftiBytes(std::string_view bytes, bool swap) : bytes_(bytes), swap_(swap) {}
  template <class T>
  T At(std::size_t offset) const
  {
    char bytes[sizeof(T)];
    std::memcpy(bytes, bytes_.data() + offset, sizeof(T));
    if (swap_)
      SwapBytes(bytes, sizeof(T), 1);
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }
  /// Up to the first zero, without blanks at the end.
  std::string Text(std::size_t offset, std::size_t length) const;

private:
  std::string_view bytes_;
  bool swap_;
};

/// The version that the first four bytes name, 0 for none. \param swap set to whether its numbers are in the other byte order
int NiftiVersion(std::string_view start, bool& swap);

/// Bytes of the header of a version.
std::size_t NiftiHeaderSize(int version);

NiftiHeader ParseNiftiHeader(int version, const NiftiBytes& bytes);

/// The voxel type of a code, nothing for those that are not supported; NiftiTypeName says what these are.
std::optional<VoxelType> NiftiVoxelType(int code);
const char* NiftiTypeName(int code);

/// How our extension of the header begins, and the description that we write when there is no other.
inline const std::string NiftiCommentStart = "Echorama volume", NiftiDescription = "Echorama";
constexpr int NiftiCommentCode = 6;

/// All that comes before the voxels of a NIfTI-1 file (NIfTI-2 when a dimension is beyond 32767). sform and qform hold the pose
/// as 32-bit floats, which is all that NIfTI-1 has; an extension of the header (a comment, which other programs skip) holds
/// it exactly, and the fields.
/// \param path the file, for messages
/// \param roundingMm by how many millimetres other programs see a voxel displaced, at most: the rounding to floats
/// \throws Error(BadInput) for fields that are too long, or a geometry beyond the range of floats.
std::string NiftiHeaderText(const std::string& path, const ImageHeader& header, double& roundingMm);

} // namespace echorama
