// The driver and simulated modules on a wire in memory, and the published bytes of the protocol.
#include "hw/powercube/driver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "hw/can/testing/memory_wire.h"
#include "hw/sim/powercube/module.h"

namespace mimesis::hw::powercube {
namespace {

using namespace std::chrono_literals;

constexpr Time kCycle = 20ms;  // 50 Hz: what modules of 500 kbit/s keep up with

/// Identifiers 0A0h, 0C0h, 0E0h + module and 100h; commands, parameters and modes of
/// ProtocolCommands.h.
TEST(Protocol, BytesAsPublished) {
  EXPECT_EQ(frame_text(to_all(Command::watchdog)), "100#07");
  EXPECT_EQ(frame_text(get(3, Parameter::state)), "0C3#0A27");
  EXPECT_EQ(frame_text(get(3, Parameter::position)), "0C3#0A3C");
  EXPECT_EQ(frame_text(set(3, Parameter::max_velocity, 0.5f)), "0E3#08480000003F");
  EXPECT_EQ(frame_text(set(3, Parameter::config, 0x01020304u)), "0E3#083904030201");
  EXPECT_EQ(frame_text(step(3, -1.0f, 20)), "0E3#0B10000080BF1400");
}

TEST(Protocol, AnswersAsPublished) {
  const auto answer =
      parse_answer({.id = 0x0A3, .length = 8, .data = {0x0B, 0x10, 0, 0, 0, 0x3F, 0x11, 0}});
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->module, 3);
  EXPECT_EQ(answer->position, 0.5f);
  EXPECT_EQ(answer->short_state, kNotOk | kMoves);
  const auto state = parse_answer({.id = 0x0BF, .length = 6, .data = {0x0A, 0x27, 0x06, 0, 0, 0}});
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->module, 31);
  EXPECT_EQ(state->value, state::kHomeOk | state::kHalted);
  EXPECT_FALSE(parse_answer({.id = 0x0A0, .length = 6, .data = {0x0A, 0x27}}).has_value())
      << "module 0";
  EXPECT_FALSE(parse_answer({.id = 0x0A3, .length = 5, .data = {0x0A, 0x27}}).has_value())
      << "short";
  EXPECT_FALSE(parse_answer({.id = 0x0E3, .length = 6, .data = {0x0A, 0x27}}).has_value())
      << "a command";
}

class Arm : public ::testing::Test {
 protected:
  void connect(bool homed = true) {
    const auto all = [](double x) { return Eigen::VectorXd::Constant(3, x); };
    const std::vector<cia402::Axis> axes{
        {.node_id = 3}, {.node_id = 4, .sign = -1}, {.node_id = 31, .offset_rad = 0.5}};
    driver.emplace(
        DriverOptions{
            .axes = axes,
            .limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(1), .a_max = all(4)}},
        wire.join());
    const double home[] = {0.1, -0.2, 0.3};  // of the modules: +0.1, +0.2 and 0.8 rad of the joints
    if (!modules.empty()) return;
    for (std::size_t i = 0; i < 3; ++i)
      modules.emplace_back(
          sim::ModuleConfig{.module = axes[i].node_id, .position_rad = home[i], .homed = homed});
    target = {0.1, 0.2, 0.8};
  }
  void cycle(Mode mode) {
    if (driver) {
      reading = driver->read(now);
      driver->write(now, {.mode = mode, .position_rad = target});
    }
    std::array<can::Frame, 256> frames;
    std::vector<can::Frame> out;
    const std::size_t count = bus->receive(frames);
    for (sim::Module& m : modules) {
      m.advance(now + kCycle / 2);
      for (const can::Frame& f : std::span(frames).first(count)) m.handle(f, out);
    }
    bus->send(out);
    now += kCycle;
  }
  void run(Mode mode, Time duration) {
    for (const Time end = now + duration; now < end;) cycle(mode);
  }
  void follow() {
    connect();
    run(Mode::idle, 1s);
    ASSERT_EQ(reading.phase, Phase::idle) << reading.reason;
    run(Mode::follow, 300ms);
    ASSERT_EQ(reading.phase, Phase::following) << reading.reason;
  }
  double fastest() const {
    double most = 0.0;
    for (const sim::Module& m : modules) most = std::max(most, std::abs(m.velocity_rad_s()));
    return most;
  }

  can::MemoryWire wire;
  std::unique_ptr<can::Bus> bus = wire.join();
  std::vector<sim::Module> modules;
  std::optional<Driver> driver;
  Reading reading;
  std::vector<double> target;
  Time now = 1s;
};

