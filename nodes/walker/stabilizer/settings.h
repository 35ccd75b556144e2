#pragma once
#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Gains of the stabilizer [docs/walking.md 6]. Laws: [K10] Kajita et al., IROS 2010; [C19] Caron,
/// Kheddar, Tempier, ICRA 2019. Values without a source were found by trials on two plants. In
/// double support, with the measured frequency responses of both plants and 2 to 4 ticks from
/// command to measurement, the gain margin is at least 2 and the phase margin at least 42 degrees.
struct StabilizerSettings {
  // divergent component of motion: z = z_r + (1 + kd/ω) e + (ki/ω) ∫e [C19]
  double kd_1_s = 4.5, ki_1_s = 1.5;
  /// Limit of (kd/ω) e forward and back: a large e decays at ω times this, and the ankles' pitch
  /// torque is mg (e + this) instead of mg (1 + kd/ω) e: 30 instead of 50 N m after a push of 4.9 N
  /// s.
  double forward_limit_m = 0.01;
  double integral_leak_s = 10.0;  ///< forgetting time of ∫e
  double integral_limit = 0.1;    ///< limit of |∫e| [m s]
  double edge_margin_m =
      0.002;  ///< wished ZMPs stay this far inside the soles; 10 mm: falls at 10 N s

  // time constants of low passes of the measurement
  double velocity_filter_s = 0.01;  ///< 1/λ of the CoM's velocity (Estimator)
  double wrench_filter_s = 0.005;
  /// Stiffness of joints whose encoders are on the motors' side; 0: rigid, or encoders on the
  /// links.
  double hip_stiffness_n_m_rad = 0.0, knee_stiffness_n_m_rad = 0.0, ankle_stiffness_n_m_rad = 0.0;
  double com_offset_s = 0.0;  ///< mean of the CoM's constant error (ComOffset); 0: without
  int delay_ticks = 2;        ///< age of a sensor reading: one tick of the control, one of the bus

  // attitude and ground
  bool imu_attitude = true;     ///< the IMU's own attitude; false: AttitudeFilter's
  double attitude_s = 10.0;     ///< forgetting time of AttitudeFilter
  bool slope = false;           ///< ground that is not level is felt by the soles (SlopeEstimate)
  double slope_filter_s = 1.0;  ///< low pass of the slope

  // feet: gain, leak and limit of each law
  double cop_rad_s_n_m = 0.015;  ///< gain of the centre of pressure [K10, C19: 0.01]
  double cop_alone =
      0.1;  ///< share of a foot's own rate in double support, the rest is the mean [1]
  double cop_leak_s = 0.5, cop_limit_rad = 0.25;
  double cop_pivot = 0.5;        ///< point about which a sole turns: 0 its origin, 1 the ankle
  double force_m_s_n = 8e-5;     ///< gain of the difference of the feet's heights [K10; C19: 1e-4]
  double force_window_s = 0.15;  ///< the law acts for this time after a landing
  double force_leak_s = 1.0, force_limit_m = 0.05;
  /// A foot that lands early gives way. With k = 3e5 N/m (LegGive on servos) and τ = 20 ms from
  /// command to measurement the loop A k e^(−τs)/s is stable up to A = π/(2 k τ) = 2.6e-4; at 5e-4
  /// a foot on servos jumped 3 mm off the ground and came down again at 0.1 m/s.
  double landing_m_s_n = 2e-4;
  double landing_leak_s = 0.8;  ///< leak of about one step; at 0.2 s a foot on a plate is pushed
                                ///< back and tilts the robot
  double landing_limit_m = 0.03;
  double landing_window_s = 0.25;  ///< the law begins this long before the planned landing
  double reach_m_s = 0.045;        ///< least speed down until ground contact: half of the glide's
  double reach_limit_m = 0.01;
  // correction of the swing foot for the error of the base
  double swing_filter_s = 0.05, swing_fade_s = 0.3;
  double swing_position = 1.0;          ///< share of the position correction; 0: attitude only [1]
  double swing_height_limit_m = 0.005;  ///< limit of the height correction
  double swing_position_limit_m = 0.05, swing_tilt_limit_rad = 0.25;

