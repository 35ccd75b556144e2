// What parameters of the walker reach.
#include <gtest/gtest.h>

#include <map>

#include "common/error.h"
#include "common/model/files.h"
#include "common/runtime/param_source.h"
#include "nodes/walker/walker_params_node.h"

namespace mimesis::walker {
namespace {

WalkerParams with(const std::vector<std::string>& sets) {
  WalkerParams p;
  runtime::ParamSource("", {}, sets).read("walker", [&](runtime::ParamVisitor& v) { p.visit(v); });
  return p;
}

const robot::Biped& biped() {
  static const robot::Biped b = model::load_biped("biped.yaml");
  return b;
}

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
    try {
      (void)with(sets).settings(biped());
      ADD_FAILURE() << "accepted: " << sets.front();
    } catch (const ConfigError& e) {
      EXPECT_EQ(std::string(e.what()), what);
    }
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
  EXPECT_EQ(s.pattern, PatternKind::kNonlinear);
  EXPECT_TRUE(s.filter && s.stabilize);
  EXPECT_TRUE(s.stack.tasks.empty());
  s = with({"pattern=linear", "filter=false", "filter_iterations=3", "filter_legs_only=true",
            "stabilize=false", "stabilizer.kd_1_s=7", "stack.tasks=[{name: a, kind: com}]"})
          .settings(biped());
  EXPECT_EQ(s.pattern, PatternKind::kLinear);
  EXPECT_FALSE(s.filter || s.stabilize);
  EXPECT_EQ(s.filter_settings.iterations, 3);
  EXPECT_TRUE(s.filter_settings.legs_only);
  EXPECT_EQ(s.stabilizer.kd_1_s, 7.0);
  ASSERT_EQ(s.stack.tasks.size(), 1U);
  EXPECT_EQ(with({"pattern=preview"}).settings(biped()).pattern, PatternKind::kPreview);
}

TEST(WalkerParams, TheRobotMayStandAnywhere) {
  const WalkerParams p = with({"start.x_m=-3", "start.y_m=-4", "start.heading_rad=-3"});
  EXPECT_EQ(p.start.x_m, -3.0);
  EXPECT_EQ(p.start.y_m, -4.0);
  EXPECT_EQ(p.start.heading_rad, -3.0);
}

}  // namespace
}  // namespace mimesis::walker
