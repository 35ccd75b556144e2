#include "nodes/planner/task_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nodes/planner/collision.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

// Stops that leave the path are certified up to the pace at which the bridge catches up
// (hw/bridge/command_track.cc).
constexpr double kPace = 1.2;
constexpr double kJerk = 0.95;           // share of the arm's limit of the jerk, at any speed
constexpr std::size_t kMostPieces = 32;  // of a path whose stops are proven at once by parts

using Way = std::vector<Eigen::VectorXd>;

constexpr double kStraightStep = 0.01;  // step of straight hand motions [m]
// Lengths of straight ways that are tried, in shares of the full one: shorter ones where no posture
// allows longer ones.
constexpr std::array kShares{1.0, 0.6, 0.35};
constexpr std::size_t kGraspTries = 6;                // grasps for which a transport is searched
constexpr int kWideWaves = 60, kWideBranches = 4000;  // effort for the wide margin
// Pre-selected by F5: postures nearer than this to its own, and holds below them [rad].
constexpr double kPreselected = 0.8, kHoldNear = 1.0;

Obstacles table_obstacles(const kin::Table& table) {
  return {table.balls, table.boxes, {}, {}, table.hulls};
}

Way reversed(Way way) {
  std::reverse(way.begin(), way.end());
  return way;
}

/// A posture that holds the object, with the straight ways that begin or end there.
struct Hold {
  Eigen::VectorXd q;
  Way away;               ///< from q back along the approach axis, without the object
  Way up;                 ///< from q straight up, with it
  double margin_m = 0.0;  ///< of both
};

class TaskPlanner {
 public:
  TaskPlanner(const kin::ArmModel& arm, const kin::Table& table, const Roadmap& roadmap,
              const Task& task, const TaskSettings& settings)
      : arm_(arm), table_(table), roadmap_(roadmap), task_(task), settings_(settings) {}

  tl::expected<TaskPlan, Status> plan(const Eigen::VectorXd& start);

 private:
  tl::expected<TaskPlan, Status> plan_between(const Eigen::VectorXd& start, const Hold& grasp,
                                              const std::vector<Hold>& places,
                                              double margin_m) const;
  /// @param near  a posture above it, from which holds are sought; null: all are
  tl::expected<std::vector<Hold>, Status> holds_at(const Eigen::Vector3d& center,
                                                   const std::string& what,
                                                   const Eigen::VectorXd* near);
  /// The free straight way by `by_W` from q, the hand not turned, or if it must be, about the
  /// vertical.
  std::optional<Way> straight(const Eigen::VectorXd& q, const Eigen::Vector3d& by_W,
                              CollisionChecker& checker) const;
  std::vector<Hold> holds_of(const Way& postures, double share, CollisionChecker& empty_handed,
                             std::array<std::size_t, 2>& failed);
  double wide_margin() const { return std::max(settings_.margin_m, settings_.wide_margin_m); }
  tl::expected<FoundPath, Status> find(const Obstacles& obstacles, double margin_m,
                                       const Eigen::VectorXd& from, const Way& goals,
                                       const PostureCost& cost) const;
  Obstacles carrying(bool on_its_support) const;
  double passing_cost(const Eigen::VectorXd& q) const;
  /// Up, as the hand sees it.
  Eigen::Vector3d up_in_E(const Eigen::VectorXd& q) const {
    return kin::end_effector(arm_, q).linear().row(2);
  }
  std::vector<kin::Ball> held_balls(const Eigen::VectorXd& q) const;
  bool add_motion(TaskPlan& plan, Phase phase, const Way& waypoints, const Obstacles& obstacles,
                  double speed, double margin_m) const;

  const kin::ArmModel& arm_;
  const kin::Table& table_;
  const Roadmap& roadmap_;
  const Task& task_;
  const TaskSettings& settings_;
  Eigen::Vector3d lean_ = Eigen::Vector3d::Zero();  // of the hand at every hold [rad, in E]
  std::vector<kin::Ball> held_;                     // in E, the same at every hold
};

bool certified(CollisionChecker& checker, const Way& way) {
  for (std::size_t i = 1; i < way.size(); ++i) {
    if (!checker.certify(way[i - 1], way[i])) return false;
  }
  return true;
}

