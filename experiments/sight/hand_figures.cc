#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/sight/figures.h"
#include "experiments/sight/hand_runs.h"

namespace mimesis::sight {
namespace {

using namespace reproduce;

// The tracker's constants were chosen on seeds below 100.
constexpr std::uint64_t kFirstSeed = 101;
constexpr int kSeeds = 10, kFrames = 120, kLong = 500, kHiddenSeeds = 20;
constexpr int kHideAt = 10, kHidden = 20, kRegain = 15, kSettled = 15;

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

/// Accuracy that is asked for and what the prototype had: both for a number of cameras.
struct Wanted {
  double across_mm, across95_mm, along_mm, turn_deg, turn95_deg;
};
struct Case {
  int cameras;
  Wanted goal, prototype;
};
const Case kMono{1, {7, 16, 30, 14, 30}, {7.4, 16, 31, 17, 40}};
const Case kStereo{2, {3, 7, 5, 9, 16}, {3.0, 6.6, 5.1, 9.0, 15.5}};

HandTrial trial(const Case& c, int k, int frames) {
  HandTrial t;
  t.world.seed = kFirstSeed + static_cast<std::uint64_t>(k);
  t.world.cameras = c.cameras;
  t.frames = frames;
  return t;
}

/// Quantiles of all seeds: the worst and the middle one.
struct OverSeeds {
  std::vector<double> values;
  double worst() const { return *std::ranges::max_element(values); }
  double middle() const { return quantile(values, 0.5); }
};

void add_accuracy(Report& report, const Case& c) {
  OverSeeds across, across95, along, turn, turn95, tips, drift;
  int converged = 0;
  for (int k = 0; k < kSeeds; ++k) {
    const HandCourse course = track_hand(trial(c, k, kFrames));
    const auto put = [](OverSeeds& to, double value) { to.values.push_back(value); };
    put(across, 1e3 * quantile(course.across_m, 0.5));
    put(across95, 1e3 * quantile(course.across_m, 0.95));
    put(along, 1e3 * quantile(course.along_m, 0.5));
    put(turn, degrees(quantile(course.turn_rad, 0.5)));
    put(turn95, degrees(quantile(course.turn_rad, 0.95)));
    put(tips, 1e3 * quantile(course.tips_m, 0.5));
    converged += course.right(kSettled) ? 1 : 0;
  }
  const auto row = [&report](const char* what, const OverSeeds& ours, double wanted,
                             const char* unit) {
    report.at_most(fmt::format("{}, worst of {} seeds", what, kSeeds), ours.worst(), goal(wanted),
                   unit,
                   "hands, cameras, light and motion are drawn from ranges that the "
                   "tracker does not know; it starts 40 mm and 30 deg off");
    report.beside(fmt::format("{}, middle seed", what), ours.middle(), goal(wanted), unit,
                  "what is usual");
  };
  row("palm across the line of sight, median", across, c.goal.across_mm, "mm");
  row("palm across the line of sight, 95 %", across95, c.goal.across95_mm, "mm");
  row("palm along it, median", along, c.goal.along_mm, "mm");
  row("rotation, median", turn, c.goal.turn_deg, "deg");
  row("rotation, 95 %", turn95, c.goal.turn95_deg, "deg");
  if (c.cameras == 2) row("finger tips, median", tips, 20.0, "mm");
  const auto earlier = [&](const char* what, const OverSeeds& ours, double value,
                           const char* unit) {
    report.beside(fmt::format("{}, worst seed, beside the prototype", what), ours.worst(),
                  prototype(value, "vision.md"), unit,
                  "its hand, room and start were easier: sleeve, start at the truth");
  };
  earlier("palm across, median", across, c.prototype.across_mm, "mm");
  earlier("palm across, 95 %", across95, c.prototype.across95_mm, "mm");
  earlier("palm along, median", along, c.prototype.along_mm, "mm");
  earlier("rotation, median", turn, c.prototype.turn_deg, "deg");
  earlier("rotation, 95 %", turn95, c.prototype.turn95_deg, "deg");
  report.at_least("right after 15 frames from a start 40 mm and 30 deg off", converged,
                  goal(kSeeds), "seeds", "within 25 mm and 35 deg of the truth");
}

void add_endurance(Report& report, const Case& c) {
  HandTrial t = trial(c, 0, kLong);
  const HandCourse course = track_hand(t);
  const auto& a = course.across_m;
  t.world.skin_patches = 15;
  const int among_skin = track_hand(t).lost();
  report.at_most(
      "error of the last 100 of 500 frames over that of the first 100",
      quantile({a.end() - 100, a.end()}, 0.5) / quantile({a.begin(), a.begin() + 100}, 0.5),
      goal(1.2), "1", "it does not drift; one seed");
  report.at_most("frames lost of 500", course.lost(), goal(0), "frames",
                 "40 mm or 60 deg off; one seed");
  report.at_most("frames lost of 500 before 15 skin-coloured patches", among_skin, goal(0),
                 "frames", "40 mm or 60 deg off; one seed");
}

void add_disturbances(Report& report, const Case& c) {
  int regained = 0, wrong_size = 0;
  double length = 0.0;
  for (int k = 0; k < kHiddenSeeds; ++k) {
    HandTrial t = trial(c, k, kHideAt + kHidden + kRegain + 1);
    t.world.hidden = {{kHideAt, kHideAt + kHidden}};
    regained += track_hand(t).right(t.frames - 1) ? 1 : 0;
  }
  for (int k = 0; k < kSeeds; ++k) {
    HandTrial t = trial(c, k, 40);
    t.length_error = k % 2 == 0 ? 0.08 : -0.08;
    const HandCourse course = track_hand(t);
    wrong_size += course.lost();
    length = std::max(length, std::abs(course.length_ratio - 1.0));
  }
  report.at_least("right 15 frames after 20 hidden ones, of 20 seeds", regained, goal(19), "seeds",
                  "within 25 mm and 35 deg of the truth");
  report.at_most("frames lost of 40 with a length wrong by 8 %, all seeds", wrong_size, goal(0),
                 "frames", "40 mm or 60 deg off");
  report.beside("error of the length after 40 frames, told 8 % wrong, worst seed", length,
                goal(0.08), "1",
                c.cameras == 1 ? "one camera cannot know it" : "two cameras refine it slowly");
}

void add_controls(Report& report, const Case& c) {
  HandTrial t = trial(c, 0, 60);
  const auto fails = [&](const char* what, const HandCourse& course) {
    const double across = 1e3 * quantile(course.across_m, 0.95),
                 turn = degrees(quantile(course.turn_rad, 0.95)),
                 along = 1e3 * quantile(course.along_m, 0.5);
    report.holds(
        fmt::format("control, {}: misses the goals", what),
        across > c.goal.across95_mm || turn > c.goal.turn95_deg || along > c.goal.along_mm, goal(),
        fmt::format("95 %: {:.0f} mm across and {:.0f} deg; {:.0f} mm along", across, turn, along));
  };
  fails("the pose stays as it began", freeze_hand(t));
  fails("centroid of skin colour alone", follow_blob(t));
  if (c.cameras == 1) fails("free histogram of each picture", track_by_free_histogram(t));
}

Report run(const Case& c) {
  Report report;
  add_accuracy(report, c);
  add_endurance(report, c);
  add_disturbances(report, c);
  add_controls(report, c);
  return report;
}

}  // namespace

std::vector<reproduce::Figure> figures() {
  return {
      vision::stereo_calibration_figure(),
      segmentation_figure(),
      setup_figure(),
      symbols_figure(),
      Figure(
          "hand-mono", "26 degrees of freedom of a hand by mutual information, one camera", "M18",
          Declared{.prototype = 5, .goal = 20}, [](const PlotDir&) { return run(kMono); }, 2.0),
      Figure(
          "hand-stereo", "26 degrees of freedom of a hand by mutual information, two cameras",
          "M18", Declared{.prototype = 5, .goal = 21}, [](const PlotDir&) { return run(kStereo); },
          4.0)};
}

}  // namespace mimesis::sight
