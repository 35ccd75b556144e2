#include "experiments/crowd/quality.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/parallel/team.h"

namespace mimesis::crowd {
namespace {

constexpr double kDisc_m = 0.2, kFarGoal_m = 1e4;
constexpr double kRhythm = 6.0, kStride_m = 0.22;  // 1.32 m/s
constexpr double kDeep_m = 0.01, kLook_s = 1.0 / 60.0;
constexpr int kStreaming = 1000, kQueuing = 240, kSeeds = 8;
constexpr double kStreams_s = 6.0, kDoor_s = 30.0;
constexpr double kCorridor_m = 4.0, kDoor_m = 1.2;

class MovedByEngine : public Movers {
 public:
  MovedByEngine(Crowd crowd, int threads) : crowd_(std::move(crowd)) {
    if (threads > 1) team_ = std::make_unique<parallel::Team>(threads);
  }
  void step() override { crowd_.step(team_.get()); }
  double time_s() const override { return crowd_.time_s(); }
  int size() const override { return crowd_.size(); }
  Eigen::Vector2d position_W_m(int agent) const override {
    const auto i = static_cast<std::size_t>(agent);
    return {crowd_.x_m()[i], crowd_.y_m()[i]};
  }
  void set_goal(int agent, const Eigen::Vector2d& goal_W_m) override {
    Agent a = crowd_.agent(agent);
    a.traits.goal_W_m = goal_W_m;
    (void)crowd_.set_traits(a.id, a.traits);
  }

 private:
  Crowd crowd_;
  std::unique_ptr<parallel::Team> team_;
};

/// n agents in rows of so many, the first ahead, on a grid of this density that is shaken as far as
/// discs have room. The grid's corner is 0, it grows to -x and +y.
std::vector<Agent> shaken_grid(int n, int columns, double per_m2, std::mt19937& random) {
  const double cell = std::sqrt(1.0 / per_m2), room = cell - 2.1 * kDisc_m;
  std::uniform_real_distribution<double> shift(0.0, room), phase(0.0, 6.0);
  std::vector<Agent> all;
  for (int i = 0; i < n; ++i) {
    Agent a{.id = static_cast<AgentId>(i + 1)};
    const double x = shift(random), y = shift(random);
    a.state.position_W_m = {x - i / columns * cell, y + i % columns * cell};
    a.state.phase_rad = phase(random);
    a.traits.omega_rad_s = kRhythm;
    a.traits.radius_m = kDisc_m;
    all.push_back(a);
  }
  return all;
}

Crowd coupled_crowd(std::span<const Agent> agents, const CrowdSettings& settings) {
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 1.0 / static_cast<double>(agents.size())};
  rules.heading = {.kind = HeadingKind::goal, .avoid = true};
  Crowd crowd(settings);
  crowd.add_group({rules, {kStride_m, std::vector{0.02, 0.05}, std::vector{0.01, -0.03}}, {}});
  crowd.add(0, agents);
  return crowd;
}

Eigen::Vector2d ahead_of(int agent) {
  return agent % 2 == 0 ? Eigen::Vector2d::UnitX() : Eigen::Vector2d::UnitY();
}

std::vector<Eigen::Vector2d> places_of(const Movers& movers) {
  std::vector<Eigen::Vector2d> at;
  for (int i = 0; i < movers.size(); ++i) at.push_back(movers.position_W_m(i));
  return at;
}

int deep_pairs(const std::vector<Eigen::Vector2d>& at) {
  constexpr double kNear_m = 2.0 * kDisc_m - kDeep_m;
  int pairs = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      pairs += (at[i] - at[j]).squaredNorm() < kNear_m * kNear_m ? 1 : 0;
    }
  }
  return pairs;
}

/// Steps until an end; returns the mean number of deep pairs.
double deep_pairs_until(Movers& movers, double end_s, const std::function<void()>& before_step) {
  double sum = 0.0;
  std::vector<Eigen::Vector2d> from = places_of(movers), at = from;
  while (movers.time_s() < end_s - 1e-3) {
    before_step();
    const double begin_s = movers.time_s();
    movers.step();
    const double step_s = movers.time_s() - begin_s;
    const auto to = places_of(movers);
    const int looks = static_cast<int>(std::ceil(step_s / kLook_s - 1e-3));
    for (int k = 1; k <= looks; ++k) {
      const double share = static_cast<double>(k) / looks;
      for (std::size_t i = 0; i < at.size(); ++i) at[i] = from[i] + share * (to[i] - from[i]);
      sum += step_s / looks * deep_pairs(at);
    }
    from = to;
  }
  return sum / movers.time_s();
}

