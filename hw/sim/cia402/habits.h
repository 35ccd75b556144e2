#pragma once
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::hw::sim {

struct DriveConfig;

/// What makers do differently in CANopen, so far as it is no object that is missing or fixed.
struct SlaveHabits {
  bool cob_bit30 = false;        ///< a TPDO's COB-ID must say "no remote requests" (bit 30)
  bool unsized_sdo = false;      ///< an expedited answer without its size
  bool four_byte_sdo = false;    ///< ... always of four bytes
  bool odd_abort = false;        ///< 0601'0000h where an object does not exist
  bool no_boot_message = false;  ///< silent until it is asked
  bool starts_itself = false;    ///< operational without a command
  bool stuck_toggle = false;     ///< its CAN controller answers node guarding, not its program
  std::chrono::milliseconds sdo_delay{0};
};

/// ... and in the profile of drives.
struct DriveHabits {
  bool mode_shown_late = false;  ///< 6061h is 0 while it is not enabled
  bool mode_lag = false;         ///< 6061h follows 6060h after 0.5 s
  bool late_boot = false;        ///< nothing for 3 s after power-on
  bool boots_in_fault = false;
  bool sticky_reset = false;     ///< the fault reset bit must stand for 50 ms
  bool keeps_fault = false;      ///< no reset helps
  bool slow_switch_on = false;   ///< 0.3 s from ready to switched on, as of a brake
  bool no_bit12 = false;         ///< never says that it follows
  bool ignores_targets = false;  ///< enabled, says that it does not follow, and stands
  bool stands = false;           ///< enabled, says that it follows, and stands
  bool other_bits = false;       ///< bits 7, 8, 14 and 15 of the statusword, of its maker
  bool emergencies = false;      ///< "no error" ten times a second
};

/// Gives the drive these habits. @throws ConfigError that lists the known ones
void take_habits(DriveConfig& config, const std::vector<std::string>& habits);
/// All that take_habits() knows, in the order of their documentation.
std::vector<std::string_view> known_habits();

}  // namespace mimesis::hw::sim
