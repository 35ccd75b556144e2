"""One run of a scenario, its processes, and an observer outside of it: what happened, and when on the monotonic clock."""
import collections
import contextlib
import dataclasses
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
import mimesis  # noqa: E402


@dataclasses.dataclass(frozen=True)
class Scenario:
    """truth: topic of the simulator's own joints, by which a run is judged; outcome: topic that ends the run."""
    name: str
    truth: str
    outcome: str
    moves_s: float  # graph time from the first motion that a moment is drawn from
    still_rad_s: float  # slower than this is at rest
    mean_s: float = 0.0  # speeds are means over this time: a robot that is held and falls bends its springs
    upstream: tuple = ()  # processes whose loss must bring the joints to rest; a walker ends its step first
    options: tuple = ()  # of the launch
    lockstep_options: tuple = ()  # more of them


NOT_NODES = ("supervisor", "subreaper")
SCENARIOS = {s.name: s for s in (
    Scenario("imitation", "sim_drives/joint_states", "world/outcome", 6.0, 0.01, 0.0,
             ("camera", "vision", "cognition", "planner", "world", "bridge", *NOT_NODES), ("--set", "camera.duration_s=3")),
    Scenario("biped", "sim_body/joint_states", "sim_body/outcome", 8.0, 0.8, 0.05, ("walker", "bridge")),
    Scenario("crowd", "crowd/status", "crowd/outcome", 6.0, 0.0, 0.0, (), ("--arg", "until=12"), ("--arg", "until=1000")),
)}
@dataclasses.dataclass(frozen=True)
class Sample:
    """Joints of the simulation, as received."""
    at: float  # receipt [s], monotonic
    graph: float  # graph time [s]
    speed: float  # of the fastest joint [rad/s]
    powered: bool  # any drive is in operation


class Observer(threading.Thread):
    """Listens to the truth. It is no member of the lock-step and is seen by nobody."""

    def __init__(self, scenario):
        super().__init__(daemon=True)
        self.samples, self.stamp_ns, self.moved_ns, self.error = [], 0, None, ""
        self.outcome = None  # when the topic that ends the run was heard [s], monotonic
        self._scenario, self._end = scenario, False
        self._postures = collections.deque()  # (stamp, joints) of the last mean_s
        self._graph = mimesis.Graph("observer")

    def run(self):
        try:
            topics = (self._scenario.truth, self._scenario.outcome)
            while not self._end:
                for got in self._graph.subscribe(*topics, policy="reliable", timeout_s=0.1):
                    self._take(got)
                    if self._end:
                        break
        except Exception as error:  # a thread's exception would be seen by nobody
            self.error = f"the observer failed: {error}"
        finally:
            self._graph.close()

    def _take(self, got):
        if got.source == "rogue":  # hostile.py
            return
        if got.topic == self._scenario.outcome:
            self.outcome = self.outcome or time.monotonic()
            return
        self.stamp_ns = got.stamp_ns
        joints = hasattr(got.message, "drives")
        speed = self._speed(got.stamp_ns, got.message) if joints else 1.0
        powered = joints and 5 in got.message.drives  # DRIVE_STATE_OPERATION_ENABLED
        if self._scenario.name == "biped" and (not powered or self.outcome):
            speed = 0.0  # its drives hold it; once it fell, what its body does on them is no motion of ours
        self.samples.append(Sample(time.monotonic(), got.stamp_ns / 1e9, speed, powered))
        if self.moved_ns is None and speed > self._scenario.still_rad_s and (powered or not joints):
            self.moved_ns = got.stamp_ns

    def _speed(self, stamp_ns, joints):
        """Of the fastest joint [rad/s]."""
        if not self._scenario.mean_s:
            return max((abs(v) for v in joints.velocity_rad_s), default=0.0)
        past, now = self._postures, list(joints.position_rad)
        past.append((stamp_ns, now))
        while len(past) > 2 and past[1][0] <= stamp_ns - self._scenario.mean_s * 1e9:
            past.popleft()
        passed_s = (stamp_ns - past[0][0]) / 1e9
        return max(abs(a - b) for a, b in zip(now, past[0][1])) / passed_s if passed_s > 0 else 0.0

    def close(self):
        self._end = True
        self.join()


