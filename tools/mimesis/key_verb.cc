// `mimesis key`: the keys that encrypt and admit what leaves a host (common/runtime/keys.h).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/json_text.h"
#include "common/runtime/keys.h"
#include "common/runtime/raw.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

int show_keys(bool json) {
  const auto own = runtime::own_key();
  if (json) {
    Json trusted = Json::object();
    for (const auto& [key, name] : runtime::trusted_keys()) trusted[key] = name;
    fmt::print("{}\n", json_text(Json{{"key", own ? Json(own->public_key) : Json(nullptr)},
                                      {"trusted", trusted}}));
    return own ? 0 : 3;
  }
  for (const auto& [key, name] : runtime::trusted_keys())
    fmt::print(stderr, "trusts {} '{}'\n", name, key);
  if (own) return fmt::print("{}\n", own->public_key), 0;
  fmt::print(stderr, "this host has no key; make one: mimesis key new\n");
  return 3;
}

int list_keys(const std::string& graph, bool json) {
  std::map<std::string, std::vector<std::string>> nodes;  // by key
  for (const v1::NodeInfo& node :
       runtime::GraphView(graph.empty() ? runtime::graph_name() : graph).nodes()) {
    if (!node.public_key().empty()) nodes[node.public_key()].push_back(node.name());
  }
  Json all = Json::array();
  TextTable table({"HOST", "KEY", "NODES"});
  for (const auto& [key, name] : runtime::trusted_keys()) {
    all.push_back({{"host", name}, {"key", key}, {"nodes", nodes[key]}});
    table.row({name, key, fmt::format("{}", fmt::join(nodes[key], " "))});
  }
  if (json) {
    fmt::print("{}\n", json_text(Json{{"trusted", all}}));
  } else {
    table.print(std::cout, use_colour(1));
  }
  return 0;
}

}  // namespace

void add_key(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("key");
  verb->require_subcommand(1);
  struct Options {
    std::string name, key, graph;
    bool replace = false, json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* make =
      verb->add_subcommand("new", "Makes the key of this host and prints its public part");
  make->add_flag("--replace", options->replace, "In the place of the one there is");
  make->footer("Examples:\n  mimesis key new");
  make->callback([options, &exit_code] {
    fmt::print("{}\n", runtime::make_key(options->replace).public_key);
    exit_code = 0;
  });
  CLI::App* show = verb->add_subcommand("show", "Prints the public key of this host");
  show->add_flag("--json", options->json, "With the keys that it trusts");
  show->footer("Examples:\n  mimesis key show\n  ssh spine mimesis key show");
  show->callback([options, &exit_code] { exit_code = show_keys(options->json); });
  CLI::App* list = verb->add_subcommand("list", "Trusted hosts, and their nodes in a graph");
  list->add_option("--graph", options->graph, "Graph (default: $MIMESIS_GRAPH, or 'default')");
  list->add_flag("--json", options->json, "One JSON object");
  list->footer("Examples:\n  mimesis key list");
  list->callback([options, &exit_code] { exit_code = list_keys(options->graph, options->json); });
  CLI::App* untrust =
      verb->add_subcommand("untrust", "Takes trust back: connections of the host end within 2 s");
  untrust->add_option("name", options->name, "Of the host, or its key")->required();
  untrust->footer("Examples:\n  mimesis key untrust spine");
  untrust->callback([options, &exit_code] {
    for (const std::string& key : runtime::untrust_key(options->name))
      fmt::print(stderr, "'{}' is not trusted any more\n", key);
    exit_code = 0;
  });
  CLI::App* trust = verb->add_subcommand("trust", "Talks to a host from now on");
  trust->add_option("name", options->name, "For the host")->required();
  trust->add_option("key", options->key, "What `mimesis key show` prints there")->required();
  trust->footer("Examples:\n  mimesis key trust spine \"$(ssh spine mimesis key show)\"");
  trust->callback([options, &exit_code] {
    runtime::trust_key(options->name, options->key);
    exit_code = 0;
  });
}

}  // namespace mimesis::tool
