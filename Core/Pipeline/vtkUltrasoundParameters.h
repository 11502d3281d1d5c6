// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a class does with the description of its parameters (Core/Base/Parameters.h). A class has
//
//   echorama::ParameterList Parameters();                       // private, by hand: Describe(this->Values)
//   vtkUltrasoundParametersMacro(vtkUltrasoundNoiseSource);     // in its .cxx: the functions below
//   // BEGIN parameters ... // END parameters                   // in its header: what ./run generate writes
#include "Core/Base/Parameters.h"
#include "EchoramaCoreModule.h"
#include "vtkIndent.h"
#include "vtkType.h"
#include <string>

class vtkObject;

/// Each sets or reads one parameter of a list that points into \a self. What is refused becomes an error event of \a self, and
/// changes nothing; \a self is modified when the value is another.
class ECHORAMACORE_EXPORT vtkUltrasoundParameters {
public:
  static bool Set(vtkObject* self, echorama::ParameterList parameters, const char* name, double value);
  static bool Set(vtkObject* self, echorama::ParameterList parameters, const char* name, const char* value);
  static bool Set(vtkObject* self, echorama::ParameterList parameters, const char* name, vtkTypeInt64 value);
  static bool Set(vtkObject* self, echorama::ParameterList parameters, const char* name, const double value[3]);
  static double Get(vtkObject* self, echorama::ParameterList parameters, const char* name); ///< NaN when there is none
  static std::string GetText(vtkObject* self, echorama::ParameterList parameters, const char* name);
  static vtkTypeInt64 GetInteger(vtkObject* self, echorama::ParameterList parameters, const char* name);
  static double* GetVector(vtkObject* self, echorama::ParameterList parameters, const char* name); ///< nullptr when it is none
  static void Print(ostream& os, vtkIndent indent, const echorama::ParameterList& parameters);     ///< a line "Name: value" each
};

#define vtkUltrasoundParametersMacro(Class)                                                                                      \
  bool Class::SetParameter(const char* name, double value)                                                                       \
  {                                                                                                                              \
    return vtkUltrasoundParameters::Set(this, this->Parameters(), name, value);                                                  \
  }                                                                                                                              \
  bool Class::SetParameterAsText(const char* name, const char* value)                                                            \
  {                                                                                                                              \
    return vtkUltrasoundParameters::Set(this, this->Parameters(), name, value);                                                  \
  }                                                                                                                              \
  bool Class::SetParameterAsInteger(const char* name, vtkTypeInt64 value)                                                        \
  {                                                                                                                              \
    return vtkUltrasoundParameters::Set(this, this->Parameters(), name, value);                                                  \
  }                                                                                                                              \
  bool Class::SetParameterAsVector(const char* name, const double value[3])                                                      \
  {                                                                                                                              \
    return vtkUltrasoundParameters::Set(this, this->Parameters(), name, value);                                                  \
  }                                                                                                                              \
  vtkTypeInt64 Class::GetParameterAsInteger(const char* name)                                                                    \
  {                                                                                                                              \
    return vtkUltrasoundParameters::GetInteger(this, this->Parameters(), name);                                                  \
  }                                                                                                                              \
  double Class::GetParameter(const char* name)                                                                                   \
  {                                                                                                                              \
    return vtkUltrasoundParameters::Get(this, this->Parameters(), name);                                                         \
  }                                                                                                                              \
  std::string Class::GetParameterAsText(const char* name)                                                                        \
  {                                                                                                                              \
    return vtkUltrasoundParameters::GetText(this, this->Parameters(), name);                                                     \
  }                                                                                                                              \
  double* Class::GetParameterAsVector(const char* name)                                                                          \
  {                                                                                                                              \
    return vtkUltrasoundParameters::GetVector(this, this->Parameters(), name);                                                   \
  }                                                                                                                              \
  std::string Class::GetParameterDescriptions()                                                                                  \
  {                                                                                                                              \
    return echorama::DescriptionText(this->Parameters());                                                                        \
  }
