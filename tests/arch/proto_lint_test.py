#!/usr/bin/python3
"""tools/proto_lint finds each kind of mistake in a broken example, and none in proto/."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
README = "## Units\nClosed:\n\n`_m` `_s` `_ns` `_rad`\n"
GOOD = """// What the test looks at.
syntax = "proto3";
package mimesis.v1;

// How it goes.
enum TaskState {
  TASK_STATE_UNSPECIFIED = 0;
  TASK_STATE_DONE = 1;
}

// A point.
message Vector3 {
  double x_m = 1;
}

// All of it.
message Thing {
  Header header = 1;
  reserved 2, 4 to 5;
  Vector3 place_m = 3;
  repeated double gain = 6;  // [1]
  uint64 stamp_ns = 7;
  TaskState state = 8;
}
"""


def lint(text, name="thing.proto"):
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "README.md").write_text(README)
        pathlib.Path(folder, name).write_text(text)
        run = subprocess.run([ROOT / "tools/proto_lint", folder], capture_output=True, text=True, check=False)
        return run.returncode, run.stdout.replace(folder + "/", "")


class ProtoLint(unittest.TestCase):
    def expect(self, old, new, finding):
        """GOOD with `old` replaced by `new` has exactly one mistake."""
        self.assertIn(old, GOOD)
        code, out = lint(GOOD.replace(old, new, 1))
        self.assertEqual(code, 1, out)
        self.assertEqual(len(out.splitlines()), 1, out)
        self.assertIn(finding, out)

    def test_our_messages_have_no_mistakes(self):
        run = subprocess.run([ROOT / "tools/proto_lint"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stdout)

    def test_a_good_example_has_none(self):
        self.assertEqual(lint(GOOD)[0], 0, lint(GOOD)[1])

    def test_units(self):
        self.expect("x_m", "x", "thing.proto:13: field x has no unit")
        self.expect("x_m", "x_kg", "field x_kg has no unit")  # not in this list
        self.expect(" = 6;  // [1]", " = 6;", "field gain has no unit")
        self.expect("place_m", "place", "vector place has no unit")
        self.expect("uint64 stamp_ns", "uint64 stamp", "integer time stamp is not in _ns")
        self.expect("uint64 stamp_ns", "int32 delay_ms", "unit of field delay_ms")

    def test_names(self):
        self.expect("double x_m", "double xPos_m", "field xPos_m is not snake_case")
        self.expect("message Thing", "message thing_two", "message thing_two is not UpperCamel")
        self.expect("TASK_STATE_DONE", "DONE", "does not begin with TASK_STATE_")
        self.expect("TASK_STATE_UNSPECIFIED", "TASK_STATE_IDLE", "expected TASK_STATE_UNSPECIFIED")
        self.assertIn("file name Thing.proto is not snake_case", lint(GOOD, "Thing.proto")[1])

    def test_headers(self):
        self.expect("  Header header = 1;\n  reserved 2,", "  reserved 1, 2,", "Thing: field 1 of a topic message")
        self.expect("Header header = 1;\n  reserved 2,", "Header header = 2;\n  reserved 1,", "the header is not")
        no_topic = GOOD.replace("  Header header = 1;\n  reserved 2,", "  reserved 1, 2,")
        self.assertEqual(lint(no_topic.replace("All of it.", "Not a topic."))[0], 0)

    def test_numbers(self):
        self.expect("reserved 2, 4 to 5", "reserved 2, 4", "number 5 is neither used nor reserved")
        self.expect("reserved 2, 4 to 5", "reserved 2 to 5", "number 3 is reserved")

    def test_comments_and_package(self):
        self.expect("// All of it.\n", "", "message Thing has no comment")
        self.expect("// How it goes.\n", "", "enum TaskState has no comment")
        self.expect("// What the test looks at.\n", "", "the first line is not a comment")
        self.expect("package mimesis.v1;", "package mimesis.v2;", "package is not mimesis.v1")


if __name__ == "__main__":
    sys.exit(unittest.main())
