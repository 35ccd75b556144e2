"""A Python process as a node of a graph: registry entry, sockets, wire format (docs/architecture.md)."""
import collections
import dataclasses
import fcntl
import json
import math
import os
import pathlib
import secrets
import socket
import stat
import struct
import sys
import tempfile
import time
import typing

import zmq
from google.protobuf.message import DecodeError

from . import hosts, types

HEADER = struct.Struct("<QqQQQ")  # seq, stamp [ns], type hash, start id, tick [ns]
FLOCK = struct.Struct("@hhqqi4x")  # struct flock of 64-bit Linux
HELLO = b"\xff"  # begins the subscription by which a reliable subscriber names itself
POLL_MS = 20
LARGEST_MESSAGE = 64 << 20  # bytes of a frame, as in common/runtime/wire.h
LARGEST_INFO = 16 << 20  # bytes of a NodeInfo, as in common/runtime/registry.cc


class ServiceError(Exception):
    """A service that is not there, does not answer, or answers with a reason; raised by one that refuses."""


@dataclasses.dataclass(frozen=True)
class Received:
    topic: str
    message: typing.Any  # has the type that the publisher announced
    stamp_ns: int  # graph time of the content
    seq: int  # number within this publisher and topic, from 1, without gaps
    source: str  # name of the publishing node
    start_id: int = 0  # of that node
    payload: bytes = b""  # the serialised message


def _lock(kind):
    return FLOCK.pack(kind, os.SEEK_SET, 0, 0, 0)


def _check_name(what, name):
    allowed = all(c.isascii() and (c.isalnum() or c in "_-.") for c in name)
    if not (0 < len(name) <= 64 and allowed and name[0] != "."):
        raise ValueError(f"{what} '{name}' is invalid: expected 1 to 64 letters, digits, '_', '-' or '.'")


def graph_directory(graph):
    """Where the graph's nodes meet: as common/runtime/registry.cc finds it."""
    _check_name("graph name", graph)
    runtime, own = os.environ.get("XDG_RUNTIME_DIR", ""), os.environ.get("MIMESIS_RUNTIME_DIR", "")
    if own.startswith("/"):
        base = pathlib.Path(own)
    elif runtime.startswith("/"):
        base = pathlib.Path(runtime, "mimesis")
    else:
        namespace = os.stat("/proc/self/ns/user").st_ino
        user = f"{os.geteuid()}" + ("" if namespace == 0xEFFFFFFD else f"-{namespace}")
        memory = "TMPDIR" not in os.environ and os.access("/dev/shm", os.W_OK | os.X_OK)
        base = pathlib.Path("/dev/shm" if memory else tempfile.gettempdir(), f"mimesis-{user}")
    for path in (base, base / graph, base / graph / "nodes"):
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o077:
            raise PermissionError(f"{path}: expected a directory of this user alone (mode 0700); MIMESIS_RUNTIME_DIR names another")
    return base / graph


