// The real bridge, drives and hand as processes on the wall clock. MIMESIS_TEST_CAN chooses another
// bus, MIMESIS_TEST_CLOCK=lockstep a clock that a busy machine cannot outrun: test/on_vcan runs the
// same on the kernel's CAN in a guest where system calls are slow.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>

#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "hw/can/bus.h"
#include "hw/cia402/cia402.h"
#include "hw/modbus/testing/odd_hand.h"
#include "proto/bridge.pb.h"

namespace mimesis::hw::bridge {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;
using runtime::Time;

std::string can_address() {
  const char* chosen = std::getenv("MIMESIS_TEST_CAN");
  return chosen != nullptr ? chosen : "embedded:arm";
}

bool in_lockstep() {
  const char* chosen = std::getenv("MIMESIS_TEST_CLOCK");
  return chosen != nullptr && chosen == std::string("lockstep");
}

constexpr double kRate_hz = 200.0;
constexpr auto kPatience = 60s;  // for processes to start or end, where the machine is busy

/// Three processes and the test as their planner.
class Robot : public ::testing::Test {
 protected:
  Robot() {
    if (in_lockstep()) {
      // No faster than the wall clock: a hand has a thread of its own.
      clock.emplace(
          graph, "mimesis_clock",
          std::vector<std::string>{"--set", "participants=test,sim_drives", "--set", "factor=1"});
      EXPECT_TRUE(clock->wait_ready(graph, "clock", kPatience)) << clock->errors();
      peer.open_lockstep(kRate_hz);
    } else {
      peer.open();
    }
    start_drives();
  }

  void start_node(std::optional<Process>& process, const std::string& name,
                  std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--clock", in_lockstep() ? "lockstep" : "wall"});
    process.emplace(graph, "mimesis_" + name, arguments);
    ASSERT_TRUE(process->wait_ready(graph, name, kPatience)) << process->errors();
  }
  void start_drives() { start_node(drives, "sim_drives", {"--set", "bus=" + can_address()}); }
  void start_hand() { start_node(hand, "sim_hand", {}); }
  void start_bridge(const std::string& setting = "enable=auto") {
    // Patience beyond the defaults: a busy machine must not stop the arm in a test about something
    // else.
    start_node(bridge, "bridge",
               {"--set", "can=" + can_address(), "--set", "silence_s=0.5", "--set",
                "feedback_timeout_s=0.5", "--set", "enable=auto", "--set", setting, "--in",
                "command=test/command", "--in", "hand_command=test/hand_command"});
    ASSERT_TRUE(wait_state("idle")) << bridge->errors();
    ASSERT_TRUE(peer.wait_subscriber(command));
    ASSERT_TRUE(peer.until([&] { return arm.get() != nullptr; }));
    start.assign(arm.get()->position_rad().begin(), arm.get()->position_rad().end());
  }

  bool wait_state(const std::string& state) {
    return peer.until([&] { return status.get() != nullptr && status.get()->state() == state; });
  }
  /// Streams q(t) every cycle until `done`; joint 2 is offset by `motion(t)`.
  template <class Motion, class Done>
  bool stream(Motion motion, Done done, std::chrono::milliseconds timeout = 10s) {
    const Time begin = peer.graph_time();
    Time next = begin;
    return peer.until(
        [&] {
          const Time now = peer.graph_time();
          if (now >= next) {
            v1::JointCommand c;
            for (const double q : start) c.add_position_rad(q);
            c.set_position_rad(1, start[1] + motion(runtime::to_seconds(now - begin)));
            command.send(c, now);
            next = now + runtime::from_seconds(1.0 / kRate_hz);
          }
          return done();
        },
        timeout);
  }
  void follow() {
    ASSERT_TRUE(stream(at_rest, [&] {
      return status.get() != nullptr && status.get()->state() == "following";
    })) << bridge->errors();
  }
  static double at_rest(double) { return 0.0; }
  /// Swings by 0.2 rad with a period of 2 s.
  static double swing(double t) { return 0.1 * (1.0 - std::cos(M_PI * t)); }
  bool enabled() {
    const v1::JointState* t = truth.get();
    return t != nullptr && std::ranges::any_of(t->drives(), [](int s) {
             return s == v1::DRIVE_STATE_OPERATION_ENABLED;
           });
  }

