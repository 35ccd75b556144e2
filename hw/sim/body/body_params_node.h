#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "hw/cia402/axis.h"
#include "hw/joints/joints.h"
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/drawer.h"

namespace mimesis::hw::sim {

/// A plate on the ground, unknown to the robot.
struct PlateParams {
  double x_m = 0.0, y_m = 0.0, half_x_m = 0.25, half_y_m = 0.5, height_m = 0.005;

  void visit(runtime::ParamVisitor& v) {
    v("x_m", x_m, -100.0, 100.0);
    v("y_m", y_m, -100.0, 100.0);
    v("half_x_m", half_x_m, 0.01, 10.0);
    v("half_y_m", half_y_m, 0.01, 10.0);
    v("height_m", height_m, 0.0, 0.1);
  }
};

/// A push on a link.
struct PushParams {
  double at_s = 0.0, duration_s = 0.1;           ///< start, in the world's time, and duration [s]
  double x_n_s = 0.0, y_n_s = 0.0, z_n_s = 0.0;  ///< impulse along W [N s]
  std::string link{};                            ///< empty: the trunk

  void visit(runtime::ParamVisitor& v) {
    v("at_s", at_s, 0.0, 1e6);
    v("duration_s", duration_s, 0.001, 10.0);
    v("x_n_s", x_n_s, -1000.0, 1000.0);
    v("y_n_s", y_n_s, -1000.0, 1000.0);
    v("z_n_s", z_n_s, -1000.0, 1000.0);
    v("link", link);
  }
};

/// Something that breaks. overcurrent, mute: the drive's trouble (drive.h); off, locked, weak: the
/// motor's (body_world.h).
struct FaultParams {
  double at_s = 0.0;
  std::string joint{};
  std::string kind = "overcurrent";

  void visit(runtime::ParamVisitor& v) {
    v("at_s", at_s, 0.0, 1e6);
    v("joint", joint);
    v("kind", kind, {"overcurrent", "mute", "off", "locked", "weak"});
  }
};

/// The drawer is pushed to another place.
struct JumpParams {
  double at_s = 0.0, by_m = 0.0;

  void visit(runtime::ParamVisitor& v) {
    v("at_s", at_s, 0.0, 1e6);
    v("by_m", by_m, -2.0, 2.0);
  }
};

/// The joint of a gripper and the angle beyond which it counts as closed.
struct GripperParams {
  std::string joint{};  ///< empty: as in the robot's description; none: the hand is always closed
  double closed_rad = 0.25;  ///< closed if abs(angle) exceeds this, with the same sign

  void visit(runtime::ParamVisitor& v) {
    v("joint", joint);
    v("closed_rad", closed_rad, -3.15, 3.15);
  }
};

/// The drawer before the robot, if there is one; see drawer.h.
struct DrawerParams {
  bool present = false;  ///< false: no drawer in the world
  double front_x_m = 2.6, front_y_m = 0.0,
         yaw_rad = 0.0;  ///< closed front, direction into it, in W
  /// Heights 0: those of a drawer for a robot of this size, then handle_left_m is too.
  double handle_height_m = 0.0, handle_left_m = 0.14;
  double object_height_m = 0.0, object_left_m = 0.0, object_depth_m = 0.25;
  double friction_n = 7.0, viscous_n_s_m = 5.0;  ///< Coulomb and viscous friction of the rail
  std::vector<JumpParams> jumps{};               ///< moves of the front at given times
  GripperParams left_gripper{}, right_gripper{};

