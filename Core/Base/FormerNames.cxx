// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/FormerNames.h"
#include <map>
#include <mutex>

namespace echorama {
namespace {

// What descriptions say, which is always the same: those of other structs that use a name have another help.
struct Register {
  std::mutex mutex;
  std::map<std::pair<std::string, std::string>, std::vector<FormerName>> names; // by present name and help
};

Register& All()
{
  static Register all;
  return all;
}

} // namespace

std::string FormerName::Warning(const std::string& asGiven, const std::string& now) const
{
  return asGiven + " is now " + now + "; the former name goes in version " + until;
}

Parameter Formerly(Parameter parameter, const std::string& name, const std::string& until)
{
  const std::lock_guard<std::mutex> lock(All().mutex);
  std::vector<FormerName>& names = All().names[{parameter.name, parameter.help}];
  for (const FormerName& former : names)
    if (former.name == name)
      return parameter;
  names.push_back({name, until});
  return parameter;
}

std::vector<FormerName> FormerNamesOf(const Parameter& parameter)
{
  const std::lock_guard<std::mutex> lock(All().mutex);
  const auto found = All().names.find({parameter.name, parameter.help});
  return found == All().names.end() ? std::vector<FormerName>() : found->second;
}

Parameter& NamedOrFormerly(ParameterList& parameters, std::string_view name, const std::function<void(const std::string&)>& warn)
{
  if (!Find(parameters, name))
    for (Parameter& parameter : parameters)
      for (const FormerName& former : FormerNamesOf(parameter))
        if (former.name == name) {
          warn(former.Warning(former.name, parameter.name));
          return parameter;
        }
  return Named(parameters, name);
}

} // namespace echorama
