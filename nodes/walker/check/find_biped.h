#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/robot/biped.h"

namespace mimesis::walker {

/// One thing that a check of a robot found, assumed, or missed.
struct Finding {
  enum class Kind {
    found,
    assumed,  ///< the description leaves it open: worth a look
    missing,  ///< without it the robot does not walk
  };
  Kind kind = Kind::found;
  std::string part;  ///< "left leg"
  std::string text;  ///< what, with numbers and names, in one line
};

/// Points of a link's geometry that may touch the ground, in the link's frame [m]: corners of boxes
/// and meshes, the lower ends of balls.
using ContactPoints = std::map<std::string, std::vector<Eigen::Vector3d>>;

/// A link without mass beside those of the URDF.
struct FoundFrame {
  std::string name, link;
  Eigen::Vector3d position_m, rpy_rad;  ///< in the link
};

/// What `robot check` makes of a robot's tree: all that a file like models/biped.yaml says.
struct FoundBiped {
  std::vector<Finding> findings;
  std::vector<std::pair<std::string, double>> fixed;  ///< joints that are held, where [rad], [m]
  bool balance_inertias = false;                      ///< robot::balanced changes some
  std::vector<FoundFrame> frames;
  robot::BipedNames names;
  std::array<int, 2> leg_joints{};    ///< of the left and of the right leg, those held left out
  std::optional<robot::Biped> biped;  ///< nothing if something is missing
};

/// Links that move with the feet: whose geometry find_biped() needs.
std::vector<std::string> foot_links(const robot::RobotTree& tree);

/// Finds legs, feet, soles, trunk, arms and head by shape: the root link is the pelvis, x forward,
/// z up, and the zero posture has level feet at its lower end. Joints of hands, toes and eyes,
/// those that slide, mimic others or move what has no proper mass are held. Soles are the
/// rectangles of the points within 3 mm of the lowest one.
/// @param knee_rad  bend of the knees in half-sitting
FoundBiped find_biped(const robot::RobotTree& tree, const ContactPoints& contacts, double knee_rad);

}  // namespace mimesis::walker
