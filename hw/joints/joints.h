#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "hw/cia402/axis.h"
#include "hw/setpoint_limiter.h"

/// Settings that bridge and simulated drives share: a robot's joints and the buses of their drives.
namespace mimesis::hw {

/// The joints of a robot, from any kind of model file.
struct Joints {
  std::vector<std::string> names{};  ///< names of the joints; of an arm A1 ... An
  JointLimits limits;
  Eigen::VectorXd home;         ///< where a simulation starts [rad]
  Eigen::VectorXd effort_n_m;   ///< largest torque; 0: not in the file
  bool walks = false;           ///< would fall without power
  std::string drives;           ///< kind of its actuators, see hw/bridge/bridge_params.h
  double rate_hz = 200.0;       ///< rate of commands and readings
  int extrapolated_cycles = 0;  ///< without a set-point the drives go on at their rate for so long

  int count() const { return static_cast<int>(names.size()); }
};

/// Reads an arm (models/lwr4.yaml) or a walking robot (models/biped.yaml, or a bare .urdf: then
/// home is zero and the rest has the defaults of model::BipedDrives). The file alone owns rate and
/// limits; the bridge enforces these once, in the SetpointLimiter of its actuators.
/// @throws ConfigError that names the file
Joints load_joints(const std::string& file);

/// One bus and how many of the robot's joints have their drives on it: those that follow the ones
/// of the bus before, in the model's order.
struct BusShare {
  std::string can;  ///< see hw/can/bus.h
  int joints = 0;
  double sdo_timeout_s = 0.1;  ///< of each answer of a drive's configuration, three times [s]
  bool exclusive = false;  ///< every node on it is a drive of this robot: one frame halts them all

  void visit(runtime::ParamVisitor& v) {
    v("can", can);
    v("joints", joints, 1, 126);
    v("sdo_timeout_s", sdo_timeout_s, 0.01, 10.0);
    v("exclusive", exclusive);
  }
};

/// `buses` checked, or all joints on `can` if it is empty.
/// @throws ConfigError if they do not carry all joints, or one address occurs twice
std::vector<BusShare> complete(std::vector<BusShare> buses, const std::string& can,
                               const Joints& joints);

/// `axes` checked, or nodes 1..n if it is empty; then the largest torque is the rated one.
/// Numbers of nodes are the robot's, not a bus's: each occurs once.
/// @throws ConfigError as cia402::complete
std::vector<cia402::Axis> complete(std::vector<cia402::Axis> axes, const Joints& joints);

/// The drives of one bus, for people and for comparison: "lwr4.yaml: nodes 1 2 3 at 160000/rad".
std::string text_of(const std::string& robot, std::span<const cia402::Axis> axes);

JointLimits part_of(const JointLimits& limits, int first, int count);

}  // namespace mimesis::hw
