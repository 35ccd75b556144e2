// Peaks of the ankles' pitch torque and of the ground reaction force: pattern generator, learned
// joint angles played, our method; training behaviours and novel goals [M18 3.8.4, fig. 3.47].
#include <algorithm>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

using reproduce::Report;

std::vector<Bar> bars(DrawerStudy& study, double (*value)(const Outcome&)) {
  std::vector<Bar> out;
  const auto add = [&](const std::string& label, const std::vector<Outcome>& o, int colour) {
    out.push_back({label, spread_of(values_of(o, value)), colour});
  };
  add("WPG", study.originals(), 8);
  for (const Sources& s : kSources)
    add("naive resynth. " + s.text(), study.naive_resynthesis(s), 5);
  for (const Sources& s : kSources) {
    add("naive novel " + s.text(), study.naive_inference(s, Goals::kEveryThird), 5);
  }
  for (const Sources& s : kSources) add("ours resynth. " + s.text(), study.resynthesis(s), 1);
  for (const Sources& s : kSources) {
    add("ours novel " + s.text(), study.inference(s, Goals::kEveryThird), 1);
  }
  return out;
}

void add_limits(const std::string& what, const std::vector<Outcome>& o, Report& report) {
  const char* why = "limit of HRP-2 [M18 fig. 3.47]; low-passed by 20 ms";
  report.rows.push_back(reproduce::within(what + ": ankle pitch torque, largest peak",
                                          largest(o, ankle), kMostAnkle_n_m, "N m", why));
  report.rows.push_back(reproduce::within(what + ": ground reaction force, largest peak",
                                          largest(o, normal_force), kMostNormal_n, "N", why));
}

double share_beyond(const std::vector<Outcome>& o, double (*value)(const Outcome&), double limit) {
  const auto n = std::ranges::count_if(o, [&](const Outcome& x) { return value(x) > limit; });
  return static_cast<double>(n) / static_cast<double>(o.size());
}

}  // namespace

Report peaks(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  add_limits("WPG", study.originals(), report);
  std::vector<Outcome> again, novel;
  for (const Sources& s : kSources) {
    add_limits("ours, resynthesis " + s.text(), study.resynthesis(s), report);
    add_limits("ours, novel goals " + s.text(), study.inference(s, Goals::kEveryThird), report);
    std::ranges::copy(study.naive_resynthesis(s), std::back_inserter(again));
    std::ranges::copy(study.naive_inference(s, Goals::kEveryThird), std::back_inserter(novel));
  }
  report.rows.push_back(reproduce::at_least(
      "naive, novel goals: share of walks beyond the ankle's limit",
      share_beyond(novel, ankle, kMostAnkle_n_m), 0.5, "1",
      "\"almost all torque peak values exceed 30 Nm\", no figure [M18 3.8.4]; falls included"));
  report.rows.push_back(reproduce::beside(
      "naive, novel goals: share of walks beyond the ground force's limit",
      share_beyond(novel, normal_force, kMostNormal_n), 1.0, "1",
      "\"always infeasible\" [M18 3.8.4], of HRP-2's soles in OpenHRP; peaks end with a fall"));
  report.rows.push_back(
      reproduce::at_least("naive, resynthesis: mean ankle torque / ours",
                          spread_of(values_of(again, ankle)).mean /
                              spread_of(values_of(study.resynthesis(kSources[1]), ankle)).mean,
                          1.0, "1", "above ours in fig. 3.47.a, no figures"));
  if (plot_dir) {
    std::vector<plot::Data> data;
    const std::string a = bars_panel(bars(study, ankle), "ankle", 120.0, kMostAnkle_n_m, data);
    const std::string b =
        bars_panel(bars(study, normal_force), "normal", 1600.0, kMostNormal_n, data);
    const auto file = *plot_dir / "fig-3.47.png";
    plot::plot_png(file, 1300, 520, data,
                        "set multiplot layout 1,2\nset ylabel 'peak ankle pitch torque [Nm]'\n" +
                            a + "set ylabel 'peak ground reaction force [N]'\n" + b +
                            "unset multiplot\n");
    report.plots.push_back(file);
  }
  return report;
}

}  // namespace mimesis::walk
