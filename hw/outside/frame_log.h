#pragma once
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hw/can/bus.h"

namespace mimesis::hw::outside {

/// Keeps the frames that pass the buses of a node, both ways, until it publishes them.
class FrameLog {
 public:
  /// `bus`, heard from now on. The result must not outlive this object.
  std::unique_ptr<can::Bus> tap(std::unique_ptr<can::Bus> bus, const std::string& address) {
    names_.push_back(address.substr(address.find(':') + 1));
    return std::make_unique<Tap>(std::move(bus), names_.back(), frames_);
  }
  /// Calls `show(name of the bus, frame)` for each since the last call, in their order.
  template <class Show>
  void take(const Show& show) {
    for (const auto& [name, frame] : frames_) show(*name, frame);
    frames_.clear();
  }

 private:
  using Frames = std::vector<std::pair<const std::string*, can::Frame>>;

  class Tap final : public can::Bus {
   public:
    Tap(std::unique_ptr<can::Bus> bus, const std::string& name, Frames& frames)
        : bus_(std::move(bus)), name_(name), frames_(frames) {}
    void send(std::span<const can::Frame> frames) override {
      bus_->send(frames);
      keep(frames);
    }
    std::size_t receive(std::span<can::Frame> frames) override {
      const std::size_t count = bus_->receive(frames);
      keep(frames.first(count));
      return count;
    }

   private:
    void keep(std::span<const can::Frame> frames) {
      for (const can::Frame& frame : frames) frames_.emplace_back(&name_, frame);
      counters_ = bus_->counters();
    }
    std::unique_ptr<can::Bus> bus_;
    const std::string& name_;
    Frames& frames_;
  };

  std::deque<std::string> names_;  // whose addresses stay
  Frames frames_;
};

}  // namespace mimesis::hw::outside
