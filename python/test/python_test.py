#!/usr/bin/python3
"""The Python package against a real node and the recorded logs: usage: python_test.py PROTOSET COUNTER LOGS"""
import contextlib
import io
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import mimesis  # noqa: E402
from google.protobuf import descriptor_pb2  # noqa: E402
from mimesis import types  # noqa: E402

COUNTER, LOGS = "", pathlib.Path()
CALLER = f"""
import sys
sys.path.insert(0, {str(pathlib.Path(mimesis.__file__).parents[1])!r})
import mimesis
with mimesis.Graph("caller") as graph:
    def refusal(service, request):
        try:
            return graph.call(service, request)
        except mimesis.ServiceError as error:
            return str(error)
    def shall(given, wanted):
        assert given == wanted, (given, wanted)
    shall(graph.call("server/add", {{"seq": 41}}).seq, 42)
    shall(refusal("server/add", {{"seq": 13}}), "service server/add: 13 brings bad luck")
    def put(**values):
        return refusal("server/params", {{"set": [{{"key": k, "value": v}} for k, v in values.items()]}})
    shall([(p.key, p.value, p.type, p.allowed) for p in put(gain="0.5").params],
          [("gain", "0.5", "number", "[0.0, 2.0]"), ("name", '"x"', "text", "")])
    shall(put(name="y", gain="3"), "service server/params: server.gain: 3 is outside [0.0, 2.0]")
    shall(put(gain="nan"), "service server/params: server.gain: nan is outside [0.0, 2.0]")
    shall(put(gian="1"), "service server/params: server.gian: unknown parameter; there are: gain, name")
    shall(put().params[1].value, '"x"')
"""


class Types(unittest.TestCase):
    def test_a_message_of_the_project_is_known_by_name(self):
        status = mimesis.message_type("mimesis.v1.TaskStatus")()
        self.assertEqual(status.header.seq, 0)
        with self.assertRaisesRegex(mimesis.MessageTypeError, "no message type 'mimesis.v1.Nothing'"):
            mimesis.message_type("mimesis.v1.Nothing")

    def test_definitions_that_end_programs_are_refused(self):
        def weak(part):
            part.field[0].options.weak = True

        def nested(part):
            part.nested_type.add(name="Inner").field.add(name="x", number=1, type=5, label=1).options.weak = True

        def extended(part):
            part.extension.add(name="x", number=1000, type=5, label=1, extendee=".mimesis.v1.Health").options.weak = True

        def lazy(part):
            part.field[1].options.lazy = True

        for spoil in (weak, nested, extended, lazy):
            files = descriptor_pb2.FileDescriptorSet.FromString(types.own_set())
            spoil(next(m for f in files.file for m in f.message_type if m.name == "Health"))
            with self.assertRaisesRegex(mimesis.MessageTypeError, "no valid definition"):
                types.classes_of(files.SerializeToString())
        with self.assertRaisesRegex(mimesis.MessageTypeError, "no valid definition"):
            types.classes_of(b"\xff" * 9)


