#!/usr/bin/env python3
"""`cmake --install` brings every launch file, scenario and model to where programs look for them."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


class Install(unittest.TestCase):
    def test_data_is_whole(self):
        with tempfile.TemporaryDirectory() as prefix:
            subprocess.run([CMAKE, "--install", BUILD, "--prefix", prefix, "--component", "data"], check=True,
                           stdout=subprocess.DEVNULL)
            share = pathlib.Path(prefix) / "share" / "mimesis"
            for folder in ("launch", "models"):
                self.assertEqual(files(share / folder), files(ROOT / folder))
            self.assertIn("formation.yaml", {p.name for p in (share / "launch" / "crowd").iterdir()})

    def test_programs_are_named(self):
        rule = "".join(p.read_text() for p in pathlib.Path(BUILD).rglob("cmake_install.cmake"))
        for program in ("mimesis_crowd", "mimesis_synthesizer", "mimesis"):
            self.assertIn(f'/bin/{program}"', rule)


if __name__ == "__main__":
    CMAKE, BUILD = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1])
