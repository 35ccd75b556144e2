#pragma once
#include <array>
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::walk {

/// Figures and tables of walking that need the physics: M18 3.8, the paths of 4.5.1, and three
/// walks of the suites. A build without DART lists them; running one throws an error that says how
/// to get DART.
std::vector<reproduce::Figure> figures();

struct Title {
  const char *name, *title;
  reproduce::Declared rows;
  double cpu_minutes;  ///< about, run alone; figures of one call share their walks
  const char* source;
};
constexpr Title title(const char* name, const char* title, reproduce::Declared rows,
                      double cpu_minutes = 0.0, const char* source = "M18") {
  return {name, title, rows, cpu_minutes, source};
}
inline constexpr std::array kTitles = {
    title("power-law", "ellipses walked by power laws of speed and curvature [sec. 4.5.1]",
          {.closed_form = 4, .goal = 8}, 1),
    title("fig-3.41", "accuracy of step sizes and reach of resynthesized robot walks",
          {.published = 9, .goal = 12}, 5),
    title("fig-3.43",
          "ZMP in walking direction: planned, and measured without filter, with that of the legs "
          "and of the full body",
          {.prototype = 2, .goal = 6}, 0),
    title("fig-3.44", "robot behaviours for the smallest and largest steps and reaches",
          {.published = 4, .goal = 1}, 3),
    title("fig-3.45", "the robot walks to a drawer that jumps", {.published = 2, .goal = 6}, 2),
    title("fig-3.46", "lateral spread of the ZMP: originals, resynthesis, novel goals", {.goal = 7},
          4),
    title("table-3.1", "falls: learned joint angles beside our method",
          {.published = 52, .goal = 32}, 20),
    title("fig-3.47", "peak ankle torques and ground forces: WPG, naive, ours",
          {.published = 19, .goal = 4}, 5),
    title("second-robot",
          "JVRC-1 walks, is pushed, steps on plates and opens drawers (needs the shared data)",
          {.goal = 24}, 5, "own"),
    title("second-engine",
          "the walker judged by MuJoCo beside DART: steps and pushes (needs npm's @mujoco/mujoco)",
          {.goal = 12}, 21, "own"),
    title("walk-arms", "the biped walks at 0.3 m/s and swings its arms",
          {.closed_form = 1, .goal = 2}),
    title("walk-drawer", "the biped walks to a drawer, opens it and takes an object out [sec. 3.8]",
          {.goal = 5}),
    title("walk-push", "the biped is pushed aside by 10 N s while it walks", {.goal = 2}),
};

using reproduce::PlotDir;

reproduce::Report power_law(const PlotDir& plot_dir);
// The experiments of the drawer study, on shared walks.
reproduce::Report accuracy(const PlotDir& plot_dir);
reproduce::Report filtered_zmp(const PlotDir& plot_dir);
reproduce::Report extremes(const PlotDir& plot_dir);
reproduce::Report jumps(const PlotDir& plot_dir);
reproduce::Report zmp_spread(const PlotDir& plot_dir);
reproduce::Report falls_table(const PlotDir& plot_dir);
reproduce::Report peaks(const PlotDir& plot_dir);
reproduce::Report second_robot(const PlotDir& plot_dir);
reproduce::Report second_engine(const PlotDir& plot_dir);
reproduce::Report walk_arms(const PlotDir& plot_dir);
reproduce::Report walk_drawer(const PlotDir& plot_dir);
reproduce::Report walk_push(const PlotDir& plot_dir);

}  // namespace mimesis::walk
