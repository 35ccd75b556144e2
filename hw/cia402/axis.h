#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::hw::cia402 {

/// Relation between a joint of the robot's model and its drive on the bus. `visit` lets the bridge
/// and the simulated drives read the same table.
struct Axis {
  int node_id = 0;                        ///< CANopen node, 1..126 [1]
  double increments_per_rad = 160'000.0;  ///< encoder increments × gear ratio / 2π [1/rad]
  int sign = 1;                     ///< +1, or -1 if the drive turns against the model's axis [1]
  double rated_torque_n_m = 100.0;  ///< at the joint; 6077h is in thousandths of it [N m]
  double offset_rad = 0.0;          ///< the joint's position where the drive counts 0 [rad]
  int stop_bit = -1;  ///< bit of 60FDh: 1 while an emergency stop's circuit is closed; -1: none
  /// what this drive may lack although it protects: "no_6007", "no_bit12"; docs/hardware
  std::vector<std::string> accept{};
  /// node guarding (100Ch, 100Dh) in the place of heartbeats (1016h, 1017h), which it lacks
  bool guarding = false;
  /// what its set-points are: csp (cyclic synchronous position), csv (.. velocity), pv (profile
  /// velocity); by velocity the bridge closes the loop of the position
  std::string mode = "csp";

  bool accepts(std::string_view lack) const { return std::ranges::count(accept, lack) > 0; }

  template <class Visitor>
  void visit(Visitor& v) {
    v("node_id", node_id, 1, 126);
    v("increments_per_rad", increments_per_rad, 100.0, 1e8);
    v("sign", sign, -1, 1);
    v("rated_torque_n_m", rated_torque_n_m, 0.1, 1e4);
    v("offset_rad", offset_rad, -1e3, 1e3);
    v("stop_bit", stop_bit, -1, 31);
    v("accept", accept);
    v("guarding", guarding);
    v("mode", mode, {"csp", "csv", "pv"});
  }

  std::int32_t to_increments(double rad) const;  ///< position; saturates
  double to_rad(std::int32_t increments) const { return rate_to_rad(increments) + offset_rad; }
  std::int32_t rate_to_increments(double rad) const;  ///< rad/s, rad/s²; saturates
  double rate_to_rad(std::int32_t increments) const {
    return sign * increments / increments_per_rad;
  }
  std::int32_t to_thousandths(double n_m) const;  ///< of the rated torque; saturates at 16 bits
  double to_torque(std::int32_t thousandths) const {
    return sign * thousandths * 1e-3 * rated_torque_n_m;
  }
};

/// What a drive may be without, if its user knows what is lost then: objects, and bit 12 of the
/// statusword (the drive follows its set-point).
inline constexpr std::array<const char*, 6> kAcceptable = {"no_1016", "no_1017", "no_6007",
                                                           "no_605A", "no_60C2", "no_bit12"};

/// `axes` checked, or nodes 1..`joints` with defaults if it is empty.
/// @throws ConfigError naming the axis: wrong number, node id used twice, sign 0, `accept` of
/// nothing
std::vector<Axis> complete(std::vector<Axis> axes, int joints);

}  // namespace mimesis::hw::cia402
