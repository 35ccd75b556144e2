#include "tools/mimesis/launch/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <vector>

#include "common/error.h"

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

namespace {

// As linux/landlock.h of Debian 12 has them, and later versions.
constexpr std::uint64_t kExecute = 1, kWriteFile = 1 << 1, kReadFile = 1 << 2, kReadFolder = 1 << 3;
constexpr std::uint64_t kTruncate = 1 << 14;     // version 3
constexpr std::uint64_t kIoctlDevice = 1 << 15;  // version 5
constexpr std::uint64_t kVersion1 = (1 << 13) - 1, kRefer = 1 << 13;
constexpr std::uint64_t kOfFiles = kExecute | kWriteFile | kReadFile | kTruncate | kIoctlDevice;

/// Attributes of a set of rules of version 6. An older kernel takes them as long as what it does
/// not know is 0.
struct Attributes {
  std::uint64_t files = 0, tcp = 0, scoped = 0;
};

class Rules {
 public:
  explicit Rules(int version) {
    files_ = kVersion1;
    if (version >= 2) files_ |= kRefer;
    if (version >= 3) files_ |= kTruncate;
    if (version >= 5) files_ |= kIoctlDevice;
    const Attributes attributes{
        .files = files_,
        .tcp = version >= 4 ? 3U : 0U,     // bind, connect
        .scoped = version >= 6 ? 3U : 0U,  // abstract sockets, signals
    };
    rules_ = Fd(
        static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
  }
  /// What is not there is not allowed.
  void allow(const std::string& path, std::uint64_t rights) {
    const Fd place(open(path.c_str(), O_PATH | O_CLOEXEC));
    if (!place.open()) return;
    std::error_code ignored;
    if (!std::filesystem::is_directory(path, ignored)) rights &= kOfFiles;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = rights & files_;
    rule.parent_fd = place.get();
    syscall(SYS_landlock_add_rule, rules_.get(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
  }
  std::uint64_t files() const { return files_; }
  Fd take() { return std::move(rules_); }

 private:
  std::uint64_t files_ = 0;
  Fd rules_;
};

#if defined(__x86_64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_AARCH64;
#else
#error "confinement: the audit name of this machine is missing"
#endif

}  // namespace

Confinement::Confinement(const std::string& writable) {
  const long version =
      syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) {
    throw ConfigError(
        fmt::format("this kernel cannot confine the programs that a log names (Landlock: {}); log "
                    "replay and log restore run them all the same with --unconfined",
                    std::strerror(errno)));
  }
  Rules rules(static_cast<int>(version));
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/", ignored)) {
    if (entry.path() != "/dev") rules.allow(entry.path(), kExecute | kReadFile | kReadFolder);
  }
  for (const char* device : {"/dev/null", "/dev/zero"}) rules.allow(device, kReadFile | kWriteFile);
  rules.allow("/dev/urandom", kReadFile);
  rules.allow(writable, rules.files() & ~kExecute);
  rules_ = rules.take();
}

bool Confinement::enter() const {
  // What Landlock does not know, or not in all versions: sockets, signals, attributes of files.
  // (It keeps ptrace(2) to the program's own processes: LeakSanitizer needs that.)
  constexpr std::array kDenied {
    SYS_socket, SYS_io_uring_setup, SYS_kill, SYS_pidfd_send_signal, SYS_truncate, SYS_fchmod,
        SYS_fchmodat, SYS_fchown, SYS_fchownat, SYS_utimensat, SYS_setxattr, SYS_lsetxattr,
        SYS_fsetxattr, SYS_removexattr, SYS_lremovexattr, SYS_fremovexattr,
#if defined(__x86_64__)
        SYS_chmod, SYS_chown, SYS_lchown, SYS_utime, SYS_utimes, SYS_futimesat,
#endif
  };
  constexpr std::uint32_t kOtherNumbers = 0x40000000;  // x32
  std::array<sock_filter, kDenied.size() + 7> program{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kMachine, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kOtherNumbers, kDenied.size() + 1, 0),
  }};
  for (std::size_t k = 0; k < kDenied.size(); ++k) {
    program.at(5 + k) = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(kDenied[k]),
                                 static_cast<std::uint8_t>(kDenied.size() - k), 0);
  }
  program.at(5 + kDenied.size()) = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  program.at(6 + kDenied.size()) = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EACCES);
  const sock_fprog filter{.len = program.size(), .filter = program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         syscall(SYS_landlock_restrict_self, rules_.get(), 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

namespace {

namespace fs = std::filesystem;

std::string policy_text(int policy, int priority) {
  policy &= ~SCHED_RESET_ON_FORK;
  const char* name = policy == SCHED_FIFO    ? "fifo"
                     : policy == SCHED_RR    ? "rr"
                     : policy == SCHED_OTHER ? "other"
                                             : "another";
  return fmt::format("{} {}", name, priority);
}

/// "" if this thread has what it was asked for.
std::string thread_lacks(pid_t thread, const Sched& sched) {
  sched_param has{};
  const int policy = sched_getscheduler(thread);
  cpu_set_t cpus;
  if (policy < 0 || sched_getparam(thread, &has) != 0 ||
      sched_getaffinity(thread, sizeof cpus, &cpus) != 0)
    return {};  // it has ended
  if (sched.policy != "other") {
    const std::string asked = fmt::format("{} {}", sched.policy, sched.priority);
    const std::string got = policy_text(policy, has.sched_priority);
    if (got != asked) return fmt::format("policy: expected {}, the system gave {}", asked, got);
  }
  if (sched.cpus.empty()) return {};
  std::set<int> got;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) got.insert(cpu);
  }
  const std::set<int> asked(sched.cpus.begin(), sched.cpus.end());
  return got == asked ? ""
                      : fmt::format("cpus: expected {}, the system gave {}", fmt::join(asked, ", "),
                                    fmt::join(got, ", "));
}

/// Memory that a process has locked [kB], VmLck of proc(5).
long locked_kb(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmLck:")) return std::stol(line.substr(6));
  }
  return -1;  // it has ended
}

}  // namespace

std::string not_granted(pid_t pid, const Sched& sched, bool locked) {
  if (sched.policy == "other" && sched.cpus.empty() && !sched.mlock) return {};
  std::error_code gone;
  fs::directory_iterator task(fmt::format("/proc/{}/task", pid), gone);
  for (; !gone && task != fs::directory_iterator(); task.increment(gone)) {
    const pid_t thread = std::stoi(task->path().filename());
    if (const std::string lacks = thread_lacks(thread, sched); !lacks.empty()) {
      std::ifstream comm(task->path() / "comm");
      std::string name;
      std::getline(comm, name);
      return "sched." + lacks + (thread == pid ? "" : fmt::format(" (its thread '{}')", name));
    }
  }
  if (locked && sched.mlock && locked_kb(pid) == 0)
    return "sched.mlock: expected locked memory, the system says VmLck 0 kB";
  return {};
}

}  // namespace mimesis::launch
