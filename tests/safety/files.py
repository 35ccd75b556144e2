"""Damaged copies of every kind of file that is read, given to the cheapest program that reads it."""
import os
import pathlib
import re
import resource
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import zlib

import hostile
import judge
import trial

LIMIT_S = 60.0  # on a loaded machine
MEMORY = 4 << 30  # bytes of address space
MOST_LINES = 300  # of a refusal
SHARED = pathlib.Path(os.environ.get("MIMESIS_SHARED", trial.ROOT.parent / "shared"))
WORDS = ("nan", "inf", "-inf", "1e308", "-1", "0", "99999999999999999999", "", "[]", "{}", "~", "!!binary x", "*a", "&a b", "'",
         "\"\\u0000\"", "yes", "[1, 2]", "{a: b}", "../../../etc/passwd", "/dev/zero", "é\x1b[31m", "${arg:x}", "1e-320", "0x10")
WHOLE = (b"", b"\0", b"[" * 100000, b"{" * 5000, b", x\n", b"- " * 50000, b"a: &a [*a]\n", b"a: \"" + b"x" * (1 << 20), b"\xef\xbb\xbf",
         b"%YAML 9.9\n---\n", b"---\n---\n", b"\n".join(b"k%d: &k%d [*k%d, *k%d]" % (i, i, max(i - 1, 0), max(i - 1, 0)) for i in range(30)))
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def mutated_text(rng, data):
    """Some lines removed, repeated, exchanged or indented; some values and keys replaced."""
    lines = data.decode().split("\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, how = rng.randrange(len(lines)), rng.randrange(7)
        if how == 0:
            del lines[at]
        elif how == 1:
            lines.insert(at, rng.choice(lines))
        elif how == 2:
            lines[at] = " " * rng.randrange(1, 4) + lines[at]
        elif how == 3:
            lines[at] = lines[at].lstrip()
        elif how == 4:
            lines[at] = re.sub(r"\w+", lambda m: m.group()[::-1], lines[at], count=1)
        elif ":" in lines[at] and how == 5:
            lines[at] = lines[at].partition(":")[0] + ": " + rng.choice(WORDS)
        else:
            found = list(NUMBER.finditer(lines[at]))
            if found:
                one = rng.choice(found)
                lines[at] = lines[at][:one.start()] + rng.choice(WORDS) + lines[at][one.end():]
        lines = lines or [""]
    return "\n".join(lines).encode()


def _png(width=16, height=16):
    part = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(range(3 * width)) for _ in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b"")


def _candump():
    return "".join(f"({1436509052 + n / 100:.6f}) vcan0 {0x180 + n % 9:03X}#{n:016X}\n" for n in range(200)).encode()


def _launches(names=("imitation", "biped", "crowd", "drawer", "walk")):
    return [trial.ROOT / f"launch/{name}.yaml" for name in names]


# Kind of file: seeds (paths, or name and bytes), whether they are text, and the command of a mutated copy.
def _launch(rng, file, folder):
    return ["mimesis", "launch", file, "--check" if rng.random() < 0.05 else "--dry-run"]


def _params(rng, file, folder):
    node = rng.choice(("bridge", "planner", "cognition", "vision", "camera", "world", "sim_drives", "sim_hand"))
    return [f"mimesis_{node}", "--params", f"{file}#nodes.{node}.params", "--check"]


def _robot(rng, file, folder):
    if file.name == "lwr4.yaml":
        return rng.choice((["mimesis_sim_drives", "--set", f"robot={file}", "--set", "bus=embedded:x"],
                           ["mimesis_planner", "--set", f"robot={file}"], ["mimesis_world", "--set", f"robot={file}"],
                           ["mimesis_bridge", "--set", f"robot={file}", "--set", "can=embedded:x", "--set", "hand="]))
    whole = folder / "biped.yaml"  # it names the .urdf beside it
    return rng.choice((["mimesis_walker", "--set", f"robot={whole}"], ["mimesis_sim_body", "--set", f"robot={whole}"],
                       ["mimesis_synthesizer", "--set", f"robot.description={whole}", "--set", "model=biped_walk.motion.json"]))


def _log(rng, file, folder):
    out = folder / "out"
    return ["mimesis", "log", *rng.choice((
        ["check", file], ["check", file], ["info", file], ["cat", file, "--limit", "200"], ["recover", file, out],
        ["filter", file, out], ["diff", file, file], ["filter", file, file, "-o", out], ["info", file, "--json"],
        ["cat", file, "--attachment", "launch.yaml"], ["plot", file, "planner/status.state", "-o", folder / "out.png"],
        ["replay", file.stem, file], ["play", file, "--rate", "100"]))]


def _mocap(rng, file, folder):
    return ["mimesis", "demix", "-o", folder / "out.motion.json", "--whole-clips", file]


def _log_seeds():
    return [p for p in sorted((trial.ROOT / "tests/replay/logs").glob("*.mcap")) if p.stat().st_size < 300_000]


def _mocap_seeds():
    seeds = [SHARED / "data/mocap" / name for name in (
        "bandai_nc/dataset-2_raise-up-both-hands_normal_001.bvh", "cmu_amc/35_01.amc", "cmu_amc/35.asf", "c3d/Eb015pi.c3d", "sets/A.csv")]
    return [s for s in seeds if s.exists()]


