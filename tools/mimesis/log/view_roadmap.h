#pragma once
#include <optional>
#include <utility>
#include <vector>

#include "nodes/planner/task_plan.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"
#include "tools/mimesis/log/view_drawing.h"

namespace mimesis::tool {

/// What a node or link of the roadmap is good for, with an empty hand.
enum class Use {
  usable,   ///< the links proven free
  closed,   ///< free, but in the passage that was not decided [M18 2.3.2, P_F5]
  blocked,  ///< the links not proven free
};

/// The roadmap in W: every node a small ball where it puts the end effector, every link a line
/// between two of them (the hand's true way is curved). Entities "usable", "closed" and "blocked".
/// `decided`: closes the other passage.
foxglove::SceneUpdate to_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                                 const planner::Roadmap& roadmap, double margin_m,
                                 std::optional<planner::Transport> decided,
                                 std::chrono::nanoseconds stamp);

/// Draws what the planner knew: its roadmap on view/roadmap when the scene is first seen and for
/// every plan that finds a scene or a decision changed; on view/path the way of the hand in all
/// motions of the plan so far, with the hand's pose at grasp and release.
class RoadmapView {
 public:
  RoadmapView(kin::ArmModel arm, const planner::TaskSettings& settings)
      : arm_(std::move(arm)), settings_(settings) {}

  // False: places that are not finite, or not a motion of this arm.
  bool see(const v1::Scene& scene, const Draw& draw);
  bool see(const v1::TaskStatus& status, const Draw& draw);
  bool see(const v1::Trajectory& motion, const Draw& draw);

 private:
  struct Motion {
    v1::TaskPhase phase;
    std::vector<Eigen::Isometry3d> X_WE;
  };
  using Shown = std::pair<std::string, std::optional<planner::Transport>>;  ///< scene, decision

  void draw_roadmap(std::chrono::nanoseconds stamp, const Draw& draw);

  kin::ArmModel arm_;
  planner::TaskSettings settings_;
  std::optional<kin::Table> table_;
  Shown known_, shown_;
  std::optional<planner::Roadmap> roadmap_;  ///< of the scene in `shown_`
  std::vector<Motion> motions_;              ///< of the plan
};

}  // namespace mimesis::tool
