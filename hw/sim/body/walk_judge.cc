#include "hw/sim/body/walk_judge.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/math/so3.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kLowPass_s = 0.02;  // of forces and torques: time constant, first order
constexpr double kSettle_s = 0.08;   // from a planned landing until the foot's place is read

/// A foot's place as the other one sees it.
Eigen::Vector2d seen_from(const Eigen::Vector2d& foot_W_m, const Eigen::Vector2d& other_W_m,
                          double other_yaw_rad) {
  return Eigen::Rotation2Dd(-other_yaw_rad) * (foot_W_m - other_W_m);
}

}  // namespace

Eigen::Isometry2d truth_to_plan(const PlannedGround& plan, const BodyTruth& truth) {
  const double normal = truth.normal_n[0] + truth.normal_n[1];
  const double left = normal > 0.0 ? truth.normal_n[robot::kLeft] / normal : 0.5;
  const std::array share{left, 1.0 - left};
  double turn = 0.0;
  for (const robot::Side s : robot::kSides) {
    turn += share[s] * math::wrap_pi(plan.foot_yaw_rad[s] - math::yaw_of(truth.X_WS[s].linear()));
  }
  Eigen::Isometry2d X = Eigen::Isometry2d::Identity();
  X.linear() = Eigen::Rotation2Dd(turn).toRotationMatrix();
  for (const robot::Side s : robot::kSides) {
    X.translation() +=
        share[s] * (plan.foot_W_m[s] - X.linear() * truth.X_WS[s].translation().head<2>());
  }
  return X;
}

void WalkJudge::tick(const BodyTruth& truth, const std::optional<PlannedGround>& plan) {
  if (figures_.fell) return;  // a fallen robot does not walk any more
  const double normal = truth.normal_n[0] + truth.normal_n[1];
  const double share = started_ ? 1.0 - std::exp(-(truth.time_s - time_s_) / kLowPass_s) : 1.0;
  started_ = true;
  time_s_ = truth.time_s;
  figures_.fell = truth.fell;
  figures_.how = truth.how;

  normal_n_ += share * (normal - normal_n_);
  figures_.normal_peak_n = std::max(figures_.normal_peak_n, normal_n_);
  figures_.raw_normal_peak_n = std::max(figures_.raw_normal_peak_n, truth.most_normal_n);
  for (std::size_t i = 0; i < 2; ++i) {
    const double now = truth.ankle_pitch_n_m[i];
    ankle_pitch_n_m_[i] += share * (now - ankle_pitch_n_m_[i]);
    figures_.ankle_pitch_peak_n_m = std::max(figures_.ankle_pitch_peak_n_m, std::abs(now));
    figures_.ankle_pitch_slow_peak_n_m =
        std::max(figures_.ankle_pitch_slow_peak_n_m, std::abs(ankle_pitch_n_m_[i]));
  }
  if (plan && normal > 0.0) {
    zmp_squares_ += (truth_to_plan(*plan, truth) * truth.zmp_W_m - plan->zmp_W_m).cwiseAbs2();
    figures_.zmp_error_rms_m = (zmp_squares_ / static_cast<double>(++zmp_count_)).cwiseSqrt();
  }
  std::erase_if(landed_, [&](const Landed& landed) {
    if (landed.read_at_s > time_s_ + 1e-9) return false;
    read(landed.step, truth);
    return true;
  });
}

void WalkJudge::step(const JudgedStep& step) {
  if (figures_.fell) return;
  ++figures_.steps;
  landed_.push_back({step, time_s_ + kSettle_s});
}

void WalkJudge::read(const JudgedStep& step, const BodyTruth& truth) {
  const Eigen::Isometry3d& X_WO = truth.X_WS[robot::other(step.side)];
  const Eigen::Vector2d foot = truth.X_WS[step.side].translation().head<2>();
  const Eigen::Vector2d real =
      seen_from(foot, X_WO.translation().head<2>(), math::yaw_of(X_WO.linear()));
  const double error =
      (real - seen_from(step.planned_W_m, step.planned_other_W_m, step.planned_other_yaw_rad))
          .norm();
  step_squares_ += error * error;
  figures_.step_error_max_m = std::max(figures_.step_error_max_m, error);
  figures_.step_error_rms_m = std::sqrt(step_squares_ / ++steps_read_);
  if (step.wished_length_m) {
    figures_.step_length_error_max_m =
        std::max(figures_.step_length_error_max_m, std::abs(real.x() - *step.wished_length_m));
  }
}

namespace {

// The CoM below this share of the standing height, or this tilt of the trunk from the set-points'
// tilt on level soles: a robot that bends for a low drawer has not fallen.
constexpr double kFallenShare = 0.6, kFallenTilt_rad = 0.9;

}  // namespace

FallJudge::FallJudge(const robot::Biped& biped, const Eigen::Vector3d& up_W)
    : biped_(&biped), up_W_(up_W), wished_(biped.tree) {}

std::string FallJudge::how(const Eigen::Vector3d& com_W_m, const Eigen::Matrix3d& R_WT,
                           const Eigen::VectorXd& set_point, robot::Side loaded) {
  const double height = up_W_.dot(com_W_m);
  if (height < kFallenShare * biped_->com_height_m) {
    return "centre of mass at " + std::to_string(height) + " m";
  }
  // the trunk's z axis from where the set-points have it above a level sole
  wished_.update(Eigen::Isometry3d::Identity(), set_point);
  const Eigen::Vector3d z_B = wished_.X_WL(biped_->leg[loaded].sole).linear().col(2);
  const Eigen::Vector3d up_T = wished_.X_WL(biped_->trunk).linear().transpose() * z_B;
  const double tilt = std::acos(std::clamp(up_T.dot(R_WT.row(2).transpose()), -1.0, 1.0));
  if (tilt > kFallenTilt_rad) return "trunk tilted by " + std::to_string(tilt) + " rad";
  return {};
}

}  // namespace mimesis::hw::sim
