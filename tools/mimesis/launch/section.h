#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "common/runtime/yaml_document.h"

namespace mimesis::launch {

/// Something that is wrong in a launch file, or, as a warning, that could not be looked at.
struct Mistake {
  runtime::Place near;  ///< orders the list
  std::string text;     ///< "file:line:col: what, expected what, did you mean 'what'?"
  bool warning = false;
};

/// All mistakes of a launch file: a check continues after the first one.
class Mistakes {
 public:
  void add(const runtime::Place& place, const std::string& what) {
    all_.push_back({place, to_string(place) + ": " + what});
  }
  void warn(const runtime::Place& place, const std::string& what) {
    all_.push_back({place, to_string(place) + ": " + what, true});
  }
  /// A line that has its place already (from a ConfigError, or from a node's own check).
  void add_line(const runtime::Place& near, const std::string& line) {
    all_.push_back({near, line});
  }
  std::size_t size() const { return all_.size(); }
  bool empty() const { return std::ranges::all_of(all_, &Mistake::warning); }
  /// In the order of the files, each once; those of no file are first.
  std::vector<Mistake> sorted() const {
    std::vector<Mistake> sorted = all_;
    const auto order = [this](const Mistake& m) {
      const auto first = std::ranges::find_if(
          all_, [&](const Mistake& other) { return other.near.file == m.near.file; });
      return std::tuple(m.near.line > 0 ? first - all_.begin() + 1 : 0, m.near.line, m.near.column);
    };
    std::ranges::stable_sort(sorted, {}, order);
    std::vector<Mistake> once;
    for (Mistake& m : sorted) {
      if (std::ranges::find(once, m.text, &Mistake::text) == once.end())
        once.push_back(std::move(m));
    }
    return once;
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines;
    for (const Mistake& m : sorted()) {
      if (!m.warning) lines.push_back(m.text);
    }
    return lines;
  }

 private:
  std::vector<Mistake> all_;
};

/// Text with the place it was written at.
struct Text {
  std::string text;
  runtime::Place place;

  bool operator==(const Text&) const = default;
};

/// Reads one map of a launch file: each value by its expected type, with variables replaced. Call
/// `finish` after reading all known keys; keys not read are unknown.
class Section {
 public:
  Section(const runtime::Yaml& map, const runtime::Variables& variables, Mistakes& mistakes)
      : map_(map), variables_(variables), mistakes_(mistakes) {
    if (map.kind != runtime::Yaml::Kind::empty) expect(map, runtime::Yaml::Kind::map, "a map");
  }

  bool has(const std::string& key) const { return map_.find(key) != nullptr; }
  /// Value of `key`, null if absent. The key counts as known.
  const runtime::Yaml* take(const std::string& key) {
    if (std::ranges::find(known_, key) == known_.end()) known_.push_back(key);
    return map_.find(key);
  }

  // Empty if the key is absent or, with a mistake noted, if the value is wrong.
  std::optional<Text> text(const std::string& key) {
    const runtime::Yaml* value = take(key);
    return value != nullptr ? expand(*value, key + " as text") : std::nullopt;
  }
  std::optional<std::string> choice(const std::string& key,
                                    const std::vector<std::string>& choices) {
    const auto found = text(key);
    if (!found) return std::nullopt;
    if (std::find(choices.begin(), choices.end(), found->text) != choices.end()) return found->text;
    mistakes_.add(found->place,
                  fmt::format("{}: expected one of {}, found '{}'{}", key, fmt::join(choices, ", "),
                              found->text, runtime::did_you_mean(found->text, choices)));
    return std::nullopt;
  }
  /// Also "!true", for `if: "!${arg:sim}"`.
  std::optional<bool> flag(const std::string& key) {
    return parsed(key, "true or false",
                  [](const std::string& text) { return runtime::to_condition(text); });
  }
  std::optional<int> whole(const std::string& key, int lo, int hi) {
    return parsed(key, fmt::format("a whole number in [{}, {}]", lo, hi),
                  [&](const std::string& text) { return within(runtime::to_int(text), lo, hi); });
  }
  std::optional<double> number(const std::string& key, double lo, double hi) {
    return parsed(key, fmt::format("a number in [{}, {}]", lo, hi), [&](const std::string& text) {
      return within(runtime::to_double(text), lo, hi);
    });
  }
  std::optional<std::chrono::nanoseconds> duration(const std::string& key) {
    return parsed(key, "a time such as 500ms or 2s",
                  [](const std::string& text) { return runtime::to_duration(text); });
  }
  /// A list.
  std::vector<Text> texts(const std::string& key) {
    std::vector<Text> all;
    const runtime::Yaml* list = take(key);
    if (list == nullptr || !expect(*list, runtime::Yaml::Kind::sequence, key + " as a list"))
      return all;
    for (const runtime::Yaml& item : list->items) {
      if (auto text = expand(item, "text")) all.push_back(std::move(*text));
    }
    return all;
  }
  std::vector<int> wholes(const std::string& key, int lo, int hi) {
    std::vector<int> all;
    for (const Text& item : texts(key)) {
      if (const auto value = within(runtime::to_int(item.text), lo, hi)) {
        all.push_back(*value);
      } else {
        mistakes_.add(item.place, fmt::format("{}: expected a whole number in [{}, {}], found '{}'",
                                              key, lo, hi, item.text));
      }
    }
    return all;
  }

