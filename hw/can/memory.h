#pragma once
#include <deque>
#include <memory>
#include <vector>

#include "hw/can/bus.h"

namespace mimesis::hw::can {

/// A wire in memory for tests on one thread. Participants leave by being destroyed.
class MemoryWire {
 public:
  MemoryWire();
  ~MemoryWire();
  std::unique_ptr<Bus> join();

  struct Shared;

 private:
  std::shared_ptr<Shared> shared_;
};

}  // namespace mimesis::hw::can
