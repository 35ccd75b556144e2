#include "nodes/crowd/regions/far_crowd.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "common/error.h"
#include "common/time.h"

namespace mimesis::crowd {

namespace {

void check(const std::vector<double>& cuts, const std::string& axis) {
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    if (std::isfinite(cuts[i]) && (i == 0 || cuts[i] > cuts[i - 1])) continue;
    throw ConfigError("regions." + axis +
                      "_m: expected cuts in ascending order, each a finite number");
  }
}

int part_of(const std::vector<double>& cuts, double x) {
  return static_cast<int>(std::upper_bound(cuts.begin(), cuts.end(), x) - cuts.begin());
}

/// How far x is outside of part i of the line.
double outside(const std::vector<double>& cuts, int i, double x) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto k = static_cast<std::size_t>(i);
  const double low = k == 0 ? -kInfinity : cuts[k - 1];
  const double high = k == cuts.size() ? kInfinity : cuts[k];
  return std::max({low - x, x - high, 0.0});
}

AgentState later(AgentState state, double ahead_s) {
  if (ahead_s == 0.0) return state;
  state.position_W_m += ahead_s * state.velocity_W_m_s;
  if (std::isfinite(state.phase_rate_rad_s)) state.phase_rad += ahead_s * state.phase_rate_rad_s;
  return state;
}

GroupSums later(const FarSums& far, double ahead_s) {
  GroupSums sums = far.sums;
  if (ahead_s == 0.0 || sums.count == 0.0) return sums;
  const double turn = ahead_s * far.phase_rate_rad_s / sums.count;
  sums.cos_phase = far.sums.cos_phase * std::cos(turn) - far.sums.sin_phase * std::sin(turn);
  sums.sin_phase = far.sums.cos_phase * std::sin(turn) + far.sums.sin_phase * std::cos(turn);
  sums.error_m += ahead_s * far.speed_m_s;
  sums.leader_phase_rad += turn;
  return sums;
}

GroupSums sums_of_one(const ScenarioRun& run, const FarAgent& agent) {
  const Group& group = run.scenario().groups[static_cast<std::size_t>(agent.group)];
  const Eigen::Vector2d origin(group.origin_x_m, group.origin_y_m);
  const Eigen::Vector2d ahead(std::cos(group.heading_rad), std::sin(group.heading_rad));
  const AgentState& s = agent.state;
  return {
      .count = 1.0,
      .cos_phase = std::cos(s.phase_rad),
      .sin_phase = std::sin(s.phase_rad),
      .error_m = (s.position_W_m - origin).dot(ahead) - run.roster().start(agent.id).traits.place_m,
      .cos_heading = std::cos(s.heading_rad),
      .sin_heading = std::sin(s.heading_rad),
      .leader = agent.id,
      .leader_phase_rad = s.phase_rad};
}

}  // namespace

RegionMap::RegionMap(std::vector<double> cuts_x_m, std::vector<double> cuts_y_m)
    : cuts_x_(std::move(cuts_x_m)), cuts_y_(std::move(cuts_y_m)) {
  check(cuts_x_, "x");
  check(cuts_y_, "y");
}

int RegionMap::count() const {
  return static_cast<int>((cuts_x_.size() + 1) * (cuts_y_.size() + 1));
}

int RegionMap::of(const Eigen::Vector2d& p) const {
  return part_of(cuts_x_, p.x()) + static_cast<int>(cuts_x_.size() + 1) * part_of(cuts_y_, p.y());
}

double RegionMap::outside_m(int region, const Eigen::Vector2d& p) const {
  const int columns = static_cast<int>(cuts_x_.size()) + 1;
  return std::hypot(outside(cuts_x_, region % columns, p.x()),
                    outside(cuts_y_, region / columns, p.y()));
}

