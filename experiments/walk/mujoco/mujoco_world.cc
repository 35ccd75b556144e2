#include "experiments/walk/mujoco/mujoco_world.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/robot/dynamics.h"

namespace mimesis::walk {

using robot::Side;

MujocoWorld::MujocoWorld(const robot::Biped& biped, const hw::sim::BodyOptions& options)
    : biped_(&biped),
      options_(options),
      model_(make_mujoco_model(biped, options)),
      engine_(model_.xml),
      fall_(biped, Eigen::AngleAxisd(options.slope_rad.x(), Eigen::Vector3d::UnitY()) *
                       (Eigen::AngleAxisd(options.slope_rad.y(), Eigen::Vector3d::UnitX()) *
                        Eigen::Vector3d::UnitZ())),
      set_point_(biped.half_sitting),
      row_(Row(engine_.start().data(), static_cast<Eigen::Index>(engine_.start().size()))),
      ramp_(biped.half_sitting),
      motor_(biped.half_sitting),
      motor_before_(biped.half_sitting),
      errors_(options.senses, options.seed) {
  MIMESIS_ASSERT(row_.size() == model_.end);
  sensors_.torque = Eigen::VectorXd::Zero(biped.tree.dof());
  observe(0.0);
}

void MujocoWorld::push(const hw::sim::Push& push) {
  const double dt = options_.dt_s;
  const long first = std::max(done_, std::lround(push.at_s / dt));
  const long steps = std::max(1L, std::lround(push.duration_s / dt));
  pushes_.push_back({push.link.empty() ? biped_->trunk : biped_->tree.require_link(push.link),
                     push.impulse_W_ns / (static_cast<double>(steps) * dt), first, first + steps});
}

void MujocoWorld::step(std::span<const double> target, double duration_s) {
  if (truth_.fell && !row_.allFinite()) return;  // nothing moves on from numbers that are none
  const auto dof = static_cast<Eigen::Index>(target.size());
  MIMESIS_ASSERT(dof == set_point_.size());
  const int steps = std::max(1, static_cast<int>(std::lround(duration_s / options_.dt_s)));
  const Eigen::VectorXd start = set_point_, goal = Row(target.data(), dof)
                                                       .cwiseMax(biped_->tree.lower())
                                                       .cwiseMin(biped_->tree.upper());
  const std::size_t width = target.size() + 3 * biped_->tree.links().size();
  std::vector<double> wishes(static_cast<std::size_t>(steps) * width, 0.0);
  for (int i = 0; i < steps; ++i) {
    set_point_ = start + double(i + 1) / double(steps) * (goal - start);
    wish(done_ + i, {wishes.data() + static_cast<std::size_t>(i) * width, width});
  }
  set_point_ = goal;
  const std::span<const double> rows = engine_.step(wishes, steps);

  sensors_.torque.setZero();
  sensors_.foot_S.fill({});
  truth_.most_normal_n = 0.0;
  Ground ground;
  for (int i = 0; i < steps; ++i) {
    feel(std::span(wishes).subspan(static_cast<std::size_t>(i) * width, width),
         Row(rows.data() + i * model_.end, model_.end), ground);
  }
  row_ = Row(rows.data() + steps * model_.end, model_.end);
  done_ += steps;
  sensors_.torque /= steps;
  for (const Side side : robot::kSides) {
    robot::Wrench& wrench = sensors_.foot_S[side];
    wrench.force /= steps;
    wrench.moment /= steps;
    truth_.normal_n[side] = wrench.force.z();
    truth_.ankle_pitch_n_m[side] =
        (wrench.moment - biped_->leg[side].ankle_S_m.cross(wrench.force)).y();
  }
  if (ground.vertical_n > 1e-9) truth_.zmp_W_m = ground.weighted_W / ground.vertical_n;
  observe(steps * options_.dt_s);
}

void MujocoWorld::wish(long step, std::span<double> row) {
  std::size_t at = 0;
  const auto put = [&](int joint) {
    const double most = model_.motors[static_cast<std::size_t>(joint)].speed_rad_s * options_.dt_s;
    ramp_[joint] = std::clamp(set_point_[joint], ramp_[joint] - most, ramp_[joint] + most);
    row[at++] = ramp_[joint];
  };
  std::ranges::for_each(model_.springs, put);
  std::ranges::for_each(model_.servos, put);
  for (const RunningPush& push : pushes_) {
    if (step < push.first_step || step >= push.last_step) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      row[at + 3 * model_.body[static_cast<std::size_t>(push.link)] + k] +=
          push.force_W_n[static_cast<Eigen::Index>(k)];
    }
  }
}

