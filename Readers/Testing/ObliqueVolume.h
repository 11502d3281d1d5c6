// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Readers/ImageHeader.h"
#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

namespace echorama::testing {

inline constexpr VoxelType AllTypes[] = {VoxelType::Int8,    VoxelType::UInt8,  VoxelType::Int16, VoxelType::UInt16,
                                         VoxelType::Int32,   VoxelType::UInt32, VoxelType::Int64, VoxelType::UInt64,
                                         VoxelType::Float32, VoxelType::Float64};

/// A header whose numbers are no short ones, with two fields.
inline ImageHeader Oblique(VoxelType type, const std::array<int, 3>& dimensions = {5, 4, 3})
{
  ImageHeader header;
  header.type = type;
  header.geometry.dimensions = dimensions;
  header.geometry.origin = {1.0 / 3.0, -1e5 / 7.0, 1e-3};
  header.geometry.spacing = {0.1, 1.0 / 3.0, 0.7};
  header.geometry.direction = ExpRotation({0.3, -1.2, 2.0});
  header.fields = {{"Echorama_TimeStamp", "0.1"}, {"Modality", "MET_MOD_US"}};
  return header;
}

/// Values of every size, the extremes of T and (for real numbers) NaN among them.
template <class T>
std::vector<T> Values(std::size_t count)
{
  Random random(5, sizeof(T));
  std::vector<T> values(count);
  for (T& value : values)
    value = std::is_floating_point_v<T> ? static_cast<T>(random.Normal() * 1e3) : static_cast<T>(random.Bits());
  values[0] = std::numeric_limits<T>::lowest();
  values[1] = std::numeric_limits<T>::max();
  if (std::is_floating_point_v<T>)
    values[2] = std::numeric_limits<T>::quiet_NaN();
  return values;
}

/// The lines "key = value" of a MetaImage, some of them changed; lines without a value are left out.
inline std::string MetaImageLines(const std::vector<HeaderField>& lines, const std::map<std::string, std::string>& changes)
{
  std::string text;
  for (const auto& [key, value] : lines) {
    const auto change = changes.find(key);
    const std::string& now = change == changes.end() ? value : change->second;
    if (!now.empty())
      text += key + " = " + now + "\n";
  }
  return text;
}

} // namespace echorama::testing
