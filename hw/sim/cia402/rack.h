#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::sim {

/// Simulated drives that share one participant of a bus.
class Rack {
 public:
  Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus);

  /// Moves all drives up to `now` and lets them answer what has arrived, in one batch. A drive does
  /// not wait because this process had to: several SYNCs are taken as even in time since the last
  /// step, if that is not longer ago than a bus keeps frames (50 ms).
  void step(Time now);
  /// With a physics world that moves the joints in between: all that has arrived counts from `now`.
  void move(Time now);
  void answer();

  std::vector<Drive>& drives() { return drives_; }
  const std::vector<Drive>& drives() const { return drives_; }
  const Traffic& counters() const { return bus_->counters(); }

 private:
  void receive();
  void answer(std::span<const can::Frame> frames);

  std::unique_ptr<can::Bus> bus_;
  std::vector<Drive> drives_;
  std::optional<Time> stepped_;
  std::vector<can::Frame> inbox_, outbox_;
};

}  // namespace mimesis::hw::sim
