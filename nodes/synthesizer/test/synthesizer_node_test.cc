#include "nodes/synthesizer/synthesizer_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/loopback.h"
#include "common/testing/refusal.h"
#include "nodes/synthesizer/test/models.h"

namespace mimesis::synthesizer {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
using testing::ModelFile;

const ModelFile& file() {
  static const ModelFile three(testing::three_styles());
  return three;
}

SynthesizerParams params(int characters = 1, double rate_hz = 200.0) {
  SynthesizerParams p;
  p.model = file().path();
  p.characters = characters;
  p.rate_hz = rate_hz;
  return p;
}

double stamp_s(const v1::Motion& m) { return static_cast<double>(m.header().stamp_ns()) * 1e-9; }

/// One node on a loopback bus.
class Rig {
 public:
  explicit Rig(const SynthesizerParams& p = params())
      : period_(runtime::from_seconds(1.0 / p.rate_hz)), node_(p, bus) {}

  void run(Time duration) {
    for (const Time end = now_ + duration; now_ < end; now_ += period_) {
      if (before_step) before_step(now_);
      node_.step(now_);
      while (auto m = bus.take<v1::Motion>("motion")) motion = *m;
      while (auto b = bus.take<v1::MotionBatch>("characters")) batch = *b;
      while (auto s = bus.take<v1::MotionStatus>("status")) statuses.push_back(*s);
    }
  }
  void go(double x, double y, std::uint32_t character = 0,
          v1::MotionGoalKind kind = v1::MOTION_GOAL_KIND_WALK_TO) {
    v1::MotionGoal goal;
    goal.set_character(character);
    goal.set_kind(kind);
    goal.mutable_position_in_world_m()->set_x_m(x);
    goal.mutable_position_in_world_m()->set_y_m(y);
    bus.send("goal", goal, now_);
  }
  void wish(const std::string& style, double duration_s = 0.0) {
    v1::StyleWish w;
    v1::StyleShare* share = w.add_shares();
    share->set_style(style);
    share->set_share(1.0);
    w.set_duration_s(duration_s);
    bus.send("style", w, now_);
  }
  /// The reason of the newest status that has one.
  std::string last_reason() const {
    for (auto s = statuses.rbegin(); s != statuses.rend(); ++s) {
      if (!s->reason().empty()) return s->reason();
    }
    return {};
  }
  double x() const { return motion.position_pelvis_in_world_m().x_m(); }
  double y() const { return motion.position_pelvis_in_world_m().y_m(); }
  Time now() const { return now_; }

  mimesis::testing::Loopback bus;
  std::function<void(Time)> before_step;
  v1::Motion motion;
  v1::MotionBatch batch;
  std::vector<v1::MotionStatus> statuses;

