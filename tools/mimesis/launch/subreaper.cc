#include "tools/mimesis/launch/subreaper.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <vector>

#include "common/runtime/registry.h"
#include "common/time.h"
#include "tools/mimesis/launch/watchdog.h"

namespace mimesis::launch {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kGraceMs = 3000;

/// Children of this process. Their parent is field 4 of /proc/PID/stat, after the name in brackets.
std::vector<pid_t> children() {
  std::vector<pid_t> all;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t bracket = text.rfind(')');
    char state = 0;
    int parent = 0;
    if (bracket != std::string::npos &&
        std::sscanf(text.c_str() + bracket + 1, " %c %d", &state, &parent) == 2 &&
        parent == getpid()) {
      all.push_back(std::stoi(name));
    }
  }
  return all;
}

sigset_t set_of(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : signals) sigaddset(&set, s);
  return set;
}

constexpr std::chrono::seconds kLauncherHung{2};
int wait_for(pid_t worker, const Fd& life, const sigset_t& set,
             const std::function<void(const std::string&)>& killed) {
  Watched time;
  Silence silence;
  std::string hung;
  while (true) {
    siginfo_t info{};
    const timespec look{0, nanoseconds(kLook).count()};
    const int signal = sigtimedwait(&set, &info, &look);
    const nanoseconds passed = time.passed(Clock::now());
    std::array<char, 65536> signs;  // all that a pipe holds
    const ssize_t n = read(life.get(), signs.data(), signs.size());
    // The reader of our output may be slow: then the worker waits.
    pollfd output{STDERR_FILENO, POLLOUT, 0};
    if (n > 0 || (n < 0 && poll(&output, 1, 0) == 0)) {
      if (const auto stood = silence.heard(passed))
        say("the launcher goes on after {:.1f} s", to_seconds(*stood));
    } else if (n == 0) {
      silence = {};
    }
    if (silence.look(worker, passed))
      say("the launcher hangs: no sign of life for {}", silence.text());
    if (hung.empty() && silence.reached(kLauncherHung)) {
      hung = "the launcher hung for " + silence.text();
      kill(worker, SIGKILL);
    }
    if (signal < 0) continue;
    if (signal != SIGCHLD) {
      kill(worker, signal);
      continue;
    }
    // Only the worker is waited for: its remaining processes are ended together afterwards.
    int status = 0;
    if (waitpid(worker, &status, WNOHANG) != worker) continue;
    if (WIFEXITED(status)) {
      end_descendants(0);
      return WEXITSTATUS(status);
    }
    const int left = end_descendants(kGraceMs);
    const std::string why =
        hung.empty() ? "the launcher " + Ending{.signal = WTERMSIG(status)}.text() : hung;
    say("{}; ended the {} processes it left", why, left);
    killed(why);
    return 1;
  }
}

}  // namespace

int end_descendants(int grace_ms) {
  const auto grace = std::chrono::milliseconds(grace_ms);
  const auto start = Clock::now();
  const sigset_t child_signal = set_of({SIGCHLD});
  std::set<pid_t> seen, told;
  while (true) {
    while (waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    const std::vector<pid_t> left = children();
    if (left.empty()) return static_cast<int>(seen.size());
    const auto passed = Clock::now() - start;
    for (const pid_t pid : left) {
      seen.insert(pid);
      // A node leads its session and got SIGTERM when its parent died. A second one would end it
      // before it has stopped what it moves.
      const bool due = getsid(pid) != pid || passed > grace * 2 / 3;
      if (passed < grace && due && told.insert(pid).second) kill(pid, SIGTERM);
      if (passed >= grace) kill(pid, SIGKILL);
    }
    const timespec pause{0, 20'000'000};
    sigtimedwait(&child_signal, nullptr, &pause);
  }
}

Fd open_signals() {
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP});
  Fd fd(signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!fd.open()) throw std::runtime_error("signalfd failed");
  return fd;
}

int run_below_subreaper(const std::function<int(Fd)>& work,
                        const std::function<void(const std::string&)>& killed) {
  std::fflush(nullptr);
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP, SIGCHLD});
  sigset_t before;
  sigprocmask(SIG_BLOCK, &set, &before);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  signal(SIGPIPE, SIG_IGN);
  const pid_t subreaper = getpid();
  int life[2] = {-1, -1};
  const pid_t worker = pipe2(life, O_CLOEXEC | O_NONBLOCK) == 0 ? fork() : -1;
  Fd watched(life[0]), lives(life[1]);
  if (worker < 0) {
    std::perror("mimesis: fork");
    return 1;
  }
  if (worker > 0) {
    lives.reset();
    return wait_for(worker, watched, set, killed);
  }
  watched.reset();
  // A group of its own: Ctrl-C reaches the subreaper alone, which passes it on once.
  setpgid(0, 0);
  signal(SIGTTOU, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  if (getppid() != subreaper) return 1;
  return work(std::move(
      lives));  // with the signals still blocked: the supervisor reads them from a descriptor
}

void clean_folder(const std::string& directory) {
  runtime::clean_graph(directory);
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::vector<fs::path> sockets, folders;
  for (fs::recursive_directory_iterator it(directory, ignored), end; !ignored && it != end;
       it.increment(ignored)) {
    std::error_code gone;
    if (it->symlink_status(gone).type() == fs::file_type::socket) sockets.push_back(it->path());
    if (it->symlink_status(gone).type() == fs::file_type::directory &&
        it->path().filename() != "nodes")
      folders.push_back(it->path());
    if (it.depth() > 0) it.disable_recursion_pending();
  }
  // A datagram socket is refused where nobody is bound; a bound socket of another type is not
  // disturbed.
  const Fd probe(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  for (const fs::path& path : sockets) {
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    if (path.native().size() >= sizeof address.sun_path) continue;
    path.native().copy(address.sun_path, path.native().size());
    const auto* to = reinterpret_cast<const sockaddr*>(&address);
    if (connect(probe.get(), to, sizeof address) != 0 && errno == ECONNREFUSED)
      unlink(path.c_str());
  }
  for (const fs::path& folder : folders) rmdir(folder.c_str());  // stays unless it is empty
}

}  // namespace mimesis::launch
