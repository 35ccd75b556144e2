// A driver of joints behind a controller, and a simulated controller, which shares no code with it.
#include "hw/udp/driver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "hw/sim/udp/controller.h"

namespace mimesis::hw::udp {
namespace {

using namespace std::chrono_literals;

constexpr int kJoints = 2;
constexpr Time kCycle = 4ms;

/// Datagrams in memory.
struct Wire {
  std::vector<std::string> to_controller, to_driver;
};
class MemoryLink final : public Link {
 public:
  explicit MemoryLink(Wire& wire) : wire_(wire) {}
  bool send(std::string_view datagram) override {
    wire_.to_controller.emplace_back(datagram);
    return true;
  }
  std::vector<std::string> receive() override { return std::exchange(wire_.to_driver, {}); }

 private:
  Wire& wire_;
};

class Joints : public ::testing::Test {
 protected:
  void plug(std::uint32_t session = 7, std::vector<double> home = {0.3, -0.2}) {
    const std::vector<double> v(home.size(), 1.5), a(home.size(), 5.0);
    controller.emplace(sim::ControllerConfig{
        .home_rad = std::move(home), .v_max_rad_s = v, .a_max_rad_s2 = a, .session = session});
  }
  std::unique_ptr<Driver> driver_of(std::uint32_t session, Wire& to) {
    const auto all = [](double x) { return Eigen::VectorXd::Constant(kJoints, x); };
    return std::make_unique<Driver>(
        DriverOptions{
            .address = "arm:1",
            .names = {"shoulder", "elbow"},
            .limits = {.q_min = all(-2.0), .q_max = all(2.0), .v_max = all(1.5), .a_max = all(5.0)},
            .session = session},
        std::make_unique<MemoryLink>(to));
  }
  void connect() { driver = driver_of(99, wire); }
  void cycle(const Setpoint& setpoint) {
    driver->read(now);
    driver->write(now, setpoint);
    sim_cycle();
  }
  void sim_cycle() {
    for (const std::string& d : std::exchange(wire.to_controller, {}))
      if (controller) controller->handle("bridge", d, now + kCycle / 2);
    if (controller) {
      controller->advance(now + kCycle / 2);
      wire.to_driver.push_back(controller->state());
    }
    now += kCycle;
  }
  void idle(Time duration) {
    for (const Time end = now + duration; now < end;) cycle({.mode = Mode::idle});
  }
  void follow(Time duration) {
    for (const Time end = now + duration; now < end;)
      cycle({.mode = Mode::follow, .position_rad = target});
  }
  void enable() {
    plug();
    connect();
    idle(100ms);
    ASSERT_EQ(driver->reading().phase, Phase::idle) << reason();
    follow(200ms);
    ASSERT_EQ(driver->reading().phase, Phase::following) << reason();
  }
  const std::string& reason() const { return driver->reading().reason; }

