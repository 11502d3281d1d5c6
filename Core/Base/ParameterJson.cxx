// SPDX-License-Identifier: BSD-3-Clause
#include "ParameterJson.h"

namespace echorama {

nlohmann::ordered_json JsonOf(const Parameter& parameter)
{
  return std::visit(
      [&parameter](const auto& value) -> nlohmann::ordered_json {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, Choice>)
          return parameter.Text();
        else if constexpr (std::is_same_v<T, Eigen::Vector3d*>)
          return {value->x(), value->y(), value->z()};
        else
          return *value;
      },
      parameter.value);
}

nlohmann::ordered_json JsonOf(const ParameterList& parameters)
{
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for (const Parameter& parameter : parameters)
    object[parameter.Key()] = JsonOf(parameter);
  return object;
}

} // namespace echorama
