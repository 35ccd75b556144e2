#pragma once
#include <span>
#include <string>
#include <vector>

#include "hw/joints/joints.h"

namespace mimesis::hw {

/// Where the drives of a robot are: what bridge, simulated drives and `mimesis hw` read from one
/// file.
///   robot: lwr4.yaml
///   buses: [{can: "socketcan:can0"}, {can: "socketcan:can1"}]
///   joints:
///     - {name: A1, bus: 0, node_id: 1, increments_per_turn: 4096, gear_ratio: 160, sign: -1}
struct Machine {
  std::string robot;                 ///< model file
  Joints joints;                     ///< of the model, with the limits of both files
  std::vector<BusShare> buses{};     ///< in the order of their joints
  std::vector<int> bitrates{};       ///< of each bus [bit/s]
  std::vector<cia402::Axis> axes{};  ///< one per joint
  std::vector<std::string> eds{};    ///< of each joint's drive, EDS or DCF; empty: none
};

/// @throws ConfigError "FILE: joints[3].bus: ..." for what is wrong: joints in another order than
/// the robot's, buses that do not exist or have no joint, node ids used twice, limits that leave no
/// room or do not fit into 32 bits of increments, a rate that the drives cannot have
Machine load_machine(const std::string& file);

/// Load of one bus, as a share of its bit rate.
struct BusLoad {
  double least = 0.0;  ///< without stuff bits
  double worst = 0.0;  ///< with as many as there can be
};
/// Largest share that may be in use; the rest is for configuration, emergencies and repetitions.
inline constexpr double kLargestLoad = 0.75;

/// Cyclic traffic of the drives `axes` of one bus: the PDOs that the bridge maps in each, SYNC and
/// heartbeats; of PowerCube modules steps, answers, states and the watchdog's refresh.
/// @param joints kind of the drives, and whether they stay powered: then they report their demand
BusLoad bus_load(std::span<const cia402::Axis> axes, const Joints& joints, double rate_hz,
                 int bitrate);
/// Largest rate of whole 0.1 ms up to 1 kHz that fits; 0: none.
double largest_rate(std::span<const cia402::Axis> axes, const Joints& joints, int bitrate);
/// Fewest buses that carry these drives in their order at `rate_hz`; 0: one alone is too much.
int fewest_buses(std::span<const cia402::Axis> axes, const Joints& joints, double rate_hz,
                 int bitrate);

}  // namespace mimesis::hw
