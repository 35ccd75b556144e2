#!/usr/bin/env python3
"""`cmake --install` brings a library that others can build on: docs/tutorial is configured, built and run against it, in
C++ and in Python, and every launch file, scenario and model is where programs look for them."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done.stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.prefix = pathlib.Path(cls.folder.name, "prefix")
        for component in ("library", "programs", "python", "data"):
            run(CMAKE, "--install", BUILD, "--prefix", cls.prefix, "--component", component, "--strip")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_data_is_whole(self):
        share = self.prefix / "share" / "mimesis"
        for folder in ("launch", "models"):
            self.assertEqual(files(share / folder), files(ROOT / folder))
        self.assertIn("formation.yaml", {p.name for p in (share / "launch" / "crowd").iterdir()})

    def test_programs_are_there_and_run(self):
        programs = {p.name for p in (self.prefix / "bin").iterdir()}
        self.assertLessEqual({"mimesis", "mimesis-launch", "mimesis-log", "mimesis_crowd", "mimesis_synthesizer"}, programs)
        self.assertRegex(run(self.prefix / "bin" / "mimesis", "--version"), r"^mimesis \d+\.\d+\.\d+\n$")

    def test_the_tutorial_builds_and_runs_against_it(self):
        work = pathlib.Path(self.folder.name, "tutorial")
        run(CMAKE, "-S", ROOT / "docs" / "tutorial", "-B", work, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={self.prefix}",
            f"-DCMAKE_CXX_FLAGS={FLAGS}")
        run(CMAKE, "--build", work)
        sockets = pathlib.Path(self.folder.name, "run")
        sockets.mkdir()
        environment = dict(os.environ, PATH=f"{work / 'bin'}:{self.prefix / 'bin'}:{os.environ['PATH']}",
                           XDG_RUNTIME_DIR=str(sockets), XDG_STATE_HOME=self.folder.name,
                           PYTHONPATH=str(self.prefix / "lib" / "python3" / "dist-packages"))
        environment.pop("MIMESIS_PROTOSET", None)
        said = run("mimesis", "launch", ROOT / "docs" / "tutorial" / "brightness.yaml", env=environment)
        self.assertIn('"mean":148.', said)

        nodes = [subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                 for command in (["mimesis_camera"], ["mimesis_brightness", "--in", "image=camera/image"])]
        try:
            lines = run("/usr/bin/python3", ROOT / "docs" / "tutorial" / "listen.py", "3", env=environment).splitlines()
        finally:
            for node in nodes:
                node.terminate()
                node.wait()
        self.assertEqual(len(lines), 3)
        for line in lines:
            self.assertAlmostEqual(float(line.split()[1]), 148.0, delta=2.0)


if __name__ == "__main__":
    CMAKE, BUILD, FLAGS = sys.argv[1:4]
    unittest.main(argv=sys.argv[:1])
