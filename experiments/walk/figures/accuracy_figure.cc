#include <algorithm>
#include <array>

#include "common/plot/gnuplot.h"
#include "experiments/walk/figures.h"
#include "experiments/walk/study/drawer_rows.h"
#include "experiments/walk/study/velocity_study.h"

namespace mimesis::walk {

using namespace reproduce;

namespace {

constexpr double kBin_mm = 1.0, kMost_mm = 24.0;
constexpr Sources kOneSource{1, 0};  // beside the non-periodic one, which every model has

struct Quantity {
  const char* name;
  double (*error_m)(const Places&);
};
constexpr std::array kQuantities = {
    Quantity{"size of action 1", [](const Places& p) { return p.normal_m.norm(); }},
    Quantity{"size of action 2", [](const Places& p) { return p.reaching_m.norm(); }},
    Quantity{"reach", [](const Places& p) { return p.reach_m.norm(); }},
};

std::vector<double> errors_of(const std::vector<FreeWalk>& walks, const Quantity& q) {
  std::vector<double> out;
  for (const FreeWalk& walk : walks) out.push_back(q.error_m(walk.came));
  return out;
}

double largest_error(const std::vector<FreeWalk>& walks, const Quantity& q) {
  return spread_of(errors_of(walks, q)).most;
}

/// Trials per millimetre of error; the last bin holds larger errors and failed reaches.
std::vector<double> histogram(const std::vector<double>& errors_m) {
  std::vector<double> count(static_cast<std::size_t>(kMost_mm / kBin_mm), 0.0);
  for (const double e : errors_m) {
    const double bin = 1e3 * e / kBin_mm;
    const double last = static_cast<double>(count.size()) - 1.0;
    ++count[static_cast<std::size_t>(bin < last ? bin : last)];
  }
  return count;
}

using Walks = std::vector<std::pair<std::string, std::vector<FreeWalk>>>;

std::filesystem::path plot_accuracy(const std::filesystem::path& dir, const Walks& walks) {
  std::vector<plot::Data> data;
  std::string script =
      "set multiplot layout 1,3\nset style fill solid 0.6 noborder\nset yrange [0:*]\nset ytics "
      "2\nset xlabel 'error [mm]'\nset xrange [0:24]\nset arrow 1 from 10, graph 0 to 10, graph 1 "
      "nohead dt 2 lc rgb '#404040'\nset boxwidth 0.2\n";
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    script += "set title " + plot::quoted(kQuantities[k].name) + "\n";
    script += k == 0 ? "set ylabel 'trials'\n" : "unset ylabel\n";
    std::string curves;
    for (std::size_t i = 0; i < walks.size(); ++i) {
      const std::vector<double> count = histogram(errors_of(walks[i].second, kQuantities[k]));
      plot::Data d{"h" + std::to_string(k) + std::to_string(i), {}};
      for (std::size_t b = 0; b < count.size(); ++b) {
        d.rows.push_back(
            {(static_cast<double>(b) + 0.2 + 0.2 * static_cast<double>(i)) * kBin_mm, count[b]});
      }
      data.push_back(d);
      curves += (i ? ", $" : "$") + d.name + " with boxes lt " + std::to_string(i + 1) +
                " title '" + walks[i].first + "'";
    }
    script += "plot " + curves + "\n";
  }
  const auto file = dir / "fig-3.41.png";
  plot::plot_png(file, 1200, 380, data, script + "unset multiplot\n");
  return file;
}

int falls_of(const std::vector<FreeWalk>& walks) {
  return static_cast<int>(std::ranges::count_if(walks, &FreeWalk::fell));
}

void add_resynthesis(const std::string& name, const std::vector<FreeWalk>& walks, Report& report) {
  report.near(name + " sources: falls", falls_of(walks), goal(0), 0, "1", "none is told of");
  std::vector<double> all;
  for (const Quantity& q : kQuantities) {
    std::ranges::copy(errors_of(walks, q), std::back_inserter(all));
    report.at_most(name + " sources: " + q.name + ", largest error", largest_error(walks, q),
                   published(kMostError_m, "M18 3.8.3"), "m",
                   "\"always below 10 mm\"; length of the vector");
  }
  const auto small =
      static_cast<double>(std::ranges::count_if(all, [](double e) { return e < 0.005; }));
  report.at_least(name + " sources: share of errors below 5 mm",
                  small / static_cast<double>(all.size()), 0.5, "1",
                  "\"often below 5 mm\" [M18 3.8.3]");
}

/// Middles between two training trials of one pace, of each of the four.
std::vector<VelocityStudy::Pair> novel_places() {
  std::vector<VelocityStudy::Pair> out;
  for (std::size_t pace = 0; pace < 4; ++pace) {
    out.push_back({8 * pace, 8 * pace + 5});
    out.push_back({8 * pace + 3, 8 * pace + 6});
  }
  return out;
}

/// Difference of the walked lengths from those of the human-like trials that they were made of.
double made_off_m(DrawerStudy& study, VelocityStudy& free) {
  double most = 0.0;
  for (std::size_t i = 0; i < study.trials().action[0].trials.size(); ++i) {
    const DrawerGoal wished = goal_of(study.trials(), i), walked = goal_of(free.trials(), i);
    most = std::max({most, std::abs(walked.normal_m - wished.normal_m),
                     std::abs(walked.reaching_m - wished.reaching_m)});
  }
  return most;
}

}  // namespace

/// Places that a walk comes to whose footprints the pattern generator makes of learned velocities,
/// and whose hands learned joint angles lead, by the number of sources [M18 3.8.3, fig. 3.41].
Report accuracy(const PlotDir& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  VelocityStudy free(study.robot(), study.trials());
  Report report;
  report.at_most(
      "training trials: lengths walked, largest difference from the human-like ones",
      made_off_m(study, free), 0.06, "m",
      "the mean about a landing takes a quarter of an action from its neighbours: at most a "
      "quarter "
      "of the lengths' difference, 0.086 m, of which the stopping foot makes up some");
  const std::vector<std::size_t> trials = study.chosen_trials();
  Walks walks;
  for (const Sources& s : kSources) {
    walks.emplace_back(s.text(), free.resynthesis(s, trials));
    add_resynthesis(s.text(), walks.back().second, report);
  }
  const Quantity& reach = kQuantities.back();
  walks.emplace_back("1", free.resynthesis(kOneSource, trials));
  const double one = largest_error(walks.back().second, reach);
  report.at_least(
      "1 source: reach, largest error", one, kMostError_m, "m",
      "control: one source misses what three sizes of model keep, so that the errors are theirs");
  report.at_least(
      "reach, largest error: 1 source / " + kSources[1].text(),
      one / largest_error(walks[1].second, reach), 3.0, "1",
      "1 and 7 sources leave 0.09 and 0.0003 of the variance, amplitudes as 17 to 1; what both "
      "share, the physics' 2 mm, hides more of it the smaller it is");
  const auto novel = free.inference(kSources[1], novel_places());
  for (const Quantity& q : kQuantities) {
    report.at_most(
        std::string("novel goals, ") + kSources[1].text() + " sources: " + q.name +
            ", largest error",
        largest_error(novel, q), kMostError_m, "m",
        "by the maps, for the reach with the goal moved by what kinematics say the hand misses; in "
        "the "
        "middle between two trained places; nothing is published, 10 mm are of training trials");
  }
  if (plot_dir) report.plots.push_back(plot_accuracy(*plot_dir, walks));
  return report;
}

}  // namespace mimesis::walk
