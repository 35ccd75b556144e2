#pragma once
#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/progress.h"

namespace mimesis::launch {

/// The status line of this process: other lines take it away first.
inline tool::StatusLine& status_line() {
  static tool::StatusLine line;
  return line;
}

template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = fmt::format(format, std::forward<Args>(args)...);
  status_line().clear();
  std::fprintf(stderr, "mimesis: %s\n", line.c_str());
}

/// Runs `work` in a child process and stays its parent, so that nothing can outlive a launch:
///  - kill -9 of this process: the child gets SIGTERM and stops its nodes in order;
///  - kill -9 of the child: this process inherits all that the child had started (it is a
///    subreaper), sends SIGTERM, and after 3 s SIGKILL;
///  - a child that hangs is named, and killed when it has given no sign of life for 2 s.
/// SIGINT, SIGTERM and SIGHUP are passed on. Returns the exit code of `work`, 1 if it was killed:
/// then `killed` says why in its stead, when all it had started is gone.
/// In the child it returns, too, with the result of `work`.
/// @param work  gets the descriptor that it gives its signs of life on: a byte ten times a second.
///              It is watched from the first to the closing.
int run_below_subreaper(const std::function<int(Fd life)>& work,
                        const std::function<void(const std::string& why)>& killed);

/// Ends all descendants of this process that it inherited as a subreaper: SIGTERM, then SIGKILL
/// after `grace_ms`. Returns how many there were. Precondition: SIGCHLD is blocked.
int end_descendants(int grace_ms);

/// Removes what killed nodes have left in a graph's folder: entries, sockets that no process has
/// bound (of simulated devices too), and folders that are empty then.
void clean_folder(const std::string& directory);

/// SIGINT, SIGTERM and SIGHUP, which are blocked, as a file descriptor.
/// @throws std::runtime_error
Fd open_signals();

}  // namespace mimesis::launch
