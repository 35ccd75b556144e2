#include "nodes/synthesizer/robot/biped_sequence.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::synthesizer {

namespace {

// Move of the drawer that changes the task: on the way, where a new plan costs nothing, and for a
// robot that stands before it, whose hands follow handle and object by themselves.
constexpr double kMoved_m = 0.01, kMovedStanding_m = 0.03;
constexpr double kMargin_rad = 0.005;  // from the joints' limits

constexpr double kSideBySide_m = 0.05;  // feet that may stand so
constexpr double kOnGround_s = 0.05;    // after a landing, when the next foot has not yet lifted

mocap::Side other(mocap::Side side) { return side == mocap::kLeft ? mocap::kRight : mocap::kLeft; }

constexpr double kRounding_m = 1e-3;  // less is no step back

constexpr double kFade_s = 0.8, kAhead_s = 0.1;
constexpr double kLambda_1_s = 20.0;  // bandwidth of the joints' low-pass
constexpr double kJump_rad = 0.1;     // jump of the phase: a robot that begins with the other foot
constexpr double kAcceleration_m_s2 = 0.6;

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
                   .actions = ActionMaps(learn_drawer_model(data, options))};
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
    const BipedDrawer& drawer, const DrawerPlace& task, const RobotFeedback& robot,
    const BipedSequenceOptions& options) {
  BipedDrawerSequence sequence(drawer, task, robot, options);
  sequence.replan();
  if (!sequence.state_.refused.empty()) {
    return tl::make_unexpected(Status{sequence.state_.refused});
  }
  sequence.begin_action();
  sequence.course_.restart();
  return sequence;
}

