#pragma once
#include <sys/stat.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// Tells by a folder's time of change whether entries may have come or gone: one system call a
/// look. inotify would tell births at once, but closing one waits for the kernel (Linux 6.18: 8 ms
/// on an idle machine, up to 10 s on a busy one), and with it the end of every process.
class FolderChanges {
 public:
  using Clock = std::chrono::steady_clock;

  /// True from a change on for 30 ms, since times of change within a tick of the kernel's clock are
  /// equal; the first look counts as one.
  bool look(const std::string& folder, Clock::time_point now) {
    struct stat st {};
    const bool there = stat(folder.c_str(), &st) == 0;
    const std::int64_t at_ns = st.st_mtim.tv_sec * 1'000'000'000 + st.st_mtim.tv_nsec;
    if (there && (st.st_ino != inode_ || at_ns != at_ns_)) {
      inode_ = st.st_ino;
      at_ns_ = at_ns;
      changed_ = now;
    }
    return now < changed_ + kTick;
  }
  Clock::time_point changed() const { return changed_; }  ///< when the last change was seen

 private:
  static constexpr std::chrono::milliseconds kTick{30};
  ino_t inode_ = 0;
  std::int64_t at_ns_ = 0;
  Clock::time_point changed_{};
};

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
/// 20 ms, for half a second after a change every 2 ms, 10 s after it every 50 ms; deaths at once,
/// through pidfds. Entries that are no regular files of a bounded size are skipped, said once.
class Registry {
 public:
  /// `descriptors`: those of the nodes' types are kept, which take 50 kB a node.
  Registry(const std::string& directory, bool descriptors);
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
  struct Seen {
    Stamp stamp;
    bool read = false;  ///< as it is since; not if it was so young that another may have its stamp
  };

  void read_deaths();
  /// `all`: also what has not changed, if a change or an end could have been missed
  void scan(bool all);
  void watch(const std::string& name, std::uint32_t pid);
  void unwatch(const std::string& name);
  /// @param sockets in the graph's folder, by node; read when first needed
  void refresh(const std::string& name, std::vector<RegistryChange>& changes,
               std::optional<std::multimap<std::string, std::string>>& sockets);

  std::string directory_;
  int deaths_;                         ///< epoll of `pidfds_`
  std::map<std::string, int> pidfds_;  ///< by node; absent: dead, or of elsewhere
  bool descriptors_;
  std::map<std::string, Seen> seen_;
  FolderChanges changes_;
  std::map<std::string, v1::NodeInfo> nodes_;
  std::map<std::string, int> suspects_;  ///< name -> looks left: to be read, or perhaps dying
  std::chrono::steady_clock::time_point next_look_{}, next_whole_{};
};

/// A node as other hosts see it: its tcp endpoints alone, with `address` in the place of any
/// (0.0.0.0, [::]).
v1::NodeInfo seen_from_afar(v1::NodeInfo node, const std::string& address);

/// The nodes of other hosts in the directory of this one: entries as its own nodes have them, but
/// seen from afar, held by this process. So nodes and tools of every host see the whole graph
/// and need to know of no other host.
class FarNodes {
 public:
  explicit FarNodes(std::string directory) : directory_(std::move(directory)) {}

  /// Shows a node, or what has changed about it. A name that a node of this host has is left to it
  /// and said once.
  void show(const v1::NodeInfo& node);
  void hide(const std::string& name) { shown_.erase(name); }
  bool shows(std::uint64_t start_id) const;

 private:
  struct Shown {
    std::uint64_t start_id = 0;
    std::unique_ptr<RegistryEntry> entry;
  };
  std::string directory_;
  std::map<std::string, Shown> shown_;
  std::set<std::uint64_t> refused_;
};

}  // namespace mimesis::runtime