TEST_F(Arm, FollowsInTheModelsSignsAndZeros) {
  follow();
  const std::vector<double> start = target;
  for (int k = 1; k <= 100; ++k) {
    for (std::size_t i = 0; i < 3; ++i)
      target[i] = start[i] + 0.2 * (1.0 - std::cos(M_PI * k / 100.0));
    cycle(Mode::follow);
  }
  run(Mode::follow, 200ms);
  EXPECT_NEAR(modules[0].position_rad(), 0.5, 1e-3);
  EXPECT_NEAR(modules[1].position_rad(), -0.6, 1e-3);
  EXPECT_NEAR(modules[2].position_rad(), 0.7, 1e-3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(reading.joints[i].position_rad, target[i], 1e-3);
  EXPECT_EQ(reading.limited, 0u);
}

TEST_F(Arm, StandsHaltedUntilItIsToldToFollow) {
  connect();
  run(Mode::idle, 1s);
  for (const sim::Module& m : modules) EXPECT_NE(m.state() & state::kHalted, 0u);
  EXPECT_NEAR(reading.joints[2].position_rad, 0.8, 1e-6);
  follow();
  run(Mode::idle, 500ms);
  EXPECT_EQ(reading.phase, Phase::idle);
  for (const sim::Module& m : modules) EXPECT_NE(m.state() & state::kHalted, 0u);
}

TEST_F(Arm, ModulesHaltByThemselvesWithoutTheDriver) {
  follow();
  target = {1.9, 1.9, 1.9};
  run(Mode::follow, 300ms);
  ASSERT_GT(fastest(), 0.5);
  driver.reset();
  run(Mode::idle, 400ms);
  EXPECT_EQ(fastest(), 0.0);
  for (const sim::Module& m : modules) EXPECT_NE(m.state() & state::kCommunication, 0u);
}

TEST_F(Arm, AJammedModuleStopsAllAndIsReset) {
  follow();
  modules[1].jam();
  target[1] += 0.5;
  run(Mode::follow, 600ms);
  EXPECT_EQ(reading.phase, Phase::fault);
  EXPECT_NE(reading.reason.find("A2 (module 4): "), std::string::npos) << reading.reason;
  run(Mode::idle, 300ms);
  EXPECT_EQ(fastest(), 0.0);
  modules[1] = sim::Module({.module = 4, .position_rad = -0.2});
  EXPECT_EQ(driver->reset_faults(), "");
  run(Mode::idle, 200ms);
  target = {reading.joints[0].position_rad, reading.joints[1].position_rad,
            reading.joints[2].position_rad};
  run(Mode::follow, 300ms);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Arm, ACutCableIsLostAndStopsTheOthers) {
  follow();
  modules[2].cut(true);
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::fault);
  EXPECT_EQ(reading.reason, "A3 (module 31): no answer for 0.1 s");
  EXPECT_NE(modules[0].state() & state::kHalted, 0u);
  EXPECT_EQ(driver->reset_faults(), "modules are missing: A3 (module 31): no answer for 0.1 s");
  modules[2].cut(false);
  run(Mode::idle, 1s);
  EXPECT_NE(reading.reason.find("A3 (module 31): lost its watchdog's refresh"), std::string::npos)
      << reading.reason;
  EXPECT_EQ(driver->reset_faults(), "");
  run(Mode::idle, 500ms);
  EXPECT_EQ(reading.phase, Phase::idle) << reading.reason;
}

TEST_F(Arm, RefusesAModuleThatIsNotHomedOrNotThere) {
  connect(false);
  run(Mode::idle, 1s);
  EXPECT_EQ(reading.phase, Phase::fault);
  EXPECT_NE(reading.reason.find("A1 (module 3): is not homed"), std::string::npos)
      << reading.reason;
  driver.reset();
  modules.erase(modules.begin() + 1, modules.end());
  connect();
  run(Mode::idle, 3s);
  EXPECT_EQ(reading.reason, "no answer within 2 s from A2 (module 4), A3 (module 31)");
}

TEST_F(Arm, LimitsAreWrittenAndKept) {
  follow();
  target = {9.0, 9.0, 9.0};
  double most = 0.0;
  for (int k = 0; k < 200; ++k) {
    cycle(Mode::follow);
    most = std::max(most, fastest());
  }
  EXPECT_LE(most, 1.01);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(reading.joints[i].position_rad, 2.0, 1e-2);
}

}  // namespace
}  // namespace mimesis::hw::powercube
