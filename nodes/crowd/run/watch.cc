#include "nodes/crowd/run/watch.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"

namespace mimesis::crowd {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// @param sway_m  how far sway takes walkers from their lanes; negative: lanes do not count
void measure_places(const Group& group, double sway_m, std::span<const Observed> agents,
                    GroupOrder& order) {
  const Eigen::Vector2d origin(group.origin_x_m, group.origin_y_m);
  const Eigen::Vector2d ahead(std::cos(group.heading_rad), std::sin(group.heading_rad));
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  const auto error = [&](const Observed& a) { return (a.p_W_m - origin).dot(ahead) - a.place_m; };
  double mean = 0.0, least = error(agents[0]), most = least;
  for (const Observed& a : agents) {
    mean += error(a) / static_cast<double>(agents.size());
    least = std::min(least, error(a));
    most = std::max(most, error(a));
  }
  order.errors.spacing_m = most - least;
  for (const Observed& a : agents) {
    const double across = sway_m < 0.0 ? 0.0 : std::abs((a.p_W_m - origin).dot(left) - a.lane_m);
    order.place_most_m =
        std::max(order.place_most_m, std::hypot(error(a) - mean, std::max(0.0, across - sway_m)));
  }
}

/// Distance of an agent from its lane as its certificate has it: √(ψ² + (ξ/Δz)²) of the angle ψ to
/// the lane's direction and the way ξ to it.
double lane_error(const Group& group, double ahead_m, const Observed& agent) {
  const Eigen::Vector2d from = agent.p_W_m - Eigen::Vector2d(group.origin_x_m, group.origin_y_m);
  const double across =
      from.y() * std::cos(group.heading_rad) - from.x() * std::sin(group.heading_rad);
  return std::hypot(math::wrap_pi(agent.heading_rad - group.heading_rad),
                    (across - agent.lane_m) / ahead_m);
}

/// Largest error of a heading in its rule; agents at their goals do not count.
double heading_error(const Group& group, const HeadingRule& rule, std::span<const double> headings,
                     std::span<const Observed> agents) {
  const HeadingKind kind = rule.kind;
  if (kind == HeadingKind::consensus || kind == HeadingKind::coupled) return spread(headings);
  if (kind == HeadingKind::keep) return kNan;
  double most = 0.0;
  for (const Observed& a : agents) {
    const Eigen::Vector2d way = a.next_W_m - a.p_W_m;
    const bool there = (a.goal_W_m - a.p_W_m).norm() <= group.goals.reached_m;
    if (kind == HeadingKind::goal && there) continue;
    most =
        std::max(most, kind == HeadingKind::lane
                           ? lane_error(group, rule.ahead_m, a)
                           : std::abs(math::wrap_pi(a.heading_rad - std::atan2(way.y(), way.x()))));
  }
  return most;
}

// Largest share of avoidance in the rate at which the rule reduces the error.
constexpr double kFree = 0.05;
constexpr double kNearLane_rad = 0.1;  // where sines are angles

constexpr double kLost = 10.0;  // times the tolerance: bodies are disturbed

std::size_t at(int i) { return static_cast<std::size_t>(i); }

bool hears_beat(const ScenarioRun& run, int group) {
  return run.scenario().groups[at(group)].beat_gain_1_s > 0.0;
}

bool has_zone(const Scenario& scenario, const std::string& group) {
  return std::ranges::any_of(scenario.zones, [&](const Zone& zone) {
    return zone.from == group || zone.from.empty() || zone.to == group;
  });
}

bool is_gate(const Scenario& scenario, int from, int to) {
  return std::ranges::any_of(scenario.zones, [&](const Zone& zone) {
    return zone.gather > 1 && zone.to == scenario.groups[at(to)].name &&
           (zone.from.empty() || zone.from == scenario.groups[at(from)].name);
  });
}

}  // namespace

