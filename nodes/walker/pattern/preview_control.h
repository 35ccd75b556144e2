#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "nodes/walker/pattern/cart_table.h"

namespace mimesis::walker {

/// x⁺ = A x + b u per axis: x = (p, ṗ, p̈), u the jerk over dt, ZMP = c x. [Kajita 2003]
struct CartTableAxis {
  CartTableAxis(double dt_s, double height_m);
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
  Eigen::RowVector3d c;
};

/// P ⪰ 0 of the discrete algebraic Riccati equation for one input,
/// P = AᵀPA − AᵀPb (R + bᵀPb)⁻¹ bᵀPA + Q, by structure-preserving doubling [Chu, Fan, Lin,
/// Wang 2004]: converges quadratically. Precondition: (A, b) can be stabilized, (A, Q) detected.
/// @throws ConfigError if it does not converge: these conditions fail
Eigen::MatrixXd riccati(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                        const Eigen::MatrixXd& Q, double R);

enum class PreviewForm {
  kPosition,  ///< u = −K x + Σᵢ₌₀ Fᵢ z_ref(k+i): three states
  kIntegral  ///< u = −K x + Ks Σ (z_ref − z) + Σᵢ₌₁ Fᵢ z_ref(k+i): the error's sum is a state
};

struct PreviewSettings {
  PreviewForm form = PreviewForm::kPosition;
  double height_m = 0.807;
  double dt_s = kTick_s;
  int samples = 320;  ///< of the reference that are looked at
  double zmp_weight = 1.0, jerk_weight = 1e-5;
};

/// Gains of both forms [walking.md 1.6; Katayama 1985].
struct PreviewGains {
  Eigen::RowVector3d K;
  double Ks = 0.0;    ///< kIntegral only
  Eigen::VectorXd F;  ///< samples; F(0) belongs to z_ref(k) (kPosition) or z_ref(k+1) (kIntegral)
  /// Fᵢ = input · closed_loopⁱ · output: of the three states, or the error's sum and these.
  Eigen::MatrixXd closed_loop;  ///< (A − b K)ᵀ
  Eigen::RowVectorXd input;     ///< bᵀ / (R + bᵀPb)
  Eigen::VectorXd output;
};

/// @throws ConfigError that names height, dt, samples or weight out of range
PreviewGains preview_gains(const PreviewSettings& settings);

/// Moves a cart-table so that its ZMP follows a reference that is known some time ahead.
class PreviewControl {
 public:
  explicit PreviewControl(const PreviewSettings& settings);
  /// `last_jerk`: that led to `com` over the dt before.
  void reset(const ComState& com, const Eigen::Vector2d& last_jerk = Eigen::Vector2d::Zero());
  /// One dt on. `zmp_ref[i]` is the reference i · dt from now. What comes after its last element
  /// (or after `samples`) is taken to be equal to it, so that a standing robot's gains do not
  /// depend on where it stands. Not empty. Does not allocate.
  void step(std::span<const Eigen::Vector2d> zmp_ref);
  /// The jerk that the next step() with this reference uses [m/s³].
  Eigen::Vector2d jerk(std::span<const Eigen::Vector2d> zmp_ref) const;
  /// Where steps with this reference lead: coms[i] after i of them, coms[0] = com(). Looks at all
  /// of the reference at once, from its end (which stays for ever), so that it costs little more
  /// than a few steps. Of both sizes the smaller counts. Does not allocate once it had this size.
  void roll_out(std::span<const Eigen::Vector2d> zmp_ref, std::span<ComState> coms);
  const ComState& com() const { return com_; }
  Eigen::Vector2d zmp_W_m() const { return zmp(com_, settings_.height_m); }
  const PreviewGains& gains() const { return gains_; }
  void shift(const Eigen::Vector2d& shift_W_m);

 private:
  Eigen::Vector2d feedback(const ComState& x) const;  // K x

  PreviewSettings settings_;
  PreviewGains gains_;
  ComState com_;
  ComState last_com_;  // a step ago
  Eigen::Vector2d last_jerk_ = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> previewed_;  // the sum over the reference, for every k
};

}  // namespace mimesis::walker
