// Engine systemd on another host: the launcher in a network namespace of its own reaches, through
// ssh, this one, in which the systemd of with_systemd starts units.
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/test/hosts_fixture.h"

namespace mimesis::launch {
namespace {

constexpr int kHere = 2;

class LaunchSystemdHosts : public LaunchHosts {
 protected:
  std::string of(const std::string& node, const std::string& property) {
    return said("/usr/bin/systemctl", {"show", "-P", property, unit_name(graph_, node)});
  }
  static std::string units() {
    return said("/usr/bin/systemctl",
                {"list-units", "--all", "--plain", "--no-legend", "--type=service", "mimesis*"});
  }
  static std::string said(const std::string& program, const std::vector<std::string>& arguments) {
    Process p(program, arguments);
    p.wait();
    std::string text = p.output();
    while (text.ends_with('\n')) text.pop_back();
    return text;
  }
  /// On the host of systemd.
  static std::string there(const std::string& name, const std::string& more = "") {
    return counter(name, ", host: h2" + more);
  }
};

TEST_F(LaunchSystemdHosts, NodesAreUnitsThereAndFollowTheirLauncher) {
  begin(2, true, kHere);
  if (HasFatalFailure()) return;
  const std::string b =
      there("b", ", restart: {delay: 10ms}, in: {a: a/out}, sched: {policy: fifo, priority: 7}");
  for (const std::string how : {"stop", "kill of the launcher", "kill of sshd", "cut"}) {
    start(counter("a", ", in: {a: b/out}") + b, ", engine: systemd, lost_after: 4s", "", 2);
    ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
    EXPECT_EQ(of("b", "Slice"), slice_name(graph_));
    EXPECT_EQ(of("b", "CPUSchedulingPriority"), "7");
    const auto echo = at(1).mimesis("topic echo --once --timeout 10 --graph " + graph_ + " b/out");
    EXPECT_EQ(echo->wait(15s), 0) << echo->errors();
    const auto journal = [&] {
      return said("/usr/bin/journalctl", {"-q", "-o", "cat", "-u", unit_name(graph_, "b")});
    };
    EXPECT_TRUE(until([&] { return journal().find("ready") != std::string::npos; }));
    const std::string pid = of("b", "MainPID");
    kill(std::stoi(pid), SIGKILL);
    ASSERT_TRUE(until([&] {
      return of("b", "MainPID") != pid && of("b", "SubState") == "running";
    })) << launch_->errors();
    double gone_s = 0.0;
    const auto no_unit = [] { return units().empty(); };
    if (how == "stop") {
      launch_->signal(SIGINT);
      EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
      gone_s = seconds_until(no_unit);
    } else if (how == "kill of the launcher") {
      for (const pid_t one : processes_with(std::string("launch\0", 7) + folder_.path()))
        kill(one, SIGKILL);
      gone_s = seconds_until(no_unit);
    } else {
      const std::string before = of("b", "MainPID");
      how == "cut" ? (void)at(1).cut(at(2)) : at(2).end_sessions();
      gone_s = seconds_until([&] { return of("b", "MainPID") != before; });
      ASSERT_TRUE(until_says("host 'h2' is lost")) << launch_->errors();
      if (how == "cut") {
        ASSERT_TRUE(until_says("its nodes end by themselves")) << launch_->errors();
        ASSERT_TRUE(at(1).up(at(2)) && at(2).up(at(1)));
      }
      ASSERT_TRUE(until_says("b was lost with host 'h2'; starting it again", 30s))
          << launch_->errors();
      ASSERT_TRUE(until([&] { return of("b", "SubState") == "running"; }, 30s))
          << launch_->errors();
      launch_->signal(SIGINT);
      EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
      EXPECT_TRUE(until(no_unit)) << units();
    }
    std::printf("units end %.2f s after: %s\n", gone_s, how.c_str());
    EXPECT_GE(gone_s, 0.0) << units();
    EXPECT_GE(all_gone(), 0.0);
  }
}

}  // namespace
}  // namespace mimesis::launch
