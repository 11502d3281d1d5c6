// SPDX-License-Identifier: BSD-3-Clause
#include "Parameters.h"
#include "Core/Base/FormerNames.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/Json.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cctype>
#include <cmath>

namespace echorama {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

// The words of "DetailScaleMm", each from its capital on. Capitals in a row ("UseMRIMask" has three words) and units are one.
std::vector<std::string> WordsOf(const std::string& name)
{
  std::vector<std::string> words;
  const auto isCapital = [&name](std::size_t i) { return i < name.size() && std::isupper(static_cast<unsigned char>(name[i])); };
  const auto isSmall = [&name](std::size_t i) { return i < name.size() && std::islower(static_cast<unsigned char>(name[i])); };
  const auto isWithinUnit = [&name](std::size_t i) {
    return i > 0 && (name.compare(i - 1, 3, "MHz") == 0 || name.compare(i - 1, 3, "KPa") == 0);
  };
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (i == 0 || (isCapital(i) && !isWithinUnit(i) && (!isCapital(i - 1) || isSmall(i + 1))))
      words.emplace_back();
    words.back() += name[i];
  }
  return words;
}

std::string Lower(std::string word)
{
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word;
}

[[noreturn]] void Refuse(const Parameter& parameter, std::string_view value, const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, parameter.name + " is " + std::string(value) + "; it must be " + reason);
}

// A whole number of type T, or why not. 2^63 does not fit, though as a double it equals the largest number.
template <class T>
T Whole(const Parameter& parameter, double number)
{
  const double least = static_cast<double>(std::numeric_limits<T>::lowest());
  const double beyond = 2.0 * (static_cast<double>(std::numeric_limits<T>::max() / 2) + 1.0);
  if (!(number >= least && number < beyond) || number != std::floor(number))
    Refuse(parameter, NumberText(number), "a whole number that fits");
  return static_cast<T>(number);
}

template <class T>
T Parsed(const Parameter& parameter, std::string_view text)
{
  T number{};
  if (!ParseNumber(text, number))
    Refuse(parameter, "'" + std::string(text) + "'", std::is_integral_v<T> ? "a whole number" : "a number");
  return number;
}

constexpr std::string_view switchNames[] = {"off", "on"};

} // namespace

Choice& Choice::ByName()
{
  isByName = true;
  return *this;
}

int Choice::Number() const
{
  return text_ ? static_cast<int>(std::find(names.begin(), names.end(), *text_) - names.begin()) : read_(place_);
}

void Choice::Set(int number)
{
  if (text_)
    *text_ = names[static_cast<std::size_t>(number)];
  else
    write_(place_, number);
}

std::string Choice::Name() const
{
  const auto number = static_cast<std::size_t>(Number());
  return number < names.size() ? names[number] : text_ ? *text_ : NumberText(Number());
}

bool ParameterRange::Holds(double value) const
{
  return std::isfinite(value) && value <= high && (open ? value > low : value >= low);
}

namespace {
// "100000", where the shortest text is 1e+05.
std::string WholeOrNumber(double number)
{
  return number == std::floor(number) && std::abs(number) < 1e15 ? std::to_string(static_cast<std::int64_t>(number))
                                                                 : NumberText(number);
}
} // namespace

std::string ParameterRange::Text() const
{
  const bool fromBelow = std::isfinite(low), toAbove = std::isfinite(high);
  if (fromBelow && toAbove)
    return (open ? "(" : "[") + WholeOrNumber(low) + ", " + WholeOrNumber(high) + "]";
  if (fromBelow)
    return (open ? "above " : "at least ") + WholeOrNumber(low);
  return toAbove ? "at most " + WholeOrNumber(high) : "";
}

std::string ParameterRange::Demand() const
{
  const std::string text = Text();
  return text.empty() ? "finite" : text.find_first_of("[(") == 0 ? "in " + text : text;
}

Parameter& Parameter::When(std::string other, std::string itsValue)
{
  whenName = std::move(other);
  whenValues.push_back(std::move(itsValue));
  return *this;
}