std::optional<Way> TaskPlanner::straight(const Eigen::VectorXd& q, const Eigen::Vector3d& by_W,
                                         CollisionChecker& checker) const {
  kin::IkGoal goal = moved_hand(arm_, q, by_W);
  auto way = straight_way(arm_, q, goal, kStraightStep, settings_.interrupt);
  if (way && certified(checker, *way)) return way;
  if (by_W.head<2>().norm() > 1e-3 * by_W.norm()) return std::nullopt;
  goal.axes = {{up_in_E(q), Eigen::Vector3d::UnitZ()}};
  way = straight_way(arm_, q, goal, kStraightStep, settings_.interrupt);
  return way && certified(checker, *way) ? way : std::nullopt;
}

/// A margin wider than necessary is sought with less effort.
tl::expected<FoundPath, Status> TaskPlanner::find(const Obstacles& obstacles, double margin_m,
                                                  const Eigen::VectorXd& from, const Way& goals,
                                                  const PostureCost& cost) const {
  CollisionChecker checker(arm_, obstacles, margin_m, settings_.interrupt);
  SearchSettings search = settings_.search;
  if (margin_m > settings_.margin_m) {
    search.max_waves = std::min(search.max_waves, kWideWaves);
    search.max_branches = std::min(search.max_branches, kWideBranches);
  }
  return find_path(roadmap_, checker, from, goals, cost, search);
}

std::vector<kin::Ball> TaskPlanner::held_balls(const Eigen::VectorXd& q) const {
  const Eigen::Isometry3d X_EW = kin::end_effector(arm_, q).inverse();
  std::vector<kin::Ball> balls =
      cylinder_balls(table_.object, table_.object_radius, table_.object_height);
  for (auto& ball : balls) ball.center = X_EW * ball.center;
  return balls;
}

Obstacles TaskPlanner::carrying(bool on_its_support) const {
  Obstacles obstacles{
      table_.balls, closed_passages(table_, task_.transport), held_, {}, table_.hulls};
  auto& boxes = on_its_support ? obstacles.supports : obstacles.boxes;
  boxes.insert(boxes.end(), table_.boxes.begin(), table_.boxes.end());
  return obstacles;
}

double TaskPlanner::passing_cost(const Eigen::VectorXd& q) const {
  const Eigen::Vector3d from_bar = kin::end_effector(arm_, q).translation() - table_.bar_center;
  const bool near = std::abs(from_bar.x()) < 0.2 && std::abs(from_bar.y()) < table_.bar_half_width;
  const bool as_decided = (from_bar.z() > 0.0) == (task_.transport == Transport::above);
  const bool preselected = std::ranges::any_of(
      task_.preselected, [&](const auto& p) { return (p - q).norm() < kPreselected; });
  return (near && as_decided) || preselected ? settings_.preference : 1.0;
}

tl::expected<std::vector<Hold>, Status> TaskPlanner::holds_at(const Eigen::Vector3d& center,
                                                              const std::string& what,
                                                              const Eigen::VectorXd* near) {
  const Interrupt& interrupt = settings_.interrupt;
  interrupt.enter(fmt::format("postures at {} were sought", what));
  CollisionChecker empty_handed(arm_, table_obstacles(table_), settings_.margin_m, interrupt);
  const kin::IkOptions options{.interrupt = interrupt};
  Way solutions;
  for (const auto& goal :
       grasp_goals(task_.grip, center, table_.object_height, settings_.precision_depth_m, lean_)) {
    Way some;
    if (near == nullptr) {
      some = kin::solve_ik_anywhere(arm_, goal, settings_.ik_attempts, settings_.roadmap.seed,
                                    options);
    } else if (auto q = kin::solve_ik(arm_, goal, *near, options);
               q && (*q - *near).norm() < kHoldNear) {
      some.push_back(*std::move(q));
    }
    solutions.insert(solutions.end(), some.begin(), some.end());
  }
  if (solutions.empty()) return tl::unexpected(Status{"no posture reaches " + what});

  Way free, in_contact;
  for (const auto& q : solutions) (empty_handed.free(q) ? free : in_contact).push_back(q);
  if (free.empty())
    return tl::unexpected(
        Status{"no free posture at " + what + ": " + why_inhibited(empty_handed, in_contact)});
  if (held_.empty()) held_ = held_balls(free.front());
  std::array<std::size_t, 2> failed{};
  for (const double share : kShares) {
    std::array<std::size_t, 2> with_share{};
    auto holds = holds_of(free, share, empty_handed, with_share);
    if (interrupt.told()) break;
    if (!holds.empty()) return holds;
    if (share == 1.0) failed = with_share;
  }
  return tl::unexpected(
      Status{fmt::format("{} of {} postures at {} are free, but the straight way to it ({:.0f} mm) "
                         "fails at {} of them, "
                         "the way up from it ({:.0f} mm) at {}",
                         free.size(), solutions.size(), what, 1e3 * settings_.approach_m, failed[0],
                         1e3 * settings_.lift_m, failed[1])});
}

