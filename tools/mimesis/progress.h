#pragma once
#include <chrono>
#include <cstdint>
#include <string>

namespace mimesis::tool {

/// A bar on standard error for long work: "recover  [#####     ]  47 %  310 MB/s". Only on a
/// terminal, ten times a second at most, and gone when the work is done.
class Progress {
 public:
  enum class Unit { bytes, none };
  /// @param total  of the work; 0: unknown. A rate is shown for bytes only.
  Progress(std::string what, std::uint64_t total, Unit unit = Unit::bytes);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void at(std::uint64_t done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  std::uint64_t total_;
  Unit unit_;
  bool shown_;
  Clock::time_point started_ = Clock::now(), next_ = started_;
  bool drawn_ = false;
};

}  // namespace mimesis::tool
