#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/kin/ik.h"
#include "common/kin/table.h"

namespace mimesis::planner {

enum class Grip {
  precision,
  full
};  ///< from above with the finger tips; from the side, whole hand
enum class Transport { above, below };  ///< how the object passes the bridge

/// Goals of the hand that hold a cylinder whose centre is at `center`: precision: z_E down, the
/// object's top `depth_m` above E; full: E at the centre, y_E up or down, so that the fingers close
/// horizontally. The turn about the vertical stays free, as the cylinder looks the same from all
/// sides.
std::vector<kin::IkGoal> grasp_goals(Grip grip, const Eigen::Vector3d& center, double height_m,
                                     double depth_m);

/// The same hand orientation as at posture q, at another place.
kin::IkGoal moved_hand(const kin::ArmModel& arm, const Eigen::VectorXd& q,
                       const Eigen::Vector3d& by_W);

/// Balls that cover an upright cylinder completely: n = ⌈h/r⌉ on its axis, radius √(r² + (h/2n)²).
std::vector<kin::Ball> cylinder_balls(const Eigen::Vector3d& center, double radius_m,
                                      double height_m);

/// Which ball or box of the table an upright cylinder at `center` would be in, in words; standing
/// on a box is allowed. Nothing if its place is free.
std::optional<std::string> place_blocked(const kin::Table& table, const Eigen::Vector3d& center);

/// Boxes that close the plane of the bridge except for the decided passage: `above` leaves open
/// what is above the bar, `below` the opening under it. They are the pre-selection P_F5
/// [M18 2.3.2]: a posture is pre-selected if no safety ball enters them, so that P_F5 ∩ P_free is
/// the set of postures that are free of real and of closed space, and the certificate of motions
/// covers both.
std::vector<kin::Box> closed_passages(const kin::Table& table, Transport transport);

}  // namespace mimesis::planner
