#include "tools/mimesis/verb.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/table.h"

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

/// Scripts give --timeout to any verb, whether or not it waits.
void accept_timeout(CLI::App& verb) {
  for (CLI::App* sub : verb.get_subcommands([](const CLI::App*) { return true; }))
    accept_timeout(*sub);
  if (verb.get_require_subcommand_min() > 0 || verb.get_option_no_throw("--timeout") != nullptr)
    return;
  verb.add_option_function<double>(
      "--timeout", [](double) {}, "Accepted by every verb; this one waits for nothing");
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
  } else if (const auto verbs = known_words(verb, false);
             !verbs.empty() && verb.get_require_subcommand_min() > 0) {
    what = fmt::format("expected a verb: {}", fmt::join(verbs, ", "));
  }
  std::cerr << full_name(verb) << ": " << what << "\nSee: " << full_name(verb) << " --help\n";
  return 2;
}

LiveNames live_names = nullptr;

std::vector<std::string> completions(const CLI::App& verb, const std::vector<std::string>& words) {
  const CLI::App* at = &verb;
  std::vector<std::string> before;  // arguments of `at`
  std::string graph;
  const CLI::Option* open = nullptr;  // an option that waits for its value
  const auto takes_value = [](const CLI::Option* o) {
    return o != nullptr && o->get_items_expected_max() > 0;
  };
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (open != nullptr) {
      if (open->check_lname("graph")) graph = word;
      open = nullptr;
    } else if (word.starts_with('-')) {
      if (word.starts_with("--graph=")) graph = word.substr(8);
      const CLI::Option* option = at->get_option_no_throw(word);
      if (takes_value(option)) open = option;
    } else if (const auto subs =
                   at->get_subcommands([&](const CLI::App* sub) { return sub->check_name(word); });
               before.empty() && !subs.empty()) {
      at = subs.front();
    } else {
      before.push_back(word);
    }
  }
  const std::string last = words.empty() ? "" : words.back();
  std::vector<std::string> found;
  const auto offer = [&](const std::vector<std::string>& candidates) {
    for (const std::string& candidate : candidates) {
      if (candidate.starts_with(last)) found.push_back(candidate);
    }
  };
  const auto live = [&](const std::string& what) {
    if (live_names != nullptr) offer(live_names(what, graph, before));
  };
  if (open != nullptr) {
    live(open->get_lnames().empty() ? "" : open->get_lnames().front());
  } else if (last.starts_with('-')) {
    offer(known_words(*at, /*options=*/true));
  } else {
    if (before.empty()) offer(known_words(*at, /*options=*/false));
    std::vector<const CLI::Option*> places;
    for (const CLI::Option* option : at->get_options()) {
      if (option->get_positional()) places.push_back(option);
    }
    if (!places.empty())
      live(places[std::min(before.size(), places.size() - 1)]->get_name(/*positional=*/true));
  }
  std::ranges::sort(found);
  return found;
}

int run_verb(const std::string& verb, int argc, char** argv, void (*add)(CLI::App&, int&)) {
  CLI::App program("Starts, watches and records graphs of robot nodes.", "mimesis");
  program.set_version_flag("--version", "mimesis " MIMESIS_VERSION);
  program.require_subcommand(1);
  int exit_code = 0;
  add(program, exit_code);
  accept_timeout(program);
  for (const KnownVerb& known : kKnownVerbs) {
    if (known.name == verb) program.get_subcommand(verb)->description(std::string(known.about));
  }
  if (argc > 1 && std::string_view(argv[1]) == kComplete) {
    const std::vector<std::string> words(argv + 2, argv + argc);
    for (const std::string& word : completions(*program.get_subcommand(verb), words))
      std::cout << word << '\n';
    return 0;
  }
  // CLI11 takes the arguments in reverse order.
  std::vector<std::string> arguments(std::make_reverse_iterator(argv + argc),
                                     std::make_reverse_iterator(argv + 1));
  arguments.push_back(verb);
  try {
    program.parse(std::move(arguments));
  } catch (const CLI::ParseError& e) {
    return report_usage(program, e);
  } catch (const ConfigError& e) {
    std::cerr << printable(e.what(), "\n") << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << "mimesis: " << printable(e.what(), "\n") << '\n';
    return 1;
  }
  return exit_code;
}

std::string yaml_word(const std::string& text) {
  const bool plain = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) &&
                     std::ranges::all_of(text, [](unsigned char c) {
                       return std::isalnum(c) || c == '_' || c == '-' || c == '/' || c == '.';
                     });
  const bool word = text == "true" || text == "false" || text == "null" || text == "yes" ||
                    text == "no" || text == "on" || text == "off";
  return plain && !word ? text : nlohmann::json(text).dump();
}

}  // namespace mimesis::tool
