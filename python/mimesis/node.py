"""Nodes in Python that are what nodes in C++ are: options, parameters, clocks, description, health, recorded steps, replay."""
import argparse
import collections
import json
import math
import os
import pathlib
import re
import select
import signal
import socket
import struct
import sys
import time
import traceback

import zmq

from . import graph as live
from . import types

TOPIC_TYPES = {"health": "mimesis.v1.Health", "start": "mimesis.v1.NodeStart", "steps": "mimesis.v1.StepLog"}
CREATE, STEP, STOP = 1, 2, 3  # v1.StepKind


class Refused(Exception):
    """A setting that makes no node: one line, exit code 2."""


class Input:
    """Messages on a port. take(): the newest since the last call, or None; pop(): the oldest, of a "reliable" or "queue" input."""

    def __init__(self, node, port, kind, policy):
        self.port, self.kind, self.policy, self.topic = port, kind, policy, None
        self.received = self.dropped = self.rejected = self.last_ns = 0
        self._node, self.waiting = node, collections.deque()

    def put(self, received):
        if self.policy == "latest" and self.waiting:
            self.waiting.clear()
            self.dropped += 1
        self.received += 1
        self.last_ns = received.stamp_ns
        self.waiting.append(received)

    def pop(self):
        if not self.waiting:
            return None
        received = self.waiting.popleft()
        self._node.took(self, received)
        return received

    def take(self):
        last = None
        while self.waiting:
            last = self.pop()
        return last


class Node:
    """Derive from it, override create() and step(), and give the class to run().

    What a step does may depend on its inputs, `now_ns` and parameters alone: then `mimesis log replay` repeats it byte for byte."""

    rate_hz, offset_s, about = 100.0, 0.0, ""

    def create(self):
        """Makes parameters, inputs, outputs and services."""

    def step(self, now_ns):
        """Called rate_hz times a second of graph time."""

    def stop(self, now_ns):
        """The last call."""

    def parameter(self, key, value, least=-math.inf, most=math.inf, meaning=""):
        made = self._bus.parameter(key, value, least, most, meaning)
        if key in self._given:
            given = self._given.pop(key)
            try:
                made.value = made.read(given if isinstance(given, str) else json.dumps(given))
            except ValueError as error:
                raise Refused(f"{self._bus.name}.{error}") from None
        self._defaults[key] = value
        return made

    def input(self, port, kind, policy="latest"):
        made = Input(self._bus, port, types.message_type(kind) if isinstance(kind, str) else kind, policy)
        made.topic = self._wires["in"].get(port)
        self._inputs[port] = made
        self._bus.listen(made)
        return made

    def output(self, port, kind, latched=False):
        topic = self._wires["out"].get(port, f"{self._bus.name}/{port}")
        made = self._bus.publish(topic, types.message_type(kind) if isinstance(kind, str) else kind, latched)
        self._outputs[port] = made
        return made

    def service(self, name, request, answer, act):
        self._bus.offer(name, request, answer, act)

    def make(self, bus, options):
        """Fills the node on `bus`. Raises Refused."""
        self._bus, self._given, self._defaults = bus, dict(options.given), {}
        self._inputs, self._outputs, self._wires = {}, {}, {"in": options.wired_in, "out": options.wired_out}
        rate = self.parameter("rate_hz", float(self.rate_hz), 0.1, 10000.0, "rate of steps [Hz]")
        offset = self.parameter("offset_s", float(self.offset_s), 0.0, 10.0, "time of the first step within the period [s]")
        rate.changeable = offset.changeable = False
        self.rate_hz, self.offset_s = rate.value, offset.value
        self.create()
        for what, given, known in (("parameter", self._given, self._defaults), ("input", options.wired_in, self._inputs),
                                   ("output", options.wired_out, {**self._outputs, **TOPIC_TYPES})):
            for key in given:
                if key not in known:
                    raise Refused(f"{bus.name}.{key}: unknown {what}; there are: {', '.join(known)}")

    def describe(self, program):
        """What `mimesis launch --check` reads."""
        def parameter(p):
            low, high = (None if math.isinf(x) else x for x in (p.least, p.most))
            kind = {float: "number", int: "integer", bool: "bool", str: "text"}[type(p.value)]
            allowed = f"[{low}, {high}]" if kind in ("number", "integer") and None not in (low, high) else ""
            return {"key": p.key, "type": kind, "default": self._defaults[p.key], "value": p.value, "allowed": allowed,
                    "changeable": p.changeable, "help": p.meaning,
                    **({"range": [low, high]} if allowed else {})}

        ports = [{"name": i.port, "direction": "in", "type": i.kind.DESCRIPTOR.full_name, "policy": i.policy, "optional": True,
                  "sole": False} for i in self._inputs.values()]
        ports += [{"name": port, "direction": "out", "type": o.message.DESCRIPTOR.full_name, "latched": o.latched}
                  for port, o in self._outputs.items()]
        ports += [{"name": port, "direction": "out", "type": kind, "latched": False, "own": True}
                  for port, kind in TOPIC_TYPES.items()]
        offered = [{"name": name.partition("/")[2], "request": a.DESCRIPTOR.full_name, "response": b.DESCRIPTOR.full_name}
                   for name, (a, b, _) in self._bus._offered.items() if not name.endswith("/params")]
        return json.dumps({"program": program, "version": "", "about": self.about, "complete": True, "ports": ports,
                           "services": offered, "parameters": [parameter(p) for p in self._bus._parameters.values()],
                           "opens": []}, separators=(",", ":"))


