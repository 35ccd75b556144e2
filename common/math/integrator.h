#pragma once
#include <array>

namespace mimesis::math {

/// One step of the classical Runge-Kutta method of order 4 for ẋ = f(t, x).
/// `State` adds and is multiplied by a double (Eigen vectors and arrays, double); f(t, x) -> State.
/// Fixed-size states do not allocate.
template <class State, class F>
State rk4_step(F&& f, double t, const State& x, double dt) {
  const State k1 = f(t, x);
  const State k2 = f(t + 0.5 * dt, State(x + (0.5 * dt) * k1));
  const State k3 = f(t + 0.5 * dt, State(x + (0.5 * dt) * k2));
  const State k4 = f(t + dt, State(x + dt * k3));
  return State(x + (dt / 6.0) * (k1 + 2.0 * (k2 + k3) + k4));
}

/// Explicit 5-step Adams-Bashforth method, of order 5 in a constant dt, one evaluation a step:
///   xₙ₊₁ = xₙ + dt/720 (1901 fₙ − 2774 fₙ₋₁ + 2616 fₙ₋₂ − 1274 fₙ₋₃ + 251 fₙ₋₄).
/// [Hairer, Nørsett, Wanner, Solving ODEs I, III.1]. Its first four steps are RK4's. Its region of
/// stability is small (|λ dt| < 0.16 on the negative axis): where couplings are stiff, take RK4.
template <class State>
class AdamsBashforth5 {
 public:
  explicit AdamsBashforth5(double dt) : dt_(dt) {}
  double dt() const { return dt_; }

  /// Forgets the history: to be called after x was changed from outside or f has jumped.
  void restart() { known_ = 0; }

  /// Advances x from t to t + dt.
  template <class F>
  void step(F&& f, double t, State& x) {
    for (std::size_t i = 4; i > 0; --i) history_[i] = history_[i - 1];
    history_[0] = f(t, static_cast<const State&>(x));
    if (known_ < 4) {
      ++known_;
      x = rk4_step(f, t, x, dt_);
      return;
    }
    x = State(x +
              (dt_ / 720.0) * (1901.0 * history_[0] - 2774.0 * history_[1] + 2616.0 * history_[2] -
                               1274.0 * history_[3] + 251.0 * history_[4]));
  }

 private:
  double dt_;
  int known_ = 0;  ///< derivatives of the past, at most 4
  std::array<State, 5> history_{};
};

}  // namespace mimesis::math
