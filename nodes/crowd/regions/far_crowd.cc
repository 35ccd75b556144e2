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

GroupSums sums_of_one(const ScenarioRun& run, const Traveller& traveller) {
  const Group& group = run.scenario().groups[static_cast<std::size_t>(traveller.group)];
  const Agent& agent = traveller.agent;
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

namespace {

std::vector<AgentId> own_agents(const Crowd& crowd) {
  std::vector<AgentId> own;
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    if (crowd.roles()[r] == Role::own) own.push_back(crowd.ids()[r]);
  }
  return own;
}

}  // namespace

FarCrowd::FarCrowd(const FarSettings& settings, const ScenarioRun& run)
    : settings_(settings),
      ownership_({.coordinators = settings.coordinators,
                  .own = settings.own,
                  .stale = from_seconds(settings.stale_s),
                  .slack = from_seconds(settings.slack_s)},
                 run.roster().agents(), own_agents(run.crowd())),
      reports_(static_cast<std::size_t>(settings.coordinators)) {
  const Crowd& crowd = run.crowd();
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    const AgentId id = crowd.ids()[r];
    if (crowd.roles()[r] == Role::mirror) imported_[id] = {run.roster().home(id), Role::mirror, 0};
  }
}

void FarCrowd::begin_step(ScenarioRun& run, Time now) {
  const bool first = life_ == Time{};
  ownership_.begin_step(now);
  if (first) life_ = ownership_.since();
  follow(run);
}

/// A new life of ours owns nothing. Where our agents stand nobody else may know.
void FarCrowd::follow(ScenarioRun& run) {
  if (life_ == ownership_.since()) return;
  life_ = ownership_.since();
  for (const AgentId id : own_agents(run.crowd())) {
    const std::optional<Traveller> traveller = run.release(id);
    imported_[id] = {traveller->group, Role::mirror, round_};
    agents_.push_back({.id = id, .group = traveller->group, .state = traveller->agent.state});
  }
  std::ranges::sort(agents_, {}, &FarAgent::id);
  std::erase_if(passing_, [this](const Passing& p) { return p.offer.from == settings_.own; });
}

void FarCrowd::hear(int coordinator, FarReport report) {
  const auto c = static_cast<std::size_t>(coordinator);
  if (report.stamp < reports_[c].stamp) return;
  if (!report.ownership.heard.empty()) ownership_.hear(report.ownership);
  reports_[c] = std::move(report);
}

void FarCrowd::admit(ScenarioRun& run, const Traveller& traveller) {
  imported_.erase(traveller.agent.id);
  run.admit(traveller);
}

bool FarCrowd::hear(ScenarioRun& run, const Passing& passing, Time state_time) {
  follow(run);
  const AgentId id = passing.offer.claim.id;
  if (passing.offer.to == settings_.own) {
    if (!ownership_.acceptable(passing.offer)) return false;
    Traveller traveller = passing.traveller;
    AgentState& state = traveller.agent.state;  // it stands since the offer
    state = later(state, std::min(to_seconds(state_time - passing.stamp), run.crowd().dt_s()));
    admit(run, traveller);
    ownership_.take(passing.offer);
    return true;
  }
  const bool newer = passing.offer.view == ownership_.view().id() && !ownership_.owns(id) &&
                     !ownership_.offered(id) && passing.offer.claim.epoch > ownership_.epoch(id);
  if (!newer) return false;
  std::erase_if(passing_, [&](const Passing& p) { return p.offer.claim.id == id; });
  passing_.push_back(passing);
  return false;
}

/// Where and how it was when somebody last spoke of it; else where it began.
Traveller FarCrowd::last_seen(const ScenarioRun& run, AgentId id) const {
  const auto on_the_way =
      std::ranges::find(passing_, id, [](const Passing& p) { return p.offer.claim.id; });
  if (on_the_way != passing_.end()) return on_the_way->traveller;
  const auto seen = std::ranges::lower_bound(agents_, id, {}, &FarAgent::id);
  if (seen != agents_.end() && seen->id == id) {
    return run.traveller(id, seen->group, seen->state);
  }
  return run.traveller(id, run.roster().home(id), run.roster().start(id).state);
}

FarCrowd::Decided FarCrowd::decide(ScenarioRun& run, Time state_time) {
  follow(run);
  ownership_.decide();
  follow(run);
  Decided out;
  for (int c = 0; c < settings_.coordinators && view_.id() != ownership_.view().id(); ++c) {
    const auto k = static_cast<std::size_t>(c);
    const bool was = k < view_.since.size() && view_.since[k] != Time{};
    if (!was || c == settings_.own || ownership_.view().since[k] != Time{}) continue;
    Left left{.coordinator = c, .groups = {}};
    for (const FarAgent& agent : reports_[k].agents) left.groups.push_back(agent.group);
    std::ranges::sort(left.groups);
    left.groups.erase(std::unique(left.groups.begin(), left.groups.end()), left.groups.end());
    out.left.push_back(std::move(left));
  }
  view_ = ownership_.view();
  const auto bring = [&](const Traveller& traveller) {
    try {
      admit(run, traveller);
      ++out.taken;
      return true;
    } catch (const ConfigError& e) {
      out.trouble = e.what();
      return false;
    }
  };
  for (const AgentId id : std::vector(ownership_.orphans())) {
    if (!ownership_.may_own()) break;
    if (bring(last_seen(run, id))) ownership_.adopt(id);
  }
  for (const Passing& p : passing_) {
    const AgentId id = p.offer.claim.id;
    if (p.offer.from != settings_.own || !ownership_.refused(id)) continue;
    if (bring(p.traveller)) ownership_.take_back(id);
  }
  forget_arrived(state_time);
  return out;
}

