#include "nodes/planner/planner_node.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <chrono>
#include <cmath>
#include <utility>

#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "common/robot/convex_parts.h"
#include "common/runtime/bus.h"
#include "common/runtime/log.h"

namespace mimesis::planner {

Task to_task(v1::Grip grip, v1::Transport transport, v1::Goal goal) {
  return {model::from_proto(grip), model::from_proto(transport),
          std::string(task::word(model::from_proto(goal)))};
}

std::optional<Order> to_decided(const v1::Decision& decision) {
  if (!decision.settled() || decision.grip() == v1::GRIP_UNSPECIFIED ||
      decision.transport() == v1::TRANSPORT_UNSPECIFIED ||
      decision.goal() == v1::GOAL_UNSPECIFIED) {
    return std::nullopt;
  }
  Task task = to_task(decision.grip(), decision.transport(), decision.goal());
  for (const v1::Posture& p : decision.preselected()) {
    task.preselected.emplace_back(
        Eigen::VectorXd::Map(p.position_rad().data(), p.position_rad_size()));
  }
  return Order{std::move(task), decision.decided_ns() + 1};  // 0 stands for no decision
}

std::optional<ArmReading> to_reading(const v1::JointState& state, int dof) {
  if (state.position_rad_size() != dof) return std::nullopt;
  return ArmReading{Eigen::VectorXd::Map(state.position_rad().data(), dof), state.operational(),
                    state.fault()};
}

HandReading to_reading(const v1::HandState& state) {
  return {state.closure(), state.moving(), state.object_detected(), state.active(), state.fault()};
}

v1::TaskState to_proto(TaskSequence::State state) {
  switch (state) {
    case TaskSequence::State::idle:
      return v1::TASK_STATE_IDLE;
    case TaskSequence::State::planning:
      return v1::TASK_STATE_PLANNING;
    case TaskSequence::State::executing:
      return v1::TASK_STATE_EXECUTING;
    case TaskSequence::State::done:
      return v1::TASK_STATE_DONE;
    case TaskSequence::State::failed:
      return v1::TASK_STATE_FAILED;
  }
  return v1::TASK_STATE_UNSPECIFIED;
}

v1::TaskPhase to_proto(Phase phase) {
  switch (phase) {
    case Phase::reach:
      return v1::TASK_PHASE_REACH;
    case Phase::approach:
      return v1::TASK_PHASE_APPROACH;
    case Phase::grasp:
      return v1::TASK_PHASE_GRASP;
    case Phase::transport:
      return v1::TASK_PHASE_TRANSPORT;
    case Phase::release:
      return v1::TASK_PHASE_RELEASE;
    case Phase::retreat:
      return v1::TASK_PHASE_RETREAT;
  }
  return v1::TASK_PHASE_UNSPECIFIED;
}

v1::TaskStatus to_status(const TaskSequence& sequence, int carried) {
  v1::TaskStatus status;
  status.set_state(to_proto(sequence.state()));
  if (sequence.state() == TaskSequence::State::executing)
    status.set_phase(to_proto(sequence.phase()));
  if (sequence.order_id() >= kOfTicket) status.set_ticket(sequence.order_id() - kOfTicket);
  if (const Task* task = sequence.task(); task != nullptr && sequence.order_id() != 0) {
    status.set_grip(model::to_proto(task->grip));
    status.set_transport(model::to_proto(task->transport));
    status.set_goal(task->goal == "high" ? v1::GOAL_HIGH : v1::GOAL_LOW);
  }
  status.set_reason(sequence.reason());
  status.set_plan_succeeded(sequence.plan_succeeded());
  if (const auto& plan = sequence.plan()) {
    status.set_path_length_rad(plan->path_length_rad);
    status.set_roadmap_nodes(static_cast<std::uint32_t>(plan->roadmap_nodes));
    if (carried > 0) {
      for (const Eigen::VectorXd& q : carried_postures(*plan, carried)) {
        status.add_carried()->mutable_position_rad()->Add(q.begin(), q.end());
      }
    }
  }
  return status;
}

v1::Trajectory to_proto(const PlannedMotion& motion) {
  v1::Trajectory trajectory;
  trajectory.set_phase(to_proto(motion.phase));
  const JointTrajectory& samples = motion.trajectory;
  for (Eigen::Index k = 0; k < samples.samples(); ++k) {
    v1::TrajectoryPoint& point = *trajectory.add_points();
    point.set_time_from_start_ns(
        static_cast<std::uint64_t>(std::llround(static_cast<double>(k) * samples.period_s * 1e9)));
    for (Eigen::Index j = 0; j < samples.position.rows(); ++j) {
      point.add_position_rad(samples.position(j, k));
      point.add_velocity_rad_s(samples.velocity(j, k));
    }
  }
  return trajectory;
}

double PlannerParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

TaskSettings task_settings(const PlannerParams& p) {
  TaskSettings s;
  s.roadmap = {p.roadmap_nodes, p.neighbours, static_cast<std::uint64_t>(p.seed), {}};
  s.search.neighbours = p.neighbours;
  s.search.seed = static_cast<std::uint64_t>(p.seed);
  s.margin_m = p.margin_m;
  s.wide_margin_m = p.wide_margin_m;
  s.approach_m = p.approach_m;
  s.lift_m = p.lift_m;
  s.precision_depth_m = p.precision_depth_m;
  s.lean_rad = p.lean_rad;
  s.speed = p.speed;
  s.contact_speed = p.contact_speed;
  s.period_s = 1.0 / p.rate_hz;
  return s;
}

namespace {

constexpr std::chrono::milliseconds kSeenPeriod{200}, kPosePeriod{40};  // of drawings
constexpr double kVisible = 0.01;  // change of the hand's closure that is drawn [1]

SequenceSettings sequence_settings(const PlannerParams& p, const kin::ArmModel& arm) {
  SequenceSettings s;
  s.period_s = 1.0 / p.rate_hz;
  s.ready_s = p.ready_s;
  s.hand_s = p.hand_s;
  s.has_hand = p.has_hand;
  s.tracking_rad = p.tracking_rad;
  s.object_moved_m = p.object_moved_m;
  s.grip_force = p.grip_force;
  s.a_max_rad_s2 = 0.95 * arm.a_max;  // the rest is for the rounding of periods
  // A body that moves by less than half the margin uses up no more of it.
  s.keeps_clear = [arm, margin = p.margin_m](const TaskPlan& plan, std::size_t first,
                                             const kin::Table& planned, const kin::Table& now) {
    const Obstacles moved = moved_obstacles(planned, now, 0.5 * margin);
    return (moved.balls.empty() && moved.boxes.empty() && moved.hulls.empty()) ||
           keeps_clear(arm, planned, plan, first, moved, 0.5 * margin);
  };
  return s;
}

template <class T>
const T* pointer(const std::optional<T>& value) {
  return value ? &*value : nullptr;
}

using Eigen::Vector3d;
using model::Rgba;
using model::to_eigen;

constexpr Rgba kEmpty{0.1, 0.75, 0.95, 1.0}, kHolding{0.95, 0.25, 0.85, 1.0},
    kText{0.95, 0.95, 0.95, 1.0}, kSeen{0.95, 0.75, 0.2, 0.35}, kDoubt{0.95, 0.3, 0.2, 0.6},
    kAdded{0.7, 0.55, 0.85, 1.0};
constexpr double kEvery_s = 0.02;  // a point of the way
constexpr double kAxes_m = 0.06, kLabel_m = 0.03;

/// `spread_m`: lower triangle of L by rows, L Lᵀ the covariance; nothing if it was told exactly.
void add_uncertainty(foxglove::SceneEntity& entity, const Vector3d& center,
                     const google::protobuf::RepeatedField<double>& spread_m) {
  if (spread_m.size() != 6) return;
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  for (int row = 0, k = 0; row < 3; ++row) {
    for (int column = 0; column <= row; ++column) L(row, column) = spread_m[k++];
  }
  model::add_uncertainty(entity, center, L * L.transpose(), kDoubt);
  model::add_label(entity, center + Vector3d(0.0, 0.0, 2.0 * kLabel_m), 0.7 * kLabel_m,
                   fmt::format("±{:.1f} mm", 1e3 * L.jacobiSvd().singularValues()(0)), kText);
}

}  // namespace

foxglove::SceneUpdate draw_plan(const kin::ArmModel& arm, const TaskPlan& plan,
                                std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "plan", "world", stamp);
  for (const PlannedMotion& motion : plan.motions) {
    const JointTrajectory& samples = motion.trajectory;
    const auto hand = [&](Eigen::Index k) {
      return kin::end_effector(arm, samples.position.col(k));
    };
    const auto every = std::max<Eigen::Index>(1, std::lround(kEvery_s / samples.period_s));
    auto& way = model::add_line(entity, foxglove::LinePrimitive::LINE_STRIP, 6.0,
                                motion.phase == Phase::transport ? kHolding : kEmpty);
    const Eigen::Index last = samples.samples() - 1;
    for (Eigen::Index k = 0; k < last; k += every) model::add_point(way, hand(k).translation());
    model::add_point(way, hand(last).translation());
    const auto pose = [&](const Eigen::Isometry3d& X_WE, const char* name) {
      model::add_axes(entity, X_WE, kAxes_m);
      model::add_label(entity, X_WE * Vector3d(0.0, 0.0, -kAxes_m), kLabel_m, name, kText);
    };
    if (motion.phase == Phase::approach) pose(hand(last), "grasp");
    if (motion.phase == Phase::retreat) pose(hand(0), "release");
  }
  return update;
}