GroupOrder Observer::measure(const Group& group, const Rules& rules,
                             std::span<const Observed> agents, std::optional<double> beat_rad,
                             double sway_m) {
  GroupOrder order;
  order.agents = static_cast<int>(agents.size());
  order.errors = {kNan, kNan, kNan, kNan, kNan};
  if (agents.empty()) return order;
  phases_.clear();
  headings_.clear();
  for (const Observed& a : agents) {
    phases_.push_back(a.phase_rad);
    headings_.push_back(a.heading_rad);
  }
  const bool led = rules.phase.leader_gain_1_s > 0.0, by_agent = led && !beat_rad;
  const std::span followers = std::span<const double>(phases_).subspan(by_agent ? 1 : 0);
  order.errors.dispersion = dispersion(followers);
  order.phase_most_rad = followers.empty() ? 0.0 : spread(followers);
  if (led) {
    const double leader = beat_rad.value_or(phases_[0]);
    order.errors.tracking_rad = 0.0;
    for (const double phase : followers) {
      order.errors.tracking_rad =
          std::max(order.errors.tracking_rad, std::abs(math::wrap_pi(phase - leader)));
    }
  }
  if (rules.phase.gain_1_s > 0.0 || led) {
    order.errors.phases_rad = 2.0 * order.phase_most_rad + (led ? order.errors.tracking_rad : 0.0);
  }
  order.errors.heading_rad = heading_error(group, rules.heading, headings_, agents);
  measure_places(group, rules.heading.kind == HeadingKind::lane ? sway_m : -1.0, agents, order);
  for (const Observed& a : agents) {
    order.goal_most_m = std::max(order.goal_most_m, (a.goal_W_m - a.p_W_m).norm());
  }
  return order;
}

Wanted wanted_of(const Group& group, const Rules& rules, bool passes) {
  if (passes) return {};
  const bool keeps_places = group.formation.shape != Shape::none &&
                            (rules.frequency.gain_rad_m_s != 0.0 || rules.length.gain_1_m != 0.0);
  const HeadingKind heading = rules.heading.kind;
  const bool endless = group.goals.aim == Aim::route && group.goals.loop;
  return {.phases = rules.phase.gain_1_s != 0.0,
          .leader = rules.phase.leader_gain_1_s != 0.0,
          .places = keeps_places,
          .headings = heading == HeadingKind::consensus || heading == HeadingKind::coupled,
          .goals = heading == HeadingKind::goal && group.goals.aim != Aim::none && !endless};
}

bool in_order(const Group& group, const Wanted& wanted, const GroupOrder& order, double formed_m) {
  if (order.agents == 0) return true;
  return (!wanted.phases || order.phase_most_rad <= kInOrder_rad) &&
         (!wanted.leader || order.errors.tracking_rad <= kInOrder_rad) &&
         (!wanted.places || order.place_most_m <= formed_m) &&
         (!wanted.headings || order.errors.heading_rad <= kInOrder_rad) &&
         (!wanted.goals || order.goal_most_m <= group.goals.reached_m);
}

void Closeness::observe(std::span<const Disc> discs) {
  before_.swap(overlapping_);
  double widest = 0.0, least_x = kInf, most_x = -kInf, least_y = kInf, most_y = -kInf;
  for (const Disc& d : discs) {
    widest = std::max(widest, d.radius_m);
    least_x = std::min(least_x, d.x_m), most_x = std::max(most_x, d.x_m);
    least_y = std::min(least_y, d.y_m), most_y = std::max(most_y, d.y_m);
  }
  // The nearest pair so far bounds how far apart a nearer one can be. At first the density does: of
  // N points in a box with diagonal D two are within 2 D/√N, and the least gap is no larger.
  const double across = discs.empty() ? 0.0 : std::hypot(most_x - least_x, most_y - least_y);
  const double size = static_cast<double>(std::max<std::size_t>(discs.size(), 1));
  const double dense = 2.0 * across / std::sqrt(size);
  const double nearer = std::max(2.0 * widest + std::max(least_gap_m_, 0.0), least_distance_m_);
  look(discs, std::max(1e-6, std::min(2.0 * widest + dense, nearer * (1.0 + 1e-12))));
  std::ranges::sort(overlapping_);
  for (const auto& pair : overlapping_) {
    collisions_ += std::ranges::binary_search(before_, pair) ? 0 : 1;
  }
}

/// All pairs that are within a distance, in cells as wide as that: lists in a hash table.
void Closeness::look(std::span<const Disc> discs, double reach_m) {
  constexpr std::int32_t kNone = -1;
  overlapping_.clear();
  cells_.resize(discs.size());
  next_.resize(discs.size());
  first_.assign(std::bit_ceil(discs.size() + 1), kNone);
  const auto cell_at = [&](double x) { return static_cast<std::int64_t>(std::floor(x / reach_m)); };
  const auto slot = [&](std::int64_t x, std::int64_t y) {
    const auto mixed = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U ^
                       static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FU;
    return static_cast<std::size_t>((mixed ^ mixed >> 29U) & (first_.size() - 1));
  };
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Disc& a = discs[i];
    const auto [cx, cy] = cells_[i] = {cell_at(a.x_m), cell_at(a.y_m)};
    for (std::int64_t x = cx - 1; x <= cx + 1; ++x) {
      for (std::int64_t y = cy - 1; y <= cy + 1; ++y) {
        for (std::int32_t k = first_[slot(x, y)]; k != kNone;
             k = next_[static_cast<std::size_t>(k)]) {
          const auto j = static_cast<std::size_t>(k);
          if (cells_[j].first == x && cells_[j].second == y) meet(a, discs[j]);
        }
      }
    }
    std::int32_t& first = first_[slot(cx, cy)];
    next_[i] = std::exchange(first, static_cast<std::int32_t>(i));
  }
}

