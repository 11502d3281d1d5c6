# SPDX-License-Identifier: BSD-3-Clause
"""What run_tests.py counts, on small trees of pretended tests: nothing that did not run, or ended badly, passes or is skipped."""
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import unittest

HERE = pathlib.Path(__file__).resolve().parent

# Behaves as a GoogleTest program of four tests does: lists, filters and shards them, and writes its report when it is done.
GTEST = """\
#!/usr/bin/python3
import fnmatch, os, sys
names = ["Suite.One", "Suite.Two", "Suite.Three", "Suite.Skipped"]
if "--gtest_list_tests" in sys.argv:
    print("Running main() from somewhere\\nSuite.\\n" + "\\n".join("  " + name[6:] + "  # GetParam() = 1" for name in names))
    sys.exit()
wanted = os.environ.get("GTEST_FILTER", "*").split(":")
names = [name for name in names if any(fnmatch.fnmatchcase(name, each) for each in wanted)]
names = names[int(os.environ["GTEST_SHARD_INDEX"])::int(os.environ["GTEST_TOTAL_SHARDS"])]
report = ""
for name in names:
    BODY
    inside = '<skipped message="x.cxx:1&#x0A;on purpose"/>' if name.endswith("Skipped") else ""
    report += f'<testcase classname="Suite" name="{name[6:]}" status="run">{inside}</testcase>'
with open(os.environ["GTEST_OUTPUT"][4:], "w") as file:
    file.write(f"<testsuites><testsuite>{report}</testsuite></testsuites>")
"""


