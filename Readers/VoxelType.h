// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace echorama {

/// The types of voxels that files hold. (Filters promise fewer, see Core/Imaging/VoxelTypes.h.)
enum class VoxelType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32, Float64 };

/// Calls functor(T(0)) with the type.
template <class Functor>
auto DispatchVoxelType(VoxelType type, Functor&& functor)
{
  switch (type) {
  case VoxelType::Int8:
    return functor(std::int8_t{});
  case VoxelType::UInt8:
    return functor(std::uint8_t{});
  case VoxelType::Int16:
    return functor(std::int16_t{});
  case VoxelType::UInt16:
    return functor(std::uint16_t{});
  case VoxelType::Int32:
    return functor(std::int32_t{});
  case VoxelType::UInt32:
    return functor(std::uint32_t{});
  case VoxelType::Int64:
    return functor(std::int64_t{});
  case VoxelType::UInt64:
    return functor(std::uint64_t{});
  case VoxelType::Float32:
    return functor(float{});
  case VoxelType::Float64:
    break;
  }
  return functor(double{});
}

/// Bytes of one voxel.
inline std::size_t SizeOf(VoxelType type)
{
  return DispatchVoxelType(type, [](auto zero) { return sizeof zero; });
}

/// Grey out of red, green and blue, by the weights of ITU-R BT.601.
template <class T>
T Luminance(const T* colours)
{
  const double value =
      0.299 * static_cast<double>(colours[0]) + 0.587 * static_cast<double>(colours[1]) + 0.114 * static_cast<double>(colours[2]);
  return static_cast<T>(std::is_integral_v<T> ? std::floor(value + 0.5) : value);
}

} // namespace echorama
