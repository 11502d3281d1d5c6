#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The site: it is built, every link and picture in it resolves, nothing comes from the network, and no page is wider than a telephone."""
import functools
import html.parser
import http.server
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest
import urllib.parse

source = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"])
missing = [name for name in ("mkdocs", "doxygen") if not shutil.which(name)]


class Page(html.parser.HTMLParser):
    """What a page links to, what it loads, and the anchors that it has."""

    LOADED = {"script": "src", "link": "href", "img": "src", "iframe": "src", "source": "src", "video": "src", "object": "data"}

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.anchors, self.text = [], [], [], []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag == "a" and "href" in attributes:
            self.links.append(attributes["href"])
        if attributes.get(self.LOADED.get(tag)) is not None:
            self.loads.append(attributes[self.LOADED[tag]])
        if attributes.get("id"):
            self.anchors.append(attributes["id"])

    def handle_data(self, data):
        self.text.append(data)


@unittest.skipIf(missing, f"{' and '.join(missing)} not installed: ./run site installs what the site needs")
class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        folder = pathlib.Path(cls.temporary.name)
        built = subprocess.run(["/usr/bin/python3", source / "Documentation" / "site" / "build.py", folder], capture_output=True, text=True)
        if built.returncode != 0:
            raise RuntimeError(f"the site is not built:\n{built.stdout}{built.stderr}")
        cls.root = folder / "html"
        cls.pages = {path: Page(path) for path in sorted(cls.root.rglob("*.html"))}

    def name(self, path):
        return str(path.relative_to(self.root))

    def test_every_link_resolves(self):
        dead, links, pictures = [], 0, 0
        for path, page in self.pages.items():
            for target in [*page.links, *page.loads]:
                parts = urllib.parse.urlsplit(target)
                if parts.scheme:
                    continue
                other = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
                links, pictures = links + (target in page.links), pictures + (other.suffix == ".png")
                if not other.is_file() or self.root not in other.parents:
                    dead.append(f"{self.name(path)}: {target} is not there")
                elif parts.fragment and other in self.pages and urllib.parse.unquote(parts.fragment) not in self.pages[other].anchors:
                    dead.append(f"{self.name(path)}: {target} has no such place")
        self.assertEqual(dead, [])
        self.assertGreater(links, 20_000)  # reference and navigation alone
        self.assertGreater(pictures, 150)

    def test_nothing_comes_from_elsewhere(self):
        for path, page in self.pages.items():
            self.assertEqual([target for target in page.loads if not target.startswith("data:") and urllib.parse.urlsplit(target).netloc + urllib.parse.urlsplit(
                target).scheme], [], self.name(path))
        for path in [*self.root.rglob("*.css"), *self.root.rglob("*.js")]:
            if path.name != "search-index.js":  # text that nothing loads
                self.assertNotRegex(path.read_text(), r"https?:|@import|url\(\s*['\"]?//|fetch\(|XMLHttpRequest|sendBeacon")

    def test_anchors_are_unique(self):
        for path, page in self.pages.items():
            self.assertEqual(sorted(set(page.anchors)), sorted(page.anchors), self.name(path))

    def test_all_pages_and_classes_are_there(self):
        for path in (source / "Documentation").rglob("*.md"):
            page = self.root / path.relative_to(source / "Documentation").with_suffix(".html")
            self.assertTrue(page.is_file(), page)
            self.assertNotRegex(" ".join(self.pages[page].text), r"(?m)^\s*(\* |\|.*\|.*\|$)|\]\(\w|^#+ ", f"{path}: Markdown is left over")
        overview = self.pages[self.root / "reference.html"]
        classes = {path.stem for room in ("Core", "Readers", "Filters", "Tracking", "Widgets") for path in (source / room).rglob("vtk*.h")
                   if re.search(rf"^class (\w+ )?{path.stem}\b", path.read_text(), re.M)}
        self.assertGreater(len(classes), 50)
        self.assertEqual([name for name in sorted(classes) if f"reference/{name}.html" not in overview.links], [])
        aligner = " ".join(self.pages[self.root / "reference" / "vtkUltrasoundAligner.html"].text)
        for part in ("from echorama import vtkUltrasoundAligner", "SetMinimumOverlap", "in [0.01, 1]", "SetFixedVolume", "vtkUltrasoundMultiBlockAlgorithm"):
            self.assertIn(part.lower(), " ".join(aligner.split()).lower())
        metric = " ".join(self.pages[self.root / "reference" / "Filters" / "Registration" / "Metric.h.html"].text)
        self.assertIn("SeeIntensity", metric)

    def test_search_finds_pages(self):
        entries = json.loads((self.root / "search-index.js").read_text().removeprefix("searchIndex = ").removesuffix(";\n"))
        found = {address.partition("#")[0] for address, _, text in entries if "membrane" in text.lower()}
        self.assertLessEqual({"membrane.html", "filters/Stitcher.html", "reference/vtkUltrasoundStitcher.html"}, found)
        for address, title, _ in entries:
            path, _, anchor = address.partition("#")
            self.assertIn(self.root / path, self.pages)
            self.assertTrue(not anchor or anchor in self.pages[self.root / path].anchors, address)
            self.assertTrue(title, address)

    def test_gallery_has_every_picture(self):
        """Each with the page that shows it, and a command whose files are there."""
        gallery = (source / "Documentation" / "gallery.md").read_text()
        items = re.findall(r"^\* \[!\[[^\]]+\]\(([^)]+\.png)\)\]\(([^)#]+)[^)]*\)\s+([^\n]+(?:\n  [^\n]+)*)", gallery, re.M)
        folder = source / "Documentation"
        self.assertEqual(sorted(picture for picture, _, _ in items), sorted(str(path.relative_to(folder)) for path in folder.rglob("*.png")))
        for picture, page, text in items:
            self.assertIn(os.path.relpath(folder / picture, (folder / page).parent), (folder / page).read_text(), f"{page} does not show {picture}")
            commands = re.findall(r"`([^`]+)`", text)
            self.assertTrue(commands, picture)
            for file in re.findall(r"\b(?:Examples|Applications|Testing|Widgets|Plugin|Documentation)/[\w/.-]+", " ".join(commands)):
                self.assertTrue((source / file).exists(), f"{picture}: there is no {file}")

    def browser(self, address):
        """The page as it is when its scripts have run."""
        return subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={self.temporary.name}/browser", "--virtual-time-budget=600000",
                               "--dump-dom", address], capture_output=True, text=True, timeout=600).stdout

    @unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
    def test_search_works_from_a_disk(self):
        page = self.root / "filters" / "typed.htm"
        for typed, wanted, never in (("stitcher", "Stitcher.html", "no page"), ("Membrane seam", "stitching", "no page"), ("xyzzy", "no page", "<a ")):
            page.write_text((self.root / "filters" / "Aligner.html").read_text() + f"""<script>addEventListener("load", () => {{
              const input = document.querySelector("header input");
              input.value = "{typed}";
              input.dispatchEvent(new Event("input"));
            }});</script>""")
            found = re.search(r'<div id="found">(.*?)</div>', self.browser(page.as_uri()), re.S)
            self.assertTrue(found, typed)
            self.assertIn(wanted.lower(), found[1].lower(), typed)
            self.assertNotIn(never, found[1].lower(), typed)
            for target in re.findall(r'href="([^"]*)"', found[1]):
                self.assertTrue((page.parent / target.partition("#")[0]).resolve().is_file(), target)

    @unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
    def test_no_page_is_wider_than_a_telephone(self):
        class Quiet(http.server.SimpleHTTPRequestHandler):
            def log_message(self, *_):
                pass

        names = [self.name(path) for path in self.pages]
        (self.root / "measure.htm").write_text("""<!DOCTYPE html><body><pre id="wide"></pre><script>
          (async () => {
            const frame = document.createElement("iframe"), wide = [];
            frame.style = "width: 400px; height: 800px; border: 0";
            document.body.append(frame);
            for (const name of %s) {
              await new Promise(done => { frame.onload = done; frame.src = name; });
              const width = frame.contentDocument.documentElement.scrollWidth;
              if (!frame.contentDocument.querySelector("main p, main dl") || width > 400) wide.push(name + ": " + width);
            }
            document.getElementById("wide").textContent = "wide: " + JSON.stringify(wide) + " end";
          })();</script>""" % json.dumps(names))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=self.root)) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            shown = self.browser(f"http://127.0.0.1:{server.server_port}/measure.htm")
            server.shutdown()
        wide = re.search(r"wide: (\[.*?\]) end</pre>", shown)
        self.assertTrue(wide, shown[-300:])
        self.assertEqual(json.loads(wide[1]), [])


if __name__ == "__main__":
    unittest.main()