  double leg_give_share = 1.0;  ///< compensated share of the legs' give under load (LegGive) [1]

  // CoM admittance: a = k (z − z_d) − 2 v/T − x/T² [C19]
  double com_1_s2 = 8.0, com_leak_s = 0.5, com_limit_m = 0.06;

  // step adjustment, only while the feedback is at the edge of the soles
  bool step_adjustment = true;
  double adjust_forward_m = 0.12, adjust_outward_m = 0.12, adjust_inward_m = 0.02;
  double adjust_noise_m = 0.008;  ///< of the error e: as much of it moves no landing
  double adjust_filter_s = 0.08;  ///< time constant of a landing's move
  double adjust_speed_m_s = 1.0;  ///< of a landing's move, at most

  // falling
  double fall_tilt_rad = 0.6;  ///< tilt from the commanded attitude that counts as a fall
  double fall_dcm_m = 0.35;    ///< error of the divergent component that counts as a fall

  template <class V>
  void visit(V& v) {
    v("kd_1_s", kd_1_s, 0.0, 30.0);
    v("ki_1_s", ki_1_s, 0.0, 30.0);
    v("forward_limit_m", forward_limit_m, 0.0, 0.3);
    v("velocity_filter_s", velocity_filter_s, 0.01, 1.0);
    v("hip_stiffness_n_m_rad", hip_stiffness_n_m_rad, 0.0, 1e6);
    v("knee_stiffness_n_m_rad", knee_stiffness_n_m_rad, 0.0, 1e6);
    v("ankle_stiffness_n_m_rad", ankle_stiffness_n_m_rad, 0.0, 1e6);
    v("com_offset_s", com_offset_s, 0.0, 1000.0);
    v("delay_ticks", delay_ticks, 1, 8);
    v("imu_attitude", imu_attitude);
    v("slope", slope);
    v("cop_rad_s_n_m", cop_rad_s_n_m, 0.0, 0.1);
    v("force_m_s_n", force_m_s_n, 0.0, 1e-2);
    v("landing_m_s_n", landing_m_s_n, 0.0, 1e-2);
    v("reach_m_s", reach_m_s, 0.0, 1.0);
    v("leg_give_share", leg_give_share, 0.0, 1.0);
    v("com_1_s2", com_1_s2, 0.0, 200.0);
    v("step_adjustment", step_adjustment);
    v("adjust_forward_m", adjust_forward_m, 0.0, 0.3);
    v("adjust_outward_m", adjust_outward_m, 0.0, 0.3);
    v("adjust_inward_m", adjust_inward_m, 0.0, 0.1);
    v("adjust_noise_m", adjust_noise_m, 0.0, 0.1);
    v("adjust_filter_s", adjust_filter_s, 0.0, 1.0);
    v("adjust_speed_m_s", adjust_speed_m_s, 0.0, 10.0);
    v("fall_tilt_rad", fall_tilt_rad, 0.1, 1.5);
    v("fall_dcm_m", fall_dcm_m, 0.05, 2.0);
  }
};

/// Share of the new sample in a first-order low-pass of one tick; 1 without a filter.
inline double low_pass_share(double time_s) {
  return time_s > 0.0 ? -std::expm1(-kTick_s / time_s) : 1.0;
}

/// One tick of ẋ = rate − x/leak, |x| ≤ limit (Euler).
inline double leaky(double x, double rate, double leak_s, double limit) {
  return std::clamp(x + kTick_s * (rate - x / leak_s), -limit, limit);
}

/// One tick of a first-order decay to 0.
inline double decayed(double x, double time_s) { return x * std::exp(-kTick_s / time_s); }

}  // namespace mimesis::walker