  void visit(runtime::ParamVisitor& v) {
    v("present", present);
    v("front_x_m", front_x_m, -100.0, 100.0);
    v("front_y_m", front_y_m, -100.0, 100.0);
    v("yaw_rad", yaw_rad, -3.15, 3.15);
    v("handle_height_m", handle_height_m, 0.0, 3.0);
    v("handle_left_m", handle_left_m, -1.0, 1.0);
    v("object_height_m", object_height_m, 0.0, 3.0);
    v("object_left_m", object_left_m, -1.0, 1.0);
    v("object_depth_m", object_depth_m, 0.0, 1.0);
    v("friction_n", friction_n, 0.0, 100.0);
    v("viscous_n_s_m", viscous_n_s_m, 0.0, 1000.0);
    runtime::list(v, "jumps", jumps);
    v.group("left_gripper", [&](auto& g) { left_gripper.visit(g); });
    v.group("right_gripper", [&](auto& g) { right_gripper.visit(g); });
  }
};

struct SimBodyParams {
  double rate_hz = 200.0;  ///< rate of steps: the robot's [Hz]
  /// time of the first step within the period: after the bridge's [s]
  double offset_s = 0.0025;
  std::string robot = "biped.yaml";   ///< model file
  std::string can = "embedded:body";  ///< bus of all drives, see hw/can/bus.h
  std::vector<BusShare> buses{};      ///< several buses instead of `can`, as in the bridge
  std::vector<cia402::Axis> axes{};   ///< empty: nodes 1..n with defaults
  double v_margin = 1.2;  ///< largest speed claimed by the drives, relative to the model's [1]
  double following_window_rad = 0.2;  ///< larger following errors are a fault [rad]
  double following_time_s = 0.1;      ///< time beyond following_window_rad until a fault [s]

  std::string plant = "springs";      ///< how joints follow: springs, servo
  double friction = 0.8;              ///< friction of the ground [1]
  double slope_forward_rad = 0.0;     ///< slope of the ground, + rises forward [rad]
  double slope_left_rad = 0.0;        ///< slope of the ground, + rises to the left [rad]
  std::vector<PlateParams> plates{};  ///< boxes on the ground
  double payload_kg = 0.0;            ///< unknown mass in the trunk [kg]
  /// share of the model's speed limits that the motors reach [1]
  double motor_speed_share = 1.0;
  /// share of the model's torque limits that the motors reach [1]
  double motor_torque_share = 1.0;
  int seed = 0;                       ///< seed of the sensors' noise [1]
  double imu_tilt_rad = 0.0;          ///< slowly wandering error of the attitude [rad]
  double encoder_noise_rad = 0.0;     ///< noise of the encoders [rad]
  double force_noise_n = 0.0;         ///< noise of the feet's force sensors [N]
  std::vector<PushParams> pushes{};   ///< impulses on links at given times
  std::vector<FaultParams> faults{};  ///< drives that fail at given times
  DrawerParams drawer{};

  double time_limit_s = 0.0;  ///< the outcome is a failure after this time; 0: no limit [s]
  double settle_s = 1.0;  ///< the outcome is a success after standing at the goal for this time [s]

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("robot", robot);
    v("can", can);
    runtime::list(v, "buses", buses);
    runtime::list(v, "axes", axes);
    v("v_margin", v_margin, 0.1, 10.0);
    v("following_window_rad", following_window_rad, 0.001, 3.0);
    v("following_time_s", following_time_s, 0.001, 10.0);
    v("plant", plant, {"springs", "servo"});
    v("friction", friction, 0.0, 10.0);
    v("slope_forward_rad", slope_forward_rad, -0.3, 0.3);
    v("slope_left_rad", slope_left_rad, -0.3, 0.3);
    runtime::list(v, "plates", plates);
    v("payload_kg", payload_kg, 0.0, 100.0);
    v("motor_speed_share", motor_speed_share, 0.01, 100.0);
    v("motor_torque_share", motor_torque_share, 0.01, 100.0);
    v("seed", seed, 0, 1'000'000'000);
    v("imu_tilt_rad", imu_tilt_rad, 0.0, 0.5);
    v("encoder_noise_rad", encoder_noise_rad, 0.0, 0.1);
    v("force_noise_n", force_noise_n, 0.0, 1000.0);
    runtime::list(v, "pushes", pushes);
    runtime::list(v, "faults", faults);
    v.group("drawer", [&](auto& g) { drawer.visit(g); });
    v("time_limit_s", time_limit_s, 0.0, 1e6);
    v("settle_s", settle_s, 0.0, 100.0);
  }
  double robot_rate_hz() const;  ///< see run_node
};

BodyOptions body_options(const SimBodyParams& params);
/// @throws ConfigError as robot::drawer_size(), for heights that are the robot's
DrawerSettings drawer_settings(const DrawerParams& params, const robot::Biped& biped);

}  // namespace mimesis::hw::sim
