#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "common/math/circle.h"
#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "nodes/synthesizer/test/models.h"
#include "proto/motion.pb.h"

namespace mimesis::synthesizer {
namespace {

using mimesis::testing::Process;
using mimesis::testing::TestGraph;
using mimesis::testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kSynthesizer = MIMESIS_BIN_DIR "/mimesis_synthesizer";

const testing::ModelFile& file() {
  static const testing::ModelFile three(testing::three_styles());
  return three;
}

/// Sends wishes and listens, on the wall clock.
class Partner {
 public:
  explicit Partner(const TestGraph& graph)
      : node_(graph,
              {{"motion", "synthesizer/motion"},
               {"status", "synthesizer/status"},
               {"rows", "synthesizer/rows"}},
              {{"goal", "test/goal"},
               {"style", "test/style"},
               {"beat", "test/beat"},
               {"crowd", "test/crowd"}}),
        goal(node_.bus(), "goal"),
        style(node_.bus(), "style"),
        beat(node_.bus(), "beat"),
        crowd(node_.bus(), "crowd"),
        motion_(node_.bus(), "motion"),
        status_(node_.bus(), "status"),
        rows_(node_.bus(), "rows") {
    node_.open();
  }

  /// Calls `send` with every motion that arrives until `done`.
  bool until(const std::function<bool(const v1::Motion&)>& done,
             const std::function<void(runtime::Time)>& send = {},
             std::chrono::milliseconds timeout = 20s) {
    return node_.until(
        [&] {
          bool is_done = false;
          while (const auto m = motion_.pop()) {
            if (send) send(TestNode::now());
            last = *m;
            is_done = is_done || done(*m);
          }
          while (const auto s = status_.pop()) statuses.push_back(*s);
          return is_done;
        },
        timeout);
  }
  bool connected() {
    return node_.wait_subscriber(goal) && node_.wait_subscriber(style) &&
           node_.wait_subscriber(beat) && node_.wait_subscriber(crowd) &&
           node_.until([this] { return rows_.get() != nullptr; });
  }
  const v1::MotionRows& rows() { return *rows_.get(); }

 private:
  TestNode node_;

 public:
  runtime::Out<v1::MotionGoal> goal;
  runtime::Out<v1::StyleWish> style;
  runtime::Out<v1::Beat> beat;
  runtime::Out<v1::CrowdCommand> crowd;
  v1::Motion last;
  std::vector<v1::MotionStatus> statuses;

