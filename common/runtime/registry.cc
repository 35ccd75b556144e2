#include "common/runtime/registry.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <sys/epoll.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "common/error.h"
#include "common/runtime/graph_time.h"
#include "common/runtime/keys.h"
#include "common/runtime/log.h"
#include "common/runtime/raw.h"
#include "common/runtime/sockets.h"

namespace mimesis::runtime {
namespace {

constexpr std::size_t kMaxName = 64, kMaxTopic = 255;
constexpr int kMaxInfo = 16 << 20;      // bytes of a NodeInfo; it holds its messages' descriptors
constexpr std::size_t kMostSaid = 100;  // bad entries

/// Creates `path` for this user alone, or checks that it is: write access there is command of the
/// robot.
void private_directory(const std::string& path) {
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
    throw ConfigError("cannot create " + path + ": " + std::strerror(errno));
  }
  struct stat st {};
  if (lstat(path.c_str(), &st) != 0 || !S_ISDIR(st.st_mode)) {
    throw ConfigError(path + " is not a directory");
  }
  constexpr const char* kWayOut = "; MIMESIS_RUNTIME_DIR=/FOLDER names one of your own";
  if (st.st_uid != geteuid()) throw ConfigError(path + " belongs to another user" + kWayOut);
  if ((st.st_mode & 0077) != 0)
    throw ConfigError(path + " is open to other users, expected mode 0700" + kWayOut);
}

/// Tells users apart in a folder that all share. User 0 of a user namespace is not the machine's
/// root.
std::string user_name() {
  constexpr ino_t kInitialNamespace = 0xEFFFFFFD;  // linux/proc_ns.h
  struct stat st {};
  const bool nested = stat("/proc/self/ns/user", &st) == 0 && st.st_ino != kInitialNamespace;
  return std::to_string(geteuid()) + (nested ? "-" + std::to_string(st.st_ino) : "");
}

/// For users without a folder of their own. In memory if it can be: entries and sockets on a disk
/// that is busy take as long as all else of a start.
std::filesystem::path shared_folder() {
  const bool memory = std::getenv("TMPDIR") == nullptr && access("/dev/shm", W_OK | X_OK) == 0;
  return memory ? "/dev/shm" : std::filesystem::temp_directory_path();
}

bool name_char(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '.';
}

bool is_name(std::string_view name) {
  if (name.empty() || name.size() > kMaxName || name.front() == '.') return false;
  for (const char c : name) {
    if (!name_char(c)) return false;
  }
  return true;
}

using namespace std::chrono_literals;

constexpr auto kLookPeriod = 20ms;
constexpr auto kBusy = 500ms, kBusyLookPeriod = 2ms;  // so long after a change
constexpr auto kQuiet = 10s;                          // after a change, and from then on
constexpr auto kQuietLookPeriod = 50ms;
constexpr auto kWholePeriod = 1s;
constexpr int kLooks = 20;  // 1 ms apart: a dying process closes its files, then drops the locks
constexpr std::string_view kConductorSocket = "clock.sock";

struct flock whole_file(short type) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::string nodes_directory(const std::string& graph) {
  std::string path = graph + "/nodes";
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
    throw ConfigError("cannot create " + path + ": " + std::strerror(errno));
  }
  return path;
}

/// Says once per place what is wrong with an entry that another process put there.
void skip(const std::string& path, std::string_view what) {
  thread_local std::set<std::string> said;
  if (said.size() < kMostSaid && said.insert(path).second)
    warn("{}: {}; it is skipped", path, what);
}

/// Never blocks and follows no link; -1 unless the entry is a regular file.
int open_entry(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC, 0600);
  struct stat st {};
  if (fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode)) return fd;
  if (fd < 0 && errno == ENOENT) return -1;
  skip(path, std::string("expected a regular file") +
                 (fd < 0 ? std::string(": ") + std::strerror(errno) : ""));
  if (fd >= 0) close(fd);
  errno = EINVAL;
  return -1;
}

bool held(const std::string& lock_path) {
  const int fd = open_entry(lock_path, O_RDONLY);
  if (fd < 0) return false;
  struct flock lock = whole_file(F_WRLCK);
  const bool other = fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(fd);
  return other;
}

