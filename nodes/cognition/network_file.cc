#include "nodes/cognition/network_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::cognition {
namespace {

using runtime::ParamVisitor;

void visit(ParamVisitor& v, FieldParams& p) {
  v("neurons", p.neurons, 16, 4096);
  v("rows", p.rows, 1, 1024);
  v("dx", p.dx, 0.01, 100.0);
  v("tau_s", p.tau_s, 0.001, 10.0);
  v("resting_level", p.resting_level, -50.0, -0.01);
  v("slope", p.slope, 0.1, 50.0);
  v("threshold1", p.threshold1, -10.0, 10.0);
  v("threshold2", p.threshold2, -10.0, 10.0);
  v("excitation", p.excitation, 0.0, 100.0);
  v("width", p.width, 0.1, 100.0);
  v("inhibition", p.inhibition, -100.0, 100.0);
  v("decay", p.decay, 0.0, 100.0);
  v("decay_tau_s", p.decay_tau_s, 0.001, 10.0);
  v("decay_width", p.decay_width, 0.1, 100.0);
  v("decay_slope", p.decay_slope, 0.1, 50.0);
  v("decay_threshold", p.decay_threshold, -10.0, 10.0);
}

void visit(ParamVisitor& v, FieldSpec& f) {
  v("name", f.name);
  v("sites", f.sites);
  v("at", f.at, -1e6, 1e6, 0);
  visit(v, f.params);
}

void visit(ParamVisitor& v, LinkSpec& l) {
  v("from", l.from);
  v("to", l.to);
  v("gain", l.gain, 0.0, 50.0);
  v("form", l.form, {"dense", "low_rank", "gaussian"});
  v("learns", l.learns, {"never", "babbling", "success", "always"});
  v("initial", l.initial, 0.0, 10.0);
  v("pairs", l.pairs);
  v("width", l.width, 0.1, 100.0);
  v("along", l.along, {"x", "y"});
}

void visit(ParamVisitor& v, InputSpec& i) {
  v("name", i.name);
  v("into", i.into);
  v("gain", i.gain, 0.0, 50.0);
  v("sites", i.sites);
}

/// Items of the file, behind those of the spec that it extends.
template <class Spec>
void visit_list(ParamVisitor& v, std::string_view key, std::vector<Spec>& items,
                const Spec& fresh = {}) {
  const std::size_t before = items.size();
  v.elements(
      key, 0, [&](std::size_t n) { items.resize(before + n, fresh); },
      [&](ParamVisitor& g, std::size_t i) { visit(g, items[before + i]); });
}

NetworkSpec load(const std::string& file, int depth);

/// @param extended  the spec that this one extends
/// @param depth  files that extend this one
void visit(ParamVisitor& v, NetworkSpec& a, NetworkSpec& extended, int depth) {
  constexpr int kDeepest = 8;
  int version = 0;  // must be given
  std::string base;
  FieldSpec common;
  v("version", version, 1, 1);
  v.file("extends", base, "neural fields");
  if (depth > kDeepest) throw ConfigError(base + ": extends itself");
  if (!base.empty()) a = extended = load(base, depth + 1);
  v("dt_s", a.dt_s, 1e-5, 0.1);
  v.group("input", [&](ParamVisitor& g) {
    g("width", a.input_width, 0.1, 100.0);
    g("window_s", a.input_window_s, 0.001, 100.0);
  });
  v.group("learning", [&](ParamVisitor& g) {
    g("tau_s", a.learning.tau_s, 0.001, 1000.0);
    g("window_s", a.learning.window_s, 0.001, 1000.0);
    g("local_above", a.learning.local_above, -50.0, 50.0);
    g.group("shunted", [&](ParamVisitor& s) {
      s("tau_s", a.learning.shunted.tau_s, 0.001, 1000.0);
      s("alpha", a.learning.shunted.alpha, 1e-6, 100.0);
      s("beta", a.learning.shunted.beta, 0.0, 100.0);
      s("threshold", a.learning.shunted.threshold, -50.0, 50.0);
      s("slope", a.learning.shunted.slope, 0.1, 50.0);
    });
  });
  v.group("field", [&](ParamVisitor& g) { visit(g, common.params); });
  visit_list(v, "fields", a.fields, common);
  visit_list(v, "links", a.links);
  visit_list(v, "inputs", a.inputs);
  std::vector<std::string> babbling;
  v("babbling", babbling);
  a.babbling.insert(a.babbling.end(), babbling.begin(), babbling.end());
}

/// Where the value at a path was written: in the file, or in the one that it extends, whose items
/// come first.
std::string place_in(const runtime::ParamSource& source, const NetworkSpec& extended,
                     const std::string& path) {
  const std::array<std::pair<std::string_view, std::size_t>, 4> lists{
      {{"fields.", extended.fields.size()},
       {"links.", extended.links.size()},
       {"inputs.", extended.inputs.size()},
       {"babbling.", extended.babbling.size()}}};
  for (const auto& [list, before] : lists) {
    if (!path.starts_with(list) || before == 0) continue;
    std::size_t digits = 0;
    const std::size_t i = std::stoul(path.substr(list.size()), &digits);
    if (i < before) return extended.place(path);
    return runtime::to_string(source.place_of(std::string(list) + std::to_string(i - before) +
                                              path.substr(list.size() + digits)));
  }
  return runtime::to_string(source.place_of(path));
}

NetworkSpec load(const std::string& file, int depth) {
  const auto source = std::make_shared<runtime::ParamSource>(
      runtime::find_model_file(file), std::vector<std::string>{}, std::vector<std::string>{});
  NetworkSpec a;
  const auto extended = std::make_shared<NetworkSpec>();
  source->read("", [&](ParamVisitor& v) { visit(v, a, *extended, depth); });
  a.place = [=](const std::string& path) { return place_in(*source, *extended, path); };
  return a;
}

}  // namespace

NetworkSpec load_network(const std::string& file) { return load(file, 0); }

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
