#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <queue>
#include <random>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

constexpr double kConsistent_m = 1e-6;
constexpr int kTries = 1000;  // for one agent of a box

/// [0, 1) of 53 bits: the same on every standard library.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double within(double half) { return half * (2.0 * (*this)() - 1.0); }

 private:
  std::mt19937_64 engine_;
};

int columns_of(int asked, int count) {
  return asked > 0 ? asked : static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
}

/// Middle of `n` things side by side is 0; the first is on the left.
double across(int i, int n, double spacing) { return spacing * (0.5 * (n - 1) - i); }

Eigen::Vector2d arranged(const Start& s, int i, int count) {
  const int columns = columns_of(s.columns, count);
  switch (s.arrangement) {
    case Arrangement::line:
      return {-s.spacing_m * i, 0.0};
    case Arrangement::row:
      return {0.0, across(i, count, s.across_m)};
    case Arrangement::grid:
      return {-s.spacing_m * (i / columns), across(i % columns, columns, s.across_m)};
    case Arrangement::circle: {
      const double angle = math::kTwoPi * i / count;
      return {s.radius_m * std::cos(angle), s.radius_m * std::sin(angle)};
    }
    case Arrangement::listed: {
      const auto k = 2 * static_cast<std::size_t>(i);
      return {s.position_m.at(k), s.position_m.at(k + 1)};
    }
    case Arrangement::box:
      break;
  }
  return Eigen::Vector2d::Zero();
}

/// A place of the box that is free, that is one radius from the bodies of all others.
Eigen::Vector2d free_place(const Group& group, const std::vector<Eigen::Vector2d>& taken,
                           Uniform& uniform) {
  const double apart = 3.0 * group.radius_m;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const double z = uniform.within(0.5 * group.start.length_m);
    const Eigen::Vector2d p(z, uniform.within(0.5 * group.start.width_m));
    const auto near = [&](const Eigen::Vector2d& other) { return (p - other).norm() < apart; };
    if (std::ranges::none_of(taken, near)) return p;
  }
  throw ConfigError("group " + group.name + ": no room for agent " + std::to_string(taken.size()) +
                    " in a box of " + std::to_string(group.start.length_m) + " x " +
                    std::to_string(group.start.width_m) + " m");
}

double phase_of(const Start& s, int i, Uniform& uniform) {
  switch (s.phase) {
    case PhaseStart::equal:
      return 0.0;
    case PhaseStart::spread:
      return math::wrap_two_pi(math::kTwoPi * std::numbers::phi * i);
    case PhaseStart::random:
      return math::kTwoPi * uniform();
    case PhaseStart::listed:
      return math::wrap_two_pi(s.phase_rad.at(static_cast<std::size_t>(i)));
  }
  return 0.0;
}