 private:
  Time period_;
  SynthesizerNode node_;
  Time now_ = 1s;
};

TEST(SynthesizerNode, SaysWhatItsNumbersMean) {
  Rig rig;
  rig.run(50ms);
  const auto rows = rig.bus.take<v1::MotionRows>("rows");
  ASSERT_TRUE(rows.has_value());
  EXPECT_EQ(rows->model(), "three");
  ASSERT_EQ(rows->rows_size(), 51);
  EXPECT_EQ(rows->rows(3), "lhip.x");
  ASSERT_EQ(rows->styles_size(), 3);
  EXPECT_EQ(rows->styles(1), "slow");
  EXPECT_EQ(rows->characters(), 1U);
  EXPECT_FALSE(rig.bus.take<v1::MotionRows>("rows").has_value());  // once: it is latched
  EXPECT_EQ(rig.motion.position_rad_size(), 51);
  EXPECT_EQ(rig.motion.velocity_rad_s_size(), 51);
  EXPECT_EQ(rig.motion.action(), "stand");
  EXPECT_EQ(rig.motion.style(), "walk");
  EXPECT_EQ(rig.motion.header().stamp_ns(), static_cast<std::uint64_t>((rig.now() - 5ms).count()));
}

TEST(SynthesizerNode, WalksToAGoalAndStands) {
  Rig rig;
  rig.run(200ms);
  rig.go(3.0, 2.0);
  rig.run(1s);
  EXPECT_EQ(rig.motion.action(), "walk");
  ASSERT_FALSE(rig.statuses.empty());
  EXPECT_EQ(rig.statuses.front().kind(), v1::MOTION_GOAL_KIND_WALK_TO);
  EXPECT_FALSE(rig.statuses.front().reached());
  rig.run(8s);
  EXPECT_NEAR(rig.x(), 3.0, 0.15);
  EXPECT_NEAR(rig.y(), 2.0, 0.15);
  EXPECT_EQ(rig.motion.action(), "stand");
  EXPECT_TRUE(rig.statuses.back().reached());
  EXPECT_LT(rig.statuses.back().goal_distance_m(), 0.15);
  EXPECT_LT(rig.statuses.size(), 14U);  // changes, and once a second
  const auto reached = rig.bus.take<v1::MotionStatus>("reached");
  ASSERT_TRUE(reached.has_value());
  EXPECT_EQ(reached->kind(), v1::MOTION_GOAL_KIND_WALK_TO);
  EXPECT_FALSE(rig.bus.take<v1::MotionStatus>("reached").has_value());  // once
  EXPECT_GT(rig.statuses.size(), 8U);
}

TEST(SynthesizerNode, VelocitiesAreTheRatesOfThePositions) {
  Rig rig;
  rig.go(0.0, 4.0);
  rig.run(2s);
  for (int k = 0; k < 100; ++k) {
    const v1::Motion before = rig.motion;
    rig.run(5ms);
    const v1::Motion& now = rig.motion;
    for (int r = 0; r < 51; ++r) {
      ASSERT_NEAR(now.velocity_rad_s(r), (now.position_rad(r) - before.position_rad(r)) * 200.0,
                  1e-9);
    }
    const double dx = rig.x() - before.position_pelvis_in_world_m().x_m();
    const double dy = rig.y() - before.position_pelvis_in_world_m().y_m();
    const double c = std::cos(now.heading_rad()), s = std::sin(now.heading_rad());
    ASSERT_NEAR(now.velocity_forward_m_s(), (c * dx + s * dy) * 200.0, 1e-9);
    ASSERT_NEAR(now.velocity_left_m_s(), (c * dy - s * dx) * 200.0, 1e-9);
    ASSERT_NEAR(now.yaw_rate_rad_s(),
                math::wrap_pi(now.heading_rad() - before.heading_rad()) * 200.0, 1e-9);
  }
}

TEST(SynthesizerNode, TheSmoothVelocityIsTheMovedOneALittleLater) {
  Rig rig;
  rig.go(20.0, 0.0);
  rig.run(3s);
  double moved = 0.0, smooth = 0.0, jump = 0.0, smooth_jump = 0.0;
  v1::Motion before = rig.motion;
  for (int k = 0; k < 800; ++k) {
    rig.run(5ms);
    moved += rig.motion.velocity_forward_m_s() / 800.0;
    smooth += rig.motion.smooth_velocity_forward_m_s() / 800.0;
    jump =
        std::max(jump, std::abs(rig.motion.velocity_forward_m_s() - before.velocity_forward_m_s()));
    smooth_jump = std::max(smooth_jump, std::abs(rig.motion.smooth_velocity_forward_m_s() -
                                                 before.smooth_velocity_forward_m_s()));
    before = rig.motion;
  }
  EXPECT_GT(moved, 0.3);
  EXPECT_NEAR(smooth, moved, 0.02);
  EXPECT_LT(jump, 0.01);  // m/s from step to step: 2 m/s2
  EXPECT_LT(smooth_jump, 0.01);
}

/// A walk whose left knee may bend half as far as it wants to.
TEST(SynthesizerNode, StaysWithinTheModelsLimits) {
  motion::MotionModel model = motion::load_motion_model(file().path());
  const auto knee = static_cast<int>(std::ranges::find(model.rows, "lknee.y") - model.rows.begin());
  const auto most_bent = [knee](Rig& rig) {
    rig.go(20.0, 0.0);
    double most = 0.0;
    for (int k = 0; k < 600; ++k) {
      rig.run(5ms);
      most = std::max(most, rig.motion.position_rad(knee));
    }
    return most;
  };
  Rig free;
  const double wanted = most_bent(free);
  model.limits_rad.assign(model.rows.size(), std::nullopt);
  model.limits_rad[static_cast<std::size_t>(knee)] = {.lower = -1.0, .upper = 0.5 * wanted};
  const std::string limited = file().path() + ".limited";
  motion::save_motion_model(model, limited);
  for (const int characters : {1, 2}) {
    SynthesizerParams p = params(characters);
    p.model = limited;
    Rig rig(p);
    if (characters == 1) {
      EXPECT_FLOAT_EQ(static_cast<float>(most_bent(rig)), static_cast<float>(0.5 * wanted));
      continue;
    }
    rig.go(20.0, 0.0, 1);
    float most = 0.0F;
    for (int k = 0; k < 600; ++k) {
      rig.run(5ms);
      most = std::max(most, rig.batch.position_rad(static_cast<int>(model.rows.size()) + knee));
    }
    EXPECT_FLOAT_EQ(most, static_cast<float>(0.5 * wanted));
  }
  std::filesystem::remove(limited);
}

TEST(SynthesizerNode, TheLastGoalCountsAndStopStops) {
  Rig rig;
  rig.go(5.0, 0.0);
  rig.run(2s);
  rig.go(0.0, 3.0);
  rig.go(2.0, 0.5);
  rig.run(9s);
  EXPECT_NEAR(rig.x(), 2.0, 0.15);
  rig.go(9.0, 0.5);
  rig.run(2s);
  rig.go(0.0, 0.0, 0, v1::MOTION_GOAL_KIND_STOP);
  rig.run(1200ms);
  EXPECT_EQ(rig.motion.action(), "stand");
  EXPECT_EQ(rig.statuses.back().kind(), v1::MOTION_GOAL_KIND_STOP);
  EXPECT_TRUE(rig.statuses.back().reached());
}

TEST(SynthesizerNode, ChangesItsStyle) {
  SynthesizerParams p = params();
  p.character.walking = true;
  Rig rig(p);
  rig.run(1500ms);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi, 0.01);
  rig.wish("slow");
  rig.run(3s);
  EXPECT_EQ(rig.motion.style(), "slow");
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi / 1.3, 0.01);
  rig.wish("brisk", 1.0);
  rig.run(3s);
  EXPECT_EQ(rig.motion.style(), "brisk");
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi / 0.9, 0.01);
}

