// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/ZeroedMemory.h"
#include "Core/Geometry/ImageGeometry.h"
#include <array>
#include <cstddef>
#include <type_traits>

namespace echorama {

/// Voxels that lie somewhere else, as an array of dimensions nx x ny x nz, x fastest, without gaps. A 2D image has nz = 1.
template <class T>
class VolumeView {
public:
  VolumeView() = default;
  VolumeView(T* data, const std::array<int, 3>& dimensions) : data_(data), dimensions_(dimensions) {}
  /// A view of T is a view of const T.
  template <class U, class = std::enable_if_t<std::is_same_v<const U, T>>>
  VolumeView(const VolumeView<U>& other) : data_(other.Data()), dimensions_(other.Dimensions())
  {
  }

  T* Data() const { return data_; }
  bool Empty() const { return data_ == nullptr; }
  const std::array<int, 3>& Dimensions() const { return dimensions_; }
  int Slices() const { return dimensions_[2]; }
  std::ptrdiff_t RowStride() const { return dimensions_[0]; }
  std::ptrdiff_t SliceStride() const { return static_cast<std::ptrdiff_t>(dimensions_[0]) * dimensions_[1]; }
  std::ptrdiff_t Size() const { return SliceStride() * dimensions_[2]; }
  T* Row(int j, int k) const { return data_ + SliceStride() * k + RowStride() * j; }
  T& operator()(int i, int j, int k) const { return Row(j, k)[i]; }
  T& operator[](std::ptrdiff_t index) const { return data_[index]; }
  T* begin() const { return data_; }
  T* end() const { return data_ + Size(); }

private:
  T* data_ = nullptr;
  std::array<int, 3> dimensions_{0, 0, 0};
};

/// Voxels of its own, zeros where no other value is given.
template <class T>
class Volume {
public:
  Volume() = default;
  explicit Volume(const std::array<int, 3>& dimensions) : data_(SizeOf(dimensions)), dimensions_(dimensions) {}
  Volume(const std::array<int, 3>& dimensions, T value) : data_(SizeOf(dimensions), value), dimensions_(dimensions) {}
  VolumeView<T> View() { return {data_.data(), dimensions_}; }
  VolumeView<const T> View() const { return {data_.data(), dimensions_}; }
  const std::array<int, 3>& Dimensions() const { return dimensions_; }

private:
  static std::size_t SizeOf(const std::array<int, 3>& dimensions)
  {
    return static_cast<std::size_t>(dimensions[0]) * static_cast<std::size_t>(dimensions[1]) *
           static_cast<std::size_t>(dimensions[2]);
  }

  Zeroed<T> data_;
  std::array<int, 3> dimensions_{0, 0, 0};
};

/// A volume as our kernels take it: intensities, which of them are real, and where they lie.
/// An empty \a valid means that every voxel is real. Voxels that are not finite count as not real.
template <class T>
struct PosedVolume {
  VolumeView<const T> intensity;
  VolumeView<const unsigned char> valid; ///< 1 or 0
  ImageGeometry geometry;
};

} // namespace echorama
