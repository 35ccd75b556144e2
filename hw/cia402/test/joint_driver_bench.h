#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::cia402 {

using namespace std::chrono_literals;

constexpr int kAxes = 3;
constexpr Time kCycle = 5ms;
constexpr double kV = 1.5, kA = 5.0;

inline JointLimits limits() {
  const auto all = [](double x) { return Eigen::VectorXd::Constant(kAxes, x); };
  return {.q_min = all(-2.0), .q_max = all(2.0), .v_max = all(kV), .a_max = all(kA)};
}

inline std::vector<Axis> axes() {
  return {
      {.node_id = 1}, {.node_id = 5, .sign = -1}, {.node_id = 9, .increments_per_rad = 40'000.0}};
}

/// Driver and simulated drives on a wire in memory, the drives half a cycle later.
class Bench : public ::testing::Test {
 protected:
  can::MemoryWire wire;
  std::unique_ptr<can::Bus> tap = wire.join();
  std::optional<sim::Rack> rack;
  std::optional<JointDriver> driver;
  Time now = 1s;
  std::vector<double> target = {0.3, -0.2, 0.1};
  int goes_on = 0;                                    // cycles, of the drives
  double fastest_motion = 0.0, fastest_change = 0.0;  // [rad/s], [rad/s²] seen at the drives

  void plug(int count = kAxes) {
    std::vector<sim::DriveConfig> configs;
    for (const Axis& axis : axes()) {
      configs.push_back(
          {.axis = axis, .home_rad = target[configs.size()], .extrapolated_cycles = goes_on});
    }
    configs.resize(static_cast<std::size_t>(count));
    rack.emplace(configs, wire.join());
  }
  void connect() {
    driver.emplace(JointDriverOptions{.axes = axes(), .limits = limits()}, wire.join());
  }
  const Reading& reading() { return last_; }

  void cycle(const Setpoint& setpoint, bool left_out = false) {
    if (driver && !left_out) {
      last_ = driver->read(now);
      driver->write(now, setpoint);
    }
    if (rack) {
      std::vector<double> before;
      for (auto& d : rack->drives()) before.push_back(d.velocity_rad_s());
      rack->step(now + kCycle / 2);
      for (std::size_t i = 0; i < before.size(); ++i) {
        const double v = rack->drives()[i].velocity_rad_s();
        fastest_motion = std::max(fastest_motion, std::abs(v));
        fastest_change = std::max(fastest_change, std::abs(v - before[i]) / 5e-3);
      }
    }
    now += kCycle;
  }
  void idle(Time duration) {
    for (const Time end = now + duration; now < end;) cycle({.mode = Mode::idle});
  }
  void follow(Time duration) {
    for (const Time end = now + duration; now < end;) {
      cycle({.mode = Mode::follow, .position_rad = target});
    }
  }
  void enable() {
    plug();
    connect();
    idle(500ms);
    ASSERT_EQ(reading().phase, Phase::idle) << reading().reason;
    follow(100ms);
    ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  }
  bool any_enabled() {
    for (auto& d : rack->drives()) {
      if (d.state() == DriveState::operation_enabled) return true;
    }
    return false;
  }
  std::vector<can::Frame> seen() {
    std::vector<can::Frame> frames(100'000);
    frames.resize(tap->receive(frames));
    return frames;
  }

 private:
  Reading last_;
};

}  // namespace mimesis::hw::cia402
