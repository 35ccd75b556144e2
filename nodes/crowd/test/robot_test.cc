// A robot that says where it is.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "nodes/crowd/test/alone.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

TEST(CrowdNode, TheCrowdFollowsARobotAndTheWishBringsItBack) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(40.0);  // it obeys no rule
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(i) - crowd.states.phase_rad(4)), 0.0, 0.01);
  }
}

/// Walks at 0.25 m/s, sways, lands every 0.8 s: the left foot first.
v1::WalkFeedback feedback(double t, v1::WalkState state = v1::WALK_STATE_WALKING) {
  const double share = std::fmod(t / 0.8, 1.0);
  const bool left = std::fmod(t / 1.6, 1.0) < 0.5;
  v1::WalkFeedback f;
  f.set_state(state);
  f.set_swing(left ? v1::FOOT_LEFT : v1::FOOT_RIGHT);
  f.set_to_landing_s(state == v1::WALK_STATE_WALKING ? 0.8 * (1.0 - share) : 0.0);
  f.mutable_position_pelvis_in_world_m()->set_x_m(0.25 * t);
  f.mutable_position_pelvis_in_world_m()->set_y_m(8.0 + 0.03 * std::sin(M_PI * t / 0.8));
  return f;
}

constexpr const char* kEscort = R"(
name: escort
until_s: 1000
beat: {rate_rad_s: 3.927, agent: walker}
groups:
  - name: escort
    count: 3
    gait: walk
    beat_gain_1_s: 1
    rules: {}
externals:
  - {name: walker, group: escort}
)";

struct Escort : Alone {
  Escort() : Alone(kEscort) {}
  double t() const { return std::chrono::duration<double>(now - 10s).count(); }
  void robot_until(double s, v1::WalkState state = v1::WALK_STATE_WALKING) {
    while (now < runtime::from_seconds(s)) {
      bus.send("robots", feedback(t(), state), now, "walker");
      step();
    }
  }
};

TEST(CrowdNode, ARobotTakesPartAndLeadsTheStep) {
  Escort crowd;
  crowd.robot_until(11.0, v1::WALK_STATE_STANDING);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED) << "it stands, and is asked to walk";
  ASSERT_EQ(crowd.command.gaits_size(), 1);
  EXPECT_EQ(crowd.command.gaits(0).node(), "walker");
  EXPECT_GT(crowd.command.gaits(0).step_length_m(), 0.1);
  crowd.robot_until(30.0);
  ASSERT_EQ(crowd.states.id_size(), 4);
  const int row = 3;
  // The left foot swings from the landing of the right one, π, on.
  const double phase = M_PI + M_PI * crowd.t() / 0.8;
  EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(row) - phase), 0.0, 0.1);
  EXPECT_NEAR(crowd.states.position_in_world_m(2 * row + 1), 8.0, 0.005) << "without its sway";
  EXPECT_NEAR(crowd.states.position_in_world_m(2 * row), 0.25 * crowd.t(), 0.02);
  const double lag = 5.7 - 3.927;  // difference of the others' own rhythm, over a gain of 1 1/s
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(i) - crowd.states.phase_rad(row)), lag, 0.05);
  }
}

TEST(CrowdNode, ARobotThatDiesOrStopsIsNotTrustedAndItsRhythmGoesOn) {
  Escort crowd;
  crowd.robot_until(20.0);
  const double before = crowd.states.phase_rad(0);
  crowd.until(20.5);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_LAGGING);
  EXPECT_EQ(crowd.command.gaits_size(), 0);
  crowd.until(23.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(0) - before - 3.0 * 3.927), 0.0, 0.15);
  crowd.robot_until(25.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED) << "started again";
  crowd.robot_until(25.2, v1::WALK_STATE_SAFE);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.status.externals(0).reason(), "it left");
}

TEST(CrowdNode, BadFeedbackOfARobotIsIgnored) {
  Escort crowd;
  for (const double x : {1e9, -1e9}) {
    v1::WalkFeedback f = feedback(0.0);
    f.mutable_position_pelvis_in_world_m()->set_x_m(x);
    crowd.bus.send("robots", f, crowd.now, "walker");
    crowd.step();
  }
  v1::WalkFeedback f = feedback(0.0);
  f.set_to_landing_s(-1.0);
  crowd.bus.send("robots", f, crowd.now, "walker");
  crowd.step();
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  while (crowd.now < 11s) {  // of a robot that the scenario does not name
    crowd.bus.send("robots", feedback(crowd.t()), crowd.now, "walker2");
    crowd.step();
  }
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
}

}  // namespace
}  // namespace mimesis::crowd
