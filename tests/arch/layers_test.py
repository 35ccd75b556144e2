#!/usr/bin/python3
"""tests/arch/layers finds each kind of forbidden include in a broken tree, and none in ours."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

LAYERS = pathlib.Path(__file__).resolve().parent / "layers"
GOOD = {
    "common/kin/arm.h": "#include <Eigen/Core>\n",
    "common/runtime/ports.h": '#include "proto/header.pb.h"\n',
    "common/runtime/bus.cc": "#include <zmq.hpp>\n#include <thread>\n",
    "nodes/a/a.h": '#include "common/kin/arm.h"\n',
    "nodes/a/a.cc": '#include "nodes/a/a.h"\n',
    "nodes/a/a_node.h": '#include "common/runtime/ports.h"\n#include "nodes/a/a.h"\n',
    "nodes/a/main.cc": '#include "nodes/a/a_node.h"\n',
    "nodes/a/test/a_test.cc": '#include "common/testing/loopback.h"\n#include "nodes/a/a.h"\n',
    "nodes/b/main.cc": "",
    "nodes/b/CMakeLists.txt": "b_part(maths)\nb_part(model PRIVATE_LINK json)  # files\nadd(c_part x)\n",
    "nodes/b/maths/m.cc": "#include <Eigen/Core>\n",
    "nodes/b/model/file.cc": '#include <nlohmann/json.hpp>\n#include <fstream>\n',
    "experiments/b/f.cc": '#include "experiments/harness/figure.h"\n#include "nodes/b/maths/m.h"\n',
    "nodes/b/maths/test/m_test.cc": '#include "common/testing/no_malloc.h"\n',
    "nodes/b/b.h": "#include <chrono>\n",
    "hw/can/bus.h": "",
    "hw/cia402/axis.h": "",
    "hw/cia402/canopen.h": "",
    "hw/sim/cia402/drive.h": '#include "hw/cia402/axis.h"\n',
    "hw/sim/plant/main.cc": "",
    "hw/sim/plant/plant.h": '#include "hw/can/bus.h"\n',
    "hw/can/test/bus_test.cc": '#include "hw/sim/plant/plant.h"\n',
    "tests/graph/all_test.cc": '#include "nodes/a/a.h"\n#include "nodes/b/b.h"\n',
}


def layers(files):
    with tempfile.TemporaryDirectory() as root:
        for path, text in files.items():
            file = pathlib.Path(root, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        run = subprocess.run([LAYERS, root], capture_output=True, text=True, check=False)
        return run.returncode, run.stdout


class Layers(unittest.TestCase):
    def expect(self, path, line, finding):
        """GOOD with `line` put at the beginning of `path` has mistakes; the first one is `finding`."""
        code, out = layers({**GOOD, path: line + "\n" + GOOD.get(path, "")})
        self.assertEqual(code, 1, out)
        self.assertIn(f"{path}:1: {finding}", out)

    def test_our_sources_keep_the_layers(self):
        run = subprocess.run([LAYERS], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stdout)

    def test_a_good_tree_has_no_mistakes(self):
        self.assertEqual(layers(GOOD)[0], 0, layers(GOOD)[1])

    def test_the_simulated_drive_has_its_own_codec(self):
        self.expect("hw/sim/cia402/drive.h", '#include "hw/cia402/canopen.h"', "hw/cia402/canopen.h: the simulated drive")

    def test_a_node_never_includes_another(self):
        self.expect("nodes/a/a_node.h", '#include "nodes/b/b.h"', "nodes/b/b.h: belongs to node nodes/b")
        self.expect("nodes/a/test/a_test.cc", '#include "nodes/b/b.h"', "nodes/b/b.h: belongs to node nodes/b")
        self.expect("hw/can/bus.h", '#include "hw/sim/plant/plant.h"', "hw/sim/plant/plant.h: belongs to node")

    def test_arrows_point_downwards(self):
        self.expect("common/kin/arm.h", '#include "hw/can/bus.h"', "hw/can/bus.h: common is below hw")
        self.expect("nodes/a/a_node.h", '#include "hw/can/bus.h"', "hw/can/bus.h: only the bridge")
        self.expect("hw/can/bus.h", '#include "tools/x.h"', "tools/x.h: hw is below tools")
        self.expect("common/kin/arm.h", '#include "proto/bridge.pb.h"', "proto/bridge.pb.h: common/kin computes only")
        self.expect("common/kin/arm.cc", '#include "common/runtime/bus.h"', "common/runtime/bus.h: common/kin")

    def test_nothing_includes_an_experiment(self):
        self.expect("nodes/a/a_node.h", '#include "experiments/b/f.h"', "experiments/b/f.h: the product includes no")
        self.expect("tools/x.cc", '#include "experiments/b/f.h"', "experiments/b/f.h: the product includes no")

    def test_an_algorithm_is_pure(self):
        self.assertEqual(layers({**GOOD, "hw/sim/plant/plant.h": "#include <sys/socket.h>\n"})[0], 0)
        for include in ("<sys/socket.h>", "<zmq.h>", "<spdlog/spdlog.h>", "<thread>", "<mutex>", "<yaml-cpp/yaml.h>",
                        "<google/protobuf/message.h>", '"proto/bridge.pb.h"', '"common/runtime/log.h"'):
            self.expect("nodes/a/a.cc", "#include " + include, "the algorithm of a node reaches -> " + include[1:-1])
        self.expect("nodes/a/a.cc", "auto t = std::chrono::steady_clock::now();", "the algorithm of a node reads steady")

    def test_an_algorithm_is_pure_through_headers_too(self):
        code, out = layers({**GOOD, "common/kin/arm.h": "#include <thread>\n"})
        self.assertEqual(code, 1)
        self.assertIn("nodes/a/a.cc:1: the algorithm of a node reaches -> nodes/a/a.h -> common/kin/arm.h -> thread", out)

    def test_a_part_is_an_algorithm(self):
        for part, include in (("maths", "<nlohmann/json.hpp>"), ("maths", '"proto/bridge.pb.h"'), ("model", "<mutex>"),
                              ("maths", '"common/runtime/log.h"'), ("model", "<spdlog/spdlog.h>")):
            self.expect(f"nodes/b/{part}/x.cc", "#include " + include, "the algorithm of a node reaches")
        self.expect("nodes/b/maths/m.cc", "auto t = std::chrono::system_clock::now();", "the algorithm of a node reads")
        code, _ = layers({**GOOD, "nodes/b/shell/x.cc": '#include "common/runtime/log.h"\n'})
        self.assertEqual(code, 0)  # no part: a folder of the shell

    def test_heavy_libraries_stay_out_of_headers(self):
        self.expect("common/runtime/ports.h", "#include <yaml-cpp/yaml.h>", "<yaml-cpp/yaml.h>: a heavy library")


if __name__ == "__main__":
    sys.exit(unittest.main())
