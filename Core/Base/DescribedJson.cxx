// SPDX-License-Identifier: BSD-3-Clause
#include "DescribedJson.h"
#include <set>

namespace echorama::described {

std::string Shown(const Json& value)
{
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= 60 ? text : text.substr(0, 60) + " ...";
}

Json Parse(const std::string& name, const std::string& text)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadFile, name + ": " + reason); };
  std::vector<std::set<std::string>> keys; // of the objects that are open
  const auto watch = [&fail, &keys](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth > 32)
      fail("its lists are nested more than 32 deep");
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

} // namespace echorama::described