/// Those of these postures from which the ways of this share of their lengths are free.
/// @param failed  is counted: ways from the object, ways up
std::vector<Hold> TaskPlanner::holds_of(const Way& postures, double share,
                                        CollisionChecker& empty_handed,
                                        std::array<std::size_t, 2>& failed) {
  const Interrupt& interrupt = settings_.interrupt;
  CollisionChecker wide_empty_handed(arm_, table_obstacles(table_), wide_margin(), interrupt);
  CollisionChecker holding(arm_, carrying(true), settings_.margin_m, interrupt);
  CollisionChecker wide_holding(arm_, carrying(true), wide_margin(), interrupt);
  std::vector<Hold> holds;
  for (const auto& q : postures) {
    if (interrupt.now()) break;
    const Eigen::Vector3d back = kin::end_effector(arm_, q).linear().col(2);
    auto away = straight(q, -share * settings_.approach_m * back, empty_handed);
    auto up = straight(q, {0.0, 0.0, share * settings_.lift_m}, holding);
    failed[0] += !away;
    failed[1] += !up;
    if (!away || !up) continue;
    const bool wide = certified(wide_empty_handed, *away) && certified(wide_holding, *up);
    holds.push_back(
        {q, std::move(*away), std::move(*up), wide ? wide_margin() : settings_.margin_m});
  }
  return holds;
}

/// False if the motion cannot be stopped somewhere, however slow it is.
bool TaskPlanner::add_motion(TaskPlan& plan, Phase phase, const Way& waypoints,
                             const Obstacles& obstacles, double speed, double margin_m) const {
  if (path_length(waypoints) < 1e-9) return true;
  settings_.interrupt.enter("a motion was timed");
  auto motion = timed_motion(arm_, phase, waypoints, obstacles, speed, settings_, margin_m);
  if (!motion) return false;
  plan.path_length_rad += motion->length_rad;
  plan.motions.push_back(std::move(*motion));
  return true;
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
  Status failure;
  const auto& known = task_.preselected;
  tl::expected<std::vector<Hold>, Status> grasps, places;
  for (const Eigen::Vector3d& lean : leans(task_.grip, settings_.lean_rad)) {
    if (settings_.interrupt.told()) break;
    lean_ = lean;
    held_.clear();
    grasps = holds_at(table_.object, "the object", known.empty() ? nullptr : &known.front());
    if (grasps)
      places = holds_at(goal->position, "the " + task_.goal + " goal",
                        known.empty() ? nullptr : &known.back());
    if (grasps && places) break;
    if (failure.reason.empty()) failure = grasps ? places.error() : grasps.error();
    if (!known.empty()) break;
  }
  if (!grasps || !places) return tl::unexpected(failure);
  std::stable_sort(grasps->begin(), grasps->end(), [&](const Hold& a, const Hold& b) {
    return a.margin_m != b.margin_m
               ? a.margin_m > b.margin_m
               : (a.away.back() - start).norm() < (b.away.back() - start).norm();
  });

  for (const double margin_m : {wide_margin(), settings_.margin_m}) {
    for (std::size_t i = 0;
         i < std::min(kGraspTries, grasps->size()) && !settings_.interrupt.told(); ++i) {
      auto plan = plan_between(start, (*grasps)[i], *places, margin_m);
      if (plan) return plan;
      failure = plan.error();
    }
    if (margin_m == settings_.margin_m) break;
  }
  settings_.interrupt.keep(std::move(*grasps));
  settings_.interrupt.keep(std::move(*places));
  return tl::unexpected(failure);
}

