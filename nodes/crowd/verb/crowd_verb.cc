#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/json_text.h"
#include "common/motion/model/motion_model.h"
#include "common/runtime/param_source.h"
#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/scenario_file/scenario_file.h"
#include "nodes/crowd/verb/measured_gait.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using crowd::Certificate;
using crowd::Guarantee;
using crowd::MeasuredGait;
using crowd::RuleCertificate;
using crowd::Stage;
using Json = nlohmann::ordered_json;

struct CertifyOptions {
  std::string file;
  std::vector<std::string> sets;
  bool json = false;
};

struct GaitOptions {
  std::string model, style;
  int harmonics = crowd::SpeedFunction::kHarmonics;
  bool json = false;
};

// --- certify

std::array<std::pair<const char*, const RuleCertificate*>, 5> rules_of(const Certificate& c) {
  return {{{"I frequency", &c.frequency},
           {"II length", &c.length},
           {"III phase", &c.phase},
           {"III leader", &c.tracking},
           {"IV heading", &c.heading}}};
}

std::string number(double v) { return fmt::format("{:.4g}", v); }

std::string limit(const std::optional<int>& n) { return n ? std::to_string(*n) : "any"; }

void print_stage(const Stage& stage, std::ostream& out, bool colour) {
  const Certificate& c = stage.certificate;
  TextTable table({"rule", "guarantee", "rate >= 1/s", "expected 1/s", "a link lost", "lambda+",
                   "lambda_max", "theorem 6", "largest N"});
  for (const auto& [name, r] : rules_of(c)) {
    if (r->guarantee == Guarantee::off) continue;
    const bool graph = r->extremes.most > 0.0;
    table.row({name, r->while_free ? "while free" : crowd::to_string(r->guarantee),
               number(r->guaranteed_1_s), number(r->expected_1_s),
               graph && !r->extremes.directed ? number(r->without_link_1_s) : "-",
               graph ? number(r->extremes.least) : "-", graph ? number(r->extremes.most) : "-",
               r->theorem6 > 0.0 ? number(r->theorem6) : "-",
               graph && r->theorem6 > 0.0 ? limit(r->largest_agents) : "any"});
  }
  table.print(out, colour);
  for (const auto& [name, r] : rules_of(c)) {
    if (r->guarantee == Guarantee::off && stage.agents == 0) continue;
    if (!r->why.empty()) out << "  " << name << ": " << r->why << '\n';
    for (const std::string& change : r->change)
      out << "  " << name << ": change: " << change << '\n';
  }
  for (const std::string& note : c.notes) out << "  note: " << note << '\n';
  if (const auto rate = c.rate_1_s()) out << "  guaranteed: " << number(*rate) << " 1/s\n";
}

/// Groups with equal lines are printed together.
void print_stages(const std::vector<Stage>& stages, std::ostream& out, bool colour) {
  struct Said {
    std::vector<std::string> groups;
    std::string rest, body;
  };
  std::vector<Said> all;
  for (const Stage& stage : stages) {
    std::ostringstream body;
    print_stage(stage, body, colour);
    const std::string agents =
        stage.agents > 0 ? fmt::format("{} agents", stage.agents) : "nobody, others may come";
    const std::string rest =
        fmt::format(" from {:g} s: {}, gait {}\n", stage.from_s, agents, stage.gait);
    const auto same = std::ranges::find_if(
        all, [&](const Said& s) { return s.rest == rest && s.body == body.str(); });
    if (same == all.end()) {
      all.push_back({{stage.group}, rest, body.str()});
    } else {
      same->groups.push_back(stage.group);
    }
  }
  for (const Said& s : all) {
    out << (s.groups.size() > 1 ? "groups " : "group ")
        << fmt::format("{}", fmt::join(s.groups, ", ")) << s.rest << s.body;
  }
}

Json to_json(const char* name, const RuleCertificate& r) {
  Json out = {
      {"rule", name},
      {"guarantee", crowd::to_string(r.guarantee)},
      {"guaranteed_1_s", r.guaranteed_1_s},
      {"expected_1_s", r.expected_1_s},
      {"without_link_1_s",
       r.extremes.most > 0.0 && !r.extremes.directed ? Json(r.without_link_1_s) : Json(nullptr)},
      {"within", r.within > 0.0 ? Json(r.within) : Json(nullptr)},
      {"in_the_end", r.in_the_end},
      {"while_free", r.while_free},
      {"remains", std::isfinite(r.remains) ? Json(r.remains) : Json(nullptr)},
      {"overshoot", r.overshoot},
      {"connectivity", r.extremes.least},
      {"lambda_max", r.extremes.most},
      {"theorem6", r.theorem6 > 0.0 ? Json(r.theorem6) : Json(nullptr)},
      {"largest_agents", r.largest_agents ? Json(*r.largest_agents) : Json(nullptr)},
      {"why", r.why},
      {"change", r.change}};
  return out;
}

