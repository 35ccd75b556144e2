#include <fmt/format.h>

#include <map>

#include "experiments/fields/figures.h"
#include "experiments/fields/situations.h"
#include "nodes/cognition/imitator.h"

namespace mimesis::cognition {
namespace {

using namespace reproduce;

/// How many of 100 sets of gains keep each figure, when every gain varies by itself. The constants
/// were chosen with other seeds (above 5000).
Report jitter(const PlotDir&) {
  constexpr int kSets = 100;
  Report report;
  for (const auto& [spread, least] : {std::pair{0.05, 100.0}, {0.1, 90.0}}) {
    std::map<std::string, int> kept;
    for (const Situation& s : situations()) kept[s.figure] = 0;
    kept["all"] = 0;
    for (unsigned seed = 1; seed <= kSets; ++seed) {
      Constants constants;
      constants.network.dt_s = 0.005;
      for (const auto& figure : figures_that_hold<float>(jittered(constants, seed, spread))) {
        ++kept[figure];
      }
    }
    const std::string by = std::to_string(std::lround(100 * spread)) + " %, ";
    for (const auto& [figure, sets] : kept) {
      report.at_least(by + (figure == "all" ? "all figures" : "fig. " + figure), sets, Bound(least),
                      "1", "sets of 100 that hold");
    }
  }
  return report;
}

/// How well the goal is known when the decision falls.
struct View {
  const char* name;
  double goal_confidence;
  int refusals;  ///< decisions for which the planner finds no motion, before the one that counts
};
constexpr std::array<View, 5> kViews = {{{"goal seen", 1.0, 0},
                                         {"goal doubtful (0.6)", 0.6, 0},
                                         {"goal ambiguous (0.3)", 0.3, 0},
                                         {"goal hidden", 0.0, 0},
                                         {"goal blocked", 1.0, 2}}};

struct Change {
  const char* name;
  void (*apply)(Demonstration&);
};
template <class Symbol>
Symbol other(Symbol s) {
  return static_cast<Symbol>(3 - static_cast<int>(s));
}
constexpr std::array<Change, 7> kChanges = {
    {{"grip changed", [](Demonstration& d) { d.grip = other(d.grip); }},
     {"transport changed", [](Demonstration& d) { d.transport = other(d.transport); }},
     {"both means changed",
      [](Demonstration& d) {
        d.grip = other(d.grip);
        d.transport = other(d.transport);
      }},
     {"goal changed", [](Demonstration& d) { d.goal = other(d.goal); }},
     {"grip removed", [](Demonstration& d) { d.grip = Grip::unknown; }},
     {"transport removed", [](Demonstration& d) { d.transport = Transport::unknown; }},
     {"goal removed", [](Demonstration& d) { d.goal = Goal::unknown; }}}};

/// Of the eight demonstrations, those whose decision about the means, or the goal, differs after a
/// change; a row a view.
constexpr int kDiffering[kViews.size()][kChanges.size()][2] = {
    {{0, 0}, {0, 0}, {0, 0}, {8, 8}, {0, 0}, {0, 0}, {6, 6}},
    {{4, 0}, {4, 0}, {4, 0}, {4, 8}, {2, 0}, {2, 0}, {4, 6}},
    {{4, 4}, {4, 4}, {4, 4}, {4, 4}, {2, 2}, {2, 2}, {4, 4}},
    {{8, 8}, {8, 8}, {4, 4}, {0, 0}, {4, 4}, {4, 4}, {0, 0}},
    {{4, 4}, {4, 4}, {4, 4}, {4, 4}, {2, 2}, {2, 2}, {2, 2}}};

Decision decide(Imitator& robot, Demonstration shown, const View& view, bool anew = true) {
  constexpr double kPeriod_s = 0.01;
  shown.goal_confidence = view.goal_confidence;
  if (view.goal_confidence == 0.0) shown.goal = Goal::unknown;
  if (anew) robot.observe({}, false, kPeriod_s);
  robot.observe(shown, true, kPeriod_s);
  for (int refused = 0;; ++refused) {
    while (robot.stage() == Imitator::Stage::deciding) robot.advance(kPeriod_s, false);
    if (refused == view.refusals || !robot.decided()) return robot.decision();
    robot.refuse();
  }
}

/// What a node with the default practice decides, with each symbol changed or removed.
Report sensitivity(const PlotDir&) {
  Report report;
  Imitator robot({}, load_network());
  for (std::size_t v = 0; v < kViews.size(); ++v) {
    std::array<Demonstration, 8> demonstrations;
    std::array<Decision, 8> decisions;
    for (int i = 0; i < 8; ++i) {
      const auto at = static_cast<std::size_t>(i);
      demonstrations[at] = {.grip = static_cast<Grip>(1 + i / 4),
                            .transport = static_cast<Transport>(1 + i / 2 % 2),
                            .goal = static_cast<Goal>(1 + i % 2)};
      decisions[at] = decide(robot, demonstrations[at], kViews[v]);
    }
    for (std::size_t c = 0; c < kChanges.size(); ++c) {
      int means = 0, goals = 0;
      for (std::size_t i = 0; i < demonstrations.size(); ++i) {
        Demonstration changed = demonstrations[i];
        kChanges[c].apply(changed);
        const Decision &a = decisions[i], b = decide(robot, changed, kViews[v]);
        means += a.grip != b.grip || a.transport != b.transport ? 1 : 0;
        goals += a.goal != b.goal ? 1 : 0;
      }
      const auto& expected = kDiffering[v][c];
      const std::string what = std::string(kViews[v].name) + ", " + kChanges[c].name + ": other ";
      const char* why = "of eight demonstrations; a change of the table must be meant";
      report.near(what + "means", means, goal(expected[0]), 0.0, "1", why);
      report.near(what + "goal", goals, goal(expected[1]), 0.0, "1", why);
    }
  }
  return report;
}

/// When PFC becomes active for the high goal of that confidence, shown alone [s]; negative: never.
double goal_onset_s(const std::vector<std::string>& goals, double confidence) {
  Imitator robot({.goals = goals}, load_network());
  robot.observe({.goal = Goal::high, .goal_confidence = confidence}, true, 0.01);
  while (robot.stage() == Imitator::Stage::deciding) robot.advance(0.01, false);
  return robot.reasons().fields()[index(Layer::pfc)].onset_s;
}

/// Of the eight demonstrations, seen grip, transport, goal in turn, those that are decided as if
/// all had begun together.
int decided_alike(double order_s) {
  Imitator together({}, load_network()), in_turn({.order_s = order_s}, load_network());
  int alike = 0;
  for (int i = 0; i < 8; ++i) {
    const Demonstration all{.grip = static_cast<Grip>(1 + i / 4),
                            .transport = static_cast<Transport>(1 + i / 2 % 2),
                            .goal = static_cast<Goal>(1 + i % 2)};
    in_turn.observe({}, false, 0.01);
    in_turn.observe({.grip = all.grip}, false, 0.01);
    in_turn.observe({.grip = all.grip, .transport = all.transport}, false, 0.01);
    alike += decide(in_turn, all, kViews[0], false) == decide(together, all, kViews[0]) ? 1 : 0;
  }
  return alike;
}

/// Number, identity and probability of goals [M18 2.2.1]; order in time.
Report task(const PlotDir&) {
  Report report;
  const std::array<std::vector<std::string>, 5> goals = {
      {{"high"}, {"high=0.8", "low"}, {"high", "low"}, {"high=0.2", "low"}, {"low"}}};
  double before_s = 0.0;
  for (const auto& [i, name] : {std::pair{0, "certain"},
                                {1, "of probability 0.8"},
                                {2, "one of two"},
                                {3, "of probability 0.2"},
                                {4, "not of the task"}}) {
    const double onset_s = goal_onset_s(goals[static_cast<std::size_t>(i)], 1.0);
    report.at_least(std::string("onset of PFC, goal ") + name, 1000.0 * onset_s,
                    1000.0 * before_s + 0.5, "ms",
                    "what is expected is faster: later than the row above");
    before_s = onset_s;
  }
  report.holds(
      "a glimpse (confidence 0.2) is enough for a goal of 0.9, not of 0.1",
      goal_onset_s({"high=0.9", "low"}, 0.2) > 0.0 && goal_onset_s({"high=0.1", "low"}, 0.2) < 0.0,
      goal());
  for (const auto& [order_s, alike] :
       {std::pair{0.005, 8}, {0.01, 6}, {0.02, 6}, {0.03, 6}, {0.04, 4}, {0.06, 4}}) {
    report.near(fmt::format("{:.0f} ms apart: decided alike", 1000.0 * order_s),
                decided_alike(order_s), goal(alike), 0.0, "1",
                "of eight demonstrations; a change must be meant");
  }
  return report;
}

}  // namespace

void add_robustness_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fields-jitter",
                  "How many of 100 sets of jittered gains keep the decisions of the figures", "own",
                  Declared{.goal = 18}, jitter, 2.0);
  to.emplace_back("fields-sensitivity", "Which symbols of a demonstration the decisions depend on",
                  "own", Declared{.goal = 70}, sensitivity);
  to.emplace_back("fields-task",
                  "What the task leads to expect, and what the order in time decides", "own",
                  Declared{.goal = 12}, task);
}

}  // namespace mimesis::cognition
