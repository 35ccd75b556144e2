// The launcher's messages about a file and output of a run.
#include "tools/mimesis/launch/test/launch_fixture.h"

namespace mimesis::launch {
namespace {

TEST_F(Launch, CheckReadsTheParametersOfTheNodes) {
  auto launch =
      start("nodes:\n  a:\n    exec: " + counter_ +
                "\n    params:\n      rate_hz: 0\n      wrok: 3\n  b: {exec: " + counter_ + "}\n",
            {"--check", "--set", "b.work=-1"});
  EXPECT_EQ(launch->wait(), 2);
  const json found = mistakes(*launch);
  ASSERT_EQ(found.size(), 3U) << found;
  const std::string file = folder_.path() + "/g.yaml";
  EXPECT_EQ(found[0], json({{"file", file},
                            {"line", 6},
                            {"column", 16},
                            {"message", "counter.rate_hz: 0 is outside [0.1, 10000]"},
                            {"expected", "[0.1, 10000]"},
                            {"suggestion", nullptr},
                            {"severity", "error"}}));
  EXPECT_EQ(found[1]["line"], 7);
  EXPECT_EQ(found[1]["suggestion"], "work");
  EXPECT_EQ(found[2]["file"], nullptr);
  EXPECT_EQ(found[2]["line"], nullptr);
  EXPECT_TRUE(
      found[2]["message"].get<std::string>().starts_with("--set: counter.work: -1 is outside"));
}

TEST_F(Launch, CheckFindsWhatCannotWork) {
  auto launch = start("nodes:\n  a: {exec: mimesis_nothing}\n  b: {exec: " + counter_ +
                          ", in: {a: aa/out}, host: moon}\n",
                      {"--check", "--set", "c.work=1"});
  EXPECT_EQ(launch->wait(), 2);
  const json found = mistakes(*launch);
  ASSERT_EQ(found.size(), 4U) << found;
  EXPECT_EQ(found[0]["message"], "--set: c.work=1: there is no node 'c'");
  EXPECT_EQ(found[1]["line"], 3);
  EXPECT_EQ(found[1]["message"],
            "node 'a': there is no program 'mimesis_nothing' beside mimesis or on PATH");
  EXPECT_EQ(found[2]["line"], 4);
  EXPECT_EQ(found[2]["message"],
            "no node publishes 'aa/out', expected one with mimesis.v1.Publication, did you mean "
            "'a/out'?");
  EXPECT_EQ(found[3]["message"], "there is no host 'moon'");
}

TEST_F(Launch, CheckKnowsWhatASimulatedClockNeeds) {
  const std::string text = "clock: lockstep\nnodes:\n  clock: {exec: " + counter_ + "}\n";
  auto launch = start(text, {"--check"});
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(mistakes(*launch).at(0)["line"], 4);
  EXPECT_EQ(mistakes(*launch).at(0)["message"],
            "the name 'clock' belongs to the node that the launcher starts");
  // A launcher without the clock beside it.
  const std::string alone = folder_.path() + "/mimesis-launch";
  std::filesystem::copy_file(MIMESIS_BIN_DIR "/mimesis-launch", alone);
  testing::Process check(alone, {folder_.path() + "/g.yaml", "--check"});
  EXPECT_EQ(check.wait(), 2);
  EXPECT_NE(check.errors().find("clock lockstep needs the program mimesis_clock"),
            std::string::npos)
      << check.errors();
}

/// `latest` of a counter obeys one node.
TEST_F(Launch, AnInputObeysWhoeverTheFileLetsPublishItsTopic) {
  const std::string planner = "nodes:\n  planner: {exec: " + counter_ + ", out: {out: arm/go}}\n",
                    arm = "  arm: {exec: " + counter_ + ", in: {latest: arm/go}}\n";
  auto launch = start(planner + arm +
                      "result: {until: arm/health, fields: {n: 'arm/health.inputs.0.received', "
                      "refused: 'arm/health.inputs.0.rejected'}}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_GT(last_line(*launch)["n"], 0) << last_line(*launch);
  EXPECT_EQ(last_line(*launch)["refused"], 0);

  const auto mistake = [&](const std::string& nodes) {
    auto check = start(nodes, {"--check"});
    EXPECT_EQ(check->wait(), 2) << check->errors();
    const json found = mistakes(*check);
    EXPECT_EQ(found.size(), 1U) << found;
    EXPECT_EQ(found.at(0)["column"], arm.find("arm/go") + 1);
    return found.at(0)["message"];
  };
  EXPECT_EQ(mistake(planner + arm + "  rival: {exec: " + counter_ + ", out: {out: arm/go}}\n"),
            "this input obeys one node, and the topic is published by planner,rival");
  EXPECT_EQ(
      mistake(planner + "  arm: {exec: " + counter_ + ", in: {latest: planner/out}}\n"),
      "no node publishes 'planner/out', expected one with mimesis.v1.Publication, did you mean "
      "'arm/go'?");
}

TEST_F(Launch, APlainLaunchChecksTheWiringBeforeItStarts) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ + ", in: {latset: a/out}}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(mistakes(*launch).at(0)["message"],
            "node 'a' has no input 'latset', expected a, b, latest, did you mean 'latest'?");
  EXPECT_EQ(
      mistakes(*launch).at(0)["column"],
      std::string("  a: {exec: ").size() + counter_.size() + std::string(", in: {").size() + 1);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/mimesis"));
}

/// A lock-step waited 5 s for every message of another type.
TEST_F(Launch, AnotherTypeOnAWireStopsTheRun) {
  const std::string text =
      "clock: lockstep\nnodes:\n  a: {exec: " + undescribed() + ", in: {latest: clock/time}}\n";
  auto launch = start(text);
  EXPECT_EQ(launch->wait(), 2) << launch->errors();
  EXPECT_EQ(summary(*launch)["reason"],
            "topic clock/time: node clock publishes mimesis.v1.ClockTime, node a expects "
            "mimesis.v1.Publication");
  auto check = start(text, {"--check"});
  EXPECT_EQ(check->wait(), 2);
  EXPECT_EQ(mistakes(*check).at(0)["message"],
            "'clock/time' carries mimesis.v1.ClockTime, expected mimesis.v1.Publication");
}

TEST_F(Launch, TopicsFromOutsideAndInputsLeftOutOnPurposeAreNoMistakes) {
  auto check = start("outside: [far/away]\nnodes:\n  a: {exec: " + counter_ +
                         ", in: {a: far/away, b: }}\nresult: {until: far/away}\n",
                     {"--check"});
  EXPECT_EQ(check->wait(), 0) << check->output();
  EXPECT_EQ(mistakes(*check), json::array());
}

/// Nodes read their parameters in the file and section where they are written, with its arguments.
TEST_F(Launch, RunsNodesThatAreIncludedAndRepeated) {
  folder_.write("part.yaml",
                "version: 1\nargs: {work: {type: int}}\ngroups:\n  all:\n    nodes:\n"
                "      n${arg:i}:\n        for: {i: [20, 50]}\n        exec: " +
                    counter_ +
                    "\n        params: {rate_hz: \"${arg:i}\", work: \"${arg:work}\"}\n"
                    "        in: {a: \"n${arg:i}/out\"}\n");
  const std::string text =
      "include:\n  - {file: part.yaml, namespace: p, args: {work: 3}}\n"
      "nodes:\n  last: {exec: " +
      counter_ + ", after: [p_all], in: {latest: p_n20/out}, params: {rate_hz: 10}}\n";
  auto launch = start(text, {"--set", "p_n50.rate_hz=40"});
  ASSERT_TRUE(until([&] { return pids().size() == 3; })) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130) << launch->errors();
  EXPECT_LT(launch->errors().find("p_n50 is ready"), launch->errors().find("last is ready"));
  EXPECT_NE(folder_.read("mimesis/log/run/p_n20.log").find("rate_hz=20 work=3"), std::string::npos)
      << folder_.read("mimesis/log/run/p_n20.log");
  EXPECT_NE(folder_.read("mimesis/log/run/p_n50.log").find("rate_hz=40 work=3"), std::string::npos)
      << folder_.read("mimesis/log/run/p_n50.log");