/// Lengths along a tree of the pairs from agent 0.
std::vector<FormationPlace> from_distances(const Group& group) {
  const auto n = static_cast<std::size_t>(group.count);
  std::vector<FormationPlace> places(n);
  std::vector<bool> known(n, false);
  std::queue<int> open;
  if (n > 0) open.push(0), known[0] = true;
  while (!open.empty()) {
    const int i = open.front();
    open.pop();
    for (const Distance& d : group.formation.distances) {
      if (d.i != i && d.j != i) continue;
      const auto other = static_cast<std::size_t>(d.i == i ? d.j : d.i);
      const double place =
          places[static_cast<std::size_t>(i)].place_m + (d.i == i ? -d.ahead_m : d.ahead_m);
      if (known.at(other)) {
        if (std::abs(places[other].place_m - place) <= kConsistent_m) continue;
        throw ConfigError("distances d_ij are inconsistent: along one way agent " +
                          std::to_string(other) + " belongs at " +
                          std::to_string(places[other].place_m) + " m, along another at " +
                          std::to_string(place) +
                          " m; without places p with d_ij = p_i - p_j the mean frequency drifts");
      }
      places[other].place_m = place;
      known[other] = true;
      open.push(static_cast<int>(other));
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    places[i].lane_m = across(static_cast<int>(i), group.count, group.formation.across_m);
    if (known[i]) continue;
    throw ConfigError("distances d_ij: agent " + std::to_string(i) +
                      " has none to agent 0, along whatever others: its place is undefined");
  }
  return places;
}

FormationPlace place_of(const Formation& f, int i, int count) {
  const int columns = columns_of(f.columns, count);
  const auto k = static_cast<std::size_t>(i);
  switch (f.shape) {
    case Shape::none:
      return {};
    case Shape::line:
      return {-f.spacing_m * i, 0.0};
    case Shape::row:
      return {0.0, across(i, count, f.across_m)};
    case Shape::grid:
      return {-f.spacing_m * (i / columns), across(i % columns, columns, f.across_m)};
    case Shape::wedge: {
      const int rank = (i + 1) / 2;
      return {-f.spacing_m * rank, (i % 2 == 1 ? 1.0 : -1.0) * f.across_m * rank};
    }
    case Shape::listed:
      return {f.place_m.at(k), f.lane_m.empty() ? across(i, count, f.across_m) : f.lane_m.at(k)};
    case Shape::distances:
      break;
  }
  return {};
}

/// A point of the path's frame P in W.
Eigen::Vector2d in_world(const Group& group, double z_m, double lane_m) {
  return Eigen::Vector2d(group.origin_x_m, group.origin_y_m) +
         Eigen::Rotation2Dd(group.heading_rad) * Eigen::Vector2d(z_m, lane_m);
}

}  // namespace

std::vector<AgentStart> starts(const Group& group, double eigenfrequency_rad_s,
                               std::uint64_t seed) {
  Uniform uniform(seed);
  std::vector<AgentStart> all;
  std::vector<Eigen::Vector2d> taken;
  for (int i = 0; i < group.count; ++i) {
    const bool box = group.start.arrangement == Arrangement::box;
    Eigen::Vector2d p =
        box ? free_place(group, taken, uniform) : arranged(group.start, i, group.count);
    if (group.start.jitter_m > 0.0) {
      p.x() += uniform.within(group.start.jitter_m);
      p.y() += uniform.within(group.start.jitter_m);
    }
    taken.push_back(p);
    const bool circle = group.start.arrangement == Arrangement::circle;
    const double inward = circle ? std::atan2(-p.y(), -p.x()) : 0.0;
    AgentStart start;
    start.p_W_m = in_world(group, p.x(), p.y());
    start.heading_rad = math::wrap_pi(group.heading_rad + inward);
    start.phase_rad = phase_of(group.start, i, uniform);
    start.eigenfrequency_rad_s = eigenfrequency_rad_s + uniform.within(group.spread_rad_s);
    all.push_back(start);
  }
  return all;
}

std::vector<FormationPlace> places(const Group& group) {
  if (group.formation.shape == Shape::distances) return from_distances(group);
  std::vector<FormationPlace> all;
  for (int i = 0; i < group.count; ++i) {
    all.push_back(place_of(group.formation, i, group.count));
  }
  return all;
}

std::vector<Eigen::Vector2d> first_goals(const Group& group, const std::vector<AgentStart>& from) {
  std::vector<Eigen::Vector2d> goals;
  if (group.goals.aim == Aim::none) return goals;
  const Eigen::Vector2d origin(group.origin_x_m, group.origin_y_m);
  const std::vector<double>& xy = group.goals.position_m;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::size_t k = group.goals.aim == Aim::places && xy.size() > 2 ? 2 * i : 0;
    goals.emplace_back(group.goals.aim == Aim::opposite
                           ? Eigen::Vector2d(2.0 * origin - from[i].p_W_m)
                           : Eigen::Vector2d(xy.at(k), xy.at(k + 1)));
  }
  return goals;
}

}  // namespace mimesis::crowd
