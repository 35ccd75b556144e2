// Language of launch files: include, groups, for, if, implies, ${host:}.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using Lines = std::vector<std::string>;
using Args = std::vector<std::pair<std::string, std::string>>;

/// Launch files in a folder; the first is read.
class Language : public ::testing::Test {
 protected:
  GraphFile read(const std::string& text, const Lines& args = {}) {
    mistakes_ = {};
    GraphFile g =
        read_graph_file(folder_.write("g.yaml", "version: 1\n" + text), args, "/log", mistakes_);
    return g;
  }
  GraphFile read_well(const std::string& text, const Lines& args = {}) {
    GraphFile g = read(text, args);
    EXPECT_EQ(mistakes(), Lines{});
    return g;
  }
  void write(const std::string& name, const std::string& text) {
    folder_.write(name, "version: 1\n" + text);
  }
  /// With "@/" for the folder.
  Lines mistakes() const {
    Lines lines = mistakes_.lines();
    for (std::string& line : lines) {
      for (std::size_t at; (at = line.find(folder_.path())) != std::string::npos;)
        line.replace(at, folder_.path().size(), "@");
    }
    return lines;
  }
  static Lines names(const GraphFile& g) {
    Lines all;
    for (const NodeSpec& node : g.nodes) all.push_back(node.name.text);
    return all;
  }
  static Lines after(const NodeSpec& node) {
    Lines all;
    for (const Text& before : node.after) all.push_back(before.text);
    return all;
  }

  TemporaryFolder folder_;
  Mistakes mistakes_;
};

TEST_F(Language, ForRepeatsANodeForEachValue) {
  const GraphFile g = read_well(R"(args: {eyes: {default: "left, right"}}
nodes:
  eye_${arg:side}:
    for: {side: "${arg:eyes}"}
    exec: x
    args: ["${arg:side}"]
    out: {image: "cam/${arg:side}"}
    after: ["arm${arg:side}"]
  arm${arg:n}: {for: {n: [left, right, 3]}, exec: x, if: "true"}
)");
  EXPECT_EQ(names(g), (Lines{"eye_left", "eye_right", "armleft", "armright", "arm3"}));
  EXPECT_EQ(g.nodes[1].args.at(0).text, "right");
  EXPECT_EQ(g.nodes[1].out.at(0).topic.text, "cam/right");
  EXPECT_EQ(after(g.nodes[1]), Lines{"armright"});
  // The node reads its parameters where they are written.
  EXPECT_EQ(g.nodes[1].params, g.file + "#nodes.eye_${arg:side}.params");
  EXPECT_EQ(g.nodes[1].given, (Args{{"eyes", "left, right"}, {"side", "right"}}));
  EXPECT_EQ(
      names(read_well("args: {n: {default: ''}}\nnodes: {a: {exec: x}, 'b${arg:i}': {exec: x, "
                      "for: {i: '${arg:n}'}}}\n")),
      Lines{"a"});
}

TEST_F(Language, GroupsShareSettingsAConditionAndAName) {
  const std::string text = R"(args: {sim: {type: bool, default: true}}
hosts: {spine: {address: 10.0.0.2}}
defaults: {stop: {signal: TERM}, env: {A: "1"}}
groups:
  drives:
    host: spine
    env: {B: "2"}
    restart: on-failure
    nodes:
      left: {exec: x, env: {C: "3"}, restart: never}
      right: {exec: x, host: ""}
  world:
    if: ${arg:sim}
    after: [drives]
    nodes:
      table: {exec: x}
      off: {exec: x, if: false}
nodes:
  eye: {exec: x, after: [world]}
)";
  const GraphFile g = read_well(text);
  EXPECT_EQ(names(g), (Lines{"left", "right", "table", "eye"}));
  const NodeSpec &left = *g.find("left"), &right = *g.find("right");
  EXPECT_EQ(left.host->text, "spine");
  EXPECT_FALSE(right.host) << "this machine";
  EXPECT_FALSE(left.restart.on_failure);
  EXPECT_TRUE(right.restart.on_failure);
  EXPECT_EQ(left.stop.signal, SIGTERM);
  EXPECT_EQ(left.env, (Args{{"A", "1"}, {"B", "2"}, {"C", "3"}}));
  EXPECT_EQ(left.params, g.file + "#groups.drives.nodes.left.params");
  EXPECT_EQ(after(*g.find("table")), (Lines{"left", "right"}));
  EXPECT_EQ(after(*g.find("eye")), Lines{"table"});

  const GraphFile real = read_well(text, {"sim=false"});
  EXPECT_EQ(names(real), (Lines{"left", "right", "eye"}));
  EXPECT_TRUE(after(*real.find("eye")).empty());
}

