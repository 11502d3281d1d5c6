// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundParameters.h"

#include "Core/Base/FormerNames.h"
#include "Core/Base/NumberText.h"
#include "vtkObject.h"

#include <limits>

namespace {
// Does something with the parameter of that name; what is refused becomes an error event and the answer of \a otherwise.
template <class Action, class T>
T With(vtkObject* self, echorama::ParameterList& parameters, const char* name, T otherwise, const Action& action)
{
  try {
    const auto warn = [self](const std::string& text) { vtkWarningWithObjectMacro(self, << text); };
    return action(echorama::NamedOrFormerly(parameters, name ? name : "", warn));
  } catch (const echorama::Error& problem) {
    vtkErrorWithObjectMacro(self, << problem.what());
    return otherwise;
  }
}

template <class Action>
bool Change(vtkObject* self, echorama::ParameterList& parameters, const char* name, const Action& action)
{
  return With(self, parameters, name, false, [self, &action](echorama::Parameter& parameter) {
    const std::string before = parameter.Text();
    action(parameter);
    if (parameter.Text() != before) {
      self->Modified();
    }
    return true;
  });
}
} // namespace

//----------------------------------------------------------------------------
bool vtkUltrasoundParameters::Set(vtkObject* self, echorama::ParameterList parameters, const char* name, double value)
{
  return Change(self, parameters, name, [value](echorama::Parameter& parameter) { parameter.SetNumber(value); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundParameters::Set(vtkObject* self, echorama::ParameterList parameters, const char* name, const char* value)
{
  return Change(self, parameters, name, [value](echorama::Parameter& parameter) { parameter.Set(value ? value : ""); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundParameters::Set(vtkObject* self, echorama::ParameterList parameters, const char* name, vtkTypeInt64 value)
{
  return Change(self, parameters, name, [value](echorama::Parameter& parameter) { parameter.Set(echorama::NumberText(value)); });
}

//----------------------------------------------------------------------------
bool vtkUltrasoundParameters::Set(vtkObject* self, echorama::ParameterList parameters, const char* name, const double value[3])
{
  return Change(self, parameters, name, [value](echorama::Parameter& parameter) {
    parameter.Set(echorama::NumberText(value[0]) + " " + echorama::NumberText(value[1]) + " " + echorama::NumberText(value[2]));
  });
}

//----------------------------------------------------------------------------
double vtkUltrasoundParameters::Get(vtkObject* self, echorama::ParameterList parameters, const char* name)
{
  return With(self, parameters, name, std::numeric_limits<double>::quiet_NaN(),
              [](echorama::Parameter& parameter) { return parameter.Number(); });
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundParameters::GetText(vtkObject* self, echorama::ParameterList parameters, const char* name)
{
  return With(self, parameters, name, std::string(), [](echorama::Parameter& parameter) { return parameter.Text(); });
}

//----------------------------------------------------------------------------
vtkTypeInt64 vtkUltrasoundParameters::GetInteger(vtkObject* self, echorama::ParameterList parameters, const char* name)
{
  return With(self, parameters, name, vtkTypeInt64(0), [](echorama::Parameter& parameter) {
    vtkTypeInt64 number = 0;
    echorama::ParseNumber(parameter.Text(), number);
    return number;
  });
}

//----------------------------------------------------------------------------
double* vtkUltrasoundParameters::GetVector(vtkObject* self, echorama::ParameterList parameters, const char* name)
{
  return With(self, parameters, name, static_cast<double*>(nullptr), [](echorama::Parameter& parameter) {
    Eigen::Vector3d** place = std::get_if<Eigen::Vector3d*>(&parameter.value);
    return place ? (*place)->data() : nullptr;
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundParameters::Print(ostream& os, vtkIndent indent, const echorama::ParameterList& parameters)
{
  for (const echorama::Parameter& parameter : parameters) {
    os << indent << parameter.name << ": " << parameter.Text() << "\n";
  }
}
