#pragma once
#include <array>
#include <csignal>

namespace mimesis::tool {

/// While one lives, SIGINT, SIGTERM and SIGHUP ask to stop instead of killing.
class StopSignals {
 public:
  StopSignals() {
    received_ = 0;
    struct sigaction action {};
    action.sa_handler = [](int signal) {  // without SA_RESTART: sleeping calls return
      if (received_ == 0) received_ = signal;
    };
    sigemptyset(&action.sa_mask);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], &action, &previous_[i]);
    }
  }
  ~StopSignals() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], &previous_[i], nullptr);
    }
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  bool requested() const { return received_ != 0; }
  int signal() const { return received_; }  ///< the first that came, 0: none

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  static inline volatile std::sig_atomic_t received_ = 0;
  std::array<struct sigaction, kSignals.size()> previous_{};
};

}  // namespace mimesis::tool
