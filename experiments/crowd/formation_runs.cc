#include "experiments/crowd/formation_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/circle.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

constexpr double kCrowdStep_s = 0.02, kSample_s = 0.1;

std::vector<Agent> agents_of(const FormationRun& run) {
  const auto from = starts(run.group, run.gait.eigenfrequency_rad_s, std::uint64_t(run.seed));
  const auto to = places(run.group);
  std::vector<Agent> agents;
  for (std::size_t i = 0; i < from.size(); ++i) {
    Agent a{.id = i + 1};
    a.state.position_W_m = from[i].p_W_m;
    a.state.heading_rad = from[i].heading_rad;
    a.state.phase_rad = from[i].phase_rad;
    a.traits.omega_rad_s = from[i].eigenfrequency_rad_s;
    a.traits.radius_m = run.group.radius_m;
    a.traits.place_m = to[i].place_m;
    a.traits.lane_m = to[i].lane_m;
    agents.push_back(a);
  }
  return agents;
}

/// The crowd and its measured quantities; the path is W's x axis.
class Watch {
 public:
  explicit Watch(const FormationRun& run)
      : crowd_(CrowdSettings{.dt_s = kCrowdStep_s}), agents_(agents_of(run)) {
    group_ = crowd_.add_group({run.stages.front().rules, run.gait.speed(), {}});
    crowd_.add(group_, agents_);
  }

  Crowd& crowd() { return crowd_; }
  int group() const { return group_; }

  FormationOutcome::Sample sample() const {
    double least = std::numeric_limits<double>::infinity(), most = -least, lane = 0.0;
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      const double off = crowd_.x_m()[i] - agents_[i].traits.place_m;
      least = std::min(least, off);
      most = std::max(most, off);
      lane = std::max(lane, std::abs(crowd_.y_m()[i] - agents_[i].traits.lane_m));
    }
    return {crowd_.time_s(), most - least, lane, dispersion(crowd_.phase_rad())};
  }

  Snapshot snapshot() const {
    Snapshot s;
    s.time_s = crowd_.time_s();
    s.z_m.assign(crowd_.x_m().begin(), crowd_.x_m().end());
    const double middle = reproduce::mean(s.z_m);
    for (double& z : s.z_m) z -= middle;
    s.lane_m.assign(crowd_.y_m().begin(), crowd_.y_m().end());
    s.heading_rad.assign(crowd_.heading_rad().begin(), crowd_.heading_rad().end());
    for (const double phi : crowd_.phase_rad()) s.phase_rad.push_back(math::wrap_two_pi(phi));
    return s;
  }

  double least_distance() const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      for (std::size_t j = i + 1; j < agents_.size(); ++j) {
        least = std::min(least, std::hypot(crowd_.x_m()[i] - crowd_.x_m()[j],
                                           crowd_.y_m()[i] - crowd_.y_m()[j]));
      }
    }
    return least;
  }

 private:
  Crowd crowd_;
  std::vector<Agent> agents_;
  int group_ = 0;
};

/// Reads the certificate of the last stage.
void certify(const FormationRun& run, FormationOutcome& out) {
  const Rules& rules = run.stages.back().rules;
  const GaitRange gait{run.gait.speed(), run.gait.eigenfrequency_rad_s, 0.0};
  const Certificate certificate = certify(rules, run.group.count, gait);
  out.expected_length_1_s = certificate.length.expected_1_s;
  out.expected_phase_1_s = certificate.phase.expected_1_s;
}

void judge(FormationOutcome& out) {
  RateFit length(1e-6, 1e-3), phase(1e-6, 1e-2);
  const auto since = [](bool is, double& from_s, double now_s) {
    from_s = !is ? FormationOutcome::kNone : std::isnan(from_s) ? now_s : from_s;
  };
  for (const auto& s : out.samples) {
    since(s.error_m <= kFormed_m && s.lane_error_m <= kFormed_m, out.formed_s, s.time_s);
    since(s.error_m <= kNear_m, out.near_s, s.time_s);
    length.add(s.time_s, s.error_m);
    phase.add(s.time_s, s.dispersion);
  }
  out.length_rate_1_s = length.rate_1_s().value_or(std::nan(""));
  out.phase_rate_1_s = phase.rate_1_s().value_or(std::nan(""));
}

}  // namespace

FormationOutcome run(const FormationRun& run) {
  Watch watch(run);
  FormationOutcome out;
  out.least_distance_m = std::numeric_limits<double>::infinity();
  std::size_t stage = 0;
  const auto steps = static_cast<int>(std::lround(run.until_s / kCrowdStep_s));
  const auto per_sample = static_cast<int>(std::lround(kSample_s / kCrowdStep_s));
  for (int n = 0; n <= steps; ++n) {
    while (stage < run.stages.size() && n * kCrowdStep_s >= run.stages[stage].at_s - 1e-9) {
      watch.crowd().set_rules(watch.group(), run.stages[stage].rules);
      out.snapshots.push_back(watch.snapshot());
      if (++stage == run.stages.size()) certify(run, out);
    }
    if (n % per_sample == 0) out.samples.push_back(watch.sample());
    if (n == steps) break;
    watch.crowd().step();
    if (run.stages[stage - 1].rules.heading.avoid) {
      out.overlapping += watch.crowd().contacts().overlapping;
      out.least_distance_m = std::min(out.least_distance_m, watch.least_distance());
    }
  }
  out.snapshots.push_back(watch.snapshot());
  judge(out);
  return out;
}

}  // namespace mimesis::crowd
