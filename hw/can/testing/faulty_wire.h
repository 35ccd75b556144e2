#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>
#include <span>
#include <vector>

#include "common/time.h"
#include "hw/can/bus.h"

namespace mimesis::hw::can {

/// What a bad wire does to each frame, independently, with these probabilities [1].
struct WireFaults {
  double lose = 0.0;
  double duplicate = 0.0;
  double corrupt = 0.0;  ///< one bit of the data is flipped; a frame without data is lost
  double delay = 0.0;
  Time delay_by{};  ///< of a delayed frame; later ones overtake it
};

/// A wire between two buses that loses, delays, corrupts and duplicates frames. The controllers of
/// a real bus find most damage by their CRC: corrupted frames stand for software between controller
/// and us. Seeded: same frames at the same times, same damage.
class FaultyWire {
 public:
  FaultyWire(const WireFaults& faults, std::uint64_t seed) : faults_(faults), random_(seed) {}

  /// What leaves the wire at `now`, of `frames` that enter it now and of those still on it.
  std::vector<Frame> carry(Time now, std::span<const Frame> frames) {
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
  void change(const WireFaults& faults) { faults_ = faults; }
  std::uint64_t damaged() const { return damaged_; }  ///< frames to which something was done

 private:
  struct Late {
    Time due;
    Frame frame;
  };
  /// Not std::uniform_real_distribution, whose numbers differ between standard libraries.
  bool happens(double probability) {
    if (probability <= 0.0) return false;
    const bool hit = static_cast<double>(random_() >> 11) * 0x1p-53 < probability;
    damaged_ += hit ? 1 : 0;
    return hit;
  }

  WireFaults faults_;
  std::mt19937_64 random_;
  std::deque<Late> late_;
  std::uint64_t damaged_ = 0;
};

}  // namespace mimesis::hw::can
