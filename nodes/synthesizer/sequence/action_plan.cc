#include "nodes/synthesizer/sequence/action_plan.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

namespace mimesis::synthesizer {
namespace {

constexpr double kRounding = 1e-6;  // m

double squared(double x) { return x * x; }

double discomfort(const StepRange& range, double length_m) {
  return squared((length_m - range.mean_m) / (0.5 * (range.most_m - range.least_m)));
}

// Steps of one kind and length each, and their cost.
struct Steps {
  int normal = 0, reaching = 0;
  double normal_m = 0.0, reaching_m = 0.0;
  double cost = std::numeric_limits<double>::infinity();
};

class Search {
 public:
  Search(const ActionRanges& ranges, const PlanSettings& settings) : r_(ranges), s_(settings) {}

  // The best steps from a boundary of actions at `distance` to a stand. `stands`: no step at all is
  // a possibility.
  std::optional<Steps> best(double distance, bool stands) const {
    std::optional<Steps> found;
    auto offer = [&](const std::optional<Steps>& steps) {
      if (steps && (!found || steps->cost < found->cost - 1e-9)) found = steps;
    };
    if (stands && may_stand(distance)) offer(Steps{.cost = stand_cost(distance)});
    for (int n = 0; n <= s_.most_normal; ++n)
      for (int m = 1; m <= s_.most_reaching; ++m) offer(steps(distance, n, m));
    return found;
  }

  bool may_stand(double distance) const {
    return distance >= nearest() - kRounding && distance <= farthest() + kRounding;
  }
  double stand_cost(double distance) const {
    return squared((distance - s_.final_distance_m) / s_.reach_margin_m);
  }
  double nearest() const { return r_.nearest_stand_m - s_.reach_margin_m; }
  double farthest() const { return r_.farthest_stand_m + s_.reach_margin_m; }

  std::vector<PlannedAction> spelled(const Steps& steps) const {
    std::vector<PlannedAction> plan;
    for (int i = 0; i < steps.normal; ++i)
      plan.push_back({kNormalStep, steps.normal_m, r_.normal.duration_s(steps.normal_m)});
    for (int i = 0; i < steps.reaching; ++i)
      plan.push_back({kReachingStep, steps.reaching_m, r_.reaching.duration_s(steps.reaching_m)});
    plan.push_back({kStanding, 0.0, r_.standing_s});
    return plan;
  }

  tl::unexpected<Status> unreachable(double distance) const {
    const char* why = distance < nearest() ? "that is too near, and steps back were not trained"
                      : distance > s_.most_normal * r_.normal.most_m
                          ? "that is farther than the longest plan"
                          : "no sequence of trained steps ends there";
    return tl::make_unexpected(
        Status{fmt::format("drawer {:.2f} m ahead: {}; expected to stand at {:.2f} to {:.2f} m",
                           distance, why, nearest(), farthest())});
  }

 private:
  // n normal and m shortened steps: by γ if that was trained, else as near to it as can be; the
  // final distance gives way last.
  std::optional<Steps> steps(double distance, int n, int m) const {
    auto clamp = [](const StepRange& range, double x) {
      return std::clamp(x, range.least_m, range.most_m);
    };
    const double way = distance - s_.final_distance_m, two = 2.0 * s_.gamma;
    Steps x{.normal = n, .reaching = m};
    // one shortened step takes 1 − 2γ where one cycle takes 2γ
    x.reaching_m = clamp(r_.reaching, way * (1.0 - two) / (two * n + (1.0 - two) * m));
    if (n > 0) x.normal_m = clamp(r_.normal, (way - m * x.reaching_m) / n);
    x.reaching_m = clamp(r_.reaching, (way - n * x.normal_m) / m);
    const double end = distance - n * x.normal_m - m * x.reaching_m;
    if (!may_stand(end)) return std::nullopt;
    x.cost = (n > 0 ? n * discomfort(r_.normal, x.normal_m) : 0.0) +
             m * discomfort(r_.reaching, x.reaching_m) + (m - 1) + stand_cost(end);
    return x;
  }

