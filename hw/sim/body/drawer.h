#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "common/robot/biped.h"

namespace mimesis::hw::sim {

/// The whole piece is pushed to another place from a time on, at 1 m/s; it closes meanwhile.
struct DrawerJump {
  double at_s = 0.0;
  double by_m = 0.0;  ///< along its axis, + away from the robot

  template <class Visitor>
  void visit(Visitor& v) {
    v("at_s", at_s, 0.0, 1e6);
    v("by_m", by_m, -2.0, 2.0);
  }
};

/// A piece of furniture with one drawer [M18 fig. 3.12]. Its axis points into it, along the ground;
/// "left" and "in front" are those of a robot that faces it.
struct DrawerSettings {
  /// middle of the closed front, direction of the axis, in W
  double front_x_m = 2.6, front_y_m = 0.0, yaw_rad = 0.0;
  /// Heights 0: heights and handle_left_m of a drawer for a robot of this size.
  double handle_height_m = 0.0, handle_left_m = 0.14;
  double object_height_m = 0.0, object_left_m = 0.0, object_depth_m = 0.25;
  double object_kg = 0.3;                        ///< in the right hand once it has it
  bool collides = true;                          ///< with the robot
  double longest_m = 0.40;                       ///< longest opening
  double friction_n = 7.0, viscous_n_s_m = 5.0;  ///< Coulomb and viscous friction of the rail
  double near_m = 0.03, dwell_s = 0.1;           ///< a hand grips this near, after this time
  double slips_n = 40.0;                         ///< pulls the handle out of the hand
  std::vector<DrawerJump> jumps = {};            ///< moves of the front at given times
};

/// A board of the furniture in the frame of the front: x into it, z up.
struct Board {
  const char* name;
  Eigen::Vector3d low_m, high_m;  ///< corners
  bool moves;                     ///< with the drawer
  bool handle;
};
/// Cabinet, panel, tray and handle. Precondition: heights are given.
std::array<Board, 4> boards(const DrawerSettings& settings);

/// State of the drawer, as in v1.DrawerState.
struct DrawerNow {
  Eigen::Vector3d front_W_m, handle_W_m, object_W_m;
  double opened_m = 0.0;
  bool held = false;   ///< the left hand has the handle
  bool taken = false;  ///< the right hand has the object
};

/// The hands near it. A hand grips only when told to, and otherwise lets go.
struct DrawerHands {
  std::array<Eigen::Vector3d, 2> p_W_m{Eigen::Vector3d::Zero(),
                                       Eigen::Vector3d::Zero()};  ///< left, right
  std::array<bool, 2> grips{};
};

/// A drawer that hands open: it follows the left hand along its axis against the rail's friction,
/// and carries the object for the right one. Deterministic.
class Drawer {
 public:
  /// Heights are given.
  explicit Drawer(const DrawerSettings& settings);

  /// Moves on by dt to `time_s`. @return force on the left hand in W [N], at the hand's point.
  Eigen::Vector3d step(double time_s, double dt_s, const DrawerHands& hands);

  const DrawerNow& now() const { return now_; }
  /// Errors of the hands when they gripped [m]: left to the handle, right to the object. Empty: not
  /// yet.
  std::optional<double> handle_error_m() const { return error_m_[robot::kLeft]; }
  std::optional<double> reach_error_m() const { return error_m_[robot::kRight]; }

 private:
  void jump(double time_s, double dt_s);
  void lose();
  void grip(robot::Side side, double dt_s, const DrawerHands& hands);
  Eigen::Vector3d follow(double dt_s, const Eigen::Vector3d& hand_W_m);
  void show(const DrawerHands& hands);
  Eigen::Vector3d place(double depth_m, double left_m, double height_m) const;

  DrawerSettings settings_;
  Eigen::Vector3d axis_W_, left_W_;
  DrawerNow now_;
  std::array<std::optional<double>, 2> error_m_;
  std::array<double, 2> near_s_{};  ///< time near the target
  bool lost_ = false;  ///< out of a closed hand, which has to open before it grips again
  Eigen::Vector3d handle_to_hand_W_m_ = Eigen::Vector3d::Zero();  ///< when it gripped
  double hand_m_ = 0.0, speed_m_s_ = 0.0;                         ///< along the axis, low-passed
  std::size_t jumped_ = 0;
  double to_go_m_ = 0.0;  ///< of jumps
  bool closes_ = false;   ///< because of a jump
};

}  // namespace mimesis::hw::sim
