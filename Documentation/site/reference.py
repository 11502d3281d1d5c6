# SPDX-License-Identifier: BSD-3-Clause
"""Pages of the reference, made of what Doxygen reads in the headers: one for each class of the pipeline, which C++ and Python share,
and one for each header of kernels."""
import collections
import html
import os
import pathlib
import re
import subprocess
import xml.etree.ElementTree as tree

ROOMS = ["Core", "Readers", "Filters", "Tracking", "Widgets"]
LEFT_OUT = ("Testing", "Benchmarks", "Fuzzing")
# Setters and getters of a parameter become one variable: the page tells them as one.
PARAMETERS = {"Number": "double", "Integer": "int", "Integer64": "vtkTypeInt64", "Switch": "bool", "Choice": "choice", "Text": "text", "Vector": "vector"}
MACROS = [f"vtkUltrasound{kind}Macro(name)={type} name" for kind, type in PARAMETERS.items()] + [
    "vtkUltrasoundAnyParameterMacro()=bool SetParameter(const char* name, double value); bool SetParameterAsText(const char* name, const char* value);"
    " double GetParameter(const char* name); std::string GetParameterAsText(const char* name); std::string GetParameterDescriptions();",
    "vtkTypeMacro(a,b)=", "vtkTemplateTypeMacro(a,b)=",
    "vtkSetMacro(name,type)=void Set##name(type value);", "vtkGetMacro(name,type)=type Get##name();",
    "vtkSetClampMacro(name,type,low,high)=void Set##name(type value);", "vtkBooleanMacro(name,type)=void name##On(); void name##Off();",
    "vtkSetFilePathMacro(name)=void Set##name(const char* path);", "vtkGetFilePathMacro(name)=char* Get##name();",
    "vtkSetVector3Macro(name,type)=void Set##name(type x, type y, type z);", "vtkGetVector3Macro(name,type)=type* Get##name();",
    "vtkSetVectorMacro(name,type,count)=void Set##name(const type value[count]);", "vtkGetVectorMacro(name,type,count)=type* Get##name();",
    "VTK_SIZEHINT(n)=", "VTK_NEWINSTANCE=", "VTK_DEPRECATED="]
INLINE = {"bold": "strong", "emphasis": "em", "computeroutput": "code", "superscript": "sup", "subscript": "sub", "itemizedlist": "ul",
          "orderedlist": "ol", "listitem": "li", "row": "tr", "blockquote": "blockquote"}
SECTIONS = {"see": "See also", "return": "Returns", "note": "Note", "warning": "Warning", "pre": "Before", "post": "After"}
LETTERS = {"sp": " ", "ndash": "&ndash;", "mdash": "&mdash;", "nonbreakablespace": "&nbsp;", "linebreak": "<br>", "lt": "&lt;", "gt": "&gt;", "amp": "&amp;"}


def headers(source):
    for room in ROOMS:
        for path in sorted((source / room).rglob("*.h")):
            if not set(path.relative_to(source).parts) & set(LEFT_OUT):
                yield path.relative_to(source)


def read_headers(source, folder):
    """The compounds that Doxygen finds, by the header in which each lies."""
    exports = sorted({word for path in headers(source) for word in re.findall(r"\bECHORAMA\w+_EXPORT\b", (source / path).read_text())})
    settings = {"QUIET": "YES", "WARNINGS": "NO", "GENERATE_HTML": "NO", "GENERATE_LATEX": "NO", "GENERATE_XML": "YES", "XML_PROGRAMLISTING": "NO",
                "OUTPUT_DIRECTORY": folder, "STRIP_FROM_PATH": source, "FULL_PATH_NAMES": "YES", "EXTRACT_ALL": "YES", "SORT_MEMBER_DOCS": "NO",
                "DISTRIBUTE_GROUP_DOC": "YES", "MACRO_EXPANSION": "YES", "EXPAND_ONLY_PREDEF": "YES", "AUTOLINK_SUPPORT": "YES", "JAVADOC_AUTOBRIEF": "NO",
                "SEARCH_INCLUDES": "NO", "WARN_IF_DOC_ERROR": "NO", "WARN_IF_UNDOCUMENTED": "NO", "HAVE_DOT": "NO", "CLASS_GRAPH": "NO",
                "COLLABORATION_GRAPH": "NO", "INCLUDE_GRAPH": "NO", "INCLUDED_BY_GRAPH": "NO", "DIRECTORY_GRAPH": "NO", "INPUT": " ".join(f'"{source / path}"' for path in headers(source)),
                "PREDEFINED": " ".join('"' + each.replace('"', '\\"') + '"' for each in MACROS + [f"{each}=" for each in exports])}
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["doxygen", "-"], input="\n".join(f"{key} = {value}" for key, value in settings.items()), text=True, check=True, cwd=source,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    found = collections.defaultdict(list)
    for path in sorted((folder / "xml").glob("*.xml")):
        for compound in tree.parse(path).getroot().iter("compounddef"):
            if compound.get("kind") in ("class", "struct", "union"):
                if compound.get("prot") == "public":
                    found[pathlib.Path(compound.find("location").get("file"))].append(compound)
            elif compound.get("kind") in ("namespace", "file"):
                for member in compound.iter("memberdef"):
                    if member.get("kind") != "define" and member.get("prot") == "public" and not (compound.findtext("compoundname") or "").count("@"):
                        found[pathlib.Path(member.find("location").get("file"))].append(member)
    return found


