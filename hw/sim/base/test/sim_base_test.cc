#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/testing/loopback.h"
#include "hw/sim/base/base_node.h"

namespace mimesis::hw::sim {
namespace {

using runtime::Time;

TEST(WheeledBase, GoesStraightAndInCirclesAsItIsTold) {
  WheeledBase base({}, {1.0, 2.0}, 0.5 * std::numbers::pi);
  for (int i = 0; i < 500; ++i)
    base.step(0.01,
              {.phase_rate_rad_s = 4.0, .speed_m_s = 0.8, .heading_rad = 0.5 * std::numbers::pi});
  EXPECT_NEAR(base.position_W_m().x(), 1.0, 1e-12);
  EXPECT_NEAR(base.position_W_m().y(), 2.0 + 0.8 * 5.0 - 0.5 * 0.8 * 0.8,
              0.01);  // 0.8 s to speed up
  EXPECT_NEAR(std::remainder(base.phase_rad() - 20.0, 2.0 * std::numbers::pi), 0.0, 1e-9);
  const double heading = base.heading_rad();
  for (int i = 0; i < 300; ++i) base.step(0.01, {.speed_m_s = 0.8, .heading_rad = heading + 1.0});
  EXPECT_NEAR(base.heading_rad(), heading + 1.0, 0.02);
  for (int i = 0; i < 100; ++i) base.stop(0.01);
  EXPECT_EQ(base.speed_m_s(), 0.0);
  EXPECT_EQ(base.phase_rate_rad_s(), 0.0);
}

TEST(WheeledBase, KeepsItsLimits) {
  const BaseLimits limits{.v_max_m_s = 0.5, .turn_max_rad_s = 0.4, .a_max_m_s2 = 0.3};
  WheeledBase base(limits, {0.0, 0.0}, 0.0);
  double speed = 0.0, heading = 0.0;
  for (int i = 0; i < 400; ++i) {
    base.step(0.01, {.speed_m_s = 3.0, .heading_rad = 1.4});
    EXPECT_LE(std::abs(base.speed_m_s() - speed), 0.003 + 1e-12);
    EXPECT_LE(std::abs(base.heading_rad() - heading), 0.004 + 1e-12);
    EXPECT_LE(base.speed_m_s(), 0.5);
    speed = base.speed_m_s(), heading = base.heading_rad();
  }
}

TEST(SimBase, JoinsByNameFollowsItsCommandAndStandsWithoutOne) {
  testing::Loopback bus;
  SimBaseParams params;
  params.bases = {{0.0, 1.0, 0.0}, {0.0, -1.0, 0.0}};
  SimBaseNode node(params, bus);
  v1::CrowdInfo info;
  info.set_scenario("fleet");
  info.add_external_names("walker");
  info.add_external_names(bus.node() + "/1");
  info.add_external_ids(7);
  info.add_external_ids(9);
  bus.send("info", info, Time(0));
  int k = 0;
  const auto go = [&](int steps, bool tell) {
    for (int i = 0; i < steps; ++i) {
      const Time now = std::chrono::milliseconds(20 * ++k);
      v1::CrowdCommand command;
      v1::GaitCommand& gait = *command.add_gaits();
      gait.set_agent(9);
      gait.set_phase_rate_rad_s(4.0);
      gait.set_step_length_m(0.2);
      gait.set_heading_rad(0.0);
      if (tell) bus.send("crowd", command, now);
      node.step(now);
    }
    return bus.take_last<v1::CrowdStates>("states").value();
  };
  const v1::CrowdStates moving = go(200, true);
  ASSERT_EQ(moving.id_size(), 1) << "bases/0 is not in the scenario";
  EXPECT_EQ(moving.id(0), 9u);
  EXPECT_NEAR(moving.velocity_in_world_m_s(0), 0.2 * 4.0 / std::numbers::pi, 1e-6);
  EXPECT_NEAR(moving.phase_rate_rad_s(0), 4.0, 1e-12);
  const v1::CrowdStates standing = go(100, false);
  EXPECT_EQ(standing.velocity_in_world_m_s(0), 0.0F);
  EXPECT_GT(standing.position_in_world_m(0), moving.position_in_world_m(0));
}

}  // namespace
}  // namespace mimesis::hw::sim