  TestGraph graph;
  TestNode peer{graph,
                {{"truth", "sim_drives/joint_states"},
                 {"joint_states", "bridge/joint_states"},
                 {"status", "bridge/status"},
                 {"hand", "bridge/hand"}},
                {{"command", "test/command"}, {"hand_command", "test/hand_command"}},
                "test",
                in_lockstep() ? runtime::ClockKind::lockstep : runtime::ClockKind::wall};
  runtime::Latest<v1::JointState> truth{peer.bus(), "truth"}, arm{peer.bus(), "joint_states"};
  runtime::Latest<v1::BridgeStatus> status{peer.bus(), "status"};
  runtime::Latest<v1::HandState> hand_state{peer.bus(), "hand"};
  runtime::Out<v1::JointCommand> command{peer.bus(), "command"};
  runtime::Out<v1::HandCommand> hand_command{peer.bus(), "hand_command"};
  std::optional<Process> clock, drives, hand, bridge;
  std::vector<double> start;
};

TEST_F(Robot, FollowsAndStopsWhenTheStreamFallsSilent) {
  start_bridge();
  follow();
  double largest = 0.0;
  ASSERT_TRUE(stream(swing, [&] {
    largest = std::max(largest, truth.get()->position_rad(1) - start[1]);
    return largest > 0.19;
  })) << bridge->errors();
  EXPECT_TRUE(enabled());
  EXPECT_EQ(arm.get()->fault(), "");
  // Silence: the truth must show that the drives have left operation enabled.
  ASSERT_TRUE(peer.until([&] { return !enabled(); })) << bridge->errors();
  ASSERT_TRUE(wait_state("idle"));
  EXPECT_EQ(status.get()->reason(), "no command for 0.5 s");
  // A new stream from where the arm stands is obeyed.
  start.assign(arm.get()->position_rad().begin(), arm.get()->position_rad().end());
  follow();
  EXPECT_TRUE(peer.until([&] { return enabled(); }));
}

TEST_F(Robot, ObeysTheNodeOfItsTopicAlone) {
  start_bridge();
  TestNode intruder(graph, {}, {{"command", "test/command"}}, "intruder");
  runtime::Out<v1::JointCommand> other(intruder.bus(), "command");
  intruder.open();
  ASSERT_TRUE(intruder.wait_subscriber(other));
  int sent = 0;
  ASSERT_TRUE(peer.until([&] {
    v1::JointCommand c;
    for (const double q : start) c.add_position_rad(q);
    other.send(c, peer.graph_time());
    return ++sent > 200;
  }));
  EXPECT_EQ(status.get()->state(), "idle") << status.get()->reason();
  const std::string said = bridge->errors();
  const std::string line = "topic test/command: messages of node intruder, process ";
  const std::size_t at = said.find(line);
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_NE(said.find("only node test on this host is obeyed"), std::string::npos) << said;
  EXPECT_EQ(said.find(line, at + 1), std::string::npos) << "said twice: " << said;
  follow();  // the true one is obeyed beside it
}

TEST_F(Robot, MovesTheHand) {
  start_hand();
  start_bridge();
  ASSERT_TRUE(peer.until([&] { return hand_state.get() != nullptr && hand_state.get()->active(); }))
      << bridge->errors();
  ASSERT_TRUE(peer.wait_subscriber(hand_command));
  v1::HandCommand c;
  c.set_grip(v1::GRIP_PRECISION);
  c.set_closure(0.4);
  hand_command.send(c, peer.graph_time());
  EXPECT_TRUE(peer.until([&] {
    const v1::HandState* h = hand_state.get();
    return h->grip() == v1::GRIP_PRECISION && std::abs(h->closure() - 0.4) < 0.01 && !h->moving();
  })) << bridge->errors();
}

/// It is reported within 0.5 s, and the arm stops if it is to.
TEST_F(Robot, AHandThatFailsInTheMiddleOfAGrip) {
  if (in_lockstep()) GTEST_SKIP() << "no such case: time waits for a hand";
  for (const std::string way : {"dies", "stalls", "answers rubbish"}) {
    SCOPED_TRACE(way);
    start_hand();
    start_bridge("on_hand_fault=stop");
    ASSERT_TRUE(peer.until([&] {
      return hand_state.get() != nullptr && hand_state.get()->active();
    })) << bridge->errors();
    ASSERT_TRUE(peer.wait_subscriber(hand_command));
    follow();
    v1::HandCommand c;
    c.set_closure(1.0);
    hand_command.send(c, peer.graph_time());
    ASSERT_TRUE(stream(swing, [&] { return hand_state.get()->moving(); }));
    hand->signal(way == "stalls" ? SIGSTOP : SIGKILL);
    std::optional<modbus::OddHand> odd;
    if (way == "answers rubbish" && hand->wait())  // its address is free
      odd.emplace(modbus::parse_address("unix:hand", graph.directory()), std::string(300, '\xFF'));
    const Time failed = peer.graph_time();
    ASSERT_TRUE(stream(swing, [&] { return !hand_state.get()->fault().empty(); }));
    const double took_s = runtime::to_seconds(hand_state.stamp() - failed);
    EXPECT_LE(took_s, 0.5);
    RecordProperty("reported_s_" + way, std::to_string(took_s));
    ASSERT_TRUE(stream(swing, [&] { return status.get()->state() == "idle"; }));
    EXPECT_EQ(status.get()->reason().substr(0, 22), "emergency stop: hand: ");
    EXPECT_EQ(bridge->terminate(), 0);
    hand.reset();
    ASSERT_TRUE(peer.until([&] { return !enabled(); }));
  }
}

TEST_F(Robot, SigtermSendsQuickStopLastAndExitsWell) {
  start_bridge();
  follow();
  const auto tap = can::open(can_address(), graph.directory());
  std::array<std::uint8_t, 128> controlword{};  // controlword of the last set-point to each node
  int late = 0;                                 // set-points after the quick stop
  const auto listen = [&] {
    std::array<can::Frame, 256> frames;
    const std::size_t count = tap->receive(frames);
    for (const can::Frame& frame : std::span(frames).first(count)) {
      const cia402::Identity id = cia402::identify(frame);
      if (id.kind != cia402::Identity::Kind::rpdo) continue;
      auto& last = controlword[static_cast<std::size_t>(id.node)];
      if (last == cia402::controlword::kQuickStop && frame.data[0] != last) ++late;
      last = frame.data[0];
    }
    return count > 0;
  };
  bridge->signal(SIGTERM);
  ASSERT_TRUE(peer.until([&] {
    listen();
    return bridge->wait(0ms).has_value();
  }));
  while (listen()) {
  }
  EXPECT_EQ(bridge->wait(), 0) << bridge->errors();
  EXPECT_EQ(late, 0);
  for (std::size_t node = 1; node <= 7; ++node)
    EXPECT_EQ(controlword[node], cia402::controlword::kQuickStop);
  EXPECT_TRUE(peer.until([&] {
    return std::ranges::all_of(truth.get()->drives(),
                               [](int s) { return s == v1::DRIVE_STATE_SWITCH_ON_DISABLED; });
  }));
}

TEST_F(Robot, DrivesStopThemselvesWhenTheBridgeIsKilled) {
  start_bridge();
  follow();
  ASSERT_TRUE(stream(swing, [&] { return truth.get()->position_rad(1) - start[1] > 0.05; }));
  bridge->signal(SIGKILL);
  const Time killed = peer.graph_time();
  ASSERT_TRUE(peer.until([&] { return !enabled(); }));
  const double took_s = runtime::to_seconds(truth.stamp() - killed);
  EXPECT_LE(took_s, 0.3);
  RecordProperty("seconds_until_stopped", std::to_string(took_s));
  EXPECT_EQ(bridge->wait(), 128 + SIGKILL);
}

TEST_F(Robot, DrivesStopThemselvesWhenTheBridgeHangs) {
  if (in_lockstep()) GTEST_SKIP() << "no such case: time waits for a node that hangs";
  start_bridge();
  follow();
  ASSERT_TRUE(stream(swing, [&] { return truth.get()->position_rad(1) - start[1] > 0.05; }));
  bridge->signal(SIGSTOP);
  const Time stopped = peer.graph_time();
  ASSERT_TRUE(peer.until([&] { return !enabled(); }));
  EXPECT_LE(runtime::to_seconds(truth.stamp() - stopped), 0.3);
  const auto still = [&] {
    return std::ranges::all_of(truth.get()->velocity_rad_s(), [](double v) { return v == 0.0; });
  };
  ASSERT_TRUE(peer.until(still));
  EXPECT_LE(runtime::to_seconds(truth.stamp() - stopped), 0.5);
  const double rest = truth.get()->position_rad(1);
  bridge->signal(SIGCONT);
  const Time again = peer.graph_time();
  peer.until([&] {
    EXPECT_TRUE(!enabled() && still());
    return ::testing::Test::HasFailure() || peer.graph_time() > again + 1s;
  });
  EXPECT_EQ(truth.get()->position_rad(1), rest);
  EXPECT_EQ(status.get()->state(), "fault");
  EXPECT_TRUE(status.get()->reason().starts_with("no cycle for ")) << status.get()->reason();
}

TEST_F(Robot, ReportsKilledDrivesAndTakesThemBack) {
  start_bridge();
  follow();
  drives->signal(SIGKILL);
  ASSERT_TRUE(stream(at_rest, [&] { return status.get()->state() == "fault"; }))
      << bridge->errors();
  EXPECT_NE(status.get()->reason().find("A1 (node 1): no "), std::string::npos)
      << status.get()->reason();
  drives.reset();
  start_drives();
  ASSERT_TRUE(peer.until([&] {
    return status.get()->state() == "idle" && status.get()->reason() == "ready for a new stream";
  })) << bridge->errors();
  ASSERT_TRUE(peer.until([&] { return truth.get()->drives_size() == 7 && !enabled(); }));
  start.assign(arm.get()->position_rad().begin(), arm.get()->position_rad().end());
  follow();
}

/// Drives of another maker, as processes: followed, and stopped for a fault that stays.
TEST_F(Robot, DrivesWithHabits) {
  drives.reset();
  start_node(drives, "sim_drives",
             {"--set", "bus=" + can_address(), "--set",
              "habits=[cob_bit30, mode_shown_late, modes_unknown, other_bits]"});
  start_bridge();
  follow();
  double largest = 0.0;
  ASSERT_TRUE(stream(swing, [&] {
    largest = std::max(largest, truth.get()->position_rad(1) - start[1]);
    return largest > 0.1;
  })) << bridge->errors();
  EXPECT_EQ(arm.get()->fault(), "");
}

TEST_F(Robot, AResetThatDoesNotHelpIsNotCalledOne) {
  drives.reset();
  start_node(drives, "sim_drives",
             {"--set", "bus=" + can_address(), "--set", "habits=[boots_in_fault, keeps_fault]"});
  start_node(bridge, "bridge", {"--set", "can=" + can_address(), "--set", "hand="});
  ASSERT_TRUE(wait_state("fault")) << bridge->errors();
  const auto reset = peer.bus().call("bridge/reset", "", 5s);
  EXPECT_TRUE(reset.has_value()) << reset.error().reason;
  ASSERT_TRUE(peer.until([&] {
    return status.get()->reason().find("it stays so after a reset") != std::string::npos;
  })) << status.get()->reason();
  EXPECT_EQ(status.get()->state(), "fault");
}

/// A two-finger gripper where the bridge expects the three-finger one, then with its own profile.
TEST(BridgeProcess, AsksTheHandWhoItIs) {
  std::array<int, 2> life{}, ports{};
  ASSERT_EQ(pipe(life.data()) + pipe(ports.data()), 0);
  const pid_t server = fork();
  if (server == 0) {
    dup2(life[0], 0);
    dup2(ports[1], 1);
    for (const int fd : {life[0], life[1], ports[0], ports[1]}) close(fd);
    execl("/usr/bin/python3", "python3", MIMESIS_SOURCE_DIR "/hw/modbus/test/hands.py",
          "2f:plain:20", nullptr);
    _exit(127);
  }
  close(life[0]);
  close(ports[1]);
  std::string port;
  for (char c; read(ports[0], &c, 1) == 1 && c != '\n';) port += c;
  ASSERT_FALSE(port.empty());
  for (const std::string profile : {"robotiq_3f", "robotiq_2f"}) {
    TestGraph graph;
    TestNode peer(graph, {{"hand", "bridge/hand"}}, {{"hand_command", "test/hand_command"}});
    runtime::Latest<v1::HandState> hand(peer.bus(), "hand");
    runtime::Out<v1::HandCommand> command(peer.bus(), "hand_command");
    peer.open();
    Process bridge(
        graph, "mimesis_bridge",
        {"--set", "hand=tcp:127.0.0.1:" + port, "--set", "hand_profile=hands/" + profile + ".yaml",
         "--in", "hand_command=test/hand_command"});
    v1::HandCommand close_it;
    close_it.set_closure(1.0);
    close_it.set_force(0.5);
    const bool ours = profile == "robotiq_2f";
    bool misread = false;
    EXPECT_TRUE(peer.until([&] {
      command.send(close_it, peer.graph_time());
      if (hand.get() == nullptr) return false;
      misread = misread || (!ours && (hand.get()->active() || hand.get()->object_detected()));
      return ours ? hand.get()->object_detected()
                  : hand.get()->fault().find(": is no three-finger gripper") != std::string::npos;
    })) << bridge.errors();
    EXPECT_FALSE(misread);
    EXPECT_NEAR(hand.get()->closure(), ours ? 0.47 : 0.0, 0.01);
    EXPECT_EQ(bridge.terminate(), 0);
    EXPECT_NE(bridge.errors().find(ours ? "info: hand: well" : "warning: hand: "),
              std::string::npos);
  }
  close(life[1]);
  waitpid(server, nullptr, 0);
}

TEST(BridgeProcess, SaysWhenNobodyIsOnTheBus) {
  TestGraph graph;
  TestNode peer(graph, {{"status", "bridge/status"}}, {});
  runtime::Latest<v1::BridgeStatus> status(peer.bus(), "status");
  peer.open();
  Process bridge(graph, "mimesis_bridge", {"--set", "boot_timeout_s=0.3", "--set", "hand="});
  ASSERT_TRUE(peer.until([&] {
    return status.get() != nullptr && status.get()->state() == "fault";
  })) << bridge.errors();
  EXPECT_EQ(status.get()->reason(),
            "no answer within 0.3 s from A1 (node 1), A2 (node 2), A3 (node 3), A4 (node 4), A5 "
            "(node 5), "
            "A6 (node 6), A7 (node 7)");
  EXPECT_EQ(bridge.terminate(), 0);
}

TEST(BridgeProcess, RefusesBadConfigurationInOneLine) {
  using testing::refuses;
  refuses("mimesis_bridge", {"can=can0"}, "expected embedded:NAME, socketcan:INTERFACE");
  refuses("mimesis_bridge", {"robt=x"}, "robt");
  refuses("mimesis_bridge", {"robot=nobody.yaml"}, "nobody.yaml");
  refuses("mimesis_bridge", {"rate_hz=300"},
          "--set: bridge.rate_hz: 300 contradicts the robot's file, which says 200\n");
}

TEST(BridgeProcess, TakesItsRateFromTheRobotsFile) {
  TestGraph graph;
  const std::string robot = graph.directory() + "/robot.yaml",
                    params = graph.directory() + "/p.yaml";
  std::ifstream in(MIMESIS_SOURCE_DIR "/models/lwr4.yaml");
  std::ofstream out(robot);
  for (std::string line; std::getline(in, line);) {
    out << (line.starts_with("rate_hz:") ? "rate_hz: 100" : line) << '\n';
  }
  out.close();
  Process bridge(graph, "mimesis_bridge", {"--set", "robot=" + robot, "--set", "hand="});
  ASSERT_TRUE(bridge.wait_ready(graph, "bridge", kPatience)) << bridge.errors();
  EXPECT_EQ(bridge.terminate(), 0);
  EXPECT_NE(bridge.errors().find("ready: rate_hz=100 "), std::string::npos) << bridge.errors();
  std::ofstream(params) << "robot: " << robot << "\nrate_hz: 200\n";
  Process other(graph, "mimesis_bridge", {"--params", params, "--check"});
  EXPECT_EQ(other.wait(), 2);
  EXPECT_EQ(other.errors(), params +
                                ":2:10: bridge.rate_hz: 200 contradicts the robot's file, "
                                "which says 100\n");
}

}  // namespace
}  // namespace mimesis::hw::bridge
