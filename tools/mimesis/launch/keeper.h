#pragma once
#include <functional>

namespace mimesis::launch {

/// Runs `work` in a child process and stays its parent, so that nothing can outlive a launch:
///  - kill -9 of this process: the child gets SIGTERM and stops its nodes in order;
///  - kill -9 of the child: this process inherits all that the child had started (it is a
///  subreaper), sends
///    SIGTERM, and after 3 s SIGKILL.
/// SIGINT, SIGTERM and SIGHUP are passed on. Returns the exit code of `work`, 1 if it was killed.
/// In the child it returns, too, with the result of `work`.
int keep(const std::function<int()>& work);

/// Ends all descendants of this process that it inherited as a subreaper: SIGTERM, then SIGKILL
/// after `grace_ms`. Returns how many there were. Precondition: SIGCHLD is blocked.
int end_descendants(int grace_ms);

}  // namespace mimesis::launch