Json to_json(const Stage& stage) {
  const Certificate& c = stage.certificate;
  Json rules = Json::array();
  for (const auto& [name, r] : rules_of(c)) {
    if (r->guarantee != Guarantee::off || !r->why.empty()) rules.push_back(to_json(name, *r));
  }
  const auto rate = c.rate_1_s();
  return {{"group", stage.group}, {"from_s", stage.from_s},
          {"gait", stage.gait},   {"agents", stage.agents},
          {"holds", c.holds()},   {"rate_1_s", rate ? Json(*rate) : Json(nullptr)},
          {"rules", rules},       {"notes", c.notes}};
}

bool all_hold(const std::vector<Stage>& stages) {
  return std::ranges::all_of(stages, [](const Stage& s) { return s.certificate.holds(); });
}

/// What is guaranteed in every group and stage, at which rate, the largest N of each kind of graph,
/// and what to change. Returns whether every rule in force is guaranteed.
bool print_certificates(const crowd::Scenario& scenario, std::ostream& out, bool colour) {
  const std::vector<Stage> stages = crowd::certify(scenario);
  print_stages(stages, out, colour);
  out << "most agents that rules I and II lead to their places without overshoot, by graph and "
         "gait (beta = g_min/g_max):\n";
  TextTable table({"largest N", "beta", "chain", "ring", "star", "wheel", "all_to_all"});
  for (const crowd::Gait& gait : scenario.gaits) {
    const crowd::SpeedFunction g = gait.speed();
    for (const bool weak : {false, true}) {
      std::vector<std::string> cells{gait.name + (weak ? ", weak (B.14)" : ", theorem 6"),
                                     number(g.least() / g.most())};
      for (const crowd::TopologyLimit& l : crowd::topology_limits(g)) {
        cells.push_back(limit(weak ? l.weak : l.theorem6));
      }
      table.row(cells);
    }
  }
  table.print(out, colour);
  const bool holds = all_hold(stages);
  const bool free = std::ranges::any_of(stages, [](const Stage& s) {
    return std::ranges::any_of(rules_of(s.certificate),
                               [](const auto& rule) { return rule.second->while_free; });
  });
  out << (holds ? "every rule in force is guaranteed" : "NOT every rule is guaranteed")
      << (free ? ", but of `while free` nothing is said while others, walls or pillars are near\n"
               : "\n");
  return holds;
}

bool print_certificates_json(const std::string& file, const crowd::Scenario& scenario,
                             std::ostream& out) {
  const std::vector<Stage> stages = crowd::certify(scenario);
  Json groups = Json::array(), limits = Json::array();
  for (const Stage& stage : stages) groups.push_back(to_json(stage));
  for (const crowd::Gait& gait : scenario.gaits) {
    const crowd::SpeedFunction g = gait.speed();
    Json theorem6, weak;
    for (const crowd::TopologyLimit& l : crowd::topology_limits(g)) {
      const std::string name(crowd::to_string(l.topology));
      theorem6[name] = l.theorem6 ? Json(*l.theorem6) : Json(nullptr);
      weak[name] = l.weak ? Json(*l.weak) : Json(nullptr);
    }
    limits.push_back({{"gait", gait.name},
                      {"beta", g.least() / g.most()},
                      {"theorem6", theorem6},
                      {"weak", weak}});
  }
  const bool holds = all_hold(stages);
  out << json_text(Json{{"file", file},
                        {"name", scenario.name},
                        {"holds", holds},
                        {"stages", groups},
                        {"largest_agents", limits}})
      << '\n';
  return holds;
}

int certify(const CertifyOptions& o) {
  const std::string file = crowd::find_scenario(o.file);
  const crowd::Scenario scenario = crowd::read_scenario(file, o.sets);
  const bool holds = o.json ? print_certificates_json(file, scenario, std::cout)
                            : print_certificates(scenario, std::cout, use_colour(STDOUT_FILENO));
  return holds ? 0 : 1;
}

// --- gait

