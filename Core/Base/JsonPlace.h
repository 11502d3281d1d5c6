// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include "Core/Base/Json.h"
#include <Eigen/Core>
#include <string>
#include <string_view>

namespace echorama {

/// Where we are in a JSON file, and what we expect there: complaints name the place. For the kernels that read such files; a
/// heavy header, to be named in .cxx files only.
class JsonPlace {
public:
  using Json = nlohmann::ordered_json;

  explicit JsonPlace(std::string name) : name_(std::move(name)) {}
  JsonPlace In(const std::string& part) const { return JsonPlace(name_ + ", " + part); }
  [[noreturn]] void Fail(const std::string& reason) const { throw Error(Error::Kind::BadFile, name_ + ": " + reason); }

  /// The whole \a text as JSON. Refused are a key that is there twice in an object, of which the last would count, and what is an
  /// attack: more than 32 levels on the stack, more than 4,096 keys of an object on the time.
  Json Parse(std::string_view text) const;
  /// \a value as text, shortened.
  static std::string Shown(const Json& value);
  const Json& Member(const Json& object, const char* key) const;
  double Number(const Json& value) const;
  std::string Text(const Json& value) const;

  template <int Size>
  Eigen::Matrix<double, Size, 1> Vector(const Json& value) const
  {
    if (!value.is_array() || value.size() != Size)
      Fail("a list of " + std::to_string(Size) + " numbers is needed");
    Eigen::Matrix<double, Size, 1> vector;
    for (int i = 0; i < Size; ++i)
      vector[i] = Number(value[static_cast<std::size_t>(i)]);
    return vector;
  }

  template <int Size>
  Eigen::Matrix<double, Size, Size> Rows(const Json& value) const
  {
    if (!value.is_array() || value.size() != Size)
      Fail("a list of " + std::to_string(Size) + " rows is needed");
    Eigen::Matrix<double, Size, Size> matrix;
    for (int i = 0; i < Size; ++i)
      matrix.row(i) = Vector<Size>(value[static_cast<std::size_t>(i)]);
    return matrix;
  }

  /// Checks that the member \a key is the text \a wanted.
  void Need(const Json& object, const char* key, const std::string& wanted) const;

  /// As indented text. Texts in it that are not UTF-8 are mended.
  static std::string Print(const Json& value);

  /// A vector as a list.
  template <class Derived>
  static Json ListOf(const Eigen::MatrixBase<Derived>& vector)
  {
    Json list = Json::array();
    for (Eigen::Index i = 0; i < vector.size(); ++i)
      list.push_back(vector[i]);
    return list;
  }

  /// A matrix as a list of rows.
  template <class Derived>
  static Json RowsOf(const Eigen::MatrixBase<Derived>& matrix)
  {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
      rows.push_back(ListOf(matrix.row(i)));
    return rows;
  }

private:
  std::string name_;
};

} // namespace echorama
