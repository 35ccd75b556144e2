// Drawings of roadmaps, against closed forms and the recorded scene.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "common/error.h"
#include "common/model/files.h"
#include "nodes/planner/drawing/roadmap_drawing_node.h"

namespace mimesis::planner {
namespace {

const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

Eigen::Vector3d vector(const foxglove::Point3& p) { return {p.x(), p.y(), p.z()}; }

class RoadmapDrawing : public ::testing::Test {
 protected:
  /// Entities by id.
  static std::map<std::string, foxglove::SceneEntity> by_id(const foxglove::SceneUpdate& update) {
    std::map<std::string, foxglove::SceneEntity> entities;
    for (const auto& entity : update.entities()) entities[entity.id()] = entity;
    return entities;
  }
  const kin::ArmModel arm_ = model::load_arm(kModels + "lwr4.yaml");
  const kin::Table table_ = model::load_table(kModels + "bridge_table.yaml");
};

TEST_F(RoadmapDrawing, ALinkThroughAPostIsBlockedItsEndsAreNot) {
  // The arm lies level at z = 0.31 and turns about the vertical, through both posts of the bridge.
  Eigen::MatrixXd nodes = Eigen::MatrixXd::Zero(7, 3);
  const double right_angle = std::numbers::pi / 2;
  nodes.row(0) << -right_angle, right_angle, right_angle + 0.3;
  nodes.row(1).setConstant(-right_angle);
  const Roadmap roadmap(nodes, NeighbourLists{{{.to = 1}}, {{.to = 0}, {.to = 2}}, {{.to = 1}}});
  const auto entities = by_id(to_drawing(arm_, table_, roadmap, 0.0, {}, {}));
  EXPECT_EQ(entities.at("usable").spheres_size(), 3);
  EXPECT_EQ(entities.at("blocked").spheres_size(), 0);
  const auto& blocked = entities.at("blocked").lines(0);
  const auto& usable = entities.at("usable").lines(0);
  ASSERT_EQ(blocked.points_size(), 2);
  ASSERT_EQ(usable.points_size(), 2);  // each link once
  const double reach = 0.4 + 0.39 + 0.078 + 0.16;
  EXPECT_NEAR(vector(blocked.points(0)).head<2>().norm(), reach, 1e-12);
  EXPECT_NEAR(blocked.points(0).z(), 0.31, 1e-12);
  EXPECT_NEAR((vector(usable.points(1)) - vector(usable.points(0))).norm(),
              2 * reach * std::sin(0.15), 1e-12);
}

TEST_F(RoadmapDrawing, TheDecisionClosesAPassage) {
  TaskSettings settings;
  settings.roadmap.nodes = 150;
  settings.reaching_starts = 1;
  const Roadmap roadmap = prepare_roadmap(arm_, table_, settings);
  const int nodes = roadmap.size();
  std::size_t ends = 0;
  for (std::size_t i = 0; i < roadmap.links().size(); ++i) ends += roadmap.links()[i].size();
  for (const auto decided : {std::optional<Transport>(), {Transport::above}}) {
    const auto entities = by_id(to_drawing(arm_, table_, roadmap, settings.margin_m, decided, {}));
    int drawn_nodes = 0, drawn_ends = 0;
    for (const auto& [id, entity] : entities) {
      drawn_nodes += entity.spheres_size();
      drawn_ends += entity.lines(0).points_size();
    }
    EXPECT_EQ(drawn_nodes, nodes);
    EXPECT_EQ(drawn_ends, static_cast<int>(ends));        // both ends of a link: stored, and drawn
    EXPECT_EQ(entities.at("blocked").spheres_size(), 0);  // refined out of the obstacles
    EXPECT_EQ(entities.at("closed").spheres_size() > 0, decided.has_value());
  }
}

TEST_F(RoadmapDrawing, TheDrawerTakesParametersAndDecisionFromTheLog) {
  v1::NodeStart start;
  start.set_node("planner");
  start.set_parameters("roadmap_nodes: 120\n");
  RoadmapDrawer drawer(start);
  v1::TaskStatus status;
  status.mutable_header()->set_stamp_ns(5'000'000'000);
  const auto undecided = by_id(drawer.draw(model::to_proto(table_), status));
  status.set_transport(v1::TRANSPORT_ABOVE);
  const auto decided = by_id(drawer.draw(model::to_proto(table_), status));
  EXPECT_EQ(undecided.at("closed").spheres_size(), 0);
  EXPECT_GT(decided.at("closed").spheres_size(), 0);
  EXPECT_EQ(decided.at("usable").timestamp().seconds(), 5);
  start.set_parameters("no_such_parameter: 1\n");
  EXPECT_THROW(RoadmapDrawer{start}, ConfigError);
}

}  // namespace
}  // namespace mimesis::planner