 private:
  runtime::Reliable<v1::Motion> motion_;
  runtime::Reliable<v1::MotionStatus> status_;
  runtime::Latest<v1::MotionRows> rows_;
};

std::vector<std::string> options(std::vector<std::string> more = {}) {
  std::vector<std::string> all = {"--set", "model=" + file().path()};
  for (const char* port : {"goal", "style", "beat", "crowd"}) {
    all.insert(all.end(), {"--in", std::string(port) + "=test/" + port});
  }
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

double seconds(runtime::Time t) { return std::chrono::duration<double>(t).count(); }

TEST(SynthesizerProcess, WalksToAGoal) {
  TestGraph graph;
  Partner partner(graph);
  Process node(graph, kSynthesizer, options());
  ASSERT_TRUE(partner.connected()) << node.errors();
  EXPECT_EQ(partner.rows().rows_size(), 51);
  v1::MotionGoal goal;
  goal.set_kind(v1::MOTION_GOAL_KIND_WALK_TO);
  goal.mutable_position_in_world_m()->set_x_m(1.5);
  partner.goal.send(goal, TestNode::now());
  EXPECT_TRUE(partner.until([](const v1::Motion& m) { return m.action() == "walk"; }));
  EXPECT_TRUE(partner.until([](const v1::Motion& m) { return m.action() == "stand"; }))
      << node.errors();
  EXPECT_NEAR(partner.last.position_pelvis_in_world_m().x_m(), 1.5, 0.3);
  EXPECT_TRUE(partner.until([&](const v1::Motion&) {
    return !partner.statuses.empty() && partner.statuses.back().reached();
  }));
  EXPECT_EQ(node.terminate(), 0) << node.errors();
}

TEST(SynthesizerProcess, ChangesItsStyleSmoothly) {
  TestGraph graph;
  Partner partner(graph);
  Process node(graph, kSynthesizer, options({"--set", "start.walking=true"}));
  ASSERT_TRUE(partner.connected()) << node.errors();
  v1::StyleWish wish;
  wish.add_shares()->set_style("happy");
  wish.mutable_shares(0)->set_share(1.0);
  partner.style.send(wish, TestNode::now());
  ASSERT_TRUE(partner.until([&](const v1::Motion&) {
    return !partner.statuses.empty() && !partner.statuses.back().reason().empty();
  }));
  EXPECT_EQ(partner.statuses.back().reason(), "style 'happy' is unknown; known: walk, slow, brisk");

  wish.mutable_shares(0)->set_style("slow");
  partner.style.send(wish, TestNode::now());
  v1::Motion before;
  double fastest = 0.0;  // change of a row's rate in a step
  ASSERT_TRUE(partner.until([&](const v1::Motion& m) {
    for (int r = 0; r < before.velocity_rad_s_size(); ++r) {
      fastest = std::max(fastest, std::abs(m.velocity_rad_s(r) - before.velocity_rad_s(r)));
    }
    before = m;
    return m.style() == "slow" &&
           std::abs(m.phase_rate_rad_s() - 2.0 * std::numbers::pi / 1.3) < 0.01;
  })) << node.errors();
  EXPECT_LT(fastest, 3.0);  // rad/s in 5 ms; a cut makes some 50
  EXPECT_EQ(node.terminate(), 0) << node.errors();
  EXPECT_NE(
      node.errors().find("style wish refused: style 'happy' is unknown; known: walk, slow, brisk"),
      std::string::npos)
      << node.errors();
}

TEST(SynthesizerProcess, LocksToABeatThenToTheCrowdAndIsReleased) {
  TestGraph graph;
  Partner partner(graph);
  Process node(graph, kSynthesizer, options({"--set", "start.walking=true"}));
  ASSERT_TRUE(partner.connected()) << node.errors();
  const auto phase_of = [](double rate, runtime::Time t) { return rate * seconds(t % 1000s); };
  const auto locks = [&](double rate) {
    return [&, rate, since = 0](const v1::Motion& m) mutable {
      const runtime::Time t(static_cast<std::int64_t>(m.header().stamp_ns()));
      const double off = math::wrap_pi(m.phase_rad() - phase_of(rate, t));
      // 14 ms of latency are 0.1 rad; who does not follow is that near for 1 of 30 steps.
      since = std::abs(off) < 0.1 ? since + 1 : std::max(0, since - 5);
      return since > 100;
    };
  };
  EXPECT_TRUE(partner.until(locks(7.0), [&](runtime::Time now) {
    v1::Beat beat;
    beat.set_phase_rad(phase_of(7.0, now));
    beat.set_phase_rate_rad_s(7.0);
    partner.beat.send(beat, now);
  })) << node.errors();
  EXPECT_TRUE(partner.until(locks(5.8), [&](runtime::Time now) {
    v1::CrowdCommand crowd;
    v1::GaitCommand* gait = crowd.add_gaits();
    gait->set_phase_rad(phase_of(5.8, now));
    gait->set_phase_rate_rad_s(5.8);
    partner.crowd.send(crowd, now);
  })) << node.errors();
  v1::Beat over;
  partner.beat.send(over, TestNode::now());
  EXPECT_TRUE(partner.until([](const v1::Motion& m) { return m.action() == "stand"; }))
      << node.errors();
  EXPECT_EQ(node.terminate(), 0);
  EXPECT_NE(node.errors().find("no crowd command for 0.5 s: character 0 is on its own"),
            std::string::npos)
      << node.errors();
}

TEST(SynthesizerProcess, BadConfigurationExitsWith2AndNamesTheKey) {
  const auto refused = [](const std::string& setting, const std::string& what) {
    mimesis::testing::refuses(kSynthesizer, {"model=" + file().path(), setting}, what);
  };
  refused("characters=0", "synthesizer.characters");
  refused("rate_hz=5", "synthesizer.rate_hz");
  refused("start.arrangement=heap", "start.arrangement");
  refused("goal.kind=drawer", "'drawer' needs synthesizer.drawer: true");
  refused("style=happy", "'happy' is none of the model's: walk, slow, brisk");
  refused("colour=red", "colour");
  refused("model=/nowhere/x.motion.json", "/nowhere/x.motion.json: no such file");
  const std::string damaged = file().folder() + "/damaged.motion.json";
  std::ofstream(damaged) << R"({"format": "mimesis.motion", "version": 99})";
  refused("model=" + damaged, "damaged.motion.json");
  mimesis::testing::refuses(kSynthesizer, {"robot.description=biped.yaml", "rate_hz=100"},
                            "synthesizer.rate_hz: 100 contradicts");
}

}  // namespace
}  // namespace mimesis::synthesizer