std::optional<Passing> FarCrowd::give(ScenarioRun& run, AgentId id, int to, Time now) {
  if (!ownership_.can_offer(id, to)) return std::nullopt;
  const std::optional<Traveller> traveller = run.release(id);
  if (!traveller) return std::nullopt;
  imported_[id] = {traveller->group, Role::mirror, round_};
  passing_.push_back({*traveller, ownership_.offer(id, to), now, now});
  return passing_.back();
}

std::vector<Passing> FarCrowd::repeats(Time now) {
  constexpr Time kEvery = std::chrono::milliseconds(100);
  std::vector<Passing> due;
  for (Passing& p : passing_) {
    const AgentId id = p.offer.claim.id;
    if (p.offer.from != settings_.own || !ownership_.offered(id) || now - p.sent < kEvery) continue;
    p.offer = ownership_.repeat(id);
    p.sent = now;
    due.push_back(p);
  }
  return due;
}

bool FarCrowd::heard(int coordinator, Time now) const {
  const Time stamp = reports_[static_cast<std::size_t>(coordinator)].stamp;
  return stamp != Time{} && to_seconds(now - stamp) <= settings_.stale_s;
}

bool FarCrowd::member(int coordinator) const {
  const FarReport& report = reports_[static_cast<std::size_t>(coordinator)];
  return coordinator == settings_.own
             ? ownership_.member()
             : !started() || ownership_.view().has(coordinator, report.ownership.since);
}

/// Our own run knows better which agents it moves itself.
bool FarCrowd::ours(const ScenarioRun& run, AgentId id) const {
  return run.crowd().group_of(id).has_value() && !imported_.contains(id);
}

/// Every agent that is moved elsewhere, once.
void FarCrowd::collect(const ScenarioRun& run, Time now) {
  const std::vector<FarAgent> before = std::move(agents_);
  agents_.clear();
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || !heard(c, now) || !member(c)) continue;
    const FarReport& report = reports_[static_cast<std::size_t>(c)];
    const double ahead_s = to_seconds(now - report.stamp);
    for (FarAgent agent : report.agents) {
      if (!run.roster().known(agent.id) || ours(run, agent.id)) continue;
      agent.state = later(agent.state, ahead_s);
      agents_.push_back(agent);
    }
  }
  for (const Passing& passing : passing_) {
    const Agent& agent = passing.traveller.agent;
    if (ours(run, agent.id)) continue;
    agents_.push_back({.id = agent.id,
                       .group = passing.traveller.group,
                       .state = agent.state,
                       .epoch = passing.offer.claim.epoch});
  }
  std::ranges::stable_sort(agents_, {},
                           [](const FarAgent& a) { return std::pair(a.id, ~a.epoch); });
  const auto same = [](const FarAgent& a, const FarAgent& b) { return a.id == b.id; };
  agents_.erase(std::unique(agents_.begin(), agents_.end(), same), agents_.end());
  const auto known = static_cast<std::ptrdiff_t>(agents_.size());
  for (FarAgent agent : before) {
    const auto end = agents_.begin() + known;
    const auto now_at = std::ranges::lower_bound(agents_.begin(), end, agent.id, {}, &FarAgent::id);
    if (agent.external || ours(run, agent.id) || (now_at != end && now_at->id == agent.id))
      continue;
    agent.state.velocity_W_m_s.setZero();
    agent.state.phase_rate_rad_s = 0.0;
    agent.trusted = false;
    agents_.push_back(agent);
  }
  std::ranges::inplace_merge(agents_, agents_.begin() + known, {}, &FarAgent::id);
}

void FarCrowd::add_sums(const ScenarioRun& run, Time now, std::vector<GroupSums>& sums) const {
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || !heard(c, now) || !member(c)) continue;
    const FarReport& report = reports_[static_cast<std::size_t>(c)];
    for (const FarSums& far : report.sums) {
      GroupSums& sum = sums[static_cast<std::size_t>(far.group)];
      sum = sum + later(far, to_seconds(now - report.stamp));
    }
  }
  for (const Passing& passing : passing_) {
    GroupSums& sum = sums[static_cast<std::size_t>(passing.traveller.group)];
    sum = sum + sums_of_one(run, passing.traveller);
  }
}

/// Forgets passing agents that have arrived, or whose new coordinator never said so.
void FarCrowd::forget_arrived(Time now) {
  std::erase_if(passing_, [&](const Passing& p) {
    const AgentId id = p.offer.claim.id;
    if (p.offer.from == settings_.own) return !ownership_.offered(id);
    const FarReport& report = reports_[static_cast<std::size_t>(p.offer.to)];
    return now >= p.offer.until || ownership_.owns(id) ||
           std::ranges::find(report.agents, id, &FarAgent::id) != report.agents.end();
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
  collect(run, now);
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