def line_of(element):
    return int(element.find("location").get("line"))


def short(compound):
    return (compound.findtext("compoundname") or compound.findtext("name")).removeprefix("echorama::")


def public_members(compound):
    seen = set()
    for member in sorted(compound.iter("memberdef"), key=line_of):
        name, kind = member.findtext("name"), member.get("kind")
        signature = name + (member.findtext("argsstring") or "")
        if member.get("prot") == "public" and kind != "friend" and signature not in seen and name not in ("New", "PrintSelf", "operator=") \
                and not name.startswith("~") and "=delete" not in signature and "@" not in name:
            seen.add(signature)
            yield member


def hidden_from_python(text):
    """Lines that VTK's wrapper does not see."""
    lines, depth, hidden = set(), 0, False
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*#\s*if", line):
            depth += 1
            if "ifndef __VTK_WRAP__" in line:
                hidden = depth
        elif re.match(r"\s*#\s*endif", line):
            if hidden == depth:
                hidden = False
            depth -= 1
        elif hidden:
            lines.add(number)
    return lines


class Reference:
    def __init__(self, source, folder):
        self.source = source
        self.found = read_headers(source, folder)
        self.place = {}  # of what Doxygen calls by an id: page and anchor
        self.pages = {}
        for path, things in self.found.items():
            page = f"reference/{path.stem}.md" if path.name.startswith("vtk") else f"reference/{path.with_suffix('')}.h.md"
            self.pages[path] = page
            taken = collections.Counter()
            for thing in sorted(things, key=line_of):
                inside = [thing] if thing.tag == "memberdef" else [thing, *thing.iter("memberdef")]
                for each in inside:
                    name = short(thing) if each is thing else f"{short(thing)}-{each.findtext('name')}"
                    if path.name.startswith("vtk") and each is thing and name == path.stem:
                        self.place.setdefault(each.get("id"), (page, ""))
                    elif each.get("id") not in self.place and (each is thing or each.get("prot") == "public"):
                        anchor = re.sub(r"[^\w-]+", "-", name).strip("-")
                        taken[anchor] += 1 # overloads
                        self.place[each.get("id")] = (page, anchor if taken[anchor] == 1 else f"{anchor}-{taken[anchor]}")
        self.classes = sorted(path.stem for path in self.pages if path.name.startswith("vtk"))

    def link(self, page, identity, text):
        if identity not in self.place:
            return text
        other, anchor = self.place[identity]
        target = "" if other == page else os.path.relpath(other, os.path.dirname(page)).removesuffix(".md") + ".html"
        return f'<a href="{target}{"#" + anchor if anchor else ""}">{text}</a>' if target or anchor else text

    def html(self, page, element):
        """A description as HTML."""
        if element is None:
            return ""
        inner = html.escape(element.text or "", quote=False)
        for child in element:
            inner += self.html(page, child) + html.escape(child.tail or "", quote=False)
        tag = element.tag
        if tag in LETTERS:
            return LETTERS[tag]
        if tag == "ref":
            return self.link(page, element.get("refid"), inner)
        if tag == "ulink":
            return f'<a href="{html.escape(element.get("url"))}">{inner}</a>'
        if tag == "para":
            inner = inner.strip()
            return f"<p>{inner}</p>" if inner and not re.match(r"<(ul|ol|pre|table|dl|p)\b", inner) else inner
        if tag in INLINE:
            return f"<{INLINE[tag]}>{inner}</{INLINE[tag]}>"
        if tag == "table":
            return f'<table>{inner}</table>'
        if tag == "entry":
            cell = "th" if element.get("thead") == "yes" else "td"
            return f"<{cell}>{re.sub('</?p>', '', inner).strip()}</{cell}>"
        if tag == "codeline":
            return inner + "\n"
        if tag in ("programlisting", "verbatim", "preformatted"):
            return f"<pre>{inner}</pre>"
        if tag == "simplesect":
            title = SECTIONS.get(element.get("kind"), element.get("kind"))
            return f"<p><strong>{title}:</strong> {re.sub('</?p>', ' ', inner).strip()}</p>"
        if tag == "parameterlist":
            return f"<ul>{inner}</ul>"
        if tag == "parameteritem":
            return f"<li>{inner}</li>"
        if tag == "parameternamelist":
            return f"<code>{inner.strip()}</code> "
        if tag == "parameterdescription":
            return re.sub("</?p>", "", inner)
        return inner

    def about(self, page, thing):
        return "".join(self.html(page, thing.find(part)).strip() for part in ("briefdescription", "detaileddescription", "inbodydescription"))

    def brief(self, page, thing):
        return re.sub("</?p>", " ", self.html(page, thing.find("briefdescription"))).strip()

    def signature(self, page, member):
        kind, name = member.get("kind"), member.findtext("name")
        type_ = self.html(page, member.find("type")).strip()
        if kind == "enum":
            values = ", ".join(each.findtext("name") for each in member.iter("enumvalue"))
            return f"enum {'' if name.startswith('@') else html.escape(name) + ' '}{{ {html.escape(values)} }}"
        template = member.find("templateparamlist")
        names = [] if template is None else [" ".join(filter(None, ("".join(each.find("type").itertext()), each.findtext("declname")))) for each in template]
        start = f"template &lt;{html.escape(', '.join(names), quote=False)}&gt; " if names else ""
        if kind == "typedef":
            return f"{start}using {html.escape(name)} = {type_}"
        arguments = html.escape(member.findtext("argsstring") or "", quote=False) if kind == "function" else html.escape((member.findtext("argsstring") or ""))
        value = self.html(page, member.find("initializer")).strip() if kind == "variable" and member.find("initializer") is not None else ""
        static = "static " if member.get("static") == "yes" else ""
        return f"{start}{static}{type_}{' ' if type_ else ''}<strong>{html.escape(name)}</strong>{arguments}{' ' + value if len(value) < 60 else ''}".strip()

    def entry(self, page, member, note=""):
        _, anchor = self.place[member.get("id")]
        values = "".join(f"<li><code>{html.escape(each.findtext('name'))}</code> {re.sub('</?p>', '', self.about(page, each))}</li>"
                         for each in member.iter("enumvalue") if self.about(page, each))
        return (f'<dt id="{anchor}"><code>{self.signature(page, member)}</code>{note}</dt>\n'
                + (f"<dd>{self.about(page, member)}{f'<ul>{values}</ul>' if values else ''}</dd>\n" if values or self.about(page, member) else ""))

    def class_page(self, path):
        page, text = self.pages[path], (self.source / path).read_text()
        main = next((each for each in self.found[path] if short(each) == path.stem), None)
        lines = [f"# {path.stem}\n"]
        module = "".join(self.module(path))
        if main is not None:
            bases = ", ".join(self.link(page, each.get("refid"), html.escape(each.text)) for each in main.findall("basecompoundref"))
            lines += [f'<div class="declared"><p>{self.brief(page, main)}</p>\n'
                      f"<p>{f'Inherits {bases}. ' if bases else ''}In <code>Echorama::{module}</code>, header <code>{path.name}</code>"
                      + (f"; Python: <code>from echorama import {path.stem}</code>" if path.stem in self.wrapped else "; for C++ alone") + ".</p></div>\n"]
            lines += [f'<div>{self.html(page, main.find("detaileddescription"))}</div>\n']
        hidden = hidden_from_python(text)
        for thing in [main] * (main is not None) + [each for each in self.found[path] if each is not main]:
            if thing.tag == "memberdef":
                lines += [f'<dl class="members">{self.entry(page, thing)}</dl>\n']
                continue
            members = list(public_members(thing))
            named = dict.fromkeys(PARAMETERS.values())
            parameters = [each for each in members if each.get("kind") == "variable" and thing is main and "".join(each.find("type").itertext()) in named]
            rest = [each for each in members if each not in parameters]
            if thing is not main:
                lines += [f"## `{short(thing)}` {{#{self.place[thing.get('id')][1]}}}\n", f'<div>{self.about(page, thing)}</div>\n']
            if parameters:
                lines += ["## Parameters\n", '<dl class="members">']
                for each in parameters:
                    name, type_ = each.findtext("name"), "".join(each.find("type").itertext())
                    calls = {"bool": f"<strong>{name}On</strong>(), <strong>{name}Off</strong>(), ", "choice": ""}.get(type_, "")
                    value = {"text": "text", "choice": "int", "vector": "x, y, z", "vtkTypeInt64": "integer"}.get(type_, type_)
                    lines += [f'<dt id="{self.place[each.get("id")][1]}"><code>{calls}<strong>Set{name}</strong>({value}), <strong>Get{name}</strong>()'
                              + (f", <strong>Get{name}AsString</strong>()" if type_ == "choice" else "") + f"</code></dt>\n<dd>{self.about(page, each)}</dd>"]
                lines += ["</dl>\n"]
            if rest:
                lines += ["## Functions\n" if thing is main else "", '<dl class="members">']
                lines += [self.entry(page, each, ' <span class="note">C++</span>' if thing is main and line_of(each) in hidden else "") for each in rest]
                lines += ["</dl>\n"]
        return "\n".join(lines)

    def header_page(self, path):
        page = self.pages[path]
        lines = [f"# {path.name}\n", f'<div class="declared"><p><code>#include "{path}"</code>, in <code>Echorama::{"".join(self.module(path))}Kernels'
                 "</code>, namespace <code>echorama</code>.</p></div>\n"]
        things = sorted(self.found[path], key=line_of)
        for number, thing in enumerate(things):
            anchor = self.place[thing.get("id")][1]
            if thing.tag == "memberdef":
                if number == 0 or things[number - 1].tag != "memberdef" or thing.findtext("name") != things[number - 1].findtext("name"):
                    lines += [f"## `{thing.findtext('name').strip('@0123456789') or 'enum'}` {{#{anchor}-}}\n"]
                lines += [f'<dl class="members">{self.entry(page, thing)}</dl>\n']
            else:
                lines += [f"## `{thing.get('kind')} {short(thing)}` {{#{anchor}}}\n", f'<div>{self.about(page, thing)}</div>\n']
                members = "".join(self.entry(page, each) for each in public_members(thing))
                lines += [f'<dl class="members">{members}</dl>\n' if members else ""]
        return "\n".join(lines)

    def module(self, path):
        """The folders that make the name of a room: Filters, Registration."""
        parts = path.parts[:2] if path.parts[0] == "Filters" or (self.source / pathlib.Path(*path.parts[:2]) / "CMakeLists.txt").is_file() else path.parts[:1]
        return parts

    @property
    def wrapped(self):
        return {path.stem for path in self.found if path.name.startswith("vtk") and not re.search(
            rf"UNWRAPPED[^)]*\b{path.stem}\b", (self.source / pathlib.Path(*self.module(path)) / "CMakeLists.txt").read_text())}

    def overview(self):
        """The list for the page reference.md: rooms, their classes and headers."""
        rooms = collections.defaultdict(lambda: ([], []))
        for path in sorted(self.found):
            rooms["/".join(self.module(path))][not path.name.startswith("vtk")].append(path)
        lines = []
        for room, (classes, kernels) in sorted(rooms.items(), key=lambda each: (ROOMS.index(each[0].split("/")[0]), each[0])):
            lines += [f"### {room}\n"]
            for path in classes:
                main = next((each for each in self.found[path] if short(each) == path.stem), None)
                brief = re.sub("<[^>]*>", "", self.brief(self.pages[path], main)) if main is not None else ""
                lines += [f"* [`{path.stem}`]({self.pages[path]}){': ' + brief if brief else ''}"]
            if kernels:
                lines += ["\nKernels: " + ", ".join(f"[{path.name}]({self.pages[path]})" for path in kernels) + "\n"]
        return "\n".join(lines) + "\n"

    def write(self, folder):
        for path, page in self.pages.items():
            (folder / page).parent.mkdir(parents=True, exist_ok=True)
            (folder / page).write_text(self.class_page(path) if path.name.startswith("vtk") else self.header_page(path))
