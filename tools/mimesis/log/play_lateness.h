#pragma once
#include <array>
#include <cstdint>

#include "common/runtime/time.h"

namespace mimesis::tool {

/// How late messages were played: counts in bins whose width is 1/32 of their octave, so quantiles
/// are at most 3 % too high. Does not allocate.
class PlayLateness {
 public:
  void add(runtime::Time late);  ///< too early counts as 0
  std::uint64_t count() const { return count_; }
  runtime::Time worst() const { return worst_; }
  /// Upper end of the bin below which `share` of all lie; 0 without any.
  runtime::Time quantile(double share) const;

 private:
  static constexpr std::size_t kPerOctave = 32, kOctaves = 60;
  std::array<std::uint64_t, kPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  runtime::Time worst_{};
};

}  // namespace mimesis::tool