void Closeness::meet(const Disc& a, const Disc& b) {
  const double distance = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
  const double gap = distance - a.radius_m - b.radius_m;
  least_distance_m_ = std::min(least_distance_m_, distance);
  least_gap_m_ = std::min(least_gap_m_, gap);
  if (gap < -slack_m_) overlapping_.emplace_back(std::min(a.id, b.id), std::max(a.id, b.id));
}

double turn_error(const Group& group, const HeadingRule& rule, const RuleCertificate& certificate,
                  const Observed& agent) {
  const bool to_goal = rule.kind == HeadingKind::goal;
  if (!to_goal && rule.kind != HeadingKind::lane) return kNan;
  const Eigen::Vector2d way = agent.next_W_m - agent.p_W_m;
  if (to_goal && way.norm() < certificate.beyond_m) return kNan;
  const double error =
      to_goal ? std::abs(math::wrap_pi(agent.heading_rad - std::atan2(way.y(), way.x())))
              : lane_error(group, rule.ahead_m, agent);
  if (!to_goal && error > kNearLane_rad) return kNan;
  const double rate_rad_s =
      to_goal ? rule.gain * std::sin(error) : certificate.guaranteed_1_s * error;
  if (!(std::abs(agent.avoid_rad_s) <= kFree * rate_rad_s)) return kNan;  // NaN too
  return to_goal ? 2.0 * std::tan(0.5 * error) : error;
}

namespace {
constexpr double kLeastAge_s = 0.02, kYounger_s = 5.0;
}

void measure_turns(Monitor& monitor, const Group& group, const HeadingRule& rule,
                   std::span<const Observed> agents, double t_s) {
  for (const Observed& a : agents) {
    monitor.turn(a.id, t_s, turn_error(group, rule, monitor.certificate().heading, a));
  }
}

Watch::Watch(const ScenarioRun& run) : groups_(run.scenario().groups.size()) {
  const Roster& roster = run.roster();
  last_group_.assign(at(roster.agents() + roster.externals() + 1), -1);
  std::vector<int> members(groups_.size(), 0);
  for (AgentId id = 1; id <= static_cast<AgentId>(roster.agents()); ++id) {
    ++members[at(roster.home(id))];
  }
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    groups_[g].passes = has_zone(run.scenario(), run.scenario().groups[g].name);
    certify(run, static_cast<int>(g), members[g], {});
  }
  number_ = 1;
  voided_.clear();
}

void Watch::certify(const ScenarioRun& run, int group, int agents, const std::string& why) {
  Kept& kept = groups_[at(group)];
  const Rules& rules = run.crowd().group(group).rules;
  const Group& described = run.scenario().groups[at(group)];
  kept.wanted = wanted_of(described, rules, kept.passes);
  const bool came = agents > kept.monitor.certificate().agents && !why.empty();
  kept.turned = kept.turned || kept.heading != HeadingKind::keep || came;
  kept.heading = rules.heading.kind;
  kept.monitor.certify(crowd::certify(run.scenario(), {.group = group,
                                                       .rules = rules,
                                                       .gait = run.gait(group),
                                                       .agents = agents,
                                                       .guests = kept.guests,
                                                       .age_s = kept.age_s,
                                                       .turned = kept.turned}));
  kept.expected.clear();
  kept.settled = {};
  if (why.empty()) return;
  ++number_;
  voided_ += (voided_.empty() ? "" : "; ") + ("group " + described.name + ": " + why);
}

std::string Watch::change_of(const ScenarioRun& run, int group, int agents) const {
  const Kept& kept = groups_[at(group)];
  const int before = kept.monitor.certificate().agents;
  const bool ruled = std::ranges::find(run.changed_groups(), group) != run.changed_groups().end();
  std::string why = ruled ? "its rules changed" : "";
  if (agents != before) {
    why += (why.empty() ? "" : ", ") + std::to_string(agents) + " agents instead of " +
           std::to_string(before);
  }
  if (!why.empty() && !kept.expected.empty()) why += ": " + kept.expected;
  return why;
}

