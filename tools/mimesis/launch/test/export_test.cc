#include "tools/mimesis/launch/export.h"

#include <gtest/gtest.h>

#include "common/testing/process.h"
#include "common/testing/refusal.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {

const char* const kArm = R"(version: 1
args: {say: {default: "a $b 5% \"c\""}}
nodes:
  planner: {exec: sh, ready: started, after: [bridge], args: [-c, "echo ${arg:say} ; sleep 1"]}
  drives: {exec: /bin/true}
  bridge:
    exec: /usr/bin/mimesis_bridge
    after: [drives]
    required: true
    hung_after: 1500ms
    stop: {order: last, signal: TERM, timeout: 4s}
    sched: {policy: fifo, priority: 30, cpus: [0, 1], mlock: true}
    restart: {delay: 250ms, max: 3, window: 20s}
  world: {exec: /bin/true}
result: {until: world/outcome}
)";

BootUnits units_of(const std::string& text, const std::string& host = "",
                   const std::string& graph_name = "arm") {
  GraphFile graph = read_text(text);
  graph.file = "/etc/mimesis/arm.yaml";
  for (NodeSpec& node : graph.nodes) {
    if (!node.params.empty()) node.params = graph.file + node.params.substr(node.params.rfind('#'));
  }
  sort_by_start(graph);
  return boot_units(graph, {.graph = graph_name, .log = boot_log(graph_name), .sets = {}}, host);
}

/// The value of a key, of several with this key joined by |.
std::string value(const std::string& unit, const std::string& key) {
  std::istringstream lines(unit);
  std::string values;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(key + "="))
      values += (values.empty() ? "" : "|") + line.substr(key.size() + 1);
  }
  return values;
}

