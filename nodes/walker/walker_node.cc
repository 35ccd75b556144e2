#include "nodes/walker/walker_node.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include "common/math/so3.h"
#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/robot/biped.h"
#include "common/runtime/bus.h"
#include "proto/walker.pb.h"

namespace mimesis::walker {
namespace {

/// The plan for viewers, in W: where the soles are and where the next one lands; the planned CoM
/// and its place on the ground; the zero moment point planned, wished and measured.
/// @param balance  null: none of these
foxglove::SceneUpdate draw_plan(const v1::WalkFeedback& feedback, const v1::WalkBalance* balance,
                                const robot::Biped& biped, std::chrono::nanoseconds now);

using Eigen::Vector3d;
using model::Rgba;
using model::to_eigen;

constexpr Rgba kStands{0.35, 0.38, 0.42, 0.6}, kLands{0.3, 0.7, 0.4, 0.7}, kCom{0.3, 0.7, 0.4, 1.0},
    kPlanned{0.3, 0.7, 0.4, 1.0}, kWished{0.95, 0.75, 0.2, 1.0}, kMeasured{0.9, 0.15, 0.3, 1.0};
constexpr double kSheet_m = 0.004;  // soles are drawn this thick

void add_sole(foxglove::SceneEntity& entity, const v1::Footprint& foot, const robot::Biped& biped,
              const Rgba& colour) {
  const robot::Biped::Leg& leg =
      biped.leg[foot.foot() == v1::FOOT_LEFT ? robot::kLeft : robot::kRight];
  Eigen::Isometry3d X_WS = Eigen::Translation3d(to_eigen(foot.position_in_world_m())) *
                           Eigen::Isometry3d(Eigen::AngleAxisd(foot.yaw_rad(), Vector3d::UnitZ()));
  Vector3d edges, middle;
  edges << leg.max_S_m - leg.min_S_m, kSheet_m;
  middle << 0.5 * (leg.max_S_m + leg.min_S_m), 0.5 * kSheet_m;
  X_WS.translate(middle);
  model::add_box(entity, X_WS, edges, colour);
}

foxglove::SceneUpdate draw_plan(const v1::WalkFeedback& feedback, const v1::WalkBalance* balance,
                                const robot::Biped& biped, std::chrono::nanoseconds now) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "plan", "world", now);
  for (const v1::Footprint& foot : feedback.feet()) add_sole(entity, foot, biped, kStands);
  if (feedback.to_landing_s() > 0.0) add_sole(entity, feedback.landing(), biped, kLands);
  if (balance == nullptr) return update;
  const Vector3d com = to_eigen(balance->com_planned_in_world_m());
  model::add_ball(entity, com, 0.03, kCom);
  model::add_rod(entity, {com.x(), com.y(), 0.0}, com, 0.003, kCom);
  model::add_ball(entity, to_eigen(balance->zmp_planned_in_world_m()), 0.016, kPlanned);
  model::add_ball(entity, to_eigen(balance->zmp_wished_in_world_m()), 0.016, kWished);
  model::add_ball(entity, to_eigen(balance->zmp_measured_in_world_m()), 0.016, kMeasured);
  return update;
}

Sensors no_sensors(int dof) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Sensors s;
  s.q = s.dq = Eigen::VectorXd::Constant(dof, kNan);
  s.R_WI.coeffs().setConstant(kNan);
  s.gyro_I.setConstant(kNan);
  s.specific_force_I.setConstant(kNan);
  for (robot::Wrench& foot : s.foot_S) {
    foot.force.setConstant(kNan);
    foot.moment.setConstant(kNan);
  }
  return s;
}

/// Direction up of the world in the IMU's frame in half-sitting.
Eigen::Vector3d up_in_imu(const robot::Biped& biped) {
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  return kinematics.X_WL(biped.imu).linear().transpose() * Eigen::Vector3d::UnitZ();
}

// After this silence the bridge brakes and holds the robot.
constexpr std::chrono::milliseconds kLongestPause(100);
constexpr std::uint64_t kTransformsEvery = 8;  // steps: 25 Hz

const char* name(v1::WalkState state) {
  constexpr std::array kNames = {"",        "waiting",  "standing", "starting",
                                 "walking", "stopping", "safe"};
  return kNames.at(static_cast<std::size_t>(state));
}

}  // namespace

