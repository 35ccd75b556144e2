#!/usr/bin/python3
"""Nodes in Python beside nodes in C++: usage: node_test.py PROTOSET COUNTER MIMESIS"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import mimesis  # noqa: E402

SUMMER = str(pathlib.Path(__file__).resolve().with_name("summer.py"))
COUNTER = MIMESIS = ""
LAUNCH = """version: 1
clock: {clock}
args:
  salt: {{type: int, default: 3}}
nodes:
  recorder:
    exec: mimesis
    args: [log, record, --all, --output, {log}]
    stop: {{order: last}}
  counter: {{exec: {counter}, after: [recorder], params: {{rate_hz: 100}}, in: {{a: summer/sum}}}}
  summer: {{exec: {summer}, after: [recorder], params: {{salt: "${{arg:salt}}"}}, in: {{word: counter/out}}}}
"""


class Nodes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        os.environ["MIMESIS_RUNTIME_DIR"] = os.environ["XDG_STATE_HOME"] = self.folder.name

    def say(self, *words):
        done = subprocess.run(words, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    def launch(self, clock, number=0):
        log = f"{self.folder.name}/{clock}{number}.mcap"
        file = pathlib.Path(self.folder.name, f"{clock}.yaml")
        file.write_text(LAUNCH.format(clock=clock, log=log, counter=COUNTER, summer=SUMMER))
        self.assertEqual(self.say(MIMESIS, "launch", "--check", str(file))[::2], (0, f"{file}: no mistakes\n"))
        code, out, err = self.say(MIMESIS, "launch", str(file), "--set", "clock.until_s=2")
        self.assertEqual(code, 0, err)
        self.assertNotIn("hangs", err)
        return log

    def test_mistakes_are_refused_in_one_line(self):
        pathlib.Path(self.folder.name, "a.yaml").write_text(
            "args: {salt: {type: int}, odd: 3}\nnodes: {summer: {params: {salt: \"${arg:salt}\"}}}\n")
        pathlib.Path(self.folder.name, "b.yaml").write_text("salt:\n")
        for words, line in ((["--set", "salt=2000"], "summer: summer.salt: 2000 is outside [0, 1000]\n"),
                            (["--set", "slat=2"], "summer: summer.slat: unknown parameter; there are: rate_hz, offset_s, salt\n"),
                            (["--in", "wrod=a/b"], "summer: summer.wrod: unknown input; there are: word\n"),
                            (["--params", f"{self.folder.name}/a.yaml#nodes.other.params"],
                             f"summer: {self.folder.name}/a.yaml#nodes.other.params: expected parameters as a map\n"),
                            (["--params", f"{self.folder.name}/a.yaml#nodes.summer.params"],
                             f"summer: {self.folder.name}/a.yaml#nodes.summer.params: '${{arg:salt}}' is not known to a node in Python, "
                             "expected ${arg:NAME} of the file\n"),
                            (["--params", f"{self.folder.name}/b.yaml"], "summer: summer.salt: 'null' is no int\n"),
                            (["--params", "/nowhere.yaml"], "summer: /nowhere.yaml: [Errno 2] No such file or directory: '/nowhere.yaml'\n")):
            self.assertEqual(self.say(SUMMER, "--check", *words), (2, "", line))

    def test_it_describes_itself(self):
        code, out, _ = self.say(SUMMER, "--describe", "--set", "salt=7")
        self.assertEqual(code, 0)
        told = json.loads(out)
        self.assertEqual([(p["key"], p["value"], p["changeable"]) for p in told["parameters"]],
                         [("rate_hz", 50.0, False), ("offset_s", 0.0, False), ("salt", 7, True)])
        self.assertEqual([p["name"] for p in told["ports"]], ["word", "sum", "beat", "health", "start", "steps"])
        self.assertEqual([s["name"] for s in told["services"]], ["add"])

    def test_in_lockstep_two_runs_and_replays_are_equal(self):
        a, b = self.launch("lockstep", 1), self.launch("lockstep", 2)
        code, out, err = self.say(MIMESIS, "log", "diff", a, b)
        self.assertEqual(code, 0, out + err)
        self.assertIn("equal: 400 messages", out)
        for node, program in (("summer", SUMMER), ("counter", COUNTER)):
            code, out, err = self.say(MIMESIS, "log", "replay", node, a, "--exec", program)
            self.assertEqual(code, 0, out + err)
        code, out, _ = self.say(MIMESIS, "log", "replay", "summer", a, "--exec", SUMMER, "--set", "salt=4")
        self.assertEqual(code, 1, out)
        self.assertEqual(self.say(MIMESIS, "log", "check", a)[0], 0)

    def test_on_a_simulated_clock_a_replay_is_equal(self):
        log = self.launch("sim")
        code, out, err = self.say(MIMESIS, "log", "replay", "summer", log, "--exec", SUMMER)
        self.assertEqual(code, 0, out + err)
        health = [h.message for h in mimesis.read_log(log, "summer/health")]
        self.assertEqual([i.lost for i in health[-1].inputs if i.topic == "counter/out"], [0])

    def test_a_step_that_fails_still_stops_what_it_moves(self):
        code, _, err = self.say(SUMMER, "--set", "salt=666")
        self.assertEqual(code, 1)
        self.assertRegex(err, "(?s)ValueError: an evil salt.*stopped")

    def test_messages_of_another_type_are_counted(self):
        with mimesis.Graph("odd") as graph:
            odd = graph.publish("odd/word", "mimesis.v1.Beat")
            node = subprocess.Popen([SUMMER, "--in", "word=odd/word"], stderr=subprocess.PIPE, text=True)
            for received in graph.subscribe("summer/health", policy="reliable", timeout_s=60.0):
                if sum(i.rejected for i in received.message.inputs) > 0:
                    break
                odd.send(odd.message())
            node.terminate()
            self.assertEqual(node.wait(60), 0)
            self.assertIn("input word takes (mimesis.v1.Publication); ignored", node.stderr.read())
            node.stderr.close()

    def test_on_the_wall_clock_what_it_is_asked_is_replayed(self):
        log = f"{self.folder.name}/wall.mcap"
        recorder = subprocess.Popen([MIMESIS, "log", "record", "--all", "--output", log], stderr=subprocess.DEVNULL,
                                    stdout=subprocess.DEVNULL)
        with mimesis.Graph("asker") as graph:
            while "recorder" not in {n.split("-")[0] for n in graph.nodes()} and not graph.nodes():
                time.sleep(0.02)
            node = subprocess.Popen([SUMMER, "--set", "salt=1"], stderr=subprocess.PIPE, text=True)
            heard = graph.subscribe("summer/sum", policy="reliable", timeout_s=60.0)
            first = next(heard)
            total = graph.call("summer/add", {"seq": 1000}, timeout_s=60.0).seq
            self.assertGreaterEqual(total, 1000)
            with self.assertRaisesRegex(mimesis.ServiceError, "13 brings bad luck"):
                graph.call("summer/add", {"seq": 13}, timeout_s=60.0)
            graph.call("summer/params", {"set": [{"key": "salt", "value": "5"}]}, timeout_s=60.0)
            with self.assertRaisesRegex(mimesis.ServiceError, "rate_hz: cannot be changed while the node runs"):
                graph.call("summer/params", {"set": [{"key": "rate_hz", "value": "5"}]}, timeout_s=60.0)
            sums = [first.message.seq] + [next(heard).message.seq for _ in range(20)]
            self.assertEqual(sums[-1] - sums[-2], 5)
            node.send_signal(signal.SIGTERM)
            self.assertEqual(node.wait(60), 0, node.stderr.read())
            node.stderr.close()
        recorder.send_signal(signal.SIGINT)
        self.assertEqual(recorder.wait(60), 0)
        code, out, err = self.say(MIMESIS, "log", "replay", "summer", log, "--exec", SUMMER)
        self.assertEqual(code, 0, out + err)


if __name__ == "__main__":
    os.environ["MIMESIS_PROTOSET"], COUNTER, MIMESIS = sys.argv[1:4]
    unittest.main(argv=sys.argv[:1], verbosity=2)
