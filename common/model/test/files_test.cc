#include "common/model/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/model/test/model_texts.h"
#include "common/shared_data.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::model {
namespace {

/// A copy of a model file in which `from` is replaced by `to`; removed at the end.
class EditedCopy {
 public:
  EditedCopy(const std::string& model, const std::string& from, const std::string& to) {
    std::string text = slurp(kModels + model);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    std::ofstream(file()) << text;
  }
  std::string file() const { return folder_ / "edited.yaml"; }

 private:
  testing::TemporaryFolder folder_;
};

template <class Load>
std::string message_of(const Load& load) {
  return testing::refusal([&] { load(); }, "no error");
}

void expect_arm_of_the_set(const std::string& arm_file, const std::string& name) {
  SCOPED_TRACE(arm_file);
  const auto file = shared_data("data/planner/problemset.json");
  std::ifstream in(file);
  if (!in) GTEST_SKIP() << "not here: " << file << " is absent";
  const nlohmann::json set = nlohmann::json::parse(in);
  const auto robot = std::find_if(set["robots"].begin(), set["robots"].end(),
                                  [&](const auto& r) { return r["name"] == name; });
  ASSERT_NE(robot, set["robots"].end());
  const kin::ArmModel arm = load_arm(kModels + arm_file);
  ASSERT_EQ(arm.links.size(), (*robot)["dh"].size());
  for (std::size_t i = 0; i < arm.links.size(); ++i) {
    const auto& link = (*robot)["dh"][i];
    EXPECT_DOUBLE_EQ(arm.links[i].a, link["a"]);
    EXPECT_DOUBLE_EQ(arm.links[i].alpha, link["alpha"]);
    EXPECT_DOUBLE_EQ(arm.links[i].d, link["d"]);
    EXPECT_DOUBLE_EQ(arm.links[i].offset, link["off"]);
    EXPECT_EQ(arm.links[i].modified, (*robot)["convention"] == "modified");
    EXPECT_NEAR(arm.q_min[static_cast<int>(i)], (*robot)["lo"][i], 1e-9);
    EXPECT_NEAR(arm.q_max[static_cast<int>(i)], (*robot)["hi"][i], 1e-9);
  }
  ASSERT_EQ(arm.balls.size(), (*robot)["balls"].size());
  for (std::size_t i = 0; i < arm.balls.size(); ++i) {
    const auto& ball = (*robot)["balls"][i];
    EXPECT_EQ(arm.balls[i].frame, ball["frame"]);
    EXPECT_EQ(arm.groups[static_cast<std::size_t>(arm.balls[i].group)], ball["group"]);
    EXPECT_DOUBLE_EQ(arm.balls[i].radius, ball["r"]);
    for (int k = 0; k < 3; ++k) EXPECT_DOUBLE_EQ(arm.balls[i].center[k], ball["c"][k]);
  }
  EXPECT_EQ(arm.self_pairs.size(), (*robot)["self_groups"].size());
  ASSERT_EQ(arm.env_groups.size(), (*robot)["env_groups"].size());
  for (std::size_t i = 0; i < arm.env_groups.size(); ++i) {
    EXPECT_EQ(arm.groups[static_cast<std::size_t>(arm.env_groups[i])], (*robot)["env_groups"][i]);
  }
}

TEST(ArmFile, ArmsAreThoseOfThePlannersProblemSet) {
  expect_arm_of_the_set("lwr4.yaml", "lwr4p");
  expect_arm_of_the_set("rx90.yaml", "rx90");
  expect_arm_of_the_set("planar2.yaml", "planar2");
}

TEST(ArmFile, Lwr4HasTheDataSheetsSpeeds) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  const double degrees[] = {110, 110, 128, 128, 204, 184, 184};
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(arm.v_max[i], degrees[i] * M_PI / 180, 1e-4);
  EXPECT_TRUE((arm.a_max.array() > 0).all());
  EXPECT_TRUE(((arm.home - arm.q_min).array() > 0).all() &&
              ((arm.q_max - arm.home).array() > 0).all());
}

TEST(RobotFile, OwnsTheRateOfItsJoints) {
  const EditedCopy arm("lwr4.yaml", "rate_hz: 200", "rate_hz: 125");
  const EditedCopy biped("biped.yaml", "rate_hz: 200", "rate_hz: 250");
  EXPECT_EQ(rate_of_robot(arm.file()), 125.0);
  EXPECT_EQ(rate_of_robot(biped.file()), 250.0);
  EXPECT_EQ(rate_of_robot("biped.urdf"), 200.0);
}

TEST(ArmFile, AMissingLimitIsNamed) {
  for (const std::string limit : {"q_min_rad: -2.9670597284, ", "q_max_rad: 2.9670597284,\n     ",
                                  "v_max_rad_s: 1.9199, ", "a_max_rad_s2: 6, "}) {
    const EditedCopy without("lwr4.yaml", limit, "");
    const std::string name = limit.substr(0, limit.find(':'));
    EXPECT_NE(message_of([&] { load_arm(without.file()); }).find(name), std::string::npos) << name;
  }
}

TEST(ArmFile, BaseAndToolAreTurnedAsInAUrdf) {
  const EditedCopy hanging(
      "lwr4.yaml", "base_m: [0, 0, 0]",
      "base_m: [0, 0, 1]\nbase_rpy_rad: [3.141592653589793, 0, 1.5707963267948966]");
  const kin::ArmModel arm = load_arm(hanging.file());
  EXPECT_TRUE((arm.X_WB * Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector3d(2, 1, -2), 1e-9));
  EXPECT_TRUE(arm.X_LE.linear().isIdentity());
}

