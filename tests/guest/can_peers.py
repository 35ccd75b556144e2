#!/usr/bin/python3
"""Our simulated drives and `mimesis hw` against can-utils, python-can and the kernel's own CAN driver, in tests/guest/run;
with --here against python-can without a CAN in the kernel: over a serial line.

    tests/guest/can_peers.py BIN_DIR [--here]
"""
import fcntl
import os
import pathlib
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time

try:
    import can
except ImportError:
    can = None

BIN = pathlib.Path(sys.argv[1])
PATIENCE_S = 20.0 if "--here" in sys.argv else 60.0  # system calls of the guest are slow


def expect(what, found, wanted):
    good = wanted(found) if callable(wanted) else found == wanted
    print(f"{'ok  ' if good else 'BAD '} {what}: {found}", flush=True)
    if not good:
        sys.exit(1)


def mimesis(*words, **more):
    return subprocess.Popen([str(BIN / "mimesis"), *words], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more)


def until(done, step=lambda: None):
    end = time.monotonic() + PATIENCE_S
    while not (result := done()) and time.monotonic() < end:
        step()
        time.sleep(0.02)
    return result


def drives(folder):
    """Seven simulated drives on vcan0; returns once they have booted."""
    heard = subprocess.Popen(["candump", "-L", "-n", "7", "vcan0,700:780"], text=True, stdout=subprocess.PIPE)
    time.sleep(0.5)
    process = subprocess.Popen([str(BIN / "mimesis_sim_drives"), "--set", "bus=socketcan:vcan0"], stderr=subprocess.PIPE)
    lines = heard.communicate(timeout=PATIENCE_S)[0].splitlines()
    expect("boot-up messages in candump", sorted(line.split()[2] for line in lines), [f"70{n}#00" for n in range(1, 8)])
    return process


def can_utils():
    answer = subprocess.Popen(["candump", "-L", "-n", "1", "vcan0,583:7FF"], text=True, stdout=subprocess.PIPE)
    until(lambda: answer.poll() is not None, lambda: subprocess.run(["cansend", "vcan0", "603#4000100000000000"], check=True))
    expect("device type, asked by cansend", answer.communicate()[0].split()[2], "583#4300100092010200")


