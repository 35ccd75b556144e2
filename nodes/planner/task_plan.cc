#include "nodes/planner/task_plan.h"

#include <algorithm>
#include <cmath>

#include "nodes/planner/hand_motion.h"
#include "nodes/planner/sampling.h"

namespace mimesis::planner {
namespace {

using Way = std::vector<Eigen::VectorXd>;

constexpr double kStraightStep = 0.01;  // of straight hand motions [m]
constexpr std::size_t kGraspTries = 6;  // grasps for which a transport is searched

Obstacles table_obstacles(const kin::Table& table) { return {table.balls, table.boxes, {}, {}}; }

Way reversed(Way way) {
  std::reverse(way.begin(), way.end());
  return way;
}

/// A posture that holds the object, with the straight ways that begin or end there.
struct Hold {
  Eigen::VectorXd q;
  Way away;  ///< from q back along the approach axis, without the object
  Way up;    ///< from q straight up, with it
};

class TaskPlanner {
 public:
  TaskPlanner(const kin::ArmModel& arm, const kin::Table& table, const Roadmap& roadmap,
              const Task& task, const TaskSettings& settings)
      : arm_(arm), table_(table), roadmap_(roadmap), task_(task), settings_(settings) {}

  tl::expected<TaskPlan, Status> plan(const Eigen::VectorXd& start);

 private:
  tl::expected<std::vector<Hold>, Status> holds_at(const Eigen::Vector3d& center,
                                                   const std::string& what);
  std::optional<Way> certified_way(const Eigen::VectorXd& q, const Eigen::Vector3d& by_W,
                                   CollisionChecker& checker) const;
  Obstacles carrying(bool on_its_support) const;
  double passing_cost(const Eigen::VectorXd& q) const;
  std::vector<kin::Ball> held_balls(const Eigen::VectorXd& q) const;
  void add_motion(TaskPlan& plan, Phase phase, const Way& waypoints, const Obstacles& obstacles,
                  double speed) const;

