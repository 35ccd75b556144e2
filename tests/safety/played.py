"""A live arm, and random parts of a log that are played beside it: it does not move, and both sides say why."""
import contextlib
import json
import os
import subprocess
import time

import judge
import trial
import mimesis

LIVE = """version: 1
outside: [cognition/decision, cognition/proposal, robot_vision/table]
nodes:
  sim_drives: {exec: mimesis_sim_drives, params: {bus: "embedded:arm", robot: lwr4.yaml}}
  sim_hand: {exec: mimesis_sim_hand, params: {rate_hz: 100, address: "unix:hand"}, in: {contact: world/contact}}
  world:
    exec: mimesis_world
    params: {rate_hz: 100, robot: lwr4.yaml, table: bar_table.yaml}
    in: {joint_states: sim_drives/joint_states, hand: sim_hand/hand, task: planner/status}
  bridge:
    exec: mimesis_bridge
    after: [sim_drives, sim_hand]
    params: {robot: lwr4.yaml, can: "embedded:arm", enable: auto, hand: "unix:hand"}
    in: {command: planner/command, hand_command: planner/hand_command}
  planner:
    exec: mimesis_planner
    params: {robot: lwr4.yaml}
    in: {decision: cognition/decision, proposal: cognition/proposal, scene: robot_vision/table,
         joint_states: bridge/joint_states, hand: bridge/hand}
"""
MOVED_RAD = 1e-6
PLAY_S = 6.0  # of the log, at twice its pace


def record(build, folder):
    """A log of the whole imitation, with what moved its arm."""
    log = folder / "whole.mcap"
    symbols = trial.ROOT / "tests/graph/symbols/precision_above_high.mcap"
    command = [build / "bin/mimesis", "launch", trial.ROOT / "launch/imitation.yaml", "--arg", "played=true", "--arg",
               f"symbols={symbols}", "--arg", f"log={log}", "--graph", "recorded"]
    subprocess.run(command, check=True, capture_output=True)
    told = subprocess.run([build / "bin/mimesis", "log", "info", "--json", log], check=True, capture_output=True, text=True).stdout
    return log, sorted(t["topic"] for t in json.loads(told)["topics"])


class Live(trial.Launch):
    """The graph, once its arm stands."""

    def __init__(self, build):
        super().__init__(build)
        file = self.folder / "live.yaml"
        file.write_text(LIVE)
        self.start(file)
        self.observer = mimesis.Graph("observer")
        deadline = time.monotonic() + 60
        while not all(n in self.observer.nodes() and self.observer.nodes()[n].ready for n in ("bridge", "planner")):
            assert time.monotonic() < deadline, self.errors
            time.sleep(0.05)

    def joints(self):
        for got in self.observer.subscribe("sim_drives/joint_states", timeout_s=5.0):
            return list(got.message.position_rad)
        return None

    def __exit__(self, *what):
        self.observer.close()
        with contextlib.suppress(ProcessLookupError):
            self.process.terminate()
        self.wait_end(10.0)
        super().__exit__(*what)


def play(live, log, topics, rng):
    """Plays a random part. Verdict, and what it was."""
    chosen = rng.sample(topics, rng.randrange(1, len(topics) + 1))
    words = [live.build / "bin/mimesis", "log", "play", log, "--rate", "2", "--duration", str(PLAY_S)]
    words += [w for t in chosen for w in ("--topic", t)]
    if rng.random() < 0.2:
        words += ["--name", rng.choice(("cognition", "robot_vision", "eyes", "camera"))]
    before = live.joints()
    ran = subprocess.run(words, capture_output=True, text=True, env=os.environ | {"TMPDIR": str(live.scratch)})
    after, verdict = live.joints(), judge.Verdict()
    moved = max(abs(a - b) for a, b in zip(before, after)) if before and after else float("nan")
    if not moved < MOVED_RAD:
        verdict.breach("motion", f"the arm moved {moved:.6f} rad")
    known = {i.topic for n in live.observer.nodes().values() for i in (*n.inputs, *n.outputs)}
    if known & set(chosen):
        if ran.returncode != 2 or "the graph is live, and nothing is published" not in ran.stderr:
            verdict.breach("silent", f"exit {ran.returncode}: {ran.stderr[-200:]}")
    elif ran.returncode != 0:
        verdict.breach("refused", ran.stderr[-200:])
    return verdict, f"{len(chosen)} of {len(topics)} topics"
