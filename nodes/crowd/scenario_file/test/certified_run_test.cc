// Scenarios of launch/crowd in the engine: what their certificates promise happens.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/math/circle.h"
#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/certificate/monitor.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/scenario/scenario.h"
#include "nodes/crowd/scenario_file/scenario_file.h"

namespace mimesis::crowd {
namespace {

/// The first group of a scenario, without what comes later.
class GroupRun {
 public:
  explicit GroupRun(const Scenario& scenario)
      : scenario_(scenario),
        group_(scenario.groups.at(0)),
        crowd_({.dt_s = scenario.step_s}),
        stage_(certify(scenario).at(0)) {
    const Gait& gait = *scenario.gait(group_.gait);
    crowd_.add_group({.rules = group_.rules,
                      .gait = gait.speed(),
                      .path = {{group_.origin_x_m, group_.origin_y_m}, group_.heading_rad}});
    const auto begin =
        starts(group_, gait.eigenfrequency_rad_s, static_cast<unsigned>(scenario.seed));
    const auto wished = places(group_);
    std::vector<Agent> agents(begin.size());
    for (std::size_t i = 0; i < begin.size(); ++i) {
      Agent& a = agents[i];
      a.id = i + 1;
      a.state.position_W_m = begin[i].p_W_m;
      a.state.heading_rad = begin[i].heading_rad;
      a.state.phase_rad = begin[i].phase_rad;
      a.traits.omega_rad_s = begin[i].eigenfrequency_rad_s;
      a.traits.radius_m = group_.radius_m;
      a.traits.place_m = wished[i].place_m;
      a.traits.lane_m = wished[i].lane_m;
    }
    crowd_.add(0, agents);
    errors_.resize(begin.size());
    monitor_.certify(stage_.certificate);
  }

  void step() {
    crowd_.step();
    const auto phases = crowd_.phase_rad();
    const bool led = group_.rules.phase.leader_gain_1_s > 0.0;
    crowd_.spacing(0, errors_);
    const auto [least, most] = std::ranges::minmax(errors_);
    GroupErrors e;
    e.dispersion = dispersion(phases.subspan(led ? 1 : 0));
    e.tracking_rad = 0.0;
    for (const double phi : phases) {
      e.tracking_rad = std::max(e.tracking_rad, std::abs(math::wrap_pi(phi - phases[0])));
    }
    e.spacing_m = apart_m_ = most - least;
    e.heading_rad = std::nan("");
    monitor_.step(crowd_.time_s(), e);
  }
  void run_until(double t_s) {
    while (crowd_.time_s() < t_s) step();
  }

  const Stage& stage() const { return stage_; }
  double apart_m() const { return apart_m_; }
  double dispersion_now() const { return dispersion(crowd_.phase_rad()); }
  MonitorReport report() const { return monitor_.report(); }
  double least_gap_m() const {
    double least = 1e9;
    const auto x = crowd_.x_m(), y = crowd_.y_m();
    for (std::size_t i = 0; i < x.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        least = std::min(least, std::hypot(x[i] - x[j], y[i] - y[j]));
    }
    return least - 2.0 * group_.radius_m;
  }

 private:
  Scenario scenario_;
  Group group_;
  Crowd crowd_;
  Stage stage_;
  Monitor monitor_;
  std::vector<double> errors_;
  double apart_m_ = 0.0;
};

TEST(CertifiedRun, SoldiersFallIntoStepAtTheirRate) {
  for (const char* seed : {"seed=1", "seed=2", "seed=3"}) {
    GroupRun run(read_scenario(find_scenario("soldiers"), {seed}));
    run.run_until(25.0);
    const RuleReport phase = run.report().phase;
    ASSERT_TRUE(phase.measured_1_s) << seed;
    EXPECT_NEAR(*phase.measured_1_s, phase.guaranteed_1_s, 0.01 * phase.guaranteed_1_s) << seed;
    EXPECT_FALSE(phase.broken());
  }
}

TEST(CertifiedRun, NobodyTouchesAnybodyOnTheWayIntoStep) {
  for (const char* name : {"soldiers", "leader"}) {
    for (int seed = 1; seed <= 20; ++seed) {
      GroupRun run(read_scenario(find_scenario(name), {"seed=" + std::to_string(seed)}));
      double least_m = 1e9;
      for (int i = 0; i < 750; ++i) {
        run.step();
        least_m = std::min(least_m, run.least_gap_m());
      }
      EXPECT_GT(least_m, 0.0) << name << ", seed " << seed;
    }
  }
}

TEST(CertifiedRun, FollowersAgreeAndComeToTheirLeader) {
  GroupRun run(read_scenario(find_scenario("leader")));
  run.run_until(30.0);
  const MonitorReport report = run.report();
  EXPECT_NEAR(report.phase.measured_1_s.value(), 0.1 * 8 + 0.6, 0.02 * 1.4);
  EXPECT_NEAR(report.tracking.measured_1_s.value(), 0.6, 0.02 * 0.6);
}

TEST(CertifiedRun, FormationsStandNoSlowerThanCertified) {
  for (const char* graph : {"all_to_all", "ring", "star"}) {
    const std::string word(graph);
    const Scenario scenario =
        read_scenario(find_scenario("formation"),
                      {"groups.0.rules.length.graph=" + word, "groups.0.rules.phase.graph=" + word,
                       "groups.0.rules.length.gain_1_m=0.3", "groups.0.rules.phase.gain_1_s=1.5"});
    GroupRun run(scenario);
    run.run_until(150.0);
    EXPECT_LE(run.apart_m(), 0.01)
        << graph << " at " << run.stage().certificate.length.guaranteed_1_s;
    EXPECT_LT(run.dispersion_now(), 1e-3) << graph;
    const RuleReport spacing = run.report().spacing;
    EXPECT_FALSE(spacing.broken()) << *spacing.measured_1_s << " < " << spacing.guaranteed_1_s;
  }
}

std::string not_arrived(const Crowd& crowd) {
  std::string who;
  for (int row = 0; row < crowd.size(); ++row) {
    const Agent a = crowd.agent(row);
    if ((a.state.position_W_m - a.traits.goal_W_m).norm() < 0.5) continue;
    who += std::to_string(a.id) + " at " + std::to_string(a.state.position_W_m.x()) + ", " +
           std::to_string(a.state.position_W_m.y()) + "; ";
  }
  return who;
}

TEST(Pillars, AllArriveFromEverySeed) {
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scenario scenario =
        read_scenario(find_scenario("pillars"), {"seed=" + std::to_string(seed)});
    ScenarioRun run(scenario);
    while (run.time_s() < scenario.until_s) {
      run.step();
      ASSERT_EQ(run.crowd().contacts().overlapping, 0) << run.time_s();
    }
    EXPECT_EQ(not_arrived(run.crowd()), "");
  }
}
}  // namespace
}  // namespace mimesis::crowd
