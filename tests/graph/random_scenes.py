#!/usr/bin/env python3
"""Runs launch/imitation.yaml on random scenes, and says how many decide right and place.

    tests/graph/random_scenes.py [--bin build/bin] [--first 1] [--count 50] [--least SHARE] [--json FILE]
                                 [--scenario NAME]

Scene N has seed N; the demonstration is one of the two that the robot can do as they are, or that of the
scenario. `first` is what was decided before any plan was tried, `no_plan` the planner's reasons.
Exit code 0 if the share of scenes that succeed is at least SHARE.
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEMONSTRATIONS = ["precision,above,high", "full,below,low"]
# What each scenario of launch/imitation.yaml shall decide. `dialogue`: the first means with the grip
# seen that have a plan, else those of habit.
SCENARIOS = {
    "copy": ["precision,above,high"],
    "infer": ["full,below,low"],
    "goal_first": ["precision,above,high"],
    "colour": ["precision,above,high"],
    "practice": ["full,below,low"],
    "dialogue": ["full,above,high", "full,below,high", "precision,above,high"],
}


def run(mimesis, seed, folder, scenario=None):
    """One scene: what the launcher says, and whether all was right."""
    demonstrations = SCENARIOS[scenario] if scenario else [DEMONSTRATIONS[seed % len(DEMONSTRATIONS)]]
    command = [mimesis, "launch", "launch/imitation.yaml", "--graph", f"scene-{os.getpid()}-{seed}",
               "--arg", "scene=random", "--arg", f"seed={seed}",
               "--arg", f"{scenario}=true" if scenario else f"teacher={demonstrations[0]}",
               "--arg", f"log={folder}/scene.mcap", "--timeout", "300"]
    done = subprocess.run(command, cwd=ROOT, env=dict(os.environ, XDG_STATE_HOME=folder),
                          check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    lines = done.stdout.strip().splitlines()
    result = json.loads(lines[-1]) if lines else {"reason": done.stderr.strip()[-200:]}
    decided = ",".join(str(result.get(key)) for key in ("grip", "transport", "goal"))
    said = pathlib.Path(result.get("log", folder), "cognition.log")
    said = said.read_text(encoding="utf-8") if said.exists() else ""
    first = re.search(r"decided: (\w+), (\w+), (\w+)", said)
    return {"scenario": scenario, "seed": seed, "demonstration": " or ".join(demonstrations), "decided": decided,
            "right": decided in demonstrations, "first": ",".join(first.groups()) if first else None,
            "no_plan": re.findall(r"planning failed for ([\w, ]+ \([^)]*\))", said),
            "learned": result.get("learned"),
            "placed": bool(result.get("success")), "error_mm": result.get("placement_error_mm"),
            "collisions": result.get("collisions"), "reason": result.get("reason")}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=str(ROOT / "build/bin"), help="folder of the programs")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--least", type=float, default=0.96)
    parser.add_argument("--scenario", choices=SCENARIOS, help="of launch/imitation.yaml")
    parser.add_argument("--json", help="writes a line per scene to this file")
    options = parser.parse_args()
    mimesis = str(pathlib.Path(options.bin).resolve() / "mimesis")
    scenes = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.count):
            scenes.append(run(mimesis, seed, folder, options.scenario))
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
