#include "hw/sim/body/body_params_node.h"

#include "common/model/files.h"
#include "common/robot/drawer_size.h"

namespace mimesis::hw::sim {

double SimBodyParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

BodyOptions body_options(const SimBodyParams& p) {
  BodyOptions options;
  options.plant = p.plant == "servo" ? Plant::servo : Plant::springs;
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

DrawerSettings drawer_settings(const DrawerParams& p, const robot::Biped& biped) {
  DrawerSettings settings{.front_W_m = {p.front_x_m, p.front_y_m},
                          .yaw_rad = p.yaw_rad,
                          .handle_height_m = p.handle_height_m,
                          .handle_left_m = p.handle_left_m,
                          .object_height_m = p.object_height_m,
                          .object_left_m = p.object_left_m,
                          .object_depth_m = p.object_depth_m,
                          .friction_n = p.friction_n,
                          .viscous_n_s_m = p.viscous_n_s_m};
  if (p.handle_height_m == 0.0 || p.object_height_m == 0.0) {
    const robot::DrawerSize size = robot::drawer_size(biped);
    if (p.handle_height_m == 0.0) {
      settings.handle_height_m = size.handle_height_m;
      settings.handle_left_m = size.handle_left_m;
    }
    if (p.object_height_m == 0.0) settings.object_height_m = size.object_height_m;
  }
  for (const JumpParams& jump : p.jumps) settings.jumps.push_back({jump.at_s, jump.by_m});
  return settings;
}

}  // namespace mimesis::hw::sim
