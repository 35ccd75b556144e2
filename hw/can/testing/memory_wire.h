#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hw/can/bus.h"

namespace mimesis::hw::can {

/// A frame from "205#0F0000000000": identifier and data in hexadecimal digits.
inline Frame frame(const std::string& text) {
  const std::size_t hash = text.find('#');
  Frame made{.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16))};
  for (std::size_t i = hash + 1; i + 1 < text.size(); i += 2)
    made.data[made.length++] =
        static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16));
  return made;
}

/// And back.
inline std::string frame_text(const Frame& frame) {
  std::string text = fmt::format("{:03X}#", frame.id);
  for (const std::uint8_t byte : std::span(frame.data).first(frame.length))
    text += fmt::format("{:02X}", byte);
  return text;
}

/// A wire in memory for tests on one thread. Participants leave by being destroyed.
class MemoryWire {
 public:
  std::unique_ptr<Bus> join() { return std::make_unique<Participant>(participants_); }

 private:
  class Participant;
  using Participants = std::vector<Participant*>;

  class Participant final : public Bus {
   public:
    explicit Participant(std::shared_ptr<Participants> wire) : wire_(std::move(wire)) {
      wire_->push_back(this);
    }
    ~Participant() override { std::erase(*wire_, this); }

    void send(std::span<const Frame> frames) override {
      (wire_->size() > 1 ? counters_.sent : counters_.errors) += frames.size();
      for (Participant* other : *wire_) {
        if (other == this) continue;
        other->arrived_.insert(other->arrived_.end(), frames.begin(), frames.end());
      }
    }

    std::size_t receive(std::span<Frame> frames) override {
      const std::size_t count = std::min(frames.size(), arrived_.size());
      std::copy_n(arrived_.begin(), count, frames.begin());
      arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(count));
      for (const Frame& frame : frames.first(count)) {
        ++((frame.id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
      }
      return count;
    }

   private:
    std::shared_ptr<Participants> wire_;
    std::deque<Frame> arrived_;
  };

  std::shared_ptr<Participants> participants_ = std::make_shared<Participants>();
};

}  // namespace mimesis::hw::can