  const ActionRanges& r_;
  const PlanSettings& s_;
};

StepRange range_of(const mocap::Trials& trials, const char* action) {
  if (trials.trials.empty())
    throw ConfigError(std::string("drawer: no trials of the ") + action + ", expected some");
  StepRange r{.least_m = 1e9, .most_m = -1e9, .shortest_s = 1e9, .longest_s = -1e9};
  const auto n = static_cast<double>(trials.trials.size());
  for (const auto& t : trials.trials) {
    r.least_m = std::min(r.least_m, t.step_length_m);
    r.most_m = std::max(r.most_m, t.step_length_m);
    r.shortest_s = std::min(r.shortest_s, t.duration_s);
    r.longest_s = std::max(r.longest_s, t.duration_s);
    r.mean_m += t.step_length_m / n;
    r.duration_mean_s += t.duration_s / n;
  }
  double xx = 0.0, xy = 0.0;
  for (const auto& t : trials.trials) {
    xx += squared(t.step_length_m - r.mean_m);
    xy += (t.step_length_m - r.mean_m) * (t.duration_s - r.duration_mean_s);
  }
  r.duration_slope_s_m = xx > 0.0 ? xy / xx : 0.0;
  return r;
}

}  // namespace

double StepRange::duration_s(double length_m) const {
  return std::clamp(duration_mean_s + duration_slope_s_m * (length_m - mean_m), shortest_s,
                    longest_s);
}

bool StepRange::holds(double length_m) const {
  return length_m >= least_m - kRounding && length_m <= most_m + kRounding;
}

ActionRanges ranges_of(const std::array<mocap::Trials, kActions>& trials) {
  ActionRanges r;
  r.normal = range_of(trials[kNormalStep], "normal step");
  r.reaching = range_of(trials[kReachingStep], "reaching step");
  const auto& standing = trials[kStanding];
  r.standing_s = range_of(standing, "standing").duration_mean_s;
  r.nearest_stand_m = 1e9;
  for (const auto& t : standing.trials) {
    r.nearest_stand_m = std::min(r.nearest_stand_m, t.task.at(1));
    r.farthest_stand_m = std::max(r.farthest_stand_m, t.task.at(1));
  }
  return r;
}

tl::expected<std::vector<PlannedAction>, Status> plan_actions(double distance_m,
                                                              const ActionRanges& ranges,
                                                              const PlanSettings& settings) {
  const Search search(ranges, settings);
  if (const auto steps = search.best(distance_m, true)) return search.spelled(*steps);
  return search.unreachable(distance_m);
}

tl::expected<std::vector<PlannedAction>, Status> replan_actions(const Underway& now,
                                                                double distance_m,
                                                                const ActionRanges& ranges,
                                                                const PlanSettings& settings) {
  const Search search(ranges, settings);
  if (now.action == kStanding) {  // continues to stand, or to walk
    if (search.may_stand(distance_m)) return search.spelled(Steps{});
    if (const auto steps = search.best(distance_m, false)) return search.spelled(*steps);
    return search.unreachable(distance_m);
  }
  const bool normal = now.action == kNormalStep;
  const StepRange& range = normal ? ranges.normal : ranges.reaching;
  const double least = std::max(range.least_m, now.walked_m + (1.0 - now.share) * range.least_m);
  const double most = std::min(range.most_m, now.walked_m + (1.0 - now.share) * range.most_m);
  std::optional<Steps> found;
  double length = 0.0;
  auto offer = [&](double now_m) {
    // a normal cycle ends in full stride: a shortened step has to follow
    auto rest = search.best(distance_m - (now_m - now.walked_m), !normal);
    if (!rest) return;
    rest->cost += discomfort(range, now_m) + (!normal && rest->reaching > 0 ? 1.0 : 0.0);
    if (found && rest->cost >= found->cost - 1e-9) return;
    found = rest;
    length = now_m;
  };
  if (now.planned_length_m >= least && now.planned_length_m <= most) offer(now.planned_length_m);
  constexpr int kLengths = 200;
  for (int i = 0; i <= kLengths && most >= least; ++i) offer(least + (most - least) * i / kLengths);
  if (!found) return search.unreachable(distance_m);
  auto plan = search.spelled(*found);
  plan.insert(plan.begin(), {now.action, length, range.duration_s(length)});
  return plan;
}

}  // namespace mimesis::synthesizer
