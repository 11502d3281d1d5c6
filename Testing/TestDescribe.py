#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the program says of itself for others: forms for 3D Slicer, completion for bash, manual pages; and what desktops are told."""
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
# Elements of Slicer's Execution Model, and what may be in a parameter.
TYPES = {"integer", "double", "boolean", "string", "double-vector", "string-enumeration", "file", "directory", "image"}
PARTS = {"name", "label", "description", "longflag", "index", "default", "element", "constraints", "channel"}


def form(*command):
    done = run(*command, "--xml")
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return ElementTree.fromstring(done.stdout)


def parameters(tree):
    return [parameter for group in tree.findall("parameters") for parameter in group if parameter.tag not in ("label", "description")]


class Slicer(unittest.TestCase):
    def test_every_command_has_a_form(self):
        for command in LEAVES:
            tree = form(*command)
            self.assertEqual([part.tag for part in tree if part.tag != "parameters"],
                             ["category", "title", "description", "version", "license", "contributor"])
            found = parameters(tree)
            names = [parameter.findtext("name") for parameter in found]
            self.assertEqual(len(names), len(set(names)), command)
            listed = set(re.findall(r"^\s+(?:-\w,)?--([a-z-]+)", run(*command, "--help").stdout, re.MULTILINE)) - {"help", "json", "threads"}
            self.assertEqual({flag for flag in (parameter.findtext("longflag") for parameter in found) if flag}, {"--" + flag for flag in listed})
            indices = [int(parameter.findtext("index")) for parameter in found if parameter.find("index") is not None]
            self.assertEqual(indices, list(range(len(indices))), command)
            for parameter in found:
                self.assertIn(parameter.tag, TYPES, command)
                self.assertLessEqual({part.tag for part in parameter}, PARTS)
                self.assertRegex(parameter.findtext("name"), r"^[a-z][a-z_]*$")
                self.assertTrue(parameter.findtext("description"))
                default = parameter.findtext("default")
                if parameter.tag in ("integer", "double"):
                    float(default)  # a field that is empty would be zero
                if parameter.tag == "string-enumeration":
                    self.assertIn(default, [element.text for element in parameter.findall("element")], command)
                if parameter.tag in ("file", "directory", "image"):
                    written = parameter.findtext("longflag") in ("--output", "--save-poses", "--record", "--screenshot", "--apply") or (
                        command, parameter.findtext("name")) == (["convert"], "output")
                    self.assertEqual(parameter.findtext("channel"), "output" if written else "input", (command, parameter.findtext("name")))

    def test_what_goes_in_and_comes_out_is_a_volume(self):
        kinds = {parameter.findtext("name"): parameter for parameter in parameters(form("stitch"))}
        self.assertEqual(kinds["volume"].tag, "image")
        self.assertEqual(kinds["volume"].get("multiple"), "true")
        self.assertEqual(kinds["output"].tag, "image")
        self.assertEqual(kinds["poses"].tag, "file")
        sharpness = kinds["sharpness"].find("constraints")
        self.assertEqual(sharpness.findtext("minimum"), "0")

    def test_a_form_that_is_sent_as_it_came_changes_nothing(self):
        # Slicer gives every field that is not empty.
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for i in range(2):
                write_mha(folder / f"{i}.mha", blobs(seed=3 + i), spacing=(1.5, 1.5, 1.5), origin=(4.0 * i, 0, 0))
            for command, inputs in (("stitch", ["0.mha", "1.mha"]), ("embed", ["0.mha"]), ("noise", []), ("convert", ["0.mha", "form.nrrd"])):
                words = []
                for parameter in parameters(form(command)):
                    default, flag = parameter.findtext("default"), parameter.findtext("longflag")
                    if flag and default and parameter.tag != "boolean":
                        words += [flag, default]
                outputs = [folder / "plain.nrrd", folder / "form.nrrd"]
                for output, extra in zip(outputs, ([], words)):
                    files = [folder / (output.name if name == "form.nrrd" else name) for name in inputs]
                    target = [] if command == "convert" else ["-o", output]
                    done = run(command, *extra, *target, *files)
                    self.assertEqual(done.returncode, 0, f"{command} {extra}: {done.stderr}")
                self.assertEqual(outputs[0].read_bytes(), outputs[1].read_bytes(), command)
                for output in outputs:
                    output.unlink()

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
    def test_pages(self):
        for words in ([], *([name] for name in COMMANDS)):
            done = run(*words, "--man")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            page = done.stdout
            self.assertIn(".SH NAME\n" + "\\-".join(["echorama", *words[:1]]).replace("e-f", "e\\-f"), page)
            flags = set(re.findall(r"--([a-z-]+)", re.sub(r"\[.*?\]", "", run(*words, "--help").stdout)))
            for flag in flags - {"help", "version"} if words and words != ["calibrate"] else []:
                self.assertIn("--" + flag, page.replace("\\-", "-"), words)
            if shutil.which("groff"):
                told = subprocess.run(["groff", "-man", "-ww", "-z", "-Tutf8"], input=page, capture_output=True, text=True).stderr
                self.assertEqual(told, "", words)


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
