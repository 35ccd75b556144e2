#include <gtest/gtest.h>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;
using Lines = std::vector<std::string>;

TEST(GraphFile, ReadsEverything) {
  const GraphFile g = read_text(R"(
version: 1
clock: ${arg:clock}
args:
  clock: {type: string, default: sim, help: "which clock"}
  fast: {type: bool, default: "true"}
hosts:
  spine: {address: biped.local, user: robot, prefix: /opt}
defaults: {stop: {timeout: 1s}, restart: on-failure, env: {A: "1"}}
nodes:
  eye: {exec: mimesis_camera, params: {rate_hz: 30}, out: {image: cam/image}}
  arm:
    exec: mimesis_bridge
    args: [--verbose, "${run:log}/x"]
    after: [eye]
    required: true
    host: spine
    in: {image: cam/image}
    env: {B: "2"}
    restart: {policy: on-failure, delay: 100ms, backoff: 3, max: 2, window: 10s}
    stop: {order: last, signal: TERM}
    ready: {within: 5s}
    sched: {policy: fifo, priority: 80, cpus: [0, 1]}
  slow: {exec: x, if: "!${arg:fast}"}
result:
  until: arm/done
  timeout: 2 min
  success: arm/done.ok
  fields:
    ok: arm/done.ok
    error_mm: {from: arm/done.error_m, scale: 1000, digits: 1}
)");
  EXPECT_EQ(g.clock, "sim");
  ASSERT_EQ(g.nodes.size(), 2U);  // slow is switched off
  const NodeSpec& eye = g.nodes[0];
  EXPECT_EQ(eye.out.at(0).port, "image");
  EXPECT_EQ(eye.out.at(0).topic.text, "cam/image");
  EXPECT_EQ(eye.stop.timeout, 1s);
  EXPECT_EQ(eye.stop.signal, SIGINT);
  EXPECT_TRUE(eye.restart.on_failure);
  EXPECT_FALSE(eye.required);
  const NodeSpec& arm = g.nodes[1];
  EXPECT_EQ(arm.args.at(1).text, "/log/x");
  EXPECT_EQ(arm.after.at(0).text, "eye");
  EXPECT_TRUE(arm.required);
  EXPECT_EQ(arm.host->text, "spine");
  EXPECT_EQ(arm.restart.delay, 100ms);
  EXPECT_EQ(arm.restart.max, 2);
  EXPECT_TRUE(arm.stop.last);
  EXPECT_EQ(arm.stop.signal, SIGTERM);
  EXPECT_EQ(arm.ready_within, 5s);
  EXPECT_EQ(arm.sched.priority, 80);
  EXPECT_EQ(arm.sched.cpus, (std::vector<int>{0, 1}));
  EXPECT_EQ(arm.env, (std::vector<std::pair<std::string, std::string>>{{"A", "1"}, {"B", "2"}}));
  ASSERT_TRUE(g.result);
  EXPECT_EQ(g.result->timeout, 120s);
  EXPECT_EQ(g.result->success->topic, "arm/done");
  EXPECT_EQ(g.result->success->field, "ok");
  EXPECT_EQ(g.result->fields.at(1).scale, 1000.0);
  EXPECT_EQ(g.result->fields.at(1).digits, 1);
}

struct Mistake {
  const char* name;
  const char* nodes;  ///< text after "version: 1\n", from line 2
  const char* expected;
};

std::ostream& operator<<(std::ostream& out, const Mistake& m) { return out << m.name; }

class FindsLaunchMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(FindsLaunchMistake, AtItsPlace) {
  Lines mistakes;
  read_text(std::string("version: 1\n") + GetParam().nodes, mistakes);
  EXPECT_EQ(mistakes, (Lines{GetParam().expected}));
}