/// The open file still has this name: no other process has removed it.
bool names_file(const std::string& path, int fd) {
  struct stat named {};
  struct stat opened {};
  return stat(path.c_str(), &named) == 0 && fstat(fd, &opened) == 0 &&
         named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
}

/// A serialised NodeInfo without its largest part: of N nodes each reads the entries of all.
std::string without_descriptors(const std::string& bytes) {
  using google::protobuf::internal::WireFormatLite;
  constexpr std::uint32_t kDescriptors = WireFormatLite::MakeTag(
      v1::NodeInfo::kDescriptorsFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                            static_cast<int>(bytes.size()));
  std::string kept;
  for (;;) {
    const int begin = in.CurrentPosition();
    const std::uint32_t tag = in.ReadTag();
    if (tag == 0) return in.ConsumedEntireMessage() ? kept : bytes;
    if (!WireFormatLite::SkipField(&in, tag)) return bytes;  // whose parser refuses it
    const auto length = static_cast<std::size_t>(in.CurrentPosition() - begin);
    if (tag != kDescriptors) kept.append(bytes, static_cast<std::size_t>(begin), length);
  }
}

std::optional<v1::NodeInfo> read_info(const std::string& path, const std::string& name,
                                      bool descriptors = true) {
  const int fd = open_entry(path, O_RDONLY);
  if (fd < 0) return std::nullopt;
  // Not from the file itself: Protobuf throws if it becomes shorter meanwhile.
  std::string bytes;
  struct stat st {};
  if (fstat(fd, &st) == 0 && st.st_size <= kMaxInfo) {
    bytes.resize(static_cast<std::size_t>(st.st_size));
    bytes.resize(
        static_cast<std::size_t>(std::max<ssize_t>(read(fd, bytes.data(), bytes.size()), 0)));
  }
  close(fd);
  v1::NodeInfo info;
  if (info.ParseFromString(descriptors ? bytes : without_descriptors(bytes)) &&
      info.name() == name && info.start_id() != 0)
    return info;
  skip(path, fmt::format("expected the NodeInfo of node {} in at most {} bytes", name, kMaxInfo));
  return std::nullopt;
}

/// Than two ticks of the kernel's clock: no later change can have the same time.
bool is_older(std::int64_t changed_ns) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec > changed_ns + 50'000'000;
}

std::vector<std::string> entries(const std::string& directory) {
  std::vector<std::string> names;
  DIR* dir = opendir(directory.c_str());
  if (dir == nullptr) return names;
  while (const dirent* entry = readdir(dir)) names.emplace_back(entry->d_name);
  closedir(dir);
  return names;
}

/// Name of the node that a socket file in a graph's folder is of: NAME-START.s, .d or .r;
/// clock.sock is the conductor's. Empty: it is no socket of ours.
std::string socket_owner(const std::string& file) {
  if (file == kConductorSocket) return "clock";
  const std::size_t dash = file.rfind('-');
  if (dash == std::string::npos || file.size() < dash + 4) return {};
  const std::string_view start = std::string_view(file).substr(dash + 1, file.size() - dash - 3);
  const bool ours = start.find_first_not_of("0123456789") == std::string_view::npos &&
                    file[file.size() - 2] == '.' &&
                    std::string_view("sdr").find(file.back()) != std::string_view::npos;
  return ours ? file.substr(0, dash) : std::string();
}

/// Sockets in a graph's folder, by node. Whoever cleans after many reads the folder once.
using Sockets = std::multimap<std::string, std::string>;
Sockets sockets_in(const std::string& graph) {
  Sockets sockets;
  for (const std::string& file : entries(graph)) sockets.emplace(socket_owner(file), file);
  sockets.erase("");
  return sockets;
}

/// Removes the entry, the sockets and the lock of a dead node; a process that takes the name
/// meanwhile keeps it.
void clean(const std::string& directory, const std::string& name, const Sockets& sockets) {
  const std::string path = directory + "/" + name, hidden_path = directory + "/." + name;
  const int fd = open_entry(hidden_path, O_RDWR | O_CREAT);
  if (fd < 0) return;
  struct flock lock = whole_file(F_WRLCK);
  if (fcntl(fd, F_OFD_SETLK, &lock) == 0 && names_file(hidden_path, fd)) {
    const std::string graph = directory.substr(0, directory.rfind('/') + 1);
    for (auto [it, end] = sockets.equal_range(name); it != end; ++it) {
      const std::string& file = it->second;
      // A conductor may bear another name than clock: then it listens.
      if (file != kConductorSocket || !PacketSocket::connect(graph + file).valid())
        unlink((graph + file).c_str());
    }
    unlink(path.c_str());
    const std::string temporary = hidden_path + ".new";
    if (!held(temporary)) unlink(temporary.c_str());  // not the lock of a node NAME.new
    unlink(hidden_path.c_str());
  }
  close(fd);
}

}  // namespace