TEST_F(Language, AGroupIsRepeatedAsAWhole) {
  const GraphFile g = read_well(R"(groups:
  robots:
    for: {r: [a, b]}
    nodes:
      bridge_${arg:r}: {exec: x}
      leg_${arg:r}_${arg:s}: {for: {s: [l, r]}, exec: x, after: ["bridge_${arg:r}"]}
nodes: {last: {exec: x, after: [robots]}}
)");
  EXPECT_EQ(names(g),
            (Lines{"bridge_a", "leg_a_l", "leg_a_r", "bridge_b", "leg_b_l", "leg_b_r", "last"}));
  EXPECT_EQ(after(*g.find("leg_b_l")), Lines{"bridge_b"});
  EXPECT_EQ(g.find("leg_b_l")->given, (Args{{"r", "b"}, {"s", "l"}}));
  EXPECT_EQ(g.find("last")->after.size(), 6U);
}

TEST_F(Language, ConditionsChooseAmongNodesOfOneName) {
  const std::string text = R"(args: {sim: {type: bool, default: true}}
groups:
  real: {if: "!${arg:sim}", nodes: {eye: {exec: camera}}}
  simulated: {if: "${arg:sim}", nodes: {eye: {exec: renderer}}}
)";
  EXPECT_EQ(read_well(text).find("eye")->exec.text, "renderer");
  EXPECT_EQ(read_well(text, {"sim=false"}).find("eye")->exec.text, "camera");
}

