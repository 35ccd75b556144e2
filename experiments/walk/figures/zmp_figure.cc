// Variability of the ZMP across the way: originals of the pattern generator, mixtures of training
// trials, novel goals [M18 3.8.4, fig. 3.46].
#include <algorithm>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

double zmp_std(const Outcome& o) { return o.zmp_std_m; }

std::vector<Bar> bars(DrawerStudy& study) {
  std::vector<Bar> out;
  const auto add = [&](const std::string& label, const std::vector<Outcome>& o, int colour) {
    out.push_back({label,
                   spread_of(values_of(o, [](const Outcome& x) { return 1e3 * zmp_std(x); })),
                   colour});
  };
  add("WPG", study.originals(), 8);
  for (const Sources& s : kSources) add("resynth. " + s.text(), study.resynthesis(s), 1);
  for (const Sources& s : kSources) {
    add("novel " + s.text(), study.inference(s, Goals::kEveryThird), 3);
  }
  return out;
}

}  // namespace

reproduce::Report zmp_spread(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  reproduce::Report report;
  const Spread original = spread_of(values_of(study.originals(), zmp_std));
  report.rows.push_back(reproduce::at_most(
      "WPG's originals: mean STD", original.mean, 0.02, "m",
      "two thirds of the half width that the pattern keeps to; the text has no figures"));
  const char* why =
      "\"not significantly higher\", \"relatively independent of the number of sources\" [M18 "
      "3.8.4], without figures: by less than the originals differ among themselves, or 20 %";
  const double bound = 1.0 + std::max(0.2, original.std / original.mean);
  for (const Sources& s : kSources) {
    const Spread again = spread_of(values_of(study.resynthesis(s), zmp_std));
    const Spread novel = spread_of(values_of(study.inference(s, Goals::kEveryThird), zmp_std));
    report.rows.push_back(
        reproduce::at_most(s.text() + " sources, resynthesis: mean STD / originals'",
                           again.mean / original.mean, bound, "1", why));
    report.rows.push_back(
        reproduce::at_most(s.text() + " sources, novel goals: mean STD / originals'",
                           novel.mean / original.mean, bound, "1", why));
  }
  if (plot_dir) {
    std::vector<plot::Data> data;
    const auto file = *plot_dir / "fig-3.46.png";
    const std::string panel = bars_panel(bars(study), "zmp", 0.0, 0.0, data);
    plot::plot_png(file, 760, 460, data,
                        "set ylabel 'STD of the lateral ZMP in single support [mm]'\n" + panel);
    report.plots.push_back(file);
  }
  return report;
}

}  // namespace mimesis::walk
