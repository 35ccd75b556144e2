#include "common/runtime/graph_directory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>

#include "common/error.h"
#include "common/runtime/raw.h"

namespace mimesis::runtime {
namespace {

constexpr std::size_t kMaxName = 64;

/// Creates `path` for this user alone, or checks that it is: whoever can write there can command
/// the robot.
void private_directory(const std::string& path) {
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
    throw ConfigError("cannot create " + path + ": " + std::strerror(errno));
  }
  struct stat st {};
  if (lstat(path.c_str(), &st) != 0 || !S_ISDIR(st.st_mode)) {
    throw ConfigError(path + " is not a directory");
  }
  if (st.st_uid != geteuid()) throw ConfigError(path + " belongs to another user");
  if ((st.st_mode & 0077) != 0)
    throw ConfigError(path + " is open to other users; expected mode 0700");
}

/// Tells users apart in a folder that all share. User 0 of a user namespace is not the machine's
/// root.
std::string user_name() {
  constexpr ino_t kInitialNamespace = 0xEFFFFFFD;  // linux/proc_ns.h
  struct stat st {};
  const bool nested = stat("/proc/self/ns/user", &st) == 0 && st.st_ino != kInitialNamespace;
  return std::to_string(geteuid()) + (nested ? "-" + std::to_string(st.st_ino) : "");
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

}  // namespace

void check_name(std::string_view what, std::string_view name) {
  if (is_name(name)) return;
  throw ConfigError(
      std::string(what) + " '" + std::string(name) +
      "' is invalid: expected 1 to 64 letters, digits, '_', '-' or '.', not beginning with '.'");
}

void check_topic(std::string_view topic) {
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
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime != nullptr && *runtime == '/') {
    base = std::string(runtime) + "/mimesis";
  } else {  // shared by all users: one folder for each
    base = (std::filesystem::temp_directory_path() / ("mimesis-" + user_name())).string();
  }
  private_directory(base);
  private_directory(base + "/" + graph);
  return base + "/" + graph;
}

}  // namespace mimesis::runtime
