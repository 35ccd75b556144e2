#include "nodes/walker/filter/whole_body.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::walker {
namespace {

/// Knees that are bent less than the first value do not move in this model; those bent more than
/// the second move as the closed form says. Towards a straight knee the joints need ever more
/// acceleration (as bend⁻³, up to 10⁴ rad/s²) to lengthen the leg by nothing; no drive follows
/// that. Undisturbed walks of 0.35 m/s keep 0.5 rad.
constexpr double kRigidBend_rad = 0.1, kFreeBend_rad = 0.3;

/// A leg that is straighter is stretched.
constexpr double kStraight_rad = 0.01;

using Eigen::Isometry3d, Eigen::Vector3d;

/// Time between the postures of central differences: exact to 1e-7 of walking's accelerations;
/// rounding leaves 1e-9 rad/s².
constexpr double kLittle_s = 1e-3;
/// Corrections of the pelvis by the CoM's error; each leaves some 3 % of it. From the extrapolated
/// lever of the last tick one is enough.
constexpr int kPasses = 2;

Eigen::Matrix3d about_z(double yaw) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  Eigen::Matrix3d R;
  R << c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0;
  return R;
}

template <class V>
V rate(const V& before, const V& after) {
  return (after - before) / (2.0 * kLittle_s);
}

template <class V>
V acceleration(const V& before, const V& now, const V& after) {
  return (after - 2.0 * now + before) / (kLittle_s * kLittle_s);
}

Isometry3d sole_at(const FootState& foot, double t) {
  const double yaw = t * (foot.yaw_rate_rad_s + 0.5 * t * foot.yaw_acceleration);
  Isometry3d X;
  X.linear() = about_z(yaw) * foot.X_WS.linear();
  X.translation() = foot.X_WS.translation() + t * (foot.v_W + 0.5 * t * foot.a_W);
  X.makeAffine();
  return X;
}