foxglove::SceneUpdate draw_seen(const v1::Scene& scene, std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "seen", "world", stamp);
  if (scene.has_object()) {
    const v1::GraspObject& object = scene.object();
    const Vector3d center = to_eigen(object.position_in_world_m());
    const Vector3d half(0.0, 0.0, 0.5 * object.height_m());
    model::add_rod(entity, center - half, center + half, object.radius_m(), kSeen);
    add_uncertainty(entity, center, object.spread_m());
  }
  for (const v1::GoalPlace& goal : scene.goals()) {
    const Vector3d place = to_eigen(goal.position_in_world_m());
    model::add_ball(entity, place, goal.radius_m(), kSeen);
    add_uncertainty(entity, place, goal.spread_m());
  }
  if (scene.has_bar()) {
    const Vector3d middle = to_eigen(scene.bar().center_in_world_m());
    const Vector3d half(0.0, scene.bar().half_width_m(), 0.0);
    model::add_rod(entity, middle - half, middle + half, 0.005, kSeen);
    add_uncertainty(entity, middle, scene.bar().spread_m());
  }
  return update;
}

PlannerNode::PlannerNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      arm_(model::load_checked_arm(params.robot).arm),
      settings_(task_settings(params)),
      sequence_(sequence_settings(params, arm_)),
      job_(bus, arm_, settings_),
      decision_in_(bus, "decision", {.author = runtime::Author::first}),
      scene_in_(bus, "scene",
                {.author = runtime::Author::first, .optional = !params.table.empty()}),
      arm_in_(bus, "joint_states", {.author = runtime::Author::first}),
      hand_in_(bus, "hand", {.author = runtime::Author::first, .optional = !params.has_hand}),
      command_(bus, "command"),
      hand_command_(bus, "hand_command"),
      status_(bus, "status", {.latched = true}),
      trajectory_(bus, "trajectory"),
      requests_(bus, arm_, settings_, params.ready_s),
      plan_(bus, "plan", {.latched = true}),
      seen_(bus, "seen", {.latched = true}),
      robot_(bus, "robot", {.latched = true}),
      robot_frames_(bus, "robot_frames", {.latched = true}) {
  if (!params.table.empty()) table_ = given_ = model::load_scene(params.table);
  runtime::offer<v1::Obstacle, v1::ObstacleNames>(
      bus, "obstacle", [this](const v1::Obstacle& obstacle) { return add(obstacle); });
  for (const std::string& link : arm_.unchecked)
    runtime::warn("link '{}' has no known shape: nothing of it is checked", link);
}

