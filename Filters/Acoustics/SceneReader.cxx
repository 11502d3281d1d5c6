// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/TextFile.h"
#include "SceneKeys.h"
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

namespace echorama {
namespace scene {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

std::string Shown(const Json& value)
{
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= 60 ? text : text.substr(0, 60) + " ...";
}

bool IsAffine(const Eigen::Matrix4d& rows)
{
  return rows.allFinite() && rows.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
}

// Checks beyond the ranges; a message without its place.

template <class T>
void Validate(const T& value)
{
  if constexpr (std::is_same_v<T, AnatomyParameters> || std::is_same_v<T, CalibrationRigParameters> ||
                std::is_same_v<T, Receiver>)
    value.Check();
}

void Validate(const ScenePlace& place)
{
  if (!place.rows)
    return;
  if (!IsAffine(*place.rows))
    Refuse("the last row must be 0 0 0 1");
  const Eigen::Matrix3d linear = place.rows->topLeftCorner<3, 3>();
  if (!(linear.determinant() > 1e-12 * std::pow(linear.norm(), 3)))
    Refuse("the matrix mirrors or flattens what it moves");
}

void Validate(const ScenePose& pose)
{
  if (pose.rows) {
    if (!IsAffine(*pose.rows) || !IsRotation(pose.rows->topLeftCorner<3, 3>()))
      Refuse("the matrix is not rigid: a rotation and a translation, with 0 0 0 1 as its last row");
    return;
  }
  const Vector3d beam = pose.target - pose.face;
  if (!(beam.norm() > 1e-6))
    Refuse("face and target are the same point");
  if (!(pose.fan.cross(beam).norm() > 1e-6 * pose.fan.norm() * beam.norm()))
    Refuse("the fan lies along the beam");
}

void Validate(const SceneProbe& probe)
{
  probe.Resolve();
}

void Validate(const ScenePacking& packing)
{
  packing.tissue.packing.Check();
  if (std::none_of(packing.materials.begin(), packing.materials.end(), [](const auto& share) { return share.weight > 0.0; }))
    Refuse("no material has a weight above 0");
}

void Validate(const SceneCylinder& cylinder)
{
  if (!((cylinder.to - cylinder.from).norm() > 1e-6))
    Refuse("from and to are the same point");
}

void Validate(const SceneRecording& recording)
{
  const Eigen::Matrix4d matrix = recording.trackerToWorld.Matrix().matrix();
  if (!IsRotation(matrix.topLeftCorner<3, 3>()))
    Refuse("trackerToWorld is not rigid");
}

// What an item has from its scene unless it says otherwise.
template <class T>
void Inherit(const SynthesisScene&, T&)
{
}

void Inherit(const SynthesisScene& scene, ScenePacking& packing)
{
  packing.tissue.packing.seed = scene.seed;
}

void Inherit(const SynthesisScene& scene, AnatomyParameters& anatomy)
{
  anatomy.seed = scene.seed;
}

/// One object of the text, key by key.
class Reader {
public:
  static constexpr bool reads = true;
  struct Source {
    std::string name;
    const SynthesisScene* scene = nullptr; ///< whose materials are read so far
  };

  Reader(const Source& text, const Json& object, std::string path, bool mayBeList = false)
    : text_(text), object_(object), path_(std::move(path))
  {
    if (!object.is_object() && !(mayBeList && object.is_array()))
      Fail(path_, "an object is needed, not " + Shown(object));
  }

  /// Reads all of \a value, whose keys must all be known.
  template <class T>
  static void Read(const Source& text, const Json& json, const std::string& path, T& value)
  {
    Reader reader(text, json, path, mayBeRows<T>);
    if constexpr (mayBeRows<T>)
      value.rows = reader.Rows();
    if (json.is_object()) {
      Describe(reader, value);
      reader.Finish();
    }
    reader.Try(path, [&value] { Validate(value); });
  }

  void Constant(const char* key, const char* wanted)
  {
    const Json* found = Find(key);
    if (!found)
      Fail(path_, Missing(key));
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

  void MaterialName(const char* key, std::string& value, Presence presence = {})
  {
    Value(Parameter(key, value, ""), presence);
    Try(At(key), [this, &value] { text_.scene->MaterialOf(value); });
  }

  template <class T>
  void Object(const char* key, T& value, const char*, Presence presence = {})
  {
    if (const Json* found = FindNeeded(key, presence))
      Read(text_, *found, At(key), value);
  }

  template <class T>
  void MaybeObject(const char* key, std::optional<T>& value, const char*)
  {
    if (const Json* found = Find(key))
      Read(text_, *found, At(key), value.emplace());
  }

  template <class T>
  void List(const char* key, std::vector<T>& values, const char*, Presence presence = {})
  {
    const Json* found = FindNeeded(key, presence);
    if (!found)
      return;
    if (!found->is_array() || found->size() > longestList || (presence == Presence::Needed && found->empty()))
      Fail(At(key), "a list of up to " + std::to_string(longestList) + (presence == Presence::Needed ? " and at least one" : "") +
                        " is needed, not " + Shown(*found));
    values.clear();
    for (std::size_t i = 0; i < found->size(); ++i) {
      values.emplace_back();
      Read(text_, (*found)[i], At(key, i), values.back());
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
        Inherit(*text_.scene, fresh);
        Read(text_, *found, At(form.key), fresh);
        value = std::move(fresh);
      }
    };
    (read(forms, T()), ...);
  }

