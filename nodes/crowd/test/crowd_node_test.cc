// One coordinator between messages.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "nodes/crowd/test/coordinators.h"
#include "nodes/crowd/test/scenario_file.h"

namespace mimesis::crowd {
namespace {

using namespace testing;
using namespace std::chrono_literals;
using mimesis::testing::Loopback;

constexpr const char* kGuests = R"(
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
constexpr std::uint64_t kRobot = 5, kFigure = 6;

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

TEST(CrowdNode, SaysWhoIsWho) {
  Alone crowd(kGuests);
  crowd.step();
  const auto info = crowd.bus.take<v1::CrowdInfo>("info");
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->scenario(), "guests");
  EXPECT_EQ(info->agents(), 4u);
  ASSERT_EQ(info->external_ids_size(), 2);
  EXPECT_EQ(info->external_ids(0), kRobot);
  EXPECT_EQ(info->external_names(1), "figure");
  EXPECT_EQ(info->gaits(1), "brisk");
}

TEST(CrowdNode, PublishesAllStatesEveryStep) {
  Alone crowd(kFormation);
  crowd.until(11.0);
  EXPECT_EQ(crowd.states.id_size(), 16);
  EXPECT_EQ(crowd.states.coordinator(), 1u);
  EXPECT_EQ(crowd.states.position_in_world_m_size(), 32);
  ASSERT_EQ(crowd.states.sums_size(), 1);
  EXPECT_EQ(crowd.states.sums(0).agents(), 16u);
  double rates = 0.0, speed = 0.0;
  for (int i = 0; i < 16; ++i) {
    rates += crowd.states.phase_rate_rad_s(i);
    speed += static_cast<double>(crowd.states.velocity_in_world_m_s(2 * i));
  }
  EXPECT_NEAR(crowd.states.sums(0).phase_rate_rad_s(), rates, 1e-9);
  EXPECT_NEAR(crowd.states.sums(0).speed_m_s(), speed, 1e-6);
}

TEST(CrowdNode, CertifiesOnceASecond) {
  Alone crowd(kFormation);
  crowd.until(13.0);
  ASSERT_EQ(crowd.certificate.guarantees_size(), 3);
  EXPECT_EQ(crowd.certificate.number(), 1u);
  EXPECT_EQ(crowd.certificate.voided(), "");
  for (const v1::CrowdGuarantee& g : crowd.certificate.guarantees()) {
    EXPECT_EQ(g.agents(), 16u);
    EXPECT_FALSE(g.why().empty());
    if (g.rule() == v1::CROWD_RULE_PHASE) {
      EXPECT_TRUE(g.guaranteed());
      EXPECT_NEAR(g.expected_rate_1_s(), 16 * 0.06, 1e-9);
    }
  }
  crowd.until(30.0);
  for (const v1::CrowdGuarantee& g : crowd.certificate.guarantees()) {
    if (g.rule() == v1::CROWD_RULE_PHASE) {
      EXPECT_NEAR(g.measured_rate_1_s(), 0.96, 0.02);
    }
  }
}

TEST(CrowdNode, TellsOnceHowTheRunEnded) {
  Alone crowd(kFormation, 50.0);
  crowd.until(61.0);
  const auto outcome = crowd.bus.take<v1::CrowdOutcome>("outcome");
  ASSERT_TRUE(outcome.has_value());
  EXPECT_TRUE(outcome->success()) << outcome->reason();
  EXPECT_EQ(outcome->agents(), 16u);
  EXPECT_GT(outcome->formation_s(), 1.0);
  EXPECT_LT(outcome->formation_s(), 50.0);
  EXPECT_LT(outcome->place_error_m(), 0.01);
  EXPECT_GT(outcome->measured_rate_1_s(), 0.9 * outcome->guaranteed_rate_1_s());
  EXPECT_GT(outcome->least_distance_m(), 0.3);
  EXPECT_FALSE(crowd.bus.take<v1::CrowdOutcome>("outcome").has_value());
}

TEST(CrowdNode, ARunThatIsTooShortIsAFailureWithAReason) {
  Alone crowd(kFormation, 2.0);
  crowd.until(13.0);
  const auto outcome = crowd.bus.take<v1::CrowdOutcome>("outcome");
  ASSERT_TRUE(outcome.has_value());
  EXPECT_FALSE(outcome->success());
  EXPECT_NE(outcome->reason().find("not in order: square: phases"), std::string::npos)
      << outcome->reason();
}

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

TEST(CrowdNode, TheCrowdFollowsARobotAndTheWishBringsItBack) {
  Alone crowd(kGuests);
  crowd.walk_with_robot(40.0);  // it obeys nobody
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(math::wrap_pi(crowd.states.phase_rad(i) - crowd.states.phase_rad(4)), 0.0, 0.01);
  }
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

TEST(CrowdNode, CharactersOfTheSynthesizerTakePart) {
  Alone crowd(kGuests);
  const auto send = [&] {
    const double t = std::chrono::duration<double>(crowd.now - 10s).count();
    v1::MotionBatch batch;
    for (const float y : {7.0F, 9.0F}) {
      batch.add_phase_rad(static_cast<float>(math::wrap_two_pi(5.0 * t)));
      batch.add_position_pelvis_in_world_m(static_cast<float>(1.1 * t));
      batch.add_position_pelvis_in_world_m(y);
      batch.add_position_pelvis_in_world_m(0.9F);
      batch.add_heading_rad(0.0F);
    }
    crowd.bus.send("characters", batch, crowd.now);
  };
  double way_m = 0.0, from_m = 0.0;
  while (crowd.now < 14s) {
    send();
    crowd.step();
    if (crowd.now == 12s) from_m = crowd.states.position_in_world_m(10);
    if (crowd.now > 12s)
      way_m += 0.02 * static_cast<double>(crowd.states.velocity_in_world_m_s(10));
  }
  EXPECT_EQ(crowd.trust(0), v1::CROWD_TRUST_TRUSTED);
  EXPECT_EQ(crowd.trust(1), v1::CROWD_TRUST_TRUSTED);
  ASSERT_EQ(crowd.states.id_size(), 6);
  EXPECT_NEAR(crowd.states.phase_rate_rad_s(5), 5.0, 0.01) << "from two messages";
  EXPECT_NEAR(way_m, 2.2, 0.05) << "it hurries with its steps as the gait of its group does";
  EXPECT_NEAR(crowd.states.position_in_world_m(10) - from_m, 2.2, 0.03);
  EXPECT_EQ(crowd.command.gaits_size(), 2);
  const auto wish = crowd.bus.take<v1::StyleWish>("wish");
  ASSERT_TRUE(wish.has_value());
  EXPECT_EQ(wish->shares(0).style(), "walk") << "as their group walks";
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

TEST(CrowdNode, PaintsTheScene) {
  Alone crowd(kFormation);
  crowd.until(11.0);
  int pictures = 0;
  foxglove::SceneUpdate last;
  while (const auto picture = crowd.bus.take<foxglove::SceneUpdate>("scene")) {
    ++pictures;
    last = *picture;
  }
  EXPECT_NEAR(pictures, 10, 1);
  ASSERT_EQ(last.entities_size(), 2);
  EXPECT_EQ(last.entities(1).id(), "group/square");
  EXPECT_EQ(last.entities(1).lines(0).points_size(), 32);
}

TEST(CrowdNode, RefusesRegionsThatDoNotFit) {
  const ScenarioFile file(kFormation);
  CrowdParams params = file.params();
  Loopback bus;
  params.regions.own = 2;
  EXPECT_THROW(CrowdNode(params, bus), ConfigError);
  params = file.params();
  params.set = {"groups.0.rules.phase.gain_1_s=-1"};
  try {
    CrowdNode node(params, bus);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("phase.gain_1_s"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace mimesis::crowd
