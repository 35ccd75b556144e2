#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hw/cia402/axis.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/cia402.h"

namespace mimesis::hw::cia402 {

inline constexpr int kMasterNode = 127;                ///< node id of our heartbeat
inline constexpr int kMasterHeartbeatMs = 100;         ///< we send
inline constexpr int kMasterHeartbeatTimeoutMs = 250;  ///< drives stop after
inline constexpr int kDriveHeartbeatMs = 100;          ///< drives send
inline constexpr int kDriveHeartbeatTimeoutMs = 250;   ///< we stop after
inline constexpr std::uint32_t kGuardMs =
    kMasterHeartbeatMs;  ///< between our requests of node guarding
inline constexpr std::uint32_t kLifeTimeFactor =
    2;                                       ///< drives stop without requests after so many of them
inline constexpr int kRpdoDeadlineMs = 100;  ///< drives stop without set-points after

/// An object in a PDO.
struct Mapped {
  Object object;
  int bytes = 0;
};
Mapped mapped(std::uint32_t entry);  ///< of a mapping entry: index, sub-index, bits
std::uint32_t mapping_entry(const Mapped& mapped);

/// The PDOs of a drive that we use: RPDO1, TPDO1, TPDO2, TPDO3.
using PdoMaps = std::array<std::vector<Mapped>, 4>;
inline constexpr std::array<std::uint16_t, 4> kPdoObjects = {0x1400, 0x1800, 0x1801, 0x1802};

/// One SDO access of the configuration of a drive.
struct SetupStep {
  enum class Kind : std::uint8_t {
    expect,         ///< upload; value under `mask` must be equal
    expect_least,   ///< upload; value must be at least as large
    write,          ///< download
    write_checked,  ///< download, then upload: the drive must have kept it
    learn,          ///< upload of a mapping that the drive does not let us change
  };
  Kind kind;
  Object object;
  std::uint32_t value;
  int bytes;
  const char* meaning;
  std::uint32_t mask = 0xFFFFFFFF;
  /// What follows if the drive lacks the object; null: then it cannot be used.
  const char* without = nullptr;
  int pdo = -1;  ///< index into PdoMaps of a mapping
  /// What is lost if the axis accepts that the drive lacks it (Axis::accept); null: it cannot.
  const char* lost = nullptr;
};
std::string lack_of(Object object);  ///< the word in Axis::accept: "no_6007"

/// Interpolation period 60C2h: value · 10^exponent seconds.
struct Period {
  std::uint8_t value;
  std::int8_t exponent;
};
/// @throws ConfigError if 1/rate is no whole number of 0.1 ms up to 255
Period period_of(double rate_hz);

/// Settings of a drive for its joint.
struct JointSetup {
  double q_min = 0.0, q_max = 0.0;    ///< [rad]
  double v_max = 0.0;                 ///< [rad/s]
  double a_max = 0.0;                 ///< [rad/s²], also of a quick stop
  double following_window_rad = 0.0;  ///< 6065h; 0: the drive's own
  double following_time_s = 0.0;      ///< 6066h; 0: the drive's own
  OperationMode mode = OperationMode::cyclic_position;
  double profile_v = 0.0;  ///< of profile position and homing [rad/s]; accelerations are a_max
  int homing_method = 0;   ///< 6098h
};

/// Mode in which the axis follows a stream (Axis::mode).
OperationMode stream_mode(const Axis& axis);

/// Setup of a drive: follow positions synchronously, and stop if the bridge is lost.
/// Afterwards, if the drive can be mapped:
///   RPDO1 controlword 6040h (2 B), the target of the mode: position 607Ah (4 B), velocity 60FFh
///         (4 B), torque 6071h (2 B), none of homing; taken with SYNC
///   TPDO1 statusword 6041h (2 B), position 6064h (4 B), torque 6077h (2 B), sent on SYNC
///   TPDO2 velocity 606Ch (4 B), sent on SYNC; of a drive that stays powered also its position
///         demand 6062h (4 B): a loaded joint does not stand where its motor is held
///   TPDO3 digital inputs 60FDh (4 B), sent on SYNC; of a drive with an emergency stop's input
std::vector<SetupStep> setup_steps(const Axis& axis, const JointSetup& joint, Period period,
                                   QuickStop quick_stop = QuickStop::disables);

/// The mapping after these steps; a PDO that they leave alone is empty.
PdoMaps maps_of(const std::vector<SetupStep>& steps);
int bytes_of(const std::vector<Mapped>& map);  ///< length of a PDO

}  // namespace mimesis::hw::cia402
