// SPDX-License-Identifier: BSD-3-Clause
// Check() writes a scene and reads it again, and so says the same as the reader.
#include "SceneKeys.h"

namespace echorama {
namespace scene {

using described::Json;

// Not in a nameless namespace: the keys are found beside it.
class Writer : public described::Writer<Writer> {
public:
  using Base = described::Writer<Writer>;

  template <class T>
  static Json Write(T& value)
  {
    if constexpr (mayBeRows<T>)
      if (value.rows) {
        Json rows = Json::array();
        for (const auto& row : value.rows->rowwise())
          rows.push_back({row[0], row[1], row[2], row[3]});
        return rows;
      }
    return Base::Write(value);
  }

  void Value(const Parameter& parameter, Presence presence = {})
  {
    const auto* text = std::get_if<std::string*>(&parameter.value);
    const bool isRemark = text && presence != Presence::Needed && (parameter.name == "Name" || parameter.name == "About");
    if (!isRemark || !(*text)->empty())
      Base::Value(parameter);
  }
  void MaterialName(const char* key, const std::string& value, Presence = {}) { object_[key] = value; }
  template <class Variant>
  void Views(const char* key, Variant& value, const char*)
  {
    if (auto* recording = std::get_if<SceneRecording>(&value)) {
      RecordingKey under{*recording};
      object_[key] = Write(under);
    } else if (auto* views = std::get_if<SceneViews>(&value))
      object_[key] = Write(*views);
    else if (auto* motion = std::get_if<SceneMotion>(&value))
      object_[key] = Write(*motion);
    else
      object_[key] = Write(std::get<SceneRow>(value));
  }
  void Shares(const char* key, const std::vector<ScenePacking::Share>& shares, const char*)
  {
    Json object = Json::object();
    for (const ScenePacking::Share& share : shares)
      object[share.material] = share.weight;
    object_[key] = std::move(object);
  }
  void Materials(const char* key, std::vector<Material>& materials, const char*)
  {
    Json object = Json::object();
    for (Material& material : materials)
      object[material.name] = Write(material);
    object_[key] = std::move(object);
  }
};

} // namespace scene

void SynthesisScene::Check(const std::string& title) const
{
  for (std::size_t i = 0; i < materials.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (materials[i].name == materials[j].name)
        throw Error(Error::Kind::BadFile, title + ": materials." + materials[i].name + ": it is there twice");
  SynthesisScene copy = *this;
  SceneFromJson(scene::Writer::Write(copy).dump(), title);
}

std::string SceneToJson(const SynthesisScene& scene)
{
  scene.Check();
  SynthesisScene copy = scene;
  return scene::Writer::Write(copy).dump(2) + "\n";
}

} // namespace echorama
