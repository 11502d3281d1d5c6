// SPDX-License-Identifier: BSD-3-Clause
#include "ParameterOptions.h"
#include "Core/Base/FormerNames.h"
#include <cctype>
#include <CLI/Error.hpp>
#include <iostream>
#include <map>
#include <utility>

namespace echorama {
namespace {

// "Edge of the cubic voxels (mm, above 0)". Help of the command line ends without a full stop.
std::string HelpOf(const Parameter& parameter)
{
  std::string text = parameter.help, facts = parameter.unit;
  if (const auto* choice = std::get_if<Choice>(&parameter.value))
    for (const std::string& name : choice->names)
      facts += (facts.empty() ? "" : ", ") + name;
  if (!text.empty() && text.back() == '.')
    text.pop_back();
  const std::string range = parameter.range.high > 1e15 && parameter.range.low == 0.0 ? "" : parameter.range.Text();
  if (!range.empty())
    facts += (facts.empty() ? "" : ", ") + (range.find_first_of("[(") == 0 ? "in " + range : range);
  return facts.empty() ? text : text + " (" + facts + ")";
}

// Of a switch: what the flag does. "Whether shadowed voxels count less" is turned on or off.
std::string FlagHelp(std::string help, bool on)
{
  const std::string whether = "Whether ";
  if (help.rfind(whether, 0) == 0) {
    help.erase(0, whether.size());
    if (on)
      help[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(help[0])));
    else
      help.insert(0, "Turn off that ");
  } else if (!on) {
    help.insert(0, "Turn off: ");
  }
  return help;
}

std::map<const CLI::Option*, Parameter>& Known()
{
  static std::map<const CLI::Option*, Parameter> known;
  return known;
}

// The options of former names: nothing lists them, and they warn.
void AddFormer(CLI::App* options, CLI::Option* present, const Parameter& parameter, const std::any& owner)
{
  for (const FormerName& name : FormerNamesOf(parameter)) {
    Parameter former = parameter;
    former.name = name.name;
    CLI::Option* option = AddParameter(options, former, {}, owner);
    const std::string flag = option->get_name(), now = present->get_name();
    option->group("")->excludes(present)->each([options, name, flag, now, told = false](const std::string&) mutable {
      const CLI::App* program = options;
      while (program->get_parent())
        program = program->get_parent();
      if (!std::exchange(told, true))
        std::cerr << program->get_name() << ": warning: " << name.Warning(flag, now) << std::endl;
    });
  }
}

} // namespace

const Parameter* ParameterOf(const CLI::Option* option)
{
  const auto found = Known().find(option);
  return found == Known().end() ? nullptr : &found->second;
}

CLI::Option* AddParameter(CLI::App* options, Parameter parameter, std::string flag, std::any owner)
{
  const bool isNamedSo = flag.empty(); // a flag of its own stays when the parameter gets another name
  if (isNamedSo)
    flag = parameter.Flag();
  const auto remembered = [&](CLI::Option* option) {
    Known().emplace(option, parameter);
    if (isNamedSo)
      AddFormer(options, option, parameter, owner);
    return option;
  };
  if (const auto* place = std::get_if<bool*>(&parameter.value)) {
    const bool wanted = !**place;
    if (!wanted && flag.rfind("--no-", 0) != 0)
      flag.insert(2, "no-");
    CLI::Option* option = options->add_flag_callback(
        flag, [target = *place, wanted, owner] { *target = wanted; }, FlagHelp(HelpOf(parameter), wanted));
    return remembered(option);
  }
  const std::string help = HelpOf(parameter);
  const bool isVector = std::holds_alternative<Eigen::Vector3d*>(parameter.value);
  const auto set = [parameter, flag, owner](const std::vector<std::string>& words) mutable {
    std::string text;
    for (const std::string& word : words)
      text += (text.empty() ? "" : " ") + word;
    try {
      parameter.Set(text);
      parameter.Check();
    } catch (const Error& problem) {
      throw CLI::ValidationError(flag, problem.what());
    }
  };
  CLI::Option* option = options->add_option_function<std::vector<std::string>>(flag, set, help)->expected(isVector ? 3 : 1);
  const auto* choice = std::get_if<Choice>(&parameter.value);
  option->type_name(choice ? "" : isVector ? "X Y Z" : std::holds_alternative<std::string*>(parameter.value) ? "TEXT" : "NUMBER");
  option->default_str(parameter.Text())->allow_extra_args(false); // files may follow
  if (isVector)
    option->delimiter(','); // 3D Slicer writes 1,2,3
  return remembered(option);
}

} // namespace echorama
