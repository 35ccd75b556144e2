#include "nodes/walker/walker_params.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>

#include "common/model/files.h"
#include "common/runtime/param_source.h"
#include "common/testing/refusal.h"
#include "nodes/walker/test/closed_loop.h"

namespace mimesis::walker {
namespace {

/// Reads parameters, or returns in one line why it cannot.
std::string read(const std::vector<std::string>& sets, StackSettings& settings) {
  return mimesis::testing::refusal([&] {
    runtime::ParamSource("", {}, sets).read("stack", [&](runtime::ParamVisitor& v) {
      visit_stack(v, settings);
    });
  });
}

TEST(StackParams, ReadsAStack) {
  StackSettings settings;
  EXPECT_EQ(read({"damping=0.01", "knee_margin_rad=0.1", "limit_margin_rad=0.03", "speed_share=0.5",
                  "tasks=[{name: left foot, kind: foot, link: left_sole, weight: 100, gain_1_s: "
                  "200, axes: [1, 1, 0]}, {name: arm, kind: posture, priority: 3, joints: "
                  "[left_elbow]}]"},
                 settings),
            "");
  EXPECT_EQ(settings.damping, 0.01);
  EXPECT_EQ(settings.knee_margin_rad, 0.1);
  EXPECT_EQ(settings.limit_margin_rad, 0.03);
  EXPECT_EQ(settings.speed_share, 0.5);
  ASSERT_EQ(settings.tasks.size(), 2U);
  EXPECT_EQ(settings.tasks[0].name, "left foot");
  EXPECT_EQ(settings.tasks[0].kind, TaskKind::foot);
  EXPECT_EQ(settings.tasks[0].link, "left_sole");
  EXPECT_EQ(settings.tasks[0].weight, 100.0);
  EXPECT_EQ(settings.tasks[0].gain_1_s, 200.0);
  EXPECT_EQ(settings.tasks[0].axes, (std::vector{true, true, false}));
  EXPECT_EQ(settings.tasks[1].priority, 3);
  EXPECT_EQ(settings.tasks[1].joints, std::vector<std::string>{"left_elbow"});
}

/// The logged effective set is read back as the same stack.
TEST(StackParams, SaysEveryKindAsItIsRead) {
  const std::vector<std::pair<TaskKind, std::string>> kinds = {
      {TaskKind::com, "com"},
      {TaskKind::foot, "foot"},
      {TaskKind::orientation, "orientation"},
      {TaskKind::position, "position"},
      {TaskKind::posture, "posture"},
      {TaskKind::regularisation, "regularisation"}};
  for (const auto& [kind, word] : kinds) {
    StackSettings settings;
    EXPECT_EQ(read({"tasks=[{name: a, kind: " + word + "}]"}, settings), "");
    ASSERT_EQ(settings.tasks.size(), 1U);
    EXPECT_EQ(settings.tasks[0].kind, kind) << word;
    const std::string said =
        runtime::dump_params([&](runtime::ParamVisitor& v) { visit_stack(v, settings); });
    EXPECT_NE(said.find("kind: \"" + word + "\""), std::string::npos) << said;
  }
}

TEST(StackParams, SaysInOneLineWhatIsWrong) {
  for (const char* set :
       {"tasks=[{name: a, kind: tail}]", "tasks=[{name: a, priority: 0}]", "tasks=[{nme: a}]",
        "tasks=[{name: a, gain_1_s: fast}]", "damping=2", "taks=[]"}) {
    StackSettings settings;
    const std::string said = read({set}, settings);
    EXPECT_FALSE(said.empty()) << set;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
}

}  // namespace

// Effects of the walker's parameters.
namespace {

WalkerParams with(const std::vector<std::string>& sets) {
  WalkerParams p;
  runtime::ParamSource("", {}, sets).read("walker", [&](runtime::ParamVisitor& v) { p.visit(v); });
  return p;
}

using testing::biped;

/// Notes where every number is kept, and whether its default is allowed.
class Places final : public runtime::ParamVisitor {
 public:
  void operator()(std::string_view key, double& value, double lo, double hi) override {
    EXPECT_TRUE(lo <= value && value <= hi) << key << ": " << value;
    note(key, &value);
  }
  void operator()(std::string_view key, int& value, int lo, int hi) override {
    EXPECT_TRUE(lo <= value && value <= hi) << key << ": " << value;
    note(key, &value);
  }
  void operator()(std::string_view key, bool& value) override { note(key, &value); }
  void operator()(std::string_view key, std::string& value) override { note(key, &value); }
  void operator()(std::string_view key, std::string& value,
                  std::initializer_list<std::string_view>) override {
    note(key, &value);
  }
  void operator()(std::string_view key, std::vector<double>& value, double, double,
                  std::size_t) override {
    note(key, &value);
  }
  void operator()(std::string_view key, std::vector<std::string>& value) override {
    note(key, &value);
  }
  void group(std::string_view, const std::function<void(ParamVisitor&)>& visit) override {
    visit(*this);
  }
  void elements(std::string_view, std::size_t, const std::function<void(std::size_t)>& resize,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override {
    resize(1);
    visit(*this, 0);
  }

 private:
  void note(std::string_view key, const void* place) {
    const auto [at, is_new] = key_.emplace(place, key);
    EXPECT_TRUE(is_new) << key << " and " << at->second << " are one figure";
  }
  std::map<const void*, std::string> key_;
};

TEST(WalkerParams, EveryKeyHasAFigureOfItsOwnAndAnAllowedDefault) {
  WalkerParams p;
  Places places;
  p.visit(places);
}

TEST(WalkerParams, RateAndStepTimeAreThoseOfTheRobotsFile) {
  std::ifstream in(runtime::find_model_file("biped.yaml"));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const auto& [from, to] : std::map<std::string, std::string>{
           {"urdf: biped.urdf", "urdf: " + runtime::find_model_file("biped.urdf")},
           {"step_s: 0.8", "step_s: 0.7"},
           {"rate_hz: 200", "rate_hz: 250"}}) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  WalkerParams p;
  EXPECT_EQ(p.robot_rate_hz(), 200.0);
  p.robot = ::testing::TempDir() + "robot_of_walker_params_test.yaml";
  std::ofstream(p.robot) << text;
  EXPECT_EQ(p.settings(model::load_biped(p.robot)).gait->step_s, 0.7);
  const std::string words = mimesis::testing::refusal([&] { p.robot_rate_hz(); });
  EXPECT_EQ(words, p.robot + ": rate_hz: 250, expected 200: the walker's gains belong to it");
}

TEST(WalkerParams, FiguresOfTheGaitReplaceThoseOfTheRobot) {
  struct Figure {
    const char* key;
    double GaitSettings::*setting;
    double value;
  };
  const GaitSettings own = gait_settings(biped());
  const std::vector<Figure> figures = {
      {"step_s", &GaitSettings::step_s, 0.7},
      {"double_support_s", &GaitSettings::double_support_s, 0.2},
      {"first_double_support_s", &GaitSettings::first_double_support_s, 0.9},
      {"step_height_m", &GaitSettings::step_height_m, 0.03},
      {"feet_distance_m", &GaitSettings::feet_distance_m, 0.21},
      {"longest_step_m", &GaitSettings::longest_step_m, 0.2},
      {"widest_step_m", &GaitSettings::widest_step_m, 0.33},
      {"narrowest_step_m", &GaitSettings::narrowest_step_m, 0.18},
      {"most_forward_m_s", &GaitSettings::most_forward_m_s, 0.25},
      {"most_sideways_m_s", &GaitSettings::most_sideways_m_s, 0.07},
      {"most_turn_rad_s", &GaitSettings::most_turn_rad_s, 0.15},
      {"most_foot_yaw_rad", &GaitSettings::most_foot_yaw_rad, 0.12}};
  for (const Figure& given : figures) {
    const WalkerParams p =
        with({std::string("gait.") + given.key + "=" + std::to_string(given.value)});
    const GaitSettings gait = *p.settings(biped()).gait;
    for (const Figure& figure : figures) {
      const double expected = &figure == &given ? given.value : own.*figure.setting;
      EXPECT_NEAR(gait.*figure.setting, expected, 1e-9) << figure.key << ", given " << given.key;
    }
    EXPECT_EQ(gait.com_height_m, own.com_height_m);
  }
}

TEST(WalkerParams, FiguresOfTheGaitMustNotContradictEachOther) {
  const auto refused = [](const std::vector<std::string>& sets, const std::string& what) {
    const std::string words =
        mimesis::testing::refusal([&] { (void)with(sets).settings(biped()); });
    EXPECT_EQ(words, what);
  };
  const std::string no_swing =
      "walker.gait.double_support_s: more than half of step_s leaves no swing";
  const std::string no_order =
      "walker.gait: expected narrowest_step_m <= feet_distance_m <= widest_step_m";
  refused({"gait.step_s=0.8", "gait.double_support_s=0.5"}, no_swing);
  refused({"gait.narrowest_step_m=0.2"}, no_order);
  refused({"gait.widest_step_m=0.18"}, no_order);
  EXPECT_NO_THROW((void)with({"gait.double_support_s=0.4"}).settings(biped()));
}

TEST(WalkerParams, SettingsOfTheChainAreThoseOfTheFile) {
  WalkerSettings s = with({}).settings(biped());
  EXPECT_EQ(s.pattern, PatternKind::nonlinear);
  EXPECT_TRUE(s.filter && s.stabilize);
  EXPECT_TRUE(s.stack.tasks.empty());
  s = with({"pattern=linear", "filter=false", "filter_iterations=3", "filter_legs_only=true",
            "stabilize=false", "stabilizer.kd_1_s=7", "stack.tasks=[{name: a, kind: com}]"})
          .settings(biped());
  EXPECT_EQ(s.pattern, PatternKind::linear);
  EXPECT_FALSE(s.filter || s.stabilize);
  EXPECT_EQ(s.filter_settings.iterations, 3);
  EXPECT_TRUE(s.filter_settings.legs_only);
  EXPECT_EQ(s.stabilizer.kd_1_s, 7.0);
  ASSERT_EQ(s.stack.tasks.size(), 1U);
  EXPECT_EQ(with({"pattern=preview"}).settings(biped()).pattern, PatternKind::preview);
}

TEST(WalkerParams, TheRobotMayStandAnywhere) {
  const WalkerParams p = with({"start.x_m=-3", "start.y_m=-4", "start.heading_rad=-3"});
  EXPECT_EQ(p.start.x_m, -3.0);
  EXPECT_EQ(p.start.y_m, -4.0);
  EXPECT_EQ(p.start.heading_rad, -3.0);
}

}  // namespace

}  // namespace mimesis::walker
