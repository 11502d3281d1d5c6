// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include <Eigen/Core>
#include <nlohmann/json.hpp>
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

  /// The whole \a text as JSON, of at most 32 levels: deeper nesting is an attack on the stack.
  Json Parse(std::string_view text) const
  {
    const auto shallow = [this](int depth, nlohmann::json::parse_event_t, const Json&) {
      if (depth > 32)
        Fail("its lists are nested more than 32 deep");
      return true;
    };
    try {
      return Json::parse(text.begin(), text.end(), shallow);
    } catch (const nlohmann::json::exception& problem) {
      Fail("it is not JSON (" + std::string(problem.what()).substr(0, 200) + ")"); // it quotes what it read
    }
  }

  const Json& Member(const Json& object, const char* key) const
  {
    if (!object.is_object() || !object.contains(key))
      Fail(std::string("\"") + key + "\" is missing");
    return object.at(key);
  }

  double Number(const Json& value) const
  {
    if (!value.is_number())
      Fail("a number is needed, not " + Shown(value));
    return value.get<double>(); // JSON has no NaN; overflowing numbers are refused by the parser
  }

  std::string Text(const Json& value) const
  {
    if (!value.is_string())
      Fail("a text is needed, not " + Shown(value));
    return value.get<std::string>();
  }

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
  void Need(const Json& object, const char* key, const std::string& wanted) const
  {
    const Json& value = Member(object, key);
    if (!value.is_string() || value.get<std::string>() != wanted)
      Fail(std::string("\"") + key + "\" is " + Shown(value) + "; \"" + wanted + "\" is needed");
  }

  /// A matrix as a list of rows.
  template <class Derived>
  static Json RowsOf(const Eigen::MatrixBase<Derived>& matrix)
  {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      Json row = Json::array();
      for (Eigen::Index j = 0; j < matrix.cols(); ++j)
        row.push_back(matrix(i, j));
      rows.push_back(row);
    }
    return rows;
  }

private:
  static std::string Shown(const Json& value)
  {
    const std::string text = value.dump(-1, ' ', true);
    return text.size() <= 60 ? text : text.substr(0, 60) + " ...";
  }

  std::string name_;
};

} // namespace echorama