int RegionMap::heir(int region, const std::vector<bool>& there) const {
  const int columns = static_cast<int>(cuts_x_.size()) + 1;
  int best = region, least = std::numeric_limits<int>::max();
  for (int r = 0; r < count(); ++r) {
    const int away =
        std::abs(r % columns - region % columns) + std::abs(r / columns - region / columns);
    if (!there[static_cast<std::size_t>(r)] || away >= least) continue;
    best = r;
    least = away;
  }
  return best;
}

int RegionMap::owner(int region, const Eigen::Vector2d& p, double margin_m) const {
  return outside_m(region, p) > margin_m ? of(p) : region;
}

FarSums own_sums(const ScenarioRun& run, int group) {
  const Crowd& crowd = run.crowd();
  FarSums own{.group = group, .sums = crowd.sums(group)};
  const double direction = crowd.group(group).path.direction_rad;
  const double ahead_x = std::cos(direction), ahead_y = std::sin(direction);
  const Crowd::Rows rows = crowd.rows(group);
  for (int row = rows.first; row < rows.first + rows.count; ++row) {
    const auto r = static_cast<std::size_t>(row);
    const Role role = crowd.roles()[r];
    if (role != Role::own && role != Role::external) continue;
    const double rate = crowd.phase_rate_rad_s()[r];
    if (std::isfinite(rate)) own.phase_rate_rad_s += rate;
    own.speed_m_s += static_cast<double>(crowd.velocity_x_m_s()[r]) * ahead_x +
                     static_cast<double>(crowd.velocity_y_m_s()[r]) * ahead_y;
  }
  return own;
}

FarCrowd::FarCrowd(const FarSettings& settings, const ScenarioRun& run)
    : settings_(settings),
      reports_(static_cast<std::size_t>(settings.coordinators)),
      ran_(reports_.size(), false) {
  const Crowd& crowd = run.crowd();
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    const AgentId id = crowd.ids()[r];
    if (crowd.roles()[r] == Role::mirror) imported_[id] = {run.roster().home(id), Role::mirror, 0};
  }
}

void FarCrowd::hear(int coordinator, FarReport report) {
  const auto c = static_cast<std::size_t>(coordinator);
  if (report.stamp < reports_[c].stamp) return;
  if (report.time_s > 0.0) {
    ran_[c] = true;
  } else if (ran_[c]) {  // restarted: it does not have its initial agents
    report.agents.clear();
    report.sums.clear();
  }
  reports_[c] = std::move(report);
}

void FarCrowd::pass(const Traveller& traveller, int to, Time stamp) {
  const Agent& agent = traveller.agent;
  passing_.push_back(
      {{.id = agent.id, .group = traveller.group, .state = agent.state}, to, stamp, traveller});
}

std::optional<Traveller> FarCrowd::give(ScenarioRun& run, AgentId id, int to, Time stamp) {
  std::optional<Traveller> traveller = run.release(id);
  if (!traveller) return std::nullopt;
  imported_[id] = {traveller->group, Role::mirror, round_};
  pass(*traveller, to, stamp);
  return traveller;
}

void FarCrowd::take(ScenarioRun& run, Traveller traveller, Time stamp, Time now) {
  AgentState& state = traveller.agent.state;
  state = later(state, to_seconds(now - stamp));
  imported_.erase(traveller.agent.id);
  run.admit(traveller);
  since_[traveller.agent.id] = stamp;
}

std::vector<FarCrowd::Orphans> FarCrowd::take_orphans(const ScenarioRun& run, Time now) {
  std::vector<Orphans> silent;
  for (int c = 0; c < settings_.coordinators; ++c) {
    FarReport& report = reports_[static_cast<std::size_t>(c)];
    if (c == settings_.own || report.stamp == Time{} || heard(c, now)) continue;
    Orphans orphans{.coordinator = c, .agents = {}};
    const auto ours = [&](AgentId id) {
      return run.crowd().group_of(id).has_value() && !imported_.contains(id);
    };
    for (const FarAgent& agent : report.agents) {
      if (agent.external || ours(agent.id)) continue;
      orphans.agents.push_back(
          run.traveller(agent.id, agent.group, later(agent.state, to_seconds(now - report.stamp))));
    }
    for (const Passing& passing : passing_) {
      if (passing.to != c || ours(passing.agent.id)) continue;
      Traveller traveller = passing.traveller;
      traveller.agent.state = later(traveller.agent.state, to_seconds(now - passing.stamp));
      orphans.agents.push_back(traveller);
    }
    std::erase_if(passing_, [c](const Passing& p) { return p.to == c; });
    report = {};
    silent.push_back(std::move(orphans));
  }
  return silent;
}

