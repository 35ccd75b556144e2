#include "nodes/walker/walker_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/so3.h"
#include "common/model/drawing.h"

namespace mimesis::walker {
namespace {

constexpr double kUnitTolerance = 0.05;  // error of a quaternion's length

std::optional<Side> side_of(v1::Foot foot) {
  if (foot == v1::FOOT_LEFT) return kLeft;
  if (foot == v1::FOOT_RIGHT) return kRight;
  return std::nullopt;
}
v1::Foot foot_of(Side side) { return side == kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT; }

void set(const Eigen::Vector2d& p, double z, v1::Vector3& out) {
  to_proto(Eigen::Vector3d(p.x(), p.y(), z), out);
}

std::string read_landings(const v1::Motion& message, MotionWish& out) {
  out.landing = {};
  const int landings = message.landings_size();
  if (landings > 2) return fmt::format("{} landings, expected at most 2", landings);
  for (int i = 0; i < landings; ++i) {
    const v1::Footprint& landing = message.landings(i);
    const std::optional<Side> side = side_of(landing.foot());
    if (!side) return fmt::format("landing {} names no foot", i);
    if (i == 1 && side == out.landing[0]->side) return "both landings are of the same foot";
    const v1::Vector3& p = landing.position_in_world_m();
    out.landing[static_cast<std::size_t>(i)] =
        Footprint{.side = *side, .p_W_m = {p.x_m(), p.y_m()}, .yaw_rad = landing.yaw_rad()};
  }
  return {};
}

}  // namespace

MotionReader::MotionReader(const robot::Biped& biped) : row_(biped.upper_body.size(), -1) {
  for (const int dof : biped.upper_body) joints_.push_back(biped.tree.moved(dof).joint);
}

std::string MotionReader::set_rows(const v1::MotionRows& message) {
  rows_ = message.rows_size();
  fault_.clear();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto found = std::ranges::find(message.rows(), joints_[i]);
    row_[i] = static_cast<int>(found - message.rows().begin());
    if (found == message.rows().end() && fault_.empty()) {
      fault_ = fmt::format("rows of motion '{}' have no joint '{}', expected all of the upper body",
                           message.model(), joints_[i]);
    }
  }
  return fault_;
}

std::string MotionReader::read_upper_body(const v1::Motion& message, double age_s,
                                          MotionWish& out) const {
  const int angles = message.position_rad_size(), rates = message.velocity_rad_s_size();
  if (angles == 0) {  // a walk with the arms at rest
    out.upper_body.resize(0);
    return {};
  }
  if (rows_ < 0) return "motion with joints, and no rows yet that name them";
  if (!fault_.empty()) return fault_;
  if (angles != rows_) return fmt::format("motion of {} joints, its rows are {}", angles, rows_);
  if (rates != 0 && rates != rows_) {
    return fmt::format("motion with {} joint rates, its rows are {}", rates, rows_);
  }
  const auto joints = static_cast<Eigen::Index>(row_.size());
  out.upper_body.resize(joints);
  out.upper_body_rate.resize(joints);
  for (Eigen::Index i = 0; i < joints; ++i) {
    const int row = row_[static_cast<std::size_t>(i)];
    const double rate = rates == 0 ? 0.0 : message.velocity_rad_s(row);
    out.upper_body[i] = message.position_rad(row) + rate * age_s;
    out.upper_body_rate[i] = rate;
  }
  return {};
}

std::string MotionReader::read(const v1::Motion& message, double age_s, bool smooth,
                               MotionWish& out) const {
  if (std::string why = read_upper_body(message, age_s, out); !why.empty()) return why;
  if (std::string why = read_landings(message, out); !why.empty()) return why;
  out.velocity_m_s = {
      smooth ? message.smooth_velocity_forward_m_s() : message.velocity_forward_m_s(),
      smooth ? message.smooth_velocity_left_m_s() : message.velocity_left_m_s()};
  out.yaw_rate_rad_s = smooth ? message.smooth_yaw_rate_rad_s() : message.yaw_rate_rad_s();
  out.pelvis_W_m = model::to_eigen(message.position_pelvis_in_world_m()).head<2>();
  out.heading_rad = message.heading_rad();
  out.stands = message.stands();
  out.hand = {};
  for (const v1::HandGoal& hand : message.hands()) {
    out.hand[hand.left() ? kLeft : kRight] = {.p_W_m = model::to_eigen(hand.position_in_world_m()),
                                              .share = hand.share()};
  }
  return {};
}

