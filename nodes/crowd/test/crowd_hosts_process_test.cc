// Real coordinators on hosts of their own: network namespaces joined by wires, which know each
// other by tcp alone. Wires are cut one way and both ways, a coordinator is killed and restarted.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "common/runtime/keys.h"
#include "common/runtime/registry.h"
#include "common/testing/net_host.h"
#include "nodes/crowd/test/scenario_file.h"
#include "proto/crowd.pb.h"

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;
using Host = mimesis::testing::NetHost;
using mimesis::testing::Process;
using mimesis::testing::TestGraph;
using mimesis::testing::TestNode;
using runtime::Time;

constexpr Time kPeriod = 20ms;

/// What one coordinator said of an agent that it moves.
struct Said {
  Time stamp;
  int by;
  long report;  // number of its report
  double x_m, y_m;
};

/// A coordinator on a host, and what it publishes.
class Coordinator {
 public:
  Coordinator(Host& host, int number, const std::string& keys, const std::string& settings)
      : host_(&host),
        number_(number),
        peer_(graph_, {{"status", name() + "/status"}, {"states", "crowd/states"}}, {}, "watcher"),
        status_in_(peer_.bus(), "status"),
        states_in_(peer_.bus(), "states") {
    line_ = "export XDG_CONFIG_HOME=" + keys + "; exec " MIMESIS_BIN_DIR "/mimesis_crowd --graph " +
            graph_.name() + " --name " + name() + " --bind tcp://" + host.address() +
            ":7310 --set regions.own=" + std::to_string(number) +
            " --in peers=crowd/states --in handovers=crowd/handover --out states=crowd/states"
            " --out handover=crowd/handover " +
            settings;
    peer_.open();
    start();
  }
  void start() {
    process_ = host_->start(line_);
    status = {};
  }
  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
    states = {};
  }
  std::optional<int> terminate() { return process_->terminate(); }
  std::string errors() const { return process_->errors(); }
  int number() const { return number_; }
  Host& host() { return *host_; }

  /// Shows the other coordinators to this one's host, as a launcher does.
  void meet(const Coordinator& other) {
    for (const v1::NodeInfo& node : runtime::GraphView(other.graph_.name()).nodes()) {
      if (node.name() == other.name()) far_.show(runtime::seen_from_afar(node, ""));
    }
  }
  void drain(std::map<std::uint64_t, std::vector<Said>>& said) {
    peer_.until([] { return false; }, 5ms);
    while (const auto s = status_in_.pop()) status = *s;
    while (const auto s = states_in_.pop()) {
      states = *s;
      ++reports_;
      if (s->time_s() == 0.0) continue;  // before the crowd has begun nobody is moved
      for (int i = 0; i < s->id_size(); ++i) {
        said[s->id(i)].push_back({Time(s->header().stamp_ns()), number_, reports_,
                                  s->position_in_world_m(2 * i),
                                  s->position_in_world_m(2 * i + 1)});
      }
    }
  }

  v1::CrowdStatus status;
  v1::CrowdStates states;

 private:
  std::string name() const { return "crowd" + std::to_string(number_); }

  Host* host_;
  int number_;
  long reports_ = 0;
  TestGraph graph_;
  runtime::FarNodes far_{graph_.directory()};
  std::string line_;
  std::unique_ptr<Process> process_;
  TestNode peer_;
  runtime::Reliable<v1::CrowdStatus> status_in_;
  runtime::Reliable<v1::CrowdStates> states_in_;
};

/// Coordinators on as many hosts, each wired to each; all that they say is kept.
class CrowdHosts : public ::testing::Test {
 protected:
  /// Skips where there are no network namespaces.
  void begin(int coordinators, const std::string& settings) {
    if (const std::string why = Host::missing(); !why.empty()) GTEST_SKIP() << why;
    for (int c = 1; c <= coordinators; ++c) {
      hosts_.push_back(std::make_unique<Host>(c));
      if (!hosts_.back()->made()) GTEST_SKIP() << "not here: no address in a network namespace";
      for (int other = 1; other < c; ++other) {
        const std::string why = hosts_.back()->wire(host(other));
        if (!why.empty()) GTEST_SKIP() << why;
      }
    }
    setenv("XDG_CONFIG_HOME", keys_.c_str(), 1);
    runtime::make_key(false);  // one for all, and none for this process
    unsetenv("XDG_CONFIG_HOME");
    for (int c = 1; c <= coordinators; ++c) {
      all_.push_back(std::make_unique<Coordinator>(host(c), c, keys_, settings));
    }
  }
  Host& host(int number) { return *hosts_[static_cast<std::size_t>(number - 1)]; }
  Coordinator& at(int number) { return *all_[static_cast<std::size_t>(number - 1)]; }

