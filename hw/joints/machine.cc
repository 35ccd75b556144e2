#include "hw/joints/machine.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "hw/can/bus.h"
#include "hw/cia402/setup.h"

namespace mimesis::hw {
namespace {

constexpr double kAny = 1e6;  // of a limit that the file does not have

struct MachineBus {
  std::string can;
  int bitrate_bit_s = 1'000'000;
  double sdo_timeout_s = 0.1;
  bool exclusive = false;

  void visit(runtime::ParamVisitor& v) {
    v("can", can);
    v("bitrate_bit_s", bitrate_bit_s, 10'000, 1'000'000);
    v("sdo_timeout_s", sdo_timeout_s, 0.01, 10.0);
    v("exclusive", exclusive);
  }
};

struct MachineJoint {
  std::string name;
  int bus = 0;
  int node_id = 0;
  double increments_per_turn = 0.0;  // of the motor
  double gear_ratio = 1.0;
  int sign = 1;
  double offset_rad = 0.0;
  double rated_torque_n_m = 100.0;  // at the joint
  double q_min_rad = -kAny, q_max_rad = kAny, v_max_rad_s = kAny, a_max_rad_s2 = kAny;
  double j_max_rad_s3 = 0.0;  // 0: no limit
  int stop_bit = -1;
  std::vector<std::string> accept{};
  bool guarding = false;
  std::string mode = "csp";
  std::string eds;

  void visit(runtime::ParamVisitor& v) {
    v("name", name);
    v("bus", bus, 0, 125);
    v("node_id", node_id, 1, 126);
    v("increments_per_turn", increments_per_turn, 1.0, 1e9);
    v("gear_ratio", gear_ratio, 1e-3, 1e5);
    v("sign", sign, -1, 1);
    v("offset_rad", offset_rad, -1e3, 1e3);
    v("rated_torque_n_m", rated_torque_n_m, 0.1, 1e4);
    v("q_min_rad", q_min_rad, -kAny, kAny);
    v("q_max_rad", q_max_rad, -kAny, kAny);
    v("v_max_rad_s", v_max_rad_s, 1e-6, kAny);
    v("a_max_rad_s2", a_max_rad_s2, 1e-6, kAny);
    v("j_max_rad_s3", j_max_rad_s3, 0.0, 1e9);
    v("stop_bit", stop_bit, -1, 31);
    v("accept", accept);
    v("guarding", guarding);
    v("mode", mode, {"csp", "csv", "pv"});
    v.file("eds", eds, "EDS or DCF of the drive");
  }
};

struct MachineFile {
  std::string robot;
  std::vector<MachineBus> buses;
  std::vector<MachineJoint> joints;