TEST(SynthesizerNode, FollowsABeatUntilItEnds) {
  SynthesizerParams p = params();
  p.character.walking = true;
  Rig rig(p);
  rig.before_step = [&](Time now) {  // twice a second, with a delay of 30 ms on the way
    if (now.count() % 500'000'000 != 0) return;
    v1::Beat beat;
    beat.set_phase_rad(2.0 + 7.0 * std::chrono::duration<double>(now - 30ms).count());
    beat.set_phase_rate_rad_s(7.0);
    rig.bus.send("beat", beat, now - 30ms);
  };
  rig.run(6s);
  const double t = stamp_s(rig.motion);
  EXPECT_NEAR(math::wrap_pi(rig.motion.phase_rad() - 2.0 - 7.0 * t), 0.0, 0.02);
  rig.before_step = nullptr;
  v1::Beat over;
  rig.bus.send("beat", over, rig.now());
  rig.run(2s);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi, 0.01);
}

TEST(SynthesizerNode, ABeatThatFallsSilentIsLeft) {
  SynthesizerParams p = params();
  p.character.walking = true;
  p.beat_stale_s = 1.0;
  Rig rig(p);
  v1::Beat beat;
  beat.set_phase_rate_rad_s(7.0);
  rig.bus.send("beat", beat, rig.now());
  rig.run(1s);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 7.0, 0.4);
  rig.run(2s);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi, 0.01);
  rig.bus.send("beat", beat, rig.now() - 2s);  // late: it was stale when it came
  rig.run(1s);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 2.0 * std::numbers::pi, 0.01);
}

v1::CrowdCommand command(std::uint32_t character, double rate, double step, double heading) {
  v1::CrowdCommand crowd;
  v1::GaitCommand* gait = crowd.add_gaits();
  gait->set_character(character);
  gait->set_phase_rate_rad_s(rate);
  gait->set_step_length_m(step);
  gait->set_heading_rad(heading);
  return crowd;
}

