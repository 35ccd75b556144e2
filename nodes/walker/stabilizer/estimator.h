#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "common/math/so3.h"
#include "common/robot/dynamics.h"
#include "common/robot/kinematics.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/attitude.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Constant error of the measured CoM: a tilt of what the IMU takes for upright, masses that the
/// model does not know, a load in the hand. The pendulum c̈ = ω² (c − z) holds for the true c, and
/// the measured ZMP z does not depend on the attitude, so [docs/walking.md eq. 6.10]
///   o = ⟨c − z − c̈/ω²⟩
/// over the last T, along and across the heading. The mean of the rate of angular momentum, which
/// the pendulum neglects, is 0. A push is no offset: what differs from o by more than a limit
/// counts as the limit. A Kalman filter with the same model is in JRL's state-observation.
class ComOffset {
 public:
  ComOffset(double omega_1_s, const StabilizerSettings& settings)
      : settings_(&settings), per_omega2_(1.0 / (omega_1_s * omega_1_s)) {}

  void reset() { age_s_ = 0.0, offset_H_.setZero(), lost(); }
  /// The next measurement does not follow the last one.
  void lost() { follows_ = false; }
  /// Once a tick with the measured CoM, its velocity and the ZMP of the same instant [m, W].
  void measure(const Eigen::Vector2d& com_W, const Eigen::Vector2d& v_W,
               const Eigen::Vector2d& zmp_W, double yaw_rad) {
    if (!follows_) slow_W_ = com_W - zmp_W, slow_v_W_ = v_W;
    follows_ = true;
    constexpr double kShare = kTick_s / kSmooth_s;
    slow_W_ += kShare * (com_W - zmp_W - slow_W_);
    // the low pass of c̈ is the rest of the high pass of ċ
    const Eigen::Vector2d a_W = (v_W - slow_v_W_) / kSmooth_s;
    slow_v_W_ += kTick_s * a_W;
    if (settings_->com_offset_s <= 0.0) return;
    age_s_ = std::min(age_s_ + kTick_s, settings_->com_offset_s);
    Eigen::Vector2d off = Eigen::Rotation2Dd(-yaw_rad) * (slow_W_ - per_omega2_ * a_W) - offset_H_;
    const double norm = off.norm();
    if (norm > kMost_m) off *= kMost_m / norm;
    offset_H_ += kTick_s / std::max(age_s_, kStart_s) * off;
  }
  Eigen::Vector2d offset_W_m(double yaw_rad) const {
    return Eigen::Rotation2Dd(yaw_rad) * offset_H_;
  }

 private:
  static constexpr double kSmooth_s = 0.1, kStart_s = 2.0, kMost_m = 0.03;

  const StabilizerSettings* settings_;
  double per_omega2_, age_s_ = 0.0;
  bool follows_ = false;
  Eigen::Vector2d offset_H_ = Eigen::Vector2d::Zero(), slow_W_, slow_v_W_;
};

/// Measurements of one tick. The IMU's W has z up and the heading of its start.
struct Sensors {
  Eigen::VectorXd q, dq;                                       ///< dof; encoders
  Eigen::Quaterniond R_WI = Eigen::Quaterniond::Identity();    ///< attitude of the IMU link
  Eigen::Vector3d gyro_I = Eigen::Vector3d::Zero();            ///< [rad/s] in the IMU link
  Eigen::Vector3d specific_force_I = Eigen::Vector3d::Zero();  ///< [m/s²], +g up when at rest
  /// Wrenches on the soles about their origins, in S; averaged over the tick.
  std::array<robot::Wrench, 2> foot_S;
};

/// Pose of the body seen from the feet that carry it, in the frame of the plan, where these feet
/// stand as planned. Drift and slip of the whole robot do not show.
struct BodyEstimate {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d com_v_W = Eigen::Vector2d::Zero();
};

/// Share of the left foot in carrying: 1 or 0 in single support.
inline double left_weight(const PatternSample& plan) {
  if (!plan.contact[kLeft]) return 0.0;
  return plan.contact[kRight] ? std::clamp(plan.left_share, 0.0, 1.0) : 1.0;
}

/// Estimates the body from encoders, the IMU's attitude and the kinematic chain to the standing
/// feet [docs/walking.md 6.1]. The heading is that of the standing feet, not the IMU's; in double
/// support both feet count by their planned shares of the weight. The velocity of the CoM follows
/// the force of the ground, and the kinematics with poles at −λ [eq. 6.9]:
///   v̂' = F/m − g ẑ + λ² (c − ĉ),  ĉ' = v̂ + 2λ (c − ĉ)
/// so that it is neither late nor as noisy as a difference of encoders.
class Estimator {
 public:
  Estimator(const robot::Biped& biped, const StabilizerSettings& settings)
      : biped_(&biped),
        kinematics_(biped.tree),
        mass_kg_(biped.tree.mass_kg()),
        pole_1_s_(1.0 / settings.velocity_filter_s),
        q_(biped.tree.dof()) {
    for (std::size_t i = 0; i < give_.size(); ++i) {
      const double stiffness = i <= robot::kHipLast ? settings.hip_stiffness_n_m_rad
                               : i == robot::kKnee  ? settings.knee_stiffness_n_m_rad
                                                    : settings.ankle_stiffness_n_m_rad;
      give_[i] = stiffness > 0.0 ? 1.0 / stiffness : 0.0;
    }
  }

