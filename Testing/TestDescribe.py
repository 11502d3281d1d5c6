#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the program says of itself for others: forms for 3D Slicer, completion for bash, manual pages; and what desktops are told."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

from program_under_test import PROGRAM, SOURCE, blobs, run, write_mha

DESKTOP = SOURCE / "Applications" / "desktop"
COMMANDS = re.findall(r"^  ([a-z][a-z-]*) ", run("--help").stdout, re.MULTILINE)
LEAVES = [[name] for name in COMMANDS if name != "calibrate"] + [["calibrate", kind] for kind in ("hand-eye", "pivot", "rig", "surface", "temporal")]
# The rules of Slicer's Execution Model that forms must keep: those of its parser (ModuleDescriptionParser of 3D Slicer) and of the stricter
# schema of CTK, which reads the same forms (ctkCmdLineModule.xsd). Debian has neither.
IDENTIFIER = r"[_a-zA-Z][_a-zA-Z0-9]*"
OF_THE_WHOLE = ["category", "title", "description", "version", "documentation-url", "license", "contributor", "acknowledgements", "parameters"]
OF_A_PARAMETER = ["name", "flag", "longflag", "index", "description", "label", "default", "channel", "element", "constraints"]
NUMBERS = {"integer": int, "float": float, "double": float}
VECTORS = {f"{kind}-vector": kind for kind in NUMBERS}
ENUMERATIONS = {f"{kind}-enumeration" for kind in (*NUMBERS, "string")}
FILES = {"file", "image", "geometry"}
ATTRIBUTES = {**dict.fromkeys([*NUMBERS, "string", "directory"], {"hidden", "multiple"}),
              **dict.fromkeys([*VECTORS, "string-vector", *ENUMERATIONS, "boolean"], {"hidden"}),
              "file": {"hidden", "multiple", "fileExtensions"}, **dict.fromkeys(("image", "geometry"), {"hidden", "multiple", "fileExtensions", "type"})}


def faults(text):
    """What the execution model would not take in a form, or would take for something else."""
    found = []
    if not text.startswith("<?xml "):
        found.append("the first line is not that of XML")
    tree = ElementTree.fromstring(text)
    if tree.tag != "executable":
        found.append(f"the outermost is <{tree.tag}>")

    def order(element, wanted, required, may_repeat=()):
        tags = [part.tag for part in element]
        known = [tag for tag in tags if tag in wanted]
        place = f"<{element.tag}> {element.findtext('name') or ''}"
        if strange := set(tags) - set(wanted):
            found.append(f"{place}: there is no {strange} in it")
        if known != sorted(known, key=wanted.index):
            found.append(f"{place}: order {known}")
        found.extend(f"{place}: no {tag}" for tag in required if not element.findtext(tag, "").strip())
        found.extend(f"{place}: {tag} twice" for tag in set(tags) - set(may_repeat) if tags.count(tag) > 1)

    order(tree, OF_THE_WHOLE, ["title", "description"], {"parameters"})
    groups = tree.findall("parameters")
    everything = []
    if not groups:
        found.append("it has no parameters")
    for group in groups:
        if [part.tag for part in group][:2] != ["label", "description"] or len(group) < 3:
            found.append("a group without label, description or parameters")
        if set(group.attrib) - {"advanced"}:
            found.append(f"attributes of a group: {group.attrib}")
        everything += list(group)[2:]
    for one in everything:
        name, kind = one.findtext("name", ""), one.tag
        place = f"<{kind}> {name}"
        if kind not in ATTRIBUTES:
            found.append(f"{place}: there is no such type")
            continue
        order(one, OF_A_PARAMETER, ["name", "description", "label"], {"element"})
        if strange := set(one.attrib) - ATTRIBUTES[kind]:
            found.append(f"{place}: there is no attribute {strange}")
        found.extend(f"{place}: {key} is {one.get(key)}" for key in ("hidden", "multiple") if one.get(key, "true") not in ("true", "false"))
        if not re.fullmatch(IDENTIFIER, name):
            found.append(f"{place}: its name is no identifier")
        for tag, pattern in (("flag", "-?[a-zA-Z]"), ("longflag", f"-?-?{IDENTIFIER}"), ("index", r"\d+"), ("channel", "input|output")):
            if one.find(tag) is not None and not re.fullmatch(pattern, one.findtext(tag) or ""):
                found.append(f"{place}: {tag} is {one.findtext(tag)}")
        if (one.find("index") is None) == (one.find("flag") is None and one.find("longflag") is None):
            found.append(f"{place}: a flag or an index, not both")
        if kind in FILES and one.find("channel") is None:
            found.append(f"{place}: no channel")
        if (kind in ENUMERATIONS) != (one.find("element") is not None):
            found.append(f"{place}: elements are of enumerations")
        default, elements = one.findtext("default"), [each.text for each in one.findall("element")]
        if kind in ENUMERATIONS and default is not None and default not in elements:
            found.append(f"{place}: the default {default} is none of {elements}")
        if kind == "boolean" and default not in (None, "true", "false"):
            found.append(f"{place}: the default is {default}")
        of_numbers = VECTORS.get(kind, kind)
        values = []
        if of_numbers in NUMBERS and default is not None:
            try:
                values = [NUMBERS[of_numbers](word) for word in (default.split(",") if kind in VECTORS else [default])]
            except ValueError:
                found.append(f"{place}: the default is {default}")
        limits = one.find("constraints")
        if limits is not None:
            if of_numbers not in NUMBERS or [part.tag for part in limits] != ["minimum", "maximum", "step"]:
                found.append(f"{place}: constraints are minimum, maximum and step of numbers")
                continue
            try:
                least, most, step = (NUMBERS[of_numbers](part.text) for part in limits)
            except ValueError:
                found.append(f"{place}: a constraint is no {of_numbers}")
                continue
            if not (least < most and 0 < step <= most - least and all(least <= value <= most for value in values)):
                found.append(f"{place}: {values} is not in [{least}, {most}], or steps of {step} are none in it")
            if any(abs(value / step - round(value / step)) > 1e-5 for value in values):
                found.append(f"{place}: {values} is lost in steps of {step}")
    for tag in ("name", "flag", "longflag", "index"):
        words = [word for word in (one.findtext(tag) for one in everything) if word]
        found.extend(f"{tag} {word} is there twice" for word in set(words) if words.count(word) > 1)
    indices = [int(one.findtext("index")) for one in everything if one.find("index") is not None]
    if indices != list(range(len(indices))):
        found.append(f"indices {indices}")
    several = [i for i, one in enumerate(one for one in everything if one.find("index") is not None) if one.get("multiple") == "true"]
    if several not in ([], [len(indices) - 1]):
        found.append("several words before others without a flag")
    return found


