// Agents that other processes move.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/math/circle.h"
#include "nodes/crowd/test/alone.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

TEST(CrowdNode, AnExternalAgentTakesPart) {
  Alone crowd(kGuests);
  crowd.until(11.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.states.id_size(), 4);
  crowd.walk_with_robot(12.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED);
  EXPECT_EQ(crowd.states.id_size(), 5);
  EXPECT_EQ(crowd.voided, "group square: 5 agents instead of 4: 'robot' it came");
  EXPECT_EQ(crowd.certificate.guarantees(0).agents(), 5u);
  EXPECT_NEAR(crowd.certificate.guarantees(0).expected_rate_1_s(), 5 * 0.2, 1e-9);
  // It is where it says, and is asked to walk as the rules want.
  const int row = 4;
  ASSERT_EQ(crowd.states.id(row), kRobot);
  const double t = std::chrono::duration<double>(crowd.now - 10s).count();
  EXPECT_NEAR(crowd.states.position_in_world_m(2 * row), 1.2 * t, 0.03);
  ASSERT_EQ(crowd.command.gaits_size(), 1);
  EXPECT_EQ(crowd.command.gaits(0).character(), 0u);
  EXPECT_GT(crowd.command.gaits(0).phase_rate_rad_s(), 3.0);
  EXPECT_NEAR(crowd.command.gaits(0).step_length_m(), M_PI * 0.22, 1e-6);
}

TEST(CrowdNode, WhoDiesIsMissedAtOnceAndTheCrowdGoesOn) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(14.0);
  crowd.voided.clear();
  crowd.until(14.6);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_LAGGING);
  EXPECT_NE(crowd.status.externals(0).reason().find("s old, at most 0.3 are trusted"),
            std::string::npos);
  EXPECT_NE(crowd.voided.find("4 agents instead of 5: 'robot' its last state is"),
            std::string::npos)
      << crowd.voided;
  EXPECT_EQ(crowd.command.gaits_size(), 0);
  EXPECT_EQ(crowd.states.id_size(), 5) << "still an obstacle";
  crowd.until(17.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.states.id_size(), 4);
  crowd.until(40.0);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(i) - crowd.states.phase_rad(0)), 0.0, 1e-3);
  }
  EXPECT_EQ(crowd.certificate.guarantees(0).agents(), 4u);
}

TEST(CrowdNode, ALateStateIsNotTrusted) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(14.0);
  crowd.walk_with_robot(15.0, 0.5);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_LAGGING);
  EXPECT_EQ(crowd.certificate.guarantees(0).agents(), 4u);
  crowd.walk_with_robot(17.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED);
  EXPECT_EQ(crowd.certificate.guarantees(0).agents(), 5u);
}

TEST(CrowdNode, WhoLeavesIsGone) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(12.0);
  v1::CrowdStates bye;
  bye.add_leaving(kRobot);
  crowd.bus.send("agents", bye, crowd.now);
  crowd.step();
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.status.externals(0).reason(), "it left");
  EXPECT_EQ(crowd.states.id_size(), 4);
}

TEST(CrowdNode, BadMessagesAreRefused) {
  Alone crowd(kGuests);
  crowd.step();
  v1::CrowdStates s;
  s.add_id(kRobot);
  s.add_heading_rad(0.0);
  crowd.bus.send("agents", s, crowd.now);  // no position
  crowd.bus.send_raw("agents", "\x12garbage", crowd.now);
  crowd.robot(0.0, 1e9);
  crowd.step();
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.states.id_size(), 4);
  crowd.walk_with_robot(11.0);
  v1::CrowdStates nan;
  nan.add_id(kRobot);
  nan.add_position_in_world_m(NAN);
  crowd.bus.send("agents", nan, crowd.now);
  crowd.walk_with_robot(12.0);
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED);
}

/// Agents 6 and 7, after the robot.
const std::string kFigures = square_with_robot("figures", "0.3", "",
                                               R"(  - {name: left/1, group: square}
  - {name: right, group: square}
)");

/// Characters of a synthesizer, one beside the other, that walk on.
void send_figures(Alone& crowd, const char* node, const std::vector<float>& y_m, Time before = 0s,
                  Time late = 0s) {
  const double t = std::chrono::duration<double>(crowd.now - before - 10s).count();
  v1::MotionBatch batch;
  for (const float y : y_m) {
    batch.add_phase_rad(static_cast<float>(math::wrap_two_pi(5.0 * t)));
    batch.add_position_pelvis_in_world_m(static_cast<float>(1.1 * t));
    batch.add_position_pelvis_in_world_m(y);
    batch.add_position_pelvis_in_world_m(0.9F);
    batch.add_heading_rad(0.0F);
  }
  crowd.bus.send("characters", batch, crowd.now - before + late, node);
}

