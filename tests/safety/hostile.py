"""Messages that no node sends, to every socket and folder of a running graph."""
import contextlib
import os
import pathlib
import socket
import struct
import time

import zmq
from google.protobuf import descriptor_pb2

import strangers
import trial  # noqa: F401  finds the package mimesis
import mimesis
from mimesis import graph as wire

SPREADS_S = (4.0, 4.0, 0.1)  # the messages of a trial come over one of these times
NUMBERS = (float("nan"), float("inf"), -float("inf"), 0.0, -1.0, 1e300, -1e-300, 7.5)
INTEGERS = (0, 1, -1, 7, 2**31 - 1, -2**31)
STAMPS = (0, 1, -1, 2**63 - 1, -2**63, 10**9, 4 * 10**18)


def rubbish(rng, most=400):
    return rng.randbytes(rng.choice((0, 1, 7, rng.randrange(most))))


def mutated(rng, data):
    """A valid message with some bytes changed, cut off, repeated or put in."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(data) + 1)
        how = rng.randrange(5)
        if how == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif how == 1:
            del data[at:]
        elif how == 2:
            data[at:at] = rng.randbytes(rng.randrange(1, 20))
        elif how == 3:
            del data[at:at + rng.randrange(1, 20)]
        else:
            data += data[at:][:4096]
    return bytes(data)


def fill(message, rng, depth=0):
    """Sets every field to something that may be out of any range."""
    for field in message.DESCRIPTOR.fields:
        if depth > 2 or field.name == "header" or rng.random() < 0.2:
            continue
        repeated = field.label == field.LABEL_REPEATED
        if repeated and field.message_type and field.message_type.GetOptions().map_entry:
            continue
        length = rng.choice((0, 1, 7, 7, 30, 1000)) if repeated else 1
        if field.type == field.TYPE_MESSAGE:
            for _ in range(min(length, 8)):
                fill(getattr(message, field.name).add() if repeated else getattr(message, field.name), rng, depth + 1)
            continue
        values = [_value(field, rng) for _ in range(length)]
        if repeated:
            getattr(message, field.name).extend(values)
        else:
            setattr(message, field.name, values[0])
    return message


def _value(field, rng):
    kind = field.cpp_type
    if kind in (field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT):
        return rng.choice(NUMBERS)
    if kind == field.CPPTYPE_BOOL:
        return rng.random() < 0.5
    if kind == field.CPPTYPE_ENUM:
        return rng.choice([v.number for v in field.enum_type.values] + [77])
    if field.type == field.TYPE_BYTES:
        return rubbish(rng)
    if kind == field.CPPTYPE_STRING:
        return "".join(rng.choice("a/\0\x1bé.~") for _ in range(rng.choice((0, 1, 20, 3000))))
    value = rng.choice(INTEGERS)
    return abs(value) if kind in (field.CPPTYPE_UINT32, field.CPPTYPE_UINT64) else value


def redefined(rng, kind, definition):
    """A FileDescriptorSet that turns on an option of one field of a type: Protobuf throws when it reads a weak one."""
    files = descriptor_pb2.FileDescriptorSet.FromString(definition)
    fields = [f for file in files.file for m in file.message_type if kind.endswith("." + m.name) for f in m.field]
    if fields:
        options = rng.choice(fields).options
        setattr(options, rng.choice([f.name for f in options.DESCRIPTOR.fields if f.type == f.TYPE_BOOL]), True)
    return files.SerializeToString()


def pace(rng, count):
    """Numbers 0 .. count - 1, spread evenly over a time that the seed chooses."""
    begin, spread_s = time.monotonic(), rng.choice(SPREADS_S)
    for n in range(count):
        time.sleep(max(0.0, begin + spread_s * n / count - time.monotonic()))
        yield n


def topics(run, rng, count):
    """A node that publishes on the topics that others listen to: wrong types, numbers, sizes, stamps, start ids, orders."""
    with mimesis.Graph("rogue") as rogue:
        nodes = rogue.nodes()
        inputs = sorted({(i.topic, i.type) for n in nodes.values() for i in n.inputs if n.name != "observer"} - {("", "")})
        inputs = [(t, k) for t, k in inputs if k]
        starts = {o.topic: (n.start_id, o.type_hash) for n in nodes.values() for o in n.outputs}
        starts[run.scenario.truth] = (0, starts[run.scenario.truth][1])  # the observer believes it
        for topic, kind in inputs:
            with contextlib.suppress(ValueError):
                rogue.publish(topic, kind, into_live=True)
        time.sleep(0.2)
        for n in pace(rng, count):
            topic, kind = rng.choice(inputs)
            start, kind_hash = starts.get(topic, (rogue.start_id, 0))
            header = wire.HEADER.pack(rng.choice((n + 1, 0, 2**64 - 1, rng.randrange(10**6))),
                                      rng.choice(STAMPS + (rogue.now_ns(),) * 4), rng.choice((kind_hash, kind_hash, 77)),
                                      rng.choice((rogue.start_id, rogue.start_id, start, 0)), rng.choice((0, 10**9)))
            payload = fill(mimesis.message_type(kind)(), rng).SerializePartialToString()
            payload = rng.choice((payload, payload, mutated(rng, payload), rubbish(rng)))
            frames = [topic.encode() + b"\0" + header, payload]
            if rng.random() < 0.2:
                frames = rng.choice((frames[:1], frames + [b"more"], [mutated(rng, frames[0]), payload], [b"", b""]))
            if n == count // 2:
                frames[-1] = bytes(65 << 20)  # more than the largest frame
            for out in rogue.outputs:
                with contextlib.suppress(zmq.ZMQError):
                    out.send_multipart(frames, zmq.DONTWAIT)
            rogue.serve()
    return count


def _sockets(run, *suffixes):
    return sorted(str(p) for p in run.graph.iterdir() if p.name.endswith(suffixes) and p.is_socket()
                  and not p.name.startswith(("observer", "rogue")))


def _connections(rng, count, make, family=socket.SOCK_STREAM):
    """Connects to and writes what make(number) gives (path, bytes). Connections stay open, at most 200, or end at once."""
    with contextlib.ExitStack() as held:
        ones = []
        for n in pace(rng, count):
            path, data = make(n)
            one = held.enter_context(socket.socket(socket.AF_UNIX, family))
            one.settimeout(0.05)
            with contextlib.suppress(OSError):
                one.connect(path)
                one.send(data)
            ones.append(one)
            if len(ones) > 200 or rng.random() < 0.2:
                ones.pop(rng.randrange(len(ones))).close()
    return count


def endpoints(run, rng, count):
    """Bytes of no protocol, and half greetings of ZeroMQ, to the sockets of all nodes."""
    greeting = b"\xff" + bytes(8) + b"\x7f\x03\0NULL" + bytes(48)
    ready = b"\x04\x26\x05READY\x0bSocket-Type\0\0\0\x03SUB\x08Identity\0\0\0\0"
    paths = _sockets(run, ".d", ".r", ".s")
    return _connections(rng, count, lambda n: (rng.choice(paths), rng.choice((
        rubbish(rng), greeting[:rng.randrange(64)], mutated(rng, greeting), greeting + rubbish(rng), greeting + ready + rubbish(rng)))))


def _clients(run, kind, *suffixes):
    context, clients = zmq.Context(), []
    for path in _sockets(run, *suffixes):
        one = context.socket(kind)
        one.setsockopt(zmq.LINGER, 0)
        one.connect("ipc://" + path)
        clients.append(one)
    return context, clients


def subscriptions(run, rng, count):
    """Many subscribers, with many, long and strange subscriptions."""
    context, subscribers = _clients(run, zmq.SUB, ".d", ".r")
    for n in pace(rng, count):
        one = rng.choice(subscribers)
        word = rng.choice((rubbish(rng), b"", f"{n}/topic\0".encode(), b"\xff" + rubbish(rng, 20), bytes(300),
                           wire.HELLO + struct.pack("<Q", rng.choice((0, 1, 2**64 - 1)))))
        one.setsockopt(zmq.SUBSCRIBE, word)
        if rng.random() < 0.2:
            one.setsockopt(zmq.UNSUBSCRIBE, word)
    context.destroy(linger=0)
    return count


def services(run, rng, count):
    """Requests in half, in excess, of unknown names, and answered too late."""
    context, clients = _clients(run, zmq.DEALER, ".s")
    with mimesis.Graph("rogue") as rogue:
        known = [s.service.encode() for n in rogue.nodes().values() for s in n.services] + [b"info", b""]
    for _ in pace(rng, count):
        frames = [rng.choice((rng.randbytes(8), rubbish(rng))), rng.choice(known + [rubbish(rng)]), rubbish(rng)]
        frames = frames[:rng.choice((1, 2, 3, 3, 3))] + [b"x"] * rng.choice((0, 0, 5))
        with contextlib.suppress(zmq.ZMQError):
            rng.choice(clients).send_multipart(frames, zmq.DONTWAIT)
    context.destroy(linger=0)
    return count


def clock(run, rng, count):
    """Joins and reports of the lock-step that contradict the order of the barrier."""
    with mimesis.Graph("rogue") as rogue:
        known = [(n.name, n.start_id) for n in rogue.nodes().values()]

    def make(n):
        message = fill(mimesis.message_type("mimesis.v1." + rng.choice(("LockstepJoin", "LockstepJoin", "StepReport", "StepGo")))(), rng)
        if "rate_hz" in message.DESCRIPTOR.fields_by_name and rng.random() < 0.7:
            message.node, message.start_id = rng.choice(known + [(f"rogue{n}", n + 1), ("rogue", 1)])
            message.rate_hz = rng.choice((message.rate_hz, 100.0))
        data = message.SerializePartialToString()
        return str(run.graph / "clock.sock"), rng.choice((data, data, mutated(rng, data), rubbish(rng)))

    return _connections(rng, count, make, socket.SOCK_SEQPACKET)


def hand(run, rng, count):
    """Modbus requests to the simulated hand: half, mutated, of other functions and lengths."""
    def make(n):
        body = struct.pack(">BBHH", 9, rng.choice((3, 4, 16, 23, rng.randrange(256))), rng.choice((0, 1000, 2000, 65535)),
                           rng.choice((1, 3, 125, 65535)))
        data = struct.pack(">HHH", n & 0xFFFF, 0, rng.choice((len(body), len(body), 0, 65535))) + body
        return str(run.graph / "hand.modbus"), rng.choice((data, mutated(rng, data), data[:rng.randrange(12)], rubbish(rng)))

    return _connections(rng, count, make)


def can(run, rng, count):
    """Datagrams and frames on the simulated buses, of all identifiers and lengths."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.setblocking(False)
        for _ in pace(rng, count):
            paths = [p for p in run.graph.glob("can-*/*") if p.is_socket()]
            base = rng.choice((0, 0x80, 0x180, 0x280, 0x200, 0x580, 0x600, 0x700, rng.randrange(2**32)))
            frame = struct.pack("<IBBH64s", base + rng.randrange(1, 10), rng.choice((0, 2, 6, 8, 64, 255)), rng.choice((0, 255)), 0,
                                rng.randbytes(rng.choice((0, 8, 64))))
            data = rng.choice((frame, frame, frame * rng.choice((2, 64, 65, 200)), mutated(rng, frame), rubbish(rng)))
            with contextlib.suppress(OSError, IndexError):
                one.sendto(data, str(rng.choice(paths)))
    return count