void print_yaml(const std::vector<MeasuredGait>& gaits) {
  std::cout << "gaits:\n";
  for (const MeasuredGait& m : gaits) {
    const crowd::Gait& g = m.gait;
    std::cout << fmt::format(
        "  - name: {}                  # {:.3f} m/s, steps of {:.3f} m\n"
        "    eigenfrequency_rad_s: {:.4f}\n"
        "    mean_m_rad: {:.5f}            # g in [{:.4f}, {:.4f}], {:.4f} rms not in the series\n"
        "    cosine_m_rad: [{:.5f}]\n"
        "    sine_m_rad: [{:.5f}]\n"
        "    sway_cosine: [{:.5f}]\n"
        "    sway_sine: [{:.5f}]\n",
        g.name, g.mean_m_rad * g.eigenfrequency_rad_s, m.step_length_m, g.eigenfrequency_rad_s,
        g.mean_m_rad, m.least_m_rad, m.most_m_rad, m.rms_m_rad, fmt::join(g.cosine_m_rad, ", "),
        fmt::join(g.sine_m_rad, ", "), fmt::join(g.sway_cosine, ", "),
        fmt::join(g.sway_sine, ", "));
  }
}

int gait(const GaitOptions& o) {
  const motion::MotionModel model = motion::load_motion_model(runtime::find_model_file(o.model));
  const std::vector<MeasuredGait> gaits = crowd::measure_gaits(model, o.style, o.harmonics);
  if (!o.json) {
    print_yaml(gaits);
    return 0;
  }
  Json list = Json::array();
  for (const MeasuredGait& m : gaits) {
    list.push_back({{"name", m.gait.name},
                    {"eigenfrequency_rad_s", m.gait.eigenfrequency_rad_s},
                    {"mean_m_rad", m.gait.mean_m_rad},
                    {"cosine_m_rad", m.gait.cosine_m_rad},
                    {"sine_m_rad", m.gait.sine_m_rad},
                    {"sway_cosine", m.gait.sway_cosine},
                    {"sway_sine", m.gait.sway_sine},
                    {"least_m_rad", m.least_m_rad},
                    {"most_m_rad", m.most_m_rad},
                    {"rms_m_rad", m.rms_m_rad},
                    {"step_length_m", m.step_length_m}});
  }
  std::cout << json_text(Json{{"model", model.name}, {"gaits", list}}) << '\n';
  return 0;
}

}  // namespace

void add_crowd(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("crowd", "Guarantees for crowds of walkers");
  verb->require_subcommand(1);

  auto certify_options = std::make_shared<CertifyOptions>();
  CLI::App* sub = verb->add_subcommand(
      "certify", "Guarantees of contraction theory for a scenario, and advice");
  sub->add_option("FILE", certify_options->file, "Scenario file, or its name in launch/crowd")
      ->required();
  sub->add_option("--set", certify_options->sets,
                  "Another value, KEY=VALUE: groups.0.count=25 (repeatable)")
      ->type_name("KEY=VALUE");
  sub->add_flag("--json", certify_options->json,
                "One object: file, name, holds, stages, largest_agents");
  sub->footer(
      "Exit codes: 0 every rule in force is guaranteed, 1 one is not, 2 the scenario is refused.\n"
      "Examples:\n  mimesis crowd certify formation\n"
      "  mimesis crowd certify launch/crowd/soldiers.yaml --set groups.0.count=40 --json");
  sub->callback([certify_options, &exit_code] { exit_code = certify(*certify_options); });

  auto gait_options = std::make_shared<GaitOptions>();
  sub = verb->add_subcommand(
      "gait",
      "Speed function g and sway g^psi of a motion model's styles, as scenario files write them");
  sub->add_option("MODEL", gait_options->model, "*.motion.json, here or in models/")->required();
  sub->add_option("--style", gait_options->style, "Only this style");
  sub->add_option("--harmonics", gait_options->harmonics, "Harmonics over a gait cycle")
      ->check(CLI::Range(0, crowd::SpeedFunction::kHarmonics))
      ->capture_default_str();
  sub->add_flag("--json", gait_options->json, "One object: model, gaits");
  sub->footer(
      "Exit codes: 0 done, 2 no such model or style, or g touches zero.\n"
      "Examples:\n  mimesis crowd gait walk.motion.json\n"
      "  mimesis crowd gait walk.motion.json --style walk --harmonics 2 --json");
  sub->callback([gait_options, &exit_code] { exit_code = gait(*gait_options); });
}

}  // namespace mimesis::tool