  void Shares(const char* key, std::vector<ScenePacking::Share>& shares, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of weights by material is needed, not " + Shown(*found));
    shares.clear();
    for (const auto& [name, weight] : found->items()) {
      Try(At(key), [this, &name = name] { text_.scene->MaterialOf(name); });
      shares.push_back({name, NumberFrom<double>(weight, At(key) + "." + name, weights)});
    }
  }

  template <class Variant>
  void Views(const char* key, Variant& value, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (found->is_object() && found->contains("recording")) {
      RecordingKey recording{value.template emplace<SceneRecording>()};
      Read(text_, *found, At(key), recording);
    } else if (found->is_object() && found->contains("poses"))
      Read(text_, *found, At(key), value.template emplace<SceneViews>());
    else
      Read(text_, *found, At(key), value.template emplace<SceneRow>());
  }

  void Materials(const char* key, std::vector<Material>& materials, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of materials by name is needed, not " + Shown(*found));
    materials.clear();
    for (const auto& [name, json] : found->items()) {
      const std::string place = At(key) + "." + name;
      if (name.empty() || name.size() > 100)
        Fail(At(key), "the name of a material must be of 1 to 100 characters");
      Reader reader(text_, json, place);
      std::string like;
      reader.Value(Parameter("Like", like, ""));
      Material material;
      if (!like.empty())
        reader.Try(place + ".like", [this, &like, &material] { material = text_.scene->MaterialOf(like); });
      material.name = name;
      Describe(reader, material);
      reader.Finish();
      materials.push_back(material);
    }
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
    throw Error(Error::Kind::BadFile, text_.name + ": " + (path.empty() ? "" : path + ": ") + reason);
  }

private:
  std::string At(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  std::string At(const std::string& key, std::size_t index) const { return At(key) + "[" + std::to_string(index) + "]"; }
  static std::string Missing(const std::string& key) { return "\"" + key + "\" is missing"; }

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
      Fail(path_, Missing(key));
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
    } else if constexpr (std::is_same_v<T, Vector3d*>) {
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

  /// When it is the rows of a matrix instead of an object.
  std::optional<Eigen::Matrix4d> Rows() const
  {
    if (!object_.is_array())
      return {};
    const auto wrong = [this] { Fail(path_, "4 rows of 4 numbers are needed, not " + Shown(object_)); };
    if (object_.size() != 4)
      wrong();
    Eigen::Matrix4d rows;
    for (std::size_t i = 0; i < 4; ++i) {
      if (!object_[i].is_array() || object_[i].size() != 4)
        wrong();
      for (std::size_t j = 0; j < 4; ++j)
        rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            NumberFrom<double>(object_[i][j], path_ + "[" + std::to_string(i) + "][" + std::to_string(j) + "]", {-1e9, 1e9});
    }
    return rows;
  }

  const Source& text_;
  const Json& object_;
  std::string path_;
  std::vector<std::string> known_;
};

Json Parse(const std::string& name, const std::string& text)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadFile, name + ": " + reason); };
  std::vector<std::set<std::string>> keys; // of the objects that are open
  const auto watch = [&fail, &keys](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth > 32)
      fail("its lists are nested more than 32 deep"); // an attack on the stack
    if (event == Json::parse_event_t::object_start)
      keys.emplace_back();
    else if (event == Json::parse_event_t::object_end)
      keys.pop_back();
    else if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      fail("the key " + Shown(parsed) + " is there twice in one object");
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), watch);
  } catch (const nlohmann::json::exception& problem) {
    fail("it is not JSON (" + std::string(problem.what()).substr(0, 200) + ")");
  }
  return {};
}
} // namespace

std::string Quoted(const std::string& text)
{
  return Shown(text);
}

} // namespace scene

SynthesisScene SceneFromJson(const std::string& text, const std::string& name, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene;
  const scene::Reader::Source place{name, &scene};
  auto json = scene::Parse(name, text);
  if (json.is_object())
    json.erase("$schema"); // a hint for editors
  if (seed && json.is_object())
    json["seed"] = *seed;
  scene::Reader::Read(place, json, "", scene);
  if (scene.sweep.alongRecording && !std::holds_alternative<SceneRecording>(scene.views))
    throw Error(Error::Kind::BadFile, name + ": sweep.alongRecording: the views are not those of a recording");
  if (scene.gel && !scene.MaterialOf(scene.background).IsGas())
    throw Error(Error::Kind::BadFile, name + ": background: around gel there is air, not \"" + scene.background + "\"");
  return scene;
}

SynthesisScene ReadScene(const std::string& path, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene = SceneFromJson(ReadTextFile(path), path, seed);
  scene.folder = std::filesystem::path(path).parent_path().string();
  return scene;
}

} // namespace echorama
