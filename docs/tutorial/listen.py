"""Prints what the node publishes: python3 listen.py [COUNT]"""
import sys

import mimesis

count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
with mimesis.Graph("listen") as graph:
    for received in graph.subscribe("brightness/mean", timeout_s=10.0):
        print(f"{received.message.header.stamp_ns} {received.message.mean:.2f}", flush=True)
        count -= 1
        if count == 0:
            break
sys.exit(1 if count else 0)
