#include "nodes/walker/pattern/preview_control.h"

#include <Eigen/LU>
#include <algorithm>

#include "common/error.h"

// Equation numbers are those of docs/walking.md.
namespace mimesis::walker {
namespace {

/// Fᵢ = bᵀ/d (closed_loopᵀ)ⁱ output for i < samples.
void set_preview(PreviewGains& gains, const Eigen::MatrixXd& closed_loop, const Eigen::VectorXd& b,
                 double d, const Eigen::VectorXd& output, int samples) {
  gains.closed_loop = closed_loop.transpose();
  gains.input = b.transpose() / d;
  gains.output = output;
  gains.F.resize(samples);
  Eigen::VectorXd f = output;
  for (int i = 0; i < samples; ++i) {
    gains.F(i) = gains.input.dot(f);
    f = gains.closed_loop * f;
  }
}

}  // namespace

CartTableAxis::CartTableAxis(double dt_s, double height_m) {
  const double T = dt_s;
  A << 1.0, T, T * T / 2.0, 0.0, 1.0, T, 0.0, 0.0, 1.0;
  b << T * T * T / 6.0, T * T / 2.0, T;
  c << 1.0, 0.0, -height_m / kGravity_m_s2;
}

/// Doubling, with P₀ = Q, G₀ = b R⁻¹ bᵀ, A₀ = A and W = (1 + G P)⁻¹:
///   P⁺ = P + AᵀP W A,   G⁺ = G + A W G Aᵀ,   A⁺ = A W A                                  [eq. 3.3]
Eigen::MatrixXd riccati(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                        const Eigen::MatrixXd& Q, double R) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd Ak = A, G = b * b.transpose() / R, P = Q;
  for (int i = 0; i < 60; ++i) {
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(identity + G * P);
    const Eigen::MatrixXd WA = lu.solve(Ak), WG = lu.solve(G);
    const Eigen::MatrixXd dP = Ak.transpose() * P * WA;
    G += Ak * WG * Ak.transpose();
    P += dP;
    Ak = Ak * WA;
    if (!P.allFinite()) break;
    if (dP.cwiseAbs().maxCoeff() <= 1e-15 * P.cwiseAbs().maxCoeff())
      return (P + P.transpose()) / 2.0;
  }
  throw ConfigError(
      "Riccati equation: no solution found, expected a system that can be stabilized");
}

PreviewGains preview_gains(const PreviewSettings& s) {
  const CartTableAxis axis(s.dt_s, s.height_m);
  // d = R + bᵀP b,   K = bᵀP A / d,   Fᵢ = bᵀ/d ((A − b K)ᵀ)ⁱ cᵀ                         [eq. 3.4]
  const Eigen::MatrixXd P = riccati(axis.A, axis.b, axis.c.transpose() * axis.c, s.jerk_weight);
  const double d = s.jerk_weight + axis.b.dot(P * axis.b);
  PreviewGains gains;
  gains.K = axis.b.transpose() * P * axis.A / d;
  set_preview(gains, axis.A - axis.b * gains.K, axis.b, d, axis.c.transpose(), s.samples);
  return gains;
}

PreviewGains integral_gains(const PreviewSettings& s) {
  const CartTableAxis axis(s.dt_s, s.height_m);
  // With the sum of errors as first state: Ã = [1 cA; 0 A], b̃ = [cb; b], c̃ = [1 0 0 0]  [eq. 3.5]
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero(), cc = Eigen::Matrix4d::Zero();
  A(0, 0) = 1.0;
  A.block<1, 3>(0, 1) = axis.c * axis.A;
  A.block<3, 3>(1, 1) = axis.A;
  Eigen::Vector4d b;
  b << axis.c.dot(axis.b), axis.b;
  cc(0, 0) = 1.0;
  // d = R + b̃ᵀP b̃,   (Ks, K) = b̃ᵀP Ã / d,   Fᵢ = b̃ᵀ/d ((Ã − b̃ (Ks, K))ᵀ)ⁱ P c̃ᵀ          [eq. 3.6]
  const Eigen::MatrixXd P = riccati(A, b, cc, s.jerk_weight);
  const double d = s.jerk_weight + b.dot(P * b);
  const Eigen::RowVector4d K = b.transpose() * P * A / d;
  PreviewGains gains;
  gains.Ks = K(0);
  gains.K = K.tail<3>();
  set_preview(gains, A - b * K, b, d, P.col(0), s.samples);
  return gains;
}

PreviewControl::PreviewControl(const PreviewSettings& settings)
    : settings_(settings), gains_(integral_gains(settings)) {}

