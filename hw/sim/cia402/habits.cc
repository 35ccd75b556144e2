#include "hw/sim/cia402/habits.h"

#include <algorithm>
#include <array>

#include "common/error.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::sim {
namespace {

using Config = DriveConfig;

void fix(Config& c, std::initializer_list<Address> objects) {
  for (const Address object : objects) {
    for (unsigned sub = 0; sub <= 8; ++sub) c.fixed.push_back(object + sub);
  }
}

/// PDOs as their maker made them: set-points and measurements on SYNC (type 1), or by event (255).
void fix_pdos(Config& c, std::int64_t target, std::int64_t type) {
  fix(c, {0x1400'00, 0x1600'00, 0x1800'00, 0x1A00'00});
  c.made.merge(std::map<Address, std::int64_t>{{0x1400'02, type},
                                               {0x1600'00, 2},
                                               {0x1600'01, 0x60400010},
                                               {0x1600'02, target},
                                               {0x1800'02, type},
                                               {0x1800'05, 5},
                                               {0x1A00'00, 2},
                                               {0x1A00'01, 0x60410010},
                                               {0x1A00'02, 0x60640020}});
}

struct Habit {
  std::string_view name;
  void (*take)(Config&);
};

const std::array kHabits = {
    Habit{"cob_bit30", [](Config& c) { c.slave.cob_bit30 = true; }},
    Habit{"mode_shown_late", [](Config& c) { c.habits.mode_shown_late = true; }},
    Habit{"mode_lag", [](Config& c) { c.habits.mode_lag = true; }},
    Habit{"no_6007", [](Config& c) { c.lacks.push_back(0x6007'00); }},
    Habit{"no_60C2",
          [](Config& c) {
            c.lacks.insert(c.lacks.end(), {0x60C2'00, 0x60C2'01, 0x60C2'02});
          }},
    Habit{"no_1016",
          [](Config& c) {
            c.lacks.insert(c.lacks.end(), {0x1016'00, 0x1016'01, 0x1016'02});
          }},
    Habit{"no_1017", [](Config& c) { c.lacks.push_back(0x1017'00); }},
    Habit{"no_100C",
          [](Config& c) {
            c.lacks.insert(c.lacks.end(), {0x100C'00, 0x100D'00});
          }},
    Habit{"stuck_toggle", [](Config& c) { c.slave.stuck_toggle = true; }},
    Habit{"no_1400_05", [](Config& c) { c.lacks.push_back(0x1400'05); }},
    Habit{"no_6502", [](Config& c) { c.lacks.push_back(0x6502'00); }},
    Habit{"modes_unknown", [](Config& c) { c.made[0x6502'00] = 0; }},
    Habit{"late_boot", [](Config& c) { c.habits.late_boot = true; }},
    Habit{"no_boot_message", [](Config& c) { c.slave.no_boot_message = true; }},
    Habit{"starts_itself", [](Config& c) { c.slave.starts_itself = true; }},
    Habit{"slow_sdo", [](Config& c) { c.slave.sdo_delay = std::chrono::milliseconds(400); }},
    Habit{"unsized_sdo", [](Config& c) { c.slave.unsized_sdo = true; }},
    Habit{"four_byte_sdo", [](Config& c) { c.slave.four_byte_sdo = true; }},
    Habit{"odd_abort", [](Config& c) { c.slave.odd_abort = true; }},
    Habit{"event_pdo", [](Config& c) { fix_pdos(c, 0x607A0020, 255); }},
    Habit{"velocity_pdo", [](Config& c) { fix_pdos(c, 0x60FF0020, 1); }},
    Habit{"fixed_tpdo_map", [](Config& c) { fix(c, {0x1A00'00}); }},
    Habit{"boots_in_fault", [](Config& c) { c.habits.boots_in_fault = true; }},
    Habit{"sticky_reset", [](Config& c) { c.habits.sticky_reset = true; }},
    Habit{"keeps_fault", [](Config& c) { c.habits.keeps_fault = true; }},
    Habit{"slow_switch_on", [](Config& c) { c.habits.slow_switch_on = true; }},
    Habit{"no_bit12", [](Config& c) { c.habits.no_bit12 = true; }},
    Habit{"ignores_targets", [](Config& c) { c.habits.ignores_targets = true; }},
    Habit{"stands", [](Config& c) { c.habits.stands = true; }},
    Habit{"other_bits", [](Config& c) { c.habits.other_bits = true; }},
    Habit{"emergencies", [](Config& c) { c.habits.emergencies = true; }},
};

}  // namespace

std::vector<std::string_view> known_habits() {
  std::vector<std::string_view> names;
  for (const Habit& habit : kHabits) names.push_back(habit.name);
  return names;
}

void take_habits(DriveConfig& config, const std::vector<std::string>& habits) {
  for (const std::string& name : habits) {
    const auto* found = std::ranges::find(kHabits, name, &Habit::name);
    if (found != kHabits.end()) {
      found->take(config);
      continue;
    }
    std::string known;
    for (const Habit& habit : kHabits)
      known += (known.empty() ? "" : ", ") + std::string(habit.name);
    throw ConfigError("habits: '" + name + "', expected some of " + known);
  }
}

}  // namespace mimesis::hw::sim