def life(run, rng, count):
    """Words on the launcher's socket for signs of life."""
    environment = pathlib.Path(f"/proc/{run.processes()['recorder']}/environ").read_bytes().split(b"\0")
    address = next(e for e in environment if e.startswith(b"NOTIFY_SOCKET=")).partition(b"=")[2]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.setblocking(False)
        for _ in pace(rng, count):
            data = rng.choice((b"WATCHDOG=1", b"READY=1", b"STOPPING=1", bytes(30000), rubbish(rng)))
            with contextlib.suppress(OSError):
                one.sendto(data, b"\0" + address[1:] if address[:1] == b"@" else address)
    return count


RUBBISH = "rubbish"  # begins or is in the name of every entry that `folders` makes


def folders(run, rng, count):
    """Entries in the folders of the graph and of its buses: files, FIFOs, links, sockets, long names, node infos."""
    places = [run.graph, run.graph / "nodes", run.graph / "nodes", *run.graph.glob("can-*")]
    claims = []
    with mimesis.Graph("rogue") as rogue:
        infos = [n.SerializeToString() for n in rogue.nodes().values()]
    for n in pace(rng, count):
        place = rng.choice(places)
        name = RUBBISH + rng.choice((f"-{n}", f"-{n}.s", f"-{n % 7}", "x" * rng.choice((57, 58, 90, 240)), f" {n}\n\x1b[31m", f"-{n}.new"))
        path = place / (rng.choice(("", ".")) + name)
        with contextlib.suppress(OSError):
            how = rng.randrange(7)
            if how == 0:
                os.mkfifo(path)
            elif how == 1:
                path.symlink_to(rng.choice(("/dev/zero", "/dev/full", path, "/nowhere", place)))
            elif how == 2:
                path.mkdir()
            elif how == 3:
                with socket.socket(socket.AF_UNIX, rng.choice((socket.SOCK_DGRAM, socket.SOCK_STREAM))) as one:
                    one.bind(str(path))
            elif how == 4:
                with open(path, "xb") as file:
                    file.truncate(rng.choice((0, 1, 1 << 40)))
            else:  # a node that lives: it holds its lock
                claim = os.open(place / f".{name}", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
                wire.fcntl.fcntl(claim, wire.fcntl.F_OFD_SETLK, wire._lock(wire.fcntl.F_WRLCK))
                claims.append(claim)
                info = mimesis.message_type("mimesis.v1.NodeInfo").FromString(rng.choice(infos))
                info.name = name
                if rng.random() < 0.7:
                    info.start_id = n + 1
                for endpoint in rng.sample((info.data_endpoints, info.reliable_endpoints, info.service_endpoints), 2):
                    endpoint[:] = [rng.choice(("garbage://x", "ipc://", "ipc:///nowhere", "tcp://127.0.0.1:1", "tcp://:*", "", "é" * 300))]
                for kind in info.descriptors:
                    if rng.random() < 0.2:
                        info.descriptors[kind] = redefined(rng, kind, info.descriptors[kind])
                info = info.SerializeToString()
                with open(place / f".{name}.new", "xb") as file:  # not into a FIFO
                    file.write(rng.choice((info, info, mutated(rng, info))))
                (place / f".{name}.new").rename(place / name)
        if rng.random() < 0.3:
            with contextlib.suppress(OSError):
                path.unlink()
    for claim in claims:
        os.close(claim)
    return count


def remove_rubbish(story):
    """What `folders` made, and a folder that it is in, are not the run's to remove."""
    kept = [path for path in story.leftovers if RUBBISH in path]
    story.leftovers = [path for path in story.leftovers if not any(k.startswith(path) for k in kept)]


KINDS = {f.__name__: f for f in (topics, endpoints, subscriptions, services, clock, hand, can, life, folders, strangers.other_user,
                                  strangers.second_launch, strangers.viewer)}


def send(kind, run, rng, count):
    """Number of messages that were sent."""
    return KINDS[kind](run, rng, count)
