#include "nodes/walker/stabilizer/stabilizer.h"

#include "common/error.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {
namespace {

constexpr double kLeastShare =
    0.2;  ///< share of the weight on the ground below which a ZMP is noise
constexpr int kForgotten_ticks = 100;  ///< without an IMU: the old attitude means nothing

}  // namespace

Stabilizer::Stabilizer(const robot::Biped& biped, const GaitSettings& gait,
                       const StabilizerSettings& settings)
    : settings_(settings),
      weight_n_(biped.tree.mass_kg() * robot::kGravity),
      wrench_share_(low_pass_share(settings.wrench_filter_s)),
      attitude_(settings.attitude_s),
      estimator_(biped, settings_),
      slope_(settings_),
      feedback_(gait.com_height_m, settings_),
      offset_(feedback_.omega_1_s(), settings_),
      admittance_(settings_),
      adjustment_(settings_),
      ground_(biped, settings_.edge_margin_m),
      feet_(biped, settings_) {
  if (settings.delay_ticks < 1 || settings.delay_ticks >= kHistory) {
    throw ConfigError("stabilizer.delay_ticks: " + std::to_string(settings.delay_ticks) +
                      " is outside [1, " + std::to_string(kHistory - 1) + "]");
  }
  command_.reason.reserve(128);
  reset();
}

void Stabilizer::reset() {
  estimator_.reset();
  feedback_.reset();
  offset_.reset();
  admittance_.reset();
  adjustment_.reset();
  give_.reset();
  feet_.reset();
  slope_.reset();
  command_.ground = {};
  at_ = remembered_ = 0;
  blind_ = true;
  command_.falling = command_.saturated = false;
  command_.reason.clear();
}

/// @return the plan for the instant of the present measurement, with the pelvis of that instant
const StabilizerPlan& Stabilizer::remember(const StabilizerPlan& plan) {
  at_ = (at_ + 1) % kHistory;
  history_[std::size_t(at_)] = {plan, command_.X_WS};
  if (remembered_ == 0) {
    for (Side s : robot::kSides)
      history_[std::size_t(at_)].X_WS_last[s] = plan.pattern.foot[s].X_WS;
  }
  remembered_ = std::min(remembered_ + 1, settings_.delay_ticks + 1);
  const int back = std::min(settings_.delay_ticks, remembered_ - 1);
  return history_[std::size_t((at_ + kHistory - back) % kHistory)].plan;
}

void Stabilizer::filter(const std::array<robot::Wrench, 2>& foot_S) {
  const double share = blind_ ? 1.0 : wrench_share_;
  for (Side s : robot::kSides) {
    wrench_S_[s].force += share * (foot_S[s].force - wrench_S_[s].force);
    wrench_S_[s].moment += share * (foot_S[s].moment - wrench_S_[s].moment);
  }
}

void Stabilizer::without_feedback(const StabilizerPlan& plan, const char* why) {
  estimator_.reset();
  feedback_.reset();
  offset_.lost();
  blind_ = true;
  const Eigen::Vector2d zmp = plan.pattern.zmp_W_m;
  admittance_.step(zmp, zmp);
  move_com();
  command_.pattern_shift_W_m = adjustment_.step(
      plan.pattern, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), false, 0.0});
  command_.X_WS = feet_.fade(plan.pattern);
  command_.dcm_error_W_m.setZero();
  command_.com_W_m.head<2>() = plan.com.p_W_m;
  command_.X_WB = plan.X_WB_last;
  command_.zmp_W_m = command_.wished_zmp_W_m = zmp;
  command_.saturated = false;
  if (!command_.falling) command_.reason.assign(why);
}

const Eigen::Quaterniond& Stabilizer::watch(const Sensors& sensors) {
  return attitude(sensors, AttitudeFilter::Seen{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()},
                  true);
}

const Eigen::Quaterniond& Stabilizer::attitude(const Sensors& sensors,
                                               const std::optional<AttitudeFilter::Seen>& seen,
                                               bool rests) {
  if (settings_.imu_attitude) return sensors.R_WI;
  if (Estimator::unusable_imu(sensors, false) != nullptr) {
    if (++unseen_ >= kForgotten_ticks) attitude_.reset();
    return attitude_.R_WI();
  }
  unseen_ = 0;
  return attitude_.step({sensors.gyro_I, sensors.specific_force_I, seen, rests}, kTick_s);
}

void Stabilizer::measure_ground(const PatternSample& plan, const BodyEstimate& body) {
  std::array<Eigen::Vector3d, 2> up_W;
  std::array<double, 2> load_n;
  for (Side s : robot::kSides) {
    up_W[s] = body.X_WB.linear() * estimator_.X_BS(s).linear().col(2);
    load_n[s] = wrench_S_[s].force.z();
  }
  command_.ground = slope_.step(plan, up_W, load_n, kLeastShare * weight_n_);
}

