#!/usr/bin/env python3
"""Runs launch/imitation.yaml on random scenes, and says how many decide right and place.

    tests/graph/random_scenes.py [--bin build/bin] [--first 1] [--count 50] [--least SHARE] [--json FILE]

Scene N has seed N; the lesson is one of the two that the robot can do as they are. Exit code 0
if the share of scenes that succeed is at least SHARE.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LESSONS = ["precision,above,high", "full,below,low"]


def run(mimesis, seed, folder):
    """One scene: what the launcher says, and whether all was right."""
    lesson = LESSONS[seed % len(LESSONS)]
    command = [mimesis, "launch", "launch/imitation.yaml", "--graph", f"scene-{os.getpid()}-{seed}",
               "--arg", "scene=random", "--arg", f"seed={seed}", "--arg", f"teacher={lesson}",
               "--arg", f"log={folder}/scene.mcap", "--timeout", "300"]
    done = subprocess.run(command, cwd=ROOT, env=dict(os.environ, XDG_STATE_HOME=folder),
                          check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    lines = done.stdout.strip().splitlines()
    result = json.loads(lines[-1]) if lines else {"reason": done.stderr.strip()[-200:]}
    decided = ",".join(str(result.get(key)) for key in ("grip", "transport", "goal"))
    return {"seed": seed, "lesson": lesson, "decided": decided, "right": decided == lesson,
            "placed": bool(result.get("success")), "error_mm": result.get("placement_error_mm"),
            "collisions": result.get("collisions"), "reason": result.get("reason")}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=str(ROOT / "build/bin"), help="folder of the programs")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--least", type=float, default=0.96)
    parser.add_argument("--json", help="writes a line per scene to this file")
    options = parser.parse_args()
    mimesis = str(pathlib.Path(options.bin).resolve() / "mimesis")
    scenes = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.count):
            scenes.append(run(mimesis, seed, folder))
            line = json.dumps(scenes[-1])
            print(line, flush=True)
            if options.json:
                with open(options.json, "a", encoding="utf-8") as file:
                    file.write(line + "\n")
    good = [s for s in scenes if s["right"] and s["placed"]]
    errors = [s["error_mm"] for s in good]
    print(f"{len(good)} of {len(scenes)} decided right and placed"
          + (f"; placement error: median {statistics.median(errors):.2f} mm, worst "
             f"{max(errors):.2f} mm" if errors else ""))
    sys.exit(0 if len(good) >= options.least * len(scenes) else 1)


if __name__ == "__main__":
    main()