/// A new certificate where states of agents from outside are older than in the last one, or have
/// not been half as old for some seconds: ages in powers of two.
std::string Watch::aged(Kept& kept, double time_s) const {
  double oldest = 0.0;
  for (const Observed& a : members_) {
    if (a.external) oldest = std::max(oldest, a.age_s);
  }
  const auto level = [](double age_s) {
    return age_s > 0.0
               ? kLeastAge_s * std::exp2(std::ceil(std::max(0.0, std::log2(age_s / kLeastAge_s))))
               : 0.0;
  };
  kept.older_s = std::max(kept.older_s, oldest);
  const double before = kept.age_s;
  if (oldest > kept.age_s) {
    kept.age_s = level(oldest);
  } else if (time_s - kept.seen_s > kYounger_s) {
    kept.age_s = level(kept.older_s);
  } else {
    return {};
  }
  kept.older_s = 0.0;
  kept.seen_s = time_s;
  if (kept.age_s == before) return {};
  return fmt::format("what is known of agents from outside is up to {:g} s old", kept.age_s);
}

void Watch::expect_change(int group, std::string reason) {
  std::string& expected = groups_[at(group)].expected;
  expected += (expected.empty() ? "" : ", ") + std::move(reason);
}

/// Phase error of an agent that comes through a gate into a group that hears the beat.
void Watch::greet(const ScenarioRun& run, const Observed& agent, double beat_rad) {
  int& last = last_group_[agent.id];
  const bool came = last >= 0 && last != agent.group && hears_beat(run, agent.group) &&
                    is_gate(run.scenario(), last, agent.group);
  if (came) {
    const double off = std::abs(math::wrap_pi(agent.phase_rad - beat_rad));
    ++entrances_.count;
    entrances_.wrong_foot += off > 0.5 * std::numbers::pi ? 1 : 0;
    entrances_.most_rad = std::max(entrances_.most_rad, off);
  }
  last = agent.group;
}

void Watch::observe(const ScenarioRun& run, double time_s, std::span<const Observed> everybody) {
  bool order = true;
  const double beat = run.beat_rad();
  std::size_t i = 0;
  for (int g = 0; g < static_cast<int>(groups_.size()); ++g) {
    members_.clear();
    for (; i < everybody.size() && everybody[i].group == g; ++i) {
      greet(run, everybody[i], beat);
      if (everybody[i].coupled) members_.push_back(everybody[i]);
    }
    groups_[at(g)].guests = static_cast<int>(std::ranges::count_if(members_, &Observed::external));
    std::string why = change_of(run, g, static_cast<int>(members_.size()));
    if (const std::string age = aged(groups_[at(g)], time_s); why.empty()) why = age;
    if (!why.empty()) certify(run, g, static_cast<int>(members_.size()), why);
    const Group& group = run.scenario().groups[at(g)];
    Kept& kept = groups_[at(g)];
    kept.order = observer_.measure(group, run.crowd().group(g).rules, members_,
                                   hears_beat(run, g) ? std::optional(beat) : std::nullopt,
                                   kept.monitor.certificate().sway_m);
    measure(run, g, time_s);
    order = order && crowd::in_order(group, kept.wanted, kept.order, run.scenario().formed_m);
  }
  if (!order) since_s_ = -1.0;
  if (order && since_s_ < 0.0) since_s_ = time_s;
}

void Watch::measure(const ScenarioRun& run, int group, double time_s) {
  Kept& kept = groups_[at(group)];
  GroupErrors errors = kept.order.errors;
  if (kept.guests > 0) {
    errors.phases_rad = kNan;  // of bodies it has no end
    const auto settle = [](bool& settled, double now, double tolerance, double& error) {
      settled = now < (settled ? kLost : 1.0) * tolerance;
      if (settled) error = std::numeric_limits<double>::quiet_NaN();
    };
    Settled& settled = kept.settled;
    settle(settled.phase, kept.order.phase_most_rad, 0.1 * kInOrder_rad, errors.dispersion);
    settle(settled.tracking, errors.tracking_rad, 0.1 * kInOrder_rad, errors.tracking_rad);
    settle(settled.spacing, errors.spacing_m, run.scenario().formed_m, errors.spacing_m);
    settle(settled.heading, errors.heading_rad, kInOrder_rad, errors.heading_rad);
  }
  const HeadingRule& heading = run.crowd().group(group).rules.heading;
  if (heading.avoid || kept.passes) {
    for (Observed& a : members_) {
      if (run.waiting(a.id)) a.avoid_rad_s = kNan;  // marks time, and goes nowhere
    }
    measure_turns(kept.monitor, run.scenario().groups[at(group)], heading, members_, time_s);
  }
  if (kept.passes && hears_beat(run, group)) {
    for (const Observed& a : members_) {
      kept.monitor.track(a.id, time_s, std::abs(math::wrap_pi(a.phase_rad - run.beat_rad())));
    }
  }
  kept.monitor.step(time_s, errors);
}

