#include <fmt/format.h>

#include <algorithm>

#include "experiments/walk/figures.h"
#include "experiments/walk/study/drawer_rows.h"
#include "experiments/walk/study/drawer_study.h"

namespace mimesis::walk {

using hw::sim::Plant;
using namespace reproduce;

// Behaviours for the smallest and largest steps and goal distances, and those between [M18 3.8.4,
// fig. 3.44].
Report extremes(const PlotDir&) {
  DrawerStudy& study = DrawerStudy::shared();
  const auto outcomes = study.extremes();
  Report report;
  report.near("falls", falls(outcomes), published(0, "M18 3.8.4"), 0, "1",
              "\"for all tested intermediate step sizes a human-like "
              "coordinated behavior was generated\"");
  report.holds("every object is taken",
               std::ranges::all_of(outcomes, [](const Outcome& o) { return o.taken; }), goal());
  const auto row = [&](const char* what, double (*value)(const Outcome&)) {
    report.at_most(what, largest(outcomes, value), published(kMostError_m, "M18 3.8.3"), "m",
                   "\"always below 10 mm\", of training trials");
  };
  row("size of action 1 (50.5-56.1 cm), largest error", normal_error);
  row("size of action 2 (16.3-35.9 cm), largest error", reaching_error);
  row("reach (66.3-75.5 cm), largest error of the hand when it grips", reach_error);
  return report;
}

// The drawer jumps while the robot comes: from two places to the same one [M18 3.8.4, fig. 3.45].
namespace {

constexpr double kFinal_m = 1.75, kDepth_m = 0.2;
struct Row {
  const char* what;
  double by_m, at_s;
};
constexpr std::array kRows = {Row{"jumps away by 0.2 m", 0.2, 3.5},
                              Row{"jumps nearer by 0.2 m", -0.2, 4.5}};

DrawerTrialSpec spec_of(DrawerStudy& study, const Row& row) {
  DrawerTrialSpec spec;
  spec.name = row.what;
  spec.robot = study.robot().robot;
  spec.actions = &study.actions(kSources[1]);
  spec.front_m = kFinal_m - row.by_m;
  spec.object_depth_m = kDepth_m;
  spec.jumps = {{row.at_s, row.by_m}};
  sense(spec, spec.body.plant, 0);
  return spec;
}

}  // namespace

Report jumps(const PlotDir&) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  for (const Row& row : kRows) {
    double feet_m = 0.0;
    const DrawerResult result = run_drawer_trial(spec_of(study, row), [&](const DrawerTick& tick) {
      feet_m = 0.5 * (tick.trial.truth.X_WS[0](0, 3) + tick.trial.truth.X_WS[1](0, 3));
    });
    const std::string what = std::string(row.what) + ": ";
    const Outcome outcome = outcome_of(result.walk, {});
    report.near(what + "falls", outcome.fell, goal(0), 0, "1");
    report.holds(what + "the object is taken", result.taken, published("M18 fig. 3.45"),
                 "moments d and e of the figure");
    report.near(what + "middle of the feet before the front, at the end", kFinal_m - feet_m,
                goal(0.51), 0.055, "m",
                "where the trained robot is at ease; half of the distances it knows");
    report.at_most(what + "hand at the object, error",
                   result.taken ? result.reach_error_m : std::nan(""), 0.010, "m",
                   "goal of the task; no figure published");
  }
  return report;
}

// Variability of the ZMP across the way: originals of the pattern generator, mixtures of training
// trials, novel goals [M18 3.8.4, fig. 3.46].
namespace {

double zmp_std(const Outcome& o) { return o.zmp_std_m; }

std::vector<Bar> zmp_bars(DrawerStudy& study) {
  std::vector<Bar> out;
  const auto add = [&](const std::string& label, const std::vector<Outcome>& o, int colour) {
    out.push_back({label,
                   spread_of(values_of(o, [](const Outcome& x) { return 1e3 * zmp_std(x); })),
                   colour});
  };
  add("WPG", study.originals(), 8);
  for (const Sources& s : kSources) add("resynth. " + s.text(), study.resynthesis(s), 1);
  for (const Sources& s : kSources) {
    add("novel " + s.text(), study.inference(s, Goals::every_third), 3);
  }
  return out;
}

}  // namespace

