#pragma once
#include <chrono>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hw/can/bus.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/eds.h"
#include "hw/joints/machine.h"
#include "tools/mimesis/graph_tools.h"

// Shared by the parts of `mimesis hw`.
namespace mimesis::tool {

struct HwOptions : GraphOptions {
  std::string bus;                  ///< see hw/can/bus.h
  std::string file;                 ///< machine file
  int node = 0;                     ///< CANopen node
  std::string object, value, type;  ///< hw sdo; object: hw monitor, too
  bool force = false;               ///< hw sdo: also what protects the drive
  double degrees_c = 1.0;           ///< hw monitor: of one unit of a temperature
  bool frames = false;              ///< hw monitor: frames, not a table
  int count = 0;                    ///< hw monitor: tables or frames; 0: no end
  int bitrate = 1'000'000;          ///< hw monitor [bit/s]
  bool drives = false;              ///< hw check: asks the drives, too
  std::string joint;                ///< hw jog, try
  double by_rad = 0.0, speed_rad_s = 0.0;
  double amount = 0.0;      ///< hw try: rad, rad/s or N m
  int method = 35;          ///< hw try: homing
  std::string kind;         ///< hw try
  double duration_s = 0.0;  ///< hw try
};

int hw_check(const HwOptions& options);
int hw_scan(const HwOptions& options);
int hw_monitor(const HwOptions& options);
int hw_sdo(const HwOptions& options);
int hw_jog(const HwOptions& options);
int hw_try(const HwOptions& options);

/// Drives of a machine beside the descriptions that it names.
struct DriveCheck {
  struct Drive {
    std::string name, file, product;
    std::vector<hw::cia402::EdsFinding> found;
  };
  std::vector<Drive> drives;
  bool usable = true;  ///< all of them, with what their axes accept
};
/// @throws ConfigError for a file that makes no sense, VerbFailure for a drive that does not answer
DriveCheck check_drives(const hw::Machine& machine, const HwOptions& options);
nlohmann::ordered_json as_json(const DriveCheck& check);
void print(const DriveCheck& check);

/// "6041" or "607D:02". @throws ConfigError
hw::cia402::Object object_of(const std::string& text);
/// Opens a bus; an embedded one is the graph's.
std::unique_ptr<hw::can::Bus> open_bus(const std::string& address, const GraphOptions& options);
/// Runs a transfer to its end and returns it. @throws VerbFailure without an answer in time
hw::cia402::SdoTransfer transfer(hw::can::Bus& bus, hw::cia402::SdoTransfer transfer,
                                 std::chrono::milliseconds timeout);

}  // namespace mimesis::tool
