#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hw/actuators.h"
#include "hw/can/bus.h"
#include "hw/cia402/canopen.h"

namespace mimesis::tool {

/// A frame as `candump -L` writes it, for canplayer and log2asc:
///   (1436509052.249713) can0 201#0F0000000000
std::string candump_line(const hw::can::Frame& frame, hw::Time stamp, const std::string& bus);

/// What a listener learns of the drives on a bus from their frames, as the bridge maps them.
class BusWatch {
 public:
  /// @param temperature its object; its answers to whoever asks are kept
  explicit BusWatch(std::optional<hw::cia402::Object> temperature = {})
      : temperature_(temperature) {}

  struct Node {
    int id = 0;
    std::optional<int> nmt{};  ///< of its last heartbeat
    hw::DriveState state = hw::DriveState::unknown;
    std::uint16_t statusword = 0;
    std::optional<std::int32_t> position{}, target{}, velocity{};  ///< [increments], [1/s]
    std::int32_t torque = 0;                                       ///< thousandths of the rated one
    std::optional<std::int32_t> temperature{};                     ///< in units of its maker
    std::string emergency{};                                       ///< last one, in words
    std::uint64_t frames = 0;
    double frames_s = 0.0;  ///< in the last interval
  };

  void observe(const hw::can::Frame& frame);
  /// Rates since the last call, which was `seconds` ago.
  void close_interval(double seconds);

  /// In the order of their ids.
  std::vector<Node> nodes() const;
  double syncs_s() const { return syncs_s_; }
  double frames_s() const { return frames_s_; }
  double bits_s() const { return bits_s_; }  ///< with as many stuff bits as there can be
  std::uint64_t error_frames() const { return error_frames_; }
  bool bus_off() const { return bus_off_; }

 private:
  std::optional<hw::cia402::Object> temperature_;
  struct Seen {
    Node node;
    std::uint64_t before = 0;  // frames at the last close_interval
  };
  std::map<int, Seen> nodes_;
  std::uint64_t frames_ = 0, syncs_ = 0, bits_ = 0, error_frames_ = 0;
  double frames_s_ = 0.0, syncs_s_ = 0.0, bits_s_ = 0.0;
  bool bus_off_ = false;
};

}  // namespace mimesis::tool
