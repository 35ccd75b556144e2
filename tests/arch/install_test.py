#!/usr/bin/env python3
"""`cmake --install` brings a library that others can build on. docs/examples are built and run against it, in C++ and in Python, and
every launch file, scenario and model is where programs look for them. The probe is a project with habits of others."""
import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "docs" / "examples"
PYTHON = "/usr/bin/python3"
WAIT_S = 60  # some ten times what the slowest step takes
PROBE = """
cmake_minimum_required(VERSION 3.10)
project(probe LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 17)
add_custom_target(programs)
get_cmake_property(before VARIABLES)
find_package(Mimesis QUIET)
get_cmake_property(after VARIABLES)
get_cmake_property(cached CACHE_VARIABLES)
list(REMOVE_ITEM after ${before} ${cached} before)
list(FILTER after EXCLUDE REGEX "^([Mm]imesis_|CACHE)")
get_directory_property(options COMPILE_OPTIONS)
get_directory_property(included INCLUDE_DIRECTORIES)
get_directory_property(linked LINK_OPTIONS)
message("LEAKED=${after}${options}${included}${linked}")
if(TARGET Mimesis::log)
  message("LEAKED=Mimesis::log")
endif()

find_package(Mimesis 0.1 QUIET)
message("OLD=${Mimesis_FOUND}")
find_package(Mimesis QUIET COMPONENTS node lgo)
message("UNKNOWN=${Mimesis_FOUND}${Mimesis_lgo_FOUND} ${Mimesis_NOT_FOUND_MESSAGE}")
find_package(Mimesis REQUIRED COMPONENTS node log OPTIONAL_COMPONENTS lgo)
message("OPTIONAL=${Mimesis_FOUND}${Mimesis_log_FOUND}${Mimesis_lgo_FOUND}")
set(CMAKE_DISABLE_FIND_PACKAGE_Eigen3 TRUE)
find_package(Mimesis QUIET COMPONENTS kin)
message("PACKAGE=${Mimesis_FOUND} ${Mimesis_NOT_FOUND_MESSAGE}")
set(CMAKE_DISABLE_FIND_PACKAGE_Eigen3 FALSE)
set(path $ENV{PKG_CONFIG_LIBDIR})
set(ENV{PKG_CONFIG_LIBDIR} /nowhere)
find_package(Mimesis QUIET COMPONENTS image)
message("MODULE=${Mimesis_FOUND} ${Mimesis_NOT_FOUND_MESSAGE}")
set(ENV{PKG_CONFIG_LIBDIR} ${path})

file(WRITE ${CMAKE_BINARY_DIR}/other.cc "int main() {}")
add_executable(other ${CMAKE_BINARY_DIR}/other.cc)
add_subdirectory(examples)
"""