void FarCrowd::adopt(ScenarioRun& run, const Traveller& traveller, Time now) {
  imported_.erase(traveller.agent.id);
  run.admit(traveller);
  since_[traveller.agent.id] = now;
}

void FarCrowd::abandon(ScenarioRun& run) {
  const std::vector<AgentId> ids(run.crowd().ids().begin(), run.crowd().ids().end());
  for (const AgentId id : ids) {
    const std::optional<Traveller> traveller = run.release(id);
    if (traveller) imported_[id] = {traveller->group, Role::mirror, round_};
  }
}

bool FarCrowd::heard(int coordinator, Time now) const {
  const Time stamp = reports_[static_cast<std::size_t>(coordinator)].stamp;
  return stamp != Time{} && to_seconds(now - stamp) <= settings_.stale_s;
}

/// Every agent that is moved elsewhere, once. Our own run knows better which agents it moves
/// itself.
void FarCrowd::collect(const ScenarioRun& run, Time now) {
  agents_.clear();
  const auto ours = [&](AgentId id) {
    return run.crowd().group_of(id).has_value() && !imported_.contains(id);
  };
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || !heard(c, now)) continue;
    const FarReport& report = reports_[static_cast<std::size_t>(c)];
    const double ahead_s = to_seconds(now - report.stamp);
    for (FarAgent agent : report.agents) {
      if (!run.roster().known(agent.id)) continue;
      if (ours(agent.id)) {
        const auto since = since_.find(agent.id);
        const bool newer = since == since_.end() || report.stamp > since->second;
        if (c > settings_.own || agent.external || !newer) continue;
        claimed_.push_back(agent.id);
      }
      agent.state = later(agent.state, ahead_s);
      agents_.push_back(agent);
    }
  }
  for (const Passing& passing : passing_) {
    if (ours(passing.agent.id)) continue;
    FarAgent agent = passing.agent;
    agent.state = later(agent.state, to_seconds(now - passing.stamp));
    agents_.push_back(agent);
  }
  std::ranges::stable_sort(agents_, {}, &FarAgent::id);
  const auto same = [](const FarAgent& a, const FarAgent& b) { return a.id == b.id; };
  agents_.erase(std::unique(agents_.begin(), agents_.end(), same), agents_.end());
}

void FarCrowd::add_sums(const ScenarioRun& run, Time now, std::vector<GroupSums>& sums) const {
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || !heard(c, now)) continue;
    const FarReport& report = reports_[static_cast<std::size_t>(c)];
    for (const FarSums& far : report.sums) {
      GroupSums& sum = sums[static_cast<std::size_t>(far.group)];
      sum = sum + later(far, to_seconds(now - report.stamp));
    }
  }
  for (const Passing& passing : passing_) {
    FarAgent agent = passing.agent;
    agent.state = later(agent.state, to_seconds(now - passing.stamp));
    GroupSums& sum = sums[static_cast<std::size_t>(agent.group)];
    sum = sum + sums_of_one(run, agent);
  }
}

/// Forgets passing agents that have arrived, or whose new coordinator never said so.
void FarCrowd::forget_arrived(Time now) {
  std::erase_if(passing_, [&](const Passing& p) {
    const FarReport& report = reports_[static_cast<std::size_t>(p.to)];
    return to_seconds(now - p.stamp) > settings_.stale_s ||
           std::ranges::find(report.agents, p.agent.id, &FarAgent::id) != report.agents.end();
  });
}

