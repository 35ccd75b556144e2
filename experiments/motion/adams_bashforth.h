#pragma once
#include <array>

#include "common/math/integrator.h"

namespace mimesis::math {

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
