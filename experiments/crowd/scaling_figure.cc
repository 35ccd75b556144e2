// How the time of a step grows with the crowd, ours and that of RVO2 in the same run.
#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/parallel/team.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/rvo2.h"

namespace mimesis::crowd {
namespace {

using Clock = std::chrono::steady_clock;
using namespace reproduce;

constexpr double kTimedFrom_s = 0.5, kTimedTo_s = 3.5;  // simulated time
constexpr double kGoal = 1.2;                           // our agent-steps/s over those of RVO2

double since_s(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A simulation to time.
struct Stepping {
  std::function<void()> step;
  std::function<double()> time_s;
};

/// Seconds of a step of what `make` makes, the best of some tries: of processor time on one thread,
/// else of wall time. Every try starts again, so that all measure the same seconds of the crowd.
double step_s(const std::function<Stepping()>& make, int agents, int threads) {
  const int most = std::max(1, 200'000 / agents);
  const auto begin = Clock::now();
  double best = 1e9;
  for (int tries = 0; tries < 5 || since_s(begin) < 0.5; ++tries) {
    const Stepping crowd = make();
    const auto warm = Clock::now();
    do {
      crowd.step();
    } while (crowd.time_s() < kTimedFrom_s && since_s(warm) < 2.0);
    const auto wall = Clock::now();
    const std::clock_t processor = std::clock();
    int steps = 0;
    for (; steps < most && crowd.time_s() < kTimedTo_s; ++steps) crowd.step();
    const double processor_s = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
    const double spent_s = threads > 1 || processor_s == 0.0 ? since_s(wall) : processor_s;
    best = std::min(best, spent_s / std::max(1, steps));
    if (tries > 1 && since_s(begin) > 4.0) break;
  }
  return best;
}

double ours_s(Crowd (*make)(int), int n, int threads) {
  const std::shared_ptr team = threads > 1 ? std::make_unique<parallel::Team>(threads) : nullptr;
  const auto stepping = [&]() -> Stepping {
    const auto crowd = std::make_shared<Crowd>(make(n));
    return {[crowd, team] { crowd->step(team.get()); }, [crowd] { return crowd->time_s(); }};
  };
  return step_s(stepping, n, threads);
}

double peer_s(Crowd (*make)(int), int n, int threads) {
  const auto stepping = [&]() -> Stepping {
    const std::shared_ptr crowd = Rvo2::make(make(n), {.threads = threads});
    return {[crowd] { crowd->step(); }, [crowd] { return crowd->time_s(); }};
  };
  return step_s(stepping, n, threads);
}

struct Curve {
  std::string what;
  int most;
  double (*seconds)(int n, int threads);
  const char* note;
};

const Curve kCurves[] = {
    {"full dynamics", 1'000'000, [](int n, int t) { return ours_s(crossing_crowd, n, t); },
     "oscillators, step length, spacing, headings, avoidance, discs kept apart"},
    {"formation only", 1'000'000, [](int n, int t) { return ours_s(formation_crowd, n, t); },
     "rules I, II and III by mean fields"},
    {"RVO2", 100'000, [](int n, int t) { return peer_s(crossing_crowd, n, t); },
     "the agents of full dynamics; velocities that avoid at most 10 others, nothing else"},
};

Report scaling(const PlotDir&) {
  Report report;
  std::map<std::pair<std::string, int>, double> one_core;  // million agent-steps per second
  for (const Curve& curve : kCurves) {
    if (curve.what == "RVO2" && !Rvo2::built()) continue;
    for (const int threads : {1, 2}) {
      for (int n = 100; n <= curve.most; n *= 10) {
        const double rate = n / curve.seconds(n, threads) * 1e-6;
        if (threads == 1) one_core[{curve.what, n}] = rate;
        const std::string what = curve.what + ", " + std::to_string(n) + " agents, " +
                                 std::to_string(threads) + (threads > 1 ? " cores" : " core");
        report.beside(what, rate, goal(60e-6 * n), "M agent-steps/s",
                      std::string("60 Hz in real time; ") + curve.note);
      }
    }
  }
  report.at_least("full dynamics, 10000 agents, 1 core: steps a second",
                  one_core.at({"full dynamics", 10'000}) * 1e2, 60.0, "Hz",
                  "real time at 60 Hz, of processor time");
  report.at_least("formation only, 1000000 agents, 1 core: steps a second",
                  one_core.at({"formation only", 1'000'000}), 60.0, "Hz", "the same");
  if (Rvo2::built()) {
    report.at_least("full dynamics over RVO2, 10000 agents, 1 core",
                    one_core.at({"full dynamics", 10'000}) / one_core.at({"RVO2", 10'000}), kGoal,
                    "1", "agent-steps/s of the same run");
  }
  report.at_most("memory of an agent", crossing_crowd(100).bytes_per_agent(), 500.0, "B",
                 Rvo2::built() ? "without the cells of the grid"
                               : "without the cells of the grid; no RVO2 beside ours: "
                                 "cmake --build build --target peers");
  return report;
}

}  // namespace

void add_scaling_figure(std::vector<reproduce::Figure>& to) {
  to.emplace_back("crowd-scaling", "Agent-steps per second from 1e2 to 1e6 agents", "own",
                  Declared{.goal = Rvo2::built() ? 32 : 23}, scaling);
}

}  // namespace mimesis::crowd
