#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/folder_changes.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// @throws ConfigError unless `name` is 1-64 letters, digits, `_`, `-` or `.` and does not begin
/// with `.`: it becomes a file name. `what`: "node name", "graph name".
void check_name(std::string_view what, std::string_view name);

/// @throws ConfigError unless `topic` is names (check_name) joined by `/`, of at most 255 bytes.
void check_topic(std::string_view topic);

/// Random, never 0.
std::uint64_t new_start_id();

/// One line for every topic that wires these two together with different types.
std::vector<std::string> type_mismatches(const v1::NodeInfo& a, const v1::NodeInfo& b);

/// Removes from a graph's folder (graph_directory) all that is of no living process: entries, locks
/// and sockets that kills and crashes have left. What a process holds is known by its lock.
void clean_graph(const std::string& directory);

/// A node's claim to its name: a lock on GRAPH/nodes/.NAME for the life of the process, however it
/// ends, and its NodeInfo in GRAPH/nodes/NAME, replaced atomically.
class RegistryEntry {
 public:
  /// @param patience  with a predecessor that is just dying
  /// @throws ConfigError if a live process holds the name.
  RegistryEntry(const std::string& directory, const std::string& name,
                std::chrono::milliseconds patience = std::chrono::milliseconds(500));
  ~RegistryEntry();
  RegistryEntry(const RegistryEntry&) = delete;
  RegistryEntry& operator=(const RegistryEntry&) = delete;

  void publish(const v1::NodeInfo& info);

 private:
  std::string path_, hidden_path_;
  int lock_;
};

struct RegistryChange {
  v1::NodeInfo node;
  bool alive = true;  ///< false: gone, or replaced by a new start
};

/// The nodes of a graph. Births are seen in the directory's time of change, which is read every
/// 20 ms, for half a second after a change every 2 ms; deaths at once, through pidfds. Entries that
/// are no regular files of a bounded size are skipped, said once.
class Registry {
 public:
  explicit Registry(const std::string& directory);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// Changes since the last call. Removes files of dead nodes.
  std::vector<RegistryChange> poll();
  /// Readable when a node has died.
  int fd() const { return deaths_; }
  /// How long one may sleep on fd() before `poll` is due anyway.
  std::chrono::milliseconds patience() const;

  const std::map<std::string, v1::NodeInfo>& nodes() const { return nodes_; }  ///< alive, by name

 private:
  /// Entry of a name: another file after each publish().
  struct Stamp {
    ino_t inode = 0;
    std::int64_t changed_ns = 0;
    bool operator==(const Stamp&) const = default;
  };

  void read_deaths();
  /// `all`: also what has not changed, should a change have been missed
  void scan(bool all);
  void watch(const std::string& name, std::uint32_t pid);
  void unwatch(const std::string& name);
  /// @param sockets in the graph's folder, by node; read when first needed
  void refresh(const std::string& name, std::vector<RegistryChange>& changes,
               std::optional<std::multimap<std::string, std::string>>& sockets);

  std::string directory_;
  int deaths_;                         ///< epoll of `pidfds_`
  std::map<std::string, int> pidfds_;  ///< by node; absent: dead, or of elsewhere
  std::map<std::string, Stamp> seen_;
  FolderChanges changes_;
  std::map<std::string, v1::NodeInfo> nodes_;
  std::map<std::string, int> suspects_;  ///< name -> looks left: to be read, or perhaps dying
  std::chrono::steady_clock::time_point next_look_{}, next_whole_{};
};

}  // namespace mimesis::runtime