void PlannerNode::step(runtime::Time now) {
  read_inputs(now);
  take_plan();
  requests_.step(now, pointer(table_), pointer(arm_reading_), roadmap_);
  advance(now);
  publish_trajectory(now);
  publish_commands(now);
  publish_status(now);
  publish_drawings(now);
}

void PlannerNode::advance(runtime::Time now) {
  const auto abort = requests_.take_abort();
  if (abort == Requests::Abort::all && decided_) begun_ = decided_->id;
  const bool decision = decided_ && decided_->id != begun_;
  const Order* order = decision ? &*decided_ : requests_.next();
  sequence_.step({order, pointer(table_), pointer(arm_reading_), pointer(hand_reading_),
                  missing(now), periods_since_last(now), abort != Requests::Abort::nothing});
  if (decision && sequence_.order_id() == decided_->id) begun_ = decided_->id;
  requests_.follow(now, sequence_, compute_s_);
  if (auto request = sequence_.take_request()) waiting_request_ = std::move(request);
  if (sequence_.state() != TaskSequence::State::planning) waiting_request_.reset();
  const bool awaited = sequence_.state() == TaskSequence::State::planning && !sequence_.plan();
  if (job_.running() && (waiting_request_ || !awaited)) job_.cancel();
  if (waiting_request_ && !job_.running()) {
    const std::string why = beyond_limits(arm_, waiting_request_->start, 0.0);
    if (!why.empty()) runtime::info("the arm starts beyond a limit: {}", why);
    job_.start(*std::exchange(waiting_request_, std::nullopt), roadmap_,
               requests_.deadline_s(sequence_.order_id()));
  }
}

