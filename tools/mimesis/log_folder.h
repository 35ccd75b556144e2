#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mimesis::tool {

/// Where runs leave their logs: $XDG_STATE_HOME/mimesis/log, a folder for each run.
std::filesystem::path log_root();

/// "20261121-154000-imitation-4711": names sort by time. The process id makes it unique among runs
/// that start in the same second.
std::string new_run_name(const std::string& launch_file);

/// Largest size of all logs unless a launch or $MIMESIS_LOG_LIMIT says another [bytes].
inline constexpr std::uint64_t kLogLimit = 4'000'000'000;

/// The log of one run.
struct RunFolder {
  std::string name;
  std::uint64_t bytes = 0;
  bool running = false;  ///< its launcher holds it, or a recorder one of its logs
  bool kept = false;     ///< its name is not new_run_name's: somebody gave it, to keep it
};
/// Oldest first.
std::vector<RunFolder> run_folders();

/// Limits of what is kept.
struct LogLimit {
  std::size_t runs = SIZE_MAX;
  std::uint64_t bytes = UINT64_MAX;
};
/// Which folders go so that the others are within the limit, oldest first: neither running ones nor
/// kept ones, which count nevertheless.
std::vector<RunFolder> beyond(const std::vector<RunFolder>& oldest_first, const LogLimit& limit);

/// The first failure, else empty.
std::string remove_run(const RunFolder& run);

/// Marks a run's folder as running for the life of this object, and of processes forked from this.
class RunLock {
 public:
  /// @throws ConfigError if the folder cannot be made or is that of a run that goes on.
  explicit RunLock(const std::filesystem::path& folder);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int fd_;
};

}  // namespace mimesis::tool
