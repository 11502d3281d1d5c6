#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what follows from the description of a class's parameters: setters in its header, properties in its ParaView XML, tables
in pages; and the JSON schema of scenes. ./run generate builds, calls this, and builds again; with --check it writes nothing and
fails when something is stale.

A header has "// BEGIN parameters" and "// END parameters", XML the same as comments, a page
"<!-- BEGIN parameters of vtkUltrasoundNoiseSource -->" (perhaps followed by ": Kind, Seed" for some of them) and
"<!-- END parameters -->". What lies between is replaced.
"""
import json
import os
import pathlib
import re
import sys
import textwrap
from xml.sax.saxutils import escape, quoteattr

WIDTH = 130
MULTI_LINE = {"Scene"}  # texts that are edited in a field of several lines
MACROS = {"number": "Number", "integer": "Integer", "integer64": "Integer64", "switch": "Switch", "choice": "Choice", "name": "Text", "text": "Text",
          "vector": "Vector"}

COMMON = """
  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
"""


def number(value):
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))


def range_of(one):
    low, high = one.get("low"), one.get("high")
    if one["type"] in ("choice", "name", "switch", "text"):
        return ""
    if one["type"] == "integer64" and high is not None and high >= 2**63:  # the type's own end
        high = None
    if low is not None and high is not None:
        return f"{'(' if one.get('open') else '['}{number(low)}, {number(high)}]"
    if low is not None:
        return f"{'above' if one.get('open') else 'at least'} {number(low)}"
    return f"at most {number(high)}" if high is not None else ""


def default_of(one):
    if one["type"] == "choice":
        return one["choices"][one["value"]]
    if one["type"] == "switch":
        return "on" if one["value"] else "off"
    if one["type"] == "vector":
        return "(" + ", ".join(number(value) for value in one["value"]) + ")"
    return one["value"] or "none" if one["type"] in ("name", "text") else number(one["value"])


def when_of(one):
    if "when" not in one:
        return ""
    other, values = one["when"]["name"], one["when"]["values"]
    return f"Used when {other} is {' or '.join(values)}."


def sentence(one):
    """Range, unit and default: "In [0, 100] mm; default 3." """
    said = measure(one)
    return said + ("; default " if said else "Default ") + default_of(one) + "."


def measure(one):
    """Range and unit: "In [0, 100] mm", "Above 0 dB", "In degrees", or nothing."""
    span, unit = range_of(one), one.get("unit", "")
    if span[:1] in ("(", "[") or unit and not span:
        span = " ".join(part for part in ("in", span) if part)
    return " ".join(part for part in (span[:1].upper() + span[1:], unit) if part)


def constant(choice):
    return choice.upper().replace("-", "_")


def capital(text):
    """"3d probe" is "3D probe"."""
    return re.sub(r"^[a-z]|(?<=\d)[a-z]\b", lambda letter: letter.group().upper(), text)


def camel(choice):
    return "".join(capital(word) for word in choice.split("-"))


def comment(text):
    one = f"  /** {text} */"
    if len(one) <= WIDTH:
        return one
    return "\n".join(["  /**", *textwrap.wrap(text, WIDTH, initial_indent="   * ", subsequent_indent="   * ", break_on_hyphens=False), "   */"])


def plural(name):
    return name[:-1] + "ies" if name.endswith("y") else name if name.endswith("s") else name + "s"


def setters(one):
    name, kind = one["name"], one["type"]
    text = " ".join(part for part in (one["help"], when_of(one), sentence(one)) if part)
    if kind == "choice":
        text += " There are " + ", ".join(map(constant, one["choices"])) + "."
    elif kind == "name":
        text += " There are " + ", ".join(f'"{choice}"' for choice in one["choices"]) + "."
    lines = []
    if kind == "choice":
        lines += [f"  enum {plural(name)} {{ " + ", ".join(f"{constant(choice)} = {i}" for i, choice in enumerate(one["choices"])) + " };", ""]
    made = f"  vtkUltrasound{MACROS[kind]}Macro({name});"
    for former in one.get("formerly", []):
        made += f"\n  /** \\deprecated {name} now; goes in version {former['until']}. */\n  vtkUltrasound{MACROS[kind]}Macro({former['name']});"
    if kind != "choice":
        return "\n".join([comment(text), made])
    lines += ["  ///@{", comment(text), made]
    lines += [f"  void Set{name}To{camel(choice)}() {{ this->Set{name}({constant(choice)}); }}" for choice in one["choices"]]
    return "\n".join([*lines, "  ///@}"])


def header_of(parameters):
    return "\n\n".join([setters(one) for one in parameters] + [COMMON.strip("\n")])


def property_of(one, everything):
    kind = one["type"]
    element = {"number": "Double", "vector": "Double", "integer64": "IdType", "name": "String", "text": "String"}.get(kind, "Int") + "VectorProperty"
    value = one["value"]
    default = " ".join(map(number, value)) if kind == "vector" else value if kind in ("name", "text") else number(value)
    lines = [f"      <{element} name=\"{one['name']}\" command=\"Set{one['name']}\" number_of_elements=\"{3 if kind == 'vector' else 1}\" "
             f"default_values={quoteattr(default)}",
             f"          label=\"{one['label']}\"" + (' panel_visibility="advanced"' if one.get("advanced") else "") + ">"]
    if kind == "choice":
        lines.append('        <EnumerationDomain name="enum">')
        lines += [f"          <Entry value=\"{i}\" text=\"{capital(choice.replace('-', ' '))}\"/>" for i, choice in enumerate(one["choices"])]
        lines.append("        </EnumerationDomain>")
    elif kind == "name":
        lines += ['        <StringListDomain name="list">', *(f'          <String value="{choice}"/>' for choice in one["choices"]),
                  "        </StringListDomain>"]
    elif kind == "switch":
        lines.append('        <BooleanDomain name="bool"/>')
    elif kind in ("number", "integer", "vector"):
        bounds = "".join(f' {key}="{number(one[side])}"' for key, side in (("min", "low"), ("max", "high")) if side in one)
        lines.append(f"        <{'Int' if kind == 'integer' else 'Double'}RangeDomain name=\"range\"{bounds}/>")
    text = " ".join(part for part in (one["help"], measure(one) and measure(one) + ".") if part)
    lines += textwrap.wrap(f"<Documentation>{escape(text)}</Documentation>", 140, initial_indent=" " * 8, subsequent_indent=" " * 10,
                           break_on_hyphens=False)
    hints = ['          <Widget type="multi_line"/>'] if one["name"] in MULTI_LINE else []
    if "when" in one:
        other = next(two for two in everything if two["name"] == one["when"]["name"])
        numbers = [other["choices"].index(text) if other["type"] == "choice" else int(text == "on") for text in one["when"]["values"]]
        values = f'value="{numbers[0]}"' if len(numbers) == 1 else f'values="{" ".join(map(str, numbers))}"'
        hints.append(f"          <PropertyWidgetDecorator type=\"GenericDecorator\" mode=\"visibility\" property=\"{other['name']}\" {values}/>")
    if hints:
        lines += ["        <Hints>", *hints, "        </Hints>"]
    return "\n".join([*lines, f"      </{element}>"])


def table_of(parameters):
    rows = ["| parameter | default | range | |", "| --- | --- | --- | --- |"]
    for one in parameters:
        span = ", ".join(one["choices"]) if "choices" in one else "" if one["type"] == "switch" else range_of(one)
        unit = one.get("unit", "")
        text = " ".join(part for part in (one["help"], when_of(one)) if part)
        rows.append(f"| `{one['name']}` | {default_of(one)} | {span}{' ' if span and unit else ''}{unit} | {text.replace('|', chr(92) + '|')} |")
    return "\n".join(rows) + "\n"


def overdue(name, now):
    """Former names of a class's parameters that were to go in this version or an earlier one."""
    numbers = lambda version: [int(part) for part in version.split(".")]
    return [f"{name}: {one['name']} is no longer to be called {former['name']}, which was to go in version {former['until']}; take Formerly() away"
            for one in described(name) or [] for former in one.get("formerly", []) if numbers(former["until"]) <= numbers(now)]