/// Everybody goes to the nearest place in the door, and on.
void lead_through(Movers& movers) {
  constexpr double kRoom = kDoor_m / 2 - 1.25 * kDisc_m;
  for (int i = 0; i < movers.size(); ++i) {
    const Eigen::Vector2d p = movers.position_W_m(i);
    const bool through = p.x() > -kDisc_m && std::abs(p.y()) < kDoor_m;
    movers.set_goal(i, through ? Eigen::Vector2d(kFarGoal_m, p.y())
                               : Eigen::Vector2d(0.6, std::clamp(p.y(), -kRoom, kRoom)));
  }
}

}  // namespace

std::unique_ptr<Movers> move_by_engine(Crowd crowd, int threads) {
  return std::make_unique<MovedByEngine>(std::move(crowd), threads);
}

World streams(int n, double per_m2, const CrowdSettings& settings, unsigned seed) {
  std::mt19937 random(seed);
  const int columns = static_cast<int>(std::sqrt(n)) | 1;  // odd: neighbours go elsewhere
  std::vector<Agent> agents = shaken_grid(n, columns, per_m2, random);
  for (int i = 0; i < n; ++i) {
    Agent& a = agents[static_cast<std::size_t>(i)];
    a.traits.goal_W_m = a.state.position_W_m + kFarGoal_m * ahead_of(i);
    a.state.heading_rad = i % 2 == 0 ? 0.0 : std::numbers::pi / 2;
    a.state.velocity_W_m_s = kRhythm * kStride_m * ahead_of(i);
  }
  return {coupled_crowd(agents, settings)};
}

World door(double per_m2, const CrowdSettings& settings, unsigned seed) {
  std::mt19937 random(seed);
  const int columns = static_cast<int>(std::floor(kCorridor_m * std::sqrt(per_m2)));
  std::vector<Agent> agents = shaken_grid(kQueuing, columns, per_m2, random);
  for (Agent& a : agents) {
    a.state.position_W_m -= Eigen::Vector2d(2.0, kCorridor_m / 2 - 1.1 * kDisc_m);
    a.state.velocity_W_m_s = kRhythm * kStride_m * Eigen::Vector2d::UnitX();
  }
  World world{coupled_crowd(agents, settings)};
  for (const double side : {-1.0, 1.0}) {
    const double wide = side * kCorridor_m / 2;
    world.walls.push_back({{-100.0, wide}, {0.0, wide}});
    world.walls.push_back({{0.0, wide}, {0.0, side * kDoor_m / 2}});
  }
  world.crowd.set_obstacles({}, world.walls);
  return world;
}

bool Quality::admissible(const Quality& finest) const {
  const double unsure_1_s = 2.0 * std::hypot(flow_error_1_s, finest.flow_error_1_s);
  return overlaps <= 1e-3 && delay_s <= 1.05 * finest.delay_s + 0.02 &&
         flow_1_s >= 0.95 * finest.flow_1_s - unsure_1_s;
}

Quality quality(const MakeMovers& make, double per_m2, const CrowdSettings& settings) {
  Quality q{};
  double squares = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto streaming = make(streams(kStreaming, per_m2, settings, seed));
    const auto from = places_of(*streaming);
    const double streaming_pairs = deep_pairs_until(*streaming, kStreams_s, [] {});
    double way_m = 0.0;
    for (int i = 0; i < kStreaming; ++i) {
      const auto k = static_cast<std::size_t>(i);
      way_m += (streaming->position_W_m(i) - from[k]).dot(ahead_of(i)) / kStreaming;
    }
    const auto queuing = make(door(per_m2, settings, seed));
    const double queuing_pairs =
        deep_pairs_until(*queuing, kDoor_s, [&] { lead_through(*queuing); });
    const auto through = std::ranges::count_if(
        places_of(*queuing), [](const Eigen::Vector2d& p) { return p.x() > 0.0; });
    q.overlaps += 0.5 * (streaming_pairs / kStreaming + queuing_pairs / kQueuing) / kSeeds;
    const double flow_1_s = static_cast<double>(through) / queuing->time_s();
    q.flow_1_s += flow_1_s / kSeeds;
    squares += flow_1_s * flow_1_s / kSeeds;
    q.delay_s += (streaming->time_s() - way_m / (kRhythm * kStride_m)) / kSeeds;
  }
  const double variance = std::max(squares - q.flow_1_s * q.flow_1_s, 0.0);
  q.flow_error_1_s = std::sqrt(variance / (kSeeds - 1));
  return q;
}

}  // namespace mimesis::crowd
