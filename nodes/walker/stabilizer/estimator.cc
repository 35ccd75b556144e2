#include "nodes/walker/stabilizer/estimator.h"

#include "common/math/so3.h"

namespace mimesis::walker {
namespace {

Eigen::Matrix3d about_z(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

double left_weight(const PatternSample& plan) {
  if (!plan.contact[kLeft]) return 0.0;
  return plan.contact[kRight] ? std::clamp(plan.left_share, 0.0, 1.0) : 1.0;
}

Estimator::Estimator(const robot::Biped& biped, const StabilizerSettings& settings)
    : biped_(&biped),
      kinematics_(biped.tree),
      velocity_share_(low_pass_share(settings.velocity_filter_s)) {}

void Estimator::reset() { first_ = true; }

const char* Estimator::unusable(const Sensors& sensors) const {
  const auto dof = biped_->tree.dof();
  if (sensors.q.size() != dof) return "encoders: wrong number of joints";
  if (!sensors.q.allFinite()) return "encoders: a position is not finite";
  if (!sensors.R_WI.coeffs().allFinite() || std::abs(sensors.R_WI.norm() - 1.0) > 1e-3) {
    return "inertial measurement unit: attitude is not a rotation";
  }
  for (const robot::Wrench& w : sensors.foot_S) {
    if (!w.force.allFinite() || !w.moment.allFinite()) {
      return "foot force sensors: a value is not finite";
    }
  }
  return nullptr;
}

/// Body pose if foot `side` stands as planned and the IMU's tilt is right.
Estimator::Anchored Estimator::anchor(Side side, const PatternSample& plan,
                                      const Eigen::Matrix3d& R_IB) const {
  const Eigen::Isometry3d& X_WS = plan.foot[side].X_WS;
  const Eigen::Isometry3d& X_BS = kinematics_.X_WL(biped_->leg[side].sole);
  Anchored a;
  a.yaw_rad =
      std::remainder(math::yaw_of(X_WS.linear()) - math::yaw_of(R_IB * X_BS.linear()), 2.0 * M_PI);
  const Eigen::Matrix3d R_WB = about_z(a.yaw_rad) * R_IB;
  a.p_WB_m = X_WS.translation() - R_WB * X_BS.translation();
  a.com_W_m = a.p_WB_m + R_WB * kinematics_.com();
  return a;
}

const BodyEstimate& Estimator::step(const PatternSample& plan, const Sensors& sensors) {
  kinematics_.update(Eigen::Isometry3d::Identity(), sensors.q);
  const Eigen::Matrix3d R_IB =
      sensors.R_WI.toRotationMatrix() * kinematics_.X_WL(biped_->imu).linear().transpose();
  const std::array<Anchored, 2> seen{anchor(kLeft, plan, R_IB), anchor(kRight, plan, R_IB)};
  const double left = left_weight(plan);
  const auto blend = [left](const auto& l, const auto& r) { return left * l + (1.0 - left) * r; };

  const double turn = std::remainder(seen[kLeft].yaw_rad - seen[kRight].yaw_rad, 2.0 * M_PI);
  now_.X_WB.linear() = about_z(seen[kRight].yaw_rad + left * turn) * R_IB;
  now_.X_WB.translation() = blend(seen[kLeft].p_WB_m, seen[kRight].p_WB_m);
  now_.com_W_m = blend(seen[kLeft].com_W_m, seen[kRight].com_W_m);

  // Each foot's view is differentiated on its own: a change of the blend is no motion.
  if (first_) {
    now_.com_v_W.setZero();
  } else {
    const Eigen::Vector3d v = blend(Eigen::Vector3d(seen[kLeft].com_W_m - last_com_[kLeft]),
                                    Eigen::Vector3d(seen[kRight].com_W_m - last_com_[kRight])) /
                              kTick_s;
    now_.com_v_W += velocity_share_ * (v.head<2>() - now_.com_v_W);
  }
  for (Side s : robot::kSides) last_com_[s] = seen[s].com_W_m;
  first_ = false;
  return now_;
}

}  // namespace mimesis::walker
