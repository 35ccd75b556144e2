#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "nodes/walker/stack_params_node.h"

namespace mimesis::walker {
namespace {

/// The stack that a YAML file says, or why it says none.
std::string read(const std::string& yaml, StackSettings& settings) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("stack_params_test_" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(file) << yaml;
  std::string said;
  try {
    runtime::load_params(file, [&](runtime::ParamVisitor& v) { visit_stack(v, settings); });
  } catch (const ConfigError& error) {
    said = error.what();
    said = said.substr(said.find(".yaml") + 5);
  }
  std::filesystem::remove(file);
  return said;
}

TEST(StackParams, ReadsAStack) {
  StackSettings settings;
  EXPECT_EQ(read(R"(
damping: 0.01
tasks:
  - {name: left foot, kind: foot, link: left_sole, weight: 100, gain_1_s: 200, axes: [1, 1, 0]}
  - {name: arm, kind: posture, priority: 3, joints: [left_elbow]}
)",
                 settings),
            "");
  EXPECT_EQ(settings.damping, 0.01);
  ASSERT_EQ(settings.tasks.size(), 2U);
  EXPECT_EQ(settings.tasks[0].kind, TaskKind::kFoot);
  EXPECT_EQ(settings.tasks[0].weight, 100.0);
  EXPECT_EQ(settings.tasks[0].axes, (std::vector{true, true, false}));
  EXPECT_EQ(settings.tasks[1].priority, 3);
  EXPECT_EQ(settings.tasks[1].joints, std::vector<std::string>{"left_elbow"});
}

TEST(StackParams, SaysInOneLineWhatIsWrong) {
  for (const char* yaml :
       {"tasks: [{name: a, kind: tail}]", "tasks: [{name: a, priority: 0}]", "tasks: [{nme: a}]",
        "tasks: [{name: a, gain_1_s: fast}]", "damping: 2", "taks: []"}) {
    StackSettings settings;
    const std::string said = read(yaml, settings);
    EXPECT_FALSE(said.empty()) << yaml;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace mimesis::walker
