#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

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

/// The nodes of a graph, kept current through inotify. The kernel reports the closing of a dead
/// process's lock file, so a death is known as fast as a birth; without inotify the directory is
/// read every 20 ms. Entries that are no regular files of a bounded size are skipped, said once.
class Registry {
 public:
  explicit Registry(const std::string& directory);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// Changes since the last call. Removes files of dead nodes.
  std::vector<RegistryChange> poll();
  /// Readable when `poll` has work; -1 without inotify.
  int fd() const { return inotify_; }
  /// How long one may sleep on fd() before `poll` is due anyway.
  std::chrono::milliseconds patience() const;

  const std::map<std::string, v1::NodeInfo>& nodes() const { return nodes_; }  ///< alive, by name

 private:
  void read_events();
  void scan();
  /// @param sockets in the graph's folder, by node; read when first needed
  void refresh(const std::string& name, std::vector<RegistryChange>& changes,
               std::optional<std::multimap<std::string, std::string>>& sockets);

  std::string directory_;
  int inotify_;
  std::map<std::string, v1::NodeInfo> nodes_;
  std::map<std::string, int> suspects_;  ///< name -> looks left: to be read, or perhaps dying
  std::chrono::steady_clock::time_point next_scan_{};
};

}  // namespace mimesis::runtime