/// The motions with this grasp. @param margin_m  of the transport; the others have what they can
tl::expected<TaskPlan, Status> TaskPlanner::plan_between(const Eigen::VectorXd& start,
                                                         const Hold& grasp,
                                                         const std::vector<Hold>& places,
                                                         double margin_m) const {
  const Obstacles supported = carrying(true), carried = carrying(false);
  Obstacles with_object = table_obstacles(table_);
  const auto object = cylinder_balls(table_.object, table_.object_radius, table_.object_height);
  with_object.balls.insert(with_object.balls.end(), object.begin(), object.end());

  Way above_places;  // where the object stands as it stood
  std::vector<const Hold*> place_of;
  const bool wide_places =
      margin_m > settings_.margin_m &&
      std::ranges::any_of(places, [&](const Hold& place) { return place.margin_m >= margin_m; });
  for (const Hold& place : places) {
    if (up_in_E(place.q).dot(up_in_E(grasp.q)) < 0.999) continue;
    if (wide_places && place.margin_m < margin_m) continue;
    above_places.push_back(place.up.back());
    place_of.push_back(&place);
  }
  if (above_places.empty())
    return tl::unexpected(
        Status{"no posture at the " + task_.goal + " goal puts the object down upright"});
  settings_.interrupt.enter("the transport was sought");
  const auto transport = find(carried, margin_m, grasp.up.back(), above_places,
                              [this](const Eigen::VectorXd& q) { return passing_cost(q); });
  if (!transport) {
    return tl::unexpected(
        Status{"transport " + std::string(task_.transport == Transport::above ? "above" : "below") +
               " the bar to the " + task_.goal + " goal: " + transport.error().reason});
  }
  const Way before{grasp.away.back()};
  settings_.interrupt.enter("the reach was sought");
  double reach_margin_m = wide_margin();
  auto reach = find(with_object, reach_margin_m, start, before, {});
  if (!reach) {
    reach_margin_m = settings_.margin_m;
    reach = find(with_object, reach_margin_m, start, before, {});
  }
  if (!reach) return tl::unexpected(Status{"reach for the object: " + reach.error().reason});
  const Hold& place = *place_of[static_cast<std::size_t>(transport->goal)];
  TaskPlan plan;
  plan.roadmap_nodes = std::max({reach->nodes, transport->nodes, roadmap_.size()});
  const double fast = settings_.speed, gentle = settings_.contact_speed;
  const double grasp_m = grasp.margin_m, place_m = place.margin_m;
  const Obstacles alone = table_obstacles(table_);
  if (add_motion(plan, Phase::reach, reach->waypoints, with_object, fast, reach_margin_m) &&
      add_motion(plan, Phase::approach, reversed(grasp.away), alone, gentle, grasp_m) &&
      add_motion(plan, Phase::transport, grasp.up, supported, gentle, grasp_m) &&
      add_motion(plan, Phase::transport, transport->waypoints, carried, fast, margin_m) &&
      add_motion(plan, Phase::transport, reversed(place.up), supported, gentle, place_m) &&
      add_motion(plan, Phase::retreat, place.away, alone, gentle, place_m)) {
    for (PlannedMotion& motion : plan.motions) {
      if (motion.phase == Phase::reach) motion.found_by = reach->by;
      if (motion.phase == Phase::transport && motion.obstacles.supports.empty())
        motion.found_by = transport->by;
    }
    return plan;
  }
  return tl::unexpected(Status{"a motion cannot be stopped without touching something"});
}

/// Where the middle of the held object is at a sample of the motion, in W.
Eigen::Vector3d held_center(const kin::ArmModel& arm, const PlannedMotion& motion,
                            Eigen::Index sample) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const kin::Ball& ball : motion.obstacles.held) sum += ball.center;
  return kin::end_effector(arm, motion.trajectory.position.col(sample)) *
         (sum / static_cast<double>(motion.obstacles.held.size()));
}

}  // namespace

