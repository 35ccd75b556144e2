#include "tools/mimesis/launch/process.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

extern char** environ;

namespace mimesis::launch {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

/// All that the child needs, made before the fork: after it only async-signal-safe calls are
/// allowed.
struct Prepared {
  std::vector<char*> argv, env;
  pid_t parent = 0;
  int in = -1, out = -1, err = -1, kept = -1, report = -1;
  bool pinned = false;
  cpu_set_t cpus{};
  int policy = SCHED_OTHER;
  sched_param priority{};
  const Confinement* confinement = nullptr;
};

/// The stage that failed: the first of two ints that the child reports; the second is errno.
enum Stage : int { kAffinity, kScheduler, kConfinement, kExec };

[[noreturn]] void become(const Prepared& p) {
  setsid();
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != p.parent) _exit(1);  // it died before we could ask
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int s : {SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGTTOU}) signal(s, SIG_DFL);
  dup2(p.in >= 0 ? p.in : open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(p.out, STDOUT_FILENO);
  dup2(p.err, STDERR_FILENO);
  if (p.kept >= 0) fcntl(p.kept, F_SETFD, 0);  // not closed by exec
  int failure[2] = {kExec, 0};
  if (p.pinned && sched_setaffinity(0, sizeof p.cpus, &p.cpus) != 0) {
    failure[0] = kAffinity;
  } else if (p.policy != SCHED_OTHER && sched_setscheduler(0, p.policy, &p.priority) != 0) {
    failure[0] = kScheduler;
  } else if (p.confinement != nullptr && !p.confinement->enter()) {
    failure[0] = kConfinement;
  } else {
    execve(p.argv[0], p.argv.data(), p.env.data());
  }
  failure[1] = errno;
  if (write(p.report, failure, sizeof failure) < 0) _exit(126);
  _exit(127);
}

void set_schedule(Prepared& p, const Sched& sched) {
  CPU_ZERO(&p.cpus);
  for (const int cpu : sched.cpus) CPU_SET(static_cast<std::size_t>(cpu), &p.cpus);
  p.pinned = !sched.cpus.empty();
  p.policy = sched.policy == "fifo" ? SCHED_FIFO : sched.policy == "rr" ? SCHED_RR : SCHED_OTHER;
  p.priority.sched_priority = p.policy == SCHED_OTHER ? 0 : sched.priority;
}

}  // namespace

Pipe make_pipe() {
  int fds[2];
  if (pipe2(fds, O_CLOEXEC) != 0)
    throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  return {Fd(fds[0]), Fd(fds[1])};
}

std::vector<std::string> environment(const Command& command) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    bool replaced = false;
    for (const auto& [name, value] : command.env)
      replaced = replaced || text.starts_with(name + "=");
    if (!replaced) all.push_back(text);
  }
  for (const auto& [name, value] : command.env) all.push_back(name + "=" + value);
  return all;
}

std::string Ending::text() const {
  if (!lost.empty()) return "was lost with host '" + lost + "'";
  if (signal == 0) return "ended with exit code " + std::to_string(code);
  const char* name = sigabbrev_np(signal);
  return "was killed by " + (name != nullptr ? "SIG" + std::string(name) : std::to_string(signal));
}

void Child::send(int signal) const {
  if (pid > 0) kill(-pid, signal);
}

std::optional<Ending> Child::reap() {
  int status = 0;
  if (pid <= 0 || waitpid(pid, &status, WNOHANG) != pid) return std::nullopt;
  kill(-pid, SIGKILL);  // processes that it started itself
  pid = -1;
  pidfd.reset();
  if (WIFSIGNALED(status)) return Ending{.signal = WTERMSIG(status)};
  return Ending{.code = WEXITSTATUS(status)};
}

Child spawn(const Command& command, const Sched& sched, const Shared& shared) {
  std::vector<std::string> argv = command.argv, env = environment(command);
  const std::string path = find_executable(argv[0]);
  if (path.empty()) throw std::runtime_error(argv[0] + ": there is no such program");
  argv[0] = path;
  Pipe report = make_pipe(), out, err;
  if (shared.output < 0) {
    out = make_pipe();
    err = make_pipe();
  }
  Prepared prepared{.argv = pointers(argv), .env = pointers(env), .parent = getpid()};
  prepared.out = shared.output < 0 ? out.write.get() : shared.output;
  prepared.err = shared.output < 0 ? err.write.get() : shared.output;
  prepared.in = shared.input;
  prepared.kept = shared.kept;
  prepared.confinement = shared.confinement;
  prepared.report = report.write.get();
  set_schedule(prepared, sched);

  Child child;
  child.pid = fork();
  if (child.pid < 0) throw std::runtime_error(argv[0] + ": fork: " + std::strerror(errno));
  if (child.pid == 0) become(prepared);
  report.write.reset();
  out.write.reset();
  err.write.reset();
  int failure[2];
  if (read(report.read.get(), failure, sizeof failure) == sizeof failure) {
    waitpid(child.pid, nullptr, 0);
    const char* stage = failure[0] == kAffinity      ? ": sched.cpus: "
                        : failure[0] == kScheduler   ? ": sched.policy: "
                        : failure[0] == kConfinement ? ": cannot be confined: "
                                                     : ": ";
    throw std::runtime_error(argv[0] + stage + std::strerror(failure[1]));
  }
  child.pidfd = Fd(static_cast<int>(syscall(SYS_pidfd_open, child.pid, 0)));
  if (!child.pidfd.open())
    throw std::runtime_error(std::string("pidfd_open: ") + std::strerror(errno));
  for (const Fd* end : {&out.read, &err.read}) {
    if (end->open()) fcntl(end->get(), F_SETFL, O_NONBLOCK);
  }
  child.out = std::move(out.read);
  child.err = std::move(err.read);
  return child;
}

}  // namespace mimesis::launch
