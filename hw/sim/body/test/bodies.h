#pragma once
#include <fmt/format.h>

#include <span>
#include <string>

#include "common/model/files.h"

namespace mimesis::hw::sim {

inline constexpr double kTick_s = 0.005;

/// A robot of models/, with the URDF that it is made of.
struct TestRobot {
  robot::Biped biped;
  std::string urdf;

  std::span<const double> half_sitting() const {
    return {biped.half_sitting.data(), static_cast<std::size_t>(biped.half_sitting.size())};
  }
  double weight_n() const { return biped.tree.mass_kg() * robot::kGravity; }
};

/// @throws ConfigError if the file or one that it names does not exist
inline TestRobot test_robot(const std::string& name = "biped.yaml") {
  const std::string file = fmt::format("{}/models/{}", MIMESIS_SOURCE_DIR, name);
  return {model::load_biped(file), model::urdf_of_biped(file)};
}

}  // namespace mimesis::hw::sim
