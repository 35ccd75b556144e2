#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/robot/biped_sequence.h"
#include "nodes/synthesizer/robot/robot_walk.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFacing_rad = 0.08;  // a drawer less aside is faced
constexpr double kStep_m = 0.2;
// a robot farther away walks up to the drawer first
constexpr double kFar_m = 5.0, kBeforeFar_m = 3.0;
constexpr double kRobotFade_s = 0.8;

std::vector<std::size_t> rows_of(const std::vector<std::string>& joints,
                                 const std::vector<std::string>& rows) {
  std::vector<std::size_t> found;
  for (const std::string& joint : joints) {
    const auto row = std::ranges::find(rows, joint);
    if (row == rows.end()) throw ConfigError("the motion model has no row '" + joint + "'");
    found.push_back(static_cast<std::size_t>(row - rows.begin()));
  }
  return found;
}

/// Leads a walking robot. RobotWalk leads it to a goal, and the model's motion gives it arms and
/// trunk in the rhythm of its own steps: the leading oscillator is coupled to the robot's clock
/// [M18 eq. 3.18], and the shares of walk and stand are those of the length of its steps. To a
/// drawer, the robot stops, turns to it, and BipedDrawerSequence takes over; out of it again when
/// it has another goal. Arms and trunk go from one to the other within kRobotFade_s.
class RobotDirector : public Director {
 public:
  /// @param drawer  null: goals of that kind are refused; outlives this
  /// @throws ConfigError if the model has no row of a joint that drawer moves
  RobotDirector(const motion::MotionModel& model, const CharacterStart& start,
                const CharactersSettings& settings, const RobotLimits& limits,
                const BipedDrawer* drawer)
      : Director(model, {&start, 1}, settings),
        drawer_(drawer),
        limits_(limits),
        dt_s_(settings.walk.dt_s),
        walk_(limits, settings.walk.goal_tolerance_m, settings.walk.give_up_s, settings.walk.dt_s) {
    const RootPose& root = characters_.state(0).root;
    walk_.place(root.position_W_m, root.heading_rad);
    move_character();  // its first posture
    const auto angles = characters_.angles(0);
    angles_.assign(angles.begin(), angles.end());
    if (drawer == nullptr) return;
    tracker_.emplace(drawer->drawer.handle_lateral_m, dt_s_);
    row_ = rows_of(drawer->upper.joint_names(), characters_.repertoire().model().rows);
    left_rad_ = left_rate_ = Eigen::VectorXd::Zero(drawer->upper.dof());
  }

  bool leads_robot() const override { return true; }
  void walk_to(int, const Eigen::Vector2d& goal_W_m) override {
    leave();
    kind_ = GoalKind::walk_to;
    walk_.walk_to(goal_W_m);
  }
  void stop(int) override {
    leave();
    kind_ = GoalKind::stop;
    walk_.stop();
  }
  std::string to_drawer(int, const DrawerPlace& task) override {
    if (drawer_ == nullptr) return "no actions for drawers are loaded (parameter drawer)";
    task_ = task;
    if (kind_ == GoalKind::drawer && sequence_ && sequence_->set_task(task).empty()) return {};
    leave();
    kind_ = GoalKind::drawer;
    walk_.stop();
    return {};
  }
  /// Steps of the wished length and heading in the rhythm that the robot has; without a length 0.2
  /// m, without a heading the present one.
  void follow(int, const GaitWish& wish, std::optional<double>) override {
    if (kind_ != GoalKind::none) return;
    walk_.go_on(wish.step_length_m.value_or(kStep_m) / limits_.step_s,
                wish.heading_rad.value_or(walk_.heading_rad()));
  }
  /// The coordinator is silent: the robot stands if it has no goal.
  void release(int) override {
    if (kind_ == GoalKind::none) walk_.stop();
  }
  void step(const RobotFeedback* robot, const DrawerSenses& senses) override {
    const DrawerSeen* seen = nullptr;
    if (tracker_) {
      seen =
          tracker_->step(robot, sequence_ ? sequence_->heading_rad() : walk_.heading_rad(), senses);
    }
    if (kind_ == GoalKind::drawer) {
      if (seen != nullptr && !sequence_) task_.front_W_m = seen->front_W_m;
      if (!sequence_) approach(robot);
    }
    if (sequence_) {
      sequence_->step(robot, seen);
      if (seen != nullptr && sequence_->across(seen->front_W_m)) {  // to be walked to again
        leave();
        walk_.stop();
      }
    }
    walk_.step(robot);
    move_character();
    sequence_ ? show_sequence() : show_walk(robot);
    show_angles();
  }