  // A mistake in an included file is found there, once.
  std::string part = folder_.read("part.yaml");
  folder_.write("part.yaml", part.replace(part.find("work: \"$"), 4, "wrok"));
  auto check = start(text, {"--check"});
  EXPECT_EQ(check->wait(), 2);
  const json found = mistakes(*check);
  ASSERT_EQ(found.size(), 1U) << found;
  EXPECT_EQ(found[0]["file"], folder_.path() + "/part.yaml");
  EXPECT_EQ(found[0]["line"], 9);
  EXPECT_EQ(found[0]["column"], 39);
  EXPECT_EQ(found[0]["suggestion"], "work");
}

TEST_F(Launch, HelpOfAFileSaysWhatItIs) {
  const std::string file = folder_.write(
      "help.yaml",
      "# An arm.\n#   mimesis launch help.yaml\n\nversion: 1\nargs:\n"
      "  log: {type: path, help: where}\n"
      "  sim: {type: bool, default: false, help: \"no arm\", implies: {bus: virtual}}\n"
      "  bus: {default: can0}\n"
      "hosts: {spine: {address: 10.0.0.1}}\n"
      "nodes:\n  arm: {exec: x, host: spine}\n  world: {exec: y, if: \"${arg:sim}\"}\n");
  testing::Process help("mimesis", {"launch", file, "--help"});
  EXPECT_EQ(help.wait(), 0) << help.errors();
  EXPECT_EQ(help.output(), file +
                               "\nAn arm.\n  mimesis launch help.yaml\n\n"
                               "Arguments (--arg NAME=VALUE; type, default):\n"
                               "  log  path      (needed)  where\n"
                               "  sim  bool      false     no arm\n"
                               "                           true implies bus=virtual\n"
                               "  bus  string    can0\n\n"
                               "Nodes:\n  arm                    x on spine\n"
                               "  world                  y (switched off)\n\n"
                               "Options of every launch: mimesis launch --help\n");
  testing::Process as_json("mimesis", {"launch", file, "--help", "--json", "--arg", "sim=true"});
  EXPECT_EQ(as_json.wait(), 0);
  const json told = json::parse(as_json.output());
  EXPECT_EQ(told["args"][1]["implies"], json({{"bus", "virtual"}}));
  EXPECT_EQ(told["args"][0]["default"], nullptr);
  EXPECT_EQ(told["nodes"][1]["enabled"], true);
  testing::Process general("mimesis", {"launch", "--help"});
  EXPECT_EQ(general.wait(), 0);
  EXPECT_NE(general.output().find("--dry-run"), std::string::npos);
}