Report zmp_spread(const PlotDir& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const Spread original = spread_of(values_of(study.originals(), zmp_std));
  report.at_most("WPG's originals: mean STD", original.mean, 0.02, "m",
                 "two thirds of the half width that the pattern keeps to; the text has no figures");
  const char* why =
      "\"not significantly higher\", \"relatively independent of the number of sources\" [M18 "
      "3.8.4], without figures: by less than the originals differ among themselves, or 20 %";
  const double bound = 1.0 + std::max(0.2, original.std / original.mean);
  for (const Sources& s : kSources) {
    const Spread again = spread_of(values_of(study.resynthesis(s), zmp_std));
    const Spread novel = spread_of(values_of(study.inference(s, Goals::every_third), zmp_std));
    report.at_most(s.text() + " sources, resynthesis: mean STD / originals'",
                   again.mean / original.mean, bound, "1", why);
    report.at_most(s.text() + " sources, novel goals: mean STD / originals'",
                   novel.mean / original.mean, bound, "1", why);
  }
  if (plot_dir) {
    std::vector<plot::Data> data;
    const std::string panel = bars_panel(zmp_bars(study), "zmp", 0.0, 0.0, data);
    plot::plot_png(report.picture(*plot_dir / "fig-3.46.png"), 760, 460, data,
                   "set ylabel 'STD of the lateral ZMP in single support [mm]'\n" + panel);
  }
  return report;
}

// Falls of thirty walks to novel goals: joint angles that are learned and played, and our method,
// also with its forces and errors [M18 3.8.4, table 3.1].
namespace {

/// Table 3.1, of HRP-2 in OpenHRP: slow, middle, fast.
constexpr int kPrinted[3][3] = {{0, 10, 7}, {1, 0, 2}, {0, 5, 10}};
constexpr double kMostAtSole_n_m = 31.5;  ///< of the ankle's torque as the sole feels it
constexpr const char* kPrintedError =
    "printed: \"always below 10 mm\", of training trials without errors of sensors [M18 3.8.3]";

void add_ours(const std::string& name, const std::vector<Outcome>& all, Report& report) {
  for (std::size_t c = 0; c < kSpeeds.size(); ++c) {
    const std::vector<Outcome> ten = speed_class(all, c);
    const std::string what = name + ", " + kSpeeds[c] + ": ";
    report.near(what + "falls of 10", falls(ten), published(0, "M18 table 3.1"), 0, "1");
    report.near(what + "objects taken of 10",
                static_cast<double>(std::ranges::count_if(ten, &Outcome::taken)), goal(10), 0, "1",
                "every sequence ends with the object in the hand");
    report.at_most(
        what + "ankle pitch torque, largest", largest(ten, ankle), goal(kMostAtSole_n_m), "N m",
        "low-passed by 20 ms; motors stop at HRP-2's 30 [M18 3.8.4], the foot's inertia adds");
    report.at_most(what + "ground reaction force, largest", largest(ten, normal_force),
                   published(kMostNormal_n, "M18 3.8.4"), "N",
                   "limit of HRP-2; low-passed by 20 ms");
    report.at_most(what + "sole off its planned place, largest", largest(ten, step_error),
                   kMostError_m, "m", "goal of the project; published are travels only");
    const double travel = std::max(largest(ten, normal_error), largest(ten, reaching_error));
    report.at_most(what + "size of actions 1 and 2, largest error", travel, goal(kMostWithSenses_m),
                   "m", kPrintedError);
    report.at_most(what + "reach, largest error", largest(ten, reach_error),
                   goal(kMostWithSenses_m), "m", kPrintedError);
  }
}

/// Whether falls come from the angles or from the way of playing them.
const std::array<Playing, 4> kWays{{{},
                                    {.adjust_steps = false},
                                    {.plant = Plant::servo},
                                    {.adjust_steps = false, .plant = Plant::servo}}};

/// Falls of ten at a speed, of each model.
std::vector<double> naive_falls(DrawerStudy& study, Sources sources, std::size_t speed,
                                const Playing& how = {}) {
  std::vector<double> out;
  for (std::size_t model = 0; model < kNaiveModels; ++model) {
    const auto all = study.naive_inference(sources, Goals::all, model, how);
    out.push_back(falls(speed_class(all, speed)));
  }
  return out;
}

/// @return falls of thirty at each speed, mean of the models
std::array<double, 3> add_naive(DrawerStudy& study, const Playing& how, Report& report) {
  std::array<double, 3> all{};
  for (std::size_t i = 0; i < kSources.size(); ++i) {
    for (std::size_t c = 0; c < kSpeeds.size(); ++c) {
      const std::vector<double> fell = naive_falls(study, kSources[i], c, how);
      all[c] += spread_of(fell).mean;
      report.beside(
          fmt::format("ML {}, {}, {}: falls of 10", how.text(), kSources[i].text(), kSpeeds[c]),
          spread_of(fell).mean, published(kPrinted[i][c], "M18 table 3.1"), "1",
          fmt::format("of {} models: {}; \"varies in a non-systematic manner\" [M18 3.8.4]",
                      kNaiveModels, fmt::join(fell, ", ")));
    }
  }
  return all;
}

}  // namespace

