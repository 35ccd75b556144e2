#pragma once
#include <array>
#include <csignal>

namespace mimesis::tool {

/// While one lives, SIGINT, SIGTERM and SIGHUP ask to stop instead of killing.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  bool requested() const;
  int signal() const;  ///< the first that came, 0: none

 private:
  std::array<struct sigaction, 3> previous_{};
};

}  // namespace mimesis::tool