def form(*command):
    done = run(*command, "--xml")
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return ElementTree.fromstring(done.stdout)


def parameters(tree):
    return [parameter for group in tree.findall("parameters") for parameter in group if parameter.tag not in ("label", "description")]


class Slicer(unittest.TestCase):
    def test_every_command_has_a_form(self):
        for command in LEAVES:
            done = run(*command, "--xml")
            self.assertEqual((done.returncode, done.stderr, faults(done.stdout)), (0, "", []), command)
            found = parameters(ElementTree.fromstring(done.stdout))
            listed = set(re.findall(r"^\s+(?:-\w,)?--([a-z-]+)", run(*command, "--help").stdout, re.MULTILINE)) - {"help", "json", "threads"}
            self.assertEqual({flag for flag in (parameter.findtext("longflag") for parameter in found) if flag},
                             {"--" + flag.replace("-", "_") for flag in listed})
            for parameter in found:
                default = parameter.findtext("default")
                if parameter.tag in ("integer", "double", "string-enumeration"):
                    self.assertIsNotNone(default, (command, parameter.findtext("name")))  # a field that is empty would be zero, or the first
                if parameter.tag in ("file", "directory", "image"):
                    written = parameter.findtext("longflag") in ("--output", "--save_poses", "--record", "--screenshot", "--apply") or (
                        command, parameter.findtext("name")) == (["convert"], "output")
                    self.assertEqual(parameter.findtext("channel"), "output" if written else "input", (command, parameter.findtext("name")))

    def test_what_the_model_does_not_take_is_found(self):
        good = run("stitch", "--xml").stdout
        for old, new, told in (("<longflag>--detail_sharpness", "<longflag>--detail-sharpness", "longflag is --detail-sharpness"),
                               ("<index>0", "<longflag>--x</longflag><index>0", "not both"), ("<label>Sharpness</label>", "", "no label"),
                               ("double", "number", "no such type"), ("<channel>input", "<channel>both", "channel is both"),
                               ("<name>sharpness", "<name>1st", "no identifier"), ("<name>sharpness", "<name>method", "there twice"),
                               ("<step>", "<step>1 ", "is no double"), ("<minimum>0<", "<minimum>1e6<", "steps of"), ("<default>32", "<default>32.12345", "is lost in steps"), ("<default>32", "<default>1001", "is not in"),
                               ("<default>membrane", "<default>nothing", "is none of"), ("<title>", "<category>x</category><title>", "category twice"),
                               ("<description>", "<version>1</version><description>", "order"), ('multiple="true"', 'many="true"', "no attribute"),
                               ("<executable>", "<executable><colour/>", "there is no {'colour'}"), ("<index>0", "<index>1", "indices")):
            bad = good.replace(old, new) if old == "double" else good.replace(old, new, 1)
            self.assertIn(told, "\n".join(faults(bad)), old)

    def test_underscores_in_names_of_options(self):
        with tempfile.TemporaryDirectory() as folder:
            written = [pathlib.Path(folder) / name for name in ("hyphens_.mha", "underscores_.mha")]  # only names of options are changed
            for path, words in zip(written, (["--depth-max=30", "--fan-width", "20"], ["--depth_max=30", "--fan_width", "20"])):
                done = run("noise", "--spacing", "2", *words, f"--output={path}")
                self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(written[0].read_bytes(), written[1].read_bytes())

    def test_what_goes_in_and_comes_out_is_a_volume(self):
        kinds = {parameter.findtext("name"): parameter for parameter in parameters(form("stitch"))}
        self.assertEqual(kinds["volume"].tag, "image")
        self.assertEqual(kinds["volume"].get("multiple"), "true")
        self.assertEqual(kinds["output"].tag, "image")
        self.assertEqual(kinds["poses"].tag, "file")
        sharpness = kinds["sharpness"].find("constraints")
        self.assertEqual(sharpness.findtext("minimum"), "0")

    def as_it_came(self, *command):
        words = []
        for parameter in parameters(form(*command)):
            default, flag = parameter.findtext("default"), parameter.findtext("longflag")
            if flag and default and parameter.tag != "boolean":
                words += [flag, default]
        return words

    def test_a_form_that_is_sent_as_it_came_changes_nothing(self):
        # Slicer gives every field that is not empty.
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for i in range(2):
                write_mha(folder / f"{i}.mha", blobs(seed=3 + i), spacing=(1.5, 1.5, 1.5), origin=(4.0 * i, 0, 0))
            for command, inputs in (("stitch", ["0.mha", "1.mha"]), ("embed", ["0.mha"]), ("noise", []), ("convert", ["0.mha", "form.nrrd"])):
                words = self.as_it_came(command)
                outputs = [folder / "plain.nrrd", folder / "form.nrrd"]
                for output, extra in zip(outputs, ([], words)):
                    files = [folder / (output.name if name == "form.nrrd" else name) for name in inputs]
                    target = [] if command == "convert" else ["-o", output]
                    done = run(command, *extra, *target, *files)
                    self.assertEqual(done.returncode, 0, f"{command} {extra}: {done.stderr}")
                self.assertEqual(outputs[0].read_bytes(), outputs[1].read_bytes(), command)
                for output in outputs:
                    output.unlink()

    def test_a_form_that_is_sent_as_it_came_is_not_misused(self):
        """It gets as far as without: to a file that is not there."""
        with tempfile.TemporaryDirectory() as folder:
            missing, out = pathlib.Path(folder) / "missing.mha", pathlib.Path(folder) / "out.json"
            for command, given in ((["align"], [missing, missing, "-o", out]), (["align"], [missing, missing, "-o", out, "--apply", folder + "/moved"]),
                                   (["probe-fit"], [missing]), (["synthesize"], [missing, "-o", folder + "/made"]),
                                   (["calibrate", "hand-eye"], ["--volumes", missing, missing, missing, "--tracker", missing, "-o", out]),
                                   (["calibrate", "surface"], [f"recording:{missing}", "--check", missing])):
                plain, sent = (run(*command, *given, *more) for more in ([], self.as_it_came(*command)))
                self.assertEqual(plain.returncode, 1, plain.stderr)
                self.assertIn(missing.name, plain.stderr)
                self.assertEqual((sent.returncode, sent.stderr), (1, plain.stderr), command)

    def test_nothing_else_has_a_form(self):
        for words in (["--xml"], ["calibrate", "--xml"], ["banana", "--xml"], ["align", "--completion"]):
            self.assertEqual(run(*words).returncode, 2, words)


