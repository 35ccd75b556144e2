#include "hw/can/faulty_wire.h"

#include <algorithm>

namespace mimesis::hw::can {

/// Not std::uniform_real_distribution, whose numbers differ between standard libraries.
bool FaultyWire::happens(double probability) {
  if (probability <= 0.0) return false;
  const bool hit = static_cast<double>(random_() >> 11) * 0x1p-53 < probability;
  damaged_ += hit ? 1 : 0;
  return hit;
}

std::vector<Frame> FaultyWire::carry(Time now, std::span<const Frame> frames) {
  std::vector<Frame> out;
  const auto put = [&](const Frame& frame) {
    if (happens(faults_.delay)) {
      late_.push_back({now + faults_.delay_by, frame});
    } else {
      out.push_back(frame);
    }
  };
  for (Frame frame : frames) {
    if (happens(faults_.lose)) continue;
    if (happens(faults_.corrupt)) {
      if (frame.length == 0) continue;
      const std::uint64_t bit = random_() % (8u * frame.length);
      frame.data[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    }
    put(frame);
    if (happens(faults_.duplicate)) put(frame);
  }
  std::erase_if(late_, [&](const Late& late) {
    if (late.due > now) return false;
    out.push_back(late.frame);
    return true;
  });
  return out;
}

}  // namespace mimesis::hw::can