  bool until(const std::function<bool()>& done, Time most = 60s) {
    const Time end = TestNode::now() + most;
    do {
      for (auto& c : all_) {
        c->drain(said_);
        for (auto& other : all_) {
          if (other != c) c->meet(*other);
        }
      }
      if (done()) return true;
    } while (TestNode::now() < end);
    return false;
  }
  void wait(Time time) {
    until([] { return false; }, time);
  }
  /// All go on, and each agent is with one of them.
  bool complete(int agents) {
    int sum = 0;
    for (const auto& c : all_) {
      if (!c->status.runs()) return false;
      sum += c->states.id_size();
    }
    return sum == agents;
  }
  std::string what() const {
    std::string text;
    for (const auto& c : all_) {
      text += std::to_string(c->number()) + ": " + std::to_string(c->states.id_size()) +
              " agents, " + c->status.reason() + "\n" + c->errors();
    }
    return text;
  }

  /// Agents that two coordinators had at once: from the first of some reports without a gap to the
  /// last one it is theirs alone.
  static int overlaps(const std::vector<Said>& all) {
    struct Tenure {
      Said first, last;
    };
    std::vector<Tenure> tenures;
    std::map<int, std::size_t> latest;  // of each
    for (const Said& now : all) {
      const auto known = latest.find(now.by);
      if (known != latest.end() && tenures[known->second].last.report + 1 == now.report) {
        tenures[known->second].last = now;
      } else {
        latest[now.by] = tenures.size();
        tenures.push_back({now, now});
      }
    }
    int count = 0;
    for (const Tenure& a : tenures) {
      for (const Tenure& b : tenures) {
        const bool both = a.first.stamp <= b.last.stamp && b.first.stamp <= a.last.stamp;
        count += a.first.by < b.first.by && both ? 1 : 0;
      }
    }
    return count;
  }

  /// Prints how long agents stood between two times, and who was moved by two.
  void judge(const char* event, Time from, Time to) {
    std::vector<double> stood;
    int twice = 0;
    double jump_m = 0.0;
    for (auto& [id, all] : said_) {
      std::ranges::stable_sort(all, {}, &Said::stamp);
      twice += overlaps(all);
      Time longest{}, moved{};
      const Said* last = nullptr;
      for (const Said& now : all) {
        if (now.stamp < from || now.stamp > to) continue;
        const double way_m =
            last == nullptr ? 0.0 : std::hypot(now.x_m - last->x_m, now.y_m - last->y_m);
        if (last == nullptr || way_m > 1e-4) {
          longest = std::max(longest, moved == Time{} ? Time{} : now.stamp - moved - kPeriod);
          moved = now.stamp;
        }
        jump_m = std::max(jump_m, way_m);
        last = &now;
      }
      stood.push_back(std::chrono::duration<double>(longest).count());
    }
    ASSERT_FALSE(stood.empty());
    std::ranges::sort(stood);
    std::printf(
        "%-34s stood at most %.2f s, half of them %.2f s or less; moved by two: %d; "
        "largest step %.3f m\n",
        event, stood.back(), stood[stood.size() / 2], twice, jump_m);
    EXPECT_EQ(twice, 0) << event;
    // Cut off, a coordinator goes on for 0.5 s, and as long as a busy machine lets it wait; then
    // others adopt its agents where they saw them last. Back at the start they were 3 to 18 m away.
    EXPECT_LT(jump_m, 2.5) << event;
  }

  ~CrowdHosts() override { std::filesystem::remove_all(keys_); }

  std::map<std::uint64_t, std::vector<Said>> said_;

 private:
  const std::string keys_ =
      (std::filesystem::temp_directory_path() / ("crowd-keys-" + std::to_string(getpid())))
          .string();
  std::vector<std::unique_ptr<Host>> hosts_;
  std::vector<std::unique_ptr<Coordinator>> all_;
};