class Bash(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.script = run("--completion").stdout

    def complete(self, *words, cwd=None):
        quoted = " ".join(f"'{word}'" for word in ("echorama", *words))
        done = subprocess.run(["bash", "-c", f"{self.script}\nCOMP_WORDS=({quoted}) COMP_CWORD={len(words)}\n_echorama\nprintf '%s\\n' \"${{COMPREPLY[@]}}\""],
                              capture_output=True, text=True, cwd=cwd)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_commands_options_and_values(self):
        self.assertEqual(self.complete("s"), ["score", "stitch", "synthesize", "shell"])
        self.assertIn("--version", self.complete("--"))
        self.assertEqual(self.complete("stitch", "--det"), ["--detail-sharpness", "--detail-scale"])
        self.assertEqual(self.complete("stitch", "a.mha", "--met"), ["--method"])
        self.assertIn("membrane", self.complete("stitch", "--method", "m"))
        self.assertEqual(self.complete("calibrate", "p"), ["pivot"])
        self.assertIn("--scale", self.complete("calibrate", "rig", "--s"))
        self.assertEqual(self.complete("calibrate", "hand-eye", "--align", ""), ["rig", "contents"])

    def test_files_and_folders(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "volume.mha").write_text("")
            (pathlib.Path(folder) / "volumes").mkdir()
            self.assertEqual(sorted(self.complete("info", "vol", cwd=folder)), ["volume.mha", "volumes"])
            self.assertEqual(sorted(self.complete("stitch", "--poses", "vol", cwd=folder)), ["volume.mha", "volumes"])
            self.assertEqual(self.complete("phantom", "-o", "vol", cwd=folder), ["volumes"])


class Manual(unittest.TestCase):
    def check(self, page, name, flags):
        self.assertTrue(page.startswith(f".TH {name.upper()} 1 ".replace("-", "\\-")), page[:100])
        self.assertIn(".SH NAME\n" + name.replace("-", "\\-") + " \\- ", page)
        for flag in flags - {"help", "version"}:
            self.assertRegex(page.replace("\\-", "-"), rf"\\fB(-\w, )?--{flag}\\fR", name)
        with tempfile.NamedTemporaryFile("w", suffix=".1") as file:
            file.write(page)
            file.flush()
            if shutil.which("man"):
                told = subprocess.run(["man", "--warnings", "-l", file.name], capture_output=True, text=True, env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "200"})
                self.assertEqual((told.returncode, told.stderr), (0, ""), name)
                for flag in flags - {"help", "version"}:
                    self.assertIn("--" + flag, told.stdout, name)
            if shutil.which("mandoc"):
                told = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", file.name], capture_output=True, text=True).stdout
                self.assertEqual([line for line in told.splitlines() if "missing date" not in line], [], name)  # what is built twice is the same

    def test_pages(self):
        for words in ([], *([name] for name in COMMANDS)):
            done = run(*words, "--man")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            flags = set(re.findall(r"^\s+(?:-\w,)?--([a-z-]+)", run(*words, "--help").stdout, re.MULTILINE))
            self.check(done.stdout, "-".join(["echorama", *words]), flags if words and words != ["calibrate"] else set())

    def test_pages_of_other_programs(self):
        for name in ("echorama-workbench", "echorama-simulator", "echorama-leds"):
            program = [PROGRAM.parent / name]
            page = subprocess.run([*program, "--man"], capture_output=True, text=True, env={key: value for key, value in os.environ.items() if key != "DISPLAY"})
            self.assertEqual((page.returncode, page.stderr), (0, ""), name)  # without a screen
            told = subprocess.run([*program, "--help"], capture_output=True, text=True, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
            self.assertEqual(told.returncode, 0, name)
            flags = set(re.findall(r"^\s+(?:-\w, ?)*--([a-z-]+)", told.stdout, re.MULTILINE)) - {"help-all"}
            self.assertGreater(len(flags), 2, told.stdout)
            self.check(page.stdout, name, flags)
            for line in re.findall(r"^  (?:VOLUME|FILE) +(.*)$", told.stdout, re.MULTILINE):
                self.assertIn(line[:30], page.stdout, name)


class Desktop(unittest.TestCase):
    def test_what_desktops_are_told(self):
        types = {each.get("type") for each in ElementTree.parse(DESKTOP / "echorama.xml").getroot()}
        version = run("--version").stdout.split()[1]
        about = ElementTree.parse(DESKTOP / "org.echorama.Workbench.metainfo.xml")
        self.assertEqual(about.find("releases/release").get("version"), version)
        for name in ("Workbench", "Simulator"):
            text = (DESKTOP / f"org.echorama.{name}.desktop").read_text()
            wanted = set(re.search(r"^MimeType=(.*);$", text, re.MULTILINE)[1].split(";"))
            self.assertLessEqual(wanted - {"application/dicom"}, types)
            self.assertTrue((PROGRAM.parent / re.search(r"^Exec=(\S+)", text, re.MULTILINE)[1]).exists())
        ElementTree.parse(DESKTOP / "echorama.svg")


if __name__ == "__main__":
    unittest.main()
