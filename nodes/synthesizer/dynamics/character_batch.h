#pragma once
#include <Eigen/Core>
#include <memory>
#include <span>

#include "common/motion/model/motion_model.h"
#include "nodes/synthesizer/dynamics/motion_series.h"

namespace mimesis::synthesizer {

struct CharacterOptions {
  double dt_s = 1.0 / 60.0;  ///< step, in (0, 0.1]; integrated in parts of at most 1/120 s
  /// H of MotionSeries; 0: by tolerance_rad. Recorded cycles do not close exactly, which fills all
  /// harmonics a little: 10 to 14 give smoother velocities than the tolerance does.
  int harmonics = 0;
  double tolerance_rad = 1e-3;  ///< largest error of the cut-off series at the joints
  /// Characters may have parameters of their own (set_parameters): a series of about 6 kB each.
  /// Without, they share the model's patterns, and large crowds stay in the cache.
  bool individual = false;
  bool foot_lock = false;  ///< keep the standing feet in place (posture.h)
};

/// Where a character's pelvis is. The heading frame H: origin at the pelvis, x forward along the
/// heading, z up.
struct RootPose {
  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  double height_m = 0.0;     ///< above the ground, so that the lowest foot point touches it
  double heading_rad = 0.0;  ///< heading of H in W, + to the left; not wrapped
  Eigen::Vector2d velocity_H_m_s = Eigen::Vector2d::Zero();  ///< forward, left
  double yaw_rate_rad_s = 0.0;
  int support = 0;  ///< mocap::Side of the standing foot
};

/// Synthesizes whole-body motion online for one robot or for thousands of characters [M18 3.3.4,
/// fig. 3.19]. A character is one leading Andronov-Hopf oscillator [eq. 3.16, 3.18],
///   ẋ = (1 − |x|²) x + ω J x + α (x_ext − x),
/// whose phase φ = atan2(x₂, x₁) drives all sources at once: the other oscillators of the star have
/// nothing to add once they follow their leader. The posture is the mixture
/// at φ, forward kinematics gives the joints, and the standing foot moves the pelvis
/// (posture.h).
///
/// Patterns are tables of their series (MotionSeries; at least 512 rows a cycle, 130 kB), with the
/// cubic in between; parameters of a character's own are the series itself. Phases are integrated
/// in double by RK4, postures computed in float: joint angles deviate by less than 1e-5 rad,
/// positions by less than 1e-5 m from the same formulas in double. A character's numbers depend on
/// nothing but its own inputs: not on the batch, its place there or the machine's vector width.
/// step() does not allocate, nor do the setters.
///
/// Body rows ("lhip.x") that the model lacks stay zero; rows that are no body rows (a robot's
/// joints) are synthesized but move nothing.
class CharacterBatch {
 public:
  /// All characters start with pattern 0, its duration's frequency (1 s if it has none), phase 0,
  /// at the origin, heading along x.
  /// @throws ConfigError for a model that does not fit together. @pre count >= 1
  CharacterBatch(const motion::MotionModel& model, int count, const CharacterOptions& options = {});
  ~CharacterBatch();
  CharacterBatch(CharacterBatch&&) noexcept;
  CharacterBatch& operator=(CharacterBatch&&) noexcept;

  int size() const;
  int rows() const;  ///< R, in the model's order
  const MotionSeries& series() const;

  /// Character i moves by the model's pattern p from now on, at once: smooth changes are the
  /// caller's (control/), by set_blend or set_parameters every step.
  void set_pattern(int i, int p);
  /// Parameters of its own. Needs `individual`. Sizes as in Pattern. Some µs.
  /// @param beta  shares of the patterns, one each: pelvis and contacts are a blend of theirs
  void set_parameters(int i, const Eigen::Ref<const Eigen::VectorXd>& mean_rad,
                      const Eigen::Ref<const Eigen::MatrixXd>& weight_rad,
                      const Eigen::Ref<const Eigen::MatrixXd>& delay_rad,
                      std::span<const double> beta);
  /// Σₚ βₚ · pattern p over all patterns of the model, one β each: means and weights blend linearly
  /// [M18 eq. 3.21] since tied delays are the same in all. Needs model.tied. Costs a mixture per
  /// β ≠ 0 and frame, and nothing to set.
  void set_blend(int i, std::span<const double> beta);

  void set_frequency(int i, double omega_rad_s);  ///< ω ≥ 0
  void set_phase(int i, double phase_rad);        ///< puts the oscillator there, radius 1
  /// Coupling to an external oscillator at phase_rad, held until changed [eq. 3.18].
  /// @param alpha_1_s  α in [0, 100] 1/s; 0: none
  void set_external(int i, double phase_rad, double alpha_1_s);
  void set_root(int i, const Eigen::Vector2d& position_W_m, double heading_rad);
  /// Turn of the heading beside that of the patterns, held until changed: feet that stand stay.
  void set_turn(int i, double rate_rad_s);

  void step();
  /// Postures of what was set, where they are; nothing moves. The next step starts there.
  void settle();

  double phase(int i) const;                   ///< [0, 2π)
  Eigen::Vector2d state(int i) const;          ///< x of the oscillator [1]
  std::span<const float> angles(int i) const;  ///< R values [rad], with the foot lock's change
  RootPose root(int i) const;
  Eigen::Vector3d joint_W_m(int i, int body_joint) const;  ///< centre of a mocap::BodyJoint
  Eigen::Vector3d heel_W_m(int i, int side) const;         ///< mocap::Side
  Eigen::Vector3d toe_W_m(int i, int side) const;

 private:
  struct Tile;
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mimesis::synthesizer