std::vector<std::string> type_mismatches(const v1::NodeInfo& a, const v1::NodeInfo& b) {
  std::vector<std::string> lines;
  const auto compare = [&lines](const v1::NodeInfo& publisher, const v1::NodeInfo& subscriber) {
    for (const v1::TopicInfo& out : publisher.outputs()) {
      for (const v1::TopicInfo& in : subscriber.inputs()) {
        if (in.topic() != out.topic() || in.type_hash() == out.type_hash()) continue;
        std::string line = "topic " + out.topic() + ": node " + publisher.name() + " publishes " +
                           out.type() + ", node " + subscriber.name() + " expects " + in.type();
        if (in.type() == out.type()) line += " with other fields (different builds)";
        lines.push_back(line);
      }
    }
  };
  compare(a, b);
  compare(b, a);
  return lines;
}

void clean_graph(const std::string& directory) {
  const std::string nodes = nodes_directory(directory);
  std::set<std::string> names;
  const Sockets sockets = sockets_in(directory);
  for (const auto& [name, file] : sockets) names.insert(name);
  for (std::string file : entries(nodes)) {
    if (file.ends_with(".new")) file.resize(file.size() - 4);
    names.insert(file.substr(file.find_first_not_of('.') == 1 ? 1 : 0));
  }
  for (const std::string& name : names) {
    if (is_name(name)) clean(nodes, name, sockets);
  }
  try {
    const GraphTime last(directory);  // takes its file along if nobody else holds it
  } catch (const ConfigError&) {      // the next node says why
  }
}

void check_name(std::string_view what, std::string_view name) {
  if (is_name(name)) return;
  throw ConfigError(
      std::string(what) + " '" + std::string(name) +
      "' is invalid: expected 1 to 64 letters, digits, '_', '-' or '.', not beginning with '.'");
}

void check_topic(std::string_view topic) {
  if (topic.size() > kMaxTopic) {
    throw ConfigError("topic '" + std::string(topic) + "' is invalid: expected at most " +
                      std::to_string(kMaxTopic) + " bytes");
  }
  for (std::string_view rest = topic;;) {
    const std::size_t slash = rest.find('/');
    if (!is_name(rest.substr(0, slash))) {
      throw ConfigError("topic '" + std::string(topic) +
                        "' is invalid: expected names joined by '/'");
    }
    if (slash == std::string_view::npos) return;
    rest.remove_prefix(slash + 1);
  }
}

std::uint64_t new_start_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32U) | random();
  return id;
}

std::string graph_name() {
  const char* name = std::getenv("MIMESIS_GRAPH");
  return name != nullptr && *name != '\0' ? name : "default";
}

std::string graph_directory(const std::string& graph) {
  check_name("graph name", graph);
  std::string base;
  const auto folder = [](const char* variable) {
    const char* path = std::getenv(variable);
    return std::string(path != nullptr && *path == '/' ? path : "");
  };
  if (const std::string own = folder("MIMESIS_RUNTIME_DIR"); !own.empty()) {
    base = own;
  } else if (const std::string runtime = folder("XDG_RUNTIME_DIR"); !runtime.empty()) {
    base = runtime + "/mimesis";
  } else {
    base = (shared_folder() / ("mimesis-" + user_name())).string();
  }
  private_directory(base);
  private_directory(base + "/" + graph);
  return base + "/" + graph;
}