class _Memory(live.Services):
    """A bus without sockets, of descriptions and replays. It keeps what is sent."""

    class Out:
        def __init__(self, bus, topic, message, latched):
            self.bus, self.topic, self.message, self.latched, self.seq = bus, topic, message, latched, 0

        def send(self, message, stamp_ns=None):
            self.seq += 1
            stamp_ns = self.bus.time_ns if stamp_ns is None else int(stamp_ns)
            live.stamp(message, stamp_ns, self.seq)
            self.bus.sent.append((self.topic, message.SerializeToString(deterministic=True), stamp_ns, self.seq))

    def __init__(self, name):
        super().__init__(name)
        self.sent, self.time_ns = [], 0

    def publish(self, topic, message, latched):
        return self.Out(self, topic, message, latched)

    def listen(self, made):
        pass

    def took(self, made, received):
        pass


class _Live(live.Graph):
    """The node's connection to its graph, which records each step on NODE/steps."""

    def __init__(self, options):
        super().__init__(options.name, options.graph, options.bind, clock=options.clock, ready=False)
        self.lockstep, self._ports, self._record, self._log = options.clock == "lockstep", [], None, None
        self.policy, self._steps, self._requests_served = {}, 0, []
        if self.lockstep:
            self.published = []  # for the conductor, who shows these messages to others
        self._alike = {}  # whether a publisher's type is that of an input, by its class
        self.on_served = lambda service, asked, answer: self._requests_served.append((service, asked, answer))
        self._own, self._looked, self._poller = {}, 0.0, zmq.Poller()
        for into in (*self._inputs.values(), self._requests):
            self._poller.register(into, zmq.POLLIN)

    def own_topics(self):
        for port, kind in TOPIC_TYPES.items():
            self._own[port] = self.publish(f"{self.name}/{port}", types.message_type(kind), latched=port == "start")
        self._record, self._log = (types.message_type(f"mimesis.v1.{t}")() for t in ("StepRecord", "StepLog"))

    def listen(self, made):
        if not made.topic:
            return print(f"{self.name}: input {made.port} is not wired: it will receive nothing", file=sys.stderr)
        policy = "reliable" if self.lockstep or made.policy != "latest" else "latest"
        self.policy[made.topic] = policy
        kind = made.kind.DESCRIPTOR
        self._info.inputs.add(topic=made.topic, port=made.port, type=kind.full_name, type_hash=types.type_hash(kind),
                              policy=made.policy)
        self._info.descriptors[kind.full_name] = types.descriptor_set(kind)
        self._inputs[policy].setsockopt(zmq.SUBSCRIBE, made.topic.encode() + b"\0")
        self._wanted.add((made.topic, policy))
        self._ports.append(made)

    def greet(self):
        """All subscriptions have been made: publishers of a lock-step wait for this word."""
        word = live.HELLO + struct.pack("<Q", self.start_id)
        for into in self._inputs.values():
            into.setsockopt(zmq.UNSUBSCRIBE, word)
            into.setsockopt(zmq.SUBSCRIBE, word)

    def announce_ready(self):
        self._info.ready = True
        self._announce()

    def meet_members(self):
        """Lock-step: until the nodes that hear us have subscribed; 2 s at most."""
        until = time.monotonic() + 2.0
        while time.monotonic() < until:
            self._discover()
            self.serve()
            hear = {n.start_id for n in self._nodes.values() if n.clock == "lockstep" or any(i.topic == "*" for i in n.inputs)
                    for i in n.inputs if i.topic in self._publications or i.topic == "*"}
            if hear <= self.greeted:
                return
            time.sleep(0.002)

    def look(self):
        """For news of the directory, now and then; answers requests."""
        if time.monotonic() - self._looked > live.POLL_MS / 1000:
            self._looked = time.monotonic()
            self._discover()
            notify("WATCHDOG=1")
        self.serve()

    def gather(self, timeout_s=0.0):
        """Reads the sockets; what came waits in the inbox by topic."""
        for into, _ in self._poller.poll(max(0, round(1000 * timeout_s))):
            self.serve() if into is self._requests else self._take(into)

    def deliver_all(self):
        for made in self._ports:
            while self._inbox[made.topic]:
                self._deliver(made, self._inbox[made.topic].popleft())

    def deliver(self, visible):
        """Lock-step: exactly these, in their order; each is waited for, 5 s at most, 0.5 s if its publisher is gone."""
        for wanted in visible:
            lives = any(n.start_id == wanted.start_id for n in self._nodes.values())
            ports, until = [p for p in self._ports if p.topic == wanted.topic], time.monotonic() + (5.0 if lives else 0.5)
            while ports:
                box = self._inbox[wanted.topic]
                found = next((m for m in box if (m.start_id, m.seq) == (wanted.start_id, wanted.seq)), None)
                if found:
                    box.remove(found)
                    for made in ports:
                        self._deliver(made, found)
                    break
                if time.monotonic() >= until:
                    print(f"{self.name}: message {wanted.seq} on topic {wanted.topic} did not arrive", file=sys.stderr)
                    break
                self.look()
                self.gather(0.02)

    def _deliver(self, made, received):
        pair = type(received.message), made.port
        if pair not in self._alike:
            self._alike[pair] = types.type_hash(pair[0].DESCRIPTOR) == types.type_hash(made.kind.DESCRIPTOR)
        if self._alike[pair]:
            return made.put(live.dataclasses.replace(received, message=made.kind.FromString(received.payload)))
        made.rejected += 1
        self._complain(pair, f"{made.topic}: messages of node {received.source} are of another {pair[0].DESCRIPTOR.full_name} than "
                             f"input {made.port} takes ({made.kind.DESCRIPTOR.full_name}); ignored")

    # The record of steps.

    def took(self, made, received):
        sources = self._log.sources
        at = next((n for n, s in enumerate(sources) if (s.port, s.start_id) == (made.port, received.start_id)), len(sources))
        if at == len(sources):
            sources.add(port=made.port, topic=made.topic, node=received.source, start_id=received.start_id)
        self._record.taken.add(source=at, seq=received.seq)

    def begin(self, kind, now_ns):
        self._record.kind, self._record.time_ns, self._sent_before = kind, now_ns, self.count()
        self.step_ns = now_ns
        for service, asked, (failed, body) in self._requests_served:
            self._record.requests.add(service=service.partition("/")[2], request=asked,
                                      **({"failure": body.decode()} if failed == b"\1" else {"response": body}))
        self._requests_served.clear()

    def count(self):
        return sum(p._seq for topic, p in self._publications.items() if p not in self._own.values())

    def end(self, now_ns, last=False):
        self._record.published = self.count() - self._sent_before
        self._log.steps.add().CopyFrom(self._record)
        self._record.Clear()
        self._steps += 1
        if last or now_ns - self._log.steps[0].time_ns >= 100_000_000:
            log, self._log = self._log, types.message_type("mimesis.v1.StepLog")()
            self._log.first = self._steps
            self._own["steps"].send(self._own["steps"].message.FromString(log.SerializeToString()), now_ns)

    def start(self, node, now_ns):
        text = "".join(f"{p.key}: {json.dumps(p.value)}\n" for p in self._parameters.values())
        info = self._info
        self._own["start"].send(self._own["start"].message(
            node=self.name, executable=pathlib.Path(info.executable).name, start_id=self.start_id, clock=info.clock,
            parameters=text, inputs=[i for i in info.inputs if i.topic in self.policy], outputs=info.outputs), now_ns)

    def health(self, now_ns, steps, overruns, worst_s, mean_s):
        self._own["health"].send(self._own["health"].message(
            node=self.name, steps=steps, overruns=overruns, worst_step_s=worst_s, mean_step_s=mean_s, sent=self.count(),
            inputs=[{"topic": p.topic, "received": p.received, "lost": self._lost[p.topic], "dropped": p.dropped, "rejected": p.rejected,
                     "age_s": (now_ns - p.last_ns) * 1e-9 if p.last_ns else -1.0} for p in self._ports]), now_ns)


