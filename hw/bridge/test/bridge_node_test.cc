// The node on a loopback graph, with simulated drives and hand on its buses, in explicit time.
#include "hw/bridge/bridge_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <fstream>

#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "common/testing/refusal.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/hand/hand.h"
#include "hw/sim/powercube/module.h"
#include "hw/sim/udp/udp_node.h"

namespace mimesis::hw::bridge {
namespace {

using namespace std::chrono_literals;
using Time = runtime::Time;

class Node : public ::testing::Test {
 protected:
  explicit Node(const BridgeParams& params = {.enable = "auto", .log_frames = true}) {
    for (Eigen::Index i = 0; i < model.dof(); ++i) {
      drives.push_back({.axis = {.node_id = static_cast<int>(i) + 1}, .home_rad = model.home[i]});
      target.push_back(model.home[i]);
    }
    rack.emplace(drives, can::open("embedded:arm", graph.directory()));
    node.emplace(params, graph);
  }

  void run(Time duration, bool speak = true) {
    for (const Time end = now + duration; now < end; now += 5ms) {
      v1::JointCommand command;
      for (const double q : target) command.add_position_rad(q);
      if (speak) graph.send("command", command, now - 5ms);
      node->step(now);
      if (rack) rack->step(now + 2500us);
      if (server && now.count() % 10'000'000 == 0)
        plant.step(0.01, server->exchange(plant.input()), 0.5);
    }
    if (auto s = graph.take_last<v1::BridgeStatus>("status")) status = *s;
    if (auto s = graph.take_last<v1::JointState>("joint_states")) arm = *s;
    if (auto s = graph.take_last<v1::HandState>("hand")) hand = *s;
  }

  /// Answer of a service; empty if it has done what it is for.
  std::string ask(const std::string& service) {
    const auto answer = graph.call("test/" + service, "", 1s);
    return answer ? "" : answer.error().reason;
  }