def described(name):
    """The parameters of a class, in the order in which it describes them, or None before it is built."""
    import echorama
    made = getattr(echorama, name, None)
    return json.loads(made().GetParameterDescriptions()) if made and hasattr(made, "GetParameterDescriptions") else None


def between(text, begin, end, inside, place):
    """Replaces what lies between two lines."""
    start = text.index(begin) + len(begin)
    stop = text.find(end, start)
    if stop < 0:
        raise ValueError(f"{place}: {begin.strip()} has no {end.strip()}")
    return text[:start].rstrip("\n") + "\n" + inside.strip("\n") + "\n" + text[text.rindex("\n", 0, stop) + 1:]


def renewed(path, text):
    name = path.stem
    if path.suffix == ".h":
        parameters = described(name)
        # Before the class is built, what its .cxx needs declared, unless it is there.
        if parameters is None and "GetParameterDescriptions" in text:
            return text
        inside = header_of(parameters) if parameters is not None else COMMON
        return between(text, "  // BEGIN parameters\n", "  // END parameters", inside, path)
    if path.suffix == ".xml":
        parameters = described(name) or []
        return between(text, "<!-- BEGIN parameters -->", "<!-- END parameters -->",
                       "\n".join(property_of(one, parameters) for one in parameters), path)
    for begin, name, chosen in re.findall(r"^(<!-- BEGIN parameters of (\w+)(?:: ([\w, ]+?))? -->)", text, re.M):
        parameters = described(name)
        if parameters is None:
            raise ValueError(f"{path}: there is no class {name} with parameters")
        wanted = chosen.replace(",", " ").split()
        unknown = set(wanted) - {one["name"] for one in parameters}
        if unknown:
            raise ValueError(f"{path}: {name} has no parameter {', '.join(sorted(unknown))}")
        text = between(text, begin, "<!-- END parameters -->", table_of([one for one in parameters if not wanted or one["name"] in wanted]), path)
    return text