TEST(SynthesizerNode, ObeysTheCrowdAndIsReleased) {
  Rig rig;
  rig.before_step = [&](Time now) {
    v1::CrowdCommand crowd = command(0, 6.8, 0.4, 0.9);
    crowd.mutable_gaits(0)->set_phase_rad(1.0 + 6.8 * std::chrono::duration<double>(now).count());
    rig.bus.send("crowd", crowd, now);
  };
  rig.run(8s);
  const double t = stamp_s(rig.motion);
  EXPECT_NEAR(math::wrap_pi(rig.motion.phase_rad() - 1.0 - 6.8 * t), 0.0, 0.02);
  EXPECT_NEAR(rig.motion.heading_rad(), 0.9, 0.1);
  rig.before_step = nullptr;
  rig.run(400ms);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), 6.8, 0.05);  // not yet stale
  rig.run(2s);
  EXPECT_EQ(rig.motion.action(), "stand");
}

/// Of two synthesizers that one coordinator leads each obeys what names it.
TEST(SynthesizerNode, CommandsAndStylesForAnotherNodeAreNotItsOwn) {
  Rig rig;
  const auto led = [&](const std::string& node) {
    v1::CrowdCommand crowd = command(0, 6.8, 0.4, 0.9);
    crowd.mutable_gaits(0)->set_node(node);
    for (int k = 0; k < 10; ++k) {
      rig.bus.send("crowd", crowd, rig.now());
      rig.run(100ms);
    }
    return rig.motion.action();
  };
  EXPECT_EQ(led("other"), "stand");
  EXPECT_EQ(led(rig.bus.node()), "walk");
  EXPECT_EQ(led(""), "walk");
}

TEST(SynthesizerNode, AnOldCommandDoesNotReplaceANewOne) {
  Rig rig;
  rig.run(1s);
  rig.bus.send("crowd", command(0, 6.8, 0.4, 1.0), rig.now());
  rig.run(5ms);
  rig.bus.send("crowd", command(0, 6.8, 0.4, -1.0), rig.now() - 300ms);
  rig.run(450ms);
  EXPECT_GT(rig.motion.yaw_rate_rad_s(), 0.0);
}

TEST(SynthesizerNode, RefusesWhatItCannotDoAndGoesOn) {
  Rig rig;
  rig.go(4.0, 0.0);
  rig.run(2s);
  const auto refused = [&](const std::string& why) {
    rig.statuses.clear();
    const double before = rig.x();
    rig.run(100ms);
    EXPECT_EQ(rig.last_reason(), why);
    EXPECT_GT(rig.x(), before);  // it continues
  };
  rig.wish("happy");
  refused("style 'happy' is unknown; known: walk, slow, brisk");
  rig.wish("slow", -1.0);
  refused("duration -1 s is outside [0, 600]");
  v1::StyleWish empty;
  rig.bus.send("style", empty, rig.now());
  refused("names no style; known: walk, slow, brisk");
  empty.add_shares()->set_style("slow");
  rig.bus.send("style", empty, rig.now());
  refused("style 'slow' has share 0, expected more than 0");
  rig.go(1.0, 1.0, 7);
  refused("character 7: there are 1, from 0");
  rig.go(1e7, 0.0);
  refused("goal at (1e+07, 0) m is farther than 10000 m");
  rig.go(1.0, 0.0, 0, v1::MOTION_GOAL_KIND_UNSPECIFIED);
  refused("kind 0 is none of WALK_TO, DRAWER, STOP");
  rig.go(1.0, 0.0, 0, static_cast<v1::MotionGoalKind>(77));
  refused("kind 77 is none of WALK_TO, DRAWER, STOP");
  rig.go(1.0, 0.0, 0, v1::MOTION_GOAL_KIND_DRAWER);
  refused("no actions for drawers are loaded (parameter drawer)");
  rig.go(NAN, 0.0);
  rig.run(10ms);
  EXPECT_EQ(rig.bus.counters("goal").rejected, 1U);
  rig.bus.send("crowd", command(3, 6.0, 0.5, 0.0), rig.now());
  rig.bus.send_raw("beat", "no message", rig.now());
  v1::Beat beat;
  beat.set_phase_rate_rad_s(-3.0);
  rig.bus.send("beat", beat, rig.now());
  rig.run(5s);
  EXPECT_NEAR(rig.x(), 4.0, 0.15);
}