void Stabilizer::measure_give(const Past& sent) {
  for (Side s : robot::kSides) {
    const Eigen::Isometry3d X_BS = sent.plan.X_WB_last.inverse() * sent.X_WS_last[s];
    give_.measure(wrench_S_[s].force.z(),
                  estimator_.X_BS(s).translation().z() - X_BS.translation().z());
  }
}

void Stabilizer::move_com() {
  command_.com_shift_W_m = admittance_.shift_m() + adjustment_.com_W_m();
  command_.com_shift_v_W = admittance_.rate_m_s() + adjustment_.com_v_W();
}

/// Tilt counts from the commanded pelvis, so that wished bending is no fall.
void Stabilizer::watch_fall(const BodyEstimate& body, const Eigen::Isometry3d& X_WB_sent) {
  if (command_.falling) return;
  command_.reason.clear();
  const double upright = body.X_WB.linear().col(2).dot(X_WB_sent.linear().col(2));
  if (std::acos(std::clamp(upright, -1.0, 1.0)) > settings_.fall_tilt_rad) {
    command_.reason.assign("falling: the pelvis is tilted beyond fall_tilt_rad");
  } else if (command_.dcm_error_W_m.norm() > settings_.fall_dcm_m) {
    command_.reason.assign("falling: the divergent component is off by more than fall_dcm_m");
  }
  command_.falling = !command_.reason.empty();
}

/// Plan with both feet at their adjusted places.
const StabilizerPlan& Stabilizer::adjusted(const StabilizerPlan& plan) {
  adjustment_.follow();
  plan_ = plan;
  for (Side s : robot::kSides) {
    plan_.pattern.foot[s].X_WS.translation().head<2>() += adjustment_.foot_W_m(s);
  }
  return plan_;
}

const StabilizerCommand& Stabilizer::step(const StabilizerPlan& unadjusted,
                                          const Sensors& sensors) {
  const StabilizerPlan& plan = adjusted(unadjusted);
  const StabilizerPlan& past = remember(plan);
  if (const char* why = estimator_.unusable(sensors, settings_.imu_attitude)) {
    attitude(sensors, std::nullopt, false);
    without_feedback(plan, why);
    return command_;
  }
  // Set-points are stored with the plan of the next tick: the entry after the past one has them.
  const int back = std::min(settings_.delay_ticks, remembered_ - 1);
  const Past& sent = history_[std::size_t((at_ + kHistory - std::max(back - 1, 0)) % kHistory)];

  filter(sensors.foot_S);
  const auto seen = estimator_.see(past.pattern, sensors.q, wrench_S_,
                                   kTick_s * (sensors.gyro_I - attitude_.gyro_bias_I()));
  const Eigen::Quaterniond& R_WI = attitude(sensors, seen, past.pattern.gait == Gait::standing);
  const BodyEstimate& body = estimator_.step(past.pattern, R_WI, sensors.foot_S);
  measure_ground(past.pattern, body);
  blind_ = false;
  measure_give(sent);
  const auto zmp = measured_zmp(past.pattern, wrench_S_, kLeastShare * weight_n_);
  command_.com_W_m = body.com_W_m;
  if (zmp) {
    offset_.measure(body.com_W_m.head<2>(), body.com_v_W, *zmp, past.pattern.yaw_rad);
  } else {
    offset_.lost();
  }
  command_.com_W_m.head<2>() -= offset_.offset_W_m(past.pattern.yaw_rad);
  feedback_.measure(past.com, command_.com_W_m.head<2>(), body.com_v_W);
  command_.X_WB = body.X_WB;
  command_.dcm_error_W_m = feedback_.error_m();
  watch_fall(body, sent.plan.X_WB_last);

  const Eigen::Vector2d wished =
      plan.pattern.zmp_W_m + feedback_.step(command_.saturated, plan.pattern.yaw_rad);
  command_.wished_zmp_W_m = ground_.reachable(plan.pattern, wished);
  command_.saturated = command_.wished_zmp_W_m != wished;

  if (zmp) {
    command_.zmp_W_m = *zmp;
    admittance_.step(*zmp, command_.wished_zmp_W_m);
  }
  move_com();
  command_.pattern_shift_W_m =
      adjustment_.step(plan.pattern, {feedback_.error_m(),
                                      command_.wished_zmp_W_m - plan.pattern.zmp_W_m,
                                      command_.saturated,
                                      feedback_.omega_1_s(),
                                      {feet_.touched(kLeft), feet_.touched(kRight)}});
  command_.X_WS =
      feet_.step(plan.pattern, ground_.distribute(plan.pattern, command_.wished_zmp_W_m),
                 {wrench_S_, sent.plan.X_WB_last, body.X_WB,
                  settings_.leg_give_share * give_.m_n(kLeastShare * weight_n_)});
  return command_;
}

}  // namespace mimesis::walker