  void reset() { first_ = true; }
  /// First call of a tick: the encoders. Precondition: !unusable(sensors).
  /// @param plan  the plan for the instant of the measurement
  /// @param foot_S  bends the legs' springs, if encoders do not see them
  /// @param turn_I  turn of the IMU since the last tick [rad]
  /// @return nothing at first; motion of the IMU if the soles that carry do not move
  std::optional<AttitudeFilter::Seen> see(const PatternSample& plan, const Eigen::VectorXd& q,
                                          const std::array<robot::Wrench, 2>& foot_S,
                                          const Eigen::Vector3d& turn_I) {
    kinematics_.update(Eigen::Isometry3d::Identity(), q);
    bend_legs(q, foot_S);
    const Eigen::Isometry3d X_IB = kinematics_.X_WL(biped_->imu).inverse();
    const Eigen::Matrix3d R_before = math::exp_so3(-turn_I);
    const double left = left_weight(plan);
    AttitudeFilter::Seen seen{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (Side s : robot::kSides) {
      const double share = s == kLeft ? left : 1.0 - left;
      const Eigen::Isometry3d X_IS = X_IB * X_BS(s), before = std::exchange(X_IS_[s], X_IS);
      seen.v_I += share / kTick_s * (R_before * before.translation() - X_IS.translation());
      seen.rate_I += share / kTick_s *
                     math::log_so3(Eigen::Matrix3d(before.linear() * X_IS.linear().transpose()));
    }
    if (first_) return std::nullopt;
    return seen;
  }
  /// After see(). @param R_WI  attitude of the IMU, of any heading. No allocation.
  const BodyEstimate& step(const PatternSample& plan, const Eigen::Quaterniond& R_WI,
                           const std::array<robot::Wrench, 2>& foot_S) {
    const Eigen::Matrix3d R_IB =
        R_WI.toRotationMatrix() * kinematics_.X_WL(biped_->imu).linear().transpose();
    const std::array<Anchored, 2> seen{anchor(kLeft, plan, R_IB), anchor(kRight, plan, R_IB)};
    const double left = left_weight(plan);
    const auto blend = [left](const auto& l, const auto& r) {
      return (left * l + (1.0 - left) * r).eval();
    };

    const double turn = math::wrap_pi(seen[kLeft].yaw_rad - seen[kRight].yaw_rad);
    now_.X_WB.linear() = about_z(seen[kRight].yaw_rad + left * turn) * R_IB;
    now_.X_WB.translation() = blend(seen[kLeft].p_WB_m, seen[kRight].p_WB_m);
    now_.com_W_m = blend(seen[kLeft].com_W_m, seen[kRight].com_W_m);

    Eigen::Vector2d a_W = Eigen::Vector2d::Zero();
    for (Side s : robot::kSides) {
      a_W += (now_.X_WB.linear() * (X_BS(s).linear() * foot_S[s].force)).head<2>() / mass_kg_;
    }
    // Each foot's view is followed on its own: a change of the blend is no motion.
    std::array<Eigen::Vector2d, 2> off;
    for (Side s : robot::kSides) {
      const bool carries = (s == kLeft ? left : 1.0 - left) > 0.0;
      if (first_ || !carries) com_[s] = seen[s].com_W_m.head<2>();
      off[s] = seen[s].com_W_m.head<2>() - com_[s];
    }
    if (first_) {
      now_.com_v_W.setZero();
    } else {
      now_.com_v_W += kTick_s * (a_W + pole_1_s_ * pole_1_s_ * blend(off[kLeft], off[kRight]));
    }
    for (Side s : robot::kSides) com_[s] += kTick_s * (now_.com_v_W + 2.0 * pole_1_s_ * off[s]);
    first_ = false;
    return now_;
  }
  const BodyEstimate& now() const { return now_; }
  /// Pose of a sole in the base by the encoders of the last step.
  const Eigen::Isometry3d& X_BS(Side side) const {
    return kinematics_.X_WL(biped_->leg[side].sole);
  }
  static const char* unusable_imu(const Sensors& sensors, bool imu_attitude) {
    if (imu_attitude) {
      const bool turns = std::abs(sensors.R_WI.norm() - 1.0) <= 1e-3;  // false for NaN
      return turns ? nullptr : "inertial measurement unit: attitude is not a rotation";
    }
    return sensors.gyro_I.allFinite() && sensors.specific_force_I.allFinite()
               ? nullptr
               : "inertial measurement unit: a value is not finite";
  }
  /// nullptr, or the fault of the sensors: size or a value that is not finite.
  const char* unusable(const Sensors& sensors, bool imu_attitude) const {
    const auto dof = biped_->tree.dof();
    if (sensors.q.size() != dof) return "encoders: wrong number of joints";
    if (!sensors.q.allFinite()) return "encoders: a position is not finite";
    if (const char* why = unusable_imu(sensors, imu_attitude)) return why;
    for (const robot::Wrench& w : sensors.foot_S) {
      if (!w.force.allFinite() || !w.moment.allFinite()) {
        return "foot force sensors: a value is not finite";
      }
    }
    return nullptr;
  }

 private:
  static Eigen::Matrix3d about_z(double angle_rad) {
    return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }

  /// Joints where the ground's force on the foot has turned them to, q = q_motor + τ/k [eq. 6.11].
  void bend_legs(const Eigen::VectorXd& q, const std::array<robot::Wrench, 2>& foot_S) {
    if (give_ == decltype(give_){}) return;
    q_ = q;
    for (Side s : robot::kSides) {
      const Eigen::Vector3d force_B = X_BS(s).linear() * foot_S[s].force,
                            moment_B = X_BS(s).linear() * foot_S[s].moment;
      for (std::size_t i = 0; i < give_.size(); ++i) {
        const int dof = biped_->leg[s].dof[i];
        const Eigen::Isometry3d& X_BL = kinematics_.X_WL(biped_->tree.moved_link(dof));
        const Eigen::Vector3d lever_B = X_BS(s).translation() - X_BL.translation();
        q_[dof] +=
            give_[i] *
            (X_BL.linear() * biped_->tree.moved(dof).axis).dot(moment_B + lever_B.cross(force_B));
      }
    }
    kinematics_.update(Eigen::Isometry3d::Identity(), q_);
  }

  struct Anchored {
    double yaw_rad;  ///< turns the IMU's heading into the plan's
    Eigen::Vector3d com_W_m, p_WB_m;
  };
  /// Body pose if foot `side` stands as planned and the IMU's tilt is right.
  Anchored anchor(Side side, const PatternSample& plan, const Eigen::Matrix3d& R_IB) const {
    const Eigen::Isometry3d& X_WS = plan.foot[side].X_WS;
    const Eigen::Isometry3d& X_BS = kinematics_.X_WL(biped_->leg[side].sole);
    Anchored a;
    a.yaw_rad = math::wrap_pi(math::yaw_of(X_WS.linear()) - math::yaw_of(R_IB * X_BS.linear()));
    const Eigen::Matrix3d R_WB = about_z(a.yaw_rad) * R_IB;
    a.p_WB_m = X_WS.translation() - R_WB * X_BS.translation();
    a.com_W_m = a.p_WB_m + R_WB * kinematics_.com();
    return a;
  }

  const robot::Biped* biped_;
  robot::Kinematics kinematics_;  ///< with the base at the origin
  double mass_kg_, pole_1_s_;
  std::array<double, 6> give_{};  ///< of a leg's joints [rad/(N m)]
  Eigen::VectorXd q_;
  bool first_ = true;
  std::array<Eigen::Isometry3d, 2> X_IS_;  ///< soles in the IMU's frame
  std::array<Eigen::Vector2d, 2> com_;     ///< ĉ seen from each foot, at the next tick
  BodyEstimate now_;
};

/// Compliance c of the legs: a leg that bears F is δ = c F shorter than its set-points
/// [docs/walking.md eq. 6.6]. c by least squares over the last seconds, Σ F δ / Σ F², from encoders
/// that see the springs; 0 for stiff joints and for encoders on the motors' side.
class LegGive {
 public:
  void reset() { load_ = shortening_ = 0.0; }
  /// Once a tick for each leg.
  void measure(double normal_n, double shorter_m) {
    constexpr double kForget = kTick_s / 2.0;  // seconds
    load_ += kForget * (normal_n * normal_n - load_);
    shortening_ += kForget * (normal_n * shorter_m - shortening_);
  }
  /// c [m/N]; 0 as long as the mean load is below `least_n`.
  double m_n(double least_n) const {
    constexpr double kMost_m_n = 1e-5;
    return load_ < least_n * least_n ? 0.0 : std::clamp(shortening_ / load_, 0.0, kMost_m_n);
  }

 private:
  double load_ = 0.0, shortening_ = 0.0;
};

}  // namespace mimesis::walker