/// By the names of their nodes: of `left` the second one, of `right` the first.
TEST(CrowdNode, CharactersOfTwoSynthesizersTakePart) {
  Alone crowd(kFigures);
  double way_m = 0.0, from_m = 0.0;
  while (crowd.now < 14s) {
    send_figures(crowd, "left", {6.0F, 7.0F});
    send_figures(crowd, "right", {9.0F});
    crowd.step();
    if (crowd.now == 12s) from_m = crowd.states.position_in_world_m(10);
    if (crowd.now > 12s)
      way_m += 0.02 * static_cast<double>(crowd.states.velocity_in_world_m_s(10));
  }
  EXPECT_EQ(crowd.trust(0), v1::CROWD_TRUST_ABSENT);
  EXPECT_EQ(crowd.trust(1), v1::CROWD_TRUST_TRUSTED);
  EXPECT_EQ(crowd.trust(2), v1::CROWD_TRUST_TRUSTED);
  ASSERT_EQ(crowd.states.id_size(), 6);
  EXPECT_NEAR(crowd.states.phase_rate_rad_s(5), 5.0, 0.01) << "from two messages";
  EXPECT_NEAR(way_m, 2.2, 0.05) << "it hurries with its steps as the gait of its group does";
  EXPECT_NEAR(crowd.states.position_in_world_m(10) - from_m, 2.2, 0.03);
  EXPECT_NEAR(crowd.states.position_in_world_m(9), 7.0, 0.01);
  EXPECT_NEAR(crowd.states.position_in_world_m(11), 9.0, 0.01);
  ASSERT_EQ(crowd.command.gaits_size(), 2);
  const std::array<std::pair<const char*, unsigned>, 2> who = {{{"left", 1}, {"right", 0}}};
  for (int i = 0; i < 2; ++i) {
    const auto& [node, character] = who.at(static_cast<std::size_t>(i));
    EXPECT_EQ(crowd.command.gaits(i).node(), node);
    EXPECT_EQ(crowd.command.gaits(i).character(), character);
    EXPECT_EQ(crowd.command.gaits(i).agent(), crowd.states.id(4 + i));
    const auto wish = crowd.bus.take<v1::StyleWish>("wish");
    ASSERT_TRUE(wish.has_value());
    EXPECT_EQ(wish->node(), node);
    EXPECT_EQ(wish->characters(0), character);
    EXPECT_EQ(wish->shares(0).style(), "walk") << "as their group walks";
  }
}

/// A busy machine steps late, and then again when the next step is due: the stamps of two states
/// lie closer than the steps between them. (1.1 m/s looked like 11: "no walker's".)
TEST(CrowdNode, AFigureOnABusyMachineIsBelieved) {
  Alone crowd(kFigures);
  while (crowd.now < 12s) {
    for (const Time late : {4500us, 0us}) {
      send_figures(crowd, "right", {9.0F}, late == 0us ? 5ms : 10ms, late);
    }
    crowd.step();
  }
  EXPECT_EQ(crowd.voided, "group square: 5 agents instead of 4: 'right' it came");
  EXPECT_NEAR(crowd.states.phase_rate_rad_s(4), 5.0, 0.5);
}

/// Anybody may publish characters; those that no agent is named after are not looked at.
TEST(CrowdNode, CharactersThatNobodyNamedCostNothing) {
  Alone crowd(kFigures);
  const std::vector<float> many(100'000, 3.0F);
  for (int i = 0; i < 20; ++i) {
    send_figures(crowd, "stranger", many);
    send_figures(crowd, "left/1", {3.0F});  // the agent's name is not the node's
    send_figures(crowd, "right", {9.0F});
    crowd.step();
  }
  EXPECT_EQ(crowd.trust(1), v1::CROWD_TRUST_TRUSTED);  // a node may be called so
  EXPECT_EQ(crowd.trust(2), v1::CROWD_TRUST_TRUSTED);
  EXPECT_EQ(crowd.states.id_size(), 6);
}

/// Two programs that move one agent: the first one's word counts until it has been forgotten.
TEST(CrowdNode, WhoMovesAnAgentIsOneNode) {
  Alone crowd(kGuests);
  const auto says = [&](const char* node, double x_m) {
    const double t = std::chrono::duration<double>(crowd.now - 10s).count();
    crowd.bus.send("agents", robot_beside(t, 1.0, x_m), crowd.now, node);
  };
  while (crowd.now < 14s) {
    says("cart", 0.0);
    if (crowd.now > 12s) says("other", 0.2);
    crowd.step();
  }
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED);
  EXPECT_NEAR(crowd.states.position_in_world_m(8), 1.2 * 4.0, 0.03);
  EXPECT_EQ(crowd.status.externals(0).node(), "cart");
  EXPECT_EQ(crowd.status.externals(0).reason(),
            "moved by node 'cart'; what 'other' says of it is ignored");
  v1::CrowdStates bye;
  bye.add_leaving(kRobot);
  crowd.bus.send("agents", bye, crowd.now, "other");  // it is not its
  crowd.step();
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED);
  while (crowd.now < 20s) {
    says("other", 0.2);
    crowd.step();
  }
  EXPECT_EQ(crowd.trust(), v1::CROWD_TRUST_TRUSTED) << "'cart' has been silent: forgotten";
  EXPECT_EQ(crowd.status.externals(0).node(), "other");
  EXPECT_NEAR(crowd.states.position_in_world_m(8), 0.2 + 1.2 * 10.0, 0.03);
  EXPECT_EQ(crowd.status.externals(0).reason(), "");
}