TEST(ArmFile, MistakesAreNamedInOneLine) {
  const EditedCopy group("lwr4.yaml", "group: upper", "group: uper");
  EXPECT_NE(message_of([&] { load_arm(group.file()); }).find("'uper' is not one of groups"),
            std::string::npos);
  const EditedCopy home("lwr4.yaml", "home_rad: 1.6", "home_rad: 2.6");
  EXPECT_NE(message_of([&] { load_arm(home.file()); }).find("joints[3]: home_rad is outside"),
            std::string::npos);
  const EditedCopy limits("lwr4.yaml", "q_min_rad: -2.9670597284", "q_min_rad: 2.9670597284");
  EXPECT_NE(message_of([&] { load_arm(limits.file()); }).find("q_min_rad is not below"),
            std::string::npos);
  const EditedCopy frame("lwr4.yaml", "{frame: 7", "{frame: 8");
  EXPECT_NE(message_of([&] { load_arm(frame.file()); }).find("frame is above"), std::string::npos);
  const EditedCopy key("lwr4.yaml", "radius_m: 0.11", "radius: 0.11");
  EXPECT_NE(message_of([&] { load_arm(key.file()); }).find("edited.yaml:"), std::string::npos);
  EXPECT_NE(message_of([] { load_arm("no-such-arm.yaml"); }), "no error");
}

TEST(TableFile, BarTableHoldsItsObjectsUp) {
  const kin::Table table = load_table(kModels + "bar_table.yaml");
  EXPECT_NEAR(table.bar_height, 0.42, 1e-12);
  ASSERT_EQ(table.goals.size(), 2u);
  EXPECT_EQ(table.goals[0].name, "high");
  EXPECT_GT(table.goals[0].position.z(), table.goals[1].position.z());
  const auto bottom_is_supported = [&](const Eigen::Vector3d& p) {
    for (const kin::Box& box : table.boxes) {
      const double top = box.center.z() + box.half_extent.z();
      const Eigen::Vector2d side = (p - box.center).head<2>().cwiseAbs();
      if (std::abs(p.z() - table.object_height / 2 - top) < 1e-9 &&
          (side.array() < box.half_extent.head<2>().array()).all()) {
        return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(bottom_is_supported(table.object));
  for (const kin::GoalPlace& goal : table.goals) {
    EXPECT_TRUE(bottom_is_supported(goal.position)) << goal.name;
    EXPECT_GT(goal.position.x(), table.bar_center.x()) << goal.name << " is not behind the bar";
  }
  EXPECT_LT(table.object.x(), table.bar_center.x());
}

TEST(TableFile, BarHeightCanBeGivenInstead) {
  const kin::Table table = load_table(kModels + "bar_table.yaml", 0.25);
  EXPECT_DOUBLE_EQ(table.bar_height, 0.25);
  EXPECT_NEAR(table.bar_center.z(), -0.01 + 0.25 + 0.03, 1e-12);
  for (const kin::Ball& ball : table.balls)
    EXPECT_LE(ball.center.z(), table.bar_center.z() + 1e-12);
}

TEST(TableFile, MistakesAreNamedInOneLine) {
  EXPECT_NE(
      message_of([] { load_table(kModels + "bar_table.yaml", 0.01); }).find("height_m is below"),
      std::string::npos);
  const EditedCopy goal("bar_table.yaml", "{name: low,", "{name: middle,");
  EXPECT_NE(message_of([&] { load_table(goal.file()); }).find("middle"), std::string::npos);
  const EditedCopy object("bar_table.yaml", "position_m: [0.40", "# position_m: [0.40");
  EXPECT_EQ(message_of([&] { load_table(object.file()); }),
            object.file() + ":23:3: object.position_m: is missing, expected 3 numbers");
}

TEST(ModelFiles, EachLineIsEitherNotNeededOrMissedByName) {
  const auto load = [](const std::string& model, const std::string& file) {
    if (model == "bar_table.yaml") load_table(file);
    if (model == "lwr4.yaml") load_arm(file);
    if (model == "biped.yaml") load_biped(file);
  };
  for (const std::string model : {"bar_table.yaml", "lwr4.yaml", "biped.yaml"}) {
    std::istringstream lines(slurp(kModels + model));
    int refused = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.empty()) continue;
      const EditedCopy without(model, line + "\n", "");
      const std::string message = message_of([&] { load(model, without.file()); });
      if (message == "no error") continue;
      ++refused;
      EXPECT_TRUE(message.starts_with(without.file())) << line << ": " << message;
    }
    EXPECT_GT(refused, 5) << model;
  }
}

/// What a scene's message has no word for is told larger, not left out.
TEST(Files, PartsOfMeshesAreToldByTheBallsThatHoldThem) {
  kin::Table table;
  kin::Hull& hull = table.hulls.emplace_back();
  hull.shape.points = Eigen::MatrixX3d::Identity(3, 3);
  hull.cover = {{{0.5, 0.5, 0.0}, 0.8}, {{0.0, 0.3, 0.8}, 0.7}};
  const kin::Table told = from_proto(to_proto(table));
  ASSERT_EQ(told.balls.size(), 2u);
  EXPECT_EQ(told.balls[1].center, hull.cover[1].center);
  EXPECT_EQ(told.balls[1].radius, 0.7);
}

}  // namespace
}  // namespace mimesis::model
