#include "hw/can/memory.h"

#include <algorithm>

namespace mimesis::hw::can {
namespace {
class MemoryBus;
}

struct MemoryWire::Shared {
  std::vector<MemoryBus*> participants;
};

namespace {

class MemoryBus final : public Bus {
 public:
  explicit MemoryBus(std::shared_ptr<MemoryWire::Shared> wire) : wire_(std::move(wire)) {
    wire_->participants.push_back(this);
  }
  ~MemoryBus() override { std::erase(wire_->participants, this); }

  void send(std::span<const Frame> frames) override {
    (wire_->participants.size() > 1 ? counters_.sent : counters_.errors) += frames.size();
    for (MemoryBus* other : wire_->participants) {
      if (other != this)
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
  std::shared_ptr<MemoryWire::Shared> wire_;
  std::deque<Frame> arrived_;
};

}  // namespace

MemoryWire::MemoryWire() : shared_(std::make_shared<Shared>()) {}
MemoryWire::~MemoryWire() = default;

std::unique_ptr<Bus> MemoryWire::join() { return std::make_unique<MemoryBus>(shared_); }

}  // namespace mimesis::hw::can
