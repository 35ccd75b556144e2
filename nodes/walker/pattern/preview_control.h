#pragma once
#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

inline constexpr double kGravity_m_s2 = robot::kGravity;

/// ZMP of the cart-table model [Kajita 2003; docs/walking.md eq. 1.1], a CoM at constant height h
/// above level ground: z = p − (h/g) p̈ per axis.
inline Eigen::Vector2d zmp(const ComState& com, double height_m) {
  return com.p_W_m - height_m / kGravity_m_s2 * com.a_W;
}

/// Cart-tables are linear: motions add.
inline ComState operator+(const ComState& a, const ComState& b) {
  return {.p_W_m = a.p_W_m + b.p_W_m, .v_W = a.v_W + b.v_W, .a_W = a.a_W + b.a_W};
}

/// State after a time t [s] of constant jerk j [m/s³]:
///   p⁺ = p + t ṗ + t²/2 p̈ + t³/6 j,   ṗ⁺ = ṗ + t p̈ + t²/2 j,   p̈⁺ = p̈ + t j              [eq. 1.2]
inline ComState advance(const ComState& com, const Eigen::Vector2d& j, double t) {
  ComState next;
  next.p_W_m = com.p_W_m + t * (com.v_W + t * (com.a_W / 2.0 + t / 6.0 * j));
  next.v_W = com.v_W + t * (com.a_W + t / 2.0 * j);
  next.a_W = com.a_W + t * j;
  return next;
}

/// State after t seconds with the ZMP z at rest, a linear inverted pendulum, ω = √(g/h) [eq. 1.4]:
///   p⁺ = z + (p − z) cosh ωt + ṗ/ω sinh ωt
inline ComState with_zmp_at_rest(const ComState& com, double height_m, double t) {
  const double w = std::sqrt(kGravity_m_s2 / height_m), c = std::cosh(w * t), s = std::sinh(w * t);
  const Eigen::Vector2d z = zmp(com, height_m), d = com.p_W_m - z;
  return {.p_W_m = z + c * d + s / w * com.v_W,
          .v_W = w * s * d + c * com.v_W,
          .a_W = w * w * (c * d + s / w * com.v_W)};
}

/// One axis of the cart-table in discrete time: x⁺ = A x + b u, x = (p, ṗ, p̈), u the jerk over dt;
/// ZMP z = c x. [Kajita 2003; docs/walking.md eq. 3.1]
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

struct PreviewSettings {
  double height_m = 0.807;
  double dt_s = kTick_s;
  int samples = 320;          ///< length of the preview
  double jerk_weight = 1e-5;  ///< R: cost Σ (z − z_ref)² + R u²
};

/// Gains of preview control [Katayama 1985; docs/walking.md 3].
struct PreviewGains {
  Eigen::RowVector3d K;
  double Ks = 0.0;    ///< of integral_gains()
  Eigen::VectorXd F;  ///< samples
  /// Fᵢ = input · closed_loopⁱ · output, in three or four states.
  Eigen::MatrixXd closed_loop;  ///< (A − b K)ᵀ
  Eigen::RowVectorXd input;     ///< bᵀ / (R + bᵀPb)
  Eigen::VectorXd output;       ///< cᵀ, or P c̃ᵀ
};

/// u = −K x + Σᵢ₌₀ Fᵢ z_ref(k+i): three states.
PreviewGains preview_gains(const PreviewSettings& settings);
/// u = −K x + Ks Σ (z_ref − z) + Σᵢ₌₁ Fᵢ₋₁ z_ref(k+i): four states, the sum of errors first.
PreviewGains integral_gains(const PreviewSettings& settings);

/// Moves a cart-table so that its ZMP follows a reference that is known some time ahead, by
/// integral_gains() [Kajita 2003].
class PreviewControl {
 public:
  explicit PreviewControl(const PreviewSettings& settings);
  /// `last_jerk`: the jerk over the dt that led to `com`.
  void reset(const ComState& com, const Eigen::Vector2d& last_jerk = Eigen::Vector2d::Zero());
  /// Advances by one dt. `zmp_ref[i]` is the reference i · dt from now. After its last element (or
  /// after `samples`) the reference is assumed to stay constant, so that a standing robot's gains
  /// do not depend on where it stands. Not empty. Does not allocate.
  void step(std::span<const Eigen::Vector2d> zmp_ref);
  /// The jerk that the next step() with this reference uses [m/s³].
  Eigen::Vector2d jerk(std::span<const Eigen::Vector2d> zmp_ref) const;
  /// Predicts the states that steps with this reference lead to: coms[i] after i steps, coms[0] =
  /// com(). One backward pass over the reference (constant after its end) gives all preview sums,
  /// so it costs little more than a few steps. Fills min(zmp_ref.size(), coms.size()) states. Does
  /// not allocate once it was called with this size.
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
  ComState last_com_;  // one step ago
  Eigen::Vector2d last_jerk_ = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> previewed_;  // Σᵢ Fᵢ r(k+i) for every k
};

/// Brings the CoM to rest above a point by state feedback u = −K x, K from preview_gains().
class Standing {
 public:
  explicit Standing(double height_m);
  ComState after(ComState com, const Eigen::Vector2d& middle_W_m, int ticks) const;
  /// The CoM is so close to the point and to rest that this feedback keeps the ZMP well between the
  /// feet.
  static bool settled(const ComState& com, const Eigen::Vector2d& middle_W_m);

 private:
  Eigen::RowVector3d gain_;
};

/// Share of the weight on the left foot: where the ZMP is between the ankles; 0 or 1 on one foot.
double left_share(const PatternSample& sample);

}  // namespace mimesis::walker
