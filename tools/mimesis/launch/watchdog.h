#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Hears the nodes' signs of life, in the protocol of systemd (sd_notify(3), WATCHDOG=1), on a
/// socket in the graph's folder, which other users cannot reach: an abstract one they could fill,
/// so that nodes seem to hang. The kernel says which process sent a sign.
class Watchdog {
 public:
  /// A node that is silent for this long is named. Signs come three times as often.
  static constexpr std::chrono::milliseconds kNamed{900};

  /// `directory`: of the graph. @throws std::runtime_error without a socket.
  explicit Watchdog(const std::string& directory);
  ~Watchdog() { unlink(path_.c_str()); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// What a node needs to know. `prefix`: of the variables' names
  std::vector<std::pair<std::string, std::string>> environment(const std::string& prefix) const;
  int fd() const { return socket_.get(); }  ///< readable when a sign has come
  struct Sign {
    pid_t pid = 0;       ///< of the sender
    bool ready = false;  ///< READY=1 instead of a sign of life
  };
  /// The next sign, if one has come.
  std::optional<Sign> next();

 private:
  std::string path_;  ///< as in $NOTIFY_SOCKET
  Fd socket_;
};

/// Activity of a process, from /proc.
struct Activity {
  char state = '?';                   ///< as in proc(5): R, S, D, T ...
  std::chrono::nanoseconds cpu{};     ///< time it has computed for
  std::chrono::nanoseconds queued{};  ///< time it waited for a processor, of waits that have ended

  /// "stopped by a signal", "it waits for a device", ...
  std::string text() const;
};
Activity activity(pid_t pid);

/// By how much a process has been silent for longer, `passed` after it did `before`. A machine that
/// is busy lets a process wait for a processor: that time does not count. `ahead`: of a wait that
/// has not ended, what was left out already.
std::chrono::nanoseconds silence(std::chrono::nanoseconds passed, const Activity& before,
                                 const Activity& now, std::chrono::nanoseconds& ahead);

/// For how long a process has given no sign of life; before the first it is not expected to.
class Silence {
 public:
  /// A sign came in the time that passed since the last look. Returns for how long the process hung
  /// before, if that had been named.
  std::optional<std::chrono::nanoseconds> heard(std::chrono::nanoseconds passed);
  /// Looks at the process if a sign is overdue; true if it is to be named now.
  bool look(pid_t pid, std::chrono::nanoseconds passed);
  bool reached(std::chrono::nanoseconds limit) const { return length_ && *length_ >= limit; }
  std::chrono::nanoseconds length() const { return length_.value_or(std::chrono::nanoseconds(0)); }
  std::string doing() const { return does_.text(); }
  std::string text() const;  ///< "2.1 s (stopped by a signal)"

 private:
  std::optional<std::chrono::nanoseconds> length_;
  bool named_ = false;
  Activity does_;  ///< when last looked at, in this silence
  std::chrono::nanoseconds ahead_{};
};

constexpr std::chrono::milliseconds kLook{100};  ///< period of looking for silence

/// The time since the last call. Time in which this process did not run itself is nobody's silence.
class Watched {
 public:
  std::chrono::nanoseconds passed(std::chrono::steady_clock::time_point now) {
    return std::min<std::chrono::nanoseconds>(now - std::exchange(looked_, now), 2 * kLook);
  }

 private:
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
};

}  // namespace mimesis::launch