double stop_delay_s(const kin::ArmModel& arm, double period_s) {
  return (1 + arm.extrapolated_cycles) * period_s;
}

std::optional<PlannedMotion> timed_motion(const kin::ArmModel& arm, Phase phase,
                                          const std::vector<Eigen::VectorXd>& waypoints,
                                          const Obstacles& obstacles, double speed,
                                          const TaskSettings& settings, double margin_m,
                                          const SmoothPath::Accept& corners) {
  margin_m = std::max(margin_m, settings.margin_m);
  CollisionChecker checker(arm, obstacles, margin_m, settings.interrupt);
  CollisionChecker stops(arm, obstacles, kStopMargin * settings.margin_m, settings.interrupt);
  const SmoothPath path(
      waypoints, settings.corner_rad,
      [&](const Eigen::MatrixXd& curve) {
        return (!corners || corners(curve)) && checker.certify_curve(curve);
      },
      settings.interrupt);
  const double alone_s = stop_alone_s(settings.period_s);
  auto motion = time_optimal(
      path, speed * arm.v_max, speed * arm.a_max, settings.period_s,
      [&](Stops those) {
        those.v0 *= kPace;
        those.v1 *= kPace;
        those.a = arm.a_max;
        those.delay_s = stop_delay_s(arm, settings.period_s) / kPace;
        those.alone_s = alone_s;
        return stops.certify_stops(those);
      },
      kPace * alone_s, kJerk * arm.j_max, settings.interrupt, stops.has_parts() ? kMostPieces : 1);
  if (!motion) return std::nullopt;
  return PlannedMotion{phase,         path.curves(), obstacles,    std::move(*motion),
                       path.length(), margin_m,      FoundBy::line};
}

std::vector<Eigen::VectorXd> carried_postures(const TaskPlan& plan, int count) {
  // Lifting and lowering are straight and short.
  const auto carried = std::ranges::max_element(plan.motions, {}, [](const PlannedMotion& m) {
    return m.phase == Phase::transport ? m.length_rad : -1.0;
  });
  const Eigen::MatrixXd& q = carried->trajectory.position;
  std::vector<double> length{0.0};
  for (Eigen::Index k = 1; k < q.cols(); ++k) {
    length.push_back(length.back() + (q.col(k) - q.col(k - 1)).norm());
  }
  std::vector<Eigen::VectorXd> postures;
  for (int i = 0; i < count; ++i) {
    const double at = length.back() * i / std::max(1, count - 1);
    const auto k = std::ranges::lower_bound(length, at - 1e-12) - length.begin();
    postures.emplace_back(q.col(std::min(static_cast<Eigen::Index>(k), q.cols() - 1)));
  }
  return postures;
}

Roadmap prepare_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                        const TaskSettings& settings) {
  settings.interrupt.enter("the roadmap was built");
  CollisionChecker checker(arm, table_obstacles(table), settings.margin_m, settings.interrupt);
  std::vector<Eigen::Vector3d> targets{table.object};
  for (const auto& goal : table.goals) targets.push_back(goal.position);
  const Eigen::MatrixXd starts =
      sample_box(arm.q_min, arm.q_max, settings.reaching_starts, settings.roadmap.seed + 1);
  Way postures;
  for (const auto& target : targets) {
    for (const Grip grip : {Grip::precision, Grip::full}) {
      const auto goal =
          grasp_goals(grip, target, table.object_height, settings.precision_depth_m).front();
      for (Eigen::Index i = 0; i < starts.cols() && !settings.interrupt.told(); ++i) {
        const Way way = reaching_postures(arm, starts.col(i), goal, settings.reaching_postures,
                                          settings.interrupt);
        postures.insert(postures.end(), way.begin(), way.end());
      }
    }
  }
  Eigen::MatrixXd more(arm.dof(), static_cast<Eigen::Index>(postures.size()));
  for (std::size_t i = 0; i < postures.size(); ++i)
    more.col(static_cast<Eigen::Index>(i)) = postures[i];
  return build_roadmap(checker, more, settings.roadmap);
}

