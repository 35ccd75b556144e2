#include "tools/mimesis/usage.h"

#include <CLI/App.hpp>
#include <algorithm>
#include <iostream>

#include "common/runtime/suggest.h"

namespace mimesis::tool {
namespace {

/// The verb or sub-verb that the command line has reached.
const CLI::App& innermost(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? app : innermost(*chosen.front());
}

std::string full_name(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return parent == nullptr ? app.get_name() : full_name(*parent) + " " + app.get_name();
}

std::vector<std::string> known_words(const CLI::App& app, bool options) {
  std::vector<std::string> known;
  if (options) {
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
  } else {
    for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(verb->get_name());
    }
  }
  return known;
}

std::string unknown(const std::string& word, bool option, const std::vector<std::string>& known) {
  return (option          ? "unknown option '"
          : known.empty() ? "unexpected argument '"
                          : "unknown verb '") +
         word + "'" + runtime::did_you_mean(word, known);
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

}  // namespace

int report_usage(const CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& verb = innermost(program);
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
    std::cout << (error.get_name() == "CallForVersion" ? std::string(error.what()) + "\n"
                                                       : program.help());
    return 0;
  }
  const std::vector<std::string> extra = program.remaining(true);
  std::string what = error.what();
  if (!extra.empty()) {
    const bool option = extra.front().starts_with('-');
    const std::vector<std::string> known = known_words(verb, option);
    const std::string name = extra.front().substr(0, extra.front().find('='));
    if (option && std::ranges::find(known, name) != known.end()) {
      what = "'" + name + "' belongs behind the verb: " + full_name(verb) + " " + name + " ...";
    } else {
      what = unknown(extra.front(), option, known);
    }
  } else if (const auto verbs = known_words(verb, false); !verbs.empty()) {
    what = "expected a verb: " + joined(verbs);
  }
  std::cerr << full_name(verb) << ": " << what << "\nSee: " << full_name(verb) << " --help\n";
  return 2;
}

}  // namespace mimesis::tool