void PlannerNode::read_inputs(runtime::Time now) {
  const runtime::Time stale = runtime::from_seconds(params_.stale_s);
  if (const auto* decision = decision_in_.take()) {
    if (auto decided = to_decided(*decision)) {
      auto& preselected = std::get<Task>(decided->what).preselected;
      const auto fits = [&](const Eigen::VectorXd& q) {
        return q.size() == arm_.dof() && q.allFinite();
      };
      if (!std::ranges::all_of(preselected, fits)) {
        if (unlike_.pass()) {
          runtime::warn("decision: preselected postures of {} joints, expected {}; not used",
                        preselected.front().size(), arm_.dof());
        }
        preselected.clear();
      }
      decided_ = std::move(decided);
    }
  }
  if (const auto* scene = scene_in_.take()) {
    given_ = model::from_proto(*scene);
    place_obstacles();
  }
  const auto* arm = arm_in_.fresh(now, stale);
  arm_reading_ = arm == nullptr ? std::nullopt : to_reading(*arm, arm_.dof());
  if (arm != nullptr && !arm_reading_ && unusable_.pass()) {
    runtime::warn("arm: {} positions, expected {} ({}); ignored", arm->position_rad_size(),
                  arm_.dof(), params_.robot);
  }
  const auto* hand = hand_in_.fresh(now, stale);
  hand_reading_ = hand == nullptr ? std::nullopt : std::optional(to_reading(*hand));
  if (!params_.has_hand) hand_reading_ = HandReading{.active = true, .fault = {}};
}

tl::expected<v1::ObstacleNames, Status> PlannerNode::add(const v1::Obstacle& obstacle) {
  constexpr std::size_t kMostObstacles = 256, kMostLetters = 64;
  constexpr double kMost_m = 100.0;
  const std::string& name = obstacle.name();
  if (name.empty() || name.size() > kMostLetters)
    return tl::unexpected(Status{fmt::format("name: expected 1 to {} bytes", kMostLetters)});
  const auto place = [](const v1::Vector3& p) {
    const Vector3d at = to_eigen(p);
    return at.allFinite() && at.norm() < kMost_m;
  };
  const auto length = [](double m) { return m > 0.0 && m < kMost_m; };
  for (const v1::Ball& ball : obstacle.balls()) {
    if (!place(ball.center_in_world_m()) || !length(ball.radius_m()))
      return tl::unexpected(Status{"balls: expected a place and radius_m above 0, below 100 m"});
  }
  for (const v1::Box& box : obstacle.boxes()) {
    const Vector3d half = to_eigen(box.half_extent_m());
    if (!place(box.center_in_world_m()) || !length(half.x()) || !length(half.y()) ||
        !length(half.z()))
      return tl::unexpected(
          Status{"boxes: expected a place and half_extent_m above 0, below 100 m"});
  }
  for (const v1::Hull& hull : obstacle.hulls()) {
    if (hull.points_in_world_m().empty() || !std::ranges::all_of(hull.points_in_world_m(), place) ||
        !(hull.radius_m() >= 0.0 && hull.radius_m() < kMost_m))
      return tl::unexpected(
          Status{"hulls: expected points and radius_m not below 0, all below 100 m"});
  }
  if (obstacle.balls().empty() && obstacle.boxes().empty() && obstacle.hulls().empty()) {
    if (obstacles_.erase(name) == 0)
      return tl::unexpected(Status{fmt::format("no obstacle '{}' was added", name)});
  } else if (obstacles_.size() >= kMostObstacles && !obstacles_.contains(name)) {
    return tl::unexpected(Status{fmt::format("{} obstacles were added already", kMostObstacles)});
  } else {
    obstacles_[name] = obstacle;
  }
  place_obstacles();
  undrawn_obstacles_ = true;
  v1::ObstacleNames names;
  for (const auto& [known, shapes] : obstacles_) names.add_name(known);
  return names;
}