def _wall_clock(directory):
    """The file that the graph's living nodes share, and the graph's time less monotonic time [ns] in it."""
    file = open(os.open(directory / "wall_clock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600), "r+", encoding="latin-1")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        file.truncate()
        print(time.time_ns() - time.monotonic_ns(), file=file, flush=True)
    except BlockingIOError:
        pass  # others are alive
    fcntl.flock(file, fcntl.LOCK_SH)
    file.seek(0)
    return file, int(file.readline())


def stamp(message, stamp_ns, seq):
    """Writes the header of a message, where it has one."""
    if "header" in message.DESCRIPTOR.fields_by_name:
        message.header.stamp_ns, message.header.seq = stamp_ns, seq
    elif "timestamp" in message.DESCRIPTOR.fields_by_name:  # of foxglove.*
        message.timestamp.FromNanoseconds(stamp_ns)


class Publication:
    """One topic of this process. send() stamps `header` where the message has one, and counts seq."""

    def __init__(self, graph, topic, message, latched):
        self._graph, self.topic, self.message, self.latched = graph, topic, message, latched
        self._hash = types.type_hash(message.DESCRIPTOR)
        self._seq, self._last = 0, None

    def send(self, message, stamp_ns=None):
        """Publishes one message; never blocks. stamp_ns: time of the content, by default now, or that of a node's step."""
        if message.DESCRIPTOR.full_name != self.message.DESCRIPTOR.full_name:
            raise types.MessageTypeError(
                f"{self.topic} carries {self.message.DESCRIPTOR.full_name}, not {message.DESCRIPTOR.full_name}")
        if message.ByteSize() > LARGEST_MESSAGE:
            raise ValueError(f"{self.topic}: a message of {message.ByteSize()} bytes, expected at most {LARGEST_MESSAGE}")
        self._seq += 1
        now_ns = self._graph.now_ns() if self._graph.step_ns is None else self._graph.step_ns
        stamp_ns = now_ns if stamp_ns is None else int(stamp_ns)
        stamp(message, stamp_ns, self._seq)
        graph = self._graph
        frame = self.topic.encode() + b"\0" + HEADER.pack(self._seq, stamp_ns, self._hash, graph.start_id, graph.tick_ns)
        if graph.published is not None:
            graph.published.append((self.topic, self._seq, self.latched))
        self._last = [frame, message.SerializeToString(deterministic=True)]
        self._graph.serve()
        for out in self._graph.outputs:
            out.send_multipart(self._last, zmq.DONTWAIT)

    def repeat(self, out):
        if self.latched and self._last:
            out.send_multipart(self._last, zmq.DONTWAIT)


class Parameter:
    """A value that `mimesis param set` changes while the process runs: read `value` where it is used."""

    def __init__(self, key, value, least, most, meaning):
        self.key, self.value, self.least, self.most, self.meaning = key, value, least, most, meaning
        self.changeable = True  # while the process runs

    def read(self, text):
        """The value that `text` stands for. Raises ValueError."""
        kind = type(self.value)
        if kind is str:
            return text
        try:
            value = {"true": True, "false": False}[text] if kind is bool else kind(text)
        except (KeyError, ValueError):
            raise ValueError(f"{self.key}: '{text}' is no {kind.__name__}") from None
        if kind is not bool and not (math.isfinite(value) and self.least <= value <= self.most):
            raise ValueError(f"{self.key}: {text} is outside [{self.least}, {self.most}]")
        return value

    def describe(self, entry):
        """Fills a v1.Param."""
        entry.key, entry.value = self.key, json.dumps(self.value)
        entry.changeable, entry.meaning = self.changeable, self.meaning
        entry.type = {float: "number", int: "integer", bool: "bool", str: "text"}[type(self.value)]
        if entry.type in ("number", "integer") and math.isfinite(self.most - self.least):
            entry.allowed = f"[{self.least}, {self.most}]"


class Services:
    """What a process offers under its name, and its parameters."""

    def __init__(self, name):
        self.name, self._offered, self._parameters = name, {}, {}

    def offer(self, name, request, answer, act):
        request, answer = (types.message_type(k) if isinstance(k, str) else k for k in (request, answer))
        service = f"{self.name}/{name}"
        if service in self._offered:
            raise ValueError(f"{service} is offered already")
        self._offered[service] = (request, answer, act)
        return service, request, answer

    def parameter(self, key, value, least=-math.inf, most=math.inf, meaning=""):
        """A Parameter that starts as `value`, a float, int, bool or str, within [least, most]."""
        if not self._parameters:
            self.offer("params", "mimesis.v1.ParamRequest", "mimesis.v1.ParamSet", self._change)
        made = self._parameters[key] = Parameter(key, value, least, most, meaning)
        return made

    def _answer(self, service, body):
        """Frames: whether it failed, and the answer or the reason."""
        request, answer, act = self._offered.get(service, (None,) * 3)
        try:
            if request is None:
                raise ServiceError(f"no service {service} here")
            done = act(request.FromString(body))
            return [b"\0", (answer(**done) if isinstance(done, dict) else done).SerializeToString()]
        except DecodeError:
            return [b"\1", f"expected a {request.DESCRIPTOR.full_name}".encode()]
        except ServiceError as error:
            return [b"\1", str(error).encode()]

    def _change(self, request):
        try:
            if request.log_level:
                raise ValueError("a process in Python has no log level")
            unknown = [s.key for s in request.set if s.key not in self._parameters]
            if unknown:
                raise ValueError(f"{unknown[0]}: unknown parameter; there are: {', '.join(self._parameters)}")
            fixed = [s.key for s in request.set if not self._parameters[s.key].changeable]
            if fixed:
                raise ValueError(f"{fixed[0]}: cannot be changed while the node runs")
            values = {s.key: self._parameters[s.key].read(s.value) for s in request.set}
        except ValueError as error:
            raise ServiceError(f"{self.name}.{error}") from None
        for key, value in values.items():  # all of them, or none
            self._parameters[key].value = value
        answer = types.message_type("mimesis.v1.ParamSet")()
        for parameter in self._parameters.values():
            parameter.describe(answer.params.add())
        return answer


class Graph(Services):
    """Joins a graph as node `name`. Use it in `with`, or close() it; one thread only.

    bind: "tcp://ADDRESS:PORT" for other hosts, data on PORT+1 and reliable data on PORT+2, PORT "*": any. A launcher of
    several hosts gives it as MIMESIS_BIND."""

    def __init__(self, name=None, graph=None, bind=None, clock="wall", ready=True):
        super().__init__(name or f"python-{os.getpid()}")
        _check_name("node name", self.name)
        self.tick_ns, self.step_ns = 0, None  # of a node's step: in lock-step, on any clock
        self.published, self.on_served = None, None  # a list: of what was sent, in lock-step
        self.greeted = set()  # start ids of reliable subscribers
        self.start_id = secrets.randbits(63) | 1
        self.directory = graph_directory(graph or os.environ.get("MIMESIS_GRAPH") or "default")
        self._publications, self._nodes = {}, {}
        self._inbox, self._seen, self._complained = collections.defaultdict(collections.deque), {}, set()
        self._connected, self._wanted = set(), set()
        self._lost, self._subscribers = collections.Counter(), collections.Counter()
        self._take_name()
        self._clock, self._offset_ns = _wall_clock(self.directory)
        self._context = zmq.Context()
        self._gate = hosts.Gate(self._context)
        self.outputs = [self._socket(zmq.XPUB) for _ in range(2)]  # data, reliable
        for out, high_water in zip(self.outputs, (32, 0)):
            out.setsockopt(zmq.XPUB_VERBOSER, 1)
            out.setsockopt(zmq.SNDHWM, high_water)
        self._requests = self._socket(zmq.ROUTER)
        self._inputs = {policy: self._socket(zmq.SUB) for policy in ("latest", "reliable")}
        for into in self._inputs.values():
            into.setsockopt(zmq.SUBSCRIBE, HELLO + struct.pack("<Q", self.start_id))
        self._info = types.message_type("mimesis.v1.NodeInfo")(
            name=self.name, host=socket.gethostname(), pid=os.getpid(), start_id=self.start_id, ready=ready,
            executable=sys.argv[0] or sys.executable, clock=clock, started_ns=self.now_ns())
        stem = f"ipc://{self.directory}/{self.name}-{self.start_id % 100_000_000}"
        bind = bind or os.environ.get("MIMESIS_BIND", "")
        at, _, port = bind.rpartition(":")
        lists = self._info.service_endpoints, self._info.data_endpoints, self._info.reliable_endpoints
        for n, (out, suffix, listed) in enumerate(zip((self._requests, *self.outputs), (".s", ".d", ".r"), lists)):
            out.bind(stem + suffix)
            listed.append(stem + suffix)
            if bind:
                listed.append(self._gate.bind(out, f"{at}:{port if port == '*' else int(port) + n}"))
        self._info.public_key = self._gate.public_key.decode()
        self._announce()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.close()
        return kind is KeyboardInterrupt  # Ctrl-C, and the launcher's stop, end the block

    def close(self):
        """Leaves the graph; a second call does nothing."""
        if self._context.closed:
            return
        endpoints = (*self._info.service_endpoints, *self._info.data_endpoints, *self._info.reliable_endpoints)
        sockets = [e.removeprefix("ipc://") for e in endpoints if e.startswith("ipc://")]
        for path in (self._entry, self._entry.with_name("." + self.name), *sockets):
            pathlib.Path(path).unlink(missing_ok=True)
        for into in self._inputs.values():
            into.close(linger=0)  # subscriptions would wait for publishers that have ended
        self._context.destroy(linger=1000)
        os.close(self._claim)
        self._clock.close()

    def nodes(self):
        """The v1.NodeInfo of every live node of the graph, by name; not this process."""
        self._discover()
        return dict(self._nodes)

    def topics(self):
        """Full type name of every topic that a node publishes."""
        return {o.topic: o.type for info in self.nodes().values() for o in info.outputs}

    def publish(self, topic, message_type, latched=False, into_live=False):
        """A topic to send on. message_type: a class, or the name of one of this project's.

        PermissionError if a node takes the topic from another node alone, unless `into_live`: then that node refuses it."""
        for node in self.nodes().values():
            for taken in node.inputs:
                if taken.topic == topic and taken.obeys not in ("", self.name) and not into_live:
                    raise PermissionError(f"node {node.name} takes topic {topic} from node {taken.obeys} alone: it refuses "
                                          f"messages of node {self.name}")
        kind = types.message_type(message_type) if isinstance(message_type, str) else message_type
        if topic in self._publications:
            raise ValueError(f"{topic} is published already")
        publication = self._publications[topic] = Publication(self, topic, kind, latched)
        descriptor = kind.DESCRIPTOR
        self._info.outputs.add(topic=topic, port=topic.split("/")[-1], type=descriptor.full_name,
                               type_hash=types.type_hash(descriptor), latched=latched)
        self._info.descriptors[descriptor.full_name] = types.descriptor_set(descriptor)
        self._announce()
        return publication

    def offer(self, name, request, answer, act):
        """Offers service NODE/`name`: act(request) gives the answer, or raises ServiceError with the reason of a refusal.

        request, answer: classes, or names of this project's. Answered whenever this process waits: in every() and subscribe()."""
        service, request, answer = super().offer(name, request, answer, act)
        added = self._info.services.add(service=service, request_type=request.DESCRIPTOR.full_name,
                                        response_type=answer.DESCRIPTOR.full_name)
        for kind in (request, answer):
            added.type_hash = (added.type_hash * 31 + types.type_hash(kind.DESCRIPTOR)) & 0xFFFFFFFFFFFFFFFF
            self._info.descriptors[kind.DESCRIPTOR.full_name] = types.descriptor_set(kind.DESCRIPTOR)
        self._announce()

    def every(self, period_s):
        """Yields the graph's time [ns] each period_s seconds, and answers requests in between."""
        due = time.monotonic()
        while True:
            yield self.now_ns()
            due = max(due + period_s, time.monotonic())
            while (left_s := due - time.monotonic()) > 0:
                self._requests.poll(min(POLL_MS, 1000 * left_s))
                self.serve()

    def now_ns(self):
        """The graph's wall clock [ns]: setting the system's does not move it."""
        return time.monotonic_ns() + self._offset_ns

    def wait_for_subscriber(self, topic, timeout_s=5.0):
        """True once a subscription to `topic` is in force."""
        for _ in self._until(timeout_s):
            if self._subscribers[topic] > 0:
                return True
        return False

    def subscribe(self, *topics, policy="latest", timeout_s=None):
        """Yields Received messages on the topics; ends after timeout_s without a message (None: never).

        policy "latest" may lose messages when this process is slow (lost() counts them), "reliable" holds the
        publisher's backlog instead. Subscription begins with the call."""
        for topic in topics:
            self._inputs[policy].setsockopt(zmq.SUBSCRIBE, topic.encode() + b"\0")
        self._wanted |= {(t, policy) for t in topics}
        return self._messages(topics, timeout_s)

    def lost(self, topic):
        """Messages of `topic` that were published but not received, by gaps in seq."""
        return self._lost[topic]

    def call(self, service, request, timeout_s=5.0):
        """Answer of a service, e.g. call("world/reset", request), typed as its node announced.

        request: a message, or a dict of fields. Raises ServiceError."""
        for _ in self._until(timeout_s):
            for node in self._nodes.values():
                for offered in node.services:
                    if offered.service == service and node.service_endpoints:
                        return self._ask(node, offered, request, timeout_s)
        raise ServiceError(f"no node offers service {service} within {timeout_s} s")

    def serve(self):
        """Lets other hosts in, answers requests, and repeats latched messages to new subscribers; send(), every() and
        subscribe() call it."""
        self._gate.serve()
        while self._requests.poll(0):
            frames = self._requests.recv_multipart()
            if len(frames) == 4:
                service = frames[2].decode(errors="replace")
                answer = self._answer(service, frames[3])
                self._requests.send_multipart([*frames[:2], *answer])
                if self.on_served and service in self._offered:
                    self.on_served(service, frames[3], answer)
        for out in self.outputs:
            while out.poll(0):
                subscription = out.recv()
                if subscription[1:2] == HELLO:
                    if subscription[:1] == b"\1" and len(subscription) == 10:
                        self.greeted.add(struct.unpack("<Q", subscription[2:])[0])
                    continue
                topic, joined = subscription[1:-1].decode(errors="replace"), subscription[:1] == b"\1"
                self._subscribers[topic] += 1 if joined else -1
                if joined and topic in self._publications:
                    self._publications[topic].repeat(out)

    def _socket(self, kind):
        made = self._context.socket(kind)
        made.setsockopt(zmq.LINGER, 1000)
        made.setsockopt(zmq.MAXMSGSIZE, LARGEST_MESSAGE)
        return made

    def _take_name(self):
        self._entry = self.directory / "nodes" / self.name
        hidden = self._entry.with_name("." + self.name)
        while True:
            self._claim = os.open(hidden, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
            try:
                fcntl.fcntl(self._claim, fcntl.F_OFD_SETLK, _lock(fcntl.F_WRLCK))
            except OSError:
                os.close(self._claim)
                raise ValueError(f"a node '{self.name}' runs already in {self.directory}") from None
            try:
                if os.path.samestat(hidden.stat(), os.fstat(self._claim)):
                    return
            except FileNotFoundError:
                pass
            os.close(self._claim)  # a process that cleans has removed it in between

    def _announce(self):
        temporary = self._entry.with_name("." + self.name + ".new")
        temporary.write_bytes(self._info.SerializeToString())
        temporary.rename(self._entry)

    def _complain(self, about, what):
        if about not in self._complained:
            self._complained.add(about)
            printable = "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in what)
            print(f"mimesis: {printable}", file=sys.stderr)

    def _open_entry(self, name):
        """Descriptor of a regular file in nodes/, or None: others may put links, FIFOs or folders there."""
        path = self._entry.with_name(name)
        try:
            fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
            if stat.S_ISREG(os.fstat(fd).st_mode):
                return fd
            os.close(fd)
        except FileNotFoundError:
            return None
        except OSError:
            pass
        self._complain(path, f"{path}: expected a regular file; it is skipped")
        return None

    def _read_info(self, name):
        """The NodeInfo of a node, or None."""
        fd = self._open_entry(name)
        if fd is None:
            return None
        with open(fd, "rb") as file:
            try:
                info = types.message_type("mimesis.v1.NodeInfo").FromString(file.read(LARGEST_INFO))
                if info.name == name and info.start_id != 0:
                    return info
            except DecodeError:
                pass
        path = self._entry.with_name(name)
        self._complain(path, f"{path}: expected the NodeInfo of node {name}; it is skipped")
        return None

    def _is_alive(self, name):
        fd = self._open_entry("." + name)
        if fd is None:
            return False
        try:
            return FLOCK.unpack(fcntl.fcntl(fd, fcntl.F_OFD_GETLK, _lock(fcntl.F_WRLCK)))[0] != fcntl.F_UNLCK
        finally:
            os.close(fd)

    def _discover(self):
        found = {}
        for path in self._entry.parent.iterdir():
            if path.name.startswith(".") or path.name == self.name or not self._is_alive(path.name):
                continue
            info = self._read_info(path.name)
            if info:
                found[path.name] = info
        self._nodes = found
        for node in found.values():
            for output in node.outputs:
                for policy in self._inputs:
                    if (output.topic, policy) in self._wanted:
                        self._meet(node, output, policy)

    def _meet(self, node, output, policy):
        """Connects to a publisher, and announces an input of the type that the publisher announced."""
        endpoints = node.reliable_endpoints if policy == "reliable" else node.data_endpoints
        if endpoints and endpoints[0] not in self._connected:
            self._connected.add(endpoints[0])
            try:
                if not self._gate.connect(self._inputs[policy], endpoints[0], node.public_key):
                    self._connected.discard(endpoints[0])  # it may be trusted later
            except zmq.ZMQError as error:
                self._complain(endpoints[0], f"node {node.name}: endpoint '{endpoints[0]}': {error}")
        if not any(i.topic == output.topic for i in self._info.inputs):
            self._info.inputs.add(topic=output.topic, port=output.topic.replace("/", "_"), type=output.type,
                                  type_hash=output.type_hash, policy=policy)
            self._announce()

    def _until(self, timeout_s):
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            self._discover()
            self.serve()
            yield
            if deadline is not None and time.monotonic() >= deadline:
                return
            time.sleep(POLL_MS / 1000)

    def _messages(self, topics, timeout_s):
        poller = zmq.Poller()
        for into in self._inputs.values():
            poller.register(into, zmq.POLLIN)
        poller.register(self._requests, zmq.POLLIN)
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        looked = 0.0
        while True:
            for topic in topics:
                while self._inbox[topic]:
                    yield self._inbox[topic].popleft()
                    deadline = None if timeout_s is None else time.monotonic() + timeout_s
            if deadline is not None and time.monotonic() >= deadline:
                return
            if time.monotonic() - looked > POLL_MS / 1000:
                self._discover()
                self.serve()
                looked = time.monotonic()
            for into, _ in poller.poll(POLL_MS):
                if into is self._requests:
                    self.serve()
                else:
                    self._take(into)

    def _take(self, into):
        while into.poll(0):
            frames = into.recv_multipart()
            name, separator, header = frames[0].partition(b"\0")
            if len(frames) != 2 or not separator or len(header) != HEADER.size:
                continue
            topic = name.decode(errors="replace")
            seq, stamp, kind, start_id, _ = HEADER.unpack(header)
            last = self._seen.get((start_id, topic))
            if last is not None and seq <= last:
                continue  # a latched message again
            self._seen[start_id, topic] = seq
            gap = 0 if last is None else seq - last - 1
            self._lost[topic] += gap
            if gap and into is self._inputs["reliable"]:  # the publisher counts what it could not deliver
                for tell in (zmq.SUBSCRIBE, zmq.UNSUBSCRIBE):
                    into.setsockopt(tell, HELLO + struct.pack("<QQ", start_id, gap))
            node = next((n for n in self._nodes.values() if n.start_id == start_id), None)
            output = node and next((o for o in node.outputs if o.topic == topic and o.type_hash == kind), None)
            if not output:
                self._complain((start_id, topic), f"{topic}: messages of a type that no node announced are ignored")
                continue
            try:
                content = types.classes_of(node.descriptors[output.type])[output.type].FromString(frames[1])
            except (DecodeError, KeyError, types.MessageTypeError) as error:
                self._complain((start_id, topic), f"{topic}: messages of node {node.name} cannot be read: {error}")
                continue
            self._inbox[topic].append(Received(topic, content, stamp, seq, node.name, start_id, frames[1]))

    def _ask(self, node, offered, request, timeout_s):
        try:
            kind, answer = (types.classes_of(node.descriptors[t])[t] for t in (offered.request_type, offered.response_type))
        except (KeyError, types.MessageTypeError) as error:
            raise ServiceError(f"service {offered.service} of node {node.name}: {error}") from None
        if isinstance(request, dict):
            try:
                request = kind(**request)
            except (TypeError, ValueError) as error:
                raise ServiceError(f"{offered.service}: {error}; expected fields of {offered.request_type}") from None
        if request.DESCRIPTOR.full_name != offered.request_type:
            raise ServiceError(f"{offered.service} takes {offered.request_type}, not {request.DESCRIPTOR.full_name}")
        client = self._socket(zmq.DEALER)
        try:
            if not self._gate.connect(client, node.service_endpoints[0], node.public_key):
                raise ServiceError(f"service {offered.service}: node {node.name} is on a host that is not trusted")
            client.send_multipart([secrets.token_bytes(8), offered.service.encode(), request.SerializeToString()])
            if not client.poll(round(timeout_s * 1000)):
                raise ServiceError(f"service {offered.service}: no answer from node {node.name} within {timeout_s} s")
            _, status, body = client.recv_multipart()
        finally:
            client.close(linger=0)
        if status != b"\0":
            raise ServiceError(f"service {offered.service}: {body.decode(errors='replace')}")
        return answer.FromString(body)