def python_can(bus=None):
    if can is None:
        print("skip python3-can is not installed")
        return
    bus = bus or can.Bus(interface="socketcan", channel="vcan0")
    bus.set_filters([{"can_id": 0x583, "can_mask": 0x7FF}])
    send = lambda identifier, *data: bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def ask(*data):
        send(0x603, *data)
        return bytes(bus.recv(PATIENCE_S).data)

    first = ask(0x40, 0x08, 0x10, 0, 0, 0, 0, 0)
    size, text, toggle = struct.unpack("<I", first[4:])[0], b"", 0
    while len(text) < size:
        segment = ask(0x60 | toggle, 0, 0, 0, 0, 0, 0, 0)
        text += segment[1:8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
    expect("name in segments, by python-can", text.decode(), "mimesis simulated drive")
    bus.set_filters([{"can_id": 0x183, "can_mask": 0x7FF}])
    send(0x000, 1, 3)
    for word, wanted in ((0x06, 0x231), (0x07, 0x233), (0x0F, 0x1237), (0x02, 0x217), (0x00, 0x250)):
        send(0x203, word, 0)
        send(0x080)
        status = lambda: struct.unpack("<H", bytes(bus.recv(PATIENCE_S).data)[:2])[0]
        expect(f"statusword after controlword {word:#04x}", hex(status()), hex(wanted))
    send(0x000, 0x80, 3)
    bus.shutdown()


def frames_as_candump(folder):
    """What `mimesis hw monitor --frames` prints is what candump -L prints, for each kind of frame."""
    kinds = ["123#", "123#DEADBEEF", "123#R", "00012345#0102030405060708", "124##1AABB", "124##0" + "55" * 64]
    log = folder / "candump"
    with log.open("w") as out:
        dump = subprocess.Popen(["candump", "-L", "vcan1"], stdout=out)
        monitor = mimesis("hw", "monitor", "socketcan:vcan1", "--frames", "--count", "24")
        until(lambda: monitor.poll() is not None, lambda: [subprocess.run(["cansend", "vcan1", k], check=True) for k in kinds])
        time.sleep(0.2)
        dump.terminate()
        dump.wait()
    ours = monitor.communicate()[0].splitlines()
    theirs = set(log.read_text().splitlines())
    expect("frames monitored", len(ours), 24)
    expect("lines that candump does not have, with the kernel's time of arrival", sorted(set(ours) - theirs), [])
    expect("kinds seen", len({line.split(" ", 1)[1] for line in ours}), len(kinds))


def controller_errors():
    """The kernel's driver for serial adapters, on a pseudo terminal: its error frames reach us."""
    master, slave = pty.openpty()
    asked = bytearray()

    def adapter():  # the driver waits until its commands are taken
        while True:
            asked.extend(os.read(master, 100))

    threading.Thread(target=adapter, daemon=True).start()
    fcntl.ioctl(slave, termios.TIOCSETD, struct.pack("i", 17))  # N_SLCAN
    name = fcntl.ioctl(slave, 0x8910, bytes(40)).split(b"\0")[0].decode()  # SIOCGIFNAME
    subprocess.run(["ip", "link", "set", name, "type", "can", "bitrate", "1000000"], check=True)
    subprocess.run(["ip", "link", "set", name, "up"], check=True)
    until(lambda: b"O\r" in asked)
    expect("the driver sets its adapter up", bytes(asked), b"C\rS8\rO\r")
    # Lines of the adapter, and the error frame that the driver makes of each: class, data[1] (linux/can/error.h).
    told = {"t1232DEAD": "a frame", "sw096096": "warning", "sp128128": "passive", "e1a": "bus error", "sb256256": "bus-off"}
    monitor = mimesis("hw", "monitor", f"socketcan:{name}", "--frames", "--count", "5")

    def kind(line):
        head, data = line.split(" ")[2].split("#")
        if len(head) == 3:
            return "a frame" if (head, data) == ("123", "DEAD") else line
        classes, state = int(head, 16) & 0x1FFFFFFF, int(data[2:4], 16)
        if classes & 0x40:
            return "bus-off"
        if classes & 0x04 and state:
            return "passive" if state & 0x30 else "warning" if state & 0x0C else line
        return "bus error" if classes & 0x88 else line

    def tell():
        os.write(master, "".join(line + "\r" for line in told).encode())

    # Once: a driver that is in a state says no more of it. Again only while the monitor has not opened its socket.
    os.set_blocking(monitor.stdout.fileno(), False)
    until(lambda: monitor.poll() is not None, tell)
    seen = [kind(line) for line in monitor.communicate()[0].splitlines()]
    expect("error frames of the kernel's driver", sorted(set(seen)), lambda k: k == sorted(told.values()))
    watch = mimesis("hw", "monitor", f"socketcan:{name}", "--json", "--count", "20")
    seen = []

    def look():
        tell()
        if line := watch.stdout.readline():
            seen.append(line)

    until(lambda: watch.poll() is not None or any('"bus_off":true' in line for line in seen), look)
    expect("`monitor` says bus-off", any('"bus_off":true' in line for line in seen), True)
    watch.kill()


def booted(bus, address):
    """Seven simulated drives at `address`, once python-can has heard them boot."""
    process = subprocess.Popen([str(BIN / "mimesis_sim_drives"), "--set", f"bus={address}"], stderr=subprocess.PIPE)
    found = set()
    until(lambda: len(found) == 7,
          lambda: found.update(m.arbitration_id for m in [bus.recv(1.0)] if m and 0x700 < m.arbitration_id < 0x708 and m.data[0] == 0))
    expect(f"boot-up messages on {address}", sorted(found), list(range(0x701, 0x708)))
    return process


def serial_line():
    """A line between two pseudo terminals; both ends believe that the other is an adapter."""
    masters, names = [], []
    for _ in range(2):
        master, slave = pty.openpty()
        attributes = termios.tcgetattr(slave)
        attributes[3] &= ~(termios.ECHO | termios.ICANON)
        termios.tcsetattr(slave, termios.TCSANOW, attributes)
        masters.append(master)
        names.append(os.ttyname(slave))

    def carry(source, target):
        while data := os.read(source, 1000):
            os.write(target, data)

    for i in range(2):
        threading.Thread(target=carry, args=(masters[i], masters[1 - i]), daemon=True).start()
    bus = can.Bus(interface="slcan", channel=names[1], bitrate=1000000, sleep_after_open=0)
    running = booted(bus, f"slcan:{names[0]}")
    python_can(bus)
    running.terminate()
    running.wait()


def here():
    if can is None:
        print("python3-can is not installed")
        sys.exit(77)
    serial_line()


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        os.environ.update(XDG_RUNTIME_DIR=name, XDG_STATE_HOME=name, MIMESIS_GRAPH="peers")
        if "--here" in sys.argv:
            return here()
        running = drives(folder)
        try:
            can_utils()
            python_can()
            scan = mimesis("hw", "scan", "socketcan:vcan0", "--json", "--timeout", "2")
            found = scan.communicate()[0]
            expect("`hw scan` on the kernel's CAN", found.count('"mimesis simulated drive"'), 7)
        finally:
            running.terminate()
            running.wait()
        frames_as_candump(folder)
        controller_errors()


main()
