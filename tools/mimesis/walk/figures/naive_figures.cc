// Our method beside the pattern generator on its own and beside joint angles that are learned and
// played: spread of the ZMP, falls, ankle torques and ground forces [M18 3.8.4, fig. 3.46, table
// 3.1, fig. 3.47].
#include <algorithm>

#include "tools/mimesis/walk/figures/list.h"
#include "tools/mimesis/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

using reproduce::at_most;
using reproduce::near;
using reproduce::Report;

constexpr double kMostAnkle_n_m = 30.0, kMostNormal_n = 800.0;
constexpr std::array kClasses = {"slow", "middle speed", "fast"};
/// Table 3.1, of HRP-2 in OpenHRP: slow, middle, fast.
constexpr int kPrinted[3][3] = {{0, 10, 7}, {1, 0, 2}, {0, 5, 10}};

double ankle(const Outcome& o) { return o.ankle_n_m; }
double normal(const Outcome& o) { return o.normal_n; }
double zmp_std(const Outcome& o) { return o.zmp_std_m; }

std::vector<Bar> bars_of(DrawerStudy& study, double (*value)(const Outcome&), double factor,
                         bool naive) {
  std::vector<Bar> bars;
  const auto add = [&](const std::string& label, const std::vector<Outcome>& o, int colour) {
    bars.push_back({label,
                    spread_of(values_of(o, [&](const Outcome& x) { return factor * value(x); })),
                    colour});
  };
  add("WPG", study.originals(), 8);
  if (naive) {
    for (const Sources& s : kSources) {
      add("naive resynth. " + s.text(), study.naive_resynthesis(s), 5);
    }
    for (const Sources& s : kSources) {
      add("naive infer. " + s.text(), study.naive_inference(s, Feedback::kOwn), 5);
    }
  }
  for (const Sources& s : kSources) add("ours resynth. " + s.text(), study.resynthesis(s), 1);
  for (const Sources& s : kSources) add("ours infer. " + s.text(), study.inference(s), 1);
  return bars;
}

}  // namespace

Report zmp_spread(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const Spread original = spread_of(values_of(study.originals(), zmp_std));
  report.rows.push_back(at_most("WPG's originals: mean STD", original.mean, 0.02, "m",
                                "bound of our own; the figure's axis is not legible"));
  for (const Sources& s : kSources) {
    const Spread again = spread_of(values_of(study.resynthesis(s), zmp_std));
    const Spread novel = spread_of(values_of(study.inference(s), zmp_std));
    report.rows.push_back(at_most(s.text() + " sources, resynthesis: mean STD / originals'",
                                  again.mean / original.mean, 1.3, "1",
                                  "\"not significantly higher\" [M18 3.8.4]"));
    report.rows.push_back(at_most(s.text() + " sources, novel goals: mean STD / originals'",
                                  novel.mean / original.mean, 1.3, "1",
                                  "\"not significantly higher\" [M18 3.8.4]"));
  }
  if (plot_dir) {
    std::vector<reproduce::Data> data;
    const auto file = *plot_dir / "fig-3.46.png";
    const std::string panel =
        bars_panel(bars_of(study, zmp_std, 1e3, false), "zmp", 20.0, 0.0, data);
    reproduce::plot_png(file, 760, 460, data, "set ylabel 'STD of the lateral ZMP [mm]'\n" + panel);
    report.plots.push_back(file);
  }
  return report;
}

Report naive_table(const std::optional<std::filesystem::path>&) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const auto& ours = study.inference(kSources[1]);
  for (std::size_t c = 0; c < kClasses.size(); ++c) {
    report.rows.push_back(near(std::string("our method, ") + kClasses[c] + ": falls of 10",
                               falls(ours, 10 * c, 10 * c + 10), 0, 0, "1"));
  }
  int all = 0;
  for (std::size_t i = 0; i < kSources.size(); ++i) {
    const auto& naive = study.naive_inference(kSources[i], Feedback::kOwn);
    all += falls(naive);
    for (std::size_t c = 0; c < kClasses.size(); ++c) {
      report.rows.push_back(at_most(
          "naive " + kSources[i].text() + ", balanced, " + kClasses[c] + ": falls of 10",
          falls(naive, 10 * c, 10 * c + 10), 10, "1",
          "printed: " + std::to_string(kPrinted[i][c]) + ", another robot's; not asserted"));
    }
  }
  const auto& bare = study.naive_inference(kSources[1], Feedback::kNone);
  report.rows.push_back(at_most("naive 4+3, open loop: falls of 30", falls(bare), 30, "1",
                                "the plant's springs topple open loops anyway; not asserted"));
  report.rows.push_back(reproduce::holds("the naive approach falls in some", all > 0));
  report.rows.push_back(near("control: WPG's own angles played, balanced: falls of 8",
                             falls(study.played_originals(Feedback::kOwn)), 0, 0, "1"));
  report.rows.push_back(at_most("control: the same in open loop: falls of 8",
                                falls(study.played_originals(Feedback::kNone)), 8, "1",
                                "what the plant does to angles without feedback; not asserted"));
  return report;
}

Report peaks(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const auto largest = [&](const std::string& what, const std::vector<Outcome>& o) {
    report.rows.push_back(at_most(what + ": ankle pitch torque, largest peak",
                                  spread_of(values_of(o, ankle)).most, kMostAnkle_n_m, "N m",
                                  "limit of HRP-2 [M18 fig. 3.47]"));
    report.rows.push_back(at_most(what + ": ground reaction force, largest peak",
                                  spread_of(values_of(o, normal)).most, kMostNormal_n, "N",
                                  "limit of HRP-2 [M18 fig. 3.47]"));
  };
  largest("WPG", study.originals());
  std::vector<double> naive;
  for (const Sources& s : kSources) {
    largest("ours, resynthesis " + s.text(), study.resynthesis(s));
    largest("ours, novel goals " + s.text(), study.inference(s));
    for (const Outcome& o : study.naive_inference(s, Feedback::kOwn)) naive.push_back(ankle(o));
  }
  const auto beyond = static_cast<double>(
      std::ranges::count_if(naive, [](double v) { return v > kMostAnkle_n_m; }));
  report.rows.push_back(reproduce::at_least(
      "naive, novel goals: share of trials beyond the ankle's limit",
      beyond / static_cast<double>(naive.size()), 0.5, "1",
      "\"almost all torque peak values exceed 30 Nm\" [M18 3.8.4]; falls included"));
  if (plot_dir) {
    std::vector<reproduce::Data> data;
    const std::string a =
        bars_panel(bars_of(study, ankle, 1.0, true), "ankle", 120.0, kMostAnkle_n_m, data);
    const std::string b =
        bars_panel(bars_of(study, normal, 1.0, true), "normal", 1600.0, kMostNormal_n, data);
    const auto file = *plot_dir / "fig-3.47.png";
    reproduce::plot_png(file, 1300, 520, data,
                        "set multiplot layout 1,2\nset ylabel 'peak ankle pitch torque [Nm]'\n" +
                            a + "set ylabel 'peak ground reaction force [N]'\n" + b +
                            "unset multiplot\n");
    report.plots.push_back(file);
  }
  return report;
}

}  // namespace mimesis::walk