TEST_F(Language, IncludedNodesJoinTheGraph) {
  std::filesystem::create_directory(folder_.path() + "/parts");
  write("parts/arm.yaml", R"(clock: sim
args: {bus: {}, rate: {type: int, default: 5}, host: {default: ""}}
defaults: {restart: on-failure, host: "${arg:host}"}
hosts: {spine: {address: 10.0.0.2}}
groups: {chain: {nodes: {drives: {exec: x, args: ["${arg:bus}", "${arg:rate}"]}}}}
nodes:
  bridge: {exec: x, after: [chain, recorder], in: {image: eye/image, state: drives/state}, out: {arm: bridge/joint_states}}
outside: [bridge/moved, far/away]
result: {until: a/b}
)");
  const std::string text = R"(hosts: {spine: {address: 10.0.0.2}}
nodes: {recorder: {exec: x}}
outside: [here/too]
include:
  - {file: parts/arm.yaml, args: {bus: can0}}
  - {file: parts/arm.yaml, namespace: left, args: {bus: can1, rate: 7, host: spine}}
  - {file: parts/arm.yaml, namespace: off, args: {bus: can2}, if: false}
)";
  const GraphFile g = read_well(text);
  EXPECT_EQ(names(g), (Lines{"recorder", "drives", "bridge", "left_drives", "left_bridge"}));
  EXPECT_EQ(g.clock, "wall");
  EXPECT_FALSE(g.result) << "that of an included file does not count";
  EXPECT_EQ(g.included, Lines{folder_.path() + "/parts/arm.yaml"});
  Lines outside;
  for (const launch::Text& topic : g.outside) outside.push_back(topic.text);
  EXPECT_EQ(outside,
            (Lines{"bridge/moved", "far/away", "left_bridge/moved", "far/away", "here/too"}));
  const NodeSpec& bridge = *g.find("left_bridge");
  EXPECT_EQ(after(bridge), (Lines{"left_drives", "recorder"}));
  EXPECT_EQ(bridge.in.at(0).topic.text, "eye/image") << "of the graph around";
  EXPECT_EQ(bridge.in.at(1).topic.text, "left_drives/state");
  EXPECT_EQ(bridge.out.at(0).topic.text, "left_bridge/joint_states");
  EXPECT_EQ(bridge.params, folder_.path() + "/parts/arm.yaml#nodes.bridge.params");
  EXPECT_EQ(bridge.given, (Args{{"bus", "can1"}, {"rate", "7"}, {"host", "spine"}}));
  EXPECT_EQ(bridge.host->text, "spine");
  EXPECT_TRUE(bridge.restart.on_failure);
  EXPECT_FALSE(g.find("recorder")->restart.on_failure) << "defaults are those of a file";
  EXPECT_EQ(g.hosts.size(), 1U);
  EXPECT_EQ(g.find("drives")->args.at(1).text, "5");

  // The recorder learns which files to keep; nodes elsewhere read the same path.
  const launch::Run run{.graph = "g", .log = "/log", .sets = {}};
  GraphFile foreign = g;
  foreign.nodes[0].ready_when_started = true;
  const Command recorder = command(foreign, foreign.nodes[0], run);
  const auto told = nlohmann::json::parse(recorder.env.back().second);
  EXPECT_EQ(told["included"], nlohmann::json(g.included));
}

TEST_F(Language, NamespacesOfIncludedFilesAreNested) {
  write("eye.yaml", "nodes: {eye: {exec: x, in: {light: lamp/on}}}\n");
  write("head.yaml",
        "include: [{file: eye.yaml, namespace: l}]\nnodes: {lamp: {exec: x, after: [l_eye]}}\n");
  const GraphFile g = read_well("include: [{file: head.yaml, namespace: r}]\n");
  EXPECT_EQ(names(g), (Lines{"r_l_eye", "r_lamp"}));
  EXPECT_EQ(g.nodes[0].in.at(0).topic.text, "r_lamp/on");
  EXPECT_EQ(after(g.nodes[1]), Lines{"r_l_eye"});
}

TEST_F(Language, AHostThatIsSwitchedOffIsThisMachine) {
  const std::string text = R"(args: {sim: {type: bool, default: false}}
hosts: {spine: {address: 10.9.9.9, if: "!${arg:sim}"}}
nodes: {bridge: {exec: x, host: spine, args: ["tcp:${host:spine}:502"]}}
)";
  const GraphFile far = read_well(text);
  EXPECT_NE(far.far(far.nodes[0]), nullptr);
  EXPECT_EQ(far.nodes[0].args.at(0).text, "tcp:10.9.9.9:502");
  const GraphFile here = read_well(text, {"sim=true"});
  EXPECT_FALSE(here.several_hosts());
  EXPECT_FALSE(here.nodes[0].host);
  EXPECT_EQ(here.nodes[0].args.at(0).text, "tcp:127.0.0.1:502");
}

TEST_F(Language, AFlagImpliesOtherDefaults) {
  const std::string text = R"(clock: ${arg:clock}
args:
  sim: {type: bool, default: false, implies: {clock: lockstep, bus: "embedded:arm"}}
  clock: {default: wall}
  bus: {default: can0}
nodes: {bridge: {exec: x, args: ["${arg:bus}"]}}
result: {if: "${arg:sim}", until: a/b}
)";
  const GraphFile real = read_well(text);
  EXPECT_EQ(real.clock, "wall");
  EXPECT_FALSE(real.result);
  const GraphFile sim = read_well(text, {"sim=true"});
  EXPECT_EQ(sim.clock, "lockstep");
  EXPECT_TRUE(sim.result);
  EXPECT_EQ(sim.nodes[0].given,
            (Args{{"sim", "true"}, {"clock", "lockstep"}, {"bus", "embedded:arm"}}));
  EXPECT_EQ(read_well(text, {"sim=true", "bus=can7"}).nodes[0].args.at(0).text, "can7");
}