std::string read_body(const v1::BodySensors& message, Sensors& sensors) {
  const bool announced = message.has_world_from_imu();
  const bool felt = message.has_gyro_in_imu() && message.has_specific_force_in_imu();
  if (!announced && !felt) return "an IMU without attitude, and without gyro and accelerometer";
  const v1::Quaternion& q = message.world_from_imu();
  const Eigen::Quaterniond R_WI(q.w(), q.x(), q.y(), q.z());
  if (announced && std::abs(R_WI.norm() - 1.0) > kUnitTolerance) {
    return fmt::format("attitude of the IMU has length {:.3g}, expected 1", R_WI.norm());
  }
  std::array<bool, 2> heard{};
  for (const v1::FootWrench& foot : message.feet()) {
    const std::optional<Side> side = side_of(foot.foot());
    if (!side) return "a foot force that names no foot";
    heard[*side] = true;
    sensors.foot_S[*side] = {
        .force = {foot.force_x_n(), foot.force_y_n(), foot.force_z_n()},
        .moment = {foot.moment_x_n_m(), foot.moment_y_n_m(), foot.moment_z_n_m()}};
  }
  if (!heard[kLeft] || !heard[kRight]) return "foot forces of one foot only, expected both";
  // what it does not say is not a number, which nobody takes
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  sensors.R_WI.coeffs().setConstant(kUnknown);
  sensors.gyro_I.setConstant(kUnknown);
  sensors.specific_force_I.setConstant(kUnknown);
  if (announced) sensors.R_WI = R_WI.normalized();
  if (!felt) return {};
  const auto& w = message.gyro_in_imu();
  const auto& f = message.specific_force_in_imu();
  sensors.gyro_I = {w.x_rad_s(), w.y_rad_s(), w.z_rad_s()};
  sensors.specific_force_I = {f.x_m_s2(), f.y_m_s2(), f.z_m_s2()};
  return {};
}

std::string read_joints(const v1::JointState& message, Sensors& sensors) {
  const auto dof = static_cast<int>(sensors.q.size());
  if (message.position_rad_size() != dof || message.velocity_rad_s_size() != dof) {
    return fmt::format("encoders of {} positions and {} rates, the robot has {} joints",
                       message.position_rad_size(), message.velocity_rad_s_size(), dof);
  }
  for (int j = 0; j < dof; ++j) {
    sensors.q[j] = message.position_rad(j);
    sensors.dq[j] = message.velocity_rad_s(j);
  }
  return {};
}

void to_proto(const Eigen::Quaterniond& turn, v1::Quaternion& out) {
  out.set_w(turn.w());
  out.set_x(turn.x());
  out.set_y(turn.y());
  out.set_z(turn.z());
}

void to_proto(const Footprint& footprint, v1::Footprint& out) {
  out.set_foot(foot_of(footprint.side));
  set(footprint.p_W_m, 0.0, *out.mutable_position_in_world_m());
  out.set_yaw_rad(footprint.yaw_rad);
}

void to_proto(const WalkerOutput& tick, v1::WalkFeedback& out) {
  const PatternSample& plan = tick.pattern;
  to_proto(tick.X_WB.translation(), *out.mutable_position_pelvis_in_world_m());
  out.set_heading_rad(math::yaw_of(tick.X_WB.linear()));
  out.mutable_velocity_pelvis_in_world()->set_x_m_s(tick.com.v_W.x());
  out.mutable_velocity_pelvis_in_world()->set_y_m_s(tick.com.v_W.y());
  out.set_swing(foot_of(plan.swing));
  out.set_to_landing_s(plan.to_landing_s);
  to_proto(plan.landing, *out.mutable_landing());
  out.clear_feet();
  for (const Side side : robot::kSides) {
    const Eigen::Isometry3d& X_WS = plan.foot[side].X_WS;
    v1::Footprint& foot = *out.add_feet();
    foot.set_foot(foot_of(side));
    to_proto(X_WS.translation(), *foot.mutable_position_in_world_m());
    foot.set_yaw_rad(math::yaw_of(X_WS.linear()));
  }
  out.set_steps(static_cast<std::uint32_t>(plan.steps));
}

void to_proto(const WalkerOutput& tick, v1::WalkBalance& out) {
  const StabilizerCommand& balance = tick.stabilizer;
  const double height = balance.com_W_m.z();
  set(tick.com.p_W_m, height, *out.mutable_com_planned_in_world_m());
  to_proto(balance.com_W_m, *out.mutable_com_measured_in_world_m());
  set(tick.pattern.zmp_W_m, 0.0, *out.mutable_zmp_planned_in_world_m());
  set(balance.wished_zmp_W_m, 0.0, *out.mutable_zmp_wished_in_world_m());
  set(balance.zmp_W_m, 0.0, *out.mutable_zmp_measured_in_world_m());
  set(balance.dcm_error_W_m, 0.0, *out.mutable_dcm_error_in_world_m());
  set(tick.com.p_W_m - tick.pattern.com.p_W_m, 0.0, *out.mutable_filter_shift_in_world_m());
  out.set_saturated(balance.saturated);
}

v1::WalkState to_proto(Gait gait) {
  switch (gait) {
    case Gait::standing:
      return v1::WALK_STATE_STANDING;
    case Gait::starting:
      return v1::WALK_STATE_STARTING;
    case Gait::walking:
      return v1::WALK_STATE_WALKING;
    case Gait::stopping:
      return v1::WALK_STATE_STOPPING;
  }
  return v1::WALK_STATE_UNSPECIFIED;
}

void to_proto(const robot::Kinematics& kinematics, runtime::Time stamp,
              foxglove::FrameTransforms& out) {
  out.clear_transforms();
  const std::vector<robot::Link>& links = kinematics.tree().links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    model::add_frame(out, "world", "robot/" + links[i].name, kinematics.X_WL(static_cast<int>(i)),
                     stamp);
  }
}

}  // namespace mimesis::walker
