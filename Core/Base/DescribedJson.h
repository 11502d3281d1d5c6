// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// JSON of structs that list their keys once, in a function template beside them:
//
//   template <class A>
//   void Describe(A& a, Tube& tube)
//   {
//     a.Points("path", tube.path, "The middle of the tube, at least two points.");
//     a.Value(Parameter("Radius", tube.radius, {0, 1e4, true}, "mm", "Of the tube."), Presence::Needed);
//   }
//
// A reader (JSON to struct, with every check) and a writer (back) walk that list, so they cannot drift apart. A kind of file with
// more to it derives from them, as scenes do (Filters/Scenes). A heavy header, to be named in .cxx files only.
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Base/ParameterJson.h"
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace echorama {

/// Whether a key must be there. What comes from a preset has no default of its own.
enum class Presence { Optional, Needed, FromPreset };

/// One form that an object may have: the key says which.
template <class T>
struct Form {
  const char* key;
  const char* help;
};

/// What has values alone.
template <class A>
void Each(A& a, const ParameterList& parameters)
{
  for (const Parameter& parameter : parameters)
    a.Value(parameter);
}

namespace described {

using Json = nlohmann::ordered_json;

inline constexpr std::size_t longestText = 4096, longestList = 100000;
inline constexpr std::uint64_t largestSeed = 9223372036854775807u; // VTK's seeds have a sign

inline std::string Shown(const Json& value)
{
  return JsonPlace::Shown(value);
}

/// One object of a text, key by key. \a Derived says how structs are checked beyond their ranges, Validate(value), and what they
/// have from what was read before, Inherit(context, value). Every failure is Error(BadFile) with the way to the key.
template <class Derived, class Context>
class Reader {
public:
  static constexpr bool reads = true;

  Reader(const std::string& name, Context& context, const Json& object, std::string path, bool mayBeList = false)
    : name_(name), context_(context), object_(object), path_(std::move(path))
  {
    if (!object.is_object() && !(mayBeList && object.is_array()))
      Fail(path_, "an object is needed, not " + Shown(object));
  }

  /// Reads all of \a value, whose keys must all be known.
  template <class T>
  static void Read(const std::string& name, Context& context, const Json& json, const std::string& path, T& value)
  {
    Derived reader(name, context, json, path, Derived::template mayBeList<T>);
    reader.ReadBody(value);
    reader.Try(path, [&value] { Derived::Validate(value); });
  }

  void Constant(const char* key, const char* wanted)
  {
    const Json* found = FindNeeded(key, Presence::Needed);
    if (!found->is_string() || found->get<std::string>() != wanted)
      Fail(At(key), Shown(*found) + " is not known; \"" + wanted + "\" is needed");
  }

  /// \returns whether it is there.
  bool Value(Parameter parameter, Presence presence = {})
  {
    const std::string key = parameter.Key();
    const Json* found = FindNeeded(key, presence);
    if (found)
      std::visit([&](auto& value) { Take(*found, At(key), parameter.range, presence, value); }, parameter.value);
    return found != nullptr;
  }
  bool Maybe(const Parameter& parameter, bool) { return Value(parameter); }

  template <class T>
  void Object(const char* key, T& value, const char*, Presence presence = {})
  {
    if (const Json* found = FindNeeded(key, presence))
      Derived::Read(name_, context_, *found, At(key), value);
  }

  template <class T>
  void MaybeObject(const char* key, std::optional<T>& value, const char*)
  {
    if (const Json* found = Find(key))
      Derived::Read(name_, context_, *found, At(key), value.emplace());
  }

  template <class T>
  void List(const char* key, std::vector<T>& values, const char*, Presence presence = {})
  {
    const Json* found = FindList(key, presence);
    if (!found)
      return;
    values.clear();
    for (std::size_t i = 0; i < found->size(); ++i) {
      values.emplace_back();
      Derived::Read(name_, context_, (*found)[i], At(key, i), values.back());
    }
  }

  /// Numbers with a range, or points of such.
  template <class T>
  void Numbers(const char* key, std::vector<T>& values, const ParameterRange& range, const char*, const char*,
               Presence presence = {})
  {
    const Json* found = FindList(key, presence);
    if (!found)
      return;
    values = std::vector<T>(found->size());
    for (std::size_t i = 0; i < found->size(); ++i) {
      T* value = &values[i];
      Take((*found)[i], At(key, i), range, presence, value);
    }
  }

  template <class Variant, class... T>
  void OneOf(Variant& value, const Form<T>&... forms)
  {
    const int there = (static_cast<int>(object_.contains(forms.key)) + ...);
    if (there != 1)
      Fail(path_,
           (there == 0 ? "one of " : "just one of ") + Joined(std::initializer_list<std::string>{forms.key...}) + " is needed");
    const auto read = [this, &value](const auto& form, auto fresh) {
      if (const Json* found = Find(form.key)) {
        Derived::Inherit(context_, fresh);
        Derived::Read(name_, context_, *found, At(form.key), fresh);
        value = std::move(fresh);
      }
    };
    (read(forms, T()), ...);
  }

  /// Refuses keys that nobody asked for.
  void Finish() const
  {
    for (const auto& item : object_.items())
      if (std::find(known_.begin(), known_.end(), item.key()) == known_.end())
        Fail(At(item.key()), "there is no such key; there are " + Joined(known_));
  }

  /// Names the key to what other kernels complain of.
  template <class F>
  void Try(const std::string& path, F&& f) const
  {
    try {
      f();
    } catch (const Error& error) {
      Fail(path, error.what());
    }
  }

  [[noreturn]] void Fail(const std::string& path, const std::string& reason) const
  {
    throw Error(Error::Kind::BadFile, name_ + ": " + (path.empty() ? "" : path + ": ") + reason);
  }

protected:
  // Structs that may be more than an object replace these two.
  template <class T>
  static constexpr bool mayBeList = false;
  template <class T>
  void ReadBody(T& value)
  {
    Describe(static_cast<Derived&>(*this), value);
    Finish();
  }

  std::string At(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  std::string At(const std::string& key, std::size_t index) const { return At(key) + "[" + std::to_string(index) + "]"; }

  const Json* Find(const std::string& key)
  {
    known_.push_back(key);
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }

  const Json* FindNeeded(const std::string& key, Presence presence)
  {
    const Json* found = Find(key);
    if (!found && presence == Presence::Needed)
      Fail(path_, "\"" + key + "\" is missing");
    return found;
  }

  const Json* FindList(const char* key, Presence presence)
  {
    const Json* found = FindNeeded(key, presence);
    if (found && (!found->is_array() || found->size() > longestList || (presence == Presence::Needed && found->empty())))
      Fail(At(key), "a list of up to " + std::to_string(longestList) + (presence == Presence::Needed ? " and at least one" : "") +
                        " is needed, not " + Shown(*found));
    return found;
  }

  template <class T>
  void Take(const Json& json, const std::string& path, const ParameterRange& range, Presence presence, T& value) const
  {
    if constexpr (std::is_same_v<T, Choice>) {
      const auto name = std::find(value.names.begin(), value.names.end(), json);
      if (name == value.names.end())
        Fail(path, Shown(json) + " is not known; there are \"" + Joined(value.names, "\", \"") + "\"");
      value.Set(static_cast<int>(name - value.names.begin()));
    } else if constexpr (std::is_same_v<T, std::string*>) {
      if (!json.is_string())
        Fail(path, "a text is needed, not " + Shown(json));
      *value = json.get<std::string>();
      if (value->size() > longestText || value->find('\0') != std::string::npos ||
          (presence == Presence::Needed && value->empty()))
        Fail(path, "the text must be of 1 to " + std::to_string(longestText) + " characters");
    } else if constexpr (std::is_same_v<T, bool*>) {
      if (!json.is_boolean())
        Fail(path, "true or false is needed, not " + Shown(json));
      *value = json.get<bool>();
    } else if constexpr (std::is_same_v<T, std::uint64_t*>) {
      if (!json.is_number_unsigned() || json.get<std::uint64_t>() > largestSeed)
        Fail(path, "a whole number in [0, 2^63) is needed, not " + Shown(json));
      *value = json.get<std::uint64_t>();
    } else if constexpr (std::is_same_v<T, Eigen::Vector3d*>) {
      if (!json.is_array() || json.size() != 3)
        Fail(path, "a list of 3 numbers is needed, not " + Shown(json));
      for (std::size_t i = 0; i < 3; ++i)
        (*value)[static_cast<Eigen::Index>(i)] = NumberFrom<double>(json[i], path + "[" + std::to_string(i) + "]", range);
    } else {
      *value = NumberFrom<std::remove_pointer_t<T>>(json, path, range);
    }
  }

  template <class T>
  T NumberFrom(const Json& json, const std::string& path, const ParameterRange& range) const
  {
    if (!json.is_number())
      Fail(path, "a number is needed, not " + Shown(json));
    const auto value = json.get<double>();
    if (!range.Holds(value))
      Fail(path, Shown(json) + " is out of range; it must be " + range.Demand());
    if constexpr (std::is_integral_v<T>)
      if (value != std::floor(value))
        Fail(path, "a whole number is needed, not " + Shown(json));
    return static_cast<T>(value);
  }

  const std::string& name_;
  Context& context_;
  const Json& object_;
  std::string path_;
  std::vector<std::string> known_;
};

/// A struct as a JSON object.
template <class Derived>
class Writer {
public:
  static constexpr bool reads = false;

  template <class T>
  static Json Write(T& value)
  {
    Derived writer;
    Describe(writer, value);
    return std::move(writer.object_);
  }

  void Constant(const char* key, const char* text) { object_[key] = text; }
  void Value(const Parameter& parameter, Presence = {}) { object_[parameter.Key()] = JsonOf(parameter); }
  bool Maybe(const Parameter& parameter, bool there)
  {
    if (there)
      Value(parameter);
    return there;
  }
  template <class T>
  void Object(const char* key, T& value, const char*, Presence = {})
  {
    object_[key] = Derived::Write(value);
  }
  template <class T>
  void MaybeObject(const char* key, std::optional<T>& value, const char*)
  {
    if (value)
      object_[key] = Derived::Write(*value);
  }
  template <class T>
  void List(const char* key, std::vector<T>& values, const char*, Presence = {})
  {
    Json list = Json::array();
    for (T& value : values)
      list.push_back(Derived::Write(value));
    object_[key] = std::move(list);
  }
  template <class T>
  void Numbers(const char* key, std::vector<T>& values, const ParameterRange& range, const char* unit, const char* help,
               Presence = {})
  {
    Json list = Json::array();
    for (T& value : values)
      list.push_back(JsonOf(Parameter(key, value, range, unit, help)));
    object_[key] = std::move(list);
  }
  template <class Variant, class... T>
  void OneOf(Variant& value, const Form<T>&... forms)
  {
    const auto write = [this](const auto& form, auto* held) {
      if (held)
        object_[form.key] = Derived::Write(*held);
    };
    (write(forms, std::get_if<T>(&value)), ...);
  }

protected:
  Json object_ = Json::object();
};

} // namespace described
} // namespace echorama