/// Squares of the plane as wide as the sight.
void FarCrowd::mark_cells(const Crowd& crowd) {
  cells_.clear();
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    if (crowd.roles()[r] != Role::own && crowd.roles()[r] != Role::external) continue;
    const auto ix = static_cast<std::int64_t>(std::floor(crowd.x_m()[r] / settings_.sight_m));
    const auto iy = static_cast<std::int64_t>(std::floor(crowd.y_m()[r] / settings_.sight_m));
    cells_.push_back((ix << 32) + iy);
  }
  std::ranges::sort(cells_);
  cells_.erase(std::unique(cells_.begin(), cells_.end()), cells_.end());
}

bool FarCrowd::near_ours(const Eigen::Vector2d& p) const {
  const auto ix = static_cast<std::int64_t>(std::floor(p.x() / settings_.sight_m));
  const auto iy = static_cast<std::int64_t>(std::floor(p.y() / settings_.sight_m));
  for (std::int64_t dx = -1; dx <= 1; ++dx) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      if (std::ranges::binary_search(cells_, ((ix + dx) << 32) + (iy + dy))) return true;
    }
  }
  return false;
}

Role FarCrowd::role_of(const FarAgent& agent, bool whole) const {
  const bool coupled = whole && agent.trusted;
  if (agent.external) return coupled ? Role::external : Role::seen;
  return coupled ? Role::mirror : Role::ghost;
}

std::string FarCrowd::import(ScenarioRun& run, Time now) {
  Crowd& crowd = run.crowd();
  ++round_;
  forget_arrived(now);
  claimed_.clear();
  collect(run, now);
  for (const AgentId id : claimed_) {
    const std::optional<Traveller> traveller = run.release(id);
    if (!traveller) continue;
    imported_[id] = {traveller->group, Role::mirror, round_};
    since_.erase(id);
  }
  mark_cells(crowd);
  joining_.resize(static_cast<std::size_t>(crowd.groups()));
  for (auto& joining : joining_) joining.clear();
  leaving_.clear();
  for (const FarAgent& agent : agents_) {
    if (run.whole(agent.group) || near_ours(agent.state.position_W_m)) import(run, agent);
  }
  for (auto known = imported_.begin(); known != imported_.end();) {
    const bool stays = known->second.round == round_;
    if (!stays) leaving_.push_back(known->first);
    known = stays ? std::next(known) : imported_.erase(known);
  }
  crowd.remove(leaving_);
  std::string trouble;
  for (std::size_t g = 0; g < joining_.size(); ++g) {
    try {
      if (!joining_[g].empty()) crowd.add(static_cast<int>(g), joining_[g]);
    } catch (const ConfigError& e) {
      for (const Agent& agent : joining_[g]) imported_.erase(agent.id);
      trouble = e.what();
    }
  }
  std::vector<GroupSums> sums(joining_.size());
  add_sums(run, now, sums);
  for (int g = 0; g < crowd.groups(); ++g) {
    run.set_outside(g, sums[static_cast<std::size_t>(g)]);
  }
  return trouble;
}

void FarCrowd::import(ScenarioRun& run, const FarAgent& agent) {
  Crowd& crowd = run.crowd();
  const Role role = role_of(agent, run.whole(agent.group));
  const auto known = imported_.find(agent.id);
  if (known != imported_.end() && known->second.group == agent.group) {
    known->second.round = round_;
    MIMESIS_ASSERT(crowd.set_state(agent.id, agent.state));
    if (known->second.role != role) MIMESIS_ASSERT(crowd.set_role(agent.id, role));
    known->second.role = role;
    return;
  }
  if (known != imported_.end()) leaving_.push_back(agent.id);
  Agent joining{.id = agent.id, .role = role, .state = agent.state};
  joining.traits = run.roster().start(agent.id).traits;
  joining_[static_cast<std::size_t>(agent.group)].push_back(joining);
  imported_[agent.id] = {agent.group, role, round_};
}

}  // namespace mimesis::crowd
