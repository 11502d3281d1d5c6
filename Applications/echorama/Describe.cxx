// SPDX-License-Identifier: BSD-3-Clause
#include "Describe.h"
#include "Core/Base/NumberText.h"
#include "ManPage.h"
#include "ParameterOptions.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>

namespace echorama {
namespace {

const std::set<std::string> Written = {"output", "save-poses", "record", "screenshot", "apply"}; // by options of these names

bool All(const CLI::App*)
{
  return true;
}

bool IsListed(const CLI::Option* option)
{
  return !option->get_group().empty() && !option->check_lname("help");
}

bool IsFlag(const CLI::Option* option)
{
  return option->get_items_expected_max() == 0;
}

bool IsMultiple(const CLI::Option* option)
{
  return option->get_items_expected_max() > 16;
}

// "--output", or what a positional one is called.
std::string LongName(const CLI::Option* option)
{
  return option->get_lnames().empty() ? option->get_name(true) : option->get_lnames().front();
}

// "INT", "FILE" ..., without what may be in it.
std::string TypeOf(const CLI::Option* option)
{
  const std::string type = option->get_type_name();
  return type.substr(0, type.find(':'));
}

std::vector<std::string> ChoicesOf(const CLI::Option* option)
{
  if (const Parameter* parameter = ParameterOf(option))
    if (const auto* choice = std::get_if<Choice>(&parameter->value))
      return choice->names;
  std::vector<std::string> names; // of CLI::IsMember: "TEXT:{rig,contents}"
  const std::string type = option->get_type_name();
  const std::size_t from = type.find(":{"), to = type.find('}');
  if (from != std::string::npos && to != std::string::npos) {
    std::istringstream list(type.substr(from + 2, to - from - 2));
    for (std::string name; std::getline(list, name, ',');)
      names.push_back(name);
  }
  return names;
}

ParameterRange RangeOf(const CLI::Option* option)
{
  if (const Parameter* parameter = ParameterOf(option))
    return parameter->range;
  ParameterRange range; // of CLI::Range: "INT:INT in [1 - 1000000]"
  const std::string type = option->get_type_name();
  const std::size_t at = type.find(" in [");
  double low = 0.0, high = 0.0;
  if (at != std::string::npos && std::sscanf(type.c_str() + at, " in [%lf - %lf]", &low, &high) == 2)
    range.low = low, range.high = high;
  return range;
}

void Replace(std::string& text, const std::string& from, const std::string& to)
{
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

std::string Xml(std::string text)
{
  for (const auto& [from, to] :
       {std::pair("&", "&amp;"), std::pair("<", "&lt;"), std::pair(">", "&gt;"), std::pair("\"", "&quot;")})
    Replace(text, from, to);
  return text;
}

std::string Element(const std::string& name, const std::string& text)
{
  return "      <" + name + ">" + Xml(text) + "</" + name + ">\n";
}

// "Maximum Gap" of "maximum-gap".
std::string Label(std::string name)
{
  bool begins = true;
  for (char& letter : name) {
    if (begins)
      letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    begins = letter == '-';
    letter = begins ? ' ' : letter;
  }
  return name;
}

// What an option is for, among what it chooses, and what it is by itself.
std::string HelpOf(const CLI::Option* option)
{
  std::string help = option->get_description();
  const std::vector<std::string> choices = ChoicesOf(option);
  if (!ParameterOf(option)) // whose help names them
    for (const std::string& choice : choices)
      help += (&choice == &choices.front() ? " (" : ", ") + choice + (&choice == &choices.back() ? ")" : "");
  if (!option->get_default_str().empty())
    help += " [" + option->get_default_str() + "]";
  return help;
}

bool BeginsWithNumber(const std::string& text)
{
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return end != text.c_str();
}

// A form gives each field that is not empty. Empty must be what would ask for another option, or refuse one, and what says its
// default in words.
bool IsEmptyInForms(const CLI::Option* option)
{
  const Parameter* parameter = ParameterOf(option);
  const bool isText = !parameter || std::holds_alternative<std::string*>(parameter->value) || !ChoicesOf(option).empty();
  return !option->get_needs().empty() || !option->get_excludes().empty() ||
         (!isText && !BeginsWithNumber(option->get_default_str()));
}

// The element of an option. A number without a default is a text there: an empty field is not given, a zero would be.
std::string SlicerType(const CLI::Option* option)
{
  const std::string type = TypeOf(option), given = option->get_default_str();
  if (IsFlag(option))
    return "boolean";
  if (type == "VOLUME")
    return "image";
  if (type == "FILE")
    return "file";
  if (type == "FOLDER")
    return "directory";
  if (IsEmptyInForms(option))
    return "string";
  if (!ChoicesOf(option).empty())
    return "string-enumeration";
  if (!BeginsWithNumber(given))
    return "string";
  char* end = nullptr;
  std::strtod(given.c_str(), &end);
  const Parameter* parameter = ParameterOf(option);
  if (option->get_items_expected_max() > 1)
    return *end == ' ' || *end == ',' ? "double-vector" : "string";
  if (*end != '\0')
    return "string";
  if (parameter)
    return std::holds_alternative<std::string*>(parameter->value) ? "string"
           : std::holds_alternative<double*>(parameter->value)    ? "double"
                                                                  : "integer";
  return type == "INT" || type == "UINT" ? "integer" : type == "FLOAT" ? "double" : "string";
}

// What an arrow of a field adds: 1 to integers, else the power of ten of which the range holds some hundred, or a smaller one
// that the default is made of: fields may round to it.
double Step(const std::string& type, const ParameterRange& range, double given)
{
  if (type == "integer")
    return 1.0;
  double step = std::pow(10.0, std::floor(std::log10(range.high - range.low)) - 2.0);
  while (step > 1e-9 && std::abs(given / step - std::round(given / step)) > 1e-6)
    step /= 10.0;
  return step;
}

std::string SlicerParameter(const CLI::Option* option, int& index)
{
  const std::string name = LongName(option), type = SlicerType(option);
  const bool isFile = type == "image" || type == "file" || type == "directory";
  std::string identifier = name; // flags, too, have underscores there (main.cxx takes both): Slicer refuses hyphens
  Replace(identifier, "-", "_");
  std::string text = "    <" + type + (isFile && type != "directory" && IsMultiple(option) ? " multiple=\"true\"" : "") + ">\n" +
                     Element("name", identifier);
  if (option->get_positional())
    text += Element("index", std::to_string(index++));
  else
    text += Element("longflag", "--" + identifier);
  const bool isEmpty = type == "string" && IsEmptyInForms(option);
  text += Element("description", isEmpty ? HelpOf(option) : option->get_description()) + Element("label", Label(name));
  std::string given = type == "boolean" ? "false" : option->get_default_str();
  if (type == "double-vector")
    for (char& letter : given)
      letter = letter == ' ' ? ',' : letter;
  if (!given.empty() && !isFile && !isEmpty)
    text += Element("default", given);
  if (isFile)
    text += Element("channel", Written.count(name) ? "output" : "input");
  for (const std::string& choice : type == "string-enumeration" ? ChoicesOf(option) : std::vector<std::string>())
    text += Element("element", choice);
  const ParameterRange range = RangeOf(option);
  if ((type == "double" || type == "integer") && range.low > -Unlimited && range.high < 1e15) {
    const auto limit = [&type](double number) { // integers are of 32 bits there
      return type == "integer" ? std::to_string(static_cast<int>(std::clamp(number, -2147483648.0, 2147483647.0)))
                               : NumberText(number);
    };
    text += "      <constraints><minimum>" + limit(range.low) + "</minimum><maximum>" + limit(range.high) + "</maximum><step>" +
            NumberText(Step(type, range, std::stod(given))) + "</step></constraints>\n";
  }
  return text + "    </" + type + ">\n";
}

std::vector<ManEntry> OptionEntries(const CLI::App& app)
{
  std::vector<ManEntry> entries;
  for (const CLI::Option* option : app.get_options(IsListed)) {
    ManEntry entry;
    for (const std::string& name : option->get_snames())
      entry.name += "-" + name + ", ";
    entry.name += option->get_lnames().empty() ? option->get_name(true) : "--" + option->get_lnames().front();
    entry.value = IsFlag(option) || option->get_positional() ? "" : TypeOf(option);
    entry.help = HelpOf(option);
    entry.several = IsMultiple(option);
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::string Joined(const std::vector<std::string>& words)
{
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : " ") + word;
  return text;
}

// Of one command: what may follow it.
std::string BashCase(const CLI::App& app, const std::string& words)
{
  std::string options, names, values;
  for (const CLI::Option* option : app.get_options(IsListed)) {
    if (option->get_lnames().empty())
      continue;
    const std::string flag = "--" + option->get_lnames().front();
    options += flag + " ";
    const std::string match = option->get_snames().empty() ? flag : flag + "|-" + option->get_snames().front();
    if (const std::vector<std::string> choices = ChoicesOf(option); !choices.empty())
      values += "        " + match + ") values='" + Joined(choices) + "' ;;\n";
    else if (TypeOf(option) == "FOLDER")
      values += "        " + match + ") kind=-d ;;\n";
  }
  for (const CLI::App* each : app.get_subcommands(All))
    names += each->get_name() + " ";
  return "    '" + words + " '" + (words.empty() ? "" : "*") + ")\n      options='" + options + "' names='" + names + "'\n" +
         (values.empty() ? "" : "      case $previous in\n" + values + "      esac\n") + "      ;;\n";
}

} // namespace

std::string SlicerDescription(const CLI::App& command, const std::string& name)
{
  std::string text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n  <category>Ultrasound.Echorama</category>\n"
                     "  <title>Echorama " +
                     name + "</title>\n  <description>" + Xml(command.get_description()) +
                     "</description>\n  <version>" ECHORAMA_VERSION "</version>\n  <license>BSD-3-Clause</license>\n"
                     "  <contributor>The authors of Echorama</contributor>\n";
  // Files first, as forms begin with what goes in and comes out.
  int index = 0;
  std::string files, others;
  for (const CLI::Option* option : command.get_options(IsListed)) {
    if (option->check_lname("json") || option->check_lname("threads"))
      continue;
    const std::string type = SlicerType(option);
    (type == "image" || type == "file" || type == "directory" || option->get_positional() ? files : others) +=
        SlicerParameter(option, index);
  }
  const auto group = [](const std::string& label, const std::string& parameters) {
    return parameters.empty() ? std::string()
                              : "  <parameters>\n    <label>" + label + "</label>\n    <description>" + label +
                                    "</description>\n" + parameters + "  </parameters>\n";
  };
  return text + group("Input and output", files) + group("Parameters", others) + "</executable>\n";
}

std::string ManPageOf(const CLI::App& app, const std::string& command, const std::string& ending)
{
  ManPage page{command, app.get_description(), {}, {}, ending};
  const bool isWhole = !app.get_parent() && !app.get_subcommands(All).empty(); // its commands have pages of their own
  for (const CLI::App* each : app.get_subcommands(All))
    page.commands.push_back(
        {each->get_name(), "", each->get_description(), false, isWhole ? std::vector<ManEntry>() : OptionEntries(*each)});
  if (!isWhole)
    page.options = OptionEntries(app);
  return page.Text();
}

std::string BashCompletion(const CLI::App& program)
{
  std::string cases = BashCase(program, "");
  for (const CLI::App* command : program.get_subcommands(All)) {
    for (const CLI::App* each : command->get_subcommands(All))
      cases += BashCase(*each, command->get_name() + " " + each->get_name());
    cases += BashCase(*command, command->get_name());
  }
  return "# Completion of echorama in bash; made by echorama --completion.\n"
         "_echorama() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} options= names= values= kind=-f\n"
         "  case \"${COMP_WORDS[*]:1:COMP_CWORD-1} \" in\n" +
         cases +
         "  esac\n"
         "  if [[ $values ]]; then names=$values\n"
         "  elif [[ $current == -* ]]; then names=$options; fi\n"
         "  if [[ $names ]]; then mapfile -t COMPREPLY < <(compgen -W \"$names\" -- \"$current\")\n"
         "  else mapfile -t COMPREPLY < <(compgen $kind -- \"$current\"); fi\n"
         "}\n"
         "complete -o filenames -F _echorama echorama\n";
}

} // namespace echorama
