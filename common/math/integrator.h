#pragma once

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

}  // namespace mimesis::math