void PreviewControl::reset(const ComState& com, const Eigen::Vector2d& last_jerk) {
  com_ = com;
  last_com_ = advance(com, last_jerk, -settings_.dt_s);
  last_jerk_ = last_jerk;
}

Eigen::Vector2d PreviewControl::feedback(const ComState& x) const {
  return gains_.K(0) * x.p_W_m + gains_.K(1) * x.v_W + gains_.K(2) * x.a_W;
}

Eigen::Vector2d PreviewControl::jerk(std::span<const Eigen::Vector2d> zmp_ref) const {
  // Difference of two ticks of the law, so that no sum has to be kept:
  // u = u⁻ + Ks (z_ref − z) − K (x − x⁻) + Σᵢ Fᵢ (z_ref(k+1+i) − z_ref(k+i))             [eq. 3.7]
  Eigen::Vector2d u =
      last_jerk_ + gains_.Ks * (zmp_ref[0] - zmp_W_m()) - feedback(com_) + feedback(last_com_);
  const std::size_t n = std::min(static_cast<std::size_t>(gains_.F.size()), zmp_ref.size() - 1);
  for (std::size_t i = 0; i < n; ++i)
    u += gains_.F[static_cast<Eigen::Index>(i)] * (zmp_ref[i + 1] - zmp_ref[i]);
  return u;
}

void PreviewControl::step(std::span<const Eigen::Vector2d> zmp_ref) {
  last_jerk_ = jerk(zmp_ref);
  last_com_ = com_;
  com_ = advance(com_, last_jerk_, settings_.dt_s);
}

void PreviewControl::shift(const Eigen::Vector2d& shift_W_m) {
  com_.p_W_m += shift_W_m;
  last_com_.p_W_m += shift_W_m;
}

void PreviewControl::roll_out(std::span<const Eigen::Vector2d> zmp_ref, std::span<ComState> coms) {
  const std::size_t n = std::min(zmp_ref.size(), coms.size());
  if (n == 0) return;
  if (previewed_.size() < zmp_ref.size()) previewed_.resize(zmp_ref.size());
  // Σᵢ Fᵢ r(k+i) = input · s(k) with s(k) = output · r(k) + closed_loop · s(k+1), from the end
  Eigen::Matrix<double, Eigen::Dynamic, 2, 0, 4, 2> s, carried;
  s.setZero(gains_.output.size(), 2);
  for (std::size_t k = zmp_ref.size(); k-- > 0;) {
    const Eigen::Vector2d next = zmp_ref[std::min(k + 1, zmp_ref.size() - 1)];
    carried.noalias() = gains_.closed_loop * s;
    s = carried;
    s.noalias() += gains_.output * (next - zmp_ref[k]).transpose();
    previewed_[k] = (gains_.input * s).transpose();
  }
  ComState com = com_, last = last_com_;
  Eigen::Vector2d u = last_jerk_;
  for (std::size_t k = 0; k < n; ++k) {
    coms[k] = com;
    u += gains_.Ks * (zmp_ref[k] - zmp(com, settings_.height_m)) - feedback(com) + feedback(last) +
         previewed_[k];
    last = com;
    com = advance(com, u, settings_.dt_s);
  }
}

Standing::Standing(double height_m)
    : gain_(preview_gains({.height_m = height_m, .samples = 1, .jerk_weight = 1e-4}).K) {}

ComState Standing::after(ComState com, const Eigen::Vector2d& middle, int ticks) const {
  for (int i = 0; i < ticks; ++i) {
    const Eigen::Vector2d error = com.p_W_m - middle;
    if (com.a_W.isZero(0.0) && com.v_W.isZero(0.0) && error.isZero(0.0)) break;
    if (error.norm() + com.v_W.norm() + com.a_W.norm() < 1e-9) {  // no endless small numbers
      com = {.p_W_m = middle};
      break;
    }
    com = advance(com, -(gain_(0) * error + gain_(1) * com.v_W + gain_(2) * com.a_W), kTick_s);
  }
  return com;
}

bool Standing::settled(const ComState& com, const Eigen::Vector2d& middle) {
  return (com.p_W_m - middle).norm() < 0.015 && com.v_W.norm() < 0.03 && com.a_W.norm() < 0.2;
}

double left_share(const PatternSample& sample) {
  if (!sample.contact[kLeft]) return 0.0;
  if (!sample.contact[kRight]) return 1.0;
  const Eigen::Vector2d right = sample.foot[kRight].X_WS.translation().head<2>();
  const Eigen::Vector2d across = sample.foot[kLeft].X_WS.translation().head<2>() - right;
  return std::clamp((sample.zmp_W_m - right).dot(across) / across.squaredNorm(), 0.0, 1.0);
}

}  // namespace mimesis::walker