std::shared_ptr<const Roadmap> refreshed_roadmap(std::shared_ptr<const Roadmap> known,
                                                 const kin::ArmModel& arm, const kin::Table& table,
                                                 const TaskSettings& settings) {
  settings.interrupt.enter("the roadmap was refined");
  CollisionChecker checker(arm, table_obstacles(table), settings.margin_m, settings.interrupt);
  const std::vector<char> free = checker.free_columns(known->nodes());
  const auto inhibited = static_cast<double>(std::count(free.begin(), free.end(), 0));
  const double share = settings.roadmap.refinement.inhibited_share;
  if (inhibited < share * static_cast<double>(free.size())) return known;
  auto refined =
      std::make_shared<const Roadmap>(refined_roadmap(checker, known->nodes(), settings.roadmap));
  return settings.interrupt.told() ? known : refined;
}

tl::expected<TaskPlan, Status> plan_task(const kin::ArmModel& arm, const kin::Table& table,
                                         const Roadmap& roadmap, const Eigen::VectorXd& start,
                                         const Task& task, const TaskSettings& settings) {
  auto plan = TaskPlanner(arm, table, roadmap, task, settings).plan(start);
  if (!plan && !task.preselected.empty()) {
    Task free = task;  // here what succeeded elsewhere does not
    free.preselected.clear();
    plan = TaskPlanner(arm, table, roadmap, free, settings).plan(start);
  }
  if (settings.interrupt.told()) return tl::unexpected(settings.interrupt.reason());
  return plan;
}

Obstacles moved_obstacles(const kin::Table& planned, const kin::Table& now, double tolerance_m) {
  Obstacles moved;
  for (const kin::Ball& ball : now.balls) {
    const bool known =
        std::any_of(planned.balls.begin(), planned.balls.end(), [&](const kin::Ball& b) {
          return (b.center - ball.center).norm() + std::max(0.0, ball.radius - b.radius) <=
                 tolerance_m;
        });
    if (!known) moved.balls.push_back(ball);
  }
  for (const kin::Box& box : now.boxes) {
    const bool known =
        std::any_of(planned.boxes.begin(), planned.boxes.end(), [&](const kin::Box& b) {
          return ((b.center - box.center).cwiseAbs() +
                  (box.half_extent - b.half_extent).cwiseMax(0.0))
                     .norm() <= tolerance_m;
        });
    if (!known) moved.boxes.push_back(box);
  }
  for (const kin::Hull& hull : now.hulls) {
    const math::ConvexPart& at = hull.shape;
    const bool known =
        std::any_of(planned.hulls.begin(), planned.hulls.end(), [&](const kin::Hull& h) {
          const math::ConvexPart& was = h.shape;
          return was.points.rows() == at.points.rows() &&
                 (was.points - at.points).rowwise().norm().maxCoeff() +
                         std::max(0.0, at.radius - was.radius) <=
                     tolerance_m;
        });
    if (!known) moved.hulls.push_back(hull);
  }
  return moved;
}

bool keeps_clear(const kin::ArmModel& arm, const kin::Table& table, const TaskPlan& plan,
                 std::size_t first, const Obstacles& moved, double margin_m) {
  for (std::size_t i = first; i < plan.motions.size(); ++i) {
    const PlannedMotion& motion = plan.motions[i];
    Obstacles obstacles{moved.balls, moved.boxes, motion.obstacles.held, {}, moved.hulls};
    if (!motion.obstacles.supports.empty()) {
      // The object may stand on what moved, as on any box: not its balls count, which reach into
      // the box, but the upright cylinder that it sweeps.
      obstacles.supports.swap(obstacles.boxes);
      kin::Table swept;
      swept.boxes = moved.boxes;
      swept.object_radius = table.object_radius + margin_m;
      const Eigen::Vector3d from = held_center(arm, motion, 0),
                            to = held_center(arm, motion, motion.trajectory.samples() - 1);
      swept.object_height = table.object_height + std::abs(to.z() - from.z());
      if (place_blocked(swept, 0.5 * (from + to))) return false;
    }
    CollisionChecker checker(arm, obstacles, margin_m);
    for (const auto& curve : motion.curves) {
      if (!checker.certify_curve(curve)) return false;
    }
  }
  return true;
}

}  // namespace mimesis::planner