TEST_F(CrowdHosts, OfTwoThatAreCutTheFirstGoesOnAndGivesBack) {
  const testing::ScenarioFile file(testing::kFormation);
  begin(2, "--set scenario=" + file.path() + " --set regions.x_m=[0]");
  if (IsSkipped() || HasFatalFailure()) return;
  const Time start = TestNode::now();
  const auto shared = [&](int of_one, int of_two) {
    return [&, of_one, of_two] {
      return at(1).status.runs() && at(2).status.runs() && at(1).states.id_size() == of_one &&
             at(2).states.id_size() == of_two;
    };
  };
  ASSERT_TRUE(until(shared(0, 16))) << "all walk over the cut: " << what();
  EXPECT_GE(at(1).status.given(), 4u);
  ASSERT_TRUE(host(1).cut(host(2)));
  ASSERT_TRUE(until(shared(16, 0))) << "only the half with number 1 goes on: " << what();
  ASSERT_TRUE(host(1).up(host(2)) && host(2).up(host(1)));
  ASSERT_TRUE(until(shared(0, 16))) << "it gives them back: " << what();
  judge("two hosts, a cut both ways", start, TestNode::now());
  EXPECT_EQ(said_.size(), 16u);
  for (int c : {1, 2}) EXPECT_EQ(at(c).terminate(), 0) << at(c).errors();
}

// Slow: on a busy machine 2 of 23 runs failed, once by an agent's jump, once unread.
TEST_F(CrowdHosts, DISABLED_SlowThreeLoseNobodyInCutsOneWayAndBothWaysAndARestart) {
  constexpr int kAgents = 96;
  const testing::ScenarioFile file(testing::kFormation);
  begin(3, "--set scenario=" + file.path() +
               " --set set=groups.0.count=" + std::to_string(kAgents) + " --set regions.x_m=[0,8]");
  if (IsSkipped() || HasFatalFailure()) return;
  const auto all_there = [&] { return complete(kAgents); };
  const auto view = [&] {
    std::uint64_t newest = 0;
    for (int c : {1, 2, 3}) newest = std::max(newest, at(c).states.ownership().view_ns());
    return newest;
  };
  /// Does harm, until somebody agrees on another view, and undoes it.
  const auto event = [&](const char* name, const std::function<void()>& harm,
                         const std::function<void()>& undo) {
    const Time from = TestNode::now();
    const std::uint64_t before = view();
    harm();
    ASSERT_TRUE(until([&] { return view() > before; })) << name << "\n" << what();
    wait(1s);
    undo();
    ASSERT_TRUE(until(all_there)) << name << "\n" << what();
    wait(500ms);
    ASSERT_TRUE(until(all_there)) << name << "\n" << what();
    judge(name, from, TestNode::now());
  };
  ASSERT_TRUE(until([&] { return all_there() && at(1).status.given() >= 4; })) << what();
  wait(2s);
  judge("hand-overs on a whole network", {}, TestNode::now());
  event(
      "1 is not heard by 2", [&] { ASSERT_TRUE(host(1).mute(host(2))); },
      [&] { ASSERT_TRUE(host(1).unmute(host(2))); });
  event(
      "3 is heard by nobody", [&] { ASSERT_TRUE(host(3).mute(host(1)) && host(3).mute(host(2))); },
      [&] { ASSERT_TRUE(host(3).unmute(host(1)) && host(3).unmute(host(2))); });
  event(
      "2 is cut off both ways", [&] { ASSERT_TRUE(host(2).cut(host(1)) && host(2).cut(host(3))); },
      [&] {
        for (const int other : {1, 3}) {
          ASSERT_TRUE(host(2).up(host(other)) && host(other).up(host(2)));
        }
      });
  event(
      "2 is killed and restarted", [&] { at(2).kill(); }, [&] { at(2).start(); });
  EXPECT_EQ(said_.size(), static_cast<std::size_t>(kAgents)) << "each was moved by somebody";
  EXPECT_GE(at(1).status.given() + at(3).status.given(), 20u);
  for (int c : {1, 2, 3}) EXPECT_EQ(at(c).terminate(), 0) << at(c).errors();
}

}  // namespace
}  // namespace mimesis::crowd
