#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "nodes/planner/task_plan.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"
#include "proto/steps.pb.h"

namespace mimesis::planner {

/// The roadmap in W: every node a small ball at its place of the end effector, every link a line
/// between two of them (the hand's true path is curved). Entities by their use with an empty hand:
/// "usable", links proven free; "closed", free but in the passage that was not decided [M18 2.3.2,
/// P_F5]; "blocked", links not proven free.
/// @param decided  closes the other passage
foxglove::SceneUpdate to_drawing(const kin::ArmModel& arm, const kin::Table& table,
                                 const Roadmap& roadmap, double margin_m,
                                 std::optional<Transport> decided, std::chrono::nanoseconds stamp);

/// Makes the roadmaps again that a recorded planner had, and draws them.
class RoadmapDrawer {
 public:
  /// @param start  the planner's record of its start; without parameters its defaults hold
  /// @throws ConfigError if it names a robot or parameters that this version does not know.
  explicit RoadmapDrawer(const v1::NodeStart& start);

  /// The roadmap for a scene whose values are finite, with the decision and the stamp of `status`.
  foxglove::SceneUpdate draw(const v1::Scene& scene, const v1::TaskStatus& status);

 private:
  kin::ArmModel arm_;
  TaskSettings settings_;
  std::string scene_;  ///< scene of `roadmap_`, without its header
  std::shared_ptr<const Roadmap> stored_;
  std::optional<Roadmap> roadmap_;
};

}  // namespace mimesis::planner
