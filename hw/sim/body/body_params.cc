#include "hw/sim/body/body_params.h"

#include "common/model/files.h"
#include "common/robot/drawer_size.h"

namespace mimesis::hw::sim {

double SimBodyParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

BodyOptions body_options(const SimBodyParams& p, const robot::Biped& biped) {
  BodyOptions options = p.body;
  options.plant = p.plant == "servo" ? Plant::servo : Plant::springs;
  // A turn by the right hand about y lowers what lies ahead.
  options.slope_rad = {-p.slope_forward_rad, p.slope_left_rad};
  options.seed = static_cast<std::uint64_t>(p.seed);
  if (p.drawer.present) {
    DrawerSettings& drawer = options.drawer.emplace(drawer_settings(p.drawer.drawer, biped));
    const double ground_m =
        ground_height_m(options.slope_rad, {drawer.front_x_m, drawer.front_y_m});
    drawer.handle_height_m += ground_m;
    drawer.object_height_m += ground_m;
  }
  return options;
}

DrawerSettings drawer_settings(DrawerSettings settings, const robot::Biped& biped) {
  if (settings.handle_height_m != 0.0 && settings.object_height_m != 0.0) return settings;
  const robot::DrawerSize size = robot::drawer_size(biped);
  if (settings.handle_height_m == 0.0) {
    settings.handle_height_m = size.handle_height_m;
    settings.handle_left_m = size.handle_left_m;
  }
  if (settings.object_height_m == 0.0) settings.object_height_m = size.object_height_m;
  return settings;
}

}  // namespace mimesis::hw::sim
