// Faults of a standing biped that squats at a pace of its own: of drives, of commands, of the
// bridge, of a bus, and emergency stops. Its arms swing before a piece of furniture. None takes its
// drives' power away, so it must not fall, nor touch the furniture or itself.
// Explicit time, seeded; MIMESIS_FAULTS changes the number of trials.
#include <csignal>
#include <random>

#include "hw/bridge/test/body/robot.h"

namespace mimesis::hw::sim {
namespace {

constexpr std::array kFaults{"overcurrent", "cable cut",      "walker silent", "bridge dies",
                             "bus-off",     "emergency stop", "SIGUSR1",       "wild command"};
constexpr double kFront_m = 0.4;        // of the furniture
constexpr double kMostSwing_rad = 0.6;  // of the arms

class BodyCampaign : public Robot {
 protected:
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  /// @return how far a joint went after the fault [rad]
  double trial(unsigned seed, std::size_t fault) {
    random_.seed(seed);
    const double depth = uniform(0.0, 0.075), rate_hz = uniform(0.2, 0.7);
    const double swing = uniform(0.2, kMostSwing_rad);
    const double onset_s = 1.5 + uniform(0.0, 2.0);
    const std::string at = names[random_() % names.size()];
    SimBodyParams params{.drawer = {.present = true, .drawer = {.front_x_m = kFront_m}}};
    if (fault < 2)
      params.faults = {{.at_s = onset_s, .joint = at, .kind = fault == 0 ? "overcurrent" : "mute"}};
    start_body(params);
    start_bridge();
    const Time begin = now;
    double t = 0.0;
    nearest_m = kFront_m;
    const auto move = [&](bool speak) {
      for (const auto& hand : truth.hands_in_world_m())
        nearest_m = std::min(nearest_m, kFront_m - hand.x_m());
      squat(depth * (1.0 - std::cos(2.0 * M_PI * rate_hz * t)));
      const double arms = swing * std::sin(2.0 * M_PI * rate_hz * t);
      for (const std::string arm : {"left_shoulder_pitch", "right_shoulder_pitch"})
        target[joint(arm)] = home[joint(arm)] + (arm[0] == 'l' ? arms : -arms);
      t += now - begin > 1s ? to_seconds(kTick) : 0.0;
      tick(speak);
    };
    while (to_seconds(now - begin) < onset_s) move(true);
    EXPECT_EQ(status.state(), "following") << status.reason();
    const std::vector<double> before(drives.position_rad().begin(), drives.position_rad().end());
    if (fault == 3) bridge.reset();
    if (fault == 4) {
      const std::string bus = four_buses()[random_() % 4].can;
      can::open(bus, bridge_graph->directory())
          ->send(std::array{can::Frame{.id = can::kErrorFlag | can::kBusOff, .length = 8}});
    }
    if (fault == 5) bridge_graph->send("emergency_stop", v1::EmergencyStop{}, now);
    if (fault == 6) std::raise(SIGUSR1);
    const std::size_t wild = random_() % names.size();
    noticed_ms = -1;
    for (const Time onset = now, end = now + 3s; now < end;) {
      move(fault != 2);
      const bool gone = !bridge && drives.drives(0) != v1::DRIVE_STATE_OPERATION_ENABLED;
      if (noticed_ms < 0 && (gone || status.state() != "following" || !status.reason().empty()))
        noticed_ms = static_cast<int>((now - onset) / 1ms);
      if (fault == 7) target[wild] += uniform(-2.0, 2.0);
    }
    EXPECT_FALSE(truth.fell()) << truth.how() << ", " << status.reason();
    EXPECT_EQ(truth.furniture_collisions().steps(), 0u)
        << truth.furniture_collisions().deepest_between();
    EXPECT_EQ(truth.self_collisions().steps(), 0u) << truth.self_collisions().deepest_between();
    double farthest = 0.0;
    for (int i = 0; i < 30; ++i)
      farthest = std::max(farthest,
                          std::abs(drives.position_rad(i) - before[static_cast<std::size_t>(i)]));
    bridge.reset();
    body.reset();
    return farthest;
  }
  std::mt19937 random_;
  double nearest_m = 0.0;  // of a hand to the front of the furniture
  int noticed_ms = -1;     // after the fault, by the bridge, or by the drives of a dead one
};

/// One process-wide seed range; each trial a robot of its own.
class BodyFault : public BodyCampaign, public ::testing::WithParamInterface<int> {};

TEST_P(BodyFault, LeavesTheRobotStanding) {
  const auto fault = static_cast<std::size_t>(GetParam()) % kFaults.size();
  const double farthest = trial(static_cast<unsigned>(GetParam()), fault);
  std::printf(
      "seed %d, %s: noticed after %d ms, a joint went %.3f rad, a hand came to %.3f m; %s\n",
      GetParam(), kFaults[fault], noticed_ms, farthest, nearest_m, status.reason().c_str());
}

int trials() {
  const char* asked = std::getenv("MIMESIS_FAULTS");
  return asked != nullptr ? std::atoi(asked) : 80;
}
INSTANTIATE_TEST_SUITE_P(Campaign, BodyFault, ::testing::Range(1, trials() + 1));

}  // namespace
}  // namespace mimesis::hw::sim