Report falls_table(const PlotDir&) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const std::array<double, 3> naive = add_naive(study, kWays[0], report);
  for (std::size_t i = 1; i < kWays.size(); ++i) add_naive(study, kWays[i], report);
  report.at_least("ML, all: falls of 90 (printed: 35)", naive[0] + naive[1] + naive[2], 9, "1",
                  "\"often resulted in falling\" [M18 3.8.4]: a tenth of all at the least");
  report.at_least("ML, fast: falls of 30 (printed: 19)", naive[2], 3, "1",
                  "\"a significant number of cases\" [M18 3.8.4]: a tenth at the least");
  add_ours("ours, springs", study.inference(kSources[1], Goals::all), report);
  add_ours("ours, servos", study.inference(kSources[1], Goals::all, Plant::servo), report);
  const std::string alone = "controls: the way of playing alone, with the WPG's own angles; ";
  for (const Playing& how : kWays) {
    report.near(fmt::format("WPG's angles played with feedback, {}: falls of 8", how.text()),
                falls(study.played_originals(how)), published(0, "M18 3.8.4"), 0, "1",
                alone + "what falls above falls by the learned angles");
  }
  return report;
}

// Peaks of the ankles' pitch torque and of the ground reaction force: pattern generator, learned
// joint angles played, our method; training behaviours and novel goals [M18 3.8.4, fig. 3.47].
namespace {

std::vector<Bar> peak_bars(DrawerStudy& study, double (*value)(const Outcome&)) {
  std::vector<Bar> out;
  const auto add = [&](const std::string& label, const std::vector<Outcome>& o, int colour) {
    out.push_back({label, spread_of(values_of(o, value)), colour});
  };
  add("WPG", study.originals(), 8);
  for (const Sources& s : kSources)
    add("naive resynth. " + s.text(), study.naive_resynthesis(s), 5);
  for (const Sources& s : kSources) {
    add("naive novel " + s.text(), study.naive_inference(s, Goals::every_third), 5);
  }
  for (const Sources& s : kSources) add("ours resynth. " + s.text(), study.resynthesis(s), 1);
  for (const Sources& s : kSources) {
    add("ours novel " + s.text(), study.inference(s, Goals::every_third), 1);
  }
  return out;
}

void add_limits(const std::string& what, const std::vector<Outcome>& o, Report& report) {
  const char* why = "limit of HRP-2; low-passed by 20 ms";
  report.at_most(what + ": ankle pitch torque, largest peak", largest(o, ankle),
                 published(kMostAnkle_n_m, "M18 3.8.4"), "N m", why);
  report.at_most(what + ": ground reaction force, largest peak", largest(o, normal_force),
                 published(kMostNormal_n, "M18 3.8.4"), "N", why);
}

double share_beyond(const std::vector<Outcome>& o, double (*value)(const Outcome&), double limit) {
  const auto n = std::ranges::count_if(o, [&](const Outcome& x) { return value(x) > limit; });
  return static_cast<double>(n) / static_cast<double>(o.size());
}

}  // namespace

