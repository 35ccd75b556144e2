#pragma once
#include <memory>
#include <vector>

#include "hw/can/bus.h"
#include "hw/sim/drives/drive.h"

namespace mimesis::hw::sim {

/// Simulated drives that share one participant of a bus.
class Rack {
 public:
  Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus);

  /// Moves all drives up to `now`, then lets them answer what has arrived, in one batch.
  void step(Time now) {
    move(now);
    answer(now);
  }
  /// The two halves of `step`: between them a physics world moves the joints.
  void move(Time now);
  void answer(Time now);

  std::vector<Drive>& drives() { return drives_; }
  const std::vector<Drive>& drives() const { return drives_; }
  const can::Counters& counters() const { return bus_->counters(); }

 private:
  std::unique_ptr<can::Bus> bus_;
  std::vector<Drive> drives_;
  std::vector<can::Frame> inbox_, outbox_;
};

}  // namespace mimesis::hw::sim
