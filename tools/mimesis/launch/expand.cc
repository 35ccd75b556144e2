#include "tools/mimesis/launch/expand.h"

#include <fmt/format.h>

#include <set>
#include <sstream>

namespace mimesis::launch {
namespace {

using runtime::Yaml;

struct Repetition {
  std::string name;
  std::vector<Text> values;
};

/// `for: {NAME: [a, b, c]}`, or one text with commas. Empty, with a mistake noted, if it is wrong.
std::optional<Repetition> read_for(const Yaml& value, const Written& around, Mistakes& mistakes) {
  if (value.kind != Yaml::Kind::map || value.entries.size() != 1) {
    mistakes.add(value.place, fmt::format("for: expected {{NAME: [VALUE, ...]}}, found {}",
                                          value.entries.size() > 1 ? "several names (put one `for` "
                                                                     "on a group around the node)"
                                                                   : value.described()));
    return std::nullopt;
  }
  const Yaml::Entry& entry = value.entries.front();
  Repetition all{entry.key, {}};
  const runtime::Variables& variables = around.variables;
  const bool taken = std::ranges::any_of(
      around.bound, [&](const auto& bound) { return bound.first == entry.key; });
  if (taken || variables.declares(entry.key)) {
    mistakes.add(entry.place,
                 fmt::format("for: '{}' is {} already, expected another name", entry.key,
                             taken ? "the name of a `for` around this" : "an argument"));
    return std::nullopt;
  }
  Section section(value, variables, mistakes);
  if (entry.value.kind == Yaml::Kind::scalar) {
    const auto text = section.text(entry.key);
    if (!text) return std::nullopt;
    std::istringstream in(text->text);
    for (std::string item; std::getline(in, item, ',');) {
      const std::size_t begin = std::min(item.find_first_not_of(' '), item.size());
      item = item.substr(begin, item.find_last_not_of(' ') + 1 - begin);
      if (!item.empty()) all.values.push_back({item, text->place});
    }
  } else {
    all.values = section.texts(entry.key);
  }
  std::set<std::string> once;
  std::erase_if(all.values, [&](const Text& item) {
    const bool again = !once.insert(item.text).second;
    if (again)
      mistakes.add(item.place, fmt::format("for: the value '{}' appears twice", item.text));
    return again;
  });
  return all;
}

}  // namespace

std::vector<Written> expand(const Yaml& map, const std::string& path, const Written& around,
                            bool named, Mistakes& mistakes) {
  std::vector<Written> all;
  for (const Yaml::Entry& entry : map.entries) {
    Yaml key;
    key.kind = Yaml::Kind::scalar;
    key.text = entry.key;
    key.place = entry.place;
    Written one{.name = {entry.key, entry.place},
                .map = &entry.value,
                .path = path + "." + entry.key,
                .bound = around.bound,
                .variables = around.variables};
    const auto add = [&] {
      for (const auto& [name, value] : one.bound) {
        const std::string reference = "${arg:" + name + "}";
        if (!named || entry.key.find(reference) != std::string::npos) continue;
        mistakes.add(entry.place,
                     fmt::format("'{}' is repeated by `for`, expected {} in its name, did you mean "
                                 "'{}{}'?",
                                 entry.key, reference, entry.key, reference));
        return false;
      }
      if (auto name = Section(map, one.variables, mistakes).expand(key, "a name")) {
        one.name = std::move(*name);
        all.push_back(one);
      }
      return true;
    };
    const Yaml* repeated = entry.value.find("for");
    if (repeated == nullptr) {
      add();
      continue;
    }
    const auto repetition = read_for(*repeated, around, mistakes);
    if (!repetition) continue;
    for (const Text& value : repetition->values) {
      one.bound = around.bound;
      one.bound.emplace_back(repetition->name, value.text);
      one.variables.bind(repetition->name, value.text);
      if (!add()) break;
    }
  }
  return all;
}

}  // namespace mimesis::launch
