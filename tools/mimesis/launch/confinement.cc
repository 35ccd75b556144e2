#include "tools/mimesis/launch/confinement.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>

#include "common/error.h"

namespace mimesis::launch {
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

}  // namespace mimesis::launch
