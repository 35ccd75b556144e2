#pragma once
#include <Eigen/Core>
#include <array>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// Keeps standing feet where they are while the pelvis goes its planned way: a mixture of few
/// sources lets them slide some centimetres. (A character that has no planned way takes its pelvis
/// from the feet instead: dynamics/root_motion.h.) A foot stands from when its lowest point, heel
/// or toe, is near the ground and slow, until it is neither; meanwhile that point is held. In the
/// air the correction fades away. Feet are never below the ground.
class FootHold {
 public:
  /// Corrects hips, knees and ankles of `angles_rad` (rows of the body). The pelvis stays.
  void apply(const mocap::Body& body, const Eigen::Vector3d& p_W_pelvis, double dt_s,
             Eigen::Ref<Eigen::VectorXd> angles_rad);

  bool stands(mocap::Side side) const { return foot_[side].stands; }
  /// Of the held point, after the correction [m].
  const Eigen::Vector3d& held(mocap::Side side) const { return foot_[side].held_W_m; }
  /// Largest correction of a foot in the last call [m], and by how much a leg was too short for it.
  double correction_m() const { return correction_m_; }
  double short_by_m() const { return short_by_m_; }

 private:
  struct Foot {
    bool stands = false, seen = false;
    int end = 0;  // 0: the heel is held, 1: the toes
    Eigen::Vector3d held_W_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
    std::array<Eigen::Vector3d, 2> before_W_m{};  // heel, toes as the mixture had them
  };
  void hold(Foot& foot, const std::array<Eigen::Vector3d, 2>& ends_W_m, double dt_s) const;

  std::array<Foot, 2> foot_{};
  double correction_m_ = 0.0, short_by_m_ = 0.0;
};

}  // namespace mimesis::synthesizer
