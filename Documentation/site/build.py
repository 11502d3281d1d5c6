#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The site in FOLDER/html: the pages of Documentation, pages and sources outside of it that they link to, and the reference. The pages
stay as code hosts show them; what MkDocs sees differently is changed in copies (FOLDER/pages)."""
import argparse
import html
import json
import os
import pathlib
import re
import shutil

import mkdocs.commands.build
import mkdocs.config
from pygments.formatters import HtmlFormatter

from reference import Reference

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[1]
LANGUAGES = {".h": "cpp", ".cxx": "cpp", ".py": "python", ".json": "json", ".txt": "text"}
LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\]]*\])*\]\()([^)\s]+)(\))")


def slug(text, separator="-"):
    """The anchor of a heading as code hosts make it."""
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", separator)


def outside_code(text, change):
    """Changes all of a Markdown text but its fenced blocks and code in lines."""
    parts = re.split(r"(^```.*?^```[^\n]*$|(?<!`)`[^`\n]+`(?!`)|<!--.*?-->)", text, flags=re.M | re.S)
    # A link may have code as its text: such lines are changed as a whole.
    joined, held = [], ""
    for number, part in enumerate(parts):
        if number % 2 and (part.startswith("```") or part.startswith("<!--")):
            joined += [change(held), part]
            held = ""
        else:
            held += part
    return "".join([*joined, change(held)])


class Pages:
    def __init__(self, folder):
        self.folder = folder
        self.waiting, self.places = [], {}

    def place(self, path):
        """Where a file of the project lies among the pages; the first time it is put there."""
        if path not in self.places:
            if path.is_relative_to("Documentation"):
                self.places[path] = path.relative_to("Documentation")
            elif path.suffix in (".md", ".png"):
                self.places[path] = "project" / path
            else: # a source is shown
                self.places[path] = pathlib.Path("project", f"{path}.md")
            self.waiting.append(path)
        return self.places[path]

    def copy(self):
        """Puts everything there that is waiting, and what that links to."""
        while self.waiting:
            path = self.waiting.pop()
            out = self.folder / self.places[path]
            out.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == ".md":
                out.write_text(outside_code(separated((SOURCE / path).read_text()), lambda text: LINK.sub(lambda link: self.relinked(path, link), text)))
            elif path.suffix == ".png":
                shutil.copyfile(SOURCE / path, out)
            else:
                out.write_text(f"# {path.name}\n\n`{path}`\n\n```{LANGUAGES.get(path.suffix, 'text')}\n{(SOURCE / path).read_text()}\n```\n")

    def relinked(self, path, link):
        target, hash_, anchor = link[2].partition("#")
        if not target or re.match(r"[a-z]+:", target):
            return link[0]
        other = pathlib.Path(os.path.normpath(path.parent / target))
        if (SOURCE / other).is_dir():
            other /= "README.md"
        if not (SOURCE / other).is_file():
            raise SystemExit(f"{path}: there is no {target}")
        place = os.path.relpath(self.place(other), self.places[path].parent)
        return link[1] + place + hash_ + anchor + link[3]


def separated(text):
    """Blank lines where Python's Markdown needs them and CommonMark does not (before lists, tables, after comments), and its indentation."""
    lines, fence, items, before = [], False, False, ""
    for line in text.splitlines():
        if fence or line.startswith("```"):
            fence = fence != line.startswith("```")
        else:
            item = re.match(r"([*+-]|\d+[.)]) ", line)
            if not line.strip():
                pass
            elif item:
                if before.strip() and not items:
                    lines.append("")
                items = True
            elif not line.startswith(" ") and not before.strip():
                items = False
            if line.startswith("|") and before.strip() and not before.startswith("|"):
                lines.append("")
            if before.endswith("-->") and line.strip() or line.startswith("<!--") and before.strip():
                lines.append("")
            if items and line.startswith("  "): # lists in lists
                line = line.replace("  ", "    ", 1)
        lines.append(line)
        before = line
    return "\n".join(lines) + "\n"


def navigation(index):
    """The sections of index.md, each with the pages that it links to. The first of a line is called as there, the others by their titles."""
    sections, seen = [], {"index.md"}
    for line in index.splitlines():
        if line.startswith("## "):
            sections.append((line[3:], []))
        for number, (title, target) in enumerate(re.findall(r"\[([^\]]+)\]\(([^)#\s]+\.md)\)", line) if sections else ()):
            if target not in seen:
                seen.add(target)
                sections[-1][1].append({title[:1].upper() + title[1:]: target} if number == 0 else target)
    return [{"Home": "index.md"}, *({title: pages} for title, pages in sections if pages)]


def with_class_links(folder, classes):
    """Names of classes in the text of pages lead to the reference."""
    for path in folder.rglob("*.html"):
        if "reference" not in path.relative_to(folder).parts[:1]:
            text, up = path.read_text(), os.path.relpath(folder, path.parent)
            path.write_text(re.sub(r"(<a\b[^>]*>.*?</a>|<h\d.*?</h\d>|<pre.*?</pre>)|<code>(vtkUltrasound\w+)</code>", lambda found: found[1] or (
                f'<a href="{up}/reference/{found[2]}.html">{found[0]}</a>' if found[2] in classes else found[0]), text, flags=re.S))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder.resolve()
    for old in (folder / "html", folder / "pages"):
        shutil.rmtree(old, ignore_errors=True)

    pages = Pages(folder / "pages")
    for path in [*sorted((SOURCE / "Documentation").rglob("*.md")), *sorted((SOURCE / "Documentation").rglob("*.png"))]:
        pages.place(path.relative_to(SOURCE))
    pages.copy()
    reference = Reference(SOURCE, folder / "doxygen")
    reference.write(folder / "pages")
    with (folder / "pages" / "reference.md").open("a") as overview:
        overview.write("\n" + reference.overview())

    style = "\n".join((HERE / "theme" / "style.css").read_text().splitlines())
    config = mkdocs.config.load_config(str(HERE / "mkdocs.yml"), docs_dir=str(folder / "pages"), site_dir=str(folder / "html"),
                                       nav=navigation((folder / "pages" / "index.md").read_text()))
    config["mdx_configs"]["toc"] = {"slugify": slug, "toc_depth": "2-3"}
    mkdocs.commands.build.build(config)

    site = folder / "html"
    colours = [HtmlFormatter(style=name).get_style_defs(".codehilite") for name in ("default", "monokai")]
    (site / "style.css").write_text(f"{style}\n{colours[0]}\n@media (prefers-color-scheme: dark) {{\n{colours[1]}\n}}\n")
    index = json.loads((site / "search" / "search_index.json").read_text())["docs"]
    entries = [[each["location"], html.unescape(each["title"]), re.sub(r"\s+", " ", html.unescape(re.sub("<[^>]*>", " ", each["text"])))] for each in index]
    (site / "search-index.js").write_text("searchIndex = " + json.dumps(entries, ensure_ascii=False, separators=(",", ":")) + ";\n")
    shutil.rmtree(site / "search")
    for unused in site.glob("sitemap.xml*"):
        unused.unlink()
    with_class_links(site, set(reference.classes))
    print(f"{len(list(site.rglob('*.html')))} pages: open {site / 'index.html'}")


if __name__ == "__main__":
    main()