std::vector<RuleLine> Watch::lines() const {
  std::vector<RuleLine> lines;
  for (int g = 0; g < static_cast<int>(groups_.size()); ++g) {
    const Kept& kept = groups_[at(g)];
    const Certificate& c = kept.monitor.certificate();
    const MonitorReport report = kept.monitor.report();
    const GroupErrors& e = kept.order.errors;
    const auto add = [&](Rule rule, const RuleCertificate& rule_certificate, RuleReport measured,
                         double disorder) {
      if (rule_certificate.guarantee == Guarantee::off) return;
      if (c.agents == 0 && !kept.passes) return;  // otherwise the counts of agents that left stay
      lines.push_back({g, rule, rule_certificate, measured,
                       std::isfinite(disorder) ? disorder : 0.0, kept.guests});
      if (kept.guests == 0) return;
      lines.back().certificate.why +=
          fmt::format("; {} of {} agents come from outside and follow by laws of their own",
                      kept.guests, c.agents);
    };
    RuleReport by_frequency = report.spacing;
    if (c.length.guarantee != Guarantee::off) by_frequency.measured_1_s.reset();  // is of rule II
    add(Rule::frequency, c.frequency, by_frequency, e.spacing_m);
    add(Rule::length, c.length, report.spacing, e.spacing_m);
    add(Rule::phase, c.phase, report.phase, e.dispersion);
    add(Rule::tracking, c.tracking, report.tracking, e.tracking_rad);
    add(Rule::heading, c.heading, report.heading, e.heading_rad);
  }
  return lines;
}

std::optional<RuleLine> Watch::weakest() const {
  const std::vector<RuleLine> all = lines();
  const auto least = std::ranges::min_element(all, {}, [](const RuleLine& l) {
    // of equal rates, a measured one
    return std::pair(l.report.guaranteed_1_s, !l.report.measured_1_s);
  });
  return least == all.end() ? std::nullopt : std::optional(*least);
}

std::string Watch::take_voided() {
  std::string voided;
  voided.swap(voided_);
  return voided;
}

int Watch::agents(int group) const { return groups_[at(group)].monitor.certificate().agents; }

std::string Watch::disorder(const ScenarioRun& run) const {
  std::string text;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Kept& kept = groups_[g];
    const Group& group = run.scenario().groups[g];
    const GroupOrder& o = kept.order;
    if (crowd::in_order(group, kept.wanted, o, run.scenario().formed_m)) continue;
    const auto add = [&](bool wanted, double error, double tolerance, const char* what,
                         const char* unit) {
      if (!wanted || error <= tolerance) return;
      text += (text.empty() ? "" : ", ") + group.name +
              fmt::format(": {} {:.3g} of {:.3g} {}", what, error, tolerance, unit);
    };
    add(kept.wanted.phases, o.phase_most_rad, kInOrder_rad, "phases", "rad");
    add(kept.wanted.leader, o.errors.tracking_rad, kInOrder_rad, "phases to the leader", "rad");
    add(kept.wanted.places, o.place_most_m, run.scenario().formed_m, "places", "m");
    add(kept.wanted.headings, o.errors.heading_rad, kInOrder_rad, "headings", "rad");
    add(kept.wanted.goals, o.goal_most_m, group.goals.reached_m, "goals", "m");
  }
  return text;
}

double Watch::place_most_m() const {
  double most = 0.0;
  for (const Kept& kept : groups_) {
    if (kept.wanted.places) most = std::max(most, kept.order.place_most_m);
  }
  return most;
}

bool Watch::broken() const {
  return std::ranges::any_of(lines(), [](const RuleLine& line) {
    // Headings are measured while walkers are free; the others are of the group as a whole.
    const bool free = !line.certificate.while_free || line.rule == Rule::heading;
    return line.guests == 0 && free && line.report.broken();
  });
}

}  // namespace mimesis::crowd