  void visit(runtime::ParamVisitor& v) {
    v.file("robot", robot, "arm or biped");
    runtime::list(v, "buses", buses);
    runtime::list(v, "joints", joints);
  }
};

void narrow(JointLimits& limits, const MachineJoint& joint, Eigen::Index i) {
  limits.q_min[i] = std::max(limits.q_min[i], joint.q_min_rad);
  limits.q_max[i] = std::min(limits.q_max[i], joint.q_max_rad);
  limits.v_max[i] = std::min(limits.v_max[i], joint.v_max_rad_s);
  limits.a_max[i] = std::min(limits.a_max[i], joint.a_max_rad_s2);
  limits.j_max[i] = joint.j_max_rad_s3;
}

/// @param bits of a frame of so many bytes
double bits_per_second(std::span<const cia402::Axis> axes, const Joints& joints, double rate_hz,
                       int (*bits)(int)) {
  const auto count = static_cast<double>(axes.size());
  if (joints.drives == "powercube") {
    constexpr double kStates = 0.25;  // a cycle: see powercube::Driver
    return rate_hz * (count * (bits(8) + bits(8) + kStates * (bits(2) + bits(6))) + bits(1));
  }
  constexpr double kHeartbeat_hz = 1000.0 / cia402::kDriveHeartbeatMs;
  int cycle = bits(0);
  for (const cia402::Axis& axis : axes) {
    const cia402::PdoMaps maps = cia402::maps_of(cia402::setup_steps(
        axis, {}, {},
        joints.walks ? cia402::QuickStop::stays_powered : cia402::QuickStop::disables));
    for (const auto& map : maps) cycle += map.empty() ? 0 : bits(cia402::bytes_of(map));
  }
  constexpr double kAudit_hz = 1.0;  // an object of a drive is read again: request and answer
  return rate_hz * cycle + kHeartbeat_hz * (count + 1.0) * bits(1) + kAudit_hz * 2.0 * bits(8);
}

}  // namespace

Machine load_machine(const std::string& file) {
  MachineFile given;
  runtime::load_params(file, [&](runtime::ParamVisitor& v) { given.visit(v); });
  const auto refuse = [&](const std::string& where, const std::string& why) {
    throw ConfigError(file + ": " + where + ": " + why);
  };
  if (given.robot.empty()) refuse("robot", "expected the model file of the robot");
  Machine machine{.robot = given.robot, .joints = load_joints(given.robot)};
  Joints& joints = machine.joints;
  joints.limits.j_max = Eigen::VectorXd::Zero(joints.count());
  if (static_cast<int>(given.joints.size()) != joints.count()) {
    refuse("joints",
           fmt::format("{} given, {} has {}", given.joints.size(), given.robot, joints.count()));
  }
  for (const MachineBus& bus : given.buses) {
    can::check_address(bus.can);
    machine.buses.push_back(
        {.can = bus.can, .sdo_timeout_s = bus.sdo_timeout_s, .exclusive = bus.exclusive});
    machine.bitrates.push_back(bus.bitrate_bit_s);
  }
  for (std::size_t i = 0; i < given.joints.size(); ++i) {
    const MachineJoint& joint = given.joints[i];
    const std::string where = fmt::format("joints[{}]", i);
    const auto k = static_cast<Eigen::Index>(i);
    if (!joint.name.empty() && joint.name != joints.names[i]) {
      refuse(where + ".name", fmt::format("'{}', expected {}, which {} has here", joint.name,
                                          joints.names[i], given.robot));
    }
    if (joint.bus >= static_cast<int>(machine.buses.size()))
      refuse(where + ".bus", fmt::format("{}, there are {}", joint.bus, machine.buses.size()));
    if (i > 0 && joint.bus < given.joints[i - 1].bus) {
      refuse(where + ".bus", fmt::format("{} behind bus {}: expected the joints of a bus one after "
                                         "the other, in the robot's order",
                                         joint.bus, given.joints[i - 1].bus));
    }
    ++machine.buses[static_cast<std::size_t>(joint.bus)].joints;
    machine.axes.push_back(
        {.node_id = joint.node_id,
         .increments_per_rad = joint.increments_per_turn * joint.gear_ratio / (2.0 * M_PI),
         .sign = joint.sign,
         .rated_torque_n_m = joint.rated_torque_n_m,
         .offset_rad = joint.offset_rad,
         .stop_bit = joint.stop_bit,
         .accept = joint.accept,
         .guarding = joint.guarding,
         .mode = joint.mode});
    if (!joint.eds.empty() && joints.drives != "cia402")
      refuse(where + ".eds",
             "drives of kind " + joints.drives + " are not CANopen's, and have none");
    machine.eds.push_back(joint.eds);
    narrow(joints.limits, joint, k);
    const JointLimits& l = joints.limits;
    if (l.q_min[k] >= l.q_max[k])
      refuse(where, fmt::format("limits leave no room: {} to {} rad", l.q_min[k], l.q_max[k]));
    const double most =
        std::max(std::abs(l.q_min[k] - joint.offset_rad), std::abs(l.q_max[k] - joint.offset_rad)) *
        machine.axes.back().increments_per_rad;
    if (most > 0x7FFFFFFF)
      refuse(where, fmt::format("{:.3g} increments at a limit, expected at most 2^31", most));
  }
  for (std::size_t b = 0; b < machine.buses.size(); ++b) {
    if (machine.buses[b].joints == 0)
      refuse(fmt::format("buses[{}].can", b), "'" + machine.buses[b].can + "' has no joint");
  }
  try {
    machine.axes = cia402::complete(machine.axes, joints.count());
    machine.buses = complete(machine.buses, "", joints);
    cia402::period_of(joints.rate_hz);
  } catch (const ConfigError& e) {
    throw ConfigError(file + ": " + e.what());
  }
  return machine;
}

BusLoad bus_load(std::span<const cia402::Axis> axes, const Joints& joints, double rate_hz,
                 int bitrate) {
  return {bits_per_second(axes, joints, rate_hz, can::least_bits) / bitrate,
          bits_per_second(axes, joints, rate_hz, can::worst_bits) / bitrate};
}

double largest_rate(std::span<const cia402::Axis> axes, const Joints& joints, int bitrate) {
  const double second = bits_per_second(axes, joints, 0.0, can::worst_bits);
  const double cycle = bits_per_second(axes, joints, 1.0, can::worst_bits) - second;
  const double ticks = std::ceil(1e4 * cycle / (kLargestLoad * bitrate - second) - 1e-9);
  return ticks > 0.0 && ticks <= 1e4 ? 1e4 / std::max(ticks, 10.0) : 0.0;  // of 0.1 ms
}

int fewest_buses(std::span<const cia402::Axis> axes, const Joints& joints, double rate_hz,
                 int bitrate) {
  const auto fits = [&](std::size_t count) {
    return bus_load(axes.first(count), joints, rate_hz, bitrate).worst <= kLargestLoad;
  };
  int buses = 0;
  for (; !axes.empty(); ++buses) {
    std::size_t most = 0;
    while (most < axes.size() && fits(most + 1)) ++most;
    if (most == 0) return 0;
    axes = axes.subspan(most);
  }
  return buses;
}

}  // namespace mimesis::hw
