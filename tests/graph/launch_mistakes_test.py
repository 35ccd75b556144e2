#!/usr/bin/python3
"""`mimesis launch --check` sees every mistake of the table at its place, and none in the shipped files.

usage: launch_mistakes_test.py BIN
"""
import concurrent.futures
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import launch_mistakes as table

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 else ROOT / "build" / "bin"
# Documented arguments of the shipped files, one set after the other.
CLEAN = {
    "biped_two.yaml": [("sim=true",), ("head=localhost", "spine=localhost")],
    "crowd_four_hosts.yaml": [("sim=true",), tuple(f"h{n}=localhost" for n in (1, 2, 3, 4))],
    "robot.yaml": [("sim=true",), ("vision=localhost", "arm=localhost")],
    "biped.yaml": [(), ("plant=servo",), ("style=brisk", "x=1.5"), ("push_y=7",), ("whole=false",), ("clock=wall",)],
    "crowd.yaml": [(), ("characters=true", "scenario=characters"), ("clock=sim",)]
    + [(f"scenario={p.stem}",) for p in sorted((ROOT / "launch/crowd").glob("*.yaml"))],
    "crowd_biped.yaml": [(), ("plant=servo",)],
    "drawer.yaml": [(), ("plant=servo",)],
    "fleet.yaml": [(), ("clock=wall",)],
    "imitation.yaml": [(), ("teacher=full,below,low",), ("clock=wall",), ("clock=sim",)],
    "replay.yaml": [("log=imitation.mcap",)],
    "walk.yaml": [(), ("style=brisk", "x=-2", "y=3"), ("kind=drawer", "drawer=true", "x=4", "y=0")],
}


def check(file, options=()):
    """Exit code and mistakes."""
    run = subprocess.run([BIN / "mimesis", "launch", file, "--check", "--json", *options], capture_output=True, text=True,
                         cwd=ROOT, check=False, timeout=120)
    return run.returncode, json.loads(run.stdout) if run.stdout else run.stderr


def fault(mistake, folder):
    """Why the mistake counts as not found; empty if it was."""
    text = (ROOT / "launch" / mistake.file).read_text()
    if mistake.old not in text:
        return f"{mistake.file} has no {mistake.old!r}"
    text = text.replace(mistake.old, mistake.new, 1)
    before, mark, after = text.partition("«")
    place = (before.count("\n") + 1, len(before) - before.rfind("\n")) if mark else (None, None)
    copy = pathlib.Path(folder, mistake.name.replace(" ", "_"))
    shutil.copytree(ROOT / "launch", copy)
    file = copy / mistake.file
    file.write_text(before + after)
    code, found = check(copy / (mistake.main or mistake.file), mistake.options)
    if code != 2 or not isinstance(found, list):
        return f"exit code {code}: {found}"
    said = [m for m in found if mistake.says in m["message"]]
    if not said:
        return f"not said: {found}"
    if len(found) > 4:
        return f"{len(found)} lines: {found}"
    m = said[0]
    if m["severity"] != "error" or m["suggestion"] != mistake.suggests:
        return f"suggested {m['suggestion']!r}: {m}"
    if mistake.at == "mark" and (m["file"] != str(file) or (m["line"], m["column"]) != place):
        return f"expected at {place}: {m}"
    return ""


def faults(mistakes):
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(3) as pool:
        return {m.name: why for m, why in zip(mistakes, pool.map(lambda m: fault(m, folder), mistakes)) if why}


class LaunchMistakes(unittest.TestCase):
    maxDiff = None

    def test_first(self):
        self.assertEqual(faults(table.FIRST), {})

    def test_second(self):
        self.assertEqual(faults(table.SECOND), {})

    def test_third(self):
        self.assertEqual(faults(table.THIRD), {})

    def test_shipped_files_are_clean(self):
        self.assertEqual(set(CLEAN), {p.name for p in (ROOT / "launch").glob("*.yaml")})
        runs = [(name, args) for name, all_args in CLEAN.items() for args in all_args]
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            found = pool.map(lambda run: check(ROOT / "launch" / run[0], [w for a in run[1] for w in ("--arg", a)]), runs)
        self.assertEqual([(run, f) for run, f in zip(runs, found) if f != (0, [])], [])


if __name__ == "__main__":
    unittest.main()