  const kin::ArmModel& arm_;
  const kin::Table& table_;
  const Roadmap& roadmap_;
  const Task& task_;
  const TaskSettings& settings_;
  std::vector<kin::Ball> held_;  // in E, the same at every hold of one grip
};

std::optional<Way> TaskPlanner::certified_way(const Eigen::VectorXd& q, const Eigen::Vector3d& by_W,
                                              CollisionChecker& checker) const {
  auto way = straight_way(arm_, q, moved_hand(arm_, q, by_W), kStraightStep);
  if (!way) return std::nullopt;
  for (std::size_t i = 1; i < way->size(); ++i) {
    if (!checker.certify((*way)[i - 1], (*way)[i])) return std::nullopt;
  }
  return way;
}

std::vector<kin::Ball> TaskPlanner::held_balls(const Eigen::VectorXd& q) const {
  const Eigen::Isometry3d X_EW = kin::end_effector(arm_, q).inverse();
  std::vector<kin::Ball> balls =
      cylinder_balls(table_.object, table_.object_radius, table_.object_height);
  for (auto& ball : balls) ball.center = X_EW * ball.center;
  return balls;
}

Obstacles TaskPlanner::carrying(bool on_its_support) const {
  Obstacles obstacles{table_.balls, closed_passages(table_, task_.transport), held_, {}};
  auto& boxes = on_its_support ? obstacles.supports : obstacles.boxes;
  boxes.insert(boxes.end(), table_.boxes.begin(), table_.boxes.end());
  return obstacles;
}

double TaskPlanner::passing_cost(const Eigen::VectorXd& q) const {
  const Eigen::Vector3d from_bar = kin::end_effector(arm_, q).translation() - table_.bridge_center;
  const bool near =
      std::abs(from_bar.x()) < 0.2 && std::abs(from_bar.y()) < table_.bridge_half_width;
  const bool as_decided = (from_bar.z() > 0.0) == (task_.transport == Transport::above);
  return near && as_decided ? settings_.preference : 1.0;
}

tl::expected<std::vector<Hold>, Status> TaskPlanner::holds_at(const Eigen::Vector3d& center,
                                                              const std::string& what) {
  CollisionChecker empty_handed(arm_, table_obstacles(table_), settings_.margin_m);
  Way solutions;
  for (const auto& goal :
       grasp_goals(task_.grip, center, table_.object_height, settings_.precision_depth_m)) {
    const Way some =
        kin::solve_ik_anywhere(arm_, goal, settings_.ik_attempts, settings_.roadmap.seed);
    solutions.insert(solutions.end(), some.begin(), some.end());
  }
  if (solutions.empty()) return tl::unexpected(Status{"no posture reaches " + what});

  std::vector<Hold> holds;
  std::string contact;
  for (const auto& q : solutions) {
    if (const auto touch = empty_handed.contact(q)) {
      contact = *touch;
      continue;
    }
    if (held_.empty()) held_ = held_balls(q);
    CollisionChecker holding(arm_, carrying(true), settings_.margin_m);
    const Eigen::Vector3d back = -settings_.approach_m * kin::end_effector(arm_, q).linear().col(2);
    auto away = certified_way(q, back, empty_handed);
    if (!away) continue;
    auto up = certified_way(q, Eigen::Vector3d(0.0, 0.0, settings_.lift_m), holding);
    if (up) holds.push_back({q, std::move(*away), std::move(*up)});
  }
  if (!holds.empty()) return holds;
  if (contact.empty()) return tl::unexpected(Status{"no free straight way to " + what});
  return tl::unexpected(Status{"no free posture at " + what + ", e.g. " + contact});
}

void TaskPlanner::add_motion(TaskPlan& plan, Phase phase, const Way& waypoints,
                             const Obstacles& obstacles, double speed) const {
  if (path_length(waypoints) < 1e-9) return;
  CollisionChecker checker(arm_, obstacles, settings_.margin_m);
  const SmoothPath path(waypoints, settings_.corner_rad,
                        [&](const Eigen::MatrixXd& curve) { return checker.certify_curve(curve); });
  plan.path_length_rad += path.length();
  plan.motions.push_back(
      {phase, path.curves(), obstacles,
       time_optimal(path, speed * arm_.v_max, speed * arm_.a_max, settings_.period_s)});
}

tl::expected<TaskPlan, Status> TaskPlanner::plan(const Eigen::VectorXd& start) {
  const auto goal = std::find_if(table_.goals.begin(), table_.goals.end(),
                                 [&](const kin::GoalPlace& g) { return g.name == task_.goal; });
  if (goal == table_.goals.end())
    return tl::unexpected(Status{"the scene has no goal '" + task_.goal + "'"});

  if (const auto obstacle = place_blocked(table_, goal->position)) {
    return tl::unexpected(
        Status{"the " + task_.goal + " goal is blocked: the object would touch " + *obstacle});
  }
  auto grasps = holds_at(table_.object, "the object");
  if (!grasps) return tl::unexpected(grasps.error());
  const auto places = holds_at(goal->position, "the " + task_.goal + " goal");
  if (!places) return tl::unexpected(places.error());
  std::stable_sort(grasps->begin(), grasps->end(), [&](const Hold& a, const Hold& b) {
    return (a.away.back() - start).norm() < (b.away.back() - start).norm();
  });

  const Obstacles supported = carrying(true), carried = carrying(false);
  CollisionChecker transport_checker(arm_, carried, settings_.margin_m);
  Obstacles with_object = table_obstacles(table_);
  const auto object = cylinder_balls(table_.object, table_.object_radius, table_.object_height);
  with_object.balls.insert(with_object.balls.end(), object.begin(), object.end());
  CollisionChecker reach_checker(arm_, with_object, settings_.margin_m);
  Way above_places;
  for (const auto& place : *places) above_places.push_back(place.up.back());
  const PostureCost cost = [this](const Eigen::VectorXd& q) { return passing_cost(q); };

  Status failure;
  for (std::size_t i = 0; i < std::min(kGraspTries, grasps->size()); ++i) {
    const Hold& grasp = (*grasps)[i];
    const auto transport = find_path(roadmap_, transport_checker, grasp.up.back(), above_places,
                                     cost, settings_.search);
    if (!transport) {
      failure = {"transport " +
                 std::string(task_.transport == Transport::above ? "above" : "below") +
                 " the bridge to the " + task_.goal + " goal: " + transport.error().reason};
      continue;
    }
    const Way before{grasp.away.back()};
    const auto reach = find_path(roadmap_, reach_checker, start, before, {}, settings_.search);
    if (!reach) {
      failure = {"reach for the object: " + reach.error().reason};
      continue;
    }
    const Hold& place = (*places)[static_cast<std::size_t>(transport->goal)];
    TaskPlan plan;
    plan.roadmap_nodes =
        std::max({reach->nodes, transport->nodes, static_cast<int>(roadmap_.nodes.cols())});
    const double fast = settings_.speed, gentle = settings_.contact_speed;
    add_motion(plan, Phase::reach, reach->waypoints, with_object, fast);
    add_motion(plan, Phase::approach, reversed(grasp.away), table_obstacles(table_), gentle);
    add_motion(plan, Phase::transport, grasp.up, supported, gentle);
    add_motion(plan, Phase::transport, transport->waypoints, carried, fast);
    add_motion(plan, Phase::transport, reversed(place.up), supported, gentle);
    add_motion(plan, Phase::retreat, place.away, table_obstacles(table_), gentle);
    return plan;
  }
  return tl::unexpected(failure);
}

}  // namespace

Roadmap prepare_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                        const TaskSettings& settings) {
  CollisionChecker checker(arm, table_obstacles(table), settings.margin_m);
  std::vector<Eigen::Vector3d> targets{table.object};
  for (const auto& goal : table.goals) targets.push_back(goal.position);
  const Eigen::MatrixXd starts =
      sample_box(arm.q_min, arm.q_max, settings.reaching_starts, settings.roadmap.seed + 1);
  Way postures;
  for (const auto& target : targets) {
    for (const Grip grip : {Grip::precision, Grip::full}) {
      const auto goal =
          grasp_goals(grip, target, table.object_height, settings.precision_depth_m).front();
      for (Eigen::Index i = 0; i < starts.cols(); ++i) {
        const Way way = reaching_postures(arm, starts.col(i), goal, settings.reaching_postures);
        postures.insert(postures.end(), way.begin(), way.end());
      }
    }
  }
  Eigen::MatrixXd more(arm.dof(), static_cast<Eigen::Index>(postures.size()));
  for (std::size_t i = 0; i < postures.size(); ++i)
    more.col(static_cast<Eigen::Index>(i)) = postures[i];
  return build_roadmap(checker, more, settings.roadmap);
}

tl::expected<TaskPlan, Status> plan_task(const kin::ArmModel& arm, const kin::Table& table,
                                         const Roadmap& roadmap, const Eigen::VectorXd& start,
                                         const Task& task, const TaskSettings& settings) {
  return TaskPlanner(arm, table, roadmap, task, settings).plan(start);
}

}  // namespace mimesis::planner
