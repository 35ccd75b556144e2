#!/usr/bin/env python3
"""Modbus TCP servers of grippers, from their makers' manuals; shares nothing with our code.

    hands.py KIND:HABIT:DELAY_MS ...    prints the ports in this order, one line; ends with its standard input

KIND: 3f, 2f (Robotiq), rg2 (OnRobot), rh56 (Inspire). HABIT: plain; short (at most 3 registers at once, else exception 2); chunks
(an answer in single bytes); twice (each answer two times); foreign (an answer to another transaction before each); lost (only those).
A request to another unit is not answered. An object is met at 0.47 of the way."""
import socket
import struct
import sys
import threading
import time

STEP, OBJECT = 0.08, 0.47


class Hand:
    unit, spans = 9, ()

    def __init__(self):
        self.out, self.pos, self.active = {}, 0.0, None

    def word(self, n):
        return self.out.get(n, 0)

    def move(self, want, closing_stops=True):
        """True while it moves; second: it has met the object."""
        if closing_stops and self.pos >= OBJECT - 1e-9 and want > OBJECT:
            self.pos = OBJECT
            return False, True
        step = max(-STEP, min(STEP, want - self.pos))
        self.pos = min(self.pos + step, OBJECT) if step > 0 and self.pos <= OBJECT < want else self.pos + step
        return abs(step) > 1e-9, False

    def activated(self):
        if not self.word(1000) >> 8 & 1:
            self.active = None
            return False
        self.active = self.active or time.monotonic()
        return time.monotonic() - self.active > 0.3


class Robotiq3f(Hand):
    spans = ((1000, 1007), (2000, 2007))

    def read(self):
        ready, go, want = self.activated(), self.word(1000) >> 11 & 1, self.word(1001) & 255
        moving, met = self.move(want / 255) if ready and go else (False, False)
        sta, dt = (0, 0) if moving else (2, 2) if met else (3, 3)
        first = (self.active is not None) | (self.word(1000) >> 9 & 3) << 1 | go << 3 | (3 if ready else 1 if self.active else 0) << 4 | sta << 6
        p = round(255 * self.pos)
        return bytes([first, dt * 0b010101 | 3 << 6, 0] + 3 * [want, p, 5] + 4 * [0]), 2000


class Robotiq2f(Hand):
    spans = ((1000, 1007), (2000, 2007))  # more than it has are taken, and read as zeros

    def read(self):
        ready, go, want = self.activated(), self.word(1000) >> 11 & 1, self.word(1001) & 255
        moving, met = self.move(want / 255) if ready and go else (False, False)
        first = (self.active is not None) | go << 3 | (3 if ready else 1 if self.active else 0) << 4 | (0 if moving else 2 if met else 3) << 6
        return bytes([first, 0, 0, want, round(255 * self.pos), 5] + 10 * [0]), 2000


class Rg2(Hand):
    unit, spans = 65, ((0, 2), (258, 275), (1536, 1536))

    def read(self):
        moving, met = self.move(1 - self.word(1) / 1100) if self.word(2) == 1 else (False, False)
        words = {267: round(1100 * (1 - self.pos)), 268: moving | (met and self.word(2) == 1) << 1, 1536: 0x20}
        return b"".join(struct.pack(">H", words.get(n, 0)) for n in range(1537)), 0


class Rh56(Hand):
    unit, spans = 1, ((1000, 1000), (1486, 1491), (1498, 1503), (1522, 1527), (1546, 1551), (1606, 1608), (1612, 1614))

    def read(self):
        wanted = self.word(1486)
        moving, met = self.move(1 - wanted / 1000) if wanted != 0xFFFF and 1486 in self.out else (False, False)
        status = 1 if moving else 3 if met else 2
        words = {1000: 1, **{n: round(1000 * (1 - self.pos)) for n in range(1546, 1551)}, 1551: 1000}
        words.update({n: status << 8 | status for n in (1612, 1613)} | {1614: 2 << 8 | status})
        return b"".join(struct.pack(">H", words.get(n, 0)) for n in range(1000, 1615)), 1000


KINDS = {"3f": Robotiq3f, "2f": Robotiq2f, "rg2": Rg2, "rh56": Rh56}


def answer(hand, habit, pdu):
    function, first, count = struct.unpack(">BHH", pdu[:5])
    if function not in (3, 4, 16):
        return bytes([function | 0x80, 1])
    inside = any(low <= first and first + count - 1 <= high for low, high in hand.spans)
    if not inside or (habit == "short" and count > 3):
        return bytes([function | 0x80, 2])
    if function == 16:
        hand.out.update(zip(range(first, first + count), struct.unpack(f">{count}H", pdu[6:6 + 2 * count])))
        return pdu[:5]
    data, base = hand.read()
    return bytes([function, 2 * count]) + data[2 * (first - base):2 * (first - base + count)]


def serve(client, hand, habit, delay):
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    heard = b""
    try:
        while part := client.recv(512):
            heard += part
            while len(heard) >= 8 and len(heard) >= 6 + (size := struct.unpack(">H", heard[4:6])[0]):
                transaction, pdu, unit = struct.unpack(">H", heard[:2])[0], heard[7:6 + size], heard[6]
                heard = heard[6 + size:]
                if unit != hand.unit:
                    continue
                said = answer(hand, habit, pdu)
                time.sleep(delay)
                frame = lambda t: struct.pack(">HHHB", t & 0xFFFF, 0, len(said) + 1, unit) + said
                if habit in ("foreign", "lost"):
                    client.sendall(frame(transaction + 1))
                if habit == "chunks":
                    for byte in frame(transaction):
                        client.sendall(bytes([byte]))
                        time.sleep(0.0005)
                elif habit != "lost":
                    client.sendall(frame(transaction) * (2 if habit == "twice" else 1))
    except OSError:
        pass


def listen(spec):
    kind, habit, delay = spec.split(":")
    hand, server = KINDS[kind](), socket.create_server(("127.0.0.1", 0))

    def accept():
        while True:
            threading.Thread(target=serve, args=(server.accept()[0], hand, habit, float(delay) / 1000), daemon=True).start()
    threading.Thread(target=accept, daemon=True).start()
    return server.getsockname()[1]


print(*[listen(spec) for spec in sys.argv[1:]], flush=True)
sys.stdin.read()