class Launch:
    """A launch in folders of its own; `with` removes them, and every process that is left."""

    def __init__(self, build):
        self.build = build
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="safety-", dir="/dev/shm"))
        self.runtime, self.scratch = self.folder / "r", self.folder / "tmp"
        for path in (self.runtime, self.scratch, self.folder / "state"):
            path.mkdir(mode=0o700)
        os.environ["XDG_RUNTIME_DIR"], os.environ["MIMESIS_GRAPH"] = str(self.runtime), "g"
        os.environ["MIMESIS_PROTOSET"] = str(build / "generated/mimesis.protoset")
        self.graph = self.runtime / "mimesis/g"

    def start(self, file, options=(), preload=None):
        environment = os.environ | {"XDG_STATE_HOME": str(self.folder / "state"), "TMPDIR": str(self.scratch)} | (preload or {})
        self.command = command = [str(self.build / "bin/mimesis"), "launch", str(file), "--json", *options]
        self.trespass = ""  # what a stranger was let do
        self.errors, self.output = [], []  # (time of receipt, line)
        self.began, self.ended = time.monotonic(), None
        self.process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True)
        self._readers = [threading.Thread(target=self._read, args=(self.process.stderr, self.errors), daemon=True),
                         threading.Thread(target=self._read, args=(self.process.stdout, self.output), daemon=True)]
        for reader in self._readers:
            reader.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill_rest()
        self.process.wait()
        for reader in self._readers:
            reader.join()
        self.process.stdout.close(), self.process.stderr.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _read(self, stream, into):
        for line in stream:
            into.append((time.monotonic(), line.rstrip("\n")))

    def processes(self):
        """Living processes of this run by node name, "subreaper" and "supervisor"; others by their pid."""
        mark, found = f"XDG_RUNTIME_DIR={self.runtime}\0".encode(), {}
        for entry in pathlib.Path("/proc").iterdir():
            if not entry.name.isdigit() or int(entry.name) == os.getpid():
                continue
            with contextlib.suppress(OSError):
                if mark not in (entry / "environ").read_bytes():
                    continue
                words = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                if not words[0]:
                    continue  # ended, and not waited for
                name = entry.name
                if int(entry.name) == self.process.pid:
                    name = "subreaper"
                elif "--name" in words:
                    name = words[words.index("--name") + 1]
                elif "record" in words or words[0].endswith("mimesis-log-record"):
                    name = "recorder"
                elif "launch" in words[0] and parent == self.process.pid:
                    name = "supervisor"
                found[name] = int(entry.name)
        return found

    def wait_end(self, timeout_s):
        """True when no process is left and both streams are closed."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            if not any(r.is_alive() for r in self._readers) and self.process.poll() is not None and not self.processes():
                self.ended = time.monotonic()
                return True
            time.sleep(0.02)
        return False

    def kill_rest(self):
        """Kills what is left; returns the names."""
        left = self.processes()
        for pid in left.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return sorted(left)

    def json_lines(self):
        """The summary of the nodes and the result, of those that were printed."""
        found = []
        for _, line in self.output:
            with contextlib.suppress(ValueError):
                found.append(json.loads(line))
        summary = next((f for f in found if "nodes" in f and "exit_code" in f), None)
        return summary, next((f for f in found if f is not summary), None)

    def leftovers(self):
        """Files that nobody needs any more. wall_clock is everybody's."""
        ours = {"mimesis", "mimesis/g", "mimesis/g/nodes", "mimesis/g/wall_clock"}
        found = [str(p.relative_to(self.runtime)) for p in self.runtime.rglob("*")]
        return sorted(set(found) - ours) + [str(p) for p in self.scratch.rglob("*")]


class Run(Launch):
    """A scenario that was launched, and its observer."""

    def __init__(self, build, scenario, clock, preload=None, fifo=False):
        super().__init__(build)
        self.scenario, self.clock, self.log = scenario, clock, self.folder / "run.mcap"  # logs have 150 MB
        self.observer = Observer(scenario)
        self.observer.start()
        options = ["--arg", f"clock={clock}", "--arg", f"log={self.log}", *scenario.options]
        options += scenario.lockstep_options if clock == "lockstep" else ()
        self.start((self._with_fifo() if fifo else ROOT / "launch") / f"{scenario.name}.yaml", options, preload)

    def __exit__(self, *_):
        self.observer.close()
        super().__exit__()

    def _with_fifo(self):
        """Copies of the launch files, whose nodes run at real-time priority, below the kernel's throttle."""
        folder = self.folder / "launch"
        shutil.copytree(ROOT / "launch", folder)
        for file in (*folder.glob("*.yaml"), *folder.glob("parts/*.yaml")):
            text, sched = file.read_text(), "sched: {policy: fifo, priority: 40}"
            kept = re.sub(r"(?m)^defaults: \{", f"defaults: {{{sched}, ", text)
            file.write_text(kept if kept != text else f"{text}\ndefaults: {{{sched}}}\n")
        return folder

    def wait_until(self, condition, timeout_s):
        """False if the run ended or the time is up before the condition holds."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline or self.process.poll() is not None or self.observer.error:
                return False
            time.sleep(0.002)
        return True

    def log_state(self):
        """Exit code of `log check`, and graph time of the last message [ns]; None without a readable log."""
        mimesis_program = str(self.build / "bin/mimesis")
        run = lambda *words: subprocess.run([mimesis_program, "log", *words, str(self.log)], capture_output=True, text=True)
        told = run("info", "--json").stdout
        with contextlib.suppress(ValueError, KeyError, TypeError):
            return run("check").returncode, int(json.loads(told)["end_ns"])
        return run("check").returncode, None


def node_names(build, scenario, clock):
    """Nodes of a launch file in order of start."""
    command = [str(build / "bin/mimesis"), "launch", str(ROOT / f"launch/{scenario.name}.yaml"), "--dry-run", "--json",
               "--arg", f"clock={clock}"]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [node["name"] for node in json.loads(told)["start"]]
