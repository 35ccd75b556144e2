#include "tools/mimesis/launch/section.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::launch {

void Mistakes::add(const runtime::Place& place, const std::string& what) {
  all_.push_back({place.line, place.column, to_string(place) + ": " + what});
}

void Mistakes::add_line(const runtime::Place& near, const std::string& line) {
  all_.push_back({near.line, near.column, line});
}

std::vector<std::string> Mistakes::lines() const {
  std::vector<Mistake> sorted = all_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Mistake& a, const Mistake& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  std::vector<std::string> lines;
  for (const Mistake& m : sorted) {
    if (std::find(lines.begin(), lines.end(), m.text) == lines.end()) lines.push_back(m.text);
  }
  return lines;
}

using runtime::Yaml;

Section::Section(const Yaml& map, const runtime::Variables& variables, Mistakes& mistakes)
    : map_(map), variables_(variables), mistakes_(mistakes) {
  if (map.kind != Yaml::Kind::empty) expect(map, Yaml::Kind::map, "a map");
}

bool Section::expect(const Yaml& value, Yaml::Kind kind, const std::string& expected) {
  if (value.kind == kind) return true;
  mistakes_.add(value.place, fmt::format("expected {}, found {}", expected, value.described()));
  return false;
}

const Yaml* Section::take(const std::string& key) {
  known_.push_back(key);
  return map_.find(key);
}

std::optional<Text> Section::expand(const Yaml& value, const std::string& expected) {
  if (!expect(value, Yaml::Kind::scalar, expected)) return std::nullopt;
  try {
    return Text{variables_.expand(value), value.place};
  } catch (const ConfigError& e) {
    mistakes_.add_line(value.place, e.what());
    return std::nullopt;
  }
}

std::optional<Text> Section::text(const std::string& key) {
  const Yaml* value = take(key);
  return value != nullptr ? expand(*value, key + " as text") : std::nullopt;
}

std::optional<std::string> Section::choice(const std::string& key,
                                           const std::vector<std::string>& choices) {
  const auto found = text(key);
  if (!found) return std::nullopt;
  if (std::find(choices.begin(), choices.end(), found->text) != choices.end()) return found->text;
  mistakes_.add(found->place,
                fmt::format("{}: expected one of {}, found '{}'{}", key, fmt::join(choices, ", "),
                            found->text, runtime::did_you_mean(found->text, choices)));
  return std::nullopt;
}

std::optional<bool> Section::flag(const std::string& key) {
  const auto found = text(key);
  if (!found) return std::nullopt;
  const bool inverted = found->text.starts_with('!');
  const auto value = runtime::to_bool(inverted ? found->text.substr(1) : found->text);
  if (value) return *value != inverted;
  mistakes_.add(found->place,
                fmt::format("{}: expected true or false, found '{}'", key, found->text));
  return std::nullopt;
}

std::optional<int> Section::whole(const std::string& key, int lo, int hi) {
  const auto found = text(key);
  if (!found) return std::nullopt;
  const auto value = runtime::to_int(found->text);
  if (value && *value >= lo && *value <= hi) return value;
  mistakes_.add(found->place, fmt::format("{}: expected a whole number in [{}, {}], found '{}'",
                                          key, lo, hi, found->text));
  return std::nullopt;
}

std::optional<double> Section::number(const std::string& key, double lo, double hi) {
  const auto found = text(key);
  if (!found) return std::nullopt;
  const auto value = runtime::to_double(found->text);
  if (value && *value >= lo && *value <= hi) return value;
  mistakes_.add(found->place, fmt::format("{}: expected a number in [{}, {}], found '{}'", key, lo,
                                          hi, found->text));
  return std::nullopt;
}

std::optional<std::chrono::nanoseconds> Section::duration(const std::string& key) {
  const auto found = text(key);
  if (!found) return std::nullopt;
  const auto value = runtime::to_duration(found->text);
  if (!value) {
    mistakes_.add(found->place, fmt::format("{}: expected a time such as 500ms or 2s, found '{}'",
                                            key, found->text));
  }
  return value;
}

std::vector<Text> Section::texts(const std::string& key) {
  std::vector<Text> all;
  const Yaml* list = take(key);
  if (list == nullptr || !expect(*list, Yaml::Kind::sequence, key + " as a list")) return all;
  for (const Yaml& item : list->items) {
    if (auto text = expand(item, "text")) all.push_back(std::move(*text));
  }
  return all;
}

std::vector<int> Section::wholes(const std::string& key, int lo, int hi) {
  std::vector<int> all;
  for (const Text& item : texts(key)) {
    const auto value = runtime::to_int(item.text);
    if (value && *value >= lo && *value <= hi) {
      all.push_back(*value);
    } else {
      mistakes_.add(item.place, fmt::format("{}: expected a whole number in [{}, {}], found '{}'",
                                            key, lo, hi, item.text));
    }
  }
  return all;
}

void Section::section(const std::string& key, const std::function<void(Section&)>& read) {
  const Yaml* map = take(key);
  if (map == nullptr || map->kind == Yaml::Kind::empty) return;
  Section inner(*map, variables_, mistakes_);
  if (map->kind != Yaml::Kind::map) return;
  read(inner);
  inner.finish();
}

void Section::entries(const std::string& key,
                      const std::function<void(const Text&, const Yaml&)>& read) {
  const Yaml* map = take(key);
  if (map == nullptr || map->kind == Yaml::Kind::empty) return;
  if (!expect(*map, Yaml::Kind::map, key + " as a map")) return;
  for (const Yaml::Entry& entry : map->entries) read({entry.key, entry.place}, entry.value);
}

void Section::finish() {
  for (const Yaml::Entry& entry : map_.entries) {
    if (std::find(known_.begin(), known_.end(), entry.key) == known_.end()) {
      mistakes_.add(entry.place,
                    "unknown key '" + entry.key + "'" + runtime::did_you_mean(entry.key, known_));
    }
  }
}

}  // namespace mimesis::launch
