#pragma once
#include "common/robot/kinematics.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/sensors.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Where the body is, seen from the feet that carry it: in the frame of the plan, in which those
/// feet stand where they are planned. Drift and slip of the whole robot do not show.
struct BodyEstimate {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d com_v_W = Eigen::Vector2d::Zero();
};

/// Estimator of encoders, attitude of the IMU and the kinematic chain to the standing feet
/// [walking.md 8.6.2, 8.7]: attitude from the IMU but for its heading, which is that of the
/// standing feet; in double support both feet count by their planned shares of the weight.
class Estimator {
 public:
  Estimator(const robot::Biped& biped, const StabilizerSettings& settings);

  void reset();
  /// @param plan  of the instant that the sensors tell about
  /// No allocation. Precondition: !unusable(sensors).
  const BodyEstimate& step(const PatternSample& plan, const Sensors& sensors);
  /// Of the encoders at the last step.
  const Eigen::Isometry3d& X_BS(Side side) const {
    return kinematics_.X_WL(biped_->leg[side].sole);
  }
  /// nullptr, or what is wrong with the sensors: size or a value that is not finite.
  const char* unusable(const Sensors& sensors) const;

 private:
  struct Anchored {
    double yaw_rad;  ///< turns the IMU's heading into the plan's
    Eigen::Vector3d com_W_m, p_WB_m;
  };
  Anchored anchor(Side side, const PatternSample& plan, const Eigen::Matrix3d& R_IB) const;

  const robot::Biped* biped_;
  robot::Kinematics kinematics_;  ///< with the base at the origin
  double velocity_share_;
  bool first_ = true;
  std::array<Eigen::Vector3d, 2> last_com_;  ///< as seen from each foot
  BodyEstimate now_;
};

/// Share of the left foot in carrying: 1 or 0 in single support.
double left_weight(const PatternSample& plan);

}  // namespace mimesis::walker
