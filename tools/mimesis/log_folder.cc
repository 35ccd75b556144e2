#include "tools/mimesis/log_folder.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "common/error.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = ".running";

/// A lock of flock(2) ends with the last process that has the file open, however that ends.
bool is_locked(const fs::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool locked = flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(fd);
  return locked;
}

/// "20261121-154000-" and more.
bool is_made_name(const std::string& name) {
  constexpr std::string_view kForm = "00000000-000000-";
  return name.size() > kForm.size() &&
         std::equal(kForm.begin(), kForm.end(), name.begin(), [](char form, char c) {
           return form == '0' ? c >= '0' && c <= '9' : c == form;
         });
}

}  // namespace

fs::path log_root() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path base = state != nullptr && *state != '\0' ? fs::path(state)
                        : home != nullptr && *home != '\0' ? fs::path(home) / ".local/state"
                                                           : fs::temp_directory_path();
  return base / "mimesis/log";
}

std::string new_run_name(const std::string& launch_file) {
  return fmt::format("{:%Y%m%d-%H%M%S}-{}-{}", fmt::localtime(std::time(nullptr)),
                     fs::path(launch_file).stem().string(), getpid());
}

std::vector<RunFolder> run_folders() {
  std::vector<RunFolder> runs;
  std::error_code ignored;
  for (const auto& folder : fs::directory_iterator(log_root(), ignored)) {
    if (folder.is_symlink(ignored) || !folder.is_directory(ignored)) continue;
    RunFolder run{.name = folder.path().filename().string()};
    run.kept = !is_made_name(run.name);
    for (const auto& file : fs::recursive_directory_iterator(folder, ignored)) {
      if (file.is_symlink(ignored) || !file.is_regular_file(ignored)) continue;
      const std::uint64_t bytes = file.file_size(ignored);
      if (bytes != static_cast<std::uint64_t>(-1)) run.bytes += bytes;
      const bool held = file.path().filename() == kLock || file.path().extension() == ".mcap";
      run.running = run.running || (held && is_locked(file.path()));
    }
    runs.push_back(std::move(run));
  }
  std::ranges::sort(runs, {}, &RunFolder::name);
  return runs;
}

std::vector<RunFolder> beyond(const std::vector<RunFolder>& oldest_first, const LogLimit& limit) {
  std::uint64_t bytes = 0;
  for (const RunFolder& run : oldest_first) bytes += run.bytes;
  std::size_t count = oldest_first.size();
  std::vector<RunFolder> gone;
  for (const RunFolder& run : oldest_first) {
    if (count <= limit.runs && bytes <= limit.bytes) break;
    if (run.running || run.kept) continue;
    gone.push_back(run);
    bytes -= run.bytes;
    --count;
  }
  return gone;
}

std::string remove_run(const RunFolder& run) {
  std::error_code error;
  const fs::path folder = log_root() / run.name;
  fs::remove_all(folder, error);
  return error ? fmt::format("cannot remove '{}': {}", folder.string(), error.message()) : "";
}

RunLock::RunLock(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw ConfigError(folder.string() + ": " + error.message());
  fd_ = open((folder / kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd_ < 0) throw ConfigError((folder / kLock).string() + ": " + std::strerror(errno));
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    close(fd_);
    throw ConfigError(folder.string() + ": a run writes there: choose another --name");
  }
}

RunLock::~RunLock() { close(fd_); }

}  // namespace mimesis::tool