/// Share of its joints' motion that a leg has in the model.
double freedom(double bend_rad) {
  const double u =
      std::clamp((bend_rad - kRigidBend_rad) / (kFreeBend_rad - kRigidBend_rad), 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
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
  for (Posture& posture : posture_) {
    for (const Side side : robot::kSides)
      posture.leg[side] = biped.half_sitting(biped.leg[side].dof);
  }
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

/// Goals at time `t` from now: soles, centre of mass and turning of the pelvis.
void WholeBody::aim(double t, const PatternSample& sample, const ComState& com, Posture& out) {
  const Eigen::Vector2d p = com.p_W_m + t * (com.v_W + 0.5 * t * com.a_W);
  out.com_W << p, com_height_;
  out.X_WB.linear() =
      about_z(sample.yaw_rad + t * (sample.yaw_rate_rad_s + 0.5 * t * yaw_acceleration(sample)));
  for (const Side side : robot::kSides) out.X_WS[side] = sole_at(sample.foot[side], t);
}

/// Puts the pelvis where its point `lever_B` is the planned centre of mass, and the legs to the
/// soles.
void WholeBody::stand(const Vector3d& lever_B, Posture& out) {
  out.lever_B = lever_B;
  out.X_WB.translation() = out.com_W - out.X_WB.linear() * lever_B;
  const Isometry3d X_BW = out.X_WB.inverse();
  for (const Side side : robot::kSides) {
    const robot::LegIk::Result leg =
        ik_[side].solve(X_BW * out.X_WS[side], kStraight_rad, &out.leg[side]);
    out.leg[side] = leg.q;
    out.freedom[side] = leg.stretched || leg.limited ? 0.0 : freedom(leg.bend_rad);
  }
}

Vector3d WholeBody::own_com_B(const Posture& posture, const Vector3d& upper_moment) {
  Vector3d moment = upper_moment;
  for (const Side side : robot::kSides) {
    moment += leg_mass_[side].first_moment(posture.leg[side]);
  }
  return moment / mass_;
}

/// A lever with which own_com_B() is closer to the lever itself.
Vector3d WholeBody::better_lever(const Posture& posture, const Vector3d& com_B) const {
  return posture.lever_B + gain_.cwiseProduct(com_B - posture.lever_B);
}

void WholeBody::search(const Moments& moments, const Lever* lever) {
  auto& [before, now, after] = posture_;
  if (lever == nullptr || !lever->known) {
    for (std::size_t i = 0; i < 3; ++i) {
      stand(com_B_, posture_[i]);
      for (int pass = 0; pass < kPasses; ++pass) {
        stand(better_lever(posture_[i], own_com_B(posture_[i], moments[i])), posture_[i]);
      }
    }
    return;
  }
  const auto predicted = [lever](double t) {
    return Vector3d(lever->p_m + t * (lever->v + t / 2.0 * (lever->a + t / 3.0 * lever->jerk)));
  };
  stand(predicted(kTick_s), now);
  const Vector3d shift = better_lever(now, own_com_B(now, moments[1])) - now.lever_B;
  stand(now.lever_B + shift, now);
  stand(predicted(kTick_s - kLittle_s) + shift, before);
  stand(predicted(kTick_s + kLittle_s) + shift, after);
}

/// A leg that is nearly straight would carry its accelerations over to the pelvis and the other
/// leg: as far as it does not move, the pelvis goes the way of the centre of mass.
void WholeBody::calm(double share) {
  const auto& now = posture_[1];
  for (const std::size_t i : {0U, 2U}) {
    stand(now.lever_B + share * (posture_[i].lever_B - now.lever_B), posture_[i]);
  }
}

void WholeBody::remember(const Moments& moments, Lever& lever) {
  const bool goes_on = lever.known;
  lever.known = free_;
  if (!free_) return;
  const auto& [before, now, after] = posture_;
  const Vector3d first = better_lever(before, own_com_B(before, moments[0])),
                 last = better_lever(after, own_com_B(after, moments[2]));
  lever.p_m = better_lever(now, now_com_B_);
  lever.v = rate(first, last);
  const Vector3d a = acceleration(first, lever.p_m, last);
  lever.jerk = goes_on ? Vector3d((a - lever.a) / kTick_s) : Vector3d::Zero();
  lever.a = a;
}

const robot::RobotMotion& WholeBody::motion(const PatternSample& sample, const ComState& com,
                                            const UpperBody& upper, const Moments& moments,
                                            Lever* lever) {
  for (std::size_t i = 0; i < 3; ++i) {
    aim((static_cast<double>(i) - 1.0) * kLittle_s, sample, com, posture_[i]);
  }
  search(moments, lever);
  const auto share = [this](Side side) {
    return std::min(
        {posture_[0].freedom[side], posture_[1].freedom[side], posture_[2].freedom[side]});
  };
  const std::array<double, 2> free_share{share(kLeft), share(kRight)};
  const double least = std::min(free_share[kLeft], free_share[kRight]);
  unreachable_ = least == 0.0;
  free_ = least == 1.0;
  if (!free_) calm(least);
  now_com_B_ = own_com_B(posture_[1], moments[1]);
  move_pelvis(sample);
  for (const Side side : robot::kSides) move_leg(side, free_share[side]);
  move_upper_body(upper);
  if (lever != nullptr) remember(moments, *lever);
  return motion_;
}

void WholeBody::move_pelvis(const PatternSample& sample) {
  const auto& [before, now, after] = posture_;
  motion_.X_WB = now.X_WB;
  motion_.v_W = rate<Vector3d>(before.X_WB.translation(), after.X_WB.translation());
  motion_.a_W = acceleration<Vector3d>(before.X_WB.translation(), now.X_WB.translation(),
                                       after.X_WB.translation());
  motion_.omega_W.z() = sample.yaw_rate_rad_s;
  motion_.alpha_W.z() = yaw_acceleration(sample);
}

/// `share`: share of its joints' motion that the leg has.
void WholeBody::move_leg(Side side, double share) {
  const auto& [before, now, after] = posture_;
  const Vector6d dq = share * rate(before.leg[side], after.leg[side]);
  const Vector6d ddq = share * acceleration(before.leg[side], now.leg[side], after.leg[side]);
  for (std::size_t i = 0; i < 6; ++i) {
    const int dof = biped_->leg[side].dof[i];
    const auto n = static_cast<Eigen::Index>(i);
    motion_.q[dof] = now.leg[side][n];
    motion_.dq[dof] = dq[n];
    motion_.ddq[dof] = ddq[n];
  }
}

void WholeBody::move_upper_body(const UpperBody& upper) {
  for (std::size_t i = 0; i < biped_->upper_body.size(); ++i) {
    const int dof = biped_->upper_body[i];
    const auto n = static_cast<Eigen::Index>(i);
    motion_.q[dof] = upper.q[n];
    motion_.dq[dof] = upper.dq[n];
    motion_.ddq[dof] = upper.ddq[n];
  }
}

Eigen::Vector2d WholeBody::zmp(const PatternSample& sample, const ComState& com,
                               const UpperBody& upper, const Moments& moments, Lever* lever) {
  robot::Wrench ground = dynamics_.ground_wrench(motion(sample, com, upper, moments, lever));
  // f = m (c̈ + g ẑ) acts at the planned c: n += c × f − c_found × f_found                [eq. 5.1]
  const Vector3d& c = posture_[1].com_W;
  const Vector3d force = mass_ * Vector3d(com.a_W.x(), com.a_W.y(), robot::kGravity);
  ground.moment += c.cross(force) - Vector3d(motion_.X_WB * now_com_B_).cross(ground.force);
  ground.force = force;
  return robot::zmp_of(ground);
}

}  // namespace mimesis::walker
