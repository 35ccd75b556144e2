// Streams of people in corridors, corners, junctions and doors, beside RVO2 on the same ways.
#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>

#include "experiments/crowd/figures.h"
#include "experiments/crowd/rvo2.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/run/scenario_run.h"

namespace mimesis::crowd {
namespace {

using namespace reproduce;
using Eigen::Vector2d;

constexpr double kRadius_m = 0.2, kApart_m = 0.9, kThere_m = 1.0;

/// Where people stand, and go to: rows across an arm of a place, seen from its middle.
struct Arm {
  Vector2d outwards;
  double width_m;
  Vector2d at(int i, double from_m) const {
    const int abreast = std::max(1, static_cast<int>((width_m - 0.4) / kApart_m));
    const Vector2d across(-outwards.y(), outwards.x());
    return (from_m + kApart_m * (i / abreast)) * outwards +
           (i % abreast - 0.5 * (abreast - 1)) * kApart_m * across;
  }
};

class Place {
 public:
  explicit Place(unsigned seed) : random_(seed) {
    scenario_.gaits = {{.name = "walk", .eigenfrequency_rad_s = 6.0, .mean_m_rad = 0.2}};
    scenario_.until_s = 600.0;
  }
  double in(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  int of(int a, int b) { return std::uniform_int_distribution<int>(a, b)(random_); }
  void box(double x0, double y0, double x1, double y1) {
    scenario_.polygons.push_back({{x0, y0, x1, y0, x1, y1, x0, y1}});
  }
  void wall(const Vector2d& a, const Vector2d& b) { scenario_.walls.push_back({a, b}); }
  void stream(const Arm& from, const Arm& to, int n) {
    Group g{.name = "stream" + std::to_string(scenario_.groups.size()),
            .count = n,
            .gait = "walk",
            .radius_m = kRadius_m};
    g.start.arrangement = Arrangement::listed;
    g.goals.aim = Aim::places;
    for (int i = 0; i < n; ++i) {
      const Vector2d p = from.at(i, 5.0) + Vector2d(in(-0.1, 0.1), in(-0.1, 0.1));
      const Vector2d goal = to.at(n - 1 - i, 8.0);
      g.start.position_m.insert(g.start.position_m.end(), {p.x(), p.y()});
      g.goals.position_m.insert(g.goals.position_m.end(), {goal.x(), goal.y()});
    }
    g.heading_rad = 0.0;
    g.rules.heading = {.kind = HeadingKind::goal, .gain = 1.0, .avoid = true};
    scenario_.groups.push_back(g);
  }
  const Scenario& scenario() const { return scenario_; }

 private:
  std::mt19937 random_;
  Scenario scenario_;
};

constexpr double kLong_m = 70.0;

Scenario corridor(unsigned seed) {
  Place p(seed);
  const double wide = p.in(2.0, 6.0);
  const Arm east{{1, 0}, wide}, west{{-1, 0}, wide};
  for (const double y : {-0.5 * wide, 0.5 * wide}) p.wall({-kLong_m, y}, {kLong_m, y});
  const int most = static_cast<int>(10.0 * wide);  // 10 to 60 a side, as the width allows
  p.stream(west, east, p.of(10, most)), p.stream(east, west, p.of(10, most));
  return p.scenario();
}

/// Arms to the west, the south and, at a junction, the east.
Scenario junction(unsigned seed, bool three) {
  Place p(seed);
  const double wide = p.in(2.5, 4.0), half = 0.5 * wide;
  const Arm west{{-1, 0}, wide}, south{{0, -1}, wide}, east{{1, 0}, wide};
  p.box(-kLong_m, -kLong_m, -half, -half), p.box(half, -kLong_m, kLong_m, three ? -half : half);
  p.wall({-kLong_m, half}, {three ? kLong_m : half, half});
  const auto n = [&] { return p.of(10, 20); };
  p.stream(west, south, n());
  p.stream(south, three ? east : west, n());
  if (three) p.stream(east, west, n());
  return p.scenario();
}
Scenario corner(unsigned seed) { return junction(seed, false); }
Scenario three_arms(unsigned seed) { return junction(seed, true); }

Scenario door(unsigned seed) {
  Place p(seed);
  const double half = 0.5 * p.in(0.9, 1.5);
  for (const double side : {-1.0, 1.0}) p.wall({0.0, side * half}, {0.0, side * kLong_m});
  p.stream({{-1, 0}, 8.0}, {{1, 0}, 8.0}, p.of(10, 60));
  return p.scenario();
}

struct Passage {
  double took_s = 0.0;  // 0: somebody is not there
  int overlapping = 0;
};

double most_s(const Scenario& s) {
  int people = 0;
  for (const Group& g : s.groups) people += g.count;
  return 90.0 + 4.0 * people;
}

Passage ours(const Scenario& s) {
  ScenarioRun run(s);
  Passage out;
  while (run.time_s() < most_s(s)) {
    run.step();
    const Crowd& crowd = run.crowd();
    out.overlapping = std::max(out.overlapping, crowd.contacts().overlapping);
    bool all = true;
    for (int i = 0; i < crowd.size() && all; ++i) {
      const auto r = static_cast<std::size_t>(i);
      const Vector2d p(crowd.x_m()[r], crowd.y_m()[r]);
      all = (p - run.goal_W_m(crowd.ids()[r])).norm() < kThere_m;
    }
    if (!all) continue;
    out.took_s = run.time_s();
    break;
  }
  return out;
}

/// Seconds; 0: somebody is not there.
double rvo2(const Scenario& s) {
  const ScenarioRun start(s);
  const auto peer = Rvo2::make(start.crowd(), {}, edges(s.walls, s.polygons));
  Ways ways = ways_of(s, s.groups[0]);
  const Crowd& crowd = start.crowd();
  while (peer->time_s() < most_s(s)) {
    bool all = true;
    for (int i = 0; i < crowd.size(); ++i) {
      const Vector2d p = peer->position_W_m(i), goal = crowd.agent(i).traits.goal_W_m;
      const double way = (goal - p).norm();
      all = all && way < kThere_m;
      const Vector2d next = ways.next(p, goal).value_or(goal);
      peer->set_goal(i, next == goal ? goal : p + 3.0 * (next - p).normalized());
    }
    if (all) return peer->time_s();
    peer->step();
  }
  return 0.0;
}

Report streams(const PlotDir&) {
  Report report;
  const char* asked = std::getenv("MIMESIS_STREAMS");
  const int seeds = asked != nullptr ? std::atoi(asked) : 100;
  const std::pair<const char*, Scenario (*)(unsigned)> places[] = {
      {"corridor", corridor}, {"corner", corner}, {"junction", three_arms}, {"door", door}};
  for (const auto& [name, make] : places) {
    int stuck = 0, overlapping = 0, peers_stuck = 0;
    std::vector<double> ratios;
    for (int seed = 0; seed < seeds; ++seed) {
      const Scenario s = make(static_cast<unsigned>(seed));
      const Passage mine = ours(s);
      stuck += mine.took_s == 0.0;
      overlapping += mine.overlapping > 0;
      if (!Rvo2::built()) continue;
      const double theirs = rvo2(s);
      peers_stuck += theirs == 0.0;
      if (mine.took_s > 0.0 && theirs > 0.0) ratios.push_back(mine.took_s / theirs);
    }
    const std::string what = std::string(name) + ", " + std::to_string(seeds) + " seeds: ";
    report.at_most(what + "somebody does not arrive", stuck, 0.0, "runs", "nobody stands for ever");
    report.at_most(what + "somebody in another's disc", overlapping, 0.0, "runs", "never");
    if (ratios.empty()) continue;
    std::ranges::sort(ratios);
    report.at_most(what + "time over RVO2's, median", median(ratios), 2.0, "1",
                   "RVO2 on the same ways: " + std::to_string(peers_stuck) +
                       " not through; worst " + std::to_string(ratios.back()));
  }
  return report;
}

}  // namespace

void add_stream_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("crowd-streams",
                  "streams in corridors, corners, junctions and doors, beside RVO2", "own",
                  Declared{.goal = Rvo2::built() ? 12 : 8}, streams);
}

}  // namespace mimesis::crowd