def main():
    root = pathlib.Path(os.environ.get("ECHORAMA_SOURCE_DIR") or pathlib.Path(__file__).resolve().parent.parent)
    check, stale, complaints = "--check" in sys.argv, [], []
    version = re.search(r"project\(Echorama VERSION ([\d.]+)", (root / "CMakeLists.txt").read_text())[1]
    folders = ["Core", "Readers", "Tracking", "Filters", "Widgets"]
    files = [path for folder in folders for pattern in ("vtk*.h", "vtk*.xml") for path in (root / folder).rglob(pattern)]
    for path in sorted([*files, *(root / "Documentation").rglob("*.md"), root / "README.md"]):
        text = path.read_text()
        if not re.search({".h": r"^  // BEGIN parameters$", ".xml": r"^ *<!-- BEGIN parameters -->$"}.get(path.suffix, r"^<!-- BEGIN parameters of"), text, re.M):
            continue
        try:
            new = renewed(path, text)
        except ValueError as problem:
            complaints.append(str(problem))
            continue
        if path.suffix == ".h":
            complaints += overdue(path.stem, version)
        if new != text:
            stale.append(str(path.relative_to(root)))
            if not check:
                path.write_text(new)
    import echorama
    schema = root / "Examples/scenes/echorama-scene-1.schema.json"
    if schema.read_text() != echorama.vtkUltrasoundSceneSource.GetSceneSchema():
        stale.append(str(schema.relative_to(root)))
        if not check:
            schema.write_text(echorama.vtkUltrasoundSceneSource.GetSceneSchema())
    for line in complaints:
        print(line)
    for name in stale:
        print(f"{name}: {'stale: ./run generate' if check else 'written'}")
    sys.exit(1 if complaints or check and stale else 0)


if __name__ == "__main__":
    main()
