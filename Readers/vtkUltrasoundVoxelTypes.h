// SPDX-License-Identifier: BSD-3-Clause
// The types of voxels in files as VTK's, and back. Not a class: for the readers and writers here.
#ifndef vtkUltrasoundVoxelTypes_h
#define vtkUltrasoundVoxelTypes_h

#include "Core/Base/Error.h"
#include "Readers/VoxelType.h"

#include "vtkDataArray.h"
#include "vtkType.h"

#include <cstdint>
#include <string>
#include <type_traits>

namespace echorama {

inline int VtkTypeOf(VoxelType type)
{
  constexpr int types[] = {VTK_SIGNED_CHAR,  VTK_UNSIGNED_CHAR, VTK_SHORT,       VTK_UNSIGNED_SHORT, VTK_INT,
                           VTK_UNSIGNED_INT, VTK_TYPE_INT64,    VTK_TYPE_UINT64, VTK_FLOAT,          VTK_DOUBLE};
  return types[static_cast<int>(type)];
}

template <class T>
constexpr VoxelType VoxelTypeOf()
{
  if constexpr (std::is_floating_point_v<T>) {
    return sizeof(T) == 4 ? VoxelType::Float32 : VoxelType::Float64;
  }
  constexpr VoxelType types[] = {VoxelType::Int8,  VoxelType::UInt8,  VoxelType::Int16, VoxelType::UInt16,
                                 VoxelType::Int32, VoxelType::UInt32, VoxelType::Int64, VoxelType::UInt64};
  constexpr int power = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
  return types[2 * power + (std::is_signed_v<T> ? 0 : 1)];
}

/** \throws Error(BadInput) for an array that does not hold numbers. */
inline VoxelType VoxelTypeOf(vtkDataArray* array)
{
  switch (array->GetDataType()) {
    vtkTemplateMacro(return VoxelTypeOf<VTK_TT>());
  default:
    throw Error(Error::Kind::BadInput, std::string("voxels of type ") + array->GetDataTypeAsString() + " cannot be written");
  }
}

/** Grey out of colours (the first three of \a components). */
template <class T>
inline void MakeGrey(const T* colours, std::uint64_t components, T* grey, vtkIdType count)
{
  for (vtkIdType i = 0; i < count; ++i, colours += components) {
    grey[i] = Luminance(colours);
  }
}

} // namespace echorama

#endif
