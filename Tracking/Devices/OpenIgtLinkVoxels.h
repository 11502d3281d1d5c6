// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VoxelType.h"
#include <igtl_image.h>

namespace echorama {

/// OpenIGTLink's numbers of the types of voxels that it knows.
struct OpenIgtLinkVoxel {
  int number;
  VoxelType type;
};
inline constexpr OpenIgtLinkVoxel OpenIgtLinkVoxels[] = {
    {IGTL_IMAGE_STYPE_TYPE_INT8, VoxelType::Int8},       {IGTL_IMAGE_STYPE_TYPE_UINT8, VoxelType::UInt8},
    {IGTL_IMAGE_STYPE_TYPE_INT16, VoxelType::Int16},     {IGTL_IMAGE_STYPE_TYPE_UINT16, VoxelType::UInt16},
    {IGTL_IMAGE_STYPE_TYPE_INT32, VoxelType::Int32},     {IGTL_IMAGE_STYPE_TYPE_UINT32, VoxelType::UInt32},
    {IGTL_IMAGE_STYPE_TYPE_FLOAT32, VoxelType::Float32}, {IGTL_IMAGE_STYPE_TYPE_FLOAT64, VoxelType::Float64}};

} // namespace echorama
