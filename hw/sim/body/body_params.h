#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "hw/cia402/axis.h"
#include "hw/joints/joints.h"
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/drawer.h"
#include "hw/sim/body/head_camera.h"

namespace mimesis::hw::sim {

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
  DrawerSettings drawer{};
  GripperParams left_gripper{}, right_gripper{};

  void visit(runtime::ParamVisitor& v) {
    v("present", present);
    v("front_x_m", drawer.front_x_m, -100.0, 100.0);
    v("front_y_m", drawer.front_y_m, -100.0, 100.0);
    v("yaw_rad", drawer.yaw_rad, -3.15, 3.15);
    v("handle_height_m", drawer.handle_height_m, 0.0, 3.0);
    v("handle_left_m", drawer.handle_left_m, -1.0, 1.0);
    v("object_height_m", drawer.object_height_m, 0.0, 3.0);
    v("object_left_m", drawer.object_left_m, -1.0, 1.0);
    v("object_depth_m", drawer.object_depth_m, 0.0, 1.0);
    v("object_kg", drawer.object_kg, 0.0, 5.0);
    v("collides", drawer.collides);
    runtime::list(v, "jumps", drawer.jumps);
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
  double slope_forward_rad = 0.0;     ///< slope of the ground, + rises forward [rad]
  double slope_left_rad = 0.0;        ///< slope of the ground, + rises to the left [rad]
  int seed = 0;                       ///< seed of the sensors' errors [1]
  BodyOptions body{};                 ///< further settings of robot and ground
  std::vector<Push> pushes{};         ///< impulses on links at given times
  std::vector<FaultParams> faults{};  ///< drives that fail at given times
  DrawerParams drawer{};
  HeadCameraSettings camera{};  ///< camera in the head that finds the drawer

  double time_limit_s = 0.0;  ///< the outcome is a failure after this time; 0: no limit [s]
  double settle_s = 1.0;  ///< the outcome is a success after standing at the goal for this time [s]

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v.file("robot", robot, "biped");
    v("can", can);
    runtime::list(v, "buses", buses);
    runtime::list(v, "axes", axes);
    v("plant", plant, {"springs", "servo"});
    v("friction", body.friction, 0.0, 10.0);
    v("slope_forward_rad", slope_forward_rad, -0.3, 0.3);
    v("slope_left_rad", slope_left_rad, -0.3, 0.3);
    runtime::list(v, "plates", body.plates);
    v("payload_kg", body.payload_kg, 0.0, 100.0);
    v("motor_speed_share", body.motor_speed_share, 0.01, 100.0);
    v("motor_torque_share", body.motor_torque_share, 0.01, 100.0);
    v("ankle_pitch_n_m", body.ankle_pitch_n_m, 0.0, 1000.0);
    v("seed", seed, 0, 1'000'000'000);
    body.senses.visit(v);
    runtime::list(v, "pushes", pushes);
    runtime::list(v, "faults", faults);
    v.group("drawer", [&](auto& g) { drawer.visit(g); });
    v.group("camera", [&](auto& g) { camera.visit(g); });
    v("time_limit_s", time_limit_s, 0.0, 1e6);
    v("settle_s", settle_s, 0.0, 100.0);
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// A drawer stands on the sloped ground. @throws ConfigError as robot::drawer_size(), if there is
/// one
BodyOptions body_options(const SimBodyParams& params, const robot::Biped& biped);
/// Heights of 0 become the robot's. @throws ConfigError as robot::drawer_size()
DrawerSettings drawer_settings(DrawerSettings settings, const robot::Biped& biped);

}  // namespace mimesis::hw::sim