RegistryEntry::RegistryEntry(const std::string& directory, const std::string& name,
                             std::chrono::milliseconds patience) {
  check_name("node name", name);
  const std::string nodes = nodes_directory(directory);
  path_ = nodes + "/" + name;
  hidden_path_ = nodes + "/." + name;
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    lock_ = open_entry(hidden_path_, O_RDWR | O_CREAT);
    if (lock_ < 0) throw ConfigError("cannot open " + hidden_path_ + ": " + std::strerror(errno));
    struct flock lock = whole_file(F_WRLCK);
    if (fcntl(lock_, F_OFD_SETLK, &lock) == 0 && names_file(hidden_path_, lock_)) break;
    close(lock_);
    if (std::chrono::steady_clock::now() >= deadline) {
      const auto other = read_info(path_, name);
      throw ConfigError("a node '" + name + "' runs already in " + directory +
                        (other ? " (process " + std::to_string(other->pid()) + ")" : ""));
    }
    std::this_thread::sleep_for(2ms);
  }
  unlink(path_.c_str());  // file of a predecessor that died
}

RegistryEntry::~RegistryEntry() {
  unlink(path_.c_str());
  unlink(hidden_path_.c_str());  // while it is locked: the next owner makes a new one
  close(lock_);
}

void RegistryEntry::publish(const v1::NodeInfo& info) {
  const std::string temporary = hidden_path_ + ".new";
  unlink(temporary.c_str());  // whatever lies there, this file is ours
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const bool written = fd >= 0 && info.SerializeToFileDescriptor(fd);
  if (fd >= 0) close(fd);
  if (!written) throw ConfigError("cannot write " + temporary + ": " + std::strerror(errno));
  if (std::rename(temporary.c_str(), path_.c_str()) != 0) {
    throw ConfigError("cannot write " + path_ + ": " + std::strerror(errno));
  }
}

Registry::Registry(const std::string& directory, bool descriptors)
    : directory_(nodes_directory(directory)),
      deaths_(epoll_create1(EPOLL_CLOEXEC)),
      descriptors_(descriptors) {
  if (deaths_ < 0) throw ConfigError(std::string("no epoll: ") + std::strerror(errno));
}

Registry::~Registry() {
  for (const auto& [name, fd] : pidfds_) close(fd);
  close(deaths_);
}

std::chrono::milliseconds Registry::patience() const {
  if (!suspects_.empty()) return 1ms;
  const auto left = next_look_ - std::chrono::steady_clock::now();
  return std::max(0ms, std::chrono::ceil<std::chrono::milliseconds>(left));
}

