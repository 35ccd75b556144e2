#include "nodes/cognition/network_file.h"

#include <array>
#include <memory>
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

}  // namespace mimesis::cognition