class Live(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        os.environ["XDG_RUNTIME_DIR"] = self.folder.name
        self.node = None

    def tearDown(self):
        if self.node:
            self.node.kill()
            self.node.wait()
        self.folder.cleanup()

    def start(self, *options):
        self.node = subprocess.Popen([COUNTER, "--name", "counter", *options], stdout=subprocess.DEVNULL,
                                     stderr=subprocess.DEVNULL)

    def test_hears_a_node(self):
        self.start()
        with mimesis.Graph("listener") as graph:
            got = []
            for received in graph.subscribe("counter/out", policy="reliable", timeout_s=5.0):
                got.append(received)
                if len(got) == 20:
                    break
        self.assertEqual([r.seq for r in got], list(range(got[0].seq, got[0].seq + 20)))
        self.assertEqual(got[0].message.topic, "counter")
        self.assertEqual(got[0].source, "counter")
        self.assertEqual(graph.lost("counter/out"), 0)
        self.assertGreater(got[-1].stamp_ns, got[0].stamp_ns)

    def test_is_heard_by_a_node(self):
        self.start("--in", "latest=python/word", "--set", "rate_hz=50")
        with mimesis.Graph("python") as graph:
            word = graph.publish("python/word", "mimesis.v1.Publication")
            self.assertTrue(graph.wait_for_subscriber("python/word"))
            health = graph.subscribe("counter/health", policy="reliable", timeout_s=5.0)
            for n in range(5):
                word.send(word.message(start_id=n))
            inputs = {}
            for received in health:
                inputs = {i.topic: i for i in received.message.inputs}
                if inputs["python/word"].received == 5 or received.seq > 4:
                    break
        self.assertEqual(inputs["python/word"].received, 5)
        self.assertEqual(inputs["python/word"].lost, 0)
        self.assertEqual(inputs["python/word"].rejected, 0, "the type's hash is as C++ computes it")

    def test_calls_a_service(self):
        self.start()
        with mimesis.Graph("caller") as graph:
            self.assertEqual(graph.call("counter/add_one", {"seq": 41}).seq, 42)
            with self.assertRaisesRegex(mimesis.ServiceError, "expected fields of mimesis.v1.Publication"):
                graph.call("counter/add_one", {"nothing": 1})
            with self.assertRaisesRegex(mimesis.ServiceError, "no node offers service counter/none"):
                graph.call("counter/none", {}, timeout_s=0.2)

    def test_offers_services_and_parameters(self):
        kind = mimesis.message_type("mimesis.v1.Publication")

        def add(request):
            if request.seq == 13:
                raise mimesis.ServiceError("13 brings bad luck")
            return {"seq": request.seq + 1}

        with mimesis.Graph("server") as server:
            server.offer("add", kind, "mimesis.v1.Publication", add)
            gain = server.parameter("gain", 1.0, least=0.0, most=2.0, meaning="of all")
            server.parameter("name", "x")
            caller = subprocess.Popen([sys.executable, "-c", CALLER], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            for _ in server.every(0.02):
                if caller.poll() is not None:
                    break
            self.assertEqual((caller.returncode, caller.communicate()[0]), (0, ""))
            self.assertEqual(gain.value, 0.5)

    def test_python_hears_python_with_latched_and_own_classes(self):
        kind = mimesis.message_type("mimesis.v1.ClockTime")
        with mimesis.Graph("one") as one, mimesis.Graph("two") as two:
            out = one.publish("one/time", kind, latched=True)
            out.send(kind(time_ns=7), stamp_ns=5)
            messages = two.subscribe("one/time", timeout_s=0.05)
            for _ in range(100):  # the subscriber joins late; the publisher serves
                received = next(messages, None)
                if received:
                    break
                one.serve()
                messages = two._messages(("one/time",), 0.05)
            self.assertEqual((received.message.time_ns, received.stamp_ns, received.message.header.seq), (7, 5, 1))
            with self.assertRaises(mimesis.MessageTypeError):
                out.send(mimesis.message_type("mimesis.v1.Publication")())

    def test_is_heard_by_tcp(self):
        for address in ("127.0.0.1", "[::1]"):
            with mimesis.Graph("far", graph="there", bind=f"tcp://{address}:*") as far, mimesis.Graph("near", graph="here") as near:
                word = far.publish("far/word", "mimesis.v1.Publication", latched=True)
                word.send(word.message(start_id=3))
                info = mimesis.message_type("mimesis.v1.NodeInfo")()
                info.CopyFrom(far._info)  # as the launcher of several hosts shows it on another one
                for endpoints in (info.data_endpoints, info.reliable_endpoints):
                    self.assertRegex(endpoints[1], r"^tcp://.*:\d+$")
                    del endpoints[0]
                near._nodes = {"far": info}
                near._discover = lambda: near._meet(info, info.outputs[0], "reliable")
                near.subscribe("far/word", policy="reliable")
                for _ in range(100):
                    far.serve()
                    received = next(near._messages(("far/word",), 0.05), None)
                    if received:
                        break
                self.assertEqual((received.message.start_id, received.source), (3, "far"))

    def test_a_name_is_taken_once_and_free_again(self):
        with mimesis.Graph("single"):
            with self.assertRaisesRegex(ValueError, "a node 'single' runs already"):
                mimesis.Graph("single")
        with mimesis.Graph("single") as again:
            again.close()  # and once more at the end
        with self.assertRaisesRegex(ValueError, "is invalid"):
            mimesis.Graph("no/slash")

    def test_skips_entries_that_are_no_nodes(self):
        self.start()
        nodes = pathlib.Path(self.folder.name, "mimesis/default/nodes")
        with mimesis.Graph("listener") as graph, mimesis.Graph("liar") as liar, contextlib.redirect_stderr(io.StringIO()) as said:
            os.mkfifo(nodes / ".fifo")  # whoever opens it waits for ever
            (nodes / "fifo").write_bytes(b"")
            (nodes / "folder").mkdir()
            (nodes / ".\x1b[31m").mkdir()
            (nodes / "\x1b[31m").write_bytes(b"")
            (nodes / ".folder").symlink_to("/dev/zero")
            liar.publish("counter/out", "mimesis.v1.Publication")
            liar._info.data_endpoints[:] = ["garbage://x"]
            liar._announce()
            self.assertIsNotNone(next(graph.subscribe("counter/out", timeout_s=5.0), None))
            (nodes / "liar").write_bytes(b"rubbish")
            self.assertEqual(set(graph.nodes()), {"counter"})
        for part in ("/.fifo: expected a regular file", "'garbage://x'", "expected the NodeInfo of node liar", "/.\\u001b[31m: "):
            self.assertIn(part, said.getvalue())


class Logs(unittest.TestCase):
    def test_reads_recorded_logs(self):
        messages = list(mimesis.read_log(LOGS / "cognition.mcap", "vision/observation"))
        self.assertGreater(len(messages), 10)
        self.assertEqual(messages[0].message.DESCRIPTOR.full_name, "mimesis.v1.Observation")
        self.assertEqual([m.seq for m in messages], sorted(m.seq for m in messages))

    def test_says_what_is_damaged(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "x.mcap")
            path.write_bytes(b"nothing")
            with self.assertRaisesRegex(mimesis.LogError, "not an MCAP file"):
                list(mimesis.read_log(path))
            whole = (LOGS / "sim_body.mcap").read_bytes()
            path.write_bytes(whole[:len(whole) // 2])
            cut = len(list(mimesis.read_log(path)))
            self.assertLess(cut, len(list(mimesis.read_log(LOGS / "sim_body.mcap"))))


if __name__ == "__main__":
    os.environ["MIMESIS_PROTOSET"], COUNTER, LOGS = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    unittest.main(argv=sys.argv[:1])