void PlannerNode::place_obstacles() {
  if (!given_) return;  // they are placed in the first scene
  table_ = given_;
  for (const auto& [name, obstacle] : obstacles_) {
    for (const v1::Ball& ball : obstacle.balls())
      table_->balls.push_back({to_eigen(ball.center_in_world_m()), ball.radius_m()});
    for (const v1::Box& box : obstacle.boxes())
      table_->boxes.push_back(
          {to_eigen(box.center_in_world_m()), to_eigen(box.half_extent_m()), name});
    for (const v1::Hull& hull : obstacle.hulls()) {
      kin::Hull& added = table_->hulls.emplace_back();
      added.name = name;
      added.shape = {Eigen::MatrixX3d(hull.points_in_world_m_size(), 3), hull.radius_m()};
      for (int i = 0; i < hull.points_in_world_m_size(); ++i)
        added.shape.points.row(i) = to_eigen(hull.points_in_world_m(i)).transpose();
      added.cover = robot::balls_around(added.shape);
    }
  }
}

/// Input that the motion depends on and that was silent for too long. Called in every step.
std::string PlannerNode::missing(runtime::Time now) {
  if (params_.upstream_s == 0.0) return {};
  const runtime::Time oldest = runtime::from_seconds(params_.upstream_s);
  const auto* decision = decision_in_.fresh(now, oldest);
  const auto* scene = scene_in_.fresh(now, oldest);
  const bool stands = !params_.table.empty() && scene_in_.get() == nullptr;
  if (scene == nullptr && !stands) return "the scene";
  if (sequence_.order_id() >= kOfTicket) return {};  // a client's: no teacher is needed
  if (decision == nullptr) return "the decision";
  return decision->sight_lost() ? "the sight of the teacher" : "";
}

/// A step on the wall clock is late by what the machine makes of it; the motion is not: its
/// positions are those of even times. Steps may be left out.
int PlannerNode::periods_since_last(runtime::Time now) {
  const runtime::Time period = runtime::from_seconds(1.0 / params_.rate_hz);
  const runtime::Time late = (now - runtime::from_seconds(params_.offset_s)) % period;
  constexpr auto kRounding = std::chrono::microseconds(1);
  const runtime::Time even = late < kRounding || period - late < kRounding ? now : now - late;
  const double periods = even_ == runtime::Time(0)
                             ? 1.0
                             : runtime::to_seconds(even - even_) / runtime::to_seconds(period);
  even_ = even;
  return static_cast<int>(std::clamp(std::round(periods), 1.0, 1000.0));
}

void PlannerNode::take_plan() {
  auto planned = job_.take();
  if (!planned) return;
  if (planned->roadmap) roadmap_ = planned->roadmap;
  compute_s_ = planned->compute_s;
  if (waiting_request_) return;  // a newer request made this answer obsolete
  if (planned->plan) {
    runtime::info("plan of {:.2f} rad in {} motions, computed in {:.3f} s",
                  planned->plan->path_length_rad, planned->plan->motions.size(), compute_s_);
  }
  undrawn_ = planned->plan.has_value();
  sequence_.set_plan(std::move(planned->plan));
}

void PlannerNode::publish_trajectory(runtime::Time now) {
  const auto started = sequence_.started_motion();
  if (!started) return;
  v1::Trajectory trajectory = to_proto(sequence_.plan()->motions[*started]);
  trajectory_.send(trajectory, now);
}

