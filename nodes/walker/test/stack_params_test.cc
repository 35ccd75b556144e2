#include <gtest/gtest.h>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "nodes/walker/stack_params_node.h"

namespace mimesis::walker {
namespace {

/// Reads what is set, or says in one line why it cannot.
std::string read(const std::vector<std::string>& sets, StackSettings& settings) {
  try {
    runtime::ParamSource("", {}, sets).read("stack", [&](runtime::ParamVisitor& v) {
      visit_stack(v, settings);
    });
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
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
  EXPECT_EQ(settings.tasks[0].kind, TaskKind::kFoot);
  EXPECT_EQ(settings.tasks[0].link, "left_sole");
  EXPECT_EQ(settings.tasks[0].weight, 100.0);
  EXPECT_EQ(settings.tasks[0].gain_1_s, 200.0);
  EXPECT_EQ(settings.tasks[0].axes, (std::vector{true, true, false}));
  EXPECT_EQ(settings.tasks[1].priority, 3);
  EXPECT_EQ(settings.tasks[1].joints, std::vector<std::string>{"left_elbow"});
}

/// What is logged as the effective set is the same stack when it is read.
TEST(StackParams, SaysEveryKindAsItIsRead) {
  const std::vector<std::pair<TaskKind, std::string>> kinds = {
      {TaskKind::kCom, "com"},
      {TaskKind::kFoot, "foot"},
      {TaskKind::kOrientation, "orientation"},
      {TaskKind::kPosition, "position"},
      {TaskKind::kPosture, "posture"},
      {TaskKind::kRegularisation, "regularisation"}};
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
}  // namespace mimesis::walker
