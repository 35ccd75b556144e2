// `mimesis key`: the keys that encrypt and admit what leaves a host (common/runtime/keys.h).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/keys.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

int show_keys(bool json) {
  const auto own = runtime::own_key();
  if (json) {
    Json trusted = Json::object();
    for (const auto& [key, name] : runtime::trusted_keys()) trusted[key] = name;
    fmt::print(
        "{}\n",
        Json{{"key", own ? Json(own->public_key) : Json(nullptr)}, {"trusted", trusted}}.dump());
    return own ? 0 : 3;
  }
  for (const auto& [key, name] : runtime::trusted_keys())
    fmt::print(stderr, "trusts {} '{}'\n", name, key);
  if (own) return fmt::print("{}\n", own->public_key), 0;
  fmt::print(stderr, "this host has no key; make one: mimesis key new\n");
  return 3;
}

}  // namespace

void add_key(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("key");
  verb->require_subcommand(1);
  struct Options {
    std::string name, key;
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
