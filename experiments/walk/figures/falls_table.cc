// Falls of thirty walks to novel goals: joint angles that are learned and played, and our method,
// whose forces and errors are told besides [M18 3.8.4, table 3.1].
#include <fmt/format.h>

#include <algorithm>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

using hw::sim::Plant;
using reproduce::Report;

/// Table 3.1, of HRP-2 in OpenHRP: slow, middle, fast.
constexpr int kPrinted[3][3] = {{0, 10, 7}, {1, 0, 2}, {0, 5, 10}};

void add_ours(const std::string& name, const std::vector<Outcome>& all, Report& report) {
  for (std::size_t c = 0; c < kSpeeds.size(); ++c) {
    const std::vector<Outcome> ten = speed_class(all, c);
    const std::string what = name + ", " + kSpeeds[c] + ": ";
    report.rows.push_back(reproduce::near(what + "falls of 10", falls(ten), 0, 0, "1"));
    report.rows.push_back(
        reproduce::near(what + "objects taken of 10",
                        static_cast<double>(std::ranges::count_if(ten, &Outcome::taken)), 10, 0,
                        "1", "every sequence ends with the object in the hand"));
    report.rows.push_back(reproduce::within(what + "ankle pitch torque, largest",
                                            largest(ten, ankle), kMostAnkle_n_m, "N m",
                                            "limit of HRP-2 [M18 fig. 3.47]; low-passed by 20 ms"));
    report.rows.push_back(reproduce::within(what + "ground reaction force, largest",
                                            largest(ten, normal_force), kMostNormal_n, "N",
                                            "limit of HRP-2 [M18 fig. 3.47]; low-passed by 20 ms"));
    report.rows.push_back(reproduce::at_most(what + "sole off its planned place, largest",
                                             largest(ten, step_error), kMostError_m, "m",
                                             "goal of the project; published are travels only"));
    const double travel = std::max(largest(ten, normal_error), largest(ten, reaching_error));
    report.rows.push_back(reproduce::within(what + "size of actions 1 and 2, largest error", travel,
                                            kMostError_m, "m",
                                            "\"always below 10 mm\" [M18 3.8.3, fig. 3.41]"));
    report.rows.push_back(reproduce::within(what + "reach, largest error",
                                            largest(ten, reach_error), kMostError_m, "m",
                                            "\"always below 10 mm\" [M18 3.8.3, fig. 3.41]"));
  }
}

/// Falls of ten at a speed, of each model.
std::vector<double> naive_falls(DrawerStudy& study, Sources sources, std::size_t speed) {
  std::vector<double> out;
  for (std::size_t model = 0; model < kNaiveModels; ++model) {
    const auto all = study.naive_inference(sources, Goals::kAll, model);
    out.push_back(falls(speed_class(all, speed)));
  }
  return out;
}

/// @return falls of thirty at each speed, mean of the models
std::array<double, 3> add_naive(DrawerStudy& study, Report& report) {
  std::array<double, 3> all{};
  for (std::size_t i = 0; i < kSources.size(); ++i) {
    for (std::size_t c = 0; c < kSpeeds.size(); ++c) {
      const std::vector<double> fell = naive_falls(study, kSources[i], c);
      all[c] += spread_of(fell).mean;
      report.rows.push_back(reproduce::beside(
          "ML " + kSources[i].text() + ", " + kSpeeds[c] + ": falls of 10", spread_of(fell).mean,
          kPrinted[i][c], "1",
          fmt::format("of {} models: {}; \"varies in a non-systematic manner\" [M18 3.8.4]",
                      kNaiveModels, fmt::join(fell, ", "))));
    }
  }
  return all;
}

/// A row of its own for what the printed numbers are an example of.
reproduce::Row at_least_of_printed(const std::string& what, double ours, double bound,
                                   double printed, const std::string& why) {
  reproduce::Row row = reproduce::at_least(what, ours, bound, "1", why);
  row.reference = printed;
  return row;
}

std::filesystem::path plot(const std::filesystem::path& dir, DrawerStudy& study) {
  // groups of a speed; of each method ours (of several models mean and range), and the printed
  // number as an empty frame around it
  std::vector<plot::Data> data;
  std::string curves;
  const std::size_t methods = kSources.size() + 1;
  for (std::size_t m = 0; m < methods; ++m) {
    const bool own = m == kSources.size();
    plot::Data d{"m" + std::to_string(m), {}};
    for (std::size_t c = 0; c < kSpeeds.size(); ++c) {
      const double x = static_cast<double>(c) + 0.2 * (static_cast<double>(m) - 1.5);
      std::vector<double> fell{0.0};
      if (own) {
        fell[0] = falls(speed_class(study.inference(kSources[1], Goals::kAll), c));
      } else {
        fell = naive_falls(study, kSources[m], c);
      }
      const Spread s = spread_of(fell);
      // 0 is seen as a line on the ground
      d.rows.push_back({x, std::max(0.06, s.mean), own ? 0.0 : static_cast<double>(kPrinted[m][c]),
                        s.least, s.most});
    }
    data.push_back(d);
    const std::string name = own ? "ours" : "ML " + kSources[m].text();
    curves += ", $" + d.name + " using 1:2:(0.16) with boxes fs solid 0.75 noborder lt " +
              std::to_string(own      ? 3
                             : m == 2 ? 5
                                      : m + 1) +
              " title '" + name + "'";
    if (!own) {
      curves += ", $" + d.name + " using 1:2:4:5 with yerrorbars lc rgb '#202020' pt 0 ps 0 " +
                (m == 0 ? "title 'models, least to most'" : "notitle");
    }
    curves += ", $" + d.name + " using 1:3:(0.18) with boxes lc rgb '#202020' lw 1.2 fs empty " +
              (m == 0 ? "title 'printed'" : "notitle");
  }
  const auto file = dir / "table-3.1.png";
  plot::plot_png(file, 860, 420, data,
                      "set xrange [-0.6:2.6]\nset yrange [0:11]\nset ylabel 'falls of 10'\n"
                      "set xtics ('slow' 0, 'middle speed' 1, 'fast' 2)\nset key outside right\n"
                      "plot -1 notitle" +
                          curves + "\n");
  return file;
}

}  // namespace

Report falls_table(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  Report report;
  const std::array<double, 3> naive = add_naive(study, report);
  report.rows.push_back(at_least_of_printed(
      "ML, all: falls of 90", naive[0] + naive[1] + naive[2], 9, 35,
      "\"often resulted in falling\" [M18 3.8.4]: a tenth of all at the least"));
  report.rows.push_back(
      at_least_of_printed("ML, fast: falls of 30", naive[2], 3, 19,
                          "\"a significant number of cases\" [M18 3.8.4]: a tenth at the least"));
  add_ours("ours, springs", study.inference(kSources[1], Goals::kAll), report);
  add_ours("ours, servos", study.inference(kSources[1], Goals::kAll, Plant::kServo), report);
  const std::string alone = "controls: the way of playing alone, with the WPG's own angles; ";
  report.rows.push_back(reproduce::near("WPG's angles played with feedback: falls of 8",
                                        falls(study.played_originals()), 0, 0, "1",
                                        alone + "what falls above falls by the learned angles"));
  if (plot_dir) report.plots.push_back(plot(*plot_dir, study));
  return report;
}

}  // namespace mimesis::walk
