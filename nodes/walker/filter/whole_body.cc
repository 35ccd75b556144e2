#include "nodes/walker/filter/whole_body.h"

#include <cmath>

#include "common/error.h"

namespace mimesis::walker {
namespace {

constexpr double kLeastPressure = 0.2;  ///< of the weight

using Eigen::Isometry3d, Eigen::Vector3d;

/// "A little": central differences of postures over it are exact to 1e-7 of walking's
/// accelerations; rounding leaves 1e-9 rad/s².
constexpr double kLittle_s = 1e-3;
/// Corrections of the pelvis by the CoM's error; each leaves some 3 % of it. From where the CoM was
/// a tick ago, carried on, one does.
constexpr int kPasses = 2, kPassesFromLever = 1;

Isometry3d upright(double yaw, const Vector3d& p) {
  Isometry3d X = Isometry3d::Identity();
  const double c = std::cos(yaw), s = std::sin(yaw);
  X.linear() << c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0;
  X.translation() = p;
  return X;
}

Isometry3d sole_at(const FootState& foot, double t) {
  const double yaw = t * (foot.yaw_rate_rad_s + 0.5 * t * foot.yaw_acceleration);
  const Vector3d p = foot.X_WS.translation() + t * (foot.v_W + 0.5 * t * foot.a_W);
  Isometry3d X = upright(yaw, p);
  X.linear() *= foot.X_WS.linear();
  return X;
}

double yaw_acceleration(const PatternSample& sample) {
  return 0.5 * (sample.foot[kLeft].yaw_acceleration + sample.foot[kRight].yaw_acceleration);
}

}  // namespace

WholeBody::WholeBody(const robot::Biped& biped, double com_height_m)
    : biped_(&biped),
      com_height_(com_height_m),
      dynamics_(biped.tree),
      ik_{robot::LegIk(biped, kLeft), robot::LegIk(biped, kRight)},
      upper_mass_(biped.tree, biped.upper_body, true),
      leg_mass_{robot::PartMass(biped.tree, biped.leg[kLeft].dof, false),
                robot::PartMass(biped.tree, biped.leg[kRight].dof, false)},
      mass_(biped.tree.mass_kg()),
      upper_q_(static_cast<Eigen::Index>(biped.upper_body.size())),
      motion_(biped.tree.dof()) {
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(Isometry3d::Identity(), biped.half_sitting);
  com_B_ = kinematics.com();
  measure_lag();
}

void WholeBody::measure_lag() {
  constexpr double kShift_m = 1e-3;
  const auto com = [&](const Vector3d& shift) {
    Vector3d moment = Vector3d::Zero();
    for (const Side side : robot::kSides) {
      Isometry3d X_BS = biped_->X_WB_half_sitting.inverse();
      X_BS.translation() -= shift;
      X_BS.translation().y() += robot::sign(side) * 0.5 * biped_->feet_distance_m;
      moment += leg_mass_[side].first_moment(ik_[side].solve(X_BS).q);
    }
    return Vector3d(shift + moment / mass_);
  };
  for (int i = 0; i < 3; ++i) {
    const Vector3d step = kShift_m * Vector3d::Unit(i);
    gain_[i] = 2.0 * kShift_m / (com(step) - com(-step))[i];
  }
}

WholeBody::Moments WholeBody::moments(const UpperBody& upper) {
  MIMESIS_ASSERT(upper.q.size() == upper_q_.size() && upper.dq.size() == upper_q_.size() &&
                 upper.ddq.size() == upper_q_.size());
  Moments out;
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = (static_cast<double>(i) - 1.0) * kLittle_s;
    upper_q_ = upper.q + t * upper.dq + (0.5 * t * t) * upper.ddq;
    out[i] = upper_mass_.first_moment(upper_q_);
  }
  return out;
}

