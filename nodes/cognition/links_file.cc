#include "nodes/cognition/links_file.h"

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
constexpr int kVersion = 2;

/// Links that learn while the robot acts.
std::vector<const LinkSpec*> learned(const NetworkSpec& a) {
  std::vector<const LinkSpec*> all;
  for (const LinkSpec& link : a.links) {
    if (link.learns == "success" || link.learns == "always") all.push_back(&link);
  }
  return all;
}

Json constants(const FieldParams& p) {
  Json all = {{"neurons", p.neurons},
              {"rows", p.rows},
              {"dx", p.dx},
              {"slope", p.slope},
              {"resting_level", p.resting_level},
              {"threshold1", p.threshold1},
              {"threshold2", p.threshold2},
              {"excitation", p.excitation},
              {"width", p.width},
              {"inhibition", p.inhibition}};
  if (p.decay > 0.0) {
    all.update({{"tau_s", p.tau_s},
                {"decay", p.decay},
                {"decay_tau_s", p.decay_tau_s},
                {"decay_width", p.decay_width},
                {"decay_slope", p.decay_slope},
                {"decay_threshold", p.decay_threshold}});
  }
  return all;
}

/// Columns with the weights between the first and the last that is not zero.
Json columns(const Link<float>& link, std::size_t targets, std::size_t sources) {
  Json all = Json::array();
  for (std::size_t y = 0; y < sources; ++y) {
    std::size_t first = 0, last = targets;
    while (first < targets && link.weight(first, y) == 0.0F) ++first;
    while (last > first && link.weight(last - 1, y) == 0.0F) --last;
    if (first == last) continue;
    Json column = {y, first};
    for (std::size_t x = first; x < last; ++x) column.push_back(link.weight(x, y));
    all.push_back(std::move(column));
  }
  return all;
}

/// Constants of the fields that the learned links join.
Json fields(const NetworkSpec& a) {
  Json all = Json::object();
  for (const LinkSpec* link : learned(a)) {
    for (const std::string& name : {link->from, link->to}) {
      all[name] = constants(a.fields[a.field_index(name)].params);
    }
  }
  return all;
}

std::size_t neurons(const FieldNetwork<float>& network, const std::string& field) {
  return network.field(network.spec().field_index(field)).activity().size();
}

void check(bool ok, const std::string& what) {
  if (!ok) throw ConfigError(what);
}

void read(const Json& file, FieldNetwork<float>& network) {
  check(file.at("format") == kFormat, fmt::format("expected \"format\": \"{}\"", kFormat));
  check(file.at("version") == kVersion,
        fmt::format("is of version {}, expected {}", file.at("version").dump(), kVersion));
  const NetworkSpec& a = network.spec();
  const Json expected = fields(a);
  for (const auto& [field, ours] : expected.items()) {
    const Json& theirs = file.at("fields").at(field);
    for (const auto& [key, value] : ours.items()) {
      check(theirs.at(key) == value, fmt::format("was learned with {}.{} = {}, here it is {}",
                                                 field, key, theirs.at(key).dump(), value.dump()));
    }
  }
  const auto links = learned(a);
  check(file.at("links").size() == links.size(),
        fmt::format("holds {} links, expected {}", file.at("links").size(), links.size()));
  for (const LinkSpec* link : links) {
    const std::string name = link->name();
    const std::size_t targets = neurons(network, link->to), sources = neurons(network, link->from);
    network.cut(name);
    for (const Json& column : file.at("links").at(name)) {
      const auto y = column.at(0).get<std::size_t>(), first = column.at(1).get<std::size_t>();
      check(y < sources && first <= targets && column.size() - 2 <= targets - first,
            fmt::format("{} reaches beyond {} x {} neurons", name, sources, targets));
      for (std::size_t i = 2; i < column.size(); ++i) {
        const auto weight = column[i].get<float>();
        check(std::isfinite(weight) && weight >= 0.0F,
              fmt::format("{} has the weight {}, expected finite and not negative", name, weight));
        network.set_weight(name, first + i - 2, y, weight);
      }
    }
  }
}

void read(const Json& file, Bundles& bundles) {
  std::vector<Bundles::Bundle> all;
  for (const Json& b : file.at("bundles")) {
    const auto postures = b.at("postures").get<std::vector<std::vector<double>>>();
    check(!postures.empty(), "a bundle has no postures");
    const std::size_t joints = postures.front().size();
    Eigen::MatrixXd mean(joints, postures.size());
    for (std::size_t i = 0; i < postures.size(); ++i) {
      check(postures[i].size() == joints, "a bundle has postures of unlike size");
      mean.col(static_cast<Eigen::Index>(i)) =
          Eigen::VectorXd::Map(postures[i].data(), static_cast<Eigen::Index>(joints));
    }
    all.push_back({std::move(mean), b.at("motions").get<int>()});
  }
  check(all.size() <= bundles.most(),
        fmt::format("holds {} bundles, here is place for {}", all.size(), bundles.most()));
  bundles.restore(std::move(all));
}

}  // namespace

std::string links_text(const FieldNetwork<float>& network, const Bundles& bundles) {
  const NetworkSpec& a = network.spec();
  Json links = Json::object();
  for (const LinkSpec* link : learned(a)) {
    links[link->name()] = columns(network.link(link->name()), neurons(network, link->to),
                                  neurons(network, link->from));
  }
  Json file = {{"format", kFormat}, {"version", kVersion}, {"fields", fields(a)}, {"links", links}};
  if (bundles.most() > 0) {
    Json& all = file["bundles"] = Json::array();
    for (const Bundles::Bundle& b : bundles.all()) {
      Json postures = Json::array();
      for (const auto& q : b.mean.colwise())
        postures.emplace_back(Json(std::vector(q.begin(), q.end())));
      all.push_back({{"motions", b.motions}, {"postures", std::move(postures)}});
    }
  }
  return file.dump();
}

std::string save_links(const std::string& path, const std::string& text) {
  const std::string draft = path + ".new";  // who reads `path` meanwhile finds the old file whole
  std::ofstream out(draft);
  out << text << '\n';
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(draft, path, error);
  return !out || error ? "cannot write the links to " + path : "";
}

void load_links(const std::string& path, FieldNetwork<float>& network, Bundles* bundles) {
  std::ifstream in(path);
  if (!in) throw ConfigError("cognition.links: cannot read " + path);
  try {
    const Json file = Json::parse(in);
    read(file, network);
    if (bundles != nullptr && bundles->most() > 0) read(file, *bundles);
  } catch (const Json::exception& e) {
    throw ConfigError("cognition.links: " + path + " is no file of links: " + e.what());
  } catch (const ConfigError& e) {
    throw ConfigError("cognition.links: " + path + ": " + e.what());
  }
}

}  // namespace mimesis::cognition
