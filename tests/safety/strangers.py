"""Others on the machine, against a running graph: another user, a second launch, a viewer's clients."""
import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time

NOBODY = 65534

# Runs as another user: what it may do it counts, by what it was. Words: the count, the run's folder, its processes, the seed.
OTHER_USER = r"""
import collections, json, os, pathlib, random, signal, socket, sys
count, folder, pids, seed = int(sys.argv[1]), pathlib.Path(sys.argv[2]), json.loads(sys.argv[3]), sys.argv[4]
rng, did = random.Random(seed), collections.Counter()
addresses = [l.split()[-1] for l in open("/proc/net/unix") if " @" in l or str(folder) in l]
paths = [a for a in addresses if not a.startswith("@")] or [str(folder)]
def attempt(name, act):
    try:
        act()
        did[name] += 1
    except OSError:
        pass
def datagram(address):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as one:
        one.setblocking(False)
        one.sendto(rng.choice((b"WATCHDOG=1", b"STOPPING=1", b"READY=1", rng.randbytes(300))), address)
def connect(path, family):
    with socket.socket(socket.AF_UNIX, family) as one:
        one.settimeout(0.05)
        one.connect(path)
        one.send(rng.randbytes(64))
for n in range(count):
    pid, path = rng.choice(pids), rng.choice(paths)
    attempt("signal", lambda: os.kill(pid, rng.choice((signal.SIGSTOP, signal.SIGTERM, signal.SIGUSR1))))
    attempt("memory", lambda: open(f"/proc/{pid}/mem", "rb").close())
    attempt("files", lambda: os.listdir(f"/proc/{pid}/fd"))
    attempt("folder", lambda: os.listdir(rng.choice((folder / "mimesis", folder / "mimesis/g", folder / "mimesis/g/nodes"))))
    attempt("entry", lambda: open(folder / f"mimesis/g/nodes/rogue{n}", "xb").close())
    attempt("log", lambda: open(folder.parent / "run.mcap", "rb").close())
    attempt("socket", lambda: connect(path, rng.choice((socket.SOCK_STREAM, socket.SOCK_SEQPACKET))))
    attempt("datagram", lambda: datagram(path))
    for a in addresses:
        if a.startswith("@mimesis"):
            attempt("abstract socket", lambda: datagram("\0" + a[1:]))
print(json.dumps(did))
"""


def other_user(run, rng, count):
    """Signals, sockets, folders, memory and logs, as another user whom the folders around the graph's let pass."""
    if os.getuid() != 0:
        return 0
    for path in (run.folder, run.runtime):
        path.chmod(0o755)
    words = [sys.executable, "-c", OTHER_USER, str(count), str(run.runtime), json.dumps(list(run.processes().values())), str(rng.random())]
    told = subprocess.run(words, user=NOBODY, group=NOBODY, extra_groups=[], capture_output=True, text=True, check=True).stdout
    if (did := json.loads(told)):
        run.trespass = f"another user did: {did}"
    return count


def second_launch(run, rng, count):
    """The same file in the same graph once more, with the run's log or one of its own: it ends with a reason."""
    tried = max(1, count // 200)
    for _ in range(tried):
        log = rng.choice((run.log, run.log.with_name("second.mcap")))
        second = subprocess.run([*run.command, "--arg", f"log={log}"], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                timeout=120)
        if second.returncode == 0 or not any(words in second.stderr for words in ("runs already", "another process is writing it")):
            run.trespass = f"a second launch: exit {second.returncode}, {second.stderr[-500:]}"
    return tried


def viewer(run, rng, count):
    """`mimesis view` beside the run: clients without its key hold connections, send halves, garbage, long and deep JSON;
    then its owner still gets the page, and an interrupt ends it."""
    view = subprocess.Popen([str(run.build / "bin/mimesis"), "view", "--port", "0", "--key", "secret"], stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL, text=True)
    port = int(re.search(r":(\d+)/", view.stdout.readline())[1])
    upgrade = (f"GET {{}} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: c2VjcmV0c2VjcmV0c2VjIQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n")
    text = lambda data: bytes([0x81, 0xFF]) + len(data).to_bytes(8, "big") + bytes(4) + data
    held = []
    for n in range(count):
        with contextlib.suppress(OSError):
            one = socket.create_connection(("127.0.0.1", port), timeout=1.0)
            held.append(one)
            asked = upgrade.format(rng.choice(("/", "/?key=wrong", "/?key=" + "x" * 5000))).encode()
            said = text(rng.choice((b"[" * 100_000, b'{"op":"subscribe","subscriptions":[' + b"{}," * 30_000 + b"{}]}",
                                    b'{"op":"setParameters","parameters":[{"name":"a.b","value":1}]}', rng.randbytes(5000))))
            one.sendall(rng.choice((asked + said, asked + said * 5, asked[:rng.randrange(len(asked))], rng.randbytes(2000), asked)))
        if len(held) > 300:
            held.pop(rng.randrange(len(held))).close()
    begin, answer = time.monotonic(), b""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=10.0) as owner:
        owner.sendall(upgrade.format("/?key=secret").encode())
        answer = owner.recv(4096)
    if b" 101 " not in answer[:20]:
        run.trespass = f"the viewer's owner got {answer[:40]} after {time.monotonic() - begin:.1f} s"
    for one in held:
        one.close()
    view.send_signal(signal.SIGINT)
    try:
        if view.wait(timeout=10.0) != 0:
            run.trespass = f"the viewer ended with {view.returncode}"
    except subprocess.TimeoutExpired:
        run.trespass = "the viewer does not end by an interrupt"
        view.kill()
    view.stdout.close()
    return count
