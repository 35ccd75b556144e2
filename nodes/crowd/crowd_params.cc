#include "nodes/crowd/crowd_params.h"

#include <fmt/format.h>

#include "common/error.h"
#include "nodes/crowd/scenario_file/scenario_file.h"

namespace mimesis::crowd {

namespace {

constexpr double kFarCut_m = 1e5;
constexpr double kClocks_s = 0.004;  // twice the largest offset between clocks of coordinators

}  // namespace

void CrowdParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 1.0, 1000.0);
  v("offset_s", offset_s, 0.0, 1.0);
  v.file("scenario", scenario, "scenario, by name or file", false);
  v("set", set);
  v("until_s", until_s, 0.0, 1e6);
  v.group("regions", [this](runtime::ParamVisitor& g) {
    g("own", regions.own, 1, 1024);
    g("x_m", regions.x_m, -kFarCut_m, kFarCut_m, 0);
    g("y_m", regions.y_m, -kFarCut_m, kFarCut_m, 0);
    g("sight_m", regions.sight_m, 0.5, 1000.0);
    g("stale_s", regions.stale_s, 0.02, 60.0);
  });
  v.group("trust", [this](runtime::ParamVisitor& g) {
    g("forget_s", trust.forget_s, 0.02, 600.0);
    g("return_s", trust.return_s, 0.0, 60.0);
    g("most_m_s", trust.most_m_s, 0.1, 100.0);
    g("slack_m", trust.slack_m, 0.0, 100.0);
  });
  v.group("robot", [this](runtime::ParamVisitor& g) {
    g("agent", robot.agent, -1, 1'000'000);
    g("step_s", robot.step_s, 0.1, 5.0);
  });
  v("first_character", first_character, 0, 1'000'000);
  v("scene_hz", scene_hz, 0.0, 100.0);
  v("threads", threads, 1, 256);
}

Scenario CrowdParams::read_scenario() const {
  std::vector<std::string> sets = set;
  sets.push_back(fmt::format("step_s={}", 1.0 / rate_hz));
  if (until_s > 0.0) sets.push_back(fmt::format("until_s={}", until_s));
  return crowd::read_scenario(find_scenario(scenario), sets);
}

FarSettings CrowdParams::far() const {
  const int count = regions.map().count();
  if (regions.own > count) {
    throw ConfigError(fmt::format("crowd.regions.own: {} of {} regions; the cuts make no more",
                                  regions.own, count));
  }
  return {.coordinators = count,
          .own = regions.own - 1,
          .sight_m = regions.sight_m,
          .stale_s = regions.stale_s,
          .slack_s = 1.0 / rate_hz + kClocks_s};
}

TrustSettings CrowdParams::trust_in(const Scenario& read) const {
  TrustSettings settings = trust;
  settings.stale_s = read.stale_s;
  if (settings.forget_s < settings.stale_s) {
    throw ConfigError("crowd.trust.forget_s: less than the scenario's stale_s");
  }
  return settings;
}

}  // namespace mimesis::crowd
