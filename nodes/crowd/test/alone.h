#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "nodes/crowd/test/coordinators.h"
#include "nodes/crowd/test/scenario_file.h"

namespace mimesis::crowd::testing {

using namespace std::chrono_literals;
using mimesis::testing::Loopback;

inline constexpr const char* kGuests = R"(
name: guests
until_s: 1000
stale_s: 0.3
groups:
  - name: square
    count: 4
    gait: walk
    start: {columns: 2}
    rules:
      phase: {graph: all_to_all, gain_1_s: 0.2}
  - name: glad
    gait: brisk
    rules: {}
externals:
  - {name: robot, group: square}
  - {name: figure, group: square}
encounters:
  - {group: square, other: glad, to: glad, within_m: 1}
)";
inline constexpr std::uint64_t kRobot = 5, kFigure = 6;

/// The node alone, on its own time.
struct Alone {
  explicit Alone(const std::string& text, double until_s = 0.0, int robot = -1)
      : file(text), params(file.params()) {
    params.until_s = until_s;
    params.robot.agent = robot;
    node = std::make_unique<CrowdNode>(params, bus);
  }
  void step() {
    now += 20ms;
    node->step(now);
    if (const auto s = bus.take_last<v1::CrowdStatus>("status")) status = *s;
    if (const auto s = bus.take_last<v1::CrowdStates>("states")) states = *s;
    while (const auto c = bus.take<v1::CrowdCertificate>("certificate")) {
      certificate = *c;
      voided += c->voided();
    }
    command.Clear();
    if (const auto c = bus.take_last<v1::CrowdCommand>("command")) command = *c;
  }
  void until(double s) {
    while (now < runtime::from_seconds(s)) step();
  }
  /// A robot walks beside the others, at their speed.
  void robot(double delay_s = 0.0, double x_m = 0.0) {
    const Time stamp = now - runtime::from_seconds(delay_s);
    const double t = std::chrono::duration<double>(stamp - 10s).count();
    v1::CrowdStates s;
    s.add_id(kRobot);
    s.add_position_in_world_m(x_m + 1.2 * t);
    s.add_position_in_world_m(8.0);
    s.add_velocity_in_world_m_s(1.2F);
    s.add_velocity_in_world_m_s(0.0F);
    s.add_heading_rad(0.0);
    s.add_phase_rad(1.0 + 5.7 * t);
    s.add_phase_rate_rad_s(5.7);
    bus.send("agents", s, stamp);
  }
  void walk_with_robot(double until_s, double delay_s = 0.0) {
    while (now < runtime::from_seconds(until_s)) {
      robot(delay_s);
      step();
    }
  }
  v1::CrowdTrust trust(int e = 0) const { return status.externals(e).trust(); }

  ScenarioFile file;
  CrowdParams params;
  Loopback bus;
  std::unique_ptr<CrowdNode> node;
  Time now = 10s;
  v1::CrowdStatus status;
  v1::CrowdStates states;
  v1::CrowdCertificate certificate;
  v1::CrowdCommand command;
  std::string voided;
};

}  // namespace mimesis::crowd::testing
