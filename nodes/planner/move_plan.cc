#include "nodes/planner/move_plan.h"

#include <fmt/format.h>

#include <cmath>

namespace mimesis::planner {
namespace {

using Way = std::vector<Eigen::VectorXd>;

constexpr double kStraight_m = 0.01;  // step of straight hand motions
constexpr int kMostLegs = 40;         // searched, with those that other postures repeat
constexpr double kTurn = 2.0 * M_PI;
constexpr const char* kUnstoppable = "a motion cannot be stopped without touching something";
constexpr int kOtherWays = 2;  // are searched if that happens

/// `q`, and the same place by other turns of endless joints: the nearest to `from` on either side.
Way turned(const kin::ArmModel& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& from) {
  Way all{q};
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    if (!arm.links[static_cast<std::size_t>(j)].endless) continue;
    const double above = q[j] + kTurn * std::ceil((from[j] - q[j]) / kTurn);
    Way copies;
    for (Eigen::VectorXd& place : all) {
      for (const double at : {above, above - kTurn}) {
        if (at < arm.q_min[j] || at > arm.q_max[j]) continue;
        place[j] = at;
        copies.push_back(place);
      }
    }
    all = std::move(copies);
  }
  return all;
}

class MovePlanner {
 public:
  MovePlanner(const kin::ArmModel& arm, const Roadmap& roadmap, const PlanRequest& request,
              const TaskSettings& settings)
      : arm_(arm),
        roadmap_(roadmap),
        settings_(settings),
        held_(!request.held.empty()),
        around_(obstacles(request, false)),
        leaving_(obstacles(request, true)),
        checker_(arm, around_, settings.margin_m, settings.interrupt) {}

  tl::expected<TaskPlan, Status> plan(const Move& move, Eigen::VectorXd start) {
    if (!move.tool.empty()) return along(move, start);
    for (std::size_t i = 0; i <= move.via.size(); ++i) {
      const bool last = i == move.via.size();
      const std::string what = last ? "the goal" : fmt::format("place {} of the way", i + 1);
      settings_.interrupt.enter(fmt::format("postures at {} were sought", what));
      Way fitting;
      for (const Place& place : last ? move.goals : std::vector{move.via[i]}) {
        for (const Eigen::VectorXd& q : postures(place)) {
          const Way some = turned(arm_, q, start);
          fitting.insert(fitting.end(), some.begin(), some.end());
        }
      }
      if (fitting.empty()) return tl::unexpected(Status{"no posture reaches " + what});
      places_.push_back({what, std::move(fitting)});
    }
    TaskPlan plan;
    plan.roadmap_nodes = roadmap_.size();
    if (const auto left = leave(start)) {
      start = left->back();
      if (!add(plan, *left, leaving_, settings_.contact_speed))
        return tl::unexpected(Status{kUnstoppable});
    }
    const auto legs = through(start, 0);
    if (!legs) return tl::unexpected(legs.error());
    for (const FoundPath& leg : *legs) {
      const std::size_t before = plan.motions.size();
      if (!add(plan, leg.waypoints, around_, settings_.speed))
        return tl::unexpected(Status{kUnstoppable});
      if (plan.motions.size() > before) plan.motions.back().found_by = leg.by;
      plan.passed.resize(plan.motions.size(), passed_);
      ++passed_;
    }
    return plan;
  }

 private:
  tl::expected<TaskPlan, Status> along(const Move& move, const Eigen::VectorXd& start) {
    settings_.interrupt.enter("the tool's way was sought");
    const auto path = ToolPath::make(kin::end_effector(arm_, start), move.tool);
    if (!path) return tl::unexpected(path.error());
    const auto way = tool_way(arm_, *path, move.tolerance, start, checker_);
    if (!way) return tl::unexpected(way.error());
    TaskPlan plan;
    const auto keeps = [&](const Eigen::MatrixXd& curve) {
      return keeps_to(arm_, *path, move.tolerance, curve);
    };
    if (!add(plan, *way, around_, settings_.speed, keeps))
      return tl::unexpected(Status{kUnstoppable});
    return plan;
  }

  struct Candidates {
    std::string what;
    Way postures;
  };

  static Obstacles obstacles(const PlanRequest& request, bool leaving) {
    const kin::Table& table = request.table;
    Obstacles all{table.balls, table.boxes, request.held, {}, table.hulls};
    if (!request.held.empty()) {
      if (leaving) all.boxes.swap(all.supports);
    } else if (table.object_radius > 0.0 && !leaving) {
      const auto object = cylinder_balls(table.object, table.object_radius, table.object_height);
      all.balls.insert(all.balls.end(), object.begin(), object.end());
    }
    return all;
  }

  Way postures(const Place& place) const {
    if (place.q.size() > 0) return {place.q};
    return kin::solve_ik_anywhere(arm_, {place.hand, {}}, settings_.ik_attempts,
                                  settings_.roadmap.seed, {.interrupt = settings_.interrupt});
  }

