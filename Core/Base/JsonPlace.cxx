// SPDX-License-Identifier: BSD-3-Clause
// Here, so that the parser and the printer of JSON are compiled once.
#include "Core/Base/JsonPlace.h"
#include <set>
#include <vector>

namespace echorama {
std::string JsonPlace::Shown(const Json& value)
{
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= 60 ? text : text.substr(0, 60) + " ...";
}

JsonPlace::Json JsonPlace::Parse(std::string_view text) const
{
  constexpr std::size_t MostKeys = 4096;   // of an object, which looks through all of them for each
  std::vector<std::set<std::string>> keys; // of the objects that are open
  const auto watch = [this, &keys](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth > 32)
      Fail("its lists are nested more than 32 deep");
    if (event == Json::parse_event_t::object_start)
      keys.emplace_back();
    else if (event == Json::parse_event_t::object_end)
      keys.pop_back();
    else if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      Fail("the key " + Shown(parsed) + " is there twice in one object");
    if (event == Json::parse_event_t::key && keys.back().size() > MostKeys)
      Fail("an object has more than " + std::to_string(MostKeys) + " keys");
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), watch);
  } catch (const nlohmann::json::exception& problem) {
    Fail("it is not JSON (" + std::string(problem.what()).substr(0, 200) + ")"); // it quotes what it read
  }
}

const JsonPlace::Json& JsonPlace::Member(const Json& object, const char* key) const
{
  if (!object.is_object() || !object.contains(key))
    Fail(std::string("\"") + key + "\" is missing");
  return object.at(key);
}

double JsonPlace::Number(const Json& value) const
{
  if (!value.is_number())
    Fail("a number is needed, not " + Shown(value));
  return value.get<double>(); // JSON has no NaN; overflowing numbers are refused by the parser
}

std::string JsonPlace::Text(const Json& value) const
{
  if (!value.is_string())
    Fail("a text is needed, not " + Shown(value));
  return value.get<std::string>();
}

void JsonPlace::Need(const Json& object, const char* key, const std::string& wanted) const
{
  const Json& value = Member(object, key);
  if (!value.is_string() || value.get<std::string>() != wanted)
    Fail(std::string("\"") + key + "\" is " + Shown(value) + "; \"" + wanted + "\" is needed");
}

std::string JsonPlace::Print(const Json& value)
{
  return value.dump(2, ' ', false, Json::error_handler_t::replace);
}

} // namespace echorama
