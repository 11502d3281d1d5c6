// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/TrackerAddress.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"

namespace echorama {
namespace {

[[noreturn]] void RefuseAddress(const std::string& address, const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, address + ": " + reason);
}

} // namespace

TrackerAddress TrackerAddress::Parse(const std::string& text)
{
  TrackerAddress address;
  address.text = text;
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos || colon == 0)
    RefuseAddress(text, "a tracker is named as SCHEME:PLACE, such as igtl://localhost:18944");
  address.scheme = text.substr(0, colon);
  std::size_t question = text.find('?', colon);
  if (address.scheme == "fused") {
    const std::size_t bar = text.find('|', colon);
    question = bar == std::string::npos ? bar : text.find('|', bar + 1);
  }
  address.place = text.substr(colon + 1, question == std::string::npos ? std::string::npos : question - colon - 1);
  if (question == std::string::npos)
    return address;
  std::size_t at = question + 1;
  while (at <= text.size()) {
    const std::size_t next = std::min(text.find('&', at), text.size());
    const std::string option = text.substr(at, next - at);
    const std::size_t equals = option.find('=');
    if (equals == std::string::npos || equals == 0)
      RefuseAddress(text, "\"" + option + "\" is not OPTION=VALUE");
    if (!address.options.emplace(option.substr(0, equals), option.substr(equals + 1)).second)
      RefuseAddress(text, "the option " + option.substr(0, equals) + " is given twice");
    at = next + 1;
  }
  return address;
}

void TrackerAddress::Set(ParameterList parameters) const
{
  for (const auto& [name, value] : options) {
    Parameter* found = nullptr;
    std::string list;
    for (Parameter& parameter : parameters) {
      if (name == parameter.Key() || "--" + name == parameter.Flag())
        found = &parameter;
      list += (list.empty() ? "" : ", ") + parameter.Key();
    }
    if (!found)
      RefuseAddress(text, "there is no option " + name + "; there are: " + list);
    try {
      found->Set(value);
      found->Check();
    } catch (const Error& error) {
      RefuseAddress(text, error.what());
    }
  }
}

TrackerAddress::Endpoint TrackerAddress::HostAndPort(const std::string& fallbackHost, int fallbackPort) const
{
  Endpoint endpoint{fallbackHost, fallbackPort};
  std::string rest = place;
  if (rest.compare(0, 2, "//") == 0)
    rest.erase(0, 2);
  while (!rest.empty() && rest.back() == '/')
    rest.pop_back();
  const std::size_t colon = rest.rfind(':');
  if (colon != std::string::npos) {
    if (!ParseNumber(rest.substr(colon + 1), endpoint.port) || endpoint.port < 0 || endpoint.port > 65535)
      RefuseAddress(text, "the port must be a whole number from 0 to 65535");
    rest.erase(colon);
  }
  if (!rest.empty())
    endpoint.host = rest;
  return endpoint;
}

} // namespace echorama