void WholeBody::solve(double t, const PatternSample& sample, const ComState& com,
                      const Vector3d& upper_moment, const Lever* lever, Posture& out) {
  const double yaw =
      sample.yaw_rad + t * (sample.yaw_rate_rad_s + 0.5 * t * yaw_acceleration(sample));
  const Eigen::Vector2d p = com.p_W_m + t * (com.v_W + 0.5 * t * com.a_W);
  const Vector3d wished(p.x(), p.y(), com_height_);
  const std::array<Isometry3d, 2> X_WS{sole_at(sample.foot[kLeft], t),
                                       sole_at(sample.foot[kRight], t)};
  Isometry3d X_WB = upright(yaw, Vector3d::Zero());
  const bool known = lever != nullptr && lever->known;
  const int passes = known ? kPassesFromLever : kPasses;
  Vector3d com_B = com_B_;
  if (known) {
    const double since = t + kTick_s;
    com_B = lever->p_m + since * (lever->v + 0.5 * since * lever->a);
  }
  X_WB.translation() = wished - X_WB.linear() * com_B;
  for (int pass = 0;; ++pass) {
    Vector3d moment = upper_moment;
    const Isometry3d X_BW = X_WB.inverse();
    for (const Side side : robot::kSides) {
      const robot::LegIk::Result leg = ik_[side].solve(X_BW * X_WS[side]);
      out.leg[side] = leg.q;
      out.fits[side] = !leg.stretched && !leg.limited;
      if (pass < passes) moment += leg_mass_[side].first_moment(leg.q);
    }
    if (pass == passes) break;
    const Vector3d error_B = X_BW * wished - moment / mass_;
    X_WB.translation() += X_WB.linear() * gain_.cwiseProduct(error_B);
  }
  out.p_WB = X_WB.translation();
  out.lever_B = X_WB.linear().transpose() * (wished - out.p_WB);
}

void WholeBody::remember(Lever& lever) const {
  const auto& [before, now, after] = posture_;
  lever.p_m = now.lever_B;
  lever.v = (after.lever_B - before.lever_B) / (2.0 * kLittle_s);
  lever.a = (after.lever_B - 2.0 * now.lever_B + before.lever_B) / (kLittle_s * kLittle_s);
  lever.known = !unreachable_;
}

const robot::RobotMotion& WholeBody::motion(const PatternSample& sample, const ComState& com,
                                            const UpperBody& upper, const Moments& moments,
                                            Lever* lever) {
  for (std::size_t i = 0; i < 3; ++i) {
    solve((static_cast<double>(i) - 1.0) * kLittle_s, sample, com, moments[i], lever, posture_[i]);
  }
  const auto rate = [](const auto& before, const auto& after) {
    return (after - before) / (2.0 * kLittle_s);
  };
  const auto acceleration = [](const auto& before, const auto& now, const auto& after) {
    return (after - 2.0 * now + before) / (kLittle_s * kLittle_s);
  };
  const auto& [before, now, after] = posture_;
  motion_.X_WB = upright(sample.yaw_rad, now.p_WB);
  motion_.v_W = rate(before.p_WB, after.p_WB);
  motion_.a_W = acceleration(before.p_WB, now.p_WB, after.p_WB);
  motion_.omega_W.z() = sample.yaw_rate_rad_s;
  motion_.alpha_W.z() = yaw_acceleration(sample);
  unreachable_ = false;
  for (const Side side : robot::kSides) {
    const bool fits = before.fits[side] && now.fits[side] && after.fits[side];
    unreachable_ = unreachable_ || !fits;
    for (std::size_t i = 0; i < 6; ++i) {
      const int dof = biped_->leg[side].dof[i];
      const auto q = [&](const Posture& p) { return p.leg[side][static_cast<Eigen::Index>(i)]; };
      motion_.q[dof] = q(now);
      motion_.dq[dof] = fits ? rate(q(before), q(after)) : 0.0;
      motion_.ddq[dof] = fits ? acceleration(q(before), q(now), q(after)) : 0.0;
    }
  }
  if (lever != nullptr) remember(*lever);
  for (std::size_t i = 0; i < biped_->upper_body.size(); ++i) {
    const int dof = biped_->upper_body[i];
    const auto n = static_cast<Eigen::Index>(i);
    motion_.q[dof] = upper.q[n];
    motion_.dq[dof] = upper.dq[n];
    motion_.ddq[dof] = upper.ddq[n];
  }
  return motion_;
}

Eigen::Vector2d WholeBody::zmp(const PatternSample& sample, const ComState& com,
                               const UpperBody& upper, const Moments& moments, Lever* lever) {
  const robot::Wrench ground = dynamics_.ground_wrench(motion(sample, com, upper, moments, lever));
  // A wish that throws the upper body about can ask the ground to pull, which has no ZMP
  const bool pressed = ground.force.z() > kLeastPressure * mass_ * robot::kGravity;
  return pressed ? robot::zmp_of(ground) : sample.zmp_W_m;
}

}  // namespace mimesis::walker