TEST(SynthesizerNode, ManyCharactersComeInOneMessage) {
  Rig rig(params(20, 60.0));
  rig.go(6.0, 6.0, 3);
  rig.run(12s);
  ASSERT_EQ(rig.batch.phase_rad_size(), 20);
  ASSERT_EQ(rig.batch.heading_rad_size(), 20);
  ASSERT_EQ(rig.batch.position_pelvis_in_world_m_size(), 60);
  ASSERT_EQ(rig.batch.position_rad_size(), 20 * 51);
  EXPECT_NEAR(rig.batch.position_pelvis_in_world_m(9), 6.0F, 0.15F);
  EXPECT_NEAR(rig.batch.position_pelvis_in_world_m(10), 6.0F, 0.15F);
  EXPECT_EQ(rig.motion.position_rad_size(), 0);
  EXPECT_EQ(rig.statuses.back().character(), 3U);
  EXPECT_TRUE(rig.statuses.back().reached());
}

TEST(SynthesizerNode, SameInputsSameBytes) {
  const auto bytes = [] {
    Rig rig(params(5, 60.0));
    rig.go(3.0, 1.0, 2);
    rig.wish("brisk", 0.7);
    rig.run(3s);
    return rig.batch.SerializeAsString();
  };
  EXPECT_EQ(bytes(), bytes());
}

TEST(SynthesizerNode, RefusesToStart) {
  const auto why = [](const std::function<void(SynthesizerParams&)>& change) -> std::string {
    SynthesizerParams p = params();
    change(p);
    mimesis::testing::Loopback bus;
    return mimesis::testing::refusal([&] { SynthesizerNode node(p, bus); });
  };
  EXPECT_EQ(why([](SynthesizerParams& p) { p.character.style = "happy"; }),
            "style: 'happy' is none of the model's: walk, slow, brisk");
  EXPECT_NE(why([](SynthesizerParams& p) {
              p.model = "none.motion.json";
            }).find("none.motion.json: no such file"),
            std::string::npos);
  EXPECT_EQ(why([](SynthesizerParams& p) { p.goal.kind = "drawer"; }),
            "synthesizer.goal.kind: 'drawer' needs synthesizer.drawer: true");
}

TEST(SynthesizerNode, DrawsItsFigureWhereItWalks) {
  Rig rig;
  rig.go(3.0, 1.0);
  rig.run(3s);
  std::optional<foxglove::SceneUpdate> last;
  int pictures = 0;
  while (auto picture = rig.bus.take<foxglove::SceneUpdate>("figures")) last = picture, ++pictures;
  EXPECT_EQ(pictures, 75) << "25 a second";
  ASSERT_TRUE(last && last->entities_size() == 1);
  const foxglove::SceneEntity& figure = last->entities(0);
  EXPECT_EQ(figure.cylinders_size(), 11) << "neck, limbs, insteps";
  const auto lowest = [](const foxglove::SpherePrimitive& part) {
    const foxglove::Quaternion& q = part.pose().orientation();
    const Eigen::Vector3d up =  // the world's, in its axes
        Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).inverse() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d half(part.size().x() / 2, part.size().y() / 2, part.size().z() / 2);
    return part.pose().position().z() - up.cwiseProduct(half).norm();
  };
  double lowest_m = 1.0;
  foxglove::Vector3 head;
  for (const foxglove::SpherePrimitive& part : figure.spheres()) {
    lowest_m = std::min(lowest_m, lowest(part));
    if (part.pose().position().z() > head.z()) head = part.pose().position();
  }
  EXPECT_NEAR(lowest_m, 0.0, 0.005) << "the standing foot is on the ground";
  EXPECT_NEAR(head.z(), 1.6, 0.15);
  EXPECT_NEAR(head.x(), rig.motion.position_pelvis_in_world_m().x_m(), 0.25);
  EXPECT_NEAR(head.y(), rig.motion.position_pelvis_in_world_m().y_m(), 0.25);
  EXPECT_GT(head.x(), 0.5) << "it has walked";

  SynthesizerParams many = params(50);
  Rig crowd(many);
  crowd.run(100ms);
  const auto all = crowd.bus.take<foxglove::SceneUpdate>("figures");
  ASSERT_TRUE(all && all->entities_size() == 1 && all->entities(0).lines_size() == 1);
  EXPECT_EQ(all->entities(0).lines(0).points_size(), 50 * 2 * 20) << "twenty bones each";
}

}  // namespace
}  // namespace mimesis::synthesizer