void PlannerNode::publish_commands(runtime::Time now) {
  const auto& point = sequence_.set_point();
  if (!point) return;  // silence stops the drives
  v1::JointCommand command;
  command.mutable_position_rad()->Assign(point->q.begin(), point->q.end());
  command.mutable_ahead_rad()->Assign(point->ahead.data(),
                                      point->ahead.data() + point->ahead.size());
  command_.send(command, even_);
  if (const auto& order = sequence_.hand_order()) {
    v1::HandCommand hand;
    hand.set_grip(model::to_proto(order->grip));
    hand.set_closure(order->closure);
    hand.set_force(order->force);
    hand_command_.send(hand, now);
  }
}

/// What a planner at rest waits for, and for how long; empty: it has nothing to wait for.
std::string PlannerNode::waits_for(runtime::Time now) {
  std::string what = sequence_.awaited();
  if (what.empty() && sequence_.state() == TaskSequence::State::idle) what = "a decision";
  if (what != awaited_) awaited_since_ = now;
  awaited_ = std::move(what);
  if (awaited_.empty()) return {};
  const auto seconds = std::chrono::floor<std::chrono::seconds>(now - awaited_since_).count();
  return fmt::format("waits for {}{}", awaited_,
                     seconds > 0 ? fmt::format(", {} s so far", seconds) : "");
}

void PlannerNode::publish_status(runtime::Time now) {
  v1::TaskStatus status = to_status(sequence_, params_.carried_postures);
  status.set_plan_compute_s(compute_s_);
  const std::string waits = waits_for(now);
  const bool rests = status.reason().empty() && !waits.empty();
  if (rests) status.set_reason(waits);
  const bool changed = status.SerializeAsString() != last_status_.SerializeAsString();
  if (!changed && now < status_due_) return;
  // A busy machine makes the arm wait again and again; a wait at rest is said once.
  const bool news = rests ? awaited_since_ == now : status.reason() != last_status_.reason();
  if (status.state() != last_status_.state() ||
      (!status.reason().empty() && news && waits_.pass())) {
    runtime::info("task {}{}{}", v1::TaskState_Name(status.state()),
                  status.reason().empty() ? "" : ": ", status.reason());
  }
  last_status_ = status;
  status_due_ = now + std::chrono::seconds(1);
  status_.send(status, now);
}

void PlannerNode::publish_drawings(runtime::Time now) {
  if (std::exchange(undrawn_, false) && sequence_.plan()) {
    auto plan = draw_plan(arm_, *sequence_.plan(), now);
    plan_.send(plan, now);
  }
  if (arm_reading_ && now >= pose_due_) {
    pose_due_ = now + kPosePeriod;
    kin::forward(arm_, arm_reading_->q, X_);
    auto frames = model::to_robot_frames(arm_, X_, now);
    robot_frames_.send(frames, now);
    const double closure = hand_reading_ ? hand_reading_->closure : drawn_closure_.value_or(0.0);
    const bool hand_moves =
        arm_.parts.empty() && drawn_closure_ && std::abs(closure - *drawn_closure_) >= kVisible;
    if (!drawn_closure_ || hand_moves) {
      drawn_closure_ = closure;
      auto robot = model::to_robot(arm_, closure, now);
      robot_.send(robot, now);
    }
  }
  if (std::exchange(undrawn_obstacles_, false)) {
    foxglove::SceneUpdate update;
    foxglove::SceneEntity& entity = model::add_entity(update, "obstacles", "world", now);
    for (const auto& [name, obstacle] : obstacles_) {
      for (const v1::Ball& ball : obstacle.balls())
        model::add_ball(entity, to_eigen(ball.center_in_world_m()), ball.radius_m(), kAdded);
      for (const v1::Box& box : obstacle.boxes())
        model::add_box(entity,
                       Eigen::Isometry3d(Eigen::Translation3d(to_eigen(box.center_in_world_m()))),
                       2.0 * to_eigen(box.half_extent_m()), kAdded);
    }
    if (table_) {
      for (const kin::Hull& hull : table_->hulls)
        if (obstacles_.contains(hull.name)) model::add_hull(entity, hull.shape, kAdded);
    }
    seen_.send(update, now);
  }
  const v1::Scene* scene = scene_in_.get();
  if (scene == nullptr || now < seen_due_) return;
  seen_due_ = now + kSeenPeriod;
  auto seen = draw_seen(*scene, now);
  seen_.send(seen, now);
}

}  // namespace mimesis::planner