TEST_F(Language, MistakesOfSeveralFilesNameTheirPlaces) {
  write("a.yaml", "include: [{file: g.yaml}]\nnodes: {a: {exec: x}}\n");
  read("include: [{file: a.yaml}]\nnodes: {b: {exec: x}}\n");
  EXPECT_EQ(mistakes(), Lines{"@/a.yaml:2:18: files include each other: @/g.yaml includes the next "
                              "(@/g.yaml:2:18), @/a.yaml includes the next (@/a.yaml:2:18)"});
  write("a.yaml", "nodes: {b: {exec: x}}\n");
  read("include: [{file: a.yaml}]\nnodes: {b: {exec: x}}\n");
  EXPECT_EQ(mistakes(), Lines{"@/g.yaml:3:9: there is a node 'b' already (@/a.yaml:2:9), expected "
                              "another name, or a namespace of what is included"});
  write("a.yaml", "hosts: {h: {address: localhost}}\nnodes: {a: {exec: x, requierd: true}}\n");
  read("hosts: {h: {address: 10.0.0.7}}\ninclude: [{file: a.yaml}]\n");
  EXPECT_EQ(
      mistakes(),
      (Lines{"@/a.yaml:2:9: host 'h' is another one at @/g.yaml:2:9, expected the same values",
             "@/a.yaml:3:22: unknown key 'requierd', did you mean 'required'?"}));
  folder_.write("a.yaml", "version: 1\nnodes: {a: {exec: [x}}\n");
  read("include: [{file: a.yaml}]\n");
  EXPECT_EQ(mistakes(),
            Lines{"@/a.yaml:2:21: found }, expected the other half of the [ on line 2"});
  folder_.write("a.yaml", "version: 2\n");
  read("include: [{file: a.yaml}]\n");
  EXPECT_EQ(mistakes(), Lines{"@/a.yaml:1:10: expected version: 1"});
  write("a.yaml", "args: {n: {type: int}}\nnodes: {a: {exec: x}}\n");
  read("include: [{file: a.yaml}]\n");
  EXPECT_EQ(mistakes(), Lines{"@/g.yaml:2:18: argument 'n' of @/a.yaml has no default, expected "
                              "args: {n: VALUE}"});
  read("include: [{file: a.yaml, args: {n: two}}]\n");
  EXPECT_EQ(mistakes(), Lines{"@/g.yaml:2:33: n: expected int, found 'two'"});
  read("include: [{file: a.yaml, args: {n: 2, nn: 3}}]\n");
  EXPECT_EQ(mistakes(),
            Lines{"@/g.yaml:2:39: @/a.yaml declares no argument 'nn', did you mean 'n'?"});
}

TEST_F(Language, ManyIncludesEnd) {
  for (int i = 0; i < 20; ++i) {
    const std::string next = "{file: a" + std::to_string(i + 1) + ".yaml, namespace: ";
    write("a" + std::to_string(i) + ".yaml",
          i == 19 ? "nodes: {a: {exec: x}}\n" : "include: [" + next + "x}, " + next + "y}]\n");
  }
  read("include: [{file: a0.yaml}]\n");
  ASSERT_FALSE(mistakes().empty());
  EXPECT_NE(mistakes().front().find("more than 1000 files are included"), std::string::npos);
}

