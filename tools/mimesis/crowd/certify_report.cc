#include "tools/mimesis/crowd/certify_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>
#include <utility>

#include "nodes/crowd/certificate/certificate.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using crowd::Certificate;
using crowd::Guarantee;
using crowd::RuleCertificate;
using crowd::Stage;
using Json = nlohmann::ordered_json;

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
  Table table({"rule", "guarantee", "rate >= 1/s", "expected 1/s", "a link lost", "lambda+",
               "lambda_max", "theorem 6", "largest N"});
  for (const auto& [name, r] : rules_of(c)) {
    if (r->guarantee == Guarantee::off) continue;
    const bool graph = r->extremes.most > 0.0;
    table.row({name, crowd::to_string(r->guarantee), number(r->guaranteed_1_s),
               number(r->expected_1_s), graph ? number(r->without_link_1_s) : "-",
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
  if (stage.formation_s) {
    out << "  formation stands after " << number(*stage.formation_s) << " s at the latest\n";
  }
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
      {"without_link_1_s", r.extremes.most > 0.0 ? Json(r.without_link_1_s) : Json(nullptr)},
      {"within", r.within > 0.0 ? Json(r.within) : Json(nullptr)},
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
  return {{"group", stage.group},
          {"from_s", stage.from_s},
          {"gait", stage.gait},
          {"agents", stage.agents},
          {"holds", c.holds()},
          {"rate_1_s", rate ? Json(*rate) : Json(nullptr)},
          {"formation_s", stage.formation_s ? Json(*stage.formation_s) : Json(nullptr)},
          {"residual_m", c.residual_m},
          {"rules", rules},
          {"notes", c.notes}};
}

bool all_hold(const std::vector<Stage>& stages) {
  return std::ranges::all_of(stages, [](const Stage& s) { return s.certificate.holds(); });
}

}  // namespace

bool print_certificates(const crowd::Scenario& scenario, std::ostream& out, bool colour) {
  const std::vector<Stage> stages = crowd::certify(scenario);
  print_stages(stages, out, colour);
  out << "most agents that rules I and II lead to their places without overshoot, by graph and "
         "gait (beta = g_min/g_max):\n";
  Table table({"largest N", "beta", "chain", "ring", "star", "wheel", "all_to_all"});
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
  out << (holds ? "every rule in force is guaranteed\n" : "NOT every rule is guaranteed\n");
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
  out << Json{{"file", file},
              {"name", scenario.name},
              {"holds", holds},
              {"stages", groups},
              {"largest_agents", limits}}
             .dump()
      << '\n';
  return holds;
}

}  // namespace mimesis::tool
