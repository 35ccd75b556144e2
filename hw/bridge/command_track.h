#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/time.h"

namespace mimesis::hw::bridge {

/// The accepted commands as a path over time, read once per cycle at a time that goes on evenly. On
/// the wall clock commands come late, twice or not at all in a cycle: taken as they come they would
/// jerk, and the limiter would leave their path. The reading time follows the newest stamp slowly,
/// so a stream that is regular passes bit for bit, and an irregular one is followed on its path, a
/// little earlier or later. Does not allocate.
class CommandTrack {
 public:
  /// `joints` positions a command; `cycle` is the period of `advance`.
  CommandTrack(std::size_t joints, Time cycle) : cycle_(cycle), position_(joints, 0.0) {
    for (Sample& sample : samples_) sample.position_rad.resize(joints);
  }

  /// The stream begins at the actual posture.
  void begin(Time stamp, std::span<const double> position_rad);
  /// Its next command; one that is not newer than the last replaces it.
  void add(Time stamp, std::span<const double> position_rad);
  /// The positions of this cycle [rad], valid until the next call. Before the oldest command kept
  /// the oldest; after the newest on in its direction, for at most a cycle.
  const std::vector<double>& advance();

 private:
  struct Sample {
    Time stamp{};
    std::vector<double> position_rad;
  };
  const Sample& back(std::size_t n) const { return samples_[(newest_ + kKept - n) % kKept]; }

  static constexpr std::size_t kKept = 32;  ///< more than a stream may be late
  Time cycle_, read_{};
  std::array<Sample, kKept> samples_;
  std::size_t newest_ = 0, count_ = 0;
  std::vector<double> position_;
};

}  // namespace mimesis::hw::bridge