TEST(CrowdNode, AWishedStyleMovesAnAgentToAGroupThatWalksSo) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(12.0);
  while (crowd.bus.take<v1::StyleWish>("wish")) {
  }
  v1::StyleWish wish;
  wish.add_characters(static_cast<std::uint32_t>(kRobot));
  wish.add_shares()->set_style("brisk");
  wish.mutable_shares(0)->set_share(1.0);
  crowd.bus.send("style", wish, crowd.now);
  crowd.robot();
  crowd.step();
  const int row = 4;
  EXPECT_EQ(crowd.states.id(row), kRobot);
  EXPECT_EQ(crowd.states.group(row), 1u);
  const auto told = crowd.bus.take<v1::StyleWish>("wish");
  ASSERT_TRUE(told.has_value());
  EXPECT_EQ(told->shares(0).style(), "brisk");
  EXPECT_EQ(told->characters(0), 0u);
}

constexpr const char* kColumn = R"(
name: column
until_s: 1000
groups:
  - name: column
    count: 3
    gait: walk
    start: {arrangement: line, spacing_m: 1.5, phase: equal}
    formation: {shape: line, spacing_m: 1.5}
    rules:
      length: {graph: all_to_all, gain_1_m: 0.08, limit: 0.15}
      phase: {graph: all_to_all, gain_1_s: 0.3}
      heading: {kind: lane, gain: 0.25}
externals:
  - {name: synthesizer, group: column, place_m: -4.5, lane_m: 0}
)";

/// A body whose steps are 6 % longer than asked, whose pelvis looks 3 degrees aside, and which
/// turns 2 degrees less than asked.
TEST(CrowdNode, ABodyThatDoesNotQuiteObeyTakesItsPlace) {
  Alone crowd(kColumn);
  double x = -4.8, y = 0.3, way = 0.0, phase = 1.0;
  v1::CrowdStates same_time;
  const SpeedFunction gait(0.22, std::array{-0.006, 0.023}, std::array{0.0, 0.022});
  while (crowd.now < 70s) {
    double rate = 5.7, step_m = 0.69, heading = 0.0;
    if (crowd.command.gaits_size() == 1) {
      const v1::GaitCommand& asked = crowd.command.gaits(0);
      rate = asked.phase_rate_rad_s();
      step_m = 1.06 * asked.step_length_m();
      heading = asked.heading_rad();
    }
    const double by = 0.02 * rate;
    const double go =
        step_m / (0.5 * gait.cycle_m()) * (gait.integral(phase + by) - gait.integral(phase));
    x += go * std::cos(way);
    y += go * std::sin(way);
    phase += by;
    const double pelvis = way - 0.05;
    way += 0.02 * 1.5 * (heading - 0.035 - pelvis);
    v1::MotionBatch batch;
    batch.add_phase_rad(static_cast<float>(math::wrap_two_pi(phase)));
    batch.add_position_pelvis_in_world_m(static_cast<float>(x));
    batch.add_position_pelvis_in_world_m(
        static_cast<float>(y + 0.03 * std::sin(phase) * std::cos(way)));
    batch.add_position_pelvis_in_world_m(0.9F);
    batch.add_heading_rad(static_cast<float>(pelvis + 0.1 * std::cos(phase)));
    crowd.bus.send("characters", batch, crowd.now, "synthesizer");
    same_time = crowd.states;
    crowd.step();
  }
  ASSERT_EQ(same_time.id_size(), 4);
  const double last = same_time.position_in_world_m(4);
  EXPECT_NEAR(x - last, -1.5, 0.01);
  EXPECT_NEAR(y, 0.0, 0.01);
  EXPECT_NEAR(way, 0.0, 0.01);
  EXPECT_NEAR(math::wrap_pi(phase - same_time.phase_rad(0)), 0.0, 0.01);
}

}  // namespace
}  // namespace mimesis::crowd