Parameter& Parameter::Advanced()
{
  advanced = true;
  return *this;
}

std::string Parameter::Label() const
{
  std::string text;
  for (const std::string& word : WordsOf(name))
    text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string Parameter::Key() const
{
  std::string text;
  for (const std::string& word : WordsOf(name))
    text += text.empty() ? Lower(word) : word;
  return text;
}

std::string Parameter::Flag() const
{
  std::string text = "-";
  for (const std::string& word : WordsOf(name))
    text += "-" + Lower(word);
  return text;
}

double Parameter::Number() const
{
  return std::visit(Overloaded{[](const Choice& choice) { return static_cast<double>(choice.Number()); },
                               [](const auto* place) -> double {
                                 if constexpr (std::is_arithmetic_v<std::decay_t<decltype(*place)>>)
                                   return static_cast<double>(*place);
                                 return std::numeric_limits<double>::quiet_NaN();
                               }},
                    value);
}

void Parameter::SetNumber(double number)
{
  std::visit(Overloaded{[this, number](Choice& choice) {
                          const double count = static_cast<double>(choice.names.size());
                          if (!(number >= 0.0 && number < count) || number != std::floor(number))
                            Refuse(*this, NumberText(number),
                                   "one of 0 to " + NumberText(count - 1.0) + ": " + Joined(choice.names));
                          choice.Set(static_cast<int>(number));
                        },
                        [number](double* place) { *place = number; }, [number](bool* place) { *place = number != 0.0; },
                        [this, number](auto* place) {
                          using T = std::decay_t<decltype(*place)>;
                          if constexpr (std::is_integral_v<T>)
                            *place = Whole<T>(*this, number);
                          else
                            Refuse(*this, NumberText(number), std::is_same_v<T, std::string> ? "a text" : "three numbers");
                        }},
             value);
}

std::string Parameter::Text() const
{
  return std::visit(Overloaded{[](const Choice& choice) { return choice.Name(); },
                               [](const bool* place) { return std::string(switchNames[*place]); },
                               [](const std::string* place) { return *place; },
                               [](const Eigen::Vector3d* place) {
                                 return NumberText(place->x()) + " " + NumberText(place->y()) + " " + NumberText(place->z());
                               },
                               [](const auto* place) { return NumberText(*place); }},
                    value);
}

void Parameter::Set(std::string_view text)
{
  std::visit(Overloaded{[this, text](Choice& choice) {
                          const auto begins = [text](const std::string& one) { return one.substr(0, text.size()) == text; };
                          auto found = std::find(choice.names.begin(), choice.names.end(), text);
                          if (found == choice.names.end() && std::count_if(choice.names.begin(), choice.names.end(), begins) == 1)
                            found = std::find_if(choice.names.begin(), choice.names.end(), begins);
                          if (found == choice.names.end())
                            Refuse(*this, "'" + std::string(text) + "'", "one of " + Joined(choice.names));
                          choice.Set(static_cast<int>(found - choice.names.begin()));
                        },
                        [this, text](bool* place) {
                          if (text != switchNames[0] && text != switchNames[1] && text != "0" && text != "1")
                            Refuse(*this, "'" + std::string(text) + "'", "on or off");
                          *place = text == switchNames[1] || text == "1";
                        },
                        [text](std::string* place) { *place = text; },
                        [this, text](Eigen::Vector3d* place) {
                          Eigen::Vector3d parsed;
                          std::size_t from = 0;
                          for (int axis = 0; axis < 3; ++axis) {
                            const std::size_t to = axis < 2 ? std::min(text.find(' ', from), text.size()) : text.size();
                            parsed[axis] =
                                Parsed<double>(*this, text.substr(std::min(from, text.size()), to - std::min(from, to)));
                            from = to + 1;
                          }
                          *place = parsed;
                        },
                        [this, text](auto* place) { *place = Parsed<std::decay_t<decltype(*place)>>(*this, text); }},
             value);
}

void Parameter::Check() const
{
  const auto demand = [this](double number, const std::string& shown) {
    if (!range.Holds(number))
      throw Error(Error::Kind::InvalidParameter,
                  name + " is " + shown + (unit.empty() ? "" : " " + unit) + "; it must be " + range.Demand());
  };
  std::visit(Overloaded{[this](const Choice& choice) {
                          if (static_cast<std::size_t>(choice.Number()) >= choice.names.size())
                            Refuse(*this, "'" + choice.Name() + "'", "one of " + Joined(choice.names));
                        },
                        [](const bool*) {}, [](const std::string*) {},
                        [&](const Eigen::Vector3d* place) {
                          for (const double number : *place)
                            demand(number, "(" + Text() + ")");
                        },
                        [&](const auto* place) { demand(static_cast<double>(*place), NumberText(*place)); }},
             value);
}

void CheckRanges(const ParameterList& parameters, const std::string& place)
{
  try {
    for (const Parameter& parameter : parameters)
      parameter.Check();
  } catch (const Error& error) {
    if (place.empty())
      throw;
    throw Error(error.GetKind(), place + ": " + error.what());
  }
}

Parameter* Find(ParameterList& parameters, std::string_view name)
{
  const auto found =
      std::find_if(parameters.begin(), parameters.end(), [name](const Parameter& parameter) { return parameter.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

Parameter& Named(ParameterList& parameters, std::string_view name)
{
  if (Parameter* found = Find(parameters, name))
    return *found;
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters)
    names.push_back(parameter.name);
  throw Error(Error::Kind::InvalidParameter, "there is no parameter '" + std::string(name) + "'; there are " + Joined(names));
}

ParameterList Join(std::vector<ParameterList> lists)
{
  ParameterList all;
  for (ParameterList& list : lists)
    std::move(list.begin(), list.end(), std::back_inserter(all));
  return all;
}

ParameterList Without(ParameterList parameters, const std::vector<std::string>& names)
{
  const auto isLeftOut = [&names](const Parameter& parameter) {
    return std::find(names.begin(), names.end(), parameter.name) != names.end();
  };
  parameters.erase(std::remove_if(parameters.begin(), parameters.end(), isLeftOut), parameters.end());
  return parameters;
}

ParameterList Renamed(ParameterList parameters, const std::string& from, const std::string& to)
{
  Named(parameters, from).name = to;
  for (Parameter& parameter : parameters)
    if (parameter.whenName == from)
      parameter.whenName = to;
  return parameters;
}

std::string DescriptionText(const ParameterList& parameters)
{
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Parameter& parameter : parameters) {
    nlohmann::ordered_json one;
    one["name"] = parameter.name;
    one["label"] = parameter.Label();
    const auto describe = [&one](const char* type, auto value) {
      one["type"] = type;
      one["value"] = value;
    };
    std::visit(
        Overloaded{
            [&](const Choice& choice) {
              if (choice.isByName)
                describe("name", choice.Name());
              else
                describe("choice", choice.Number());
              one["choices"] = choice.names;
            },
            [&](const double* place) { describe("number", *place); }, [&](const bool* place) { describe("switch", *place); },
            [&](const std::string* place) { describe("text", *place); },
            [&](const Eigen::Vector3d* place) { describe("vector", std::vector<double>(place->begin(), place->end())); },
            [&](const int* place) { describe("integer", *place); }, [&](const auto* place) { describe("integer64", *place); }},
        parameter.value);
    if (!parameter.unit.empty())
      one["unit"] = parameter.unit;
    if (std::isfinite(parameter.range.low))
      one["low"] = parameter.range.low;
    if (std::isfinite(parameter.range.high))
      one["high"] = parameter.range.high;
    if (parameter.range.open)
      one["open"] = true;
    if (!parameter.whenName.empty())
      one["when"] = {{"name", parameter.whenName}, {"values", parameter.whenValues}};
    if (parameter.advanced)
      one["advanced"] = true;
    for (const FormerName& former : FormerNamesOf(parameter))
      one["formerly"].push_back({{"name", former.name}, {"until", former.until}});
    one["help"] = parameter.help;
    list.push_back(std::move(one));
  }
  return list.dump();
}

} // namespace echorama