  testing::Loopback graph;
  kin::ArmModel model = model::load_arm("lwr4.yaml");
  std::vector<sim::DriveConfig> drives;
  std::optional<sim::Rack> rack;
  std::optional<sim::HandServer> server{modbus::parse_address("unix:hand", graph.directory())};
  sim::HandPlant plant{{}};
  std::optional<BridgeNode> node;
  Time now = 1s;
  std::vector<double> target;
  v1::BridgeStatus status;
  v1::JointState arm;
  v1::HandState hand;
};

TEST_F(Node, ReportsThePostureBeforeAnyCommand) {
  run(1s, false);
  EXPECT_EQ(status.state(), "idle");
  EXPECT_EQ(status.reason(), "no command yet");
  ASSERT_EQ(arm.position_rad_size(), 7);
  EXPECT_NEAR(arm.position_rad(0), model.home[0], 1e-4);
  EXPECT_FALSE(arm.operational());
  EXPECT_EQ(arm.drives(0), v1::DRIVE_STATE_SWITCH_ON_DISABLED);
  EXPECT_TRUE(hand.active());
  const auto joints = graph.take_last<foxglove::JointStates>("joints");
  ASSERT_TRUE(joints.has_value());
  EXPECT_EQ(joints->joints(6).name(), "A7");
  EXPECT_NEAR(joints->joints(0).position(), model.home[0], 1e-4);
}

TEST_F(Node, FollowsThenStopsOnSilenceThenFollowsAgain) {
  run(1s);
  ASSERT_EQ(status.state(), "following") << status.reason();
  EXPECT_TRUE(arm.operational());
  for (int k = 1; k <= 200; ++k) {  // 1 s, at most 0.63 rad/s and 3.9 rad/s²
    target[1] = model.home[1] + 0.1 * (1.0 - std::cos(M_PI * k / 100.0));
    run(5ms);
  }
  run(50ms);
  EXPECT_NEAR(arm.position_rad(1), target[1], 1e-3);
  run(95ms, false);
  EXPECT_EQ(status.state(), "following") << "held, powered";
  run(50ms, false);
  EXPECT_FALSE(arm.operational());
  EXPECT_EQ(status.reason(), "no command for 0.1 s");
  target[1] += 0.5;
  run(100ms);
  EXPECT_FALSE(arm.operational()) << "not at the actual posture";
  EXPECT_NE(status.reason().find("A2 starts 0.500 rad"), std::string::npos) << status.reason();
  target[1] -= 0.5;
  run(200ms);
  EXPECT_EQ(status.state(), "following") << status.reason();
  EXPECT_EQ(status.commands_limited(), 0u);
  EXPECT_GT(status.can_frames_sent(), 1000u);
  EXPECT_EQ(status.can_errors(), 0u);
}

TEST_F(Node, LostDrivesAreAFault) {
  run(1s);
  rack.reset();
  run(300ms);
  EXPECT_EQ(status.state(), "fault");
  EXPECT_EQ(status.reason(), "A1 (node 1): no feedback for 0.0075 s");
  EXPECT_EQ(arm.fault(), status.reason());
  EXPECT_GT(status.can_errors(), 0u) << "nobody hears the quick stop";
}

/// One bridge for all of it: a fault stops the arm, service `reset` ends the fault, a new stream
/// moves the arm again.
TEST_F(Node, AFaultOfADriveIsReset) {
  const auto reset = [&] { return ask("reset"); };
  run(1s);
  EXPECT_EQ(reset(), "there is no fault");
  rack->drives()[2].inject(sim::Trouble::over_temperature);
  run(300ms);
  EXPECT_EQ(status.state(), "fault");
  EXPECT_NE(status.reason().find("A3 (node 3): expected operation enabled, is fault"),
            std::string::npos)
      << status.reason();
  EXPECT_NE(status.reason().find("drive too hot (0x4310)"), std::string::npos);
  run(300ms);
  EXPECT_EQ(status.state(), "fault") << "the stream that was there has no effect";
  run(200ms, false);
  run(300ms);
  EXPECT_EQ(status.state(), "fault") << "a new stream alone does not reset a drive";
  EXPECT_EQ(reset(), "");
  run(300ms);
  EXPECT_NE(status.state(), "fault") << status.reason();
  run(200ms, false);
  EXPECT_EQ(status.state(), "idle");
  for (const auto& drive : rack->drives()) EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  run(300ms);
  EXPECT_EQ(status.state(), "following") << status.reason();
  EXPECT_EQ(rack->drives()[2].objects().value(0x1001'00), 0) << "error register";
}

struct ArmedByService : Node {
  ArmedByService() : Node(BridgeParams{}) {}
};

TEST_F(ArmedByService, MovesNothingBefore) {
  run(1s);
  EXPECT_EQ(status.state(), "idle");
  EXPECT_EQ(status.reason(), "not enabled (service bridge/enable)");
  EXPECT_FALSE(status.enabled());
  EXPECT_EQ(ask("enable"), "");
  run(300ms);
  EXPECT_EQ(status.state(), "following") << status.reason();
  EXPECT_TRUE(status.enabled());
  EXPECT_EQ(ask("disable"), "");
  run(500ms);
  EXPECT_EQ(status.state(), "idle") << status.reason();
  rack->drives()[1].inject(sim::Trouble::overcurrent);
  run(100ms);
  EXPECT_NE(ask("enable").find("A2 (node 2): expected switch on disabled, is fault"),
            std::string::npos)
      << ask("enable");
}

BridgeParams with_stop_input() {
  BridgeParams params{.enable = "auto"};
  for (int i = 1; i <= 7; ++i) params.axes.push_back({.node_id = i, .stop_bit = i == 5 ? 3 : -1});
  return params;
}
struct WithStopInput : Node {
  WithStopInput() : Node(with_stop_input()) {}
};

/// By topic, by signal and by a drive's input; none is left before its cause is gone.
TEST_F(WithStopInput, EmergencyStopsByTopicSignalAndInput) {
  const auto stops = [&](const std::string& why) {
    run(20ms);
    EXPECT_NE(status.state(), "following");
    EXPECT_EQ(status.reason(), "emergency stop: " + why);
    run(1s);
    EXPECT_EQ(status.state(), "idle") << status.reason();
    for (const auto& drive : rack->drives())
      EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  };
  const auto goes_on = [&] {
    run(200ms, false);
    run(300ms);
    EXPECT_EQ(status.state(), "following") << status.reason();
  };
  run(1s);
  goes_on();
  v1::EmergencyStop stop;
  stop.set_reason("the guard is open");
  graph.send("emergency_stop", stop, now);
  stops("the guard is open");
  EXPECT_EQ(ask("reset"), "");
  goes_on();
  std::raise(SIGUSR1);
  stops("signal SIGUSR1");
  EXPECT_EQ(ask("reset"), "");
  goes_on();
  rack->drives()[4].inject(sim::Trouble::emergency_stop, 3s);
  stops("A5 (node 5): bit 3 of its inputs (60FD:00) is open");
  EXPECT_EQ(
      ask("reset"),
      "the emergency stop is still demanded: A5 (node 5): bit 3 of its inputs (60FD:00) is open");
  run(3s);
  EXPECT_EQ(status.state(), "idle") << "released, but not reset";
  EXPECT_EQ(ask("reset"), "");
  goes_on();
}

TEST_F(Node, PublishesItsFramesOnRequest) {
  run(170ms);
  int syncs = 0, resets = 0;
  while (const auto frame = graph.take<v1::CanFrame>("can")) {
    EXPECT_EQ(frame->bus(), "arm");
    syncs += frame->id() == 0x080 && frame->data().empty() ? 1 : 0;
    resets +=
        frame->id() == 0 && frame->data() == std::string{'\x82', static_cast<char>(1 + resets)} ? 1
                                                                                                : 0;
  }
  EXPECT_EQ(resets, 7) << "of its nodes, one by one";
  EXPECT_EQ(syncs, 5) << "of four steps, and of the first quick stop";
}

TEST_F(Node, ClosesTheHandOnTheObject) {
  run(1s);
  v1::HandCommand close;
  close.set_grip(v1::GRIP_PRECISION);
  close.set_closure(1.0);
  close.set_force(0.5);
  graph.send("hand_command", close, now);
  run(2s);
  EXPECT_EQ(hand.grip(), v1::GRIP_PRECISION);
  EXPECT_TRUE(hand.object_detected());
  EXPECT_NEAR(hand.closure(), 0.5, 0.01);
  EXPECT_FALSE(hand.moving());
}

struct WithHand : Node, ::testing::WithParamInterface<const char*> {
  WithHand() : Node({.on_hand_fault = GetParam(), .enable = "auto"}) {}
};

/// A hand that dies in the middle of a grip: the arm stops, or goes on, as configured.
TEST_P(WithHand, ThatFailsStopsTheArmIfItIsTo) {
  run(1s);
  ASSERT_EQ(status.state(), "following") << "a hand that is not there yet stops nothing";
  v1::HandCommand close;
  close.set_closure(1.0);
  graph.send("hand_command", close, now);
  run(300ms);
  ASSERT_TRUE(hand.moving());
  server.reset();
  run(500ms);
  EXPECT_NE(hand.fault(), "");
  if (std::string(GetParam()) == "go_on") {
    EXPECT_EQ(status.state(), "following") << status.reason();
    return;
  }
  EXPECT_EQ(status.reason().substr(0, 22), "emergency stop: hand: ");
  EXPECT_EQ(status.state(), "idle");
  server.emplace(modbus::parse_address("unix:hand", graph.directory()));
  run(3s);
  EXPECT_EQ(status.state(), "idle") << "it is back, but nobody has reset";
  EXPECT_EQ(ask("reset"), "");
  run(200ms, false);
  run(1s);
  EXPECT_EQ(status.state(), "following") << status.reason();
}
INSTANTIATE_TEST_SUITE_P(OnHandFault, WithHand, ::testing::Values("go_on", "stop"),
                         [](const auto& p) { return std::string(p.param); });

TEST_F(Node, StopDisablesTheDrives) {
  run(1s);
  node->stop(now);
  node.reset();
  for (int k = 0; k < 40; ++k) rack->step(now += 5ms);
  for (auto& drive : rack->drives()) EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
}

/// The arm's file with another value of `key`.
std::string robot_with(const testing::Loopback& graph, const std::string& key,
                       const std::string& value) {
  std::ifstream in(std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml");
  const std::string file = graph.directory() + "/robot.yaml";
  std::ofstream out(file);
  for (std::string line; std::getline(in, line);) {
    out << (line.starts_with(key + ":") ? key + ": " + value : line) << '\n';
  }
  return file;
}

/// A stream at `home` for `steps` steps of 5 ms from `now` on. @return the state at its end
std::string stream_at(const Eigen::VectorXd& home, int steps, BridgeNode& node,
                      testing::Loopback& graph, Time& now) {
  for (int k = 0; k < steps; ++k, now += 5ms) {
    v1::JointCommand command;
    for (const double q : home) command.add_position_rad(q);
    graph.send("command", command, now - 5ms);
    node.step(now);
  }
  return graph.take_last<v1::BridgeStatus>("status").value_or(v1::BridgeStatus{}).state();
}

/// Commands to a puppet; they outlive it.
struct Strings {
  std::vector<Mode> modes;
  int stops = 0;
};

/// Actuators of a kind that hw knows nothing of.
class Puppet final : public Actuators {
 public:
  Puppet(const Joints& joints, Strings& strings) : strings_(strings) {
    reading_.phase = Phase::idle;
    reading_.posture_known = true;
    for (const double q : joints.home) reading_.joints.push_back({.position_rad = q});
  }
  const Reading& read(Time) override { return reading_; }
  void write(Time, const Setpoint& setpoint) override {
    strings_.modes.push_back(setpoint.mode);
    reading_.phase = setpoint.mode == Mode::follow ? Phase::following : Phase::idle;
  }
  void stop() noexcept override { ++strings_.stops; }
  Traffic traffic() const override { return {.sent = strings_.modes.size()}; }

 private:
  Strings& strings_;
  Reading reading_;
};

TEST(ActuatorsOfAnotherKind, AreObeyedGatedAndStopped) {
  testing::Loopback graph;
  Strings strings;
  add_actuators("puppet", [&](const ActuatorsRequest& request) {
    EXPECT_EQ(request.joints.count(), 7);
    EXPECT_FALSE(request.stays_powered);
    return std::make_unique<Puppet>(request.joints, strings);
  });
  const std::string robot = robot_with(graph, "drives", "puppet");
  BridgeNode node({.robot = robot, .hand = "", .enable = "auto"}, graph);
  const Eigen::VectorXd home = load_joints(robot).home;
  Time now = 1s;
  EXPECT_EQ(stream_at(home, 20, node, graph, now), "following");
  EXPECT_EQ(strings.modes.back(), Mode::follow);
  for (int k = 0; k < 30; ++k) node.step(now += 5ms);  // silence
  EXPECT_EQ(strings.modes.back(), Mode::idle);
  EXPECT_EQ(stream_at(home.array() + 0.5, 20, node, graph, now), "idle") << "starts elsewhere";
  EXPECT_EQ(strings.modes.back(), Mode::idle);
  node.stop(now);
  EXPECT_EQ(strings.stops, 1);
}

TEST(ActuatorsOfAnotherKind, MayBePowerCubeModules) {
  testing::Loopback graph;
  const std::string robot = robot_with(graph, "drives", "powercube");
  BridgeNode node({.robot = robot, .hand = "", .enable = "auto"}, graph);
  Eigen::VectorXd target = load_joints(robot).home;
  const auto bus = can::open("embedded:arm", graph.directory());
  std::vector<sim::Module> modules;
  for (int i = 0; i < 7; ++i)
    modules.emplace_back(sim::ModuleConfig{.module = i + 1, .position_rad = target[i]});
  Time now = 1s;
  std::string state;
  const auto step = [&] {
    state = stream_at(target, 1, node, graph, now);
    std::array<can::Frame, 128> frames;
    std::vector<can::Frame> out;
    const std::size_t count = bus->receive(frames);
    for (sim::Module& m : modules) {
      m.advance(now);
      for (const can::Frame& f : std::span(frames).first(count)) m.handle(f, out);
    }
    bus->send(out);
  };
  for (int k = 0; k < 200; ++k) step();
  for (int k = 0; k < 100; ++k) {
    target[3] += 0.001;
    step();
  }
  for (int k = 0; k < 20; ++k) step();
  EXPECT_NEAR(modules[3].position_rad(), target[3], 1e-3);
  EXPECT_EQ(modules[3].state() & 0x4u, 0u) << "not halted";
}

TEST(ActuatorsOfAnotherKind, MayBeAControllerOfDatagrams) {
  testing::Loopback graph, other;
  const std::string robot = robot_with(graph, "drives", "udp");
  sim::UdpNode arm({.address = "127.0.0.1:27218", .robot = robot}, other);
  BridgeNode node({.robot = robot, .controller = "127.0.0.1:27218", .hand = "", .enable = "auto"},
                  graph);
  Eigen::VectorXd target = load_joints(robot).home;
  Time now = 1s;
  std::string state;
  for (int k = 0; k < 320; ++k) {
    if (k >= 200 && k < 300) target[3] += 0.001;
    if (const std::string said = stream_at(target, 1, node, graph, now); !said.empty())
      state = said;
    arm.step(now + 2500us);
  }
  EXPECT_EQ(state, "following");
  EXPECT_NEAR(other.take_last<v1::JointState>("joint_states")->position_rad(3), target[3], 1e-6);
  EXPECT_NE(testing::refusal([&] { BridgeNode({.robot = robot, .hand = ""}, other); }, "accepted")
                .find("controller: expected HOST:PORT"),
            std::string::npos);
  for (const BridgeParams& odd :
       {BridgeParams{.controller = "127.0.0.1:27218", .hand = ""},
        BridgeParams{
            .robot = robot, .controller = "127.0.0.1:27218", .hand = "", .log_frames = true}}) {
    testing::Loopback third;
    EXPECT_NE(testing::refusal([&] { BridgeNode(odd, third); }, "accepted").find("drives: "),
              std::string::npos);
  }
}

TEST(ActuatorsOfAnotherKind, ThatNobodyKnowsAreRefused) {
  testing::Loopback graph;
  const std::string robot = robot_with(graph, "drives", "nobody");
  const std::string refused = testing::refusal([&] { BridgeNode node({.robot = robot}, graph); });
  EXPECT_NE(refused.find("drives: 'nobody' is not known, expected one of cia402, powercube"),
            std::string::npos)
      << refused;
}

TEST_F(Node, BadConfigurationIsRefused) {
  const auto refusal = [&](const BridgeParams& wrong) -> std::string {
    testing::Loopback other;
    return testing::refusal([&] { BridgeNode refused(wrong, other); }, "accepted");
  };
  EXPECT_NE(refusal({.robot = "nobody.yaml"}).find("nobody.yaml"), std::string::npos);
  EXPECT_EQ(refusal({.can = "can0"}),
            "CAN bus 'can0': expected embedded:NAME, socketcan:INTERFACE or "
            "slcan:/dev/NAME");
  EXPECT_EQ(refusal({.hand = "hand"}),
            "Modbus 'hand': expected tcp:HOST:PORT, unix:NAME or rtu:/dev/NAME");
  EXPECT_EQ(refusal({.axes = {{.node_id = 1}}}), "axes: 1 given, the robot has 7 joints");
}

}  // namespace
}  // namespace mimesis::hw::bridge
