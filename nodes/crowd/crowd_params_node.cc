#include "nodes/crowd/crowd_params_node.h"

#include <spdlog/fmt/fmt.h>

#include "common/error.h"
#include "nodes/crowd/scenario_file/scenario_file.h"

namespace mimesis::crowd {
namespace {

constexpr double kFar_m = 1e5;

}  // namespace

void RegionParams::visit(runtime::ParamVisitor& v) {
  v("own", own, 1, 1024);
  v("x_m", x_m, -kFar_m, kFar_m, 0);
  v("y_m", y_m, -kFar_m, kFar_m, 0);
  v("margin_m", margin_m, 0.0, 100.0);
  v("sight_m", sight_m, 0.5, 1000.0);
  v("stale_s", stale_s, 0.02, 60.0);
}

void RobotParams::visit(runtime::ParamVisitor& v) {
  v("agent", agent, -1, 1'000'000);
  v("step_s", step_s, 0.1, 5.0);
}

void CrowdParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 1.0, 1000.0);
  v("offset_s", offset_s, 0.0, 1.0);
  v("scenario", scenario);
  v("set", set);
  v("until_s", until_s, 0.0, 1e6);
  v.group("regions", [this](runtime::ParamVisitor& g) { regions.visit(g); });
  v.group("trust", [this](runtime::ParamVisitor& g) {
    g("forget_s", trust.forget_s, 0.02, 600.0);
    g("return_s", trust.return_s, 0.0, 60.0);
    g("most_m_s", trust.most_m_s, 0.1, 100.0);
    g("slack_m", trust.slack_m, 0.0, 100.0);
  });
  v.group("robot", [this](runtime::ParamVisitor& g) { robot.visit(g); });
  v("first_character", first_character, 0, 1'000'000);
  v("ahead_s", ahead_s, 0.0, 10.0);
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
          .stale_s = regions.stale_s};
}

}  // namespace mimesis::crowd