class Counting(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tree = pathlib.Path(self.folder.name) / "fake"
        (self.tree / "Testing" / "reports").mkdir(parents=True)
        self.lines, self.skips = [], ["fake  *.Skipped*  always  on purpose"]

    def program(self, name, text):
        path = self.tree / name
        path.write_text(textwrap.dedent(text))
        path.chmod(0o755)
        return path

    def add(self, name, *command, **properties):
        quoted = " ".join(f'"{part}"' for part in command)
        given = " ".join(f'{key} "{value}"' for key, value in {"TIMEOUT": 60, **properties}.items())
        self.lines += [f'add_test("{name}" {quoted})', f'set_tests_properties("{name}" PROPERTIES {given})']

    def add_gtest(self, body="pass", shards=2, text=None):
        program = self.program("FakeTests", text or GTEST.replace("BODY", body))
        for shard in range(1, shards + 1):
            report = self.tree / "Testing" / "reports" / f"Fake.shard{shard}.xml"
            self.add(f"Fake.shard{shard}", program, LABELS="kernel;reports",
                     ENVIRONMENT=f"GTEST_TOTAL_SHARDS={shards};GTEST_SHARD_INDEX={shard - 1};GTEST_OUTPUT=xml:{report}")
        return program

    def add_python(self, text, name="Python.Test"):
        file = self.program(f"{name}.py", text)
        self.add(name, "/usr/bin/python3", HERE / "python_test.py", self.tree / "Testing" / "reports" / f"{name}.xml", file,
                 LABELS="python;reports", SKIP_RETURN_CODE=77)

    def add_qt(self, events, status=0):
        report = self.tree / "Testing" / "reports" / "Window.Test.xml"
        text = f"<TestCase><TestFunction name='initTestCase'><Incident type='pass'/></TestFunction>{events}"
        self.add("Window.Test", self.program("window", f"#!/bin/sh\ncat >'{report}' <<'END'\n{text}\nEND\nexit {status}\n"), LABELS="window;reports")

    def run_tests(self, *arguments):
        (self.tree / "CTestTestfile.cmake").write_text("\n".join(self.lines) + "\n")
        (self.tree / "skips.txt").write_text("# comment\n\n" + "\n".join(self.skips) + "\n")
        done = subprocess.run([sys.executable, HERE / "run_tests.py", self.tree, "-j", "2", "--skips", self.tree / "skips.txt",
                               "--counts", self.tree / "counts", *arguments], capture_output=True, text=True)
        counts = tuple(map(int, (self.tree / "counts").read_text().split()))
        last = done.stdout.splitlines()[-1]
        self.assertEqual(last, "fake: {} passed, {} failed, {} skipped".format(*counts), done.stdout + done.stderr)
        self.assertEqual(done.returncode != 0, counts[1] > 0)
        self.said = done.stdout + done.stderr
        return counts

    def expect(self, counts, *words, arguments=()):
        self.assertEqual(self.run_tests(*arguments), counts, self.said)
        for word in words:
            self.assertIn(word, self.said)

    # -------------------------------------------------------------------------------------------------------- what passes

    def test_every_kind_is_counted_by_its_single_tests(self):
        self.add("Plain", "/bin/true")
        self.add_gtest()
        self.add_python("import unittest\nclass A(unittest.TestCase):\n  def test_a(self): pass\n  def test_b(self): pass\nunittest.main()")
        self.add_python("print('fine')", name="Python.Script")
        self.add_qt("<TestFunction name='a'><Incident type='pass'/></TestFunction><TestFunction name='b'>"
                    "<Incident type='xfail'/><Incident type='pass'><DataTag>1</DataTag></Incident></TestFunction></TestCase>")
        self.expect((1 + 3 + 2 + 1 + 3, 0, 1), "Fake.Suite.Skipped: x.cxx:1 on purpose")

    def test_single_tests_are_found_by_name(self):
        self.add("Plain", "/bin/false")
        self.add_gtest(shards=3)
        self.expect((1, 0, 0), arguments=("-R", "Suite.One"))
        self.expect((2, 0, 0), arguments=("-R", r"^Fake\.Suite\.T"))
        self.expect((0, 1, 0), "Plain", arguments=("-R", "Plain"))
        self.expect((0, 0, 0), arguments=("-R", "NoSuchTest"))
        self.expect((3, 0, 1), arguments=("-R", "Fake"))

    def test_labels_are_left_out(self):
        self.add("Plain", "/bin/true")
        self.add("Slow", "/bin/false", LABELS="slow")
        self.expect((1, 0, 0), arguments=("--without", "slow"))

    def test_each_python_test_has_a_folder_of_its_own(self):
        text = "import pathlib, tempfile\nhere = pathlib.Path('mine')\nassert not here.exists()\nhere.write_text('')\n" \
               "assert pathlib.Path(tempfile.gettempdir()) == pathlib.Path.cwd()\n"
        self.add_python(text)
        self.add_python(text, name="Python.Other")
        self.expect((2, 0, 0))

    # ---------------------------------------------------------------------------------------------------- what is tried again

    def add_unsteady(self, name, later, label="window"):
        """A test that fails at first, and does what the shell command says later."""
        report, mark = self.tree / "Testing" / "reports" / f"{name}.xml", self.tree / f"{name}.ran"
        told = "<TestCase><TestFunction name='initTestCase'><Incident type='pass'/></TestFunction><TestFunction name='a'>" \
               "<Incident type='{}'/></TestFunction></TestCase>"
        self.add(name, self.program(f"program of {name}", f"""\
            #!/bin/sh
            if [ -e '{mark}' ]; then {later.format(f'echo "{told.format("pass")}" >"{report}"')}; fi
            touch '{mark}'
            echo "{told.format("fail")}" >'{report}'
            exit 1
            """), LABELS=f"{label};reports")

    def test_a_window_that_fails_is_tried_again_by_itself(self):
        self.add("Plain", "/bin/true")
        self.add_unsteady("Window.Late", "{}; exit 0")
        self.add_unsteady("Device.Late", "{}; exit 0", label="live")
        self.expect((3, 0, 0), "once more, by themselves: Window.Late, Device.Late", "passed by themselves only: Window.Late, Device.Late")

    def test_what_fails_twice_has_failed(self):
        self.add_unsteady("Window.Late", "{}; exit 0")
        self.add_unsteady("Window.Wrong", "false")
        self.add_unsteady("Window.Dies", "exit 3")  # without a report: that of the first try does not count
        self.expect((1, 2, 0), "Window.Wrong.a", "Window.Dies: it left no report")
        self.assertNotIn("only: Window.Wrong", self.said)

    def test_nothing_else_is_tried_again(self):
        self.add_unsteady("Python.Late", "{}; exit 0", label="python")
        self.expect((0, 1, 0))
        self.assertNotIn("once more", self.said)

    def test_many_windows_that_fail_are_not_tried_again(self):
        for i in range(6):
            self.add_unsteady(f"Window.Late{i}", "{}; exit 0")
        self.expect((0, 6, 0))

    # ------------------------------------------------------------------------------------------------- what does not run

    def test_a_missing_executable_fails(self):
        self.add("Plain", "/bin/true")
        self.add("Gone", self.tree / "no such program", SKIP_RETURN_CODE=77)
        self.expect((1, 1, 0), "Gone: ")

    def test_a_missing_gtest_program_fails(self):
        self.add_gtest().unlink()
        self.expect((0, 3, 0), "Fake.shard1: it left no report", "its test program is not there")
        self.expect((0, 1, 0), "its test program is not there", arguments=("-R", "Suite.One"))

    def test_a_tree_without_tests_fails(self):
        self.expect((0, 1, 0), "there are no tests")
        self.add("Slow", "/bin/true", LABELS="slow")
        self.expect((0, 1, 0), "there are no tests", arguments=("--without", "slow"))

    def test_no_tree_fails(self):
        done = subprocess.run([sys.executable, HERE / "run_tests.py", self.tree / "none"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("none: 0 passed, 1 failed, 0 skipped", done.stdout)

    def test_programs_without_tests_fail(self):
        self.add_python("import unittest\nunittest.main()")
        self.add_gtest(text=GTEST.replace('["Suite.One", "Suite.Two", "Suite.Three", "Suite.Skipped"]', "[]"), shards=1)
        self.expect((0, 2, 0), "Python.Test: it has no tests", "Fake.shard1: it has no tests")

    def test_a_test_whose_needs_fail_does_not_run(self):
        self.add("First", "/bin/false", FIXTURES_SETUP="it")
        self.add("Second", "/bin/true", FIXTURES_REQUIRED="it")
        self.expect((0, 2, 0), "Second: ")

    # ------------------------------------------------------------------------------------------------------ what ends badly

    def test_saying_skipped_does_not_help(self):
        self.add("Plain", self.program("plain", "#!/bin/sh\necho 'skipped: [  SKIPPED ]'\nexit 1\n"), SKIP_RETURN_CODE=77)
        self.add_python("import sys\nprint('skipped')\nsys.exit(1)")
        self.expect((0, 2, 0), "Plain: it ended badly", "skipped: [  SKIPPED ]", "Python.Test: exit status 1")

    def test_a_crash_at_start_fails(self):
        self.add("Plain", self.program("plain", "#!/bin/sh\nkill -SEGV $$\n"))
        self.add_gtest(text="#!/bin/sh\nkill -SEGV $$\n")
        self.add_python("import os\nos.kill(os.getpid(), 11)")
        self.expect((0, 1 + 3 + 1, 0))

    def test_a_gtest_program_that_dies_in_its_middle_fails(self):
        self.add_gtest("if name.endswith('Two'): os.kill(os.getpid(), 11)")
        # Two and Skipped are one shard: neither has run.
        self.expect((2, 3, 0), "Fake.shard2: it left no report", "Fake.Suite.Two: it did not run", "Fake.Suite.Skipped: it did not run")

    def test_a_gtest_program_that_leaves_in_its_middle_fails(self):
        self.add_gtest("if name.endswith('Two'): sys.exit(0)")
        self.expect((2, 3, 0), "Fake.Suite.Two: it did not run")

    def test_a_gtest_program_that_forgets_a_test_fails(self):
        self.add_gtest("if name.endswith('Two'): continue")
        self.expect((2, 1, 1), "Fake.Suite.Two: it did not run")

    def test_a_gtest_program_that_dies_at_its_end_fails(self):
        self.add_gtest(text=GTEST.replace("BODY", "pass") + "os.kill(os.getpid(), 11)\n")
        self.expect((3, 2, 1), "no test of it failed, but the program did")

    def test_an_old_report_is_no_report(self):
        program = self.add_gtest()
        self.run_tests()
        program.write_text("#!/bin/sh\nexit 0\n")
        self.expect((0, 2, 0), "it left no report")

    def test_a_python_test_that_dies_fails(self):
        self.add_python("import os, unittest\nclass A(unittest.TestCase):\n  def test_a(self): os._exit(0)\nunittest.main()")
        self.expect((0, 1, 0), "it left no report")

    def test_failures_inside_programs(self):
        self.add_python("""
            import unittest
            class A(unittest.TestCase):
                def test_fails(self): self.fail("with \\x01 a control character")
                def test_breaks(self): raise OSError("broken")
                def test_passes(self): pass
                def test_parts(self):
                    for part in range(3):
                        with self.subTest(part): self.assertEqual(part, 1)
                @unittest.expectedFailure
                def test_surprise(self): pass
            class B(unittest.TestCase):
                @classmethod
                def setUpClass(cls): raise OSError("at the start")
                def test_never(self): pass
            unittest.main()""")
        self.add_python("assert False, 'wrong'", name="Python.Script")
        self.add_qt("<TestFunction name='a'><Incident type='fail'><Description>bad</Description></Incident></TestFunction>"
                    "<TestFunction name='b'/><TestFunction name='c'><Incident type='xpass'/></TestFunction></TestCase>", status=3)
        self.expect((1, 5 + 1 + 3, 0), "Window.Test.a: bad", "Window.Test.b: it did not end", "A.test_parts", "setUpClass", "Python.Script: AssertionError('wrong')")

    def test_a_window_test_that_dies_fails(self):
        self.add_qt("<TestFunction name='a'><Incident type='pass'/>")
        self.expect((0, 1, 0), "it left no report")

    def test_a_timeout_fails(self):
        self.add("Slow", "/bin/sleep", "60", TIMEOUT=1)
        self.add_gtest("import time; time.sleep(0 if name.endswith('One') else 60)", shards=4)
        self.lines.append('set_tests_properties("Fake.shard2" "Fake.shard3" "Fake.shard4" PROPERTIES TIMEOUT 1)')
        self.expect((1, 1 + 3 + 3, 0), "Slow: it ended badly", "Timeout", "Fake.Suite.Three: it did not run")

    # ---------------------------------------------------------------------------------------------------------------- skips

    def test_unexpected_skips_fail(self):
        self.add("Plain", self.program("plain", "#!/bin/sh\nexit 77\n"), SKIP_RETURN_CODE=77)
        self.add_python("import sys\nsys.exit(77)")
        self.add_python("import unittest\nclass A(unittest.TestCase):\n  @unittest.skip('lazy')\n  def test_a(self): pass\nunittest.main()", name="Python.Unit")
        self.add_qt("<TestFunction name='a'><Message type='skip'><Description>lazy</Description></Message></TestFunction></TestCase>")
        self.skips = []
        self.add_gtest(shards=1)
        self.expect((3, 5, 0), "Python.Test: skipped, and that is not expected: it does not say why", "A.test_a: skipped, and that is not expected: lazy",
                    "Window.Test.a: skipped", "Plain: skipped", "Fake.Suite.Skipped: skipped")

    def test_skips_are_expected_by_name_and_reason(self):
        self.add_python("import sys\nprint('skipped: no such data')\nsys.exit(77)")
        self.skips = ["*  Python.*  always  no such data"]
        self.expect((0, 0, 1))
        for line in ("other  Python.*  always  no such data", "*  Window.*  always  no such data", "*  *  always  no real data"):
            self.skips = [line]
            self.expect((0, 1, 0), "not expected")

    def test_data_that_are_there_excuse_nothing(self):
        self.add_python("import sys\nprint('skipped: no real data')\nsys.exit(77)")
        self.skips = ["*  *  no-data  no real data"]
        self.expect((0, 1, 0), "not expected", arguments=("--data", str(self.tree)))
        self.expect((0, 0, 1), arguments=("--data", str(self.tree / "none")))

    def test_a_disabled_test_is_a_skip(self):
        self.add("Plain", "/bin/true", DISABLED="ON")
        self.expect((0, 1, 0), "Plain: ")


class Repository(unittest.TestCase):
    def test_the_list_of_expected_skips_can_be_read(self):
        for line in (HERE / "expected_skips.txt").read_text().splitlines():
            if line and not line.startswith("#"):
                self.assertRegex(line, r"^(\*|release|sanitize|paraview) +\S+ +(always|no-data|root|not-bookworm) +\S")

    def test_nothing_passes_by_its_words(self):
        paths = [path for path in [*HERE.parent.rglob("CMakeLists.txt"), *(HERE.parent / "CMake").glob("*.cmake")]
                 if "build" not in path.relative_to(HERE.parent).parts]
        self.assertGreater(len(paths), 10)
        for path in paths:
            self.assertNotRegex(path.read_text(), "(SKIP|PASS)_REGULAR_EXPRESSION|WILL_FAIL", path)
        self.assertFalse(re.search(r"ctest [^\n]*\|\| true", (HERE.parent / "run").read_text()))


if __name__ == "__main__":
    unittest.main()
