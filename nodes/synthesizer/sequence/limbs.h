#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// Where a foot is. The sole is at z = 0 if pitch is zero and the ankle at its height.
struct FootPose {
  Eigen::Vector3d p_W_ankle = Eigen::Vector3d::Zero();  ///< [m]
  double yaw_rad = 0.0;                                 ///< toes out to the left: +
  double pitch_rad = 0.0;                               ///< about y: + toes down
};

/// Axis-angle vectors of the three joints of a limb, from the trunk outwards, and how much too far
/// the target was (0 if it was reached; the limb points to it, stretched, otherwise).
struct LimbAngles {
  std::array<Eigen::Vector3d, 3> axis_angle_rad;
  double short_by_m = 0.0;
};

/// Hip, knee and ankle that put the ankle at `p_W_ankle` and the foot at `R_W_foot` (place_foot()
/// of dynamics/lanes.h, to 2e-6 rad). The knee is a hinge about y and bends to where pelvis and
/// toes point. Needs offsets of knee and ankle along −z, as bodies have them.
LimbAngles leg_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_root,
                      const Eigen::Vector3d& p_W_root, const Eigen::Vector3d& p_W_ankle,
                      const Eigen::Matrix3d& R_W_foot);

/// Shoulder, elbow and wrist (straight) that put the finger tips at `p_W_hand`. The elbow is a
/// hinge about z and points to `elbow_W` as far as the target allows. Needs offsets of elbow, wrist
/// and hand along ±y.
LimbAngles arm_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_chest,
                      const Eigen::Vector3d& p_W_shoulder, const Eigen::Vector3d& p_W_hand,
                      const Eigen::Vector3d& elbow_W);

Eigen::Matrix3d foot_rotation(const FootPose& foot);

/// One stand of a foot on the ground: heel first, then the whole sole, then the toes.
struct Footprint {
  double x_m = 0.0, y_m = 0.0;    ///< place of the ankle while the sole is flat, W
  double strike_s = 0.0;          ///< the heel touches
  double flat_s = 0.0;            ///< the sole is down
  double heel_off_s = 0.0;        ///< the heel leaves; infinity if the foot stays
  double lift_s = 0.0;            ///< the toes leave; infinity if the foot stays
  double strike_pitch_rad = 0.0;  ///< < 0: toes up
  double lift_pitch_rad = 0.0;    ///< > 0: heel up
};

enum class Contact { swing, heel, flat, toe };

struct FootState {
  FootPose pose;
  Contact contact = Contact::swing;
};

/// The way of one foot over its footprints. Points on the ground neither slide nor sink: the foot
/// rolls about the heel point, then about the toe point; between, a cubic with the velocities of
/// both ends and a clearance of `clearance_m` added in the middle.
class FootPath {
 public:
  /// Footprints in order of time, at least one. `body` gives heel, toe and the sole's height.
  FootPath(const mocap::Body& body, mocap::Side side, std::vector<Footprint> prints,
           double clearance_m, double yaw_rad);
  /// At time t [s], which must not be before the first strike.
  FootState at(double t) const;

 private:
  FootState standing(const Footprint& print, double t) const;
  FootPose rolled(const Footprint& print, const Eigen::Vector3d& pivot, double pitch_rad) const;

  std::vector<Footprint> prints_;
  Eigen::Vector3d heel_, toe_;
  double clearance_m_, yaw_rad_;
};

/// The non-periodic primitive of the upper body that starts when its target is presented, in any
/// phase of the gait [M18 3.3.3]: a point attractor ẋ = u·x(1 − x) [M18 eq. 3.12], whose solution
/// x = (1 + tanh(u(t − t₀)/2))/2 has a bell-shaped speed, draws one hand from where the other
/// primitives have it to the target: p = p_gait + x (p_target − p_gait).
class ArmReach {
 public:
  /// Draws the hand to the target within duration_s > 0 from now on, or back (`to_target` false).
  void start(bool to_target, double duration_s);
  /// Advances by dt [s]. The solution of eq. 3.12 in closed form: any step is exact.
  void step(double dt_s);

  /// x, scaled so that it is 0 before and 1 after the reach.
  double share() const;
  /// Changes shoulder, elbow and wrist of `angles_rad` so that the finger tips are `share()` of the
  /// way nearer to `p_W_target`; the elbow keeps its side. Returns the remaining error of the hand
  /// [m]: not 0 only if the arm is too short.
  double apply(const mocap::Body& body, mocap::Side side, const Eigen::Vector3d& p_W_pelvis,
               const Eigen::Vector3d& p_W_target, Eigen::Ref<Eigen::VectorXd> angles_rad) const;

 private:
  double x_ = 0.0, u_1_s_ = 0.0;
};

/// Keeps standing feet where they are while the pelvis goes its planned way: a mixture of few
/// sources lets them slide some centimetres. (A character that has no planned way takes its pelvis
/// from the feet instead: dynamics/posture.h.) A foot stands from when its lowest point, heel
/// or toe, is near the ground and slow, until it is neither; meanwhile that point is held. In the
/// air the correction fades away. Feet are never below the ground.
class FootHold {
 public:
  /// Corrects hips, knees and ankles of `angles_rad` (rows of the body). The pelvis stays.
  void apply(const mocap::Body& body, const Eigen::Vector3d& p_W_pelvis, double dt_s,
             Eigen::Ref<Eigen::VectorXd> angles_rad);

  bool stands(mocap::Side side) const { return foot_[side].stands; }
  /// Place of the held point, after the correction [m].
  const Eigen::Vector3d& held(mocap::Side side) const { return foot_[side].held_W_m; }
  /// Largest correction of a foot in the last call [m], and by how much a leg was too short for it.
  double correction_m() const { return correction_m_; }
  double short_by_m() const { return short_by_m_; }

 private:
  struct HeldFoot {
    bool stands = false, seen = false;
    int end = 0;  // 0: the heel is held, 1: the toes
    Eigen::Vector3d held_W_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
    std::array<Eigen::Vector3d, 2> before_W_m{};  // heel, toes as the mixture had them
  };
  void hold(HeldFoot& foot, const std::array<Eigen::Vector3d, 2>& ends_W_m, double dt_s) const;

  std::array<HeldFoot, 2> foot_{};
  double correction_m_ = 0.0, short_by_m_ = 0.0;
};

}  // namespace mimesis::synthesizer
