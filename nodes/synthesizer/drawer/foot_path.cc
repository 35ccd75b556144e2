#include "nodes/synthesizer/drawer/foot_path.h"

#include "common/math/so3.h"
#include "nodes/synthesizer/drawer/smooth.h"

namespace mimesis::synthesizer {

FootPath::FootPath(const mocap::Body& body, mocap::Side side, std::vector<Footprint> prints,
                   double clearance_m, double yaw_rad)
    : prints_(std::move(prints)),
      heel_(body.heel_m[side]),
      toe_(body.toe_m[side]),
      clearance_m_(clearance_m),
      yaw_rad_(yaw_rad) {}

// The ankle when the foot has turned about a ground point of its sole, `pivot` in the ankle's
// frame.
FootPose FootPath::rolled(const Footprint& print, const Eigen::Vector3d& pivot,
                          double pitch_rad) const {
  const Eigen::Matrix3d R_yaw = math::exp_so3({0.0, 0.0, yaw_rad_});
  const Eigen::Matrix3d R_pitch = math::exp_so3({0.0, pitch_rad, 0.0});
  const Eigen::Vector3d flat(print.x_m, print.y_m, -pivot.z());
  return {.p_W_ankle = flat + R_yaw * (pivot - R_pitch * pivot),
          .yaw_rad = yaw_rad_,
          .pitch_rad = pitch_rad};
}

FootState FootPath::standing(const Footprint& print, double t) const {
  if (t < print.flat_s) {
    const double u = (print.flat_s - t) / (print.flat_s - print.strike_s);
    return {rolled(print, heel_, print.strike_pitch_rad * u * u), Contact::kHeel};
  }
  if (t <= print.heel_off_s) return {rolled(print, heel_, 0.0), Contact::kFlat};
  const double u = (t - print.heel_off_s) / (print.lift_s - print.heel_off_s);
  return {rolled(print, toe_, print.lift_pitch_rad * u * u), Contact::kToe};
}

FootState FootPath::at(double t) const {
  std::size_t k = 0;
  while (k + 1 < prints_.size() && prints_[k + 1].strike_s <= t) ++k;
  const Footprint& from = prints_[k];
  if (t <= from.lift_s) return standing(from, t);
  // in the air: leave and arrive with the velocities of the rolling foot
  const Footprint& to = prints_[k + 1];
  constexpr double kStep = 1e-4;  // [s]
  const FootPose a0 = standing(from, from.lift_s - kStep).pose,
                 a1 = standing(from, from.lift_s).pose;
  const FootPose b0 = standing(to, to.strike_s).pose, b1 = standing(to, to.strike_s + kStep).pose;
  const double duration = to.strike_s - from.lift_s, u = (t - from.lift_s) / duration;
  auto between = [&](double x0, double x1, double y0, double y1) {
    return hermite(t - from.lift_s, duration, x1, (x1 - x0) / kStep, y0, (y1 - y0) / kStep);
  };
  FootState state;
  for (int i = 0; i < 3; ++i)
    state.pose.p_W_ankle(i) =
        between(a0.p_W_ankle(i), a1.p_W_ankle(i), b0.p_W_ankle(i), b1.p_W_ankle(i));
  state.pose.p_W_ankle.z() += clearance_m_ * 16.0 * u * u * (1.0 - u) * (1.0 - u);
  state.pose.pitch_rad = between(a0.pitch_rad, a1.pitch_rad, b0.pitch_rad, b1.pitch_rad);
  state.pose.yaw_rad = yaw_rad_;
  return state;
}

}  // namespace mimesis::synthesizer