struct Case {
  const char* name;
  const char* text;  ///< from line 2; there is a file part.yaml with a node p and an argument n
  const char* expected;
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class FindsLanguageMistake : public Language, public ::testing::WithParamInterface<Case> {};

TEST_P(FindsLanguageMistake, AtItsPlace) {
  write("part.yaml", "args: {n: {type: int, default: 1}}\nnodes: {p: {exec: x}}\n");
  read(GetParam().text);
  EXPECT_EQ(mistakes(), (Lines{GetParam().expected}));
}

const Case kCases[] = {
    {"include_map", "include: {file: part.yaml}\n",
     "@/g.yaml:2:10: expected include as a list, found a map"},
    {"include_text", "include: [part.yaml]\n", "@/g.yaml:2:11: expected a map, found 'part.yaml'"},
    {"include_no_file", "include: [{namespace: a}]\n",
     "@/g.yaml:2:11: an include needs file: FILE"},
    {"include_missing", "include: [{file: prat.yaml}]\n",
     "@/g.yaml:2:18: there is no file '@/prat.yaml', did you mean 'part.yaml'?"},
    {"include_itself", "include: [{file: g.yaml}]\n",
     "@/g.yaml:2:18: files include each other: @/g.yaml includes the next (@/g.yaml:2:18)"},
    {"include_key", "include: [{file: part.yaml, as: a}]\n",
     "@/g.yaml:2:29: unknown key 'as', expected one of file, namespace, if, args"},
    {"include_namespace", "include: [{file: part.yaml, namespace: a/b}]\n",
     "@/g.yaml:2:40: namespace 'a/b' is invalid: expected 1 to 64 letters, digits, '_', '-' or "
     "'.', not beginning with '.'"},
    {"include_condition", "include: [{file: part.yaml, if: yes}]\n",
     "@/g.yaml:2:33: if: expected true or false, found 'yes'"},
    {"include_arg_list", "include: [{file: part.yaml, args: {n: [1]}}]\n",
     "@/g.yaml:2:39: expected text, found a list"},
    {"after_in_namespace",
     "include: [{file: part.yaml, namespace: a}]\nnodes: {b: {exec: x, after: [p]}}\n",
     "@/g.yaml:3:30: after: there is no node 'p'"},
    {"group_no_nodes", "groups:\n  g: {host: here}\n", "@/g.yaml:3:3: group 'g' has no nodes"},
    {"group_key", "groups: {g: {exec: x, nodes: {a: {exec: x}}}}\n",
     "@/g.yaml:2:14: unknown key 'exec', expected one of restart, stop, sched, ready, hung_after, "
     "host, env, if, after, for, nodes"},
    {"group_list", "groups: [a]\nnodes: {a: {exec: x}}\n",
     "@/g.yaml:2:9: expected groups as a map, found a list"},
    {"group_node_name", "groups: {a: {nodes: {b: {exec: x}}}}\nnodes: {a: {exec: x}}\n",
     "@/g.yaml:2:10: group 'a' has the name of a node (@/g.yaml:3:9), expected another one"},
    {"group_after_member", "groups: {g: {nodes: {a: {exec: x, after: [g]}}}}\n",
     "@/g.yaml:2:43: nodes wait for each other: a -> a"},
    {"group_unknown",
     "groups: {eyes: {nodes: {a: {exec: x}}}}\nnodes: {b: {exec: x, after: [eye]}}\n",
     "@/g.yaml:3:30: after: there is no node 'eye', did you mean 'eyes'?"},
    {"two_nodes", "groups: {g: {nodes: {a: {exec: x}}}}\nnodes: {a: {exec: x}}\n",
     "@/g.yaml:3:9: there is a node 'a' already (@/g.yaml:2:22), expected another name, or a "
     "namespace of what is included"},
    {"for_name", "nodes:\n  eye: {exec: x, for: {i: [1, 2]}}\n",
     "@/g.yaml:3:3: 'eye' is repeated by `for`, expected ${arg:i} in its name, did you mean "
     "'eye${arg:i}'?"},
    {"for_group_name", "groups: {g: {for: {i: [1, 2]}, nodes: {a: {exec: x}}}}\n",
     "@/g.yaml:2:40: 'a' is repeated by `for`, expected ${arg:i} in its name, did you mean "
     "'a${arg:i}'?"},
    {"for_list", "nodes:\n  a${arg:i}: {exec: x, for: [1, 2]}\n",
     "@/g.yaml:3:29: for: expected {NAME: [VALUE, ...]}, found a list"},
    {"for_two", "nodes:\n  a${arg:i}: {exec: x, for: {i: [1], k: [2]}}\n",
     "@/g.yaml:3:29: for: expected {NAME: [VALUE, ...]}, found several names (put one `for` on a "
     "group around the node)"},
    {"for_argument", "args: {i: {default: 1}}\nnodes:\n  a${arg:i}: {exec: x, for: {i: [1]}}\n",
     "@/g.yaml:4:30: for: 'i' is an argument already, expected another name"},
    {"for_inner", "groups: {g: {for: {i: [1]}, nodes: {'a${arg:i}': {exec: x, for: {i: [1]}}}}}\n",
     "@/g.yaml:2:66: for: 'i' is the name of a `for` around this already, expected another name"},
    {"for_twice", "nodes:\n  a${arg:i}: {exec: x, for: {i: [1, 2, 2]}}\n",
     "@/g.yaml:3:40: for: the value '2' appears twice"},
    {"for_variable", "nodes:\n  a${arg:k}_${arg:i}: {exec: x, for: {i: [1]}}\n",
     "@/g.yaml:3:4: no argument 'k' is declared"},
    {"for_value", "nodes:\n  a${arg:i}: {exec: x, for: {i: [\"b c\"]}}\n",
     "@/g.yaml:3:3: node name 'ab c' is invalid: expected 1 to 64 letters, digits, '_', '-' or "
     "'.', not beginning with '.'"},
    {"host_variable",
     "hosts: {h: {address: here}}\nnodes: {a: {exec: x, args: [\"${host:hh}\"]}}\n",
     "@/g.yaml:3:30: there is no host 'hh', did you mean 'h'?"},
    {"host_condition", "hosts: {h: {address: here, if: 1}}\nnodes: {a: {exec: x}}\n",
     "@/g.yaml:2:32: if: expected true or false, found '1'"},
    {"variable_kind", "nodes: {a: {exec: x, args: [\"${hots:h}\"]}}\n",
     "@/g.yaml:2:30: ${hots:h}: expected ${arg:NAME}, ${env:NAME}, ${host:NAME} or ${run:NAME}"},
    {"implies_unknown",
     "args: {s: {type: bool, default: true, implies: {cluck: sim}}, clock: {default: wall}}\n"
     "nodes: {a: {exec: x}}\n",
     "@/g.yaml:2:49: implies: no argument 'cluck' is declared, did you mean 'clock'?"},
    {"implies_type",
     "args: {s: {type: bool, default: true, implies: {n: two}}, n: {type: int, default: 1}}\n"
     "nodes: {a: {exec: x}}\n",
     "@/g.yaml:2:52: n: expected int, found 'two'"},
    {"implies_of_text",
     "args: {s: {default: x, implies: {n: 2}}, n: {default: 1}}\nnodes: {a: {exec: x}}\n",
     "@/g.yaml:2:8: s: implies needs type: bool"},
    {"result_condition", "nodes: {a: {exec: x}}\nresult: {until: a/b, if: maybe}\n",
     "@/g.yaml:3:26: if: expected true or false, found 'maybe'"},
    {"unknown_key_without_a_like", "nodes: {a: {exec: x, stop: {zzz: 1}}}\n",
     "@/g.yaml:2:29: unknown key 'zzz', expected one of order, signal, timeout"},
};

INSTANTIATE_TEST_SUITE_P(Launch, FindsLanguageMistake, ::testing::ValuesIn(kCases),
                         [](const auto& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace mimesis::launch