  /// A nested section; nothing happens if it is absent.
  void section(const std::string& key, const std::function<void(Section&)>& read) {
    const runtime::Yaml* map = take(key);
    if (map == nullptr || map->kind == runtime::Yaml::Kind::empty) return;
    Section inner(*map, variables_, mistakes_);
    if (map->kind != runtime::Yaml::Kind::map) return;
    read(inner);
    inner.finish();
  }
  /// Each entry of a map with free keys.
  void entries(const std::string& key,
               const std::function<void(const Text&, const runtime::Yaml&)>& read) {
    const runtime::Yaml* map = take(key);
    if (map == nullptr || map->kind == runtime::Yaml::Kind::empty) return;
    if (!expect(*map, runtime::Yaml::Kind::map, key + " as a map")) return;
    for (const runtime::Yaml::Entry& entry : map->entries)
      read({entry.key, entry.place}, entry.value);
  }

  void finish() {
    for (const runtime::Yaml::Entry& entry : map_.entries) {
      if (std::ranges::find(known_, entry.key) != known_.end()) continue;
      std::string hint = runtime::did_you_mean(entry.key, known_);
      if (hint.empty()) hint = fmt::format(", expected one of {}", fmt::join(known_, ", "));
      mistakes_.add(entry.place, "unknown key '" + entry.key + "'" + hint);
    }
  }

  std::optional<Text> expand(const runtime::Yaml& value, const std::string& expected) {
    if (!expect(value, runtime::Yaml::Kind::scalar, expected)) return std::nullopt;
    try {
      return Text{variables_.expand(value), value.place};
    } catch (const ConfigError& e) {
      mistakes_.add_line(value.place, e.what());
      return std::nullopt;
    }
  }
  Mistakes& mistakes() { return mistakes_; }
  const runtime::Variables& variables() const { return variables_; }
  const runtime::Place& place() const { return map_.place; }

 private:
  /// `parse` of the text at `key`; a mistake if that is nothing.
  template <class Parse>
  auto parsed(const std::string& key, const std::string& expected, const Parse& parse)
      -> decltype(parse(key)) {
    const auto found = text(key);
    if (!found) return std::nullopt;
    const auto value = parse(found->text);
    if (!value) {
      mistakes_.add(found->place,
                    fmt::format("{}: expected {}, found '{}'", key, expected, found->text));
    }
    return value;
  }

  template <class T>
  static std::optional<T> within(std::optional<T> value, T lo, T hi) {
    return value && *value >= lo && *value <= hi ? value : std::nullopt;
  }

  bool expect(const runtime::Yaml& value, runtime::Yaml::Kind kind, const std::string& expected) {
    if (value.kind == kind) return true;
    mistakes_.add(value.place, fmt::format("expected {}, found {}", expected, value.described()));
    return false;
  }

  const runtime::Yaml& map_;
  const runtime::Variables& variables_;
  Mistakes& mistakes_;
  std::vector<std::string> known_;
};

}  // namespace mimesis::launch
