#include "nodes/crowd/crowd_params.h"

#include <fmt/format.h>

#include "common/error.h"
#include "nodes/crowd/scenario_file/scenario_file.h"

namespace mimesis::crowd {

void CrowdParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 1.0, 1000.0);
  v("offset_s", offset_s, 0.0, 1.0);
  v.file("scenario", scenario, "scenario, by name or file", false);
  v("set", set);
  v("until_s", until_s, 0.0, 1e6);
  v.group("trust", [this](runtime::ParamVisitor& g) {
    g("forget_s", trust.forget_s, 0.02, 600.0);
    g("return_s", trust.return_s, 0.0, 60.0);
    g("most_m_s", trust.most_m_s, 0.1, 100.0);
    g("slack_m", trust.slack_m, 0.0, 100.0);
  });
  v("scene_hz", scene_hz, 0.0, 100.0);
  v("threads", threads, 1, 256);
}

Scenario CrowdParams::read_scenario() const {
  std::vector<std::string> sets = set;
  sets.push_back(fmt::format("step_s={}", 1.0 / rate_hz));
  if (until_s > 0.0) sets.push_back(fmt::format("until_s={}", until_s));
  return crowd::read_scenario(find_scenario(scenario), sets);
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
