// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/TrackerAddress.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <cmath>

namespace echorama {
namespace {

[[noreturn]] void RefuseAddress(const std::string& address, const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, address + ": " + reason);
}

bool ReadNumber(const std::string& text, double& number)
{
  return ParseNumber(text, number) && std::isfinite(number);
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
  const std::size_t question = text.find('?', colon);
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

void TrackerAddress::CheckOptions(const std::vector<std::string>& known) const
{
  for (const auto& [name, value] : options) {
    bool found = false;
    std::string list;
    for (const std::string& option : known) {
      found = found || option == name;
      list += (list.empty() ? "" : ", ") + option;
    }
    if (!found)
      RefuseAddress(text, "there is no option " + name + "; there are: " + (list.empty() ? "none" : list));
  }
}

double TrackerAddress::Number(const std::string& option, double fallback, double low, double high) const
{
  const auto found = options.find(option);
  if (found == options.end())
    return fallback;
  double number = 0.0;
  if (!ReadNumber(found->second, number) || number < low || number > high)
    RefuseAddress(text, option + " must be a number from " + NumberText(low) + " to " + NumberText(high));
  return number;
}

std::string TrackerAddress::Text(const std::string& option, const std::string& fallback) const
{
  const auto found = options.find(option);
  return found == options.end() ? fallback : found->second;
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
    double port = 0.0;
    if (!ReadNumber(rest.substr(colon + 1), port) || port < 0.0 || port > 65535.0 || port != std::floor(port))
      RefuseAddress(text, "the port must be a whole number from 0 to 65535");
    endpoint.port = static_cast<int>(port);
    rest.erase(colon);
  }
  if (!rest.empty())
    endpoint.host = rest;
  return endpoint;
}

} // namespace echorama
