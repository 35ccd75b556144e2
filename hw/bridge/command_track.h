#pragma once
#include <Eigen/Core>
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
/// little earlier or later. A command may say how the motion goes on (`ahead`): then the path is
/// followed without newer commands, too, and can be braked on. Does not allocate once it runs.
class CommandTrack {
 public:
  /// Rows of `ahead` that are kept; the rest is ignored.
  static constexpr std::size_t kAhead = 64;

  /// `cycle` is the period of `advance`; `v_max` [rad/s] and `a_max` [rad/s²], one per joint, bound
  /// a motion whose way is told.
  CommandTrack(Time cycle, std::span<const double> v_max, std::span<const double> a_max);

  /// The stream begins at the actual posture.
  void begin(Time stamp, std::span<const double> position_rad, std::span<const double> ahead = {});
  /// Its next command; one that is not newer than the last replaces it. `ahead`: positions of the
  /// following cycles, row after row.
  void add(Time stamp, std::span<const double> position_rad, std::span<const double> ahead = {});
  /// The positions of this cycle [rad], valid until the next call. Before the oldest command kept
  /// the oldest; after the newest `ahead`, or on in its direction for at most a cycle. `brake`: the
  /// pace falls to rest as fast as the joints allow.
  const std::vector<double>& advance(bool brake = false);
  /// Cycles without `advance` have passed, in which the joints went on at their last rate.
  void coast(int cycles);
  /// The stream says how its motion goes on.
  bool can_brake() const { return told_; }
  bool at_rest() const { return step_ == Time(0); }

 private:
  struct Sample {
    Time stamp{};
    std::vector<double> position_rad;
  };
  const Sample& back(std::size_t n) const { return samples_[(newest_ + kKept - n) % kKept]; }
  void push(Time stamp, std::span<const double> position_rad);
  void read(Time at, Eigen::VectorXd& position) const;
  Time end() const;
  double fastest(double wanted);
  Time bounded(Time wanted);

  static constexpr std::size_t kKept = 256;  ///< more than the reading may be late
  Time cycle_, read_{}, step_{};             ///< reading time, and what it advanced by last
  Eigen::VectorXd v_max_, a_max_;
  std::array<Sample, kKept> samples_;
  std::size_t newest_ = 0, count_ = 0, rows_ = 0;
  bool told_ = false;  // at the end of a motion no row is left
  std::vector<double> ahead_;
  std::vector<double> position_;
  Eigen::VectorXd moved_;                   // by the last `advance`
  Eigen::VectorXd before_, here_, behind_;  // scratch
};

}  // namespace mimesis::hw::bridge