  Wire wire;
  std::optional<sim::Controller> controller;
  std::unique_ptr<Driver> driver;
  std::vector<double> target = {0.3, -0.2};
  Time now = 1s;
};

TEST_F(Joints, FollowAStreamAndStop) {
  enable();
  for (int k = 1; k <= 250; ++k) {
    const double by = 0.4 * (1.0 - std::cos(M_PI * k / 250.0));
    target = {0.3 + by, -0.2 - by};
    cycle({.mode = Mode::follow, .position_rad = target});
    for (int i = 0; i < kJoints; ++i)
      ASSERT_NEAR(controller->position_rad()[i], target[i], 0.01) << k;
  }
  idle(20ms);
  EXPECT_EQ(driver->reading().phase, Phase::idle) << "it stood";
  EXPECT_FALSE(controller->follows());
  EXPECT_NEAR(driver->reading().joints[0].position_rad, 1.1, 1e-9);
  EXPECT_EQ(driver->traffic().errors, 0u);
}

/// The controller follows only after an order to stop that was meant for it.
TEST_F(Joints, MayBeStreamedToFromTheFirstCycle) {
  plug();
  connect();
  follow(200ms);
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
}

TEST_F(Joints, LimitsAreTheBridges) {
  enable();
  target = {9.0, 9.0};
  follow(5s);
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
  EXPECT_NEAR(controller->position_rad()[0], 2.0, 1e-6);
  EXPECT_GT(driver->reading().limited, 0u);
}

TEST_F(Joints, TheControllerStopsWithoutTheBridge) {
  enable();
  for (int k = 1; k <= 60; ++k) {
    target[0] += 0.004;
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  ASSERT_GT(std::abs(controller->velocity_rad_s()[0]), 0.5);
  const Time last = now;
  while (controller->follows() && now < last + 1s) sim_cycle();
  EXPECT_LE(now - last, 110ms) << "its watchdog of 0.1 s";
  for (int k = 0; k < 200; ++k) sim_cycle();
  EXPECT_EQ(controller->velocity_rad_s()[0], 0.0);
}

TEST_F(Joints, ASilentControllerIsAFaultAndIsTakenAgain) {
  connect();
  follow(2100ms);
  EXPECT_EQ(reason(), "no answer within 2 s from controller arm:1");
  plug();
  follow(100ms);
  EXPECT_EQ(driver->reading().phase, Phase::fault) << "a stream of before";
  idle(100ms);
  EXPECT_EQ(driver->reading().phase, Phase::idle) << reason();
  follow(200ms);
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
  controller.reset();
  follow(150ms);
  EXPECT_EQ(reason(), "controller arm:1: no state for 0.1 s");
}

TEST_F(Joints, ARestartedControllerIsNotMoved) {
  enable();
  plug(8, {0.9, 0.9});
  follow(50ms);
  EXPECT_EQ(driver->reading().phase, Phase::fault);
  EXPECT_EQ(reason(), "controller arm:1 has restarted");
  follow(300ms);
  EXPECT_EQ(controller->position_rad()[0], 0.9);
  idle(100ms);
  target = {0.9, 0.9};
  follow(200ms);
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
}

TEST_F(Joints, ASecondBridgeMovesNothingAndSaysWhy) {
  enable();
  const auto second = driver_of(55, wire);
  for (int k = 0; k < 100; ++k) {
    std::vector<std::string> states = wire.to_driver;
    cycle({.mode = Mode::follow, .position_rad = target});
    wire.to_driver.swap(states);
    second->read(now);
    second->write(now, {.mode = Mode::follow, .position_rad = std::vector<double>{1.0, 1.0}});
    wire.to_driver.swap(states);
  }
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
  EXPECT_EQ(second->reading().reason, "controller arm:1 obeys another master (session 99)");
  EXPECT_NEAR(controller->position_rad()[0], 0.3, 1e-9);
}

TEST_F(Joints, FaultsOfTheControllerAndTheirReset) {
  enable();
  controller->fail(42);
  follow(50ms);
  EXPECT_EQ(reason(), "controller arm:1: fault 42");
  EXPECT_EQ(driver->reset_faults(), "");
  idle(100ms);
  EXPECT_EQ(driver->reading().phase, Phase::idle) << reason();
  follow(200ms);
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
  controller->jam(true);
  for (int k = 0; k < 200 && driver->reading().phase == Phase::following; ++k) {
    target[1] += 0.004;
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  EXPECT_NE(reason().find("elbow: is 0.1"), std::string::npos) << reason();
}

/// A controller that does not stop, or that has no session to be told apart by.
TEST_F(Joints, AControllerThatDoesNotObeyIsAFault) {
  enable();
  const std::string follows = wire.to_driver.back();
  for (std::uint32_t k = 1; k < 600 && driver->reading().phase != Phase::fault; ++k) {
    std::string state = follows;
    const std::uint32_t sequence = 1000 + k;
    std::memcpy(state.data() + 8, &sequence, sizeof sequence);
    wire.to_driver = {state};
    driver->read(now);
    driver->write(now, {.mode = Mode::idle});
    now += kCycle;
  }
  EXPECT_EQ(reason(),
            "controller arm:1: expected off within 2 s of the order to stop, is following");
  std::string nobody = follows;
  std::memset(nobody.data() + 4, 0, 4);
  EXPECT_FALSE(decode_state(nobody).has_value());
}

TEST_F(Joints, AnotherArmIsRefused) {
  plug(7, {0.0, 0.0, 0.0});
  connect();
  idle(100ms);
  EXPECT_EQ(reason(), "controller arm:1 has 3 joints, the robot has 2");
  EXPECT_FALSE(controller->follows());
}

/// Lost, doubled, overtaken, torn and wrong datagrams: the newest state counts, the rest is
/// counted.
TEST_F(Joints, DatagramsAsNetworksTreatThem) {
  enable();
  std::vector<std::string> old;
  double farthest = 0.3;
  for (int k = 1; k <= 400; ++k) {
    target[0] += 0.002;
    cycle({.mode = Mode::follow, .position_rad = target});
    const std::string newest = wire.to_driver.back();
    old.push_back(newest);
    if (k % 10 == 0) wire.to_driver.pop_back();
    if (k % 7 == 0) wire.to_driver.push_back(old[old.size() - 3]);
    if (k % 11 == 0) wire.to_driver.emplace_back(newest.substr(0, 30));
    if (k % 13 == 0) {
      std::string broken = newest;
      const double nan = std::numeric_limits<double>::quiet_NaN();
      std::memcpy(broken.data() + 24, &nan, sizeof nan);
      wire.to_driver.push_back(broken);
    }
    const double shown = driver->reading().joints[0].position_rad;
    ASSERT_GE(shown, farthest) << "no older state, and a number";
    farthest = shown;
  }
  EXPECT_EQ(driver->reading().phase, Phase::following) << reason();
  EXPECT_NEAR(controller->position_rad()[0], target[0], 0.02);
  EXPECT_GT(driver->traffic().errors, 100u);
}

/// The layout that README.md documents.
TEST(Packet, IsAsDocumented) {
  const std::string bytes = encode({.header = {1, 2, 3, 4},
                                    .order = Order::follow,
                                    .watchdog_ms = 0x0102,
                                    .position_rad = {1.0},
                                    .velocity_rad_s = {-2.0}});
  const std::string expected(
      "MJC1\1\0\0\0\2\0\0\0\3\0\0\0\1\1\2\1\4\0\0\0"
      "\0\0\0\0\0\0\xF0\x3F\0\0\0\0\0\0\0\xC0",
      40);
  EXPECT_EQ(bytes, expected);
}

}  // namespace
}  // namespace mimesis::hw::udp
