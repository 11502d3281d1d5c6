// SPDX-License-Identifier: BSD-3-Clause
#include "SceneKeys.h"
#include <nlohmann/json.hpp>

namespace echorama {
namespace scene {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

class SchemaMaker {
public:
  static constexpr bool reads = false;
  /// Of the objects that have the keys of T.
  template <class T>
  static Json Make(T&& value)
  {
    SchemaMaker maker;
    Describe(maker, value);
    Json schema{{"type", "object"}, {"properties", std::move(maker.properties_)}, {"additionalProperties", false}};
    if (!maker.required_.empty())
      schema["required"] = std::move(maker.required_);
    if (!maker.oneOf_.empty())
      schema["oneOf"] = std::move(maker.oneOf_);
    if constexpr (mayBeRows<std::decay_t<T>>) {
      Json row{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 4}, {"maxItems", 4}};
      Json rows{{"type", "array"}, {"items", std::move(row)}, {"minItems", 4}, {"maxItems", 4}};
      rows["description"] = "The rows of a 4 x 4 matrix.";
      return {{"oneOf", Json::array({std::move(rows), std::move(schema)})}};
    }
    return schema;
  }

  void Constant(const char* key, const char* text)
  {
    properties_[key] = {{"const", text}};
    required_.push_back(key);
  }
  void Text(const char* key, const std::string& value, const char* help, Presence presence = {})
  {
    Add(key, {{"type", "string"}, {"maxLength", longestText}}, help, presence);
    if (presence == Presence::Needed)
      properties_[key]["minLength"] = 1;
    else
      properties_[key]["default"] = value;
  }
  template <class T>
  void Number(const char* key, const T& value, const Range& range, const char* help)
  {
    Add(key, NumberSchema<T>(range), help);
    properties_[key]["default"] = value;
  }
  template <class T>
  void Number(const char* key, const std::optional<T>&, const Range& range, const char* help)
  {
    Add(key, NumberSchema<T>(range), help);
  }
  void Seed(const char* key, std::uint64_t value, const char* help)
  {
    Add(key, {{"type", "integer"}, {"minimum", 0}, {"maximum", largestSeed}, {"default", value}}, help);
  }
  void Flag(const char* key, bool value, const char* help) { Add(key, {{"type", "boolean"}, {"default", value}}, help); }
  template <class T>
  void Choice(const char* key, const T& value, const Choices<T>& choices, const char* help)
  {
    Json names = Json::array();
    Json standard;
    for (const auto& [name, choice] : choices) {
      names.push_back(name);
      if (choice == value)
        standard = name;
    }
    Add(key, {{"enum", std::move(names)}, {"default", std::move(standard)}}, help);
  }
  void Vector(const char* key, const Vector3d& value, const Range& range, const char* help)
  {
    Add(key,
        {{"type", "array"},
         {"items", NumberSchema<double>(range)},
         {"minItems", 3},
         {"maxItems", 3},
         {"default", Json::array({value.x(), value.y(), value.z()})}},
        help);
  }
  void MaterialName(const char* key, const std::string& value, Presence presence = {})
  {
    Add(key, {{"type", "string"}}, "Name of a material.", presence);
    if (presence == Presence::Optional)
      properties_[key]["default"] = value;
  }
  template <class T>
  void Object(const char* key, T& value, const char* help, Presence presence = {})
  {
    Add(key, presence == Presence::FromPreset ? WithoutDefaults(Make(value)) : Make(value), help, presence);
  }
  template <class T>
  void List(const char* key, std::vector<T>&, const char* help, Presence presence = {})
  {
    Add(key, {{"type", "array"}, {"items", Make(T())}, {"maxItems", longestList}}, help, presence);
    if (presence == Presence::Needed)
      properties_[key]["minItems"] = 1;
  }
  template <class Variant, class... T>
  void OneOf(Variant&, const Form<T>&... forms)
  {
    (Add(forms.key, Make(T()), forms.help), ...);
    oneOf_ = Json::array();
    (oneOf_.push_back({{"required", {forms.key}}}), ...);
  }
  template <class Variant>
  void Views(const char* key, Variant&, const char* help)
  {
    SceneRecording recording;
    Add(key, {{"oneOf", Json::array({Make(SceneRow()), Make(SceneViews()), Make(RecordingKey{recording})})}}, help);
  }
  void Materials(const char* key, std::vector<Material>&, const char* help)
  {
    Json material = WithoutDefaults(Make(Material())); // they are those of the material which this one is like
    material["properties"]["like"] = {{"type", "string"},
                                      {"description", "The material that it is like but for what is said here."}};
    Add(key, {{"type", "object"}, {"additionalProperties", std::move(material)}}, help);
  }
  void Shares(const char* key, const std::vector<ScenePacking::Share>& shares, const char* help)
  {
    Json standard = Json::object();
    for (const ScenePacking::Share& share : shares)
      standard[share.material] = share.weight;
    Add(key, {{"type", "object"}, {"additionalProperties", NumberSchema<double>(weights)}, {"default", std::move(standard)}},
        help);
  }

private:
  static Json WithoutDefaults(Json schema)
  {
    for (auto& property : schema["properties"])
      property.erase("default");
    return schema;
  }

  void Add(const char* key, Json schema, const char* help, Presence presence = Presence::Optional)
  {
    schema["description"] = help;
    properties_[key] = std::move(schema);
    if (presence == Presence::Needed)
      required_.push_back(key);
  }

  template <class T>
  static Json NumberSchema(const Range& range)
  {
    return {{"type", std::is_integral_v<T> ? "integer" : "number"},
            {range.open ? "exclusiveMinimum" : "minimum", range.low},
            {"maximum", range.high}};
  }

  Json properties_ = Json::object(), required_ = Json::array(), oneOf_;
};

} // namespace
} // namespace scene

std::string SceneSchema()
{
  scene::Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                     {"title", "Scene of synthetic ultrasound"},
                     {"description",
                      "What lies in the world, which probe looks at it from where, and how it is made into volumes. Lengths "
                      "in mm, angles in degrees; missing keys have their defaults."}};
  schema.update(scene::SchemaMaker::Make(SynthesisScene()));
  schema["properties"]["$schema"] = {{"type", "string"}, {"description", "For editors."}};
  return schema.dump(2) + "\n";
}

} // namespace echorama
