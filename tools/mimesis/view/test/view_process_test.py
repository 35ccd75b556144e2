#!/usr/bin/python3
"""`mimesis view` as strangers and viewers meet it: view_process_test.py BIN_DIR COUNTER LOGS"""
import base64
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

BIN, COUNTER, LOGS = sys.argv[1:4]
PATIENCE_S = 20.0
TEXT, BINARY, CLOSE = 1, 2, 8


class Client:
    """A WebSocket over a plain socket."""

    def __init__(self, port, target="/", **headers):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        self.file = self.socket.makefile("rb")
        fields = {"Host": f"127.0.0.1:{port}", "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
                  "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
                  "Sec-WebSocket-Protocol": "foxglove.sdk.v1"} | {name.replace("_", "-"): value for name, value in headers.items()}
        self.socket.sendall((f"GET {target} HTTP/1.1\r\n" + "".join(f"{n}: {v}\r\n" for n, v in fields.items() if v) + "\r\n").encode())
        self.status = int(self.file.readline().split()[1])
        self.headers = {}
        while (line := self.file.readline().strip()):
            name, _, value = line.decode().partition(": ")
            self.headers[name.lower()] = value

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()
        self.socket.close()

    def body(self):
        return self.file.read().decode()

    def say(self, payload, opcode=TEXT):
        if not isinstance(payload, bytes):
            payload = json.dumps(payload).encode()
        length = len(payload)
        head = bytes([0x80 | opcode]) + (bytes([0x80 | length]) if length < 126 else bytes([0xFE]) + struct.pack(">H", length))
        self.socket.sendall(head + bytes(4) + payload)

    def next(self):
        """Opcode and payload of the next message."""
        first, second = self.file.read(2)
        length = second & 0x7F
        if length >= 126:
            length = struct.unpack(">H" if length == 126 else ">Q", self.file.read(2 if length == 126 else 8))[0]
        return first & 0x0F, self.file.read(length)

    def until(self, wanted):
        """What `wanted` makes of the first message for which that is true."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            opcode, payload = self.next()
            if (found := wanted(json.loads(payload) if opcode == TEXT else payload)):
                return found
        raise AssertionError("not said in time")

    def op(self, name):
        return self.until(lambda m: isinstance(m, dict) and m["op"] == name and m)

    def channel(self, topic):
        return self.until(lambda m: isinstance(m, dict) and m["op"] == "advertise" and
                          next((c for c in m["channels"] if c["topic"] == topic), None))

    def subscribe(self, topic, number=1):
        self.say({"op": "subscribe", "subscriptions": [{"id": number, "channelId": self.channel(topic)["id"]}]})


def message(m):
    """Subscription, time and payload of a message; else nothing."""
    return isinstance(m, bytes) and m[0] == 1 and (*struct.unpack("<IQ", m[1:13]), m[13:])


class Running(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        os.environ.update(XDG_RUNTIME_DIR=cls.folder.name, MIMESIS_GRAPH="g")
        cls.node = subprocess.Popen([COUNTER, "--name", "n", "--set", "rate_hz=500"], stderr=subprocess.DEVNULL)
        cls.view = subprocess.Popen([f"{BIN}/mimesis", "view", "--port", "0", "--key", "secret"],
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        cls.url = cls.view.stdout.readline().strip()
        cls.port = int(re.search(r":(\d+)/", cls.url)[1])

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait()
        cls.view.send_signal(signal.SIGINT)
        out, errors = cls.view.communicate(timeout=PATIENCE_S)
        cls.folder.cleanup()
        assert cls.view.returncode == 0, errors

    def trusted(self):
        return Client(self.port, "/?key=secret")


class View(Running):
    def test_its_address_is_printed_and_serves_a_page(self):
        self.assertEqual(self.url, f"http://127.0.0.1:{self.port}/?key=secret")
        with Client(self.port, "/?key=secret", Upgrade=None, Connection="close") as page:
            self.assertEqual(page.status, 200)
            self.assertIn("default-src 'self'", page.headers["content-security-policy"])

    def test_files_of_elsewhere_are_none(self):
        for path in ("/../../../../etc/passwd", "//etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/assets/../../view_verb.cc", "/nothing"):
            with Client(self.port, path, Upgrade=None, Connection="close") as page:
                self.assertEqual(page.status, 404, path)

    def test_messages_come_with_stamp_and_in_order(self):
        with self.trusted() as client:
            self.assertEqual(client.headers["sec-websocket-protocol"], "foxglove.sdk.v1")
            self.assertIn("services", client.op("serverInfo")["capabilities"])
            client.subscribe("n/out", 7)
            first, second = client.until(message), client.until(message)
            self.assertEqual(first[0], 7)
            self.assertLess(first[1], second[1])
            self.assertLess(abs(first[1] / 1e9 - time.time()), 60.0)
            client.say({"op": "unsubscribe", "subscriptionIds": [7]})

    def test_the_older_name_of_the_protocol_and_no_other(self):
        with Client(self.port, "/", Sec_WebSocket_Protocol="foxglove.websocket.v1") as old:
            self.assertEqual((old.status, old.headers["sec-websocket-protocol"]), (101, "foxglove.websocket.v1"))
        with Client(self.port, "/", Sec_WebSocket_Protocol="mqtt") as other:
            self.assertEqual(other.status, 400)

    def test_who_has_not_the_key_may_look_and_not_change(self):
        with Client(self.port) as client:
            self.assertEqual(client.op("serverInfo")["capabilities"], ["time", "connectionGraph"])
            client.subscribe("n/out")
            self.assertTrue(client.until(message))
            client.say({"op": "setParameters", "parameters": [{"name": "n.salt", "value": 9}]})
            self.assertIn("key", client.op("status")["message"])

    def test_pages_and_names_of_elsewhere_may_not_look(self):
        for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Host": f"127.0.0.1.evil.example:{self.port}"}):
            with Client(self.port, "/", **headers) as client:
                self.assertEqual(client.status, 403, headers)
        with Client(self.port, "/?key=guess", Origin="http://evil.example") as client:
            self.assertEqual(client.status, 403)
        with Client(self.port, "/", Origin=f"http://127.0.0.1:{self.port}") as own:
            self.assertEqual(own.status, 101)

    def test_parameters_are_shown_and_set(self):
        with self.trusted() as client, self.trusted() as other:
            other.say({"op": "subscribeParameterUpdates", "parameterNames": ["n.salt"]})
            client.say({"op": "getParameters", "parameterNames": [], "id": "all"})
            values = client.op("parameterValues")
            self.assertEqual(values["id"], "all")
            self.assertIn({"name": "n.rate_hz", "value": 500.0, "type": "float64"}, values["parameters"])
            client.say({"op": "setParameters", "id": "s", "parameters": [{"name": "n.salt", "value": 5}]})
            self.assertEqual(client.op("parameterValues")["parameters"], [{"name": "n.salt", "value": 5, "type": "float64"}])
            self.assertEqual(other.op("parameterValues")["parameters"][0]["value"], 5)
            client.say({"op": "setParameters", "parameters": [{"name": "n.salt", "value": -1}]})
            self.assertIn("outside [0, 1000000000]", client.op("status")["message"])

    def test_services_are_called_in_protobuf(self):
        with self.trusted() as client:
            service = client.until(lambda m: isinstance(m, dict) and m["op"] == "advertiseServices" and
                                   next((s for s in m["services"] if s["name"] == "n/params"), None))
            client.say(struct.pack("<BIII", 2, service["id"], 3, 8) + b"protobuf", BINARY)
            answer = client.until(lambda m: isinstance(m, bytes) and m[0] == 3 and m)
            self.assertEqual(struct.unpack("<II", answer[1:9]), (service["id"], 3))
            self.assertIn(b"rate_hz", answer)
            client.say(struct.pack("<BIII", 2, 999, 4, 8) + b"protobuf", BINARY)
            self.assertEqual(client.op("serviceCallFailure")["callId"], 4)

    def test_graph_says_who_publishes(self):
        with self.trusted() as client:
            client.say({"op": "subscribeConnectionGraph"})
            publishers = client.until(lambda m: isinstance(m, dict) and m["op"] == "connectionGraphUpdate" and
                                      {t["name"]: t["publisherIds"] for t in m["publishedTopics"]}.get("n/out"))
            self.assertEqual(publishers, ["n"])

    def test_rubbish_is_answered_and_changes_nothing(self):
        with self.trusted() as client:
            for rubbish in (b"\xff\xfe", b"[" * 5000, b"{}", b'{"op":"fly"}', b'{"op":"subscribe","subscriptions":[{"id":1,"channelId":77777}]}'):
                client.say(rubbish if rubbish[0] != 0xFF else b"nonsense")
                self.assertTrue(client.op("status")["message"])
            client.say(os.urandom(100), BINARY)
            self.assertTrue(client.op("status")["message"])
        for frame in (b"\x82\xff" + struct.pack(">Q", 1 << 30) + bytes(8), b"\xff" * 64, b"\x81\x05hello", os.urandom(300)):
            with self.trusted() as client:  # a frame of 1 GB, a wrong one, one without a mask
                client.socket.sendall(frame)
                client.socket.settimeout(PATIENCE_S)
                while client.socket.recv(1 << 16):
                    pass  # until the server ends it
        for _ in range(20):
            with socket.create_connection(("127.0.0.1", self.port)) as plain:
                plain.sendall(os.urandom(200))
        self.test_messages_come_with_stamp_and_in_order()

    def test_who_reads_nothing_holds_up_nobody(self):
        with self.trusted() as stuck, self.trusted() as client:
            stuck.subscribe("n/steps"), stuck.say({"op": "subscribeConnectionGraph"})
            client.subscribe("n/out")
            begin, stamps = time.monotonic(), []
            while time.monotonic() - begin < 1.0:
                stamps.append(client.until(message)[1])
            self.assertGreater(len(stamps), 50)

    def test_an_address_in_use_is_one_line(self):
        second = subprocess.run([f"{BIN}/mimesis", "view", "--port", str(self.port)], capture_output=True, text=True, timeout=PATIENCE_S)
        self.assertEqual(second.returncode, 2)
        self.assertEqual(second.stderr, f"cannot listen on 127.0.0.1:{self.port}: Address already in use\n")


@unittest.skipUnless("MIMESIS_SOAK_S" in os.environ, "no such case: MIMESIS_SOAK_S is not set")
class Soak(Running):
    """Clients come and go, some without a word: MIMESIS_SOAK_S seconds."""

    def memory_kb(self):
        return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{self.view.pid}/status").read_text())[1])

    def test_memory_stays_with_clients_that_come_and_go(self):
        seconds, clients, sizes = float(os.environ["MIMESIS_SOAK_S"]), [], []
        end, next_look = time.monotonic() + seconds, 0.0
        while (now := time.monotonic()) < end:
            clients.append(self.trusted())
            clients[-1].subscribe("n/out")
            for client in clients[1:]:  # the first never reads
                for _ in range(20):
                    client.until(message)
            if len(clients) == 5:
                gone = clients.pop(1)
                gone.socket.close() if len(sizes) % 2 else gone.say(b"", CLOSE)
                gone.__exit__()
            if now >= next_look:
                sizes.append(self.memory_kb())
                next_look = now + seconds / 40
        for client in clients:
            client.__exit__()
        print("memory [MB]:", *[f"{kb / 1024:.1f}" for kb in sizes])
        later = sizes[len(sizes) // 4:]
        self.assertLess(max(later[len(later) // 2:]), 1.05 * max(later[:len(later) // 2]) + 1024)


class ViewOfALog(unittest.TestCase):
    def test_a_log_is_played_and_nothing_is_left(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"XDG_RUNTIME_DIR": folder, "MIMESIS_GRAPH": "r"}
            log = f"{folder}/run.mcap"
            node = subprocess.Popen([COUNTER, "--name", "n"], stderr=subprocess.DEVNULL, env=environment)
            subprocess.run([f"{BIN}/mimesis", "log", "record", "--all", "--duration", "0.5", "--output", log], env=environment,
                           capture_output=True, check=True, timeout=PATIENCE_S)
            node.terminate(), node.wait()
            view = subprocess.Popen([f"{BIN}/mimesis", "view", log, "--port", "0", "--key", "k"], stdout=subprocess.PIPE,
                                    stderr=subprocess.DEVNULL, text=True, env=environment)
            port = int(re.search(r":(\d+)/", view.stdout.readline())[1])
            with Client(port, "/?key=k") as client:
                client.subscribe("n/out")
                self.assertTrue(client.until(message))
            view.send_signal(signal.SIGINT)
            self.assertEqual(view.wait(timeout=PATIENCE_S), 0)
            view.stdout.close()
            self.assertEqual([p.name for p in pathlib.Path(folder, "mimesis").iterdir() if p.name.startswith("view-")], [])

    def test_what_precedes_a_subscription_or_a_seek_is_delivered(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"XDG_RUNTIME_DIR": folder}
            subprocess.run([f"{BIN}/mimesis", "plan", "bar_table.yaml", "--hand", "0.6", "0.1", "0.6", "--scene", f"{folder}/q.mcap"],
                           capture_output=True, check=True, timeout=60.0, env=environment)
            view = subprocess.Popen([f"{BIN}/mimesis", "view", f"{folder}/q.mcap", "--port", "0", "--key", "k"], stdout=subprocess.PIPE,
                                    stderr=subprocess.DEVNULL, text=True, env=environment)
            port = int(re.search(r":(\d+)/", view.stdout.readline())[1])
            with Client(port, "/?key=k") as client:
                channels = {}
                client.until(lambda m: isinstance(m, dict) and m["op"] == "advertise" and
                             channels.update({c["topic"]: c["id"] for c in m["channels"]}) is None and "scene" in channels)
                subscribe = lambda topic, number: client.say({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channels[topic]}]})
                of = lambda number: lambda m: (found := message(m)) and found[0] == number and found
                subscribe("frames", 1)  # the scene, sent once and not latched, is over by then
                first = client.until(of(1))
                client.until(lambda m: (found := of(1)(m)) and found[1] > first[1] + 500_000_000)
                subscribe("scene", 2)
                self.assertLess(client.until(of(2))[1], first[1] + 500_000_000, "its own time, not that of its delivery")
                client.say({"op": "unsubscribe", "subscriptionIds": [1]})
                with Client(port, "/?key=k") as other:
                    service = other.until(lambda m: isinstance(m, dict) and m["op"] == "advertiseServices" and
                                          next((s for s in m["services"] if s["name"] == "player/seek"), None))
                    other.say(struct.pack("<BIII", 2, service["id"], 3, 8) + b"protobuf" + b"\x09" + struct.pack("<d", 2.0), BINARY)
                self.assertTrue(client.until(of(2)), "once more after a seek")
            view.send_signal(signal.SIGINT)
            self.assertEqual(view.wait(timeout=PATIENCE_S), 0)
            view.stdout.close()

    def images(self, log, environment, seeks):
        """Stamp and payload of camera/image, as the page gets it, after each seek [s, stamp; None: the first that comes]."""
        view = subprocess.Popen([f"{BIN}/mimesis", "view", log, "--port", "0", "--key", "k", "--paused"], stdout=subprocess.PIPE,
                                stderr=subprocess.DEVNULL, text=True, env=environment)
        port, seen = int(re.search(r":(\d+)/", view.stdout.readline())[1]), []
        with Client(port, "/?key=k") as client:
            channel, service = {}, {}
            def learn(m):
                if isinstance(m, dict) and m["op"] == "advertise":
                    channel.update({c["topic"]: c["id"] for c in m["channels"]})
                if isinstance(m, dict) and m["op"] == "advertiseServices":
                    service.update({s["name"]: s["id"] for s in m["services"]})
                return "camera/image" in channel and "player/seek" in service
            client.until(learn)
            client.say({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel["camera/image"]}]})
            for call, (position_s, stamp) in enumerate(seeks):
                client.say(struct.pack("<BIII", 2, service["player/seek"], call, 8) + b"protobuf\x09" + struct.pack("<d", position_s), BINARY)
                # While its own image is computed, one shortly before may come.
                seen.append(client.until(lambda m: (found := message(m)) and len(found[2]) > 4096 and (stamp is None or found[1] == stamp) and found[1:]))
        view.send_signal(signal.SIGINT)
        self.assertEqual(view.wait(timeout=PATIENCE_S), 0)
        view.stdout.close()
        return seen

    def test_elided_images_come_at_once_where_the_log_stands_and_to_the_last_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"XDG_RUNTIME_DIR": folder, "MIMESIS_GRAPH": "e"}
            sets = [f"--set={s}" for s in ("rate_hz=20", "source=renderer", "view.width_px=160", "view.height_px=120", "view.focal_px=185")]
            camera = subprocess.Popen([f"{BIN}/mimesis_camera", *sets], stderr=subprocess.DEVNULL, env=environment)
            recorder = subprocess.Popen([f"{BIN}/mimesis", "log", "record", "--all", "--elide", "camera/image:source=renderer",
                                         "--output", f"{folder}/run.mcap"], env=environment, stderr=subprocess.DEVNULL)
            images = [f"{BIN}/mimesis", "topic", "echo", "camera/image", "-n", "60"]
            subprocess.run(images, env=environment, stdout=subprocess.DEVNULL, check=True, timeout=60.0)
            camera.terminate(), camera.wait()
            recorder.send_signal(signal.SIGINT), recorder.wait()
            subprocess.run([f"{BIN}/mimesis", "log", "restore", f"{folder}/run.mcap", f"{folder}/whole.mcap"], check=True, timeout=60.0,
                           capture_output=True, env=environment)
            seeks = (2.4, 1.0, 2.0)  # forth, back, and forth again
            recorded = self.images(f"{folder}/whole.mcap", environment, [(s, None) for s in seeks])
            self.assertEqual(len(set(recorded)), len(seeks))
            painted = self.images(f"{folder}/run.mcap", environment, [(s, stamp) for s, (stamp, _) in zip(seeks, recorded)])
            self.assertTrue(painted == recorded, "other bytes")

    def film(self, *arguments, log="world.mcap"):
        return subprocess.run([f"{BIN}/mimesis", "view", f"{LOGS}/{log}", *arguments], capture_output=True, text=True, timeout=120.0)

    def test_films_that_cannot_be_are_one_line(self):
        for arguments, word in ((("--browser", "no-such-browser"), "no such program"), (("--from", "1e6"), "nothing at"), ((), "nothing in it is drawn")):
            made = self.film("--png", "/nowhere/x.png", *arguments, log="world.mcap" if arguments else "sim_hand.mcap")
            if "needs the page" in made.stderr or "needs a browser" in made.stderr:
                self.skipTest(made.stderr.strip())
            self.assertEqual(made.returncode, 2)
            self.assertRegex(made.stderr, f"^[^\n]*{word}[^\n]*\n$")

    def test_without_the_page_a_film_says_how_to_get_it(self):
        with tempfile.TemporaryDirectory() as folder:  # programs without share/mimesis/page beside them
            bin_dir = pathlib.Path(folder, "bin")
            bin_dir.mkdir()
            for name in ("mimesis", "mimesis-view"):
                shutil.copy(f"{BIN}/{name}", bin_dir)
            pathlib.Path(folder, "index.html").write_text("of somebody else")
            made = subprocess.run([bin_dir / "mimesis", "view", os.path.abspath(f"{LOGS}/world.mcap"), "--png", "/nowhere/x.png"], capture_output=True, text=True,
                                  timeout=PATIENCE_S, cwd=folder)
            self.assertRegex(made.stderr, r"^[^\n]*tools/setup viewer, then cmake --build build --target page\n$")

    def test_a_camera_is_six_numbers(self):
        for camera in ("1,2", "1,2,3,4,5,6,7", "1,2,3,4,5,x", "1;2;3;4;5;6"):
            made = self.film("--png", "/nowhere/x.png", "--camera", camera)
            self.assertNotEqual(made.returncode, 0, camera)
            self.assertIn("expected six numbers", made.stderr)

    def test_a_scene_becomes_a_picture_and_a_film(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = self.film("--png", f"{folder}/x.png", "--from", "1", "--width", "320", "--height", "200")
            if "needs the page" in picture.stderr or "needs a browser" in picture.stderr:
                self.skipTest(picture.stderr.strip())
            self.assertEqual(picture.returncode, 0, picture.stderr)
            png = pathlib.Path(folder, "x.png").read_bytes()
            self.assertEqual(struct.unpack(">4x4sII", png[8:24]), (b"IHDR", 320, 200))
            self.assertGreater(len(png), 5000, "one colour is far smaller")
            if not shutil.which("ffmpeg"):
                self.skipTest("a film needs ffmpeg")
            film = self.film("--film", f"{folder}/x.mp4", "--from", "0.5", "--to", "1.0", "--fps", "20", "--camera", "1.5,-1.5,1,0.3,0,0.2")
            self.assertEqual(film.returncode, 0, film.stderr)
            frames = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,width", "-of", "csv=p=0",
                                     f"{folder}/x.mp4"], capture_output=True, text=True, check=True)
            self.assertEqual(frames.stdout.strip(), "1280,11")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