WalkerNode::WalkerNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      bus_(bus),
      biped_(model::load_biped(params.robot)),
      settings_(params.settings(biped_)),
      walker_(biped_, settings_),
      wish_(biped_, *settings_.gait, params.wish),
      conduct_(params.conduct),
      reader_(biped_),
      kinematics_(biped_.tree),
      up_I_(up_in_imu(biped_)),
      blind_(no_sensors(biped_.tree.dof())),
      q_(biped_.half_sitting),
      place_{.p_W_m = {params.start.x_m, params.start.y_m}, .yaw_rad = params.start.heading_rad},
      motion_in_(bus, "motion", {.author = runtime::Author::first}),
      rows_in_(bus, "rows", {.author = runtime::Author::first}),
      body_in_(bus, "sensors", {.author = runtime::Author::first}),
      joints_in_(bus, "joint_states", {.author = runtime::Author::first}),
      command_(bus, "command"),
      feedback_(bus, "feedback"),
      balance_(bus, "balance"),
      status_(bus, "status"),
      transforms_(bus, "transforms"),
      plan_(bus, "plan", {.latched = true}) {
  sensors_.q = sensors_.dq = Eigen::VectorXd::Zero(q_.size());
  kinematics_.update(Eigen::Translation3d(place_.p_W_m.x(), place_.p_W_m.y(), 0.0) *
                         Eigen::AngleAxisd(place_.yaw_rad, Eigen::Vector3d::UnitZ()) *
                         biped_.X_WB_half_sitting,
                     q_);
  runtime::info("robot '{}': {} joints, {:.1f} kg, CoM at {:.3f} m; {} pattern, filter {}",
                biped_.tree.name(), biped_.tree.dof(), biped_.tree.mass_kg(), biped_.com_height_m,
                params.pattern, params.filter ? "on" : "off");
}

void WalkerNode::step(runtime::Time now) {
  const runtime::Time passed = now - std::exchange(last_, now);
  pause_line_ = steps_ > 0 && passed > kLongestPause
                    ? fmt::format("the walker stood still for {:.1f} s", to_seconds(passed))
                    : "";
  take_sensors(now);
  take_motion(now);
  const Phase before = conduct_.phase();
  const Phase phase = conduct_.step(condition(), kTick_s);
  if (phase != before) enter(phase);
  switch (phase) {
    case Phase::waiting:
      break;
    case Phase::enabling:
      hold_actual_posture();
      break;
    case Phase::approaching:
      approach_.step(kTick_s);
      q_ = approach_.q();
      break;
    case Phase::balancing:
      balance();
      break;
    case Phase::safe:
      break;
  }
  publish(now);
  ++steps_;
}

bool WalkerNode::at_rest() const {
  return conduct_.phase() != Phase::balancing || tick_ == nullptr ||
         tick_->pattern.gait == Gait::standing;
}

void WalkerNode::take_sensors(runtime::Time now) {
  if (const v1::BodySensors* body = body_in_.take()) body_fault_ = read_body(*body, sensors_);
  if (const v1::JointState* joints = joints_in_.take()) {
    joints_fault_ = read_joints(*joints, sensors_);
    drives_fault_ = joints->operational()     ? ""
                    : joints->fault().empty() ? "the bridge does not follow yet"
                                              : "the bridge does not follow: " + joints->fault();
  }
  const auto old = [&](auto& port) {
    return port.get() != nullptr &&
           port.fresh(now, runtime::from_seconds(params_.sensors_stale_s)) == nullptr;
  };
  sensors_line_ = !joints_fault_.empty() ? joints_fault_
                  : old(joints_in_)      ? "encoders are silent"
                  : !body_fault_.empty() ? body_fault_
                  : old(body_in_)        ? "IMU and foot forces are silent"
                                         : std::string();
}

void WalkerNode::take_motion(runtime::Time now) {
  if (const v1::MotionRows* rows = rows_in_.take()) {
    if (const std::string why = reader_.set_rows(*rows); !why.empty()) runtime::warn("{}", why);
  }
  const v1::Motion* motion = motion_in_.fresh(now, runtime::from_seconds(params_.motion_stale_s));
  if ((motion != nullptr) != motion_heard_) {
    motion_heard_ = motion != nullptr;
    if (motion_heard_) {
      runtime::info("a motion begins");
    } else {
      runtime::info("no motion for {} s: steps end", params_.motion_stale_s);
    }
  }
  if (motion == nullptr) return;
  const double age_s = std::max(0.0, to_seconds(now - motion_in_.stamp()));
  std::string why = reader_.read(*motion, age_s, params_.use_smooth_velocity, motion_);
  if (!why.empty() && why != refusal_ && refusals_.pass()) {
    runtime::warn("motion refused: {}; the robot stands", why);
  }
  refusal_ = std::move(why);
}

