// `mimesis VERB ...` runs the program mimesis-VERB that stands beside it or in PATH, so that users
// can add verbs of their own. `mimesis VERB SUB ...` runs mimesis-VERB-SUB if there is one.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "common/runtime/value_text.h"
#include "tools/mimesis/verb.h"

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kPrefix = "mimesis-";

/// All programs mimesis-VERB by verb. This program's folder goes before those of PATH.
std::map<std::string, std::string> installed_verbs() {
  std::error_code ignored;
  std::vector<fs::path> folders{fs::read_symlink("/proc/self/exe", ignored).parent_path()};
  const char* path = std::getenv("PATH");
  std::istringstream in(path != nullptr ? path : "");
  for (std::string folder; std::getline(in, folder, ':');) folders.emplace_back(folder);
  std::map<std::string, std::string> verbs;
  for (const fs::path& folder : folders) {
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      const std::string name = entry.path().filename();
      if (!name.starts_with(kPrefix) || !entry.is_regular_file(ignored)) continue;
      if (access(entry.path().c_str(), X_OK) != 0) continue;
      verbs.emplace(name.substr(kPrefix.size()), entry.path());
    }
  }
  return verbs;
}

/// A verb of this project, or the program of one of its sub-verbs: "log-record".
bool is_known(const std::string& name) {
  return std::ranges::any_of(mimesis::tool::kKnownVerbs, [&](const auto& known) {
    const std::string verb(known.name);
    return name == verb || name.starts_with(verb + "-");
  });
}

int help() {
  fmt::print(
      "Starts, watches and records graphs of robot nodes.\n"
      "Usage: mimesis VERB ... | help [VERB] | --help | --version\n\n"
      "Verbs (mimesis help VERB says more):\n");
  auto verbs = installed_verbs();
  for (const auto& [name, about] : mimesis::tool::kKnownVerbs) {
    if (verbs.erase(std::string(name)) > 0) fmt::print("  {:<12}  {}\n", name, about);
  }
  for (const auto& [name, file] : verbs) {
    if (!is_known(name)) fmt::print("  {:<12}  {}\n", name, file);
  }
  fmt::print(
      "\nA program mimesis-VERB in PATH is a verb, too.\n"
      "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 not found or timed out, 130 "
      "interrupted.\n"
      "Examples:\n"
      "  mimesis launch launch/imitation.yaml\n"
      "  mimesis topic echo planner/status --once\n");
  return 0;
}

int complete_verb(const std::string& begun) {
  auto verbs = installed_verbs();
  for (const auto& [name, about] : mimesis::tool::kKnownVerbs) {
    if (verbs.erase(std::string(name)) > 0 && name.starts_with(begun)) fmt::print("{}\n", name);
  }
  for (const auto& [name, file] : verbs) {
    if (!is_known(name) && name.starts_with(begun)) fmt::print("{}\n", name);
  }
  return 0;
}

int mistake(const std::string& what) {
  fmt::print(stderr, "mimesis: {}\nSee: mimesis --help\n", what);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> words(argv + 1, argv + argc);
  if (words.empty()) return mistake("expected a verb");
  std::string verb = words[0];
  if (verb == "--version") return fmt::print("mimesis " MIMESIS_VERSION "\n"), 0;
  if (verb == "--help" || verb == "-h" || verb == "help") {
    if (words.size() == 1) return help();
    verb = words[1];
    words = {words[1], const_cast<char*>("--help")};
  }
  const bool complete = verb == mimesis::tool::kComplete;
  if (complete) {  // the program of the verb knows what may follow
    if (words.size() < 3) return complete_verb(words.size() < 2 ? "" : words[1]);
    verb = words[1];
    std::swap(words[0], words[1]);
  }
  if (verb.starts_with('-')) return mistake("unknown option '" + verb + "'");
  const auto verbs = installed_verbs();
  auto found = verbs.find(verb);
  const std::size_t part = complete ? 2 : 1;
  if (words.size() > part && is_known(verb)) {
    const auto sub = verbs.find(verb + "-" + words[part]);
    if (sub != verbs.end()) found = sub;
  }
  if (complete && (found == verbs.end() || !is_known(verb))) return 0;
  if (found != verbs.end()) {
    words.push_back(nullptr);
    execv(found->second.c_str(), words.data());
    fmt::print(stderr, "mimesis: {}: {}\n", found->second, std::strerror(errno));
    return 1;
  }
  std::vector<std::string> known;
  for (const auto& [name, file] : verbs) known.push_back(name);
  for (const auto& [name, about] : mimesis::tool::kKnownVerbs) {
    if (name != verb) continue;
    return mistake(
        fmt::format("the program of verb '{}' is missing: mimesis-{} is neither beside this one "
                    "nor in PATH; in a "
                    "source tree: cmake --build build --target mimesis-{}",
                    verb, verb, verb));
  }
  return mistake("unknown verb '" + verb + "'" + mimesis::runtime::did_you_mean(verb, known));
}
