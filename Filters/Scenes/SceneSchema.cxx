// SPDX-License-Identifier: BSD-3-Clause
#include "SceneKeys.h"
#include <cmath>

namespace echorama {
namespace scene {
namespace {

using described::Json;

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
  void Value(const Parameter& parameter, Presence presence = {})
  {
    const std::string key = parameter.Key(), unit = parameter.unit.empty() ? "" : " Unit: " + parameter.unit + ".";
    Add(key, SchemaOf(parameter), parameter.help + unit, presence);
    if (presence != Presence::Needed)
      properties_[key]["default"] = JsonOf(parameter);
    else if (std::holds_alternative<std::string*>(parameter.value))
      properties_[key]["minLength"] = 1;
  }
  bool Maybe(const Parameter& parameter, bool there)
  {
    Value(parameter);
    properties_[parameter.Key()].erase("default");
    return there;
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
  void MaybeObject(const char* key, std::optional<T>&, const char* help)
  {
    Add(key, Make(T()), help);
  }
  template <class T>
  void List(const char* key, std::vector<T>&, const char* help, Presence presence = {})
  {
    Add(key, {{"type", "array"}, {"items", Make(T())}, {"maxItems", longestList}}, help, presence);
    if (presence == Presence::Needed)
      properties_[key]["minItems"] = 1;
  }
  template <class T>
  void Numbers(const char* key, std::vector<T>&, const ParameterRange& range, const char* unit, const char* help,
               Presence presence = {})
  {
    T value{};
    Add(key, {{"type", "array"}, {"items", SchemaOf(Parameter(key, value, range, unit, help))}, {"maxItems", longestList}},
        help + std::string(" Unit: ") + unit + ".", presence);
    if (presence == Presence::Needed)
      properties_[key]["minItems"] = 1;
    else
      properties_[key]["default"] = Json::array();
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
    Add(key, {{"oneOf", Json::array({Make(SceneRow()), Make(SceneViews()), Make(SceneMotion()), Make(RecordingKey{recording})})}},
        help);
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
    Add(key, {{"type", "object"}, {"additionalProperties", NumberSchema("number", weights)}, {"default", std::move(standard)}},
        help);
  }

private:
  static Json WithoutDefaults(Json schema)
  {
    for (auto& property : schema["properties"])
      property.erase("default");
    return schema;
  }

  void Add(const std::string& key, Json schema, const std::string& help, Presence presence = Presence::Optional)
  {
    schema["description"] = help;
    properties_[key] = std::move(schema);
    if (presence == Presence::Needed)
      required_.push_back(key);
  }

  static Json NumberSchema(const char* type, const ParameterRange& range)
  {
    Json schema{{"type", type}};
    if (std::isfinite(range.low))
      schema[range.open ? "exclusiveMinimum" : "minimum"] = range.low;
    if (std::isfinite(range.high))
      schema["maximum"] = range.high;
    return schema;
  }

  static Json SchemaOf(const Parameter& parameter)
  {
    return std::visit(
        [&parameter](const auto& value) -> Json {
          using T = std::decay_t<decltype(value)>;
          if constexpr (std::is_same_v<T, Choice>)
            return {{"enum", value.names}};
          else if constexpr (std::is_same_v<T, std::string*>)
            return {{"type", "string"}, {"maxLength", longestText}};
          else if constexpr (std::is_same_v<T, bool*>)
            return {{"type", "boolean"}};
          else if constexpr (std::is_same_v<T, std::uint64_t*>)
            return {{"type", "integer"}, {"minimum", 0}, {"maximum", largestSeed}};
          else if constexpr (std::is_same_v<T, Eigen::Vector3d*>)
            return {{"type", "array"}, {"items", NumberSchema("number", parameter.range)}, {"minItems", 3}, {"maxItems", 3}};
          else
            return NumberSchema(std::is_same_v<T, double*> ? "number" : "integer", parameter.range);
        },
        parameter.value);
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
