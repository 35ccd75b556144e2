#!/usr/bin/python3
"""launch.schema.json has the keys that `mimesis launch` reads; shipped files keep to it, wrong ones do not.

usage: launch_schema_test.py BIN
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

try:
    import jsonschema
    import yaml
except ImportError:
    jsonschema = None

ROOT = pathlib.Path(__file__).resolve().parents[4]
BIN = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 else ROOT / "build" / "bin"
SCHEMA = json.loads((ROOT / "tools/mimesis/launch/launch.schema.json").read_text())
NODES = "nodes: {a: {exec: x}}\n"
# Definition of the schema: a file with an unknown key of that section.
SECTIONS = {
    "": NODES + "qqqqqqqqqqqq: 1\n",
    "defaults": NODES + "defaults: {qqqqqqqqqqqq: 1}\n",
    "arg": NODES + "args: {b: {default: 1, qqqqqqqqqqqq: 1}}\n",
    "host": NODES + "hosts: {h: {address: here, qqqqqqqqqqqq: 1}}\n",
    "include": NODES + "include: [{file: b.yaml, qqqqqqqqqqqq: 1}]\n",
    "group": "groups: {g: {nodes: {a: {exec: x}}, qqqqqqqqqqqq: 1}}\n",
    "node": "nodes: {a: {exec: x, qqqqqqqqqqqq: 1}}\n",
    "restart": "nodes: {a: {exec: x, restart: {qqqqqqqqqqqq: 1}}}\n",
    "stop": "nodes: {a: {exec: x, stop: {qqqqqqqqqqqq: 1}}}\n",
    "sched": "nodes: {a: {exec: x, sched: {qqqqqqqqqqqq: 1}}}\n",
    "ready": "nodes: {a: {exec: x, ready: {qqqqqqqqqqqq: 1}}}\n",
    "result": NODES + "result: {until: a/b, qqqqqqqqqqqq: 1}\n",
    "field": NODES + "result: {until: a/b, fields: {f: {from: a/b.c, qqqqqqqqqqqq: 1}}}\n",
}
WRONG = {
    "no version": NODES,
    "no nodes": "version: 1\n",
    "unknown key": "version: 1\nndoes: {}\n" + NODES,
    "another version": "version: 2\n" + NODES,
    "clock": "version: 1\nclock: lokstep\n" + NODES,
    "no program": "version: 1\nnodes: {a: {required: true}}\n",
    "key of a node": "version: 1\nnodes: {a: {exec: x, requierd: true}}\n",
    "flag": "version: 1\nnodes: {a: {exec: x, required: perhaps}}\n",
    "time without unit": "version: 1\nnodes: {a: {exec: x, hung_after: 5}}\n",
    "priority": "version: 1\nnodes: {a: {exec: x, sched: {policy: fifo, priority: 100}}}\n",
    "signal": "version: 1\nnodes: {a: {exec: x, stop: {signal: KILL}}}\n",
    "restart": "version: 1\nnodes: {a: {exec: x, restart: always}}\n",
    "after as text": "version: 1\nnodes: {a: {exec: x, after: b}}\n",
    "name of a node": "version: 1\nnodes: {a/b: {exec: x}}\n",
    "two names of for": "version: 1\nnodes: {'a${arg:i}': {exec: x, for: {i: [1], k: [2]}}}\n",
    "for as a list": "version: 1\nnodes: {'a${arg:i}': {exec: x, for: [1, 2]}}\n",
    "include without file": "version: 1\ninclude: [{namespace: a}]\n",
    "include as a map": "version: 1\ninclude: {file: a.yaml}\n",
    "group without nodes": "version: 1\ngroups: {g: {host: h}}\n",
    "host without address": "version: 1\nhosts: {h: {user: me}}\n" + NODES,
    "type of an argument": "version: 1\nargs: {n: {type: integer}}\n" + NODES,
    "result without until": "version: 1\nresult: {timeout: 1s}\n" + NODES,
    "field of the result": "version: 1\nresult: {until: a/b, fields: {f: a/b}}\n" + NODES,
}


def properties(name):
    section = SCHEMA["properties"]["defaults"] if name == "defaults" else SCHEMA["definitions"][name] if name else SCHEMA
    if "properties" not in section:  # a word, or a map
        section = next(s for s in section["anyOf"] if "properties" in s)
    return section["properties"]


class LaunchSchema(unittest.TestCase):
    def test_has_the_keys_that_are_read(self):
        self.assertLessEqual(set(SCHEMA["definitions"]) - {"variable", "text", "flag", "duration"}, set(SECTIONS))
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "a.yaml")
            pathlib.Path(folder, "b.yaml").write_text("version: 1\nnodes: {b: {exec: x}}\n")
            for name, text in SECTIONS.items():
                file.write_text("version: 1\n" + text)
                run = subprocess.run([BIN / "mimesis", "launch", file, "--check"], capture_output=True, text=True, check=False)
                read = re.search("unknown key 'qqqqqqqqqqqq', expected one of (.*)", run.stderr)
                self.assertIsNotNone(read, run.stderr)
                self.assertEqual(sorted(read.group(1).split(", ")), sorted(properties(name)), name or "the file")

    def test_is_what_launch_prints(self):
        run = subprocess.run([BIN / "mimesis", "launch", "--schema"], capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(run.stdout), SCHEMA)

    @unittest.skipIf(jsonschema is None, "no python3-jsonschema, python3-yaml")
    def test_shipped_files_keep_to_it(self):
        jsonschema.Draft7Validator.check_schema(SCHEMA)
        validator = jsonschema.Draft7Validator(SCHEMA)
        files = [*(ROOT / "launch").glob("*.yaml"), *(ROOT / "launch/parts").glob("*.yaml"), *(ROOT / "docs").rglob("examples/*/*.yaml")]
        self.assertGreater(len(files), 12)
        for file in files:
            wrong = [f"{'.'.join(map(str, e.absolute_path))}: {e.message}" for e in validator.iter_errors(yaml.safe_load(file.read_text()))]
            self.assertEqual(wrong, [], file)

    @unittest.skipIf(jsonschema is None, "no python3-jsonschema, python3-yaml")
    def test_refuses_wrong_files(self):
        validator = jsonschema.Draft7Validator(SCHEMA)
        self.assertEqual([name for name, text in WRONG.items() if validator.is_valid(yaml.safe_load(text))], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
