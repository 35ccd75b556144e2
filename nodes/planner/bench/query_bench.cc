#include "nodes/planner/bench/query_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <numeric>

#include "nodes/planner/path_search.h"

namespace mimesis::planner {
namespace {

constexpr double kQueryMargin = 0.001;
constexpr std::array kRobots{"lwr4p", "rx90", "planar2"};

bool certified(const Path& path, CollisionChecker& judge) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (!judge.certify(path[i - 1], path[i])) return false;
  }
  return true;
}

struct Times {
  std::vector<double> us;
  int solved = 0, certified_paths = 0;

  void add(double time_us, const Path& path, CollisionChecker& judge) {
    us.push_back(time_us);
    solved += !path.empty();
    certified_paths += !path.empty() && certified(path, judge);
  }
  void report(benchmark::State& state, const std::string& prefix) {
    if (us.empty()) return;
    std::sort(us.begin(), us.end());
    state.counters[prefix + "solved"] = solved;
    state.counters[prefix + "certified"] = certified_paths;
    state.counters[prefix + "median_us"] = us[us.size() / 2];
    state.counters[prefix + "p95_us"] = us[us.size() * 95 / 100];
    state.counters[prefix + "worst_us"] = us.back();
  }
};

/// What reading the clock takes, which is no part of a plan [us].
double reading_us() {
  static const double least = [] {
    double us = 1e18;
    for (int i = 0; i < 1000; ++i) {
      const double begin_us = processor_us();
      us = std::min(us, processor_us() - begin_us);
    }
    return us;
  }();
  return least;
}

/// Calls visit(arm, scene, judge, query) for all queries of an arm whose straight line is blocked,
/// then done(arm). Labels the state with the arm; without the problem set it is skipped.
template <class Visit, class Done>
void visit_blocked(benchmark::State& state, const Visit& visit, const Done& done) {
  const std::string robot = kRobots.at(static_cast<std::size_t>(state.range(0)));
  state.SetLabel(robot);
  const auto set = load_problem_set(robot);
  if (!set) return state.SkipWithError("no ../shared/data/planner");
  for (auto _ : state) {
    for (const ProblemScene& scene : set->scenes) {
      CollisionChecker judge(set->arm, scene.obstacles, 0.0);
      for (const Query& query : scene.queries) {
        const auto straight = [&](const auto& goal) { return judge.certify(query.start, goal); };
        if (std::ranges::none_of(query.goals, straight)) visit(set->arm, scene, judge, query);
      }
    }
    done(set->arm);
  }
}

/// Lengths of the shortest known paths of the blocked queries, by "robot scene number" [rad].
using Lengths = std::map<std::string, double>;

Lengths known_lengths(const std::string& file) {
  Lengths lengths;
  std::ifstream in(file);
  std::string robot, scene;
  for (auto [number, length] = std::pair(0, 0.0); in >> robot >> scene >> number >> length;)
    lengths[fmt::format("{} {} {}", robot, scene, number)] = length;
  return lengths;
}

void queries(benchmark::State& state) { plan_blocked_queries(state, plan_first_path, {}); }
BENCHMARK(queries)->DenseRange(0, 2)->Iterations(1)->Unit(benchmark::kMillisecond);

/// On a roadmap of the scene, which is built before: the first of the runs has that time, the best
/// has not.
template <Search by>
void roadmap_queries(benchmark::State& state) {
  std::map<const Obstacles*, Roadmap> roadmaps;
  double building_us = 0.0;
  plan_blocked_queries(
      state,
      [&](const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
          const Query& query) {
        CollisionChecker checker(arm, obstacles, margin_m);
        auto known = roadmaps.find(&obstacles);
        if (known == roadmaps.end()) {
          const double begin_us = processor_us();
          known = roadmaps.emplace(&obstacles, build_roadmap(checker, {}, {})).first;
          building_us += processor_us() - begin_us;
        }
        auto found = find_path(known->second, checker, query.start, query.goals, {},
                               {.by = by, .online_refinements = 0, .shortcuts = 0});
        return found ? std::move(found->waypoints) : Path{};
      },
      {});
  state.counters["roadmap_ms"] = 1e-3 * building_us / std::max(1.0, double(roadmaps.size()));
}
BENCHMARK_TEMPLATE(roadmap_queries, Search::waves)
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_TEMPLATE(roadmap_queries, Search::both)
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

