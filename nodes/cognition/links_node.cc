#include "nodes/cognition/links_node.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/error.h"

namespace mimesis::cognition {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "mimesis-links";
constexpr int kVersion = 1;

struct Named {
  const char* name;
  Connection connection;
};
constexpr std::array<Named, 4> kLearned = {{{"PF->PFC", Connection::pf_pfc},
                                            {"PFC->PF", Connection::pfc_pf},
                                            {"COL->PFC", Connection::color_pfc},
                                            {"PFC->COL", Connection::pfc_color}}};

Json constants(const FieldParams& p) {
  return {{"neurons", p.neurons},       {"dx", p.dx},
          {"slope", p.slope},           {"resting_level", p.resting_level},
          {"threshold1", p.threshold1}, {"threshold2", p.threshold2},
          {"excitation", p.excitation}, {"width", p.width},
          {"inhibition", p.inhibition}};
}

/// Columns with the weights between the first and the last that is not zero.
Json columns(const Link<float>& link, std::size_t neurons) {
  Json all = Json::array();
  for (std::size_t y = 0; y < neurons; ++y) {
    std::size_t first = 0, last = neurons;
    while (first < neurons && link.weight(first, y) == 0.0F) ++first;
    while (last > first && link.weight(last - 1, y) == 0.0F) --last;
    if (first == last) continue;
    Json column = {y, first};
    for (std::size_t x = first; x < last; ++x) column.push_back(link.weight(x, y));
    all.push_back(std::move(column));
  }
  return all;
}

void check(bool ok, const std::string& what) {
  if (!ok) throw ConfigError(what);
}

void read(const Json& file, Ladder<float>& ladder) {
  check(file.at("format") == kFormat, fmt::format("expected \"format\": \"{}\"", kFormat));
  check(file.at("version") == kVersion,
        fmt::format("is of version {}, expected {}", file.at("version").dump(), kVersion));
  const Json expected = constants(ladder.params().field);
  for (const auto& [key, ours] : expected.items()) {
    const Json& theirs = file.at("fields").at(key);
    check(theirs == ours, fmt::format("was learned with field.{} = {}, here it is {}", key,
                                      theirs.dump(), ours.dump()));
  }
  const auto neurons = static_cast<std::size_t>(ladder.params().field.neurons);
  check(file.at("links").size() == kLearned.size(),
        fmt::format("holds {} links, expected {}", file.at("links").size(), kLearned.size()));
  for (const auto& [name, connection] : kLearned) {
    ladder.cut(connection);
    for (const Json& column : file.at("links").at(name)) {
      const auto y = column.at(0).get<std::size_t>(), first = column.at(1).get<std::size_t>();
      check(y < neurons && first <= neurons && column.size() - 2 <= neurons - first,
            fmt::format("{} reaches beyond {} neurons", name, neurons));
      for (std::size_t i = 2; i < column.size(); ++i) {
        const auto weight = column[i].get<float>();
        check(std::isfinite(weight) && weight >= 0.0F,
              fmt::format("{} has the weight {}, expected finite and not negative", name, weight));
        ladder.set_weight(connection, first + i - 2, y, weight);
      }
    }
  }
}

}  // namespace

void save_links(const std::string& path, const Ladder<float>& ladder) {
  Json links;
  for (const auto& [name, connection] : kLearned) {
    links[name] =
        columns(ladder.link(connection), static_cast<std::size_t>(ladder.params().field.neurons));
  }
  const Json file = {{"format", kFormat},
                     {"version", kVersion},
                     {"fields", constants(ladder.params().field)},
                     {"links", links}};
  const std::string draft = path + ".new";  // who reads `path` meanwhile finds the old file whole
  std::ofstream out(draft);
  out << file.dump() << '\n';
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(draft, path, error);
  if (!out || error) throw std::runtime_error("cannot write the links to " + path);
}

void load_links(const std::string& path, Ladder<float>& ladder) {
  std::ifstream in(path);
  if (!in) throw ConfigError("cognition.links: cannot read " + path);
  try {
    read(Json::parse(in), ladder);
  } catch (const Json::exception& e) {
    throw ConfigError("cognition.links: " + path + " is no file of links: " + e.what());
  } catch (const ConfigError& e) {
    throw ConfigError("cognition.links: " + path + ": " + e.what());
  }
}

}  // namespace mimesis::cognition