void Registry::scan(bool all) {
  DIR* dir = opendir(directory_.c_str());
  if (dir == nullptr) return;
  std::set<std::string> there;
  while (const dirent* entry = readdir(dir)) {
    if (entry->d_name[0] == '.') continue;
    struct stat st {};
    if (fstatat(dirfd(dir), entry->d_name, &st, AT_SYMLINK_NOFOLLOW) != 0) continue;
    const auto name = there.insert(entry->d_name).first;
    Seen& seen = seen_[*name];
    const Stamp now{st.st_ino, st.st_mtim.tv_sec * 1'000'000'000 + st.st_mtim.tv_nsec};
    const bool changed = seen.stamp != now;
    if (changed) seen = {now, false};
    if (changed || (all && !(seen.read && pidfds_.contains(*name)))) suspects_.emplace(*name, 0);
  }
  closedir(dir);
  for (const auto& [name, info] : nodes_) {
    if (!there.contains(name)) suspects_.emplace(name, 0);
  }
  std::erase_if(seen_, [&there](const auto& entry) { return !there.contains(entry.first); });
}

void Registry::watch(const std::string& name, std::uint32_t pid) {
  unwatch(name);
  const int fd = static_cast<int>(syscall(SYS_pidfd_open, static_cast<pid_t>(pid), 0));
  if (fd < 0) return;
  epoll_event event{.events = EPOLLIN, .data = {.fd = fd}};
  epoll_ctl(deaths_, EPOLL_CTL_ADD, fd, &event);
  pidfds_[name] = fd;
}

void Registry::unwatch(const std::string& name) {
  const auto it = pidfds_.find(name);
  if (it == pidfds_.end()) return;
  close(it->second);  // which takes it out of the epoll
  pidfds_.erase(it);
}

void Registry::read_deaths() {
  std::array<epoll_event, 16> events;
  const int count = epoll_wait(deaths_, events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const auto dead = std::ranges::find(pidfds_, events[static_cast<std::size_t>(i)].data.fd,
                                        &std::pair<const std::string, int>::second);
    if (dead == pidfds_.end()) continue;
    suspects_[dead->first] = kLooks;
    unwatch(std::string(dead->first));
  }
}

std::vector<RegistryChange> Registry::poll() {
  read_deaths();
  if (const auto now = std::chrono::steady_clock::now(); now >= next_look_) {
    const bool changed = changes_.look(directory_, now), whole = now >= next_whole_;
    if (whole) next_whole_ = now + kWholePeriod;
    if (whole || changed) scan(whole);
    const auto since = now - changes_.changed();
    next_look_ = now + (since < kBusy    ? kBusyLookPeriod
                        : since < kQuiet ? kLookPeriod
                                         : kQuietLookPeriod);
  }
  std::vector<RegistryChange> changes;
  std::optional<Sockets> sockets;
  for (auto it = suspects_.begin(); it != suspects_.end();) {
    refresh(it->first, changes, sockets);
    it = nodes_.contains(it->first) && it->second-- > 0 ? std::next(it) : suspects_.erase(it);
  }
  return changes;
}

void Registry::refresh(const std::string& name, std::vector<RegistryChange>& changes,
                       std::optional<Sockets>& sockets) {
  if (!is_name(name)) return skip(directory_, "a file in it has a name that no node can have");
  const std::string path = directory_ + "/" + name;
  const bool alive = held(directory_ + "/." + name);
  const auto seen = seen_.find(name);
  if (alive && seen != seen_.end() && seen->second.read && nodes_.contains(name)) return;
  std::optional<v1::NodeInfo> info;
  if (alive) info = read_info(path, name, descriptors_);
  if (info && seen != seen_.end()) seen->second.read = is_older(seen->second.stamp.changed_ns);
  if (!alive) {
    if (!sockets) sockets = sockets_in(directory_.substr(0, directory_.rfind('/') + 1));
    clean(directory_, name, *sockets);
  }

  const auto known = nodes_.find(name);
  if (known != nodes_.end() && (!info || info->start_id() != known->second.start_id())) {
    changes.push_back({std::move(known->second), false});
    nodes_.erase(known);
    unwatch(name);
  }
  if (!info) return;
  const bool fresh = !nodes_.contains(name);
  v1::NodeInfo& entry = nodes_[name];
  // The process of another host's entry is ours or none of here.
  const bool far = !info->data_endpoints().empty() && info->data_endpoints(0).starts_with("tcp://");
  if (fresh && !far) watch(name, info->pid());
  if (entry.SerializeAsString() == info->SerializeAsString()) return;
  entry = *info;
  changes.push_back({std::move(*info), true});
}

namespace {

/// Leaves only the tcp endpoint.
void reach_through(const std::string& address,
                   google::protobuf::RepeatedPtrField<std::string>& endpoints) {
  std::string usable;
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with("tcp://")) continue;
    const bool anywhere =
        endpoint.starts_with("tcp://0.0.0.0:") || endpoint.starts_with("tcp://[::]:");
    usable = anywhere ? tcp_at(address) + endpoint.substr(endpoint.rfind(':')) : endpoint;
  }
  endpoints.Clear();
  if (!usable.empty()) *endpoints.Add() = usable;
}

}  // namespace

v1::NodeInfo seen_from_afar(v1::NodeInfo node, const std::string& address) {
  for (auto* endpoints : {node.mutable_data_endpoints(), node.mutable_reliable_endpoints(),
                          node.mutable_service_endpoints()}) {
    reach_through(address, *endpoints);
  }
  return node;
}

void FarNodes::show(const v1::NodeInfo& node) {
  try {
    Shown& shown = shown_[node.name()];
    if (!shown.entry) {
      shown.entry =
          std::make_unique<RegistryEntry>(directory_, node.name(), std::chrono::milliseconds(0));
    }
    shown.start_id = node.start_id();
    shown.entry->publish(node);
  } catch (const ConfigError& e) {
    shown_.erase(node.name());
    if (refused_.insert(node.start_id()).second)
      warn("node {} of host {} is not seen here: {}", node.name(), node.host(), e.what());
  }
}

bool FarNodes::shows(std::uint64_t start_id) const {
  return std::ranges::any_of(shown_,
                             [&](const auto& shown) { return shown.second.start_id == start_id; });
}

}  // namespace mimesis::runtime