class _Clock:
    """Times of steps: wall, sim (topic clock/time) or lock-step (node clock). wait() gives None at the end."""

    def __init__(self, bus, node, stopped):
        self.bus, self.node, self.stopped, self.overruns = bus, node, stopped, 0
        self.period_ns, self.due = round(1e9 / node.rate_hz), None
        self.base = None  # of simulated time: time, wall time, factor
        self.socket = None
        if bus._info.clock == "sim":
            self.news = Input(bus, ".clock", types.message_type("mimesis.v1.ClockTime"), "latest")
            self.news.topic = "clock/time"
            bus.listen(self.news)

    def now_ns(self):
        if self.bus.lockstep:
            return self.bus.tick_ns
        if self.bus._info.clock == "wall":
            return self.bus.now_ns()
        return self.base[0] + round(self.base[2] * (self.bus.now_ns() - self.base[1])) if self.base else 0

    def wait(self):
        return self._conducted() if self.bus.lockstep else self._paced()

    def _paced(self):
        while not self.stopped():
            self.bus.look()
            if self.bus._info.clock == "sim":
                self.bus.gather()
                self.bus.deliver_all()
                news = self.news.waiting.pop().message if self.news.waiting else None
                if news is not None and news.ended:
                    return None
                if news is not None and news.factor > 0:
                    if self.base and news.time_ns < self.now_ns() - 1_000_000_000:
                        self.due = None  # the clock was started again
                    self.base = news.time_ns, news.wall_ns, news.factor
                if not self.base:
                    self.bus.gather(0.02)
                    continue
            now = self.now_ns()
            if self.due is None:
                first = (now // 1_000_000_000 * 1_000_000_000 if self.bus._info.clock == "wall" else 0) + round(
                    1e9 * self.node.offset_s)
                self.due = first + max(0, -(-(now - first) // self.period_ns)) * self.period_ns
            if now >= self.due:
                self.bus.gather()
                self.bus.deliver_all()
                return now
            factor = self.base[2] if self.base else 1.0
            self.bus.gather(min(0.02, (self.due - now) * 1e-9 / factor))
        return None

    def _conducted(self):
        while not self.stopped():
            self.bus.look()
            if self.socket is None and not self._join():
                self.bus.gather(0.005)
                continue
            if not select.select([self.socket], [], [], 0.02)[0]:
                self.bus.gather()
                continue
            try:
                packet = self.socket.recv(1 << 20)
            except OSError:
                packet = b""
            if not packet:
                self.socket = None
                continue
            go = types.message_type("mimesis.v1.StepGo").FromString(packet)
            if go.ended:
                return None
            if go.generation != self.generation:
                self.generation = go.generation
                self.bus.meet_members()
            self.bus.tick_ns = go.time_ns
            self.bus.deliver(go.visible)
            return go.time_ns
        return None

    def _published(self):
        out = [{"topic": t, "start_id": self.bus.start_id, "seq": n, "latched": latched} for t, n, latched in self.bus.published]
        self.bus.published.clear()
        return out

    def _join(self):
        made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        join = types.message_type("mimesis.v1.LockstepJoin")(
            node=self.bus.name, start_id=self.bus.start_id, rate_hz=self.node.rate_hz, offset_s=self.node.offset_s,
            inputs=list(self.bus.policy), resume_ns=self.bus.tick_ns)
        try:
            made.connect(str(self.bus.directory / "clock.sock"))
            for publication in self._published():
                join.published.add(**publication)
            made.send(join.SerializeToString())
        except OSError:
            made.close()
            return False
        self.socket, self.generation, self.step = made, 0, 0
        return True

    def done(self):
        if self.bus.lockstep:
            self.step += 1
            report = types.message_type("mimesis.v1.StepReport")(step=self.step, published=self._published())
            try:
                self.socket.send(report.SerializeToString())
            except OSError:
                self.socket = None
            return
        self.due += self.period_ns
        late = self.now_ns() - self.due
        if late >= 0:
            self.overruns += 1
            self.due += (late // self.period_ns + 1) * self.period_ns


def notify(word):
    """To a service manager, and to the launcher."""
    for prefix in ("", "MIMESIS_"):
        path = os.environ.get(prefix + "NOTIFY_SOCKET", "")
        if path[:1] in ("/", "@"):
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to:
                try:
                    to.sendto(word.encode(), socket.MSG_DONTWAIT, path if path[0] == "/" else "\0" + path[1:])
                except OSError:
                    pass  # nobody listens


def _live_run(node, options):
    ends = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ends.append(True))
    with _Live(options) as bus:
        bus.own_topics()
        bus.begin(CREATE, 0)
        node.make(bus, options)
        bus.end(0)
        clock = _Clock(bus, node, lambda: bool(ends))
        bus._announce()
        bus.greet()
        bus.meet_members()
        bus.announce_ready()
        notify("READY=1")
        steps = worst = total = since = code = 0
        next_ns = None
        while not code and (now := clock.wait()) is not None:
            if steps == 0:
                bus.start(node, now)
            began = time.monotonic()
            bus.begin(STEP, now)
            try:
                node.step(now)
            except Exception:  # it still stops what it moves
                traceback.print_exc()
                code = 1
            bus.end(now)
            took, steps, since = time.monotonic() - began, steps + 1, since + 1
            worst, total = max(worst, took), total + took
            next_ns = next_ns or now + 1_000_000_000
            if now >= next_ns:
                bus.health(now, steps, clock.overruns, worst, total / since)
                worst = total = since = 0
                next_ns += (now - next_ns) // 1_000_000_000 * 1_000_000_000 + 1_000_000_000
            clock.done()
        notify("STOPPING=1")
        now = clock.now_ns()
        bus.begin(STOP, now)
        node.stop(now)
        bus.end(now, last=True)
        notify("WATCHDOG=1")
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)  # else one that comes now kills the interpreter
    return code


def _replay(node, options):
    """Steps that come from `mimesis log replay`, and what they make, until the stream ends."""
    stream, bus = socket.socket(fileno=options.replay), _Memory(options.name)

    def read(size):
        data = b""
        while len(data) < size:
            part = stream.recv(size - len(data))
            if not part:
                raise EOFError
            data += part
        return data

    kinds = {n: types.message_type(f"mimesis.v1.{n}") for n in ("ReplayStep", "ReplayOutcome")}
    try:
        while True:
            step = kinds["ReplayStep"].FromString(read(struct.unpack("<I", read(4))[0]))
            outcome, bus.time_ns = kinds["ReplayOutcome"](), step.step.time_ns
            try:
                for m in step.inputs:
                    made = node._inputs[m.port]
                    made.put(live.Received(made.topic, made.kind.FromString(m.payload), m.stamp_ns, m.seq, m.node, 0, m.payload))
                for asked in step.step.requests:
                    failed, body = bus._answer(f"{options.name}/{asked.service}", asked.request)
                    outcome.served.add(service=asked.service, request=asked.request,
                                       **({"failure": body.decode()} if failed == b"\1" else {"response": body}))
                if step.step.kind == CREATE:
                    node.make(bus, options)
                else:
                    (node.step if step.step.kind == STEP else node.stop)(step.step.time_ns)
            except Exception as error:  # told, as of any step that fails
                outcome.failed, outcome.problem = True, f"{type(error).__name__}: {error}"
            for topic, payload, stamp_ns, seq in bus.sent:
                outcome.outputs.add(topic=topic, payload=payload, stamp_ns=stamp_ns, seq=seq)
            bus.sent.clear()
            packet = outcome.SerializeToString()
            stream.sendall(struct.pack("<I", len(packet)) + packet)
    except EOFError:
        return 0


def _file_params(given, arguments):
    """Parameters of FILE or FILE#PATH: lines `key: JSON`, as a record of a run has them, or YAML with ${arg:NAME}."""
    name, _, path = given.partition("#")
    try:
        text = pathlib.Path(name).read_text()
        lines = [line.partition(": ") for line in text.splitlines()]
        if not path and all(colon for _, colon, _ in lines):
            return {key: json.loads(value) for key, _, value in lines}
    except (OSError, UnicodeDecodeError) as error:
        raise Refused(f"{name}: {error}") from None
    except ValueError:
        pass
    try:
        import yaml
    except ImportError:
        raise Refused(f"{name}: a launch file's parameters of a node in Python need the package python3-yaml") from None
    try:
        tree = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise Refused(f"{name}: {' '.join(str(error).split())}") from None
    declared = tree.get("args") if isinstance(tree, dict) and isinstance(tree.get("args"), dict) else {}
    known = {k: v["default"] for k, v in declared.items() if isinstance(v, dict) and v.get("default") is not None}
    known.update(a.partition("=")[::2] for a in arguments)
    for key in filter(None, path.split(".")):
        tree = tree.get(key) if isinstance(tree, dict) else None
    if not isinstance(tree, dict):
        raise Refused(f"{given}: expected parameters as a map")

    def fill(match):
        if match[1] not in known:
            raise Refused(f"{given}: '{match[0]}' is not known to a node in Python, expected ${{arg:NAME}} of the file")
        return str(known[match[1]]).lower() if isinstance(known[match[1]], bool) else str(known[match[1]])

    return {k: re.sub(r"\$\{(?:arg:)?([^}]*)\}", fill, v) if isinstance(v, str) else v for k, v in tree.items()}


def run(kind, argv=None):
    """Runs a Node class with the options that nodes have; the exit code."""
    words = argparse.ArgumentParser(description=kind.about, allow_abbrev=False)
    words.add_argument("--name", default=re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower(), help="name of the node")
    words.add_argument("--graph", help="graph to join (default: $MIMESIS_GRAPH, or 'default')")
    words.add_argument("--clock", choices=("wall", "sim", "lockstep"), default="wall")
    words.add_argument("--bind", help="tcp://ADDRESS:PORT for other hosts")
    words.add_argument("--params", metavar="FILE[#PATH]", help="parameters")
    words.add_argument("--replay", type=int, metavar="FD", help="steps that `mimesis log replay` sends")
    for option, metavar, text in (("--set", "KEY=VALUE", "sets a parameter"), ("--arg", "NAME=VALUE", "an argument of the file"),
                                  ("--in", "PORT=TOPIC", "wires an input"), ("--out", "PORT=TOPIC", "wires an output"),
                                  ("--from", "PORT=NODE", "its publisher, which no input of such a node asks for")):
        words.add_argument(option, action="append", default=[], metavar=metavar, help=text, dest=option[2:] + "_words")
    words.add_argument("--describe", action="store_true", help="prints ports, services and parameters as JSON")
    words.add_argument("--check", action="store_true", help="makes the node without sockets: exit code 0 or 2")
    options = words.parse_args(argv)
    pairs = {o: dict(w.partition("=")[::2] for w in getattr(options, o + "_words")) for o in ("set", "in", "out")}
    options.wired_in, options.wired_out = pairs["in"], pairs["out"]
    node = kind()
    try:
        given = _file_params(options.params, options.arg_words) if options.params else {}
        options.given = {**given, **pairs["set"]}
        if options.describe or options.check:
            bus = _Memory(options.name)
            node.make(bus, options)
            if options.describe:
                print(node.describe(pathlib.Path(sys.argv[0]).name), flush=True)
            return 0
        return _live_run(node, options) if options.replay is None else _replay(node, options)
    except (Refused, ValueError, PermissionError, types.MessageTypeError) as error:
        print(f"{options.name}: {error}", file=sys.stderr)
        return 2
