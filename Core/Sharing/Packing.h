// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace echorama {

/// Values as bytes, for processes of one program on machines of one kind: exact, with nothing that tells what they are. Packed
/// takes them in and Unpacked gives them back in the same order, so that one template can say for both what a struct consists of.
class Packed {
public:
  template <class... T>
  Packed& operator()(const T&... values)
  {
    (Put(values), ...);
    return *this;
  }
  const std::string& Bytes() const { return bytes_; }

private:
  template <class T, class = std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>>>
  void Put(const T& value)
  {
    PutAll(&value, 1);
  }
  template <class Matrix>
  void Put(const Eigen::PlainObjectBase<Matrix>& matrix)
  {
    static_assert(Matrix::SizeAtCompileTime != Eigen::Dynamic, "its size would have to be told");
    PutAll(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }
  void Put(const Pose& pose) { Put(pose.matrix()); }
  void Put(const std::string& text)
  {
    Put(text.size());
    PutAll(text.data(), text.size());
  }
  void Put(const ImageGeometry& g)
  {
    (*this)(g.dimensions[0], g.dimensions[1], g.dimensions[2], g.origin, g.spacing, g.direction);
  }
  template <class T>
  void Put(const Volume<T>& volume)
  {
    const std::array<int, 3>& n = volume.Dimensions();
    (*this)(n[0], n[1], n[2]);
    PutAll(volume.View().begin(), static_cast<std::size_t>(volume.View().Size()));
  }
  template <class T>
  void PutAll(const T* values, std::size_t count)
  {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }

  std::string bytes_;
};

/// \throws Error(BadInput) when there are no more
class Unpacked {
public:
  explicit Unpacked(const std::string& bytes) : bytes_(bytes) {}

  template <class... T>
  Unpacked& operator()(T&&... values)
  {
    (Get(values), ...);
    return *this;
  }
  bool AtEnd() const { return at_ == bytes_.size(); }

private:
  template <class T, class = std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>>>
  void Get(T& value)
  {
    GetAll(&value, 1);
  }
  template <class Matrix>
  void Get(Eigen::PlainObjectBase<Matrix>& matrix)
  {
    GetAll(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }
  void Get(Pose& pose) { Get(pose.matrix()); }
  void Get(std::string& text)
  {
    std::size_t size = 0;
    Get(size);
    Check(size);
    text.assign(size, '\0');
    GetAll(text.data(), size);
  }
  void Get(ImageGeometry& g) { (*this)(g.dimensions[0], g.dimensions[1], g.dimensions[2], g.origin, g.spacing, g.direction); }
  template <class T>
  void Get(Volume<T>& volume)
  {
    std::array<int, 3> n;
    (*this)(n[0], n[1], n[2]);
    volume = Volume<T>(n);
    GetAll(volume.View().begin(), static_cast<std::size_t>(volume.View().Size()));
  }
  template <class T>
  void GetAll(T* values, std::size_t count)
  {
    Check(count * sizeof(T));
    std::memcpy(static_cast<void*>(values), bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  void Check(std::size_t bytes) const
  {
    if (bytes > bytes_.size() - at_)
      throw Error(Error::Kind::BadInput, "a message of another rank is too short");
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
};

} // namespace echorama
