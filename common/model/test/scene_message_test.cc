#include <gtest/gtest.h>

#include "common/model/files.h"

namespace mimesis::model {
namespace {

TEST(SceneMessage, CarriesAWholeTableThereAndBack) {
  const kin::Table table = load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml");
  const kin::Table back = from_proto(to_proto(table));
  ASSERT_EQ(back.balls.size(), table.balls.size());
  for (std::size_t i = 0; i < table.balls.size(); ++i) {
    EXPECT_EQ(back.balls[i].center, table.balls[i].center);
    EXPECT_EQ(back.balls[i].radius, table.balls[i].radius);
  }
  ASSERT_EQ(back.boxes.size(), table.boxes.size());
  for (std::size_t i = 0; i < table.boxes.size(); ++i) {
    EXPECT_EQ(back.boxes[i].center, table.boxes[i].center);
    EXPECT_EQ(back.boxes[i].half_extent, table.boxes[i].half_extent);
    EXPECT_EQ(back.boxes[i].name, table.boxes[i].name);
  }
  ASSERT_EQ(back.goals.size(), table.goals.size());
  for (std::size_t i = 0; i < table.goals.size(); ++i) {
    EXPECT_EQ(back.goals[i].name, table.goals[i].name);
    EXPECT_EQ(back.goals[i].position, table.goals[i].position);
    EXPECT_EQ(back.goals[i].radius, table.goals[i].radius);
  }
  EXPECT_EQ(back.bar_center, table.bar_center);
  EXPECT_EQ(back.bar_height, table.bar_height);
  EXPECT_EQ(back.bar_half_width, table.bar_half_width);
  EXPECT_EQ(back.object, table.object);
  EXPECT_EQ(back.object_radius, table.object_radius);
  EXPECT_EQ(back.object_height, table.object_height);
}

TEST(SceneMessage, UnknownGoalsStayUnknown) {
  v1::Scene scene;
  scene.add_goals();
  EXPECT_EQ(from_proto(scene).goals.at(0).name, "");
}

}  // namespace
}  // namespace mimesis::model