void lengths(benchmark::State& state) {
  measure_lengths(state, [](const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                            const Query& query, double end_us, std::uint64_t seed) {
    CollisionChecker checker(arm, obstacles, margin_m,
                             {"time is up", [=] { return processor_us() > end_us; }, 16});
    auto found = find_path({}, checker, query.start, query.goals, {},
                           {.shortcuts = 400, .repeats = 1'000'000, .seed = seed});
    return found ? std::move(found->waypoints) : Path{};
  });
}
BENCHMARK(lengths)->DenseRange(0, 2)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace

double processor_us() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

Path plan_first_path(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                     const Query& query) {
  CollisionChecker checker(arm, obstacles, margin_m);
  auto found = find_path({}, checker, query.start, query.goals, {}, {.shortcuts = 0});
  return found ? std::move(found->waypoints) : Path{};
}

void plan_blocked_queries(benchmark::State& state, const PlanQuery& plan, const PlanQuery& peer) {
  constexpr int kRuns = 5;
  reading_us();  // before the first plan is timed
  struct Asked {
    const ProblemScene* scene;
    const Query* query;
    double our_us = 1e18, their_us = 1e18;
    Path our_path{}, their_path{};
  };
  std::vector<Asked> asked;
  Times ours, theirs;
  std::vector<double> ratios;
  const auto timed = [](const PlanQuery& planner, const kin::ArmModel& arm, const Asked& one,
                        Path& path) {
    const double begin_us = processor_us();
    path = planner(arm, one.scene->obstacles, kQueryMargin, *one.query);
    return processor_us() - begin_us - reading_us();
  };
  visit_blocked(
      state,
      [&](const kin::ArmModel&, const ProblemScene& scene, CollisionChecker&, const Query& query) {
        asked.push_back({&scene, &query});
      },
      [&](const kin::ArmModel& arm) {
        for (int run = 0; run < kRuns; ++run) {
          for (Asked& one : asked)
            one.our_us = std::min(one.our_us, timed(plan, arm, one, one.our_path));
          for (Asked& one : asked) {
            if (peer) one.their_us = std::min(one.their_us, timed(peer, arm, one, one.their_path));
          }
        }
        for (const Asked& one : asked) {
          CollisionChecker judge(arm, one.scene->obstacles, 0.0);
          ours.add(one.our_us, one.our_path, judge);
          if (!peer) continue;
          theirs.add(one.their_us, one.their_path, judge);
          ratios.push_back(one.their_us / one.our_us);
        }
      });
  state.counters["asked"] = static_cast<double>(ours.us.size());
  ours.report(state, "");
  if (ratios.empty()) return;
  theirs.report(state, "peer_");
  std::sort(ratios.begin(), ratios.end());
  state.counters["ratio"] = ratios[ratios.size() / 2];
}

void measure_lengths(benchmark::State& state, const PlanFor& plan) {
  const std::string robot = kRobots.at(static_cast<std::size_t>(state.range(0)));
  const char* file = std::getenv("MIMESIS_BEST_LENGTHS");
  const char* ms = std::getenv("MIMESIS_BEST_MS");
  const double effort_us = 1e3 * (file != nullptr && ms != nullptr ? std::atof(ms) : 50.0);
  Lengths known = known_lengths(file != nullptr ? file : MIMESIS_BEST_LENGTHS);
  int touching = 0;
  std::vector<double> ratios;
  visit_blocked(
      state,
      [&](const kin::ArmModel& arm, const ProblemScene& scene, CollisionChecker& judge,
          const Query& query) {
        const Path path = plan(arm, scene.obstacles, kQueryMargin, query,
                               processor_us() + effort_us, file != nullptr ? 1001 : 1);
        if (path.empty()) return;
        if (!certified(path, judge)) return void(++touching);
        const double length = path_length(path);
        const auto number = &query - scene.queries.data();
        double& best = known.try_emplace(fmt::format("{} {} {}", robot, scene.name, number), length)
                           .first->second;
        ratios.push_back(length / best);
        best = std::min(best, length);
      },
      [](const kin::ArmModel&) {});
  if (ratios.empty()) return;
  if (file != nullptr) {
    std::ofstream out(file);
    for (const auto& [query, length] : known) out << fmt::format("{} {:.5f}\n", query, length);
  }
  std::sort(ratios.begin(), ratios.end());
  state.counters["found"] = static_cast<double>(ratios.size());
  state.counters["touching"] = touching;
  state.counters["mean"] =
      std::accumulate(ratios.begin(), ratios.end(), 0.0) / static_cast<double>(ratios.size());
  state.counters["median"] = ratios[ratios.size() / 2];
  state.counters["p95"] = ratios[ratios.size() * 95 / 100];
}

}  // namespace mimesis::planner
