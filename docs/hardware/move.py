"""Moves a joint by an angle and back: python3 move.py JOINT ANGLE_RAD SPEED_RAD_S. JOINT counts from 1."""
import math
import sys

import mimesis

joint, angle_rad, speed_rad_s = int(sys.argv[1]) - 1, float(sys.argv[2]), float(sys.argv[3])
duration_s = math.pi * abs(angle_rad) / speed_rad_s  # of a cosine whose largest speed that is
with mimesis.Graph("move") as graph:
    command = graph.publish("move/command", "mimesis.v1.JointCommand")
    start, farthest_rad = None, 0.0
    for received in graph.subscribe("bridge/joint_states", timeout_s=5.0):  # one set-point for each measurement
        state = received.message
        if state.fault:
            sys.exit(state.fault)
        if start is None:
            start, begin_ns = list(state.position_rad), received.stamp_ns
        t_s = (received.stamp_ns - begin_ns) * 1e-9
        if t_s > duration_s:
            break
        farthest_rad = max(farthest_rad, abs(state.position_rad[joint] - start[joint]))
        target = list(start)
        target[joint] += angle_rad * (1.0 - math.cos(2.0 * math.pi * t_s / duration_s)) / 2.0
        command.send(command.message(position_rad=target))
    else:
        sys.exit("bridge/joint_states is silent: does the bridge see the drives? mimesis topic echo bridge/status --once")
print(f"joint {joint + 1} moved by {farthest_rad:.3f} rad and back")
