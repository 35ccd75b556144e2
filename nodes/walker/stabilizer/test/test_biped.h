#pragma once
#include "common/robot/kinematics.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/estimator.h"

namespace mimesis::walker {

/// models/biped.urdf with the names that make it a biped for the stabilizer.
inline robot::Biped test_biped() {
  robot::Biped biped{
      robot::read_urdf(MIMESIS_SOURCE_DIR "/models/biped.urdf"), {}, {}, 0, 0, {}, {}, {}};
  for (Side s : robot::kSides) {
    biped.leg[s].sole = biped.tree.require_link(s == kLeft ? "left_sole" : "right_sole");
    biped.leg[s].min_S_m = {-0.1, s == kLeft ? -0.056 : -0.075};
    biped.leg[s].max_S_m = {0.13, s == kLeft ? 0.075 : 0.056};
    std::size_t i = 0;
    for (const char* joint :
         {"hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll"}) {
      biped.leg[s].dof[i++] =
          biped.tree.require_joint(std::string(s == kLeft ? "left_" : "right_") + joint);
    }
  }
  biped.imu = biped.tree.require_link("chest");
  biped.half_sitting = Eigen::VectorXd::Zero(biped.tree.dof());
  for (const char* side : {"left", "right"}) {
    const auto set = [&](const char* joint, double degrees) {
      biped.half_sitting[biped.tree.require_joint(std::string(side) + joint)] =
          degrees * M_PI / 180.0;
    };
    set("_hip_pitch", -26.0), set("_knee", 50.0), set("_ankle_pitch", -24.0);
  }
  return biped;
}

/// Standing with the soles at ±0.095 m, the CoM above their middle.
inline PatternSample standing(double com_x_m = 0.0) {
  PatternSample plan;
  plan.com.p_W_m.x() = plan.zmp_W_m.x() = com_x_m;
  plan.foot[kLeft].X_WS.translation().y() = 0.095;
  plan.foot[kRight].X_WS.translation().y() = -0.095;
  return plan;
}

/// Sensor readings of a robot with its pelvis at X_WB; nothing presses on its feet.
inline Sensors sensors_at(const robot::Biped& biped, const Eigen::Isometry3d& X_WB,
                          const Eigen::VectorXd& q) {
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(X_WB, q);
  Sensors sensors;
  sensors.q = q;
  sensors.dq = Eigen::VectorXd::Zero(q.size());
  sensors.R_WI = Eigen::Quaterniond(kinematics.X_WL(biped.imu).linear());
  sensors.specific_force_I = sensors.R_WI.conjugate() * Eigen::Vector3d(0, 0, robot::kGravity);
  return sensors;
}

}  // namespace mimesis::walker
