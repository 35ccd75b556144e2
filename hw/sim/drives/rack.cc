#include "hw/sim/drives/rack.h"

namespace mimesis::hw::sim {

Rack::Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus)
    : bus_(std::move(bus)), inbox_(256) {
  for (const DriveConfig& config : configs) drives_.emplace_back(config);
}

void Rack::move(Time now) {
  outbox_.clear();
  for (Drive& drive : drives_) drive.move(now, outbox_);
}

void Rack::answer(Time now) {
  for (Drive& drive : drives_) drive.watch(now, outbox_);
  std::size_t count = 0;
  do {
    count = bus_->receive(inbox_);
    for (const can::Frame& frame : std::span(inbox_).first(count)) {
      for (Drive& drive : drives_) drive.handle(frame, now, outbox_);
    }
  } while (count == inbox_.size());
  if (!outbox_.empty()) bus_->send(outbox_);
}

}  // namespace mimesis::hw::sim
