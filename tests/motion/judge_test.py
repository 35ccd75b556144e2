#!/usr/bin/python3
"""The judge, on motions whose figures are known."""
import json
import math
import pathlib
import tempfile
import unittest

import judge

ROWS = [f"{joint}.{axis}" for joint in judge.JOINTS for axis in "xyz"]
LENGTHS = {"lhip": [0, 0.1, -0.1], "rhip": [0, -0.1, -0.1], "lknee": [0, 0, -0.4], "rknee": [0, 0, -0.4],
           "lank": [0, 0, -0.4], "rank": [0, 0, -0.4]}


def model():
    """One source, a cosine, on the left knee about y: 0.5 + 0.3 cos(phase), one second."""
    weight = [[0.3 if row == "lknee.y" else 0.0] for row in ROWS]
    mean = [0.5 if row == "lknee.y" else 0.0 for row in ROWS]
    data = {"rows": ROWS, "sources": [[math.cos(2 * math.pi * n / 100) for n in range(100)]],
            "delay_rad": [[0.0] for _ in ROWS],
            "body": {"offset_m": LENGTHS, "heel_m": {"left": [-0.05, 0, -0.08], "right": [-0.05, 0, -0.08]},
                     "toe_m": {"left": [0.12, 0, -0.08], "right": [0.12, 0, -0.08]}},
            "patterns": [{"style": "nod", "duration_s": 1.0, "clip": "x.bvh", "mean_rad": mean, "weight_rad": weight}]}
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(data, file)
        file.flush()
        return judge.Model(file.name)


def posture(**angles):
    return [tuple(angles.get(f"{joint}_{axis}", 0.0) for axis in "xyz") for joint in judge.JOINTS]


def standing(height=0.98, frames=200, rate=200.0, **angles):
    course = judge.Course()
    for n in range(frames):
        course.add(n / rate, (0.0, 0.0, height), 0.0, posture(**angles))
    return course


class Judge(unittest.TestCase):
    def test_flexion_has_the_sign_of_the_knees_axis(self):
        m = model()
        self.assertAlmostEqual(m.flexions(posture(lknee_y=0.5, rknee_y=0.2)), math.degrees(0.2), places=9)
        self.assertAlmostEqual(m.flexions(posture(lknee_y=0.5, rknee_y=-0.2)), -math.degrees(0.2), places=9)
        found = judge.judged(m, standing(rknee_y=-0.2))
        self.assertAlmostEqual(found["backward_s"], 199 / 200.0)

    def test_learned_speeds_are_those_of_the_mixture(self):
        speed, flexion = model().learned("nod")
        self.assertAlmostEqual(speed[judge.JOINTS.index("lknee")], 0.3 * 2 * math.pi, places=3)
        self.assertAlmostEqual(speed[judge.JOINTS.index("rknee")], speed[judge.JOINTS.index("lknee")])
        self.assertAlmostEqual(flexion, 0.0)  # of the right one

    def test_a_figure_that_stands_on_the_ground_does(self):
        found = judge.judged(model(), standing())
        self.assertAlmostEqual(found["sole_mm"], 0.0, places=9)
        self.assertAlmostEqual(found["below_mm"], 0.0, places=9)
        self.assertEqual(found["slide_m_s"], 0.0)

    def test_a_figure_that_hovers_or_sinks_is_seen(self):
        self.assertAlmostEqual(judge.judged(model(), standing(0.985))["sole_mm"], 5.0, places=6)
        sunk = judge.judged(model(), standing(0.958))
        self.assertAlmostEqual(sunk["below_mm"], 22.0, places=6)

    def test_a_figure_that_is_pulled_along_slides(self):
        course = judge.Course()
        for n in range(200):
            course.add(n / 200.0, (0.7 * n / 200.0, 0.0, 0.98), 0.0, posture())
        self.assertAlmostEqual(judge.judged(model(), course)["slide_m_s"], 0.7, places=9)

    def test_accelerations_are_those_of_the_path(self):
        times = [n / 200.0 for n in range(401)]
        path = [(0.02 * math.sin(7.0 * t), 0.0, 0.9) for t in times]
        found = judge.accelerations(judge.resampled(times, path, 30.0), 30.0)
        self.assertAlmostEqual(max(found), 0.02 * 49.0, delta=0.03)

    def test_a_snap_is_a_speed(self):
        course = standing()
        course.vectors[100] = posture(lknee_y=0.2)
        self.assertAlmostEqual(judge.judged(model(), course)["knee_rad_s"], 40.0, places=6)


if __name__ == "__main__":
    unittest.main()
