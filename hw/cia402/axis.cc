#include "hw/cia402/axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace mimesis::hw::cia402 {

std::int32_t Axis::to_increments(double rad) const { return rate_to_increments(rad - offset_rad); }

std::int32_t Axis::rate_to_increments(double rad) const {
  constexpr double kMin = std::numeric_limits<std::int32_t>::min();
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(
      std::clamp(std::round(sign * rad * increments_per_rad), kMin, kMax));
}

std::int32_t Axis::to_thousandths(double n_m) const {
  return static_cast<std::int32_t>(
      std::clamp(std::round(1e3 * sign * n_m / rated_torque_n_m), -32768.0, 32767.0));
}

std::vector<Axis> complete(std::vector<Axis> axes, int joints) {
  if (axes.empty()) {
    for (int i = 1; i <= joints; ++i) axes.push_back({.node_id = i});
  }
  if (static_cast<int>(axes.size()) != joints) {
    throw ConfigError("axes: " + std::to_string(axes.size()) + " given, the robot has " +
                      std::to_string(joints) + " joints");
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string who = "axes[" + std::to_string(i) + "].";
    if (axes[i].sign == 0) throw ConfigError(who + "sign: expected -1 or 1, is 0");
    for (const std::string& lack : axes[i].accept) {
      if (std::ranges::count(kAcceptable, lack) > 0) continue;
      std::string known;
      for (const char* one : kAcceptable) known += (known.empty() ? "" : ", ") + std::string(one);
      throw ConfigError(who + "accept: '" + lack + "', expected some of " + known);
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (axes[i].node_id == axes[j].node_id) {
        throw ConfigError(who + "node_id: " + std::to_string(axes[i].node_id) +
                          " is used by axes[" + std::to_string(j) + "]");
      }
    }
  }
  return axes;
}

}  // namespace mimesis::hw::cia402