/// @return why balance cannot begin from the present posture; empty if it can.
std::string WalkerNode::posture_fault(const Eigen::Quaterniond& R_WI) const {
  const Eigen::Vector3d up_I = R_WI.conjugate() * Eigen::Vector3d::UnitZ();
  const double tilt_rad = std::acos(std::clamp(up_I.dot(up_I_), -1.0, 1.0));
  if (tilt_rad > params_.ready.tilt_rad) {
    return fmt::format("the trunk is tilted by {:.2f} rad, at most {:.2f} to begin", tilt_rad,
                       params_.ready.tilt_rad);
  }
  Eigen::Index joint = 0;
  const double off_rad = (sensors_.q - biped_.half_sitting).cwiseAbs().maxCoeff(&joint);
  if (off_rad > params_.ready.near_rad) {
    return fmt::format("{} is {:.2f} rad from half-sitting, at most {:.2f} to begin",
                       biped_.tree.moved(static_cast<int>(joint)).joint, off_rad,
                       params_.ready.near_rad);
  }
  const double weight_n = biped_.tree.mass_kg() * robot::kGravity;
  const double normal_n = sensors_.foot_S[kLeft].force.z() + sensors_.foot_S[kRight].force.z();
  if (normal_n < params_.ready.weight_share * weight_n) {
    return fmt::format("the feet carry {:.0f} N of {:.0f} N: not on the ground", normal_n,
                       weight_n);
  }
  return {};
}

Condition WalkerNode::condition() {
  const bool balances = conduct_.phase() == Phase::balancing;
  posture_line_.clear();
  if (!balances) {
    const bool good = sensors_line_.empty();
    const Eigen::Quaterniond& R_WI = walker_.watch(good ? sensors_ : blind_);
    if (good) posture_line_ = posture_fault(R_WI);
  }
  Condition now{.sensors = sensors_line_,
                .actuators = drives_fault_,
                .posture = posture_line_,
                .falling = {},
                .paused = pause_line_,
                .stands = true,
                .approached = approach_.done()};
  if (balances && tick_ != nullptr) {
    now.stands = tick_->pattern.gait == Gait::standing;
    if (tick_->stabilizer.falling) now.falling = tick_->stabilizer.reason;
  }
  return now;
}

void WalkerNode::enter(Phase phase) {
  switch (phase) {
    case Phase::enabling:
      q_ = sensors_.q;
      break;
    case Phase::approaching:
      approach_.start(q_, biped_.half_sitting, biped_.tree.max_speed(),
                      params_.ready.approach_share, params_.ready.approach_s);
      break;
    case Phase::balancing:
      walker_.reset(place_.p_W_m, place_.yaw_rad);
      wish_.reset();
      tick_ = nullptr;
      break;
    case Phase::waiting:
    case Phase::safe:
      break;
  }
}

/// Joints may sag until the drives are enabled; set-points have to begin at the actual posture.
void WalkerNode::hold_actual_posture() {
  if ((sensors_.q - q_).cwiseAbs().maxCoeff() > params_.ready.start_rad) q_ = sensors_.q;
}

void WalkerNode::balance() {
  const bool follows = motion_heard_ && refusal_.empty() && !conduct_.blind();
  const WalkerWish& wish = wish_.step(follows ? &motion_ : nullptr, place_, kTick_s);
  if (!wish_.clipped().empty() && clips_.pass()) runtime::warn("{}", wish_.clipped());

  const auto begin = std::chrono::steady_clock::now();
  tick_ = &walker_.step(wish, conduct_.blind() ? blind_ : sensors_);
  step_times_.add(to_seconds(std::chrono::steady_clock::now() - begin));

  q_ = tick_->q;
  kinematics_.update(tick_->X_WB, q_);
  const std::array<FootState, 2>& foot = tick_->pattern.foot;
  place_.p_W_m = 0.5 * (foot[kLeft].X_WS.translation() + foot[kRight].X_WS.translation()).head<2>();
  place_.yaw_rad = tick_->pattern.yaw_rad;
  failed_ += tick_->failed ? 1 : 0;
  limited_ += tick_->limited ? 1 : 0;
  clipped_ += tick_->clipped || !wish_.clipped().empty() ? 1 : 0;
  if (!tick_->trouble.empty() && troubles_.pass()) runtime::warn("{}", tick_->trouble);
}