# Compares an image with its negative.
PAIRS = """
import mimesis
images = {}
with mimesis.Graph("judge") as graph:
    for received in graph.subscribe("camera/image", "negative/negative"):
        other = images.setdefault(received.stamp_ns, received)
        if other.topic != received.topic:
            assert all(a + b == 255 for a, b in zip(other.message.data, received.message.data, strict=True))
            break
"""


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*command, code=0, both=False, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != code:
        raise AssertionError(f"{command} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done.stdout + done.stderr if code or both else done.stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.work = pathlib.Path(cls.folder.name)
        cls.prefix = cls.work / "an installed tree"
        for component in ("library", "programs", "python", "data"):
            run(CMAKE, "--install", BUILD, "--prefix", cls.work / "prefix", "--component", component, "--strip")
        (cls.work / "prefix").rename(cls.prefix)  # nothing of it may depend on where it was installed
        (cls.work / "root").mkdir()
        (cls.work / "root" / "lib").symlink_to(cls.prefix / "lib")  # as /lib is a link to /usr/lib

        cls.probe, cls.examples = cls.work / "probe", cls.work / "probe" / "examples"
        shutil.copytree(EXAMPLES, cls.examples)
        (cls.probe / "CMakeLists.txt").write_text(PROBE)
        cls.said = run(CMAKE, "-S", cls.probe, "-B", cls.probe / "build", "-G", "Ninja", f"-DCMAKE_CXX_FLAGS={FLAGS}",
                       f"-DCMAKE_PREFIX_PATH={cls.work}/root", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
                       *(["-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld"] if shutil.which("ld.lld") else []), both=True)
        run(CMAKE, "--build", cls.probe / "build")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.runtime = tempfile.TemporaryDirectory()
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=self.runtime.name, XDG_STATE_HOME=self.folder.name, NO_COLOR="1",
                                PATH=f"{self.probe}/build/bin:{self.prefix}/bin:/usr/bin:{os.environ['PATH']}",
                                PYTHONPATH=f"{self.prefix}/lib/python3/dist-packages:{self.folder.name}", PYTHONDONTWRITEBYTECODE="1")
        self.environment.pop("MIMESIS_PROTOSET", None)

    def tearDown(self):
        self.runtime.cleanup()

    def do(self, *command, **options):
        return run(*command, env=self.environment, **options)

    @contextlib.contextmanager
    def started(self, *command, code=0):
        """Runs a program as long as the block, and gives the function that reads what it has printed. It has to stop when asked."""
        with tempfile.NamedTemporaryFile("w+") as said:
            process = subprocess.Popen([str(c) for c in command], env=self.environment, stdout=said, stderr=said)
            try:
                yield pathlib.Path(said.name).read_text
                process.send_signal(signal.SIGINT)
                self.assertEqual(process.wait(WAIT_S), code, f"{command}: {pathlib.Path(said.name).read_text()}")
            finally:
                process.kill()

    def wait_for(self, pattern, text):
        deadline = time.monotonic() + WAIT_S
        while not re.search(pattern, said := text()):
            self.assertLess(time.monotonic(), deadline, f"no '{pattern}' in: {said}")
            time.sleep(0.02)

    def test_data_is_whole(self):
        share = self.prefix / "share" / "mimesis"
        for folder in ("launch", "models"):
            self.assertEqual(files(share / folder), files(ROOT / folder))
        self.assertIn("formation.yaml", {p.name for p in (share / "launch" / "crowd").iterdir()})

    def test_programs_are_there_and_run(self):
        programs = {p.name for p in (self.prefix / "bin").iterdir()}
        self.assertLessEqual({"mimesis", "mimesis-launch", "mimesis-log", "mimesis_crowd", "mimesis_synthesizer"}, programs)
        self.assertRegex(run(self.prefix / "bin" / "mimesis", "--version"), r"^mimesis \d+\.\d+\.\d+\n$")

    def test_the_package_changes_nothing_of_others(self):
        told = dict(re.findall(r"(?m)^([A-Z]+)=(.*)$", self.said))
        self.assertEqual(told["LEAKED"], "")
        commands = {pathlib.Path(c["file"]).name: c["command"]
                    for c in json.loads((self.probe / "build/compile_commands.json").read_text())}
        self.assertIn("-std=gnu++17", commands["other.cc"])
        self.assertNotIn("ffp-contract", commands["other.cc"])
        self.assertNotIn("installed", commands["other.cc"])
        self.assertIn("-std=gnu++20", commands["talker.cc"])
        self.assertIn("-ffp-contract=off", commands["talker.cc"])
        self.assertIn("-std=gnu++20", commands["log_reader.cc"])
        for wrong in ("-W", "-O", "unity", str(ROOT)):
            self.assertNotIn(wrong, commands["talker.cc"])

    def test_components_are_found_or_refused_by_name(self):
        told = dict(re.findall(r"(?m)^([A-Z]+)=(.*)$", self.said))
        self.assertEqual(told["OLD"], "0")
        self.assertRegex(told["UNKNOWN"], "^0FALSE there is no component 'lgo', there are: .* log ")
        self.assertEqual(told["OPTIONAL"], "1TRUEFALSE")
        self.assertEqual(told["PACKAGE"], "0 component 'kin' needs package Eigen3")
        self.assertEqual(told["MODULE"], "0 component 'image' needs pkg-config and its module libpng")

    def test_the_package_names_no_path_of_its_build(self):
        package = b"".join(files(self.prefix / "lib/cmake").values())
        for path in (str(ROOT), str(BUILD), "/usr/lib/", "/usr/include"):
            self.assertNotIn(path.encode(), package)

    def test_a_folder_alone_builds_within_itself(self):
        """With make, in a folder of an odd name that holds what those of others do, and another build of itself."""
        alone = self.work / "my robot c++"
        shutil.copytree(EXAMPLES / "talker_listener", alone)
        (alone / "loop").symlink_to(".")
        (alone / "gone.h").symlink_to("nowhere")
        (alone / "latin.h").write_bytes(b"// \xe4\xf6\xfc\nint visit();  // no UTF-8: \xff\n")
        (alone / "build-before").mkdir()
        (alone / "build-before" / "talker.cc.o").write_bytes(b"\x7fELF\xff\xfe visit(")
        (alone / "talker.cc").write_text('#include "latin.h"\n' + (alone / "talker.cc").read_text())
        run(CMAKE, "-B", "build", "-G", "Unix Makefiles", f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DCMAKE_CXX_FLAGS={FLAGS}", cwd=alone)
        run(CMAKE, "--build", "build", "--target", "mimesis_talker", cwd=alone)
        self.assertIn("what it says", self.do(alone / "build/bin/mimesis_talker", "--help"))
        cache = (alone / "build/CMakeCache.txt").read_text()
        for package in ("Eigen3", "assimp", "urdfdom", "lz4", "png", "GTest", "CLI11", "nlohmann"):
            self.assertNotIn(package, cache)

    def test_talker_and_listener(self):
        folder = self.examples / "talker_listener"
        with self.started("mimesis", "launch", "-v", folder / "talker_listener.yaml", code=130) as said:
            self.wait_for("I heard 'hello 3'", said)
        for talker, listener in ((["mimesis_talker"], [PYTHON, folder / "listener.py"]),
                                 ([PYTHON, folder / "talker.py"], ["mimesis_listener", "--in", "said=talker/said"])):
            with self.started(*talker), self.started(*listener) as said:
                self.wait_for("I heard 'hello [2-9]'", said)

    def test_image_filter(self):
        folder = self.examples / "image_filter"
        self.assertIn('"width":640,"height":480,', self.do("mimesis", "launch", folder / "image_filter.yaml"))
        for node in (["mimesis_negative", "--in", "image=camera/image"], [PYTHON, folder / "negative.py"]):
            with self.started("mimesis_camera"), self.started(*node):
                self.do(PYTHON, "-c", PAIRS)

    def test_service(self):
        folder = self.examples / "service"
        run("protoc", f"--proto_path={folder}", f"--python_out={self.work}", "adder.proto")
        for node in (["mimesis_adder"], [PYTHON, folder / "adder.py"]):
            with self.started(*node):
                self.wait_for("adder/add", lambda: self.do("mimesis", "service", "list"))
                self.assertEqual(self.do(PYTHON, folder / "client.py", "2", "3"), "5\n")
                self.assertRegex(self.do("mimesis", "service", "call", "adder/add", '{"a": 2, "b": 40}'), "42")
                refused = self.do("mimesis", "service", "call", "adder/add", f'{{"a": {2**62}, "b": {2**62}}}', code=1)
                self.assertIn("the sum does not fit into 64 bits", refused)

    def test_parameter(self):
        def hears():
            return self.do("mimesis", "topic", "echo", "greeter/said", "--once", "--field", "message")

        for node in (["mimesis_greeter"], [PYTHON, self.examples / "parameter" / "greeter.py"]):
            with self.started(*node):
                self.wait_for("hello world!", hears)
                self.do("mimesis", "param", "set", "greeter", "name", "Ada")
                self.wait_for("hello Ada!", hears)
                self.assertIn("greeter.marks: 9 is outside [0, 5]", self.do("mimesis", "param", "set", "greeter", "marks", "9", code=2))

    def test_joint_controller(self):
        file = self.examples / "joint_controller" / "arm.yaml"  # the arm stands at -1.2, -0.6 rad ...
        self.assertIn('"joint_1_rad":-0.8,"joint_2_rad":-0.6,', self.do("mimesis", "launch", file))
        other = self.do("mimesis", "launch", file, "--set", "controller.joint=2", "--set", "controller.angle_rad=-0.2")
        self.assertIn('"joint_1_rad":-1.2,"joint_2_rad":-0.8,', other)

    def test_own_message(self):
        folder = self.examples / "own_message"
        self.assertRegex(self.do("mimesis", "launch", folder / "brightness.yaml"), r'"mean":148\.')
        run("protoc", f"--proto_path={folder}", f"--proto_path={self.prefix}/share/mimesis", f"--python_out={folder}", "msg/brightness.proto",
            "proto/header.proto")
        with self.started("mimesis_camera"), self.started(PYTHON, folder / "brightness.py"):
            self.wait_for(r"148\.", lambda: self.do("mimesis", "topic", "echo", "brightness/mean", "--once", "--timeout", "20", "--field", "mean"))

    def test_log_reader(self):
        log = self.work / "run.mcap"
        with self.started("mimesis_talker", "--set", "rate_hz=50"), self.started("mimesis", "log", "record", "--all", "--output", log):
            self.wait_for("x", lambda: "x" * (log.is_file() and log.stat().st_size > 4096))
        printed = self.do(self.probe / "build/examples/log_reader/log_reader", log, "talker/said")
        self.assertRegex(printed, r"(?m)^talker/said: \d+ x foxglove\.Log$")
        self.assertRegex(printed, r"(?m)^\d+ hello \d+$")

    def test_replay_test(self):
        self.do("ctest", "--test-dir", self.probe / "build", "--output-on-failure")
        self.do("mimesis", "log", "replay", "difference", EXAMPLES / "replay_test/test/difference.mcap", "--exec", "mimesis_difference",
                "--set", "gain=5", code=1)


if __name__ == "__main__":
    CMAKE, BUILD, FLAGS = sys.argv[1:4]
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
