// Messages that the node must refuse, from any sender.
#include "nodes/crowd/crowd_messages.h"

#include <gtest/gtest.h>

#include <functional>

#include "nodes/crowd/scenario_file/scenario_file.h"
#include "nodes/crowd/test/scenario_file.h"

namespace mimesis::crowd {
namespace {

constexpr const char* kWalk = R"(
name: walk
groups:
  - name: round
    count: 3
    gait: walk
    start: {arrangement: row}
    goals: {aim: route, position_m: [4, 0, 4, 4, 0, 4], loop: true, reached_m: 1}
  - name: free
    count: 2
    gait: walk
externals:
  - {name: robot, group: free}
)";

class Messages : public ::testing::Test {
 protected:
  Messages() { to_proto(run_, states_); }
  std::string spoiled(const std::function<void(v1::CrowdStates&)>& spoil) const {
    v1::CrowdStates message = states_;
    spoil(message);
    return fault(message, run_.scenario());
  }

  testing::ScenarioFile file_{kWalk};
  ScenarioRun run_{read_scenario(file_.path())};
  v1::CrowdStates states_;
};

TEST_F(Messages, OfOurOwnAreRight) {
  EXPECT_EQ(fault(states_, run_.scenario()), "");
  for (int k = 0; k < 200; ++k) run_.step();
  to_proto(run_, states_);
  EXPECT_EQ(fault(states_, run_.scenario()), "");
}

TEST_F(Messages, EveryNumberOfAWalkerIsLookedAt) {
  const std::string why = "a place, speed, angle or rate that no walker has";
  EXPECT_EQ(spoiled([](auto& s) { s.set_position_in_world_m(1, 1.1e6); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.set_velocity_in_world_m_s(1, -1.1e3F); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.set_heading_rad(0, 1.1e9); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.set_phase_rad(4, -1.1e9); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.set_phase_rate_rad_s(4, 1.1e3); }), why);
}

TEST_F(Messages, ListsOfOtherLengthsAndUnknownGroupsAreRefused) {
  const std::string why = "5 agents, but lists of other lengths";
  EXPECT_EQ(spoiled([](auto& s) { s.add_heading_rad(0.0); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.mutable_phase_rad()->RemoveLast(); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.add_position_in_world_m(0.0); }), why);
  EXPECT_EQ(spoiled([](auto& s) { s.set_group(0, 2); }), "group 2: there are 2");
}

}  // namespace
}  // namespace mimesis::crowd
