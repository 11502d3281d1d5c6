// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A parameter struct is described once, by a function beside it:
//
//   ParameterList Describe(StitchParameters& p)
//   {
//     return {Parameter("Method", Choice(p.method, {"distance", "feather"}), "What decides how much each volume counts."),
//             Parameter("Sharpness", p.sharpness, {0, 1000}, "", "Exponent of the weights: 0 is the plain average."),
//             Parameter("DetailScale", p.detailScale, {1, 100}, "voxels", "What counts as smooth.").Advanced()};
//   }
//
// From the description come the checks and their messages, reading and writing by name, what a vtk class prints, its wrapped
// setters, its ParaView XML, options of the command line, the keys of scenes, and the tables of the pages (./run generate).
#include "Core/Base/Error.h"
#include <cstdint>
#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace echorama {

constexpr double Unlimited = std::numeric_limits<double>::infinity();

/// What a number may be: [low, high], or (low, high] when open. Infinity itself is never in it.
struct ParameterRange {
  double low = -Unlimited, high = Unlimited;
  bool open = false; ///< low itself is not in it

  bool Holds(double value) const;
  std::string Text() const;   ///< "[0, 1000]", "above 0", "at least 1"; empty when every number is in it
  std::string Demand() const; ///< what messages say that it must be: "in [0, 1000]", "above 0", "finite"
};

/// A value of an enumeration whose numbers are 0, 1, 2 ...; its names in that order, in small letters with hyphens. Or a text
/// that is one of these names.
class Choice {
public:
  template <class T>
  Choice(T& place, std::vector<std::string> theNames) : names(std::move(theNames)), place_(&place)
  {
    static_assert(std::is_enum_v<T> || std::is_same_v<T, int>);
    read_ = [](const void* from) { return static_cast<int>(*static_cast<const T*>(from)); };
    write_ = [](void* to, int number) { *static_cast<T*>(to) = static_cast<T>(number); };
  }
  Choice(std::string& place, std::vector<std::string> theNames) : names(std::move(theNames)), isByName(true), text_(&place) {}

  /// VTK classes set and get it by its name ("tracked"), not by its number, as they do with a text.
  Choice& ByName();

  int Number() const; ///< beyond the last one for a text that is none of the names
  void Set(int number);
  std::string Name() const; ///< or the number that has none

  std::vector<std::string> names;
  bool isByName = false;

private:
  void* place_ = nullptr;
  int (*read_)(const void*) = nullptr;
  void (*write_)(void*, int) = nullptr;
  std::string* text_ = nullptr;
};

/// One parameter of one struct: what it is, and where its value lies.
class Parameter {
public:
  using Value = std::variant<double*, int*, std::int64_t*, std::uint64_t*, bool*, Choice, std::string*, Eigen::Vector3d*>;

  /// A number; its unit is "" when it has none. Names are spelled as VTK's properties are: "DetailScale".
  template <class T>
  Parameter(std::string theName, T& place, const ParameterRange& theRange, std::string theUnit, std::string theHelp)
    : name(std::move(theName)), help(std::move(theHelp)), unit(std::move(theUnit)), range(theRange), value(&place)
  {
  }
  /// A switch or a text.
  template <class T, class = std::enable_if_t<std::is_same_v<T, bool> || std::is_same_v<T, std::string>>>
  Parameter(std::string theName, T& place, std::string theHelp)
    : name(std::move(theName)), help(std::move(theHelp)), value(&place)
  {
  }
  Parameter(std::string theName, Choice choice, std::string theHelp)
    : name(std::move(theName)), help(std::move(theHelp)), value(std::move(choice))
  {
  }

  /// It matters only while another one, a switch or a choice, has this value ("on", "split"); said again: or this one.
  Parameter& When(std::string other, std::string itsValue);
  /// Few users change it: programs with a window hide it at first.
  Parameter& Advanced();

  std::string name, help, unit;
  ParameterRange range;
  Value value;
  std::string whenName;
  std::vector<std::string> whenValues;
  bool advanced = false;

  std::string Label() const; ///< "Detail Scale"
  std::string Key() const;   ///< as in JSON: "detailScale"
  std::string Flag() const;  ///< as on a command line: "--detail-scale"

  ///@{
  /// Numbers, switches (0 or 1) and choices (from 0). A number that is no such value, for instance 2.5 of a count, is refused;
  /// one outside of the range is not: Check() does that. \throws Error(InvalidParameter)
  double Number() const;
  void SetNumber(double number);
  ///@}
  ///@{
  /// Any value as text; what Text() says Set() reads. Switches: on, off; vectors: three numbers with blanks. Of a choice
  /// as much of its name will do as no other begins with.
  /// \throws Error(InvalidParameter) as above
  std::string Text() const;
  void Set(std::string_view text);
  ///@}
  /// \throws Error(InvalidParameter) that names it, its value and its range, when it lies outside, is not finite, or is no choice
  void Check() const;
};

using ParameterList = std::vector<Parameter>;

/// \throws Error(InvalidParameter) as Parameter::Check(), for the first that is out of its range; its message begins with
/// \a place ("ball 4") when there is one
void CheckRanges(const ParameterList& parameters, const std::string& place = {});
template <class Struct>
void CheckRanges(const Struct& parameters, const std::string& place = {})
{
  CheckRanges(Describe(const_cast<Struct&>(parameters)), place); // which only reads
}

/// \returns the one of that name, or nullptr.
Parameter* Find(ParameterList& parameters, std::string_view name);
/// \throws Error(InvalidParameter) that names those there are
Parameter& Named(ParameterList& parameters, std::string_view name);

/// One list of several.
ParameterList Join(std::vector<ParameterList> lists);
/// Without those of these names.
ParameterList Without(ParameterList parameters, const std::vector<std::string>& names);
/// With another name for one of them, also where others depend on it.
ParameterList Renamed(ParameterList parameters, const std::string& from, const std::string& to);

/// All but the places, as a JSON array of objects: name, label, type (number, integer, integer64, switch, choice, name, text,
/// vector), value, unit, low, high, open, choices, when, advanced, help. Keys without a meaning for a parameter are left out.
std::string DescriptionText(const ParameterList& parameters);

} // namespace echorama