BipedDrawerSequence::BipedDrawerSequence(const BipedDrawer& drawer, const DrawerPlace& task,
                                         const RobotFeedback& robot,
                                         const BipedSequenceOptions& options)
    : drawer_(&drawer),
      task_(task),
      options_(options),
      plan_settings_(options.plan.value_or(drawer.plan)),
      robot_(robot),
      believed_(options.step_s, options.shift_s, options.dt_s),
      clock_(options.step_s, options.dt_s),
      kinematics_(drawer.upper),
      course_(options.beta, options.settle_s, options.dt_s) {
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

std::string BipedDrawerSequence::set_task(const DrawerPlace& task) {
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
  DrawerPlace task = task_;
  const double least = state_.action == kStanding ? kMovedStanding_m : kMoved_m;
  if ((seen->front_W_m - task_.front_W_m).norm() > least) task.front_W_m = seen->front_W_m;
  const double depth =
      on_way(seen->object_W_m.head<2>()).x() + seen->opened_m - on_way(seen->front_W_m).x();
  if (std::abs(depth - task_.object_depth_m) > least) task.object_depth_m = depth;
  set_task(task);  // one that moved across stays where it was: see across()
}

const BipedSequenceState& BipedDrawerSequence::step(const RobotFeedback* robot,
                                                    const DrawerSeen* seen) {
  state_.time_s += options_.dt_s;
  see_drawer(seen);
  see(robot);
  advance_phase(seen);
  move_upper_body();
  wish_velocity();
  wish_landings();
  start_hands();
  look_again(seen);
  move_hands(seen);
  state_.distance_m = front_m_ - middle_m();
  return state_;
}

std::size_t BipedDrawerSequence::end_of_action(std::size_t first) const {
  while (first + 1 < plan_.steps.size() && plan_.steps[first].side != mocap::kLeft) ++first;
  return first;
}

double BipedDrawerSequence::middle_after(std::size_t step) const {
  const PlannedStep& s = plan_.steps[step];
  return 0.5 * (s.x_m + (step > 0 ? plan_.steps[step - 1].x_m : foot_m(other(s.side))));
}

bool BipedDrawerSequence::leads_back(std::size_t first) const {
  if (first >= plan_.steps.size()) return false;
  const double start = first > 0 ? middle_after(first - 1) : action_start_m_;
  return middle_after(end_of_action(first)) < start - kRounding_m;
}

std::vector<PlannedAction> BipedDrawerSequence::plan() const {
  std::vector<PlannedAction> actions;
  double start = action_start_m_;
  for (std::size_t i = 0; i < plan_.steps.size();) {
    const std::size_t end = end_of_action(i);
    const double middle = middle_after(end);
    actions.push_back({plan_.steps[end].action, middle - start, 2.0 * options_.step_s});
    start = middle;
    i = end + 1;
  }
  actions.push_back({kStanding, 0.0, drawer_->actions.ranges().standing_s});
  return actions;
}

void BipedDrawerSequence::see(const RobotFeedback* robot) {
  if (robot != nullptr) {
    robot_ = *robot;
    believed_.place(robot_);
  } else {
    believed_.step(state_.landing, !plan_.steps.empty());
    robot_ = believed_.feedback();
    robot_.hands_known = false;
  }
  clock_.step(&robot_, !plan_.steps.empty());
  const bool moving = robot_.moves();
  const bool foot_landed =
      was_moving_ && (robot_.steps != last_steps_ || !moving || robot_.swing != last_swing_);
  if (foot_landed) landed(last_swing_);
  last_swing_ = robot_.swing;
  last_steps_ = robot_.steps;
  was_moving_ = moving;
  const bool otherwise = moving && !plan_.steps.empty() && plan_.steps[0].side != robot_.swing;
  if (task_changed_ || foot_landed || otherwise) replan();
}

void BipedDrawerSequence::landed(mocap::Side side) {
  across_m_ += std::clamp(front_across_m_ - across_m_, -options_.aside_m, options_.aside_m);
  if (plan_.steps.empty() || plan_.steps.front().side != side) return;
  const bool ends = plan_.steps.front().side == mocap::kLeft;
  plan_.steps.erase(plan_.steps.begin());
  if (!ends) return;
  history_.back().length_m = middle_m() - action_start_m_;
  previous_length_m_ = history_.back().length_m;
  begin_action();
}

/// Steps from where the feet are; a foot that is about to land, from where it will.
void BipedDrawerSequence::replan() {
  const bool elsewhere = std::exchange(task_changed_, false);
  const bool moving = robot_.moves();
  if (!moving) robot_.swing = mocap::kRight;  // begins with a whole action
  FeetAlongWay feet{.support_m = foot_m(other(robot_.swing)),
                    .other_m = foot_m(robot_.swing),
                    .swing = robot_.swing,
                    .action = state_.action,
                    .stands = !moving};
  std::optional<PlannedStep> kept;
  if (moving && robot_.to_landing_s < options_.fixed_s && !plan_.steps.empty() &&
      plan_.steps[0].side == robot_.swing) {
    kept = plan_.steps[0];
    kept->x_m = on_way(robot_.landing.p_W_m).x();
    feet.other_m = feet.support_m;
    feet.support_m = kept->x_m;
    feet.swing = other(robot_.swing);
    feet.action = kept->action;
  } else if (moving && robot_.swing == mocap::kRight) {
    feet.other_m = foot_m(mocap::kRight);  // in the air: where it was does not count
  }
  const bool beside = std::abs(feet.support_m - feet.other_m) < kSideBySide_m;
  const bool on_ground = kept || robot_.to_landing_s > options_.step_s - kOnGround_s;
  const bool goes_back = !kept && !plan_.steps.empty() && plan_.steps[0].side == feet.swing &&
                         plan_.steps[0].x_m < feet.support_m - kRounding_m;
  feet.may_step_back = goes_back || (on_ground && beside);
  if (moving && feet.swing == mocap::kRight && beside && plan_.steps.size() <= (kept ? 1U : 0U)) {
    feet.stands = true;
  }
  auto plan = plan_steps(feet, front_m_, comfortable_m(), plan_settings_);
  state_.refused = plan ? "" : plan.error().reason;
  if (!plan) {
    halt();
    return;
  }
  plan_ = std::move(*plan);
  if (kept) plan_.steps.insert(plan_.steps.begin(), *kept);
  if (state_.number < 0) return;
  const bool stood = state_.action == kStanding, stands = plan_.steps.empty();
  const bool last = plan_.steps.size() <= 2 && !stands && plan_.steps[0].action == kReachingStep;
  const bool anew = stood && elsewhere;  // the drawer has moved since the robot stood
  const bool back = !stands && plan_.steps.back().x_m < feet.support_m - kRounding_m;
  if (anew || (!stands && (!last || back))) release(back);
  if (stood != stands || halted_ || anew) {
    from_stand_ = !moving;
    halted_ = false;
    begin_action();
    return;
  }
  course_.want(wanted());
  if (stands) return;
  state_.action = plan_.steps[0].action;
  history_.back() = this->plan().front();
  course_.drop_next();
  if (const Action kind = played(0); kind != kind_) {  // the arms are at something else
    kind_ = kind;
    course_.restart();
    fade_begins_ = true;
  }
}

/// No plan leads to the drawer: the robot stops as soon as it can, and its hands come back.
void BipedDrawerSequence::halt() {
  halted_ = true;
  plan_.steps.clear();
  course_.drop_next();
  release(false);
}

SolePrint BipedDrawerSequence::print(const PlannedStep& step, int steps_ahead) const {
  const double shift = (steps_ahead + 1) * options_.aside_m;
  const double across = across_m_ + std::clamp(front_across_m_ - across_m_, -shift, shift);
  const double apart = (step.side == mocap::kLeft ? 0.5 : -0.5) * drawer_->feet_distance_m;
  return {.side = step.side, .p_W_m = in_world({step.x_m, across + apart}), .yaw_rad = heading_};
}

void BipedDrawerSequence::wish_landings() {
  state_.landing = {};
  const auto& steps = plan_.steps;
  const bool moving = robot_.moves();
  state_.stands = steps.empty() || (moving && robot_.gait != RobotGait::starting &&
                                    steps.size() <= 2 && steps.front().action == kReachingStep);
  if (!steps.empty()) {
    state_.landing[0] = print(steps[0], 0);
    state_.landing[1] = steps.size() > 1 ? print(steps[1], 1) : robot_.feet[other(steps[0].side)];
  } else if (moving) {  // steps on the spot
    const mocap::Side support = other(robot_.swing);
    state_.landing[0] = print({kReachingStep, robot_.swing, foot_m(support)}, 0);
    state_.landing[1] = robot_.feet[support];
  }
}

/// The learned action that is played for the one that begins with this step: arms do not reach in
/// an action 2 after which another one follows, nor in one that leads back; it is a short action 1.
Action BipedDrawerSequence::played(std::size_t first) const {
  if (first >= plan_.steps.size()) return kStanding;
  const std::size_t end = end_of_action(first);
  const bool last = end + 1 == plan_.steps.size();
  return last && !leads_back(first) ? plan_.steps[end].action : kNormalStep;
}

/// Parameters of the action that begins with step `first` of the plan, from `start_m`. Steps back
/// were not trained: lengths are clamped to the shortest trained one, so that the upper body has
/// its posture; the pelvis' velocity is scaled to the length.
MotionParameters BipedDrawerSequence::parameters(std::size_t first, double start_m,
                                                 double previous_m) const {
  const ActionMaps& learned = drawer_->actions;
  const ActionRanges& ranges = learned.ranges();
  ActionTask task{.length_m = 0.0,
                  .duration_s = ranges.standing_s,
                  .previous_length_m = previous_m < 0.0 ? ranges.reaching.least_m : previous_m,
                  .final_distance_m = plan_.final_distance_m,
                  .object_depth_m = task_.object_depth_m,
                  .object_lateral_m = 0.0};
  const Action action = played(first);
  if (action == kStanding) return learned.at(action, task);
  const double length_m = middle_after(end_of_action(first)) - start_m;
  const double least_m = ranges.normal.least_m;
  task.length_m = length_m < 0.0 ? least_m : length_m;
  task.duration_s = 2.0 * options_.step_s;
  MotionParameters p = learned.at(action, task);
  if (action == kNormalStep && length_m < least_m) {
    p.mean_rad.tail<3>() *= length_m / least_m;
    p.weight_rad.bottomRows<3>() *= length_m / least_m;
  }
  return p;
}

MotionParameters BipedDrawerSequence::wanted() const {
  return parameters(0, action_start_m_, previous_length_m_);
}

MotionParameters BipedDrawerSequence::following() const {
  if (plan_.steps.empty()) return wanted();
  const std::size_t end = end_of_action(0);
  const double middle = middle_after(end);
  return parameters(end + 1, middle, middle - action_start_m_);
}

void BipedDrawerSequence::begin_action() {
  const bool stands = plan_.steps.empty();
  ++state_.number;
  state_.action = stands ? kStanding : plan_.steps[0].action;
  kind_ = played(0);
  state_.phase_rad = 0.0;
  waited_s_ = 0.0;
  action_start_m_ = middle_m();
  history_.push_back(plan().front());
  course_.want(wanted());
  if (state_.number > 0) course_.cross();
  if (state_.number > 1) from_stand_ = false;
  course_.drop_next();
  fade_begins_ = true;
}

void BipedDrawerSequence::stand_on(const DrawerSeen* seen) {
  const double share = state_.phase_rad / math::kTwoPi;
  const bool no_hold = share >= kPullFrom && share < kPullTo && seen != nullptr && !seen->held;
  const bool over = share >= 1.0 - 1e-9;
  const bool no_object = over && seen != nullptr && !seen->taken;
  state_.phase_rate_rad_s = no_hold || over ? 0.0 : course_.wanted().frequency_rad_s;
  state_.phase_rad = std::min(state_.phase_rad + options_.dt_s * state_.phase_rate_rad_s,
                              std::nextafter(math::kTwoPi, 0.0));
  waited_s_ = no_hold || no_object ? waited_s_ + options_.dt_s : 0.0;
  if (waited_s_ > options_.patience_s) {
    state_.refused = no_hold ? "the left hand does not get hold of the handle"
                             : "the right hand does not get the object";
    waiting_ = true;
  } else if (waited_s_ == 0.0 && waiting_) {
    state_.refused.clear();
    waiting_ = false;
  }
  state_.done = seen != nullptr ? seen->taken : over;
}

void BipedDrawerSequence::advance_phase(const DrawerSeen* seen) {
  if (halted_) {
    state_.phase_rate_rad_s = 0.0;
    return;
  }
  if (state_.action == kStanding) {
    stand_on(seen);
    return;
  }
  // the clock may be a little before or behind the landings that make the actions
  const bool second = !plan_.steps.empty() && plan_.steps[0].side == mocap::kLeft;
  const double middle = second ? 1.5 * std::numbers::pi : 0.5 * std::numbers::pi;
  const double off = std::clamp(math::wrap_pi(clock_.phase_rad() - middle), -0.5 * std::numbers::pi,
                                0.5 * std::numbers::pi);
  const double phase = std::min(middle + off, std::nextafter(math::kTwoPi, 0.0));
  if (std::abs(phase - state_.phase_rad) > kJump_rad) fade_begins_ = true;
  state_.phase_rad = phase;
  state_.phase_rate_rad_s = clock_.rate_rad_s();
}

/// The mixture's parameters now: eq. 3.23 around the boundaries of actions.
const MotionParameters& BipedDrawerSequence::mix() {
  const double phase = state_.phase_rad;
  course_.settle();
  if (state_.action != kStanding && !halted_ && !course_.has_next() && course_.near_end(phase)) {
    course_.set_next(following());
  }
  return course_.at(phase);
}

void BipedDrawerSequence::move_upper_body() {
  const MotionParameters& mixed = mix();
  const motion::MotionModel& model = drawer_->actions.model().action[0];
  mixture_at(model, mixed, state_.phase_rad, Between::cubic, rows_);
  move_grippers();
  const Eigen::Index joints = state_.q.size();
  if (fade_begins_) {
    fade_begins_ = false;
    offset_ = aim_ - rows_.head(joints);
    // rate of the joints, not of their targets: learned rows ripple where actions meet, at several
    // rad/s for some hundredths of a second, and a rate that is taken there would swing the arms
    // for kFade_s
    offset_rate_.setZero();
    if (!course_.has_previous()) {  // otherwise the transition continues as it was
      const double ahead = kAhead_s * state_.phase_rate_rad_s;
      const double soon = std::min(state_.phase_rad + ahead, std::nextafter(math::kTwoPi, 0.0));
      mixture_at(model, mixed, soon, Between::cubic, soon_);
      for (const Hand& hand : hand_) {
        if (hand.gripper >= 0) soon_[hand.gripper] = rows_[hand.gripper];
      }
      offset_rate_ = state_.dq - (soon_ - rows_).head(joints) / kAhead_s;
    }
    fade_s_ = 0.0;
  }
  fade_s_ = std::min(fade_s_ + options_.dt_s, kFade_s);
  // q̈ = λ²(u − q) − 2λq̇, exactly for a constant u
  const double dt = options_.dt_s, decay = std::exp(-kLambda_1_s * dt);
  for (Eigen::Index i = 0; i < joints; ++i) {
    const double u = std::clamp(rows_[i] + faded(offset_[i], offset_rate_[i], fade_s_, kFade_s),
                                lower_[i], upper_[i]);
    aim_[i] = u;
    const double e = state_.q[i] - u, a = state_.dq[i] + kLambda_1_s * e;
    const double next = (e + dt * a) * decay;
    state_.dq[i] = a * decay - kLambda_1_s * next;
    state_.q[i] = u + next;
  }
}

void BipedDrawerSequence::wish_velocity() {
  Eigen::Vector3d wished = rows_.tail<3>();
  if (state_.action == kStanding || halted_ || !robot_.moves() ||
      robot_.gait == RobotGait::starting) {
    wished.setZero();
  } else if (from_stand_ && state_.phase_rad < std::numbers::pi) {
    wished *= 0.5 * (1.0 - std::cos(state_.phase_rad));
  }
  const double most = kAcceleration_m_s2 * options_.dt_s;
  for (const int i : {0, 1, 2}) {
    state_.velocity[i] += std::clamp(wished[i] - state_.velocity[i], -most, most);
  }
}

}  // namespace mimesis::synthesizer
