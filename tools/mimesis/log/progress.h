#pragma once
#include <chrono>
#include <cstdint>
#include <string>

namespace mimesis::tool {

/// A bar on standard error for long work: "recover  [#####     ]  47 %  310 MB/s". Only on a
/// terminal, ten times a second at most, and gone when the work is done.
class Progress {
 public:
  /// @param total  of the work [bytes]; 0: unknown
  Progress(std::string what, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void at(std::uint64_t done);  ///< [bytes]

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  std::uint64_t total_;
  bool shown_;
  Clock::time_point started_ = Clock::now(), next_ = started_;
  bool drawn_ = false;
};

}  // namespace mimesis::tool