Report peaks(const PlotDir& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  add_limits("WPG", study.originals(), report);
  std::vector<Outcome> again;
  for (const Sources& s : kSources) {
    add_limits("ours, resynthesis " + s.text(), study.resynthesis(s), report);
    add_limits("ours, novel goals " + s.text(), study.inference(s, Goals::every_third), report);
    std::ranges::copy(study.naive_resynthesis(s), std::back_inserter(again));
  }
  for (const Playing& how : kWays) {
    std::vector<Outcome> novel;
    for (const Sources& s : kSources) {
      std::ranges::copy(study.naive_inference(s, Goals::every_third, 0, how),
                        std::back_inserter(novel));
    }
    report.at_least(
        fmt::format("naive, {}: share of walks to novel goals beyond the ankle's limit",
                    how.text()),
        share_beyond(novel, ankle, kMostAnkle_n_m), 0.5, "1",
        "\"almost all torque peak values exceed 30 Nm\", no figure [M18 3.8.4]; falls included");
    report.beside(
        fmt::format("naive, {}: share of walks to novel goals beyond the ground force's limit",
                    how.text()),
        share_beyond(novel, normal_force, kMostNormal_n), published(1.0, "M18 3.8.4"), "1",
        "\"always infeasible\" [M18 3.8.4], of HRP-2's soles in OpenHRP; peaks end with a fall");
  }
  report.at_least("naive, resynthesis: mean ankle torque / ours",
                  spread_of(values_of(again, ankle)).mean /
                      spread_of(values_of(study.resynthesis(kSources[1]), ankle)).mean,
                  published(1.0, "M18 fig. 3.47"), "1", "above ours, no figures");
  if (plot_dir) {
    std::vector<plot::Data> data;
    const std::string a = bars_panel(peak_bars(study, ankle), "ankle", 120.0, kMostAnkle_n_m, data);
    const std::string b =
        bars_panel(peak_bars(study, normal_force), "normal", 1600.0, kMostNormal_n, data);
    plot::plot_png(report.picture(*plot_dir / "fig-3.47.png"), 1300, 520, data,
                   "set multiplot layout 1,2\nset ylabel 'peak ankle pitch torque [Nm]'\n" + a +
                       "set ylabel 'peak ground reaction force [N]'\n" + b + "unset multiplot\n");
  }
  return report;
}

std::vector<reproduce::Figure> figures() {
  constexpr std::array runs = {&power_law,    &accuracy,      &filtered_zmp, &extremes,
                               &jumps,        &zmp_spread,    &falls_table,  &peaks,
                               &second_robot, &second_engine, &walk_arms,    &walk_drawer,
                               &walk_push};
  static_assert(runs.size() == kTitles.size());
  std::vector<reproduce::Figure> out;
  for (std::size_t i = 0; i < kTitles.size(); ++i) {
    const Title& t = kTitles[i];
    out.push_back({t.name, t.title, t.source, t.rows, runs[i], t.cpu_minutes});
  }
  return out;
}

}  // namespace mimesis::walk
