// Messages that a coordinator must refuse, from any sender.
#include "nodes/crowd/crowd_messages.h"

#include <gtest/gtest.h>

#include <cmath>
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
  Messages() {
    to_proto(run_, states_);
    traveller_.set_from(2);
    traveller_.set_to(1);
    to_proto(Traveller{.agent = *run_.crowd().find(1), .group = 0}, *traveller_.add_agents());
  }
  std::string told(const std::function<void(v1::CrowdTraveller&)>& spoil) const {
    v1::CrowdHandover message = traveller_;
    spoil(*message.mutable_agents(0));
    return fault(message, run_, 2);
  }
  std::string summed(const std::function<void(v1::CrowdSums&)>& spoil) const {
    v1::CrowdStates message = states_;
    spoil(*message.mutable_sums(0));
    return fault(message, run_.scenario());
  }

  testing::ScenarioFile file_{kWalk};
  ScenarioRun run_{read_scenario(file_.path())};
  v1::CrowdStates states_;
  v1::CrowdHandover traveller_;
};

TEST_F(Messages, OfOurOwnAreRight) {
  EXPECT_EQ(fault(states_, run_.scenario()), "");
  EXPECT_EQ(fault(traveller_, run_, 2), "");
  for (int k = 0; k < 200; ++k) run_.step();
  to_proto(run_, states_);
  EXPECT_EQ(fault(states_, run_.scenario()), "");
  *traveller_.mutable_agents(0) = {};
  to_proto(*run_.release(2), *traveller_.mutable_agents(0));
  EXPECT_EQ(fault(traveller_, run_, 2), "");
}

TEST_F(Messages, ALegThatTheRouteHasNotIsRefused) {
  const std::string why = "agent 1: a state that no walker has";
  EXPECT_EQ(told([](v1::CrowdTraveller& t) { t.set_leg(2); }), "");
  EXPECT_EQ(told([](v1::CrowdTraveller& t) { t.set_leg(3); }), why);
  EXPECT_EQ(told([](v1::CrowdTraveller& t) { t.set_leg(4'000'000'000U); }), why);
  EXPECT_EQ(told([](v1::CrowdTraveller& t) {
              t.set_group(1);  // has no route: the leg means nothing
              t.set_leg(7);
            }),
            "");
}

TEST_F(Messages, EveryNumberOfATravellerIsLookedAt) {
  using Set = void (v1::CrowdTraveller::*)(double);
  const auto refused = [&](Set set, double value) {
    EXPECT_EQ(told([&](v1::CrowdTraveller& t) { (t.*set)(value); }),
              "agent 1: a state that no walker has")
        << value;
  };
  for (const Set set : {&v1::CrowdTraveller::set_x_m, &v1::CrowdTraveller::set_y_m,
                        &v1::CrowdTraveller::set_goal_x_m, &v1::CrowdTraveller::set_goal_y_m,
                        &v1::CrowdTraveller::set_place_m, &v1::CrowdTraveller::set_lane_m}) {
    refused(set, -1.1e6);
  }
  for (const Set set :
       {&v1::CrowdTraveller::set_velocity_x_m_s, &v1::CrowdTraveller::set_velocity_y_m_s,
        &v1::CrowdTraveller::set_phase_rate_rad_s, &v1::CrowdTraveller::set_heading_rate_rad_s,
        &v1::CrowdTraveller::set_omega_rad_s, &v1::CrowdTraveller::set_stride}) {
    refused(set, 1.1e3);
  }
  for (const Set set : {&v1::CrowdTraveller::set_heading_rad, &v1::CrowdTraveller::set_phase_rad,
                        &v1::CrowdTraveller::set_smoothed_error_m}) {
    refused(set, -1.1e9);
  }
  refused(&v1::CrowdTraveller::set_length, -1.1);
  refused(&v1::CrowdTraveller::set_radius_m, 101.0);
  refused(&v1::CrowdTraveller::set_radius_m, -0.1);
  refused(&v1::CrowdTraveller::set_omega_rad_s, -0.1);
  refused(&v1::CrowdTraveller::set_stride, 0.0);
}

TEST_F(Messages, OnlyWhoIsMovedByCoordinatorsTravels) {
  const auto external = run_.roster().external_id(0);
  EXPECT_EQ(told([&](v1::CrowdTraveller& t) { t.set_id(external); }),
            "agent 6 of group 0: unknown");
  EXPECT_EQ(told([](v1::CrowdTraveller& t) { t.set_id(7); }), "agent 7 of group 0: unknown");
  EXPECT_EQ(told([](v1::CrowdTraveller& t) { t.set_group(2); }), "agent 1 of group 2: unknown");
}

/// Σ cos φ of n agents is n at most: more would move all phases, or be no number.
TEST_F(Messages, SumsThatNobodyCanAddUpToAreRefused) {
  const std::string why = "sums of group 0: what 3 agents cannot add up to";
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_cos_phase(-3.0); }), "");
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_cos_phase(3.1); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_sin_phase(-1e300); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_cos_heading(3.1); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_sin_heading(-3.1); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_error_m(7e6); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_phase_rate_rad_s(-7e3); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_speed_m_s(7e3); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_leader_phase_rad(2e9); }), why);
  EXPECT_EQ(summed([](v1::CrowdSums& s) { s.set_agents(7); }),
            "sums of group 0: what 7 agents cannot add up to");
}

}  // namespace
}  // namespace mimesis::crowd
