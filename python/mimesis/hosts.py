"""What leaves this host by tcp: encrypted with CURVE between hosts that trust each other's keys, as common/runtime/keys.h
and tcp_gate.h say."""
import os
import pathlib
import sys

import zmq
import zmq.utils.z85

HEARTBEAT_MS, HEARTBEAT_TIMEOUT_MS, CONNECT_MS, HANDSHAKE_MS = 500, 2000, 1000, 5000
NO_KEY = "this host has no key; make one: mimesis key new"


def _folder():
    config = os.environ.get("XDG_CONFIG_HOME", "")
    return pathlib.Path(config if config.startswith("/") else pathlib.Path.home() / ".config") / "mimesis"


def own_key():
    """(public, secret) key of this host as bytes, or None."""
    path = _folder() / "key"
    if not path.exists():
        return None
    if path.stat().st_mode & 0o077:
        raise PermissionError(f"{path} is open to other users; expected mode 0600")
    keys = path.read_bytes().split()
    if len(keys) != 2 or len(keys[1]) != 40 or zmq.curve_public(keys[1]) != keys[0]:
        raise ValueError(f"{path}: expected a public key and its secret key, a line each")
    return keys[0], keys[1]


def trusted_keys():
    """Name by public key."""
    known = {}
    for path in (_folder() / "trusted", pathlib.Path("/etc/mimesis/trusted")):
        for words in map(bytes.split, path.read_bytes().splitlines() if path.is_file() else ()):
            if len(words) > 1:
                known.setdefault(words[0], words[1].decode(errors="replace"))
    return known


def leaves_host(endpoint):
    return endpoint.startswith("tcp://") and not endpoint.startswith(("tcp://127.", "tcp://[::1]"))


class Gate:
    """Guards the tcp sockets of a context; serve() lets others in."""

    def __init__(self, context):
        self._context, self._asked, self._key, self._said = context, None, None, set()
        self.public_key = b""  # of this host, once a socket is bound beyond it

    def bind(self, socket, endpoint):
        self._prepare(socket, endpoint)
        if leaves_host(endpoint):
            self._key = self._key or own_key()
            if not self._key:
                raise ValueError(f"{endpoint}: {NO_KEY}")
            if not self._asked:  # libzmq asks here about a key that knocks (RFC 27)
                self._asked = self._context.socket(zmq.REP)
                self._asked.bind("inproc://zeromq.zap.01")
            self.public_key = self._key[0]
            socket.curve_server, socket.curve_secretkey = True, self._key[1]
            socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
        socket.bind(endpoint)
        return socket.getsockopt(zmq.LAST_ENDPOINT).rstrip(b"\0").decode()

    def connect(self, socket, endpoint, host_key):
        """False, said once, if that host is not trusted here."""
        self._prepare(socket, endpoint)
        if leaves_host(endpoint):
            self._key = self._key or own_key()
            host_key = host_key.encode()
            if not self._key:
                self._say(f"nodes of other hosts are not heard: {NO_KEY}")
                return False
            if host_key != self._key[0] and host_key not in trusted_keys():
                self._say(f"{endpoint.rpartition(':')[0]} is not listened to: its key '{host_key.decode()}' is not trusted here")
                return False
            socket.curve_serverkey, (socket.curve_publickey, socket.curve_secretkey) = host_key, self._key
        elif endpoint.startswith("tcp://"):
            socket.curve_server = False  # no keys
        socket.connect(endpoint)
        return True

    def serve(self):
        while self._asked and self._asked.poll(0):
            version, request, _, address, _, _, *credentials = self._asked.recv_multipart()
            key = zmq.utils.z85.encode(credentials[0]) if credentials and len(credentials[0]) == 32 else b""
            name = "this host" if key == self._key[0] else trusted_keys().get(key)
            if name is None:
                self._say(f"{address.decode(errors='replace')} is refused: its key '{key.decode()}' is not trusted here")
            self._asked.send_multipart([version, request, b"200" if name else b"400", b"OK" if name else b"key not trusted",
                                        (name or "").encode(), b""])

    def _prepare(self, socket, endpoint):
        if endpoint.startswith("tcp://"):
            socket.setsockopt(zmq.IPV6, endpoint.startswith("tcp://["))
            socket.setsockopt(zmq.HEARTBEAT_IVL, HEARTBEAT_MS)
            socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, HEARTBEAT_TIMEOUT_MS)
            socket.setsockopt(zmq.CONNECT_TIMEOUT, CONNECT_MS)

    def _say(self, line):
        if line not in self._said:
            self._said.add(line)
            print(f"mimesis: {line}", file=sys.stderr)
