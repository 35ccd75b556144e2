// `mimesis VERB ...` runs the program mimesis-VERB that stands beside it or in PATH, so that anybody can add a verb.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "common/runtime/suggest.h"

namespace fs = std::filesystem;

namespace {

struct KnownVerb {
  const char* name;
  const char* about;
};

constexpr std::array kKnown = {
    KnownVerb{"launch", "Starts the nodes of a launch file and watches them"},
    KnownVerb{"topic", "Shows what the topics of a running graph carry"},
    KnownVerb{"node", "Shows the nodes of a running graph"},
    KnownVerb{"log", "Records, plays, checks and converts message logs"},
    KnownVerb{"crowd", "Says what theory guarantees for a crowd scenario"},
    KnownVerb{"demix", "Learns motion primitives from motion capture"},
    KnownVerb{"reproduce", "Computes a published figure anew and compares it with its reference"},
    KnownVerb{"walk-trials", "Walks the whole chain in the physics, many times"}};

/// The folder of this program first, then those of PATH.
std::vector<fs::path> folders() {
  std::error_code failed;
  std::vector<fs::path> all = {fs::read_symlink("/proc/self/exe", failed).parent_path()};
  const char* path = std::getenv("PATH");
  std::istringstream rest(path != nullptr ? path : "");
  for (std::string folder; std::getline(rest, folder, ':');) {
    if (!folder.empty()) all.emplace_back(folder);
  }
  return all;
}

bool is_program(const fs::path& file) { return ::access(file.c_str(), X_OK) == 0 && !fs::is_directory(file); }

/// Names of all mimesis-VERB, each with its first place.
std::map<std::string, fs::path> verbs() {
  std::map<std::string, fs::path> found;
  for (const fs::path& folder : folders()) {
    std::error_code absent;
    for (const auto& entry : fs::directory_iterator(folder, absent)) {
      const std::string name = entry.path().filename();
      if (name.starts_with("mimesis-") && is_program(entry.path())) {
        found.emplace(name.substr(std::strlen("mimesis-")), entry.path());
      }
    }
  }
  return found;
}

void help(std::ostream& out) {
  out << "Starts, watches and records graphs of robot nodes.\n"
         "Usage: mimesis [--help] [--version] VERB ...\n\nVerbs (mimesis VERB --help says more):\n";
  auto found = verbs();
  const auto line = [&](const std::string& name, const std::string& about) {
    out << "  " << name << std::string(name.size() < 14 ? 14 - name.size() : 1, ' ') << about << '\n';
  };
  for (const KnownVerb& verb : kKnown) {
    if (found.erase(verb.name) > 0) line(verb.name, verb.about);
  }
  for (const auto& [name, path] : found) line(name, path.string());
  out << "\nA program mimesis-VERB in PATH is a verb too.\n"
         "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 not found or timed out, 130 interrupted.\n"
         "Examples:\n"
         "  mimesis launch launch/imitation.yaml\n"
         "  mimesis topic echo planner/status --once\n";
}

}  // namespace

int main(int argc, char** argv) {
  const std::string word = argc > 1 ? argv[1] : "";
  if (word == "--help" || word == "-h") {
    help(std::cout);
    return 0;
  }
  if (word == "--version") {
    std::cout << "mimesis " MIMESIS_VERSION "\n";
    return 0;
  }
  if (word.empty() || word.starts_with('-')) {
    std::cerr << (word.empty() ? "mimesis: which verb?" : "mimesis: unknown option '" + word + "'")
              << "; `mimesis --help` lists them\n";
    return 2;
  }
  for (const fs::path& folder : folders()) {
    const fs::path program = folder / ("mimesis-" + word);
    if (word.find('/') != std::string::npos || !is_program(program)) continue;
    ::execv(program.c_str(), argv + 1);
    std::cerr << "mimesis: " << program.string() << ": " << std::strerror(errno) << '\n';
    return 1;
  }
  std::vector<std::string> names;
  for (const auto& [name, path] : verbs()) names.push_back(name);
  for (const KnownVerb& verb : kKnown) {
    if (word == verb.name) {
      std::cerr << "mimesis: 'mimesis-" << word << "' is not installed: neither beside this program nor in PATH\n";
      return 2;
    }
  }
  std::cerr << "mimesis: unknown verb '" << word << "'" << mimesis::runtime::did_you_mean(word, names)
            << "; `mimesis --help` lists all\n";
  return 2;
}
