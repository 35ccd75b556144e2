#!/usr/bin/python3
"""The judgement itself, on made traces and ends: each broken promise is a breach, and none is invented."""
import pathlib
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import judge  # noqa: E402
import trial  # noqa: E402


def trace(*parts):
    """Samples each 5 ms: parts of (duration [s], speed, powered)."""
    at, samples = 0.0, []
    for length, speed, powered in parts:
        for _ in range(round(length / 0.005)):
            samples.append(trial.Sample(at, at, speed, powered))
            at += 0.005
    return samples


def story(samples, **changed):
    """The planner is killed at 1 s, and all goes well."""
    given = dict(victim="planner", event=1.0, samples=samples, still_rad_s=0.01, upstream=True, ended=2.0, exit_code=1,
                 errors=[(1.02, "mimesis: node 'planner' was killed by signal 9: stopping")], log_check=0,
                 summary={"reason": "x", "nodes": [{"name": "planner", "exit_code": 137, "killed": False}]},
                 result={"success": False, "reason": "node 'planner' was killed"})
    return judge.Story(**{**given, **changed})


STOPS = trace((1.1, 0.5, True), (1.0, 0.0, False))


class Judge(unittest.TestCase):
    def breaches(self, samples=STOPS, **changed):
        return set(judge.judge(story(samples, **changed)).breaches)

    def test_a_good_stop_is_no_breach(self):
        verdict = judge.judge(story(STOPS))
        self.assertEqual(verdict.breaches, {})
        self.assertAlmostEqual(verdict.detected_s, 0.02)
        self.assertAlmostEqual(verdict.rest_s, 0.095, places=3)

    def test_motion_after_the_stop(self):
        again = STOPS + [trial.Sample(3.0, 3.0, 0.3, True)]
        self.assertEqual(self.breaches(again), {"motion after stop", "rest"})

    def test_a_pause_of_a_powered_arm_is_no_stop(self):
        pause = trace((1.0, 0.5, True), (0.15, 0.0, True), (0.1, 0.2, True), (1.0, 0.0, False))
        self.assertEqual(self.breaches(pause), set())

    def test_it_moves_on_for_too_long(self):
        self.assertEqual(self.breaches(trace((1.5, 0.5, True), (1.0, 0.0, False))), {"rest"})
        self.assertEqual(self.breaches(trace((1.5, 0.5, True), (1.0, 0.0, False)), upstream=False), set())

    def test_motion_before_the_event_does_not_count(self):
        before = trace((0.4, 0.0, False), (0.6, 0.5, True), (1.0, 0.0, False))
        self.assertEqual(self.breaches(before), set())

    def test_in_lockstep_the_shorter_time_counts(self):
        slow = [trial.Sample(s.at, s.at / 2, s.speed, s.powered) for s in trace((1.5, 0.5, True), (1.0, 0.0, False))]
        self.assertEqual(self.breaches(slow), {"rest"})
        self.assertEqual(self.breaches(slow, lockstep=True), set())

    def test_silence(self):
        self.assertEqual(self.breaches(exit_code=0), {"silent"})
        self.assertEqual(self.breaches(errors=[]), {"silent"})
        self.assertEqual(self.breaches(errors=[(0.5, "mimesis: planner is ready (0.5 s)")]), {"silent"})
        self.assertEqual(self.breaches(errors=[(1.5, "[bridge] planner is silent")]), {"silent"})
        self.assertEqual(self.breaches(result={"reason": ""}, summary={"reason": "", "nodes": []}), {"silent"})
        self.assertEqual(self.breaches(result=None), {"no JSON line"})

    def test_crashes_of_others_and_not_of_the_victim(self):
        node = {"name": "world", "exit_code": 139, "killed": False}
        self.assertEqual(self.breaches(summary={"reason": "x", "nodes": [node]}), {"crash"})
        said = story(STOPS).errors + [(1.1, "[world] /b/x.cc:12: Assertion failed: n > 0")]
        self.assertEqual(self.breaches(errors=said), {"crash"})

    def test_hangs_and_what_is_left(self):
        self.assertEqual(self.breaches(ended=None), {"hang"})
        node = {"name": "world", "exit_code": 137, "killed": True}
        ready = [(0.5, "mimesis: world is ready (0.5 s)")] + story(STOPS).errors
        self.assertEqual(self.breaches(summary={"reason": "x", "nodes": [node]}, errors=ready), {"hang"})
        self.assertEqual(self.breaches(orphans=["vision"], leftovers=["g/x.s"]), {"orphans", "leftovers"})
        self.assertEqual(self.breaches(log_check=1), {"log"})


if __name__ == "__main__":
    unittest.main()