KINDS = {
    "launch": (_launches, True, _launch),
    "params": (lambda: _launches(("imitation",)), True, _params),
    "robot": (lambda: [trial.ROOT / "models/lwr4.yaml", trial.ROOT / "models/biped.yaml"], True, _robot),
    "urdf": (lambda: [trial.ROOT / "models/biped.urdf"], True, _robot),
    "table": (lambda: [trial.ROOT / "models/bar_table.yaml"], True,
              lambda rng, file, folder: ["mimesis_world", "--set", f"table={file}"]),
    "scenario": (lambda: sorted((trial.ROOT / "launch/crowd").glob("*.yaml")), True,
                 lambda rng, file, folder: rng.choice((["mimesis", "crowd", "certify", file],
                                                       ["mimesis_crowd", "--set", f"scenario={file}", "--set", "until_s=0.1"]))),
    "model": (lambda: [trial.ROOT / "models/walk.motion.json"], True,
              lambda rng, file, folder: ["mimesis_synthesizer", "--set", f"model={file}"]),
    "log": (_log_seeds, False, _log),
    "candump": (lambda: [("a.log", _candump())], True,
                lambda rng, file, folder: ["mimesis", "log", "convert", file, folder / "out.mcap"]),
    "picture": (lambda: [("a.png", _png())], False,
                lambda rng, file, folder: ["mimesis_camera", "--set", "source=folder", "--set", f"path={folder / 'pictures'}"]),
    "mocap": (_mocap_seeds, False, _mocap),
}


def kinds(build):
    """Those whose seeds are there, and whose programs were built."""
    return [k for k, (seeds, _, _) in KINDS.items() if seeds() and (k != "mocap" or (build / "bin/mimesis-demix").exists())]


class Case:
    """One mutated file in a folder of its own, beside the other models."""

    def __init__(self, build, kind, rng):
        self.build, self.kind = build, kind
        seeds, text, command = KINDS[kind]
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="safety-", dir="/dev/shm"))
        for path in (trial.ROOT / "models").iterdir():
            (self.folder / path.name).symlink_to(path)
        (self.folder / "parts").symlink_to(trial.ROOT / "launch/parts")  # launch files include them
        (self.folder / "pictures").mkdir()
        seed = rng.choice(seeds())
        name, self.seed = (seed.name, seed.read_bytes()) if isinstance(seed, pathlib.Path) else seed
        data = self.seed
        while data == self.seed:
            how = rng.random()
            data = mutated_text(rng, data) if text and how < 0.6 else rng.choice(WHOLE) if how < 0.63 else hostile.mutated(rng, data)
        self.file = self.folder / ("pictures" if kind == "picture" else "") / name
        self.file.unlink(missing_ok=True)
        self.file.write_bytes(data)
        if self.file.suffix == ".amc":
            shutil.copy(seed.with_name("35.asf"), self.folder)
        if self.file.suffix == ".asf":
            shutil.copy(seed.with_name("35_01.amc"), self.folder)
        clip = self.folder / "35_01.amc" if self.file.suffix == ".asf" else self.file
        self.words = [str(w) for w in command(rng, clip, self.folder)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder, ignore_errors=True)

    def _run(self):
        """Exit code (nothing: it had to be killed) and all that was said. A node is ended once it is ready."""
        def limits():
            if MEMORY:
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        environment = os.environ | {"XDG_RUNTIME_DIR": str(self.folder), "XDG_STATE_HOME": str(self.folder), "MIMESIS_GRAPH": "g"}
        told = self.folder / "told"
        with open(told, "wb") as out:
            process = subprocess.Popen([str(self.build / "bin" / self.words[0]), *self.words[1:]], stdin=subprocess.DEVNULL,
                                       stdout=out, stderr=out, env=environment, preexec_fn=limits)
        deadline = time.monotonic() + LIMIT_S
        asked = False
        while process.poll() is None:
            if time.monotonic() > deadline:
                process.kill()
                process.wait()
                return None, told.read_bytes()
            if not asked and self.words[0].startswith("mimesis_") and b"ready:" in told.read_bytes():
                time.sleep(0.1)  # some read on
                process.send_signal(signal.SIGTERM)
                asked = True
            time.sleep(0.005)
        return process.returncode, told.read_bytes()

    def judge(self):
        """The verdict, and what was called."""
        code, told = self._run()
        v = judge.Verdict()
        text = re.sub(r"\x1b\[(1;33m)?Warning.*?\x1b\[0m", "", told.decode(errors="replace"))  # in colour, of DART
        if code is None:
            v.breach("hang", f"no end within {LIMIT_S:.0f} s")
        elif code < 0 and -code != signal.SIGTERM or judge.WRECK.search(text):
            v.breach("crash", f"exit {code}: {text.strip()[-300:]!r}")
        elif code not in (0, 1, 2, 3, -signal.SIGTERM, 143):
            v.breach("exit code", f"{code}: {text.strip()[-200:]!r}")
        elif code != 0:
            lines = text.strip().splitlines()
            if not lines:
                v.breach("silent", f"exit {code} without a word")
            elif len(lines) > MOST_LINES and self.words[2:3] not in (["check"], ["cat"]):
                v.breach("many lines", f"{len(lines)} lines")
        data = "--dry-run" in self.words and code == 0  # commands as a shell takes them
        if not data and re.search(r"[\x00-\x08\x0b-\x1f\x7f]", text):
            v.breach("control characters", repr(re.search(r".{0,80}[\x00-\x08\x0b-\x1f\x7f].{0,20}", text).group()))
        if code == 0 and self.words[1:3] == ["log", "check"]:
            v.breach("silent", f"a damaged log is called intact: {self.file.name}")
        words = [w.replace(str(self.folder), ".") for w in self.words]
        return v, f"{self.file.name}: {' '.join(words)}"