  /// Straight away from what the arm touches at `start`; empty if it touches nothing, or there is
  /// no such way.
  std::optional<Way> leave(const Eigen::VectorXd& start) {
    if (checker_.free(start)) return std::nullopt;
    const Eigen::Vector3d by =
        held_ ? Eigen::Vector3d(0.0, 0.0, settings_.lift_m)
              : Eigen::Vector3d(-settings_.approach_m *
                                kin::end_effector(arm_, start).linear().col(2));
    auto way =
        straight_way(arm_, start, moved_hand(arm_, start, by), kStraight_m, settings_.interrupt);
    if (!way || !checker_.free(way->back())) return std::nullopt;
    CollisionChecker leaving(arm_, leaving_, settings_.margin_m, settings_.interrupt);
    for (std::size_t i = 1; i < way->size(); ++i) {
      if (!leaving.certify((*way)[i - 1], (*way)[i])) return std::nullopt;
    }
    return way;
  }

  /// The legs from `from` to place `index` and on to the last.
  tl::expected<std::vector<FoundPath>, Status> through(const Eigen::VectorXd& from,
                                                       std::size_t index) {
    Way open = places_[index].postures;
    Status failure{"to " + places_[index].what + ": no path within the allowed effort"};
    bool found = false;
    settings_.interrupt.enter(fmt::format("a path to {} was sought", places_[index].what));
    while (!open.empty() && legs_++ < kMostLegs) {
      if (legs_ > 1 && free_nodes_.empty()) free_nodes_ = checker_.free_columns(roadmap_.nodes());
      auto leg = find_path(roadmap_, checker_, from, open, {}, settings_.search, free_nodes_);
      if (!leg) {
        if (!found) failure = {"to " + places_[index].what + ": " + leg.error().reason};
        break;
      }
      found = true;
      if (index + 1 == places_.size()) return std::vector<FoundPath>{std::move(*leg)};
      auto rest = through(leg->waypoints.back(), index + 1);
      if (rest) {
        rest->insert(rest->begin(), std::move(*leg));
        return rest;
      }
      failure = rest.error();
      open.erase(open.begin() + leg->goal);
    }
    return tl::unexpected(failure);
  }

  bool add(TaskPlan& plan, const Way& way, const Obstacles& obstacles, double speed,
           const SmoothPath::Accept& corners = {}) const {
    if (path_length(way) < 1e-9) return true;
    settings_.interrupt.enter("a motion was timed");
    auto motion = timed_motion(arm_, Phase::reach, way, obstacles, speed, settings_, 0.0, corners);
    if (!motion) return false;
    plan.path_length_rad += motion->length_rad;
    plan.motions.push_back(std::move(*motion));
    return true;
  }

  const kin::ArmModel& arm_;
  const Roadmap& roadmap_;
  const TaskSettings& settings_;
  bool held_;
  Obstacles around_, leaving_;
  CollisionChecker checker_;
  std::vector<Candidates> places_;
  int legs_ = 0;
  std::vector<char> free_nodes_;  // of the roadmap, from the second leg on
  std::size_t passed_ = 0;        // places
};

}  // namespace

tl::expected<TaskPlan, Status> plan_move(const kin::ArmModel& arm, const Roadmap& roadmap,
                                         const PlanRequest& request, const TaskSettings& settings) {
  TaskSettings other = settings;
  tl::expected<TaskPlan, Status> plan;
  for (int i = 0; i <= kOtherWays; ++i, ++other.search.seed) {
    plan =
        MovePlanner(arm, roadmap, request, other).plan(std::get<Move>(request.what), request.start);
    if (plan || plan.error().reason != kUnstoppable || settings.interrupt.told()) break;
  }
  if (settings.interrupt.told()) return tl::unexpected(settings.interrupt.reason());
  return plan;
}

std::string beyond_limits(const kin::ArmModel& arm, const Eigen::VectorXd& q, double tolerance) {
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const kin::DhLink& link = arm.links[static_cast<std::size_t>(j)];
    const double lo = arm.q_min[j], hi = arm.q_max[j];
    const bool within =
        link.endless ? std::isfinite(q[j]) : q[j] >= lo - tolerance && q[j] <= hi + tolerance;
    if (within) continue;  // NaN is in no range
    return fmt::format("joint {} at {:.9g} {}, expected {:.4f} .. {:.4f}", j + 1, q[j],
                       link.slides ? "m" : "rad", lo, hi);
  }
  return {};
}

tl::expected<TaskPlan, Status> plan_request(const kin::ArmModel& arm, const Roadmap& roadmap,
                                            const PlanRequest& asked,
                                            const TaskSettings& settings) {
  if (std::string why = beyond_limits(arm, asked.start, kAtLimit); !why.empty())
    return tl::unexpected(Status{"the start: " + why});
  PlanRequest request = asked;
  Eigen::VectorXd turns = Eigen::VectorXd::Zero(arm.dof());
  for (Eigen::Index j = 0; j < arm.dof(); ++j) {
    double& q = request.start[j];
    const bool inside = q >= arm.q_min[j] && q <= arm.q_max[j];
    if (!inside && arm.links[static_cast<std::size_t>(j)].endless)
      turns[j] = kTurn * std::round(q / kTurn);
    q = std::clamp(q - turns[j], arm.q_min[j], arm.q_max[j]);
  }
  const Task* task = std::get_if<Task>(&request.what);
  auto plan = task != nullptr
                  ? plan_task(arm, request.table, roadmap, request.start, *task, settings)
                  : plan_move(arm, roadmap, request, settings);
  if (!plan || turns.isZero(0.0)) return plan;
  for (PlannedMotion& motion : plan->motions) {
    for (Eigen::MatrixXd& curve : motion.curves) curve.colwise() += turns;
    motion.trajectory.position.colwise() += turns;
  }
  return plan;
}

}  // namespace mimesis::planner