const Mistake kMistakes[] = {
    {"no_nodes", "clock: wall\n", "@:1:1: there are no nodes"},
    {"unknown_top", "ndoes: {}\nnodes: {a: {exec: x}}\n",
     "@:2:1: unknown key 'ndoes', did you mean 'nodes'?"},
    {"unknown_in_node", "nodes:\n  a:\n    exec: x\n    requierd: true\n",
     "@:5:5: unknown key 'requierd', did you mean 'required'?"},
    {"unknown_in_stop", "nodes: {a: {exec: x, stop: {oder: last}}}\n",
     "@:2:29: unknown key 'oder', did you mean 'order'?"},
    {"no_exec", "nodes:\n  a: {required: true}\n", "@:3:3: node 'a' has no exec"},
    {"node_is_text", "nodes:\n  b: {exec: x}\n  a: {exec: [x]}\n",
     "@:4:13: expected exec as text, found a list"},
    {"bad_flag", "nodes: {a: {exec: x, required: yes}}\n",
     "@:2:32: required: expected true or false, found 'yes'"},
    {"bad_clock", "clock: lockstpe\nnodes: {a: {exec: x}}\n",
     "@:2:8: clock: expected one of wall, sim, lockstep, found 'lockstpe', did you mean "
     "'lockstep'?"},
    {"bad_duration", "nodes: {a: {exec: x, ready: {within: 5}}}\n",
     "@:2:38: within: expected a time such as 500ms or 2s, found '5'"},
    {"bad_signal", "nodes: {a: {exec: x, stop: {signal: KILL}}}\n",
     "@:2:37: signal: expected one of INT, TERM, found 'KILL'"},
    {"bad_priority", "nodes: {a: {exec: x, sched: {policy: fifo, priority: 100}}}\n",
     "@:2:54: priority: expected a whole number in [1, 99], found '100'"},
    {"no_priority", "nodes: {a: {exec: x, sched: {policy: rr}}}\n",
     "@:2:29: policy rr needs a priority in [1, 99]"},
    {"bad_restart", "nodes: {a: {exec: x, restart: always}}\n",
     "@:2:31: restart: expected one of never, on-failure, found 'always'"},
    {"params_list", "nodes: {a: {exec: x, params: [1]}}\n",
     "@:2:30: expected params as a map, found a list"},
    {"after_unknown", "nodes: {arm: {exec: x}, b: {exec: x, after: [amr]}}\n",
     "@:2:46: after: there is no node 'amr', did you mean 'arm'?"},
    {"after_text", "nodes: {a: {exec: x}, b: {exec: x, after: a}}\n",
     "@:2:43: expected after as a list, found 'a'"},
    {"after_itself", "nodes: {a: {exec: x, after: [a]}}\n",
     "@:2:30: nodes wait for each other: a -> a"},
    {"circle",
     "nodes:\n  a: {exec: x, after: [c]}\n  b: {exec: x, after: [a]}\n  c: {exec: x, after: [b]}\n",
     "@:4:24: nodes wait for each other: a -> c -> b -> a"},
    {"arg_type", "args: {n: {type: int, default: two}}\nnodes: {a: {exec: x}}\n",
     "@:2:32: n: expected int, found 'two'"},
    {"arg_kind", "args: {n: {type: integer, default: 2}}\nnodes: {a: {exec: x}}\n",
     "@:2:18: type: expected one of string, bool, int, number, duration, path, found 'integer'"},
    {"arg_unset", "args: {n: {type: int}}\nnodes: {a: {exec: x}}\n",
     "@:2:11: argument 'n' has no default: give --arg n=VALUE"},
    {"variable", "args: {name: {default: x}}\nnodes: {a: {exec: \"${arg:nmae}\"}}\n",
     "@:3:20: no argument 'nmae' is declared, did you mean 'name'?"},
    {"result_path", "nodes: {a: {exec: x}}\nresult: {until: a/b, success: a/b}\n",
     "@:3:31: expected TOPIC.FIELD, found 'a/b'"},
    {"result_until", "nodes: {a: {exec: x}}\nresult:\n  timeout: 1s\n",
     "@:4:3: result needs until: TOPIC"},
    {"result_field", "nodes: {a: {exec: x}}\nresult: {until: a/b, fields: {e: {scale: 2}}}\n",
     "@:3:34: a result field needs from: TOPIC.FIELD"},
    {"host", "hosts: {h: {user: me}}\nnodes: {a: {exec: x}}\n", "@:2:9: host 'h' has no address"},
    {"address", "hosts: {h: {address: \"[fd00::2]:22\"}}\nnodes: {a: {exec: x}}\n",
     "@:2:22: host 'h': address: expected a name or an address such as 10.0.0.2 or fd00::2, "
     "without a port, found '[fd00::2]:22'"},
};

INSTANTIATE_TEST_SUITE_P(GraphFile, FindsLaunchMistake, ::testing::ValuesIn(kMistakes),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

TEST(GraphFile, RefusesOtherVersionsAtOnce) {
  const TemporaryFolder folder;
  Mistakes mistakes;
  read_graph_file(folder.write("g.yaml", "version: 2\nfuture: {}\n"), {}, "", mistakes);
  EXPECT_EQ(mistakes.lines(), (Lines{folder.path() + "/g.yaml:1:10: expected version: 1"}));
}

TEST(GraphFile, ArgumentsFromOutsideAreChecked) {
  const std::string text =
      "version: 1\nargs: {n: {type: int, default: 2}}\nnodes: {a: {exec: x}}\n";
  Lines mistakes;
  EXPECT_EQ(read_text(text, mistakes, {"n=7"}).args.at(0).second, "7");
  EXPECT_TRUE(mistakes.empty());
  read_text(text, mistakes, {"n=x", "m=1"});
  EXPECT_EQ(mistakes, (Lines{"--arg: the file declares no argument 'm'",
                             "--arg: n: expected int, found 'x'"}));
}

TEST(GraphFile, AddressesOfHostsAreNamesOrOfEitherKind) {
  const auto bound = [](const std::string& address) {
    Lines mistakes;
    const GraphFile graph = read_text(
        "version: 1\nhosts: {h: {address: \"" + address + "\"}}\nnodes: {a: {exec: x, host: h}}\n",
        mistakes);
    EXPECT_EQ(mistakes, Lines()) << address;
    return bind_address(graph, *graph.find("a"));
  };
  EXPECT_EQ(bound("10.77.0.2"), "tcp://10.77.0.2:*");
  EXPECT_EQ(bound("[FD77:0::2]"), "tcp://[fd77::2]:*");
  EXPECT_EQ(bound("fd77::2"), "tcp://[fd77::2]:*");
  EXPECT_EQ(bound("spine.example"), "tcp://0.0.0.0:*");
}

TEST(GraphFile, FindsAllMistakesAtOnce) {
  Lines mistakes;
  read_text("version: 1\nnodes:\n  a: {exec: x, foo: 1}\n  b: {after: [c]}\n", mistakes);
  EXPECT_EQ(mistakes.size(), 3U);
}

}  // namespace
}  // namespace mimesis::launch