// Messages that the node publishes at a step.
v1::WalkState WalkerNode::state() const {
  switch (conduct_.phase()) {
    case Phase::balancing:
      return to_proto(tick_->pattern.gait);
    case Phase::safe:
      return v1::WALK_STATE_SAFE;
    default:
      return v1::WALK_STATE_WAITING;
  }
}

void WalkerNode::publish(runtime::Time now) {
  if (conduct_.phase() != Phase::waiting) {  // silence stops the drives
    command_message_.mutable_position_rad()->Assign(q_.begin(), q_.end());
    command_.send(command_message_, now);
  }
  publish_feedback(now);
  if (conduct_.phase() == Phase::balancing) {
    to_proto(*tick_, balance_message_);
    balance_.send(balance_message_, now);
  }
  if (steps_ % kTransformsEvery == 0) {
    to_proto(kinematics_, now, transforms_message_);
    transforms_.send(transforms_message_, now);
    auto plan =
        draw_plan(feedback_message_,
                  conduct_.phase() == Phase::balancing ? &balance_message_ : nullptr, biped_, now);
    plan_.send(plan, now);
  }
  publish_status(now);
}

/// Fills the feedback from the set-points' kinematics while there is no plan.
void WalkerNode::stand_in_feedback() {
  feedback_message_.clear_feet();
  for (const Side side : robot::kSides) {
    const Eigen::Isometry3d& X_WS = kinematics_.X_WL(biped_.leg[side].sole);
    to_proto(
        Footprint{.side = side, .p_W_m = X_WS.translation().head<2>(), .yaw_rad = place_.yaw_rad},
        *feedback_message_.add_feet());
  }
  feedback_message_.set_swing(v1::FOOT_RIGHT);
  *feedback_message_.mutable_landing() = feedback_message_.feet(kRight);
}

void WalkerNode::publish_feedback(runtime::Time now) {
  if (tick_ != nullptr) {
    to_proto(*tick_, feedback_message_);
  } else {
    stand_in_feedback();
  }
  feedback_message_.set_state(state());
  const Eigen::Isometry3d& X_WB = kinematics_.X_WL(0);
  to_proto(X_WB.translation(), *feedback_message_.mutable_position_pelvis_in_world_m());
  feedback_message_.set_heading_rad(math::yaw_of(X_WB.linear()));
  feedback_message_.clear_hands_in_world_m();
  for (const Side side : robot::kSides) {
    if (biped_.hand[side] < 0) continue;
    to_proto(tick_ != nullptr ? tick_->hand_W_m[side]
                              : kinematics_.X_WL(biped_.hand[side]).translation().eval(),
             *feedback_message_.add_hands_in_world_m());
  }
  if (biped_.head >= 0) {
    const Eigen::Isometry3d& X_WH = tick_ != nullptr ? tick_->X_WH : kinematics_.X_WL(biped_.head);
    to_proto(X_WH.translation(), *feedback_message_.mutable_head_in_world_m());
    to_proto(Eigen::Quaterniond(X_WH.linear()), *feedback_message_.mutable_world_from_head());
  }
  feedback_.send(feedback_message_, now);
}

/// Sends the status at every change and once a second.
void WalkerNode::publish_status(runtime::Time now) {
  const v1::WalkState is = state();
  const std::string& reason =
      conduct_.reason().empty() && motion_heard_ ? refusal_ : conduct_.reason();
  const bool changed = is != last_status_.state || reason != last_status_.reason;
  if (!changed && now < last_status_.due) return;
  if (changed && (is != last_status_.state || troubles_.pass())) {
    runtime::log(is == v1::WALK_STATE_SAFE ? runtime::Level::warn : runtime::Level::info,
                 fmt::format("{}{}{}", name(is), reason.empty() ? "" : ": ", reason));
  }
  last_status_ = {is, reason, now + std::chrono::seconds(1)};
  const StepTimes times =
      runtime::read_outside_value<StepTimes>(bus_, "ticks", [this] { return step_times_; });
  v1::WalkerStatus status;
  status.set_state(is);
  status.set_reason(reason);
  status.set_failed_solves(failed_);
  status.set_clipped_wishes(clipped_);
  status.set_limited_ticks(limited_);
  status.set_mean_tick_s(times.mean_s);
  status.set_worst_tick_s(times.worst_s);
  status_.send(status, now);
}

}  // namespace mimesis::walker
