// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a class does with the description of its parameters (Core/Base/Parameters.h). A class has
//
//   echorama::ParameterList Parameters();                       // private, by hand: Describe(this->Values)
//   vtkUltrasoundParametersMacro(vtkUltrasoundNoiseSource);     // in its .cxx: the functions below
//   // BEGIN parameters ... // END parameters                   // in its header: what ./run generate writes
#ifndef __VTK_WRAP__
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

#endif // __VTK_WRAP__

/// What ./run generate writes into headers: setters and getters of one parameter, by its type, and of any by its name.
#define vtkUltrasoundNumberMacro(name)                                                                                           \
  void Set##name(double value)                                                                                                   \
  {                                                                                                                              \
    this->SetParameter(#name, value);                                                                                            \
  }                                                                                                                              \
  double Get##name()                                                                                                             \
  {                                                                                                                              \
    return this->GetParameter(#name);                                                                                            \
  }

#define vtkUltrasoundIntegerMacro(name)                                                                                          \
  void Set##name(int value)                                                                                                      \
  {                                                                                                                              \
    this->SetParameter(#name, value);                                                                                            \
  }                                                                                                                              \
  int Get##name()                                                                                                                \
  {                                                                                                                              \
    return static_cast<int>(this->GetParameter(#name));                                                                          \
  }

/// Integers that a double may not hold, such as seeds.
#define vtkUltrasoundInteger64Macro(name)                                                                                        \
  void Set##name(vtkTypeInt64 value)                                                                                             \
  {                                                                                                                              \
    this->SetParameterAsInteger(#name, value);                                                                                   \
  }                                                                                                                              \
  vtkTypeInt64 Get##name()                                                                                                       \
  {                                                                                                                              \
    return this->GetParameterAsInteger(#name);                                                                                   \
  }

#define vtkUltrasoundSwitchMacro(name)                                                                                           \
  void Set##name(bool value)                                                                                                     \
  {                                                                                                                              \
    this->SetParameter(#name, value);                                                                                            \
  }                                                                                                                              \
  bool Get##name()                                                                                                               \
  {                                                                                                                              \
    return this->GetParameter(#name) != 0.0;                                                                                     \
  }                                                                                                                              \
  void name##On()                                                                                                                \
  {                                                                                                                              \
    this->Set##name(true);                                                                                                       \
  }                                                                                                                              \
  void name##Off()                                                                                                               \
  {                                                                                                                              \
    this->Set##name(false);                                                                                                      \
  }

/// The functions that set one choice each stand beside it.
#define vtkUltrasoundChoiceMacro(name)                                                                                           \
  vtkUltrasoundIntegerMacro(name) std::string Get##name##AsString()                                                              \
  {                                                                                                                              \
    return this->GetParameterAsText(#name);                                                                                      \
  }

#define vtkUltrasoundTextMacro(name)                                                                                             \
  void Set##name(const char* value)                                                                                              \
  {                                                                                                                              \
    this->SetParameterAsText(#name, value);                                                                                      \
  }                                                                                                                              \
  std::string Get##name()                                                                                                        \
  {                                                                                                                              \
    return this->GetParameterAsText(#name);                                                                                      \
  }

#define vtkUltrasoundVectorMacro(name)                                                                                           \
  void Set##name(double x, double y, double z)                                                                                   \
  {                                                                                                                              \
    const double value[3] = {x, y, z};                                                                                           \
    this->SetParameterAsVector(#name, value);                                                                                    \
  }                                                                                                                              \
  void Set##name(const double value[3])                                                                                          \
  {                                                                                                                              \
    this->SetParameterAsVector(#name, value);                                                                                    \
  }                                                                                                                              \
  double* Get##name() VTK_SIZEHINT(3)                                                                                            \
  {                                                                                                                              \
    return this->GetParameterAsVector(#name);                                                                                    \
  }

#define vtkUltrasoundAnyParameterMacro()                                                                                         \
  bool SetParameter(const char* name, double value);                                                                             \
  bool SetParameterAsText(const char* name, const char* value);                                                                  \
  bool SetParameterAsInteger(const char* name, vtkTypeInt64 value);                                                              \
  bool SetParameterAsVector(const char* name, const double value[3]);                                                            \
  double GetParameter(const char* name);                                                                                         \
  std::string GetParameterAsText(const char* name);                                                                              \
  vtkTypeInt64 GetParameterAsInteger(const char* name);                                                                          \
  double* GetParameterAsVector(const char* name) VTK_SIZEHINT(3);                                                                \
  std::string GetParameterDescriptions()

/// For the class's .cxx.
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
