#include "nodes/synthesizer/biped/biped_sequence.h"

#include <algorithm>
#include <cmath>

namespace mimesis::synthesizer {
namespace {

constexpr double kMoved_m = 0.003;     // of a drawer that is seen
constexpr double kMargin_rad = 0.005;  // from the joints' limits

}  // namespace

BipedDrawer make_biped_drawer(const robot::Biped& biped, const DrawerData& data,
                              const DrawerModelOptions& options) {
  const retarget::RobotFigure figure = retarget::figure_of(biped);
  BipedDrawer made{.upper = upper_body_tree(biped.tree, figure),
                   .figure = figure,
                   .drawer = data.drawer,
                   .size = robot::drawer_size(biped),
                   .plan = robot_step_plan(biped),
                   .pelvis_height_m = easy_pelvis_height(biped.tree, figure),
                   .feet_distance_m = biped.feet_distance_m,
                   .gripper = {},
                   .actions = LearnedActions(data, options)};
  for (const robot::Side side : robot::kSides) {
    const int dof = biped.gripper[side].dof;
    if (dof >= 0) made.gripper[side] = biped.tree.moved(dof).joint;
  }
  return made;
}

BipedDrawer make_biped_drawer(const robot::Biped& biped, const RobotTrialSettings& settings,
                              const DrawerModelOptions& options) {
  return make_biped_drawer(biped, generate_robot_data(biped, settings), options);
}

BipedDrawer make_biped_drawer(const robot::Biped& biped) {
  return make_biped_drawer(biped, robot_trial_settings(biped));
}

tl::expected<BipedDrawerSequence, Status> BipedDrawerSequence::start(
    const BipedDrawer& drawer, const BipedTask& task, const RobotFeedback& robot,
    const BipedSequenceOptions& options) {
  BipedDrawerSequence sequence(drawer, task, robot, options);
  sequence.replan();
  if (!sequence.state_.refused.empty()) {
    return tl::make_unexpected(Status{sequence.state_.refused});
  }
  sequence.begin_action();
  sequence.current_ = sequence.wanted_;
  return sequence;
}

BipedDrawerSequence::BipedDrawerSequence(const BipedDrawer& drawer, const BipedTask& task,
                                         const RobotFeedback& robot,
                                         const BipedSequenceOptions& options)
    : drawer_(&drawer),
      task_(task),
      options_(options),
      plan_settings_(options.plan.value_or(drawer.plan)),
      robot_(robot),
      believed_(options.step_s, options.shift_s, options.dt_s),
      clock_(options.step_s, options.dt_s),
      kinematics_(drawer.upper) {
  origin_ = 0.5 * (robot.feet[0].p_W_m + robot.feet[1].p_W_m);
  const Eigen::Vector2d way = task.front_W_m - origin_;
  heading_ = std::atan2(way.y(), way.x());
  front_m_ = way.norm();
  believed_.place(robot);
  last_swing_ = robot.swing;
  last_steps_ = robot.steps;
  was_moving_ = robot.moves();
  from_stand_ = !was_moving_;
  const Eigen::Index joints = drawer.upper.dof();
  state_.q = Eigen::VectorXd::Zero(joints);
  for (const auto& [joint, angle] : drawer.figure.start_rad) {
    if (const int i = drawer.upper.find_joint(joint); i >= 0) state_.q[i] = angle;
  }
  aim_ = state_.q;
  state_.dq = offset_ = offset_rate_ = Eigen::VectorXd::Zero(joints);
  lower_ = drawer.upper.lower().array() + kMargin_rad;
  upper_ = drawer.upper.upper().array() - kMargin_rad;
  rows_ = soon_ = Eigen::VectorXd::Zero(drawer.actions.row_count());
  for (const std::size_t side : {0u, 1u}) {
    wrist_[side] = drawer.upper.require_link(drawer.figure.wrist[side]);
    Hand& hand = hand_[side];
    if (drawer.gripper[side].empty()) continue;
    hand.gripper = drawer.upper.require_joint(drawer.gripper[side]);
    // it opens to the nearer limit and closes towards the other one
    const double low = lower_[hand.gripper], high = upper_[hand.gripper];
    const bool high_opens = std::abs(high) < std::abs(low);
    hand.open_rad = 0.8 * (high_opens ? high : low);
    hand.closed_rad = 0.5 * (high_opens ? low : high);
  }
  state_.number = -1;
  previous_length_m_ = plan_settings_.normal_m;
}

void BipedDrawerSequence::set_posture(const Eigen::VectorXd& q) {
  state_.q = aim_ = q;
  state_.dq.setZero();
  fade_begins_ = true;
}

Eigen::Vector2d BipedDrawerSequence::on_way(const Eigen::Vector2d& p_W_m) const {
  return Eigen::Rotation2Dd(-heading_) * (p_W_m - origin_);
}

Eigen::Vector2d BipedDrawerSequence::in_world(const Eigen::Vector2d& p_way_m) const {
  return origin_ + Eigen::Rotation2Dd(heading_) * p_way_m;
}

/// The robot stands the nearer, the deeper the object lies: its reach grows less than the depth.
double BipedDrawerSequence::comfortable_m() const {
  return std::clamp(drawer_->size.reach_m(task_.object_depth_m) - task_.object_depth_m,
                    drawer_->actions.ranges().nearest_stand_m,
                    drawer_->actions.ranges().farthest_stand_m);
}

std::string BipedDrawerSequence::set_task(const BipedTask& task) {
  if (task == task_) return {};
  const Eigen::Vector2d way = on_way(task.front_W_m);
  if (across(task.front_W_m)) {
    return "the drawer moved " + std::to_string(way.y()) + " m across the way to it";
  }
  front_m_ = way.x();
  front_across_m_ = way.y();
  task_ = task;
  task_changed_ = true;
  state_.done = false;
  return {};
}

void BipedDrawerSequence::see_drawer(const DrawerSeen* seen) {
  if (seen == nullptr || seen->taken) return;
  BipedTask task = task_;
  if ((seen->front_W_m - task_.front_W_m).norm() > kMoved_m) task.front_W_m = seen->front_W_m;
  const double depth =
      on_way(seen->object_W_m.head<2>()).x() + seen->opened_m - on_way(seen->front_W_m).x();
  if (std::abs(depth - task_.object_depth_m) > kMoved_m) task.object_depth_m = depth;
  set_task(task);  // one that moved across stays where it was: see across()
}

const BipedSequenceState& BipedDrawerSequence::step(const RobotFeedback* robot,
                                                    const DrawerSeen* seen) {
  state_.time_s += options_.dt_s;
  see_drawer(seen);
  see(robot);
  if (seen != nullptr && seen->hand_W_m) {
    robot_.hand_W_m = *seen->hand_W_m;
    robot_.hands_known = true;
  }
  advance_phase(seen);
  move_upper_body();
  wish_velocity();
  wish_landings();
  start_hands();
  move_hands(seen);
  state_.distance_m = front_m_ - middle_m();
  return state_;
}

}  // namespace mimesis::synthesizer
