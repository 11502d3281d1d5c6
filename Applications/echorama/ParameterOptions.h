// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "ProgramExport.h"
#include <any>
#include <CLI/App.hpp>
#include <string>

namespace echorama {

/// An option that sets \a parameter, whose description gives its help, unit, range, choices and default. A switch that is off is
/// turned on by its flag, one that is on is turned off by "--no-...". \a flag is the parameter's own when it is empty. What the
/// parameter lies in must live as long as \a options: \a owner keeps it.
ECHORAMA_PROGRAM_EXPORT CLI::Option* AddParameter(CLI::App* options, Parameter parameter, std::string flag, std::any owner);

/// The parameter that an option sets; nullptr when AddParameter() did not make it.
ECHORAMA_PROGRAM_EXPORT const Parameter* ParameterOf(const CLI::Option* option);

/// As the first, for one of a struct that outlives \a options: AddParameter(options, Describe(values->smoothing),
/// "WindowSeconds").
inline CLI::Option* AddParameter(CLI::App* options, ParameterList parameters, const std::string& name, std::string flag = {})
{
  return AddParameter(options, Named(parameters, name), std::move(flag), {});
}

/// The same for one or more parameters of a filter, of which \a filter is a vtkSmartPointer.
template <class Pointer>
auto AddParameter(CLI::App* options, const Pointer& filter, const std::string& name, std::string flag = {})
    -> decltype(filter->Parameters(), static_cast<CLI::Option*>(nullptr))
{
  ParameterList parameters = filter->Parameters();
  return AddParameter(options, Named(parameters, name), std::move(flag), filter);
}
template <class Pointer>
void AddParameters(CLI::App* options, const Pointer& filter, const std::vector<std::string>& names)
{
  for (const std::string& name : names)
    AddParameter(options, filter, name);
}
/// The same for all parameters of a filter but those named.
template <class Pointer>
void AddParametersBut(CLI::App* options, const Pointer& filter, const std::vector<std::string>& names)
{
  for (const Parameter& parameter : Without(filter->Parameters(), names))
    AddParameter(options, parameter, {}, filter);
}

} // namespace echorama
