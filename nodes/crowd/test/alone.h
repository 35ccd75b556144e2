#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "common/testing/loopback.h"
#include "nodes/crowd/crowd_node.h"
#include "nodes/crowd/test/guests.h"
#include "nodes/crowd/test/scenario_file.h"

namespace mimesis::crowd::testing {

using namespace std::chrono_literals;
using mimesis::testing::Loopback;
using runtime::Time;

/// With another group that the square may meet, and a character.
inline const std::string kGuests = square_with_robot("guests", "0.3", R"(
  - name: glad
    gait: brisk
    rules: {}
)",
                                                     R"(
  - {name: synthesizer/1, group: square}
encounters:
  - {group: square, other: glad, to: glad, within_m: 1}
)");
inline constexpr std::uint64_t kFigure = kRobot + 1;

/// The node alone, on its own time.
struct Alone {
  explicit Alone(const std::string& text, double until_s = 0.0)
      : file(text), params(file.params()) {
    params.until_s = until_s;
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
    bus.send("agents", robot_beside(t, 1.0, x_m), stamp);
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
