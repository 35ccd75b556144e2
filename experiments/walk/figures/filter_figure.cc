// ZMP of a walk with swinging arms without the dynamic filter, with the filter of the legs, and of
// the whole body [M18 3.8.3, fig. 3.43]. The physics' contact forces judge: they know nothing of
// the inverse dynamics that the filter itself is made of.
#include <fmt/format.h>

#include <algorithm>

#include "common/plot/gnuplot.h"
#include "experiments/walk/figures.h"
#include "experiments/walk/study/drawer_study.h"
#include "experiments/walk/trial/suites.h"
#include "nodes/walker/testing/filtered_walk.h"

namespace mimesis::walk {

using namespace reproduce;

namespace {

constexpr double kFiltered_m_s = 0.3, kFiltered_s = 12.0;
constexpr double kSteady_s = 5.0;  // it stands for 1 s; arms and steps have got going
constexpr double kStands_s = 1.0;
constexpr double kArmsSize = 2.0;  // a swing of ±1 rad and a reach of 1.8 rad

struct Filter {
  const char *name, *colour;
  bool on;
  walker::FilterSettings settings;
};
const std::array<Filter, 3> kFilters{{{"unfiltered", "#2ca02c", false, {}},
                                      {"filter (legs only)", "#c020c0", true, {.legs_only = true}},
                                      {"filter (full body)", "#ff8c00", true, {}}}};

/// Measured ZMP as the plan's frame sees it, and the plan's.
struct MeasuredZmp {
  std::vector<double> time_s;
  std::vector<Eigen::Vector2d> planned_m, measured_m;
  bool fell = false;

  /// Root of the mean square of the difference in the steady walk.
  Eigen::Vector2d rms_m() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double count = 0.0;
    for (std::size_t i = 0; i < time_s.size(); ++i) {
      if (time_s[i] < kSteady_s) continue;
      sum += (measured_m[i] - planned_m[i]).cwiseAbs2();
      count += 1.0;
    }
    return (sum / count).cwiseSqrt();
  }
};

MeasuredZmp walk_filtered(const Robot& robot, const Filter& filter) {
  const walker::SwingingArms arms(robot.biped, kArmsSize);
  walker::UpperBody upper;
  TrialSpec spec;
  spec.robot = &robot;
  spec.walker.filter = filter.on;
  spec.walker.filter_settings = filter.settings;
  spec.duration_s = kFiltered_s;
  spec.wish = [&](double time_s) {
    walker::WalkerWish wish;
    wish.walk.walk = time_s >= kStands_s;
    if (wish.walk.walk) wish.walk.velocity_m_s.x() = kFiltered_m_s;
    arms.at(time_s, upper);
    wish.upper_body = upper.q;
    wish.upper_body_rate = upper.dq;
    return wish;
  };
  MeasuredZmp out;
  out.fell =
      run_trial(spec, [&](const TrialTick& tick) {
        const hw::sim::PlannedGround plan = planned_ground(tick.out.pattern);
        out.time_s.push_back(tick.time_s);
        out.planned_m.push_back(plan.zmp_W_m);
        out.measured_m.push_back(hw::sim::truth_to_plan(plan, tick.truth) * tick.truth.zmp_W_m);
      }).figures.fell;
  return out;
}

std::filesystem::path plot_zmp(const std::filesystem::path& dir,
                               const std::vector<MeasuredZmp>& walks) {
  // ripples of the contacts beyond what a pattern of 0.1 s plans
  constexpr double kLowPass_s = 0.02, kShare = walker::kTick_s / kLowPass_s;
  std::vector<plot::Data> data{{"planned", {}}};
  const MeasuredZmp& first = walks.front();
  for (std::size_t i = 0; i < first.time_s.size(); ++i) {
    data[0].rows.push_back({first.time_s[i], first.planned_m[i].x(), 0.0});
  }
  std::string along = "plot $planned using 1:2 with lines lw 3 lc rgb '#1f4fd0' title 'reference'",
              off = "plot $planned using 1:3 with lines lw 3 lc rgb '#1f4fd0'";
  for (std::size_t k = 0; k < walks.size(); ++k) {
    plot::Data d{"w" + std::to_string(k), {}};
    double shown = 0.0;
    for (std::size_t i = 0; i < walks[k].time_s.size(); ++i) {
      shown += kShare * (walks[k].measured_m[i].x() - walks[k].planned_m[i].x() - shown);
      d.rows.push_back({walks[k].time_s[i], walks[k].planned_m[i].x() + shown, 1e3 * shown});
    }
    const std::string style = fmt::format(" with lines lw 2 dt 4 lc rgb '{}'", kFilters[k].colour);
    along += ", $" + d.name + " using 1:2" + style + " title " + plot::quoted(kFilters[k].name);
    off += ", $" + d.name + " using 1:3" + style;
    data.push_back(std::move(d));
  }
  const auto file = dir / "fig-3.43.png";
  plot::plot_png(file, 1000, 900, data,
                 "set multiplot layout 2,1\nset xrange [6:10]\nset grid\n"
                 "set ylabel 'x of the ZMP [m]'\nset key top left\n" +
                     along +
                     "\nset xlabel 'time [s]'\nset ylabel 'difference from the reference [mm]'\n"
                     "unset key\n" +
                     off + "\nunset multiplot\n");
  return file;
}

}  // namespace

Report filtered_zmp(const PlotDir& plot_dir) {
  const Robot robot = load_robot("biped");
  const std::vector<MeasuredZmp> walks = in_parallel(
      kFilters.size(), [&](std::size_t k) { return walk_filtered(robot, kFilters[k]); });
  const Eigen::Vector2d none = walks[0].rms_m(), legs = walks[1].rms_m(), full = walks[2].rms_m();
  Report report;
  report.near("falls of 3", static_cast<double>(std::ranges::count_if(walks, &MeasuredZmp::fell)),
              goal(0), 0, "1", "the stabilizer works in all of them, alike");
  const char* curves =
      "curves without figures [M18 fig. 3.43]; half of the gain that was seen, against contact "
      "forces";
  const auto row = [&](const std::string& what, double ratio, double bound) {
    report.at_least("rms ZMP error " + what, ratio, bound, "1", curves);
  };
  row("in x, unfiltered / full body", none.x() / full.x(), 1.38);
  row("in x, unfiltered / legs only", none.x() / legs.x(), 1.26);
  row("in x, legs only / full body", legs.x() / full.x(), 1.07);
  row("in y, unfiltered / full body", none.y() / full.y(), 1.25);
  row("in y, legs only / full body", legs.y() / full.y(), 1.37);
  const char* other = "of other arms (1.5 rad), whose future the filter knew";
  report.beside("rms ZMP error in x, unfiltered", none.x(), prototype(0.026, "walking.md 8.4"), "m",
                other);
  report.beside("rms ZMP error in x, full body", full.x(), prototype(0.0077, "walking.md 8.4"), "m",
                other);
  if (plot_dir) report.plots.push_back(plot_zmp(*plot_dir, walks));
  return report;
}

}  // namespace mimesis::walk
