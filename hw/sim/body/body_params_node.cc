#include "hw/sim/body/body_params_node.h"

namespace mimesis::hw::sim {

BodyOptions body_options(const SimBodyParams& p) {
  BodyOptions options;
  options.plant = p.plant == "servo" ? Plant::kServo : Plant::kSprings;
  options.friction = p.friction;
  // A turn by the right hand about y lowers what lies ahead.
  options.slope_rad = {-p.slope_forward_rad, p.slope_left_rad};
  for (const PlateParams& plate : p.plates) {
    options.plates.push_back({.center_W_m = {plate.x_m, plate.y_m},
                              .half_m = {plate.half_x_m, plate.half_y_m},
                              .height_m = plate.height_m});
  }
  options.payload_kg = p.payload_kg;
  options.motor_speed_share = p.motor_speed_share;
  options.motor_torque_share = p.motor_torque_share;
  options.seed = static_cast<std::uint64_t>(p.seed);
  options.imu_tilt_rad = p.imu_tilt_rad;
  options.encoder_noise_rad = p.encoder_noise_rad;
  options.force_noise_n = p.force_noise_n;
  return options;
}

}  // namespace mimesis::hw::sim