  DirectedMotion motion(int) const override { return motion_; }
  std::span<const float> angles(int) const override { return angles_; }
  Progress progress(int) const override {
    Progress p;
    p.kind = kind_;
    p.distance_m = walk_.distance_m();
    p.reached =
        kind_ == GoalKind::stop ? walk_.stands() && !walk_.clock().moves() : walk_.reached();
    if (walk_.stuck()) p.reason = "no nearer for a long time";
    if (kind_ == GoalKind::drawer) {
      p.distance_m = (task_.front_W_m - walk_.position_W_m()).norm();
      p.reached = false;
      if (!refused_.empty()) p.reason = refused_;
    }
    if (sequence_) {
      p.distance_m = sequence_->state().distance_m;
      p.reason = sequence_->state().refused;
      p.reached = sequence_->state().done && p.reason.empty();
    }
    return p;
  }
  const std::vector<PlannedAction>* plan(int) const override {
    return sequence_ ? &actions_ : nullptr;
  }

 private:
  /// Out of the sequence; the arms come back.
  void leave() {
    refused_.clear();
    if (!sequence_) return;
    const BipedSequenceState& state = sequence_->state();
    const auto walk = characters_.angles(0);
    for (std::size_t i = 0; i < row_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      left_rad_[k] = state.q[k] - static_cast<double>(walk[row_[i]]);
      left_rate_[k] = state.dq[k];
    }
    left_s_ = 0.0;
    walk_.place(sequence_->robot().pelvis_W_m.head<2>(), sequence_->robot().heading_rad);
    sequence_.reset();
  }
  /// Stops, turns to the drawer, and begins.
  void approach(const RobotFeedback* robot) {
    const bool stands = walk_.stands() && !walk_.clock().moves() &&
                        (robot == nullptr || robot->gait == RobotGait::standing);
    if (!stands) return;
    const Eigen::Vector2d way = task_.front_W_m - walk_.position_W_m();
    const double bearing = std::atan2(way.y(), way.x());
    if (way.norm() > kFar_m) {
      walk_.walk_to(task_.front_W_m - kBeforeFar_m * way.normalized());
      return;
    }
    if (std::abs(math::wrap_pi(bearing - walk_.heading_rad())) > kFacing_rad) {
      walk_.turn_to(bearing);
      return;
    }
    const RobotFeedback here =
        robot != nullptr ? *robot
                         : standing_robot(walk_.position_W_m(), walk_.heading_rad(),
                                          drawer_->feet_distance_m, drawer_->pelvis_height_m);
    BipedSequenceOptions options;
    options.dt_s = dt_s_;
    options.step_s = limits_.step_s;
    auto sequence = BipedDrawerSequence::start(*drawer_, task_, here, options);
    if (!sequence) {
      refused_ = sequence.error().reason;
      return;
    }
    refused_.clear();
    sequence_.emplace(std::move(*sequence));
    Eigen::VectorXd q(drawer_->upper.dof());
    for (std::size_t i = 0; i < row_.size(); ++i) {
      q[static_cast<Eigen::Index>(i)] = static_cast<double>(angles_[row_[i]]);
    }
    sequence_->set_posture(q);
  }
  /// The character steps while the robot does, as long steps, in its rhythm.
  void move_character() {
    const GaitClock& clock = walk_.clock();
    const double length = limits_.step_s * walk_.velocity().head<2>().norm();
    characters_.set_gait(0,
                         {.phase_rate_rad_s = math::kTwoPi / (2.0 * limits_.step_s),
                          .step_length_m = length,
                          .heading_rad = std::nullopt},
                         clock.phase_rad());
    characters_.walk(0).set_free(clock.moves() && !sequence_);
    characters_.step();
  }
  void show_walk(const RobotFeedback* robot) {
    const CharacterState& state = characters_.state(0);
    motion_.phase_rad = state.phase_rad;
    motion_.phase_rate_rad_s = state.phase_rate_rad_s;
    motion_.velocity = motion_.smooth_velocity = walk_.velocity();
    motion_.pelvis_W_m << walk_.position_W_m(),
        robot != nullptr ? robot->pelvis_W_m.z() : state.root.height_m;
    motion_.heading_rad = walk_.heading_rad();
    motion_.support = walk_.clock().swing() == mocap::kLeft ? mocap::kRight : mocap::kLeft;
    motion_.stands = walk_.stands();
    motion_.landing = {};
    motion_.hand = {};
    const bool steps = walk_.clock().moves();
    motion_.action = walk_.stands() ? (steps ? "stop" : "stand") : (steps ? "walk" : "start");
  }
  void show_sequence() {
    const BipedSequenceState& state = sequence_->state();
    const RobotFeedback& robot = sequence_->robot();
    motion_.phase_rad = state.phase_rad;
    motion_.phase_rate_rad_s = state.phase_rate_rad_s;
    motion_.velocity = motion_.smooth_velocity = state.velocity;
    motion_.pelvis_W_m = robot.pelvis_W_m;
    motion_.heading_rad = robot.heading_rad;
    motion_.support = robot.swing == mocap::kLeft ? mocap::kRight : mocap::kLeft;
    motion_.stands = state.stands;
    motion_.landing = state.landing;
    motion_.hand = state.hand;
    motion_.action = state.action == kNormalStep     ? "step"
                     : state.action == kReachingStep ? "reach"
                                                     : "take";
    actions_ = sequence_->plan();
  }
  void show_angles() {
    std::ranges::copy(characters_.angles(0), angles_.begin());
    left_s_ = std::min(left_s_ + dt_s_, kRobotFade_s);
    for (std::size_t i = 0; i < row_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      float& angle = angles_[row_[i]];
      angle = sequence_ ? static_cast<float>(sequence_->state().q[k])
                        : angle + static_cast<float>(
                                      faded(left_rad_[k], left_rate_[k], left_s_, kRobotFade_s));
    }
  }

  const BipedDrawer* drawer_;
  RobotLimits limits_;
  double dt_s_;
  RobotWalk walk_;
  GoalKind kind_ = GoalKind::none;
  DrawerPlace task_;
  std::string refused_;  // why its sequence does not begin
  std::optional<DrawerTracker> tracker_;
  std::optional<BipedDrawerSequence> sequence_;
  std::vector<PlannedAction> actions_;
  DirectedMotion motion_;
  std::vector<std::size_t> row_;  // row of the model, for each joint of the sequence
  Eigen::VectorXd left_rad_,
      left_rate_;  // joints' difference to the walk when the sequence was left
  double left_s_ = kRobotFade_s;
  std::vector<float> angles_;
};

}  // namespace

std::unique_ptr<Director> make_robot_director(const motion::MotionModel& model,
                                              const CharacterStart& start,
                                              const CharactersSettings& settings,
                                              const RobotLimits& limits,
                                              const BipedDrawer* drawer) {
  return std::make_unique<RobotDirector>(model, start, settings, limits, drawer);
}

}  // namespace mimesis::synthesizer
