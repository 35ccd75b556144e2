#pragma once
#include "common/dmp/navigation.h"

namespace mimesis::crowd {

/// Others around one agent, in floats relative to a point near it [m, m/s].
struct Surroundings {
  static constexpr int kLanes = 16;
  static constexpr int kMost = 1024;  // a multiple of the lanes

  float x[kMost], y[kMost], vx[kMost], vy[kMost];
  int count = 0;
  bool full() const { return count == kMost; }
  void add(double x_m, double y_m, float vx_m_s, float vy_m_s) {
    x[count] = static_cast<float>(x_m);
    y[count] = static_cast<float>(y_m);
    vx[count] = vx_m_s;
    vy[count++] = vy_m_s;
  }
  /// Fills the last lanes up to a multiple of 16 with somebody who is out of reach.
  void pad();
};

struct SteerParams {
  float avoid, predict;   // gains
  float angle, distance;  // 1/(2σ²)
  float per_horizon;
  float cos_right, sin_right;  // of the angle by which others are taken to stand to the left
  float reach2;

  SteerParams(const dmp::NavigationParams& p, double reach_m);
};

/// Of one agent: position relative to the same point, velocity, heading.
struct Steered {
  float x, y, vx, vy, cos_heading, sin_heading;
};

/// Sum of the terms of avoidance and of predicted collisions over all within reach, but for who
/// stands at the same point (that is the agent itself) [rad/s; M18 eq. 3.26, 3.27]: what
/// dmp::avoidance_term and dmp::prediction_term say, to 2e-4 of the gains. Same bits on every
/// instruction set.
float steer(const Surroundings& around, const Steered& self, const SteerParams& p);

}  // namespace mimesis::crowd