TEST_F(Launch, DryRunStartsNothing) {
  auto launch =
      start("nodes:\n  b: {exec: " + counter_ + ", after: [a]}\n  a: {exec: " + counter_ + "}\n",
            {"--dry-run"});
  EXPECT_EQ(launch->wait(), 0);
  const json plan = json::parse(launch->output());
  EXPECT_EQ(plan["start"][0]["name"], "a");  // in order of start
  EXPECT_EQ(plan["stop"], json::parse(R"([["b"],["a"]])"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/mimesis"));
}

TEST_F(Launch, ARecorderLearnsWhatItRecords) {
  auto launch = start(
      "args: {speed: {type: int, default: 2}, name: {type: string, default: x}}\n"
      "nodes:\n"
      "  a: {exec: " +
          counter_ +
          ", after: [r]}\n"
          "  r: {exec: mimesis, args: [log, record, --all, -o, x.mcap]}\n",
      {"--dry-run", "--arg", "name=y z", "--set", "a.work=3"});
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  const json plan = json::parse(launch->output());
  const json told = json::parse(plan["start"][0]["env"]["MIMESIS_LAUNCH"].get<std::string>());
  EXPECT_EQ(told["file"], folder_.path() + "/g.yaml");
  EXPECT_EQ(told["args"], json({"speed=2", "name=y z"}));
  EXPECT_EQ(told["sets"], json({"a.work=3"}));
  EXPECT_EQ(told["clock"], "wall");
  EXPECT_EQ(told["graph"], plan["graph"]);
  EXPECT_FALSE(plan["start"][1]["env"].contains("MIMESIS_LAUNCH"));
}

TEST_F(Launch, ShowsALineANodeAndWarnings) {
  const std::string nodes =
      "nodes:\n  a: {exec: " + counter_ +
      "}\n  b: {exec: sh, after: [a], ready: started, required: true, args: [-c, "
      "'echo \"[09:00:00.000] [b] info: hidden\" >&2; echo \"[09:00:00.000] [b] warning: shown\" "
      ">&2; echo plain']}\n";
  auto quiet = start(nodes);
  EXPECT_EQ(quiet->wait(), 0) << quiet->errors();
  const std::string err = quiet->errors();
  EXPECT_EQ(err.find("info:"), std::string::npos) << err;
  EXPECT_NE(err.find("[b] 09:00:00.000 warning: shown\n"), std::string::npos) << err;
  EXPECT_NE(err.find("[b] plain\n"), std::string::npos) << err;
  EXPECT_EQ(err.find("a is ready"), err.rfind("a is ready")) << err;
  EXPECT_NE(folder_.read("mimesis/log/run/b.log").find("hidden"), std::string::npos);

  auto verbose = start(nodes, {"-v"});
  EXPECT_EQ(verbose->wait(), 0);
  EXPECT_NE(verbose->errors().find("[b] 09:00:00.000 info: hidden\n"), std::string::npos);
}

TEST_F(Launch, LogsOfOlderRunsAreBounded) {
  const auto old_run = [&](const std::string& name) {
    std::filesystem::create_directories(folder_.path() + "/mimesis/log/" + name);
    return folder_.write("mimesis/log/" + name + "/a.log", std::string(1000, 'x'));
  };
  const auto there = [](const std::string& file) { return std::filesystem::exists(file); };
  const std::string oldest = old_run("20200101-000000-x-1"),
                    second = old_run("20200102-000000-x-2"), named = old_run("20200101-kept");
  auto launch = start("nodes: {a: {exec: sh, ready: started, args: [-c, 'true']}}\n",
                      {"--log-limit", "2500B"});
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_FALSE(there(oldest));
  EXPECT_TRUE(there(second) && there(named));
  EXPECT_NE(launch->errors().find("removed the log of 20200101-000000-x-1 (1.0 kB)"),
            std::string::npos)
      << launch->errors();
}

TEST_F(Launch, MistakesEndWithTwo) {
  EXPECT_EQ(start("nodes: {a: {exec: sh, foo: 1}}\n")->wait(), 2);
  EXPECT_EQ(testing::Process("mimesis", {"launch", "/nowhere.yaml"}).wait(), 2);
  EXPECT_EQ(testing::Process("mimesis", {"launch"}).wait(), 2);
  testing::Process typo("mimesis", {"lanch", "x.yaml"});
  EXPECT_EQ(typo.wait(), 2);
  EXPECT_NE(typo.errors().find("did you mean 'launch'?"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::launch
