#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <vector>

#include "common/error.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kPrefix = "mimesis_";

/// Programs of nodes, without the prefix: those beside this program.
std::set<std::string> node_programs(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kPrefix) && access(entry.path().c_str(), X_OK) == 0) {
      names.insert(name.substr(kPrefix.size()));
    }
  }
  return names;
}

struct Options {
  std::string node;
  std::vector<std::string> arguments;
  bool list = false;
};

int run(const Options& o) {
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  const std::set<std::string> known = node_programs(folder);
  if (o.list) {
    for (const std::string& name : known) std::cout << name << '\n';
    return 0;
  }
  if (o.node.empty()) throw ConfigError("NODE is missing; --list shows which there are");
  const std::string name = o.node.starts_with(kPrefix) ? o.node.substr(kPrefix.size()) : o.node;
  if (!known.contains(name)) {
    throw ConfigError("no node program '" + name + "' beside this one" +
                      runtime::did_you_mean(name, {known.begin(), known.end()}) +
                      "; --list shows which there are");
  }
  std::string program = (folder / (std::string(kPrefix) + name)).string();
  std::vector<char*> words{program.data()};
  std::vector<std::string> arguments = o.arguments;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  std::cerr << program << ": " << std::strerror(errno) << '\n';
  return 1;
}

}  // namespace

void add_run(CLI::App& program, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* verb = program.add_subcommand("run", "Starts one node");
  verb->prefix_command();
  verb->add_flag("--list", o->list, "Names of the nodes that can be started");
  verb->footer(
      "What stands behind NODE is the node's own: mimesis run planner --help.\n"
      "Exit codes: the node's; 2 usage.\nExamples:\n"
      "  mimesis run planner --set robot=lwr4.yaml\n"
      "  mimesis run --list");
  verb->callback([verb, o, &exit_code] {
    const std::vector<std::string> words = verb->remaining();
    if (!words.empty()) {
      o->node = words.front();
      o->arguments.assign(words.begin() + 1, words.end());
    }
    exit_code = run(*o);
  });
}

}  // namespace mimesis::tool