TEST(Export, AUnitSaysWhatTheLauncherWouldDo) {
  const BootUnits units = units_of(kArm);
  EXPECT_EQ(units.files.size(), 6U);
  const std::string& bridge = units.files.at("mimesis-arm-bridge.service");
  EXPECT_EQ(value(bridge, "Type"), "notify");
  EXPECT_EQ(value(bridge, "PartOf"), "mimesis-arm.target");
  EXPECT_EQ(value(bridge, "Requires"), "mimesis-arm-drives.service");
  EXPECT_EQ(value(bridge, "After"), "network-online.target mimesis-arm-drives.service");
  EXPECT_EQ(value(bridge, "OnFailure"), "mimesis-arm.end.target");
  EXPECT_EQ(value(bridge, "OnSuccess"), "mimesis-arm.end.target");
  EXPECT_EQ(value(bridge, "Restart"), "on-failure");
  EXPECT_EQ(value(bridge, "RestartSec"), "250ms");
  EXPECT_EQ(value(bridge, "StartLimitBurst"), "4");  // the first start, and 3
  EXPECT_EQ(value(bridge, "StartLimitIntervalSec"), "20000ms");
  EXPECT_EQ(value(bridge, "WatchdogSec"), "1500ms");
  EXPECT_EQ(value(bridge, "KillSignal"), "SIGTERM");
  EXPECT_EQ(value(bridge, "KillMode"), "mixed");
  EXPECT_EQ(value(bridge, "TimeoutStopSec"), "4000ms");
  EXPECT_EQ(value(bridge, "CPUSchedulingPolicy"), "fifo");
  EXPECT_EQ(value(bridge, "CPUSchedulingPriority"), "30");
  EXPECT_EQ(value(bridge, "LimitRTPRIO"), "30");
  EXPECT_EQ(value(bridge, "LimitMEMLOCK"), "infinity");
  EXPECT_EQ(value(bridge, "CPUAffinity"), "0 1");
  EXPECT_EQ(value(bridge, "User"), "mimesis");
  EXPECT_EQ(value(bridge, "Environment"),
            "XDG_RUNTIME_DIR=/run|XDG_CONFIG_HOME=/etc|XDG_STATE_HOME=/var/lib|"
            "\"MIMESIS_GRAPH=arm\"|\"MIMESIS_RUN_LOG=/var/lib/mimesis/log/arm-%b\"");
  EXPECT_TRUE(value(bridge, "ExecStart").starts_with("\"/usr/bin/mimesis_bridge\" \"--name\" "));
  EXPECT_NE(bridge.find("\"--mlock\""), std::string::npos);
  EXPECT_NE(bridge.find("\"/etc/mimesis/arm.yaml#nodes.bridge.params\""), std::string::npos);

  const std::string& planner = units.files.at("mimesis-arm-planner.service");
  EXPECT_EQ(value(planner, "Type"), "exec");
  EXPECT_EQ(value(planner, "WatchdogSec"), "");
  EXPECT_EQ(value(planner, "Restart"), "");
  EXPECT_EQ(value(planner, "Requires"), "");  // the bridge is started again, and this one is not
  EXPECT_EQ(value(planner, "Wants"), "network-online.target mimesis-arm-bridge.service");
  EXPECT_EQ(value(planner, "OnFailure"), "");
  EXPECT_TRUE(value(planner, "ExecStart").ends_with(R"( "-c" "echo a $$b 5%% \"c\" ; sleep 1")"))
      << planner;
  // The last to stop is ordered before the others.
  EXPECT_EQ(value(units.files.at("mimesis-arm-world.service"), "After"),
            "network-online.target mimesis-arm-bridge.service mimesis-arm-drives.service");

  const std::string& target = units.files.at("mimesis-arm.target");
  EXPECT_EQ(value(target, "Requires"), "");  // its restart would restart all
  EXPECT_NE(value(target, "Wants").find("mimesis-arm-bridge.service"), std::string::npos);
  EXPECT_NE(value(target, "Wants").find("mimesis-arm-planner.service"), std::string::npos);
  EXPECT_EQ(value(target, "WantedBy"), "multi-user.target");
  EXPECT_EQ(units.notes,
            (std::vector<std::string>{
                "result: is left out: the nodes run until they are stopped",
                "restart.backoff is left out: systemd waits equally long before each restart of "
                "bridge"}));
}

TEST(Export, SystemdAcceptsTheUnits) {
  if (access("/usr/bin/systemd-analyze", X_OK) != 0) GTEST_SKIP() << "no systemd-analyze here";
  std::string text = kArm;  // programs that are there
  text.replace(text.find("/usr/bin/mimesis_bridge"), 23, "/bin/true");
  for (const std::string graph : {"arm", "a-1_b.c"}) {
    const TemporaryFolder folder;
    BootUnits units = units_of(text, "", graph);
    write_units(folder.path(), graph, units);
    std::vector<std::string> words{"SYSTEMD_UNIT_PATH=" + folder.path() + ":", "systemd-analyze",
                                   "verify", "--man=no"};
    for (const auto& [file, unit] : units.files) words.push_back(folder.path() + "/" + file);
    testing::Process verify("/usr/bin/env", words);
    EXPECT_EQ(verify.wait(std::chrono::seconds(60)), 0);
    EXPECT_EQ(verify.errors(), "");
    // It does find mistakes.
    std::ofstream(folder.path() + "/" + units.files.begin()->first, std::ios::app) << "Tyqe=x\n";
    testing::Process again("/usr/bin/env", words);
    again.wait(std::chrono::seconds(60));
    EXPECT_NE(again.errors().find("Tyqe"), std::string::npos);
  }
}

TEST(Export, ASecondOneIsTheSameAndTakesStaleUnitsAway) {
  const TemporaryFolder folder;
  const BootUnits units = units_of(kArm);
  write_units(folder.path(), "arm", units);
  for (const auto& [file, text] : units.files) EXPECT_EQ(folder.read(file), text);
  EXPECT_EQ(units_of(kArm).files, units.files);
  folder.write("mimesis-arm-mine.service", "[Unit]\n");  // not written by an export
  const std::string other = "mimesis-arm\\x2d2-a.service";
  folder.write(other, units.files.begin()->second);  // of another graph
  const BootUnits fewer = units_of("version: 1\nnodes: {drives: {exec: /bin/true}}\n");
  EXPECT_EQ(write_units(folder.path(), "arm", fewer),
            (std::vector<std::string>{"mimesis-arm-bridge.service", "mimesis-arm-planner.service",
                                      "mimesis-arm-world.service", "mimesis-arm.end.target"}));
  EXPECT_EQ(folder.read("mimesis-arm-mine.service"), "[Unit]\n");
  EXPECT_EQ(folder.read(other), units.files.begin()->second);
  EXPECT_EQ(folder.read("mimesis-arm.target"), fewer.files.at("mimesis-arm.target"));
}

std::string refusal(const std::string& text, const std::string& host = "") {
  return testing::refusal([&] { units_of(text, host); });
}

TEST(Export, RefusesWhatNeedsTheLauncher) {
  EXPECT_EQ(refusal("version: 1\nclock: lockstep\nnodes: {a: {exec: /bin/true}}\n"),
            "clock: lockstep computes a run that the launcher ends; expected wall or sim");
  const std::string two =
      "version: 1\nhosts: {spine: {address: 10.99.0.9, prefix: /opt/m}}\nnodes:\n  a: {exec: "
      "mimesis_a}\n  b: {exec: mimesis_b, host: spine";
  EXPECT_NE(refusal(two + ", in: {x: a/x}}\n", "spine")
                .find("node 'b' hears 'a' on another host, which takes the launcher"),
            std::string::npos);
  EXPECT_EQ(refusal(two + ", in: {x: a/x}}\n"), "");  // a hears nobody
  EXPECT_NE(refusal(two + ", after: [a]}\n", "spine").find("comes after 'a'"), std::string::npos);
  EXPECT_EQ(refusal(two + "}\n", "spnie"),
            "--host: the file declares no host 'spnie', did you mean 'spine'?");
  const BootUnits units = units_of(two + "}\n", "spine");
  EXPECT_EQ(units.files.size(), 2U);
  const std::string& b = units.files.at("mimesis-arm-b.service");
  EXPECT_TRUE(value(b, "ExecStart").starts_with("\"/opt/m/bin/mimesis_b\" ")) << b;
  EXPECT_EQ(b.find("--bind"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::launch
