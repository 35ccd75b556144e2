#!/usr/bin/python3
"""Who is not trusted, on the network of a graph.
  stranger.py overhear FILE SECONDS PORT...    keeps what clients send to these ports of this host
  stranger.py attack FILE ADDRESS PORT...      scans, talks rubbish, says again what was overheard, holds 10 000 connections"""
import json
import os
import resource
import socket
import sys
import threading
import time

GREETING, HELLO, WELCOME = 64, 2 + 200, 2 + 168  # bytes of ZMTP and of CURVE's first commands [RFC 23, 26]: no message


def overhear(file, seconds, ports):
    """TCP payload by connection, in order of sequence numbers."""
    heard = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(0x0800))
    heard.settimeout(0.1)
    flows, end = {}, time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            packet = heard.recv(65536)
        except TimeoutError:
            continue
        ip_length, protocol = (packet[0] & 15) * 4, packet[9]
        if protocol != 6:
            continue
        tcp = packet[ip_length:int.from_bytes(packet[2:4], "big")]
        source, port, number = (int.from_bytes(tcp[a:b], "big") for a, b in ((0, 2), (2, 4), (4, 8)))
        payload = tcp[(tcp[12] >> 4) * 4:]
        if port in ports and payload:
            flows.setdefault((packet[12:16].hex(), source, port), {})[number] = payload
    told = [{"port": key[2], "bytes": b"".join(parts[n] for n in sorted(parts)).hex()} for key, parts in flows.items()]
    with open(file + ".new", "w") as out:
        json.dump(told, out)
    os.rename(file + ".new", file)


def answers(address, port, words, seconds=1.0):
    """Bytes that come back until the other side hangs up or the time is over."""
    with socket.create_connection((address, port), 5) as line:
        line.settimeout(seconds)
        got = b""
        try:
            for begin, end in ((0, GREETING), (GREETING, GREETING + HELLO), (GREETING + HELLO, len(words))):
                line.sendall(words[begin:end])
                time.sleep(0.1)  # as a client that waits for each answer
            while part := line.recv(65536):
                got += part
        except OSError:
            pass
        return got


def attack(file, address, ports):
    told = {"open": 0, "replayed": 0, "most": 0, "held": 0, "refused": 0}
    for port in range(1, 65536):  # a scan
        with socket.socket() as probe:
            told["open"] += probe.connect_ex((address, port)) == 0
    sizes = []
    with open(file) as heard:
        flows = [(flow["port"], bytes.fromhex(flow["bytes"])) for flow in json.load(heard)]
    rubbish = [(port, words) for port in ports for words in (b"", b"GET / HTTP/1.1\r\n\r\n", b"\xff" * 4096, os.urandom(4096))]
    threads = [threading.Thread(target=lambda p=port, w=words: sizes.append(len(answers(address, p, w))))
               for port, words in flows + rubbish]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    told["replayed"], told["most"] = len(flows), max(sizes)
    resource.setrlimit(resource.RLIMIT_NOFILE, (12000, 12000))
    held = []
    for number in range(10000):  # who says nothing
        line = socket.socket()
        line.settimeout(1)
        if line.connect_ex((address, ports[number % len(ports)])) == 0:
            held.append(line)
        else:
            told["refused"] += 1
    told["held"] = len(held)
    time.sleep(8)  # longer than a handshake may take
    print(json.dumps(told), flush=True)
    if told["most"] > GREETING + WELCOME:
        sys.exit(f"{told['most']} bytes came back: more than a greeting and a welcome")


if __name__ == "__main__":
    what, file = sys.argv[1:3]
    if what == "overhear":
        overhear(file, float(sys.argv[3]), [int(port) for port in sys.argv[4:]])
    else:
        attack(file, sys.argv[3], [int(port) for port in sys.argv[4:]])
