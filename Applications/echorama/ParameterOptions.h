// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <CLI/App.hpp>
#include <string>
#include <vtkSmartPointer.h>

namespace echorama {

/// An option that sets \a parameter, whose description gives its help, unit, range, choices and default. A switch that is off is
/// turned on by its flag, one that is on is turned off by "--no-...". \a flag is the parameter's own when it is empty. What the
/// parameter lies in must live as long as \a options: \a owner keeps it.
CLI::Option* AddParameter(CLI::App* options, Parameter parameter, std::string flag, vtkSmartPointer<vtkObjectBase> owner);

/// The same for one of a struct that outlives \a options: AddParameter(options, Describe(values->smoothing), "WindowSeconds").
inline CLI::Option* AddParameter(CLI::App* options, ParameterList parameters, const std::string& name, std::string flag = {})
{
  return AddParameter(options, Named(parameters, name), std::move(flag), nullptr);
}

/// The same for one or more parameters of a filter.
template <class Filter>
CLI::Option* AddParameter(CLI::App* options, const vtkSmartPointer<Filter>& filter, const std::string& name,
                          std::string flag = {})
{
  ParameterList parameters = filter->Parameters();
  return AddParameter(options, Named(parameters, name), std::move(flag), filter);
}
template <class Filter>
void AddParameters(CLI::App* options, const vtkSmartPointer<Filter>& filter, const std::vector<std::string>& names)
{
  for (const std::string& name : names)
    AddParameter(options, filter, name);
}
/// The same for all parameters of a filter but those named.
template <class Filter>
void AddParametersBut(CLI::App* options, const vtkSmartPointer<Filter>& filter, const std::vector<std::string>& names)
{
  for (const Parameter& parameter : Without(filter->Parameters(), names))
    AddParameter(options, parameter, {}, filter);
}

} // namespace echorama