/// Adds a step's forces, and moves the motors. `wish`: what was asked of the step.
void MujocoWorld::feel(std::span<const double> wish, const Row& row, Ground& ground) {
  row_ = row;
  sensors_.torque += row.segment(model_.torque, sensors_.torque.size());
  motor_before_ = motor_;
  for (std::size_t i = 0; i < model_.springs.size(); ++i) {
    const int joint = model_.springs[i];
    const hw::sim::MotorModel& motor = model_.motors[static_cast<std::size_t>(joint)];
    const double most = motor.torque_n_m / motor.stiffness_n_m_rad, q = row[model_.q + joint];
    motor_[joint] = std::clamp(wish[i], q - most, q + most);
  }
  for (std::size_t i = 0; i < model_.servos.size(); ++i) {
    sensors_.torque[model_.servos[i]] += row[model_.servo_torque + static_cast<Eigen::Index>(i)];
  }
  double normal_n = 0.0;
  for (const Side side : robot::kSides) {
    const auto contact =
        row.segment<MujocoModel::kContact>(model_.contacts + side * MujocoModel::kContact);
    const Eigen::Vector3d force_W = contact.head<3>(), moment_W = contact.segment<3>(3),
                          point_W = contact.tail<3>();
    const Eigen::Isometry3d X_SW = X_WL(biped_->leg[side].sole).inverse();
    const Eigen::Vector3d force_S = X_SW.linear() * force_W;
    sensors_.foot_S[side].force += force_S;
    sensors_.foot_S[side].moment += (X_SW * point_W).cross(force_S) + X_SW.linear() * moment_W;
    ground.weighted_W +=
        point_W.head<2>() * force_W.z() + Eigen::Vector2d(-moment_W.y(), moment_W.x());
    ground.vertical_n += force_W.z();
    normal_n += force_S.z();
  }
  truth_.most_normal_n = std::max(truth_.most_normal_n, normal_n);
}

Eigen::Isometry3d MujocoWorld::X_WL(int link) const {
  const auto pose = row_.segment<MujocoModel::kPose>(model_.poses + link * MujocoModel::kPose);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = pose.head<3>();
  X.linear() = Eigen::Quaterniond(pose[3], pose[4], pose[5], pose[6]).toRotationMatrix();
  return X;
}

/// `duration_s`: since it observed last; 0 at the start.
void MujocoWorld::observe(double duration_s) {
  const int dof = biped_->tree.dof();
  sensors_.q = row_.segment(model_.q, dof);
  sensors_.dq = row_.segment(model_.dq, dof);
  if (options_.senses.motor_encoders) {
    for (const int joint : model_.springs) {
      sensors_.q[joint] = motor_[joint];
      sensors_.dq[joint] = (motor_[joint] - motor_before_[joint]) / options_.dt_s;
    }
  }
  const Eigen::Matrix3d R_WI = X_WL(biped_->imu).linear();
  const Eigen::Vector3d v_W = row_.segment<3>(model_.imu);
  Eigen::Vector3d felt_W(0.0, 0.0, robot::kGravity);
  sensors_.gyro_I.setZero();
  if (duration_s > 0.0) {
    sensors_.gyro_I = math::log_so3(R_WI_.transpose() * R_WI) / duration_s;
    felt_W += (v_W - v_imu_W_) / duration_s;
  }
  v_imu_W_ = v_W;
  R_WI_ = R_WI;
  sensors_.R_WI = Eigen::Quaterniond(R_WI);
  sensors_.specific_force_I = R_WI.transpose() * felt_W;

  truth_.time_s = static_cast<double>(done_) * options_.dt_s;
  truth_.X_WB = X_WL(0);
  for (const Side side : robot::kSides) {
    truth_.X_WS[side] = X_WL(biped_->leg[side].sole);
    if (biped_->hand[side] >= 0) truth_.hand_W_m[side] = X_WL(biped_->hand[side]).translation();
  }
  truth_.com_W_m = row_.segment<3>(model_.com);
  truth_.com_v_W = row_.segment<3>(model_.com + 3);
  if (done_ == 0) truth_.zmp_W_m = truth_.com_W_m.head<2>();
  judge();
  errors_.spoil(truth_.time_s, sensors_);
}

void MujocoWorld::judge() {
  if (truth_.fell) return;
  const bool left =
      sensors_.foot_S[robot::kLeft].force.z() >= sensors_.foot_S[robot::kRight].force.z();
  truth_.how = row_.allFinite()
                   ? fall_.how(truth_.com_W_m, X_WL(biped_->trunk).linear(), set_point_,
                               left ? robot::kLeft : robot::kRight)
                   : "the physics gave no numbers at " + std::to_string(truth_.time_s) + " s";
  truth_.fell = !truth_.how.empty();
}

}  // namespace mimesis::walk
